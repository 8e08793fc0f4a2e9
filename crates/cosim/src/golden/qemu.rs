//! Golden traces on a Cortex-M that QEMU emulates: the image reads the trace and says what it found by semihosting.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};

use super::{End, Found};

/// The program.
pub const QEMU: &str = "qemu-system-arm";
/// A replay that takes longer hangs: even the longest trace takes seconds.
const LONGEST: Duration = Duration::from_mins(2);
const GLANCE: Duration = Duration::from_millis(20);

/// A machine with its image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Machine {
    /// A Cortex-M3.
    Lm3s6965evb,
    /// A Cortex-M33.
    Mps2An505,
}

impl Machine {
    /// As QEMU calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lm3s6965evb => "lm3s6965evb",
            Self::Mps2An505 => "mps2-an505",
        }
    }

    /// Replays a trace by an image of `firmware/golden`.
    ///
    /// # Errors
    /// QEMU cannot be started, hangs, or says something else than the image would.
    pub fn replay(self, image: &Path, trace: &[u8]) -> Result<Found> {
        let image = image.canonicalize().with_context(|| format!("there is no image {}", image.display()))?;
        let folder = tempfile::tempdir()?;
        fs::write(folder.path().join("trace.rec"), trace)?;
        let mut command = Command::new(QEMU);
        command.current_dir(folder.path()).args(["-M", self.name(), "-nographic", "-monitor", "none"]);
        command.args(["-semihosting-config", "enable=on,target=native", "-kernel"]).arg(image);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = command.spawn().with_context(|| format!("cannot start {QEMU}"))?;
        let (stdout, stderr) = said_by(child)?;
        found_in(&stdout).with_context(|| format!("{QEMU} -M {} said {stdout:?} and {stderr:?}", self.name()))
    }
}

/// What a process said until its end, which comes in time. It says less than a pipe holds.
fn said_by(mut child: Child) -> Result<(String, String)> {
    let begun = Instant::now();
    while child.try_wait()?.is_none() {
        if begun.elapsed() > LONGEST {
            child.kill()?;
            child.wait()?;
            bail!("{QEMU} has not ended after {} s", LONGEST.as_secs());
        }
        thread::sleep(GLANCE);
    }
    let output = child.wait_with_output()?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    Ok((text(&output.stdout), text(&output.stderr)))
}

/// The line `ticks proven hash`, and after it why the replay ended early.
fn found_in(answer: &str) -> Result<Found> {
    let (line, reason) = answer.split_once('\n').unwrap_or((answer, ""));
    let words: Vec<&str> = line.split_whitespace().collect();
    ensure!(words.len() == 3, "there is no line of ticks, proven ticks and hash");
    let end = match reason.trim() {
        "" => End::Whole,
        "the outputs differ from those of the recorded run" => End::Differs,
        reason => End::Unreadable(reason.into()),
    };
    let hash = u64::from_str_radix(words[2], 16).context("the hash is no number")?;
    Ok(Found { ticks: words[0].parse()?, proven: words[1].parse()?, hash, end })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_answer_of_an_image_is_understood() {
        let found = found_in("2500 2000 00000000000000ff\r\n").unwrap();
        assert_eq!(found, Found { ticks: 2500, proven: 2000, hash: 255, end: End::Whole });
        let differs = found_in("9 0 01\nthe outputs differ from those of the recorded run\n").unwrap();
        assert_eq!(differs.end, End::Differs);
        let unreadable = found_in("9 0 01\nbyte 7 of the recording: it was altered").unwrap();
        assert!(matches!(unreadable.end, End::Unreadable(reason) if reason.contains("byte 7")));
    }

    #[test]
    fn other_words_are_no_answer() {
        for answer in ["", "golden: there is no trace.rec here", "1 2", "1 2 xyz", "-1 2 3"] {
            assert!(found_in(answer).is_err(), "{answer}");
        }
    }
}
