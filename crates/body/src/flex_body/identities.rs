//! Identities between the parts of a body (theory section 10): in the coordinates of its interfaces, and cross-checks
//! that no theorem about a single part covers.

use super::{InterfaceCoordinates, MassStructure, Parts, ReferenceConditions};
use crate::invariants::{CauchySchwarz, IdentityCheck, LumpedScheme};
use faer::Mat;
use flexbody_linalg::{combine, gram, larger, largest};
use flexbody_model::{rigid_axes, rigid_count, rigid_fields, span};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeSet;

/// Allowed difference of an energy computed in two ways.
const MAX_ENERGY_DIFFERENCE: f64 = 1e-9;

/// Rounding error of an entry of B'M B, B'K B, R'M R or R'K R, relative to the sum of the magnitudes of its summands,
/// which cancel in slender bodies with many modes and in bodies with many interfaces. Each entry of K, M and B is
/// rounded, so that no smaller error can be expected. Measured: 1e-16 to 2.8e-16 of these sums, which reach 2.5e9 for a
/// bar of five thousand times its width with 240 fixed-interface modes.
const SUMMAND_ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Allowed motion of the interface that carries the frame, relative to the largest motion of a node in the mode
/// (its displacement, or its rotation times its distance from the reference point); rounding causes it.
const MAX_MOTION_AT_REST: f64 = 1e-9;

impl Parts {
    /// Checks a frame on an interface: the reference point is the origin and is at rest in every mode.
    pub(super) fn frame_at_rest(&self) -> Option<IdentityCheck> {
        let ReferenceConditions::Interface(name) = &self.conditions else { return None };
        let interface = self.interfaces.iter().find(|interface| interface.name == *name)?;
        let reference = interface.reference?;
        let rotation = self.modes.rotation.as_ref().map(Mat::as_ref);
        let rows = interface.rows(&self.nodes, self.modes.shape.as_ref(), rotation, self.dimension)?;
        // A rotation displaces the nodes of the interface by their distances; for a single node the extent
        // of the body counts.
        let places: Vec<[f64; 3]> = interface.nodes.iter().map(|&i| self.nodes.positions[i]).collect();
        let (extent, interface_extent) = (span(&self.nodes.positions), span(&places));
        let arm = if interface_extent > 0.0 { interface_extent } else { extent };
        // Rotations of a single node at rest are zeros, as for nodes without rotations.
        let unknown = if self.modes.rotation.is_some() { 0.0 } else { f64::INFINITY };
        // The reference point moves by the displacements of the nodes and their rotations times its distance from them,
        // and both are rounded. A torsion of a straight beam displaces no node.
        let distance = self.nodes.positions.iter().map(|x| Vector3::from(*x).norm()).fold(0.0, f64::max);
        let turn = |j: usize| self.modes.rotation.as_ref().map_or(0.0, |all| all.col(j).norm_max());
        let size = |j: usize| self.modes.shape.col(j).norm_max().max(distance * turn(j));
        let moved = |j: usize| {
            let turned = rows.rotation.as_ref().map_or(unknown, |rotation| arm * rotation.col(j).norm_max());
            rows.translation.col(j).norm_max().max(turned) / size(j)
        };
        let modes = (0..self.modes.shape.ncols()).map(moved);
        let displaced = reference.iter().map(|x| x.abs() / extent);
        Some(IdentityCheck::new(
            "frame_on_interface",
            "the reference point is the origin and rests in every mode",
            largest(modes.chain(displaced)),
            MAX_MOTION_AT_REST + 4.0 * self.storage.rounding(),
        ))
    }

