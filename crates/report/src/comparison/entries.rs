//! Comparison of the entries of two bodies other than invariants and mode shapes: interfaces, nodal data of the modes,
//! modal matrices; and the entries of the flex-body file that a comparison leaves out.

use super::body_comparison::BodyComparison;
use super::comparable::is_placed;
use super::pair::Pair;
use super::relative_difference::relative;
use super::shapes::{product, turned};
use crate::mass_properties::gyration_radius;
use faer::{Mat, MatRef};
use flexbody_body::flex_body::{FlexBody, GeometricStiffness, Interface, InternalRows, LoadKind, UnitLoad};
use flexbody_body::invariants::InertiaStiffness;
use flexbody_linalg::{gram, larger, largest_entry};
use libm::pow;
use nalgebra::Vector3;
use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

impl BodyComparison {
    /// Compares the interfaces of the same names; `tolerance` applies to reference points, relative to the
    /// radius of gyration.
    pub(super) fn interfaces(&mut self, pair: &Pair<'_>, tolerance: f64) {
        let (a, b) = (pair.a.interfaces(), pair.b.interfaces());
        let neither = a.is_empty() && b.is_empty();
        if neither || self.leave_out(pair, "interfaces", "/interfaces", |body| !body.interfaces().is_empty())
        {
            return;
        }
        let mut notes = Vec::new();
        let (mut differing, mut farthest) = (0, 0.0);
        for own in a {
            let Some(other) = b.iter().find(|other| other.name == own.name) else {
                notes.push(format!("interface `{}` is in the first body only", own.name));
                differing += 1;
                continue;
            };
            let found = self.differences(pair, own, other);
            differing += usize::from(!found.is_empty());
            notes.extend(found);
            if let (Some(x), Some(y)) = (own.reference, other.reference) {
                farthest = larger(farthest, (pair.change.point(&y) - Vector3::from(x)).norm());
            }
        }
        for other in b.iter().filter(|other| a.iter().all(|own| own.name != other.name)) {
            notes.push(format!("interface `{}` is in the second body only", other.name));
            differing += 1;
        }
        let meaning =
            "number of interfaces that differ in name, nodes, coupling, or presence of a reference point";
        self.row("interfaces", meaning, differing as f64, 0.0);
        let radius = gyration_radius(pair.a.invariants());
        let origin = pair.a.frame().origin.amax().max(pair.b.frame().origin.amax());
        self.row(
            "reference points",
            "of interfaces, largest distance / radius of gyration",
            relative(farthest, radius),
            tolerance + 8.0 * f64::EPSILON * relative(origin, radius),
        );
        self.notes.extend(notes);
    }

    /// Returns the differences of two interfaces of one name in words.
    fn differences(&self, pair: &Pair<'_>, a: &Interface, b: &Interface) -> Vec<String> {
        let name = &a.name;
        let mut found = Vec::new();
        let (of_a, of_b) = (node_numbers(pair.a, a), node_numbers(pair.b, b));
        if self.same_nodes && of_a != of_b {
            let only = |x: &BTreeSet<i64>, y: &BTreeSet<i64>| x.difference(y).count();
            found.push(format!(
                "interface `{name}` has {} nodes in the first body only, {} in the second only",
                only(&of_a, &of_b),
                only(&of_b, &of_a)
            ));
        }
        let stated = |interface: &Interface| interface.coupling.map_or("not stated", |c| c.name());
        // The format of another program may not store the coupling.
        let unknown =
            |body: &FlexBody, interface: &Interface| !is_placed(body) && interface.coupling.is_none();
        if a.coupling != b.coupling && !unknown(pair.a, a) && !unknown(pair.b, b) {
            found.push(format!(
                "the coupling of interface `{name}` is `{}` in the first body and `{}` in the second",
                stated(a),
                stated(b)
            ));
        }
        if a.reference.is_some() != b.reference.is_some() {
            let whose = if a.reference.is_some() { "first" } else { "second" };
            found.push(format!("interface `{name}` has a reference point in the {whose} body only"));
        }
        found
    }
}

fn node_numbers(body: &FlexBody, interface: &Interface) -> BTreeSet<i64> {
    interface.nodes.iter().map(|&node| body.nodes().ids[node]).collect()
}

// Comparison of the nodal data of the modes other than displacements: rotations of nodes, internal rows,
// moments of nodal rotary inertia.

impl BodyComparison {
    /// Compares nodal data other than displacements of bodies with the same nodes. `order` gives the node of
    /// `b` for each node of `a`; `basis` transforms the modes of `b` to those of `a`.
    pub(super) fn nodal_rows(
        &mut self,
        pair: &Pair<'_>,
        order: &[usize],
        basis: MatRef<'_, f64>,
        tolerance: f64,
    ) {
        self.rotations(pair, order, basis, tolerance);
        self.internal_rows(pair, basis, tolerance);
        self.moments(pair, order, tolerance);
    }

