//! The file of recoveries over time: a small HDF5 file with a separate format, described in
//! `docs/reference/recovery.md`.

use super::names;
use super::schema::labels_json;
use super::write::system_error;
use flexbody_base::error::Result;
use flexbody_base::hdf5_file::{create, make, put_text};
use flexbody_base::output::OutputSlot;
use flexbody_base::provenance::generator;
use flexbody_body::flex_body::FlexBody;
use flexbody_motion::scene::{LoadedHistory, RecoveredRows};
use hdf5_metno as hdf5;
use std::path::Path;

/// Value of the root attribute `format`.
const FORMAT: &str = "flexbody-recovered";
/// Version of the format.
const VERSION: i64 = 1;

/// Writes recoveries of `body` over time to the temporary file of `slot`, which appears under its name when the slot is
/// committed.
///
/// # Errors
/// FB104 if the file cannot be written, FB602 if the disk is full.
pub fn fill_recovered(
    body: &FlexBody,
    history: &LoadedHistory,
    recovered: &[RecoveredRows<'_>],
    slot: &OutputSlot,
) -> Result<()> {
    fill(body, history, recovered, slot.temporary()).map_err(|e| slot.failure(&system_error(&e.to_string())))
}

fn fill(
    body: &FlexBody,
    history: &LoadedHistory,
    recovered: &[RecoveredRows<'_>],
    path: &Path,
) -> hdf5::Result<()> {
    let file = create(path)?;
    put_text(&file, "format", FORMAT)?;
    file.new_attr::<i64>().create("format_version")?.write_scalar(&VERSION)?;
    put_text(&file, "generator", &generator())?;
    put_text(&file, "body", &body.source().name)?;
    put_text(&file, "history", &history.path.display().to_string())?;
    let time = put(&file.as_group()?, "time", &[history.time.len()], &history.time)?;
    put_text(&time, "units", body.units().time.name())?;
    make(&file, "/recovery")?;
    for one in recovered {
        let group = make(&file, &format!("/recovery/{}", names::encode(&one.recovery.name)))?;
        put_text(&group, "rows", &labels_json(&one.recovery.rows))?;
        let values: Vec<f64> = one.values.iter().flatten().copied().collect();
        let shape = [one.values.len(), one.recovery.rows.len()];
        let values = put(&group, "values", &shape, &values)?;
        put_text(
            &values,
            "description",
            "one row per instant, one column per row of the recovery, in its unit",
        )?;
        if !one.points.is_empty() {
            let names: Vec<&str> = one.points.iter().map(|point| point.name.as_str()).collect();
            put_text(&group, "points", &serde_json::to_string(&names).expect("strings are valid JSON"))?;
            let equivalent: Vec<f64> = (0..history.time.len()).flat_map(|at| one.von_mises(at)).collect();
            let shape = [history.time.len(), one.points.len()];
            let equivalent = put(&group, "von_mises", &shape, &equivalent)?;
            let about = "equivalent stress of von Mises, one row per instant, one column per point";
            put_text(&equivalent, "description", about)?;
        }
    }
    file.flush()?;
    file.close()
}

fn put(place: &hdf5::Group, name: &str, shape: &[usize], values: &[f64]) -> hdf5::Result<hdf5::Dataset> {
    let dataset = place.new_dataset::<f64>().obj_track_times(false).shape(shape.to_vec()).create(name)?;
    dataset.write_raw(values)?;
    Ok(dataset)
}
