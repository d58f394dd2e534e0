//! DMIG cards of Nastran: matrices whose entries name the grids and components of their rows and columns.

use super::assemble::{
    Entry, Sides, StoredEntries, assemble_distinct, check_size, given_twice, push, undeclared_triangle,
};
use super::named_matrices::{choose, named_or_only};
use super::operator::OperatorColumns;
use super::reader::{ArraySource, MatrixSource, Reader};
use super::recent::Recent;
use crate::bulk_cards::{Card, Item, MatrixLines, is_bulk_data, read_cards, read_deck};
use crate::digits::written_digits;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::{Error, Result as Outcome};
use flexbody_base::text::Compression;
use flexbody_base::text::input_file::SeenFile;
use flexbody_base::text::scanner::{BadLines, excerpt};
use flexbody_linalg::parallel;
use flexbody_model::{DofLabel, RawMatrix};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Form of rectangular matrices, such as loads.
const RECTANGULAR: i64 = 9;

/// All DMIG matrices of a deck.
#[derive(Default)]
pub(crate) struct Dmigs {
    matrices: Vec<Dmig>,
    points: Vec<Point>,
    numbers: HashMap<Point, u32>,
    bad: BadLines,
    /// Files that were read only for these matrices, without the files that they include.
    pub files: Vec<SeenFile>,
}

struct Dmig {
    name: String,
    form: i64,
    /// Kind of the numbers: 1 and 2 are real; complex ones are skipped.
    kind: i64,
    /// Number of columns of a rectangular matrix, if the header states it.
    columns: Option<i64>,
    path: PathBuf,
    line: usize,
    /// Entries in the order of the deck; row and column are indices of points.
    pieces: Vec<Vec<Entry>>,
    written: u8,
}

impl Dmig {
    fn is_real(&self) -> bool {
        matches!(self.kind, 1 | 2)
    }

    fn count(&self) -> u64 {
        self.pieces.iter().map(|piece| piece.len() as u64).sum()
    }
}

impl Dmigs {
    /// Reads the DMIG matrices of files.
    ///
    /// # Errors
    /// FB101, FB106 for files that cannot be read, FB110 for a deck that cannot be read, FB301 for bad cards, FB302 for
    /// unsupported matrices, all that are found.
    pub(crate) fn of(paths: &[PathBuf]) -> Diagnosed<Self> {
        let mut all = Self::default();
        for path in paths {
            let read = read_deck(path, &mut |item| match item {
                Item::Card(card, path) if card.name == "DMIG" => {
                    all.card(card, path);
                    Ok(())
                }
                Item::Matrices(lines) => all.cards(lines),
                _ => Ok(()),
            });
            all.files.extend(read.map_err(|diagnostic| vec![diagnostic])?.into_iter().take(1));
        }
        let bad = all.take_bad();
        if bad.is_empty() { Ok(all) } else { Err(bad) }
    }

    /// Reads a DMIG card.
    pub(crate) fn card(&mut self, card: &Card, path: &Path) {
        match card.field(1) {
            b"0" => {
                if let Err(bad) = self.header(card, path) {
                    self.bad.add(bad);
                }
            }
            _ => {
                let heads = self.heads();
                let mut columns = Columns::of(0);
                columns.card(card, path, &heads);
                self.take(vec![columns]);
            }
        }
    }

    /// Reads consecutive DMIG cards. Cards of columns are read in parallel, a group at a time, and joined in the order
    /// of the file.
    ///
    /// # Errors
    /// FB110 for cards that cannot be read.
    pub(crate) fn cards(&mut self, lines: &MatrixLines<'_>) -> Result<(), Diagnostic> {
        let (bytes, path) = (lines.file.bytes(), lines.file.path());
        let at_once = 8 * rayon::current_num_threads();
        for parts in lines.parts.chunk_by(|a, b| a.is_header == b.is_header).flat_map(|p| p.chunks(at_once)) {
            if parts[0].is_header {
                for part in parts {
                    read_cards(&bytes[part.bytes.clone()], path, part.above, &mut |card| {
                        self.card(card, path);
                        Ok(())
                    })?;
                }
                continue;
            }
            let heads = self.heads();
            self.take(parallel::try_map(parts, |part| {
                let mut columns = Columns::of(part.bytes.len());
                read_cards(&bytes[part.bytes.clone()], path, part.above, &mut |card| {
                    columns.card(card, path, &heads);
                    Ok(())
                })?;
                Ok(columns)
            })?);
        }
        Ok(())
    }