    /// Returns the identities of the interface coordinates: they reproduce the energies of the modes and
    /// the mass of the rigid body.
    pub fn interface_identities(&self) -> Vec<IdentityCheck> {
        let Some(coordinates) = &self.coordinates else { return Vec::new() };
        let InterfaceCoordinates { stiffness, mass, of_modes, .. } = coordinates;
        let twice = |a: &Mat<f64>, b: &Mat<f64>| gram(b.as_ref(), combine(a.as_ref(), b.as_ref()).as_ref());
        let (energy, inertia) = (twice(stiffness, of_modes), twice(mass, of_modes));
        let sums = |a: &Mat<f64>, b: &Mat<f64>| twice(&magnitudes(a), &magnitudes(b));
        let root: Vec<f64> = self.modes.eigenvalue.iter().map(|l| l.sqrt()).collect();
        let nf = root.len();
        let identity = |i: usize, j: usize| f64::from(i == j);
        // The shapes contain the strain energy of rigid motion due to rounding of K, the modes do not.
        let of_stiffness = MAX_ENERGY_DIFFERENCE
            + 10.0 * self.certificate.rigid_noise
            + self.certificate.eigenvalue_rounding;
        let (of_energy, of_inertia) = (sums(stiffness, of_modes), sums(mass, of_modes));
        let mut checks = vec![
            worst_entry("interface_stiffness", "B' K B = diag(lambda)", (nf, nf), of_stiffness, |i, j| {
                let size = root[i] * root[j];
                (energy[(i, j)] / size - identity(i, j), of_energy[(i, j)] / size)
            }),
            worst_entry("interface_mass", "B' M B = I", (nf, nf), MAX_ENERGY_DIFFERENCE, |i, j| {
                (inertia[(i, j)] - identity(i, j), of_inertia[(i, j)])
            }),
        ];
        if let Some(rigid) = self.rigid_coordinates() {
            let (expected, found, r) = (self.rigid_mass(), twice(mass, &rigid), rigid.ncols());
            let size = |i: usize, j: usize| (expected[(i, i)] * expected[(j, j)]).sqrt();
            let of_mass = sums(mass, &rigid);
            let formula = "R' M R = [m, -c~; c~, I0]";
            checks.push(worst_entry(
                "interface_rigid_mass",
                formula,
                (r, r),
                MAX_ENERGY_DIFFERENCE,
                |i, j| ((found[(i, j)] - expected[(i, j)]) / size(i, j), of_mass[(i, j)] / size(i, j)),
            ));
            let (energy, first) = (twice(stiffness, &rigid), root.first().map_or(1.0, |root| root * root));
            let of_energy = sums(stiffness, &rigid);
            let formula = "R' K R = 0 beside lambda_1 R' M R";
            checks.push(worst_entry("interface_rigid_motion", formula, (r, r), of_stiffness, |i, j| {
                let size = first * size(i, j);
                (energy[(i, j)] / size, of_energy[(i, j)] / size)
            }));
        }
        checks
    }

    /// Returns R (nc x 6, in the plane nc x 3): rigid motion about the origin of the body frame in
    /// interface coordinates. Returns `None` if the coordinates are not those of the interfaces.
    pub fn rigid_coordinates(&self) -> Option<Mat<f64>> {
        let (coordinates, d) = (self.coordinates.as_ref()?, self.dimension);
        let fields = |positions: &[[f64; 3]]| rigid_fields(positions, d, [0.0; 3], 1.0);
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for interface in &self.interfaces {
            let positions = match interface.reference {
                Some(reference) => vec![reference],
                None => {
                    let nodes: BTreeSet<usize> = interface.nodes.iter().copied().collect();
                    nodes.into_iter().map(|i| self.nodes.positions[i]).collect()
                }
            };
            let moved = fields(&positions);
            rows.extend((0..moved.nrows()).map(|i| moved.row(i).iter().copied().collect()));
            if interface.reference.is_some() {
                rows.extend(
                    (d..rigid_count(d))
                        .map(|turn| (0..rigid_count(d)).map(|column| f64::from(column == turn)).collect()),
                );
            }
        }
        let size = coordinates.names.len();
        let modal = coordinates.amplitudes().len();
        // The interface alone does not determine the rotations of the nodes of a free interface.
        (rows.len() + modal == size).then(|| {
            Mat::from_fn(size, rigid_count(d), |i, j| rows.get(i).map_or(0.0, |row: &Vec<f64>| row[j]))
        })
    }

    /// Returns the mass matrix \[m I, -c~; c~, I0\] of the rigid body (6 x 6, in the plane 3 x 3) about the
    /// origin of the body frame, body axes: translations, then rotations.
    pub fn rigid_mass(&self) -> Mat<f64> {
        let (m, c, inertia) =
            (self.invariants.mass(), self.invariants.first_moment(), self.invariants.inertia());
        let lever: Matrix3<f64> = Vector3::cross_matrix(&c);
        // Existing translations and rotations: in the plane two translations and the rotation about the
        // third axis.
        let axes = rigid_axes(self.dimension);
        Mat::from_fn(axes.len(), axes.len(), |i, j| match (axes[i], axes[j]) {
            (i, j) if i < 3 && j < 3 => m * f64::from(i == j),
            (i, j) if i < 3 => -lever[(i, j - 3)],
            (i, j) if j < 3 => lever[(i - 3, j)],
            (i, j) => inertia[(i - 3, j - 3)],
        })
    }
}

