//! Rotation of a free body by its truncated part: the error of the attitude.

use super::residual::NodalView;
use faer::Mat;
use flexbody_linalg::{combine, gram};
use flexbody_motion::scene::Instant;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Angular momentum of a free body and of the static responses E outside its modes, in body axes. In the plane all
/// entries except those about z are zero.
pub(super) struct Turning {
    /// Inertia tensor J about the centre of mass.
    inertia: Matrix3<f64>,
    /// First-order change of J by each response.
    changes: Vec<Matrix3<f64>>,
    /// Displacement of each load's point by each response.
    at_loads: Vec<Vec<Vector3<f64>>>,
    plane: bool,
}

impl Turning {
    /// Computes inertia and its changes. With the rotations R_a = e_a x (x - x_cm) of points (and of directors) about
    /// the axes of the body, J_ab = R_a'M R_b; to first order R_a changes by e_a x u.
    pub(super) fn new(view: &NodalView<'_>, responses: &Mat<f64>) -> Self {
        let plane = view.model.dimension() == 2;
        let turns = central_turns(view);
        let weighted = view.rows.weigh(turns.as_ref());
        let extended = view.rows.extend(responses);
        let square = |own: &Mat<f64>| {
            if plane {
                Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, own[(0, 0)]))
            } else {
                Matrix3::from_fn(|a, b| own[(a, b)])
            }
        };
        // J_ab = R_a'M R_b.
        let inertia = square(&gram(turns.as_ref(), weighted.as_ref()));
        let change = |j: usize| {
            // Change of J_ab: (e_a x u)'M R_b and its transpose.
            let repeated = Mat::from_fn(turns.nrows(), turns.ncols(), |row, _| extended[(row, j)]);
            let mut turned = Mat::<f64>::zeros(turns.nrows(), turns.ncols());
            let axis = |k: usize| view.axes.column(if plane { 2 } else { k }).into_owned();
            view.rows.add_turned(axis, &repeated, &mut turned);
            let half = square(&gram(turned.as_ref(), weighted.as_ref()));
            half + half.transpose()
        };
        let changes = (0..responses.ncols()).map(change).collect();
        let at_load = |unit: &Mat<f64>| {
            let moved = gram(unit.as_ref().subcols(0, view.model.dimension()), responses.as_ref());
            let along_model =
                |j: usize| Vector3::from_fn(|k, _| if k < moved.nrows() { moved[(k, j)] } else { 0.0 });
            (0..moved.ncols()).map(|j| view.axes.transpose() * along_model(j)).collect()
        };
        Self { inertia, changes, at_loads: view.loads.iter().map(at_load).collect(), plane }
    }

    /// Returns the angle theta between the frames of all nodes and of the body at every instant of the `motion`. The
    /// `amplitudes` c belong to the responses. The angular momentum is J omega in both; to first order
    ///
    /// theta' = delta omega - omega x theta,
    /// J delta omega = (J omega) x theta - (delta J) omega + l,
    /// l' = sum of (delta u) x F - omega x l,
    ///
    /// with delta J and the displacements delta u at the loads F linear in c. The coefficients are constant between
    /// instants, and the equations are solved exactly there. Both frames begin with the same omega.
    pub(super) fn angles(&self, motion: &[Instant], amplitudes: &Mat<f64>) -> Vec<f64> {
        let mut state = SVector::<f64, 7>::zeros();
        let Some(first) = motion.first() else { return Vec::new() };
        let start: Vec<f64> = (0..amplitudes.nrows()).map(|row| amplitudes[(row, 0)]).collect();
        state.fixed_rows_mut::<3>(3).copy_from(&(self.change(&start) * first.omega));
        state[6] = 1.0;
        let mut angles = vec![0.0];
        for (i, pair) in motion.windows(2).enumerate() {
            // Constant coefficients over the step: exact by the matrix exponential.
            let midway = |row: usize| 0.5 * (amplitudes[(row, i)] + amplitudes[(row, i + 1)]);
            let c: Vec<f64> = (0..amplitudes.nrows()).map(midway).collect();
            let step = pair[1].time - pair[0].time;
            state = (self.rates(&pair[0], &pair[1], &c) * step).exp() * state;
            angles.push(state.fixed_rows::<3>(0).norm());
        }
        angles
    }

    /// Returns the matrix of the linear differential equations for (theta, l, 1).
    fn rates(&self, first: &Instant, second: &Instant, c: &[f64]) -> SMatrix<f64, 7, 7> {
        let omega = 0.5 * (first.omega + second.omega);
        let mut torque = Vector3::zeros();
        for (at, moved) in self.at_loads.iter().enumerate() {
            let force = 0.5 * (first.loads[at].0 + second.loads[at].0);
            let shift = moved.iter().zip(c).fold(Vector3::zeros(), |sum, (own, c)| sum + own * *c);
            torque += shift.cross(&force);
        }
        let inverse = self.inverse();
        let turning = omega.cross_matrix();
        let mut rates = SMatrix::<f64, 7, 7>::zeros();
        rates
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(inverse * (self.inertia * omega).cross_matrix() - turning));
        rates.fixed_view_mut::<3, 3>(0, 3).copy_from(&inverse);
        rates.fixed_view_mut::<3, 1>(0, 6).copy_from(&(-inverse * self.change(c) * omega));
        rates.fixed_view_mut::<3, 3>(3, 3).copy_from(&-turning);
        rates.fixed_view_mut::<3, 1>(3, 6).copy_from(&torque);
        rates
    }

    /// Returns delta J for responses with the amplitudes c.
    fn change(&self, c: &[f64]) -> Matrix3<f64> {
        self.changes.iter().zip(c).fold(Matrix3::zeros(), |sum, (own, c)| sum + own * *c)
    }

    /// Returns the inverse of J; zero if J is singular, as for a body on a line.
    fn inverse(&self) -> Matrix3<f64> {
        if self.plane {
            Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, self.inertia[(2, 2)].recip()))
        } else {
            self.inertia.try_inverse().unwrap_or_else(Matrix3::zeros)
        }
    }
}

