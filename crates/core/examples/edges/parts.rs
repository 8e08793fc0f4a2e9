//! A long run in parts with seeds of their own, on all processors: the same tally on every machine.

use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Instant;

/// Edges of a part.
const PART: u64 = 1 << 22;

fn threads() -> u64 {
    thread::available_parallelism().map_or(1, |count| count.get() as u64)
}

/// How long it took, for below a table.
pub(crate) fn taken(began: Instant) -> String {
    format!("{:.1} min on {} threads", began.elapsed().as_secs_f64() / 60.0, threads())
}

/// All parts of a run, whoever does them: `run` makes so many edges from a seed, `and` adds two tallies.
pub(crate) fn all<T: Default + Send>(
    edges: u64,
    seed: u64,
    run: impl Fn(u64, u64) -> T + Sync,
    and: impl Fn(T, &T) -> T + Sync,
) -> T {
    let next = AtomicU64::new(0);
    let work = || {
        let mut tally = T::default();
        loop {
            let part = next.fetch_add(1, Ordering::Relaxed);
            let left = edges.saturating_sub(part.saturating_mul(PART));
            if left == 0 {
                return tally;
            }
            tally = and(tally, &run(left.min(PART), (seed << 32) + part));
        }
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..threads()).map(|_| scope.spawn(work)).collect();
        let tallies = workers.into_iter().map(|worker| worker.join().expect("a worker does not panic"));
        tallies.fold(T::default(), |sum, tally| and(sum, &tally))
    })
}
