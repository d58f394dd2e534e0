//! Command line: arguments, one file per command, progress. Only this module prints or exits; it contains no
//! arithmetic.

mod advise;
mod arguments;
mod assemble;
mod audit;
mod batch;
mod check;
mod compare;
mod completions;
mod conversion_request;
mod convert;
mod convert_options;
mod doctor;
mod element_decks;
mod ending;
mod exit;
mod explain;
mod export;
mod inspect;
mod measure;
mod mode_source;
mod models;
mod outcome;
mod output;
mod prepare;
mod recipe;
mod recover;
mod reduce;
mod resources;
mod response;
mod run;
mod select;
mod shapes;
#[cfg(unix)]
mod signals;
mod simulate;
mod stiffening;
mod terminal;
mod trade;
mod view;

pub use arguments::Arguments;
pub use batch::set_program;
pub(crate) use batch::{BatchTask, failed as batch_failure};
pub use ending::end_without_unfinished_files;
pub use exit::end;
pub use output::{parse, run};
pub use resources::use_threads;
