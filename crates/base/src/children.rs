//! Child processes. They end with this program: if this program alone is interrupted, as by a batch queue, the signal
//! is passed on to them; on Linux they are terminated if this program is killed.
#![cfg_attr(target_os = "linux", allow(unsafe_code))] // a system call between fork and exec

use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Polling interval of [`wait_for_all`].
const POLLING_INTERVAL: Duration = Duration::from_millis(2);

static RUNNING: Mutex<Running> = Mutex::new(Running { processes: Vec::new(), is_closed: false });

struct Running {
    processes: Vec<u32>,
    /// True if this program is about to end and starts no more programs.
    is_closed: bool,
}

/// Runs a program to its end and returns its captured output.
///
/// # Errors
/// An error if the program cannot be started, or if this program is about to end.
pub fn output(command: &mut Command) -> std::io::Result<Output> {
    let child = start(command.stdout(Stdio::piped()).stderr(Stdio::piped()))?;
    output_of(child)
}

/// Starts a program that ends with this one. [`output_of`] must wait for it on the same thread.
///
/// # Errors
/// An error if the program cannot be started, or if this program is about to end.
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

/// Waits for the end of a program that [`start`] has started and returns its captured output.
///
/// # Errors
/// The errors of reading the output of the program.
pub fn output_of(child: Child) -> std::io::Result<Output> {
    let id = child.id();
    let output = child.wait_with_output();
    running().processes.retain(|other| *other != id);
    output
}

/// Prevents the start of further programs. Returns the process ids of the programs that run now.
pub fn close() -> Vec<u32> {
    let mut running = running();
    running.is_closed = true;
    running.processes.clone()
}

/// Waits until all programs have ended, at most for `patience`. Returns the process ids of those that still run.
pub fn wait_for_all(patience: Duration) -> Vec<u32> {
    let began = Instant::now();
    loop {
        let left = running().processes.clone();
        if left.is_empty() || began.elapsed() >= patience {
            return left;
        }
        std::thread::sleep(POLLING_INTERVAL);
    }
}

fn running() -> MutexGuard<'static, Running> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes the system send SIGTERM to the program if the thread that starts it ends. That thread must wait for it.
#[cfg(target_os = "linux")]
fn end_with_this_process(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    let parent = std::process::id();
    let ask = move || {
        // SAFETY: only system calls that are allowed between fork and exec, with arguments of the types that they
        // expect.
        let is_orphan = unsafe {
            libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGTERM as libc::c_ulong);
            libc::getppid().cast_unsigned() != parent
        };
        // The parent may have ended before the signal was requested.
        if is_orphan { Err(std::io::ErrorKind::Interrupted.into()) } else { Ok(()) }
    };
    // SAFETY: the closure makes system calls only: no allocation, no lock.
    unsafe { command.pre_exec(ask) };
}

#[cfg(not(target_os = "linux"))]
fn end_with_this_process(_: &mut Command) {}
