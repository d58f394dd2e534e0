//! NumPy's format of one array, versions 1 to 3:
//! <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use super::array::Array;
use flexbody_base::diagnostic::{Code, Diagnostic};

const MAGIC: &[u8] = b"\x93NUMPY";

pub(super) fn recognises(head: &[u8]) -> bool {
    head.starts_with(MAGIC)
}

/// Matrices of equal size, one after the other, each row by row.
pub(super) struct Blocks {
    /// Number of matrices.
    pub count: usize,
    /// Number of rows of each matrix.
    pub rows: usize,
    /// Number of columns of each matrix.
    pub columns: usize,
    /// Values of all matrices.
    pub values: Vec<f64>,
    /// Largest number of significant decimal digits of the values.
    pub digits: u8,
}

/// Reads an array of real numbers with three extents.
pub(super) fn read_blocks(bytes: &[u8]) -> Result<Blocks, Diagnostic> {
    let (Header { descr, fortran, shape }, data) = described(bytes)?;
    let (size, decode) = number_type(descr)?;
    let &[count, rows, columns] = shape.as_slice() else { return Err(other_extents(&shape, 3)) };
    let length = announced(&shape, size, data)?;
    let per_array = rows * columns;
    // In Fortran order the first index varies fastest.
    let at = |k: usize| {
        if fortran { k / per_array + count * (k % per_array / columns + rows * (k % columns)) } else { k }
    };
    let values = (0..length).map(|k| decode(&data[at(k) * size..(at(k) + 1) * size])).collect();
    Ok(Blocks { count, rows, columns, values, digits: if size == 4 { 7 } else { 17 } })
}

fn other_extents(shape: &[usize], expected: usize) -> Diagnostic {
    let message = format!("array has {} extents, expected {expected}", shape.len());
    Diagnostic::new(Code::MatrixKind, message)
}

/// Returns the number of values of `size` bytes in an array with these extents, which must be that of `data`.
fn announced(shape: &[usize], size: usize, data: &[u8]) -> Result<usize, Diagnostic> {
    let count = shape.iter().try_fold(1usize, |count, &extent| count.checked_mul(extent));
    count.filter(|count| count.checked_mul(size) == Some(data.len())).ok_or_else(|| {
        let extents: Vec<String> = shape.iter().map(usize::to_string).collect();
        let message = format!(
            "header announces {} values of {size} bytes, {} bytes follow",
            extents.join(" x "),
            data.len()
        );
        Diagnostic::new(Code::MatrixCount, message)
    })
}

/// Splits an array into its parsed header and its numbers.
fn described(bytes: &[u8]) -> Result<(Header<'_>, &[u8]), Diagnostic> {
    let (header, data) = split(bytes)?;
    let text = header.escape_ascii().to_string();
    let shown = text.get(..100).unwrap_or(&text).trim_end();
    let header = parse(header).ok_or_else(|| syntax(format!("header cannot be parsed: `{shown}`")))?;
    Ok((header, data))
}

/// Reads an array of real numbers with one or two extents.
pub(super) fn read(bytes: &[u8]) -> Result<Array, Diagnostic> {
    let (Header { descr, fortran, shape }, data) = described(bytes)?;
    let (size, decode) = number_type(descr)?;
    let (rows, cols) = match *shape.as_slice() {
        [rows] => (rows, 1),
        [rows, cols] => (rows, cols),
        _ => {
            let help = "reshape it: one row for every matrix row, one column for every shape";
            return Err(other_extents(&shape, 2).with_help(help));
        }
    };
    announced(&[rows, cols], size, data)?;
    let values = data.chunks_exact(size).map(decode).collect();
    Ok(Array { rows, cols, row_major: !fortran, values, digits: if size == 4 { 7 } else { 17 } })
}

/// Reads whole numbers with one extent, of any integer type.
pub(super) fn read_integers(bytes: &[u8]) -> Result<Vec<i64>, Diagnostic> {
    let (header, data) = split(bytes)?;
    let Header { descr, shape, .. } =
        parse(header).ok_or_else(|| syntax("header cannot be parsed".into()))?;
    let digits = descr.get(1..).and_then(|size| size.strip_prefix(['i', 'u']));
    let Some(size) = digits.and_then(|digits| digits.parse().ok()).filter(|size| [1, 2, 4, 8].contains(size))
    else {
        let message = format!("array has the type `{}`, expected whole numbers", descr.escape_default());
        return Err(Diagnostic::new(Code::MatrixKind, message));
    };
    if shape.len() != 1 {
        return Err(other_extents(&shape, 1));
    }
    announced(&shape, size, data)?;
    let big = descr.starts_with('>');
    let signed = descr.as_bytes()[1] == b'i';
    let decode = |bytes: &[u8]| {
        let digits = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        let number = if big { bytes.iter().fold(0, digits) } else { bytes.iter().rev().fold(0, digits) };
        let unused = 64 - 8 * size as u32;
        if signed { ((number << unused) as i64) >> unused } else { i64::try_from(number).unwrap_or(i64::MAX) }
    };
    Ok(data.chunks_exact(size).map(decode).collect())
}

