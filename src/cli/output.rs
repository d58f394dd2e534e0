//! Execution of a command, output of results and diagnostics, and the exit code.

use super::arguments::{Arguments, Command, Printing};
use super::outcome::{Outcome, warnings};
use super::resources::{memory_left, use_threads};
use super::terminal::{colours_of_stderr, for_terminal};
use super::{
    advise, assemble, audit, batch, check, compare, completions, convert, doctor, explain, export, inspect,
    measure, prepare, recipe, recover, reduce, response, select, shapes, simulate, trade, view,
};
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
        if words().any(|word| word == "--json") && error.use_stderr() {
            let printing = Printing { json: true, quiet: false, deny_warnings: false };
            let given = words().find_map(|word| command_named(word.to_str()?));
            return finish(
                given.as_deref(),
                printing,
                Err(Diagnostic::new(Code::Usage, first_paragraph(&error)).into()),
            );
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
    use_threads(match &arguments.command {
        Command::Convert(arguments) => arguments.threads,
        Command::Trade(arguments) => arguments.threads,
        Command::Select(arguments) => arguments.threads,
        Command::Simulate(arguments) => arguments.threads,
        Command::Response(arguments) => arguments.threads,
        Command::Assemble(arguments) => arguments.threads,
        _ => None,
    });
    let (name, printing) = command_of(arguments);
    read_files::begin_run();
    begin_run();
    set_left(|| memory_left(None));
    // Run inside the thread pool: from any other thread, every parallel loop would be handed over while this thread
    // sleeps.
    let outcome = rayon::scope(|_| outcome_of(arguments));
    stand_by();
    let has_outcome = outcome.is_ok();
    let code = finish(Some(name), printing, outcome);
    end_run(code, has_outcome && matches!(code, ExitCode::Done | ExitCode::CheckFailed));
    code
}

fn outcome_of(arguments: &Arguments) -> Result<Outcome> {
    match &arguments.command {
        Command::Convert(arguments) => convert::run(arguments),
        Command::Prepare(arguments) => prepare::run(arguments),
        Command::Assemble(arguments) => assemble::run(arguments),
        Command::Batch(arguments) => batch::run(arguments),
        Command::Inspect(arguments) => inspect::run(arguments),
        Command::Check(arguments) => check::run(arguments),
        Command::Compare(arguments) => compare::run(arguments),
        Command::Select(arguments) => select::run(arguments),
        Command::Simulate(arguments) => simulate::run(arguments),
        Command::Trade(arguments) => trade::run(arguments),
        Command::Response(arguments) => response::run(arguments),
        Command::Measure(arguments) => measure::run(arguments),
        Command::Recover(arguments) => recover::run(arguments),
        Command::Shapes(arguments) => shapes::run(arguments),
        Command::Reduce(arguments) => reduce::run(arguments),
        Command::Advise(arguments) => advise::run(arguments),
        Command::View(arguments) => view::run(arguments),
        Command::Export(arguments) => export::run(arguments),
        Command::Audit(arguments) => audit::run(arguments),
        Command::Recipe(arguments) => recipe::run(arguments),
        Command::Explain(arguments) => explain::run(arguments),
        Command::Doctor(_) => doctor::run(),
        Command::Completions(arguments) => completions::completions(arguments),
        Command::Man(arguments) => completions::man(arguments),
    }
}

fn command_of(arguments: &Arguments) -> (&'static str, Printing) {
    match &arguments.command {
        Command::Convert(arguments) => ("convert", arguments.printing),
        Command::Prepare(arguments) => ("prepare", arguments.printing),
        Command::Assemble(arguments) => ("assemble", arguments.printing),
        Command::Batch(arguments) => ("batch", arguments.printing),
        Command::Inspect(arguments) => ("inspect", arguments.printing),
        Command::Check(arguments) => ("check", arguments.printing),
        Command::Compare(arguments) => ("compare", arguments.printing),
        Command::Select(arguments) => ("select", arguments.printing),
        Command::Simulate(arguments) => ("simulate", arguments.printing),
        Command::Trade(arguments) => ("trade", arguments.printing),
        Command::Response(arguments) => ("response", arguments.printing),
        Command::Measure(arguments) => ("measure", arguments.printing),
        Command::Recover(arguments) => ("recover", arguments.printing),
        Command::Shapes(arguments) => ("shapes", arguments.printing),
        Command::Reduce(arguments) => ("reduce", arguments.printing),
        Command::Advise(arguments) => ("advise", arguments.printing),
        Command::View(arguments) => ("view", arguments.printing),
        Command::Export(arguments) => ("export", arguments.printing),
        Command::Audit(arguments) => ("audit", arguments.printing),
        Command::Recipe(arguments) => ("recipe", arguments.printing),
        Command::Explain(arguments) => ("explain", arguments.printing),
        Command::Doctor(arguments) => ("doctor", arguments.printing),
        Command::Completions(arguments) => ("completions", arguments.printing),
        Command::Man(arguments) => ("man", arguments.printing),
    }
}

/// Reports an internal error.
pub(super) fn report_internal_error(arguments: &Arguments) -> ExitCode {
    let (name, printing) = command_of(arguments);
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
