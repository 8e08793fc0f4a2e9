//! What is measured of sensing, the same source for this machine and for the image of `firmware/golden` that an
//! emulator counts the cycles of.

use super::signals::{ELLIPSE, Reading, harmonics};
use abbe_core::sense::correct::Correction;
use abbe_core::sense::head::{Config, Head};
use abbe_core::sense::phase::Polar;
use abbe_core::sense::subdivide::Subdivider;
use core::hint::black_box;

/// The functions that are metered, each by its symbol: what one of them takes is what a sample costs.
pub(crate) mod measured {
    use abbe_core::edge::SinCos;
    use abbe_core::sense::correct::Correction;
    use abbe_core::sense::head::{Config, Head, Read, Refined, Refining};
    use abbe_core::sense::phase::{Polar, polar};
    use abbe_core::sense::subdivide::Subdivider;

    #[inline(never)]
    pub(crate) fn nothing(sin: i32, cos: i32) -> i32 {
        sin ^ cos
    }

    #[inline(never)]
    pub(crate) fn head_read(head: &mut Head, sample: Option<SinCos>, count: i64, config: &Config) -> Read {
        head.read(sample, count, config)
    }

    #[inline(never)]
    pub(crate) fn head_refining(head: &Head) -> Option<Refining> {
        head.refining()
    }

    #[inline(never)]
    pub(crate) fn fit(refining: &Refining) -> Refined {
        refining.fit()
    }

    #[inline(never)]
    pub(crate) fn head_take_refined(head: &mut Head, refined: Refined) {
        head.take_refined(refined);
    }

    #[inline(never)]
    pub(crate) fn straighten(correction: &Correction, sample: SinCos) -> [i32; 2] {
        correction.straighten(sample)
    }

    #[inline(never)]
    pub(crate) fn phase(sin: i32, cos: i32) -> Polar {
        polar(sin, cos)
    }

    #[inline(never)]
    pub(crate) fn subdivide(table: &Subdivider, sin: i32, cos: i32) -> u16 {
        table.step(sin, cos)
    }

    /// Its arguments are made floats here: a converter gives whole numbers.
    #[inline(never)]
    pub(crate) fn atan2f(sin: i32, cos: i32) -> f32 {
        libm::atan2f(sin as f32, cos as f32)
    }

    #[inline(never)]
    pub(crate) fn idsp_atan2(sin: i32, cos: i32) -> i32 {
        idsp::atan2(sin, cos)
    }
}

/// A row of the tables.
pub(crate) struct Row {
    pub(crate) name: &'static str,
    /// Cycles of a Cortex-M0+ that its worst sample may take.
    pub(crate) budget: Option<u32>,
    pub(crate) work: Work,
}

/// What a row does with each sample.
#[derive(Clone, Copy)]
pub(crate) enum Work {
    /// What measuring takes.
    Nothing,
    Head {
        counted: bool,
        factor: u16,
        /// Paper B's two limit filters are on.
        filtered: bool,
    },
    /// Nothing by itself: see [`refine`].
    Refine,
    Straighten,
    Polar,
    Subdivide(u16),
    Atan2f,
    IdspAtan2,
}

/// What sensing one axis in a tick may take: docs/adr/0013-sensing.md.
const BUDGET: Option<u32> = Some(1000);

const fn row(name: &'static str, budget: Option<u32>, work: Work) -> Row {
    Row { name, budget, work }
}

const fn head(counted: bool, factor: u16, filtered: bool) -> Work {
    Work::Head { counted, factor, filtered }
}

/// Which of [`ROWS`] hands a block over, or what came of it, between ticks; and which fits it, beside them.
const HAND_OVER: usize = 4;
const FIT: usize = 5;

/// Takes an ellipse anew. Before each piece of the work `row` is told whose row it is.
pub(crate) fn refine(head: &mut Head, mut row: impl FnMut(usize)) {
    row(HAND_OVER);
    if let Some(refining) = measured::head_refining(head) {
        row(FIT);
        let refined = measured::fit(&refining);
        row(HAND_OVER);
        measured::head_take_refined(head, refined);
    }
}

