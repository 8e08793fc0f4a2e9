//! What can happen, how it must be told, and by when.

use abbe_core::sense::health::{Findings, SignalFault};

/// A range from which each seed draws.
pub(crate) type Range = [f64; 2];

/// What happens. Ranges without a unit are parts or factors.
#[derive(Clone, Copy)]
pub(crate) enum What {
    Nothing,
    /// The plug of the encoder; the level of both channels then, part of the full scale.
    Pulled(Range),
    /// What is left of the light, at once.
    Light(Range),
    /// The light goes from all to nothing within so many seconds.
    Fades(Range),
    /// A spot on the way: what it takes in its middle; width in mm; speed at which it passes in mm/s.
    Dirt {
        depth: Range,
        width_mm: Range,
        mm_s: Range,
    },
    /// Gain of the amplifiers.
    Amplify(Range),
    /// Noise of converter and comparators.
    Noise(Range),
    /// Noise at the comparators, part of the amplitude.
    Chatter(Range),
    /// Either channel stays at its last code, wherever the grating is.
    Sticks,
    /// Both channels stay at their last codes; the comparators go on.
    Freezes,
    /// Samples that do not come.
    Missing(Range),
    /// Counts that are lost or won between two samples.
    Counts(Range),
    /// No counter; so many samples in a row the way is longer or shorter by up to so many periods.
    Jumps {
        samples: u32,
        periods: Range,
    },
}

/// How it must be told: by any of these.
#[derive(Clone, Copy)]
pub(crate) struct Told {
    pub(crate) faults: &'static [SignalFault],
    pub(crate) findings: Findings,
}

impl Told {
    /// Nothing is to be told.
    pub(crate) fn is_nothing(&self) -> bool {
        self.faults.is_empty() && self.findings == Findings::NONE
    }

    pub(crate) fn words(&self) -> &'static str {
        match (self.faults.is_empty(), self.findings == Findings::NONE) {
            (true, true) => "nothing",
            (true, false) => "grade",
            (false, true) => "fault",
            (false, false) => "either",
        }
    }
}

/// From when the time counts.
#[derive(Clone, Copy)]
pub(crate) enum Danger {
    /// From the moment it happens.
    AtOnce,
    /// From where less than half of the light may be left: the inner half of a spot, half of a fading lamp.
    HalfTheLight,
    /// From where the position is off by more than 0.05 µm, a sixteenth of a period.
    Off,
}

impl Danger {
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::AtOnce => "it happens",
            Self::HalfTheLight => "half of the light",
            Self::Off => "50 nm off",
        }
    }
}

/// A row of the table.
#[derive(Clone, Copy)]
pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) what: What,
    pub(crate) told: Told,
    pub(crate) danger: Danger,
    /// From the danger on it must be told within so many ms, with the position off by so many µm at most.
    pub(crate) within_ms: f64,
    pub(crate) within_um: f64,
    /// Comparators and a counter count the same signals.
    pub(crate) counted: bool,
}

use SignalFault::{Disagrees, Fast, Lost, Missed, OffCircle, Slipped};

const NEVER: Told = either(&[], Findings::NONE);
const LOST: Told = fault(&[Lost]);
/// A phase that is half a lie comes out in many ways.
const DISTURBED: &[SignalFault] = &[Disagrees, Lost, OffCircle, Slipped];

const fn fault(faults: &'static [SignalFault]) -> Told {
    either(faults, Findings::NONE)
}

const fn finding(findings: Findings) -> Told {
    either(&[], findings)
}

const fn either(faults: &'static [SignalFault], findings: Findings) -> Told {
    Told { faults, findings }
}

const fn case(
    name: &'static str,
    what: What,
    told: Told,
    danger: Danger,
    [within_ms, within_um]: [f64; 2],
) -> Case {
    Case { name, what, told, danger, within_ms, within_um, counted: true }
}

/// The same head without a counter.
const fn uncounted(case: Case) -> Case {
    Case { counted: false, ..case }
}

const fn counts(number: f64) -> What {
    What::Counts([number, number])
}

/// A block is 256 samples; what is graded is told at the end of the block after the one in which it begins.
const BLOCKS_MS: f64 = 51.2;
/// A sample that does not come is bridged at the same speed: what the acceleration changes meanwhile.
const BRIDGED_UM: f64 = 0.13;
const DEEP: What = What::Dirt { depth: [0.8, 1.0], width_mm: [0.03, 1.0], mm_s: [0.05, 5.0] };
const MILD: What = What::Dirt { depth: [0.5, 0.6], width_mm: [0.03, 1.0], mm_s: [0.05, 5.0] };
const FADES: What = What::Fades([0.3, 3.0]);
const JUMPS: What = What::Jumps { samples: 40, periods: [0.4, 10.0] };
/// Without a counter a phase that is half a lie looks like a jump, too.
const UNCOUNTED: &[SignalFault] = &[Fast, Lost, OffCircle];
const WEAK: Told = finding(Findings::WEAK);
/// The eighth is the last that may be missing, or the first that may not.
const MISSES: Told = either(&[Missed], Findings::MISSED);
const COUNT: Told = fault(&[Disagrees, Slipped]);
const CLIPPED: Told = either(&[OffCircle], Findings::CLIPPED);
const NOISY: Told = either(DISTURBED, Findings::NOISY);
const CHATTER: Told = either(&[Disagrees, Slipped], Findings::DISAGREES.and(Findings::ILLEGAL));
const BESIDE: Told = either(&[Disagrees], Findings::DISAGREES);

