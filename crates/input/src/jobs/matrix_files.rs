//! Matrices as lines of text, as Abaqus and CalculiX write them.
//!
//! Lines with labels (Abaqus with FORMAT=MATRIX INPUT or LABELS) name node and direction of row and column: `node,
//! direction, node, direction, value`; the rows are the labels in ascending order. Other lines are `row column value`
//! without a header.

use super::deck::fields;
use super::job::{FromFile, both};
use crate::digits::{COUNTED, written_digits};
use crate::matrices::assemble::{Entry, Sides, StoredEntries, assemble_distinct, check_size, given_twice};
use crate::matrices::coordinates::{
    Blocks, Coordinates, Limits, TextEnd, cut_off, line_aligned, most_entries,
};
use crate::matrices::recent::Recent;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::Compression;
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_base::text::scanner::{BadLines, Line, Lines, expected, integer, real};
use flexbody_linalg::parallel;
use flexbody_model::{DofLabel, RawMatrix};
use std::path::Path;

/// Reads two matrices and the labels of their rows.
///
/// # Errors
/// FB101 for files that cannot be read, FB132 for files that changed, FB301 for bad lines, and the errors of
/// [`assemble_distinct`], FB309 for an entry given twice.
pub(super) fn labelled(paths: [&Path; 2]) -> Diagnosed<(Vec<DofLabel>, [FromFile; 2])> {
    let ((k, k_file), (m, m_file)) = both(LabelledLines::read(paths[0]), LabelledLines::read(paths[1]))?;
    let all = [&k, &m].into_iter().flat_map(|lines| &lines.pieces).flat_map(|piece| &piece.labels);
    let mut labels: Vec<DofLabel> = all.copied().collect();
    labels.sort_unstable();
    labels.dedup();
    let (k, m) = both(k.into_matrix(&labels, paths[0]), m.into_matrix(&labels, paths[1]))?;
    Ok((labels, [(k, k_file), (m, m_file)]))
}

/// Returns true when the first line of data of a matrix names nodes and directions: it has fields with commas.
pub(super) fn has_labels(path: &Path) -> Diagnosed<bool> {
    let file = InputFile::open_unread(path).map_err(|diagnostic| vec![diagnostic])?;
    let mut blocks = Blocks::of(&file, Compression::None);
    while let Some(block) = blocks.next().map_err(|e| vec![file.failed(&e)])? {
        if let Some(line) = Lines::of(&block).filter_map(Line::content).find(|line| is_data(line.text)) {
            return Ok(line.text.contains(&b','));
        }
    }
    Ok(false)
}

fn is_data(line: &[u8]) -> bool {
    !line.is_empty() && !line.starts_with(b"*")
}

/// Lines of a file.
struct LabelledLines {
    pieces: Vec<LabelledEntries>,
}

impl LabelledLines {
    fn read(path: &Path) -> Diagnosed<(Self, SeenFile)> {
        let one = |diagnostic| vec![diagnostic];
        let file = InputFile::open_unread(path).map_err(one)?;
        let mut blocks = Blocks::of(&file, Compression::None);
        let mut pieces = Vec::new();
        while let Some(block) = blocks.next().map_err(|e| one(file.failed(&e)))? {
            pieces.extend(parallel::map(line_aligned(&block), LabelledEntries::parse));
            blocks.take_back(block);
        }
        // A change of the file during reading may be the cause of other problems, so it is reported first.
        file.refuse_changed().map_err(one)?;
        bad_lines(&mut pieces)
            .finish(Code::MatrixSyntax, "line")
            .map_err(|bad| bad.into_iter().map(|diagnostic| diagnostic.in_file(path)).collect::<Vec<_>>())?;
        let lines = pieces.iter().map(|piece| piece.lines).sum();
        if blocks.end() == TextEnd::Number && lines > 1 {
            return Err(one(cut_off(lines).in_file(path)));
        }
        Ok((Self { pieces }, file.seen().map_err(one)?))
    }

