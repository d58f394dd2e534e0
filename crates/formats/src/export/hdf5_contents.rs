//! HDF5 files of other programs, made from a tree of named arrays. Equal trees give equal bytes.

use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::hdf5_file::{bytes_of, make, put_text};
use hdf5::types::{FixedAscii, FixedUnicode, TypeDescriptor};
use hdf5_metno as hdf5;

/// Contents under a name, with text attributes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hdf5Entry {
    name: String,
    attributes: Vec<(&'static str, String)>,
    contents: Hdf5Contents,
}

/// Groups and arrays. Values are in row-major order; empty extents stand for a single value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Hdf5Contents {
    /// A group of entries.
    Group(Vec<Hdf5Entry>),
    /// 64-bit floats with these extents.
    Floats(Vec<usize>, Vec<f64>),
    /// 64-bit integers with these extents.
    Integers(Vec<usize>, Vec<i64>),
    /// A single text.
    Text(String),
}

impl Hdf5Contents {
    /// Returns a single number.
    pub(crate) fn number(value: f64) -> Self {
        Self::Floats(Vec::new(), vec![value])
    }

    /// Returns a list of numbers.
    pub(crate) fn list(values: &[f64]) -> Self {
        Self::Floats(vec![values.len()], values.to_vec())
    }

    /// Returns an array with two extents from its entries.
    pub(crate) fn from_fn(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let places = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
        Self::Floats(vec![rows, columns], places.map(|(i, j)| entry(i, j)).collect())
    }

    /// Returns a matrix as an array with two extents.
    pub(crate) fn matrix(a: &Mat<f64>) -> Self {
        Self::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
    }

    /// Returns these contents under a name.
    pub(crate) fn named(self, name: impl Into<String>) -> Hdf5Entry {
        Hdf5Entry { name: name.into(), attributes: Vec::new(), contents: self }
    }
}

impl Hdf5Entry {
    /// Returns this entry with one more text attribute.
    pub(crate) fn with(mut self, attribute: &'static str, text: impl Into<String>) -> Self {
        self.attributes.push((attribute, text.into()));
        self
    }

    fn put(&self, place: &hdf5::Group) -> hdf5::Result<()> {
        let name = self.name.as_str();
        match &self.contents {
            Hdf5Contents::Group(members) => {
                let group = make(place, name)?;
                members.iter().try_for_each(|member| member.put(&group))?;
                self.describe(&group)
            }
            Hdf5Contents::Floats(shape, values) => self.describe(&*array(place, name, shape, values)?),
            Hdf5Contents::Integers(shape, values) => self.describe(&*array(place, name, shape, values)?),
            Hdf5Contents::Text(text) => self.describe(&*put_fixed_text(place, name, text)?),
        }
    }

    fn describe(&self, place: &hdf5::Location) -> hdf5::Result<()> {
        self.attributes.iter().try_for_each(|(name, text)| put_text(place, name, text))
    }
}

/// Largest length of a text in bytes; a longer text is an error of the export.
const LONGEST_TEXT: usize = 1 << 16;

/// Writes a text of fixed length, in ASCII if possible: Octave cannot read texts of variable length or in
/// UTF-8. The library converts the text from a longer type into that of the file.
fn put_fixed_text(place: &hdf5::Group, name: &str, text: &str) -> hdf5::Result<hdf5::Dataset> {
    let wrong = |e: &dyn std::fmt::Display| hdf5::Error::from(format!("{name}: {e}"));
    let (ascii, length) = (text.is_ascii(), text.len().max(1));
    let kind = if ascii { TypeDescriptor::FixedAscii(length) } else { TypeDescriptor::FixedUnicode(length) };
    let dataset = place.new_dataset_builder().empty_as(&kind).obj_track_times(false).create(name)?;
    if ascii {
        dataset.write_scalar(&FixedAscii::<LONGEST_TEXT>::from_ascii(text).map_err(|e| wrong(&e))?)?;
    } else {
        dataset.write_scalar(&text.parse::<FixedUnicode<LONGEST_TEXT>>().map_err(|e| wrong(&e))?)?;
    }
    Ok(dataset)
}

fn array<T: hdf5::H5Type>(
    place: &hdf5::Group,
    name: &str,
    shape: &[usize],
    values: &[T],
) -> hdf5::Result<hdf5::Dataset> {
    let new = place.new_dataset::<T>().obj_track_times(false);
    let dataset = if shape.is_empty() { new.create(name)? } else { new.shape(shape).create(name)? };
    if !values.is_empty() {
        dataset.write_raw(values)?;
    }
    Ok(dataset)
}

/// Returns the bytes of a file with these entries, which HDF5 makes in memory.
///
/// # Errors
/// [`OutputUnwritable`](Code::OutputUnwritable) if HDF5 fails.
pub(crate) fn hdf5_bytes(root: &[Hdf5Entry]) -> Result<Vec<u8>> {
    let made = bytes_of(|file| {
        let place = file.as_group()?;
        root.iter().try_for_each(|entry| entry.put(&place))
    });
    made.map_err(|why| {
        let message = format!("an HDF5 file could not be made in memory: {why}");
        Diagnostic::new(Code::OutputUnwritable, message).into()
    })
}
