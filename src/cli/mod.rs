//! Command line: arguments, one file per command, progress. Only this module prints or exits; it contains no
//! arithmetic.

mod advise;
mod arguments;
#[cfg(feature = "cluster")]
mod assemble;
#[cfg(feature = "import")]
mod audit;
#[cfg(feature = "cluster")]
mod batch;
mod check;
#[cfg(feature = "cluster")]
mod cluster_folder;
mod compare;
mod completions;
mod conversion_request;
mod convert;
#[cfg(feature = "import")]
mod convert_foreign;
mod convert_options;
mod doctor;
mod element_decks;
mod ending;
mod exit;
mod explain;
mod export;
mod inspect;
mod invocation;
mod left_out;
mod measure;
mod mode_source;
mod models;
mod outcome;
mod output;
#[cfg(feature = "cluster")]
mod prepare;
mod recipe;
mod recover;
mod reduce;
mod resources;
#[cfg(feature = "response")]
mod response;
mod run;
mod select;
mod shapes;
#[cfg(unix)]
mod signals;
mod simulate;
#[cfg(feature = "cluster")]
mod slepc;
mod stiffening;
mod terminal;
mod trade;
mod view;

pub use arguments::Arguments;
#[cfg(feature = "cluster")]
pub use batch::set_program;
#[cfg(feature = "cluster")]
pub(crate) use batch::{BatchTask, failed as batch_failure};
pub use ending::end_without_unfinished_files;
pub use exit::end;
pub use output::{parse, run};
pub use resources::use_threads;