    /// Returns name and kind of the matrices whose headers were read, for reading columns.
    fn heads(&self) -> Heads {
        self.matrices.iter().map(|matrix| (matrix.name.clone(), matrix.is_real())).collect()
    }

    /// Appends columns to those that were read.
    fn take(&mut self, all: Vec<Columns>) {
        let places: Vec<Vec<u32>> = all
            .iter()
            .map(|columns| columns.points.iter().map(|point| self.number(*point)).collect())
            .collect();
        let numbered =
            parallel::map(all.into_iter().zip(places), |(columns, place)| columns.numbered(&place));
        for columns in numbered {
            for (matrix, entries, written) in columns.runs {
                let dmig = &mut self.matrices[matrix];
                dmig.written = dmig.written.max(written);
                match entries.as_slice() {
                    // Columns that come one by one are collected in larger pieces.
                    few if few.len() < 1 << 10 => few.iter().for_each(|entry| push(&mut dmig.pieces, *entry)),
                    _ => dmig.pieces.push(entries),
                }
            }
            self.bad.append(columns.bad, 0);
        }
    }

    /// Returns the index of a point, which is created if necessary.
    fn number(&mut self, point: Point) -> u32 {
        let next = self.points.len() as u32;
        *self.numbers.entry(point).or_insert_with(|| {
            self.points.push(point);
            next
        })
    }

    /// Returns the diagnostics of the cards, and removes them.
    pub(crate) fn take_bad(&mut self) -> Vec<Diagnostic> {
        std::mem::take(&mut self.bad).into_diagnostics(Code::MatrixSyntax, "card")
    }

    /// Returns the names of the matrices, in the order of the deck.
    pub(crate) fn names(&self) -> Vec<String> {
        self.matrices.iter().map(|matrix| matrix.name.clone()).collect()
    }

    /// Returns the indices of matrices that may be K or M: square ones with entries, or all if there are none.
    pub(crate) fn candidates(&self) -> Vec<usize> {
        // Entries of complex matrices are not stored.
        let has_entries = |dmig: &Dmig| dmig.count() > 0 || !dmig.is_real();
        let is_one = |k: &usize| self.matrices[*k].form != RECTANGULAR && has_entries(&self.matrices[*k]);
        let some: Vec<usize> = (0..self.matrices.len()).filter(is_one).collect();
        if some.is_empty() { (0..self.matrices.len()).collect() } else { some }
    }

    /// Returns the points named by nonzero entries of the matrices `of`, ascending.
    pub(crate) fn points(&self, of: &[usize]) -> Vec<Point> {
        let mut named = vec![false; self.points.len()];
        for entry in of.iter().flat_map(|&k| &self.matrices[k].pieces).flatten() {
            if entry.value != 0.0 {
                named[entry.row as usize] = true;
                named[entry.col as usize] = true;
            }
        }
        let mut points: Vec<Point> =
            self.points.iter().zip(named).filter(|(_, named)| *named).map(|(point, _)| *point).collect();
        points.sort_unstable();
        points
    }

    /// Returns the points, ascending, of a matrix and of all that may be K or M.
    fn points_beside(&self, at: usize) -> Vec<Point> {
        let mut every = self.candidates();
        every.push(at);
        self.points(&every)
    }

    /// Returns a matrix with its rows in the order of `points`, which ascend and contain every point that its entries
    /// name. Its entries are moved out: the matrix can be taken once.
    ///
    /// # Errors
    /// FB302 for complex matrices and other forms, FB307 for an undeclared triangle, FB309 for duplicate entries, FB301
    /// for more rows than the entries can fill, FB312 if there is no nonzero entry.
    pub(crate) fn take_matrix(&mut self, k: usize, points: &[Point]) -> Result<RawMatrix, Diagnostic> {
        let dmig = &mut self.matrices[k];
        let (count, pieces) = (dmig.count(), std::mem::take(&mut dmig.pieces));
        let dmig = &self.matrices[k];
        let about = |diagnostic: Diagnostic| {
            diagnostic.about(format!("DMIG {}", dmig.name)).in_file(&dmig.path).at_line(dmig.line)
        };
        if !dmig.is_real() {
            let message = format!("type {} is complex", dmig.kind);
            let help = "write real matrices, without structural damping";
            return Err(about(Diagnostic::new(Code::MatrixKind, message).with_help(help)));
        }
        let stored = match dmig.form {
            1 | 2 | 9 => StoredEntries::Full,
            6 => StoredEntries::Triangle,
            other => {
                let message = format!("form {other} is not that of a symmetric matrix");
                return Err(about(
                    Diagnostic::new(Code::MatrixKind, message)
                        .with_help("write a DMIG of form 6: forms are 1, 2, 6 and 9"),
                ));
            }
        };
        let (pieces, sides) = self.in_rows(pieces, points);
        let n = points.len() as u64;
        if stored == StoredEntries::Full
            && let Some(triangle) = undeclared_triangle(sides, |_| "declare form 6 in the DMIG header".into())
        {
            return Err(about(triangle));
        }
        let n = check_size(n, n, count).map_err(about)?;
        assemble_distinct(n, pieces, stored, dmig.written, &dmig.path, |row, column| {
            let [row, column] = [row, column].map(|row| named(points[row as usize]));
            let message = format!("the entry of {row} and {column} is given twice");
            let help = "write the matrix again: form 6 has one triangle";
            about(Diagnostic::new(Code::MatrixTriangles, message).with_help(help))
        })
    }

