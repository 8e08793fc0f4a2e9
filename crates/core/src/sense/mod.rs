//! Sense: from the hardware counter to a position in the scale frame.

pub mod correct;
pub mod course;
pub mod ellipse;
pub mod harmonics;
pub mod head;
pub mod health;
pub mod limit;
pub mod moments;
pub mod peaks;
pub mod periods;
pub mod phase;
pub mod recursive;
mod solve;
pub mod subdivide;

use head::Head;
use health::SignalFault;
use periods::Periods;

use crate::edge::AxisInputs;
use crate::units::{Counts, Pos};
use crate::wide;

/// What sensing an axis needs to know.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Config {
    /// One count after decoding, picometres.
    pub count_pm: i32,
    /// Ticks that a switch must be pressed before it is believed.
    pub switch_press_ticks: u16,
    /// Ticks that a switch must be free before it is believed; longer than it bounces.
    pub switch_release_ticks: u16,
    /// An analogue reading head, if the axis has one.
    pub head: Option<head::Config>,
}

/// What one tick knows of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sensed {
    /// Position in the scale frame, from the zero that homing found.
    pub position: Pos,
    /// The counter extended to 64 bit, from power-on.
    pub raw: Counts,
    /// Counts since the last tick.
    pub moved: i32,
    /// Extended counter at the reference mark, when it was passed since the last tick.
    pub index: Option<Counts>,
    /// Why the analogue signals cannot be trusted.
    pub signal: Option<SignalFault>,
    /// Illegal transitions since the last tick.
    pub illegal: u16,
    /// Filtered pulses since the last tick.
    pub glitches: u16,
    /// Step pulses emitted so far, or what a DC motor was told in their place; wraps.
    pub pulses: i32,
    /// The low switch, debounced.
    pub limit_low: bool,
    /// The high switch, debounced.
    pub limit_high: bool,
    /// The power stage reports a fault.
    pub drive_fault: bool,
}

/// What sensing an axis remembers.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sense {
    /// What the last tick showed.
    pub now: Sensed,
    last: Option<u32>,
    origin: Counts,
    /// The same for an analogue head: where the zero lies on its grating.
    zero: Periods,
    low: Switch,
    high: Switch,
}

impl Sense {
    /// Reads one tick into [`Sense::now`]. The counter may move up to 2³¹ counts between two ticks.
    #[inline]
    pub fn read(&mut self, inputs: &AxisInputs, config: &Config) {
        self.extend(inputs.counter, config);
        self.now.index = None;
        if let Some(latched) = inputs.index {
            self.take_mark(latched, inputs.counter);
        }
        let now = &mut self.now;
        now.illegal = inputs.illegal;
        now.glitches = inputs.glitches;
        now.pulses = inputs.pulses;
        now.limit_low = self.low.read(inputs.limit_low, config);
        now.limit_high = self.high.read(inputs.limit_high, config);
        now.drive_fault = inputs.drive_fault;
    }

    /// Puts the zero of the scale frame at an extended count; returns how far it moved. The position becomes another
    /// by as much.
    pub fn set_origin(&mut self, origin: Counts, config: &Config, head: Option<&Head>) -> Pos {
        let moved = match (head, &config.head) {
            (Some(head), Some(of)) => {
                let zero = head.position_of(origin.get());
                let moved = Periods(zero.way_from(self.zero)).pm(of.period_pm);
                self.zero = zero;
                Pos::from_pm(moved)
            }
            _ => (origin - self.origin).to_pos(config.count_pm),
        };
        self.origin = origin;
        self.now.position = self.now.position - moved;
        moved
    }

    /// What an analogue head adds to the tick that was just read. Its position is not carried along: it is read anew in
    /// every tick, so that nothing adds up.
    #[inline(never)]
    pub fn read_head(&mut self, inputs: &AxisInputs, config: &head::Config, head: &mut Head) {
        if inputs.illegal != 0 {
            head.illegal();
        }
        let read = head.read(inputs.sin_cos, self.now.raw.get(), config);
        let now = &mut self.now;
        now.signal = read.fault;
        now.position = Pos::from_pm(Periods(read.position.way_from(self.zero)).pm(config.period_pm));
        if !config.counted {
            // Quarters of a period are the counts that no counter counts; what a counter may have added is taken back.
            let before = now.raw.get().wrapping_sub(i64::from(now.moved));
            let raw = Counts::new(read.position.0 >> 30);
            now.moved = raw.get().wrapping_sub(before) as i32;
            now.raw = raw;
            // The mark lies where the tick sees it.
            now.index = inputs.index.map(|_| raw);
        }
    }

    /// Carries the position along with the counter: a product of the few counts of a tick is a short one.
    fn extend(&mut self, counter: u32, config: &Config) {
        let last = self.last.replace(counter).unwrap_or(counter);
        let moved = counter.wrapping_sub(last).cast_signed();
        let now = &mut self.now;
        now.moved = moved;
        if moved != 0 {
            // 2³¹ counts in every tick would take five days to fill 64 bits; no stage goes 9.2 km.
            now.raw = Counts::new(now.raw.get().wrapping_add(i64::from(moved)));
            let way = wide::mul_i32(moved, config.count_pm);
            now.position = Pos::from_pm(now.position.pm().wrapping_add(way));
        }
    }

