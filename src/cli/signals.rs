//! Signals that end the program: the unfinished files are removed first.
//!
//! SIGINT, SIGTERM and SIGHUP end the run with exit code 130, every other signal like its default action (128 + its
//! number in a shell). Signals that are not handled by default when the program starts, as under `nohup` and in
//! background jobs, are left unchanged. SIGPIPE and SIGXFSZ are errors of the write.
#![allow(unsafe_code)] // calls of the C library that ask for, set and raise signals

use super::exit::end;
use flexbody_base::children;
use flexbody_base::error::ExitCode;
use flexbody_base::output::{abandon_unfinished, abandon_unfinished_soon};
use libc::{c_int, sigaction, siginfo_t};
use signal_hook::iterator::Signals;
use std::io::{IsTerminal, Write};
use std::sync::{OnceLock, mpsc};
use std::time::Duration;

/// Time that child processes have to end before they are killed.
const CHILD_TIMEOUT: Duration = Duration::from_secs(10);

/// Signals of an interruption: exit code 130.
const INTERRUPTIONS: [c_int; 3] = [libc::SIGINT, libc::SIGTERM, libc::SIGHUP];

/// Signals of timers, limits, queues and users.
const OTHERS: [c_int; 7] = [
    libc::SIGQUIT,
    libc::SIGXCPU,
    libc::SIGALRM,
    libc::SIGVTALRM,
    libc::SIGPROF,
    libc::SIGUSR1,
    libc::SIGUSR2,
];

/// Signals that exist on Linux only.
#[cfg(target_os = "linux")]
const OF_LINUX: [c_int; 3] = [libc::SIGIO, libc::SIGPWR, libc::SIGSTKFLT];

/// Signals that the processor or the program itself raises; the thread does not continue after them.
const CRASHES: [c_int; 7] =
    [libc::SIGSEGV, libc::SIGBUS, libc::SIGILL, libc::SIGFPE, libc::SIGABRT, libc::SIGTRAP, libc::SIGSYS];

/// Handlers of [`CRASHES`] that were set before those of this program.
static BEFORE: [OnceLock<sigaction>; CRASHES.len()] = [const { OnceLock::new() }; CRASHES.len()];

/// Handles the signals from now on. If no handler can be set, the work is done nevertheless: the next run removes files
/// that an interruption leaves.
pub(super) fn handle() {
    let (ready, is_ready) = mpsc::channel();
    let wait = move || wait_for_signal(&ready);
    if std::thread::Builder::new().name("signals".to_owned()).spawn(wait).is_ok() {
        // The thread ends without a message if it cannot set its handlers.
        let _ = is_ready.recv();
    }
    handle_crashes();
}

/// Sets the handlers, notifies the caller, and ends the program at the first signal.
fn wait_for_signal(ready: &mpsc::Sender<()>) {
    let asked: Vec<c_int> = ending().into_iter().filter(|&signal| is_default(signal)).collect();
    match Signals::new(&asked) {
        Ok(mut signals) => {
            // The caller waits for this message.
            let _ = ready.send(());
            if let Some(signal) = signals.forever().next() {
                ended_by(signal);
            }
        }
        // Handlers without their owner would ignore the signals.
        Err(_) => asked.into_iter().for_each(by_default),
    }
}

/// Returns every signal whose default action ends the program, except [`CRASHES`].
fn ending() -> Vec<c_int> {
    let mut all = [&INTERRUPTIONS[..], &OTHERS].concat();
    #[cfg(target_os = "linux")]
    {
        all.extend(OF_LINUX);
        all.extend(libc::SIGRTMIN()..=libc::SIGRTMAX());
    }
    all
}

/// Returns true if the action of a signal is the default one.
fn is_default(signal: c_int) -> bool {
    action(signal).is_some_and(|action| action.sa_sigaction == libc::SIG_DFL)
}

fn is_ignored(signal: c_int) -> bool {
    action(signal).is_some_and(|action| action.sa_sigaction == libc::SIG_IGN)
}

/// Returns the action of a signal.
fn action(signal: c_int) -> Option<sigaction> {
    // SAFETY: zeros are valid for the structure, which the call fills.
    unsafe {
        let mut action: sigaction = std::mem::zeroed();
        (libc::sigaction(signal, std::ptr::null(), &mut action) == 0).then_some(action)
    }
}

