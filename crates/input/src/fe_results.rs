//! Results of an FE program for shapes with given displacements: stresses step by step, from which a recovery is made.
//! Each format has one file and is recognised by its content.

mod any_program;
mod averaged;
mod dat;
mod frd;
mod mesh_files;
mod punch;
mod step_values;
#[cfg(test)]
mod tests;

use super::classic_netcdf::is_classic;
use super::exodus::has_nodal_variables;
use super::matrices::hdf5::Hdf5;
use super::matrices::npz_archive::Archive;
use super::matrices::scipy_npz::ScipyNpz;
use super::matrices::{HEAD, Reader};
use crate::npy::{self, Blocks};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::Error;
use flexbody_base::text::InputFile;
use flexbody_base::units::UnitSystem;
use flexbody_linalg::ties::TIE_MARGIN;
use flexbody_model::{AnsweredShapes, DofLabel, Quantity, RecoveryOperator, RecoveryRow, ShapeSteps};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use step_values::{COMPONENTS, Place, StepValues, unreadable};

/// Smallest tolerance of displacements that an FE program returns, relative to the largest one of their shape. Files
/// with fewer digits get a tolerance of ten units of their last digit.
const MIN_TOLERANCE: f64 = 1e-9;

/// Files of the answers of an FE program to shapes.
pub(super) struct AnswerFiles<'a> {
    /// Stresses and displacements of every step.
    pub answers: &'a InputFile,
    /// Displacements of all nodes in the shapes: the archive that was written with the deck, or results.
    pub displacements: &'a InputFile,
    /// Printed results with the strain energy of every step.
    pub energies: Option<&'a InputFile>,
    /// Files that the answers or the displacements list (.pvd).
    pub listed: Vec<&'a InputFile>,
}

/// Returns the files that results list: those of a collection of VTK (.pvd).
pub(super) fn files_listed_by(results: &Path) -> Vec<PathBuf> {
    mesh_files::files_of(results)
}

/// Returns the recovery of the answers of an FE program: six stresses for each node or integration point, with
/// warnings.
///
/// # Errors
/// FB327 for results that cannot be read; FB326 for results of another number of shapes, of other displacements or
/// without displacements; the errors of archives of shapes.
pub(super) fn read_answers(
    files: &AnswerFiles<'_>,
    units: &UnitSystem,
) -> Diagnosed<(RecoveryOperator, Vec<Diagnostic>)> {
    let values = read_values(files.answers, &files.listed)?;
    let is_archive = ShapeArchive::recognises(files.displacements);
    let shapes = if is_archive {
        ShapeArchive::read(files.displacements)?
    } else {
        let moved = read_values(files.displacements, &files.listed)?;
        ShapeArchive::of_results(&moved, files.displacements)?
    };
    let count = shapes.count();
    if values.steps() != count {
        let message = format!(
            "the results have {} steps, {} has {count} shapes",
            values.steps(),
            files.displacements.path().display()
        );
        return Err(vec![Diagnostic::new(Code::RecoveryShapes, message).in_file(files.answers.path())]);
    }
    refuse_other_displacements(&values, &shapes, files)?;
    let energies = match files.energies {
        Some(printed) => dat::read(printed)?.energies().map(|energies| (energies, printed)),
        None => values.energies().map(|energies| (energies, files.answers)),
    };
    // An FE program prints no strain energies of modes that it has chosen itself.
    let energies = energies.filter(|(energies, _)| is_archive || energies.len() == count);
    if let Some((energies, file)) = energies.as_ref().filter(|(energies, _)| energies.len() != count) {
        let message = format!("strain energies are those of {} steps, expected {count}", energies.len());
        let help = "remove the file if it belongs to another run";
        return Err(vec![
            Diagnostic::new(Code::RecoveryShapes, message).in_file(file.path()).with_help(help),
        ]);
    }
    let averaged = values.averaged.diagnostics(files.answers);
    let labels = labels(&values.places, units);
    let energies = energies.map(|(energies, _)| energies);
    let ShapeArchive { dofs, displacements, digits } = shapes;
    let (answers, answer_digits) = (values.stresses(), values.digits);
    let shapes = AnsweredShapes { dofs, displacements, digits, answers, answer_digits, energies };
    Ok((RecoveryOperator::Shapes { shapes, labels }, averaged))
}

