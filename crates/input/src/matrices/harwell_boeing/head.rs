//! The head of Harwell-Boeing and Rutherford-Boeing files: a title, the numbers of lines, the kind and the sizes of the
//! matrix, the formats, and for right-hand sides a fifth line.

use super::format::Format;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::scanner::{Lines, excerpt, whole, words};

/// Help for messages about the form of a file.
pub(super) const HELP: &str =
    "write the matrix again, or as Matrix Market: scipy.io.mmwrite(file, scipy.io.hb_read(old))";

/// Number of the line with kind and sizes.
pub(super) const SIZES_LINE: usize = 3;

/// Part of a file below its head.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// Starts of the columns.
    Starts,
    /// Rows of the entries.
    Rows,
    /// Values of the entries.
    Values,
}

impl Part {
    /// Returns the name of the numbers of the part.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Starts => "starts of the columns",
            Self::Rows => "rows",
            Self::Values => "values",
        }
    }
}

/// Head of a matrix of real numbers that lists its entries.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Head {
    /// True if one triangle of a symmetric matrix is stored.
    pub is_symmetric: bool,
    pub rows: u64,
    pub columns: u64,
    pub entries: u64,
    /// Formats of the parts, in their order.
    formats: [Format; 3],
}

/// Returns true when a text begins with a head.
pub(super) fn begins(head: &[u8]) -> bool {
    let mut lines = Lines::of(head).skip(1).map(|line| line.text);
    let [Some(counts), Some(sizes), Some(formats)] = std::array::from_fn(|_| lines.next()) else {
        return false;
    };
    let are_counts = |text: &[u8], least: usize| {
        words(text).take(6).all(|word| whole(word).is_some()) && words(text).count() >= least
    };
    are_counts(counts, 4)
        && kind(sizes).is_some_and(|(_, sizes)| are_counts(sizes, 3))
        && formats.trim_ascii_start().starts_with(b"(")
}

/// Returns the three letters of the kind in upper case, and the text after them.
fn kind(line: &[u8]) -> Option<([u8; 3], &[u8])> {
    let (letters, rest) = line.trim_ascii_start().split_first_chunk::<3>()?;
    let letters = letters.map(|letter| letter.to_ascii_uppercase());
    let [values, symmetry, storage] = letters;
    let is_kind = b"RCPIQ".contains(&values) && b"SUHZR".contains(&symmetry) && b"AE".contains(&storage);
    (is_kind && rest.first() == Some(&b' ')).then_some((letters, rest))
}

impl Head {
    /// Reads the head from the first lines of a file.
    ///
    /// # Errors
    /// FB301 for a head that cannot be read, FB302 for a matrix that is not read, FB304 for numbers of lines that do not
    /// fit.
    pub(super) fn read(lines: &mut Lines<'_>) -> Result<Self, Diagnostic> {
        let mut line = |what: &str| {
            lines.next().map(|line| line.text).ok_or_else(|| syntax(format!("file ends before {what}")))
        };
        line("its title")?;
        let counts = counts(line("the numbers of its lines")?, 4)?;
        let text = line("kind and sizes of its matrix")?;
        let Some((letters, sizes)) = kind(text) else {
            let message = format!("line is `{}`, expected a kind such as RSA, and sizes", excerpt(text));
            return Err(syntax(message));
        };
        let is_symmetric = check_kind(letters)?;
        let sizes = self::counts(sizes, 3)?;
        let formats = Format::three(line("its formats")?)?;
        if counts.get(4).is_some_and(|count| *count > 0) {
            line("the format of its right-hand sides")?;
        }
        let head = Self { is_symmetric, rows: sizes[0], columns: sizes[1], entries: sizes[2], formats };
        head.check_lines(&counts)?;
        Ok(head)
    }

    /// Returns the format of a part.
    pub(super) fn format(&self, part: Part) -> Format {
        self.formats[part as usize]
    }

    /// Compares the numbers of lines that the head states with the lines that the numbers take in their formats.
    fn check_lines(&self, counts: &[u64]) -> Result<(), Diagnostic> {
        let numbers = [self.columns.saturating_add(1), self.entries, self.entries];
        for ((part, numbers), stated) in
            [Part::Starts, Part::Rows, Part::Values].into_iter().zip(numbers).zip(&counts[1..])
        {
            let lines = numbers.div_ceil(self.format(part).per_line as u64);
            if lines != *stated {
                let message = format!(
                    "head states {stated} lines of {}, but {numbers} numbers in their format take {lines}",
                    part.name()
                );
                return Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP));
            }
        }
        Ok(())
    }
}

/// Returns true for a symmetric matrix.
///
/// # Errors
/// FB302 for a kind of matrices that is not read.
fn check_kind(letters: [u8; 3]) -> Result<bool, Diagnostic> {
    let [values, symmetry, storage] = letters;
    let not_read = match (values, symmetry, storage) {
        (b'P', ..) => {
            Some(("stores no values, only where the entries are", "write the values too (RSA or RUA)"))
        }
        (b'C', ..) => Some((
            "is complex",
            "write the real part; structural damping (an imaginary stiffness) does not belong here",
        )),
        (b'Q', ..) => {
            Some(("stores its values in another file", "write the values into the file (RSA or RUA)"))
        }
        (_, b'Z', _) => Some((
            "is skew-symmetric",
            "gyroscopic matrices do not belong here: give K and M, which are symmetric",
        )),
        (_, b'H', _) => Some(("is Hermitian", "K and M are real and symmetric: write RSA or RUA")),
        (.., b'E') => Some(("is stored element by element", "assemble it: write RSA or RUA")),
        _ => None,
    };
    match not_read {
        Some((what, help)) => {
            let message = format!("matrix of the kind {} {what}", String::from_utf8_lossy(&letters));
            Err(Diagnostic::new(Code::MatrixKind, message).with_help(help))
        }
        None => Ok(symmetry == b'S'),
    }
}

/// Returns the whole numbers of a line, at least `least`.
fn counts(line: &[u8], least: usize) -> Result<Vec<u64>, Diagnostic> {
    let count = |word| whole(word).and_then(|count| u64::try_from(count).ok());
    let counts: Option<Vec<u64>> = words(line).take(6).map(count).collect();
    counts.filter(|counts| counts.len() >= least).ok_or_else(|| {
        syntax(format!("line has `{}`, expected at least {least} whole numbers", excerpt(line.trim_ascii())))
    })
}

fn syntax(message: String) -> Diagnostic {
    Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP)
}
