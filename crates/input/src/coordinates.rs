//! Lines `row column value`: the body of Matrix Market files, and the complete matrix files of some FE programs.
//!
//! The text is cut at line ends into pieces that are parsed in parallel. Pieces keep the order of the file.

use super::assemble::{Entry, Sides, check_size, refuse_beyond_memory};
use super::digits::{COUNTED, written_digits};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::compression::{Compression, broken};
use flexbody_base::text::scanner::BadLines;
use flexbody_linalg::parallel;
use std::io::Read;
use std::path::Path;

mod line;
mod text;

pub(crate) use line::Limits;
pub(crate) use text::{Blocks, line_aligned, most_entries};

/// Entries of a file, and the problems of its lines.
pub(super) struct Coordinates {
    limits: Limits,
    /// Number of entries that the file announces, if it does.
    announced: Option<u64>,
    /// Entries in file order.
    pub pieces: Vec<Vec<Entry>>,
    /// Number of data lines so far, bad ones included.
    pub count: u64,
    /// True if reading ended because of too many entries.
    pub stopped: bool,
    /// Number of lines of the file so far.
    lines: usize,
    bad: BadLines,
    /// First line with an entry below the diagonal.
    pub lower: Option<usize>,
    /// First line with an entry above the diagonal.
    pub upper: Option<usize>,
    /// Largest number of significant digits of a value as written.
    pub written: u8,
}

impl Coordinates {
    /// Creates an empty list below a header of `lines` lines.
    pub(super) fn new(limits: Limits, announced: Option<u64>, lines: usize) -> Self {
        Self {
            limits,
            announced,
            pieces: Vec::new(),
            count: 0,
            stopped: false,
            lines,
            bad: BadLines::default(),
            lower: None,
            upper: None,
            written: 0,
        }
    }

    /// Reads the rest of a file: the bytes of the block `first` after the first `skip`, and all further `blocks`.
    /// Returns true when the file ends with a line end, or reading stopped at too many entries.
    ///
    /// # Errors
    /// FB103 for a damaged compressed file.
    pub(super) fn read(
        &mut self,
        path: &Path,
        mut blocks: Blocks<'_>,
        first: Vec<u8>,
        skip: usize,
    ) -> Result<bool, Vec<Diagnostic>> {
        let (mut block, mut skip) = (first, skip);
        loop {
            // The next block is read and unpacked while this one is parsed.
            let (following, ()) = parallel::join(|| blocks.next(), || self.parse(&block[skip..]));
            let following = following.map_err(|e| vec![broken(path, &e)]);
            if self.is_too_much()? && !matches!(following, Ok(None)) {
                self.stopped = true;
                return Ok(true);
            }
            match following? {
                Some(following) => blocks.take_back(std::mem::replace(&mut block, following)),
                None => return Ok(blocks.ends_with_newline()),
            }
            skip = 0;
        }
    }

    /// Returns true when there are more entries than the file announces.
    ///
    /// # Errors
    /// FB601 or the errors of [`check_size`] if the number of entries is not announced and exceeds the memory or that
    /// of any matrix.
    fn is_too_much(&self) -> Result<bool, Vec<Diagnostic>> {
        if let Some(announced) = self.announced {
            return Ok(self.count > announced);
        }
        let (n, entries) = (u64::from(self.limits.n), self.count - self.bad.count() as u64);
        let fits = check_size(n, n, entries.max(n)).and_then(|_| refuse_beyond_memory(entries));
        fits.map(|()| false).map_err(|diagnostic| vec![diagnostic])
    }

    fn parse(&mut self, block: &[u8]) {
        let parsed = parallel::map(line_aligned(block), |piece| line::parse(piece, self.limits));
        for piece in parsed {
            let before = self.lines;
            self.count += (piece.entries.len() + piece.bad.count()) as u64;
            self.bad.append(piece.bad, before);
            self.lower = self.lower.or(piece.lower.map(|line| line + before));
            self.upper = self.upper.or(piece.upper.map(|line| line + before));
            self.written = self.written.max(piece.written);
            self.lines += piece.lines;
            // A compressed file may hold any number of lines: no more are kept than the header announces.
            if self.announced.is_none_or(|announced| self.count <= announced) {
                let mut entries = piece.entries;
                // Lines without an entry leave unused capacity.
                if entries.capacity() > 2 * entries.len() {
                    entries.shrink_to_fit();
                }
                if !entries.is_empty() {
                    self.pieces.push(entries);
                }
            } else {
                self.pieces.clear();
            }
        }
    }

    /// Returns the sides of the diagonal on which entries lie.
    pub(super) fn sides(&self) -> Sides {
        Sides { lower: self.lower.is_some(), upper: self.upper.is_some() }
    }

    /// Returns diagnostics of the bad lines, the first few one by one.
    pub(super) fn bad_lines(&self, ends_with_newline: bool) -> Vec<Diagnostic> {
        let located = |bad: Diagnostic| {
            if ends_with_newline || bad.line() != Some(self.lines) {
                return bad;
            }
            let message = format!(
                "{}; it is the last line and has no line end: the file may be cut off",
                bad.message()
            );
            Diagnostic::new(bad.code(), message).at_line(self.lines).with_help(bad.help())
        };
        let bad = self.bad.clone().into_diagnostics(Code::MatrixSyntax, "line");
        bad.into_iter().map(located).collect()
    }
}