    /// Returns a matrix whose rows are points and whose columns are numbers: the transpose of an operator. Its entries
    /// are moved out.
    ///
    /// # Errors
    /// FB302 for complex matrices and for other forms, FB303 for columns beyond those of the header, FB304 for
    /// fewer than the header announces, FB309 for an entry
    /// given twice.
    fn take_numbered(&mut self, k: usize) -> Result<NumberedColumns, Diagnostic> {
        let pieces = std::mem::take(&mut self.matrices[k].pieces);
        let dmig = &self.matrices[k];
        let refuse = |code, message: String, help: &str| {
            let diagnostic = Diagnostic::new(code, message).about(format!("DMIG {}", dmig.name));
            Err(diagnostic.in_file(&dmig.path).at_line(dmig.line).with_help(help))
        };
        if !dmig.is_real() {
            return refuse(Code::MatrixKind, format!("type {} is complex", dmig.kind), "write real matrices");
        }
        if !matches!(dmig.form, 2 | RECTANGULAR) {
            let message = format!("form {} is not that of a rectangular matrix", dmig.form);
            let help = "write the transposed operator with form 9: its rows are grids and components, its columns 1, 2, ... are the rows of the operator";
            return refuse(Code::MatrixKind, message, help);
        }
        let mut entries = Vec::new();
        for entry in pieces.into_iter().flatten() {
            let (column, component) = self.points[entry.col as usize];
            if component != 0 || column > dmig.columns.unwrap_or(i64::from(u32::MAX)) {
                let message = format!("column {column}, component {component} is not a number of a column");
                let help = "number the columns 1, 2, ... as far as the header says, with component 0";
                return refuse(Code::MatrixIndex, message, help);
            }
            entries.push((label(self.points[entry.row as usize]), column as u32 - 1, entry.value));
        }
        let mut places: Vec<(DofLabel, u32)> =
            entries.iter().map(|&(row, column, _)| (row, column)).collect();
        places.sort_unstable();
        if let Some(&[(row, column), ..]) = places.windows(2).find(|pair| pair[0] == pair[1]) {
            let (row, column) = (named((row.node, row.direction)), format!("column {}", column + 1));
            let twice = given_twice(&row, &column, &dmig.path);
            return Err(twice.about(format!("DMIG {}", dmig.name)).at_line(dmig.line));
        }
        let last = entries.iter().map(|(_, column, _)| column + 1).max().unwrap_or(0);
        let columns = dmig.columns.and_then(|columns| u32::try_from(columns).ok()).unwrap_or(last);
        if last < columns {
            let message = format!("the header announces {columns} columns, the last with entries is {last}");
            let help =
                "write the file again, it may be cut off; leave out rows of the operator that read nothing";
            return refuse(Code::MatrixCount, message, help);
        }
        Ok(NumberedColumns { name: dmig.name.clone(), columns, entries })
    }

