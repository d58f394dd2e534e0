//! Lines `row column value`: the body of Matrix Market files, and the complete matrix files of some FE programs.
//!
//! The text is cut at line ends into pieces that are parsed in parallel. Pieces keep the order of the file.

use super::assemble::{Entry, Sides, check_size, refuse_beyond_memory};
use crate::digits::{COUNTED, written_digits};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::text::compression::{Compression, broken};
use flexbody_base::text::scanner::{BadLines, excerpt, expected, line_end, real, words};
use flexbody_linalg::parallel;
use std::io::Read;
use std::path::Path;

/// Entries of a file, and the problems of its lines.
pub(crate) struct Coordinates {
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
    pub(crate) fn new(limits: Limits, announced: Option<u64>, lines: usize) -> Self {
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
    /// Returns how the file ends; by a line if reading stopped at too many entries.
    ///
    /// # Errors
    /// FB103 for a damaged compressed file, FB304 for a compressed file that unpacks to little but blank lines and
    /// comments, with the bad lines so far.
    pub(crate) fn read(
        &mut self,
        path: &Path,
        mut blocks: Blocks<'_>,
        first: Vec<u8>,
        skip: usize,
    ) -> Diagnosed<TextEnd> {
        let (mut block, mut skip) = (first, skip);
        loop {
            // The next block is read and unpacked while this one is parsed.
            let (following, ()) = parallel::join(|| blocks.next(), || self.parse(&block[skip..]));
            let following = following.map_err(|e| vec![broken(path, &e)]);
            if self.is_too_much()? && !matches!(following, Ok(None)) {
                self.stopped = true;
                return Ok(TextEnd::Line);
            }
            let entries = self.count - self.bad.count() as u64;
            blocks.refuse_filling(entries).map_err(|refused| {
                let mut found = self.bad_lines(TextEnd::Line);
                found.push(refused);
                found
            })?;
            match following? {
                Some(following) => blocks.take_back(std::mem::replace(&mut block, following)),
                None => return Ok(blocks.end()),
            }
            skip = 0;
        }
    }

    /// Returns true when there are more entries than the file announces.
    ///
    /// # Errors
    /// FB601 or the errors of [`check_size`] if the number of entries is not announced and exceeds the memory or that
    /// of any matrix.
    fn is_too_much(&self) -> Diagnosed<bool> {
        if let Some(announced) = self.announced {
            return Ok(self.count > announced);
        }
        let (n, entries) = (u64::from(self.limits.n), self.count - self.bad.count() as u64);
        let fits = check_size(n, n, entries.max(n)).and_then(|_| refuse_beyond_memory(entries));
        fits.map(|()| false).map_err(|diagnostic| vec![diagnostic])
    }

    fn parse(&mut self, block: &[u8]) {
        let parsed = parallel::map(line_aligned(block), |piece| parse_lines(piece, self.limits));
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
    pub(crate) fn sides(&self) -> Sides {
        Sides { lower: self.lower.is_some(), upper: self.upper.is_some() }
    }

    /// Returns diagnostics of the bad lines, the first few one by one.
    pub(crate) fn bad_lines(&self, end: TextEnd) -> Vec<Diagnostic> {
        let located = |bad: Diagnostic| {
            if end == TextEnd::Line || bad.line() != Some(self.lines) {
                return bad;
            }
            let message = format!(
                "{}; it is the last line and has no line end: the file may be cut off",
                bad.message()
            );
            Diagnostic::new(bad.code(), message).at_line(self.lines).with_help(bad.help())
        };
        let bad = self.bad.clone().into_diagnostics(Code::MatrixSyntax, "line");
        // A count that does not fit says more.
        let is_counted = self.announced.is_none_or(|announced| announced == self.count);
        if bad.is_empty() && is_counted && end == TextEnd::Number && self.lines > 1 {
            return vec![cut_off(self.lines)];
        }
        bad.into_iter().map(located).collect()
    }
}

/// Returns the diagnostic for a file whose last line has no line end, while the others have: digits may be missing, which
/// no later check sees.
pub(crate) fn cut_off(line: usize) -> Diagnostic {
    let message = "the file ends within its last number: unlike the others, the last line has no line end";
    Diagnostic::new(Code::MatrixSyntax, message)
        .at_line(line)
        .with_help("write or transfer the file again; if it is whole, end the last line")
}

// Text in blocks that end at line ends, so that at most two blocks of a file are in memory.

/// Bytes per block. Larger blocks would be newly mapped pages each time.
const BLOCK: usize = 8 << 20;

/// Bytes of the first block at the start. It grows with the text, because most files are small.
const FIRST_BLOCK: usize = 1 << 16;

/// Factor by which the first block grows. The allocator keeps the smaller blocks: doubling would leave as much as the
/// largest block again.
const GROWTH: usize = 16;

/// Bytes per piece that one thread parses.
const PIECE: usize = 1 << 20;

/// Number of bytes that any compressed text may unpack to, entries or not. A larger number lets a file of a thousandth of
/// its bytes unpack to as many blanks, for which the reader takes about ten seconds per gigabyte.
const MAX_FILLING: u64 = 16 << 20;

/// Number of bytes for each entry that a compressed text may have besides. Lines of entries have less than 100.
const MAX_ENTRY_BYTES: u64 = 256;

/// End of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TextEnd {
    /// A line end.
    Line,
    /// A digit or a point: further digits may be missing.
    Number,
    Other,
}

/// Source of a text, block by block.
pub(crate) struct Blocks<'a> {
    stream: Box<dyn Read + Send + 'a>,
    /// Beginning of the next line, which was read with the last block.
    carry: Vec<u8>,
    /// Memory of a block that is no longer used.
    spare: Vec<u8>,
    /// Last byte of the text so far.
    last: u8,
    is_packed: bool,
    /// Number of bytes of the blocks so far.
    bytes: u64,
}

