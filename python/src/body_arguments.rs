//! Arguments of the methods of bodies.

use crate::arguments::{mistyped, real, text, whole};
use crate::arrays::{rows_of, rows_of_many, sequence};
use crate::errors::value;
use crate::scene::Motion;
use crate::types::Given;
use crate::work::alone;
use flexbody::{AttachedMass, MotionHistory, RecordedMotion};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Returns the points of an export as one text: "nodes", "interfaces", or numbers of nodes.
pub fn points_of(given: &Bound<'_, PyAny>) -> PyResult<String> {
    if let Ok(text) = given.extract::<String>() {
        return Ok(text);
    }
    let expected = "\"nodes\", \"interfaces\", or numbers of nodes";
    let items = given.try_iter().map_err(|_| mistyped(given, "points", expected))?;
    let number = |item: PyResult<Bound<'_, PyAny>>| Ok(whole(&item?, "points")?.to_string());
    Ok(items.map(number).collect::<PyResult<Vec<_>>>()?.join(","))
}

/// Returns the motion that a caller gives for a picture: a `Motion`, or the path of its file.
pub fn recorded(given: &Bound<'_, PyAny>) -> PyResult<RecordedMotion> {
    if let Ok(motion) = given.cast::<Motion>() {
        return Ok(RecordedMotion::from(motion.get().inner()));
    }
    let expected = "a Motion, or the path of its file";
    let path: PathBuf = given.extract().map_err(|_| mistyped(given, "motion", expected))?;
    alone(given.py(), || RecordedMotion::read(&path))
}

/// Returns an attached mass: a number, or a tuple of it and the name of an interface.
pub fn attached_mass(given: &Bound<'_, PyAny>) -> PyResult<AttachedMass> {
    match given.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>() {
        Ok((mass, interface)) => {
            let interface = Some(text(&interface, "attached")?);
            Ok(AttachedMass { mass: real(&mass, "attached")?, interface })
        }
        Err(_) => Ok(AttachedMass { mass: real(given, "attached")?, interface: None }),
    }
}

/// Returns the history that a caller gives: the path of a table, or a tuple of time, q and attitude or None.
pub fn motion_history(given: &Bound<'_, PyAny>, n_modes: usize) -> PyResult<MotionHistory> {
    let expected = "the path of a table, or a tuple of time, q, and attitude or None";
    let history = match given.extract::<(Given<'_>, Given<'_>, Option<Given<'_>>)>() {
        Ok((time, q, attitude)) => {
            let attitude = attitude.map(|rows| rows_of_many::<4>(&rows, "attitude")).transpose()?;
            MotionHistory::new(sequence(&time, "time")?, rows_of(&q, "q")?, attitude)
        }
        Err(_) => {
            let path: PathBuf = given.extract().map_err(|_| mistyped(given, "history", expected))?;
            MotionHistory::read(path, n_modes)
        }
    };
    value(given.py(), history)
}
