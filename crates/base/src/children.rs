//! Programs that this one has started and waits for. They end with it: an interruption of this one alone, as by a queue
//! that ends a job, is passed on to them, and on Linux they are terminated where this one is killed.
#![cfg_attr(target_os = "linux", allow(unsafe_code))] // a system call between fork and exec

use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Interval at which [`wait_for_all`] looks.
const INTERVAL: Duration = Duration::from_millis(2);

static RUNNING: Mutex<Running> = Mutex::new(Running { processes: Vec::new(), is_closed: false });

struct Running {
    processes: Vec<u32>,
    /// True if this program is about to end and starts no other one.
    is_closed: bool,
}

/// Runs a program to its end, and keeps what it prints.
///
/// # Errors
/// An error if the program cannot be started, or this program is about to end.
pub fn output(command: &mut Command) -> std::io::Result<Output> {
    let child = start(command.stdout(Stdio::piped()).stderr(Stdio::piped()))?;
    output_of(child)
}

/// Starts a program that ends with this one; [`output_of`] waits for it, on the same thread.
///
/// # Errors
/// An error if the program cannot be started, or this program is about to end.
pub fn start(command: &mut Command) -> std::io::Result<Child> {
    end_with_this_process(command);
    let mut running = running();
    if running.is_closed {
        return Err(std::io::ErrorKind::Interrupted.into());
    }
    let child = command.spawn()?;
    running.processes.push(child.id());
    Ok(child)
}

/// Waits for the end of a program that [`start`] has started, and keeps what it prints.
///
/// # Errors
/// Every error of reading the output of the program.
pub fn output_of(child: Child) -> std::io::Result<Output> {
    let id = child.id();
    let output = child.wait_with_output();
    running().processes.retain(|other| *other != id);
    output
}

/// Process numbers of the programs that run now; from here on no other one is started.
pub fn close() -> Vec<u32> {
    let mut running = running();
    running.is_closed = true;
    running.processes.clone()
}

/// Waits until all programs have ended, for `patience` at the most; returns those that still run.
pub fn wait_for_all(patience: Duration) -> Vec<u32> {
    let began = Instant::now();
    loop {
        let left = running().processes.clone();
        if left.is_empty() || began.elapsed() >= patience {
            return left;
        }
        std::thread::sleep(INTERVAL);
    }
}

fn running() -> MutexGuard<'static, Running> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Has the system send SIGTERM to the program when the thread ends that starts it, which waits for it.
#[cfg(target_os = "linux")]
fn end_with_this_process(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    let parent = std::process::id();
    let ask = move || {
        // SAFETY: system calls, which may be made between fork and exec; the numbers are of the types that they expect.
        let is_orphan = unsafe {
            libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGTERM as libc::c_ulong);
            libc::getppid().cast_unsigned() != parent
        };
        // The parent has ended before the system knew of the wish.
        if is_orphan { Err(std::io::ErrorKind::Interrupted.into()) } else { Ok(()) }
    };
    // SAFETY: the closure makes system calls and nothing else: it allocates nothing and takes no lock.
    unsafe { command.pre_exec(ask) };
}

#[cfg(not(target_os = "linux"))]
fn end_with_this_process(_: &mut Command) {}