impl<'a> Blocks<'a> {
    /// Returns the blocks of the unpacked text of a file.
    pub(crate) fn of(file: &'a InputFile, compression: Compression) -> Self {
        Self::new(compression.stream_of(file), compression)
    }

    fn new(stream: Box<dyn Read + Send + 'a>, compression: Compression) -> Self {
        let is_packed = compression != Compression::None;
        Self { stream, carry: Vec::new(), spare: Vec::new(), last: b'\n', is_packed, bytes: 0 }
    }

    /// Refuses a compressed text that has far more bytes so far than its `entries` take: a small file may unpack to blank
    /// lines and comments without end.
    ///
    /// # Errors
    /// FB304.
    pub(crate) fn refuse_filling(&self, entries: u64) -> Result<(), Diagnostic> {
        let most = entries.saturating_mul(MAX_ENTRY_BYTES).saturating_add(MAX_FILLING);
        if !self.is_packed || self.bytes <= most {
            return Ok(());
        }
        let message = format!(
            "the compressed file unpacks to more than {most} bytes with {entries} values among them: the rest is blank lines and comments"
        );
        let help = "write the file again without them, or unpack it";
        Err(Diagnostic::new(Code::MatrixCount, message).with_help(help))
    }

    /// Returns the next block. It ends at a line end, at the end of the file, or anywhere within a line longer than a
    /// block.
    pub(crate) fn next(&mut self) -> std::io::Result<Option<Vec<u8>>> {
        let mut block = std::mem::take(&mut self.spare);
        let (mut filled, mut ends) = (self.carry.len(), false);
        block.resize(block.len().clamp(FIRST_BLOCK.max(filled), BLOCK.max(filled)), 0);
        block[..filled].copy_from_slice(&self.carry);
        self.carry.clear();
        while !ends && filled < BLOCK {
            if filled == block.len() {
                block.resize((GROWTH * filled).min(BLOCK), 0);
            }
            let count = self.stream.read(&mut block[filled..])?;
            filled += count;
            ends = count == 0;
        }
        let end = whole_lines(&block[..filled], ends);
        self.carry.extend_from_slice(&block[end..filled]);
        block.truncate(end);
        let Some(&last) = block.last() else { return Ok(None) };
        self.last = last;
        self.bytes += block.len() as u64;
        Ok(Some(block))
    }

    /// Takes back the memory of a block that is no longer used.
    pub(crate) fn take_back(&mut self, block: Vec<u8>) {
        self.spare = block;
    }

    /// Returns how the text so far ends.
    pub(crate) fn end(&self) -> TextEnd {
        match self.last {
            b'\n' => TextEnd::Line,
            b'0'..=b'9' | b'.' => TextEnd::Number,
            _ => TextEnd::Other,
        }
    }
}

/// Returns the length of the whole lines of a block: all of it if it ends the file or has no line end.
fn whole_lines(block: &[u8], ends_file: bool) -> usize {
    match block.iter().rposition(|&b| b == b'\n') {
        Some(at) if !ends_file => at + 1,
        _ => block.len(),
    }
}

