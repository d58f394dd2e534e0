//! Numbers of a body, array by array.

use super::layout::{ALIGNMENT, ARRAYS};
use crate::export::{ExportFrame, Points, frames};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, GeometricStiffness, LoadKind};
use flexbody_motion::dynamics::{Constants, EquationsOfMotion, Terms};

/// Numbers of an array, column by column.
pub(crate) enum Numbers {
    /// Floats, written in the precision of the file.
    Real(Vec<f64>),
    I32(Vec<i32>),
    I64(Vec<i64>),
}

pub(crate) struct Array {
    pub rows: usize,
    pub columns: usize,
    /// Number of entries from one column to the next.
    pub stride: usize,
    pub numbers: Numbers,
}

impl Array {
    /// Returns a matrix whose columns are padded with zeros to a multiple of `unit` numbers.
    fn padded(matrix: &Mat<f64>, unit: usize) -> Self {
        let (rows, columns) = (matrix.nrows(), matrix.ncols());
        let stride = rows.next_multiple_of(unit);
        let entry = |at: usize| if at % stride < rows { matrix[(at % stride, at / stride)] } else { 0.0 };
        Self { rows, columns, stride, numbers: Numbers::Real((0..stride * columns).map(entry).collect()) }
    }

    fn plain(rows: usize, numbers: Numbers) -> Self {
        let count = match &numbers {
            Numbers::Real(v) => v.len(),
            Numbers::I32(v) => v.len(),
            Numbers::I64(v) => v.len(),
        };
        Self { rows, columns: count / rows, stride: rows, numbers }
    }
}

/// Sizes, terms and arrays of a body in the form of the file.
pub(crate) struct Content {
    /// Number T of axes along which the body translates: 3, or 2 in the plane.
    pub translations: usize,
    /// Number A of axes about which the body rotates: 3, or 1 in the plane.
    pub axes: usize,
    /// Bits of the header entry `terms`.
    pub terms: u32,
    pub frames: Vec<ExportFrame>,
    /// Arrays in the order of [`ARRAYS`].
    pub arrays: Vec<Option<Array>>,
}

impl Content {
    /// Collects the arrays with numbers of `precision` bytes.
    ///
    /// # Errors
    /// [`ExportLoses`](Code::ExportLoses) if m_ff is not positive definite, since accelerations are then
    /// undefined.
    pub(super) fn new(body: &FlexBody, points: &Points, precision: usize) -> Result<Self> {
        let unit = ALIGNMENT / precision;
        let equations = EquationsOfMotion::new(body, Terms::ALL);
        let terms = equations.terms();
        let constants = equations.constants();
        if let Some((_, None)) = constants.modal_mass {
            let message = "embedded cannot hold a modal mass that is not positive definite";
            return Err(Diagnostic::new(Code::ExportLoses, message).with_help("flexbody check").into());
        }
        let (translations, axes) = if body.dimension() == 2 { (2, 1) } else { (3, 3) };
        let frames = frames(body, points);
        let mut places = EmbeddedFrames::new(body, &frames, translations, axes);
        let arrays = ARRAYS.iter().map(|array| {
            let padded = |matrix: &Option<Mat<f64>>| Some(Array::padded(matrix.as_ref()?, unit));
            let Constants { modal_mass, .. } = &constants;
            match array.name {
                "rigid" => Some(Array::plain(constants.rigid.len(), Numbers::Real(constants.rigid.clone()))),
                "linear" => Some(Array::padded(&constants.linear, unit)),
                "w2" => padded(&constants.w2),
                "w3" => padded(&constants.w3),
                "w3_skew" => padded(&constants.w3_skew),
                "acceleration" => padded(&constants.acceleration),
                "modal_mass" => padded(&modal_mass.as_ref().map(|(matrix, _)| matrix.clone())),
                "modal_mass_factor" => {
                    let lower = modal_mass.as_ref().and_then(|(_, factor)| factor.as_ref());
                    padded(&lower.map(|lower| lower.transpose().to_owned()))
                }
                "stiffness" => Some(Array::padded(&constants.stiffness, unit)),
                "damping" => padded(&constants.damping),
                name => places.take(name),
            }
        });
        let terms = u32::from(terms.w1) | u32::from(terms.w2) << 1 | u32::from(terms.w3) << 2;
        Ok(Self { translations, axes, terms, arrays: arrays.collect(), frames })
    }
}

