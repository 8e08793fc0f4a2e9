//! What a tick may cost a Cortex-M0+, and what it does cost. See docs/adr/0011-cycle-budget.md.

use serde::Serialize;

use super::rp2040::TickCycles;

/// A row of the budget: stages of the tick, and the cycles that they may take together in one tick, both axes.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Its name.
    pub name: &'static str,
    /// Numbers in [`MEASURED`](super::rp2040::MEASURED).
    stages: &'static [usize],
    /// At most so many; none where only a larger row is judged.
    budget: Option<u32>,
}

const fn row(name: &'static str, stages: &'static [usize], budget: Option<u32>) -> Row {
    Row { name, stages, budget }
}

/// What the ticks of a stage may cost.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Its preset.
    pub preset: &'static str,
    /// The stage in a few words.
    pub stage: &'static str,
    /// Its rows; the whole tick is the last.
    pub rows: [Row; 11],
}

/// The budgets. The stages share them as docs/adr/0011-cycle-budget.md says.
pub const BUDGETS: [Budget; 2] = [
    // On a Pico: 10 kHz at 125 MHz are 12 500 cycles a tick, half of them are the tick's.
    Budget {
        preset: "microscope-100",
        stage: "microscope-100, two digital encoders",
        rows: [
            row("sense", &[1], Some(490)),
            row("guard", &[2], None),
            row("machine", &[3], None),
            row("guard + machine", &[2, 3], Some(1640)),
            row("plan", &[4], Some(1190)),
            row("compensate", &[5], Some(750)),
            row("servo", &[6], Some(1280)),
            row("drive", &[7], None),
            row("publish", &[8], None),
            row("drive + publish", &[7, 8], Some(900)),
            row("whole tick", &[0], Some(6250)),
        ],
    },
    // No board runs it yet, so it is judged by the same processor, of whose tick it may take four fifths.
    Budget {
        preset: "litho-120",
        stage: "litho-120, two analogue heads",
        rows: [
            row("sense", &[1], Some(2900)),
            row("guard", &[2], None),
            row("machine", &[3], None),
            row("guard + machine", &[2, 3], Some(1680)),
            row("plan", &[4], Some(1190)),
            row("compensate", &[5], Some(750)),
            row("servo", &[6], Some(1280)),
            row("drive", &[7], None),
            row("publish", &[8], None),
            row("drive + publish", &[7, 8], Some(1900)),
            row("whole tick", &[0], Some(10_000)),
        ],
    },
];

/// What the ticks of one scenario cost.
#[derive(Debug)]
pub struct Run<'a> {
    /// Preset of its stage.
    pub preset: &'a str,
    /// Name of the scenario.
    pub scenario: &'a str,
    /// Cycles of each of its ticks.
    pub ticks: &'a [TickCycles],
}

/// What a stage costs over all scenarios of it.
#[derive(Debug, Serialize)]
pub struct Costs {
    /// The stage in a few words.
    pub stage: &'static str,
    /// Every row of its budget.
    pub rows: Vec<Cost>,
}

/// What a row of a budget costs.
#[derive(Debug, Serialize)]
pub struct Cost {
    /// Name of the row.
    pub name: &'static str,
    /// In half of the ticks at most so many cycles.
    pub median: u32,
    /// In 99 of 100.
    pub p99: u32,
    /// In all.
    pub worst: u32,
    /// What is allowed, where it is judged.
    pub budget: Option<u32>,
    /// Scenario of the worst tick.
    pub scenario: String,
    /// Number of the worst tick in it, from 0.
    pub tick: usize,
}

impl Cost {
    /// Whether the worst tick costs more than allowed.
    pub fn is_over(&self) -> bool {
        self.budget.is_some_and(|budget| self.worst > budget)
    }
}

