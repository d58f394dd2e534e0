//! Body frame: its choice from the mass and the undeformed nodes, and the transformation of nodes and
//! shapes to it.

use super::condense::condense_rigid;
use super::derived::inertia_of;
use super::general::rigid_inertia;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::significant;
use flexbody_linalg::{SymmetricMatrix, contiguous_mut, parallel};
use libm::hypot;
use nalgebra::{Matrix3, Vector3};
use strum::{EnumString, IntoStaticStr, VariantArray};

/// The body frame in model coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Origin in model axes. Unit: length.
    pub origin: Vector3<f64>,
    /// Columns are the body axes in model axes, right-handed: x_model = origin + axes x_body.
    pub axes: Matrix3<f64>,
}

impl Frame {
    /// Returns the frame of the model.
    pub fn model() -> Self {
        Self { origin: Vector3::zeros(), axes: Matrix3::identity() }
    }

    /// Returns body coordinates of points given in model coordinates: x_body = axes' (x_model - origin).
    pub fn to_body(self, positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let to_body = self.axes.transpose();
        positions.iter().map(|x| (to_body * (Vector3::from(*x) - self.origin)).into()).collect()
    }

    /// Returns the model coordinates of a position given in body coordinates: x_model = r0 + A0 x.
    pub fn to_model(self, x: [f64; 3]) -> [f64; 3] {
        (self.origin + self.axes * Vector3::from(x)).into()
    }

    /// Turns the components of shapes (3n x nf, row 3 i + k) from model axes to body axes, in place.
    ///
    /// # Panics
    /// When the number of rows is not a multiple of three.
    pub fn rotate_shapes(&self, shapes: &mut Mat<f64>) {
        assert_eq!(shapes.nrows() % 3, 0, "three rows per node");
        let to_body = self.axes.transpose();
        parallel::for_each(shapes.col_iter_mut().map(contiguous_mut), |shape| {
            for node in shape.as_chunks_mut::<3>().0 {
                *node = (to_body * Vector3::from(*node)).into();
            }
        });
    }

    /// Turns rigid fields from the model axes to the body axes, in place. The fields are six columns: unit
    /// translations along the axes, then unit rotations about them; in the plane two and one.
    ///
    /// # Panics
    /// When there are neither six columns nor three.
    pub fn rotate_rigid(&self, fields: &mut Mat<f64>) {
        // In the plane the only rotation, about z, does not change.
        let (d, groups) = match fields.ncols() {
            3 => (2, 1),
            6 => (3, 2),
            other => panic!("{other} rigid fields, not 3 or 6"),
        };
        for row in 0..fields.nrows() {
            for first in (0..groups).map(|group| group * d) {
                let old = Vector3::from_fn(|l, _| if l < d { fields[(row, first + l)] } else { 0.0 });
                (0..d).for_each(|k| fields[(row, first + k)] = self.axes.column(k).dot(&old));
            }
        }
    }
}

/// Choice of the body frame for mean axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum BodyFrame {
    /// Origin at the centre of mass, axes of the model.
    #[default]
    Com,
    /// Origin at the centre of mass, principal axes with ascending moments: I0 is diagonal.
    Principal,
    /// The frame of the model.
    Model,
}

impl BodyFrame {
    /// All choices, in the order of the documentation.
    pub const ALL: &'static [Self] = Self::VARIANTS;

    /// Returns the name in settings and on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the frame with the given name.
    pub fn from_name(name: &str) -> Option<Self> {
        name.parse().ok()
    }
}

/// Choice of the body frame and of the conditions that tie it to the deformed body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FrameChoice {
    /// Frame that follows the mean motion of the body (mean axes).
    Mean(BodyFrame),
    /// Frame at the reference point of the interface of this name, along the axes of the model. The
    /// interface is at rest in every mode: the modes belong to the body held there.
    Interface(String),
}

