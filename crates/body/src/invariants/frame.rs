//! Body frame: its choice from the mass and the undeformed nodes, and the transformation of nodes and
//! shapes to it.

use super::condense::condense_rigid;
use super::derived::inertia_of;
use super::general::rigid_inertia;
use super::principal_axes::principal_axes;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_linalg::{SymmetricMatrix, contiguous_mut, parallel};
use nalgebra::{Matrix3, Vector3};

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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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
    pub const ALL: [BodyFrame; 3] = [Self::Com, Self::Principal, Self::Model];

    /// Returns the name in settings and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Principal => "principal",
            Self::Com => "com",
            Self::Model => "model",
        }
    }

    /// Returns the frame with the given name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
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
        let known = || BodyFrame::ALL.map(BodyFrame::name).join(", ");
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
        let message = format!("the sum of the mass matrix over one direction is {m:e}");
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
