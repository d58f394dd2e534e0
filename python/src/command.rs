//! The command `flexbody`.

use crate::batch::words_of_the_command;
use crate::errors::bug;
use flexbody::program::{self, Arguments};
use pyo3::prelude::*;
use std::ffi::OsString;

/// Runs the command `flexbody` with `words`, the name of the command first, and returns its exit code. Its output goes
/// to the streams of the process.
///
/// The process must serve this command only: signals with the default handling, and panics, end the process as they end
/// the program, without an unfinished file.
#[pyfunction]
#[pyo3(signature = (words: "Sequence[str]"))]
pub fn run_command(py: Python<'_>, words: Vec<OsString>) -> PyResult<u8> {
    // The executable of this process is that of Python.
    program::set_program(words_of_the_command(py)?);
    let arguments: &'static Arguments = match program::parse(&words) {
        Ok(arguments) => Box::leak(Box::new(arguments)),
        Err(code) => return Ok(code as u8),
    };
    program::end_without_unfinished_files(arguments);
    let worker = std::thread::Builder::new().name("flexbody".to_owned()).stack_size(8 << 20);
    let worker = worker.spawn(move || program::run(arguments))?;
    py.detach(|| worker.join()).map(|code| code as u8).map_err(|_| bug(py))
}