impl FrameChoice {
    /// Returns the name in the settings of a file.
    pub fn text(&self) -> String {
        match self {
            Self::Mean(frame) => frame.name().to_owned(),
            Self::Interface(name) => format!("interface {name}"),
        }
    }

    /// Returns the interface that carries the frame; `None` for a frame in mean axes.
    pub fn interface(&self) -> Option<&str> {
        match self {
            Self::Mean(_) => None,
            Self::Interface(name) => Some(name),
        }
    }
}

impl Default for FrameChoice {
    fn default() -> Self {
        BodyFrame::default().into()
    }
}

impl From<BodyFrame> for FrameChoice {
    fn from(frame: BodyFrame) -> Self {
        Self::Mean(frame)
    }
}

impl std::str::FromStr for FrameChoice {
    type Err = String;

    /// Parses the name of a frame in mean axes, or `interface=NAME`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        if let Some(name) = text.strip_prefix("interface=").filter(|name| !name.is_empty()) {
            return Ok(Self::Interface(name.to_owned()));
        }
        let known = || BodyFrame::ALL.iter().map(|frame| frame.name()).collect::<Vec<_>>().join(", ");
        let unknown = || format!("expected {} or interface=NAME", known());
        BodyFrame::from_name(text).map(Self::Mean).ok_or_else(unknown)
    }
}

/// Mass, centre of mass and inertia of the undeformed body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// m. Unit: mass.
    pub mass: f64,
    /// Centre of mass in model coordinates. Unit: length.
    pub centre_of_mass: Vector3<f64>,
    /// Inertia about the centre of mass, model axes. Unit: mass length^2.
    pub inertia: Matrix3<f64>,
    /// Principal moments about the centre of mass, ascending. Unit: mass length^2.
    pub principal_moments: Vector3<f64>,
}

/// Finds the body frame and the mass properties from Ms (n x n) and the node positions (model coordinates).
///
/// Coordinates are centred at the middle of their bounding box before any product and at the centre of mass
/// before the second moments are formed, so that a body far from the model's origin keeps the digits that its
/// coordinates have. The origin is rounded to the spacing of numbers at its place: about a distant origin the
/// first moment of the body frame is that rounding times m, not zero.
///
/// Axes are canonical: an axis of a distinct moment is positive along its largest component; axes of equal
/// moments (to 1e-9 of the largest) are the projections of the model axes, so that a cube keeps the model
/// axes.
///
/// # Errors
/// `MassNotPositive` when 1' Ms 1 is not a positive finite number, `CoordinateNotFinite` when the moments are
/// not finite.
///
/// # Panics
/// When the sizes disagree.
pub fn choose_frame(
    mass: &SymmetricMatrix,
    positions: &[[f64; 3]],
    choice: BodyFrame,
) -> Result<(Frame, MassProperties)> {
    scalar_frame(mass, positions, choice, false)
}

/// Finds the frame of a body that stays in the plane z = 0. The third axis is z for any moments; the first
/// axis belongs to the smaller moment in the plane. All else is as for [`choose_frame`].
///
/// # Errors
/// The errors of [`choose_frame`].
///
/// # Panics
/// When the sizes disagree.
pub fn choose_plane_frame(
    mass: &SymmetricMatrix,
    positions: &[[f64; 3]],
    choice: BodyFrame,
) -> Result<(Frame, MassProperties)> {
    scalar_frame(mass, positions, choice, true)
}

/// Finds the frame for any mass matrix. `rigid_mass` takes a frame and returns R'MR of unit translations
/// and unit rotations in it: 6x6, for a body in the plane (`dimension` 2) 3x3.
///
/// # Errors
/// The errors of [`choose_frame`].
pub fn choose_general_frame(
    rigid_mass: impl Fn(Frame) -> Mat<f64>,
    positions: &[[f64; 3]],
    dimension: usize,
    choice: BodyFrame,
) -> Result<(Frame, MassProperties)> {
    frame_of(positions, choice, dimension == 2, |middle, offset| {
        rigid_inertia(rigid_mass(Frame { origin: middle + offset, ..Frame::model() }).as_ref())
    })
}

