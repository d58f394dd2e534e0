//! Command `flexbody export`.

use super::arguments::ExportArguments;
use super::outcome::{Outcome, refuse_replacing};
use super::run::{Printed, Run};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_file::read_simulation;
use flexbody_formats::export::{AllowedLosses, ExportFormat, ExportOptions, Exported, Points};
use flexbody_formats::{export_in_units, find_format, motion_of_losses};
use flexbody_input::parse_units;
use flexbody_motion::scene::LoadCases;
use std::borrow::Cow;
use std::path::PathBuf;
use std::str::FromStr;

pub(super) fn run(arguments: &ExportArguments) -> Result<Outcome> {
    let format = find_format(&arguments.to)?;
    let level = arguments.mbdyn_level.as_ref().map(|level| format!("level{level}"));
    let mut options = ExportOptions {
        dialect: arguments.dialect.clone().or(level),
        points: arguments.points.as_deref().map(Points::from_str).transpose()?.unwrap_or_default(),
        modes: arguments.modes.map(|modes| modes as usize),
        motion: arguments.simulation.as_ref().map(read_simulation).transpose()?,
        name: Some(arguments.output.clone()),
        in_scene: Vec::new(),
    };
    let allowed = match &arguments.allow_loss {
        None => AllowedLosses::None,
        Some(names) if names.is_empty() => AllowedLosses::All,
        Some(names) => AllowedLosses::named(names.clone())?,
    };
    let units = arguments.to_units.as_deref().map(parse_units).transpose()?;
    let inputs = || std::iter::once(&arguments.body).chain(&arguments.simulation).chain(&arguments.scene);
    let mut run = Run::begin(arguments.printing, inputs(), [&arguments.output], &[])?;
    let slot = OutputSlot::prepare(&arguments.output)?;

    let body = run.read_body(&arguments.body)?;
    if let Some(scene) = &arguments.scene {
        let cases = LoadCases::read(scene, None)?;
        options.in_scene = motion_of_losses(&body, format, &options, &cases, &run.context(true))?;
    }
    let (exported, findings) = export_in_units(&body, format, &options, units.as_ref(), allowed)
        .map_err(|error| error.in_file(arguments.simulation.as_ref().unwrap_or(&arguments.body)))?;
    run.note(findings);
    run.data()?;
    // Files beside the output are known only now: they must not replace an input either.
    let place_and_size = |(ending, bytes): &(Cow<'_, str>, Vec<u8>)| {
        (Exported::place_beside(&arguments.output, ending), bytes.len())
    };
    let beside: Vec<(PathBuf, usize)> = exported.beside.iter().map(place_and_size).collect();
    let taken: Vec<&PathBuf> = inputs().chain(std::iter::once(&arguments.output)).collect();
    refuse_replacing(taken.into_iter(), beside.iter().map(|(path, _)| path))?;
    let slots = exported.fill(slot)?;
    let written = [vec![(arguments.output.clone(), exported.file.len())], beside].concat();
    run.end_with(slots, |_| String::new(), printed(format, &written), true)
}

/// Returns the texts about the `written` files and their sizes.
fn printed(format: &dyn ExportFormat, written: &[(PathBuf, usize)]) -> Printed {
    let line = |(path, size): &(PathBuf, usize)| match path.extension() {
        Some(extension) if extension == "py" => {
            format!("{}, {size} bytes: a program, run it with python3\n", path.display())
        }
        _ => format!("{}, {size} bytes: {} for {}\n", path.display(), format.name(), format.reader()),
    };
    let file = |(path, size): &(PathBuf, usize)| serde_json::json!({ "path": path.display().to_string(), "bytes": size });
    let files: serde_json::Value = written.iter().map(file).collect();
    let json = serde_json::json!({ "format": format.name(), "files": files });
    // One line per file, or a summary for many files.
    let listed = if written.len() > MOST_LINES { 1 } else { written.len() };
    let (listed, others) = written.split_at(listed);
    let mut text: String = listed.iter().map(line).collect();
    if let Some((first, _)) = others.first() {
        let size: usize = others.iter().map(|(_, size)| size).sum();
        text += &format!("{} and others, {} files, {size} bytes\n", first.display(), others.len());
    }
    Printed { text, json: format!("{json:#}") }
}

/// Number of files up to which each is listed. Of more files the first is listed, with a summary of the others.
const MOST_LINES: usize = 8;
