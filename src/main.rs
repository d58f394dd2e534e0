//! The `flexbody` program: parses the command line, runs, exits with a documented code.

mod process;

use flexbody::program::{Arguments, abandon_unfinished, parse, processes, run, tell_bug};
use flexbody::{Code, Diagnostic, ExitCode};
use std::io::{IsTerminal, Write};

#[global_allocator]
static ALLOCATOR: process::Allocator = process::Allocator;

fn main() -> std::process::ExitCode {
    keep_freed_memory();
    process::prepare();
    let arguments = match parse(&std::env::args_os().collect::<Vec<_>>()) {
        Ok(arguments) => arguments,
        Err(code) => return std::process::ExitCode::from(code as u8),
    };
    // Where no handler can be set the work is done all the same: an interruption then leaves a temporary
    // file, which the next run removes.
    let ignored = process::Ignored::now();
    let _ = ctrlc::set_handler(interrupted);
    // A run of hours goes on when its terminal closes.
    ignored.again();
    std::process::ExitCode::from(work(arguments) as u8)
}

/// Runs the command on a thread of its own: its stack is there before the work, while that of the main thread
/// grows during it and ends the process by a signal where there is no memory left.
fn work(arguments: Arguments) -> ExitCode {
    const STACK: usize = 8 << 20;
    std::thread::scope(|scope| {
        let worker = std::thread::Builder::new().name("flexbody".to_owned()).stack_size(STACK);
        match worker.spawn_scoped(scope, || run(&arguments)) {
            // The panic itself has been printed; this says what it means and what to do.
            Ok(worker) => worker.join().unwrap_or_else(|_| tell_bug(&arguments)),
            Err(error) => {
                let message = format!("not enough memory: no thread can be started: {error}");
                eprintln!("{}", Diagnostic::new(Code::MemoryShort, message));
                ExitCode::Resources
            }
        }
    })
}

/// Tells the allocator to keep freed blocks for later ones: given back to the system, they come again page by
/// page, cleared (measured: 50 000 page faults and 1 of 15 CPU seconds on a model of 100 000 degrees of
/// freedom).
#[allow(unsafe_code)]
fn keep_freed_memory() {
    /// `mi_option_purge_delay` of mimalloc 3, which the bindings do not name, and its default in
    /// milliseconds.
    const PURGE_DELAY: (i32, i64) = (15, 1000);
    // SAFETY: reads and sets a number inside the allocator, before any thread is started. Where the number is
    // not the default, the user has set it, or it is another option in that version of the allocator.
    unsafe {
        if libmimalloc_sys::mi_option_get(PURGE_DELAY.0) == PURGE_DELAY.1 {
            libmimalloc_sys::mi_option_set(PURGE_DELAY.0, -1);
        }
    }
}

/// Ctrl-C, or SIGTERM: ends the process at once, whatever it is doing, and the programs that it waits for.
fn interrupted() {
    process::interrupt(&processes());
    abandon_unfinished();
    let mut stderr = std::io::stderr();
    // A progress bar may stand on the line.
    let line_end = if stderr.is_terminal() { "\n" } else { "" };
    let _ = writeln!(stderr, "{line_end}interrupted: no unfinished file is left");
    process::end(ExitCode::Interrupted);
}
