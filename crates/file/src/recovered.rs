//! The file of recoveries over time: a small HDF5 file with a separate format, described in
//! `docs/reference/recovery.md`.

use super::names;
use super::schema::labels_json;
use super::write::system_error;
use flexbody_base::error::Result;
use flexbody_base::hdf5_file::{Numbers, create, finish, make, put_numbers, put_text};
use flexbody_base::output::OutputSlot;
use flexbody_base::provenance::generator;
use flexbody_body::flex_body::FlexBody;
use flexbody_motion::scene::{Channels, RecoveredMotion, RowMap, StressPoint};
use hdf5_metno as hdf5;
use std::path::Path;

/// Value of the root attribute `format`.
const FORMAT: &str = "flexbody-recovered";
/// Version of the format.
const VERSION: i64 = 1;

/// Writes recoveries of `body` over a motion to the temporary file of `slot`, which appears under its name when the slot
/// is committed.
///
/// * `origin`: name and value of the root attribute that says where the motion is from.
///
/// # Errors
/// FB104 if the file cannot be written, FB602 if the disk is full.
pub fn fill_recovered(
    body: &FlexBody,
    motion: &RecoveredMotion,
    origin: (&str, &str),
    slot: &OutputSlot,
) -> Result<()> {
    fill(body, motion, origin, slot.temporary()).map_err(|e| slot.failure(&system_error(&e.to_string())))
}

fn fill(body: &FlexBody, motion: &RecoveredMotion, origin: (&str, &str), path: &Path) -> hdf5::Result<()> {
    let (file, mut numbers) = begun(path, FORMAT, body, origin, &motion.states.times)?;
    make(&file, "/recovery")?;
    for recovery in &motion.recoveries {
        let group = make(&file, &format!("/recovery/{}", names::encode(&recovery.name)))?;
        fill_rows(&group, recovery, motion, &mut numbers)?;
    }
    finish(file, path, &numbers)
}

/// Creates a file with the format, the body, the origin of the motion and its times; also returns the fingerprints of its
/// datasets.
fn begun(
    path: &Path,
    format: &str,
    body: &FlexBody,
    origin: (&str, &str),
    times: &[f64],
) -> hdf5::Result<(hdf5::File, Numbers)> {
    let (file, mut numbers) = (create(path)?, Numbers::new());
    put_text(&file, "format", format)?;
    file.new_attr::<i64>().create("format_version")?.write_scalar(&VERSION)?;
    put_text(&file, "generator", &generator())?;
    put_text(&file, "body", &body.description().name)?;
    put_text(&file, origin.0, origin.1)?;
    let time = put_numbers(&file.as_group()?, "time", &[times.len()], times, &mut numbers)?;
    put_text(&time, "units", body.units().time.name())?;
    Ok((file, numbers))
}

/// Writes channels of the steps of an FE program to the temporary file of `slot`, which appears under its name when the
/// slot is committed.
///
/// * `history`: file of the motion.
///
/// # Errors
/// FB104 if the file cannot be written, FB602 if the disk is full.
pub fn fill_channels(body: &FlexBody, channels: &Channels, history: &str, slot: &OutputSlot) -> Result<()> {
    let fill = || -> hdf5::Result<()> {
        let origin = ("history", history);
        let (file, mut numbers) =
            begun(slot.temporary(), "flexbody-channels", body, origin, &channels.times)?;
        let values = put_numbers(
            &file.as_group()?,
            "channels",
            &[channels.times.len(), channels.names.len()],
            &channels.values.concat(),
            &mut numbers,
        )?;
        put_text(&values, "names", &serde_json::to_string(&channels.names).expect("strings are valid JSON"))?;
        put_text(
            &values,
            "description",
            "factors of the steps, one row per instant; the last is that of the values at rest",
        )?;
        finish(file, slot.temporary(), &numbers)
    };
    fill().map_err(|e| slot.failure(&system_error(&e.to_string())))
}

/// Writes the rows of one recovery, and the stress measures of its points.
fn fill_rows(
    group: &hdf5::Group,
    map: &RowMap,
    motion: &RecoveredMotion,
    numbers: &mut Numbers,
) -> hdf5::Result<()> {
    let instants = motion.states.times.len();
    let rows: Vec<Vec<f64>> = motion.states.iter().map(|z| map.values(z)).collect();
    put_text(group, "rows", &labels_json(&map.rows))?;
    let mut put = |name: &str, shape: &[usize], values: &[f64], description: &str| {
        put_text(&*put_numbers(group, name, shape, values, numbers)?, "description", description)
    };
    put(
        "values",
        &[instants, map.rows.len()],
        &rows.concat(),
        "one row per instant, one column per row of the recovery, in its unit",
    )?;
    if map.points.is_empty() {
        return Ok(());
    }
    let names: Vec<&str> = map.points.iter().map(|point| point.name.as_str()).collect();
    put_text(group, "points", &serde_json::to_string(&names).expect("strings are valid JSON"))?;
    let shape = [instants, map.points.len()];
    let of_points = |measure: &dyn Fn(&StressPoint, &[f64]) -> f64| -> Vec<f64> {
        rows.iter().flat_map(|rows| map.points.iter().map(|point| measure(point, rows))).collect()
    };
    put(
        "von_mises",
        &shape,
        &of_points(&StressPoint::von_mises),
        "equivalent stress of von Mises, one row per instant, one column per point",
    )?;
    put(
        "signed_von_mises",
        &shape,
        &of_points(&StressPoint::signed_von_mises),
        "equivalent stress of von Mises with the sign of the principal stress of the largest magnitude",
    )?;
    let principal: Vec<f64> =
        rows.iter().flat_map(|rows| map.points.iter().flat_map(|point| point.principal(rows))).collect();
    put(
        "principal",
        &[instants, map.points.len(), 3],
        &principal,
        "principal stresses, the largest first; instants x points x 3",
    )
}
