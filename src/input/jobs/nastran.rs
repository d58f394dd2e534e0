//! Jobs of Nastran: a deck (.bdf, .dat, .nas), or a punch file with the grids of a superelement, and the
//! matrices in it or beside it: DMIG cards, which name their rows, or OUTPUT4, whose rows follow the points.

mod assigned;
mod axes;
mod bulk;
mod elements;
mod rows;
mod sets;
mod systems;

use super::{Found, JobModel, JobReader, NodeSets, both, condensed, missing, siblings};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::input::bulk_cards::is_bulk_data;
use crate::input::bytes::InputFile;
use crate::input::dmig::{Dmigs, Point};
use crate::input::nastran_names::pair;
use crate::input::output4;
use crate::model::{DofLabel, Elements, Nodes, RawMatrix, filled_rows};
use crate::numerics::linalg::CscMatrix;
use axes::Turn;
use bulk::Bulk;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};
use systems::Systems;

/// The reader of Nastran jobs.
pub(super) struct Nastran;

const HELP: &str = "write them with PARAM,EXTOUT,DMIGPCH, EXTSEOUT(DMIGPCH), or OUTPUT4 KGG,MGG";

/// Unit vectors along the rows of a node.
type Axes = [[f64; 3]; 3];

impl JobReader for Nastran {
    fn name(&self) -> &'static str {
        "nastran"
    }

    fn needs(&self) -> &'static str {
        "job.bdf with DMIG cards, or with job.pch or job.op4 beside it"
    }

    fn recognises(&self, path: &Path) -> bool {
        InputFile::open(path).is_ok_and(|file| is_bulk_data(file.bytes()))
    }

    fn read(&self, path: &Path) -> Found<JobModel> {
        let mut bulk = Bulk::read(path)?;
        if bulk.grids.is_empty() {
            let diagnostic = Diagnostic::new(Code::DeckSyntax, "the deck has no GRID").in_file(path);
            return Err(vec![diagnostic.with_help("give the deck, or the punch file that has the grids")]);
        }
        let (nodes, axes) = places(&bulk)?;
        let dmigs = std::mem::take(&mut bulk.dmigs);
        let matrices = Matrices::of(&bulk, dmigs, path, &axes)?;
        let mut diagnostics = told(&bulk, path);
        let matrices = matrices.turned(&axes)?.without_empty_rows(&mut diagnostics);
        matrices.refuse_modal(&bulk)?;
        if bulk.is_condensed() {
            diagnostics.push(condensed(matrices.grids(&bulk), &matrices.stiffness.path));
        }
        let sets = bulk.sets.of(&bulk.grids);
        let mut files: Vec<(&'static str, PathBuf)> =
            bulk.files.iter().map(|path| ("deck", path.clone())).collect();
        files.extend(matrices.files.iter().map(|path| ("matrices", path.clone())));
        let Matrices { stiffness, mass, labels: dofs, .. } = matrices;
        // Condensed matrices leave no element all of its nodes.
        let elements = if bulk.is_condensed() { Elements::default() } else { bulk.elements };
        Ok(JobModel { stiffness, mass, nodes, dofs, sets, elements, files, diagnostics })
    }
}

/// Places of the grids in the basic system, and the axes of the rows of those that stand along others.
fn places(bulk: &Bulk) -> Found<(Nodes, HashMap<i64, Axes>)> {
    const SHOWN: usize = 5;
    let mut systems = Systems::new(&bulk.systems, &bulk.grids);
    let (mut nodes, mut axes, mut bad) = (Nodes::default(), HashMap::new(), Vec::new());
    for (&id, grid) in &bulk.grids {
        let found = systems.position(grid).and_then(|x| Ok((x, systems.axes(grid, x)?)));
        match found {
            Ok((x, own)) => {
                nodes.ids.push(id);
                nodes.positions.push(x);
                if grid.axes.is_some_and(|system| system != 0) {
                    axes.insert(id, own);
                }
            }
            Err(diagnostic) if bad.len() < SHOWN => bad.push(match diagnostic.file() {
                None => diagnostic
                    .about(format!("grid {id}"))
                    .in_file(&bulk.card_files[grid.file])
                    .at_line(grid.line),
                Some(_) => diagnostic,
            }),
            Err(_) => {}
        }
    }
    bad.dedup();
    if bad.is_empty() { Ok((nodes, axes)) } else { Err(bad) }
}

