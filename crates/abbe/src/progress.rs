//! Progress to stderr: a bar where somebody watches, a line where nobody does.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write as _};
use std::time::Duration;

/// A bar over `total` parts called `name`.
pub(crate) fn bar(name: &str, total: usize) -> ProgressBar {
    shown(name, total as u64, "{msg:28} {bar:32} {pos}/{len} {eta:>4}")
}

/// A bar over a file of `total` bytes, as often as it is read.
pub(crate) fn bytes(name: &str, total: u64) -> ProgressBar {
    shown(name, total, "{msg:28} {bar:32} {bytes}/{total_bytes} {eta:>4}")
}

/// A count of bytes whose end nobody knows.
pub(crate) fn stream(name: &str) -> ProgressBar {
    shown(name, 0, "{msg:28} {bytes}")
}

fn shown(name: &str, total: u64, template: &str) -> ProgressBar {
    let watched = std::io::stderr().is_terminal();
    if !watched {
        note(&format!("{name} …"));
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(total).with_style(style).with_message(name.to_owned());
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// A line that stays. Work goes on where stderr takes none.
pub(crate) fn note(text: &str) {
    _ = writeln!(std::io::stderr(), "{text}");
}
