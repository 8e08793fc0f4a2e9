//! How a command ends badly: one clear sentence and an exit status.

use serde_json::json;

/// A command that did not do its work.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The command line asks for something that cannot be asked: exit status 2.
    Usage(anyhow::Error),
    /// The work failed: exit status 1.
    Work(anyhow::Error),
}

impl Failure {
    /// A wrong use of the command line.
    pub(crate) fn usage(message: impl std::fmt::Display) -> Self {
        Self::Usage(anyhow::anyhow!("{message}"))
    }

    pub(crate) fn status(&self) -> u8 {
        match self {
            Self::Work(_) => 1,
            Self::Usage(_) => 2,
        }
    }

    /// The sentence to stderr; with `json` also as a document to stdout.
    pub(crate) fn print(&self, json: bool) {
        let (Self::Usage(error) | Self::Work(error)) = self;
        let sentence = format!("{error:#}");
        if json {
            println!("{:#}", json!({ "error": sentence }));
        }
        eprintln!("abbe: {sentence}");
    }
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Work(error.into())
    }
}