/// The grids, sets and elements of a deck whose matrices come from elsewhere.
///
/// # Errors
/// Those of [`Bulk::read`], and FB111 where rows of grids stand along other axes than those of the basic
/// system.
pub(in crate::input) fn nodes_of_bulk(path: &Path) -> Found<(Nodes, NodeSets, Elements)> {
    let bulk = Bulk::read(path)?;
    let (nodes, axes) = places(&bulk)?;
    if let Some(grid) = axes.keys().min() {
        let message = format!(
            "rows of {} grids stand along the axes of their CD, the first of them grid {grid}: matrices from elsewhere cannot be turned with them",
            axes.len()
        );
        let diagnostic = Diagnostic::new(Code::DeckUnsupported, message).in_file(path);
        return Err(vec![diagnostic.with_help("give the deck as the model, with its matrices beside it")]);
    }
    let sets = bulk.sets.of(&bulk.grids);
    Ok((nodes, sets, bulk.elements))
}

/// What the deck says that a user should know.
fn told(bulk: &Bulk, path: &Path) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    if bulk.has_elements && !bulk.coupled_mass {
        let message = "the deck does not ask for coupled masses (PARAM,COUPMASS,1): Nastran lumps them";
        found.push(Diagnostic::new(Code::DeckLumps, message).in_file(path));
    }
    if let Some((path, line, count)) = &bulk.supports {
        let message = match count {
            1 => "a card supports the body".to_owned(),
            _ => format!("{count} cards support the body"),
        };
        found.push(Diagnostic::new(Code::DeckSupports, message).in_file(path).at_line(*line));
    }
    found
}

/// K and M with the labels of their rows.
struct Matrices {
    stiffness: RawMatrix,
    mass: RawMatrix,
    labels: Vec<DofLabel>,
    /// Files beside the deck that they were read from.
    files: Vec<PathBuf>,
}

impl Matrices {
    /// The matrices of the deck, else those of the files beside it: either of punch files or of OUTPUT4.
    fn of(bulk: &Bulk, dmigs: Dmigs, path: &Path, axes: &HashMap<i64, Axes>) -> Found<Self> {
        let names = dmigs.names();
        // Beside elements they are a part of the model that its own matrices contain.
        if !names.is_empty() && !bulk.has_elements {
            let pair = pair(&names).map_err(|pairs| no_pair(&names, &pairs, path))?;
            return Self::of_dmigs(dmigs, pair, Vec::new(), axes);
        }
        // A file of the name of the deck, else those whose names go on.
        let with = |extension: &str| {
            let beside = siblings(path).filter(|(rest, file)| rest.ends_with(extension) && file != path);
            let mut files: Vec<(String, PathBuf)> = beside.collect();
            files.sort();
            if files.iter().any(|(rest, _)| rest == extension) {
                files.retain(|(rest, _)| rest == extension);
            }
            files.into_iter().map(|(_, file)| file).collect::<Vec<PathBuf>>()
        };
        let (punches, mut outputs) = (with(".pch"), with(".op4"));
        let assigned = bulk.assigned.outputs(path);
        let (there, absent): (Vec<PathBuf>, Vec<PathBuf>) =
            assigned.into_iter().partition(|file| file.is_file());
        outputs.extend(there.into_iter().filter(|file| !outputs.contains(file)).collect::<Vec<_>>());
        if punches.is_empty() && outputs.is_empty() {
            let what = match absent.first() {
                Some(file) => format!("{}, which the deck assigns to OUTPUT4,", file.display()),
                None => "beside the deck a file of matrices (job.pch, job.op4)".to_owned(),
            };
            return Err(vec![missing(path, &what, HELP)]);
        }
        let punched = Dmigs::of(&punches)?;
        let outputs = Outputs::of(outputs)?;
        match (pair(&punched.names()), pair(&outputs.names)) {
            (Ok(pair), Err(_)) => Self::of_dmigs(punched, pair, punches, axes),
            (Err(_), Ok(pair)) => outputs.matrices(bulk, pair),
            (punch_pair, output_pair) => {
                let names = [punched.names(), outputs.names].concat();
                let shift = punched.names().len();
                let shifted = |(k, m): (usize, usize)| (k + shift, m + shift);
                let mut pairs = punch_pair.map_or_else(|pairs| pairs, |pair| vec![pair]);
                let others = output_pair.map_or_else(|pairs| pairs, |pair| vec![pair]);
                pairs.extend(others.into_iter().map(shifted));
                Err(no_pair(&names, &pairs, path))
            }
        }
    }