    /// A latched counter value lies less than 2³¹ counts from the counter itself.
    #[cold]
    fn take_mark(&mut self, latched: u32, counter: u32) {
        let behind = i64::from(latched.wrapping_sub(counter).cast_signed());
        self.now.index = Some(self.now.raw + Counts::new(behind));
    }
}

/// A switch that bounces: believed pressed soon, believed free late.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Switch {
    pressed: bool,
    /// Ticks in a row that disagreed with `pressed`.
    disagrees: u16,
}

impl Switch {
    fn read(&mut self, contact: bool, config: &Config) -> bool {
        if contact == self.pressed {
            self.disagrees = 0;
            return self.pressed;
        }
        self.disagrees = self.disagrees.saturating_add(1);
        let needed = if contact { config.switch_press_ticks } else { config.switch_release_ticks };
        if self.disagrees >= needed {
            self.pressed = contact;
            self.disagrees = 0;
        }
        self.pressed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::{Analogue, AxisSettings, Encoder, StageSettings};
    use crate::edge::SinCos;

    const CONFIG: Config =
        Config { count_pm: 100_000, switch_press_ticks: 3, switch_release_ticks: 50, head: None };

    fn at(counter: u32) -> AxisInputs {
        AxisInputs { counter, ..AxisInputs::default() }
    }

    fn read(sense: &mut Sense, inputs: &AxisInputs) -> Sensed {
        sense.read(inputs, &CONFIG);
        sense.now
    }

    #[test]
    fn positions_go_on_through_the_wrap_of_the_counter() {
        let mut sense = Sense::default();
        read(&mut sense, &at(u32::MAX - 1));
        assert_eq!(read(&mut sense, &at(3)).moved, 5);
        assert_eq!(read(&mut sense, &at(3)).position, Pos::from_pm(500_000));
        assert_eq!(read(&mut sense, &at(u32::MAX)).moved, -4);
    }

    #[test]
    fn an_index_latched_before_the_wrap_is_extended_rightly() {
        let mut sense = Sense::default();
        read(&mut sense, &at(u32::MAX - 10));
        let inputs = AxisInputs { counter: 5, index: Some(u32::MAX), ..AxisInputs::default() };
        assert_eq!(read(&mut sense, &inputs).index, Some(Counts::new(10)));
    }

    #[test]
    fn another_zero_moves_the_position_and_nothing_else() {
        let mut sense = Sense::default();
        read(&mut sense, &at(0));
        read(&mut sense, &at(70));
        assert_eq!(sense.set_origin(Counts::new(30), &CONFIG, None), Pos::from_um(3.0));
        assert_eq!(read(&mut sense, &at(71)).position, Pos::from_um(4.1));
        assert_eq!(sense.now.raw, Counts::new(71));
    }

    /// A counter that counts something else, or nothing, must not show.
    #[test]
    fn without_a_counter_quarters_of_the_period_are_the_counts() {
        let encoder = Encoder::Analogue(Analogue { counted: false, ..Analogue::default() });
        let axis = AxisSettings { count_um: 0.2, encoder, ..AxisSettings::default() };
        let stage = StageSettings { axes: [axis], ..StageSettings::<1>::default() }.build().unwrap();
        let config = stage.axes[0].sense;
        let (mut sense, mut head) = (Sense::default(), Head::new(&config.head.unwrap()));
        let (mut travelled, mut began) = (0, None);
        for tick in 0..400_u32 {
            let angle = f64::from(tick) * 0.3;
            let [sin, cos] = [angle.sin(), angle.cos()].map(|part| (24_000.0 * part) as i16);
            let counter = tick.wrapping_mul(77);
            let inputs = AxisInputs { counter, sin_cos: Some(SinCos { sin, cos }), ..AxisInputs::default() };
            sense.read(&inputs, &config);
            sense.read_head(&inputs, &config.head.unwrap(), &mut head);
            travelled += i64::from(sense.now.moved);
            let first = *began.get_or_insert(sense.now.raw.get() - travelled);
            assert_eq!(first + travelled, sense.now.raw.get());
            let quarters = (angle / core::f64::consts::FRAC_PI_2) as i64;
            assert!((sense.now.raw.get() - quarters).abs() <= 1, "tick {tick}: {:?}", sense.now);
        }
    }

    #[test]
    fn a_bouncing_switch_is_pressed_once() {
        let mut switch = Switch::default();
        let mut changes = 0;
        let mut before = false;
        let contact = |t: u32| t >= 100 && (t > 120 || t % 4 != 3);
        for t in 0..300 {
            let now = switch.read(contact(t), &CONFIG);
            changes += u32::from(now != before);
            before = now;
        }
        assert_eq!((changes, before), (1, true));
    }
}
