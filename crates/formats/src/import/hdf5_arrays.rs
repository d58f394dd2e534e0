//! Arrays in HDF5 files of other programs, whose declared sizes may be wrong.

use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::hdf5_file::{
    Element, Stored, dataset, elements, members, open_dataset, open_with_checked_texts, text,
};
use flexbody_base::text::InputFile;
use flexbody_model::SurfaceMesh;
use hdf5_metno as hdf5;
use std::path::PathBuf;

/// An open file.
pub(crate) struct Hdf5Arrays {
    root: hdf5::Group,
    stored: Stored,
    path: PathBuf,
}

/// Values in row-major order with their extents.
pub(crate) struct Values<T> {
    pub(crate) shape: Vec<usize>,
    pub(crate) values: Vec<T>,
}

impl Hdf5Arrays {
    /// Opens a file.
    ///
    /// # Errors
    /// [`ForeignUnreadable`](Code::ForeignUnreadable) if the file is no HDF5 file or damaged.
    pub(crate) fn open(file: &InputFile) -> Result<Self> {
        let (opened, bytes) = open_with_checked_texts(file.path(), "flexible body", Code::ForeignUnreadable)?;
        let root = opened.as_group().map_err(|e| {
            let message = format!("the root group cannot be read: {e}");
            Error::from(Diagnostic::new(Code::ForeignUnreadable, message).in_file(file.path()))
        })?;
        Ok(Self { root, stored: Stored::new(bytes), path: file.path().to_path_buf() })
    }

    /// Returns true if the file is an HDF5 file with datasets of all these names.
    pub(crate) fn is_with(file: &InputFile, names: &[&str]) -> bool {
        const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
        file.bytes().starts_with(SIGNATURE)
            && Self::open(file).is_ok_and(|opened| opened.missing(names).is_empty())
    }

