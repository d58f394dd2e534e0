//! Programs that this one has started and waits for. An interruption of this one alone, as by a queue that
//! ends a job, has to reach them too.

use std::process::{Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};

static RUNNING: Mutex<Vec<u32>> = Mutex::new(Vec::new());

/// Runs a program to its end, and keeps what it prints.
///
/// # Errors
/// Where it cannot be started.
pub fn output(command: &mut Command) -> std::io::Result<Output> {
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    let id = child.id();
    running().push(id);
    let output = child.wait_with_output();
    running().retain(|other| *other != id);
    output
}

/// Process numbers of the programs that run now.
pub fn processes() -> Vec<u32> {
    running().clone()
}

fn running() -> MutexGuard<'static, Vec<u32>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}
