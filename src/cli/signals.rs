//! Signals that end a program which does not know them: the unfinished files are removed first.
//!
//! SIGINT, SIGTERM and SIGHUP end the run with exit code 130, every other one as if the program did not know it
//! (128 + its number in a shell). Signals that are not handled by default when the program starts, as `nohup` and jobs
//! in the background have it, stay as they are. SIGPIPE and SIGXFSZ are errors of the write.
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

/// Seconds that programs which this one has started have to end themselves before they are killed.
const PATIENCE: Duration = Duration::from_secs(10);

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

/// Signals of Linux alone.
#[cfg(target_os = "linux")]
const OF_LINUX: [c_int; 3] = [libc::SIGIO, libc::SIGPWR, libc::SIGSTKFLT];

/// Signals that the processor or the program itself raises: the thread does not go on after them.
const CRASHES: [c_int; 7] =
    [libc::SIGSEGV, libc::SIGBUS, libc::SIGILL, libc::SIGFPE, libc::SIGABRT, libc::SIGTRAP, libc::SIGSYS];

/// Handlers of [`CRASHES`] before those of this program.
static BEFORE: [OnceLock<sigaction>; CRASHES.len()] = [const { OnceLock::new() }; CRASHES.len()];

/// Handles the signals from here on. Where no handler can be set the work is done all the same: what an interruption
/// then leaves is removed by the next run.
pub(super) fn handle() {
    let (ready, is_ready) = mpsc::channel();
    let wait = move || wait_for_signal(&ready);
    if std::thread::Builder::new().name("signals".to_owned()).spawn(wait).is_ok() {
        // The thread ends without a word where it cannot set its handlers.
        let _ = is_ready.recv();
    }
    handle_crashes();
}

/// Sets the handlers, says so, and ends the program at the first signal.
fn wait_for_signal(ready: &mpsc::Sender<()>) {
    let asked: Vec<c_int> = ending().into_iter().filter(|&signal| is_default(signal)).collect();
    match Signals::new(&asked) {
        Ok(mut signals) => {
            // The caller waits for it.
            let _ = ready.send(());
            if let Some(signal) = signals.forever().next() {
                ended_by(signal);
            }
        }
        // Handlers without their owner would ignore the signals.
        Err(_) => asked.into_iter().for_each(by_default),
    }
}

/// Every signal whose default is the end of the program, without [`CRASHES`].
fn ending() -> Vec<c_int> {
    let mut all = [&INTERRUPTIONS[..], &OTHERS].concat();
    #[cfg(target_os = "linux")]
    {
        all.extend(OF_LINUX);
        all.extend(libc::SIGRTMIN()..=libc::SIGRTMAX());
    }
    all
}

/// True if the system does with a signal what it does by default.
fn is_default(signal: c_int) -> bool {
    action(signal).is_some_and(|action| action.sa_sigaction == libc::SIG_DFL)
}

fn is_ignored(signal: c_int) -> bool {
    action(signal).is_some_and(|action| action.sa_sigaction == libc::SIG_IGN)
}

/// Handling of a signal.
fn action(signal: c_int) -> Option<sigaction> {
    // SAFETY: zeros are valid for the structure, which the call fills.
    unsafe {
        let mut action: sigaction = std::mem::zeroed();
        (libc::sigaction(signal, std::ptr::null(), &mut action) == 0).then_some(action)
    }
}

/// Ends the process, whatever it is doing, and the programs that it waits for.
fn ended_by(signal: c_int) -> ! {
    // The outputs are in their places: the run has ended with this code.
    if let Some(code) = abandon_unfinished() {
        end(code);
    }
    let is_alone = end_children(signal);
    let mut stderr = std::io::stderr();
    // A progress bar may stand on the line.
    let line_end = if stderr.is_terminal() { "\n" } else { "" };
    let left = if is_alone {
        "no unfinished file is left"
    } else {
        "a program that this one had started was killed; the next run removes its unfinished files"
    };
    let is_interruption = INTERRUPTIONS.contains(&signal);
    let what = if is_interruption { "interrupted".to_owned() } else { format!("ended by signal {signal}") };
    let _ = writeln!(stderr, "{line_end}{what}: {left}");
    if is_interruption {
        end(ExitCode::Interrupted);
    }
    as_by_default(signal)
}

/// Ends the programs that this one has started and waits for them; false if one of them had to be killed.
fn end_children(signal: c_int) -> bool {
    let known = if is_ignored(libc::SIGTERM) { signal } else { libc::SIGTERM };
    send(known, &children::close());
    let left = children::wait_for_all(PATIENCE);
    send(libc::SIGKILL, &left);
    left.is_empty()
}

/// Sends a signal to other processes; one that has just ended gets none.
fn send(signal: c_int, processes: &[u32]) {
    for &process in processes {
        // SAFETY: sends a signal to a program that this one has started.
        let _ = unsafe { libc::kill(process.cast_signed() as libc::pid_t, signal) };
    }
}

/// Leaves a signal to the system again.
fn by_default(signal: c_int) {
    // SAFETY: sets how a signal is handled.
    unsafe {
        libc::signal(signal, libc::SIG_DFL);
    }
}

/// Does what the system does with this signal by default, which is the end of the process.
fn as_by_default(signal: c_int) -> ! {
    by_default(signal);
    // SAFETY: lets a signal through to this thread, and sends it to it.
    unsafe {
        let mut this: libc::sigset_t = std::mem::zeroed();
        libc::sigemptyset(&mut this);
        libc::sigaddset(&mut this, signal);
        libc::pthread_sigmask(libc::SIG_UNBLOCK, &this, std::ptr::null_mut());
        libc::raise(signal);
        // Only where the signal does not end the process after all.
        libc::_exit(128 + signal)
    }
}

/// Handles [`CRASHES`] in the thread that they happen in, on its stack for signals.
fn handle_crashes() {
    for (&signal, before) in CRASHES.iter().zip(&BEFORE) {
        let Some(found) = action(signal).filter(|found| found.sa_sigaction != libc::SIG_IGN) else {
            continue;
        };
        if before.set(found).is_err() {
            continue;
        }
        // SAFETY: zeros are valid for the structure; the handler has the type that SA_SIGINFO promises.
        unsafe {
            let mut action: sigaction = std::mem::zeroed();
            action.sa_sigaction = crashed as extern "C" fn(c_int, *mut siginfo_t, *mut libc::c_void) as usize;
            action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
            libc::sigaction(signal, &action, std::ptr::null_mut());
        }
    }
}

/// Removes the unfinished files, then leaves the signal to the handler before this one: it is raised again by the
/// instruction that caused it, or here. None of this allocates for paths of usual length.
extern "C" fn crashed(signal: c_int, info: *mut siginfo_t, _: *mut libc::c_void) {
    abandon_unfinished_soon();
    let before = CRASHES.iter().position(|&other| other == signal).and_then(|at| BEFORE[at].get());
    // SAFETY: the system hands over information that is valid during the call; the handler that is set was there before.
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
