//! Jobs of CalculiX: `*FREQUENCY, SOLVER=MATRIXSTORAGE` writes `job.sti`, `job.mas` (upper triangles, 14 digits) and
//! `job.dof` (a line `node.direction` for every row) into the folder of the deck `job.inp`.

use super::couplings::Coupling;
use super::deck::{Card, Deck, fields};
use super::deck_mesh::DeckMesh;
use super::deck_surfaces::Surfaces;
use super::dependent_rows::with_dependent_rows;
use super::described::{DescribedRows, Program, constraints, described_of_job, nothing};
use super::expanded::{Once, copies_in_sets, label_once};
use super::job::{JobFile, JobModel, JobReader, both, missing};
use super::knots::Knots;
use super::matrix_files::CoordinateFile;
use super::not_taken::{dashpots_left_out, refuse_axisymmetric, refuse_elements};
use super::siblings::{is_deck, siblings};
use super::transformed::along_model;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::numbers::significant;
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_base::text::scanner::{Line, Lines, excerpt, expected, integer, real};
use flexbody_elements::{DescribedElements, Equation};
use flexbody_model::{DofLabel, Nodes, RawMatrix};
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet, HashMap};
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

    fn read(&self, job: &JobFile, describe: bool) -> Diagnosed<JobModel> {
        let path = job.path.as_path();
        let [sti, mas, dof] = ["sti", "mas", "dof"].map(|extension| path.with_extension(extension));
        let absent =
            [(&sti, "stiffness matrix"), (&mas, "mass matrix"), (&dof, "list of degrees of freedom")];
        let absent = absent.iter().filter(|(file, _)| !file.exists());
        let absent: Vec<Diagnostic> = absent.map(|(file, what)| missing(file, what, HELP)).collect();
        if !absent.is_empty() {
            return Err(absent);
        }
        refuse_reported_errors(path)?;
        let deck = Deck::read(path)?;
        let mesh = DeckMesh::read(&deck, describe)?;
        refuse_kinds(&mesh, path)?;
        let (labels, dofs_file) = read_labels(&dof)?;
        let rotations = rotation_nodes(&deck, &mesh, &labels)?;
        let means = reference_places(&deck, &mesh)?;
        let n = labels.len();
        let read = |file| CoordinateFile::read(file, n as u32)?.into_matrix(n);
        // The files are read one after the other: each uses all threads, and the entries of only one are in memory.
        let stiffness = read(&sti);
        let ((stiffness, stiffness_file), (mass, mass_file)) = both(stiffness, read(&mas))?;
        let ([stiffness, mass], turned) =
            along_model([stiffness, mass], &labels, &rotations, &deck, &mesh, &dof)?;
        let is_turned = turned.counts().next().is_some();
        let knots = Knots::of(&mesh, &labels, &rotations, &dof)?;
        let ([stiffness, mass], given_rows) = if knots.are_absent() {
            ([stiffness, mass], turned)
        } else if is_turned {
            return Err(turned_knots(path));
        } else {
            knots.condensed([stiffness, mass], &dof)?
        };
        let labels = knots.labels(labels);
        let Once { labels, places, copies } = label_once(&deck, &mesh, labels, [&stiffness, &mass], &dof)?;
        let has_copies = !copies.is_empty();
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
        let is_expanded = has_copies || !knots.are_absent();
        let equations = if is_expanded { Vec::new() } else { equations_of(&deck, &mesh, &dofs, &rotations) };
        let described =
            if describe { Some(described_job(&deck, &mesh, &dofs, &rotations, is_expanded)) } else { None };
        let warnings = [dashpots_left_out(&mesh, path), stressed(&deck, path)];
        let elements = mesh.drawn_by_corners();
        let sets = mesh.sets.with_copies(copies_in_sets(copies, &nodes, &dofs));
        let (ids, positions) = nodes.into_iter().unzip();
        let mut diagnostics = mesh.notes.clone();
        diagnostics.extend(placed_note(&means, &dofs, path));
        diagnostics.extend(warnings.into_iter().flatten());
        let mut files = deck.seen()?;
        files.extend([("stiffness", stiffness_file), ("mass", mass_file), ("dofs", dofs_file)]);
        let job = JobModel {
            stiffness,
            mass,
            nodes: Nodes { ids, positions },
            dofs,
            given_rows,
            elements,
            sets,
            files,
            diagnostics,
            followers: None,
            described,
        };
        Ok(with_dependent_rows(job, &equations))
    }
}

