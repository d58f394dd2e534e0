//! Sums of squared distances from planes and points, as functions of the position.

use nalgebra::{Matrix3, Vector3};

/// Quadratic function x'Ax - 2 b'x + c.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quadric {
    a: Matrix3<f64>,
    b: Vector3<f64>,
    c: f64,
}

impl Quadric {
    /// Returns `weight` times the squared distance from the plane through `point` with the unit normal
    /// `normal`.
    pub(super) fn plane(normal: Vector3<f64>, point: Vector3<f64>, weight: f64) -> Self {
        let distance = normal.dot(&point);
        Self {
            a: weight * normal * normal.transpose(),
            b: weight * distance * normal,
            c: weight * distance * distance,
        }
    }

    /// Returns `weight` times the squared distance from `point`.
    pub(super) fn point(point: Vector3<f64>, weight: f64) -> Self {
        Self { a: Matrix3::identity() * weight, b: weight * point, c: weight * point.norm_squared() }
    }

    /// Returns the value at `x`; negative rounding becomes zero.
    pub(super) fn at(&self, x: Vector3<f64>) -> f64 {
        (x.dot(&(self.a * x)) - 2.0 * self.b.dot(&x) + self.c).max(0.0)
    }
}

impl std::ops::AddAssign for Quadric {
    fn add_assign(&mut self, other: Self) {
        self.a += other.a;
        self.b += other.b;
        self.c += other.c;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_from_planes_and_points_add_up() {
        let mut sum = Quadric::plane(Vector3::z(), Vector3::new(5.0, 6.0, 1.0), 2.0);
        sum += Quadric::point(Vector3::x(), 3.0);
        let value = sum.at(Vector3::new(1.0, 2.0, 4.0));
        assert!((value - (2.0 * 9.0 + 3.0 * (4.0 + 16.0))).abs() < 1e-12, "{value}");
    }
}
