//! Commands `flexbody completions` and `flexbody man`: input for shells and for `man`, generated from the definition of
//! the arguments.

use super::arguments::{Arguments, CompletionsArguments, ManArguments};
use super::outcome::Outcome;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;

const PROGRAM: &str = "flexbody";

pub(super) fn completions(arguments: &CompletionsArguments) -> Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::definition(), PROGRAM, &mut script);
    printed(script)
}

pub(super) fn man(arguments: &ManArguments) -> Result<Outcome> {
    // Adds the common options to the commands.
    let mut program = Arguments::definition();
    program.build();
    let page = match &arguments.command {
        None => clap_mangen::Man::new(program),
        Some(name) => {
            let found = program.find_subcommand(name).ok_or_else(|| {
                let message = format!("`{name}` is not a command");
                Diagnostic::new(Code::Usage, message).with_help("list the commands with flexbody --help")
            })?;
            clap_mangen::Man::new(found.clone())
        }
    };
    let mut text = Vec::new();
    page.render(&mut text).map_err(|error| Diagnostic::new(Code::OutputUnwritable, error.to_string()))?;
    printed(text)
}

/// Returns the outcome of a text that is printed unchanged.
fn printed(text: Vec<u8>) -> Result<Outcome> {
    let text = String::from_utf8_lossy(&text).into_owned();
    let json = serde_json::json!({ "text": text }).to_string();
    Ok(Outcome { text, json, diagnostics: Vec::new(), passed: true })
}
