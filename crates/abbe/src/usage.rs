//! The command line as it was typed: a wish, a call for help, or a mistake told in one sentence.

use crate::cli::Cli;
use crate::failure::{Failure, one_line};
use clap::error::{Error, ErrorKind};
use clap::{CommandFactory, Parser};
use std::ffi::OsString;
use std::io::IsTerminal;

/// What somebody typed.
#[derive(Debug)]
pub(crate) enum Typed {
    /// Something to do.
    Wish(Cli),
    /// A call for help or for the version: the text to show.
    Help(String),
}

/// Commands of the contract that this version does not have yet.
const PLANNED: [&str; 6] = ["serve", "jog", "status", "stop", "reset", "tune"];

/// Whether the answer is wanted as JSON, even of a command line that is wrong elsewhere.
pub(crate) fn wants_json(arguments: &[OsString]) -> bool {
    arguments.iter().skip(1).take_while(|argument| *argument != "--").any(|argument| argument == "--json")
}

/// Reads the command line.
pub(crate) fn read(arguments: &[OsString]) -> Result<Typed, Failure> {
    Cli::try_parse_from(arguments).map(Typed::Wish).or_else(|error| match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => Ok(Typed::Help(shown(&error))),
        // No command at all.
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand | ErrorKind::MissingSubcommand => {
            Ok(Typed::Help(Cli::command().render_help().to_string()))
        }
        _ => Err(Failure::usage(sentence(&error))),
    })
}

fn shown(help: &Error) -> String {
    let help = help.render();
    if std::io::stdout().is_terminal() { help.ansi().to_string() } else { help.to_string() }
}

/// The mistake, the parser's tips and the usage line, in this order.
fn sentence(error: &Error) -> String {
    if let Some(command) = planned(error) {
        return format!("`abbe {command}` is not in this version yet; `abbe help` lists what is");
    }
    let text = error.render().to_string();
    let parts = text.split("\n\n").map(one_line).filter(|part| !part.starts_with("For more information"));
    let parts: Vec<String> = parts.map(|part| part.replacen("Usage: ", "usage: ", 1)).collect();
    let sentence = parts.join("; ");
    let sentence = sentence.strip_prefix("error: ").unwrap_or(&sentence);
    if error.kind() == ErrorKind::InvalidSubcommand {
        return format!("{sentence}; `abbe help` lists the commands");
    }
    sentence.to_owned()
}

fn planned(error: &Error) -> Option<&'static str> {
    use clap::error::{ContextKind, ContextValue};
    match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(typed)) => PLANNED.into_iter().find(|name| *name == typed),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(line: &str) -> String {
        let arguments: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        read(&arguments).unwrap_err().sentence()
    }

    #[test]
    fn every_mistake_is_one_line_that_names_it() {
        for (line, names) in [
            ("abbe frobnicate", "'frobnicate'"),
            ("abbe hom", "'home'"),
            ("abbe serve", "`abbe serve` is not in this version"),
            ("abbe move 1", "usage: abbe move"),
            ("abbe move 1 two --twin", "'two'"),
            ("abbe measure --runs 1 --out a", "1 is not in 2..=1000"),
            ("abbe home --tvin", "'--twin'"),
        ] {
            let told = told(line);
            assert!(told.contains(names) && !told.contains('\n'), "{line}: {told}");
            assert!(!told.starts_with("error"), "{told}");
        }
    }

    #[test]
    fn no_command_is_a_call_for_help() {
        for line in ["abbe", "abbe --json", "abbe --help", "abbe help", "abbe move --help"] {
            let arguments: Vec<OsString> = line.split(' ').map(OsString::from).collect();
            assert!(matches!(read(&arguments), Ok(Typed::Help(_))), "{line}");
        }
    }
}
