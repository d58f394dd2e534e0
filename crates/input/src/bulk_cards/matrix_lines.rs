//! Consecutive DMIG cards of a deck, cut into parts that can be read independently.

use super::{Line, is_begin, is_include, without_comment};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{self, Lines};
use std::ops::Range;

/// Bytes of cards that one thread reads at a time.
const BYTES_PER_TASK: usize = 1 << 20;

/// Lines of consecutive DMIG cards.
pub(crate) struct MatrixLines<'a> {
    pub file: &'a InputFile,
    /// Parts in the order of the file.
    pub parts: Vec<LineRange>,
    /// Last line of the last card, from 1.
    last_line: usize,
}

/// Part of whole cards: the headers of matrices, or columns.
pub(crate) struct LineRange {
    pub bytes: Range<usize>,
    /// Number of lines above the part.
    pub above: usize,
    pub is_header: bool,
}

impl<'a> MatrixLines<'a> {
    /// Finds the cards from the byte `start` of the file on, where a line begins with `above` lines above it. Returns
    /// `None` if that line begins another card.
    pub(super) fn at(file: &'a InputFile, start: usize, above: usize) -> Option<Self> {
        let bytes = file.bytes();
        let (mut parts, mut last_line): (Vec<LineRange>, usize) = (Vec::new(), above);
        let mut lines = Lines::starting_at(bytes, start, above);
        loop {
            let at = lines.at;
            let Some(scanner::Line { number, text: line }) = lines.next() else { break };
            let end = lines.at;
            if begins_matrix(line) {
                let is_header = is_header(line);
                match parts.last_mut() {
                    Some(part) if !is_header && !part.is_header && part.bytes.len() < BYTES_PER_TASK => {
                        part.bytes.end = end;
                    }
                    _ => parts.push(LineRange { bytes: at..end, above: last_line, is_header }),
                }
            } else {
                match parts.last_mut() {
                    Some(part) if continues(line) => part.bytes.end = end,
                    _ => break,
                }
            }
            last_line = number;
        }
        (!parts.is_empty()).then_some(Self { file, parts, last_line })
    }

    /// Returns the byte after the last card, and the number of lines up to there.
    pub(super) fn end(&self) -> (usize, usize) {
        (self.parts.last().map_or(0, |part| part.bytes.end), self.last_line)
    }

    /// Returns true when the last card ends the file without a line end.
    pub(super) fn are_cut_off(&self) -> bool {
        let (end, _) = self.end();
        end == self.file.bytes().len() && !self.file.bytes().ends_with(b"\n")
    }
}

/// Returns true when a line begins a DMIG card.
fn begins_matrix(line: &[u8]) -> bool {
    line.get(..4).is_some_and(|name| name.eq_ignore_ascii_case(b"DMIG"))
        && matches!(Line::of(without_comment(line)).head()[4..], [] | [b'*'])
}

/// Returns true when a card of a matrix is its header: the second field is 0.
fn is_header(line: &[u8]) -> bool {
    let line = Line::of(without_comment(line));
    let columns = if line.head().ends_with(b"*") { 24..40 } else { 16..24 };
    line.part(2, columns) == b"0"
}

/// Returns true when a line continues a card, is empty or is a comment.
fn continues(line: &[u8]) -> bool {
    if matches!(line.first(), Some(b'*' | b'+' | b'$')) {
        return true;
    }
    let bare = line.trim_ascii();
    if bare.is_empty() || bare.starts_with(b"$") {
        return true;
    }
    let line = without_comment(line);
    !is_include(bare) && !is_begin(line) && matches!(Line::of(line).head().first(), None | Some(b'*' | b'+'))
}
