//! A variable of a MAT-file: its kind, and its matrix.

use super::HELP;
use super::elements::{Elements, Found, Numbers, Order};
use crate::assemble::{check_size, most_entries_of};
use crate::compressed::Compressed;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_model::RawMatrix;
use std::path::Path;

/// Largest number of bytes of the flags, the extents and the name of a variable, each.
const HEAD_BYTES: u64 = 1 << 16;

const REAL: &str = "save a matrix of real numbers: K = sparse(real(K)); save('FILE.mat', 'K')";
const BOTH_TRIANGLES: &str = "save both triangles: K + tril(K, -1)'";

/// Kind of the content of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum VariableKind {
    Sparse,
    /// Full array of real numbers with two extents.
    Full,
    /// Content that is no matrix, in words.
    Other(&'static str),
}

/// Variable whose head has been read.
pub(super) struct Variable<'a> {
    pub name: String,
    pub kind: VariableKind,
    pub rows: u64,
    pub columns: u64,
    single: bool,
    /// Kind of its values, if they are no real numbers.
    not_real: Option<&'static str>,
    body: &'a [u8],
    compressed: bool,
    order: Order,
}

impl<'a> Variable<'a> {
    /// Reads the head of the variable in `body`.
    ///
    /// # Errors
    /// FB103 for damaged packed bytes, FB301, FB304.
    pub(super) fn open(body: &'a [u8], compressed: bool, order: Order) -> Found<Self> {
        let [flags, extents, name] = Self::head(&mut Elements::of(body, compressed, order)?)?;
        let flags = flags.whole(0).unwrap_or(0);
        let extent = |k: usize| extents.whole(k).and_then(|extent| u64::try_from(extent).ok()).unwrap_or(0);
        let kind = match (flags & 0xff, extents.len()) {
            (5, 2) => VariableKind::Sparse,
            (6..=15, 2) => VariableKind::Full,
            (6..=15, _) => VariableKind::Other("an array of more than two extents"),
            (1, _) => VariableKind::Other("a cell array"),
            (2, _) => VariableKind::Other("a struct"),
            (4, _) => VariableKind::Other("a text"),
            _ => VariableKind::Other("an object"),
        };
        let not_real = match flags >> 8 {
            flags if flags & 8 != 0 => Some("complex numbers"),
            flags if flags & 2 != 0 => Some("logical values"),
            _ => None,
        };
        Ok(Self {
            name: String::from_utf8_lossy(&name.bytes).into_owned(),
            kind,
            rows: extent(0),
            columns: extent(1),
            single: flags & 0xff == 7,
            not_real,
            body,
            compressed,
            order,
        })
    }

    /// Reads flags, extents and name.
    fn head(elements: &mut Elements<'a>) -> Found<[Numbers; 3]> {
        let mut next = || elements.next(HEAD_BYTES);
        let head = [next()?, next()?, next()?];
        if head[0].len() < 2 || !head[0].is_whole() || !head[1].is_whole() {
            let message = "a variable does not begin with its flags and extents";
            return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP));
        }
        Ok(head)
    }

    /// Returns the matrix of the variable.
    ///
    /// # Errors
    /// FB302 for a variable that is no matrix of real numbers, FB103, and the errors of matrices.
    pub(super) fn matrix(&self, path: &Path) -> Found<RawMatrix> {
        let mut elements = Elements::of(self.body, self.compressed, self.order)?;
        Self::head(&mut elements)?;
        let raw = match (self.kind, self.not_real) {
            (VariableKind::Other(what), _) | (_, Some(what)) => {
                let message = format!("variable `{}` holds {what}, not a matrix of real numbers", self.name);
                return Err(Diagnostic::new(Code::MatrixKind, message).with_help(REAL));
            }
            (VariableKind::Sparse, None) => {
                let (indices, values) = (self.most_entries() * 4, self.most_entries() * 8);
                let pointers = self.columns.saturating_add(1).saturating_mul(8);
                let arrays = [elements.next(indices)?, elements.next(pointers)?, elements.next(values)?];
                self.sparse(arrays, path)?
            }
            (VariableKind::Full, None) => {
                let places = self.rows.saturating_mul(self.columns);
                self.full(&elements.next(places.saturating_mul(8))?, path)?
            }
        };
        elements.finish()?;
        Ok(RawMatrix { digits: if self.single { raw.digits.min(7) } else { raw.digits }, ..raw })
    }

    /// Returns the largest number of entries of a matrix of this size.
    fn most_entries(&self) -> u64 {
        most_entries_of(self.columns).min(u64::MAX / 8)
    }

    fn sparse(&self, [indices, pointers, values]: [Numbers; 3], path: &Path) -> Found<RawMatrix> {
        let n = check_size(self.rows, self.columns, values.len() as u64)?;
        let pointers: Vec<u64> = (0..pointers.len())
            .map(|k| pointers.whole(k).and_then(|at| u64::try_from(at).ok()).unwrap_or(u64::MAX))
            .collect();
        // The arrays may have capacity for more entries than are used.
        let count = indices.len().min(values.len());
        let entries = pointers.last().map_or(0, |last| (*last).min(count as u64) as usize);
        let compressed = Compressed {
            n,
            by_rows: false,
            pointers,
            pointers_name: "the list of columns (jc)",
            entries,
            entry: &|k| (indices.whole(k).unwrap_or(-1), values.real(k).unwrap_or(f64::NAN)),
            help: HELP,
            both_triangles: BOTH_TRIANGLES,
        };
        compressed.assemble(path)
    }

    fn full(&self, values: &Numbers, path: &Path) -> Found<RawMatrix> {
        if self.rows.checked_mul(self.columns) != Some(values.len() as u64) {
            let (rows, columns, count) = (self.rows, self.columns, values.len());
            let message =
                format!("variable `{}` has {rows} x {columns} places and {count} values", self.name);
            return Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP));
        }
        let n = check_size(self.rows, self.columns, values.len() as u64)?;
        let compressed = Compressed {
            n,
            by_rows: false,
            pointers: (0..=n as u64).map(|column| column * n as u64).collect(),
            pointers_name: "the list of columns",
            entries: n * n,
            entry: &|k| ((k % n) as i64, values.real(k).unwrap_or(f64::NAN)),
            help: HELP,
            both_triangles: BOTH_TRIANGLES,
        };
        compressed.assemble(path)
    }
}
