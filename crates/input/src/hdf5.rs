//! Files of HDF5, independent of what they describe: the links of groups, lists of numbers, attributes, dense arrays.

mod arrays;
mod file;
mod members;
mod values;

pub(super) use arrays::{
    StoredArray, has_arrays_beside, is_array, read_array, read_stored_array, square_arrays,
};
pub(super) use file::{MAX_DEPTH, MAX_GROUPS, layout, opened};
pub(super) use members::Members;
pub(super) use values::{
    Heaps, Numbers, Vector, integers_of, names_of, refuse_beyond_memory, text_of, truth_of,
};
