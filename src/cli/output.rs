//! Printing of results and diagnostics, and the exit code.

use super::arguments::{Arguments, Command, Printing};
use super::resources::use_threads;
use super::{audit, check, compare, convert, export, inspect, select, simulate, trade};
use crate::diagnostic::{Code, Diagnostic, Severity};
use crate::error::{ExitCode, Result};
use crate::report::diagnostics_json;
use clap::Parser;
use std::io::Write;

/// What a command found: text for stdout (or JSON with `--json`), and whether its checks passed.
pub(super) struct Outcome {
    pub text: String,
    pub json: String,
    pub passed: bool,
}

/// The arguments of this process; where there is nothing to run, help or what is wrong is printed, and the exit code given.
///
/// # Errors
/// [`ExitCode::Done`] after help or the version, [`ExitCode::BadInput`] for a command line that is not understood.
pub fn parse() -> std::result::Result<Arguments, ExitCode> {
    Arguments::try_parse().map_err(|error| {
        let json = std::env::args_os().take_while(|word| word != "--").any(|word| word == "--json");
        if json && error.use_stderr() {
            let printing = Printing { json, quiet: false };
            return finish(printing, Err(Diagnostic::new(Code::Usage, first_paragraph(&error)).into()));
        }
        // Nobody is left to tell when the stream is closed.
        let _ = error.print();
        if error.use_stderr() { ExitCode::BadInput } else { ExitCode::Done }
    })
}

/// What clap says is wrong, in one line, without its tips and its usage.
fn first_paragraph(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let lines: Vec<&str> = text.lines().map(str::trim).take_while(|line| !line.is_empty()).collect();
    lines.join(" ").trim_start_matches("error: ").to_owned()
}

/// Runs the command and prints its outcome.
pub fn run(arguments: &Arguments) -> ExitCode {
    use_threads(match &arguments.command {
        Command::Convert(arguments) => arguments.threads,
        Command::Trade(arguments) => arguments.threads,
        Command::Select(arguments) => arguments.threads,
        Command::Simulate(arguments) => arguments.threads,
        _ => None,
    });
    let (printing, outcome) = match &arguments.command {
        Command::Convert(arguments) => (arguments.printing, convert::run(arguments)),
        Command::Inspect(arguments) => (arguments.printing, inspect::run(arguments)),
        Command::Check(arguments) => (arguments.printing, check::run(arguments)),
        Command::Compare(arguments) => (arguments.printing, compare::run(arguments)),
        Command::Select(arguments) => (arguments.printing, select::run(arguments)),
        Command::Simulate(arguments) => (arguments.printing, simulate::run(arguments)),
        Command::Trade(arguments) => (arguments.printing, trade::run(arguments)),
        Command::Export(arguments) => (arguments.printing, export::run(arguments)),
        Command::Audit(arguments) => (arguments.printing, audit::run(arguments)),
    };
    finish(printing, outcome)
}

fn finish(printing: Printing, outcome: Result<Outcome>) -> ExitCode {
    match outcome {
        Ok(outcome) => {
            let printed = if printing.json {
                print(&outcome.json)
            } else if !printing.quiet {
                print(&outcome.text)
            } else {
                Ok(())
            };
            if let Err(error) = printed {
                let message = format!("the results cannot be printed: {error}");
                tell(
                    Printing { json: false, ..printing },
                    &[Diagnostic::new(Code::OutputUnwritable, message)],
                );
                return ExitCode::Resources;
            }
            if outcome.passed { ExitCode::Done } else { ExitCode::CheckFailed }
        }
        Err(error) => {
            let code = error.exit_code();
            if printing.json {
                let mut json = diagnostics_json(error.diagnostics());
                json["exit_code"] = (code as u8).into();
                // The exit code tells it as well.
                let _ = print(&format!("{json:#}"));
            } else {
                tell(printing, error.diagnostics());
            }
            code
        }
    }
}

/// Prints diagnostics to stderr: all of them, or errors only when quiet; none with `--json`, whose output has them.
pub(super) fn tell(printing: Printing, diagnostics: &[Diagnostic]) {
    if printing.json {
        return;
    }
    let mut stderr = std::io::stderr().lock();
    for diagnostic in diagnostics.iter().filter(|d| !printing.quiet || d.severity() == Severity::Error) {
        // Nobody is left to tell when stderr is closed.
        let _ = writeln!(stderr, "{diagnostic}");
    }
}

/// Prints to stdout; a reader that went away (`| head`) is not an error.
fn print(text: &str) -> std::io::Result<()> {
    let mut stdout = std::io::stdout().lock();
    let newline = if text.ends_with('\n') { "" } else { "\n" };
    match write!(stdout, "{text}{newline}").and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        printed => printed,
    }
}
