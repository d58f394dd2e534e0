//! Loads of geometric stiffness as forces at nodes, and the difference of other forces from them.

use crate::rows::{centre_and_length, rigid_axes};
use crate::{Coupling, FeModel, InertialRows, LoadKind, NodeSet, UnitLoad};
use faer::Mat;
use flexbody_linalg::{gram, larger};
use nalgebra::{Matrix6, Vector3, Vector6};

/// Largest difference between partial and full inertia relief, relative to the partial one, for a
/// load that counts as balanced.
const MAX_BALANCED_DIFFERENCE: f64 = 1e-3;

/// Part of the nodes, those with the smallest differences, that must carry the load: the others may be
/// supported.
const FREE_NODE_FRACTION: f64 = 0.5;

/// Ratio of the difference of a node, relative to its force, to the usual one, above which the node counts
/// as supported.
const MIN_SUPPORTED_RATIO: f64 = 10.0;

/// Smallest part of the load that the unsupported nodes must carry.
const MIN_FREE_LOAD: f64 = 0.25;

/// Force, relative to the inertia of the body, below which it counts as rounding.
const ROUNDING_LOAD: f64 = 1e-6;

/// Unit loads of a model as nodal forces.
pub(crate) struct UnitLoads<'m> {
    model: &'m FeModel,
    rows: InertialRows<'m>,
    /// M times the rigid motions about the centre of [`InertialRows`], on its rows.
    momenta: Mat<f64>,
    /// Inertia forces -M of the rigid motions at every node.
    relief: Vec<Relief>,
    /// Mass matrix of the rigid motions; zero for motions out of the plane.
    mass: Matrix6<f64>,
    /// Largest distance of a node from the middle.
    length: f64,
}

/// Hypothesis about the forces that a stress turns: the load plus inertia forces of a rigid acceleration.
struct Explained {
    acceleration: Vector6<f64>,
    /// Error of the acceleration itself.
    error: f64,
}

impl<'m> UnitLoads<'m> {
    pub(crate) fn new(model: &'m FeModel) -> Self {
        let rows = InertialRows::new(model, model.centre_of_mass());
        let rigid = rows.rigid();
        let momenta = rows.weigh(rigid.as_ref());
        let at_nodes = rows.restrict(momenta.clone());
        let (d, to) = (model.dimension(), rigid_axes(model.dimension()));
        let relief = (0..model.nodes().len()).map(|i| {
            let mut forces: Relief = [Vector3::zeros(); 6];
            for (column, &motion) in to.iter().enumerate() {
                (0..d).for_each(|k| forces[motion][k] = -at_nodes[(d * i + k, column)]);
            }
            forces
        });
        let relief = relief.collect();
        let products = gram(rigid.as_ref(), momenta.as_ref());
        let mut mass = Matrix6::zeros();
        for (a, &to_a) in to.iter().enumerate() {
            to.iter().enumerate().for_each(|(b, &to_b)| mass[(to_a, to_b)] = products[(a, b)]);
        }
        let (_, length) = centre_and_length(&model.nodes().positions);
        Self { model, rows, momenta, relief, mass, length }
    }

    /// Returns the difference of `forces`, one per node, from those of a unit of `load`, relative to the
    /// latter. Supports at some nodes and inertia relief may balance the load. Returns `None` for a load
    /// known by its name only.
    pub(crate) fn error(&self, load: &UnitLoad, forces: &[Vector3<f64>]) -> Option<f64> {
        let axis = load.component;
        match &load.kind {
            LoadKind::Named(_) => None,
            LoadKind::Acceleration => Some(self.of_acceleration(forces, axis)),
            LoadKind::AngularAcceleration => Some(self.of_angular_acceleration(forces, axis)),
            LoadKind::Spin => Some(self.of_spin(forces, axis)),
            LoadKind::Force(at) | LoadKind::Moment(at) => {
                let set = self.model.interfaces().iter().find(|set| set.name == *at)?;
                let mut wanted = Vector6::zeros();
                wanted[if matches!(load.kind, LoadKind::Force(_)) { axis } else { 3 + axis }] = 1.0;
                Some(self.of_interface(forces, set, &wanted))
            }
        }
    }

    /// Returns the error for the inertia forces of a unit acceleration.
    fn of_acceleration(&self, forces: &[Vector3<f64>], axis: usize) -> f64 {
        let none = vec![Vector3::zeros(); forces.len()];
        self.of_inertia(forces, &none, &Vector6::ith(axis, 1.0))
    }

