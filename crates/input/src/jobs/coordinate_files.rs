//! Matrices as lines `row column value` without a header, as CalculiX and Abaqus write them.

use super::{Found, FromFile};
use crate::assemble::{Entry, Sides, StoredEntries, assemble, check_size};
use crate::coordinates::{Blocks, Coordinates, Limits};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::Compression;
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_linalg::parallel;
use std::path::Path;

/// Entries of a file, in its order.
pub(super) struct CoordinateFile {
    seen: SeenFile,
    pieces: Vec<Vec<Entry>>,
    count: u64,
    written: u8,
    /// Sides of the diagonal on which the entries lie.
    pub sides: Sides,
}

impl CoordinateFile {
    /// Reads a file whose indices are at most `n`.
    ///
    /// # Errors
    /// FB101, FB103, FB106 for a file that cannot be read, FB132 for one that changed; FB301 for bad lines, FB303 for
    /// indices out of range, FB306 for values that are not finite.
    pub(super) fn read(path: &Path, n: u32) -> Found<Self> {
        let file = InputFile::open_unread(path).map_err(|diagnostic| vec![diagnostic])?;
        let read = Self::read_opened(&file, n);
        // A change of the file during reading may be the cause of other problems, so it is reported first.
        file.refuse_changed().map_err(|diagnostic| vec![diagnostic])?;
        read
    }

    fn read_opened(file: &InputFile, n: u32) -> Found<Self> {
        let path = file.path();
        let compression = Compression::of(file.bytes());
        let in_file = |found: Vec<Diagnostic>| found.into_iter().map(|d| d.in_file(path)).collect::<Vec<_>>();
        let mut blocks = Blocks::of(file, compression);
        let mut body = Coordinates::new(Limits { n, integer: false }, None, 0);
        let first = blocks.next().map_err(|e| vec![flexbody_base::text::compression::broken(path, &e)])?;
        let Some(first) = first else {
            return Err(vec![
                Diagnostic::new(Code::FileEmpty, "compressed file holds no bytes").in_file(path),
            ]);
        };
        let newline = body.read(path, blocks, first, 0).map_err(in_file)?;
        let found = body.bad_lines(newline);
        if !found.is_empty() {
            return Err(in_file(found));
        }
        let (sides, count) = (body.sides(), body.count);
        let seen = file.seen().map_err(|diagnostic| vec![diagnostic])?;
        Ok(Self { seen, pieces: body.pieces, count, written: body.written, sides })
    }

    /// Returns the number of rows that the indices require.
    pub(super) fn rows(&self) -> usize {
        let largest = |piece: &Vec<Entry>| piece.iter().map(|e| e.row.max(e.col) as usize + 1).max();
        parallel::map(&self.pieces, largest).into_iter().flatten().max().unwrap_or(0)
    }

    /// Returns the matrix of `n` rows. A single triangle represents both.
    ///
    /// # Errors
    /// FB301 for more rows than the entries can fill, FB306, FB312.
    pub(super) fn into_matrix(self, n: usize) -> Found<FromFile> {
        let path = &self.seen.path;
        let in_file = |diagnostic: Diagnostic| vec![diagnostic.in_file(path)];
        check_size(n as u64, n as u64, self.count).map_err(in_file)?;
        let raw = assemble(n, self.pieces, StoredEntries::of(self.sides), self.written, path);
        Ok((raw.map_err(|diagnostic| vec![diagnostic])?, self.seen))
    }
}