/// Stresses at integration points and displacements of nodes, as CalculiX prints them for all steps of a deck.
#[derive(Debug, Clone, PartialEq)]
pub struct PointStresses {
    /// Element and integration point of every stress, equal in all steps.
    pub points: Vec<(i64, i64)>,
    /// Stresses xx, yy, zz, xy, yz, xz of each step and point.
    pub stresses: Vec<Vec<[f64; 6]>>,
    /// Nodes of the displacements, equal in all steps.
    pub nodes: Vec<i64>,
    /// Displacements of each step and node.
    pub displacements: Vec<Vec<[f64; 3]>>,
    /// Significant decimal digits of the values.
    pub digits: u8,
}

/// Reads the printed results of CalculiX (.dat).
///
/// # Errors
/// FB101 and FB106 for a file that cannot be read, FB327 for another file, or without stresses at integration points.
pub fn read_point_stresses(path: &Path) -> Result<PointStresses, Error> {
    let file = InputFile::open(path)?;
    if !dat::recognises(&file.first_bytes(HEAD)) {
        let found = unreadable(&file, "the file does not begin like printed results of CalculiX (.dat)");
        return Err(Error::new(found));
    }
    let values = dat::read(&file).and_then(|values| values.with_stresses(&file)).map_err(Error::new)?;
    let point = |place: &Place| match *place {
        Place::Point { element, point } => Some((element, point)),
        Place::Node(_) => None,
    };
    let StepValues { places, stresses, moved, displacements, digits, .. } = values;
    let points = places.iter().filter_map(point).collect();
    Ok(PointStresses { points, stresses, nodes: moved, displacements, digits })
}

/// Reads results in any of the formats; `listed` are the files of collections.
fn read_values(file: &InputFile, listed: &[&InputFile]) -> Diagnosed<StepValues> {
    let head = file.first_bytes(HEAD);
    if Hdf5.recognises(&head) {
        return if has_nodal_variables(file) {
            mesh_files::read_exodus(file)
        } else {
            any_program::read_hdf5(file)
        };
    }
    if is_classic(&head) {
        return mesh_files::read_exodus(file);
    }
    file.load().map_err(|diagnostic| vec![diagnostic])?;
    if frd::recognises(&head) {
        return frd::read(file);
    }
    if dat::recognises(&head) {
        return dat::read(file);
    }
    if punch::recognises(&head) {
        return punch::read(file);
    }
    if mesh_files::is_vtk(&head) {
        return mesh_files::read_vtk(file, listed);
    }
    any_program::read_table(file)
}

/// Returns FB326 if the displacements in the results are not those of the shapes: the results then belong to another
/// deck.
fn refuse_other_displacements(
    values: &StepValues,
    shapes: &ShapeArchive,
    files: &AnswerFiles<'_>,
) -> Diagnosed<()> {
    let refuse = |message: String| {
        Err(vec![Diagnostic::new(Code::RecoveryShapes, message).in_file(files.answers.path())])
    };
    if values.moved.is_empty() {
        return refuse("the results have no displacements, which show that they belong to the shapes".into());
    }
    let place: HashMap<_, usize> = shapes.dofs.iter().enumerate().map(|(at, dof)| (*dof, at)).collect();
    let tolerance = MIN_TOLERANCE.max(10f64.powi(1 - i32::from(values.digits)));
    for (step, displacements) in values.displacements.iter().enumerate() {
        let size = shapes.displacements.col(step).norm_max();
        let (mut worst, mut at) = (0.0, 0);
        for (&node, u) in values.moved.iter().zip(displacements) {
            for (direction, &value) in (1..).zip(u) {
                let Some(&row) = place.get(&flexbody_model::DofLabel { node, direction }) else {
                    return refuse(format!("node {node} of the results is not among the shapes"));
                };
                let apart = (value - shapes.displacements[(row, step)]).abs();
                if apart > worst * (1.0 + TIE_MARGIN) {
                    (worst, at) = (apart, node);
                }
            }
        }
        if worst > tolerance * size {
            return refuse(format!(
                "displacements of step {} differ from those of its shape in {} by {:.1e} of the largest, at node {at}, expected at most {tolerance:.0e}",
                step + 1,
                files.displacements.path().display(),
                worst / size
            ));
        }
    }
    Ok(())
}

