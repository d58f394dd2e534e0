//! Stiffness of inertia: the terms of the kinetic energy that nodes with rotational mass add in second order of
//! their rotations (theory section 6).
//!
//! A director e_a of a node that turns by theta in mode j and by phi in mode k moves, in second order, by
//! u_jk = 1/2 [theta x (phi x e_a) + phi x (theta x e_a)]. With g_a the row of a director in E times a rigid motion
//! of the whole body, the stiffness of that motion is
//!
//! ```text
//! K_jk = sum over the directors g_a . u_jk = sum over the nodes theta' H phi,
//! H    = sym(G) - tr(G) I,   G = sum_a e_a g_a'
//! ```
//!
//! with g_a = h_a e_k for the acceleration along e_k, e_k x z_a for the angular acceleration about e_k and
//! e_k x (e_l x z_a) (k = l, else both orders added) for the spin w_k w_l, of the moments h_a and z_a of the node.

use super::Invariants;
use faer::{Mat, MatRef};
use flexbody_linalg::{combine, gram, symmetric_eigen, zeros};
use flexbody_model::{GeometricStiffness, LoadKind, NodeMoments, RigidAcceleration, UnitLoad};
use nalgebra::{Matrix3, Vector3};

/// Stiffness of inertia of a body and the moments of the nodes that determine it. It belongs to the kinetic
/// energy (theory sections 6 and 7.4), not to a stress state.
#[derive(Debug, Clone, PartialEq)]
pub struct InertiaStiffness {
    /// Moments of every node of the body about the origin of its frame, body axes; zero for nodes whose
    /// rotations carry no mass.
    pub moments: Vec<NodeMoments>,
    /// K^a, K^alpha and K^omega (nf x nf, symmetric) for the loads of [`InertiaStiffness::loads`], in that order.
    pub stiffness: Vec<GeometricStiffness<Mat<f64>>>,
}

impl InertiaStiffness {
    /// Computes the stiffnesses from the moments of the nodes.
    ///
    /// * `rotation`: rotations of the nodes in the modes (3n x nf), along the axes of the moments.
    /// * `dimension`: 3, or 2 for a body in the plane.
    ///
    /// # Panics
    /// When `rotation` does not have three rows for each of the moments.
    pub fn new(moments: Vec<NodeMoments>, rotation: MatRef<'_, f64>, dimension: usize) -> Self {
        assert_eq!(rotation.nrows(), 3 * moments.len(), "three rotations for every node");
        let turning = TurningNodes::new(&moments, rotation);
        let of_load = |load: UnitLoad| {
            let matrix = turning.sum(|moments| moments.of(&motion_of(&load)));
            GeometricStiffness { load, matrix }
        };
        let stiffness = Self::loads(dimension).map(of_load).collect();
        Self { moments, stiffness }
    }

    /// Returns the unit loads with a stiffness of inertia: acceleration of the origin minus gravity,
    /// angular acceleration and products of spin, along the axes of the frame.
    pub fn loads(dimension: usize) -> impl Iterator<Item = UnitLoad> {
        [LoadKind::Acceleration, LoadKind::AngularAcceleration, LoadKind::Spin].into_iter().flat_map(
            move |kind| {
                let components = kind.of_dimension(dimension).iter();
                components.map(move |&component| UnitLoad { kind: kind.clone(), component })
            },
        )
    }

    /// Returns the stiffnesses about the origin `d` and along the columns of `axes`, both given in the
    /// present frame.
    ///
    /// z_a' = z_a - h_a d, then every directional index is turned. `rotation` (3n x nf) is along the new
    /// axes.
    ///
    /// # Panics
    /// When `rotation` does not have three rows for each of the moments.
    pub fn in_frame(
        &self,
        d: &Vector3<f64>,
        axes: &Matrix3<f64>,
        rotation: MatRef<'_, f64>,
        dimension: usize,
    ) -> Self {
        let moved = |node: &NodeMoments| NodeMoments {
            first: axes.tr_mul(&node.first),
            second: axes.transpose() * (node.second - node.first * d.transpose()) * axes,
        };
        Self::new(self.moments.iter().map(moved).collect(), rotation, dimension)
    }

