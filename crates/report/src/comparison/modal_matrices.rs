//! Comparison of the modal matrices (nf x nf) other than the invariants: damping, geometric stiffness,
//! stiffness of inertia.

use super::{BodyComparison, Pair, relative};
use faer::Mat;
use flexbody_body::flex_body::{FlexBody, GeometricStiffness, LoadKind, UnitLoad};
use flexbody_body::invariants::InertiaStiffness;
use flexbody_linalg::{gram, larger, largest_entry};
use std::ops::Range;

/// Modal stiffness matrices of unit loads.
type OfLoads = Vec<GeometricStiffness<Mat<f64>>>;

impl BodyComparison {
    /// Compares damping and the stiffness of unit loads. `basis` transforms the modes of `b` to those of `a`;
    /// without a basis, norms over groups of modes are compared.
    pub(super) fn modal_matrices(&mut self, pair: &Pair<'_>, basis: Option<&Mat<f64>>, tolerance: f64) {
        let matrices = Matrices { groups: &pair.groups, basis };
        let paths = "/modes/damping_ratio, /invariants/modal_damping";
        if !self.leave_out(pair, "damping", paths, |body| largest_ratio(body) > 0.0) {
            self.damping(pair, &matrices, tolerance);
        }
        let (shift, axes) = (pair.change.shift, pair.change.axes);
        let has_geometric = |body: &FlexBody| !body.geometric_stiffness().is_empty();
        if !self.leave_out(pair, "geometric stiffness", "/geometric_stiffness", has_geometric) {
            let loads = Loads {
                a: pair.a.geometric_stiffness().to_vec(),
                b: pair.b.geometric_stiffness().to_vec(),
                b_in_frame_of_a: pair.b.geometric_stiffness_in(&shift, &axes),
            };
            self.stiffness_of_loads("geometric stiffness", &matrices, &loads, shift.norm(), tolerance);
        }
        let has_inertia = |body: &FlexBody| body.inertia_stiffness().is_some();
        if !self.leave_out(pair, "stiffness of inertia", "/inertia_stiffness", has_inertia) {
            let of =
                |own: Option<&InertiaStiffness>| own.map(|own| own.stiffness.clone()).unwrap_or_default();
            let loads = Loads {
                a: of(pair.a.inertia_stiffness()),
                b: of(pair.b.inertia_stiffness()),
                b_in_frame_of_a: of(pair.b.inertia_stiffness_in(&shift, &axes).as_ref()),
            };
            self.stiffness_of_loads("stiffness of inertia", &matrices, &loads, shift.norm(), tolerance);
        }
    }

    /// Compares the stiffness of unit loads of both bodies; that of `b` was shifted by `distance` into the
    /// frame of `a`.
    fn stiffness_of_loads(
        &mut self,
        quantity: &'static str,
        matrices: &Matrices<'_>,
        loads: &Loads,
        distance: f64,
        tolerance: f64,
    ) {
        let Some(found) = matrices.of_loads(&loads.a, &loads.b_in_frame_of_a) else { return };
        let meaning = "largest entry / largest of the kind of load";
        // The stiffness of spin about another point differs by the stiffness of acceleration times the
        // distance, whose rounding is lost.
        let lost = found.rounding(&loads.b, distance);
        self.row(quantity, meaning, found.difference, tolerance + lost);
        self.notes.extend(found.missing.into_iter().map(|note| format!("{quantity} for {note}")));
    }

    /// Compares D_pq / (2 sqrt(omega_p omega_q)); the diagonal holds the damping ratios.
    fn damping(&mut self, pair: &Pair<'_>, matrices: &Matrices<'_>, tolerance: f64) {
        let root: Vec<f64> = pair.a.modes().eigenvalue.iter().map(|lambda| lambda.powf(0.25)).collect();
        let ratios =
            |d: &Mat<f64>| Mat::from_fn(d.nrows(), d.ncols(), |p, q| d[(p, q)] / (2.0 * root[p] * root[q]));
        let (a, b) = (ratios(&pair.a.damping()), ratios(&pair.b.damping()));
        let of_matrices = larger(largest_entry(a.as_ref()), largest_entry(b.as_ref()));
        let size = [pair.a, pair.b].into_iter().map(largest_ratio).fold(of_matrices, larger);
        if size != 0.0 {
            let meaning = "largest entry of D_pq / (2 sqrt(omega_p omega_q)) / largest of both bodies";
            let difference = larger(matrices.difference(&a, &b), difference_of_ratios(pair));
            self.row("damping", meaning, relative(difference, size), tolerance);
        }
    }
}

/// Stiffness of unit loads of two bodies.
struct Loads {
    a: OfLoads,
    b: OfLoads,
    b_in_frame_of_a: OfLoads,
}

/// Returns the largest damping ratio.
fn largest_ratio(body: &FlexBody) -> f64 {
    body.modes().damping_ratio.iter().copied().fold(0.0, larger)
}

