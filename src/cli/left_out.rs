//! Commands, options and formats that this build leaves out because a feature is off.

use clap::error::{ContextKind, ContextValue};
use flexbody_base::diagnostic::{Code, Diagnostic};

/// Feature of the program, and the words of the command line that need it.
struct Feature {
    name: &'static str,
    is_on: bool,
    commands: &'static [&'static str],
    options: &'static [&'static str],
    /// Values of options.
    values: &'static [&'static str],
}

/// Features that a build may leave out. A word that is missing here is refused without the name of its feature.
const FEATURES: [Feature; 4] = [
    Feature {
        name: "cluster",
        is_on: cfg!(feature = "cluster"),
        commands: &["prepare", "assemble", "batch"],
        options: &["--engine", "--ranks", "--solver", "--mpiexec", "--python", "--cluster-folder"],
        values: &[],
    },
    Feature {
        name: "embedded-c",
        is_on: cfg!(feature = "embedded-c"),
        commands: &[],
        options: &[],
        values: &["embedded"],
    },
    Feature {
        name: "import",
        is_on: cfg!(feature = "import"),
        commands: &["audit"],
        options: &["--from"],
        values: &[],
    },
    Feature {
        name: "response",
        is_on: cfg!(feature = "response"),
        commands: &["response"],
        options: &[],
        values: &[],
    },
];

/// Returns the names of the features that this build leaves out.
pub(super) fn features_left_out() -> Vec<&'static str> {
    FEATURES.iter().filter(|feature| !feature.is_on).map(|feature| feature.name).collect()
}

/// Returns the error about a word of the command line that needs a feature which is off; `None` for all other errors.
pub(super) fn what_is_left_out(error: &clap::Error) -> Option<Diagnostic> {
    let word = |kind| match error.get(kind) {
        Some(ContextValue::String(word)) => word.as_str(),
        _ => "",
    };
    let command = word(ContextKind::InvalidSubcommand);
    let (option, value) = (word(ContextKind::InvalidArg), word(ContextKind::InvalidValue));
    let needs = |feature: &&Feature| {
        feature.commands.contains(&command)
            || feature.options.contains(&option)
            || feature.values.contains(&value)
    };
    let feature = FEATURES.iter().filter(|feature| !feature.is_on).find(needs)?;
    let word = [command, value, option].into_iter().find(|word| !word.is_empty())?;
    let message = format!("`{word}` needs the feature `{}`, which this build leaves out", feature.name);
    let help = format!("build the program with --features {}, or with the default features", feature.name);
    Some(Diagnostic::new(Code::Usage, message).with_help(help))
}