    /// Returns the stiffnesses for other rotations of the nodes (3n x nf): for other modes, or relative to
    /// another frame with the undeformed origin and axes of the present one.
    ///
    /// # Panics
    /// When `rotation` does not have three rows for each of the moments.
    pub fn with_rotations(&self, rotation: MatRef<'_, f64>, dimension: usize) -> Self {
        Self::new(self.moments.clone(), rotation, dimension)
    }

    /// Returns the largest difference between the stored stiffnesses and those recomputed from the moments
    /// and rotations of the nodes. The difference is relative to the largest sum of magnitudes for that
    /// kind of load, since contributions of nodes that turn in opposite directions may cancel.
    ///
    /// # Panics
    /// When `rotation` does not have three rows for each of the moments.
    pub fn deviation(&self, rotation: MatRef<'_, f64>, dimension: usize) -> f64 {
        let expected = self.with_rotations(rotation, dimension);
        let magnitudes = Mat::from_fn(rotation.nrows(), rotation.ncols(), |i, j| rotation[(i, j)].abs());
        let turning = TurningNodes::new(&self.moments, magnitudes.as_ref());
        let size = |load: &UnitLoad| turning.sum(|moments| moments.of(&motion_of(load)).abs()).norm_max();
        let largest = |kind: &LoadKind| {
            let loads = Self::loads(dimension).filter(|load| load.kind == *kind);
            loads.map(|load| size(&load)).fold(0.0, f64::max)
        };
        self.difference_of_stiffness(&expected, &largest)
    }

    /// Returns the largest difference of moments and stiffnesses from `other`, relative to the largest
    /// entry of that kind; infinite if the sizes differ.
    pub fn largest_difference(&self, other: &Self) -> f64 {
        if self.moments.len() != other.moments.len() || self.stiffness.len() != other.stiffness.len() {
            return f64::INFINITY;
        }
        let relative = |entries: &dyn Fn(&NodeMoments) -> Vec<f64>| {
            let pairs = self.moments.iter().zip(&other.moments);
            let pairs = pairs.flat_map(|(a, b)| entries(a).into_iter().zip(entries(b)));
            let (mut difference, mut size) = (0.0f64, 0.0f64);
            pairs.for_each(|(a, b)| (difference, size) = (difference.max((a - b).abs()), size.max(a.abs())));
            if difference == 0.0 { 0.0 } else { difference / size }
        };
        let first = relative(&|node| node.first.iter().copied().collect());
        let second = relative(&|node| node.second.iter().copied().collect());
        let size = |kind: &LoadKind| {
            let of_kind = self.stiffness.iter().filter(|stiffness| stiffness.load.kind == *kind);
            of_kind.map(|stiffness| stiffness.matrix.norm_max()).fold(0.0, f64::max)
        };
        first.max(second).max(self.difference_of_stiffness(other, &size))
    }

    /// Returns the largest difference of the stiffnesses, relative to the `size` of their kind of load.
    fn difference_of_stiffness(&self, other: &Self, size: &dyn Fn(&LoadKind) -> f64) -> f64 {
        let differences = self.stiffness.iter().zip(&other.stiffness).map(|(one, other)| {
            if one.matrix.nrows() != other.matrix.nrows() {
                return f64::INFINITY;
            }
            let difference = (&one.matrix - &other.matrix).norm_max();
            if difference == 0.0 { 0.0 } else { difference / size(&one.load.kind) }
        });
        differences.fold(0.0, f64::max)
    }
}

/// Largest ratios of a stiffness that motion causes (of inertia, of other terms of the kinetic energy) to the
/// stiffness K_ff, over all deformations and load directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InertiaShares {
    /// Ratio for a unit acceleration of the origin. Unit: time^2/length.
    pub acceleration: f64,
    /// Ratio for a unit angular acceleration. Unit: time^2.
    pub angular_acceleration: f64,
    /// Ratio for the square of a unit spin. Unit: time^2.
    pub spin_squared: f64,
}

impl InertiaStiffness {
    /// Returns upper bounds, over all directions of a unit load, of the ratio of the stiffness of inertia
    /// to the stiffness K_ff of any deformation. Returns `None` if K_ff is not positive definite.
    pub fn shares(&self, modal_stiffness: MatRef<'_, f64>) -> Option<InertiaShares> {
        InertiaShares::of(&self.stiffness, modal_stiffness)
    }
}

