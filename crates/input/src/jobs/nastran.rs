//! Jobs of Nastran: a deck (.bdf, .dat, .nas), or a punch file with the grids of a superelement, and the matrices in it
//! or in its folder: DMIG cards, which name their rows, or OUTPUT4, whose rows follow the points.

mod bulk;
mod carried_mass;
mod constraints;
mod control_sections;
mod described;
mod elimination;
mod matrices;
mod systems;

use super::dependent_rows::with_dependent_rows;
use super::job::{JobFile, JobModel, JobReader, condensed, damping_left_out};
use crate::bulk_cards::is_bulk_data;
use crate::node_file::NodeFile;
use bulk::Bulk;
use described::described;
use elimination::GridPlaces;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_base::text::scanner::BadLines;
use flexbody_elements::{DescribedElements, NotDescribed};
use flexbody_model::{Elements, NodeAxes as Axes, Nodes};
use matrices::Matrices;
use std::collections::{BTreeSet, HashMap};
use std::path::Path;
use systems::Systems;

/// Number of bytes in which a deck is recognised: comments may precede its first card.
const DECK_HEAD: usize = 1 << 20;

/// Reader of Nastran jobs.
pub(super) struct Nastran;

impl JobReader for Nastran {
    fn name(&self) -> &'static str {
        "nastran"
    }

    fn needs(&self) -> &'static str {
        "job.bdf with DMIG cards, or with job.pch or job.op4 beside it"
    }

    fn recognises(&self, path: &Path) -> bool {
        InputFile::open_unread(path).is_ok_and(|file| is_bulk_data(&file.first_bytes(DECK_HEAD)))
    }

    fn names_matrices(&self) -> bool {
        true
    }

    fn read(&self, job: &JobFile, describe: bool) -> Diagnosed<JobModel> {
        let path = job.path.as_path();
        let mut bulk = Bulk::read(path)?;
        if bulk.grids.is_empty() {
            let diagnostic = Diagnostic::new(Code::DeckSyntax, "the deck has no GRID").in_file(path);
            return Err(vec![diagnostic.with_help("give the deck, or the punch file that has the grids")]);
        }
        let (nodes, axes) = places(&bulk)?;
        let dmigs = std::mem::take(&mut bulk.dmigs);
        let places = GridPlaces::new(&nodes, &axes);
        let has_other_matrices = !dmigs.names().is_empty() && bulk.has_elements;
        let matrices = Matrices::of(&bulk, dmigs, job, &places)?;
        let (equations, not_described) = matrices.equations(&bulk, &places);
        let described = if describe {
            // The matrices are sound without elements: a card that cannot be read is a reason why nothing is described.
            let read = described(path, &nodes, &bulk, &places, has_other_matrices);
            let mut described = read.unwrap_or_else(|found| {
                let what = found.first().map_or(String::new(), |first| first.message().to_owned());
                let line = found.first().and_then(Diagnostic::line);
                let not_described = vec![NotDescribed { what, line, nodes: Vec::new() }];
                DescribedElements { not_described, path: path.to_path_buf(), ..DescribedElements::default() }
            });
            described.equations.clone_from(&equations);
            described.not_described.extend(not_described);
            Some(described)
        } else {
            None
        };
        let mut diagnostics = deck_notes(&bulk, path);
        let matrices = matrices.without_followers(&mut diagnostics).turned(&axes)?;
        let matrices = matrices.without_empty_rows(&mut diagnostics);
        matrices.refuse_modal(&bulk)?;
        if bulk.is_condensed() {
            diagnostics.push(condensed(matrices.grids(&bulk), &matrices.stiffness.path));
        }
        let sets = bulk.sets.of(&bulk.grids);
        let mut files: Vec<(&'static str, SeenFile)> =
            bulk.files.iter().map(|file| ("deck", file.clone())).collect();
        files.extend(matrices.files.iter().map(|file| ("matrices", file.clone())));
        let followers = matrices.carried(&nodes, &axes);
        let given_rows = matrices.given_rows(axes);
        let Matrices { stiffness, mass, labels: dofs, .. } = matrices;
        // With condensed matrices no element has all of its nodes.
        let elements = if bulk.is_condensed() { Elements::default() } else { bulk.elements };
        let job = JobModel {
            stiffness,
            mass,
            nodes,
            dofs,
            given_rows,
            followers,
            sets,
            elements,
            files,
            diagnostics,
            described,
        };
        Ok(with_dependent_rows(job, &equations))
    }
}

