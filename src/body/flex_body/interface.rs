//! Interfaces of a body: what a joint needs of them.

use super::Parts;
use crate::body::invariants::IdentityCheck;
use crate::model::{Coupling, InterfaceMotion, Nodes, rigid_count, rigid_fields};
use crate::numerics::linalg::{combine, gram};
use faer::{Mat, MatRef};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeSet;

/// A named interface of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Interface {
    /// Name.
    pub name: String,
    /// Indices into the body's nodes.
    pub nodes: Vec<usize>,
    /// How the nodes are coupled to the reference point, where that was stated.
    pub coupling: Option<Coupling>,
    /// Reference point in the body frame; none of a free interface.
    pub reference: Option<[f64; 3]>,
}

/// What the modes do at the reference point of an interface, in body axes: the rigid motion that fits that of the nodes best.
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceRows {
    /// 3 x nf.
    pub translation: Mat<f64>,
    /// 3 x nf; none where the nodes lie on one line and determine no rotation.
    pub rotation: Option<Mat<f64>>,
    /// Root mean square over the nodes of what the fit leaves of the displacement (nf): zero where they move as a rigid body.
    pub misfit: Vec<f64>,
    /// Root mean square over the nodes of their largest displacement in any mode.
    largest: f64,
}

impl InterfaceRows {
    /// The mode in which the interface deforms most, and how much, relative to its largest motion in any mode.
    pub fn deformation(&self) -> (usize, f64) {
        let worst = |most: (usize, f64), (j, &e): (usize, &f64)| if e > most.1 { (j, e) } else { most };
        let (mode, misfit) = self.misfit.iter().enumerate().fold((0, 0.0), worst);
        (mode, if self.largest > 0.0 { misfit / self.largest } else { 0.0 })
    }
}

impl Interface {
    /// The rows of the modes (`shape` and, where nodes have rotations, `rotation`: 3n x nf) at the reference point; `None` without one,
    /// or where they are no finite numbers.
    pub fn rows(
        &self,
        nodes: &Nodes,
        shape: MatRef<'_, f64>,
        rotation: Option<MatRef<'_, f64>>,
        dimension: usize,
    ) -> Option<InterfaceRows> {
        let (d, k, nf) = (dimension, self.nodes.len(), shape.ncols());
        let positions: Vec<[f64; 3]> = self.nodes.iter().map(|&i| nodes.positions[i]).collect();
        // Nodes without rotations have zeros in their place.
        let turns = |rotation: MatRef<'_, f64>, node: usize| {
            (0..nf).any(|j| (0..3).any(|axis| rotation[(3 * node + axis, j)] != 0.0))
        };
        let rotation = rotation.filter(|rotation| self.nodes.iter().all(|&node| turns(*rotation, node)));
        let motion = InterfaceMotion::new(&positions, rotation.is_some(), d, Some(self.reference?));
        let all =
            Mat::from_fn(motion.rigid().nrows(), nf, |row, j| match (row.checked_sub(d * k), rotation) {
                (Some(row), Some(rotation)) if d == 2 => rotation[(3 * self.nodes[row] + 2, j)],
                (Some(row), Some(rotation)) => rotation[(3 * self.nodes[row / 3] + row % 3, j)],
                _ => shape[(3 * self.nodes[row / d] + row % d, j)],
            });
        let q = motion.fit(all.as_ref());
        let u = all.as_ref().subrows(0, d * k).to_owned();
        let left = &u - combine(motion.rigid().subrows(0, d * k), q.as_ref());
        let root_mean_square = |a: &Mat<f64>, j: usize| a.col(j).norm_l2() / (k as f64).sqrt();
        let misfit: Vec<f64> = (0..nf).map(|j| root_mean_square(&left, j)).collect();
        let largest = (0..nf).map(|j| root_mean_square(&u, j)).fold(0.0, f64::max);
        let translation = Mat::from_fn(3, nf, |i, j| if i < d { q[(i, j)] } else { 0.0 });
        let rotation = Mat::from_fn(3, nf, |i, j| match (d, i) {
            (2, 0 | 1) => 0.0,
            (2, _) => q[(2, j)],
            _ => q[(3 + i, j)],
        });
        let finite = |a: &Mat<f64>| a.col_iter().all(|column| column.iter().all(|v| v.is_finite()));
        let rotation = motion.is_determined().then_some(rotation);
        let rows = InterfaceRows { translation, rotation, misfit, largest };
        (finite(&rows.translation)
            && rows.rotation.as_ref().is_none_or(finite)
            && rows.misfit.iter().all(|v| v.is_finite()))
        .then_some(rows)
    }
}

