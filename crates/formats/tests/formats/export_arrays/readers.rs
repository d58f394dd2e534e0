//! Strict readers of the file formats, written from their descriptions.

use std::collections::BTreeMap;
use std::str::Lines;

/// A file in fixed columns, without the lines that `FXRLINE` skips.
pub struct Deck<'a>(Lines<'a>);

impl<'a> Deck<'a> {
    pub fn new(text: &'a str) -> Self {
        assert!(text.is_ascii());
        Self(text.lines())
    }

    fn line(&mut self) -> &'a str {
        self.0.find(|line| !line.starts_with(['#', '$']) && !line.trim().is_empty()).expect("a line")
    }

    /// Reads values of a fixed width and asserts that their count is exactly the requested one.
    fn fields<T>(
        &mut self,
        count: usize,
        per_line: usize,
        width: usize,
        parse: impl Fn(&str) -> T,
    ) -> Vec<T> {
        let mut values = Vec::new();
        while values.len() < count {
            let line = self.line();
            let here = per_line.min(count - values.len());
            assert_eq!(line.len(), here * width, "`{line}`");
            values.extend((0..here).map(|i| parse(line[i * width..(i + 1) * width].trim_start())));
        }
        values
    }

    /// Reads integers in the format `(nI8)`.
    pub fn integers(&mut self, count: usize, per_line: usize) -> Vec<i64> {
        self.fields(count, per_line, 8, |field| field.parse().expect("an integer"))
    }

    /// Reads numbers in the format `(5F16.0)`.
    pub fn numbers(&mut self, count: usize) -> Vec<f64> {
        self.fields(count, 5, 16, fortran)
    }

    pub fn end(mut self) {
        assert_eq!(self.0.find(|line| !line.starts_with('#')), None);
    }
}

/// Parses a number in the F format of Fortran: with a decimal point, and an exponent that is a signed integer
/// with or without a letter.
fn fortran(field: &str) -> f64 {
    assert!(field.contains('.'), "`{field}`");
    let after = field.find('.').expect("just found");
    match field[after..].find(['+', '-', 'E', 'D']) {
        None => field.parse().expect("a number"),
        Some(at) => {
            let (mantissa, exponent) = field.split_at(after + at);
            format!("{mantissa}e{}", exponent.trim_start_matches(['E', 'D'])).parse().expect("a number")
        }
    }
}

/// Returns a matrix in Matrix Market coordinate format, row by row; all entries are stored and none is
/// repeated.
pub fn matrix_market(bytes: &[u8]) -> Vec<Vec<f64>> {
    let text = std::str::from_utf8(bytes).expect("ASCII");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("%%MatrixMarket matrix coordinate real general"));
    let sizes: Vec<usize> =
        lines.next().expect("sizes").split(' ').map(|size| size.parse().expect("a size")).collect();
    let [rows, columns, count] = sizes[..] else { panic!("{sizes:?}") };
    let mut entries = BTreeMap::new();
    for line in lines {
        let fields: Vec<&str> = line.split(' ').collect();
        let [i, j, value] = fields[..] else { panic!("`{line}`") };
        let index = |field: &str| field.parse::<usize>().expect("an index").checked_sub(1).expect("from 1");
        let value: f64 = value.parse().expect("a number");
        assert_eq!(entries.insert((index(i), index(j)), value), None, "`{line}`");
    }
    assert_eq!(entries.len(), count);
    assert!(entries.keys().all(|&(i, j)| i < rows && j < columns));
    (0..rows).map(|i| (0..columns).map(|j| entries.get(&(i, j)).copied().unwrap_or(0.0)).collect()).collect()
}

/// A variable of a MAT-file.
#[derive(Debug, Clone, PartialEq)]
pub enum Variable {
    /// Row by row.
    Matrix(Vec<Vec<f64>>),
    Text(Vec<String>),
}

/// Returns the variables of a little-endian MAT-file of version 5 in their order.
pub fn mat5(bytes: &[u8]) -> Vec<(String, Variable)> {
    assert!(bytes.starts_with(b"MATLAB 5.0 MAT-file"));
    assert_eq!(&bytes[116..128], b"\0\0\0\0\0\0\0\0\x00\x01IM");
    let mut rest = &bytes[128..];
    let mut found = Vec::new();
    while !rest.is_empty() {
        let (kind, mut variable) = element(&mut rest);
        assert_eq!(kind, 14, "miMATRIX");
        let words = |data: &[u8]| -> Vec<u32> {
            data.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().expect("four"))).collect()
        };
        let (kind, flags) = element(&mut variable);
        assert_eq!((kind, flags.len()), (6, 8), "miUINT32");
        let class = words(flags)[0];
        let (kind, extents) = element(&mut variable);
        assert_eq!((kind, extents.len()), (5, 8), "miINT32");
        let [rows, columns] = words(extents)[..] else { panic!("two extents") };
        let (rows, columns) = (rows as usize, columns as usize);
        let (kind, name) = element(&mut variable);
        assert_eq!(kind, 1, "miINT8");
        let name = String::from_utf8(name.to_vec()).expect("ASCII");
        let (kind, data) = element(&mut variable);
        assert!(variable.is_empty(), "{name}");
        // The data are stored column by column.
        let value = match (class, kind) {
            (6, 9) => {
                assert_eq!(data.len(), 8 * rows * columns, "{name}");
                let at = |i: usize, j: usize| &data[8 * (j * rows + i)..][..8];
                let row = |i: usize| {
                    (0..columns).map(|j| f64::from_le_bytes(at(i, j).try_into().expect("eight"))).collect()
                };
                Variable::Matrix((0..rows).map(row).collect())
            }
            (4, 4) => {
                assert_eq!(data.len(), 2 * rows * columns, "{name}");
                let at = |i: usize, j: usize| {
                    u16::from_le_bytes(data[2 * (j * rows + i)..][..2].try_into().expect("two"))
                };
                let row = |i: usize| {
                    let units: Vec<u16> = (0..columns).map(|j| at(i, j)).collect();
                    String::from_utf16(&units).expect("UTF-16").trim_end_matches(' ').to_owned()
                };
                Variable::Text((0..rows).map(row).collect())
            }
            other => panic!("{name}: class and type {other:?}"),
        };
        found.push((name, value));
    }
    found
}

/// Returns type and data of the next element; its padding to eight bytes must be zero.
fn element<'a>(rest: &mut &'a [u8]) -> (u32, &'a [u8]) {
    let word = |at: usize| u32::from_le_bytes(rest[at..at + 4].try_into().expect("four"));
    let (kind, start, length) = if word(0) >> 16 == 0 {
        (word(0), 8, word(4) as usize)
    } else {
        (word(0) & 0xffff, 4, (word(0) >> 16) as usize)
    };
    assert!(start == 8 || (1..=4).contains(&length));
    assert!(start == 4 || length > 4 || length == 0, "up to four bytes stand in the tag");
    let end = (start + length).next_multiple_of(8);
    assert!(rest[start + length..end].iter().all(|byte| *byte == 0));
    let data = &rest[start..start + length];
    *rest = &rest[end..];
    (kind, data)
}
