//! Lines `row column value`: the body of Matrix Market files, and all of what some FE programs write.
//!
//! The text is cut at line ends into pieces that are parsed in parallel; pieces keep the order of the file.

use super::assemble::{Entry, Sides};
use super::compression::{Compression, broken};
use super::digits::{COUNTED, written_digits};
use super::reader::MatrixSource;
use crate::base::diagnostic::Diagnostic;
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::Read;

mod line;
mod text;

use line::BadLine;
pub(in crate::input) use line::{Limits, real};
pub(in crate::input) use text::{Blocks, line_aligned, lines, most_entries};

/// Number of bad lines that are reported one by one.
const SHOWN: usize = 5;

/// The entries of a file, and what is wrong with its lines.
pub(super) struct Coordinates {
    limits: Limits,
    /// Number of entries that the file announces, if it does.
    announced: Option<u64>,
    /// The entries in file order.
    pub pieces: Vec<Vec<Entry>>,
    /// Data lines so far, bad ones included.
    pub count: u64,
    /// Lines of the file so far.
    lines: usize,
    bad: Vec<BadLine>,
    bad_count: usize,
    /// First line with an entry below the diagonal.
    pub lower: Option<usize>,
    /// First line with an entry above the diagonal.
    pub upper: Option<usize>,
    /// Largest number of significant digits of a value as written.
    pub written: u8,
}

impl Coordinates {
    /// Nothing yet, below so many `lines` of a header.
    pub(super) fn new(limits: Limits, announced: Option<u64>, lines: usize) -> Self {
        Self {
            limits,
            announced,
            pieces: Vec::new(),
            count: 0,
            lines,
            bad: Vec::new(),
            bad_count: 0,
            lower: None,
            upper: None,
            written: 0,
        }
    }

    /// Reads the rest of a file: what follows the first `skip` bytes of the block `first`, and all `blocks`
    /// after it. Says whether the file ends with a line end.
    ///
    /// # Errors
    /// FB103 for a compressed file that is damaged.
    pub(super) fn read<'a>(
        &mut self,
        source: &MatrixSource<'a>,
        mut blocks: Blocks<'a>,
        first: Cow<'a, [u8]>,
        skip: usize,
    ) -> Result<bool, Vec<Diagnostic>> {
        let mut next = || blocks.next().map_err(|e| vec![broken(source.file.path(), &e)]);
        let (mut block, mut skip, mut given) = (first, skip, 0);
        loop {
            // The next block is unpacked while this one is parsed.
            let (following, ()) = rayon::join(&mut next, || self.parse(&block[skip..]));
            if source.compression == Compression::None {
                source.file.release(given..given + block.len());
                given += block.len();
            }
            match following? {
                Some(following) => (block, skip) = (following, 0),
                None => return Ok(blocks.ends_with_newline()),
            }
        }
    }

    fn parse(&mut self, block: &[u8]) {
        let pieces: Vec<&[u8]> = line_aligned(block).collect();
        let parsed: Vec<line::Piece> =
            pieces.into_par_iter().map(|piece| line::parse(piece, self.limits)).collect();
        for piece in parsed {
            let before = self.lines;
            self.count += (piece.entries.len() + piece.bad_count) as u64;
            self.bad_count += piece.bad_count;
            let room = SHOWN.saturating_sub(self.bad.len());
            self.bad.extend(piece.bad.into_iter().take(room).map(|b| BadLine { line: b.line + before, ..b }));
            self.lower = self.lower.or(piece.lower.map(|line| line + before));
            self.upper = self.upper.or(piece.upper.map(|line| line + before));
            self.written = self.written.max(piece.written);
            self.lines += piece.lines;
            // A compressed file may hold any number of lines: keep no more than the header announces.
            if self.announced.is_none_or(|announced| self.count <= announced) {
                self.pieces.push(piece.entries);
            } else {
                self.pieces.clear();
            }
        }
    }

    /// On which sides of the diagonal entries lie.
    pub(super) fn sides(&self) -> Sides {
        Sides { lower: self.lower.is_some(), upper: self.upper.is_some() }
    }

    /// The bad lines, the first few one by one.
    pub(super) fn bad_lines(&self, ends_with_newline: bool) -> Vec<Diagnostic> {
        let more = self.bad_count - self.bad.len();
        let told = |(k, bad): (usize, &BadLine)| {
            let mut message = bad.message.clone();
            if bad.line == self.lines && !ends_with_newline {
                message += "; it is the last line and has no line end: the file may be cut off";
            }
            if k + 1 == SHOWN && more > 0 {
                message += &format!(" ({more} more lines are bad)");
            }
            let diagnostic = Diagnostic::new(bad.code, message).at_line(bad.line);
            match bad.help {
                Some(help) => diagnostic.with_help(help),
                None => diagnostic,
            }
        };
        self.bad.iter().enumerate().map(told).collect()
    }
}

/// A line, or its begin, printable.
pub(in crate::input) fn excerpt(line: &[u8]) -> String {
    const SHOWN: usize = 60;
    match std::str::from_utf8(line) {
        Ok(text) if text.len() <= SHOWN && !text.contains(|c: char| c.is_control() && c != '\t') => {
            text.to_owned()
        }
        _ if line.len() <= SHOWN => line.escape_ascii().to_string(),
        _ => format!("{}...", line[..SHOWN].escape_ascii()),
    }
}