    fn rotations(&mut self, pair: &Pair<'_>, order: &[usize], basis: MatRef<'_, f64>, tolerance: f64) {
        let (a, b) = (pair.a.modes(), pair.b.modes());
        let has = |body: &FlexBody| body.modes().rotation.is_some();
        let neither = a.rotation.is_none() && b.rotation.is_none();
        if neither || self.leave_out(pair, "rotations of nodes", "/modes/rotation", has) {
            return;
        }
        let zero = || Mat::zeros(a.shape.nrows(), a.shape.ncols());
        let own = a.rotation.clone().unwrap_or_else(zero);
        let other = b.rotation.clone().unwrap_or_else(zero);
        let other = turned(other.as_ref(), &pair.change.axes, order);
        let other = product(other.as_ref(), basis);
        let radius = gyration_radius(pair.a.invariants());
        let of_group = |g: &Range<usize>| {
            let norm = |x: &Mat<f64>| x.as_ref().subcols(g.start, g.len()).norm_l2();
            // Modes without bending have rotations that are rounding; the displacements over the radius bound
            // the scale.
            relative(norm(&(&own - &other)), larger(norm(&own), norm(&a.shape) / radius))
        };
        let largest = pair.groups.iter().map(of_group).fold(0.0, larger);
        let meaning = "|theta_a - theta_b| / max(|theta_a|, |psi_a| / radius of gyration), nodal norm";
        self.row("nodal rotations", meaning, largest, tolerance);
    }

    fn internal_rows(&mut self, pair: &Pair<'_>, basis: MatRef<'_, f64>, tolerance: f64) {
        let has = |body: &FlexBody| body.modes().internal.is_some();
        if self.leave_out(pair, "rows without a node", "/modes/internal, /modes/internal_dof", has) {
            return;
        }
        let (a, b) = (&pair.a.modes().internal, &pair.b.modes().internal);
        let difference = match (a, b) {
            (None, None) => return,
            (Some(a), Some(b)) => internal_difference(a, &b.in_axes(&pair.change.axes), basis, &pair.groups),
            _ => f64::INFINITY,
        };
        let meaning = "rows without a node, by group of modes / largest of them; infinite: other labels";
        self.row("internal rows", meaning, difference, tolerance);
    }

    fn moments(&mut self, pair: &Pair<'_>, order: &[usize], tolerance: f64) {
        let (own, before) = (pair.a.inertia_stiffness(), pair.b.inertia_stiffness());
        let other = pair.b.inertia_stiffness_in(&pair.change.shift, &pair.change.axes);
        let (Some(own), Some(before), Some(other)) = (own, before, other) else { return };
        let largest_second =
            |own: &InertiaStiffness| own.moments.iter().map(|m| m.second.amax()).fold(0.0, larger);
        let (mut in_first, mut in_second) = (0.0, 0.0);
        for (x, &at) in own.moments.iter().zip(order) {
            let y = &other.moments[at];
            in_first = larger(in_first, (x.first - y.first).amax());
            in_second = larger(in_second, (x.second - y.second).amax());
        }
        let of_first = own.moments.iter().map(|m| m.first.amax()).fold(0.0, larger);
        let of_second = largest_second(own);
        let largest = larger(relative(in_first, of_first), relative(in_second, of_second));
        let moved = larger(largest_second(before), of_first * pair.change.shift.norm());
        let lost = 32.0 * f64::EPSILON * relative(moved, of_second);
        let meaning = "largest entry / largest of all nodes";
        self.row("moments of nodes", meaning, largest, tolerance + if lost > 0.0 { lost } else { 0.0 });
    }
}

/// Returns the largest difference of a group of modes, relative to the largest group; infinite if the labels
/// of the rows differ.
fn internal_difference(
    a: &InternalRows,
    b: &InternalRows,
    basis: MatRef<'_, f64>,
    groups: &[Range<usize>],
) -> f64 {
    let rows: HashMap<[i64; 2], usize> = b.dofs.iter().enumerate().map(|(i, label)| (*label, i)).collect();
    let order: Option<Vec<usize>> = a.dofs.iter().map(|label| rows.get(label).copied()).collect();
    let Some(order) = order.filter(|order| order.len() == b.dofs.len()) else { return f64::INFINITY };
    let other = Mat::from_fn(order.len(), b.shape.ncols(), |i, j| b.shape[(order[i], j)]);
    let difference = &a.shape - product(other.as_ref(), basis);
    let largest = |x: &Mat<f64>| {
        groups.iter().map(|g| x.as_ref().subcols(g.start, g.len()).norm_l2()).fold(0.0, larger)
    };
    relative(largest(&difference), largest(&a.shape))
}

