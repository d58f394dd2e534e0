//! Matrices of PETSc in its binary form, as `MatView` writes them into a binary viewer:
//! <https://petsc.org/release/manualpages/Mat/MatLoad/>. All numbers are big-endian. Integers have 32 or 64 bits and
//! values 4, 8 or 16 bytes, by the configuration of PETSc. The file does not state these sizes, but they follow from
//! its first number and its length.

use super::assemble::{Entry, check_extents, check_size};
use super::compressed::Compressed;
use super::operator::OperatorColumns;
use super::reader::{ArraySource, MatrixSource, Reader};
use super::rectangular::Rectangular;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_model::RawMatrix;

/// Reader of PETSc's binary files.
pub(crate) struct Petsc;

/// Number at the beginning of a matrix. Other objects have similar numbers.
const MATRIX: u64 = 1_211_216;
const OTHERS: &[(u64, &str)] =
    &[(1_211_214, "a vector"), (1_211_218, "an index set"), (1_211_219, "a bag"), (1_211_221, "a mesh")];

const HELP: &str = "write it again: MatView(A, viewer) with a viewer of PetscViewerBinaryOpen";
const BOTH_TRIANGLES: &str = "store both triangles: MatConvert(A, MATAIJ, MAT_INITIAL_MATRIX, &B)";

impl Reader for Petsc {
    fn name(&self) -> &'static str {
        "PETSc"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["petsc"]
    }

    /// Recognises a file that begins with the number of an object of PETSc.
    fn recognises(&self, head: &[u8]) -> bool {
        Whole::of(head).is_some()
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let read = || {
            source.has_one_matrix("a PETSc file")?;
            read(source.not_packed("PETSc file")?, source)
        };
        read().map_err(|diagnostic: Diagnostic| Error::from(diagnostic.in_file(source.file.path())))
    }

    fn read_operator(&self, source: &ArraySource<'_>) -> Option<Diagnosed<OperatorColumns>> {
        let read = || read_rectangular(source.file.bytes()).map(Rectangular::operator);
        source.is_plain_of_one().then(|| read().map_err(|diagnostic| vec![diagnostic]))
    }
}

/// Size of an integer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Whole {
    Four,
    Eight,
}

impl Whole {
    /// Returns the size of the integers, if the file begins with the number of an object.
    fn of(head: &[u8]) -> Option<Self> {
        let known = |number: i64| {
            u64::try_from(number).is_ok_and(|id_of_file| {
                id_of_file == MATRIX || OTHERS.iter().any(|(id, _)| *id == id_of_file)
            })
        };
        [Self::Four, Self::Eight].into_iter().find(|whole| whole.get(head, 0).is_some_and(known))
    }

    fn bytes(self) -> usize {
        match self {
            Self::Four => 4,
            Self::Eight => 8,
        }
    }

    /// Returns the k-th number of a list.
    fn get(self, bytes: &[u8], k: usize) -> Option<i64> {
        let bytes_of_number = bytes.get(k * self.bytes()..(k + 1) * self.bytes())?;
        Some(match self {
            Self::Four => i64::from(i32::from_be_bytes(bytes_of_number.try_into().ok()?)),
            Self::Eight => i64::from_be_bytes(bytes_of_number.try_into().ok()?),
        })
    }

    /// Splits off a list of `count` numbers.
    fn list(self, bytes: &[u8], count: u64) -> Option<(&[u8], &[u8])> {
        let length = usize::try_from(count).ok()?.checked_mul(self.bytes())?;
        bytes.split_at_checked(length)
    }
}

/// Arrays of a matrix in its file.
struct Stored<'a> {
    whole: Whole,
    rows: u64,
    columns: u64,
    entries: u64,
    lengths: &'a [u8],
    indices: &'a [u8],
    values: &'a [u8],
    is_single: bool,
}

impl<'a> Stored<'a> {
    /// Splits the file into its arrays. A matrix has a head of four numbers, the lengths of its rows, the column indices
    /// and the values. `check` refuses extents and numbers of entries.
    fn of(
        bytes: &'a [u8],
        check: impl FnOnce(u64, u64, u64) -> std::result::Result<(), Diagnostic>,
    ) -> std::result::Result<Self, Diagnostic> {
        let cut_off = || {
            let message = "file ends before the matrix does: it may be cut off";
            Diagnostic::new(Code::MatrixCount, message).with_help(HELP)
        };
        let Some(whole) = Whole::of(bytes) else {
            let message = "file does not begin with the number of a matrix of PETSc, 1211216";
            return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP));
        };
        let (head, rest) = whole.list(bytes, 4).ok_or_else(cut_off)?;
        let [kind, rows, columns, entries] = std::array::from_fn(|k| whole.get(head, k).unwrap_or(-1));
        let entries = entry_count(kind, entries)?;
        let [rows, columns] = [rows, columns].map(|extent| extent.max(0) as u64);
        check(rows, columns, entries)?;
        let (lengths, rest) = whole.list(rest, rows).ok_or_else(cut_off)?;
        let (indices, values) = whole.list(rest, entries).ok_or_else(cut_off)?;
        let size = value_bytes(values.len(), entries).ok_or_else(|| wrong_size(values, entries, whole))?;
        Ok(Self { whole, rows, columns, entries, lengths, indices, values, is_single: size == 4 })
    }

    /// Returns the start of each row among the entries, and the end of the last.
    fn pointers(&self) -> Vec<u64> {
        let mut pointers = vec![0u64];
        for k in 0..self.rows as usize {
            let length = self.whole.get(self.lengths, k).and_then(|length| u64::try_from(length).ok());
            pointers.push(pointers[k].saturating_add(length.unwrap_or(u64::MAX)));
        }
        pointers
    }

    /// Returns column and value of an entry.
    fn entry(&self, k: usize) -> (i64, f64) {
        let value = if self.is_single {
            self.values[4 * k..].first_chunk().map(|b| f64::from(f32::from_be_bytes(*b)))
        } else {
            self.values[8 * k..].first_chunk().map(|b| f64::from_be_bytes(*b))
        };
        (self.whole.get(self.indices, k).unwrap_or(-1), value.unwrap_or(f64::NAN))
    }
}