/// Returns FB111 for axisymmetric elements, and for beams, whose solids have other nodes than the deck.
fn refuse_kinds(mesh: &DeckMesh, deck: &Path) -> Diagnosed<()> {
    refuse_axisymmetric(mesh, deck)?;
    let why = "CalculiX expands beams into solids, whose nodes are not in the deck";
    let help = "use solid elements, or write the beams with a program that keeps their rotations";
    refuse_elements(mesh, |kind| kind.starts_with('B'), why, help, deck)
}

/// Returns FB110 if what CalculiX printed was kept beside the deck (`job.log`, `job.out`) and reports an error: CalculiX
/// continues after some errors, and leaves out what they are about.
fn refuse_reported_errors(deck: &Path) -> Diagnosed<()> {
    let logs = siblings(deck).filter(|(rest, _)| rest == ".log" || rest == ".out");
    for (_, log) in logs {
        // A log that cannot be read says nothing.
        let Ok(file) = InputFile::open(&log) else { continue };
        let reported = Lines::of(file.bytes())
            .filter_map(Line::content)
            .find(|line| line.text.trim_ascii_start().starts_with(b"*ERROR"));
        if let Some(line) = reported {
            let message = format!("CalculiX reported an error: `{}`", excerpt(line.text));
            let diagnostic = Diagnostic::new(Code::DeckSyntax, message).in_file(&log).at_line(line.number);
            return Err(vec![diagnostic.with_help(
                "correct the deck and run it again: the matrices may lack what the error is about; remove the file if it is of another run",
            )]);
        }
    }
    Ok(())
}

/// Returns FB111 for knots of shells among matrices along the axes of nodes.
fn turned_knots(deck: &Path) -> Vec<Diagnostic> {
    let message = "GLOBAL=NO: rows of knots of shells are along the axes of a *TRANSFORM";
    let diagnostic = Diagnostic::new(Code::DeckUnsupported, message).in_file(deck);
    vec![diagnostic.with_help("write the matrices without GLOBAL=NO")]
}

/// Returns the warning that the step with the matrices continues from an earlier one with its stress, if it does.
fn stressed(deck: &Deck, path: &Path) -> Option<Diagnostic> {
    let is_writer = |card: &Card| card.parameter("SOLVER").is_some_and(|solver| solver == "MATRIXSTORAGE");
    let writer = deck.cards().iter().rposition(is_writer)?;
    let mut steps = deck.cards()[..writer].iter().rev().filter(|card| card.keyword == "STEP");
    let is_perturbed = steps.next()?.parameter("PERTURBATION").is_some();
    let message = "K is written in a step with PERTURBATION after another step: it contains the stress of the loads there";
    (is_perturbed && steps.next().is_some())
        .then(|| Diagnostic::new(Code::DeckStressed, message).in_file(path))
}

/// Describes the elements of a job, nothing if its matrices have rows of solids into which shells were expanded.
fn described_job(
    deck: &Deck,
    mesh: &DeckMesh,
    labels: &[DofLabel],
    rotations: &HashMap<i64, i64>,
    is_expanded: bool,
) -> DescribedElements {
    if is_expanded {
        let reason = "elements that CalculiX expands into solids: shells and beams are not described";
        return nothing(deck, reason);
    }
    let rows = DescribedRows::new(Program::Calculix, labels, rotations);
    described_of_job(deck, mesh, &rows)
}

/// Returns the equations of directions without rows; none if a card of the deck cannot be read.
fn equations_of(
    deck: &Deck,
    mesh: &DeckMesh,
    labels: &[DofLabel],
    rotations: &HashMap<i64, i64>,
) -> Vec<Equation> {
    let rows = DescribedRows::new(Program::Calculix, labels, rotations);
    constraints(deck, mesh, &rows).map_or_else(|_| Vec::new(), |(equations, _)| equations)
}

/// Reads a stiffness matrix (`.sti`) and the labels of its rows (`.dof`).
///
/// # Errors
/// FB204 for lines of labels, FB301 to FB312 for the matrix.
pub(in super::super) fn read_stiffness(
    matrix: &InputFile,
    labels: &InputFile,
) -> Diagnosed<(RawMatrix, Vec<DofLabel>)> {
    let labels = labels_of(labels)?;
    let (matrix, _) = CoordinateFile::read_opened(matrix, labels.len() as u32)?.into_matrix(labels.len())?;
    Ok((matrix, labels))
}

/// Reads the labels of the rows from lines `node.direction`.
fn read_labels(path: &Path) -> Diagnosed<(Vec<DofLabel>, SeenFile)> {
    let file = InputFile::open(path).map_err(|diagnostic| vec![diagnostic])?;
    Ok((labels_of(&file)?, file.seen().map_err(|diagnostic| vec![diagnostic])?))
}

