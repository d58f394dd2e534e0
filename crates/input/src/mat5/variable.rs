//! One variable of a MAT-file: what it is, and the matrix that it holds.

use super::HELP;
use super::elements::{Elements, Found, Numbers, Order};
use crate::assemble::{check_size, most_entries_of};
use crate::compressed::Compressed;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_model::RawMatrix;
use std::path::Path;

/// Bytes that flags, extents and the name of a variable may have each.
const HEAD_BYTES: u64 = 1 << 16;

const REAL: &str = "save a matrix of real numbers: K = sparse(real(K)); save('FILE.mat', 'K')";
const BOTH_TRIANGLES: &str = "save both triangles: K + tril(K, -1)'";

/// What a variable holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum VariableKind {
    Sparse,
    /// A full array of real numbers with two extents.
    Full,
    /// What is no matrix, in words.
    Other(&'static str),
}

/// A variable whose head has been read.
pub(super) struct Variable<'a> {
    pub name: String,
    pub kind: VariableKind,
    pub rows: u64,
    pub columns: u64,
    single: bool,
    /// What its values are, when they are no real numbers.
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

    /// Flags, extents and name.
    fn head(elements: &mut Elements<'a>) -> Found<[Numbers; 3]> {
        let mut next = || elements.next(HEAD_BYTES);
        let head = [next()?, next()?, next()?];
        if head[0].len() < 2 || !head[0].is_whole() || !head[1].is_whole() {
            let message = "a variable does not begin with its flags and extents";
            return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP));
        }
        Ok(head)
    }

    /// The matrix that it is.
    ///
    /// # Errors
    /// FB302 for what is no matrix of real numbers, FB103, and those of matrices.
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
                let own = [elements.next(indices)?, elements.next(pointers)?, elements.next(values)?];
                self.sparse(own, path)?
            }
            (VariableKind::Full, None) => {
                let places = self.rows.saturating_mul(self.columns);
                self.full(&elements.next(places.saturating_mul(8))?, path)?
            }
        };
        elements.finish()?;
        Ok(RawMatrix { digits: if self.single { raw.digits.min(7) } else { raw.digits }, ..raw })
    }

    /// Largest number of entries that a matrix of this size may have.
    fn most_entries(&self) -> u64 {
        most_entries_of(self.columns).min(u64::MAX / 8)
    }

    fn sparse(&self, [indices, pointers, values]: [Numbers; 3], path: &Path) -> Found<RawMatrix> {
        let n = check_size(self.rows, self.columns, values.len() as u64)?;
        let pointers: Vec<u64> = (0..pointers.len())
            .map(|k| pointers.whole(k).and_then(|at| u64::try_from(at).ok()).unwrap_or(u64::MAX))
            .collect();
        // There may be room for more entries than there are.
        let room = indices.len().min(values.len());
        let entries = pointers.last().map_or(0, |last| (*last).min(room as u64) as usize);
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