/// Returns the magnitudes of all entries.
pub(crate) fn magnitudes(a: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)].abs())
}

/// Returns the check of the entry of a matrix that comes closest to its limit, or exceeds it most: `limit` and the rounding
/// error of the summands of the entry.
///
/// * `entry`: returns the deviation of an entry from its identity, and the sum of the magnitudes of its summands.
pub(crate) fn worst_entry(
    name: &'static str,
    formula: &'static str,
    (rows, columns): (usize, usize),
    limit: f64,
    entry: impl Fn(usize, usize) -> (f64, f64),
) -> IdentityCheck {
    let entries = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    let check = |(i, j): (usize, usize)| {
        let (deviation, sum) = entry(i, j);
        IdentityCheck::new(name, formula, deviation.abs(), limit + SUMMAND_ROUNDING * sum)
    };
    entries.map(check).fold(IdentityCheck::new(name, formula, 0.0, limit), IdentityCheck::or_worse)
}

// Cross-checks between parts of a body that no theorem about a single part covers (theory section 10).
// They detect a changed file with recomputed digests, as far as mechanics can.

/// Allowed rounding error between two ways to one sum, relative to its Cauchy-Schwarz bound.
const MAX_SUM_ROUNDING: f64 = 1e-12;

impl Parts {
    /// Checks masses, modes and damping against each other.
    pub(super) fn cross_checks(&self) -> Vec<IdentityCheck> {
        let row_sums =
            if self.source.mass_structure == MassStructure::General { None } else { self.row_sums() };
        let all = row_sums.into_iter().chain(self.damping_ratios());
        all.chain(self.inertia_stiffness_of_moments()).collect()
    }

    /// Checks that row sums preserve the mass, the centre of mass and the linear momentum of every mode.
    fn row_sums(&self) -> Option<IdentityCheck> {
        let lumped =
            &self.lumped.iter().find(|lumped| lumped.scheme == LumpedScheme::RowSum.name())?.invariants;
        let exact = &self.invariants;
        let bound = CauchySchwarz::of(exact);
        let relative =
            |difference: f64, bound: f64| if difference == 0.0 { 0.0 } else { difference.abs() / bound };
        let first = (0..3)
            .map(|k| relative(exact.first_moment()[k] - lumped.first_moment()[k], bound.first_moment(k)));
        // Rows without a position belong to no node.
        let modes = if self.modes.internal.is_none() { exact.n_modes() } else { 0 };
        let c1 = (0..modes).flat_map(|p| {
            let bound = &bound;
            (0..3).map(move |k| relative(exact.c1()[(k, p)] - lumped.c1()[(k, p)], bound.c1(p)))
        });
        let value = first.chain(c1).fold(relative(exact.mass() - lumped.mass(), exact.mass()), larger);
        Some(IdentityCheck::new(
            "row_sums",
            "m, c and C1 of the row sums of M are those of M",
            value,
            MAX_SUM_ROUNDING,
        ))
    }

    /// Checks that the stiffness of inertia follows from the moments of the nodes and their rotations.
    fn inertia_stiffness_of_moments(&self) -> Option<IdentityCheck> {
        let (inertia, rotation) = (self.inertia_stiffness.as_ref()?, self.modes.rotation.as_ref()?);
        let formula = "K = sum over the nodes of theta' (sym G - tr G I) theta";
        // Both rotations in a product are rounded.
        let limit = MAX_SUM_ROUNDING + 4.0 * self.storage.rounding();
        let value = inertia.deviation(rotation.as_ref(), self.dimension);
        Some(IdentityCheck::new("inertia_stiffness", formula, value, limit))
    }

    /// Checks that the damping ratios follow from the diagonal of the modal damping.
    fn damping_ratios(&self) -> Option<IdentityCheck> {
        let damping = self.modes.modal_damping.as_ref()?;
        let size = damping.norm_max();
        // A ratio is never negative: negative diagonal entries are rounding.
        let difference = |(j, lambda): (usize, &f64)| {
            let by_ratio = 2.0 * self.modes.damping_ratio[j] * lambda.sqrt();
            let difference = (by_ratio - damping[(j, j)].max(0.0)).abs();
            if difference == 0.0 { 0.0 } else { difference / size }
        };
        let value = largest(self.modes.eigenvalue.iter().enumerate().map(difference));
        Some(IdentityCheck::new("damping_ratios", "zeta_j = D_jj / (2 omega_j)", value, MAX_SUM_ROUNDING))
    }
}
