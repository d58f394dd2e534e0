//! Recovery of stresses, strains, forces and displacements: rows
//!
//! ```text
//! y = y0 + (R Psi) q + sum_a (R G_r b_a) f_a - sum_{k <= l} (R G_r M c_kl) w_k w_l
//! ```
//!
//! of the deformed body (theory section 12), with the modal coordinates q, the loads f_a on the body and the angular
//! velocity w. G_r is the static flexibility of the free body outside the modes. Accelerations and gravity have no
//! terms: G M (rigid motion) = 0. Damping forces and the inertia of the deformation have the columns of [`MotionLoad`].

use super::modal_change::ModalChange;
use super::motion_columns::spin_along;
use super::{LoadKind, ModalMotion, MotionColumns, MotionLoad};
use faer::Mat;
use flexbody_model::RecoveryRow;
use nalgebra::Matrix3;

/// Number of columns of a load at an interface: force and torque along three axes.
pub const LOAD_COMPONENTS: usize = 6;

/// Rows that are read off the body. The rows have the axes and units of the operator that they were made of; only the
/// loads and the angular velocity are along the axes of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Recovery {
    /// Name.
    pub name: String,
    /// Label of every row.
    pub rows: Vec<RecoveryRow>,
    /// Values y0 of the undeformed body (rows).
    pub offset: Vec<f64>,
    /// R Psi (rows x nf).
    pub modes: Mat<f64>,
    /// -R G_r M c_kl (rows x 6) for the products w_k w_l in the order of [`LoadKind::SPIN`], along body axes. A body
    /// without the group W1 has no response of its modes to spin; the columns then hold -R G M c_kl.
    pub spin: Mat<f64>,
    /// Columns of the loads at each interface with a reference point.
    pub loads: Vec<LoadColumns>,
    /// R G_r f (rows x number of named loads), in the order of the named loads of the body.
    pub named: Mat<f64>,
    /// Columns of the forces that the deformed body exerts by its motion, in the order of [`MotionLoad::ALL`]; of each
    /// kind once at most.
    pub motion: Vec<MotionColumns>,
}

/// Columns of the loads at one interface.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadColumns {
    /// Name of the interface.
    pub interface: String,
    /// R G_r b_a (rows x 6) of unit forces and unit torques at the reference point, along body axes.
    pub columns: Mat<f64>,
}

/// State of the body that the rows follow from.
#[derive(Debug, Clone, Copy)]
pub struct RecoveryState<'a> {
    /// Modal coordinates, their rates and the turning of the frame.
    pub motion: ModalMotion<'a>,
    /// Force and torque at the reference point of each interface, body axes, in the order of [`Recovery::loads`].
    pub loads: &'a [[f64; LOAD_COMPONENTS]],
    /// Amplitudes of the named loads, in the order of the body; 1 for a preload.
    pub named: &'a [f64],
}

impl Recovery {
    /// Returns the values of all rows.
    ///
    /// # Panics
    /// When the numbers of modes or of loads differ.
    pub fn values(&self, state: &RecoveryState<'_>) -> Vec<f64> {
        let q = state.motion.q;
        assert_eq!(q.len(), self.modes.ncols(), "modal coordinates");
        assert_eq!(state.loads.len(), self.loads.len(), "loads");
        assert_eq!(state.named.len(), self.named.ncols(), "named loads");
        let w = state.motion.angular_velocity;
        let products = LoadKind::SPIN.map(|(k, l)| w[k] * w[l]);
        let amplitudes = |columns: &MotionColumns| {
            let mut amplitudes = vec![0.0; columns.columns.ncols()];
            columns.load.write_amplitudes(&state.motion, &mut amplitudes);
            amplitudes
        };
        let of_motion: Vec<Vec<f64>> = self.motion.iter().map(amplitudes).collect();
        let of_deformed = |i: usize| -> f64 {
            let one = |(own, amplitudes): (&MotionColumns, &Vec<f64>)| -> f64 {
                amplitudes.iter().enumerate().map(|(c, a)| own.columns[(i, c)] * a).sum()
            };
            self.motion.iter().zip(&of_motion).map(one).sum()
        };
        let of_loads = |i: usize| -> f64 {
            let one = |(of_interface, load): (&LoadColumns, &[f64; LOAD_COMPONENTS])| -> f64 {
                load.iter().enumerate().map(|(a, f)| of_interface.columns[(i, a)] * f).sum()
            };
            self.loads.iter().zip(state.loads).map(one).sum()
        };
        let value = |i: usize| {
            let of_modes: f64 = q.iter().enumerate().map(|(j, q)| self.modes[(i, j)] * q).sum();
            let of_spin: f64 = products.iter().enumerate().map(|(c, w)| self.spin[(i, c)] * w).sum();
            let of_named: f64 = state.named.iter().enumerate().map(|(c, a)| self.named[(i, c)] * a).sum();
            self.offset[i] + of_modes + of_loads(i) + of_named + of_spin + of_deformed(i)
        };
        (0..self.rows.len()).map(value).collect()
    }

