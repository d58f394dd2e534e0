//! Single values of an HDF5 file whose declarations may be wrong.
//!
//! Functions return `Ok(None)` for a missing entry, and `Err` for an unexpected one; the text reads `expected ...,
//! found ...`.

use crate::memory::{allow_failure, left};
use hdf5::dataset::Layout;
use hdf5::types::{FixedAscii, FixedUnicode, FloatSize, IntSize, TypeDescriptor, VarLenAscii, VarLenUnicode};
use hdf5::{IndexType, IterationOrder, LinkType};
use hdf5_metno as hdf5;

/// Largest compression ratio of deflate.
const MAX_DEFLATE_RATIO: u64 = 1032;

/// Longest text attribute of fixed length: the limit of HDF5 for an attribute.
const MAX_FIXED_TEXT_BYTES: usize = 65536;

/// Number of elements up to which a chunk may exceed its dataset. The library reserves memory for one whole chunk.
const MAX_EXCESS_CHUNK_ELEMENTS: usize = 1 << 20;

/// Bytes of the file that the datasets read so far do not account for. Together datasets cannot exceed the file, so
/// that many links to one dataset are detected.
#[derive(Debug)]
pub struct Stored {
    left: u64,
}

impl Stored {
    /// Starts with a file of `file_bytes` of which nothing was read.
    pub fn new(file_bytes: u64) -> Self {
        Self { left: file_bytes }
    }
}

/// Description of a missing group in the errors of [`open_group`].
pub const NOTHING: &str = "nothing";

/// Opens a group by its absolute path through hard links only, since links could lead to other files.
pub fn open_group(file: &hdf5::File, path: &str) -> Result<hdf5::Group, String> {
    let mut group = file.as_group().map_err(|e| e.to_string())?;
    for name in path.split('/').filter(|name| !name.is_empty()) {
        if !has(&group, name)? {
            return Err(NOTHING.to_owned());
        }
        group = group.group(name).map_err(|_| "another object".to_owned())?;
    }
    Ok(group)
}

/// Returns the names of the members of a group, in creation order if the file tracks it.
pub fn members(group: &hdf5::Group) -> Result<Vec<String>, String> {
    group
        .member_names_by(IndexType::CreationOrder, IterationOrder::Increasing)
        .or_else(|_| group.member_names_by(IndexType::Name, IterationOrder::Increasing))
        .map_err(|e| format!("an unreadable member list ({e})"))
}

/// Returns the names of the attributes, in creation order if the file tracks it.
pub fn attribute_names(place: &hdf5::Location) -> Result<Vec<String>, String> {
    place
        .attr_names_by(IndexType::CreationOrder, IterationOrder::Increasing)
        .or_else(|_| place.attr_names())
        .map_err(|e| format!("expected a list of attributes, found an unreadable one ({e})"))
}

fn has(group: &hdf5::Group, name: &str) -> Result<bool, String> {
    let link = group
        .find_link(IndexType::Name, IterationOrder::Native, |member, info| {
            Ok((member == name).then_some(info.link_type))
        })
        .map_err(|e| format!("an unreadable member list ({e})"))?;
    match link {
        None => Ok(false),
        Some(LinkType::Hard) => Ok(true),
        Some(_) => Err("a soft or external link".to_owned()),
    }
}

/// Opens a dataset of a group; `None` if it does not exist.
pub fn open_dataset(place: &hdf5::Group, name: &str) -> Result<Option<hdf5::Dataset>, String> {
    if !has(place, name).map_err(|found| format!("expected a dataset, found {found}"))? {
        return Ok(None);
    }
    place.dataset(name).map(Some).map_err(|e| format!("expected a dataset, found {e}"))
}

/// Element type of datasets.
pub trait Element: hdf5::H5Type + Copy + Default {
    /// Type in HDF5.
    const TYPE: TypeDescriptor;
    /// Name of the type in messages.
    const NAME: &'static str;
}

