//! Parsing of a command line.

use super::Arguments;
use clap::{Command, CommandFactory, FromArgMatches};
use std::ffi::OsString;

impl Arguments {
    /// Returns the definition of the command line. A negative number is a value of every option, so that its own parser
    /// refuses it.
    pub fn definition() -> Command {
        Self::command().mut_subcommands(|command| {
            command.mut_args(|argument| {
                let takes_values = argument.get_action().takes_values() && !argument.is_positional();
                if takes_values { argument.allow_negative_numbers(true) } else { argument }
            })
        })
    }

    /// Parses a command line, whose first word is the name of the program.
    ///
    /// # Errors
    /// The errors of clap, among them the help that was asked for.
    pub fn parse_words(words: impl IntoIterator<Item = OsString>) -> Result<Self, clap::Error> {
        let mut program = Self::definition();
        let matches = program.try_get_matches_from_mut(words)?;
        Self::from_arg_matches(&matches).map_err(|error| error.format(&mut program))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Commands whose help has too many options for one list.
    const GROUPED: &[&str] =
        &["convert", "prepare", "assemble", "select", "trade", "simulate", "response", "export"];

    #[test]
    fn every_option_of_a_large_command_has_a_heading() {
        let program = Arguments::definition();
        for name in GROUPED {
            let command = program.find_subcommand(name).expect("a command");
            for option in command.get_arguments().filter(|argument| !argument.is_positional()) {
                assert!(option.get_help_heading().is_some(), "{name} --{} has no heading", option.get_id());
            }
        }
    }
}