fn labels_of(file: &InputFile) -> Diagnosed<Vec<DofLabel>> {
    let mut labels = Vec::with_capacity(file.bytes().len() / 6);
    for Line { number, text: line } in Lines::of(file.bytes()).filter_map(Line::content) {
        let label = line.iter().position(|&b| b == b'.').and_then(|dot| {
            let (node, direction) = (integer(&line[..dot])?, integer(&line[dot + 1..])?);
            (1..=3).contains(&direction).then_some(DofLabel { node, direction: direction as u8 })
        });
        let Some(label) = label else {
            let diagnostic = expected(Code::TableRow, "a node and a direction as in `17.3`", line);
            let help = "write the file again: structures have the directions 1 to 3";
            return Err(vec![diagnostic.in_file(file.path()).at_line(number).with_help(help)]);
        };
        labels.push(label);
    }
    Ok(labels)
}

// Nodes of CalculiX whose directions 1 to 3 are rotations of a reference node.
//
// ROT NODE of *RIGID BODY names such a node. *COUPLING with *KINEMATIC creates a node that is not in the deck, but its
// number follows from the deck: CalculiX reads all *NODE cards, then all *COUPLING cards in their order, and then the
// cards and elements that create further nodes. Each kinematic coupling takes the next number for its rotation node,
// and further numbers without rows for its equations (see [`Coupling::n_numbers`]).

/// Number of internal nodes of an element with incompatible modes (C3D8I).
const INTERNAL_NODES: usize = 3;

const ROTATION_HELP: &str = "run CalculiX again if the deck has changed since; else write *RIGID BODY, NSET=SET, REF NODE=A, ROT NODE=B instead of the coupling";

/// Returns the rotation nodes of a deck, each with the reference node that rotates. `labels` are the labels of the rows
/// by CalculiX.
///
/// # Errors
/// FB111 if the rows that are rotations, or their reference node, cannot be identified.
fn rotation_nodes(deck: &Deck, mesh: &DeckMesh, labels: &[DofLabel]) -> Diagnosed<HashMap<i64, i64>> {
    let mut rotations = named_rotation_nodes(deck)?;
    rotations.extend(made_rotation_nodes(deck, mesh, labels)?);
    let with_rows: BTreeSet<i64> = labels.iter().map(|label| label.node).collect();
    let mut turned: HashMap<i64, i64> = HashMap::new();
    let mut nodes = HashMap::new();
    for Rotation { node, reference, card } in rotations {
        // A rotation node belongs to one reference node, and a reference node has one rotation node.
        if let Some(other) = nodes.insert(node, reference).filter(|other| *other != reference) {
            let message = format!("ROT NODE {node} belongs to two reference nodes, {other} and {reference}");
            let diagnostic = deck.about(card, Code::DeckUnsupported, message);
            return Err(vec![diagnostic.with_help("give each *RIGID BODY a separate ROT NODE")]);
        }
        if with_rows.contains(&node) && turned.insert(reference, node).is_some_and(|other| other != node) {
            let message = format!(
                "REF NODE {reference} of *{} is also the REF NODE of another coupling: its rotations are not unique",
                card.title
            );
            let diagnostic = deck.about(card, Code::DeckUnsupported, message);
            return Err(vec![diagnostic.with_help("give each coupling a separate REF NODE")]);
        }
    }
    Ok(nodes)
}

/// Rotation node, its reference node, and the card that defines them.
struct Rotation<'d> {
    node: i64,
    reference: i64,
    card: &'d Card,
}

/// Returns the rotation nodes that *RIGID BODY names.
///
/// # Errors
/// FB111 for *RIGID BODY without REF NODE or ROT NODE.
fn named_rotation_nodes(deck: &Deck) -> Diagnosed<Vec<Rotation<'_>>> {
    let mut rotations = Vec::new();
    for card in deck.cards().iter().filter(|card| card.keyword == "RIGIDBODY") {
        let node = |name: &str| {
            card.parameter(name).and_then(|text| fields(text.as_bytes()).next().and_then(integer))
        };
        let message = match (node("REFNODE"), node("ROTNODE")) {
            (Some(reference), Some(node)) => {
                rotations.push(Rotation { node, reference, card });
                continue;
            }
            (Some(_), None) => "*RIGID BODY has no ROT NODE: the rows of its rotations cannot be identified",
            (None, _) => "*RIGID BODY has no REF NODE: its rows cannot be identified",
        };
        let diagnostic = deck.about(card, Code::DeckUnsupported, message);
        return Err(vec![diagnostic.with_help("write *RIGID BODY, NSET=SET, REF NODE=A, ROT NODE=B")]);
    }
    Ok(rotations)
}

