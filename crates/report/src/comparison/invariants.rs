//! Comparison of positions, shapes and invariants: mode by mode with common nodes, otherwise by norms over groups of
//! modes.

use super::body_comparison::BodyComparison;
use super::mode_pair::assurance;
use super::pair::Pair;
use super::relative_difference::{lost_by_shift, relative};
use super::shapes::{product, shape_difference, turned};
use super::tolerances::Tolerances;
use crate::mass_properties::gyration_radius;
use faer::Mat;
use flexbody_body::invariants::{CauchySchwarz, Invariants, compare_invariants};
use flexbody_linalg::larger;
use libm::hypot;
use nalgebra::Vector3;
use std::ops::Range;

/// Modes of two bodies with common nodes.
pub(super) struct CommonShapes {
    /// Basis change from the modes of `b` to those of `a`.
    pub basis: Mat<f64>,
    /// Modal assurance criterion of each mode of `a` with each mode of `b`, which is aligned inside clusters.
    pub assurance: Mat<f64>,
}

impl BodyComparison {
    /// Compares positions, shapes and invariants. `order` gives the node of `b` for each node of `a`.
    pub(super) fn mode_by_mode(
        &mut self,
        pair: &Pair<'_>,
        order: &[usize],
        tolerances: &Tolerances,
    ) -> CommonShapes {
        let Pair { a, b, change, in_a, groups } = pair;
        self.same_nodes = true;
        let (pa, pb) = (&a.nodes().positions, &b.nodes().positions);
        let distance = |(x, &i): (&[f64; 3], &usize)| (change.point(&pb[i]) - Vector3::from(*x)).norm();
        let largest = pa.iter().zip(order).map(distance).fold(0.0, larger);
        let radius = gyration_radius(a.invariants());
        let origin = a.frame().origin.amax().max(b.frame().origin.amax());
        self.row(
            "node positions",
            "largest distance / radius of gyration",
            relative(largest, radius),
            tolerances.centre_of_mass + 8.0 * f64::EPSILON * relative(origin, radius),
        );

        let shapes_a = a.modes().shape.as_ref();
        let shapes_b = turned(b.modes().shape.as_ref(), &change.axes, order);
        let gram = product(shapes_a.transpose(), shapes_b.as_ref());
        let (alignment, differences) = compare_invariants(a.invariants(), in_a, gram.as_ref(), groups);
        let aligned = product(shapes_b.as_ref(), alignment.basis.as_ref());
        let by_group: Vec<f64> =
            groups.iter().map(|g| shape_difference(shapes_a, aligned.as_ref(), g)).collect();
        let largest = by_group.iter().copied().fold(0.0, larger);
        self.row("mode shapes", "|psi_a - psi_b| / |psi_a|, nodal norm", largest, tolerances.invariants);
        let rest = &by_group[..by_group.len().saturating_sub(1)];
        let shapes_agree = largest <= tolerances.invariants;
        if !shapes_agree && rest.iter().all(|d| *d <= tolerances.invariants) {
            self.notes.push(
                "only the last modes differ: other modes of the same repeated eigenvalue may have been left out"
                    .to_owned(),
            );
        }
        // J of a mass with rotary inertia of its nodes may have a diagonal entry that is not positive.
        let smallest = match a.invariants().general() {
            Some(_) => a.invariants().inertia().diagonal().min(),
            None => a.invariants().second_moment().diagonal().min(),
        };
        let lost = lost_by_shift(a.invariants().mass(), change.shift.norm(), smallest);
        for (name, difference) in differences {
            // The mass has a row of its own.
            if let Some((_, quantity, meaning)) = PRIMARY.iter().find(|(known, ..)| *known == name) {
                let lost = if name == "second_moment" { lost } else { 0.0 };
                self.row(quantity, meaning, difference, tolerances.invariants + lost);
            }
        }
        self.nodal_rows(pair, order, alignment.basis.as_ref(), tolerances.invariants);
        CommonShapes { assurance: assurance(shapes_a, aligned.as_ref()), basis: alignment.basis }
    }

    /// Compares norms of the invariants over groups of modes. No orthogonal change of basis inside a group
    /// alters these norms.
    pub(super) fn norms_only(&mut self, pair: &Pair<'_>, tolerance: f64) {
        let Pair { a, b, in_a, groups, .. } = pair;
        let (na, nb) = (a.n_nodes(), b.n_nodes());
        let count = if na == nb { format!("{na} with different numbers") } else { format!("{na} and {nb}") };
        self.notes.push(format!(
            "the bodies have different nodes ({count}): shapes are not compared, invariants only by their norms over groups of modes"
        ));
        let exact = a.invariants();
        let bound = CauchySchwarz::of(exact);
        let size = |g: &Range<usize>| g.clone().map(|p| bound.mode(p).powi(2)).sum::<f64>().sqrt();
        let norm = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0f64, hypot);
        let (mut c1, mut ibar, mut s) = (0.0, 0.0, 0.0);
        for g in groups {
            for k in 0..3 {
                let x = |body: &Invariants| norm(&mut g.clone().map(|p| body.c1()[(k, p)]));
                c1 = larger(c1, relative(x(in_a) - x(exact), exact.mass().sqrt() * size(g)));
                for l in 0..3 {
                    let x = |body: &Invariants| {
                        body.ibar().map_or(0.0, |ibar| norm(&mut g.clone().map(|p| ibar[k][l][p])))
                    };
                    // ibar(k, p) is sqrt(J_kk) |psi_p|.
                    let scale = norm(&mut g.clone().map(|p| bound.ibar(k, p)));
                    ibar = larger(ibar, relative(x(in_a) - x(exact), scale));
                    for h in groups {
                        let x = |body: &Invariants| {
                            let products = |block: &Mat<f64>| {
                                norm(&mut g.clone().flat_map(|p| h.clone().map(move |q| block[(p, q)])))
                            };
                            body.s().map_or(0.0, |s| products(&s[k][l]))
                        };
                        s = larger(s, relative(x(in_a) - x(exact), size(g) * size(h)));
                    }
                }
            }
        }
        self.row("norms of C1", "over groups of modes / sqrt(m) |psi|", c1, tolerance);
        let held = exact.groups().and(in_a.groups());
        if held.w1 {
            self.row("norms of Ibar", "over groups of modes / sqrt(J_kk) |psi|", ibar, tolerance);
        }
        if held.w2 {
            self.row("norms of S", "over groups of modes / |psi_p| |psi_q|", s, tolerance);
        }
    }
}

/// Names in `primary_differences`, names of the rows, and reference values in words.
const PRIMARY: [(&str, &str, &str); 10] = [
    ("first_moment", "first moment", "about the frame origin of the first body / sqrt(m J_kk)"),
    ("second_moment", "second moment", "about the frame origin of the first body / sqrt(J_kk J_ll)"),
    ("C1", "C1", "largest entry / sqrt(m) |psi_p|"),
    ("Ibar", "Ibar (W1, C2)", "largest entry / sqrt(J_kk) |psi_p|"),
    ("C2", "C2", "largest entry / sqrt(I0_kk) |psi_p|"),
    ("S", "S (W2, W3, m_ff)", "largest entry / |psi_p| |psi_q|"),
    ("modal_stiffness", "modal stiffness", "largest entry / sqrt(K_pp K_qq)"),
    ("W0", "W0", "largest entry / sqrt(m) |psi_p|"),
    ("W3", "W3", "largest entry / |psi_p| |psi_q|"),
    ("modal_mass", "modal mass", "largest entry / |psi_p| |psi_q|"),
];