/// Returns the extents that the header of an array states; `bytes` is the beginning of the array. `None` if there is no
/// header.
pub(super) fn announced_extents(bytes: &[u8]) -> Option<Vec<usize>> {
    described(bytes).ok().map(|(header, _)| header.shape)
}

/// Returns the number of values that the header of an array announces; `bytes` is the beginning of the array.
///
/// # Errors
/// FB301 if there is no header.
pub(super) fn announced_values(bytes: &[u8]) -> Result<u64, Diagnostic> {
    let (Header { shape, .. }, _) = described(bytes)?;
    Ok(shape.iter().fold(1u64, |product, &extent| product.saturating_mul(extent as u64)))
}

/// Returns the number of bytes of an array by its header, which `bytes` must contain; `None` if there is no array.
pub(super) fn announced_bytes(bytes: &[u8]) -> Option<u64> {
    let (header, data) = split(bytes).ok()?;
    let Header { descr, shape, .. } = parse(header)?;
    let digits = descr.trim_start_matches(|c: char| !c.is_ascii_digit());
    let letters: u64 = digits.parse().ok()?;
    let width = if descr.contains('U') { letters.saturating_mul(4) } else { letters };
    let values = shape.iter().fold(width, |product, &extent| product.saturating_mul(extent as u64));
    Some(((bytes.len() - data.len()) as u64).saturating_add(values))
}

/// Returns the text of an array that is one text of any length (`<U120`).
pub(super) fn read_text(bytes: &[u8]) -> Option<String> {
    let (header, data) = split(bytes).ok()?;
    let Header { descr, .. } = parse(header)?;
    if !descr.starts_with("<U") {
        return None;
    }
    data.as_chunks::<4>()
        .0
        .iter()
        .map(|four| char::from_u32(u32::from_le_bytes(*four)))
        .filter(|c| *c != Some('\0'))
        .collect()
}

/// Returns the text of an array that is one word (`|S3`, `<U3`).
pub(super) fn read_word(bytes: &[u8]) -> Option<String> {
    let (header, data) = split(bytes).ok()?;
    let Header { descr, .. } = parse(header)?;
    let letters = match descr.as_bytes() {
        [b'|', b'S', ..] => data.to_vec(),
        [b'<', b'U', ..] => data.iter().copied().step_by(4).collect(),
        _ => return None,
    };
    let text = String::from_utf8(letters).ok()?;
    Some(text.trim_end_matches('\0').to_owned())
}

fn syntax(what: String) -> Diagnostic {
    Diagnostic::new(Code::MatrixSyntax, what).with_help("write the array again by numpy.save")
}

/// Returns the header and the numbers after it.
fn split(bytes: &[u8]) -> Result<(&[u8], &[u8]), Diagnostic> {
    let number = |range: std::ops::Range<usize>| {
        let bytes = bytes.get(range)?;
        Some(bytes.iter().rev().fold(0usize, |number, &byte| number << 8 | usize::from(byte)))
    };
    let version = bytes.get(6).copied().unwrap_or(0);
    let (start, length) = match version {
        1 => (10, number(8..10)),
        2 | 3 => (12, number(8..12)),
        _ => return Err(syntax(format!("NumPy format has version {version}, expected 1 to 3"))),
    };
    let header = length.and_then(|length| bytes.get(start..)?.get(..length));
    let header = header.ok_or_else(|| syntax("file ends inside its header".into()))?;
    Ok((header, &bytes[start + header.len()..]))
}

/// Function that decodes the bytes of one number.
type Decode = fn(&[u8]) -> f64;

/// Returns the number of bytes of the type in the header, and its decoder.
fn number_type(descr: &str) -> Result<(usize, Decode), Diagnostic> {
    Ok(match descr {
        "<f8" => (8, |b| f64::from_le_bytes(b.try_into().expect("eight bytes"))),
        ">f8" => (8, |b| f64::from_be_bytes(b.try_into().expect("eight bytes"))),
        "<f4" => (4, |b| f64::from(f32::from_le_bytes(b.try_into().expect("four bytes")))),
        ">f4" => (4, |b| f64::from(f32::from_be_bytes(b.try_into().expect("four bytes")))),
        other => {
            let message = format!("array has the type `{}`, expected f8 or f4", other.escape_default());
            return Err(Diagnostic::new(Code::MatrixKind, message)
                .with_help("write real numbers: numpy.save(file, array.astype(float))"));
        }
    })
}

struct Header<'a> {
    descr: &'a str,
    fortran: bool,
    shape: Vec<usize>,
}

