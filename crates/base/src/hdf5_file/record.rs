//! Numbers and texts of an HDF5 file in a form that does not depend on their layout in the file.

use super::value::{Stored, elements, storage, text};
use hdf5::types::{FloatSize, IntSize, TypeDescriptor};
use hdf5_metno as hdf5;

/// Content of a dataset or an attribute, independent of chunks, compression, byte order and string type of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Type: `float64`, `float32`, `int8` to `int64`, `uint8` to `uint64`, or `text`.
    pub kind: &'static str,
    /// Extents; empty for a single value.
    pub shape: Vec<usize>,
    /// Numbers in row-major order and little-endian, texts in UTF-8.
    pub bytes: Vec<u8>,
}

/// Reason why an entry has no record.
const OTHER_TYPE: &str = "its type does not occur in flex-body files";

/// Returns the record of a dataset of numbers. Its stored bytes are subtracted from `stored`.
pub fn dataset_record(dataset: &hdf5::Dataset, stored: &mut Stored) -> Result<Record, String> {
    let shape = dataset.get_shape().map_err(|e| e.to_string())?;
    let kind = descriptor(dataset)?;
    storage(dataset, elements(&shape)?, kind.size(), stored)?;
    numbers(dataset, &kind, shape)
}

/// Returns the record of an attribute: a text, or numbers.
pub fn attribute_record(place: &hdf5::Location, name: &str) -> Result<Record, String> {
    let attribute = place.attr(name).map_err(|e| e.to_string())?;
    let shape = attribute.get_shape().map_err(|e| e.to_string())?;
    let kind = descriptor(&attribute)?;
    let is_number =
        matches!(kind, TypeDescriptor::Float(_) | TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_));
    if is_number {
        elements(&shape)?;
        return numbers(&attribute, &kind, shape);
    }
    if !shape.is_empty() {
        return Err(OTHER_TYPE.to_owned());
    }
    let found = text(place, name)?.ok_or_else(|| "it cannot be read".to_owned())?;
    Ok(Record { kind: "text", shape, bytes: found.into_bytes() })
}

fn descriptor(place: &hdf5::Container) -> Result<TypeDescriptor, String> {
    place.dtype().and_then(|kind| kind.to_descriptor()).map_err(|e| e.to_string())
}

fn numbers(place: &hdf5::Container, kind: &TypeDescriptor, shape: Vec<usize>) -> Result<Record, String> {
    macro_rules! read {
        ($type:ty, $name:literal) => {{
            let values = place.read_raw::<$type>().map_err(|e| e.to_string())?;
            ($name, values.iter().flat_map(|value| value.to_le_bytes()).collect())
        }};
    }
    let (kind, bytes) = match kind {
        TypeDescriptor::Float(FloatSize::U8) => read!(f64, "float64"),
        TypeDescriptor::Float(FloatSize::U4) => read!(f32, "float32"),
        TypeDescriptor::Integer(IntSize::U1) => read!(i8, "int8"),
        TypeDescriptor::Integer(IntSize::U2) => read!(i16, "int16"),
        TypeDescriptor::Integer(IntSize::U4) => read!(i32, "int32"),
        TypeDescriptor::Integer(IntSize::U8) => read!(i64, "int64"),
        TypeDescriptor::Unsigned(IntSize::U1) => read!(u8, "uint8"),
        TypeDescriptor::Unsigned(IntSize::U2) => read!(u16, "uint16"),
        TypeDescriptor::Unsigned(IntSize::U4) => read!(u32, "uint32"),
        TypeDescriptor::Unsigned(IntSize::U8) => read!(u64, "uint64"),
        _ => return Err(OTHER_TYPE.to_owned()),
    };
    Ok(Record { kind, shape, bytes })
}
