//! Running the program and judging how it ended.

use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The built-in preset, to be damaged.
pub(crate) const PRESET: &str = include_str!("../../../../presets/microscope-100.toml");

/// A run that has ended.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) status: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl From<Output> for Ended {
    fn from(output: Output) -> Self {
        Self {
            status: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

impl Ended {
    /// The one sentence of a failure: the last line of stderr, after nothing but progress and notes.
    pub(crate) fn sentence(&self) -> &str {
        let lines: Vec<&str> = self.stderr.lines().filter(|line| !line.is_empty()).collect();
        let (last, progress) = lines.split_last().unwrap_or_else(|| panic!("nothing on stderr: {self:?}"));
        for line in progress {
            let expected =
                line.ends_with('…') || line.starts_with("stopping …") || line.starts_with("note: ");
            assert!(expected, "`{line}` is neither progress nor a note: {self:?}");
        }
        let sentence = last.strip_prefix("abbe: ").unwrap_or_else(|| panic!("{self:?}"));
        assert!(sentence.len() > 15 && sentence.len() < 400, "{sentence}");
        for debug in ["Error {", "Err(", "Some(", "kind:", "Os {", "panicked", "field `", "error: "] {
            assert!(!sentence.contains(debug), "`{debug}` in {sentence}");
        }
        let parts: Vec<&str> = sentence.split(": ").collect();
        assert!(parts.windows(2).all(|pair| pair[0] != pair[1]), "told twice: {sentence}");
        sentence
    }

    /// The document that `--json` prints, and that nothing else is on stdout.
    pub(crate) fn document(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }
}

/// Runs `abbe` in a folder.
pub(crate) fn abbe(dir: &Path, arguments: &[&str]) -> Ended {
    command(dir, arguments).output().unwrap().into()
}

/// The program, about to run in a folder.
pub(crate) fn command(dir: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_abbe"));
    command.args(arguments).current_dir(dir);
    command
}

/// Runs `abbe`, which must do its work, and gives the document of `--json`.
pub(crate) fn done(dir: &Path, arguments: &[&str]) -> Value {
    let ended = abbe(dir, &[arguments, &["--json"]].concat());
    assert_eq!(ended.status, Some(0), "{arguments:?}: {ended:?}");
    ended.document()
}

/// Runs `abbe`, which must refuse: with this exit status, in one sentence that names all of `names`, with nothing on
/// stdout (or with `--json` the sentence as a document), and with nothing changed on the disk.
pub(crate) fn refused(dir: &Path, arguments: &[&str], status: i32, names: &[&str]) {
    let before = everything_in(dir);
    let plain = abbe(dir, arguments);
    assert_eq!(plain.status, Some(status), "{arguments:?}: {plain:?}");
    assert_eq!(plain.stdout, "", "{arguments:?}");
    for name in names {
        assert!(
            plain.sentence().contains(name),
            "{arguments:?} does not name `{name}`: {}",
            plain.sentence()
        );
    }
    let json = abbe(dir, &[&["--json"], arguments].concat());
    assert_eq!(json.status, Some(status), "{arguments:?}: {json:?}");
    assert_eq!(json.document(), serde_json::json!({ "error": json.sentence() }));
    assert_eq!(json.sentence().contains("usage: "), plain.sentence().contains("usage: "));
    assert!(everything_in(dir) == before, "{arguments:?} changed files");
}

/// Every file below a folder with its bytes, every folder with none.
pub(crate) fn everything_in(dir: &Path) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(everything_in(&path));
            found.insert(path, None);
        } else {
            let bytes = fs::read(&path).unwrap();
            found.insert(path, Some(bytes));
        }
    }
    found
}

/// The line, from 1, on which `part` first stands.
pub(crate) fn line_of(text: &str, part: &str) -> usize {
    1 + text[..text.find(part).unwrap()].matches('\n').count()
}