    /// Returns the nonzero entries with rows and columns as indices in `points`, and their sides of the diagonal.
    fn in_rows(&self, mut pieces: Vec<Vec<Entry>>, points: &[Point]) -> (Vec<Vec<Entry>>, Sides) {
        let row_of = |point| points.binary_search(point).map_or(u32::MAX, |row| row as u32);
        let row_of: Vec<u32> = parallel::concat(self.points.len(), 1024, |range| {
            self.points[range].iter().map(row_of).collect()
        });
        let place = |piece: &mut Vec<Entry>| {
            let mut sides = Sides::default();
            piece.retain_mut(|entry| {
                (entry.row, entry.col) = (row_of[entry.row as usize], row_of[entry.col as usize]);
                let is_entry = entry.value != 0.0 && entry.row != u32::MAX && entry.col != u32::MAX;
                sides.lower |= is_entry && entry.row > entry.col;
                sides.upper |= is_entry && entry.row < entry.col;
                is_entry
            });
            sides
        };
        let either = |a: Sides, b: Sides| Sides { lower: a.lower | b.lower, upper: a.upper | b.upper };
        let sides = parallel::map(&mut pieces, place).into_iter().fold(Sides::default(), either);
        (pieces, sides)
    }

    fn header(&mut self, card: &Card, path: &Path) -> Result<(), Diagnostic> {
        let name = upper(card.field(0));
        let syntax = |expected: &str| bad_card(card, 0, path, format!("DMIG {name}: {expected}"));
        let (Some(form), Some(kind)) = (card.integer(2), card.integer(3)) else {
            return Err(syntax("expected 0, form, type of the input"));
        };
        if name.is_empty() {
            return Err(syntax("the matrix has no name"));
        }
        if self.matrices.iter().any(|known| known.name == name) {
            return Err(syntax("the matrix is given twice"));
        }
        let line = card.line();
        self.matrices.push(Dmig {
            name,
            form,
            kind,
            columns: card.integer(7).filter(|columns| *columns > 0),
            path: path.to_path_buf(),
            line,
            pieces: Vec::new(),
            written: 0,
        });
        Ok(())
    }
}

/// Matrix with labelled rows and numbered columns.
struct NumberedColumns {
    pub name: String,
    pub columns: u32,
    /// Row, column from 0, and value of every entry.
    pub entries: Vec<(DofLabel, u32, f64)>,
}

/// Reads the matrix `name`, or the only one of the file, with numbered columns.
///
/// # Errors
/// FB310 if there is no such matrix, the errors of [`Dmigs::of`] and of the matrix.
fn read_numbered(path: &Path, name: Option<&str>) -> Diagnosed<NumberedColumns> {
    let mut all = Dmigs::of(&[path.to_path_buf()])?;
    let wanted = named_or_only(&all.names(), name).map_err(|diagnostic| vec![diagnostic.in_file(path)])?;
    all.take_numbered(wanted).map_err(|diagnostic| vec![diagnostic])
}

/// Returns the label of a row. Scalar points have direction 1.
pub(crate) fn label((node, component): Point) -> DofLabel {
    DofLabel { node, direction: component.max(1) }
}

fn named((id, component): Point) -> String {
    match component {
        0 => format!("scalar point {id}"),
        _ => format!("grid {id} component {component}"),
    }
}

/// Reader of matrices in punch files.
pub(crate) struct DmigPunch;

impl Reader for DmigPunch {
    fn name(&self) -> &'static str {
        "DMIG punch"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["pch", "bdf"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        is_bulk_data(head)
    }

    fn reads_by_itself(&self) -> bool {
        true
    }

    /// Reads a matrix. Its rows are the points, ascending, of all matrices of the file that may be K or M. Points of
    /// loads and other rectangular matrices are left out.
    fn read(&self, source: &MatrixSource<'_>) -> Outcome<RawMatrix> {
        let path = source.file.path();
        if source.compression != Compression::None {
            let message = "file of Nastran is compressed as a whole";
            let diagnostic = Diagnostic::new(Code::FileFormatUnknown, message).in_file(path);
            return Err(diagnostic.with_help("unpack it").into());
        }
        let mut all = Dmigs::of(&[path.to_path_buf()]).map_err(Error::new)?;
        let at = choose(&all.names(), source.role, source.group).map_err(|d| d.in_file(path))?;
        let points = all.points_beside(at);
        Ok(all.take_matrix(at, &points)?)
    }

    fn labels(&self, source: &MatrixSource<'_>) -> Outcome<Option<Vec<DofLabel>>> {
        let path = source.file.path();
        let all = Dmigs::of(&[path.to_path_buf()]).map_err(Error::new)?;
        let at = choose(&all.names(), source.role, source.group).map_err(|d| d.in_file(path))?;
        Ok(Some(all.points_beside(at).into_iter().map(label).collect()))
    }

