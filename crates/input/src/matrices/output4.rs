//! Matrices that Nastran writes with OUTPUT4: as text or binary, dense or as strings of nonzeros (with starts packed
//! into their lengths, or in separate words: BIGMAT).

mod binary;
mod columns;
mod text;

use super::assemble::{check_extents, check_size, undeclared_triangle};
use super::named_matrices::{choose, named_or_only};
use super::operator::OperatorColumns;
use super::reader::{ArraySource, MatrixSource, Reader};
use super::rectangular::Rectangular;
use crate::array::Array;
use binary::Binary;
use columns::{Columns, SINGLE_DIGITS, Stored, Stretch};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::{self, Error};
use flexbody_base::text::{Compression, InputFile};
use flexbody_linalg::parallel;
use flexbody_model::RawMatrix;
use text::Format;

/// Number of digits with which OUTPUT4 writes single-precision numbers as text.
const PADDED_DIGITS: u8 = 10;

/// Reader of OUTPUT4 files.
pub(crate) struct Output4;

impl Reader for Output4 {
    fn name(&self) -> &'static str {
        "OUTPUT4"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["op4"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        Binary::of(head).is_some() || text::begins(head)
    }

    fn read(&self, source: &MatrixSource<'_>) -> error::Result<RawMatrix> {
        let path = source.file.path();
        if source.compression != Compression::None {
            let message = "OUTPUT4 file is compressed as a whole";
            let diagnostic = Diagnostic::new(Code::FileFormatUnknown, message).in_file(path);
            return Err(diagnostic.with_help("unpack it").into());
        }
        let read = || {
            let contents = Contents::of(source.file)?;
            contents.matrix(source.file, choose(&contents.names(), source.role, source.group)?)
        };
        read().map_err(|found: Diagnostic| Error::from(found.in_file(path)))
    }

    fn read_array(&self, source: &ArraySource<'_>) -> Option<Diagnosed<Array>> {
        let read = || read_rectangular(source.file, source.name)?.array();
        source.is_plain().then(|| read().map_err(|diagnostic| vec![diagnostic]))
    }

    fn read_operator(&self, source: &ArraySource<'_>) -> Option<Diagnosed<OperatorColumns>> {
        let read = || read_rectangular(source.file, source.name).map(Rectangular::operator);
        source.is_plain().then(|| read().map_err(|diagnostic| vec![diagnostic]))
    }
}

/// Matrices of a file, in its order.
pub(crate) struct Contents {
    matrices: Vec<(Stored, Encoding)>,
}

/// Encoding of the columns of a matrix.
#[derive(Clone, Copy)]
enum Encoding {
    Text(Format),
    Binary(Binary),
}

impl Contents {
    /// Scans a file without reading a value.
    ///
    /// # Errors
    /// FB301 for a file that is no OUTPUT4 file, FB303, FB304 for files that are cut off.
    pub(crate) fn of(file: &InputFile) -> Result<Self, Diagnostic> {
        let matrices = match Binary::of(file.bytes()) {
            Some(binary) => {
                let all = binary.contents(file)?.into_iter();
                all.map(|stored| (stored, Encoding::Binary(binary))).collect()
            }
            None => {
                let all = text::contents(file)?.into_iter();
                all.map(|(stored, format)| (stored, Encoding::Text(format))).collect()
            }
        };
        Ok(Self { matrices })
    }

    /// Returns the names of the matrices.
    pub(crate) fn names(&self) -> Vec<String> {
        self.matrices.iter().map(|(stored, _)| stored.header.name.clone()).collect()
    }

    /// Returns the number of rows of a square matrix with entries; `None` for another matrix.
    pub(crate) fn square(&self, at: usize) -> Option<usize> {
        let (stored, _) = self.matrices.get(at)?;
        let is_square = stored.header.rows == stored.header.columns && stored.values > 0;
        usize::try_from(stored.header.rows).ok().filter(|_| is_square)
    }

    /// Returns a matrix that need not be square; `file` must be the file that was scanned.
    ///
    /// # Errors
    /// FB301 for text that cannot be parsed, FB302 for complex matrices and other forms, FB303 for rows outside the
    /// matrix, FB306 for values that are not finite, FB313 for more entries than memory holds.
    fn rectangular(&self, file: &InputFile, wanted: usize) -> Result<Rectangular, Diagnostic> {
        let (stored, encoding) = &self.matrices[wanted];
        let header = &stored.header;
        let about = |diagnostic: Diagnostic| diagnostic.about(&header.name);
        let refuse = |message: String, help: &str| {
            Err(about(Diagnostic::new(Code::MatrixKind, message).with_help(help)))
        };
        if !header.is_real() {
            let message = format!("type {} is complex", header.kind);
            return refuse(message, "write real matrices, without structural damping");
        }
        if !matches!(header.form, 1 | 2 | 6) {
            let message = format!("form {} is not that of a matrix with all its entries", header.form);
            return refuse(message, "write a matrix of form 2: forms are 1, 2 and 6");
        }
        let columns = columns(file, stored, *encoding)?;
        let extents = check_extents(header.rows, header.columns, columns.count() as u64).map_err(about)?;
        Ok(Rectangular { rows: extents[0], columns: extents[1], entries: columns.into_entries() })
    }

