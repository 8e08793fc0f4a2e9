//! Golden traces: recorded runs of the controller that must end in the same hash on every processor.
//!
//! A trace is fixed: it lies in `tests/golden`, one folder a scenario, and only [`record`] writes it anew. What replays
//! it, a *body*, is this machine ([`here`]), an emulated RP2040 ([`rp2040`], which counts cycles, too) or a Cortex-M3
//! or M33 in QEMU ([`qemu`]). The stage is the default one, unless the
//! trace begins with another; each body builds it anew.

pub mod budget;
pub mod here;
pub mod qemu;
pub mod record;
pub mod rp2040;

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use abbe_proto::record::HASH_TICKS;
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};

/// The folder of the traces, from the root of the project.
pub const FOLDER: &str = "tests/golden";

/// A folder of [`FOLDER`].
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Its name.
    pub name: String,
    folder: PathBuf,
    stage: StageFile,
}

/// What `stage.toml` says.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StageFile {
    /// Name of the preset: its controller and its plant.
    #[serde(default = "usual_preset")]
    preset: String,
    /// Where the slides stand at power-on, mm.
    at_mm: [f64; 2],
    #[serde(default = "first_seed")]
    seed: u64,
    /// For each axis the polynomial of its error map in the reading, µm over mm, constant first; none means no map.
    #[serde(default)]
    map: [Vec<f64>; 2],
    /// What differs from the preset's, if anything.
    #[serde(default)]
    plant: toml::Table,
}

const fn first_seed() -> u64 {
    1
}

fn usual_preset() -> String {
    "microscope-100".into()
}

/// What a replay must end in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Expected {
    /// Ticks of the run.
    pub ticks: u32,
    /// Hash of all outputs.
    pub hash: u64,
}

/// What a body found.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Found {
    /// Ticks replayed.
    pub ticks: u32,
    /// Of those, the first so many are the same as in the recorded run.
    pub proven: u32,
    /// Hash of all outputs up to there.
    pub hash: u64,
    /// How it ended.
    pub end: End,
}

/// How a replay ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum End {
    /// At the end of the trace.
    Whole,
    /// The outputs differ from those of the recorded run.
    Differs,
    /// The trace cannot be read, for this reason.
    Unreadable(String),
}

impl Scenario {
    /// Every scenario of the project whose root this is, by name.
    ///
    /// # Errors
    /// There is no such folder, or nothing in it.
    pub fn all(root: &Path) -> Result<Vec<Self>> {
        let folder = root.join(FOLDER);
        let mut scenarios = Vec::new();
        for entry in fs::read_dir(&folder).with_context(|| format!("cannot read {}", folder.display()))? {
            let folder = entry?.path();
            if folder.join("script.txt").exists() {
                scenarios.push(Self::of_folder(folder)?);
            }
        }
        ensure!(!scenarios.is_empty(), "{} holds no scenario", folder.display());
        scenarios.sort_by(|one, other| one.name.cmp(&other.name));
        Ok(scenarios)
    }

    fn of_folder(folder: PathBuf) -> Result<Self> {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let file = folder.join("stage.toml");
        let stage: StageFile =
            toml::from_str(&text_of(&file)?).with_context(|| file.display().to_string())?;
        let known = budget::BUDGETS.iter().any(|budget| budget.preset == stage.preset);
        ensure!(known, "{}: there is no budget for a stage {}", file.display(), stage.preset);
        Ok(Self { name, folder, stage })
    }

    /// Preset of its stage.
    pub fn preset(&self) -> &str {
        &self.stage.preset
    }

    /// The recorded run.
    ///
    /// # Errors
    /// It is missing.
    pub fn trace(&self) -> Result<Vec<u8>> {
        let file = self.folder.join("trace.rec");
        fs::read(&file).with_context(|| format!("cannot read {}; {RECORD_IT}", file.display()))
    }

    /// What each replay must end in.
    ///
    /// # Errors
    /// It is missing or says something else.
    pub fn expected(&self) -> Result<Expected> {
        let file = self.folder.join("expected.toml");
        let text = fs::read_to_string(&file)
            .with_context(|| format!("cannot read {}; {RECORD_IT}", file.display()))?;
        Expected::parse(&text).with_context(|| format!("{}; {RECORD_IT}", file.display()))
    }

    fn script(&self) -> Result<String> {
        text_of(&self.folder.join("script.txt"))
    }
}

fn text_of(file: &Path) -> Result<String> {
    fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))
}

const RECORD_IT: &str = "`cargo xtask golden --record` writes it";

/// The keys of `expected.toml`; TOML has no number of 64 bits without a sign.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    ticks: u32,
    hash: String,
}

impl Expected {
    fn parse(text: &str) -> Result<Self> {
        let keys: Keys = toml::from_str(text)?;
        let digits = keys.hash.strip_prefix("0x").context("`hash` does not begin with 0x")?;
        let hash = u64::from_str_radix(digits, 16).context("`hash` is no number of 64 bits")?;
        Ok(Self { ticks: keys.ticks, hash })
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "# Written by `cargo xtask golden --record`.")?;
        writeln!(f, "ticks = {}", self.ticks)?;
        writeln!(f, "hash = \"{:#018x}\"", self.hash)
    }
}

impl Found {
    /// What is wrong with it, if anything, with the first ticks that differ.
    pub fn difference(&self, expected: &Expected) -> Option<String> {
        match &self.end {
            End::Unreadable(reason) => {
                Some(format!("the trace cannot be read after tick {}: {reason}", self.ticks))
            }
            End::Differs => {
                let within = self.proven.saturating_add(HASH_TICKS);
                Some(format!("the outputs differ within ticks {} … {within}", self.proven))
            }
            End::Whole if self.ticks != expected.ticks => {
                Some(format!("{} ticks, {} are expected", self.ticks, expected.ticks))
            }
            End::Whole if self.proven != self.ticks => Some(format!(
                "the last {} ticks are not proven by a hash",
                self.ticks.saturating_sub(self.proven)
            )),
            End::Whole if self.hash != expected.hash => {
                Some(format!("the hash is {:016x}, {:016x} is expected", self.hash, expected.hash))
            }
            End::Whole => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXPECTED: Expected = Expected { ticks: 2500, hash: 0xfedc_ba98_7654_3210 };

    #[test]
    fn what_is_written_is_read_back() {
        assert_eq!(Expected::parse(&EXPECTED.to_string()).unwrap(), EXPECTED);
        for text in [
            "ticks = 1",
            "ticks = 1\nhash = \"12\"",
            "ticks = 1\nhash = \"0xg\"",
            "ticks = -1\nhash = \"0x1\"",
        ] {
            assert!(Expected::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn every_difference_has_its_words() {
        let same = Found { ticks: 2500, proven: 2500, hash: EXPECTED.hash, end: End::Whole };
        assert_eq!(same.difference(&EXPECTED), None);
        for (found, words) in [
            (Found { hash: 1, ..same.clone() }, "the hash is 0000000000000001"),
            (Found { ticks: 2400, proven: 2400, ..same.clone() }, "2400 ticks, 2500 are expected"),
            (Found { proven: 2000, ..same.clone() }, "the last 500 ticks"),
            (Found { proven: 1000, end: End::Differs, ..same.clone() }, "within ticks 1000 … 2000"),
            (Found { end: End::Unreadable("cut".into()), ..same }, "after tick 2500: cut"),
        ] {
            let difference = found.difference(&EXPECTED).unwrap();
            assert!(difference.contains(words), "{difference}");
        }
    }
}
