//! Long computations: on a separate thread, without the lock of the interpreter, interruptible by Ctrl-C.

use crate::errors::{bug, exception};
use flexbody::program::use_threads;
use flexbody::{Code, Diagnostic, Listener, Result};
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

/// Interval between checks for signals.
const INTERVAL: Duration = Duration::from_millis(50);

/// Stack size of the thread, equal to that of the program.
const STACK: usize = 8 << 20;

/// Process whose threads compute; 0 before the first computation.
static OWNER: AtomicU32 = AtomicU32::new(0);

/// Starts the threads that compute, once. A process that was forked afterwards has none of them and would wait for
/// their results forever: it gets an exception.
fn start_threads(py: Python<'_>) -> PyResult<()> {
    let current = std::process::id();
    match OWNER.compare_exchange(0, current, Ordering::SeqCst, Ordering::SeqCst) {
        Ok(_) => {
            py.detach(|| use_threads(None));
            Ok(())
        }
        Err(owner) if owner == current => Ok(()),
        Err(owner) => {
            let message = format!(
                "process {current} was forked from process {owner} after the first computation of that process"
            );
            Err(exception(py, &Diagnostic::new(Code::Forked, message).into()))
        }
    }
}

/// Performs `work` on a separate thread, while other Python threads run.
///
/// If Python raises an exception for a signal (KeyboardInterrupt), the caller gets it at once. The work learns of it
/// from its listener and ends at its next step; it holds no Python objects.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(Listener<'_>) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    start_threads(py)?;
    let stopped = Arc::new(AtomicBool::new(false));
    let (send, mut receive) = sync_channel(1);
    let with_warnings = Arc::clone(&stopped);
    let worker = std::thread::Builder::new().name("flexbody".to_owned()).stack_size(STACK);
    let started = worker.spawn(move || {
        let listener = |_: flexbody::Progress<'_>| {
            if with_warnings.load(Ordering::Relaxed) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        // The result is dropped if the caller was interrupted.
        let _ = send.send(catch_unwind(AssertUnwindSafe(|| work(&listener))));
    });
    if let Err(error) = started {
        let message = format!("not enough memory to start a thread: {error}");
        return Err(exception(py, &Diagnostic::new(Code::MemoryShort, message).into()));
    }
    loop {
        let outcome;
        (outcome, receive) = py.detach(move || (receive.recv_timeout(INTERVAL), receive));
        match outcome {
            Ok(Ok(done)) => return done.map_err(|error| exception(py, &error)),
            Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => return Err(bug(py)),
            Err(RecvTimeoutError::Timeout) => py.check_signals().inspect_err(|_| {
                stopped.store(true, Ordering::Relaxed);
            })?,
        }
    }
}

/// Performs short work that may use several threads, such as writing a file, without the lock of the interpreter.
pub fn brief<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T> + Send) -> PyResult<T> {
    start_threads(py)?;
    alone(py, work)
}

/// Performs short work on this thread only, such as reading a file, without the lock of the interpreter. A forked
/// process can do so, too.
pub fn alone<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T> + Send) -> PyResult<T> {
    match py.detach(|| catch_unwind(AssertUnwindSafe(work))) {
        Ok(done) => done.map_err(|error| exception(py, &error)),
        Err(_) => Err(bug(py)),
    }
}