    /// Returns the matrix with this index; `file` must be the file that was scanned.
    ///
    /// # Errors
    /// FB301 for text that cannot be parsed, FB302 for complex and other matrices, FB303 for rows outside the matrix,
    /// FB305 for a matrix that is not square, FB306 for values that are not finite, FB307 for a single triangle, FB312
    /// if there is no nonzero entry.
    pub(crate) fn matrix(&self, file: &InputFile, wanted: usize) -> Result<RawMatrix, Diagnostic> {
        let Some((stored, encoding)) = self.matrices.get(wanted) else {
            return Err(Diagnostic::new(Code::MatrixSyntax, "the matrix is not in the file"));
        };
        let header = &stored.header;
        let about = |diagnostic: Diagnostic| diagnostic.about(&header.name);
        if !header.is_real() {
            let message = format!("type {} is complex", header.kind);
            let help = "write real matrices, without structural damping";
            return Err(about(Diagnostic::new(Code::MatrixKind, message).with_help(help)));
        }
        let columns = columns(file, stored, *encoding)?;
        if !matches!(header.form, 1 | 2 | 6) {
            let message = format!("form {} is not that of a symmetric matrix", header.form);
            return Err(about(
                Diagnostic::new(Code::MatrixKind, message)
                    .with_help("write a matrix of form 6: forms are 1, 2 and 6"),
            ));
        }
        let n = check_size(header.rows, header.columns, columns.count() as u64).map_err(about)?;
        let triangle = undeclared_triangle(columns.sides(), |_| "write the whole matrix".into());
        if let Some(triangle) = triangle {
            return Err(about(triangle));
        }
        let written = columns.written;
        let raw = columns.into_matrix(n, stored.ascending, file.path())?;
        // Nastran with words of eight bytes also declares single precision, but writes all digits of its numbers.
        let is_single = header.is_single() && written <= PADDED_DIGITS;
        let digits = if is_single { raw.digits.min(SINGLE_DIGITS) } else { raw.digits };
        Ok(RawMatrix { digits, ..raw })
    }
}

/// Reads the matrix `name`, or the only one of the file, which need not be square.
///
/// # Errors
/// FB310 if there is no such matrix, the errors of [`Contents::of`] and of the matrix.
fn read_rectangular(file: &InputFile, name: Option<&str>) -> Result<Rectangular, Diagnostic> {
    let contents = Contents::of(file)?;
    let wanted = named_or_only(&contents.names(), name)?;
    contents.rectangular(file, wanted)
}

