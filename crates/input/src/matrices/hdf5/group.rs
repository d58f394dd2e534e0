//! A sparse matrix in an HDF5 group: compressed columns or rows, or coordinates, in the conventions of scipy, anndata,
//! MATLAB and PETSc (`docs/reference/input.md`).

use crate::hdf5::{Heaps, Members, Vector, integers_of, text_of, truth_of};
use crate::matrices::assemble::{
    ColumnEntries, Entry, Sides, StoredEntries, assemble, assemble_columns, assembled, check_extents,
    check_size, push, refuse_beyond_memory, undeclared_triangle,
};
use crate::matrices::lent::StoredColumns;
use crate::matrices::reader::MatrixSource;
use crate::matrices::rectangular::Rectangular;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_linalg::CscMatrix;
use flexbody_model::RawMatrix;
use hdf5_metno::Group;
use std::path::Path;

/// Number of entries read at a time.
const ENTRIES_PER_READ: usize = 1 << 20;

/// Names of the indices of a compressed matrix.
const INDICES: &[&str] = &["indices", "ir"];

/// Names of the pointers of a compressed matrix.
const POINTERS: &[&str] = &["indptr", "jc"];

/// Names of the values of a matrix.
const VALUES: &[&str] = &["data", "values", "val"];

/// Names of the rows of the entries of a matrix.
const ROWS: &[&str] = &["row", "rows", "i"];

/// Names of the columns of the entries of a matrix.
const COLUMNS: &[&str] = &["col", "cols", "j"];

/// Returns the names of values, indices and pointers; `None` if one is missing.
fn compressed(members: &Members) -> Option<(&'static str, &'static str, &'static str)> {
    Some((members.first(VALUES)?, members.first(INDICES)?, members.first(POINTERS)?))
}

/// Returns the names of values, rows and columns; `None` if one is missing.
fn coordinates(members: &Members) -> Option<(&'static str, &'static str, &'static str)> {
    Some((members.first(VALUES)?, members.first(ROWS)?, members.first(COLUMNS)?))
}

/// Returns true when a group with these members holds a sparse matrix.
pub(super) fn holds_matrix(members: &Members) -> bool {
    compressed(members).is_some() || coordinates(members).is_some()
}

/// Reads the matrix in `group`, which messages call `name`.
pub(super) fn read(group: &Group, name: &str, source: &MatrixSource<'_>) -> Diagnosed<RawMatrix> {
    let MatrixSource { file, keep_in, .. } = *source;
    let reader = GroupReader { file, group, name, members: Members::of(group), keep_in };
    let declared = reader.declared_symmetry().map_err(|d| vec![d])?;
    let parsed = match compressed(&reader.members) {
        Some(names) => reader.compressed(names)?,
        None => match coordinates(&reader.members) {
            Some(names) => reader.coordinates(names)?,
            None => return Err(vec![reader.layout("holds no sparse matrix")]),
        },
    };
    // Declaration and entries must agree about the stored triangles.
    let sides = parsed.sides;
    let stored = match declared {
        Declared::Triangle if sides == (Sides { lower: true, upper: true }) => {
            let message = format!(
                "group `{name}` declares one triangle, but has entries on both sides of the diagonal"
            );
            return Err(vec![Diagnostic::new(Code::MatrixTriangles, message)]);
        }
        Declared::Triangle | Declared::Symmetric if sides.lower != sides.upper => StoredEntries::Triangle,
        Declared::No => {
            let help = |stored: &str| {
                format!("store both triangles, or set the attribute symmetric = \"{stored}\" of group {name}")
            };
            match undeclared_triangle(sides, help) {
                Some(diagnostic) => return Err(vec![diagnostic]),
                None => StoredEntries::Full,
            }
        }
        _ => StoredEntries::Full,
    };
    let made = match (parsed.entries, stored) {
        (Entries::Stored(matrix), _) => assembled(matrix, 17, file.path()),
        (Entries::Columns(columns), StoredEntries::Full) => assemble_columns(columns, 17, file.path()),
        (Entries::Columns(columns), StoredEntries::Triangle) => {
            assemble(parsed.n, columns.into_entries(), stored, 17, file.path())
        }
        (Entries::Listed(pieces), _) => assemble(parsed.n, pieces, stored, 17, file.path()),
    };
    let mut raw = made.map_err(|d| vec![d])?;
    if parsed.single_precision {
        raw.digits = raw.digits.min(7);
    }
    Ok(raw)
}

