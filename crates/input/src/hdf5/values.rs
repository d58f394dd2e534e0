//! Lists of numbers and small attributes of any stored type.

use super::members::Members;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::hdf5_file::first_broken_heap;
use flexbody_base::memory::{left, refuse_beyond};
use flexbody_base::text::InputFile;
use hdf5_metno::types::{FixedAscii, FixedUnicode, FloatSize, TypeDescriptor, VarLenAscii, VarLenUnicode};
use hdf5_metno::{Attribute, Dataset, Group, Hyperslab, SliceOrIndex};
use std::cell::OnceCell;
use std::ops::Range;

/// Number of values per stored byte above which values of a dataset must be missing from the file: no filter reaches it
/// on real data (deflate: 1032).
const MAX_VALUES_PER_BYTE: u64 = 1100;

/// Number of values up to which a chunk may be larger than its dataset.
const MAX_EXCESS_CHUNK_VALUES: u64 = 1 << 20;

/// Type of the numbers of a dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum NumberKind {
    Whole,
    Single,
    Double,
}

impl NumberKind {
    fn of(descriptor: &TypeDescriptor) -> Option<Self> {
        match descriptor {
            TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) => Some(Self::Whole),
            TypeDescriptor::Float(FloatSize::U4) => Some(Self::Single),
            TypeDescriptor::Float(FloatSize::U8) => Some(Self::Double),
            _ => None,
        }
    }
}

/// Dataset of numbers whose values are stored in this file.
pub(crate) struct Numbers {
    pub dataset: Dataset,
    /// Path within the file, for messages.
    pub name: String,
    kind: NumberKind,
}

impl Numbers {
    /// Opens the dataset `name` of a group.
    ///
    /// # Errors
    /// FB302 for values that are no real numbers, FB304 for values that are not stored, FB310 for values outside this
    /// file.
    pub(crate) fn open(group: &Group, members: &Members, group_name: &str, name: &str) -> Diagnosed<Self> {
        let (dataset, at) = stored_here(group, members, group_name, name)?;
        let refuse = |code, what: String| vec![Diagnostic::new(code, format!("dataset {at} {what}"))];
        let kind = dataset.dtype().and_then(|t| t.to_descriptor()).ok().and_then(|t| NumberKind::of(&t));
        let kind = kind.ok_or_else(|| {
            refuse(Code::MatrixKind, "holds no real numbers (complex, boolean or structured values?)".into())
        })?;
        check_stored(&dataset).map_err(|what| refuse(Code::MatrixCount, what))?;
        Ok(Self { dataset, name: at, kind })
    }

    pub(crate) fn is_single_precision(&self) -> bool {
        self.kind == NumberKind::Single
    }
}

/// Opens a dataset whose values are stored in this file. Returns also its path for messages.
///
/// # Errors
/// FB310 for values outside this file.
fn stored_here(
    group: &Group,
    members: &Members,
    group_name: &str,
    name: &str,
) -> Diagnosed<(Dataset, String)> {
    let at = format!("`{}/{name}`", group_name.trim_end_matches('/'));
    let refuse = |code, what: String| vec![Diagnostic::new(code, format!("dataset {at} {what}"))];
    if members.is_elsewhere(name) {
        return Err(refuse(Code::Hdf5Layout, "is a soft or external link, which is not followed".into()));
    }
    let dataset =
        group.dataset(name).map_err(|e| refuse(Code::Hdf5Layout, format!("cannot be opened: {e}")))?;
    let properties = dataset.dcpl().map_err(|e| refuse(Code::Hdf5Layout, format!("cannot be read: {e}")))?;
    if dataset.layout() == hdf5_metno::dataset::Layout::Virtual || !properties.external().is_empty() {
        return Err(refuse(Code::Hdf5Layout, "keeps its values in another file".into()));
    }
    Ok((dataset, at))
}