    /// Returns the `names` that are missing in the file.
    pub(crate) fn missing<'n>(&self, names: &[&'n str]) -> Vec<&'n str> {
        let there = members(&self.root).unwrap_or_default();
        names.iter().filter(|name| !there.iter().any(|member| member == *name)).copied().collect()
    }

    /// Returns an error if one of `names` is missing.
    ///
    /// # Errors
    /// [`ForeignIncomplete`](Code::ForeignIncomplete) with the missing names.
    pub(crate) fn require(&self, names: &[&str]) -> Result<()> {
        let missing: Vec<String> = self.missing(names).iter().map(|name| format!("`{name}`")).collect();
        if missing.is_empty() {
            return Ok(());
        }
        let message = format!("missing in the file: {}", missing.join(", "));
        Err(Diagnostic::new(Code::ForeignIncomplete, message).in_file(&self.path).into())
    }

    /// Returns true if the file has an object with this name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.missing(&[name]).is_empty()
    }

    /// Returns true if a group of this name exists and is not empty.
    pub(crate) fn has_members(&self, name: &str) -> bool {
        let group = if self.has(name) { self.root.group(name).ok() } else { None };
        group.is_some_and(|group| members(&group).is_ok_and(|names| !names.is_empty()))
    }

    /// Returns an error that describes the defect of a dataset.
    pub(crate) fn refuse(&self, name: &str, what: &str) -> Error {
        Diagnostic::new(Code::ForeignUnreadable, format!("`{name}`: {what}")).in_file(&self.path).into()
    }

    /// Reads a dataset of any shape.
    ///
    /// # Errors
    /// [`ForeignUnreadable`](Code::ForeignUnreadable) if the dataset is missing, damaged or of another type.
    pub(crate) fn values<T: Element>(&mut self, name: &str) -> Result<Values<T>> {
        let read = dataset::<T>(&self.root, name, &mut self.stored, elements);
        match read.and_then(|found| found.ok_or_else(|| "expected a dataset, found nothing".to_owned())) {
            Ok((values, shape)) => Ok(Values { shape, values }),
            Err(what) => Err(self.refuse(name, &what)),
        }
    }

    /// Reads integers of 64 or 32 bits.
    ///
    /// # Errors
    /// [`ForeignUnreadable`](Code::ForeignUnreadable) if the dataset is missing, damaged or of another type.
    pub(crate) fn integers(&mut self, name: &str) -> Result<Vec<i64>> {
        match self.values::<i32>(name) {
            Ok(found) => Ok(found.values.into_iter().map(i64::from).collect()),
            Err(_) => self.values::<i64>(name).map(|found| found.values),
        }
    }

    /// Reads floats of this shape; extents of one are ignored in the comparison of shapes.
    ///
    /// # Errors
    /// [`ForeignUnreadable`](Code::ForeignUnreadable) if the dataset is missing, damaged or of another type
    /// or shape.
    pub(crate) fn floats(&mut self, name: &str, shape: &[usize]) -> Result<Vec<f64>> {
        let found = self.values::<f64>(name)?;
        let long = |shape: &[usize]| shape.iter().copied().filter(|extent| *extent != 1).collect::<Vec<_>>();
        if long(&found.shape) != long(shape) {
            let what = format!("expected shape {shape:?}, found {:?}", found.shape);
            return Err(self.refuse(name, &what));
        }
        Ok(found.values)
    }

    /// Reads a single number.
    ///
    /// # Errors
    /// [`ForeignUnreadable`](Code::ForeignUnreadable) if the dataset is missing, damaged or not a single
    /// float.
    pub(crate) fn number(&mut self, name: &str) -> Result<f64> {
        self.floats(name, &[]).map(|values| values[0])
    }

    /// Reads a matrix.
    ///
    /// # Errors
    /// [`ForeignUnreadable`](Code::ForeignUnreadable) if the dataset is missing, damaged or of another type
    /// or shape.
    pub(crate) fn matrix(&mut self, name: &str, rows: usize, columns: usize) -> Result<Mat<f64>> {
        let values = self.floats(name, &[rows, columns])?;
        Ok(Mat::from_fn(rows, columns, |i, j| values[i * columns + j]))
    }

    /// Returns the two extents of a matrix.
    ///
    /// # Errors
    /// [`ForeignUnreadable`](Code::ForeignUnreadable) if the dataset has another number of extents, or an
    /// extent of zero.
    pub(crate) fn extents(&self, name: &str) -> Result<(usize, usize)> {
        let shape = open_dataset(&self.root, name).map_err(|what| self.refuse(name, &what))?;
        let shape = shape.map(|dataset| dataset.shape()).unwrap_or_default();
        match shape[..] {
            [rows, columns] if rows > 0 && columns > 0 => Ok((rows, columns)),
            _ => Err(self.refuse(name, &format!("expected a matrix, found extents {shape:?}"))),
        }
    }

    /// Returns a text attribute of a dataset; `None` if it is missing.
    pub(crate) fn attribute(&self, name: &str, attribute: &str) -> Option<String> {
        let dataset = open_dataset(&self.root, name).ok().flatten()?;
        text(&dataset, attribute).ok().flatten()
    }
}

/// Returns polygons and lines of a file as the surface of `n` nodes. Polygons are split into triangles from
/// their first corner. If indices refer to no node, the surface is dropped and `omissions` states it.
///
/// * `name`: name of the array in the file.
pub(crate) fn surface(
    name: &str,
    polygons: &[Vec<i64>],
    n: usize,
    omissions: &mut Vec<String>,
) -> Option<SurfaceMesh> {
    let (mut triangles, mut edges) = (Vec::new(), Vec::new());
    let index = |i: i64| u32::try_from(i).unwrap_or(u32::MAX);
    for corners in polygons {
        match corners[..] {
            [] | [_] => {}
            [a, b] => edges.push([index(a), index(b)]),
            [first, ref others @ ..] => {
                triangles
                    .extend(others.windows(2).map(|pair| [index(first), index(pair[0]), index(pair[1])]));
            }
        }
    }
    if triangles.is_empty() && edges.is_empty() {
        return None;
    }
    SurfaceMesh::new(triangles, edges, n)
        .map_err(|problem| {
            omissions.push(format!("`{name}`: {problem}; the body is converted without a surface"))
        })
        .ok()
}
