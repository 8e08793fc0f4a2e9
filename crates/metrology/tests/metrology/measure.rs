use std::cell::RefCell;
use std::ops::ControlFlow;

use abbe_metrology::measure::{
    Arrival, Instrument, MeasureError, NoThermometer, Plan, PlanFault, Stage, Thermometer, measure,
};
use abbe_metrology::{Approach, Axis};

/// A table with an error of 1 µm a mm, 3 µm more when it comes from above, and a warm room.
#[derive(Default)]
struct Table {
    truth_mm: f64,
    last: [f64; 2],
    visited: Vec<[f64; 2]>,
    dwelt_s: f64,
    readings: usize,
}

#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Broken(&'static str);

struct Drive<'a>(&'a RefCell<Table>, Axis);
struct Laser<'a> {
    table: &'a RefCell<Table>,
    zero_mm: f64,
    broken: bool,
}
struct Probe(f64);

impl Stage for Drive<'_> {
    type Error = Broken;

    fn move_to(&mut self, position_mm: [f64; 2]) -> Result<Arrival, Broken> {
        let mut table = self.0.borrow_mut();
        let along = position_mm[self.1.index()];
        if along > 500.0 {
            return Err(Broken("soft limit"));
        }
        let from_above = along < table.last[self.1.index()];
        table.truth_mm = along + along * 1e-3 + if from_above { 3e-3 } else { 0.0 };
        table.last = position_mm;
        table.visited.push(position_mm);
        Ok(Arrival { moved_s: 1.0, settle_s: 0.25, position_mm })
    }

    fn dwell(&mut self, seconds: f64) -> Result<(), Broken> {
        self.0.borrow_mut().dwelt_s += seconds;
        Ok(())
    }
}

impl Instrument for Laser<'_> {
    type Error = Broken;

    fn set_zero(&mut self) -> Result<(), Broken> {
        self.zero_mm = self.table.borrow().truth_mm;
        Ok(())
    }

    /// Reads alternately 0.1 µm too much and too little: the mean of an even number is right.
    fn read_um(&mut self) -> Result<f64, Broken> {
        if self.broken {
            return Err(Broken("no beam"));
        }
        let mut table = self.table.borrow_mut();
        table.readings += 1;
        let wobble = if table.readings.is_multiple_of(2) { 0.1 } else { -0.1 };
        Ok((table.truth_mm - self.zero_mm) * 1e3 + wobble)
    }
}

impl Thermometer for Probe {
    type Error = Broken;

    fn name(&self) -> &'static str {
        "scale"
    }

    fn read_c(&mut self) -> Result<f64, Broken> {
        self.0 += 0.5;
        Ok(self.0)
    }
}

fn plan(axis: Axis) -> Plan {
    Plan {
        axis,
        targets_mm: vec![10.0, 20.0, 30.0],
        runs: 2,
        line_mm: 50.0,
        datum_mm: 0.0,
        overrun_mm: 0.5,
        dwell_s: 0.2,
        readings_per_point: 4,
    }
}

fn laser(table: &RefCell<Table>) -> Laser<'_> {
    Laser { table, zero_mm: f64::NAN, broken: false }
}

#[test]
fn visits_every_target_from_both_sides_and_reads_positions() {
    let table = RefCell::default();
    let mut probes = [Probe(20.0)];
    let mut heard = Vec::new();
    let found =
        measure(&plan(Axis::Y), &mut Drive(&table, Axis::Y), &mut laser(&table), &mut probes, |progress| {
            heard.push((progress.done, progress.total, progress.point.target_mm));
            ControlFlow::Continue(())
        })
        .unwrap();

    let one_run = [9.5, 10.0, 20.0, 30.0, 30.5, 30.0, 20.0, 10.0];
    let along: Vec<f64> = [-0.5, 0.0].into_iter().chain(one_run).chain(one_run).collect();
    let expected: Vec<[f64; 2]> = along.iter().map(|&y| [50.0, y]).collect();
    assert_eq!(table.borrow().visited, expected);

    for (i, target) in [10.0, 20.0, 30.0].into_iter().enumerate() {
        for run in 0..2 {
            let up = found.readings.positions_mm(Approach::Up)[i][run];
            let down = found.readings.positions_mm(Approach::Down)[i][run];
            assert!((up - target * 1.001).abs() < 1e-9, "{up}");
            assert!((down - target * 1.001 - 3e-3).abs() < 1e-9, "{down}");
        }
    }
    assert_eq!(heard.len(), 12);
    assert_eq!((heard[0], heard[11]), ((1, 12, 10.0), (12, 12, 10.0)));
    let records: Vec<_> = found.points.iter().map(|p| (p.run, p.approach, p.target_mm)).collect();
    assert_eq!(records[2..4], [(1, Approach::Up, 30.0), (1, Approach::Down, 30.0)]);
    // 18 moves of 1.25 s; a rest at the datum and at each of 12 points.
    assert!((found.elapsed_s - (18.0 * 1.25 + 13.0 * 0.2)).abs() < 1e-9);
    assert!((table.borrow().dwelt_s - 13.0 * 0.2).abs() < 1e-9);
    assert_eq!(table.borrow().readings, 48);
    // Before the first run and after each.
    let celsius: Vec<f64> = found.temperatures.iter().map(|t| t.celsius[0]).collect();
    assert_eq!(celsius, [20.5, 21.0, 21.5]);
    assert_eq!((found.mean_celsius(), found.thermometers), (Some(21.0), vec!["scale".to_owned()]));
}

