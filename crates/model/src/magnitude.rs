//! Check that the numbers of a model can be multiplied with each other in double precision.

use super::rigid::extents;
use super::{Nodes, RawModel};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::{SymmetricMatrix, parallel};

/// Largest size, and reciprocal of the smallest, of a quantity: squares of all quantities then stay
/// twenty-eight decades within the range of double precision, a margin for modes and rounding errors.
const MAX_MAGNITUDE: f64 = 1e140;

/// Returns an error if K, M, the size of the body, or quantities derived from them are so large or small
/// that products overflow or vanish.
pub(super) fn check_magnitudes(
    stiffness: &SymmetricMatrix,
    mass: &SymmetricMatrix,
    nodes: &Nodes,
    raw: &RawModel,
) -> Option<Diagnostic> {
    let largest = |m: &SymmetricMatrix| {
        let of_part = |part: &[f64]| part.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        parallel::map(m.as_csc().values().chunks(1 << 16), of_part).into_iter().fold(0.0, f64::max)
    };
    let (k, m) = (largest(stiffness), largest(mass));
    let far = nodes.positions.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let size = extents(&nodes.positions).into_iter().fold(0.0, f64::max);
    if [k, m, size].contains(&0.0) {
        return None; // other checks report zeros
    }
    let (stiffness_file, mass_file, nodes_file) = (&raw.stiffness.path, &raw.mass.path, &raw.nodes_path);
    let quantities = [
        ("stiffness", k, stiffness_file),
        ("mass", m, mass_file),
        ("length", size, nodes_file),
        ("distance from the origin", far.max(size), nodes_file),
        ("stiffness / mass", k / m, mass_file),
        ("mass length^2", m * size * size, mass_file),
    ];
    let fits = |value: f64| (MAX_MAGNITUDE.recip()..=MAX_MAGNITUDE).contains(&value);
    let (name, value, file) = quantities.into_iter().find(|&(_, value, _)| !fits(value))?;
    let message = format!(
        "{name} is of the order of {value:.0e}, not within {:.0e} and {MAX_MAGNITUDE:.0e}",
        MAX_MAGNITUDE.recip()
    );
    Some(Diagnostic::new(Code::MagnitudeExtreme, message).in_file(file))
}