/// Reads the matrix in `group`, which need not be square: compressed rows or columns, or coordinates.
///
/// # Errors
/// FB310 for a group that does not say which of rows and columns are compressed, FB301 to FB306 for an invalid matrix.
pub(super) fn read_rectangular(group: &Group, name: &str, file: &InputFile) -> Diagnosed<Rectangular> {
    let reader = GroupReader { file, group, name, members: Members::of(group), keep_in: None };
    if reader.declared_symmetry().map_err(|d| vec![d])? == Declared::Triangle {
        let message = format!("group `{name}` declares one triangle, and an operator has none");
        return Err(vec![Diagnostic::new(Code::MatrixKind, message).with_help("store all entries")]);
    }
    let (rows, columns) = reader
        .shape()?
        .ok_or_else(|| vec![reader.layout("has no `shape`").with_help("store shape = [rows, columns]")])?;
    let read = |vector: &Vector| vector.integers(0..vector.len);
    let (values, places) = match (compressed(&reader.members), coordinates(&reader.members)) {
        (Some((values, indices, pointers)), _) => {
            let [values, indices, pointers] =
                [reader.vector(values)?, reader.vector(indices)?, reader.vector(pointers)?];
            let entries = reader.same_length(&values, &indices)?;
            check_extents(rows, columns, entries as u64).map_err(|d| vec![d])?;
            let by_rows = reader.compresses_rows(pointers.len as u64, rows, columns)?;
            let (indices, starts) = (read(&indices)?, read(&pointers)?);
            if !starts.is_sorted() || starts[0] != 0 || starts.last() != Some(&(entries as i64)) {
                let message =
                    format!("{} does not rise from 0 to {entries}, the number of values", pointers.name);
                return Err(vec![Diagnostic::new(Code::MatrixSyntax, message)]);
            }
            let mut major = by_major(&starts);
            let place = |(k, index)| {
                let (minor, major) = major(k, [index]);
                if by_rows { (major, minor) } else { (minor, major) }
            };
            (values, indices.into_iter().enumerate().map(place).collect::<Vec<(i64, i64)>>())
        }
        (None, Some((values, rows_name, columns_name))) => {
            let [values, row, col] =
                [reader.vector(values)?, reader.vector(rows_name)?, reader.vector(columns_name)?];
            let entries = reader.same_length(&values, &row)?;
            reader.same_length(&values, &col)?;
            check_extents(rows, columns, entries as u64).map_err(|d| vec![d])?;
            (values, read(&row)?.into_iter().zip(read(&col)?).collect())
        }
        (None, None) => return Err(vec![reader.layout("holds no sparse matrix")]),
    };
    let index = |index: i64| u32::try_from(index).unwrap_or(u32::MAX);
    let numbers = values.floats(0..values.len)?;
    let entry = |((row, col), value): (&(i64, i64), f64)| Entry { row: index(*row), col: index(*col), value };
    let entries = places.iter().zip(numbers).map(entry).collect();
    let matrix = Rectangular { rows: rows as usize, columns: columns as usize, entries };
    matrix.checked().map_err(|d| vec![d])
}

/// Symmetry declared by the attribute `symmetric` of the group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Declared {
    /// No declaration: the matrix is stored in full.
    No,
    /// Symmetric, stored in full or by one triangle.
    Symmetric,
    /// Symmetric, stored by one triangle.
    Triangle,
}

/// Content of a group.
struct Parsed {
    n: usize,
    entries: Entries,
    sides: Sides,
    single_precision: bool,
}

/// Entries of a matrix, in the order in which its group stores them.
enum Entries {
    /// Sorted columns of both triangles, in files.
    Stored(CscMatrix),
    Columns(ColumnEntries),
    Listed(Vec<Vec<Entry>>),
}

