//! Stiffness of inertia and geometric stiffness of a body, as the equations of motion take them.

use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_model::LoadKind;

/// Which stiffness of a body is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stiffening {
    /// That of inertia alone, which is a part of the kinetic energy.
    OfInertia,
    /// That of inertia and the geometric stiffness together.
    All,
}

/// Entries (component, i, j) of the stiffness for a kind of load, zero for components that are not given;
/// `None` where none is.
pub fn stiffness_under<'b>(
    body: &'b FlexBody,
    kind: &LoadKind,
    which: Stiffening,
) -> Option<impl Fn(usize, usize, usize) -> f64 + use<'b>> {
    let mut matrices: Vec<Vec<&'b Mat<f64>>> = vec![Vec::new(); kind.components().len()];
    let of_inertia = body.inertia_stiffness().into_iter().flat_map(|own| &own.stiffness);
    let given = body.geometric_stiffness().iter().filter(|_| which == Stiffening::All);
    for one in of_inertia.chain(given).filter(|one| one.load.kind == *kind) {
        matrices[one.load.component].push(&one.matrix);
    }
    matrices.iter().any(|known| !known.is_empty()).then_some(move |component: usize, i, j| {
        matrices[component].iter().map(|matrix| 0.5 * (matrix[(i, j)] + matrix[(j, i)])).sum()
    })
}
