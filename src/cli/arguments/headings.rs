//! Groups of options in the help of the commands with many of them.

use super::Arguments;
use clap::{Arg, ArgAction, Command, CommandFactory, FromArgMatches};
use std::ffi::OsString;

/// Headings in the order of the help.
const MODEL: &str = "Model";
const MODES: &str = "Modes";
const COST: &str = "Accuracy and cost";
const FRAME: &str = "Frame";
const COMPARISON: &str = "Comparison with lumped masses";
const SCENE: &str = "Scene";
const CLUSTER: &str = "Cluster";
const FORMAT: &str = "Format";
const LOSSES: &str = "Losses";
const PLACES: &str = "Places and frequencies";
const OUTPUT: &str = "Output";

/// Commands whose options are grouped.
const GROUPED: &[&str] =
    &["convert", "prepare", "assemble", "select", "trade", "simulate", "response", "export"];

/// Groups of options by their names, the same in every command.
const GROUPS: &[(&str, &[&str])] = &[
    (
        MODEL,
        &[
            "from",
            "format",
            "matrices",
            "units",
            "dimension",
            "interface",
            "damping",
            "stiffness",
            "mass",
            "nodes",
            "dofs",
            "allow_implausible",
            "keep_soft_rotations",
            "split",
            "model",
        ],
    ),
    (MODES, &["modes", "max_frequency", "basis", "shapes", "residual_vectors", "like", "prove"]),
    (
        COST,
        &[
            "accuracy",
            "factor",
            "memory_limit",
            "allow_long",
            "threads",
            "reference",
            "repeat",
            "tolerance",
            "points",
            "solves",
        ],
    ),
    (FRAME, &["frame"]),
    (COMPARISON, &["lumped", "lumped_modes"]),
    (SCENE, &["scene", "case", "terms", "keep_modes", "motion_shapes", "enrichment", "allow_unjudged"]),
    (CLUSTER, &["engine", "ranks", "solver", "mpiexec", "python", "cluster_folder", "indices"]),
    (FORMAT, &["to", "dialect", "mbdyn_level", "simulation", "to_units"]),
    (LOSSES, &["allow_loss"]),
    (PLACES, &["base", "rows", "band", "psd"]),
    (
        OUTPUT,
        &[
            "output",
            "storage",
            "mesh_triangles",
            "no_mesh",
            "report",
            "csv",
            "rms",
            "bodies",
            "envelope",
            "verbose",
            "json",
            "deny_warnings",
            "quiet",
            "help",
        ],
    ),
];

/// Options that have another group in a command than in the others.
const EXCEPTIONS: &[(&str, &str, &str)] = &[
    ("export", "points", FORMAT),
    ("export", "modes", FORMAT),
    ("export", "scene", LOSSES),
    ("response", "from", PLACES),
    ("response", "to", PLACES),
    ("simulate", "rows", OUTPUT),
];

impl Arguments {
    /// Returns the definition of the command line, with the options of large commands in groups. A negative number is a value of
    /// every option, so that its own parser refuses it.
    pub fn grouped() -> Command {
        let signed = |command: Command| {
            command.mut_args(|argument| {
                let takes_values = argument.get_action().takes_values() && !argument.is_positional();
                if takes_values { argument.allow_negative_numbers(true) } else { argument }
            })
        };
        let program = Self::command().mut_subcommands(signed);
        GROUPED.iter().fold(program, |program, name| {
            program.mut_subcommand(name, |command| {
                let help = Arg::new("help").short('h').long("help").action(ArgAction::Help);
                let command =
                    command.disable_help_flag(true).arg(help.help("Print help (see a summary with '-h')"));
                command.mut_args(|argument| match heading(name, argument.get_id().as_str()) {
                    Some(heading) if !argument.is_positional() => argument.help_heading(heading),
                    _ => argument,
                })
            })
        })
    }

    /// Parses a command line, whose first word is the name of the program.
    ///
    /// # Errors
    /// The errors of clap, among them the help that was asked for.
    pub fn parse_words(words: impl IntoIterator<Item = OsString>) -> Result<Self, clap::Error> {
        let mut program = Self::grouped();
        let matches = program.try_get_matches_from_mut(words)?;
        Self::from_arg_matches(&matches).map_err(|error| error.format(&mut program))
    }
}

/// Returns the heading of an option of a command.
fn heading(command: &str, option: &str) -> Option<&'static str> {
    let other = EXCEPTIONS.iter().find(|(place, name, _)| (*place, *name) == (command, option));
    let common = || GROUPS.iter().find(|(_, names)| names.contains(&option)).map(|(heading, _)| *heading);
    other.map(|(_, _, heading)| *heading).or_else(common)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_option_of_a_grouped_command_has_a_group_and_every_name_an_option() {
        let program = Arguments::grouped();
        let mut used = BTreeSet::new();
        for name in GROUPED {
            let command = program.find_subcommand(name).expect("a command");
            for option in command.get_arguments().filter(|argument| !argument.is_positional()) {
                let id = option.get_id().as_str();
                assert!(option.get_help_heading().is_some(), "{name} --{id} has no group");
                used.insert(id.to_owned());
            }
        }
        for name in GROUPS.iter().flat_map(|(_, names)| *names) {
            assert!(used.contains(*name), "no command has --{name}");
        }
        for (command, option, _) in EXCEPTIONS {
            let command = program.find_subcommand(command).expect("a command");
            assert!(command.get_arguments().any(|argument| argument.get_id() == option), "--{option}");
        }
    }
}
