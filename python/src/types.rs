//! Objects of Python by their type, which the stub of the package states (`tests/program/python_stub.rs` makes it).

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// Declares a name for objects of one class of pyo3 that have the type of Python behind the `=`. The text is in the stub
/// as it stands here; nothing compares it with the value of a function.
macro_rules! python_types {
    ($($(#[$doc:meta])* $name:ident($class:ty) = $python:literal;)*) => {
        $($(#[$doc])* pub type $name<'py> = Bound<'py, $class>;)*
    };
}

python_types! {
    /// Numbers from a caller: an array or a sequence.
    Given(PyAny) = "ArrayLike";
    /// Array of floats.
    Floats(PyAny) = "_Floats";
    /// Array of floats, or None.
    FloatsOrNone(PyAny) = "_Floats | None";
    /// Array of 64-bit integers.
    Integers(PyAny) = "NDArray[np.int64]";
    /// Object of JSON.
    Json(PyAny) = "dict[str, Any]";
    /// List of objects of JSON.
    JsonRows(PyAny) = "list[dict[str, Any]]";
    /// Messages of a run.
    Diagnostics(PyTuple) = "tuple[Diagnostic, ...]";
    /// Identity of the numbers of a body, with its error.
    IdentityTuple(PyAny) = "_types.Identity";
    /// Quantity of a comparison, with its difference.
    ComparisonRowTuple(PyAny) = "_types.ComparisonRow";
    /// Stiffness and mass in interface coordinates.
    InterfaceCoordinatesTuple(PyAny) = "_types.InterfaceCoordinates";
    /// Transfer function between two places.
    TransferFunctionTuple(PyAny) = "_types.TransferFunction";
    /// Interfaces by their names.
    InterfacesByName(PyDict) = "dict[str, _types.Interface]";
    /// Arrays by the names of loads.
    FloatsByName(PyDict) = "dict[str, _Floats]";
    /// Relative errors by the name of a scheme and of a norm.
    ErrorsByScheme(PyDict) = "dict[str, dict[str, float]]";
    /// Paths of watched points by their names.
    PathsByName(PyDict) = "dict[str, _types.PointPath]";
    /// Rows by the name of their recovery.
    RowsByRecovery(PyDict) = "dict[str, _types.RecoveredRows]";
    /// Values of random vibration by the name of a recovery.
    ValuesByRecovery(PyDict) = "dict[str, dict[str, Any]]";
}