/// Returns six labels for each place.
fn labels(places: &[Place], units: &UnitSystem) -> Vec<RecoveryRow> {
    let unit = stress_unit(units);
    let of_place = |place: &Place| {
        let (name, node, element) = match *place {
            Place::Node(node) => (format!("n{node}"), Some(node), None),
            Place::Point { element, point } => (format!("e{element} p{point}"), None, Some(element)),
        };
        COMPONENTS.map(|component| RecoveryRow {
            name: format!("{name} {component}"),
            quantity: Quantity::Stress,
            component: component.to_owned(),
            unit: unit.clone(),
            node,
            element,
        })
    };
    places.iter().flat_map(of_place).collect()
}

/// Returns the unit of stress that follows from the units of the model.
fn stress_unit(units: &UnitSystem) -> String {
    let [mass, length, time] = [&units.mass, &units.length, &units.time];
    let pascal = mass.to_si() / (length.to_si() * time.to_si().powi(2));
    for (name, size) in [("Pa", 1.0), ("kPa", 1e3), ("MPa", 1e6), ("GPa", 1e9)] {
        if (pascal / size - 1.0).abs() < 1e-12 {
            return name.to_owned();
        }
    }
    format!("{pascal:e} Pa")
}

// Displacements of shapes as `flexbody shapes` writes them: an archive of the arrays `nodes` (n), `displacements`
// (shapes x n x 3) and, where nodes have rotations, `rotations` (shapes x n x 3). Results of an FE program have
// displacements as well.

/// Displacements of shapes.
struct ShapeArchive {
    /// Node and direction of every row.
    pub dofs: Vec<DofLabel>,
    /// Displacements, one column per shape.
    pub displacements: Mat<f64>,
    pub digits: u8,
}

const HELP: &str = "keep the archive that flexbody shapes writes beside the results";

/// Returns a diagnostic about an archive of shapes with this help in the place of that about matrices of SciPy.
fn of_archive(diagnostic: Diagnostic, help: &str) -> Diagnostic {
    match diagnostic.code() {
        Code::MemoryShort => diagnostic,
        _ => diagnostic.with_help(help),
    }
}

impl ShapeArchive {
    /// Returns the displacements of results, for shapes that the FE program has chosen itself.
    ///
    /// # Errors
    /// FB326 for results without displacements or with a node twice.
    fn of_results(values: &StepValues, file: &InputFile) -> Diagnosed<Self> {
        let dofs: Vec<DofLabel> = displacements_of(&values.moved).collect();
        let unique: HashSet<&i64> = values.moved.iter().collect();
        if dofs.is_empty() || unique.len() < values.moved.len() {
            let message = if dofs.is_empty() {
                "the results have no displacements"
            } else {
                "the results have two displacements of a node"
            };
            return Err(vec![Diagnostic::new(Code::RecoveryShapes, message).in_file(file.path())]);
        }
        let value = |row: usize, step: usize| values.displacements[step][row / 3][row % 3];
        let displacements = Mat::from_fn(dofs.len(), values.steps(), value);
        Ok(Self { dofs, displacements, digits: values.digits })
    }

    /// Returns true if a file begins like an archive.
    fn recognises(file: &InputFile) -> bool {
        ScipyNpz.recognises(&file.first_bytes(HEAD))
    }