    fn of_dmigs(
        mut dmigs: Dmigs,
        (k, m): (usize, usize),
        files: Vec<PathBuf>,
        axes: &HashMap<i64, Axes>,
    ) -> Found<Self> {
        let mut points: BTreeSet<Point> = dmigs.points(&[k, m]).into_iter().collect();
        // Rows that are turned together have to be there, also where they are zero.
        let turned: Vec<Point> = points.iter().filter(|(id, _)| axes.contains_key(id)).copied().collect();
        for (id, component) in turned {
            let first = if component > 3 { 4 } else { 1 };
            points.extend((first..first + 3).map(|component| (id, component)));
        }
        let points: Vec<Point> = points.into_iter().collect();
        let mut matrix = |at| dmigs.take_matrix(at, &points).map_err(|diagnostic| vec![diagnostic]);
        let (stiffness, mass) = both(matrix(k), matrix(m))?;
        let labels = points.into_iter().map(rows::label).collect();
        Ok(Self { stiffness, mass, labels, files })
    }

    /// With all rows along the axes of the basic system.
    fn turned(self, axes: &HashMap<i64, Axes>) -> Found<Self> {
        if !self.labels.iter().any(|label| axes.contains_key(&label.node)) {
            return Ok(self);
        }
        let turn = Turn::new(&self.labels, axes).map_err(|node| {
            let message = format!(
                "rows of grid {node} stand along the axes of its CD, but not each of its directions is there once"
            );
            vec![Diagnostic::new(Code::DeckUnsupported, message).in_file(&self.stiffness.path)]
        })?;
        let turned = |raw: RawMatrix| turn.turned(raw).map_err(|diagnostic| vec![diagnostic]);
        let (stiffness, mass) = both(turned(self.stiffness), turned(self.mass))?;
        Ok(Self { stiffness, mass, ..self })
    }

    /// Without the rows that are empty in both matrices: rotations of solids, and all rows of points that
    /// nothing is fixed to.
    fn without_empty_rows(self, found: &mut Vec<Diagnostic>) -> Self {
        let Self { stiffness, mass, labels, files } = self;
        let filled = filled_rows([&stiffness.matrix, &mass.matrix], labels.len());
        let rows = || labels.iter().zip(&filled);
        let moving: HashSet<i64> =
            rows().filter(|(_, filled)| **filled).map(|(label, _)| label.node).collect();
        // A displacement without stiffness and mass is a mistake where the node has others.
        let keeps = |(label, filled): (&DofLabel, &bool)| {
            *filled || label.direction <= 3 && moving.contains(&label.node)
        };
        let kept: Vec<usize> = (0..labels.len()).filter(|&row| keeps((&labels[row], &filled[row]))).collect();
        if kept.len() == labels.len() {
            return Self { stiffness, mass, labels, files };
        }
        let turning = rows().filter(|(label, filled)| !**filled && moving.contains(&label.node)).count();
        let left_out = labels.len() - kept.len();
        let message = format!(
            "{left_out} rows without stiffness and mass are left out: {turning} rotations, {} of points that nothing is fixed to",
            left_out - turning
        );
        found.push(Diagnostic::new(Code::RowsEmpty, message).in_file(&stiffness.path));
        let [stiffness, mass] = [stiffness, mass].map(|raw| principal(raw, &kept));
        Self { stiffness, mass, labels: kept.iter().map(|&row| labels[row]).collect(), files }
    }

    /// FB111 for modal coordinates: rows of scalar points with mass. What they move, and so how the inertia
    /// changes with them, is not in K and M.
    fn refuse_modal(&self, bulk: &Bulk) -> Found<()> {
        let is_modal = |(row, label): (usize, &DofLabel)| {
            !bulk.grids.contains_key(&label.node)
                && bulk.scalars.contains(&label.node)
                && !self.mass.matrix.column(row).0.is_empty()
        };
        let modal = self.labels.iter().enumerate().filter(|own| is_modal(*own)).count();
        if modal == 0 {
            return Ok(());
        }
        let message = format!(
            "{modal} scalar points have mass: modal coordinates, whose shapes are not in the matrices"
        );
        let help = "give K and M of all grids, and the modes by --basis craig-bampton or --basis imported; or condense to grids alone (no QSET, SPOINT)";
        let diagnostic = Diagnostic::new(Code::DeckUnsupported, message).in_file(&self.mass.path);
        Err(vec![diagnostic.with_help(help)])
    }

