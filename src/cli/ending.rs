//! Early end of the program: by a signal, or at an internal error.

use super::arguments::Arguments;
use super::exit::end;
use super::output::report_internal_error;
#[cfg(unix)]
use super::signals;
use flexbody_base::error::ExitCode;
use flexbody_base::output::abandon_unfinished_soon;
use std::panic::PanicHookInfo;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Ensures that the process, which runs this command and nothing else, leaves no unfinished file however it ends.
pub fn end_without_unfinished_files(arguments: &'static Arguments) {
    #[cfg(unix)]
    signals::handle();
    #[cfg(not(unix))]
    let _ = ctrlc::set_handler(interrupted);
    let print = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| panicked(panic, &print, arguments)));
}

/// Ends the program with exit code 70 at a panic on any thread. The released program has no tables for unwinding, and
/// would end by SIGABRT otherwise.
fn panicked(panic: &PanicHookInfo<'_>, print: &dyn Fn(&PanicHookInfo<'_>), arguments: &Arguments) {
    static HAS_BEGUN: AtomicBool = AtomicBool::new(false);
    if HAS_BEGUN.swap(true, Ordering::SeqCst) {
        // Another thread ends the program, or this one panics again.
        std::thread::sleep(Duration::from_secs(10));
        end(ExitCode::Bug);
    }
    print(panic);
    abandon_unfinished_soon();
    end(report_internal_error(arguments))
}

/// Ends the process at Ctrl-C.
#[cfg(not(unix))]
fn interrupted() {
    use std::io::Write;
    let ended = flexbody_base::output::abandon_unfinished();
    let _ = writeln!(std::io::stderr(), "interrupted: no unfinished file is left");
    end(ended.unwrap_or(ExitCode::Interrupted));
}