/// Kinematic coupling with its reference node, and the number of its rotation node by the deck.
struct Numbered<'d> {
    coupling: Coupling<'d>,
    reference: i64,
    node: i64,
}

/// Returns the rotation nodes that kinematic couplings create and that have rows.
///
/// # Errors
/// FB111 if rows of nodes outside the deck are not those that its couplings create.
fn made_rotation_nodes<'d>(
    deck: &'d Deck,
    mesh: &DeckMesh,
    labels: &[DofLabel],
) -> Diagnosed<Vec<Rotation<'d>>> {
    let mut next = mesh.nodes.keys().next_back().and_then(|highest| highest.checked_add(1));
    let mut end = i64::MIN;
    let mut numbered = Vec::new();
    let mut surfaces = Surfaces::of(deck, mesh);
    for coupling in Coupling::all(deck) {
        let reference = coupling.reference(deck, mesh)?;
        let Some(node) = next else {
            let why = "the nodes of the surface of a coupling above it cannot be counted";
            let help =
                "write the *SURFACE of each coupling by nodes or by the faces S1 to S6 of solid elements";
            return coupling.refuse(deck, reference, why, help);
        };
        next = coupling.n_numbers(&mut surfaces).and_then(|count| node.checked_add(count)?.checked_add(1));
        // Numbers below `end` belong to couplings.
        end = next.unwrap_or(node);
        numbered.push(Numbered { coupling, reference, node });
    }
    let Some(last) = numbered.last() else { return Ok(Vec::new()) };
    let expected: BTreeSet<i64> = numbered.iter().map(|entry| entry.node).collect();
    // Nodes with rows but without a position in the deck: rotation nodes, and others with higher numbers.
    let made: BTreeSet<i64> =
        labels.iter().map(|label| label.node).filter(|node| !mesh.nodes.contains_key(node)).collect();
    let others: Vec<i64> = made.difference(&expected).copied().collect();
    let stray = others.first().filter(|other| **other < end);
    let n_internal = INTERNAL_NODES * n_with_internal_nodes(mesh);
    let is_explained = others.len() == n_internal;
    // A coupling has no rows if all its nodes follow another coupling, or if the deck is not the one that was run.
    let absent = numbered.iter().find(|entry| entry.coupling.n_lines > 0 && !made.contains(&entry.node));
    let Numbered { coupling, reference, node } = absent.unwrap_or(last);
    match stray {
        Some(stray) => {
            let why = format!("by the deck they belong to node {node}, but node {stray} has rows");
            coupling.refuse(deck, *reference, &why, ROTATION_HELP)
        }
        None if !is_explained => {
            let why = format!(
                "by the deck they belong to node {node}, and elements have {n_internal} internal nodes, but {} nodes beyond those of the deck have rows",
                made.len()
            );
            coupling.refuse(deck, *reference, &why, ROTATION_HELP)
        }
        None => {
            let with_rows = numbered.into_iter().filter(|entry| made.contains(&entry.node));
            let rotation = |entry: Numbered<'d>| Rotation {
                node: entry.node,
                reference: entry.reference,
                card: entry.coupling.card,
            };
            Ok(with_rows.map(rotation).collect())
        }
    }
}

/// Returns the number of elements of a deck that have internal nodes.
fn n_with_internal_nodes(mesh: &DeckMesh) -> usize {
    mesh.elements
        .iter()
        .filter(|elements| elements.kind == "C3D8I")
        .map(|elements| elements.members.len())
        .sum()
}

// Reference nodes of `*DISTRIBUTING COUPLING` of CalculiX.
//
// Such a coupling makes the displacement of its reference node the weighted mean of those of its nodes, and eliminates
// the first of these nodes. CalculiX does not use the coordinates of the reference node. In a rigid motion it moves as
// the mean of the node positions, so this mean is the position of its rows.

const COUPLING_HELP: &str = "write *DISTRIBUTING COUPLING, ELSET=E with one element of type DCOUP3D in E and lines `node or set, weight`; or remove it from the deck and name its nodes as an averaging interface: --interface NAME=SET,averaging";

