//! Formats of Fortran with one kind of numbers, such as (10I8), (4E20.12) and (1P,5D16.8).

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::scanner::{excerpt, real};

const HELP: &str = "write whole numbers in a format such as (10I8), and values in one such as (4E20.12)";

/// Largest number of columns of a line. Fortran writes at most 1000 or so; a larger number lets a head ask for long lines.
const MAX_COLUMNS: usize = 1 << 16;

/// Format of the numbers of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Format {
    /// Numbers of a line.
    pub per_line: usize,
    /// Columns of a number.
    pub width: usize,
    /// Digits after the decimal point of a number that is written without one.
    decimals: usize,
    /// True if a scale factor other than 0P is stated.
    is_scaled: bool,
}

impl Format {
    /// Returns the formats of starts, rows and values in the fourth line of a head.
    ///
    /// # Errors
    /// FB301 for a line without three formats, or formats with other descriptors.
    pub(super) fn three(line: &[u8]) -> Result<[Self; 3], Diagnostic> {
        let unreadable = || {
            let message = format!("formats are `{}`, expected three", excerpt(line.trim_ascii()));
            Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP)
        };
        let mut rest = std::str::from_utf8(line).map_err(|_| unreadable())?;
        let mut next = || {
            let (text, after) = in_parentheses(rest).ok_or_else(unreadable)?;
            rest = after;
            Self::of(text).ok_or_else(|| {
                let message = format!("format `({text})` is not read");
                Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP)
            })
        };
        Ok([next()?, next()?, next()?])
    }

    /// Parses the text between the parentheses; `None` for other descriptors than one of I, E, D, F, G and P.
    fn of(text: &str) -> Option<Self> {
        let text: String = text.chars().filter(|c| *c != ' ').collect::<String>().to_ascii_uppercase();
        let mut rest = text.as_str();
        let mut is_scaled = false;
        if let Some((scale, after)) = rest.split_once('P') {
            is_scaled = scale.parse::<i8>().ok()? != 0;
            rest = after.strip_prefix(',').unwrap_or(after);
        }
        let (count, after) = leading(rest);
        let mut per_line = if count.is_empty() { 1 } else { count.parse().ok()? };
        rest = after;
        // A repeated group: 3(E23.15).
        if let Some(group) = rest.strip_prefix('(') {
            let (inner, after) = leading(group.strip_suffix(')')?);
            if !inner.is_empty() {
                per_line = usize::checked_mul(per_line, inner.parse().ok()?)?;
            }
            rest = after;
        }
        let is_whole = rest.starts_with('I');
        let letters =
            ["ES", "EN", "E", "D", "F", "G", "I"].into_iter().find_map(|name| rest.strip_prefix(name));
        let (width, after) = leading(letters?);
        let width: usize = width.parse().ok()?;
        let decimals = match after.strip_prefix('.') {
            Some(after) => {
                let (decimals, exponent) = leading(after);
                let digits = exponent.strip_prefix('E').unwrap_or(exponent);
                let is_known =
                    leading(digits).1.is_empty() && (exponent.is_empty() || exponent.starts_with('E'));
                decimals.parse().ok().filter(|_| is_known)?
            }
            None if after.is_empty() => 0,
            None => return None,
        };
        let columns = usize::checked_mul(per_line, width)?;
        let is_valid = (1..=MAX_COLUMNS).contains(&columns) && !(is_whole && is_scaled);
        // Of a whole number Iw.m the m is a number of digits, not of decimals.
        let decimals = if is_whole { 0 } else { decimals };
        is_valid.then_some(Self { per_line, width, decimals, is_scaled })
    }

    /// Returns the number in a field.
    ///
    /// # Errors
    /// FB301 for a field that is no number, or one whose value depends on the format: Fortran puts a decimal point into
    /// numbers without one, and divides numbers without an exponent by the power of ten of a scale factor, while other
    /// programs do neither.
    pub(super) fn value(self, field: &[u8]) -> Result<f64, Diagnostic> {
        let wrong = |what: &str| {
            let message = format!("value `{}` {what}", excerpt(field));
            Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP)
        };
        let value = real(field).ok_or_else(|| wrong("is not a number"))?;
        if value == 0.0 || !value.is_finite() {
            return Ok(value);
        }
        if self.decimals > 0 && !field.contains(&b'.') {
            return Err(wrong("has no decimal point, where its format would put one"));
        }
        let has_exponent = field[1..].iter().any(|byte| !byte.is_ascii_digit() && *byte != b'.');
        if self.is_scaled && !has_exponent {
            return Err(wrong("has no exponent, but its format has a scale factor"));
        }
        Ok(value)
    }
}

/// Returns the text between the first parenthesis and its partner, and the text behind it.
fn in_parentheses(text: &str) -> Option<(&str, &str)> {
    let text = text.trim_start().strip_prefix('(')?;
    let mut depth = 1;
    let end = text.find(|c| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        depth == 0
    })?;
    Some((&text[..end], &text[end + 1..]))
}

/// Splits a text behind its leading digits.
fn leading(text: &str) -> (&str, &str) {
    text.split_at(text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_of_fortran() {
        let format = |per_line, width, decimals, is_scaled| Format { per_line, width, decimals, is_scaled };
        for (text, expected) in [
            ("10I8", format(10, 8, 0, false)),
            ("I8", format(1, 8, 0, false)),
            ("16i5.2", format(16, 5, 0, false)),
            ("4E20.12", format(4, 20, 12, false)),
            ("1P,4E20.12", format(4, 20, 12, true)),
            ("1P4D20.12", format(4, 20, 12, true)),
            ("0P5F15.8", format(5, 15, 8, false)),
            ("3(E26.18E3)", format(3, 26, 18, false)),
            ("1p, 3es24.16", format(3, 24, 16, true)),
            ("5G15.0", format(5, 15, 0, false)),
        ] {
            assert_eq!(Format::of(text), Some(expected), "{text}");
        }
        for text in [
            "",
            "10",
            "10X8",
            "10I",
            "0I8",
            "I0",
            "1P10I8",
            "4(E20.12,1X)",
            "4E20.12,1X",
            "99999999999E8.1",
            "4E20.",
            "2(3(E8.1))",
            "4E99999.1",
            "XP4E20.12",
        ] {
            assert_eq!(Format::of(text), None, "{text}");
        }
        assert!(Format::three(b"(16I5)          (16I5)").is_err());
        assert!(Format::three(b"(16I5)(16I5)((3E26.18)").is_err());
        assert!(Format::three(b"(16I5)          (10I8)          (1P,(3E26.18))      ").is_ok());
    }

    #[test]
    fn a_value_that_depends_on_its_format_is_refused() {
        let [plain, scaled] = ["4F20.12", "1P,4E20.12"].map(|text| Format::of(text).expect("a format"));
        assert_eq!(plain.value(b"-1.5"), Ok(-1.5));
        assert_eq!(scaled.value(b"-1.5D+01"), Ok(-15.0));
        assert_eq!(scaled.value(b"1.5-101"), Ok(1.5e-101));
        assert_eq!(scaled.value(b"0.0"), Ok(0.0));
        for (format, field) in [(plain, "15"), (scaled, "1.5"), (scaled, "-1.5"), (plain, ""), (plain, "x")] {
            assert!(format.value(field.as_bytes()).is_err(), "{field}");
        }
    }
}