fn scalar_frame(
    mass: &SymmetricMatrix,
    positions: &[[f64; 3]],
    choice: BodyFrame,
    plane: bool,
) -> Result<(Frame, MassProperties)> {
    assert!(mass.n() >= positions.len(), "a row of Ms for every position");
    let about =
        |origin: Vector3<f64>, positions: &[[f64; 3]]| Frame { origin, ..Frame::model() }.to_body(positions);
    // Subtract twice: the coordinates left after the first subtraction are small, and so is their rounding.
    frame_of(positions, choice, plane, |middle, offset| {
        condense_rigid(mass, &about(offset, &about(middle, positions)))
    })
}

/// Finds the frame from `rigid`, which returns mass, first and second moment about the sum of the two given
/// points.
fn frame_of(
    positions: &[[f64; 3]],
    choice: BodyFrame,
    plane: bool,
    rigid: impl Fn(Vector3<f64>, Vector3<f64>) -> (f64, Vector3<f64>, Matrix3<f64>),
) -> Result<(Frame, MassProperties)> {
    let middle = bounding_box_middle(positions);
    let (m, c, _) = rigid(middle, Vector3::zeros());
    if !(m > 0.0 && m.is_finite()) {
        let message = format!("the sum of the mass matrix over one direction is {}", significant(m, 6));
        return Err(Diagnostic::new(Code::MassNotPositive, message).into());
    }
    let offset = c / m;
    let (_, c, j) = rigid(middle, offset);
    let inertia = inertia_of(&j);
    if !(inertia.iter().all(|v| v.is_finite()) && offset.iter().all(|v| v.is_finite())) {
        let message = "moments of the mass overflow: coordinates are not finite or beyond 1e150";
        return Err(Diagnostic::new(Code::CoordinateNotFinite, message).into());
    }
    let centre_of_mass = middle + (offset + c / m);
    let mut axes = principal_axes(&inertia);
    if plane {
        let first = axes.column(0).into_owned();
        axes = Matrix3::from_columns(&[first, Vector3::z().cross(&first), Vector3::z()]);
    }
    let principal_moments = (axes.transpose() * inertia * axes).diagonal();
    let frame = match choice {
        BodyFrame::Principal => Frame { origin: centre_of_mass, axes },
        BodyFrame::Com => Frame { origin: centre_of_mass, axes: Matrix3::identity() },
        BodyFrame::Model => Frame::model(),
    };
    Ok((frame, MassProperties { mass: m, centre_of_mass, inertia, principal_moments }))
}

fn bounding_box_middle(positions: &[[f64; 3]]) -> Vector3<f64> {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = Vector3::repeat(f64::NEG_INFINITY);
    for x in positions {
        low = low.inf(&Vector3::from(*x));
        high = high.sup(&Vector3::from(*x));
    }
    // Halve first: the sum of two large coordinates could overflow.
    if positions.is_empty() { Vector3::zeros() } else { low * 0.5 + high * 0.5 }
}

// Canonical principal axes of inertia: independent of numbering, thread count and initial orientation of a
// symmetric body.

/// Relative difference below which moments count as equal. Rounding of the moments is about 1e-15, so that
/// axes of moments this close are known to six digits; axes of closer moments would turn noise into a
/// rotation.
const EQUAL_MOMENTS: f64 = 1e-9;
/// Relative difference below which components count as equal in the search for the largest one, so that
/// rounding does not decide.
const EQUAL_COMPONENTS: f64 = 1e-6;

