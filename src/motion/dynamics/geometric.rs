//! Geometric stiffness of a body, as the equations of motion take it.

use crate::body::flex_body::FlexBody;
use crate::model::LoadKind;
use faer::Mat;

/// Entries (component, i, j) of the geometric stiffness for a kind of load, zero for components that are not
/// given; `None` where none is.
pub(crate) fn geometric_stiffness<'b>(
    body: &'b FlexBody,
    kind: &LoadKind,
) -> Option<impl Fn(usize, usize, usize) -> f64 + use<'b>> {
    let mut matrices: Vec<Option<&'b Mat<f64>>> = vec![None; kind.components().len()];
    for one in body.geometric_stiffness().iter().filter(|one| one.load.kind == *kind) {
        matrices[one.load.component] = Some(&one.matrix);
    }
    matrices.iter().any(Option::is_some).then_some(move |component: usize, i, j| {
        matrices[component].map_or(0.0, |matrix| 0.5 * (matrix[(i, j)] + matrix[(j, i)]))
    })
}
