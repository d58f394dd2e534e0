//! Equations of motion in rates of coordinates: velocities along world axes, and any parameters of the
//! rotation.

use super::kernels::add_scaled;
use super::{EquationsOfMotion, Evaluation};
use libm::{atan2, sin, sincos};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Parameters theta (R of them) of the rotation A from body axes to world axes, with omega = G(theta)
/// theta' in body axes.
///
/// With these parameters, coordinates x = (R, theta, q) have velocities x' = (R', theta', qd), R' along
/// world axes, and
///
/// ```text
/// nu = H x',    H = blkdiag(A', G, I)
/// H'Mc H x'' + H'(Mc dH/dt x' + h_nu) + (0, 0, K_ff q + D qd) = H'(F, tau, Q)
/// ```
///
/// which is the form of theory (3.2), and of (4.2) in the plane.
pub trait Orientation<const R: usize> {
    /// Returns A, the rotation from body axes to world axes.
    fn axes(&self) -> Matrix3<f64>;

    /// Returns G (3 x R).
    fn map(&self) -> SMatrix<f64, 3, R>;

    /// Returns dG/dt theta', the part of omega' besides G theta''.
    fn drift(&self, rate: &SVector<f64, R>) -> Vector3<f64>;
}

/// Angular velocity as rate of rotation: theta' = omega, without coordinates theta.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngularVelocity {
    /// Rotation A from body axes to world axes.
    pub axes: Matrix3<f64>,
}

impl Orientation<3> for AngularVelocity {
    fn axes(&self) -> Matrix3<f64> {
        self.axes
    }

    fn map(&self) -> Matrix3<f64> {
        Matrix3::identity()
    }

    fn drift(&self, _: &Vector3<f64>) -> Vector3<f64> {
        Vector3::zeros()
    }
}

/// Euler parameters p = (p0, p1, p2, p3) with p'p = 1, p0 the cosine of half the angle.
///
/// G = 2 \[-e, p0 I - e~\] with e = (p1, p2, p3); G G' = 4 I and G'I G has rank 3: p'p'' = -p''p' is part of
/// the system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EulerParameters(pub [f64; 4]);

impl EulerParameters {
    /// Returns the parameters scaled to p'p = 1.
    pub fn normalised(&self) -> Self {
        let length = self.0.iter().map(|p| p * p).sum::<f64>().sqrt();
        Self(self.0.map(|p| p / length))
    }

    /// Returns the parameters of the rotation with these axes as columns, computed from the largest of the
    /// four (Shepperd, J. Guidance and Control 1, 1978).
    pub fn of_axes(axes: &Matrix3<f64>) -> Self {
        let a = |i: usize, j: usize| axes[(i, j)];
        let trace = axes.trace();
        // 4 p_i p_j in row i, for the row of the largest square.
        let squares = [
            1.0 + trace,
            1.0 - trace + 2.0 * a(0, 0),
            1.0 - trace + 2.0 * a(1, 1),
            1.0 - trace + 2.0 * a(2, 2),
        ];
        let skew = [a(2, 1) - a(1, 2), a(0, 2) - a(2, 0), a(1, 0) - a(0, 1)];
        let sum = |i: usize, j: usize| a(i, j) + a(j, i);
        let products = [
            [squares[0], skew[0], skew[1], skew[2]],
            [skew[0], squares[1], sum(0, 1), sum(0, 2)],
            [skew[1], sum(0, 1), squares[2], sum(1, 2)],
            [skew[2], sum(0, 2), sum(1, 2), squares[3]],
        ];
        let largest = (1..4).fold(0, |best, i| if squares[i] > squares[best] { i } else { best });
        Self(products[largest]).normalised()
    }

    /// Returns p' = G'omega / 4.
    pub fn rate(&self, omega: &Vector3<f64>) -> [f64; 4] {
        (self.map().tr_mul(omega) * 0.25).into()
    }
}

impl From<EulerParameters> for RotationVector {
    /// Returns the shortest rotation vector: 2 e / |e| atan2(|e|, p0) with p0 >= 0.
    fn from(EulerParameters([p0, p1, p2, p3]): EulerParameters) -> Self {
        let sign = if p0 < 0.0 { -1.0 } else { 1.0 };
        let e = Vector3::new(p1, p2, p3) * sign;
        let sin = e.norm();
        let angle = 2.0 * atan2(sin, sign * p0);
        Self(if sin > 0.0 { e * (angle / sin) } else { e * 2.0 })
    }
}

impl From<RotationVector> for EulerParameters {
    /// Returns (cos f/2, v/f sin f/2) with f = |v|.
    fn from(RotationVector(vector): RotationVector) -> Self {
        let angle = vector.norm();
        let (sin, cos) = sincos(0.5 * angle);
        let e = if angle > 0.0 { vector * (sin / angle) } else { Vector3::zeros() };
        Self([cos, e.x, e.y, e.z])
    }
}

impl Orientation<4> for EulerParameters {
    fn axes(&self) -> Matrix3<f64> {
        let [p0, p1, p2, p3] = self.0;
        let e = Vector3::new(p1, p2, p3);
        Matrix3::identity() * (p0 * p0 - e.norm_squared())
            + e * e.transpose() * 2.0
            + e.cross_matrix() * (2.0 * p0)
    }

