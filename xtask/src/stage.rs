//! What a stage of the test is, and how it can end.

use std::path::PathBuf;

/// One check of the project.
pub(crate) struct Stage {
    /// One or two words; also the name for `--only`.
    pub(crate) name: &'static str,
    /// Does the check. An error counts as failed.
    pub(crate) run: fn(&Setting) -> anyhow::Result<Outcome>,
}

/// Where and how the stages run.
pub(crate) struct Setting {
    /// The folder that holds the workspace.
    pub(crate) root: PathBuf,
    /// True when a missing tool may be installed.
    pub(crate) may_install: bool,
    /// True in continuous integration, where "not possible here" is not good enough.
    pub(crate) ci: bool,
}

/// How a stage ended.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    Passed,
    /// What was wrong, a line each.
    Failed(Vec<String>),
    /// The machine lacks something.
    NotPossible {
        /// What it lacks.
        reason: String,
        /// The command that would bring it.
        install: String,
    },
}

impl Setting {
    pub(crate) fn new(root: PathBuf, install: bool) -> Self {
        let ci = std::env::var("CI").is_ok_and(|value| value == "true");
        Self { root, may_install: install || ci, ci }
    }
}

impl Outcome {
    /// Passed when nothing was found.
    pub(crate) fn of_findings(findings: Vec<String>) -> Self {
        if findings.is_empty() { Self::Passed } else { Self::Failed(findings) }
    }
}
