//! Grades and faults of made-up samples.

use super::*;
use crate::sense::ellipse::Ellipse;

const NOMINAL: u32 = 24_000 << CODE_BITS;
const GOOD: Sample = Sample { radius: NOMINAL, clipped: false, beside: 0, counted: true, slipped: false };

fn after(samples: impl Iterator<Item = Sample>) -> (Report, Option<(usize, SignalFault)>) {
    let mut health = Health::new(NOMINAL);
    let mut first = None;
    for (k, sample) in samples.enumerate() {
        let fault = health.sample(&sample);
        first = first.or(fault.map(|fault| (k, fault)));
    }
    (health.report().unwrap_or_default(), first)
}

fn grade(sample: impl Fn(u32) -> Sample) -> (Grade, Findings) {
    let (report, fault) = after((0..512).map(sample));
    assert_eq!(fault, None);
    (report.grade(), report.warn.and(report.fail))
}

#[test]
fn each_finding_has_its_grades() {
    let radius = |part: f64| move |_| Sample { radius: (f64::from(NOMINAL) * part) as u32, ..GOOD };
    assert_eq!(grade(radius(1.0)), (Grade::Good, Findings::NONE));
    assert_eq!(grade(radius(0.65)), (Grade::Warn, Findings::WEAK));
    assert_eq!(grade(radius(0.4)), (Grade::Fail, Findings::WEAK));
    assert_eq!(grade(radius(1.25)), (Grade::Warn, Findings::STRONG));
    assert_eq!(grade(radius(1.6)), (Grade::Fail, Findings::STRONG));
    let clipped = |every| move |k: u32| Sample { clipped: k.is_multiple_of(every), ..GOOD };
    assert_eq!(grade(clipped(100)), (Grade::Warn, Findings::CLIPPED));
    assert_eq!(grade(clipped(50)), (Grade::Fail, Findings::CLIPPED));
    let noisy = |part: f64| {
        move |k: u32| Sample { radius: (f64::from(NOMINAL) * (1.0 + part * f64::from(k % 2))) as u32, ..GOOD }
    };
    assert_eq!(grade(noisy(0.01)).0, Grade::Good);
    assert_eq!(grade(noisy(0.04)), (Grade::Warn, Findings::NOISY));
    assert_eq!(grade(noisy(0.1)), (Grade::Fail, Findings::NOISY));
    assert_eq!(grade(|_| Sample { beside: -(4 << 28), ..GOOD }), (Grade::Warn, Findings::DISAGREES));
    assert_eq!(grade(|_| Sample { beside: 5 << 28, counted: false, ..GOOD }), (Grade::Warn, Findings::FAST));
}

/// The tick compares whole numbers; they are the bounds that files are graded by.
#[test]
fn the_tick_grades_by_the_table_of_bounds() {
    let of = |bounds: Bounds, grade: &dyn Fn(f64) -> Grade| {
        let at = [bounds.warn - 0.004, bounds.warn + 0.004, bounds.fail - 0.004, bounds.fail + 0.004];
        assert_eq!(at.map(grade), [Grade::Good, Grade::Warn, Grade::Warn, Grade::Fail], "{bounds:?}");
    };
    let part = |part: f64| (f64::from(NOMINAL) * part) as u32;
    of(WEAKNESS, &|lacks| grade(|_| Sample { radius: part(1.0 - lacks), ..GOOD }).0);
    let change = core::f64::consts::FRAC_2_SQRT_PI;
    of(NOISE, &|noise| grade(|k| Sample { radius: part(1.0 + change * noise * f64::from(k % 2)), ..GOOD }).0);
    let clipped = |of_256: u32| grade(|k| Sample { clipped: k % 256 < of_256, ..GOOD }).0;
    assert_eq!([0, 1, 4, 5].map(clipped), [Grade::Good, Grade::Warn, Grade::Warn, Grade::Fail]);
    assert_eq!([1, 4, 5].map(|of| CLIPPED.grade(f64::from(of) / 256.0)), [1, 4, 5].map(clipped));
    assert_eq!(SURPRISE.warn, f64::from(FAST_WARN) / 4_294_967_296.0);
    assert_eq!(SURPRISE.fail, f64::from(FAST_FAULT) / 4_294_967_296.0);
}

#[test]
fn what_endangers_the_count_is_a_fault_at_once() {
    let from = |bad: Sample| after((0..200).map(|k| if k < 100 { GOOD } else { bad })).1;
    assert_eq!(from(Sample { radius: NOMINAL / 5, ..GOOD }), Some((102, SignalFault::Lost)));
    assert_eq!(from(Sample { radius: NOMINAL * 2, ..GOOD }), Some((102, SignalFault::OffCircle)));
    let far = Sample { beside: DISAGREES_FAULT as i32 + 1, ..GOOD };
    assert_eq!(from(far), Some((100, SignalFault::Disagrees)));
    assert_eq!(from(Sample { beside: i32::MIN, ..GOOD }), Some((100, SignalFault::Disagrees)));
    let fast = Sample { beside: FAST_FAULT as i32 + 1, counted: false, ..GOOD };
    assert_eq!(from(fast), Some((100, SignalFault::Fast)));
    assert_eq!(from(Sample { slipped: true, ..GOOD }), Some((100, SignalFault::Slipped)));
    let spike = after((0..200).map(|k| if k == 100 { Sample { radius: 0, ..GOOD } } else { GOOD }));
    assert_eq!(spike.1, None);
    let mut health = Health::new(NOMINAL);
    let missed: Vec<_> = (0..10).map(|_| health.miss()).collect();
    assert_eq!(missed[8], Some(SignalFault::Missed));
    assert_eq!(missed[7], None);
}

#[test]
fn the_ellipse_is_part_of_the_picture() {
    let of = |ellipse: Ellipse| {
        let mut health = Health::new(NOMINAL);
        health.take_shape(shape(&ellipse));
        (0..255).for_each(|_| _ = health.sample(&GOOD));
        assert_eq!(health.report(), None);
        health.sample(&GOOD);
        health.report().unwrap()
    };
    let circle = Ellipse::circle(24_000.0);
    assert_eq!(of(circle).grade(), Grade::Good);
    assert_eq!(of(Ellipse { p: 3000.0, ..circle }).warn, Findings::OFFSET);
    assert_eq!(of(Ellipse { r: 0.6, ..circle }).fail, Findings::GAIN);
    let both = of(Ellipse { alpha: 0.2, q: 7300.0, ..circle });
    assert_eq!((both.warn, both.fail), (Findings::QUADRATURE, Findings::OFFSET));
    assert_eq!(both.warn.and(both.fail).to_string(), "offset, out of quadrature");
}

#[test]
fn what_a_block_was_found_to_be_is_not_forgotten() {
    let clipped = |k: u32| Sample { clipped: k == 5, ..GOOD };
    let (report, _) = after((0..1024).map(clipped));
    assert_eq!((report.grade(), report.ever), (Grade::Good, Findings::CLIPPED));
}
