//! Stdout: where the answer goes, and nothing else.

use std::io::{self, ErrorKind, Write as _};

/// Prints a text and ends the line. A reader that has gone (`abbe … | head`) is no failure; a full disk is one.
pub(crate) fn print(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    let done = writeln!(stdout, "{}", text.trim_end()).and_then(|()| stdout.flush());
    match done {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        done => done,
    }
}
