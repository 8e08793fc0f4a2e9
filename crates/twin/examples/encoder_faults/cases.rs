//! What can happen, how it must be told, and by when.

use abbe_core::sense::health::{Findings, SignalFault};

/// A range from which each seed draws.
pub(crate) type Range = [f64; 2];

/// What happens. Ranges without a unit are parts or factors.
#[derive(Clone, Copy)]
pub(crate) enum What {
    Nothing,
    /// The plug of the encoder.
    Pulled,
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
pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) what: What,
    pub(crate) told: Told,
    pub(crate) danger: Danger,
    /// From the danger on it must be told within so many ms, with the position off by so many µm at most.
    pub(crate) within_ms: f64,
    pub(crate) within_um: f64,
}

/// What sensing does not notice yet. Measured like the rest and not judged.
pub(crate) const NOT_NOTICED_YET: [&str; 3] = ["4 counts", "8 counts", "9 … 1000 counts"];

use SignalFault::{Disagrees, Fast, Lost, Missed, OffCircle};

const NEVER: Told = Told { faults: &[], findings: Findings::NONE };
const LOST: Told = fault(&[Lost]);
const DISTURBED: &[SignalFault] = &[Disagrees, Lost, OffCircle];

const fn fault(faults: &'static [SignalFault]) -> Told {
    Told { faults, findings: Findings::NONE }
}

const fn finding(findings: Findings) -> Told {
    Told { faults: &[], findings }
}

const fn case(
    name: &'static str,
    what: What,
    told: Told,
    danger: Danger,
    [within_ms, within_um]: [f64; 2],
) -> Case {
    Case { name, what, told, danger, within_ms, within_um }
}

/// A count, and as many counts as it says.
const fn counts(number: f64) -> What {
    What::Counts([number, number])
}

/// A block is 256 samples; what is graded is told at the end of the block after the one in which it begins.
const BLOCKS_MS: f64 = 51.2;

pub(crate) const CASES: [Case; 23] = [
    case("nothing", What::Nothing, NEVER, Danger::AtOnce, [0.0, 0.05]),
    case("plug pulled", What::Pulled, LOST, Danger::AtOnce, [0.5, 2.0]),
    case("light gone to 0 … 25 %", What::Light([0.0, 0.25]), LOST, Danger::AtOnce, [0.5, 2.0]),
    case(
        "light at 50 … 62 %",
        What::Light([0.5, 0.62]),
        finding(Findings::WEAK),
        Danger::AtOnce,
        [BLOCKS_MS, 0.05],
    ),
    case(
        "light fades in 0.3 … 3 s: graded",
        What::Fades([0.3, 3.0]),
        finding(Findings::WEAK),
        Danger::HalfTheLight,
        [BLOCKS_MS, 0.05],
    ),
    case(
        "light fades in 0.3 … 3 s: stopped",
        What::Fades([0.3, 3.0]),
        LOST,
        Danger::HalfTheLight,
        [1000.0, 0.2],
    ),
    case(
        "dirt that takes 80 … 100 %, 0.03 … 1 mm wide, at 0.05 … 5 mm/s",
        What::Dirt { depth: [0.8, 1.0], width_mm: [0.03, 1.0], mm_s: [0.05, 5.0] },
        fault(DISTURBED),
        Danger::HalfTheLight,
        [1000.0, 1.0],
    ),
    case(
        "dirt that takes 50 … 60 %, 0.03 … 1 mm wide, at 0.05 … 5 mm/s",
        What::Dirt { depth: [0.5, 0.6], width_mm: [0.03, 1.0], mm_s: [0.05, 5.0] },
        finding(Findings::WEAK),
        Danger::HalfTheLight,
        [1000.0, 0.1],
    ),
    case(
        "gain 1.4 … 2 times too high",
        What::Amplify([1.4, 2.0]),
        Told { faults: &[OffCircle], findings: Findings::CLIPPED },
        Danger::AtOnce,
        [BLOCKS_MS, 0.1],
    ),
    case(
        "noise 12 … 40 times higher",
        What::Noise([12.0, 40.0]),
        Told { faults: DISTURBED, findings: Findings::NOISY },
        Danger::AtOnce,
        [BLOCKS_MS, 0.5],
    ),
    case(
        "comparators chatter, noise of 20 … 50 %",
        What::Chatter([0.2, 0.5]),
        Told { faults: &[Disagrees], findings: Findings::DISAGREES.and(Findings::ILLEGAL) },
        Danger::AtOnce,
        [1000.0, 1.0],
    ),
    case("a channel sticks", What::Sticks, fault(DISTURBED), Danger::Off, [100.0, 0.8]),
    case(
        "1 … 7 samples missing",
        What::Missing([1.0, 7.0]),
        finding(Findings::MISSED),
        Danger::AtOnce,
        [26.0, 0.3],
    ),
    case(
        "9 … 1000 samples missing",
        What::Missing([9.0, 1000.0]),
        fault(&[Missed]),
        Danger::AtOnce,
        [0.9, 0.3],
    ),
    case(
        "1 count lost or won",
        counts(1.0),
        Told { faults: &[Disagrees], findings: Findings::DISAGREES },
        Danger::AtOnce,
        [BLOCKS_MS, 0.05],
    ),
    case("2 counts", counts(2.0), fault(&[Disagrees]), Danger::AtOnce, [1.0, 1.0]),
    case("3 counts", counts(3.0), fault(&[Disagrees]), Danger::AtOnce, [1.0, 1.0]),
    case("4 counts", counts(4.0), fault(&[Disagrees]), Danger::AtOnce, [1.0, 1.0]),
    case("5 counts", counts(5.0), fault(&[Disagrees]), Danger::AtOnce, [1.0, 2.0]),
    case("6 counts", counts(6.0), fault(&[Disagrees]), Danger::AtOnce, [1.0, 2.0]),
    case("8 counts", counts(8.0), fault(&[Disagrees]), Danger::AtOnce, [1.0, 2.0]),
    case("9 … 1000 counts", What::Counts([9.0, 1000.0]), fault(&[Disagrees]), Danger::AtOnce, [1.0, 250.0]),
    case(
        "too fast to follow: 40 jumps of 0.4 … 10 periods",
        What::Jumps { samples: 40, periods: [0.4, 10.0] },
        fault(&[Fast]),
        Danger::AtOnce,
        [4.0, 250.0],
    ),
];
