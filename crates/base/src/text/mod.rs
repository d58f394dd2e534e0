//! Text files that people and programs write: read whole or in blocks, packed or not, with the line of everything that is
//! wrong in them. Tables of columns, series of numbers and TOML documents; what they mean is known to who reads them.

pub mod compression;
pub mod input_file;
pub mod quotes;
pub mod series;
pub mod table;
pub mod walk;
mod zstd_frames;

pub use compression::Compression;
pub use input_file::InputFile;