/// Returns the largest difference of the damping ratios over groups of modes. The frequency-weighted sum over
/// a group is the same in every basis of a repeated eigenvalue.
fn difference_of_ratios(pair: &Pair<'_>) -> f64 {
    let sum = |body: &FlexBody, g: &Range<usize>| {
        let modes = body.modes();
        g.clone().map(|j| modes.damping_ratio[j] * modes.eigenvalue[j].sqrt()).sum::<f64>()
    };
    let of_group = |g: &Range<usize>| {
        (sum(pair.a, g) - sum(pair.b, g)).abs() / pair.a.modes().eigenvalue[g.start].sqrt()
    };
    pair.groups.iter().map(of_group).fold(0.0, larger)
}

/// Comparison of modal matrices of two bodies, by entries or by norms.
struct Matrices<'a> {
    groups: &'a [Range<usize>],
    basis: Option<&'a Mat<f64>>,
}

/// Outcome of the comparison of the stiffness of unit loads.
struct LoadDifference {
    /// Largest difference over the largest entry of its kind of load.
    difference: f64,
    /// Largest entry of every kind of load.
    sizes: Vec<(LoadKind, f64)>,
    /// Loads without a matrix in one of the bodies, in words.
    missing: Vec<String>,
}

impl Matrices<'_> {
    /// Returns the largest difference of entries or, without a common basis, of the norms of blocks.
    fn difference(&self, a: &Mat<f64>, b: &Mat<f64>) -> f64 {
        if let Some(t) = self.basis {
            let b = gram(t.as_ref(), (b * t).as_ref());
            return largest_entry((a - b).as_ref());
        }
        let norm = |x: &Mat<f64>, g: &Range<usize>, h: &Range<usize>| {
            x.as_ref().submatrix(g.start, h.start, g.len(), h.len()).norm_l2()
        };
        let pairs = self.groups.iter().flat_map(|g| self.groups.iter().map(move |h| (g, h)));
        pairs.map(|(g, h)| (norm(a, g, h) - norm(b, g, h)).abs()).fold(0.0, larger)
    }

    /// Compares matrices of unit loads along the same axes about the same point; `None` if there are none. A
    /// missing matrix counts as zero.
    fn of_loads(&self, a: &OfLoads, b: &OfLoads) -> Option<LoadDifference> {
        let nf = a.first().or(b.first())?.matrix.nrows();
        // Loads of either body, each once.
        let mut loads: Vec<&UnitLoad> = a.iter().map(|one| &one.load).collect();
        loads.extend(b.iter().map(|one| &one.load).filter(|load| a.iter().all(|one| one.load != **load)));
        let of = |all: &OfLoads, load: &UnitLoad| {
            all.iter().find(|one| one.load == *load).map(|one| one.matrix.clone())
        };
        // Largest entry of each kind of load, the scale of its differences.
        let mut found = LoadDifference { difference: 0.0, sizes: Vec::new(), missing: Vec::new() };
        for one in a.iter().chain(b) {
            let size = largest_entry(one.matrix.as_ref());
            match found.sizes.iter_mut().find(|(kind, _)| *kind == one.load.kind) {
                Some((_, known)) => *known = larger(*known, size),
                None => found.sizes.push((one.load.kind.clone(), size)),
            }
        }
        // Differences load by load; a missing matrix counts as zero.
        for load in loads {
            let (own, other) = (of(a, load), of(b, load));
            let zero = || Mat::zeros(nf, nf);
            let difference =
                self.difference(&own.clone().unwrap_or_else(zero), &other.clone().unwrap_or_else(zero));
            let difference = relative(difference, found.size(&load.kind));
            found.difference = larger(found.difference, difference);
            match (own, other) {
                (None, _) if difference > 0.0 => {
                    found.missing.push(format!("{load}: none in the first body"))
                }
                (_, None) if difference > 0.0 => {
                    found.missing.push(format!("{load}: none in the second body"))
                }
                _ => {}
            }
        }
        Some(found)
    }
}

impl LoadDifference {
    fn size(&self, kind: &LoadKind) -> f64 {
        self.sizes.iter().find(|(known, _)| known == kind).map_or(0.0, |(_, size)| *size)
    }

    /// Returns the rounding error of matrices shifted by the distance `d`, relative to the smallest size of a
    /// kind of load.
    fn rounding(&self, before: &OfLoads, d: f64) -> f64 {
        if d == 0.0 {
            return 0.0;
        }
        let of_acceleration = self.size(&LoadKind::Acceleration) * d;
        let kinds = [LoadKind::AngularAcceleration, LoadKind::Spin];
        let lost = kinds.iter().map(|kind| {
            let of_kind = before.iter().filter(|one| one.load.kind == *kind);
            let moved = of_kind.map(|one| largest_entry(one.matrix.as_ref())).fold(of_acceleration, larger);
            let size = self.size(kind);
            if size == 0.0 { 0.0 } else { 32.0 * f64::EPSILON * moved / size }
        });
        lost.fold(0.0, larger)
    }
}
