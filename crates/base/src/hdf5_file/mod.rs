//! HDF5 files: written so that equal contents give equal bytes, and read without trust in their declarations.

mod digest;
mod finish;
mod heap;
mod open;
mod seal;
mod value;

pub use digest::{Digests, Number, Numbers, digests_of, of_numbers, put_numbers};
pub use finish::{bytes_of, finish};
pub use heap::first_broken as first_broken_heap;
pub use open::{
    by_utf8_name, create, library_version, make, open_unrecorded, open_with_checked_texts, put_text,
    take_variables, without_plugins,
};
pub use seal::{broken_seal, difference};
pub use value::{
    Array, Element, NOTHING, Record, Stored, attribute_names, attribute_record, dataset, dataset_record,
    elements, float, int, members, open_dataset, open_group, text,
};
