//! Layout of the file: tables that drive the writer, the C header and `docs/reference/formats/embedded.md`.

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
pub(crate) const ENTRY: usize = 16;

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
