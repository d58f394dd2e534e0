//! The command line: arguments, one file per command, progress. The only room that prints or exits; no
//! arithmetic.

mod arguments;
mod audit;
mod check;
mod compare;
mod completions;
mod convert;
mod doctor;
mod export;
mod import;
mod inspect;
mod models;
mod outcome;
mod output;
mod places;
mod recipe;
mod resources;
mod response;
mod select;
mod simulate;
mod terminal;
mod trade;
mod view;
mod watcher;

pub use arguments::Arguments;
pub use output::{parse, run, tell_bug};
