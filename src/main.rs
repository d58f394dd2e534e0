//! The `flexbody` program: parses the command line, runs, exits with a documented code.

use clap::Parser;
use flexbody::cli::{Arguments, run};
use flexbody::diagnostic::{Code, Diagnostic};
use flexbody::error::ExitCode;

fn main() -> std::process::ExitCode {
    let arguments = Arguments::parse();
    let code = std::panic::catch_unwind(|| run(&arguments)).unwrap_or_else(|_| {
        // The panic itself has been printed; this says what it means and what to do.
        eprintln!("{}", Diagnostic::new(Code::Internal, "the program stopped at a contradiction of its own"));
        ExitCode::Bug
    });
    std::process::ExitCode::from(code as u8)
}
