//! The extension module `flexbody._flexbody`: the front door of the library for Python. The package around it is in
//! `python/flexbody`. The signatures of its functions state types of Python, which pyo3 ignores: the stub `_flexbody.pyi` is
//! made of them.

mod arguments;
mod arrays;
mod batch;
mod body;
mod body_arguments;
mod body_class;
mod channels;
mod checks;
mod choice;
mod command;
mod equations;
mod errors;
mod files;
mod model;
mod recovered;
mod report;
mod response;
mod scene;
mod trade;
mod types;
mod work;

use pyo3::prelude::*;

#[pymodule]
mod _flexbody {
    #[pymodule_export]
    use crate::batch::{Batch, batch};
    #[pymodule_export]
    use crate::body_class::Body;
    #[pymodule_export]
    use crate::channels::Channels;
    #[pymodule_export]
    use crate::checks::{Audit, Check, Comparison, View, audit, explain, recipe};
    #[pymodule_export]
    use crate::choice::_choices;
    #[pymodule_export]
    use crate::command::run_command;
    #[pymodule_export]
    use crate::equations::{EquationsOfMotion, Point};
    #[pymodule_export]
    use crate::files::{_restored, export_formats, import_body, read};
    #[pymodule_export]
    use crate::model::Model;
    #[pymodule_export]
    use crate::recovered::Recovered;
    #[pymodule_export]
    use crate::response::Response;
    #[pymodule_export]
    use crate::scene::{Motion, Scene, Selection};
    #[pymodule_export]
    use crate::trade::Trade;

    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
