//! How a command ends badly: one clear sentence and an exit status.

use crate::output;
use serde_json::{Value, json};
use std::io::Write as _;

/// A command that did not do its work.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The command line asks for something that cannot be asked: exit status 2.
    Usage(anyhow::Error),
    /// The work failed: exit status 1.
    Work(anyhow::Error),
    /// The work failed at several places, and all of them are told: exit status 1.
    Errors(Errors),
}

/// Errors of one file.
#[derive(Debug)]
pub(crate) struct Errors {
    /// One sentence for all.
    pub(crate) sentence: String,
    /// A line for each, unless the sentence says it all.
    pub(crate) each: Vec<String>,
    /// The same for programs, with `error`.
    pub(crate) document: Value,
}

impl Failure {
    /// A wrong use of the command line.
    pub(crate) fn usage(message: impl std::fmt::Display) -> Self {
        Self::Usage(anyhow::anyhow!("{message}"))
    }

    /// Work that failed.
    pub(crate) fn work(message: impl std::fmt::Display) -> Self {
        Self::Work(anyhow::anyhow!("{message}"))
    }

    pub(crate) fn status(&self) -> u8 {
        match self {
            Self::Work(_) | Self::Errors(_) => 1,
            Self::Usage(_) => 2,
        }
    }

    /// The sentence to stderr, behind what it sums up; with `json` also as a document to stdout.
    pub(crate) fn print(&self, json: bool) {
        let sentence = self.sentence();
        // Where neither stream takes it, the exit status still tells.
        if json {
            _ = output::print(&format!("{:#}", self.document()));
        }
        if let Self::Errors(errors) = self {
            for error in &errors.each {
                _ = writeln!(std::io::stderr(), "{error}");
            }
        }
        _ = writeln!(std::io::stderr(), "abbe: {sentence}");
    }

    fn document(&self) -> Value {
        match self {
            Self::Errors(errors) => errors.document.clone(),
            _ => json!({ "error": self.sentence() }),
        }
    }

    /// The error with those of its causes that it does not tell itself, on one line.
    pub(crate) fn sentence(&self) -> String {
        let error = match self {
            Self::Usage(error) | Self::Work(error) => error,
            Self::Errors(errors) => return errors.sentence.clone(),
        };
        let mut told = String::new();
        for cause in error.chain().map(|cause| one_line(&cause.to_string())) {
            if told.is_empty() {
                told = cause;
            } else if !told.contains(&cause) {
                told = format!("{told}: {cause}");
            }
        }
        told
    }
}

/// Several lines as one; parsers like to draw pictures.
pub(crate) fn one_line(text: &str) -> String {
    text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Work(error.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("the lamp failed: {source}")]
    struct Lamp {
        source: std::io::Error,
    }

    #[test]
    fn a_cause_is_told_once_and_on_one_line() {
        let source = std::io::Error::other("no\n  light");
        let failure = Failure::from(Lamp { source });
        assert_eq!(failure.sentence(), "the lamp failed: no light");
        let failure = Failure::Work(anyhow::anyhow!("no light").context("the lamp failed"));
        assert_eq!(failure.sentence(), "the lamp failed: no light");
    }
}
