//! MAT-files of version 5, little-endian, not compressed: "MATLAB MAT-File Format", The MathWorks.

use faer::Mat;

/// Contents of a variable.
pub(crate) enum Mat5Value<'a> {
    /// Matrix of 64-bit floats.
    Matrix(&'a Mat<f64>),
    /// Rows of characters, padded with blanks to one length.
    Text(Vec<&'a str>),
}

/// Returns the file with these variables; `None` if a variable has more bytes than the format can state.
///
/// The names must be valid names of MATLAB variables.
pub(crate) fn mat5(variables: &[(&str, Mat5Value<'_>)]) -> Option<Vec<u8>> {
    let mut file = b"MATLAB 5.0 MAT-file, written by flexbody".to_vec();
    file.resize(124, b' ');
    // The offset of subsystem data is zero: there are none.
    file[116..].fill(0);
    file.extend(VERSION.to_le_bytes());
    file.extend(b"IM");
    for (name, value) in variables {
        file.extend(element(MATRIX, &variable(name, value)?)?);
    }
    Some(file)
}

const VERSION: u16 = 0x0100;

// Types of elements.
const INT8: u32 = 1;
const UINT16: u32 = 4;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;

// Classes of arrays.
const CHARACTERS: u32 = 4;
const DOUBLES: u32 = 6;

fn variable(name: &str, value: &Mat5Value<'_>) -> Option<Vec<u8>> {
    let (class, rows, columns, data) = match value {
        Mat5Value::Matrix(a) => {
            let bytes: Vec<u8> =
                a.col_iter().flat_map(|column| column.iter().flat_map(|v| v.to_le_bytes())).collect();
            (DOUBLES, a.nrows(), a.ncols(), element(DOUBLE, &bytes)?)
        }
        Mat5Value::Text(lines) => {
            let lines: Vec<Vec<u16>> = lines.iter().map(|line| line.encode_utf16().collect()).collect();
            let longest = lines.iter().map(Vec::len).max().unwrap_or(0);
            let unit = |i: usize, j: usize| lines[i].get(j).copied().unwrap_or(u16::from(b' '));
            let places = (0..longest).flat_map(|j| (0..lines.len()).map(move |i| (i, j)));
            let bytes: Vec<u8> = places.flat_map(|(i, j)| unit(i, j).to_le_bytes()).collect();
            (CHARACTERS, lines.len(), longest, element(UINT16, &bytes)?)
        }
    };
    let extents = [rows, columns].map(|extent| i32::try_from(extent).ok());
    let mut body = element(UINT32, &[class.to_le_bytes(), [0; 4]].concat())?;
    body.extend(element(INT32, &[extents[0]?.to_le_bytes(), extents[1]?.to_le_bytes()].concat())?);
    body.extend(element(INT8, name.as_bytes())?);
    body.extend(data);
    Some(body)
}

/// Returns an element: type, number of bytes, and the bytes padded to a multiple of eight; up to four bytes
/// are in the tag itself.
fn element(kind: u32, bytes: &[u8]) -> Option<Vec<u8>> {
    let length = u32::try_from(bytes.len()).ok()?;
    let mut out = if (1..=4).contains(&length) {
        (length << 16 | kind).to_le_bytes().to_vec()
    } else {
        [kind.to_le_bytes(), length.to_le_bytes()].concat()
    };
    out.extend(bytes);
    out.resize(out.len().next_multiple_of(8), 0);
    Some(out)
}