    /// Returns the columns of the forces of a kind; `None` if the recovery does not have them.
    pub fn of_motion(&self, load: MotionLoad) -> Option<&Mat<f64>> {
        self.motion.iter().find(|one| one.load == load).map(|one| &one.columns)
    }

    /// Returns true if no row changes with a rigid motion of the body, by the quantities of the rows.
    pub fn ignores_rigid_motion(&self) -> bool {
        self.rows.iter().all(|row| row.quantity.ignores_rigid_motion())
    }

    /// Returns the recovery for loads and angular velocities along the columns of `axes` (given in the present axes).
    pub(crate) fn in_axes(&self, axes: &Matrix3<f64>) -> Self {
        let coefficients = spin_along(axes);
        let spin = |i: usize, to: usize| -> f64 {
            (0..LoadKind::SPIN.len()).map(|from| self.spin[(i, from)] * coefficients[from][to]).sum()
        };
        let turned = |columns: &Mat<f64>| {
            Mat::from_fn(columns.nrows(), LOAD_COMPONENTS, |i, a| {
                let first = a / 3 * 3;
                (0..3).map(|k| columns[(i, first + k)] * axes[(k, a % 3)]).sum()
            })
        };
        let load =
            |columns: &LoadColumns| LoadColumns { columns: turned(&columns.columns), ..columns.clone() };
        Self {
            spin: Mat::from_fn(self.rows.len(), LoadKind::SPIN.len(), spin),
            loads: self.loads.iter().map(load).collect(),
            motion: self.motion.iter().map(|one| one.in_axes(axes)).collect(),
            ..self.clone()
        }
    }

    /// Removes the static columns of damping forces, for a body with other damping.
    pub fn remove_damping(&mut self) {
        self.motion.retain(|one| one.load != MotionLoad::Damping);
    }

    /// Returns the recovery in a frame that follows the rigid motion `taken` (6 x nf) of the modes. Its rows stay relative to
    /// the former frame.
    pub(super) fn without_rigid_motion(&self, taken: &Mat<f64>) -> Self {
        let turned = taken.as_ref().subrows(3, 3).to_owned();
        let of_motion = |columns: &MotionColumns| columns.with_modes(Mat::clone, Some(&turned), &self.spin);
        Self { motion: self.motion.iter().map(of_motion).collect(), ..self.clone() }
    }

    /// Returns the recovery of the modes `kept` (indices, ascending) alone.
    pub(super) fn of_modes(&self, kept: &[usize]) -> Self {
        Self {
            modes: Mat::from_fn(self.rows.len(), kept.len(), |i, j| self.modes[(i, kept[j])]),
            motion: self.motion.iter().map(|one| one.of_modes(kept)).collect(),
            ..self.clone()
        }
    }

    /// Returns the recovery after a change of the modes. Rows that rigid motion changes need a change that takes none.
    pub(super) fn with_modes(&self, change: &ModalChange) -> Self {
        let turned = change.taken().map(|taken| taken.as_ref().subrows(3, 3).to_owned());
        let combined = |rows: &Mat<f64>| change.combined(rows);
        let of_motion = |columns: &MotionColumns| columns.with_modes(combined, turned.as_ref(), &self.spin);
        Self {
            modes: change.combined(&self.modes),
            motion: self.motion.iter().map(of_motion).collect(),
            ..self.clone()
        }
    }
}