    fn read_operator(&self, source: &ArraySource<'_>) -> Option<Diagnosed<OperatorColumns>> {
        let labelled = |NumberedColumns { name, columns, entries }| {
            OperatorColumns::Labelled(name, columns as usize, entries)
        };
        source.is_plain().then(|| read_numbered(source.file.path(), source.name).map(labelled))
    }
}

// Cards with columns of DMIG matrices, read independently of the cards above them except for the headers.

/// Grid or scalar point with its component: 1 to 6, and 0 for a scalar point.
pub(crate) type Point = (i64, u8);

/// Name of each matrix whose header is above the columns, and true if its entries are real; complex columns are
/// skipped.
type Heads = Vec<(String, bool)>;

/// Entries of some columns. Rows and columns of the entries are indices in `points`, where a point may occur more than
/// once.
struct Columns {
    pub points: Vec<Point>,
    /// Index of the matrix, entries, and their largest number of written digits.
    pub runs: Vec<(usize, Vec<Entry>, u8)>,
    pub bad: BadLines,
    recent: Recent<Point>,
    /// Capacity in entries of the next run.
    capacity: usize,
}

impl Columns {
    /// Creates an empty list for cards with this number of bytes.
    fn of(bytes: usize) -> Self {
        /// Bytes of an entry in large fields.
        const ENTRY: usize = 56;
        let (points, runs, bad) = (Vec::new(), Vec::new(), BadLines::default());
        Self { points, runs, bad, recent: Recent::new(), capacity: bytes / ENTRY }
    }

    /// Adds the entries of a card; for a bad card those before the error.
    fn card(&mut self, card: &Card, path: &Path, heads: &Heads) {
        if let Err(bad) = self.column(card, path, heads) {
            self.bad.add(bad);
        }
    }

    /// Replaces indices in `points` by those in `place`.
    fn numbered(mut self, place: &[u32]) -> Self {
        for entry in self.runs.iter_mut().flat_map(|(_, entries, _)| entries) {
            (entry.row, entry.col) = (place[entry.row as usize], place[entry.col as usize]);
        }
        self
    }

    fn column(&mut self, card: &Card, path: &Path, heads: &Heads) -> Result<(), Diagnostic> {
        let field = card.field(0);
        let Some(at) = heads.iter().rposition(|(name, _)| field.eq_ignore_ascii_case(name.as_bytes())) else {
            let message = format!("a column of DMIG {} comes before its header", upper(field));
            return Err(bad_card(card, 0, path, message));
        };
        let (name, is_real) = &heads[at];
        if !is_real {
            return Ok(());
        }
        if self.runs.last().is_none_or(|(matrix, ..)| *matrix != at) {
            self.runs.push((at, Vec::with_capacity(std::mem::take(&mut self.capacity)), 0));
        }
        let col = self.point(card, 1, path)?;
        for k in (4..card.len()).step_by(4) {
            if (k..k + 4).all(|k| card.field(k).is_empty()) {
                continue;
            }
            let row = self.point(card, k, path)?;
            let value = match (card.real(k + 2), card.real(k + 3)) {
                (Some(value), Some(0.0)) => value,
                (Some(_), Some(_)) => {
                    let message = format!("DMIG {name}: a real matrix has a complex entry");
                    return Err(bad_card(card, k, path, message));
                }
                _ => {
                    let text = excerpt(card.field(k + 2));
                    let message = format!("DMIG {name}: expected a finite number, found `{text}`");
                    return Err(bad_card(card, k, path, message));
                }
            };
            if let Some((_, entries, written)) = self.runs.last_mut() {
                *written = (*written).max(written_digits(card.field(k + 2)));
                entries.push(Entry { row, col, value });
            }
        }
        Ok(())
    }

    /// Returns the index of the point that two fields name.
    fn point(&mut self, card: &Card, k: usize, path: &Path) -> Result<u32, Diagnostic> {
        let component = card.integer(k + 1).filter(|component| (0..=6).contains(component));
        let id = card.integer(k).filter(|id| *id > 0);
        let (Some(id), Some(component)) = (id, component) else {
            let found = [k, k + 1].map(|k| excerpt(card.field(k)));
            let message = format!(
                "DMIG: expected a grid and a component from 0 to 6, found `{}`, `{}`",
                found[0], found[1]
            );
            return Err(bad_card(card, k, path, message));
        };
        let point = (id, component as u8);
        Ok(self.recent.place(point, point, &mut self.points))
    }
}

