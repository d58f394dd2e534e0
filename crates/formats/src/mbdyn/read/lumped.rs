//! Invariants that MBDyn computes from lumped masses (record group 11) in Modal.cc, as sums over the nodes.

use super::records::Records;
use faer::Mat;
use flexbody_body::invariants::{Numbered, TermGroups};
use nalgebra::{Matrix3, Vector3};

/// Invariants of the lumped masses of the nodes, and their negative masses.
pub(crate) struct Lumped {
    /// Invariants I1 to I9 about the origin; I6 is the modal mass of the lumped masses.
    pub(crate) numbered: Numbered,
    /// Number of nodes with a negative mass.
    pub(crate) negative: usize,
    /// Sum of the magnitudes of negative masses divided by the sum of all magnitudes.
    pub(crate) negative_share: f64,
}

/// Returns the lumped masses of record groups 8 and 11; `None` without group 11.
pub(crate) fn lumped(records: &Records) -> Option<Lumped> {
    let diagonal = records.get(11)?;
    let (n, nf) = (records.n_nodes, records.n_modes);
    let mut numbered = Numbered {
        i1: 0.0,
        i2: Vector3::zeros(),
        i3: Mat::zeros(3, nf),
        i4: Mat::zeros(3, nf),
        i5: None,
        i6: Mat::zeros(nf, nf),
        i7: Matrix3::zeros(),
        i8: vec![Matrix3::zeros(); nf],
        i9: None,
        groups: TermGroups::ALL,
    };
    let (mut i5, mut i9) = (Mat::zeros(3 * nf, nf), Mat::zeros(3 * nf, 3 * nf));
    let (mut negative, mut below, mut all) = (0, 0.0, 0.0);
    // Sums over the nodes with mass m, inertia J about the node, position x, shape psi and rotation theta.
    for node in 0..n {
        let [mass, _, _, jx, jy, jz] = *diagonal[6 * node..].first_chunk::<6>().expect("six per node");
        let x = Vector3::from(records.position(node));
        let inertia = Matrix3::from_diagonal(&Vector3::new(jx, jy, jz));
        let shape = |first: usize, j: usize| Vector3::from_fn(|k, _| records.shape(node, first + k, j));
        negative += usize::from(mass < 0.0);
        below += (-mass).max(0.0);
        all += mass.abs();
        // Rigid body: sum m, sum m x, sum J - m x~ x~.
        numbered.i1 += mass;
        numbered.i2 += x * mass;
        numbered.i7 += inertia - x.cross_matrix() * x.cross_matrix() * mass;
        for j in 0..nf {
            // Linear in a mode: sum m psi, sum m x~ psi + J theta, -sum m x~ psi~.
            let (psi, turn) = (shape(0, j), shape(3, j));
            let coupled = x.cross(&psi) * mass + inertia * turn;
            for a in 0..3 {
                numbered.i3[(a, j)] += mass * psi[a];
                numbered.i4[(a, j)] += coupled[a];
            }
            numbered.i8[j] -= x.cross_matrix() * psi.cross_matrix() * mass;
            for k in 0..nf {
                // Quadratic: sum m psi_j . psi_k + theta_j . J theta_k, sum m psi_j x psi_k, sum m psi_j~
                // psi_k~.
                let other = shape(0, k);
                numbered.i6[(j, k)] += psi.dot(&other) * mass + turn.dot(&(inertia * shape(3, k)));
                let (cross, double) = (psi.cross(&other), psi.cross_matrix() * other.cross_matrix());
                for a in 0..3 {
                    i5[(a * nf + j, k)] += mass * cross[a];
                    for b in 0..3 {
                        i9[(a * nf + j, b * nf + k)] += mass * double[(a, b)];
                    }
                }
            }
        }
    }
    (numbered.i5, numbered.i9) = (Some(i5), Some(i9));
    Some(Lumped { numbered, negative, negative_share: if all > 0.0 { below / all } else { 0.0 } })
}
