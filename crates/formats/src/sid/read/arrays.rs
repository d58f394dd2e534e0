//! Dense arrays of the body, with the rounding of their numbers.

use super::parse::{Listed, ListedFrame};
use super::taylor::Taylor;
use crate::import::digits::Digits;
use faer::Mat;
use nalgebra::{Matrix3, Vector3};

/// An array M0 + sum_k M1_k q_k, zero if the file has no such object.
pub(crate) struct Array {
    pub(crate) m0: Mat<f64>,
    /// M1 of each mode; `None` if all are zero.
    pub(crate) m1: Option<Vec<Mat<f64>>>,
    /// Half a unit of the last digit of M0 and M1.
    pub(crate) rounding: [f64; 2],
}

impl Array {
    fn new(object: Option<&Taylor>, listed: &Listed<'_>, file: Digits, name: &str) -> Self {
        let shape = listed.shape(name);
        let Some(object) = object else {
            return Self { m0: Mat::zeros(shape.0, shape.1), m1: None, rounding: [0.0; 2] };
        };
        let (m0, m1) = (object.constant(shape), object.linear(shape, listed.nq, listed.modes));
        let sizes = [largest(&m0), m1.iter().flatten().map(largest).fold(0.0, f64::max)];
        let rounding = [0, 1].map(|at| file.rounding(sizes[at]));
        Self { m0, m1, rounding }
    }

    /// Returns an entry of M1 of a mode.
    pub(crate) fn linear(&self, k: usize, i: usize, j: usize) -> f64 {
        self.m1.as_ref().map_or(0.0, |m1| m1[k][(i, j)])
    }

    /// Returns the largest entries of M0 and M1.
    pub(crate) fn sizes(&self) -> [f64; 2] {
        [largest(&self.m0), self.m1.iter().flatten().map(largest).fold(0.0, f64::max)]
    }
}

/// Returns the largest absolute entry; the entries are never NaN.
pub(crate) fn largest(a: &Mat<f64>) -> f64 {
    a.col_iter().flat_map(|column| column.iter()).fold(0.0, |most: f64, v| most.max(v.abs()))
}

/// Arrays of the body.
pub(crate) struct Arrays {
    pub(crate) nq: usize,
    pub(crate) mass: f64,
    pub(crate) mass_rounding: f64,
    pub(crate) first_moment: Array,
    /// Inertia J in the form of the file.
    pub(crate) inertia: Array,
    pub(crate) ct: Array,
    pub(crate) cr: Array,
    pub(crate) me: Array,
    pub(crate) gr: Array,
    pub(crate) ge: Array,
    pub(crate) oe: Array,
    pub(crate) ksigma: Array,
    pub(crate) ke: Array,
    pub(crate) de: Array,
}

/// Axis pairs of the columns of Oe: w1^2, w2^2, w3^2, w1 w2, w2 w3, w1 w3.
pub(crate) const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Index into the column J: 11, 22, 33, 12, 13, 23.
const INERTIA: [[usize; 3]; 3] = [[0, 3, 4], [3, 1, 5], [4, 5, 2]];

impl Arrays {
    pub(crate) fn new(listed: &Listed<'_>, file: Digits) -> Self {
        let array = |name: &str| Array::new(listed.object(name), listed, file, name);
        Self {
            nq: listed.nq,
            mass: listed.mass,
            mass_rounding: file.rounding(listed.mass.abs()),
            first_moment: array("mdcm"),
            inertia: array("j"),
            ct: array("ct"),
            cr: array("cr"),
            me: array("me"),
            gr: array("gr"),
            ge: array("ge"),
            oe: array("oe"),
            ksigma: array("ksigma"),
            ke: array("ke"),
            de: array("de"),
        }
    }

    /// Returns J0.
    pub(crate) fn j0(&self) -> Matrix3<f64> {
        square(&self.inertia.m0)
    }

    /// Returns J1_k.
    pub(crate) fn j1(&self, k: usize) -> Matrix3<f64> {
        self.inertia.m1.as_ref().map_or_else(Matrix3::zeros, |m1| square(&m1[k]))
    }

    /// Returns row k of Cr0.
    pub(crate) fn cr0(&self, k: usize) -> Vector3<f64> {
        Vector3::from_fn(|a, _| self.cr.m0[(k, a)])
    }

    /// Returns Cr1(k, l, a) - Cr1(l, k, a), the value of Ge.
    pub(crate) fn cr1_skew(&self, k: usize, l: usize, a: usize) -> f64 {
        self.cr.linear(l, k, a) - self.cr.linear(k, l, a)
    }

    /// Returns the Cauchy-Schwarz bounds of terms linear in one mode with translation and with rotation, and
    /// of quadratic terms.
    pub(crate) fn bounds(&self) -> [f64; 3] {
        let modal = (0..self.nq).map(|k| self.me.m0[(k, k)].abs()).fold(0.0, f64::max);
        let rigid = 0.5 * self.j0().trace().abs();
        [(self.mass.abs() * modal).sqrt(), (rigid * modal).sqrt(), modal]
    }
}

fn square(j: &Mat<f64>) -> Matrix3<f64> {
    Matrix3::from_fn(|a, b| if j.ncols() == 3 { j[(a, b)] } else { j[(INERTIA[a][b], 0)] })
}

/// Arrays of a frame.
pub(crate) struct FrameArrays {
    pub(crate) origin: Array,
    pub(crate) phi: Array,
    /// Rotations; `None` if the frame does not have them.
    pub(crate) psi: Option<Array>,
    pub(crate) ap: Option<Array>,
}

impl FrameArrays {
    pub(crate) fn new(frame: &ListedFrame, listed: &Listed<'_>, file: Digits) -> Self {
        let array = |name: &str| Array::new(frame.object(name), listed, file, name);
        let known = |name: &str| frame.object(name).map(|_| array(name));
        Self { origin: array("origin"), phi: array("phi"), psi: known("psi"), ap: known("ap") }
    }
}