/// Returns a name in upper case, as in messages.
fn upper(name: &[u8]) -> String {
    String::from_utf8_lossy(name).to_uppercase()
}

/// Returns FB301 for a field of a card.
fn bad_card(card: &Card, field: usize, path: &Path, message: impl Into<String>) -> Diagnostic {
    Diagnostic::new(Code::MatrixSyntax, message)
        .in_file(path)
        .at_line(card.line_of(field))
        .with_help("write the matrix again")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write;

    const NODES: i64 = 3000;
    const BAND: i64 = 6;

    /// Returns a text of two matrices of chains in large fields, K and then M.
    fn punch() -> String {
        let mut text = String::from("$ a comment\n");
        for (name, scale) in [("KAAX", 1e9), ("MAAX", 1e-3)] {
            writeln!(text, "DMIG    {name:8}{:8}{:8}{:8}", 0, 6, 2).expect("memory");
            for node in 1..=NODES {
                writeln!(text, "DMIG*   {name:16}{:16}{:16}", 7 * node, 1).expect("memory");
                for other in node..=(node + BAND).min(NODES) {
                    let value = format!("{:.9E}", scale * (node * other) as f64).replace('E', "D");
                    writeln!(text, "*       {:16}{:16}{value:>16}", 7 * other, 1).expect("memory");
                }
            }
        }
        text
    }

    fn read(text: &str, threads: usize) -> Diagnosed<Vec<RawMatrix>> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("job.pch");
        std::fs::write(&path, text).expect("written");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let mut all = Dmigs::of(&[path])?;
            let points = all.points(&[0, 1]);
            assert_eq!(points.len(), NODES as usize);
            (0..2).map(|k| all.take_matrix(k, &points).map_err(|found| vec![found])).collect()
        })
    }

    #[test]
    fn matrices_of_many_parts_are_the_same_on_any_number_of_threads() {
        let text = punch();
        assert!(text.len() > 2 << 20, "more than two parts");
        let [one, three] = [1, 3].map(|threads| read(&text, threads).expect("read"));
        for ((one, three), scale) in one.iter().zip(&three).zip([1e9, 1e-3]) {
            assert_eq!((&one.matrix, one.digits), (&three.matrix, three.digits));
            assert!(one.matrix.is_symmetric());
            for node in 1..=NODES {
                for other in node..=(node + BAND).min(NODES) {
                    let expected: f64 =
                        format!("{:.9E}", scale * (node * other) as f64).parse().expect("a number");
                    assert_eq!(one.matrix.get(other as usize - 1, node as usize - 1), expected);
                }
            }
        }
    }

    #[test]
    fn bad_cards_are_told_with_their_lines_in_the_whole_file() {
        let text = punch();
        let mut lines: Vec<&str> = text.lines().collect();
        let count = lines.len();
        let first_entry =
            |at: usize| (at..count).find(|k| lines[k - 1].starts_with("DMIG*")).expect("a card");
        let bad = [3, count / 3, count / 2, 2 * count / 3, count - 20, count - 1].map(first_entry);
        let line = format!("*       {:16}{:16}{:>16}", 7, 9, 1.0);
        bad.iter().for_each(|at| lines[*at] = &line);
        for threads in [1, 3] {
            let found = read(&(lines.join("\n") + "\n"), threads).expect_err("refused");
            let at: Vec<_> = found.iter().map(Diagnostic::line).collect();
            assert_eq!(at, bad.map(|line| Some(line + 1)), "{found:?}");
            assert_eq!(found[5].message(), "1 more card has errors: this line");
        }
        let cut_off = read(text.trim_end(), 2).expect_err("refused");
        assert_eq!((cut_off.len(), cut_off[0].line()), (1, Some(text.lines().count())), "{cut_off:?}");
    }

    #[test]
    fn continuations_of_another_card_are_told_with_their_lines() {
        let text = punch();
        let lines: Vec<&str> = text.lines().collect();
        let (above, last) = (lines[lines.len() - 2], lines[lines.len() - 1]);
        let with = |name: &str| {
            let end = format!("{above:<72}*C1     \n{name:<8}{}\n", &last[8..]);
            read(&(lines[..lines.len() - 2].join("\n") + "\n" + &end), 2)
        };
        assert_eq!(with("*C1").expect("read").len(), 2);
        let found = with("*C2").expect_err("refused");
        assert_eq!((found[0].code(), found[0].line()), (Code::DeckSyntax, Some(lines.len())), "{found:?}");
    }
}
