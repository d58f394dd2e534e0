//! Matrix Market coordinate files, plain or compressed: <https://math.nist.gov/MatrixMarket/formats.html>.
//!
//! The text is cut at line ends into pieces that are parsed in parallel; pieces keep the order of the file.

use super::assemble::{Entry, Sides, Storage, assemble, check_size, undeclared_triangle};
use super::compression::{Compression, broken};
use super::digits::written_digits;
use super::reader::{MatrixSource, Reader};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::model::RawMatrix;
use rayon::prelude::*;
use std::io::Read;

mod array;
mod header;
mod line;
mod text;

pub(super) use array::read_array;
use header::{Header, Symmetry};
use line::{BadLine, Limits};
use text::Blocks;

/// The Matrix Market reader.
pub(super) struct MatrixMarket;

impl Reader for MatrixMarket {
    fn name(&self) -> &'static str {
        "Matrix Market"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["mtx", "mm"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        header::has_banner(head)
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let path = source.file.path();
        if let Some(group) = source.group {
            let message = format!("group `{group}` is named, but Matrix Market files have no groups");
            let help = "give the file without a group";
            return Err(Diagnostic::new(Code::Hdf5Layout, message).in_file(path).with_help(help).into());
        }
        read(source)
            .map_err(|diagnostics| Error::new(diagnostics.into_iter().map(|d| d.in_file(path)).collect()))
    }
}

/// Number of bad lines that are reported one by one.
const SHOWN: usize = 5;

fn read(source: &MatrixSource<'_>) -> std::result::Result<RawMatrix, Vec<Diagnostic>> {
    let path = source.file.path();
    let mut blocks = Blocks::new(source.compression, source.file.bytes());
    let mut next = || blocks.next().map_err(|e| vec![broken(path, &e)]);
    let Some(first) = next()? else {
        return Err(vec![Diagnostic::new(Code::FileEmpty, "compressed file holds no bytes")]);
    };
    let (header, length, lines) = header::parse(&first)?;
    check_size(header.rows, header.cols, header.entries).map_err(|d| vec![d.at_line(lines)])?;
    let mut body = Body { lines, ..Body::default() };
    let (mut block, mut skip, mut given) = (first, length, 0);
    loop {
        // The next block is unpacked while this one is parsed.
        let (following, ()) = rayon::join(&mut next, || body.parse(&block[skip..], &header));
        if source.compression == Compression::None {
            source.file.release(given..given + block.len());
            given += block.len();
        }
        match following? {
            Some(following) => (block, skip) = (following, 0),
            None => break,
        }
    }
    body.finish(&header, blocks.ends_with_newline()).and_then(|(pieces, written)| {
        let storage = match header.symmetry {
            Symmetry::Symmetric => Storage::Triangle,
            Symmetry::General => Storage::Full,
        };
        assemble(header.rows as usize, pieces, storage, written, path).map_err(|d| vec![d])
    })
}

/// What has been parsed below the size line.
#[derive(Default)]
struct Body {
    pieces: Vec<Vec<Entry>>,
    /// Data lines so far, bad ones included.
    count: u64,
    /// Lines of the file so far.
    lines: usize,
    bad: Vec<BadLine>,
    bad_count: usize,
    /// First line with an entry below, above the diagonal.
    lower: Option<usize>,
    upper: Option<usize>,
    written: u8,
}

impl Body {
    fn parse(&mut self, block: &[u8], header: &Header) {
        let limits = Limits { n: header.rows as u32, integer: header.integer };
        let pieces: Vec<&[u8]> = text::line_aligned(block).collect();
        let parsed: Vec<line::Piece> =
            pieces.into_par_iter().map(|piece| line::parse(piece, limits)).collect();
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
            if self.count <= header.entries {
                self.pieces.push(piece.entries);
            } else {
                self.pieces.clear();
            }
        }
    }

    /// The entries and the largest number of digits, or all that is wrong with the file.
    fn finish(
        self,
        header: &Header,
        ends_with_newline: bool,
    ) -> std::result::Result<(Vec<Vec<Entry>>, u8), Vec<Diagnostic>> {
        let mut found = Vec::new();
        let more = self.bad_count - self.bad.len();
        for (k, bad) in self.bad.iter().enumerate() {
            let mut message = bad.message.clone();
            if bad.line == self.lines && !ends_with_newline {
                message += "; it is the last line and has no line end: the file may be cut off";
            }
            if k + 1 == SHOWN && more > 0 {
                message += &format!(" ({more} more lines are bad)");
            }
            let diagnostic = Diagnostic::new(bad.code, message).at_line(bad.line);
            found.push(match bad.help {
                Some(help) => diagnostic.with_help(help),
                None => diagnostic,
            });
        }
        if self.count != header.entries {
            let message = format!("header announces {} entries, the file has {}", header.entries, self.count);
            let diagnostic = Diagnostic::new(Code::MatrixCount, message);
            found.push(if self.count > header.entries {
                diagnostic.with_help("correct the size line, or write the file again")
            } else {
                diagnostic
            });
        }
        let sides = Sides { lower: self.lower.is_some(), upper: self.upper.is_some() };
        match (header.symmetry, self.lower, self.upper) {
            (Symmetry::Symmetric, Some(lower), Some(upper)) => {
                let (stored, other, line) =
                    if lower < upper { ("lower", "above", upper) } else { ("upper", "below", lower) };
                let message = format!(
                    "matrix is declared symmetric and stored by its {stored} triangle, but this entry lies {other} the diagonal"
                );
                found.push(Diagnostic::new(Code::MatrixTriangles, message).at_line(line));
            }
            (Symmetry::General, ..) => found.extend(undeclared_triangle(sides, |_| {
                "write `symmetric` instead of `general` in the first line, or store both triangles".into()
            })),
            _ => {}
        }
        if found.is_empty() { Ok((self.pieces, self.written)) } else { Err(found) }
    }
}