/// In the order in which the image does them.
pub(crate) const ROWS: [Row; 13] = [
    row("head with a counter, as fine as it is", BUDGET, head(true, 0, false)),
    row("head with a counter, 160 steps", BUDGET, head(true, 160, false)),
    row("head with a counter, 160 steps, paper B's filters", None, head(true, 160, true)),
    row("head without a counter, 160 steps", BUDGET, head(false, 160, false)),
    row("a block handed over, or its fit", None, Work::Refine),
    row("fit of a block, beside the ticks", None, Work::Refine),
    row("correction alone", None, Work::Straighten),
    row("phase and radius alone", None, Work::Polar),
    row("table, 160 steps", None, Work::Subdivide(160)),
    row("table, 4096 steps", None, Work::Subdivide(4096)),
    row("libm::atan2f", None, Work::Atan2f),
    row("idsp::atan2", None, Work::IdspAtan2),
    row("nothing", None, Work::Nothing),
];

/// A row ready to run: what is made before the first tick is made.
pub(crate) struct Bench {
    work: Work,
    config: Config,
    head: Head,
    correction: Correction,
    table: Option<Subdivider>,
}

impl Bench {
    pub(crate) fn new(row: &Row) -> Self {
        let (counted, factor, filtered) = match row.work {
            Work::Head { counted, factor, filtered } => (counted, factor, filtered),
            _ => (true, 0, false),
        };
        let config = Config {
            period_pm: 800_000,
            ellipse: ELLIPSE,
            harmonics: harmonics(),
            rail: 32_700,
            counted,
            factor,
            sample_limit: if filtered { 40_000 } else { 0 },
            count_limit: filtered,
            tracks: true,
        };
        let table = match row.work {
            Work::Subdivide(factor) => Subdivider::new(factor).ok(),
            _ => None,
        };
        Self { work: row.work, head: Head::new(&config), config, correction: Correction::of(&ELLIPSE), table }
    }

    /// Does the row's work with every sample; a hash of all results. Between ticks `refine` is called with the head
    /// that wants it.
    pub(crate) fn run(&mut self, readings: &[Reading], mut refine: impl FnMut(&mut Head)) -> u32 {
        let mut hash = 0_u32;
        for reading in readings {
            let result = self.once(reading);
            hash = (hash ^ result).wrapping_mul(0x0100_0193).rotate_left(5);
            if self.head.wants_refining() {
                refine(&mut self.head);
                hash ^= low_and_high(self.head.ellipse().p.to_bits());
            }
        }
        hash
    }

    #[inline]
    fn once(&mut self, reading: &Reading) -> u32 {
        let Reading { sample, came, count } = *reading;
        let (sin, cos) = (i32::from(sample.sin), i32::from(sample.cos));
        match self.work {
            Work::Nothing => measured::nothing(sin, cos) as u32,
            Work::Refine => 0,
            Work::Head { .. } => {
                let config = black_box(&self.config);
                let read =
                    measured::head_read(&mut self.head, came.then_some(sample), i64::from(count), config);
                low_and_high(read.position.0 as u64) ^ u32::from(read.fault.is_some())
            }
            Work::Straighten => {
                let [cos, sin] = measured::straighten(black_box(&self.correction), sample);
                cos.rotate_left(16) as u32 ^ sin as u32
            }
            Work::Polar => {
                let Polar { phase, radius } = measured::phase(sin << 8, cos << 8);
                phase.0 ^ radius
            }
            Work::Subdivide(_) => {
                let step = |table| measured::subdivide(black_box(table), sin << 8, cos << 8);
                self.table.as_ref().map_or(0, step).into()
            }
            Work::Atan2f => measured::atan2f(sin << 8, cos << 8).to_bits(),
            Work::IdspAtan2 => measured::idsp_atan2(sin << 8, cos << 8) as u32,
        }
    }
}

fn low_and_high(word: u64) -> u32 {
    word as u32 ^ (word >> 32) as u32
}
