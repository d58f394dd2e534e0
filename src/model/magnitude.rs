//! Whether the numbers of a model can be multiplied with each other in double precision.

use super::rigid::extents;
use super::{Nodes, RawModel};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::numerics::linalg::SymmetricMatrix;
use rayon::prelude::*;

/// Largest size, and reciprocal of the smallest, that a quantity may have: squares of all of them then stay twenty-eight decades
/// within the range of double precision, which is the room that modes and rounding errors have.
const LARGEST: f64 = 1e140;

/// A refusal when K, M, the size of the body, or what units make of them, is so large or small that products overflow, or vanish
/// without a trace.
pub(super) fn check_magnitudes(
    stiffness: &SymmetricMatrix,
    mass: &SymmetricMatrix,
    nodes: &Nodes,
    raw: &RawModel,
) -> Option<Diagnostic> {
    let largest =
        |m: &SymmetricMatrix| m.as_csc().values().par_iter().map(|v| v.abs()).reduce(|| 0.0, f64::max);
    let (k, m) = (largest(stiffness), largest(mass));
    let far = nodes.positions.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let size = extents(&nodes.positions).into_iter().fold(0.0, f64::max);
    if [k, m, size].contains(&0.0) {
        return None; // said by name elsewhere
    }
    let of = (&raw.stiffness.path, &raw.mass.path, &raw.nodes_path);
    let quantities = [
        ("stiffness", k, of.0),
        ("mass", m, of.1),
        ("length", size, of.2),
        ("distance from the origin", far.max(size), of.2),
        ("stiffness / mass", k / m, of.1),
        ("mass length^2", m * size * size, of.1),
    ];
    let fits = |value: f64| (LARGEST.recip()..=LARGEST).contains(&value);
    let (name, value, file) = quantities.into_iter().find(|&(_, value, _)| !fits(value))?;
    let message = format!(
        "{name} is of the order of {value:.0e}, not within {:.0e} and {LARGEST:.0e}",
        LARGEST.recip()
    );
    Some(Diagnostic::new(Code::MagnitudeExtreme, message).in_file(file))
}