/// Returns the principal axes (columns, right-handed, moments ascending) of an inertia in model axes.
///
/// An axis of a distinct moment is positive along its largest component (the first such). Within a plane of
/// equal moments the first axis is the projection of the model axis closest to the plane (the first such);
/// three equal moments give the model axes themselves. The last axis closes the right-handed frame.
pub fn principal_axes(inertia: &Matrix3<f64>) -> Matrix3<f64> {
    let (moments, vectors) = jacobi(inertia);
    let equal = |a: usize, b: usize| moments[b] - moments[a] <= EQUAL_MOMENTS * moments[2].abs();
    match (equal(0, 1), equal(1, 2)) {
        (true, true) => Matrix3::identity(),
        (true, false) => {
            let normal = positive(&vectors[2]);
            let first = in_plane(&normal);
            Matrix3::from_columns(&[first, normal.cross(&first), normal])
        }
        (false, true) => {
            let normal = positive(&vectors[0]);
            let first = in_plane(&normal);
            Matrix3::from_columns(&[normal, first, normal.cross(&first)])
        }
        (false, false) => {
            let (first, second) = (positive(&vectors[0]), positive(&vectors[1]));
            Matrix3::from_columns(&[first, second, first.cross(&second)])
        }
    }
}

/// Returns the first index whose value is the largest up to rounding.
fn first_largest(values: [f64; 3]) -> usize {
    let largest = values.iter().copied().fold(0.0, f64::max);
    values.iter().position(|&v| v >= largest * (1.0 - EQUAL_COMPONENTS)).unwrap_or(0)
}

fn positive(v: &Vector3<f64>) -> Vector3<f64> {
    let largest = first_largest([v.x.abs(), v.y.abs(), v.z.abs()]);
    if v[largest] < 0.0 { -v } else { *v }
}

/// Returns the direction in the plane normal to `normal` that is closest to a model axis.
fn in_plane(normal: &Vector3<f64>) -> Vector3<f64> {
    let length = |k: usize| (1.0 - normal[k] * normal[k]).max(0.0);
    let k = first_largest([length(0), length(1), length(2)]);
    let mut direction = -normal * normal[k];
    direction[k] += 1.0;
    direction.normalize()
}