/// Returns a function that gives row and column of entry k from its index, for entries in the order of the columns.
fn by_major(pointers: &[i64]) -> impl FnMut(usize, [i64; 1]) -> (i64, i64) {
    let mut major = 0;
    move |k, [index]| {
        while pointers[major + 1] <= k as i64 {
            major += 1;
        }
        (index, major as i64)
    }
}

struct GroupReader<'a> {
    file: &'a InputFile,
    group: &'a Group,
    name: &'a str,
    members: Members,
    /// Folder for a matrix that is not held in memory.
    keep_in: Option<&'a Path>,
}

impl GroupReader<'_> {
    fn layout(&self, what: &str) -> Diagnostic {
        Diagnostic::new(Code::Hdf5Layout, format!("group `{}` {what}", self.name))
    }

    fn vector(&self, dataset: &str) -> Diagnosed<Vector> {
        Vector::open(self.group, &self.members, self.name, dataset)
    }

    fn compressed(&self, (values, indices, pointers): (&str, &str, &str)) -> Diagnosed<Parsed> {
        let values = self.vector(values)?;
        let indices = self.vector(indices)?;
        let pointers = self.vector(pointers)?;
        let Some(majors) = pointers.len.checked_sub(1) else {
            return Err(vec![self.layout(&format!("has an empty {}", pointers.name))]);
        };
        let (rows, cols) = self.shape()?.unwrap_or((majors as u64, majors as u64));
        let entries = self.same_length(&values, &indices)?;
        let n = check_size(rows, cols, entries as u64).map_err(|d| vec![d])?;
        if majors != n {
            let message =
                format!("{} has {} values, expected {} for {n} columns", pointers.name, pointers.len, n + 1);
            return Err(vec![Diagnostic::new(Code::MatrixCount, message)]);
        }
        let one = |diagnostic| vec![diagnostic];
        refuse_beyond_memory(if self.keep_in.is_some() { 0 } else { entries as u64 }).map_err(one)?;
        let pointer_values = pointers.integers(0..pointers.len)?;
        let ascending = pointer_values.is_sorted() && pointer_values[0] == 0;
        if !ascending || pointer_values[n] != entries as i64 {
            let message =
                format!("{} does not rise from 0 to {entries}, the number of values", pointers.name);
            return Err(vec![
                Diagnostic::new(Code::MatrixSyntax, message).with_help("write the matrix again"),
            ]);
        }
        if let Some(folder) = self.keep_in
            && let Some(parsed) = self.stored_in_files(folder, (&values, &indices, &pointer_values), n)?
        {
            return Ok(parsed);
        }
        // Compressed rows are read as columns: symmetric matrices have equal rows and columns.
        let mut columns = ColumnEntries::with_capacity(n, entries);
        let place = by_major(&pointer_values);
        let sides = self.visit(&values, &[&indices], n, place, |entry| columns.push(entry))?;
        let single_precision = values.is_single_precision();
        Ok(Parsed { n, entries: Entries::Columns(columns), sides, single_precision })
    }

    /// Returns the matrix in files of `folder`; `None` if its columns are not sorted or one triangle is missing.
    fn stored_in_files(
        &self,
        folder: &Path,
        (values, indices, pointers): (&Vector, &Vector, &[i64]),
        n: usize,
    ) -> Diagnosed<Option<Parsed>> {
        let mut columns = StoredColumns::new(folder, n).map_err(|d| vec![d])?;
        let mut wrong = None;
        let sides = self.visit(values, &[indices], n, by_major(pointers), |entry| {
            if wrong.is_none() {
                wrong = columns.push(entry).err();
            }
        })?;
        if let Some(diagnostic) = wrong {
            return Err(vec![diagnostic]);
        }
        if sides.lower != sides.upper {
            return Ok(None);
        }
        let matrix = columns.compress().map_err(|d| vec![d])?;
        let single_precision = values.is_single_precision();
        Ok(matrix.map(|matrix| Parsed { n, entries: Entries::Stored(matrix), sides, single_precision }))
    }

    fn coordinates(&self, (values, rows, columns): (&str, &str, &str)) -> Diagnosed<Parsed> {
        let values = self.vector(values)?;
        let row_indices = self.vector(rows)?;
        let column_indices = self.vector(columns)?;
        let (rows, cols) = self.shape()?.ok_or_else(|| {
            vec![self.layout("has coordinates but no `shape`").with_help("store shape = [rows, columns]")]
        })?;
        let entries = self.same_length(&values, &row_indices)?;
        self.same_length(&values, &column_indices)?;
        let n = check_size(rows, cols, entries as u64).map_err(|d| vec![d])?;
        refuse_beyond_memory(entries as u64).map_err(|d| vec![d])?;
        let mut pieces = Vec::new();
        let both = [&row_indices, &column_indices];
        let sides =
            self.visit(&values, &both, n, |_, [row, col]| (row, col), |entry| push(&mut pieces, entry))?;
        let single_precision = values.is_single_precision();
        Ok(Parsed { n, entries: Entries::Listed(pieces), sides, single_precision })
    }

    /// Returns true if rows are compressed, false if columns are: by the declared encoding, by the names of MATLAB, or by
    /// the number of pointers.
    fn compresses_rows(&self, pointers: u64, rows: u64, columns: u64) -> Diagnosed<bool> {
        let words = ["encoding-type", "h5sparse_format", "format"].iter().find_map(|name| {
            text_of(&self.group.attr(name).ok()?, &Heaps::of(self.file)).map(|text| text.to_lowercase())
        });
        let stated = words.as_deref().and_then(|text| match text {
            "csr" | "csr_matrix" => Some(true),
            "csc" | "csc_matrix" => Some(false),
            _ => None,
        });
        let of_matlab = self.group.attr("MATLAB_sparse").is_ok().then_some(false);
        let fits = |by_rows: bool| pointers == if by_rows { rows + 1 } else { columns + 1 };
        match (stated.or(of_matlab), fits(true), fits(false)) {
            (Some(by_rows), ..) if fits(by_rows) => Ok(by_rows),
            (None, true, false) => Ok(true),
            (None, false, true) => Ok(false),
            (None, true, true) => Err(vec![
                self.layout("does not say if its rows or its columns are compressed")
                    .with_help("set the attribute format = \"csr\" or \"csc\" of the group"),
            ]),
            _ => {
                let message = format!("{pointers} pointers do not fit {rows} rows and {columns} columns");
                Err(vec![Diagnostic::new(Code::MatrixCount, message)])
            }
        }
    }

    /// Reads values and indices piece by piece. `place` returns row and column of entry k from its indices; `keep`
    /// receives the nonzero entries. Returns the sides of the diagonal on which they lie.
    fn visit<const N: usize>(
        &self,
        values: &Vector,
        indices: &[&Vector; N],
        n: usize,
        mut place: impl FnMut(usize, [i64; N]) -> (i64, i64),
        mut keep: impl FnMut(Entry),
    ) -> Diagnosed<Sides> {
        // Pieces consist of whole chunks, so that no chunk is unpacked twice.
        let step = indices.iter().map(|v| v.chunk).fold(ENTRIES_PER_READ.max(values.chunk), usize::max);
        let mut sides = Sides::default();
        let mut bad = Bad { n, shown: Vec::new(), count: 0 };
        for start in (0..values.len).step_by(step) {
            let range = start..values.len.min(start.saturating_add(step));
            let numbers = values.floats(range.clone())?;
            let mut lists: [Vec<i64>; N] = std::array::from_fn(|_| Vec::new());
            for (list, vector) in lists.iter_mut().zip(indices) {
                *list = vector.integers(range.clone())?;
            }
            for (offset, &value) in numbers.iter().enumerate() {
                let (row, col) = place(start + offset, std::array::from_fn(|which| lists[which][offset]));
                if let Some(entry) = bad.check(row, col, value, start + offset) {
                    sides.lower |= entry.row > entry.col;
                    sides.upper |= entry.row < entry.col;
                    if bad.count == 0 {
                        keep(entry);
                    }
                }
            }
        }
        if bad.count == 0 { Ok(sides) } else { Err(bad.finish(self.name)) }
    }

    fn same_length(&self, values: &Vector, indices: &Vector) -> Diagnosed<usize> {
        if values.len == indices.len {
            return Ok(values.len);
        }
        let message =
            format!("{} has {} values, {} has {}", values.name, values.len, indices.name, indices.len);
        let help = "write the matrix again: both must have one value per entry";
        Err(vec![Diagnostic::new(Code::MatrixCount, message).with_help(help)])
    }

    /// Returns the numbers of rows and columns, from the attribute or dataset `shape` or from MATLAB's attribute.
    fn shape(&self) -> Diagnosed<Option<(u64, u64)>> {
        let attribute = ["shape", "h5sparse_shape"].iter().find_map(|name| self.group.attr(name).ok());
        let numbers = if let Some(attribute) = attribute {
            integers_of(&attribute)
        } else if self.members.link("shape").is_some() {
            let vector = self.vector("shape")?;
            // Two numbers are expected; a third one shows that there are too many.
            Some(vector.integers(0..vector.len.min(3))?)
        } else if let Ok(rows) = self.group.attr("MATLAB_sparse") {
            // The number of columns follows from the pointers.
            let columns = self.members.first(POINTERS).map(|name| self.vector(name)).transpose()?;
            let columns = columns.map(|pointers| pointers.len as i64 - 1);
            integers_of(&rows).map(|rows| rows.into_iter().chain(columns).collect())
        } else {
            return Ok(None);
        };
        match numbers.as_deref() {
            Some(&[rows, cols]) if rows >= 0 && cols >= 0 => Ok(Some((rows as u64, cols as u64))),
            _ => Err(vec![self.layout("has a `shape` that is not two whole numbers")]),
        }
    }

    fn declared_symmetry(&self) -> Result<Declared, Diagnostic> {
        let Ok(attribute) = self.group.attr("symmetric") else {
            return Ok(Declared::No);
        };
        let word = match truth_of(&attribute) {
            Some(true) => return Ok(Declared::Symmetric),
            Some(false) => return Ok(Declared::No),
            None => text_of(&attribute, &Heaps::of(self.file)),
        };
        let help = "set it to true, false, \"lower\" or \"upper\"";
        let refuse = |what: String| {
            let message = format!("attribute `symmetric` of group `{}` {what}", self.name);
            Diagnostic::new(Code::MatrixKind, message).with_help(help)
        };
        let word = word.ok_or_else(|| refuse("cannot be read as text, number or boolean".into()))?;
        match word.to_lowercase().as_str() {
            "lower" | "upper" | "l" | "u" => Ok(Declared::Triangle),
            "true" | "yes" | "symmetric" => Ok(Declared::Symmetric),
            "false" | "no" | "general" => Ok(Declared::No),
            _ => Err(refuse(format!("is `{}`", word.escape_debug()))),
        }
    }
}

