//! HDF5 files: written so that equal contents give equal bytes, and read without trust in their declarations.

mod create;
mod heap;
mod names;
mod open;
mod plugins;
mod record;
mod value;

pub use create::{create, library_version, make, put_text};
pub use heap::first_broken as first_broken_heap;
pub use names::by_utf8_name;
pub use open::{open_unrecorded, open_with_checked_texts};
pub use plugins::without_plugins;
pub use record::{Record, attribute_record, dataset_record};
pub use value::{
    Array, Element, NOTHING, Stored, attribute_names, dataset, elements, float, int, members, open_dataset,
    open_group, text,
};
