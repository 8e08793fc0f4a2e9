//! What is wrong with a preset, and where.

use std::fmt;

/// A preset that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct PresetError {
    /// The file, or the name of a built-in preset.
    pub file: String,
    /// Line, from 1.
    pub line: Option<usize>,
    /// What is wrong.
    pub message: String,
}

impl fmt::Display for PresetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        write!(f, ": {}", self.message)
    }
}

impl PresetError {
    /// What the TOML reader found wrong in the text of `file`; an unknown key gets the nearest known one.
    pub fn from_toml(file: &str, text: &str, error: &toml::de::Error) -> Self {
        let line = error.span().map(|span| 1 + text[..span.start.min(text.len())].matches('\n').count());
        Self { file: file.to_owned(), line, message: with_nearest(error.message()) }
    }
}

/// "unknown field `a`, expected one of `b`, `c`" becomes a question.
fn with_nearest(message: &str) -> String {
    let mut names = message.split('`').skip(1).step_by(2);
    let (Some(unknown), true) = (names.next(), message.starts_with("unknown field")) else {
        return message.trim().replace('\n', " ");
    };
    let nearest =
        names.max_by(|a, b| strsim::jaro_winkler(unknown, a).total_cmp(&strsim::jaro_winkler(unknown, b)));
    match nearest {
        Some(nearest) => format!("unknown key `{unknown}`; the nearest valid one is `{nearest}`"),
        None => format!("unknown key `{unknown}`; no key is valid here"),
    }
}

/// The line on which `key` is set below `header`.
pub fn line_of(text: &str, header: &str, key: &str) -> Option<usize> {
    let mut lines = text.lines().enumerate().skip_while(|(_, line)| !line.starts_with(header)).skip(1);
    lines
        .find(|(_, line)| line.split('=').next().is_some_and(|name| name.trim() == key))
        .map(|(number, _)| number + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_key_gets_the_nearest_valid_one() {
        let message = with_nearest("unknown field `masss_kg`, expected one of `mass_kg`, `motor`, `screw`");
        assert_eq!(message, "unknown key `masss_kg`; the nearest valid one is `mass_kg`");
    }
}