impl InertiaShares {
    /// Returns upper bounds, over all directions of a unit load, of the ratio of the stiffnesses `stiffness` of unit
    /// motions to the stiffness K_ff of any deformation. Returns `None` if K_ff is not positive definite.
    pub fn of(stiffness: &[GeometricStiffness<Mat<f64>>], modal_stiffness: MatRef<'_, f64>) -> Option<Self> {
        let of_kind = |kind: LoadKind| {
            let of_kind = stiffness.iter().filter(|stiffness| stiffness.load.kind == kind);
            // w'K w contains both orders of a pair of axes, and the stored matrix is their sum.
            let matrices: Vec<Mat<f64>> = of_kind
                .map(|stiffness| match (&kind, stiffness.load.component) {
                    (LoadKind::Spin, 3..) => &stiffness.matrix * faer::Scale(0.5f64.sqrt()),
                    _ => stiffness.matrix.clone(),
                })
                .collect();
            let matrices: Vec<_> = matrices.iter().map(Mat::as_ref).collect();
            largest_relative_norm(&matrices, modal_stiffness)
        };
        Some(Self {
            acceleration: of_kind(LoadKind::Acceleration)?,
            angular_acceleration: of_kind(LoadKind::AngularAcceleration)?,
            spin_squared: of_kind(LoadKind::Spin)?,
        })
    }
}

/// Nodes with moments, and their rotations in the modes.
struct TurningNodes<'m> {
    moments: Vec<&'m NodeMoments>,
    /// Rotations, three rows per node.
    theta: Mat<f64>,
}

impl<'m> TurningNodes<'m> {
    fn new(moments: &'m [NodeMoments], rotation: MatRef<'_, f64>) -> Self {
        let turning: Vec<usize> = (0..moments.len()).filter(|&node| !is_zero(&moments[node])).collect();
        let theta = Mat::from_fn(3 * turning.len(), rotation.ncols(), |row, j| {
            rotation[(3 * turning[row / 3] + row % 3, j)]
        });
        Self { moments: turning.iter().map(|&node| &moments[node]).collect(), theta }
    }

    /// Returns the sum over the nodes of theta' H theta, symmetric.
    fn sum(&self, h: impl Fn(&NodeMoments) -> Matrix3<f64>) -> Mat<f64> {
        let theta = &self.theta;
        let mut turned = zeros(theta.nrows(), theta.ncols());
        for (at, moments) in self.moments.iter().enumerate() {
            let h = h(moments);
            for j in 0..theta.ncols() {
                let product = h * Vector3::from_fn(|k, _| theta[(3 * at + k, j)]);
                (0..3).for_each(|k| turned[(3 * at + k, j)] = product[k]);
            }
        }
        let k = gram(theta.as_ref(), turned.as_ref());
        Mat::from_fn(k.nrows(), k.ncols(), |i, j| 0.5 * (k[(i, j)] + k[(j, i)]))
    }
}

fn is_zero(moments: &NodeMoments) -> bool {
    moments.first == Vector3::zeros() && moments.second == Matrix3::zeros()
}

/// Returns the rigid motion of a unit load.
fn motion_of(load: &UnitLoad) -> RigidAcceleration {
    let unit = |axis: usize| Vector3::ith(axis, 1.0);
    let (zero, none) = (Vector3::zeros(), Matrix3::zeros());
    match load.kind {
        LoadKind::Acceleration => {
            RigidAcceleration { linear: unit(load.component), angular: zero, spin: none }
        }
        LoadKind::AngularAcceleration => {
            RigidAcceleration { linear: zero, angular: unit(load.component), spin: none }
        }
        LoadKind::Spin => {
            let (k, l) = LoadKind::SPIN[load.component];
            let product = unit(k) * unit(l).transpose();
            let spin = if k == l { product } else { product + product.transpose() };
            RigidAcceleration { linear: zero, angular: zero, spin }
        }
        LoadKind::Force(_) | LoadKind::Moment(_) | LoadKind::Named(_) => {
            RigidAcceleration { linear: zero, angular: zero, spin: none }
        }
    }
}

// Softening by the centrifugal term, which tells if geometric stiffness is needed (theory section 7).