/// Returns an upper bound of the number of entries in a text: one per line, of which `1 1 1` is the shortest. Entries
/// are held until all are read, so their capacity must not exceed this bound.
pub(crate) fn most_entries(text: &[u8]) -> usize {
    (memchr::memchr_iter(b'\n', text).count() + 1).min(text.len() / 6 + 1)
}

/// Cuts a block at line ends into pieces of about [`PIECE`] bytes.
pub(crate) fn line_aligned(block: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = block;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let target = PIECE.min(rest.len());
        let end = rest[target..].iter().position(|&b| b == b'\n').map_or(rest.len(), |at| target + at + 1);
        let (piece, after) = rest.split_at(end);
        rest = after;
        Some(piece)
    })
}

// Data lines: a fast path for the form of nearly all files, and a slow path that reads every dialect and describes
// errors. The fast path goes from byte to byte, without finding the line and its fields first; the slow path has them
// from the text scanner.

/// Limits from the header that apply to every line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub n: u32,
    pub integer: bool,
}

/// Parsed piece of a file.
#[derive(Debug, Default)]
struct EntryLines {
    pub entries: Vec<Entry>,
    pub lines: usize,
    /// Bad lines, numbered from 1 within the piece.
    pub bad: BadLines,
    /// First lines (from 1) with a nonzero entry below and above the diagonal.
    pub lower: Option<usize>,
    pub upper: Option<usize>,
    /// Largest number of written significant digits among the first entries of the piece.
    pub written: u8,
}

/// Parses whole lines.
fn parse_lines(text: &[u8], limits: Limits) -> EntryLines {
    let mut piece = EntryLines { entries: Vec::with_capacity(most_entries(text)), ..EntryLines::default() };
    let mut at = 0;
    while at < text.len() {
        piece.lines += 1;
        at = skip_blanks(text, at);
        if let Some((entry, number, next)) = fast(text, at, limits) {
            piece.push(entry, number);
            at = next;
            continue;
        }
        let end = line_end(text, at);
        let line = text[at..end].trim_ascii();
        if !line.is_empty() && line[0] != b'%' {
            match slow(line, limits) {
                Ok((entry, number)) => piece.push(entry, number),
                Err(bad) => piece.bad.add(bad.at_line(piece.lines)),
            }
        }
        at = end;
    }
    piece
}

impl EntryLines {
    fn push(&mut self, entry: Entry, number: &[u8]) {
        if self.entries.len() < COUNTED && entry.value != 0.0 {
            self.written = self.written.max(written_digits(number));
        }
        if entry.row != entry.col && entry.value != 0.0 {
            let side = if entry.row > entry.col { &mut self.lower } else { &mut self.upper };
            side.get_or_insert(self.lines);
        }
        self.entries.push(entry);
    }
}

/// Parses `row col value` with blanks, plain exponents and a line end; returns `None` for other forms. Returns also the
/// number as written and the start of the next line.
fn fast(text: &[u8], at: usize, limits: Limits) -> Option<(Entry, &[u8], usize)> {
    let (row, at) = fast_index(text, at, limits.n)?;
    let (col, at) = fast_index(text, at, limits.n)?;
    let (value, length) = fast_float2::parse_partial::<f64, _>(&text[at..]).ok()?;
    let end = skip_blanks(text, at + length);
    if !value.is_finite()
        || text.get(end).is_some_and(|&b| b != b'\n')
        || (limits.integer && value.fract() != 0.0)
    {
        return None;
    }
    Some((Entry { row, col, value }, &text[at..at + length], end + 1))
}

/// Parses an index from 1 to n with blanks after it. Returns it from 0.
fn fast_index(text: &[u8], start: usize, n: u32) -> Option<(u32, usize)> {
    let (mut index, mut at) = (0u64, start);
    while let Some(digit @ b'0'..=b'9') = text.get(at) {
        index = index * 10 + u64::from(digit - b'0');
        at += 1;
        if at - start > 10 {
            return None;
        }
    }
    let next = skip_blanks(text, at);
    (next > at && index >= 1 && index <= u64::from(n)).then(|| (index as u32 - 1, next))
}

fn skip_blanks(text: &[u8], mut at: usize) -> usize {
    while matches!(text.get(at), Some(b' ' | b'\t' | b'\r')) {
        at += 1;
    }
    at
}