impl Element for f64 {
    const TYPE: TypeDescriptor = TypeDescriptor::Float(FloatSize::U8);
    const NAME: &'static str = "64-bit floats";
}

impl Element for f32 {
    const TYPE: TypeDescriptor = TypeDescriptor::Float(FloatSize::U4);
    const NAME: &'static str = "32-bit floats";
}

impl Element for i64 {
    const TYPE: TypeDescriptor = TypeDescriptor::Integer(IntSize::U8);
    const NAME: &'static str = "64-bit integers";
}

impl Element for i32 {
    const TYPE: TypeDescriptor = TypeDescriptor::Integer(IntSize::U4);
    const NAME: &'static str = "32-bit integers";
}

/// Values in row-major order, and the extents.
pub type Array<T> = (Vec<T>, Vec<usize>);

/// Reads a dataset with its extents. `fit` receives the extents, checks them and returns the number of elements.
pub fn dataset<T: Element>(
    place: &hdf5::Group,
    name: &str,
    stored: &mut Stored,
    fit: impl FnOnce(&[usize]) -> Result<usize, String>,
) -> Result<Option<Array<T>>, String> {
    let Some(dataset) = open_dataset(place, name)? else { return Ok(None) };
    let found = dataset.dtype().and_then(|t| t.to_descriptor());
    if !matches!(&found, Ok(found) if *found == T::TYPE) {
        let found = found.map_or_else(|e| e.to_string(), |t| t.to_string());
        return Err(format!("expected {}, found type {found}", T::NAME));
    }
    let dims = dataset.get_shape().map_err(|e| format!("expected a shape, found {e}"))?;
    let elements = fit(&dims)?;
    storage(&dataset, elements, size_of::<T>(), stored)?;
    let mut values = Vec::new();
    allow_failure(|| values.try_reserve_exact(elements))
        .map_err(|_| format!("expected an array that fits into memory, found {elements} values"))?;
    values.resize(elements, T::default());
    dataset.read_into_raw(&mut values).map_err(|e| format!("expected readable data, found {e}"))?;
    Ok(Some((values, dims)))
}

/// Returns the number of elements of an array with these extents.
pub fn elements(dims: &[usize]) -> Result<usize, String> {
    let elements = dims.iter().try_fold(1usize, |product, &d| product.checked_mul(d));
    // 2^48 values exceed any memory; below this number, products with sizes of types cannot overflow.
    elements
        .filter(|&e| e < 1 << 48)
        .ok_or_else(|| format!("expected a shape that fits into memory, found {dims:?}"))
}

/// Refuses data in other files, and sizes that the stored bytes cannot hold.
fn storage(dataset: &hdf5::Dataset, elements: usize, size: usize, stored: &mut Stored) -> Result<(), String> {
    let plist = dataset.create_plist().map_err(|e| format!("expected a storage layout, found {e}"))?;
    let layout = plist.get_layout().map_err(|e| format!("expected a storage layout, found {e}"))?;
    let external = plist.get_external().map_err(|e| format!("expected a storage layout, found {e}"))?;
    if layout == Layout::Virtual || !external.is_empty() {
        return Err("expected data inside the file, found references to other files".to_owned());
    }
    let bytes = dataset.storage_size();
    // The values must be possible for the stored bytes, and fit into memory.
    let most = if layout == Layout::Chunked { bytes.saturating_mul(MAX_DEFLATE_RATIO) } else { bytes };
    let unpacked = (elements as u64).saturating_mul(size as u64);
    if unpacked > most {
        return Err(format!("expected stored data for {elements} values, found {bytes} bytes"));
    }
    if left().is_some_and(|left| unpacked > left) {
        return Err(format!("expected an array that fits into memory, found {elements} values"));
    }
    // All datasets together cannot be larger than the file.
    let Some(left) = stored.left.checked_sub(bytes) else {
        return Err(format!(
            "expected datasets that fit into the file, found {bytes} bytes more than it has"
        ));
    };
    stored.left = left;
    if layout == Layout::Chunked {
        let chunk =
            plist.get_chunk().map_err(|e| format!("expected a chunk shape, found {e}"))?.unwrap_or_default();
        let size = chunk.iter().try_fold(1usize, |product, &d| product.checked_mul(d));
        if size.is_none_or(|size| size > elements.max(MAX_EXCESS_CHUNK_ELEMENTS)) {
            return Err(format!("expected chunks within the dataset, found chunks of {chunk:?}"));
        }
    }
    Ok(())
}