    /// Reads an archive.
    ///
    /// # Errors
    /// FB326 for a file that is no such archive; FB103, FB301 to FB306 for damaged arrays.
    fn read(file: &InputFile) -> Diagnosed<Self> {
        let about = |diagnostic: Diagnostic| vec![of_archive(diagnostic, HELP).in_file(file.path())];
        let foreign = |message: String| about(Diagnostic::new(Code::RecoveryShapes, message));
        file.load().map_err(|diagnostic| vec![diagnostic])?;
        let mut archive = Archive::open(file.bytes()).map_err(about)?;
        if !archive.has("nodes") || !archive.has("displacements") {
            return Err(foreign("the archive has no arrays `nodes` and `displacements`".into()));
        }
        let nodes = npy::read_integers(&archive.member("nodes").map_err(about)?).map_err(about)?;
        let translations = blocks(&mut archive, "displacements").map_err(about)?;
        let rotations = if archive.has("rotations") {
            Some(blocks(&mut archive, "rotations").map_err(about)?)
        } else {
            None
        };
        let mut seen = HashSet::new();
        if let Some(twice) = nodes.iter().find(|node| !seen.insert(**node)) {
            return Err(foreign(format!("node {twice} is listed twice")));
        }
        let count = translations.count;
        for (name, array) in [("displacements", Some(&translations)), ("rotations", rotations.as_ref())] {
            let Some(array) = array else { continue };
            if (array.count, array.rows, array.columns) != (count, nodes.len(), 3) {
                let message = format!(
                    "`{name}` is {} x {} x {}, expected {count} x {} x 3",
                    array.count,
                    array.rows,
                    array.columns,
                    nodes.len()
                );
                return Err(foreign(message));
            }
        }
        let mut dofs: Vec<DofLabel> = displacements_of(&nodes).collect();
        if rotations.is_some() {
            let turned = |dof: DofLabel| DofLabel { direction: dof.direction + 3, ..dof };
            dofs.extend(displacements_of(&nodes).map(turned));
        }
        let rows = 3 * nodes.len();
        let value = |row: usize, shape: usize| match (row.checked_sub(rows), &rotations) {
            (Some(row), Some(rotations)) => rotations.values[shape * rows + row],
            _ => translations.values[shape * rows + row],
        };
        let displacements = Mat::from_fn(dofs.len(), count, value);
        Ok(Self { dofs, displacements, digits: translations.digits.min(15) })
    }

    /// Returns the number of shapes.
    fn count(&self) -> usize {
        self.displacements.ncols()
    }
}

/// Reads the steps in an archive of `flexbody shapes`.
///
/// # Errors
/// FB101 and FB106 for a file that cannot be read, FB326 for a file that is no such archive, FB103, FB301 to FB306 for
/// damaged arrays.
pub fn read_steps(path: &Path) -> Result<ShapeSteps, Error> {
    let file = InputFile::open(path)?;
    let about = |diagnostic: Diagnostic| {
        Error::new(vec![
            of_archive(diagnostic, "give the archive (.npz) that flexbody shapes wrote, or write it again")
                .in_file(path),
        ])
    };
    let foreign = |message: &str| about(Diagnostic::new(Code::RecoveryShapes, message));
    if !ShapeArchive::recognises(&file) {
        return Err(foreign("file is no archive of shapes"));
    }
    let mut archive = Archive::open(file.bytes()).map_err(about)?;
    if let Some(missing) =
        ["nodes", "displacements", "factors", "description"].iter().find(|name| !archive.has(name))
    {
        return Err(foreign(&format!("the archive has no array `{missing}`")));
    }
    let text = npy::read_text(&archive.member("description").map_err(about)?);
    let description: Option<serde_json::Value> = text.and_then(|text| serde_json::from_str(&text).ok());
    let columns = description.as_ref().and_then(|description| {
        let names = description["columns"].as_array()?;
        names.iter().map(|name| name.as_str().map(str::to_owned)).collect::<Option<Vec<String>>>()
    });
    let Some(columns) = columns else {
        return Err(foreign("the description of the archive does not name its steps"));
    };
    let follows = description.and_then(|description| description["modes_follow_spin"].as_bool());
    let factors = npy::read(&archive.member("factors").map_err(about)?).map_err(about)?.values;
    let nodes = npy::read_integers(&archive.member("nodes").map_err(about)?).map_err(about)?;
    let blocks = blocks(&mut archive, "displacements").map_err(about)?;
    if (blocks.count, blocks.rows, blocks.columns) != (columns.len(), nodes.len(), 3)
        || factors.len() != columns.len()
    {
        return Err(foreign("names, factors and displacements of the archive do not fit each other"));
    }
    let step = |step: &[f64]| step.as_chunks::<3>().0.to_vec();
    let displacements = blocks.values.chunks((3 * nodes.len()).max(1)).map(step).collect();
    Ok(ShapeSteps { columns, factors, nodes, displacements, modes_follow_spin: follows.unwrap_or(true) })
}

/// Returns the labels of three displacements for each node.
fn displacements_of(nodes: &[i64]) -> impl Iterator<Item = DofLabel> {
    nodes.iter().flat_map(|&node| (1..=3).map(move |direction| DofLabel { node, direction }))
}

fn blocks(archive: &mut Archive<'_>, name: &str) -> Result<Blocks, Diagnostic> {
    npy::read_blocks(&archive.member(name)?)
}
