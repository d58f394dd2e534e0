//! Nodes of the second order as Nastran, Patran and Exodus list them: the middles of the upright edges of bricks and
//! wedges before those of the upper face.

use flexbody_model::ElementShape;

/// Where the middles of the edges of a hexahedron stand among its nodes.
const HEXAHEDRON: [usize; 12] = [8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15];

/// The same of a wedge.
const WEDGE: [usize; 9] = [6, 7, 8, 12, 13, 14, 9, 10, 11];

/// Corners, then the middles of the edges in the order of the shape, where all of them are there.
pub(super) fn in_order_of_shape(shape: ElementShape, nodes: &[i64]) -> Vec<i64> {
    let middles: &[usize] = match shape {
        ElementShape::Hexahedron if nodes.len() >= 20 => &HEXAHEDRON,
        ElementShape::Wedge if nodes.len() >= 15 => &WEDGE,
        _ => return nodes.to_vec(),
    };
    nodes[..shape.corners()].iter().copied().chain(middles.iter().map(|&k| nodes[k])).collect()
}