#[test]
fn whoever_fails_is_named() {
    let table = RefCell::default();
    let none = &mut [] as &mut [NoThermometer];
    let go = |_| ControlFlow::Continue(());
    let far = Plan { targets_mm: vec![10.0, 600.0], ..plan(Axis::X) };
    let error = measure(&far, &mut Drive(&table, Axis::X), &mut laser(&table), none, go).unwrap_err();
    assert_eq!(error.to_string(), "the stage failed on its way to x = 600 mm: soft limit");
    let mut dark = Laser { broken: true, ..laser(&table) };
    let error = measure(&plan(Axis::X), &mut Drive(&table, Axis::X), &mut dark, none, go).unwrap_err();
    assert_eq!(error.to_string(), "the instrument failed at x = 10 mm: no beam");
    let stop = |_| ControlFlow::Break(());
    let error =
        measure(&plan(Axis::X), &mut Drive(&table, Axis::X), &mut laser(&table), none, stop).unwrap_err();
    assert!(matches!(error, MeasureError::Stopped { done: 1, total: 12 }));
    let one_run = Plan { runs: 1, ..plan(Axis::X) };
    let error = measure(&one_run, &mut Drive(&table, Axis::X), &mut laser(&table), none, go).unwrap_err();
    assert!(matches!(error, MeasureError::Plan(PlanFault::TooFewRuns { found: 1 })));
}

/// Something done to a good plan.
type Change = fn(&mut Plan);

#[test]
fn impossible_plans_are_refused_before_anything_moves() {
    let travel = [[-1.0, 101.0], [-1.0, 101.0]];
    let fault = |change: Change| {
        let mut plan = plan(Axis::X);
        change(&mut plan);
        plan.check(travel).err().map(|fault| fault.to_string())
    };
    assert_eq!(fault(|_| {}), None);
    let table: [(Change, &str); 10] = [
        (
            |p| p.targets_mm.push(101.0),
            "the start of the way down at 101.5 mm is outside the travel of x, -1 to 101 mm",
        ),
        (
            |p| p.targets_mm[0] = -0.9,
            "the start of the way up at -1.4 mm is outside the travel of x, -1 to 101 mm",
        ),
        (
            |p| p.datum_mm = -0.6,
            "the approach to the datum at -1.1 mm is outside the travel of x, -1 to 101 mm",
        ),
        (|p| p.line_mm = 102.0, "the measuring line at 102 mm is outside the travel of y, -1 to 101 mm"),
        (|p| p.targets_mm = vec![1.0], "1 target(s), at least 2 are needed"),
        (|p| p.targets_mm.push(30.0), "target 30 mm does not ascend from 30 mm before it"),
        (|p| p.targets_mm.push(f64::NAN), "target NaN mm does not ascend from 30 mm before it"),
        (|p| p.overrun_mm = 0.0, "the overrun in mm is 0, which is not allowed"),
        (|p| p.dwell_s = -1.0, "the dwell in s is -1, which is not allowed"),
        (|p| p.readings_per_point = 0, "the number of readings per point is 0, which is not allowed"),
    ];
    for (change, expected) in table {
        assert_eq!(fault(change).as_deref(), Some(expected));
    }
}