    /// Returns the error for the inertia forces of a unit angular acceleration about the origin of a frame.
    fn of_angular_acceleration(&self, forces: &[Vector3<f64>], axis: usize) -> f64 {
        let none = vec![Vector3::zeros(); forces.len()];
        let about_centre = Vector6::ith(3 + axis, 1.0);
        let shift = Vector3::ith(axis, 1.0).cross(&self.rows.centre());
        let about_origin = about_centre + translation(&shift);
        let error = |motion: &Vector6<f64>| self.of_inertia(forces, &none, motion);
        error(&about_centre).min(error(&about_origin))
    }

    /// Returns the error for centrifugal forces about the origin of a frame.
    fn of_spin(&self, forces: &[Vector3<f64>], component: usize) -> f64 {
        let load = self.centrifugal(component);
        let (k, l) = LoadKind::SPIN[component];
        let twice =
            |k: usize, l: usize| Vector3::ith(k, 1.0).cross(&Vector3::ith(l, 1.0).cross(&self.rows.centre()));
        let shift = if k == l { twice(k, l) } else { twice(k, l) + twice(l, k) };
        let error = |motion: &Vector6<f64>| self.of_inertia(forces, &load, motion);
        error(&Vector6::zeros()).min(error(&translation(&shift)))
    }

    /// Returns the smallest error over the ways to balance the `load` and the inertia forces of a rigid
    /// acceleration: supports, inertia relief of a free body, or both.
    fn of_inertia(&self, forces: &[Vector3<f64>], load: &[Vector3<f64>], motion: &Vector6<f64>) -> f64 {
        let load: Vec<_> =
            load.iter().zip(&self.relief).map(|(f, relief)| f + force(relief, motion)).collect();
        let whole = self.balance(&load);
        let partly = least_lengths(&differences(forces, &load), &self.relief);
        // Supports do no work on the motion that they leave free: it is M-orthogonal to the part that they
        // carry.
        let taken = whole - partly;
        let product = |a: &Vector6<f64>, b: &Vector6<f64>| a.dot(&(self.mass * b));
        let size = product(&taken, &taken).min(product(&partly, &partly));
        // Moments at nodal rotations are not among the forces: relief that nearly balances the load counts
        // as full relief.
        let is_balanced = self.rows.have_directors()
            && product(&taken, &taken) <= MAX_BALANCED_DIFFERENCE.powi(2) * product(&partly, &partly);
        let error = if is_balanced || size == 0.0 { 0.0 } else { product(&taken, &partly).abs() / size };
        let all = [
            Explained { acceleration: Vector6::zeros(), error: 0.0 },
            Explained { acceleration: whole, error: 0.0 },
            Explained { acceleration: partly, error },
        ];
        self.least(forces, &load, &all)
    }

    /// Returns the rigid acceleration whose inertia forces balance forces at the nodes.
    fn balance(&self, load: &[Vector3<f64>]) -> Vector6<f64> {
        let mut normal = Matrix6::zeros();
        let mut right = Vector6::zeros();
        let motions = self.model.nodes().positions.iter().map(|x| self.motions_of(x));
        for ((motions, relief), f) in motions.zip(&self.relief).zip(load) {
            for a in 0..6 {
                right[a] += motions[a].dot(f);
                (0..6).for_each(|b| normal[(a, b)] -= motions[a].dot(&relief[b]));
            }
        }
        solve(0.5 * (normal + normal.transpose()), &right)
    }

    /// Returns the displacements of a position under the six unit rigid motions.
    fn motions_of(&self, place: &[f64; 3]) -> Relief {
        let arm = Vector3::from(*place) - self.rows.centre();
        std::array::from_fn(|motion| match motion {
            0..3 => Vector3::ith(motion, 1.0),
            _ => Vector3::ith(motion - 3, 1.0).cross(&arm),
        })
    }

    /// Returns the error for forces at the nodes of an interface with a unit resultant.
    fn of_interface(&self, forces: &[Vector3<f64>], set: &NodeSet, wanted: &Vector6<f64>) -> f64 {
        let ids = &self.model.nodes().ids;
        let is_member: Vec<bool> = ids.iter().map(|id| set.nodes.contains(id)).collect();
        let outside: Vec<_> = forces
            .iter()
            .zip(&is_member)
            .map(|(f, &member)| if member { Vector3::zeros() } else { *f })
            .collect();
        let resultant = self.resultant_of(wanted, self.reference(set, &is_member));
        let balance = solve(self.mass, &resultant);
        let candidates = [Vector6::zeros(), balance, least_lengths(&outside, &self.relief)];
        let total: f64 = forces.iter().map(Vector3::norm).sum::<f64>().max(f64::MIN_POSITIVE);
        let error = |by: &Vector6<f64>| {
            let rest = |i: usize| forces[i] - force(&self.relief[i], by);
            let mut lengths: Vec<f64> =
                (0..ids.len()).filter(|&i| !is_member[i]).map(|i| rest(i).norm()).collect();
            lengths.sort_by(f64::total_cmp);
            let kept = (FREE_NODE_FRACTION * ids.len() as f64).ceil() as usize;
            let elsewhere = lengths.iter().take(kept).sum::<f64>() / total;
            let rest_forces: Vec<_> =
                (0..ids.len()).filter(|&i| is_member[i]).map(|i| (i, rest(i))).collect();
            larger(elsewhere, self.resultant_error(&rest_forces, set, wanted, &is_member))
        };
        candidates.iter().map(error).fold(f64::INFINITY, f64::min)
    }