/// Returns the rows of a dataset of single characters without padding, as netCDF stores names.
///
/// # Errors
/// FB302 for other datasets, FB304 for rows that are not stored, FB310 for values outside this file.
pub(crate) fn names_of(group: &Group, members: &Members, name: &str) -> Diagnosed<Vec<String>> {
    let (dataset, at) = stored_here(group, members, "", name)?;
    let refuse = |code, what: String| vec![Diagnostic::new(code, format!("dataset {at} {what}"))];
    let shape = dataset.shape();
    let kind = dataset.dtype().and_then(|kind| kind.to_descriptor());
    let (&[_, length], Ok(TypeDescriptor::FixedAscii(1))) = (shape.as_slice(), kind) else {
        return Err(refuse(Code::MatrixKind, "holds no names".to_owned()));
    };
    // Names that were never written are blank.
    if dataset.storage_size() == 0 {
        return Ok(Vec::new());
    }
    check_stored(&dataset).map_err(|what| refuse(Code::MatrixCount, what))?;
    let letters = dataset
        .read_raw::<FixedAscii<1>>()
        .map_err(|e| refuse(Code::FileUnreadable, format!("cannot be read: {e}")))?;
    let letters: Vec<u8> =
        letters.iter().map(|letter| letter.as_bytes().first().copied().unwrap_or(0)).collect();
    let name = |row: &[u8]| {
        let end = row.iter().position(|&letter| letter == 0).unwrap_or(row.len());
        String::from_utf8_lossy(&row[..end]).trim().to_owned()
    };
    Ok(letters.chunks(length.max(1)).map(name).collect())
}

/// Refuses more values than the bytes in the file can represent.
fn check_stored(dataset: &Dataset) -> Result<(), String> {
    let declared =
        dataset.shape().iter().fold(1u64, |product, &extent| product.saturating_mul(extent as u64));
    let stored = dataset.storage_size();
    if declared > stored.saturating_mul(MAX_VALUES_PER_BYTE) {
        return Err(format!("declares {declared} values, but only {stored} bytes are stored"));
    }
    // The library unpacks whole chunks.
    let chunk = dataset.chunk().unwrap_or_default();
    let values = chunk.iter().fold(1u64, |product, &extent| product.saturating_mul(extent as u64));
    if values > declared.max(MAX_EXCESS_CHUNK_VALUES) {
        return Err(format!("has chunks of {values} values for {declared} values"));
    }
    Ok(())
}

/// Refuses a number of values that does not fit the memory left.
///
/// # Errors
/// FB601 if they do not fit.
pub(crate) fn refuse_beyond_memory(values: usize, name: &str) -> Diagnosed<()> {
    let what = format!("reading {values} values of the dataset {name}");
    let needed = values as f64 * size_of::<f64>() as f64;
    let refused = refuse_beyond(left(), needed, &what, "use a larger machine");
    refused.map_err(|error| error.into_diagnostics())
}

/// List of numbers in the file.
pub(crate) struct Vector {
    dataset: Dataset,
    /// Path within the file, for messages.
    pub name: String,
    dimensions: usize,
    axis: usize,
    pub len: usize,
    kind: NumberKind,
    /// Values per chunk; 1 if the dataset is not chunked.
    pub chunk: usize,
}

impl Vector {
    /// Opens a dataset of numbers with one dimension (others must have length 1).
    ///
    /// # Errors
    /// The errors of [`Numbers::open`]; FB302 for other shapes.
    pub(crate) fn open(group: &Group, members: &Members, group_name: &str, name: &str) -> Diagnosed<Self> {
        let Numbers { dataset, name, kind } = Numbers::open(group, members, group_name, name)?;
        let refuse = |what: String| vec![Diagnostic::new(Code::MatrixKind, format!("dataset {name} {what}"))];
        let shape = dataset.shape();
        let long: Vec<usize> = (0..shape.len()).filter(|&d| shape[d] != 1).collect();
        let axis = match (shape.len(), long.as_slice()) {
            (0, _) => return Err(refuse("is a single value, expected a list".into())),
            (_, []) => 0,
            (_, &[axis]) => axis,
            _ => return Err(refuse(format!("has the shape {shape:?}, expected a list"))),
        };
        let len = shape[axis];
        let chunk = dataset.chunk().and_then(|chunk| chunk.get(axis).copied()).unwrap_or(1).min(len.max(1));
        Ok(Self { dataset, name, dimensions: shape.len(), axis, len, kind, chunk })
    }

    pub(crate) fn is_single_precision(&self) -> bool {
        self.kind == NumberKind::Single
    }

    pub(crate) fn floats(&self, range: Range<usize>) -> Diagnosed<Vec<f64>> {
        self.read::<f64>(range)
    }

