//! Rows of CalculiX along axes of nodes: `*FREQUENCY, SOLVER=MATRIXSTORAGE, GLOBAL=NO` writes the rows of nodes of
//! `*TRANSFORM` along the axes of that card; by default the rows are along the axes of the model. CalculiX 2.20 does so
//! for K, and leaves the rows of M along the axes of the model: translations show along which axes those of M are.

use super::deck::{Card, Deck, fields};
use super::deck_mesh::DeckMesh;
use crate::matrices::turn::Turn;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::scanner::{integer, real};
use flexbody_model::{DofLabel, GivenRows, NodeAxes, RawMatrix, RowMap};
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;
use std::path::Path;

/// Part of the given vectors below which a vector across them is rounding.
const PARALLEL: f64 = 1e-9;

/// Largest deviation of the mass under translations from a multiple of the identity, relative to the mass: sums of numbers
/// with 14 digits leave less than 1e-10 of it for 10^7 entries, axes that are not those of the rows 1e-3 and more.
const MAX_DIRECTIONAL: f64 = 1e-8;

const HELP: &str = "write the matrices without GLOBAL=NO";

/// Returns K and M along the axes of the model, and the maps of arrays by rows of the files, if nodes with rows have axes
/// of their own; otherwise the matrices as they are.
///
/// # Errors
/// FB110 for cards that cannot be read, FB111 for nodes without all their directions, or with several rows of one.
pub(super) fn along_model(
    matrices: [RawMatrix; 2],
    labels: &[DofLabel],
    rotations: &HashMap<i64, i64>,
    deck: &Deck,
    mesh: &DeckMesh,
    dof: &Path,
) -> Diagnosed<([RawMatrix; 2], GivenRows)> {
    let axes = if are_local(deck) { local_axes(deck, mesh)? } else { HashMap::new() };
    if !labels.iter().any(|label| axes.contains_key(&label.node)) {
        return Ok((matrices, GivenRows::default()));
    }
    let turn = Turn::new(labels, &axes).map_err(|node| {
        let message = format!(
            "rows of node {node} are along the axes of a *TRANSFORM (GLOBAL=NO), but not each of its directions occurs once"
        );
        vec![Diagnostic::new(Code::DeckUnsupported, message).in_file(dof).with_help(HELP)]
    })?;
    let [stiffness, mass] = matrices;
    let stiffness = turn.turned(stiffness).map_err(|diagnostic| vec![diagnostic]);
    let mass = mass_along_model(mass, &translations_of(labels, rotations), &turn);
    let all = (0..labels.len() as u32).collect();
    let map = RowMap::new(turn.axes(), turn.axes(), all);
    Ok(([stiffness?, mass?], GivenRows::new(vec![map], HashMap::new())))
}

/// Returns M along the axes of the model: as it is, or turned, whichever has one mass for translations along all axes.
///
/// # Errors
/// FB111 if neither has one, or both have.
fn mass_along_model(mass: RawMatrix, translations: &[Option<usize>], turn: &Turn) -> Diagnosed<RawMatrix> {
    let turned = turn.turned(mass.clone()).map_err(|diagnostic| vec![diagnostic])?;
    let [as_written, as_turned] =
        [&mass, &turned].map(|raw| directional_mass(raw, translations) <= MAX_DIRECTIONAL);
    let are_equal = || {
        let largest = mass.matrix.values().iter().fold(0.0f64, |most, value| most.max(value.abs()));
        let (one, other) = (mass.matrix.values(), turned.matrix.values());
        let difference = one.iter().zip(other).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
        one.len() == other.len() && difference <= MAX_DIRECTIONAL * largest
    };
    match (as_written, as_turned) {
        (true, false) => Ok(mass),
        (false, true) => Ok(turned),
        (true, true) if are_equal() => Ok(mass),
        _ => {
            let message = "GLOBAL=NO: it is not known along which axes the rows of nodes of *TRANSFORM are in the mass matrix";
            let diagnostic = Diagnostic::new(Code::DeckUnsupported, message).in_file(&mass.path);
            Err(vec![diagnostic.with_help(HELP)])
        }
    }
}