/// Ends the process and its child processes at a signal.
fn ended_by(signal: c_int) -> ! {
    // The run has already ended with this code, and its outputs are in place.
    if let Some(code) = abandon_unfinished() {
        end(code);
    }
    let is_alone = end_children(signal);
    let mut stderr = std::io::stderr();
    // A progress bar may occupy the line.
    let line_end = if stderr.is_terminal() { "\n" } else { "" };
    let left = if is_alone {
        "no unfinished file is left"
    } else {
        "a program started by flexbody was killed; the next run removes its unfinished files"
    };
    let is_interruption = INTERRUPTIONS.contains(&signal);
    let what = if is_interruption { "interrupted".to_owned() } else { format!("ended by signal {signal}") };
    let _ = writeln!(stderr, "{line_end}{what}: {left}");
    if is_interruption {
        end(ExitCode::Interrupted);
    }
    raise_with_default_action(signal)
}

/// Ends the child processes and waits for them. Returns false if one of them had to be killed.
fn end_children(signal: c_int) -> bool {
    let known = if is_ignored(libc::SIGTERM) { signal } else { libc::SIGTERM };
    send(known, &children::close());
    let left = children::wait_for_all(CHILD_TIMEOUT);
    send(libc::SIGKILL, &left);
    left.is_empty()
}

/// Sends a signal to other processes. Errors for processes that have just ended are ignored.
fn send(signal: c_int, processes: &[u32]) {
    for &process in processes {
        // SAFETY: sends a signal to a child process.
        let _ = unsafe { libc::kill(process.cast_signed() as libc::pid_t, signal) };
    }
}

/// Restores the default action of a signal.
fn by_default(signal: c_int) {
    // SAFETY: sets the action of a signal.
    unsafe {
        libc::signal(signal, libc::SIG_DFL);
    }
}

/// Performs the default action of this signal, which ends the process.
fn raise_with_default_action(signal: c_int) -> ! {
    by_default(signal);
    // SAFETY: unblocks a signal for this thread, and raises it.
    unsafe {
        let mut this: libc::sigset_t = std::mem::zeroed();
        libc::sigemptyset(&mut this);
        libc::sigaddset(&mut this, signal);
        libc::pthread_sigmask(libc::SIG_UNBLOCK, &this, std::ptr::null_mut());
        libc::raise(signal);
        // Reached only if the signal does not end the process.
        libc::_exit(128 + signal)
    }
}

/// Handles [`CRASHES`] on the thread in which they occur, on its signal stack.
fn handle_crashes() {
    for (&signal, before) in CRASHES.iter().zip(&BEFORE) {
        let Some(found) = action(signal).filter(|found| found.sa_sigaction != libc::SIG_IGN) else {
            continue;
        };
        if before.set(found).is_err() {
            continue;
        }
        // SAFETY: zeros are valid for the structure; the handler has the type that SA_SIGINFO requires.
        unsafe {
            let mut action: sigaction = std::mem::zeroed();
            action.sa_sigaction = crashed as extern "C" fn(c_int, *mut siginfo_t, *mut libc::c_void) as usize;
            action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
            libc::sigaction(signal, &action, std::ptr::null_mut());
        }
    }
}

/// Removes the unfinished files, then passes the signal to the previous handler: the instruction that caused the signal
/// raises it again, or this function does. Nothing is allocated for paths of usual length.
extern "C" fn crashed(signal: c_int, info: *mut siginfo_t, _: *mut libc::c_void) {
    abandon_unfinished_soon();
    let before = CRASHES.iter().position(|&other| other == signal).and_then(|at| BEFORE[at].get());
    // SAFETY: the information from the system is valid during the call; the handler that is set existed before.
    unsafe {
        let is_of_instruction = matches!(signal, libc::SIGSEGV | libc::SIGBUS | libc::SIGILL | libc::SIGFPE);
        let is_raised_again = is_of_instruction && (*info).si_code > 0;
        match before {
            Some(before) if is_raised_again => {
                libc::sigaction(signal, before, std::ptr::null_mut());
            }
            _ => {
                libc::signal(signal, libc::SIG_DFL);
                libc::raise(signal);
            }
        }
    }
}