use Danger::{AtOnce, HalfTheLight, Off};
use What::{Amplify, Chatter, Counts, Freezes, Light, Missing, Noise, Nothing, Pulled, Sticks};

pub(crate) const CASES: [Case; 29] = [
    case("nothing", Nothing, NEVER, AtOnce, [0.0, BRIDGED_UM]),
    case("plug pulled, level near zero", Pulled([0.0, 0.04]), LOST, AtOnce, [0.5, 1.5]),
    case("light gone to 0 … 25 %", Light([0.0, 0.25]), LOST, AtOnce, [0.5, 1.5]),
    case("light at 50 … 62 %", Light([0.5, 0.62]), WEAK, AtOnce, [BLOCKS_MS, BRIDGED_UM]),
    case("light fades in 0.3 … 3 s", FADES, WEAK, HalfTheLight, [0.0, BRIDGED_UM]),
    case("light fades in 0.3 … 3 s", FADES, fault(DISTURBED), HalfTheLight, [450.0, 0.3]),
    case(
        "dirt of 80 … 100 %, 0.03 … 1 mm, at 0.05 … 5 mm/s",
        DEEP,
        fault(DISTURBED),
        HalfTheLight,
        [300.0, 0.9],
    ),
    case("dirt of 50 … 60 %, 0.03 … 1 mm, at 0.05 … 5 mm/s", MILD, WEAK, HalfTheLight, [300.0, BRIDGED_UM]),
    case("gain 1.4 … 2 times too high", Amplify([1.4, 2.0]), CLIPPED, AtOnce, [BLOCKS_MS, BRIDGED_UM]),
    case("noise 12 … 40 times higher", Noise([12.0, 40.0]), NOISY, AtOnce, [BLOCKS_MS, BRIDGED_UM]),
    case("comparators chatter, noise of 20 … 50 %", Chatter([0.2, 0.5]), CHATTER, AtOnce, [700.0, 2.0]),
    case("a channel sticks", Sticks, fault(DISTURBED), Off, [BLOCKS_MS, 0.5]),
    case("both channels freeze", Freezes, fault(DISTURBED), Off, [BLOCKS_MS, 0.6]),
    case("1 … 7 samples missing", Missing([1.0, 7.0]), finding(Findings::MISSED), AtOnce, [26.0, BRIDGED_UM]),
    case("8 samples missing", Missing([8.0, 8.0]), MISSES, AtOnce, [26.0, 0.25]),
    case("9 … 1000 samples missing", Missing([9.0, 1000.0]), fault(&[Missed]), AtOnce, [0.9, 0.25]),
    case("1 count lost or won", counts(1.0), BESIDE, AtOnce, [20.0, BRIDGED_UM]),
    case("2 counts", counts(2.0), COUNT, AtOnce, [0.2, 0.85]),
    case("3 counts", counts(3.0), COUNT, AtOnce, [0.3, 0.85]),
    case("4 counts", counts(4.0), COUNT, AtOnce, [0.3, 0.85]),
    case("5 counts", counts(5.0), COUNT, AtOnce, [0.3, 0.85]),
    case("6 counts", counts(6.0), COUNT, AtOnce, [0.2, 1.65]),
    case("8 counts", counts(8.0), COUNT, AtOnce, [0.3, 1.65]),
    case("9 … 10 000 counts", Counts([9.0, 10_000.0]), COUNT, AtOnce, [0.3, 2001.0]),
    uncounted(case("plug pulled, no counter", Pulled([0.0, 0.04]), LOST, AtOnce, [0.5, 1.5])),
    uncounted(case("light gone to 0 … 25 %, no counter", Light([0.0, 0.25]), LOST, AtOnce, [0.5, 1.5])),
    uncounted(case("dirt of 80 … 100 %, no counter", DEEP, fault(UNCOUNTED), HalfTheLight, [300.0, 0.9])),
    uncounted(case(
        "9 … 1000 samples missing, no counter",
        Missing([9.0, 1000.0]),
        fault(&[Missed]),
        AtOnce,
        [0.9, 0.25],
    )),
    uncounted(case("40 jumps of 0.4 … 10 periods, no counter", JUMPS, fault(&[Fast]), AtOnce, [4.0, 50.0])),
];
