//! VTK: the body with its modes as one mesh, or a motion as one mesh for each output time and a list of the
//! meshes.

use super::grid::{Grid, escaped};
use crate::export::Holding::{Held, NotApplicable};
use crate::export::{ExportChecklist, ExportFormat, ExportOptions, Exported};
use crate::picture::{Drawn, Played, mode_names, named, printable};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_file::RecordedMotion;
use std::fmt::Write;

/// Export format of VTK.
pub(crate) struct Vtk;

/// Largest number of files of a motion, and largest size of all of them in bytes; a longer motion is thinned.
const MOST_FILES: usize = 250;
const MAX_BYTES: usize = 500_000_000;

impl ExportFormat for Vtk {
    fn name(&self) -> &'static str {
        "vtk"
    }

    fn reader(&self) -> &'static str {
        "ParaView, PyVista, VisIt: modes to warp by (.vtu), or a motion (.pvd)"
    }

    fn has_points(&self) -> bool {
        true
    }

    fn is_picture(&self) -> bool {
        true
    }

    /// Returns mechanical properties as not applicable to a picture; [`leaves_out`](Self::leaves_out) names
    /// them.
    fn checklist(&self, _: &FlexBody, _: &ExportOptions) -> ExportChecklist {
        ExportChecklist {
            rigid_coupling: NotApplicable,
            plane: NotApplicable,
            deformed_inertia: NotApplicable,
            general_w0: NotApplicable,
            coriolis_force: NotApplicable,
            general_w3: NotApplicable,
            separate_w2: NotApplicable,
            geometric_stiffness: NotApplicable,
            inertia_stiffness: NotApplicable,
            damping: NotApplicable,
            shapes: Held,
            rotations: Held,
            internal_rows: NotApplicable,
            gravity: NotApplicable,
            interfaces: Held,
            surface: Held,
            origins_of_modes: Held,
            units: Held,
            storage: NotApplicable,
        }
    }

    fn needs(&self, _: &FlexBody, options: &ExportOptions) -> Vec<String> {
        named(options, if options.motion.is_some() { "pvd" } else { "vtu" }).into_iter().collect()
    }

    fn leaves_out(&self, body: &FlexBody, options: &ExportOptions) -> Vec<String> {
        let mut left = vec![
            "vtk holds positions, shapes and interfaces for pictures, but no mass, stiffness, damping or inertia"
                .to_owned(),
        ];
        match options.modes {
            Some(modes) if modes < body.n_modes() => {
                left.push(format!("the first {modes} of {} modes are written", body.n_modes()));
            }
            _ => {}
        }
        if let Some(motion) = &options.motion {
            let played = played(&Drawn::places(body, &options.points), motion);
            if played.len() < motion.time.len() {
                left.push(format!("{} are written", played.in_words()));
            }
        }
        left
    }

    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported> {
        let drawn = Drawn::places(body, &options.points);
        let modes = options.modes.unwrap_or(body.n_modes());
        let mut grid = Grid::new(&drawn);
        grid.put_field("metres_per_unit_of_length", &[body.units().length.to_si()]);
        match &options.motion {
            Some(motion) => {
                let stem = options.name.as_ref().and_then(|name| name.file_stem());
                let stem = stem.map_or("motion".into(), |stem| stem.to_string_lossy());
                Ok(series(&grid, &drawn, &played(&drawn, motion), modes, &stem))
            }
            None => Ok(Exported::single(with_modes(grid, body, &drawn, modes))),
        }
    }
}

/// Returns the undeformed body with a vector at every point for each mode.
fn with_modes(mut grid: Grid, body: &FlexBody, drawn: &Drawn<'_>, modes: usize) -> Vec<u8> {
    grid.put_field("frequency_hz", &body.frequencies_hz()[..modes]);
    let names = mode_names(body, modes);
    for (j, name) in names.iter().enumerate() {
        grid.put_vectors(name, &drawn.shape(j));
    }
    for (j, name) in names.iter().enumerate() {
        if let Some(rotation) = drawn.rotation(j) {
            grid.put_vectors(&name.replacen("mode", "rotation", 1), &rotation);
        }
    }
    grid.file(&drawn.positions())
}

/// Returns the output times of a motion that are written.
fn played<'m>(drawn: &Drawn<'_>, motion: &'m RecordedMotion) -> Played<'m> {
    let (cells, interfaces) = (drawn.triangles().len() + drawn.edges().len(), drawn.interfaces().len());
    let bytes = drawn.len() * (3 * 8 + 3 * 8 + 8 + interfaces) + cells * (3 * 8 + 8 + 1);
    Played::new(motion, MOST_FILES.min(MAX_BYTES / bytes.max(1)))
}

/// Returns one mesh for each output time, and the list that ParaView opens.
fn series(grid: &Grid, drawn: &Drawn<'_>, played: &Played<'_>, modes: usize, stem: &str) -> Exported {
    let positions = drawn.positions();
    let shapes: Vec<_> = (0..modes).map(|j| drawn.shape(j)).collect();
    let mut list = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n",
    );
    let mut beside = Vec::new();
    for instant in 0..played.len() {
        let (places, deflections) = played.places(instant, &positions, &shapes);
        let mut own = grid.clone();
        own.put_vectors("deflection", &deflections);
        let ending = format!("_{instant:04}.vtu");
        let name = escaped(&printable(&format!("{stem}{ending}")));
        writeln!(list, "<DataSet timestep=\"{:e}\" part=\"0\" file=\"{name}\"/>", played.time(instant))
            .expect("a text takes what is written to it");
        beside.push((ending.into(), own.file(&places)));
    }
    list += "</Collection>\n</VTKFile>\n";
    Exported { file: list.into_bytes(), beside }
}
