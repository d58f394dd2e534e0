//! Writes a body by the rows of the table.

use super::item::{Item, ItemKind};
use super::names;
use super::per::Per;
use super::scan::key;
use super::schema::ORDER;
use super::schema::TABLE;
use super::value::{Value, View};
use super::version::EMPTY_GROUPS_LEFT_OUT_SINCE;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::hdf5_file::{Number, Numbers, create, finish, make, of_numbers, put_text};
use flexbody_base::output::OutputSlot;
use flexbody_base::provenance::Fingerprint;
use flexbody_body::flex_body::FlexBody;
use hdf5_metno as hdf5;
use std::path::Path;

/// Reserves `path` for a body file, so that a long computation does not end at an unwritable output.
///
/// # Errors
/// The errors of [`OutputSlot::prepare`]; [`OutputUnwritable`](Code::OutputUnwritable) for paths that HDF5 cannot use,
/// if an open file has no name in UTF-8.
pub fn prepare_output(path: impl AsRef<Path>) -> Result<OutputSlot> {
    let slot = OutputSlot::prepare(path)?;
    if cfg!(not(unix)) && slot.temporary().to_str().is_none() {
        let message = format!("cannot write {}: HDF5 needs a path in UTF-8", slot.path().display());
        return Err(Diagnostic::new(Code::OutputUnwritable, message).into());
    }
    Ok(slot)
}

/// Writes `body` to `path`. The file appears complete or not at all. Equal bodies give equal bytes.
///
/// # Errors
/// The errors of [`prepare_output`] and [`write_to`].
pub fn write(body: &FlexBody, path: impl AsRef<Path>) -> Result<()> {
    write_to(body, prepare_output(path)?)
}

/// Writes `body` to an output reserved by [`prepare_output`].
///
/// # Errors
/// [`DiskShort`](Code::DiskShort) or [`OutputUnwritable`](Code::OutputUnwritable); an existing file is then unchanged.
pub fn write_to(body: &FlexBody, slot: OutputSlot) -> Result<()> {
    fill_slot(body, &slot)?;
    slot.commit()
}

/// Writes `body` to the temporary file of `slot`. The file appears under its name when the slot is committed.
///
/// # Errors
/// The errors of [`write_to`].
pub fn fill_slot(body: &FlexBody, slot: &OutputSlot) -> Result<()> {
    fill(body, slot.temporary()).map_err(|e| slot.failure(&system_error(&e.to_string())))
}

/// Returns the system error in a message of HDF5, which has its number only in the text.
pub(super) fn system_error(text: &str) -> std::io::Error {
    let number = text.split_once("errno = ").and_then(|(_, rest)| {
        let digits = rest.find(|c: char| !c.is_ascii_digit()).map_or(rest, |end| &rest[..end]);
        digits.parse().ok()
    });
    number.map_or_else(|| std::io::Error::other(text), std::io::Error::from_raw_os_error)
}

/// Writes all groups and entries of the body.
fn fill(body: &FlexBody, path: &Path) -> hdf5::Result<()> {
    let file = create(path)?;
    let mut numbers = Numbers::default();
    for group in TABLE {
        let instances = group.instances(body.parts());
        let is_left_out = instances.is_empty() && group.since() >= EMPTY_GROUPS_LEFT_OUT_SINCE;
        if group.per != Per::Body && !is_left_out {
            let parent = make(&file, group.parent())?;
            if let Some(order) = group.order(&instances) {
                put_text(&parent, ORDER, &order)?;
            }
        }
        for (name, view) in instances {
            if group.per == Per::Body
                && group.since() > 0
                && group.entries().all(|item| item.value(&view).is_none())
            {
                continue;
            }
            let path = group.place(name.as_deref().map(names::encode).as_deref());
            let target = if path == "/" { file.as_group()? } else { make(&file, &path)? };
            for item in group.entries() {
                let Some(value) = item.value(&view) else { continue };
                if let Some(fingerprint) = put(&target, item, &view, value)? {
                    numbers.insert(key(&path, item), fingerprint);
                }
            }
        }
    }
    finish(file, path, &numbers)
}

/// Writes an entry. Returns the fingerprint of its numbers if it is a dataset.
fn put(place: &hdf5::Group, item: &Item, view: &View<'_>, value: Value) -> hdf5::Result<Option<Fingerprint>> {
    match (item.kind, value) {
        (ItemKind::Floats(_), Value::Floats(values)) if item.is_short(view.body.storage) => {
            let short: Vec<f32> = values.into_iter().map(nearest_f32).collect();
            return put_numbers(place, item, view, &short).map(Some);
        }
        (ItemKind::Floats(_), Value::Floats(values)) => {
            return put_numbers(place, item, view, &values).map(Some);
        }
        (ItemKind::Ints(_), Value::Ints(values)) => return put_numbers(place, item, view, &values).map(Some),
        (ItemKind::Indices(_), Value::Indices(values)) => {
            return put_numbers(place, item, view, &values).map(Some);
        }
        (ItemKind::Text, Value::Text(text)) => put_text(place, item.name, &text)?,
        (ItemKind::Int, Value::Int(v)) => place.new_attr::<i64>().create(item.name)?.write_scalar(&v)?,
        (ItemKind::Float, Value::Float(v)) => place.new_attr::<f64>().create(item.name)?.write_scalar(&v)?,
        (ItemKind::Named, Value::Named(values)) => values
            .iter()
            .try_for_each(|(n, v)| place.new_attr::<f64>().create(n.as_str())?.write_scalar(v))?,
        (kind, value) => unreachable!("table entry {}: {kind:?} for {value:?}", item.name),
    }
    Ok(None)
}

/// Writes a dataset of numbers, and returns their fingerprint, which is computed at the same time. Nothing is
/// compressed: mode shapes would shrink by 5 to 30 %, at a cost of a tenth of the time of the conversion.
fn put_numbers<T: hdf5::H5Type + Number>(
    place: &hdf5::Group,
    item: &Item,
    view: &View<'_>,
    values: &[T],
) -> hdf5::Result<Fingerprint> {
    let shape = item.dims(view);
    let dataset = place.new_dataset::<T>().obj_track_times(false).shape(shape.clone()).create(item.name)?;
    let (fingerprint, written) = rayon::join(|| of_numbers(&shape, values), || dataset.write_raw(values));
    written?;
    describe(&dataset, item, view)?;
    Ok(fingerprint)
}

#[allow(clippy::cast_possible_truncation)] // rounding to 32 bits is intended
fn nearest_f32(value: f64) -> f32 {
    value as f32
}

fn describe(dataset: &hdf5::Dataset, item: &Item, view: &View<'_>) -> hdf5::Result<()> {
    put_text(dataset, "units", &item.units.concrete(&view.body.description.units))?;
    put_text(dataset, "symbol", item.symbol)?;
    put_text(dataset, "description", item.description)
}

#[cfg(test)]
mod tests {
    use super::system_error;
    use std::io::ErrorKind;

    #[test]
    fn the_number_of_the_system_error_is_found() {
        let text =
            "H5Dwrite(): file write failed: file descriptor = 3, errno = 28, error message = 'No space'";
        assert_eq!(system_error(text).raw_os_error(), Some(28));
        #[cfg(unix)]
        assert_eq!(system_error(text).kind(), ErrorKind::StorageFull);
        for text in ["H5Fcreate(): unable", "errno = ", "errno = 99999999999"] {
            assert_eq!(system_error(text).kind(), ErrorKind::Other);
            assert_eq!(system_error(text).to_string(), text);
        }
    }
}