fn read(bytes: &[u8], source: &MatrixSource<'_>) -> std::result::Result<RawMatrix, Diagnostic> {
    let stored = Stored::of(bytes, |rows, columns, entries| check_size(rows, columns, entries).map(|_| ()))?;
    let compressed = Compressed {
        n: stored.rows as usize,
        by_rows: true,
        pointers: stored.pointers(),
        pointers_name: "the sum of the lengths of the rows",
        entries: stored.entries as usize,
        entry: &|k| stored.entry(k),
        help: HELP,
        both_triangles: BOTH_TRIANGLES,
    };
    let raw = compressed.assemble(source.file.path())?;
    Ok(RawMatrix { digits: if stored.is_single { raw.digits.min(7) } else { raw.digits }, ..raw })
}

/// Reads a matrix that need not be square.
///
/// # Errors
/// FB301 to FB306 for an invalid matrix, FB313 for one beyond memory.
fn read_rectangular(bytes: &[u8]) -> std::result::Result<Rectangular, Diagnostic> {
    let check = |rows, columns, entries| check_extents(rows, columns, entries).map(|_| ());
    let stored = Stored::of(bytes, check)?;
    let pointers = stored.pointers();
    if pointers.last() != Some(&stored.entries) {
        let message = format!("the lengths of the rows do not add up to {} entries", stored.entries);
        return Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP));
    }
    let mut entries = Vec::with_capacity(stored.entries as usize);
    for (row, pair) in pointers.windows(2).enumerate() {
        for k in pair[0]..pair[1] {
            let (col, value) = stored.entry(k as usize);
            entries.push(Entry { row: row as u32, col: u32::try_from(col).unwrap_or(u32::MAX), value });
        }
    }
    Rectangular { rows: stored.rows as usize, columns: stored.columns as usize, entries }.checked()
}

/// Returns the number of stored entries of a sparse matrix; refuses other objects.
fn entry_count(kind: i64, entries: i64) -> std::result::Result<u64, Diagnostic> {
    let refuse = |message: String, help| Err(Diagnostic::new(Code::MatrixKind, message).with_help(help));
    if let Some((_, what)) = OTHERS.iter().find(|(id, _)| *id as i64 == kind) {
        return refuse(format!("file holds {what} of PETSc, not a matrix"), HELP);
    }
    match entries {
        -1 => refuse(
            "matrix is stored as a dense one".to_owned(),
            "convert it: MatConvert(A, MATAIJ, MAT_INITIAL_MATRIX, &B)",
        ),
        _ => u64::try_from(entries).map_err(|_| {
            let message = format!("the number of entries is {entries}");
            Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP)
        }),
    }
}

/// Returns the number of bytes of a real value, if `bytes` are those of `entries` values.
fn value_bytes(bytes: usize, entries: u64) -> Option<u64> {
    [8, 4].into_iter().find(|size| entries.checked_mul(*size) == Some(bytes as u64))
}

/// Returns a diagnostic of the bytes after the indices, if they do not hold one real value per entry.
fn wrong_size(values: &[u8], entries: u64, whole: Whole) -> Diagnostic {
    let bytes = values.len();
    let following = entries.checked_mul(8).and_then(|end| values.get(usize::try_from(end).ok()?..));
    if following.is_some_and(|rest| Whole::of(rest) == Some(whole)) {
        let message = "file holds several objects of PETSc";
        return Diagnostic::new(Code::Hdf5Layout, message).with_help("write every matrix to a separate file");
    }
    if entries.checked_mul(16) == Some(bytes as u64) {
        let message = "values have 16 bytes: they are complex, or of quadruple precision";
        return Diagnostic::new(Code::MatrixKind, message)
            .with_help("write it by PETSc with real scalars of double precision");
    }
    let message = format!("header announces {entries} entries, {bytes} bytes of values follow their indices");
    Diagnostic::new(Code::MatrixCount, message)
}