/// Reads all columns of a matrix. Groups of stretches are read in parallel and joined in the order of the file before
/// the next group, so that the entries are in memory once.
fn columns(file: &InputFile, stored: &Stored, encoding: Encoding) -> Result<Columns, Diagnostic> {
    let at_once = 8 * rayon::current_num_threads();
    let mut all = Columns::with_capacity(stored.values);
    for stretches in stored.stretches.chunks(at_once) {
        let read = |stretch: &Stretch| {
            let bytes = &file.bytes()[stretch.bytes.clone()];
            match encoding {
                Encoding::Text(format) => text::columns(bytes, stretch.line, &stored.header, format),
                Encoding::Binary(binary) => binary.columns(bytes, &stored.header),
            }
        };
        for columns in parallel::try_map(stretches, read)? {
            all.append(&columns);
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexbody_linalg::CscMatrix;
    use std::fmt::Write;

    const N: usize = 3000;
    const BAND: usize = 16;

    /// Returns the band of a column: its first row, and its values, which are symmetric and have all digits.
    fn column(j: usize) -> (usize, Vec<f64>) {
        let (first, end) = (j.saturating_sub(BAND), (j + BAND + 1).min(N));
        (first, (first..end).map(|i| ((i * j) as f64).sqrt() + (i + j) as f64 + 1.0).collect())
    }

    fn expected() -> CscMatrix {
        let entries = |j: usize| {
            let (first, values) = column(j);
            values.into_iter().enumerate().map(move |(k, value)| ((first + k) as u32, j as u32, value))
        };
        CscMatrix::from_triplets(N, N, &(0..N).flat_map(entries).collect::<Vec<_>>())
    }

    /// Returns the matrix as text, with its columns in the given order.
    fn text(order: impl Iterator<Item = usize>) -> String {
        let mut text = format!("{N:8}{:8}{:8}{:8}{:8}1P,3E24.16\n", -(N as i64), 6, 2, "KGG");
        for j in order {
            let (first, values) = column(j);
            writeln!(text, "{:8}{:8}{:8}", j + 1, 0, 2 * values.len() + 2).expect("memory");
            writeln!(text, "{:8}{:8}", 2 * values.len() + 1, first + 1).expect("memory");
            for three in values.chunks(3) {
                three.iter().for_each(|value| write!(text, "{value:24.16E}").expect("memory"));
                text.push('\n');
            }
        }
        write!(text, "{:8}{:8}{:8}\n{:24.16E}\n", N + 1, 1, 1, 2f64.sqrt()).expect("memory");
        text
    }

    fn binary() -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut record = |words: &[i32], name: &[u8], values: &[f64]| {
            let mut payload: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            payload.extend_from_slice(name);
            payload.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            let length = (payload.len() as i32).to_le_bytes();
            bytes.extend([&length[..], &payload, &length].concat());
        };
        let n = N as i32;
        record(&[n, -n, 6, 2], b"KGG     ", &[]);
        for j in 0..N {
            let (first, values) = column(j);
            let words = 2 * values.len() as i32;
            record(&[j as i32 + 1, 0, words + 2, words + 1, first as i32 + 1], b"", &values);
        }
        record(&[n + 1, 1, 2], b"", &[2f64.sqrt()]);
        bytes
    }

    fn read(bytes: &[u8], threads: usize) -> Result<RawMatrix, Diagnostic> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("job.op4");
        std::fs::write(&path, bytes).expect("written");
        let file = InputFile::open(&path).expect("a file");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| Contents::of(&file)?.matrix(&file, 0))
    }

    #[test]
    fn a_matrix_of_many_stretches_is_the_same_on_any_number_of_threads_and_in_any_order_of_columns() {
        let (expected, upright, reversed) = (expected(), text(0..N), text((0..N).rev()));
        assert!(upright.len() > 2 << 20, "more than two stretches");
        for threads in [1, 3] {
            for bytes in [upright.as_bytes(), reversed.as_bytes(), &binary()] {
                let raw = read(bytes, threads).expect("read");
                assert_eq!((&raw.matrix, raw.digits), (&expected, 17));
            }
        }
    }

    #[test]
    fn shapes_are_read_as_an_array() {
        let mut text = format!("{:8}{:8}{:8}{:8}{:8}1P,3E24.16\n", 3, -5, 2, 2, "PHIG");
        for (column, values) in
            [[1.0, 0.5, 0.0, -2.0, 4.0], [0.0, 3.0, 0.25, 0.0, 1.0], [7.0; 5]].iter().enumerate()
        {
            writeln!(text, "{:8}{:8}{:8}\n{:8}{:8}", column + 1, 0, 12, 11, 1).expect("memory");
            for three in values.chunks(3) {
                three.iter().for_each(|value| write!(text, "{value:24.16E}").expect("memory"));
                text.push('\n');
            }
        }
        write!(text, "{:8}{:8}{:8}\n{:24.16E}\n", 4, 1, 1, 2f64.sqrt()).expect("memory");
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("job.op4");
        std::fs::write(&path, text).expect("written");
        let location = crate::model_files::MatrixLocation::parse(format!("{}:/PHIG", path.display()));
        let shapes = crate::shapes::read_shapes(&location, &[5], "shapes").expect("shapes");
        assert_eq!((shapes.matrix.nrows(), shapes.matrix.ncols()), (5, 3));
        assert_eq!(shapes.matrix.col_as_slice(0), [1.0, 0.5, 0.0, -2.0, 4.0]);
        assert_eq!(shapes.matrix.col_as_slice(1), [0.0, 3.0, 0.25, 0.0, 1.0]);
    }

    #[test]
    fn a_bad_number_is_told_with_its_line_in_the_whole_file() {
        let text = text(0..N);
        let lines: Vec<&str> = text.lines().collect();
        // The first line of values of the last column but one.
        let bad = lines.len() - 2 - 2 * (2 + (BAND + 1).div_ceil(3)) + 2;
        for (number, code) in [("x", Code::MatrixSyntax), ("NaN", Code::MatrixNotFinite)] {
            let mut lines = lines.clone();
            let changed = lines[bad].replace(&lines[bad][..24], &format!("{number:>24}"));
            lines[bad] = &changed;
            for threads in [1, 3] {
                let found = read((lines.join("\n") + "\n").as_bytes(), threads).expect_err("refused");
                assert_eq!((found.code(), found.line()), (code, Some(bad + 1)), "{found}");
            }
        }
    }

    #[test]
    fn a_line_that_is_too_short_is_told_with_its_line_in_the_whole_file() {
        let text = text(0..N);
        let line = text.lines().count() - 4;
        let short: Vec<&str> = text
            .lines()
            .enumerate()
            .map(|(k, text_of_line)| if k == line { &text_of_line[..30] } else { text_of_line })
            .collect();
        let found = read(short.join("\n").as_bytes(), 2).expect_err("refused");
        assert_eq!((found.code(), found.line()), (Code::MatrixSyntax, Some(line + 1)), "{found}");
    }
}
