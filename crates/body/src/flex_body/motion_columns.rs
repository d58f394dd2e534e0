//! Static columns of the forces that the deformed body exerts by its motion: damping, and the inertia of the
//! deformation (theory section 12, the terms of higher order).
//!
//! With S_k v = e_k x v at every node these nodal forces are
//!
//! ```text
//! - D Psi qd - M Psi qdd - sum_k M S_k Psi (alpha_k q + 2 w_k qd) - sum_{k <= l} M C_kl Psi w_k w_l q
//! ```
//!
//! with the angular acceleration alpha, C_kk = S_k S_k and C_kl = S_k S_l + S_l S_k. The rows of a recovery in their static
//! responses outside the modes are columns beside those of loads and spin.

use super::{LoadKind, UnitLoad};
use crate::invariants::{Invariants, TermGroups};
use faer::Mat;
use flexbody_linalg::side_by_side;
use nalgebra::{Matrix3, Vector3};

/// Kind of a force that the deformed body exerts by its motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum MotionLoad {
    /// Damping forces -D psi_j per unit of qd_j, of a damping matrix or of Rayleigh damping.
    Damping,
    /// Inertia forces -M psi_j per unit of qdd_j.
    Acceleration,
    /// Inertia forces -M S_k psi_j per unit of alpha_k q_j + 2 w_k qd_j.
    Turning,
    /// Centrifugal forces -M C_kl psi_j per unit of w_k w_l q_j.
    Centrifugal,
}

/// Motion that the forces of [`MotionLoad`] belong to. Vectors are along the axes of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModalMotion<'a> {
    /// Modal coordinates (nf).
    pub q: &'a [f64],
    /// First time derivative of the modal coordinates (nf); empty for zero.
    pub rate: &'a [f64],
    /// Second time derivative of the modal coordinates (nf); empty for zero.
    pub acceleration: &'a [f64],
    /// Angular velocity of the frame. Unit: 1/time.
    pub angular_velocity: Vector3<f64>,
    /// Angular acceleration of the frame. Unit: 1/time^2.
    pub angular_acceleration: Vector3<f64>,
}

impl<'a> ModalMotion<'a> {
    /// Creates the motion of a body that turns and does not vibrate.
    pub fn steady(q: &'a [f64], angular_velocity: Vector3<f64>) -> Self {
        Self { q, rate: &[], acceleration: &[], angular_velocity, angular_acceleration: Vector3::zeros() }
    }
}

impl MotionLoad {
    /// All kinds, in the order of files.
    pub const ALL: &'static [Self] = <Self as strum::VariantArray>::VARIANTS;

    /// Kinds of the inertia of the deformation.
    pub const INERTIA: [Self; 3] = [Self::Acceleration, Self::Turning, Self::Centrifugal];

    /// Returns the name in files.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the forces in words, for messages.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Damping => "damping forces",
            Self::Acceleration => "inertia forces of vibration",
            Self::Turning => "inertia forces of the deformed body that turns",
            Self::Centrifugal => "centrifugal forces of the deformation",
        }
    }

    /// Returns the number of forces of each mode.
    pub fn components(self) -> usize {
        match self {
            Self::Damping | Self::Acceleration => 1,
            Self::Turning => 3,
            Self::Centrifugal => LoadKind::SPIN.len(),
        }
    }

    /// Returns the components that forces of a body with `dimension` directions have: a plane body turns about z alone.
    pub fn of_dimension(self, dimension: usize) -> &'static [usize] {
        match (self, dimension) {
            (Self::Damping | Self::Acceleration, _) => &[0],
            (Self::Turning, 2) => &[2],
            (Self::Turning, _) => &[0, 1, 2],
            (Self::Centrifugal, _) => LoadKind::Spin.of_dimension(dimension),
        }
    }

    /// Returns the name of the force of `mode` (counted from 0) in messages and in steps of an FE program, such as
    /// `turning x of mode 3`.
    pub fn step(self, component: usize, mode: usize) -> String {
        const AXES: [&str; 3] = ["x", "y", "z"];
        let axes = match self {
            Self::Damping | Self::Acceleration => String::new(),
            Self::Turning => format!(" {}", AXES[component]),
            Self::Centrifugal => {
                let (k, l) = LoadKind::SPIN[component];
                format!(" {}{}", AXES[k], AXES[l])
            }
        };
        format!("{}{axes} of mode {}", self.name(), mode + 1)
    }

    /// Writes the amplitudes of the forces to `to` (components x nf): those of all modes for each component.
    pub fn write_amplitudes(self, motion: &ModalMotion<'_>, to: &mut [f64]) {
        let nf = motion.q.len();
        for (at, to) in to.iter_mut().enumerate() {
            *to = self.amplitude(motion, at / nf, at % nf);
        }
    }

    /// Returns the amplitude of the force of one mode (counted from 0).
    pub fn amplitude(self, motion: &ModalMotion<'_>, component: usize, mode: usize) -> f64 {
        let ModalMotion { q, rate, acceleration, angular_velocity: w, angular_acceleration: alpha } = *motion;
        let of_mode = |all: &[f64]| all.get(mode).copied().unwrap_or(0.0);
        match self {
            Self::Damping => of_mode(rate),
            Self::Acceleration => of_mode(acceleration),
            Self::Turning => alpha[component] * q[mode] + 2.0 * w[component] * of_mode(rate),
            Self::Centrifugal => {
                let (k, l) = LoadKind::SPIN[component];
                w[k] * w[l] * q[mode]
            }
        }
    }

    /// Returns the coefficients of each old component in all new ones, for vectors along the columns of `axes`.
    fn along(self, axes: &Matrix3<f64>) -> Vec<Vec<f64>> {
        match self {
            Self::Damping | Self::Acceleration => vec![vec![1.0]],
            Self::Turning => axes.row_iter().map(|row| row.iter().copied().collect()).collect(),
            Self::Centrifugal => spin_along(axes),
        }
    }
}