    /// Returns the difference of the resultant of the forces at the nodes of an interface from `wanted`,
    /// about its reference point, in units of the larger of the wanted force and moment. Moments are not
    /// compared if nodes have rotations.
    fn resultant_error(
        &self,
        rest_forces: &[(usize, Vector3<f64>)],
        set: &NodeSet,
        wanted: &Vector6<f64>,
        is_member: &[bool],
    ) -> f64 {
        let positions = &self.model.nodes().positions;
        let about = self.reference(set, is_member);
        let mut difference = -wanted.fixed_rows::<3>(0).into_owned();
        let mut moment = -wanted.fixed_rows::<3>(3).into_owned();
        for (i, f) in rest_forces {
            difference += f;
            moment += (Vector3::from(positions[*i]) - about).cross(f);
        }
        let turning = self.model.rows().rotations().iter().any(|&(node, _)| is_member[node as usize]);
        let known = !turning && set.coupling() != Coupling::Free;
        let is_moment = wanted.fixed_rows::<3>(3).norm() > 0.0;
        let force_error = difference.norm() * if is_moment { self.length } else { 1.0 };
        let moment_error = moment.norm() / if is_moment { 1.0 } else { self.length };
        if known { larger(force_error, moment_error) } else { force_error }
    }

    /// Returns the reference point of an interface, or the mean of its nodes.
    fn reference(&self, set: &NodeSet, is_member: &[bool]) -> Vector3<f64> {
        if let Some(point) = set.reference.point() {
            return Vector3::from(point);
        }
        let members: Vec<_> =
            self.model.nodes().positions.iter().zip(is_member).filter(|(_, m)| **m).collect();
        members.iter().map(|(x, _)| Vector3::from(**x)).sum::<Vector3<f64>>() / members.len().max(1) as f64
    }

    /// Returns the work of a force and moment at a point on the unit rigid motions.
    fn resultant_of(&self, wanted: &Vector6<f64>, point: Vector3<f64>) -> Vector6<f64> {
        let f = wanted.fixed_rows::<3>(0).into_owned();
        let moment = wanted.fixed_rows::<3>(3) + (point - self.rows.centre()).cross(&f);
        let mut resultant = Vector6::zeros();
        resultant.fixed_rows_mut::<3>(0).copy_from(&f);
        resultant.fixed_rows_mut::<3>(3).copy_from(&moment);
        resultant
    }

    /// Returns the smallest error of the hypotheses about `forces`.
    fn least(&self, forces: &[Vector3<f64>], load: &[Vector3<f64>], all: &[Explained]) -> f64 {
        let error = |explained: &Explained| {
            larger(explained.error, self.unexplained(forces, load, &explained.acceleration))
        };
        all.iter().map(error).fold(f64::INFINITY, f64::min)
    }

    /// Returns the difference of `forces` from `load` plus the relief by an acceleration, at the nodes with
    /// the smallest differences, relative to the forces there.
    fn unexplained(&self, forces: &[Vector3<f64>], load: &[Vector3<f64>], by: &Vector6<f64>) -> f64 {
        let net: Vec<_> = load.iter().zip(&self.relief).map(|(f, relief)| f + force(relief, by)).collect();
        let mut nodes: Vec<(f64, usize)> =
            forces.iter().zip(&net).map(|(f, net)| (f - net).norm()).zip(0..).collect();
        nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let all: f64 = net.iter().map(Vector3::norm).sum();
        let floor = ROUNDING_LOAD * self.inertia();
        let size_of = |i: usize| larger(net[i].norm(), forces[i].norm());
        let largest = (0..net.len()).map(size_of).fold(0.0, larger);
        let loaded = nodes.iter().filter(|node| size_of(node.1) > ROUNDING_LOAD * largest);
        let mut ratios: Vec<f64> = loaded.map(|&(rest, i)| rest / size_of(i)).collect();
        ratios.sort_by(f64::total_cmp);
        let usual = ratios.get(ratios.len() / 2).copied().unwrap_or(0.0);
        let (mut difference, mut size, mut carried) = (0.0, 0.0, 0.0);
        for (count, &(rest, i)) in nodes.iter().enumerate() {
            let force_size = size_of(i);
            let is_enough =
                count as f64 >= FREE_NODE_FRACTION * net.len() as f64 && carried >= MIN_FREE_LOAD * all;
            if is_enough && rest > MIN_SUPPORTED_RATIO * usual * force_size {
                continue;
            }
            carried += net[i].norm();
            difference += rest;
            size += force_size;
        }
        difference / larger(size, floor)
    }

