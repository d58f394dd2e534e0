//! Cells of VTK as elements.

use super::vtk_numbers::Unpacked;
use flexbody_model::{ElementShape, Elements};

/// Order of the corners of pixels and voxels, which VTK lists along the axes, around the quadrilaterals.
const AROUND: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];

/// Order of the nodes of a wedge from its other end: the first triangle of VTK faces outward, that of the shape inward.
const TURNED_WEDGE: [usize; 15] = [0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13];

/// Returns the elements of cells, with points whose numbers are `ids`.
///
/// * `connectivity`: points of all cells, from 0; `offsets`: end of each cell in `connectivity`; `types`: cell types of
///   VTK.
pub(super) fn elements_of(
    connectivity: &[f64],
    offsets: &[f64],
    types: &[f64],
    ids: &[i64],
) -> Unpacked<Elements> {
    if offsets.len() != types.len() {
        return Err(format!("file has {} ends of cells and {} types", offsets.len(), types.len()));
    }
    let id =
        |point: &f64| ids.get(*point as usize).filter(|_| *point >= 0.0 && point.fract() == 0.0).copied();
    let mut elements = Elements::default();
    let mut start = 0;
    for (&end, &kind) in offsets.iter().zip(types) {
        let points = connectivity.get(start..end as usize);
        let points = points.ok_or("the ends of the cells do not ascend up to the number of their points")?;
        start += points.len();
        let nodes: Option<Vec<i64>> = points.iter().map(id).collect();
        let nodes = nodes.ok_or("a cell has a point that does not exist")?;
        add(&mut elements, kind as u8, nodes);
    }
    Ok(elements)
}

fn add(elements: &mut Elements, kind: u8, nodes: Vec<i64>) {
    let ordered = |order: &[usize]| order.iter().filter_map(|&k| nodes.get(k).copied()).collect::<Vec<_>>();
    let (shape, nodes) = match kind {
        // Vertices are not drawn.
        1 | 2 => return,
        3 | 21 => (ElementShape::Line, nodes),
        5 | 22 | 34 => (ElementShape::Triangle, nodes),
        8 => (ElementShape::Quadrilateral, ordered(&AROUND[..4])),
        9 | 23 | 28 => (ElementShape::Quadrilateral, nodes),
        10 | 24 => (ElementShape::Tetrahedron, nodes),
        11 => (ElementShape::Hexahedron, ordered(&AROUND)),
        12 | 25 | 29 => (ElementShape::Hexahedron, nodes),
        13 | 26 | 32 => (ElementShape::Wedge, ordered(&TURNED_WEDGE)),
        14 | 27 => (ElementShape::Pyramid, nodes),
        other => return elements.leave_out(&format!("cells of type {other}"), 1),
    };
    elements.add("cells", shape, &nodes);
}
