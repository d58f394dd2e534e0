//! Displacements of shapes as `flexbody shapes` writes them: an archive of the arrays `nodes` (n), `displacements`
//! (shapes x n x 3) and, where nodes have rotations, `rotations` (shapes x n x 3). Results of an FE program have
//! displacements as well.

use super::{Found, StepValues};
use crate::npy::{self, Blocks};
use crate::reader::{HEAD, Reader};
use crate::scipy_npz::{Archive, ScipyNpz};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_model::DofLabel;
use std::collections::HashSet;

/// Displacements of shapes.
pub(super) struct ShapeArchive {
    /// Node and direction of every row.
    pub dofs: Vec<DofLabel>,
    /// Displacements, one column per shape.
    pub displacements: Mat<f64>,
    pub digits: u8,
}

const HELP: &str = "keep the archive that flexbody shapes writes beside the results";

impl ShapeArchive {
    /// Returns the displacements of results, for shapes that the FE program has chosen itself.
    ///
    /// # Errors
    /// FB326 for results without displacements or with a node twice.
    pub(super) fn of_results(values: &StepValues, file: &InputFile) -> Found<Self> {
        let dofs: Vec<DofLabel> = displacements_of(&values.moved).collect();
        let unique: HashSet<&i64> = values.moved.iter().collect();
        if dofs.is_empty() || unique.len() < values.moved.len() {
            let message = match dofs.is_empty() {
                true => "the results have no displacements",
                false => "the results have two displacements of a node",
            };
            return Err(vec![Diagnostic::new(Code::RecoveryShapes, message).in_file(file.path())]);
        }
        let value = |row: usize, step: usize| values.displacements[step][row / 3][row % 3];
        let displacements = Mat::from_fn(dofs.len(), values.steps(), value);
        Ok(Self { dofs, displacements, digits: values.digits })
    }

    /// Returns true if a file begins like an archive.
    pub(super) fn recognises(file: &InputFile) -> bool {
        ScipyNpz.recognises(&file.first_bytes(HEAD))
    }

    /// Reads an archive.
    ///
    /// # Errors
    /// FB326 for a file that is no such archive; FB103, FB301 to FB306 for damaged arrays.
    pub(super) fn read(file: &InputFile) -> Found<Self> {
        let about = |diagnostic: Diagnostic| vec![diagnostic.in_file(file.path()).with_help(HELP)];
        let foreign = |message: String| about(Diagnostic::new(Code::RecoveryShapes, message));
        file.load().map_err(|diagnostic| vec![diagnostic])?;
        let mut archive = Archive::open(file.bytes()).map_err(about)?;
        if !archive.has("nodes") || !archive.has("displacements") {
            return Err(foreign("the archive has no arrays `nodes` and `displacements`".into()));
        }
        let nodes = npy::read_integers(&archive.member("nodes").map_err(about)?).map_err(about)?;
        let translations = blocks(&mut archive, "displacements").map_err(about)?;
        let rotations = match archive.has("rotations") {
            true => Some(blocks(&mut archive, "rotations").map_err(about)?),
            false => None,
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
    pub(super) fn count(&self) -> usize {
        self.displacements.ncols()
    }
}

/// Returns the labels of three displacements for each node.
fn displacements_of(nodes: &[i64]) -> impl Iterator<Item = DofLabel> {
    nodes.iter().flat_map(|&node| (1..=3).map(move |direction| DofLabel { node, direction }))
}

fn blocks(archive: &mut Archive<'_>, name: &str) -> Result<Blocks, Diagnostic> {
    npy::read_blocks(&archive.member(name)?)
}