    /// Returns whole numbers; 64-bit numbers beyond i64 become its largest value.
    pub(crate) fn integers(&self, range: Range<usize>) -> Diagnosed<Vec<i64>> {
        if self.kind == NumberKind::Whole {
            return self.read::<i64>(range);
        }
        // The function h5write of MATLAB stores indices as doubles.
        let numbers = self.read::<f64>(range)?;
        if let Some(bad) = numbers.iter().find(|v| v.fract() != 0.0) {
            let message = format!("dataset {} has {bad}, expected whole numbers", self.name);
            return Err(vec![Diagnostic::new(Code::MatrixIndex, message)]);
        }
        Ok(numbers.into_iter().map(|v| v as i64).collect())
    }

    fn read<T: hdf5_metno::H5Type>(&self, range: Range<usize>) -> Diagnosed<Vec<T>> {
        if range.is_empty() {
            return Ok(Vec::new());
        }
        refuse_beyond_memory(range.len(), &self.name)?;
        let slab: Vec<SliceOrIndex> = (0..self.dimensions)
            .map(|d| if d == self.axis { range.clone().into() } else { SliceOrIndex::Index(0) })
            .collect();
        let values = self.dataset.read_slice_1d::<T, _>(Hyperslab::from(slab)).map_err(|e| {
            let message = format!("dataset {} cannot be read: {e}", self.name);
            vec![Diagnostic::new(Code::FileUnreadable, message).with_help("write the file again")]
        })?;
        Ok(values.into_raw_vec_and_offset().0)
    }
}

/// Returns the whole numbers of a small attribute; `None` for other attributes.
pub(crate) fn integers_of(attribute: &Attribute) -> Option<Vec<i64>> {
    let kind = NumberKind::of(&attribute.dtype().ok()?.to_descriptor().ok()?)?;
    let shape = attribute.shape();
    let scalar = attribute.is_scalar();
    // A null dataspace has no shape and no value.
    if (shape.is_empty() && !scalar) || shape.iter().try_fold(1usize, |a, &b| a.checked_mul(b))? > 3 {
        return None;
    }
    match kind {
        NumberKind::Whole => attribute.read_raw::<i64>().ok(),
        _ => {
            let numbers = attribute.read_raw::<f64>().ok()?;
            numbers.iter().all(|v| v.fract() == 0.0).then(|| numbers.iter().map(|&v| v as i64).collect())
        }
    }
}

/// Returns a boolean, or a whole number 0 or 1 as one; `None` for other attributes.
pub(crate) fn truth_of(attribute: &Attribute) -> Option<bool> {
    if attribute.is_scalar() && attribute.dtype().ok()?.to_descriptor().ok()? == TypeDescriptor::Boolean {
        return attribute.read_scalar::<bool>().ok();
    }
    match integers_of(attribute)?.as_slice() {
        &[number @ 0..=1] => Some(number == 1),
        _ => None,
    }
}

/// Global heaps of a file, which hold texts of variable length. The HDF5 library walks damaged ones endlessly.
pub(crate) struct Heaps<'f> {
    file: &'f InputFile,
    are_checked: OnceCell<bool>,
}

impl<'f> Heaps<'f> {
    pub(crate) fn of(file: &'f InputFile) -> Self {
        Self { file, are_checked: OnceCell::new() }
    }

    /// Returns true when walking the heaps comes to an end. The first call examines the file.
    fn are_checked(&self) -> bool {
        let look = || first_broken_heap(&mut self.file.reader()).is_ok_and(|broken| broken.is_none());
        *self.are_checked.get_or_init(look)
    }
}

/// Returns a short text of any string type of HDF5; `heaps` are those of the file.
pub(crate) fn text_of(attribute: &Attribute, heaps: &Heaps<'_>) -> Option<String> {
    // A null dataspace has no value.
    if !attribute.is_scalar() && attribute.shape() != [1] {
        return None;
    }
    let text = match attribute.dtype().ok()?.to_descriptor().ok()? {
        TypeDescriptor::VarLenUnicode if heaps.are_checked() => {
            attribute.read_raw::<VarLenUnicode>().ok()?.first()?.as_bytes().to_vec()
        }
        TypeDescriptor::VarLenAscii if heaps.are_checked() => {
            attribute.read_raw::<VarLenAscii>().ok()?.first()?.as_bytes().to_vec()
        }
        TypeDescriptor::FixedAscii(_) => {
            attribute.read_raw::<FixedAscii<64>>().ok()?.first()?.as_bytes().to_vec()
        }
        TypeDescriptor::FixedUnicode(_) => {
            attribute.read_raw::<FixedUnicode<64>>().ok()?.first()?.as_bytes().to_vec()
        }
        _ => return None,
    };
    String::from_utf8(text).ok().map(|text| text.trim().to_owned())
}
