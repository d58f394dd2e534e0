//! The digests of the content of an HDF5 file: a SHA-256 of every group and dataset with its attributes, by path, as
//! `docs/reference/file_format.md` describes them. Files of equal content have equal digests, whatever their layout.

use super::value::{Record, Stored, attribute_names, attribute_record, dataset_record};
use crate::provenance::Fingerprint;
use hdf5::{IndexType, IterationOrder, LinkType, LocationType};
use hdf5_metno as hdf5;
use std::collections::{BTreeMap, HashMap};

/// Depth of groups above which a file is refused: no format version has deeper ones.
const MAX_DEPTH: usize = 8;
/// Number of entries above which a file is refused. Groups may contain themselves, so that even a small file can have
/// endlessly many paths.
const MAX_ENTRIES: usize = 100_000;
/// Number of elements that are converted to bytes at a time.
const BLOCK: usize = 1 << 13;

/// SHA-256 in hexadecimal by path.
pub type Digests = BTreeMap<String, String>;
/// Fingerprints of datasets whose elements have been hashed already, by path.
pub type Numbers = HashMap<String, Fingerprint>;

/// Element type of a dataset.
pub trait Number: Copy + Sync {
    /// Name of the type in the hashed header.
    const KIND: &'static str;
    /// Appends the bytes of the number, little-endian.
    fn put(self, bytes: &mut Vec<u8>);
}

macro_rules! number {
    ($type:ty, $kind:literal) => {
        impl Number for $type {
            const KIND: &'static str = $kind;
            fn put(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
        }
    };
}
number!(f64, "float64");
number!(f32, "float32");
number!(i64, "int64");
number!(i32, "int32");

/// Returns the fingerprint of a dataset without its attributes: `values` row-major in the extents `shape`.
pub fn of_numbers<T: Number>(shape: &[usize], values: &[T]) -> Fingerprint {
    let mut fingerprint = Fingerprint::default();
    fingerprint.update(header("", T::KIND, shape, size_of_val(values)).as_bytes());
    let mut bytes = Vec::with_capacity(size_of::<T>() * BLOCK.min(values.len()));
    for block in values.chunks(BLOCK) {
        bytes.clear();
        block.iter().for_each(|value| value.put(&mut bytes));
        fingerprint.update(&bytes);
    }
    fingerprint
}

/// Returns the header that is hashed before the bytes of a dataset (without a name) or of an attribute. The lengths in
/// it make the hashed text unambiguous.
fn header(name: &str, kind: &str, shape: &[usize], bytes: usize) -> String {
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    format!("{} {name} {kind} {} {bytes}\n", name.len(), shape.join("x"))
}

/// Adds header and bytes of a dataset or an attribute to the fingerprint.
fn add(fingerprint: &mut Fingerprint, name: &str, record: &Record) {
    fingerprint.update(header(name, record.kind, &record.shape, record.bytes.len()).as_bytes());
    fingerprint.update(&record.bytes);
}

/// Returns the digests of all groups and datasets of `file`, without the attributes `except` of the root. Datasets in
/// `numbers` are not read; only their attributes are.
///
/// # Errors
/// The path of an entry that no flex-body file has, with the problem.
pub fn digests_of(
    file: &hdf5::File,
    numbers: &Numbers,
    stored: &mut Stored,
    except: &[&str],
) -> Result<Digests, String> {
    let mut walk = DigestWalk { numbers, stored, except, found: Digests::new() };
    let root = file.as_group().map_err(|e| format!("/: {e}"))?;
    walk.group(&root, "/", 0)?;
    Ok(walk.found)
}

/// A walk through all groups of a file that collects digests.
struct DigestWalk<'a> {
    numbers: &'a Numbers,
    stored: &'a mut Stored,
    except: &'a [&'a str],
    found: Digests,
}

impl DigestWalk<'_> {
    fn group(&mut self, group: &hdf5::Group, path: &str, depth: usize) -> Result<(), String> {
        self.object(group, path, Fingerprint::default())?;
        let links = group.links(IndexType::Name, IterationOrder::Native);
        for (name, link) in links.map_err(|e| format!("{path}: {e}"))? {
            let inner = format!("{}/{name}", path.trim_end_matches('/'));
            if link.link_type != LinkType::Hard || depth == MAX_DEPTH || name.contains('\n') {
                return Err(format!("{inner}: not an entry of a flex-body file"));
            }
            self.member(group, &name, &inner, depth)?;
        }
        Ok(())
    }

    fn member(&mut self, group: &hdf5::Group, name: &str, path: &str, depth: usize) -> Result<(), String> {
        let about = |e: hdf5::Error| format!("{path}: {e}");
        match group.loc_type_by_name(name).map_err(about)? {
            LocationType::Group => self.group(&group.group(name).map_err(about)?, path, depth + 1),
            LocationType::Dataset => {
                let dataset = group.dataset(name).map_err(about)?;
                let numbers = match self.numbers.get(path) {
                    Some(fingerprint) => fingerprint.clone(),
                    None => {
                        let record =
                            dataset_record(&dataset, self.stored).map_err(|e| format!("{path}: {e}"))?;
                        let mut fingerprint = Fingerprint::default();
                        add(&mut fingerprint, "", &record);
                        fingerprint
                    }
                };
                self.object(&dataset, path, numbers)
            }
            _ => Err(format!("{path}: not an entry of a flex-body file")),
        }
    }

    /// Adds the attributes of a group or dataset to its fingerprint, in the order of their names, and lists the digest.
    fn object(
        &mut self,
        place: &hdf5::Location,
        path: &str,
        mut fingerprint: Fingerprint,
    ) -> Result<(), String> {
        let about = |problem: String| format!("{path}: {problem}");
        let mut names = attribute_names(place).map_err(about)?;
        names.sort_unstable();
        for name in names.iter().filter(|name| path != "/" || !self.except.contains(&name.as_str())) {
            let record = attribute_record(place, name).map_err(|e| format!("{path}@{name}: {e}"))?;
            add(&mut fingerprint, name, &record);
        }
        self.found.insert(path.to_owned(), fingerprint.hex());
        if self.found.len() > MAX_ENTRIES {
            return Err(format!("{path}: more than {MAX_ENTRIES} entries"));
        }
        Ok(())
    }
}

/// Writes a dataset of numbers, row-major in the extents `shape`, and stores their fingerprint in `numbers`.
pub fn put_numbers<T: Number + hdf5::H5Type>(
    place: &hdf5::Group,
    name: &str,
    shape: &[usize],
    values: &[T],
    numbers: &mut Numbers,
) -> hdf5::Result<hdf5::Dataset> {
    let dataset = place.new_dataset::<T>().obj_track_times(false).shape(shape.to_vec()).create(name)?;
    dataset.write_raw(values)?;
    let path = format!("{}/{name}", place.name().trim_end_matches('/'));
    numbers.insert(path, of_numbers(shape, values));
    Ok(dataset)
}
