//! Matrix Market arrays: dense, column by column.

use super::header::{has_banner, size};
use crate::array::Array;
use crate::coordinates::Blocks;
use crate::digits::written_digits;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::memory::{left, refuse_beyond};
use flexbody_base::text::InputFile;
use flexbody_base::text::compression::{Compression, broken};
use flexbody_base::text::scanner::{Line, Lines, excerpt, real, words};

/// Number of values whose written digits are counted.
const MAX_COUNTED_VALUES: usize = 4096;

const HELP: &str = "write the array as Matrix Market array real general: scipy.io.mmwrite of a numpy array";

type Found<T> = Result<T, Vec<Diagnostic>>;

/// Reads an array of real numbers.
pub(crate) fn read_array(file: &InputFile, compression: Compression) -> Found<Array> {
    let damaged = |e: std::io::Error| vec![broken(file.path(), &e)];
    let mut blocks = Blocks::of(file, compression);
    let mut reading = ArrayReader::default();
    while let Some(block) = blocks.next().map_err(damaged)? {
        for Line { number, text } in Lines::below(&block, reading.line) {
            reading.line = number;
            let line = text.trim_ascii_start();
            if reading.line == 1 {
                banner(line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line))?;
            } else if !line.is_empty() && !line.starts_with(b"%") {
                reading.content(line).map_err(|diagnostic| vec![diagnostic.at_line(reading.line)])?;
            }
        }
    }
    reading.finish().map_err(|diagnostic| vec![diagnostic])
}

fn banner(line: &[u8]) -> Found<()> {
    let text = String::from_utf8_lossy(line).to_lowercase();
    let kinds: Vec<&str> = text.split_whitespace().collect();
    if !has_banner(line) || kinds.len() != 5 {
        let message =
            format!("first line is `{}`, expected `%%MatrixMarket matrix array real general`", excerpt(line));
        return Err(vec![Diagnostic::new(Code::MatrixSyntax, message).at_line(1)]);
    }
    let expected: [(&str, &[&str], &str); 4] = [
        ("object", &["matrix"], "write the array"),
        ("storage", &["array"], "write a dense array: scipy.io.mmwrite of a numpy array"),
        ("field", &["real", "integer"], "write real numbers"),
        ("symmetry", &["general"], "write all values"),
    ];
    let wrong = expected.iter().zip(&kinds[1..]).filter(|((_, allowed, _), word)| !allowed.contains(word));
    let found: Vec<Diagnostic> = wrong
        .map(|((what, allowed, help), word)| {
            let message =
                format!("{what} is `{}`, expected `{}`", word.escape_default(), allowed.join("` or `"));
            Diagnostic::new(Code::MatrixKind, message).at_line(1).with_help(*help)
        })
        .collect();
    if found.is_empty() { Ok(()) } else { Err(found) }
}

/// State of reading below the first line.
#[derive(Default)]
struct ArrayReader {
    line: usize,
    /// Number of rows, number of columns and their product.
    size: Option<(usize, usize, usize)>,
    values: Vec<f64>,
    written: u8,
}

impl ArrayReader {
    fn content(&mut self, line: &[u8]) -> Result<(), Diagnostic> {
        let content = line.split(|&b| b == b'%').next().unwrap_or(line);
        let mut fields = words(content);
        let Some((_, _, count)) = self.size else {
            let numbers: Vec<Option<u64>> = fields.take(3).map(size).collect();
            let extents = match *numbers.as_slice() {
                [Some(rows), Some(cols)] => usize::try_from(rows).ok().zip(usize::try_from(cols).ok()),
                _ => None,
            };
            self.size = extents.and_then(|(rows, cols)| Some((rows, cols, rows.checked_mul(cols)?)));
            let message = || format!("size line is `{}`, expected rows and columns", excerpt(line));
            let Some((_, _, count)) = self.size else {
                return Err(Diagnostic::new(Code::MatrixSyntax, message()).with_help(HELP));
            };
            let (what, needed) =
                (format!("an array of {count} values"), count as f64 * size_of::<f64>() as f64);
            let refused = refuse_beyond(left(), needed, &what, "use a larger machine");
            return refused.map_err(|error| error.first_error().clone());
        };
        fields.try_for_each(|field| {
            let value = real(field).ok_or_else(|| {
                let message = format!("value `{}` is not a number", excerpt(field));
                Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP)
            })?;
            if self.values.len() == count {
                let message = format!("header announces {count} values, the file has more");
                return Err(Diagnostic::new(Code::MatrixCount, message));
            }
            if self.values.len() < MAX_COUNTED_VALUES && value != 0.0 {
                self.written = self.written.max(written_digits(field));
            }
            self.values.push(value);
            Ok(())
        })
    }

    fn finish(self) -> Result<Array, Diagnostic> {
        let Some((rows, cols, count)) = self.size else {
            return Err(Diagnostic::new(
                Code::MatrixSyntax,
                "file ends before the line with rows and columns",
            ));
        };
        if self.values.len() < count {
            let message = format!("header announces {count} values, the file has {}", self.values.len());
            return Err(Diagnostic::new(Code::MatrixCount, message));
        }
        Ok(Array { rows, cols, row_major: false, values: self.values, digits: self.written.max(1) })
    }
}
