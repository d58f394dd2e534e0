//! The `flexbody` program: parses the command line, runs, exits with a documented code.

mod process;

use flexbody::program::{Arguments, end_without_unfinished_files, parse, run, state_command};
use flexbody::{Code, Diagnostic, ExitCode};
use std::io::Write;

#[global_allocator]
static ALLOCATOR: process::Allocator = process::Allocator;

/// Runs the command on a thread of its own: its stack is there before the work, while that of the main thread
/// grows during it, up to a limit that may be small, and ends the process by a signal where there is no memory left.
fn main() -> std::process::ExitCode {
    const STACK: usize = 8 << 20;
    keep_freed_memory();
    process::prepare();
    let worker = std::thread::Builder::new().name("flexbody".to_owned()).stack_size(STACK);
    let code = match worker.spawn(command) {
        // A panic ends the process.
        Ok(worker) => worker.join().unwrap_or(ExitCode::Bug),
        Err(error) => {
            let message = format!("not enough memory to start the threads: {error}");
            let _ = writeln!(std::io::stderr(), "{}", Diagnostic::new(Code::MemoryShort, message));
            ExitCode::Resources
        }
    };
    std::process::ExitCode::from(code as u8)
}

fn command() -> ExitCode {
    let arguments: &'static Arguments = match parse(&std::env::args_os().collect::<Vec<_>>()) {
        Ok(arguments) => Box::leak(Box::new(arguments)),
        Err(code) => return code,
    };
    state_command(&std::env::args_os().collect::<Vec<_>>());
    end_without_unfinished_files(arguments);
    run(arguments)
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