/// Columns of the forces of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionColumns {
    /// Kind of the forces.
    pub load: MotionLoad,
    /// R G_r f (rows x components nf), along body axes: the columns of all modes for each component. Modes of a body
    /// without the group that holds their response (W3 for turning, W2 for centrifugal forces) do not respond; the columns
    /// then hold R G f.
    pub columns: Mat<f64>,
}

impl MotionColumns {
    /// Returns the columns for vectors along the columns of `axes`.
    pub(super) fn in_axes(&self, axes: &Matrix3<f64>) -> Self {
        let (components, nf) = (self.load.components(), self.modes());
        let coefficients = self.load.along(axes);
        let entry = |i: usize, at: usize| -> f64 {
            let (to, j) = (at / nf, at % nf);
            (0..components).map(|from| coefficients[from][to] * self.columns[(i, from * nf + j)]).sum()
        };
        Self { columns: Mat::from_fn(self.columns.nrows(), components * nf, entry), ..*self }
    }

    /// Returns the columns of the modes (Psi - R A) X, with the rotations `turned` (3 x nf) of the rigid motions A.
    ///
    /// * `spin`: columns of the centrifugal loads on the undeformed body, of which those of rigid rotations consist.
    pub(super) fn with_modes(
        &self,
        combined: impl Fn(&Mat<f64>) -> Mat<f64>,
        turned: Option<&Mat<f64>>,
        spin: &Mat<f64>,
    ) -> Self {
        let (components, nf) = (self.load.components(), self.modes());
        let part = |component: usize| {
            let mut own = self.columns.as_ref().subcols(component * nf, nf).to_owned();
            for l in 0..3 {
                let (Some(turned), Some(load)) = (turned, self.load.of_rotation(component, l)) else {
                    continue;
                };
                let column: Vec<f64> = (0..own.nrows())
                    .map(|i| load.iter().enumerate().map(|(c, factor)| spin[(i, c)] * factor).sum())
                    .collect();
                for j in 0..nf {
                    (0..own.nrows()).for_each(|i| own[(i, j)] -= turned[(l, j)] * column[i]);
                }
            }
            combined(&own)
        };
        let parts: Vec<Mat<f64>> = (0..components).map(part).collect();
        let parts: Vec<_> = parts.iter().map(Mat::as_ref).collect();
        Self { columns: side_by_side(&parts), ..*self }
    }

    /// Returns the columns of the modes `kept` alone.
    pub(super) fn of_modes(&self, kept: &[usize]) -> Self {
        let nf = self.modes();
        let entry = |i: usize, at: usize| self.columns[(i, at / kept.len() * nf + kept[at % kept.len()])];
        let count = self.load.components() * kept.len();
        Self { columns: Mat::from_fn(self.columns.nrows(), count, entry), ..*self }
    }

    fn modes(&self) -> usize {
        self.columns.ncols() / self.load.components()
    }
}

impl MotionLoad {
    /// Returns the centrifugal loads of the undeformed body, in the order of [`LoadKind::SPIN`], that the forces of a
    /// rotation about axis `l` in place of a mode consist of, beside forces M B x of rigid motions, which have no static
    /// response; `None` where there is nothing else.
    fn of_rotation(self, component: usize, l: usize) -> Option<[f64; 6]> {
        match self {
            Self::Damping | Self::Acceleration => None,
            Self::Turning => Some(spin_amplitudes(&(turning(component) * turning(l)))),
            Self::Centrifugal => Some(spin_amplitudes(&(spin_matrix(component) * turning(l)))),
        }
    }
}