/// Arrays of the frames.
struct EmbeddedFrames {
    nf: usize,
    translations: usize,
    number: Vec<i64>,
    parts: Vec<i32>,
    position: Vec<f64>,
    translation: Vec<f64>,
    rotation: Vec<f64>,
    second: Vec<f64>,
}

impl EmbeddedFrames {
    fn new(body: &FlexBody, frames: &[ExportFrame], translations: usize, axes: usize) -> Self {
        let nf = body.n_modes();
        let mut places = Self {
            nf,
            translations,
            number: Vec::new(),
            parts: Vec::new(),
            position: Vec::new(),
            translation: Vec::new(),
            rotation: Vec::new(),
            second: Vec::new(),
        };
        let row = |rows: &Mat<f64>, k: usize| (0..nf).map(|j| rows[(k, j)]).collect::<Vec<f64>>();
        for frame in frames {
            // Indices of the first rotation row and of the first stiffness matrix of the frame.
            let turned = places.rotation.len() / (nf * axes);
            let first = places.second.len() / (nf * nf);
            let mut components = 0;
            // Symmetric parts of the geometric stiffness of loads at the frame, with a bit for each
            // component.
            for (bit, one) in loads(body, frames, frame) {
                components |= 1 << bit;
                let matrix = &one.matrix;
                let entry = |at: usize| 0.5 * (matrix[(at % nf, at / nf)] + matrix[(at / nf, at % nf)]);
                places.second.extend((0..nf * nf).map(entry));
            }
            places.number.push(frame.id);
            places.parts.extend([
                if frame.rotation.is_some() { turned as i32 } else { -1 },
                first as i32,
                components,
            ]);
            // Position, displacement and rotation along the axes in which the body moves.
            places.position.extend(&frame.position[..translations]);
            (0..translations).for_each(|k| places.translation.extend(row(&frame.translation, k)));
            if let Some(rotation) = &frame.rotation {
                (3 - axes..3).for_each(|k| places.rotation.extend(row(rotation, k)));
            }
        }
        places
    }

    /// Returns the array of that name; `None` if it is empty.
    fn take(&mut self, name: &str) -> Option<Array> {
        use std::mem::take;
        let (rows, numbers) = match name {
            "frame_number" => (1, Numbers::I64(take(&mut self.number))),
            "frame_parts" => (3, Numbers::I32(take(&mut self.parts))),
            "frame_position" => (self.translations, Numbers::Real(take(&mut self.position))),
            "frame_translation" => (self.nf, Numbers::Real(take(&mut self.translation))),
            "frame_rotation" => (self.nf, Numbers::Real(take(&mut self.rotation))),
            _ => (self.nf, Numbers::Real(take(&mut self.second))),
        };
        Some(Array::plain(rows, numbers)).filter(|array| array.columns > 0)
    }
}

/// Returns the geometric stiffness for forces and moments at a frame, each with its bit in `components`. It
/// is that of the reference point of an interface, as in
/// [`BodyPoint::interface`](flexbody_motion::dynamics::BodyPoint::interface).
pub(crate) fn loads<'b>(
    body: &'b FlexBody,
    frames: &[ExportFrame],
    frame: &'b ExportFrame,
) -> Vec<(usize, &'b GeometricStiffness<Mat<f64>>)> {
    let Some(name) = &frame.name else { return Vec::new() };
    let is_reference =
        body.interfaces().iter().any(|interface| interface.name == *name && interface.reference.is_some())
            && frames.iter().filter(|other| other.name == frame.name).count() == 1;
    if !is_reference {
        return Vec::new();
    }
    let at = |one: &GeometricStiffness<Mat<f64>>| match &one.load.kind {
        LoadKind::Force(at) if at == name => Some(one.load.component),
        LoadKind::Moment(at) if at == name && frame.rotation.is_some() => Some(3 + one.load.component),
        _ => None,
    };
    let mut found: Vec<_> =
        body.geometric_stiffness().iter().filter_map(|one| Some((at(one)?, one))).collect();
    found.sort_by_key(|(bit, _)| *bit);
    found
}
