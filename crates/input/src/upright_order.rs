//! Nodes of second-order elements in the order of Nastran, Patran and Exodus: the mid-edge nodes of the upright edges
//! of bricks and wedges precede those of the upper face.

use flexbody_model::ElementShape;

/// Indices of the mid-edge nodes of a hexahedron among its nodes.
const HEXAHEDRON: [usize; 12] = [8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15];

/// Indices of the mid-edge nodes of a wedge among its nodes.
const WEDGE: [usize; 9] = [6, 7, 8, 12, 13, 14, 9, 10, 11];

/// Returns the corners, then the mid-edge nodes in the order of the shape; other elements are unchanged.
pub(super) fn in_order_of_shape(shape: ElementShape, nodes: &[i64]) -> Vec<i64> {
    let middles: &[usize] = match shape {
        ElementShape::Hexahedron if nodes.len() >= 20 => &HEXAHEDRON,
        ElementShape::Wedge if nodes.len() >= 15 => &WEDGE,
        _ => return nodes.to_vec(),
    };
    nodes[..shape.corners()].iter().copied().chain(middles.iter().map(|&k| nodes[k])).collect()
}