    /// Returns the sum of the inertia forces of unit motions over the nodes, with rotations scaled by their
    /// lengths.
    fn inertia(&self) -> f64 {
        let of_node = |relief: &Relief| relief.iter().map(Vector3::norm).fold(0.0, larger);
        self.relief.iter().map(of_node).sum::<f64>()
    }

    /// Returns the centrifugal forces at the nodes for one product of spin rates, about the centre.
    fn centrifugal(&self, component: usize) -> Vec<Vector3<f64>> {
        let (d, (k, l)) = (self.model.dimension(), LoadKind::SPIN[component]);
        let mut load = Mat::zeros(self.momenta.nrows(), 1);
        for (k, l) in if k == l { vec![(k, l)] } else { vec![(k, l), (l, k)] } {
            let momentum = self.momenta.as_ref().subcols(if d == 2 { 2 } else { 3 + l }, 1).to_owned();
            self.rows.add_turned(|_| -Vector3::ith(k, 1.0), &momentum, &mut load);
        }
        let load = self.rows.restrict(load);
        let at = |i: usize| Vector3::from_fn(|k, _| if k < d { load[(d * i + k, 0)] } else { 0.0 });
        (0..self.model.nodes().len()).map(at).collect()
    }
}

/// Returns the rigid motion of a translation.
fn translation(by: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(by.x, by.y, by.z, 0.0, 0.0, 0.0)
}

fn differences(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

// Fit of inertia relief to forces at nodes, robust against arbitrary forces at a few supported nodes.

/// Number of reweightings. Each reduces the share of the supported nodes in the fit; forty leave 1e-6 of
/// it.
const REWEIGHTINGS: usize = 40;

/// Force relative to the mean below which all forces have equal weight.
const EQUAL_WEIGHT_FORCE: f64 = 1e-7;

/// Forces of the six unit rigid accelerations at one node; those out of the plane are zero.
type Relief = [Vector3<f64>; 6];

/// Returns the sum of the forces of the accelerations `by`.
fn force(relief: &Relief, by: &Vector6<f64>) -> Vector3<f64> {
    relief.iter().zip(by.iter()).fold(Vector3::zeros(), |sum, (unit, &c)| sum + unit * c)
}

/// Returns the rigid accelerations that minimise the sum of the lengths of `forces` - relief. In a sum of
/// lengths a few nodes with arbitrary forces do not change the result (iteratively reweighted least
/// squares).
fn least_lengths(forces: &[Vector3<f64>], relief: &[Relief]) -> Vector6<f64> {
    let mean = forces.iter().map(Vector3::norm).sum::<f64>() / forces.len().max(1) as f64;
    let mut by = Vector6::zeros();
    if mean == 0.0 {
        return by;
    }
    for _ in 0..REWEIGHTINGS {
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for (f, unit) in forces.iter().zip(relief) {
            let weight = 1.0 / (f - force(unit, &by)).norm().max(EQUAL_WEIGHT_FORCE * mean);
            for a in 0..6 {
                right[a] += weight * unit[a].dot(f);
                (0..6).for_each(|b| normal[(a, b)] += weight * unit[a].dot(&unit[b]));
            }
        }
        by = solve(normal, &right);
    }
    by
}

/// Returns the least-squares solution of normal equations; motions without effect get no acceleration.
fn solve(normal: Matrix6<f64>, right: &Vector6<f64>) -> Vector6<f64> {
    /// Squared size of a motion, relative to the largest, below which it has no effect.
    const MIN_SQUARED_MOTION: f64 = 1e-12;
    // Scale to a unit diagonal: rotations and translations have different units.
    let scale =
        Vector6::from_fn(|k, _| if normal[(k, k)] > 0.0 { normal[(k, k)].sqrt().recip() } else { 0.0 });
    let scaled = Matrix6::from_fn(|a, b| scale[a] * normal[(a, b)] * scale[b]);
    let eigen = scaled.symmetric_eigen();
    let right = scale.component_mul(right);
    let largest = eigen.eigenvalues.amax();
    let mut solution = Vector6::zeros();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > MIN_SQUARED_MOTION * largest {
            solution += vector * (vector.dot(&right) / value);
        }
    }
    scale.component_mul(&solution)
}