/// K and M of a body in the motions of its interfaces and the amplitudes of its fixed-interface modes, and the transformation from
/// its modes. In body axes: the coordinates of an interface are those of its reference point (three translations, three
/// rotations; in the plane two and one) or, of a free one, the displacements of its nodes in the order of the nodes of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceCoordinates {
    /// What each of the nc coordinates is: those of the interfaces in their order, then the fixed-interface modes.
    pub names: Vec<String>,
    /// K (nc x nc), with as many zero-energy motions as the body has rigid ones.
    pub stiffness: Mat<f64>,
    /// M (nc x nc).
    pub mass: Mat<f64>,
    /// B (nc x nf): coordinates B p for the amplitudes p of the modes, B'K B = diag(lambda), B'M B = I.
    pub of_modes: Mat<f64>,
}

/// What the numbers of two ways to the same energy may differ by.
const ENERGY: f64 = 1e-9;

impl Parts {
    /// What must hold for the interface coordinates: they carry the energies of the modes and the mass of the rigid body.
    pub fn interface_identities(&self) -> Vec<IdentityCheck> {
        let Some(coordinates) = &self.coordinates else { return Vec::new() };
        let InterfaceCoordinates { stiffness, mass, of_modes, .. } = coordinates;
        let check = |name, formula, value: f64, limit| IdentityCheck {
            name,
            formula,
            value,
            limit,
            passed: value <= limit,
        };
        let twice = |a: &Mat<f64>, b: &Mat<f64>| gram(b.as_ref(), combine(a.as_ref(), b.as_ref()).as_ref());
        let (energy, inertia) = (twice(stiffness, of_modes), twice(mass, of_modes));
        let root: Vec<f64> = self.modes.eigenvalue.iter().map(|l| l.sqrt()).collect();
        let nf = root.len();
        let worst = |f: &dyn Fn(usize, usize) -> f64, rows: usize, columns: usize| {
            let places = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
            places.fold(0.0f64, |m, (i, j)| {
                let value = f(i, j).abs();
                if value.is_nan() { f64::INFINITY } else { m.max(value) }
            })
        };
        let identity = |i: usize, j: usize| f64::from(i == j);
        let mut checks = vec![
            check(
                "interface_stiffness",
                "B' K B = diag(lambda)",
                worst(&|i, j| energy[(i, j)] / (root[i] * root[j]) - identity(i, j), nf, nf),
                // What K makes of rigid motion is in the shapes, but not in the modes.
                ENERGY + 10.0 * self.certificate.rigid_noise + self.certificate.eigenvalue_rounding,
            ),
            check(
                "interface_mass",
                "B' M B = I",
                worst(&|i, j| inertia[(i, j)] - identity(i, j), nf, nf),
                ENERGY,
            ),
        ];
        if let Some(rigid) = self.rigid_coordinates() {
            let (expected, own) = (self.rigid_mass(), twice(mass, &rigid));
            let r = rigid.ncols();
            checks.push(check(
                "interface_rigid_mass",
                "R' M R = [m, -c~; c~, I0]",
                worst(
                    &|i, j| (own[(i, j)] - expected[(i, j)]) / (expected[(i, i)] * expected[(j, j)]).sqrt(),
                    r,
                    r,
                ),
                ENERGY,
            ));
            let (energy, first) = (twice(stiffness, &rigid), root.first().map_or(1.0, |root| root * root));
            checks.push(check(
                "interface_rigid_motion",
                "R' K R = 0 beside lambda_1 R' M R",
                worst(&|i, j| energy[(i, j)] / (first * (expected[(i, i)] * expected[(j, j)]).sqrt()), r, r),
                ENERGY + 10.0 * self.certificate.rigid_noise + self.certificate.eigenvalue_rounding,
            ));
        }
        checks
    }

    /// R (nc x 6, in the plane nc x 3): rigid motion about the origin of the body frame in interface coordinates. `None` when the
    /// coordinates are not those of the interfaces.
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
        let modal = coordinates.names.iter().filter(|name| name.starts_with("fixed-interface mode ")).count();
        // Rotations of the nodes of a free interface are not told from the interface alone.
        (rows.len() + modal == size).then(|| {
            Mat::from_fn(size, rigid_count(d), |i, j| rows.get(i).map_or(0.0, |row: &Vec<f64>| row[j]))
        })
    }

    /// The mass matrix \[m I, -c~; c~, I0\] of the rigid body (6 x 6, in the plane 3 x 3) about the origin of the body frame, body
    /// axes: translations, then rotations.
    pub fn rigid_mass(&self) -> Mat<f64> {
        let (m, c, inertia) = (self.invariants.mass, self.invariants.first_moment, self.invariants.inertia());
        let lever: Matrix3<f64> = Vector3::cross_matrix(&c);
        // Translations and rotations that are there: in the plane two and the third.
        let axes: Vec<usize> = if self.dimension == 2 { vec![0, 1, 5] } else { (0..6).collect() };
        Mat::from_fn(axes.len(), axes.len(), |i, j| match (axes[i], axes[j]) {
            (i, j) if i < 3 && j < 3 => m * f64::from(i == j),
            (i, j) if i < 3 => -lever[(i, j - 3)],
            (i, j) if j < 3 => lever[(i - 3, j)],
            (i, j) => inertia[(i - 3, j - 3)],
        })
    }
}
