//! Rows without coordinates that carry mass: displacements inside elements, or none.

use crate::Nodes;
use crate::rows::{Rows, centre_and_length};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::SymmetricMatrix;
use flexbody_linalg::ties::first_largest;
use nalgebra::Matrix3;

/// Deviation of the mass that an internal vector shares with rigid motion, relative to the root of its own mass and that of
/// the body: rounding of programs that compute in single precision stays below.
const MAX_INTERNAL_DEVIATION: f64 = 1e-5;

/// Returns an error for a vector without a position that does not turn with the body as displacements do. A vector of
/// internal displacements N a (bubbles) has, with rigid motion, the mass P = M_p R = [p I, -s~] with p = int rho N and
/// s = int rho N x: a multiple of the identity for translations, and a skew matrix for rotations. Amplitudes of a condensed
/// model (Craig-Bampton) have participation factors there, and W2 and W3 would be wrong.
pub(crate) fn refuse_turned_internals(
    mass: &SymmetricMatrix,
    rows: &Rows,
    nodes: &Nodes,
) -> Option<Diagnostic> {
    let d = rows.dimension;
    let vectors = rows.nodes..rows.displacements() / d;
    if vectors.is_empty() {
        return None;
    }
    let (centre, length) = centre_and_length(&nodes.positions);
    let fields = rows.rigid_fields(&nodes.positions, centre, length);
    let moved = |row: usize, c: usize| -> f64 {
        let (columns, values) = mass.row(row);
        columns.iter().zip(values).map(|(&column, value)| value * fields[(column as usize, c)]).sum()
    };
    let total: f64 = (0..rows.len()).map(|row| fields[(row, 0)] * moved(row, 0)).sum();
    let diagonal = mass.diagonal();
    let deviation = |vertex: usize| {
        let momentum = |first: usize| {
            Matrix3::from_fn(|k, c| {
                let is_there = k < d && c < d && first + c < fields.ncols();
                if is_there { moved(d * vertex + k, first + c) } else { 0.0 }
            })
        };
        let mut translation = momentum(0);
        let mean = translation.trace() / d as f64;
        (0..d).for_each(|k| translation[(k, k)] -= mean);
        let mut worst = translation.amax();
        if d == 3 {
            let rotation = momentum(3);
            worst = worst.max((0.5 * (rotation + rotation.transpose())).amax());
        }
        let own =
            diagonal[d * vertex..d * (vertex + 1)].iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
        worst / (own * total).sqrt()
    };
    let (vertex, deviation) =
        first_largest(vectors.map(|vertex| (vertex, deviation(vertex))), |pair| pair.1)?;
    (deviation > MAX_INTERNAL_DEVIATION).then(|| {
        let message = format!(
            "rows of {} have no coordinates, and the mass that they share with rigid motion deviates by {deviation:.0e} from that of displacements which turn with the body, as those of bubbles do: the invariants would be wrong",
            rows.number(nodes, vertex)
        );
        Diagnostic::new(Code::MassDirectional, message).with_help(
            "give the matrices of all nodes; amplitudes of a condensed model (Craig-Bampton, superelement) are no rows of nodes: keep more nodes and no amplitudes, or import the shapes",
        )
    })
}