/// Returns the reference nodes of the couplings of a deck, each with the mean of the positions of its nodes.
///
/// # Errors
/// FB111 for a coupling whose reference node or nodes cannot be identified.
fn reference_places(deck: &Deck, mesh: &DeckMesh) -> Diagnosed<BTreeMap<i64, [f64; 3]>> {
    let is_coupling = |card: &&Card| card.keyword == "DISTRIBUTINGCOUPLING";
    let mut sums: BTreeMap<i64, Sum<'_>> = BTreeMap::new();
    for card in deck.cards().iter().filter(is_coupling) {
        let node = reference_node(card, mesh).map_err(|why| refused(deck, card, &why))?;
        let sum = sums.entry(node).or_insert(Sum { card, moment: Vector3::zeros(), total: 0.0 });
        // Data that continue in another file have a separate card.
        for (line, text) in deck.data(card) {
            let (places, weight) = weighted(text, mesh).ok_or_else(|| {
                let text = excerpt(text);
                let message =
                    format!("*DISTRIBUTING COUPLING: `{text}` is not a node or node set and its weight");
                vec![deck.at(card, line, Code::DeckUnsupported, message).with_help(COUPLING_HELP)]
            })?;
            sum.moment += places.iter().map(|place| weight * Vector3::from(*place)).sum::<Vector3<f64>>();
            sum.total += weight * places.len() as f64;
        }
    }
    let mean = |(node, sum): (i64, Sum<'_>)| {
        let place = sum.moment / sum.total;
        let why = "the weights of its nodes add up to zero";
        let is_finite = place.iter().all(|x| x.is_finite());
        is_finite.then(|| (node, place.into())).ok_or_else(|| refused(deck, sum.card, why))
    };
    sums.into_iter().map(mean).collect()
}

/// Weighted sum of node positions.
struct Sum<'d> {
    card: &'d Card,
    moment: Vector3<f64>,
    total: f64,
}

fn refused(deck: &Deck, card: &Card, why: &str) -> Vec<Diagnostic> {
    let message = format!("*DISTRIBUTING COUPLING: {why}");
    vec![deck.about(card, Code::DeckUnsupported, message).with_help(COUPLING_HELP)]
}

/// Returns a note that names the reference nodes with rows, whose positions differ from those in the deck.
fn placed_note(means: &BTreeMap<i64, [f64; 3]>, labels: &[DofLabel], path: &Path) -> Option<Diagnostic> {
    let with_rows: BTreeSet<i64> = labels.iter().map(|label| label.node).collect();
    let named: Vec<String> = means
        .iter()
        .filter(|(node, _)| with_rows.contains(node))
        .map(|(node, x)| format!("{node} at ({})", x.map(|x| significant(x, 6)).join(", ")))
        .collect();
    let message = format!(
        "reference nodes of distributing couplings lie at the weighted mean of their nodes, whatever their coordinates are: {}",
        named.join("; ")
    );
    (!named.is_empty()).then(|| Diagnostic::new(Code::DeckReference, message).in_file(path))
}

/// Returns the node of the only element of the set of a coupling.
///
/// # Errors
/// The set is missing, or has other elements than one DCOUP3D; the error is in words.
fn reference_node(card: &Card, mesh: &DeckMesh) -> Result<i64, String> {
    let set = card.name("ELSET").ok_or("ELSET is missing")?;
    let members = mesh.sets.elements(&set).ok_or_else(|| format!("element set `{set}` is unknown"))?;
    let is_coupling = |kind: &str| kind == "DCOUP3D";
    let nodes: Vec<i64> = mesh
        .elements
        .iter()
        .filter(|elements| is_coupling(&elements.kind))
        .flat_map(|elements| elements.members.iter())
        .filter(|(id, _)| members.as_slice() == [*id])
        .flat_map(|(_, nodes)| nodes.iter().copied())
        .collect();
    match (nodes.as_slice(), members.len()) {
        (&[node], 1) => Ok(node),
        _ => Err(format!("element set `{set}` is not one element of type DCOUP3D")),
    }
}

/// Returns the positions of the nodes that a line names by a number or a set, and the weight of each; `None` for a line
/// without a weight, or without a node or set of the deck.
fn weighted(line: &[u8], mesh: &DeckMesh) -> Option<(Vec<[f64; 3]>, f64)> {
    let mut given = fields(line);
    let (name, weight) = (given.next()?, given.next()?);
    let weight = real(weight).filter(|weight| weight.is_finite())?;
    let nodes: BTreeSet<i64> = match integer(name) {
        Some(node) => BTreeSet::from([node]),
        None => mesh.set(&String::from_utf8_lossy(name))?.into_iter().collect(),
    };
    let places: Option<Vec<[f64; 3]>> = nodes.iter().map(|node| mesh.nodes.get(node).copied()).collect();
    Some((places?, weight))
}