    /// Returns the matrix with rows in the order of the ascending `labels`.
    fn into_matrix(self, labels: &[DofLabel], path: &Path) -> Diagnosed<RawMatrix> {
        let n = labels.len() as u64;
        let count = self.pieces.iter().map(|piece| piece.entries.len() as u64).sum();
        check_size(n, n, count).map_err(|diagnostic| vec![diagnostic.in_file(path)])?;
        let written = self.pieces.iter().map(|piece| piece.written).max().unwrap_or(0);
        let numbered = parallel::map(self.pieces, |piece| piece.numbered(labels));
        let some = |side: fn(&Entry) -> bool| parallel::any(&numbered, |piece| piece.iter().any(side));
        let sides = Sides {
            lower: some(|entry| entry.row > entry.col && entry.value != 0.0),
            upper: some(|entry| entry.row < entry.col && entry.value != 0.0),
        };
        let named = |row: u32| {
            let DofLabel { node, direction } = labels[row as usize];
            format!("node {node}, direction {direction}")
        };
        assemble_distinct(labels.len(), numbered, StoredEntries::of(sides), written, path, |row, column| {
            given_twice(&named(row), &named(column), path)
        })
        .map_err(|diagnostic| vec![diagnostic])
    }
}

/// Returns the bad lines of all pieces, numbered through the file.
fn bad_lines(pieces: &mut [LabelledEntries]) -> BadLines {
    let (mut bad, mut above) = (BadLines::default(), 0);
    for piece in pieces {
        bad.append(std::mem::take(&mut piece.bad), above);
        above += piece.lines;
    }
    bad
}

/// Entries of some lines. Rows and columns are indices in `labels`, where a label may occur more than once.
#[derive(Default)]
struct LabelledEntries {
    entries: Vec<Entry>,
    labels: Vec<DofLabel>,
    written: u8,
    lines: usize,
    /// Bad lines, numbered from 1 within the piece.
    bad: BadLines,
}

impl LabelledEntries {
    fn parse(text: &[u8]) -> Self {
        let mut piece = Self { entries: Vec::with_capacity(most_entries(text)), ..Self::default() };
        let mut recent = Recent::new();
        for Line { number, text } in Lines::of(text) {
            piece.lines = number;
            let line = text.trim_ascii_start();
            if !is_data(line) {
                continue;
            }
            match labelled_line(line) {
                Some((row, col, value, number)) => {
                    if piece.entries.len() < COUNTED {
                        piece.written = piece.written.max(written_digits(number));
                    }
                    let mut place = |label: DofLabel| {
                        recent.place(label, (label.node, label.direction), &mut piece.labels)
                    };
                    let (row, col) = (place(row), place(col));
                    piece.entries.push(Entry { row, col, value });
                }
                None => {
                    const LINE: &str = "node, direction, node, direction, value";
                    piece.bad.add(expected(Code::MatrixSyntax, LINE, line).at_line(number));
                }
            }
        }
        piece
    }

    /// Returns the entries with rows and columns as indices in `all`.
    fn numbered(mut self, all: &[DofLabel]) -> Vec<Entry> {
        let at = |label: &DofLabel| all.binary_search(label).expect("every label is listed") as u32;
        let place: Vec<u32> = self.labels.iter().map(at).collect();
        for entry in &mut self.entries {
            (entry.row, entry.col) = (place[entry.row as usize], place[entry.col as usize]);
        }
        self.entries
    }
}

