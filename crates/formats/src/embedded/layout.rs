//! Layout of the file: tables that drive the writer, the C header and `docs/reference/formats/embedded.md`.

use crate::export::{ExportFrame, Points, frames};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, GeometricStiffness, LoadKind};
use flexbody_motion::dynamics::{Constants, EquationsOfMotion, Terms};
use std::fmt::Write;

/// First bytes of the file.
pub(crate) const MAGIC: [u8; 8] = *b"FLEXBODY";

/// Byte order mark; it has this value on a machine that can read the file in place.
pub(crate) const BYTE_ORDER: u32 = 0x0102_0304;

/// Version of the layout.
pub(crate) const VERSION: u32 = 1;

/// Alignment of arrays in bytes: a cache line.
pub(crate) const ALIGNMENT: usize = 64;

/// Offset of the first byte that the checksum covers.
pub(crate) const CHECKED_FROM: usize = 24;

/// Entries before the table of arrays: name, type, content. They are stored in this order without gaps.
pub(crate) const HEADER: &[(&str, HeaderType, &str)] = &[
    ("magic", HeaderType::Bytes, "`FLEXBODY`"),
    ("byte_order", HeaderType::U32, "0x01020304"),
    ("version", HeaderType::U32, "1"),
    ("size", HeaderType::U32, "bytes of the file"),
    ("checksum", HeaderType::U32, "CRC-32 (that of gzip and zlib) of all bytes from here on"),
    ("precision", HeaderType::U32, "bytes per number of the arrays: 8 (binary64) or 4 (binary32)"),
    ("modes", HeaderType::U32, "nf"),
    ("translations", HeaderType::U32, "T: axes that the body moves along, 3 or, in the plane, 2 (x, y)"),
    ("axes", HeaderType::U32, "A: axes that it turns about, 3 or, in the plane, 1 (z)"),
    ("frames", HeaderType::U32, "n: places of the body"),
    (
        "terms",
        HeaderType::U32,
        "bit 0: `linear` has W1; bit 1: W2 is present; bit 2: W3 is present; others 0",
    ),
    ("length", HeaderType::F64, "unit of length in m"),
    ("mass", HeaderType::F64, "unit of mass in kg"),
    ("time", HeaderType::F64, "unit of time in s"),
];

/// Types of header entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HeaderType {
    Bytes,
    U32,
    F64,
}

impl HeaderType {
    fn bytes(self) -> usize {
        match self {
            Self::Bytes | Self::F64 => 8,
            Self::U32 => 4,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Bytes => "8 bytes",
            Self::U32 => "u32",
            Self::F64 => "f64",
        }
    }
}

/// Size of an entry of the table of arrays in bytes: offset of the array, rows, columns, and stride from one
/// column to the next; four u32.
const ENTRY: usize = 16;

/// Description of an array of the file.
pub(crate) struct Described {
    /// Name: lower case here and in the documentation, upper case in the C header.
    pub name: &'static str,
    shape: &'static str,
    content: &'static str,
}

const fn array(name: &'static str, shape: &'static str, content: &'static str) -> Described {
    Described { name, shape, content }
}

/// All possible arrays in the order of the table and of the file.
pub(crate) const ARRAYS: &[Described] = &[
    array("rigid", "1 + T + P x 1", "m; c; I0 of the pairs"),
    array(
        "linear",
        "T A + P + T + A x nf",
        "what is linear in q, a row each: W0 (row T-axis, in it A-axes); W1 of the pairs, only if held (symmetric part of the \
         3 x 3 matrix of each mode); C1; C2",
    ),
    array(
        "w2",
        "P nf x nf",
        "E of the pairs (theory 6.7), less stiffness of inertia (6.2b) and geometric stiffness for spin (7.4); absent without both",
    ),
    array(
        "w3",
        "A nf x nf",
        "transposed blocks of W3, each with stiffness of inertia and geometric stiffness for angular acceleration (7.4); absent without both",
    ),
    array(
        "w3_skew",
        "A nf x nf",
        "transposed blocks of W3 less the blocks; absent where that is twice `w3`, which is skew",
    ),
    array(
        "acceleration",
        "T nf x nf",
        "stiffness of inertia and geometric stiffness for acceleration (7.4); absent without",
    ),
    array("modal_mass", "nf x nf", "m_ff; absent: the identity"),
    array("modal_mass_factor", "nf x nf", "L' of m_ff = L L', zeros below its diagonal; as `modal_mass`"),
    array("stiffness", "nf x 1 or nf x nf", "K_ff: its diagonal, or in full"),
    array("damping", "nf x 1 or nf x nf", "D: its diagonal, or in full; absent: no damping"),
    array(
        "frame_number",
        "1 x n",
        "i64: number of the node of each frame; of a reference point that is no node, one above all nodes; absent without frames",
    ),
    array("frame_parts", "3 x n", "i32, described below; as `frame_number`"),
    array("frame_position", "T x n", "undeformed position of each frame"),
    array(
        "frame_translation",
        "nf x T n",
        "displacement of each frame in each mode: a column per frame and axis",
    ),
    array(
        "frame_rotation",
        "nf x A k",
        "rotation of each of k frames that have one in each mode: a column per frame and axis; absent without such",
    ),
    array(
        "frame_second",
        "nf x nf k",
        "k matrices K of motion of second order (7.5): geometric stiffness for a force or moment at a frame; absent without",
    ),
];

