//! The command `flexbody`.

use crate::errors::bug;
use flexbody::program;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::ffi::OsString;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

/// Runs the command `flexbody` with `words`, the name of the command first, and returns its exit code. What
/// it prints goes to the streams of the process.
///
/// After a KeyboardInterrupt the work goes on in the background until the process ends, which it should do at
/// once: no unfinished file is left, and none can be finished any more.
#[pyfunction]
pub fn run_command(py: Python<'_>, words: Vec<OsString>) -> PyResult<u8> {
    let arguments = match program::parse(&words) {
        Ok(arguments) => arguments,
        Err(code) => return Ok(code as u8),
    };
    let (send, mut receive) = sync_channel(1);
    let worker = std::thread::Builder::new().name("flexbody".to_owned()).stack_size(8 << 20);
    worker.spawn(move || {
        let run = || program::run(&arguments);
        let code = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run));
        let _ = send.send(code.unwrap_or_else(|_| program::tell_bug(&arguments)));
    })?;
    loop {
        let outcome;
        (outcome, receive) = py.detach(move || (receive.recv_timeout(Duration::from_millis(50)), receive));
        match outcome {
            Ok(code) => return Ok(code as u8),
            Err(RecvTimeoutError::Disconnected) => return Err(bug(py)),
            Err(RecvTimeoutError::Timeout) => py.check_signals().inspect_err(|error| {
                if error.is_instance_of::<PyKeyboardInterrupt>(py) {
                    py.detach(program::abandon_unfinished);
                }
            })?,
        }
    }
}
