//! Execution of a command, output of results and diagnostics, and the exit code.

use super::arguments::{Arguments, Printing};
use super::invocation::Invocation;
use super::left_out::what_is_left_out;
use super::outcome::{Outcome, warnings};
use super::resources::{memory_left, use_threads};
use super::terminal::{colours_of_stderr, for_terminal};
use clap::CommandFactory;
use flexbody_base::diagnostic::{Code, Diagnostic, Severity};
use flexbody_base::error::{ExitCode, Result};
use flexbody_base::memory::set_left;
use flexbody_base::output::{begin_run, end_run, stand_by};
use flexbody_base::read_files;
use flexbody_report::output_json;
use std::ffi::OsString;
use std::io::{IsTerminal, Write};

/// Parses a command line, whose first word is the name of the program. If there is nothing to run, prints help or an
/// error and returns the exit code.
///
/// # Errors
/// [`ExitCode::Done`] after help or the version, [`ExitCode::BadInput`] for an invalid command line.
pub fn parse(words: &[OsString]) -> std::result::Result<Arguments, ExitCode> {
    Arguments::parse_words(words.iter().cloned()).map_err(|error| {
        let words = || words.iter().skip(1).take_while(|word| *word != "--");
        let json = words().any(|word| word == "--json");
        let left_out = what_is_left_out(&error);
        if left_out.is_some() || (json && error.use_stderr()) {
            let printing = Printing { json, quiet: false, deny_warnings: false };
            let given = words().find_map(|word| command_named(word.to_str()?));
            let found = left_out.unwrap_or_else(|| Diagnostic::new(Code::Usage, first_paragraph(&error)));
            return finish(given.as_deref(), printing, Err(found.into()));
        }
        // An error of a closed stream cannot be reported.
        let _ = error.print();
        if error.use_stderr() { ExitCode::BadInput } else { ExitCode::Done }
    })
}

/// Returns the command of that name.
fn command_named(word: &str) -> Option<String> {
    Arguments::command().find_subcommand(word).map(|command| command.get_name().to_owned())
}

/// Returns the error message of clap in one line, without its tips and its usage.
fn first_paragraph(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let lines: Vec<&str> = text.lines().map(str::trim).take_while(|line| !line.is_empty()).collect();
    lines.join(" ").trim_start_matches("error: ").to_owned()
}

/// Runs the command and prints its outcome.
pub fn run(arguments: &Arguments) -> ExitCode {
    let invocation = Invocation::of(&arguments.command);
    use_threads(invocation.threads);
    read_files::begin_run();
    begin_run();
    set_left(|| memory_left(None));
    // Run inside the thread pool: from any other thread, every parallel loop would be handed over while this thread
    // sleeps.
    let outcome = rayon::scope(|_| invocation.run());
    stand_by();
    let has_outcome = outcome.is_ok();
    let code = finish(Some(invocation.name), invocation.printing, outcome);
    end_run(code, has_outcome && matches!(code, ExitCode::Done | ExitCode::CheckFailed));
    code
}

/// Reports an internal error.
pub(super) fn report_internal_error(arguments: &Arguments) -> ExitCode {
    let Invocation { name, printing, .. } = Invocation::of(&arguments.command);
    let message = "internal error: the program stopped";
    finish(Some(name), printing, Err(Diagnostic::new(Code::Internal, message).into()))
}

fn finish(command: Option<&str>, printing: Printing, outcome: Result<Outcome>) -> ExitCode {
    let (results, diagnostics, code, text) = match outcome {
        Ok(outcome) => {
            let denied = printing.deny_warnings && warnings(&outcome.diagnostics).next().is_some();
            let code = if outcome.passed && !denied { ExitCode::Done } else { ExitCode::CheckFailed };
            (Some(outcome.json), outcome.diagnostics, code, Some(outcome.text))
        }
        Err(error) => (None, error.diagnostics().to_vec(), error.exit_code(), None),
    };
    print_diagnostics(printing, &diagnostics);
    let printed = match text {
        _ if printing.json => print(&output_json(command, code, &diagnostics, results.as_deref())),
        Some(text) if !printing.quiet => print(&for_terminal(&text)),
        _ => Ok(()),
    };
    match printed {
        Ok(()) => code,
        Err(error) => {
            let message = format!("the results cannot be printed: {error}");
            let unprinted = Diagnostic::new(Code::OutputUnwritable, message);
            print_diagnostics(Printing { json: false, ..printing }, &[unprinted]);
            // A failure of the work itself determines the exit code.
            if code == ExitCode::Done { ExitCode::Resources } else { code }
        }
    }
}

/// Prints diagnostics to stderr: all of them, or errors only if quiet. Prints none with `--json`, whose output contains
/// them. On a terminal, a last line names the command that explains the first error.
fn print_diagnostics(printing: Printing, diagnostics: &[Diagnostic]) {
    if printing.json {
        return;
    }
    let coloured = colours_of_stderr();
    let mut stderr = std::io::stderr().lock();
    for diagnostic in diagnostics.iter().filter(|d| !printing.quiet || d.severity() == Severity::Error) {
        let text = diagnostic.to_string();
        let text = if coloured { painted(diagnostic.severity(), &text) } else { text };
        // An error of a closed stderr cannot be reported.
        let _ = writeln!(stderr, "{text}");
    }
    if !printing.quiet
        && stderr.is_terminal()
        && let Some(error) = diagnostics.iter().find(|diagnostic| diagnostic.severity() == Severity::Error)
    {
        let more = format!("more: flexbody explain {}", error.code().id());
        let more = if coloured { format!("\u{1b}[2m{more}\u{1b}[0m") } else { more };
        let _ = writeln!(stderr, "{more}");
    }
}

/// Returns a diagnostic with its severity and code in colour.
fn painted(severity: Severity, text: &str) -> String {
    let colour = match severity {
        Severity::Error => "1;31",
        Severity::Warning => "1;33",
        Severity::Note => "36",
    };
    text.split_once(": ")
        .map_or_else(|| text.to_owned(), |(head, rest)| format!("\u{1b}[{colour}m{head}\u{1b}[0m: {rest}"))
}

/// Prints to stdout. A closed pipe (`| head`) is not an error.
fn print(text: &str) -> std::io::Result<()> {
    let mut stdout = std::io::stdout().lock();
    let newline = if text.ends_with('\n') { "" } else { "\n" };
    match write!(stdout, "{text}{newline}").and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        printed => printed,
    }
}
