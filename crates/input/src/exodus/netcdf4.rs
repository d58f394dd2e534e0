//! Exodus II in netCDF-4, which is HDF5.

use super::variables::{ExodusFile, NumberTable, wrong_layers};
use crate::hdf5::{Heaps, Members, Numbers, Vector, layout, names_of, opened, refuse_beyond_memory, text_of};
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::InputFile;
use hdf5_metno::Group;
use std::cell::Cell;

/// Opens a file and runs `read` on it; returns its result.
///
/// # Errors
/// FB101 for a file that cannot be opened.
pub(super) fn with_exodus<T>(file: &InputFile, read: impl FnOnce(&dyn ExodusFile) -> T) -> Diagnosed<T> {
    let opened = opened(file)?;
    let root = opened.group("/").map_err(|e| vec![layout(format!("file cannot be read: {e}"))])?;
    let members = Members::of(&root);
    Ok(read(&Datasets { members, root, heaps: Heaps::of(file), length: file.length(), read: Cell::new(0) }))
}

/// Datasets of the root group.
struct Datasets<'f> {
    root: Group,
    members: Members,
    heaps: Heaps<'f>,
    /// Number of bytes of the file.
    length: u64,
    /// Number of stored bytes of the datasets that were read.
    read: Cell<u64>,
}

impl Datasets<'_> {
    fn vector(&self, name: &str) -> Diagnosed<Vector> {
        self.numbers(name)?;
        Vector::open(&self.root, &self.members, "", name)
    }

    /// Opens a dataset to read its values. Each dataset has one name: all together store no more bytes than the file has.
    fn numbers(&self, name: &str) -> Diagnosed<Numbers> {
        let numbers = self.unread(name)?;
        let read = self.read.get().saturating_add(numbers.dataset.storage_size());
        self.read.set(read);
        if read <= self.length {
            return Ok(numbers);
        }
        let (dataset, length) = (&numbers.name, self.length);
        Err(vec![layout(format!(
            "dataset {dataset} has several names: the datasets up to it store {read} bytes together, the file has {length}"
        ))])
    }

    fn unread(&self, name: &str) -> Diagnosed<Numbers> {
        Numbers::open(&self.root, &self.members, "", name)
    }
}

impl ExodusFile for Datasets<'_> {
    fn has(&self, name: &str) -> bool {
        self.members.link(name).is_some()
    }

    fn floats(&self, name: &str) -> Diagnosed<Vec<f64>> {
        let vector = self.vector(name)?;
        vector.floats(0..vector.len)
    }

    fn whole_numbers(&self, name: &str) -> Diagnosed<Vec<i64>> {
        let vector = self.vector(name)?;
        vector.integers(0..vector.len)
    }

    fn stacked(&self, name: &str, layers: usize) -> Diagnosed<NumberTable> {
        let numbers = self.numbers(name)?;
        let shape = numbers.dataset.shape();
        match shape.as_slice() {
            &[times, own, columns] if own == layers => read_rows(&numbers, times * layers, columns),
            _ => Err(vec![layout(wrong_layers(name, &shape, layers))]),
        }
    }

    fn table(&self, name: &str) -> Diagnosed<NumberTable> {
        let numbers = self.numbers(name)?;
        let &[rows, columns] = numbers.dataset.shape().as_slice() else {
            return Err(vec![layout(format!("dataset {} is not a table of numbers", numbers.name))]);
        };
        read_rows(&numbers, rows, columns)
    }

    fn names(&self, name: &str) -> Diagnosed<Vec<String>> {
        names_of(&self.root, &self.members, name)
    }

    fn element_type(&self, name: &str) -> String {
        let kind = self.unread(name).ok().and_then(|numbers| numbers.dataset.attr("elem_type").ok());
        kind.and_then(|kind| text_of(&kind, &self.heaps)).unwrap_or_default()
    }
}

/// Returns the values of a dataset as a table.
fn read_rows(numbers: &Numbers, rows: usize, columns: usize) -> Diagnosed<NumberTable> {
    refuse_beyond_memory(numbers.dataset.size(), &numbers.name)?;
    let values = numbers.dataset.read_raw::<f64>();
    let failed = |e| vec![layout(format!("dataset {} cannot be read: {e}", numbers.name))];
    let values = values.map_err(failed)?;
    Ok(NumberTable { rows, columns, values, is_single_precision: numbers.is_single_precision() })
}