/// Returns the largest |kappa| of A v = kappa K v for symmetric A and K (nf x nf), K positive definite: the
/// largest relative change of the stiffness of any motion by a unit of A. Returns `None` if K is not
/// positive definite or entries are not finite.
pub fn relative_norm(a: MatRef<'_, f64>, k: MatRef<'_, f64>) -> Option<f64> {
    let projected = relative_to(&[a], k)?.pop()?;
    symmetric_eigen(projected.as_ref())?.values.into_iter().map(f64::abs).reduce(f64::max)
}

/// Returns an upper bound of |kappa| in A v = kappa K v for A = sum_i a_i A_i and every a of unit length:
/// the root of the largest eigenvalue of the sum of the squares of the A_i relative to K. The bound is
/// equal in all axes. Returns `None` in the cases of [`relative_norm`].
fn largest_relative_norm(all: &[MatRef<'_, f64>], k: MatRef<'_, f64>) -> Option<f64> {
    let n = k.nrows();
    let squares = relative_to(all, k)?;
    let sum = squares.iter().fold(Mat::zeros(n, n), |sum: Mat<f64>, a| sum + gram(a.as_ref(), a.as_ref()));
    Some(symmetric_eigen(sum.as_ref())?.values.into_iter().fold(0.0, f64::max).sqrt())
}

/// Returns K^-1/2 A K^-1/2 of every A, up to one common rotation.
fn relative_to(all: &[MatRef<'_, f64>], k: MatRef<'_, f64>) -> Option<Vec<Mat<f64>>> {
    let root = inverse_root(k)?;
    let projected = |a: &MatRef<'_, f64>| gram(root.as_ref(), combine(*a, root.as_ref()).as_ref());
    Some(all.iter().map(projected).collect())
}

/// Returns X with X'K X = 1; `None` if K is not positive definite.
fn inverse_root(k: MatRef<'_, f64>) -> Option<Mat<f64>> {
    let n = k.nrows();
    // Scale to a unit diagonal first: stiffnesses of modes spread over many orders of magnitude.
    let size: Vec<f64> = (0..n).map(|i| k[(i, i)].sqrt().recip()).collect();
    let scaled = Mat::from_fn(n, n, |i, j| k[(i, j)] * size[i] * size[j]);
    let eigen = symmetric_eigen(scaled.as_ref())?;
    if eigen.values.first().is_some_and(|v| *v <= 0.0) {
        return None;
    }
    Some(Mat::from_fn(n, n, |i, j| size[i] * eigen.vectors[(i, j)] / eigen.values[j].sqrt()))
}

impl Invariants {
    /// Returns the largest part mu of the stiffness of any motion lost to the centrifugal term at the
    /// angular velocity w, the largest eigenvalue of (sum_ab w_a w_b (W2)_ab) v = mu K_ff v, and v with
    /// v'K_ff v = 1. Returns `None` if K_ff is not positive definite, or if the body does not hold W2.
    ///
    /// * `of_inertia`: stiffness of inertia at this angular velocity, if the body has it; it belongs to the
    ///   same term.
    ///
    /// # Panics
    /// When a matrix has another size.
    pub fn softening(&self, omega: &Vector3<f64>, of_inertia: Option<&Mat<f64>>) -> Option<(f64, Vec<f64>)> {
        let (nf, w2) = (self.n_modes(), self.w2()?);
        let mut term = of_inertia.map_or_else(|| Mat::zeros(nf, nf), |stiffness| -stiffness);
        for a in 0..3 {
            for b in 0..3 {
                let block = w2.as_ref().submatrix(a * nf, b * nf, nf, nf);
                let weight = 0.5 * omega[a] * omega[b];
                term += Mat::from_fn(nf, nf, |i, j| weight * (block[(i, j)] + block[(j, i)]));
            }
        }
        let root = inverse_root(self.0.modal_stiffness.as_ref())?;
        let projected = gram(root.as_ref(), combine(term.as_ref(), root.as_ref()).as_ref());
        let eigen = symmetric_eigen(projected.as_ref())?;
        let last = eigen.values.len().checked_sub(1)?;
        let softest = combine(root.as_ref(), eigen.vectors.as_ref().subcols(last, 1));
        Some((eigen.values[last].max(0.0), (0..nf).map(|i| softest[(i, 0)]).collect()))
    }
}
