//! Reads the file of a simulation as needed for pictures: the motion of the frame and of the modes.

use super::recorded_motion::RecordedMotion;
use super::simulation::{FORMAT, VERSION};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::hdf5_file::{
    self as hdf5_file, Stored, dataset, elements, open_group, open_with_checked_texts,
};
use flexbody_body::flex_body::Carrier;
use hdf5_metno as hdf5;
use std::path::Path;

/// Reads the motion that `flexbody simulate` wrote to `path`.
///
/// # Errors
/// FB101 if the file cannot be read; FB734 if it is another file, one of another version, or a damaged one.
pub fn read_simulation(path: impl AsRef<Path>) -> Result<RecordedMotion> {
    let path = path.as_ref();
    let (file, bytes) = open_with_checked_texts(path, "motion", Code::MotionUnreadable)?;
    let mut reading = RecordingReader { file, stored: Stored::new(bytes) };
    reading
        .motion()
        .map_err(|problem| Error::from(Diagnostic::new(Code::MotionUnreadable, problem).in_file(path)))
}

struct RecordingReader {
    file: hdf5::File,
    stored: Stored,
}

impl RecordingReader {
    fn motion(&mut self) -> std::result::Result<RecordedMotion, String> {
        let root = self.file.as_group().map_err(|e| e.to_string())?;
        match hdf5_file::text(&root, "format")? {
            Some(format) if format == FORMAT => {}
            found => return Err(format!("the attribute `format` is {found:?}, expected `{FORMAT}`")),
        }
        match hdf5_file::int(&root, "format_version")? {
            Some(VERSION) => {}
            found => return Err(format!("format version {found:?}, expected {VERSION}")),
        }
        let (time, _) = self.rows("/", "time", None)?;
        let instants = time.len();
        let (q, modes) = self.rows("/modes", "q", Some(instants))?;
        let mut vectors =
            |group: &str, name: &str, width: usize, rows: usize| match self.rows(group, name, Some(rows))? {
                (values, columns) if columns == width => Ok(values),
                (_, columns) => Err(format!("{group}/{name}: expected {width} columns, found {columns}")),
            };
        let origins = vectors("/frame", "origin", 3, instants)?;
        let attitudes = vectors("/frame", "attitude", 4, instants)?;
        let origin_in_model = vectors("/frame", "origin_in_model", 3, 1)?;
        if time.windows(2).any(|pair| pair[0] > pair[1]) {
            return Err("time: expected ascending instants".to_owned());
        }
        Ok(RecordedMotion {
            scene: hdf5_file::text(&root, "scene")?.unwrap_or_default(),
            body: hdf5_file::text(&root, "body")?.unwrap_or_default(),
            carrier: self.carrier(&root)?,
            origin_in_model: origin_in_model.try_into().map_err(|_| "/frame/origin_in_model")?,
            time,
            modes,
            q,
            origins,
            attitudes,
            largest_deflection: hdf5_file::float(&root, "largest_deflection")?
                .filter(|v| v.is_finite())
                .unwrap_or(0.0),
        })
    }

    /// Returns the carrier of the body. Files of earlier versions state that there is one, but not which.
    fn carrier(&self, root: &hdf5::Group) -> std::result::Result<Option<Carrier>, String> {
        if let Some(words) = hdf5_file::text(root, "carrier")? {
            let carrier = Carrier::from_words(&words);
            return carrier
                .map(Some)
                .ok_or(format!("the attribute `carrier` is {words:?}, expected an interface or a node"));
        }
        let frame = open_group(&self.file, "/frame").map_err(|found| format!("/frame: found {found}"))?;
        let origin = hdf5_file::open_dataset(&frame, "origin")?;
        let described = origin.map(|origin| hdf5_file::text(&origin, "description")).transpose()?.flatten();
        match described {
            Some(text) if text.starts_with("reference point") => {
                Err("the body is carried, but the file does not state by which interface or node: run flexbody simulate again".to_owned())
            }
            _ => Ok(None),
        }
    }

    /// Returns finite numbers with a row for every instant, and their number of columns. `rows` is the required number
    /// of rows, if it is known.
    fn rows(
        &mut self,
        group: &str,
        name: &str,
        rows: Option<usize>,
    ) -> std::result::Result<(Vec<f64>, usize), String> {
        let about = |problem: String| format!("{}/{name}: {problem}", group.trim_end_matches('/'));
        let place = open_group(&self.file, group)
            .map_err(|found| about(format!("expected a group, found {found}")))?;
        let fit = |dims: &[usize]| match *dims {
            [own] | [own, _] if rows.is_none_or(|rows| rows == own) => elements(dims),
            _ => Err(format!(
                "expected {} rows, found shape {dims:?}",
                rows.map_or("some".to_owned(), |n| n.to_string())
            )),
        };
        let read = dataset::<f64>(&place, name, &mut self.stored, fit).map_err(about)?;
        let (values, dims) = read.ok_or_else(|| about("expected a dataset, found nothing".to_owned()))?;
        if values.is_empty() || values.iter().any(|v| !v.is_finite()) {
            return Err(about("expected finite numbers".to_owned()));
        }
        Ok((values, dims.get(1).copied().unwrap_or(1)))
    }
}
