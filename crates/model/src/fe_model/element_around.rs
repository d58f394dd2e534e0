//! The element around a node of a shell, by the nodes that K couples.

use flexbody_linalg::ties::TIE_MARGIN;
use nalgebra::Vector3;

/// Area of the triangle of three nodes, projected across the direction and relative to the square of its
/// longest side, below which the nodes determine no rotation about it.
const MIN_TRIANGLE_AREA: f64 = 1e-3;

/// Returns a node and two others that K couples with it and with each other: those with the largest triangle
/// across `normal`, of equal ones the nearest to `centre`, so that neither the order of the nodes nor the axes
/// of the model decide. `coupled` returns the other nodes that K couples with a node, ascending.
pub(crate) fn element_around(
    node: usize,
    normal: &Vector3<f64>,
    centre: &Vector3<f64>,
    place: impl Fn(usize) -> Vector3<f64>,
    coupled: impl Fn(usize) -> Vec<u32>,
) -> Option<[usize; 3]> {
    let near = coupled(node);
    let arm = |other: usize| place(other) - place(node);
    let mut best: Option<(f64, f64, [usize; 3])> = None;
    for &a in &near {
        let beside = coupled(a as usize);
        for &b in near.iter().filter(|&&b| b > a && beside.binary_search(&b).is_ok()) {
            let (x, y) = (arm(a as usize), arm(b as usize));
            let longest = x.norm_squared().max(y.norm_squared());
            let area = x.cross(&y).dot(normal).abs();
            let distance = (place(node) + (x + y) / 3.0 - centre).norm();
            let is_better = |&(largest, nearest, _): &(f64, f64, [usize; 3])| {
                area > largest * (1.0 + TIE_MARGIN)
                    || area > largest * (1.0 - TIE_MARGIN) && distance < nearest * (1.0 - TIE_MARGIN)
            };
            if area > MIN_TRIANGLE_AREA * longest && best.as_ref().is_none_or(is_better) {
                best = Some((area, distance, [node, a as usize, b as usize]));
            }
        }
    }
    best.map(|(_, _, around)| around)
}
