//! Text files that people and programs write: read whole or in blocks, compressed or not, with the line of every error.
//! Tables of columns, series of numbers and TOML documents; their meaning is left to the callers.

pub mod compression;
pub mod input_file;
mod last_field;
pub mod quotes;
pub mod scanner;
pub mod series;
pub mod table;
pub mod walk;

pub use compression::Compression;
pub use input_file::InputFile;