/// Returns row, column, value and the value as written; `None` for a line of another form.
fn labelled_line(text: &[u8]) -> Option<(DofLabel, DofLabel, f64, &[u8])> {
    let mut parts = fields(text);
    let mut label = || {
        let node = integer(parts.next()?)?;
        let direction = integer(parts.next()?).filter(|direction| (1..=6).contains(direction))?;
        Some(DofLabel { node, direction: direction as u8 })
    };
    let (row, column) = (label()?, label()?);
    let number = parts.next()?;
    let value = real(number).filter(|value| value.is_finite())?;
    parts.next().is_none().then_some((row, column, value, number))
}

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
    pub(super) fn read(path: &Path, n: u32) -> Diagnosed<Self> {
        let file = InputFile::open_unread(path).map_err(|diagnostic| vec![diagnostic])?;
        let read = Self::read_opened(&file, n);
        // A change of the file during reading may be the cause of other problems, so it is reported first.
        file.refuse_changed().map_err(|diagnostic| vec![diagnostic])?;
        read
    }

    /// Reads an opened file whose indices are at most `n`.
    ///
    /// # Errors
    /// The errors of [`Self::read`] but FB101 and FB132.
    pub(super) fn read_opened(file: &InputFile, n: u32) -> Diagnosed<Self> {
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
        let end = body.read(path, blocks, first, 0).map_err(in_file)?;
        let found = body.bad_lines(end);
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
    /// FB301 for more rows than the entries can fill, FB306, FB309 for an entry given twice, FB312.
    pub(super) fn into_matrix(self, n: usize) -> Diagnosed<FromFile> {
        let path = &self.seen.path;
        let in_file = |diagnostic: Diagnostic| vec![diagnostic.in_file(path)];
        check_size(n as u64, n as u64, self.count).map_err(in_file)?;
        let stored = StoredEntries::of(self.sides);
        let raw = assemble_distinct(n, self.pieces, stored, self.written, path, |row, column| {
            given_twice(&format!("row {}", row + 1), &format!("column {}", column + 1), path)
        });
        Ok((raw.map_err(|diagnostic| vec![diagnostic])?, self.seen))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write;

    /// Returns a text of springs between nodes 3, 10, 17, ... in no order, in each direction, and the node numbers; the
    /// text has more than two pieces.
    fn chain(nodes: usize) -> (String, Vec<i64>) {
        let ids: Vec<i64> = (0..nodes as i64).map(|k| 3 + 7 * ((k * 7919) % nodes as i64)).collect();
        let mut text = String::from("** a comment\n");
        for (k, &id) in ids.iter().enumerate() {
            for direction in 1..=3 {
                let next = ids[(k + 1) % nodes];
                writeln!(text, "{id},{direction}, {id},{direction}, {:.15e}", 2.0 + k as f64)
                    .expect("memory");
                writeln!(text, "{id},{direction}, {next},{direction}, {:.15e}", -1.0 - direction as f64)
                    .expect("memory");
                writeln!(text, "{next},{direction}, {id},{direction}, {:.15e}", -1.0 - direction as f64)
                    .expect("memory");
            }
        }
        (text, ids)
    }

    #[test]
    fn rows_are_the_labels_in_ascending_order_however_many_pieces_name_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let (text, ids) = chain(9973);
        assert!(text.len() > 3 << 20);
        let path = folder.path().join("K.mtx");
        std::fs::write(&path, text).expect("written");
        let (labels, [(k, _), (m, _)]) = labelled([&path, &path]).expect("read");
        assert_eq!(labels.len(), 3 * ids.len());
        assert!(labels.is_sorted());
        assert_eq!((k.matrix.nnz(), k.digits), (9 * ids.len(), m.digits));
        let row = |node, direction| labels.binary_search(&DofLabel { node, direction }).expect("labelled");
        for (at, &id) in ids.iter().enumerate().step_by(97) {
            for direction in 1..=3u8 {
                let (this, next) = (row(id, direction), row(ids[(at + 1) % ids.len()], direction));
                assert_eq!(k.matrix.get(this, this), 2.0 + at as f64);
                assert_eq!(k.matrix.get(next, this), -1.0 - f64::from(direction));
            }
        }
    }

    #[test]
    fn bad_lines_are_numbered_through_the_whole_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let (mut text, _) = chain(9973);
        let lines = text.lines().count();
        text +=
            "1,1, 1,1\n1,7, 1,1, 1.0\n1,1, 1,1, NaN\n1,1, 1,1, 1.0, 2\n\none,1, 1,1, 1.0\n1,0, 1,1, 1.0\n";
        let path = folder.path().join("K.mtx");
        std::fs::write(&path, text).expect("written");
        let found = LabelledLines::read(&path).err().expect("refused");
        let at: Vec<_> = found.iter().map(|d| d.line()).collect();
        assert_eq!(at, [1, 2, 3, 4, 6, 7].map(|k| Some(lines + k)));
    }
}
