//! Paper B's way to find what is to be taken off the signals (row B7): the extremes of each channel, as it moves.
//!
//! A flag says whether the signal rises; where it turns round, the last sample was a maximum or a minimum. The mean of
//! both is the offset: with an 8-bit converter of 0 … 255, Δ = │255 − Pmax − Pmin│ / 2. Noise makes false turns, so a turn
//! counts only beyond a hysteresis, which the paper has not.

/// The extremes of one channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Peaks {
    hysteresis: u16,
    rising: bool,
    /// The farthest sample since the last turn.
    farthest: Option<i16>,
    highest: Option<i16>,
    lowest: Option<i16>,
}

impl Peaks {
    /// A tracker that takes a turn for one when the signal has come back by more than `hysteresis` codes.
    pub const fn new(hysteresis: u16) -> Self {
        Self { hysteresis, rising: true, farthest: None, highest: None, lowest: None }
    }

    /// One sample.
    #[inline]
    pub fn sample(&mut self, y: i16) {
        let farthest = self.farthest.unwrap_or(y);
        let on = if self.rising { y >= farthest } else { y <= farthest };
        if on {
            self.farthest = Some(y);
        } else if y.abs_diff(farthest) > self.hysteresis {
            let extreme = if self.rising { &mut self.highest } else { &mut self.lowest };
            *extreme = Some(farthest);
            self.rising = !self.rising;
            self.farthest = Some(y);
        }
    }

    /// The last maximum and the last minimum, once both were seen.
    pub fn extremes(&self) -> Option<(i16, i16)> {
        self.highest.zip(self.lowest)
    }

    /// What is to be taken off the channel: half of their sum.
    pub fn offset(&self) -> Option<i16> {
        let (highest, lowest) = self.extremes()?;
        Some((i32::from(highest).wrapping_add(i32::from(lowest)) / 2) as i16)
    }

    /// Half of their distance.
    pub fn amplitude(&self) -> Option<u16> {
        let (highest, lowest) = self.extremes()?;
        Some(highest.abs_diff(lowest) / 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(offset: f64, amplitude: f64, noise: f64) -> impl Iterator<Item = i16> {
        let mut state = 1_u32;
        (0..2000).map(move |t| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let random = f64::from(state) / 4_294_967_296.0 - 0.5;
            (offset + amplitude * (f64::from(t) * 0.05).sin() + noise * random).round() as i16
        })
    }

    /// The paper's own numbers: an 8-bit converter.
    #[test]
    fn the_offset_of_an_8_bit_signal_is_found_as_in_the_paper() {
        let mut peaks = Peaks::new(0);
        wave(140.0, 100.0, 0.0).for_each(|y| peaks.sample(y));
        assert_eq!(peaks.extremes(), Some((240, 40)));
        let (highest, lowest) = peaks.extremes().unwrap();
        assert_eq!((255 - highest - lowest).abs() / 2, 12);
        assert_eq!((peaks.offset(), peaks.amplitude()), (Some(140), Some(100)));
    }

    #[test]
    fn noise_makes_no_false_turns_within_the_hysteresis() {
        let mut peaks = Peaks::new(300);
        wave(-500.0, 20_000.0, 200.0).for_each(|y| peaks.sample(y));
        assert!(
            (peaks.offset().unwrap() + 500).abs() < 120 && peaks.amplitude().unwrap().abs_diff(20_000) < 120
        );
        let mut paper = Peaks::new(0);
        wave(-500.0, 20_000.0, 200.0).for_each(|y| paper.sample(y));
        assert!(
            (paper.offset().unwrap() + 500).abs() > 1000,
            "without hysteresis noise is taken for extremes"
        );
    }

    #[test]
    fn a_standing_signal_has_no_extremes() {
        let mut peaks = Peaks::new(10);
        (0..1000).for_each(|t| peaks.sample(100 + (t % 3) as i16));
        assert_eq!(peaks.offset(), None);
    }
}
