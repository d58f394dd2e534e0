//! HDF5 files: made so that equal contents give equal bytes, and read without believing what they declare.

mod create;
mod heap;
mod names;
mod open;
mod plugins;
mod record;
mod value;

pub(crate) use create::{create, library_version, make, put_text};
pub(crate) use heap::first_broken as first_broken_heap;
pub(crate) use names::by_utf8_name;
pub(crate) use open::{open_kept, open_sound};
pub(crate) use plugins::without_plugins;
pub(crate) use record::{Record, attribute_record, dataset_record};
pub(crate) use value::{
    Array, Element, NOTHING, Stored, attribute_names, dataset, elements, float, int, members, open_dataset,
    open_group, text,
};