/// Returns the coefficients of each product of the angular velocity, in the order of [`LoadKind::SPIN`], in the products of
/// its components along the columns of `axes`.
pub(super) fn spin_along(axes: &Matrix3<f64>) -> Vec<Vec<f64>> {
    let product = |component| UnitLoad { kind: LoadKind::Spin, component }.along(axes);
    (0..LoadKind::SPIN.len()).map(product).collect()
}

/// Returns S_k, the matrix of the cross product with e_k.
fn turning(k: usize) -> Matrix3<f64> {
    Vector3::ith(k, 1.0).cross_matrix()
}

/// Returns C_kl of the component (k, l) of the spin.
fn spin_matrix(component: usize) -> Matrix3<f64> {
    let (k, l) = LoadKind::SPIN[component];
    let product = turning(k) * turning(l);
    if k == l { product } else { product + turning(l) * turning(k) }
}

/// Returns the factors a_kl of the symmetric part of B = sum_{k <= l} a_kl C_kl: a_kl = B_kl + B_lk over two, and a_kk =
/// B_kk - tr(B) / 2, since C_kk = e_k e_k' - I.
fn spin_amplitudes(b: &Matrix3<f64>) -> [f64; 6] {
    LoadKind::SPIN.map(
        |(k, l)| {
            if k == l { b[(k, k)] - 0.5 * b.trace() } else { 0.5 * (b[(k, l)] + b[(l, k)]) }
        },
    )
}

/// Modal loads Psi_m'f (nf x components nf) of the forces of one kind, in modes Psi_m = Psi - R A without rigid motion;
/// `None` if the modes do not respond to it.
///
/// * `taken`: A (6 x nf), rigid motions about the origin of the frame.
/// * `damping`: damping of the modes.
pub(super) fn modal_forces(
    load: MotionLoad,
    invariants: &Invariants,
    damping: &Mat<f64>,
    taken: &Mat<f64>,
) -> Option<Mat<f64>> {
    let nf = invariants.n_modes();
    match load {
        MotionLoad::Damping => Some(Mat::from_fn(nf, nf, |i, j| -damping[(i, j)])),
        MotionLoad::Acceleration => {
            let mass = invariants.mass_matrix();
            let of_rigid =
                |i: usize, j: usize| -> f64 { (0..6).map(|a| taken[(a, i)] * mass[(a, 6 + j)]).sum() };
            Some(Mat::from_fn(nf, nf, |i, j| of_rigid(i, j) - mass[(6 + i, 6 + j)]))
        }
        // psi_i'M S_k psi_j is an entry of W3.
        MotionLoad::Turning => {
            let w3 = invariants.w3()?;
            let entry = |i: usize, at: usize| {
                let rigid = rigid_products(invariants, &turning(at / nf), at % nf);
                -w3[(at, i)] + (0..6).map(|a| taken[(a, i)] * rigid[a]).sum::<f64>()
            };
            Some(Mat::from_fn(nf, 3 * nf, entry))
        }
        // -psi_i'M S_k S_l psi_j = (S_k psi_i)'M (S_l psi_j) is an entry of W2.
        MotionLoad::Centrifugal => {
            let w2 = invariants.w2()?;
            let entry = |i: usize, at: usize| {
                let ((k, l), j) = (LoadKind::SPIN[at / nf], at % nf);
                let own = w2[(k * nf + i, l * nf + j)];
                let other = if k == l { 0.0 } else { w2[(l * nf + i, k * nf + j)] };
                let rigid = rigid_products(invariants, &spin_matrix(at / nf), j);
                own + other + (0..6).map(|a| taken[(a, i)] * rigid[a]).sum::<f64>()
            };
            Some(Mat::from_fn(nf, LoadKind::SPIN.len() * nf, entry))
        }
    }
}

/// Returns R'M B psi_j for the six rigid motions R about the origin of the frame, and B psi_j at every node.
fn rigid_products(invariants: &Invariants, b: &Matrix3<f64>, j: usize) -> [f64; 6] {
    let c1 = Vector3::from_fn(|k, _| invariants.c1()[(k, j)]);
    let ibar = invariants.ibar_or_half_c2();
    // x'A psi_j summed over the mass, for any A.
    let weighed = |a: &Matrix3<f64>| -> f64 {
        (0..3).flat_map(|k| (0..3).map(move |l| (k, l))).map(|(k, l)| a[(k, l)] * ibar[k][l][j]).sum()
    };
    let shift = b * c1;
    std::array::from_fn(|a| match a.checked_sub(3) {
        None => shift[a],
        Some(k) => weighed(&(turning(k).transpose() * b)),
    })
}

/// Returns true if the modes of a body with `groups` respond to the forces of a kind.
pub fn modes_respond(load: MotionLoad, groups: TermGroups) -> bool {
    match load {
        MotionLoad::Damping | MotionLoad::Acceleration => true,
        MotionLoad::Turning => groups.w3,
        MotionLoad::Centrifugal => groups.w2,
    }
}