/// Returns the positions of the grids in the basic system, and the row axes of grids with other axes than the basic
/// ones.
fn places(bulk: &Bulk) -> Diagnosed<(Nodes, HashMap<i64, Axes>)> {
    let mut systems = Systems::new(&bulk.systems, &bulk.grids);
    let (mut nodes, mut axes, mut bad) = (Nodes::default(), HashMap::new(), Vec::new());
    for (&id, grid) in &bulk.grids {
        let found = systems.position(grid).and_then(|x| Ok((x, systems.axes(grid, x)?)));
        match found {
            Ok((x, axes_of_grid)) => {
                nodes.ids.push(id);
                nodes.positions.push(x);
                if grid.axes.is_some_and(|system| system != 0) {
                    axes.insert(id, axes_of_grid);
                }
            }
            Err(diagnostic) if bad.len() < BadLines::MAX_SHOWN => bad.push(match diagnostic.file() {
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

/// Returns the grids, sets and elements of a deck for matrices from other files.
///
/// # Errors
/// The errors of [`Bulk::read`]; FB111 if rows of grids are along other axes than those of the basic system.
pub(crate) fn nodes_of_bulk(path: &Path) -> Diagnosed<NodeFile> {
    let bulk = Bulk::read(path)?;
    let (nodes, axes) = places(&bulk)?;
    if let Some(grid) = axes.keys().min() {
        let message = format!(
            "rows of {} grids are along the axes of their CD, the first of them grid {grid}: matrices that are not of this job cannot be transformed to the axes of the model",
            axes.len()
        );
        let diagnostic = Diagnostic::new(Code::DeckUnsupported, message).in_file(path);
        return Err(vec![diagnostic.with_help("give the deck as the model, with its matrices beside it")]);
    }
    let sets = bulk.sets.of(&bulk.grids);
    let followers = bulk.constraints.followers();
    Ok(NodeFile { nodes, sets, elements: bulk.elements, followers, ..NodeFile::default() })
}

/// Describes the elements of a deck for matrices from other files.
///
/// # Errors
/// The errors of [`Bulk::read`]; FB110 for cards of elements and materials that cannot be read.
pub(crate) fn elements_of_bulk(path: &Path) -> Diagnosed<DescribedElements> {
    let bulk = Bulk::read(path)?;
    let (nodes, axes) = places(&bulk)?;
    let mut found = described(path, &nodes, &bulk, &GridPlaces::new(&nodes, &axes), false)?;
    for (name, rows) in bulk.constraints.followers() {
        let what = format!("{name}: constraints are described with the matrices of the job only");
        let nodes = rows.iter().map(|row| row.node).collect::<BTreeSet<i64>>().into_iter().collect();
        found.not_described.push(NotDescribed { what, line: None, nodes });
    }
    Ok(found)
}

/// Returns warnings and notes about the deck.
fn deck_notes(bulk: &Bulk, path: &Path) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    if bulk.has_elements && !bulk.coupled_mass {
        let message = "the deck does not ask for coupled masses (PARAM,COUPMASS,1): Nastran lumps them";
        diagnostics.push(Diagnostic::new(Code::DeckLumps, message).in_file(path));
    }
    diagnostics.extend(damping_left_out(bulk.n_dampers, "damping elements (CDAMP, CVISC)", path));
    if let Some((path, line, count)) = &bulk.supports {
        let message = match count {
            1 => "a card supports the body".to_owned(),
            _ => format!("{count} cards support the body"),
        };
        diagnostics.push(Diagnostic::new(Code::DeckSupports, message).in_file(path).at_line(*line));
    }
    diagnostics
}
