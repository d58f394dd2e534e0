//! The extension module `flexbody._flexbody`: the front door of the library for Python. The package around it is in
//! `python/flexbody`, its types in `_flexbody.pyi`.

mod arrays;
mod body;
mod body_class;
mod choice;
mod command;
mod equations;
mod errors;
mod model;
mod report;
mod scene;
mod trade;
mod work;

use pyo3::prelude::*;

#[pymodule]
mod _flexbody {
    #[pymodule_export]
    use crate::body::{export_formats, read};
    #[pymodule_export]
    use crate::body_class::Body;
    #[pymodule_export]
    use crate::command::run_command;
    #[pymodule_export]
    use crate::equations::{EquationsOfMotion, Point};
    #[pymodule_export]
    use crate::model::Model;
    #[pymodule_export]
    use crate::scene::{Motion, Scene, Selection};
    #[pymodule_export]
    use crate::trade::Trade;

    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