/// The cost of every row of every budget; one without a run has no rows.
pub fn costs(runs: &[Run<'_>]) -> Vec<Costs> {
    let of_stage = |Budget { preset, stage, rows }: &Budget| {
        let of_it: Vec<&Run<'_>> = runs.iter().filter(|run| run.preset == *preset).collect();
        Costs { stage, rows: rows.iter().filter_map(|row| cost(row, &of_it)).collect() }
    };
    BUDGETS.iter().map(of_stage).collect()
}

fn cost(row: &Row, runs: &[&Run<'_>]) -> Option<Cost> {
    let of_tick = |tick: &TickCycles| row.stages.iter().map(|&stage| tick[stage]).sum::<u32>();
    let mut all: Vec<(u32, &str, usize)> = Vec::new();
    for run in runs {
        all.extend(run.ticks.iter().enumerate().map(|(number, tick)| (of_tick(tick), run.scenario, number)));
    }
    all.sort_by_key(|&(cycles, _, _)| cycles);
    let &(worst, scenario, tick) = all.last()?;
    // The smallest number that at least so many of a hundred do not exceed.
    let within = |percent: usize| all[(all.len() * percent).div_ceil(100) - 1].0;
    Some(Cost {
        name: row.name,
        median: within(50),
        p99: within(99),
        worst,
        budget: row.budget,
        scenario: scenario.into(),
        tick,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::golden::rp2040::MEASURED;

    /// A run of 200 ticks: the whole costs the number of the tick, guard and machine one and two more.
    fn ticks() -> Vec<TickCycles> {
        (0..200).map(|number| [number, 0, number + 1, number + 2, 0, 0, 0, 0, 0]).collect()
    }

    fn run<'a>(preset: &'a str, scenario: &'a str, ticks: &'a [TickCycles]) -> Run<'a> {
        Run { preset, scenario, ticks }
    }

    fn of<'a>(costs: &'a Costs, name: &str) -> &'a Cost {
        costs.rows.iter().find(|cost| cost.name == name).unwrap()
    }

    #[test]
    fn the_worst_tick_is_named_and_parts_are_added_tick_by_tick() {
        let ticks = ticks();
        let runs = [run("microscope-100", "a", &ticks[..100]), run("microscope-100", "b", &ticks[100..])];
        let costs = costs(&runs);
        let whole = of(&costs[0], "whole tick");
        assert_eq!((whole.median, whole.p99, whole.worst), (99, 197, 199));
        assert_eq!((whole.scenario.as_str(), whole.tick), ("b", 99));
        assert_eq!(of(&costs[0], "guard + machine").worst, 199 + 1 + 199 + 2);
        assert!(!whole.is_over());
        assert!(costs[1].rows.is_empty());
    }

    #[test]
    fn each_stage_is_judged_by_its_own_budget_and_over_it_is_beyond() {
        let over = |cycles| {
            let tick = [[cycles, 0, 0, 0, 0, 0, 0, 0, 0]];
            let costs = costs(&[run("microscope-100", "a", &tick), run("litho-120", "b", &tick)]);
            [0, 1].map(|stage: usize| costs[stage].rows.iter().any(Cost::is_over))
        };
        assert_eq!(over(6250), [false, false]);
        assert_eq!(over(6251), [true, false]);
        assert_eq!(over(10_000), [true, false]);
        assert_eq!(over(10_001), [true, true]);
    }

    #[test]
    fn every_stage_is_judged_once_and_together_they_fit_the_tick() {
        for budget in &BUDGETS {
            let judged: Vec<&Row> = budget.rows.iter().filter(|row| row.budget.is_some()).collect();
            let (whole, stages) = judged.split_last().unwrap();
            let mut numbers: Vec<usize> = stages.iter().flat_map(|row| row.stages).copied().collect();
            numbers.sort_unstable();
            assert_eq!(numbers, (1..MEASURED.len()).collect::<Vec<usize>>());
            let sum: u32 = stages.iter().filter_map(|row| row.budget).sum();
            assert!(sum <= whole.budget.unwrap_or(0), "{}: {sum}", budget.preset);
        }
    }
}
