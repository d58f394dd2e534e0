//! Matrices as lines `row column value` without a header, as CalculiX and Abaqus write them.

use super::Found;
use crate::base::diagnostic::{Code, Diagnostic};
use crate::input::assemble::{Entry, Sides, Storage, assemble, check_size};
use crate::input::bytes::InputFile;
use crate::input::compression::Compression;
use crate::input::coordinates::{Blocks, Coordinates, Limits};
use crate::input::reader::{MatrixRole, MatrixSource};
use crate::model::RawMatrix;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// The entries of a file, in its order.
pub(super) struct CoordinateFile {
    path: PathBuf,
    pieces: Vec<Vec<Entry>>,
    count: u64,
    written: u8,
    /// On which sides of the diagonal they lie.
    pub sides: Sides,
}

impl CoordinateFile {
    /// Reads a file whose indices are at most `n`.
    ///
    /// # Errors
    /// FB101, FB103, FB106, and FB301, FB303, FB306 for its lines.
    pub(super) fn read(path: &Path, role: MatrixRole, n: u32) -> Found<Self> {
        let file = InputFile::open(path).map_err(|diagnostic| vec![diagnostic])?;
        let compression = Compression::of(file.bytes());
        let source = MatrixSource { file: &file, compression, group: None, role, keep_in: None };
        let in_file = |found: Vec<Diagnostic>| found.into_iter().map(|d| d.in_file(path)).collect::<Vec<_>>();
        let mut blocks = Blocks::new(compression, file.bytes());
        let mut body = Coordinates::new(Limits { n, integer: false }, None, 0);
        let first = blocks.next().map_err(|e| vec![crate::input::compression::broken(path, &e)])?;
        let Some(first) = first else {
            return Err(vec![
                Diagnostic::new(Code::FileEmpty, "compressed file holds no bytes").in_file(path),
            ]);
        };
        let newline = body.read(&source, blocks, first, 0).map_err(in_file)?;
        let found = body.bad_lines(newline);
        if !found.is_empty() {
            return Err(in_file(found));
        }
        let (sides, count) = (body.sides(), body.count);
        Ok(Self { path: path.to_path_buf(), pieces: body.pieces, count, written: body.written, sides })
    }

    /// Number of rows that its indices ask for.
    pub(super) fn rows(&self) -> usize {
        let largest = |piece: &Vec<Entry>| piece.iter().map(|e| e.row.max(e.col) as usize + 1).max();
        self.pieces.par_iter().filter_map(largest).max().unwrap_or(0)
    }

    /// The matrix of `n` rows: one triangle stands for both.
    ///
    /// # Errors
    /// FB301 for more rows than entries can fill, FB306, FB312.
    pub(super) fn into_matrix(self, n: usize) -> Found<RawMatrix> {
        let in_file = |diagnostic: Diagnostic| vec![diagnostic.in_file(&self.path)];
        check_size(n as u64, n as u64, self.count).map_err(in_file)?;
        assemble(n, self.pieces, Storage::of(self.sides), self.written, &self.path)
            .map_err(|diagnostic| vec![diagnostic])
    }
}