// Comparison of the modal matrices (nf x nf) other than the invariants: damping, geometric stiffness,
// stiffness of inertia.

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
        let root: Vec<f64> = pair.a.modes().eigenvalue.iter().map(|lambda| pow(*lambda, 0.25)).collect();
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
            all.iter().find(|one| one.load == *load).map(|stiffness| stiffness.matrix.clone())
        };
        // Largest entry of each kind of load, the scale of its differences.
        let mut found = LoadDifference { difference: 0.0, sizes: Vec::new(), missing: Vec::new() };
        for stiffness in a.iter().chain(b) {
            let size = largest_entry(stiffness.matrix.as_ref());
            match found.sizes.iter_mut().find(|(kind, _)| *kind == stiffness.load.kind) {
                Some((_, known)) => *known = larger(*known, size),
                None => found.sizes.push((stiffness.load.kind.clone(), size)),
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
            let of_kind = before.iter().filter(|stiffness| stiffness.load.kind == *kind);
            let moved = of_kind
                .map(|stiffness| largest_entry(stiffness.matrix.as_ref()))
                .fold(of_acceleration, larger);
            let size = self.size(kind);
            if size == 0.0 { 0.0 } else { 32.0 * f64::EPSILON * moved / size }
        });
        lost.fold(0.0, larger)
    }
}

// Entries of the flex-body file that a comparison leaves out.

/// Entries of the file that belong together.
struct Entries {
    /// Name of the entries.
    name: &'static str,
    /// Paths of the entries in the file.
    paths: &'static str,
    /// True if a body has such entries.
    has: fn(&FlexBody) -> bool,
}

/// Entries that are never compared: they record the origin and the proofs of a body, or follow from other
/// entries.
const NEVER_COMPARED: &[Entries] = &[
    Entries { name: "provenance", paths: "/@generator, /@format_minor, /source", has: |_| true },
    Entries {
        name: "proofs and error estimates",
        paths: "/certificate, /modes/residual, /modes@provenance, /modes@truncation",
        has: |_| true,
    },
    Entries {
        name: "guaranteed bounds",
        paths: "/modes/eigenvalue_lower, /modes/eigenvalue_upper, /modes/shape_error",
        has: |body| body.certificate().guarantee.is_some(),
    },
    Entries {
        name: "estimates of the free body",
        paths: "/modes/free_eigenvalue, /modes/free_eigenvalue_lower",
        has: |body| body.certificate().fixed_interface.as_ref().is_some_and(|fixed| fixed.free.is_some()),
    },
    Entries {
        name: "reasons of kept and dropped terms",
        paths: "/terms",
        has: |body| !body.terms().is_empty(),
    },
    Entries {
        name: "lumped comparators",
        paths: "/lumped, /comparison",
        has: |body| !body.lumped().is_empty(),
    },
    Entries { name: "surface", paths: "/mesh", has: |body| body.mesh().is_some() },
    Entries {
        name: "geometric stiffness of rotations, which `flexbody check --against` holds to the model",
        paths: "/rotated_stiffness",
        has: |body| !body.parts().rotated_stiffness.is_empty(),
    },
    Entries {
        name: "estimate of missing geometric stiffness",
        paths: "/estimated_stiffness",
        has: |body| !body.estimated_stiffness().is_empty(),
    },
    Entries {
        name: "matrices in interface coordinates, which `flexbody check` holds to the modes",
        paths: "/interface_coordinates",
        has: |body| body.coordinates().is_some(),
    },
];

/// Entries that are compared only if both bodies have the same nodes.
const WITH_COMMON_NODES: &[Entries] = &[
    Entries {
        name: "nodes and modes at them",
        paths: "/nodes, /modes/shape, /modes/rotation, /modes/internal",
        has: |_| true,
    },
    Entries {
        name: "nodes of interfaces",
        paths: "/interfaces/<name>/node_id",
        has: |body| !body.interfaces().is_empty(),
    },
    Entries {
        name: "first and second moment, modal stiffness",
        paths: "/invariants/first_moment, /invariants/second_moment, /invariants/modal_stiffness",
        has: |_| true,
    },
    Entries {
        name: "invariants of a mass of structure `general`",
        paths: "/invariants/W0, /invariants/W3, /invariants/C2, /invariants/modal_mass",
        has: |body| body.invariants().general().is_some(),
    },
];

/// Returns the entries of `a` or `b` that are not compared, as `name (paths)`.
pub(super) fn not_compared(a: &FlexBody, b: &FlexBody, same_nodes: bool) -> Vec<String> {
    let by_nodes = WITH_COMMON_NODES.iter().filter(|_| !same_nodes);
    let present =
        NEVER_COMPARED.iter().chain(by_nodes).filter(|entries| (entries.has)(a) || (entries.has)(b));
    present.map(|Entries { name, paths, .. }| format!("{name} ({paths})")).collect()
}