/// Returns the axis of each row that is a displacement; `None` for rotations of rigid bodies, which rest in translations.
fn translations_of(labels: &[DofLabel], rotations: &HashMap<i64, i64>) -> Vec<Option<usize>> {
    let axis =
        |label: &DofLabel| (!rotations.contains_key(&label.node)).then(|| usize::from(label.direction) - 1);
    labels.iter().map(axis).collect()
}

/// Returns the largest deviation of T' M T, for the three unit translations T, from a multiple of the identity, relative to
/// that multiple. `translations` has the axis of each row that moves in one of them.
fn directional_mass(mass: &RawMatrix, translations: &[Option<usize>]) -> f64 {
    let mut total = Matrix3::<f64>::zeros();
    for (column, axis) in translations.iter().enumerate() {
        let (rows, values) = mass.matrix.column(column);
        for (row, value) in rows.iter().zip(values) {
            if let (Some(axis), Some(other)) = (axis, translations[*row as usize]) {
                total[(other, *axis)] += value;
            }
        }
    }
    let mean = total.trace() / 3.0;
    (total - Matrix3::identity() * mean).amax() / mean
}

/// Returns true if the last step that writes matrices writes them along the axes of nodes.
fn are_local(deck: &Deck) -> bool {
    let is = |card: &Card, name: &str, value: &str| {
        card.parameter(name).is_some_and(|text| text.trim().eq_ignore_ascii_case(value))
    };
    let last = deck.cards().iter().rfind(|card| is(card, "SOLVER", "MATRIXSTORAGE"));
    last.is_some_and(|card| is(card, "GLOBAL", "NO"))
}

/// Returns the axes of all nodes of *TRANSFORM; the last card of a node counts.
fn local_axes(deck: &Deck, mesh: &DeckMesh) -> Diagnosed<HashMap<i64, NodeAxes>> {
    let mut all = HashMap::new();
    for card in deck.cards().iter().filter(|card| card.keyword == "TRANSFORM") {
        let refused = |message: &str| {
            let diagnostic = deck.about(card, Code::DeckSyntax, format!("*TRANSFORM: {message}"));
            vec![diagnostic.with_help("correct the card")]
        };
        let set = card.parameter("NSET").ok_or_else(|| refused("NSET is missing"))?;
        let nodes = mesh.set(set).or_else(|| integer(set.as_bytes()).map(|node| vec![node]));
        let nodes = nodes.ok_or_else(|| refused("the set of nodes is unknown"))?;
        let numbers: Option<Vec<f64>> =
            deck.data(card).next().and_then(|(_, line)| fields(line).map(real).collect());
        let Some([a, b]) = numbers.as_deref().and_then(two_points) else {
            return Err(refused("expected six coordinates of two points"));
        };
        let is_cylindrical = card.parameter("TYPE").is_some_and(|kind| kind.trim().eq_ignore_ascii_case("C"));
        for node in nodes {
            let axes = if is_cylindrical {
                mesh.nodes.get(&node).and_then(|x| cylindrical(a, b, Vector3::from(*x)))
            } else {
                rectangular(a, b)
            };
            let axes =
                axes.ok_or_else(|| refused("its points define no axes, or a node lies on the axis"))?;
            all.insert(node, axes);
        }
    }
    Ok(all)
}

fn two_points(numbers: &[f64]) -> Option<[Vector3<f64>; 2]> {
    let &[ax, ay, az, bx, by, bz] = numbers else { return None };
    Some([Vector3::new(ax, ay, az), Vector3::new(bx, by, bz)])
}

/// Returns the axes by a point `a` on the first axis, and a point `b` in the plane of the first two.
fn rectangular(a: Vector3<f64>, b: Vector3<f64>) -> Option<NodeAxes> {
    let x = a.try_normalize(0.0)?;
    let across = b - x * b.dot(&x);
    let y = across.try_normalize(PARALLEL * b.norm())?;
    Some([x, y, x.cross(&y)].map(Into::into))
}

/// Returns the radial, tangential and axial direction at a position, for an axis from `a` to `b`.
fn cylindrical(a: Vector3<f64>, b: Vector3<f64>, position: Vector3<f64>) -> Option<NodeAxes> {
    let axis = (b - a).try_normalize(0.0)?;
    let from = position - a;
    let radial = (from - axis * from.dot(&axis)).try_normalize(PARALLEL * from.norm())?;
    Some([radial, axis.cross(&radial), axis].map(Into::into))
}
