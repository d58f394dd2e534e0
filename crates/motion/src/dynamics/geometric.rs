//! Stiffness of inertia and geometric stiffness of a body, in the form for the equations of motion.

use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_model::LoadKind;

/// Selection of the stiffness of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stiffening {
    /// Stiffness of inertia only, which is a part of the kinetic energy.
    OfInertia,
    /// Stiffness of inertia and geometric stiffness together.
    All,
}

/// Returns the entries (component, i, j) of the stiffness for a kind of load, zero for components that are
/// not given; `None` if no component is given.
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
