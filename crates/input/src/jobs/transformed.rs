//! Rows of CalculiX along axes of nodes: `*FREQUENCY, SOLVER=MATRIXSTORAGE, GLOBAL=NO` writes the rows of nodes of
//! `*TRANSFORM` along the axes of that card; by default the rows are along the axes of the model.

use super::deck::{Card, Deck, fields};
use super::deck_mesh::DeckMesh;
use crate::matrices::turn::Turn;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::scanner::{integer, real};
use flexbody_model::{DofLabel, GivenRows, NodeAxes, RawMatrix, RowMap};
use nalgebra::Vector3;
use std::collections::HashMap;
use std::path::Path;

/// Part of the given vectors below which a vector across them is rounding.
const PARALLEL: f64 = 1e-9;

const HELP: &str = "write the matrices without GLOBAL=NO";

/// Returns K and M along the axes of the model, and the maps of arrays by rows of the files, if nodes with rows have axes
/// of their own; otherwise the matrices as they are.
///
/// # Errors
/// FB110 for cards that cannot be read, FB111 for nodes without all their directions, or with several rows of one.
pub(super) fn along_model(
    matrices: [RawMatrix; 2],
    labels: &[DofLabel],
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
    let [stiffness, mass] = matrices.map(|raw| turn.turned(raw).map_err(|diagnostic| vec![diagnostic]));
    let all = (0..labels.len() as u32).collect();
    let map = RowMap::new(turn.axes(), turn.axes(), all);
    Ok(([stiffness?, mass?], GivenRows::new(vec![map], HashMap::new())))
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
