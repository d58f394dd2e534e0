//! Numbers at the end of a file without a last line end: digits may be missing, which no later check sees.

use super::scanner::number;
use crate::diagnostic::{Code, Diagnostic};

/// Number of rows above the last one that show a fixed number of decimals.
const MIN_ROWS_ALIKE: usize = 2;

/// Number of characters behind the decimal point that equal numbers of rows have by intent, not by chance.
const MIN_DECIMALS: usize = 3;

/// Last fields of the rows of a table.
#[derive(Debug, Default)]
pub(super) struct LastFields<'a> {
    rows: usize,
    line: usize,
    last: &'a [u8],
    /// Number of characters behind the decimal point in all rows above the last; `None` if they differ or have no point.
    decimals: Option<usize>,
}

impl<'a> LastFields<'a> {
    /// Adds the last field of a row.
    pub(super) fn row(&mut self, line: usize, field: &'a [u8]) {
        match self.rows {
            0 => {}
            1 => self.decimals = decimals(self.last),
            _ => self.decimals = self.decimals.filter(|known| decimals(self.last) == Some(*known)),
        }
        self.rows += 1;
        (self.line, self.last) = (line, field);
    }

    /// Returns the diagnostic for a `text` that may end within the number of its last row: it has no last line end, and the
    /// numbers above do not show by their fixed number of decimals that this one is whole.
    pub(super) fn cut_off(&self, text: &[u8], code: Code) -> Option<Diagnostic> {
        let ends_in_field = !self.last.is_empty() && text.ends_with(self.last);
        let fixed = self.decimals.filter(|count| *count >= MIN_DECIMALS && self.rows > MIN_ROWS_ALIKE);
        let is_whole = fixed.is_some() && decimals(self.last) == fixed;
        if !ends_in_field || is_whole || number(self.last).is_none() {
            return None;
        }
        let message =
            "the file may end within its last number: unlike the others, the last line has no line end";
        let help = "write or transfer the file again; if it is whole, end the last line";
        Some(Diagnostic::new(code, message).at_line(self.line).with_help(help))
    }
}

/// Returns the number of characters behind the decimal point, with those of an exponent.
fn decimals(number: &[u8]) -> Option<usize> {
    number.iter().position(|byte| *byte == b'.').map(|point| number.len() - point - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_cut_off(text: &str) -> bool {
        let mut fields = LastFields::default();
        text.lines().enumerate().for_each(|(at, line)| {
            fields.row(at + 1, line.rsplit(',').next().expect("a field").trim().as_bytes());
        });
        fields.cut_off(text.as_bytes(), Code::TableRow).is_some()
    }

    #[test]
    fn a_last_number_without_a_line_end_is_whole_only_by_the_decimals_of_all() {
        // Ended lines, and a separator or a blank behind the number.
        assert!(!is_cut_off("1,2.5\n2,3\n") && !is_cut_off("1,2.5\n2,3\r\n") && !is_cut_off("1,2.5\n2,3 "));
        // Numbers of any length: 4, 8, 12 less a digit, and decimals that are equal by chance.
        assert!(is_cut_off("4\n8\n1") && is_cut_off("0.125\n0.25\n0.5") && is_cut_off("0.5\n1.5\n2.2"));
        // Fixed decimals: whole, less a digit, longer before the point, and with exponents.
        assert!(!is_cut_off("1,2.500\n2,3.250\n3,4.750") && is_cut_off("1,2.500\n2,3.250\n3,4.75"));
        assert!(!is_cut_off("1.500\n-2.500\n12.500"));
        assert!(!is_cut_off("1.00e-12\n2.00e-12\n3.00e-12") && is_cut_off("1.00e-12\n2.00e-12\n3.00e-1"));
        // One row above the last shows nothing; texts are not judged.
        assert!(is_cut_off("25.125\n28.125") && !is_cut_off("1,mm\n2,mm\n3,m"));
    }
}