/// Returns the eigenvalues, ascending, and the eigenvectors of a symmetric 3x3 matrix by cyclic Jacobi
/// rotations.
///
/// Jacobi and not QR: off-diagonal entries at rounding level are not touched, so that a body whose
/// principal axes are the model axes keeps its coordinates exactly, and small moments of needles keep their
/// digits.
fn jacobi(matrix: &Matrix3<f64>) -> ([f64; 3], [Vector3<f64>; 3]) {
    let mut a = *matrix;
    let mut v = Matrix3::<f64>::identity();
    // Convergence is quadratic: five sweeps suffice. The limit only ends a loop over NaN.
    for _sweep in 0..32 {
        let mut rotated = false;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let negligible = 4.0 * f64::EPSILON * (a[(p, p)].abs() * a[(q, q)].abs()).sqrt();
            if a[(p, q)].abs() <= negligible {
                continue;
            }
            rotated = true;
            let theta = (a[(q, q)] - a[(p, p)]) / (2.0 * a[(p, q)]);
            let t = theta.signum() / (theta.abs() + hypot(theta, 1.0));
            let c = 1.0 / hypot(t, 1.0);
            let s = t * c;
            let mut rotation = Matrix3::identity();
            (rotation[(p, p)], rotation[(p, q)]) = (c, s);
            (rotation[(q, p)], rotation[(q, q)]) = (-s, c);
            a = rotation.transpose() * a * rotation;
            (a[(p, q)], a[(q, p)]) = (0.0, 0.0);
            v *= rotation;
        }
        if !rotated {
            break;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[(i, i)].total_cmp(&a[(j, j)]));
    (order.map(|i| a[(i, i)]), order.map(|i| v.column(i).normalize()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn diagonal(a: f64, b: f64, c: f64) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(a, b, c))
    }

    fn is_right_handed(axes: &Matrix3<f64>) -> bool {
        (axes.transpose() * axes - Matrix3::identity()).amax() < 1e-15 && axes.determinant() > 0.0
    }

    #[test]
    fn distinct_moments_come_ascending_and_diagonal() {
        let turn = Rotation3::from_euler_angles(0.3, -1.1, 2.0);
        let inertia = turn.matrix() * diagonal(5.0, 1.0, 3.0) * turn.matrix().transpose();
        let axes = principal_axes(&inertia);
        assert!(is_right_handed(&axes));
        assert!((axes.transpose() * inertia * axes - diagonal(1.0, 3.0, 5.0)).amax() < 4e-15);
        for k in 0..2 {
            assert!(
                axes.column(k)[axes.column(k).iamax()] > 0.0,
                "axis {k} is positive along its largest component"
            );
        }
    }

    #[test]
    fn three_equal_moments_give_the_model_axes() {
        let mut inertia = diagonal(4.5, 4.5 * (1.0 + 1e-13), 4.5);
        inertia[(0, 1)] = 1e-14;
        inertia[(1, 0)] = 1e-14;
        assert_eq!(principal_axes(&inertia), Matrix3::identity());
    }

    #[test]
    fn noise_in_a_plane_of_equal_moments_does_not_turn_the_axes() {
        // A disc about z and a bar along z.
        for (moments, expected) in [
            (diagonal(1.0, 1.0, 2.0), Matrix3::identity()),
            (diagonal(2.0, 2.0, 1.0), Matrix3::new(0., 1., 0., 0., 0., 1., 1., 0., 0.)),
        ] {
            for (i, sign) in [(0, 1.0), (1, -1.0)] {
                let mut inertia = moments;
                inertia[(i, i)] *= 1.0 + sign * 3e-12;
                inertia[(0, 1)] = sign * 7e-12;
                inertia[(1, 0)] = sign * 7e-12;
                assert_eq!(principal_axes(&inertia), expected);
            }
        }
    }

    #[test]
    fn tilted_disc_has_the_projected_model_axis_whatever_the_noise() {
        let normal = Vector3::new(1.0, 2.0, 2.0) / 3.0;
        let exact = Matrix3::identity() + normal * normal.transpose();
        for noise in [0.0, 1e-12, -1e-12] {
            let mut inertia = exact;
            inertia[(0, 2)] += noise;
            inertia[(2, 0)] += noise;
            let axes = principal_axes(&inertia);
            assert!(is_right_handed(&axes));
            // x is closest to the plane: its projection is x - n (n.x).
            let first = (Vector3::x() - normal * normal.x).normalize();
            assert!((axes.column(0) - first).amax() < 1e-11 && (axes.column(2) - normal).amax() < 1e-11);
        }
    }

    #[test]
    fn equal_components_take_the_sign_of_the_first() {
        let n = Vector3::new(-1.0, 1.0 + 1e-9, 0.0).normalize();
        let axes = principal_axes(&(Matrix3::identity() * 2.0 - n * n.transpose()));
        assert!(axes[(0, 0)] > 0.0 && axes[(1, 0)] < 0.0);
    }

    #[test]
    fn needle_keeps_the_digits_of_its_small_moment() {
        let turn = Rotation3::from_euler_angles(0.0, 0.0, 1e-4);
        let inertia = turn.matrix() * diagonal(1e-10, 1.0, 1.0) * turn.matrix().transpose();
        let axes = principal_axes(&inertia);
        assert!((axes.transpose() * inertia * axes)[(0, 0)] > 0.0);
        assert!((axes.column(0) - turn.matrix().column(0)).amax() < 1e-15);
    }

    #[test]
    fn numbers_that_are_not_finite_end_the_iteration() {
        principal_axes(&diagonal(f64::NAN, 1.0, 2.0));
        principal_axes(&Matrix3::from_element(f64::INFINITY));
        assert_eq!(principal_axes(&Matrix3::zeros()), Matrix3::identity());
    }
}