/// Parses a trimmed line with content in any dialect.
fn slow(line: &[u8], limits: Limits) -> Result<(Entry, &[u8]), Diagnostic> {
    let content = line.split(|&b| b == b'%').next().unwrap_or(line); // a comment may follow the value
    let fields: Vec<&[u8]> = words(content).take(5).collect();
    let &[row, col, number] = fields.as_slice() else {
        return Err(expected(Code::MatrixSyntax, "row, column and value", line));
    };
    let (row, col) = (index(row, "row", limits.n)?, index(col, "column", limits.n)?);
    let value = real(number).ok_or_else(|| {
        let message = format!("value `{}` is not a number", excerpt(number));
        let bad = Diagnostic::new(Code::MatrixSyntax, message);
        if number.contains(&b',') { bad.with_help("write numbers with a decimal point") } else { bad }
    })?;
    let place = format!("entry ({}, {})", row + 1, col + 1);
    if !value.is_finite() {
        return Err(Diagnostic::new(Code::MatrixNotFinite, format!("{place} is `{}`", excerpt(number))));
    }
    if limits.integer && value.fract() != 0.0 {
        let message = format!("{place} is `{}` in a matrix declared integer", excerpt(number));
        let help = "write `real` instead of `integer` in the first line";
        return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help(help));
    }
    Ok((Entry { row, col, value }, number))
}

fn index(field: &[u8], which: &str, n: u32) -> Result<u32, Diagnostic> {
    let text = std::str::from_utf8(field).ok();
    match text.and_then(|t| t.parse::<i128>().ok()) {
        Some(index) if index >= 1 && index <= i128::from(n) => Ok((index - 1) as u32),
        Some(index) => {
            let message = format!("{which} {index} is out of range, expected 1 to {n}");
            Err(Diagnostic::new(Code::MatrixIndex, message))
        }
        None => {
            let message = format!("{which} `{}` is not a whole number", excerpt(field));
            Err(Diagnostic::new(Code::MatrixSyntax, message))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_and_blocks_put_together_are_the_text_and_end_at_lines() {
        let mut text = String::new();
        for k in 0..3_000_000u32 {
            text += &format!("{k} {k} {k}.5\n");
        }
        text += "no line end";
        assert!(text.len() > 2 * BLOCK, "more than two blocks");
        let packed =
            ruzstd::encoding::compress_to_vec(text.as_bytes(), ruzstd::encoding::CompressionLevel::Fastest);
        for (compression, bytes) in [(Compression::None, text.as_bytes()), (Compression::Zstd, &packed)] {
            let mut blocks = Blocks::new(compression.stream(bytes), compression);
            let mut at = 0;
            while let Some(block) = blocks.next().unwrap() {
                for piece in line_aligned(&block) {
                    assert!(text.as_bytes()[at..].starts_with(piece));
                    at += piece.len();
                    assert!(piece.ends_with(b"\n") || at == text.len());
                }
                blocks.take_back(block);
            }
            assert_eq!(at, text.len());
            assert!(blocks.end() != TextEnd::Line);
        }
    }

    const LIMITS: Limits = Limits { n: 9, integer: false };

    #[test]
    fn the_fast_and_the_slow_path_agree() {
        for text in ["1 2 3.5", "9 9 -1e-3", "3 1 0", "4 4 +7", "5 6 1E300"] {
            let (entry, number, next) = fast(text.as_bytes(), 0, LIMITS).expect(text);
            assert_eq!(slow(text.as_bytes(), LIMITS).expect(text), (entry, number));
            assert_eq!(next, text.len() + 1);
        }
    }

    #[test]
    fn the_fast_path_never_reads_into_the_next_line() {
        for text in
            ["1 2\n3 4 5\n", "1\n2 3 4\n", "1 2 3 4\n", "1 2 1e999\n", "0 1 1\n", "10 1 1\n", "1 2 nan\n"]
        {
            assert!(fast(text.as_bytes(), 0, LIMITS).is_none(), "{text:?}");
        }
    }

    #[test]
    fn bad_lines_are_numbered_and_counted() {
        let piece =
            parse_lines(b"% c\n1 1 1\n\n1 2\nx 1 1\n2 2 nan\n1 0 1 % c\n3 3 1 %c\n1 1 1 1\n4 4 z\n", LIMITS);
        assert_eq!(piece.entries.len(), 2);
        assert_eq!((piece.lines, piece.bad.count()), (10, 6));
        let bad = piece.bad.into_diagnostics(Code::MatrixSyntax, "line");
        assert_eq!(bad.iter().filter_map(Diagnostic::line).collect::<Vec<_>>(), [4, 5, 6, 7, 9, 10]);
        assert_eq!(bad[2].code(), Code::MatrixNotFinite);
        assert_eq!(bad[3].code(), Code::MatrixIndex);
    }
}
