//! A recording of any length is read in the memory of a short one.

use crate::ended::command;
use crate::signals::MADE;
use std::fmt::Write as _;
use std::fs;
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// The most that a process has had in memory until now, kB; none once it has ended.
pub(crate) fn most_kb(child: &Child) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse().ok()
}

#[test]
#[cfg_attr(debug_assertions, ignore = "twenty megabytes take their time without optimisation")]
fn twenty_megabytes_of_samples_pass_through_forty_of_memory() {
    let dir = tempfile::tempdir().unwrap();
    let mut text = String::from("t_s,a,b\n");
    let rows = MADE.rows();
    for k in 0..750_000_usize {
        // The sweep comes again every 10 000 samples, 473 periods on.
        let [a, b] = rows[k % 10_000];
        writeln!(text, "{:.4},{a:.6},{b:.6}", k as f64 * 1e-4).unwrap();
    }
    assert!(text.len() > 19_000_000, "{}", text.len());
    fs::write(dir.path().join("s.csv"), text).unwrap();
    let asked =
        ["encoder", "s.csv", "--period-um", "0.8", "--harmonics", "--positions", "p.csv", "--plot", "p.svg"];
    let mut child = command(dir.path(), &asked).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let (mut most, mut looks) = (0, 0);
    while child.try_wait().unwrap().is_none() {
        if let Some(kb) = most_kb(&child) {
            most = most.max(kb);
            looks += 1;
        }
        sleep(Duration::from_millis(2));
    }
    assert!(child.wait().unwrap().success());
    // A process that was hardly looked at has shown nothing.
    assert!(looks > 20 && most > 1000, "{looks} looks, {most} kB");
    assert!(most <= 40 * 1024, "{most} kB");
    assert_eq!(fs::read_to_string(dir.path().join("p.csv")).unwrap().lines().count(), 750_001);
}
