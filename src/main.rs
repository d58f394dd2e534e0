//! The `flexbody` program: parses the command line, runs, exits with a documented code.

use flexbody::cli::{parse, run, tell_bug};
use flexbody::error::ExitCode;
use std::io::{IsTerminal, Write};

// Large blocks come and go on all threads: the system allocator gives them back each time, and the page faults and
// interrupts of that cost more than the work (measured: half of the factorisation time on two threads).
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    keep_freed_memory();
    let arguments = match parse() {
        Ok(arguments) => arguments,
        Err(code) => return std::process::ExitCode::from(code as u8),
    };
    // Where no handler can be set the work is done all the same: an interruption then leaves a temporary file.
    let _ = ctrlc::set_handler(interrupted);
    let code = std::panic::catch_unwind(|| run(&arguments)).unwrap_or_else(|_| {
        // The panic itself has been printed; this says what it means and what to do.
        tell_bug(&arguments)
    });
    std::process::ExitCode::from(code as u8)
}

/// Tells the allocator to keep freed blocks for later ones: given back to the system, they come again page by page, cleared
/// (measured: 50 000 page faults and 1 of 15 CPU seconds on a model of 100 000 degrees of freedom).
#[allow(unsafe_code)]
fn keep_freed_memory() {
    /// `mi_option_purge_delay` of mimalloc 3, which the bindings do not name, and its default in milliseconds.
    const PURGE_DELAY: (i32, i64) = (15, 1000);
    // SAFETY: reads and sets a number inside the allocator, before any thread is started. Where the number is not the default,
    // the user has set it, or it is another option in that version of the allocator.
    unsafe {
        if libmimalloc_sys::mi_option_get(PURGE_DELAY.0) == PURGE_DELAY.1 {
            libmimalloc_sys::mi_option_set(PURGE_DELAY.0, -1);
        }
    }
}

/// Ctrl-C, or SIGTERM: ends the process at once, whatever it is doing.
fn interrupted() {
    flexbody::output::abandon_unfinished();
    let mut stderr = std::io::stderr();
    // A progress bar may stand on the line.
    let line_end = if stderr.is_terminal() { "\n" } else { "" };
    let _ = writeln!(stderr, "{line_end}interrupted: no unfinished file is left");
    std::process::exit(ExitCode::Interrupted as i32);
}