    fn map(&self) -> SMatrix<f64, 3, 4> {
        let [p0, p1, p2, p3] = self.0;
        SMatrix::<f64, 3, 4>::new(-p1, p0, p3, -p2, -p2, -p3, p0, p1, -p3, p2, -p1, p0) * 2.0
    }

    /// Returns zero: G is linear in p and G(p') p' = 0.
    fn drift(&self, _: &SVector<f64, 4>) -> Vector3<f64> {
        Vector3::zeros()
    }
}

/// Rotation vector v: a rotation by the angle |v| about v.
///
/// A = I + sin f / f v~ + (1 - cos f) / f^2 v~^2 and G = I - (1 - cos f) / f^2 v~ + (f - sin f) / f^3 v~^2
/// with f = |v|. G is singular at f = 2 pi.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotationVector(pub Vector3<f64>);

/// Angle below which the series of [`RotationVector`] are used: the truncated terms are below rounding.
const SERIES_LIMIT: f64 = 1.0;

/// Number of terms of these series: the next term is below 1e-20 of the first.
const TERMS: u32 = 10;

impl RotationVector {
    /// Returns the shortest rotation vector of the rotation with these axes as columns.
    pub fn of_axes(axes: &Matrix3<f64>) -> Self {
        Self::from(EulerParameters::of_axes(axes))
    }

    /// Returns sin f / f, b = (1 - cos f) / f^2, c = (f - sin f) / f^3, b'/f and c'/f with b' = db/df.
    fn coefficients(&self) -> [f64; 5] {
        let square = self.0.norm_squared();
        let f = square.sqrt();
        if f < SERIES_LIMIT {
            // sum_k (-1)^k f^2k / (2k + shift)! and its derivative over f, sum_k (-1)^k 2k f^(2k-2) / (2k +
            // shift)!.
            let series = |shift: u32| {
                let mut coefficient = f64::from((1..=shift).product::<u32>()).recip();
                let (mut power, mut sum, mut slope) = (1.0, coefficient, 0.0);
                for k in 1..=TERMS {
                    coefficient /= -f64::from((2 * k + shift - 1) * (2 * k + shift));
                    slope += f64::from(2 * k) * coefficient * power;
                    power *= square;
                    sum += coefficient * power;
                }
                (sum, slope)
            };
            let ((a, _), (b, b_slope), (c, c_slope)) = (series(1), series(2), series(3));
            return [a, b, c, b_slope, c_slope];
        }
        let (whole, half) = (sin(f), sin(0.5 * f));
        // 1 - cos without cancellation.
        let (b, c) = (2.0 * half.powi(2) / square, (f - whole) / (square * f));
        [whole / f, b, c, (whole / f - 2.0 * b) / square, (b - 3.0 * c) / square]
    }

    /// Returns d(G x)/dv for a constant x.
    pub(super) fn map_derivative(&self, x: &Vector3<f64>) -> Matrix3<f64> {
        let [_, b, c, b_slope, c_slope] = self.coefficients();
        let v = &self.0;
        let once = v.cross(x);
        let twice = v.cross(&once);
        let stretched = (twice * c_slope - once * b_slope) * v.transpose();
        stretched + x.cross_matrix() * b - (once.cross_matrix() + v.cross_matrix() * x.cross_matrix()) * c
    }
}

impl Orientation<3> for RotationVector {
    fn axes(&self) -> Matrix3<f64> {
        let [a, b, ..] = self.coefficients();
        let v = self.0.cross_matrix();
        Matrix3::identity() + v * a + v * v * b
    }

    fn map(&self) -> Matrix3<f64> {
        let [_, b, c, ..] = self.coefficients();
        let v = self.0.cross_matrix();
        Matrix3::identity() - v * b + v * v * c
    }

    fn drift(&self, rate: &Vector3<f64>) -> Vector3<f64> {
        let [_, _, c, b_slope, c_slope] = self.coefficients();
        // f' f = v'v'; v~ v' changes by v'~ v' = 0.
        let (v, stretch) = (&self.0, self.0.dot(rate));
        let once = v.cross(rate);
        let twice = v.cross(&once);
        once * (-b_slope * stretch) + twice * (c_slope * stretch) + rate.cross(&once) * c
    }
}

/// Angle of a plane body about z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneAngle(pub f64);

impl Orientation<1> for PlaneAngle {
    fn axes(&self) -> Matrix3<f64> {
        let (sin, cos) = sincos(self.0);
        Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0)
    }

    fn map(&self) -> SMatrix<f64, 3, 1> {
        Vector3::z()
    }

    fn drift(&self, _: &SVector<f64, 1>) -> Vector3<f64> {
        Vector3::zeros()
    }
}

