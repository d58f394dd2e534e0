//! Banner, comments and size line.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::scanner::{Line, Lines, excerpt, words};

/// Entries of the matrix that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Symmetry {
    /// One triangle of a symmetric matrix.
    Symmetric,
    /// All entries.
    General,
}

/// Sizes and symmetry stated in the header of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Header {
    pub integer: bool,
    pub symmetry: Symmetry,
    pub rows: u64,
    pub cols: u64,
    pub entries: u64,
}

const BANNER: &[u8] = b"%%MatrixMarket";

/// Returns true when the text begins with the banner, in any case.
pub(super) fn has_banner(text: &[u8]) -> bool {
    without_bom(text).get(..BANNER.len()).is_some_and(|start| start.eq_ignore_ascii_case(BANNER))
}

fn without_bom(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

/// Returns the header, and its numbers of bytes and lines.
pub(super) fn parse(text: &[u8]) -> Result<(Header, usize, usize), Vec<Diagnostic>> {
    let mut lines = Lines::of(text);
    let first = lines.next().map_or(&b""[..], |line| line.text);
    let (integer, symmetry) = banner(without_bom(first))?;
    while let Some(Line { number, text: line }) = lines.next() {
        let line = line.trim_ascii_start();
        if line.is_empty() || line.starts_with(b"%") {
            continue;
        }
        let numbers: Vec<Option<u64>> = words(line).map(size).collect();
        let &[Some(rows), Some(cols), Some(entries)] = numbers.as_slice() else {
            let message = format!("size line is `{}`, expected rows, columns and entries", excerpt(line));
            return Err(vec![Diagnostic::new(Code::MatrixSyntax, message).at_line(number)]);
        };
        return Ok((Header { integer, symmetry, rows, cols, entries }, lines.at, number));
    }
    let message = "file ends before the line with rows, columns and entries";
    Err(vec![Diagnostic::new(Code::MatrixSyntax, message).at_line(lines.number)])
}

/// Parses a whole number.
pub(super) fn size(field: &[u8]) -> Option<u64> {
    std::str::from_utf8(field).ok()?.parse().ok()
}

/// Returns field type and symmetry of the banner. The error names every unsupported property.
fn banner(line: &[u8]) -> Result<(bool, Symmetry), Vec<Diagnostic>> {
    let shown = excerpt(line.trim_ascii());
    if !has_banner(line) {
        let message =
            format!("first line is `{shown}`, expected `%%MatrixMarket matrix coordinate real symmetric`");
        let help = "CalculiX and Abaqus write `row column value` without a header: convert their deck (.inp) with the matrices beside it";
        return Err(vec![Diagnostic::new(Code::MatrixSyntax, message).at_line(1).with_help(help)]);
    }
    let words: Vec<String> =
        String::from_utf8_lossy(line).split_whitespace().map(str::to_lowercase).collect();
    let &[_, object, format, field, symmetry] =
        words.iter().map(String::as_str).collect::<Vec<_>>().as_slice()
    else {
        let message = format!("first line is `{shown}`, expected five words");
        return Err(vec![Diagnostic::new(Code::MatrixSyntax, message).at_line(1)]);
    };
    let mut found = Vec::new();
    let mut refuse = |what: &str, word: &str, expected: &str, help: &str| {
        let message = format!("{what} is `{word}`, expected {expected}");
        found.push(Diagnostic::new(Code::MatrixKind, message).at_line(1).with_help(help));
    };
    if object != "matrix" {
        refuse("object", object, "`matrix`", "write the matrix");
    }
    if format != "coordinate" {
        refuse(
            "storage",
            format,
            "`coordinate`",
            "write the sparse matrix: row, column and value of each entry",
        );
    }
    let integer = matches!(field, "integer" | "unsigned-integer");
    if !integer && field != "real" {
        let help = match field {
            "complex" => {
                "write the real part; structural damping (an imaginary stiffness) does not belong here"
            }
            "pattern" => "write the values too, not only where they are",
            _ => Code::MatrixKind.help(),
        };
        refuse("field", field, "`real` or `integer`", help);
    }
    let kind = match symmetry {
        "symmetric" => Symmetry::Symmetric,
        "general" => Symmetry::General,
        _ => {
            let help = match symmetry {
                "skew-symmetric" => {
                    "gyroscopic matrices do not belong here: give K and M, which are symmetric"
                }
                _ => "K and M are real and symmetric",
            };
            refuse("symmetry", symmetry, "`symmetric` or `general`", help);
            Symmetry::General
        }
    };
    if found.is_empty() { Ok((integer, kind)) } else { Err(found) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn banner_in_any_case_with_comments_and_blank_lines_after_it() {
        let text =
            b"%%matrixmarket MATRIX Coordinate Real SYMMETRIC\r\n% x\r\n\r\n  %y\r\n 3 3\t4 \r\n1 1 1\r\n";
        let (header, length, lines) = parse(text).unwrap();
        assert_eq!(
            header,
            Header { integer: false, symmetry: Symmetry::Symmetric, rows: 3, cols: 3, entries: 4 }
        );
        assert_eq!(&text[length..], b"1 1 1\r\n");
        assert_eq!(lines, 5);
    }

    #[test]
    fn everything_unsupported_is_named_at_once() {
        let found = parse(b"%%MatrixMarket matrix array complex hermitian\n2 2\n").unwrap_err();
        assert_eq!(found.len(), 3);
        for (diagnostic, word) in found.iter().zip(["array", "complex", "hermitian"]) {
            assert_eq!(diagnostic.code(), Code::MatrixKind);
            assert!(diagnostic.message().contains(word));
        }
    }
}
