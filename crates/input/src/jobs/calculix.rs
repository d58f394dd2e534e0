//! Jobs of CalculiX: `*FREQUENCY, SOLVER=MATRIXSTORAGE` writes `job.sti`, `job.mas` (upper triangles, 14 digits) and
//! `job.dof` (a line `node.direction` for every row) into the folder of the deck `job.inp`.

use super::coordinate_files::CoordinateFile;
use super::deck::Deck;
use super::deck_mesh::DeckMesh;
use super::distributing_couplings::{placed_note, reference_places};
use super::expanded::{Once, label_once};
use super::rotation_nodes::rotation_nodes;
use super::{Found, JobFile, JobModel, JobReader, both, is_deck, missing};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_base::text::scanner::{Line, Lines, expected, integer};
use flexbody_model::{DofLabel, GivenRows, Nodes};
use std::collections::BTreeMap;
use std::path::Path;

/// Reader of CalculiX jobs.
pub(super) struct Calculix;

const HELP: &str =
    "run the deck with *FREQUENCY, SOLVER=MATRIXSTORAGE, and keep .sti, .mas and .dof beside it";

impl JobReader for Calculix {
    fn name(&self) -> &'static str {
        "calculix"
    }

    fn needs(&self) -> &'static str {
        "job.inp with job.sti, job.mas and job.dof beside it"
    }

    fn recognises(&self, path: &Path) -> bool {
        is_deck(path) && ["sti", "mas", "dof"].iter().any(|extension| path.with_extension(extension).exists())
    }

    fn read(&self, job: &JobFile) -> Found<JobModel> {
        let path = job.path.as_path();
        let [sti, mas, dof] = ["sti", "mas", "dof"].map(|extension| path.with_extension(extension));
        let absent =
            [(&sti, "stiffness matrix"), (&mas, "mass matrix"), (&dof, "list of degrees of freedom")];
        let absent = absent.iter().filter(|(file, _)| !file.exists());
        let absent: Vec<Diagnostic> = absent.map(|(file, what)| missing(file, what, HELP)).collect();
        if !absent.is_empty() {
            return Err(absent);
        }
        let deck = Deck::read(path)?;
        let mesh = DeckMesh::of(&deck)?;
        let (labels, dofs_file) = read_labels(&dof)?;
        let rotations = rotation_nodes(&deck, &mesh, &labels)?;
        let means = reference_places(&deck, &mesh)?;
        let n = labels.len();
        let read = |file| CoordinateFile::read(file, n as u32)?.into_matrix(n);
        // The files are read one after the other: each uses all threads, and the entries of only one are in memory.
        let stiffness = read(&sti);
        let ((stiffness, stiffness_file), (mass, mass_file)) = both(stiffness, read(&mas))?;
        let Once { labels, places } = label_once(&deck, &mesh, labels, [&stiffness, &mass], &dof)?;
        let label = |label: &DofLabel| match rotations.get(&label.node) {
            Some(reference) => DofLabel { node: *reference, direction: label.direction + 3 },
            None => *label,
        };
        let dofs: Vec<DofLabel> = labels.iter().map(label).collect();
        // Nodes that only carry rotations have no position.
        let placed = mesh.nodes.iter().filter(|(id, _)| !rotations.contains_key(id));
        let place = |(id, x): (&i64, &[f64; 3])| (*id, *means.get(id).unwrap_or(x));
        let mut nodes: BTreeMap<i64, [f64; 3]> = placed.map(place).collect();
        nodes.extend(places);
        let (ids, positions) = nodes.into_iter().unzip();
        let mut diagnostics = mesh.notes.clone();
        diagnostics.extend(placed_note(&means, &dofs, path));
        let mut files = deck.seen()?;
        files.extend([("stiffness", stiffness_file), ("mass", mass_file), ("dofs", dofs_file)]);
        Ok(JobModel {
            stiffness,
            mass,
            nodes: Nodes { ids, positions },
            dofs,
            given_rows: GivenRows::default(),
            elements: mesh.drawn(),
            sets: mesh.sets,
            unresolved: mesh.unresolved,
            files,
            diagnostics,
        })
    }
}

/// Reads the labels of the rows from lines `node.direction`.
fn read_labels(path: &Path) -> Found<(Vec<DofLabel>, SeenFile)> {
    let file = InputFile::open(path).map_err(|diagnostic| vec![diagnostic])?;
    let mut labels = Vec::with_capacity(file.bytes().len() / 6);
    for Line { number, text: line } in Lines::of(file.bytes()).filter_map(Line::content) {
        let label = line.iter().position(|&b| b == b'.').and_then(|dot| {
            let (node, direction) = (integer(&line[..dot])?, integer(&line[dot + 1..])?);
            (1..=3).contains(&direction).then_some(DofLabel { node, direction: direction as u8 })
        });
        let Some(label) = label else {
            let diagnostic = expected(Code::TableRow, "a node and a direction as in `17.3`", line);
            let help = "write the file again: structures have the directions 1 to 3";
            return Err(vec![diagnostic.in_file(path).at_line(number).with_help(help)]);
        };
        labels.push(label);
    }
    Ok((labels, file.seen().map_err(|diagnostic| vec![diagnostic])?))
}