impl EquationsOfMotion {
    /// Computes nu = H x'.
    ///
    /// * `rates`: x' = (R', theta', qd), 3 + R + nf entries, for a plane body 2 + R + nf.
    /// * `nu`: 6 + nf entries, for a plane body 3 + nf.
    ///
    /// # Panics
    /// When a length differs.
    pub fn velocities<const R: usize>(
        &self,
        orientation: &impl Orientation<R>,
        rates: &[f64],
        nu: &mut [f64],
    ) {
        let (linear, theta, modal) = self.split_rates::<R>(rates);
        assert_eq!(nu.len(), self.n_velocities(), "one entry per rigid motion and mode");
        let (rigid, flexible) = nu.split_at_mut(self.rigid.len());
        let omega = orientation.map() * theta;
        self.put_rigid(orientation.axes().tr_mul(&linear), omega, rigid);
        flexible.copy_from_slice(modal);
    }

    /// Computes H'f, the generalised forces of (R', theta', qd) from those of nu.
    ///
    /// # Panics
    /// When a length is not that of [`EquationsOfMotion::velocities`].
    pub fn forces<const R: usize>(
        &self,
        orientation: &impl Orientation<R>,
        of_nu: &[f64],
        forces: &mut [f64],
    ) {
        let d = self.translations();
        assert_eq!(forces.len(), d + R + self.nf, "one entry per coordinate");
        let (force, torque, modal) = self.split(of_nu);
        let (force, torque) = (orientation.axes() * force, orientation.map().tr_mul(&torque));
        forces[..d].copy_from_slice(&force.as_slice()[..d]);
        forces[d..d + R].copy_from_slice(torque.as_slice());
        forces[d + R..].copy_from_slice(modal);
    }

    fn split_rates<'v, const R: usize>(
        &self,
        rates: &'v [f64],
    ) -> (Vector3<f64>, SVector<f64, R>, &'v [f64]) {
        let d = self.translations();
        assert_eq!(rates.len(), d + R + self.nf, "one entry per coordinate");
        let mut linear = Vector3::zeros();
        linear.as_mut_slice()[..d].copy_from_slice(&rates[..d]);
        (linear, SVector::from_column_slice(&rates[d..d + R]), &rates[d + R..])
    }
}

impl Evaluation<'_> {
    /// Computes H'Mc H of (R'', theta'', qdd), row-major: (3 + R + nf) squared, for a plane body (2 + R +
    /// nf) squared.
    ///
    /// # Panics
    /// When `matrix` has another length.
    pub fn mass_matrix_of<const R: usize>(&self, orientation: &impl Orientation<R>, matrix: &mut [f64]) {
        let body = self.equations();
        let (d, nf) = (body.translations(), body.nf);
        let n = d + R + nf;
        assert_eq!(matrix.len(), n * n, "a square matrix");
        let (axes, map) = (orientation.axes(), orientation.map());
        let turned = axes * self.lever * map;
        let inertia = map.tr_mul(&(self.inertia() * map));
        // Compute the upper triangle and mirror it, so that the matrix is exactly symmetric.
        let upper = |i: usize, j: usize| match (i < d, j < d) {
            (true, true) => body.mass * f64::from(i == j),
            (true, false) => turned[(i, j - d)],
            _ => inertia[(i - d, j - d)],
        };
        for i in 0..d + R {
            (0..d + R).for_each(|j| matrix[i * n + j] = upper(i.min(j), i.max(j)));
        }
        for j in 0..nf {
            let part =
                |first: usize| Vector3::from_fn(|k, _| body.coupling_row(&self.coupling, first + k)[j]);
            let (linear, angular) = (axes * part(0), map.tr_mul(&part(3)));
            for i in 0..d + R {
                let value = if i < d { linear[i] } else { angular[i - d] };
                matrix[i * n + d + R + j] = value;
                matrix[(d + R + j) * n + i] = value;
            }
            for i in 0..nf {
                matrix[(d + R + i) * n + d + R + j] = body.modal_mass.get(i, j);
            }
        }
    }

    /// Computes H'(Mc dH/dt x' + h_nu), the velocity forces that belong to [`Evaluation::mass_matrix_of`],
    /// without elastic and damping forces.
    ///
    /// * `rate`: theta' of the state.
    /// * `forces`: 3 + R + nf entries, for a plane body 2 + R + nf.
    ///
    /// # Panics
    /// When `forces` has another length.
    pub fn velocity_forces_of<const R: usize>(
        &self,
        orientation: &impl Orientation<R>,
        rate: &SVector<f64, R>,
        forces: &mut [f64],
    ) {
        let body = self.equations();
        let d = body.translations();
        body.forces(orientation, &self.velocity_forces, forces);
        // V' = A'R'' - omega x V.
        let (linear, angular) = (-self.omega.cross(&self.velocity), orientation.drift(rate));
        let force = orientation.axes() * (body.mass * linear + self.lever * angular);
        let torque = orientation.map().tr_mul(&(self.lever.tr_mul(&linear) + self.inertia() * angular));
        for (sum, value) in forces.iter_mut().zip(force.iter().take(d).chain(torque.iter())) {
            *sum += value;
        }
        let modal = &mut forces[d + R..];
        for k in 0..3 {
            add_scaled(linear[k], body.coupling_row(&self.coupling, k), modal);
            add_scaled(angular[k], body.coupling_row(&self.coupling, 3 + k), modal);
        }
    }
}
