//! Places of a body at which joints and forces act: nodes or frames of the formats.

use super::Points;
use faer::Mat;
use flexbody_body::flex_body::{FlexBody, Interface};

/// A place of a body and its motion in every mode, body axes.
#[derive(Debug, Clone, PartialEq)]
pub struct ExportFrame {
    /// Number of the node. The reference point of an interface that is no node has a number above all node
    /// numbers.
    pub id: i64,
    /// Name of the interface; `None` for a node without interface.
    pub name: Option<String>,
    /// Undeformed position, body axes. Unit: length.
    pub position: [f64; 3],
    /// Displacement of each mode (3 x nf).
    pub translation: Mat<f64>,
    /// Rotation of each mode (3 x nf); `None` if it is unknown, as for nodes of solid elements.
    pub rotation: Option<Mat<f64>>,
}

/// Returns the places of `body` selected by `points`: nodes in the order of the body, reference points in the
/// order of the interfaces. A free interface, and an interface whose nodes determine no motion of a reference
/// point, contribute all their nodes.
///
/// [`Points::Usual`] selects the interfaces if there are some, otherwise all nodes.
pub fn frames(body: &FlexBody, points: &Points) -> Vec<ExportFrame> {
    let all = || (0..body.n_nodes()).map(|i| node(body, i)).collect();
    match points {
        Points::Usual if body.interfaces().is_empty() => all(),
        Points::Usual | Points::Interfaces => interfaces(body),
        Points::InterfacesAnd(ids) => {
            let mut found = interfaces(body);
            let others = named_nodes(body, ids).filter(|own| found.iter().all(|frame| frame.id != own.id));
            let others: Vec<ExportFrame> = others.collect();
            found.extend(others);
            found
        }
        Points::Nodes => all(),
        Points::Some(ids) => named_nodes(body, ids).collect(),
    }
}

/// Returns the names of the interfaces among `frames` with the numbers that the file has for them.
pub(crate) fn numbered_interfaces<'f>(
    frames: impl IntoIterator<Item = (i64, &'f ExportFrame)>,
) -> Vec<(String, i64)> {
    frames.into_iter().filter_map(|(number, frame)| Some((frame.name.clone()?, number))).collect()
}

/// Returns the table of the frames of a file: number in the file, number of the node, name of the interface, position in
/// body axes.
pub(crate) fn frame_table<'f>(frames: impl IntoIterator<Item = (i64, &'f ExportFrame)>) -> String {
    let row = |(number, frame): (i64, &ExportFrame)| {
        let [x, y, z] = frame.position;
        let name = frame.name.as_deref().unwrap_or("").replace('"', "\"\"");
        format!("{number},{},\"{name}\",{x:e},{y:e},{z:e}\n", frame.id)
    };
    let rows = frames.into_iter().map(row);
    std::iter::once("frame,node,interface,x,y,z\n".to_owned()).chain(rows).collect()
}

/// Returns the nodes with these numbers, in the order of the body.
pub(crate) fn named_nodes(body: &FlexBody, ids: &[i64]) -> impl Iterator<Item = ExportFrame> {
    (0..body.n_nodes()).filter(|&i| ids.contains(&body.nodes().ids[i])).map(|i| node(body, i))
}

fn node(body: &FlexBody, i: usize) -> ExportFrame {
    let modes = body.modes();
    let rows = |a: &Mat<f64>| a.as_ref().subrows(3 * i, 3).to_owned();
    let turns = |a: &Mat<f64>| a.col_iter().any(|column| column.iter().any(|v| *v != 0.0));
    ExportFrame {
        id: body.nodes().ids[i],
        name: None,
        position: body.nodes().positions[i],
        translation: rows(&modes.shape),
        // Nodes without rotations have zeros in the array.
        rotation: modes.rotation.as_ref().map(rows).filter(turns),
    }
}

fn interfaces(body: &FlexBody) -> Vec<ExportFrame> {
    let mut found: Vec<ExportFrame> = Vec::new();
    for (number, interface) in body.interfaces().iter().enumerate() {
        let ids: Vec<i64> = found.iter().map(|frame| frame.id).collect();
        let frames = interface_frames(body, interface, number);
        found.extend(frames.into_iter().filter(|frame| !ids.contains(&frame.id)));
    }
    found
}

/// Returns the reference point of the interface with this `number` (from 0). For a free interface, and for an
/// interface whose nodes determine no motion of a reference point, returns all its nodes.
pub(crate) fn interface_frames(body: &FlexBody, interface: &Interface, number: usize) -> Vec<ExportFrame> {
    let above = body.nodes().ids.iter().copied().max().unwrap_or(0);
    let named = |i: usize| ExportFrame { name: Some(interface.name.clone()), ..node(body, i) };
    match reference(body, interface, above.saturating_add(1 + number as i64)) {
        Some(frame) => vec![frame],
        None => interface.nodes.iter().map(|&i| named(i)).collect(),
    }
}

/// Returns the reference point of an interface; if the interface is a single node at that point, the node
/// itself.
fn reference(body: &FlexBody, interface: &Interface, id: i64) -> Option<ExportFrame> {
    let (modes, nodes) = (body.modes(), body.nodes());
    let position = interface.reference?;
    let name = Some(interface.name.clone());
    if let [single] = interface.nodes[..]
        && nodes.positions[single] == position
    {
        return Some(ExportFrame { name, ..node(body, single) });
    }
    let rotation = modes.rotation.as_ref().map(Mat::as_ref);
    let rows = interface.rows(nodes, modes.shape.as_ref(), rotation, body.dimension())?;
    Some(ExportFrame { id, name, position, translation: rows.translation, rotation: rows.rotation })
}