    /// Number of the grids that have rows.
    fn grids(&self, bulk: &Bulk) -> usize {
        let named = self.labels.iter().map(|label| label.node);
        named.filter(|node| bulk.grids.contains_key(node)).collect::<HashSet<i64>>().len()
    }
}

/// Some rows, ascending, and the same columns of a matrix that has no entries elsewhere.
fn principal(raw: RawMatrix, kept: &[usize]) -> RawMatrix {
    let mut local = vec![u32::MAX; raw.matrix.n_rows()];
    kept.iter().enumerate().for_each(|(to, &row)| local[row] = to as u32);
    let mut col_ptr = vec![0];
    let (mut row_idx, mut values) = (Vec::new(), Vec::new());
    for &column in kept {
        let (rows, own) = raw.matrix.column(column);
        row_idx.extend(rows.iter().map(|&row| local[row as usize]));
        values.extend_from_slice(own);
        col_ptr.push(row_idx.len());
    }
    let matrix = CscMatrix::from_parts(kept.len(), kept.len(), col_ptr, row_idx, values);
    RawMatrix { matrix, ..raw }
}

/// The OUTPUT4 files beside a deck.
struct Outputs {
    files: Vec<(InputFile, output4::Contents)>,
    names: Vec<String>,
    /// File of each name, and which of its matrices it is.
    places: Vec<(usize, usize)>,
}

impl Outputs {
    fn of(paths: Vec<PathBuf>) -> Found<Self> {
        let mut all = Self { files: Vec::new(), names: Vec::new(), places: Vec::new() };
        for path in paths {
            let file = InputFile::open(&path).map_err(|diagnostic| vec![diagnostic])?;
            let found = output4::Contents::of(&file);
            let contents = found.map_err(|diagnostic| vec![diagnostic.in_file(&path)])?;
            let names = contents.names();
            all.places.extend((0..names.len()).map(|at| (all.files.len(), at)));
            all.names.extend(names);
            all.files.push((file, contents));
        }
        Ok(all)
    }

    fn matrices(&self, bulk: &Bulk, (k, m): (usize, usize)) -> Found<Matrices> {
        let matrix = |name: usize| {
            let (file, at) = self.places[name];
            let (file, contents) = &self.files[file];
            contents.matrix(file, at).map_err(|diagnostic| vec![diagnostic.in_file(file.path())])
        };
        let (stiffness, mass) = both(matrix(k), matrix(m))?;
        let [rows, others] = [&stiffness, &mass].map(|own| own.matrix.n_cols());
        if rows != others {
            let message = format!("{} has {rows} rows, {} has {others}", self.names[k], self.names[m]);
            return Err(vec![Diagnostic::new(Code::MatrixSizesDiffer, message).in_file(&mass.path)]);
        }
        let points = rows::points(bulk, rows, &self.names[k], &stiffness.path);
        let labels = points.map_err(|diagnostic| vec![diagnostic])?.into_iter().map(rows::label).collect();
        let mut files = vec![stiffness.path.clone()];
        files.extend((mass.path != stiffness.path).then(|| mass.path.clone()));
        Ok(Matrices { stiffness, mass, labels, files })
    }
}

/// FB109 where there is no pair of matrices, FB111 where there are several.
fn no_pair(names: &[String], pairs: &[(usize, usize)], path: &Path) -> Vec<Diagnostic> {
    if pairs.is_empty() {
        let found = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let what = format!("a stiffness and a mass matrix (names that begin with K and M; found: {found})");
        return vec![missing(path, &what, HELP)];
    }
    let all: Vec<String> = pairs.iter().map(|&(k, m)| format!("{} and {}", names[k], names[m])).collect();
    let help = "leave one stiffness and one mass matrix beside the deck";
    let message = format!("{} pairs of matrices stand to choose from: {}", pairs.len(), all.join("; "));
    vec![Diagnostic::new(Code::DeckUnsupported, message).in_file(path).with_help(help)]
}