/// Returns the rotations about the body axes through the centre of mass, in the rows that inertia acts on: three
/// columns, in the plane one.
fn central_turns(view: &NodalView<'_>) -> Mat<f64> {
    let d = view.model.dimension();
    let (shifts, turns) = view.extended_rigid.as_ref().split_at_col(d);
    let turns = match d {
        2 => turns.to_owned(),
        _ => combine(turns, Mat::from_fn(3, 3, |i, j| view.axes[(i, j)]).as_ref()),
    };
    // Shift the axes to the centre of mass, so that rotations are M-orthogonal to translations.
    let weighted = view.rows.weigh(shifts);
    let mass = gram(shifts, weighted.as_ref())[(0, 0)];
    let moments = gram(weighted.as_ref(), turns.as_ref());
    let offsets = Mat::from_fn(moments.nrows(), moments.ncols(), |i, j| moments[(i, j)] / mass);
    turns - combine(shifts, offsets.as_ref())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instants(omega: Vector3<f64>, force: Vector3<f64>, steps: usize, step: f64) -> Vec<Instant> {
        let at = |i: usize| Instant {
            time: step * i as f64,
            velocity: Vector3::zeros(),
            velocity_rate: Vector3::zeros(),
            omega,
            omega_rate: Vector3::zeros(),
            q: Vec::new(),
            qd: Vec::new(),
            qdd: Vec::new(),
            gravity: Vector3::zeros(),
            loads: vec![(force, Vector3::zeros())],
        };
        (0..=steps).map(at).collect()
    }

    fn turning() -> Turning {
        Turning {
            inertia: Matrix3::from_diagonal(&Vector3::new(2.0, 3.0, 4.0)),
            changes: vec![Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 0.04))],
            at_loads: vec![vec![Vector3::new(1e-3, 0.0, 0.0)]],
            plane: false,
        }
    }

    /// A body whose moment about its axis of spin is 1 % larger turns 1 % slower.
    #[test]
    fn a_larger_moment_of_inertia_slows_the_spin() {
        let omega = Vector3::new(0.0, 0.0, 5.0);
        let grown = Mat::from_fn(1, 9, |_, i| if i == 0 { 0.0 } else { 1.0 });
        let motion = instants(omega, Vector3::zeros(), 8, 0.5);
        for (i, angle) in turning().angles(&motion, &grown).iter().enumerate().skip(1) {
            assert!((angle - 0.05 * 0.5 * (i as f64 - 0.5)).abs() < 1e-12, "{i}: {angle}");
        }
        // A body with the larger moment from the start has the larger angular momentum and does not turn away.
        let steady = turning().angles(&motion, &Mat::full(1, 9, 1.0));
        assert!(steady.iter().all(|angle| *angle < 1e-12), "{steady:?}");
    }

    /// A force at a point displaced by s = 1e-3 turns a body at rest by F s t^2 / 2 J.
    #[test]
    fn a_load_beside_its_place_turns_the_body() {
        let motion = instants(Vector3::zeros(), Vector3::new(0.0, 8.0, 0.0), 4, 0.25);
        let angles = turning().angles(&motion, &Mat::full(1, 5, 1.0));
        assert!((angles[4] - 8e-3 / 8.0).abs() < 1e-15, "{}", angles[4]);
    }
}