/// Rows of `frame_parts`.
const PARTS: &[(&str, &str)] = &[
    ("rotation", "index among the frames of `frame_rotation`, -1 without orientation"),
    ("second", "index of the first of its matrices in `frame_second`"),
    (
        "components",
        "bits: which matrices it has, in this order: forces along x (bit 0), y, z, moments about x, y, z (bit 5)",
    ),
];

/// Position and size of an array in the file.
pub(crate) struct ArrayPosition {
    pub offset: usize,
    pub rows: usize,
    pub columns: usize,
    pub stride: usize,
}

impl ArrayPosition {
    /// Returns the entry of the table; zeros for a missing array.
    pub(super) fn entry(place: Option<&Self>) -> [u32; 4] {
        // The writer ensures that a file has less than 4 GiB.
        place.map_or([0; 4], |p| [p.offset, p.rows, p.columns, p.stride].map(|v| v as u32))
    }
}

/// Returns the size of the entries before the table in bytes.
pub(crate) fn fixed_header() -> usize {
    HEADER.iter().map(|(_, kind, _)| kind.bytes()).sum()
}

/// Returns the offset of a header entry in bytes.
pub(crate) fn header_offset(name: &str) -> usize {
    HEADER.iter().take_while(|(own, ..)| *own != name).map(|(_, kind, _)| kind.bytes()).sum()
}

/// Returns the size of header and table in bytes, which is the offset of the first array.
pub(crate) fn header_bytes() -> usize {
    (fixed_header() + ENTRY * ARRAYS.len()).next_multiple_of(ALIGNMENT)
}

/// Returns the layout as Markdown for the documentation.
pub fn embedded_markdown() -> String {
    let mut text = String::from("| offset | type | name | content |\n|---|---|---|---|\n");
    let mut line = |cells: std::fmt::Arguments<'_>| writeln!(text, "{cells}").expect("strings take all text");
    for (name, kind, content) in HEADER {
        line(format_args!("| {} | {} | `{name}` | {content} |", header_offset(name), kind.name()));
    }
    line(format_args!(
        "| {} | {} x 4 u32 | | the table of arrays: start (bytes from the first of the file; 0: absent), rows, columns, numbers from one \
         column to the next |",
        fixed_header(),
        ARRAYS.len()
    ));
    line(format_args!("| {} | | | the arrays |", header_bytes()));
    line(format_args!("\n| entry at | array | rows x columns | content |\n|---|---|---|---|"));
    for (at, Described { name, shape, content }) in ARRAYS.iter().enumerate() {
        line(format_args!("| {} | `{name}` | {shape} | {content} |", fixed_header() + ENTRY * at));
    }
    line(format_args!("\n| row of `frame_parts` | name | content |\n|---|---|---|"));
    for (at, (name, content)) in PARTS.iter().enumerate() {
        line(format_args!("| {at} | `{name}` | {content} |"));
    }
    text
}

// Numbers of a body, array by array.

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
    let at = |stiffness: &GeometricStiffness<Mat<f64>>| match &stiffness.load.kind {
        LoadKind::Force(at) if at == name => Some(stiffness.load.component),
        LoadKind::Moment(at) if at == name && frame.rotation.is_some() => Some(3 + stiffness.load.component),
        _ => None,
    };
    let mut found: Vec<_> =
        body.geometric_stiffness().iter().filter_map(|stiffness| Some((at(stiffness)?, stiffness))).collect();
    found.sort_by_key(|(bit, _)| *bit);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_checked_starts_behind_the_checksum() {
        assert_eq!(header_offset("checksum") + 4, CHECKED_FROM);
        assert_eq!(fixed_header() % 8, 0);
        assert!(HEADER.iter().all(|(name, kind, _)| header_offset(name).is_multiple_of(kind.bytes())));
    }
}