/// Parses the header: a Python dictionary with exactly the keys descr, fortran_order and shape.
fn parse(text: &[u8]) -> Option<Header<'_>> {
    let mut cursor = Cursor(std::str::from_utf8(text).ok()?.trim());
    let (mut descr, mut fortran, mut shape) = (None, None, None);
    cursor.take("{")?;
    while cursor.take("}").is_none() {
        let key = cursor.quoted()?;
        cursor.take(":")?;
        match key {
            "descr" if descr.is_none() => descr = Some(cursor.quoted()?),
            "fortran_order" if fortran.is_none() => {
                fortran = Some(if cursor.take("True").is_some() {
                    true
                } else {
                    cursor.take("False")?;
                    false
                });
            }
            "shape" if shape.is_none() => shape = Some(cursor.tuple()?),
            _ => return None,
        }
        if cursor.take(",").is_none() {
            cursor.take("}")?;
            break;
        }
    }
    let all = cursor.0.is_empty();
    Some(Header { descr: descr?, fortran: fortran?, shape: shape? }).filter(|_| all)
}

/// Rest of a text that is parsed.
struct Cursor<'a>(&'a str);

impl<'a> Cursor<'a> {
    /// Consumes `token` and the blanks after it.
    fn take(&mut self, token: &str) -> Option<()> {
        self.0 = self.0.strip_prefix(token)?.trim_start();
        Some(())
    }

    fn quoted(&mut self) -> Option<&'a str> {
        let quote = self.0.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
        let (text, rest) = self.0[1..].split_once(quote)?;
        self.0 = rest.trim_start();
        Some(text)
    }

    /// Parses whole numbers in parentheses.
    fn tuple(&mut self) -> Option<Vec<usize>> {
        self.take("(")?;
        let mut numbers = Vec::new();
        while self.take(")").is_none() {
            let end = self.0.find(|c: char| !c.is_ascii_digit())?;
            numbers.push(self.0[..end].parse().ok()?);
            self.0 = self.0[end..].trim_start();
            if self.take(",").is_none() {
                self.take(")")?;
                break;
            }
        }
        Some(numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([version, 0]);
        match version {
            1 => bytes.extend((header.len() as u16).to_le_bytes()),
            _ => bytes.extend((header.len() as u32).to_le_bytes()),
        }
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn every_version_order_and_byte_order() {
        let values = [1.5, -2.0, 0.25, 3.0, 4.0, 5.0];
        for version in [1, 2, 3] {
            for (descr, digits) in [("<f8", 17), (">f8", 17), ("<f4", 7), (">f4", 7)] {
                let data: Vec<u8> = values
                    .iter()
                    .flat_map(|&v: &f64| match descr {
                        "<f8" => v.to_le_bytes().to_vec(),
                        ">f8" => v.to_be_bytes().to_vec(),
                        "<f4" => (v as f32).to_le_bytes().to_vec(),
                        _ => (v as f32).to_be_bytes().to_vec(),
                    })
                    .collect();
                for (fortran, row_major) in [("False", true), ("True", false)] {
                    let header = format!(
                        "{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': (3, 2), }}     \n"
                    );
                    let expected = Array { rows: 3, cols: 2, row_major, values: values.to_vec(), digits };
                    assert_eq!(read(&file(version, &header, &data)), Ok(expected));
                }
            }
        }
    }

    #[test]
    fn what_is_not_an_array_of_real_numbers_is_refused() {
        let header = |descr: &str, shape: &str| {
            format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}")
        };
        let eight = [0u8; 8];
        for (bytes, code) in [
            (file(1, &header("'<f8'", "(1, 1)"), &eight[..7]), Code::MatrixCount),
            (file(1, &header("'<f8'", "(1, 2)"), &eight), Code::MatrixCount),
            (file(1, &header("'<f8'", "(4294967296, 4294967296)"), &eight), Code::MatrixCount),
            (file(1, &header("'<f8'", "(99999999999999999999, 1)"), &eight), Code::MatrixSyntax),
            (file(1, &header("'<f8'", "(1, -1)"), &eight), Code::MatrixSyntax),
            (file(1, &header("'<f8'", "(1, 1, 1)"), &eight), Code::MatrixKind),
            (file(1, &header("'<f8'", "()"), &eight), Code::MatrixKind),
            (file(1, &header("'<c16'", "(1, 1)"), &eight), Code::MatrixKind),
            (file(1, &header("'|O'", "(1, 1)"), &eight), Code::MatrixKind),
            (file(1, &header("[('a', '<f8')]", "(1, 1)"), &eight), Code::MatrixSyntax),
            (file(1, "{'descr': '<f8', 'shape': (1, 1)}", &eight), Code::MatrixSyntax),
            (
                file(1, "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1)} x", &eight),
                Code::MatrixSyntax,
            ),
            (file(1, "{", &eight), Code::MatrixSyntax),
            (file(4, "", &eight), Code::MatrixSyntax),
            (MAGIC.to_vec(), Code::MatrixSyntax),
            ([MAGIC, &[2, 0, 255, 255, 255, 255, b'{']].concat(), Code::MatrixSyntax),
            ([MAGIC, &[1, 0, 255, 255, 0xff, 0xfe]].concat(), Code::MatrixSyntax),
        ] {
            let found = read(&bytes).expect_err("not an array");
            assert_eq!(found.code(), code, "{found}");
        }
    }
}