fn attribute(
    place: &hdf5::Location,
    name: &str,
    expected: &str,
) -> Result<Option<(hdf5::Attribute, TypeDescriptor)>, String> {
    // A name that cannot be looked up does not exist; a damaged attribute fails when it is opened.
    if place.attr_info(name).is_err() && !attribute_names(place)?.iter().any(|n| n == name) {
        return Ok(None);
    }
    let attribute = place.attr(name).map_err(|e| format!("expected {expected}, found {e}"))?;
    let kind = attribute
        .dtype()
        .and_then(|t| t.to_descriptor())
        .map_err(|e| format!("expected {expected}, found {e}"))?;
    Ok(Some((attribute, kind)))
}

/// Reads a text attribute of fixed or variable length; `None` if it does not exist.
pub fn text(place: &hdf5::Location, name: &str) -> Result<Option<String>, String> {
    const EXPECTED: &str = "a text attribute";
    let Some((attribute, kind)) = attribute(place, name, EXPECTED)? else { return Ok(None) };
    let bytes = match kind {
        TypeDescriptor::VarLenUnicode => {
            attribute.read_scalar::<VarLenUnicode>().map(|t| t.as_bytes().to_vec())
        }
        TypeDescriptor::VarLenAscii => attribute.read_scalar::<VarLenAscii>().map(|t| t.as_bytes().to_vec()),
        TypeDescriptor::FixedUnicode(n) if n <= MAX_FIXED_TEXT_BYTES => {
            attribute.read_scalar::<FixedUnicode<MAX_FIXED_TEXT_BYTES>>().map(|t| t.as_bytes().to_vec())
        }
        TypeDescriptor::FixedAscii(n) if n <= MAX_FIXED_TEXT_BYTES => {
            attribute.read_scalar::<FixedAscii<MAX_FIXED_TEXT_BYTES>>().map(|t| t.as_bytes().to_vec())
        }
        other => return Err(format!("expected {EXPECTED}, found type {other}")),
    };
    let bytes = bytes.map_err(|e| format!("expected {EXPECTED}, found {e}"))?;
    String::from_utf8(bytes)
        .map(Some)
        .map_err(|_| format!("expected {EXPECTED}, found bytes that are not UTF-8"))
}

/// Reads an integer attribute; `None` if it does not exist.
pub fn int(place: &hdf5::Location, name: &str) -> Result<Option<i64>, String> {
    let Some((attribute, kind)) = attribute(place, name, "an integer attribute")? else { return Ok(None) };
    match kind {
        TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) => {
            attribute.read_scalar().map(Some).map_err(|e| format!("expected an integer attribute, found {e}"))
        }
        other => Err(format!("expected an integer attribute, found type {other}")),
    }
}

/// Reads a float attribute; `None` if it does not exist.
pub fn float(place: &hdf5::Location, name: &str) -> Result<Option<f64>, String> {
    let Some((attribute, kind)) = attribute(place, name, "a float attribute")? else { return Ok(None) };
    match kind {
        TypeDescriptor::Float(_) => {
            attribute.read_scalar().map(Some).map_err(|e| format!("expected a float attribute, found {e}"))
        }
        other => Err(format!("expected a float attribute, found type {other}")),
    }
}

// Numbers and texts of an HDF5 file in a form that does not depend on their layout in the file.

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