/// Invalid entries: the first few, and their number.
struct Bad {
    n: usize,
    shown: Vec<Diagnostic>,
    count: usize,
}

impl Bad {
    fn check(&mut self, row: i64, col: i64, value: f64, k: usize) -> Option<Entry> {
        let inside = |index: i64| (0..self.n as i64).contains(&index);
        let (code, message) = if !inside(row) || !inside(col) {
            (
                Code::MatrixIndex,
                format!(
                    "entry {k} (from 0) is at ({row}, {col}), the matrix has indices 0 to {}",
                    self.n as i64 - 1
                ),
            )
        } else if !value.is_finite() {
            (Code::MatrixNotFinite, format!("entry {k} (from 0) at ({row}, {col}) is {value}"))
        } else {
            return (value != 0.0).then_some(Entry { row: row as u32, col: col as u32, value });
        };
        self.count += 1;
        if self.shown.len() < 5 {
            self.shown.push(Diagnostic::new(code, message));
        }
        None
    }

    fn finish(mut self, group: &str) -> Vec<Diagnostic> {
        let more = self.count - self.shown.len();
        if more > 0 {
            let message = format!("{more} more entries of group `{group}` have errors");
            self.shown.push(Diagnostic::new(Code::MatrixIndex, message));
        }
        self.shown
    }
}
