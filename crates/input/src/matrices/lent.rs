//! Numbers of a matrix that are stored in a file instead of in memory. The operating system reads them on access and
//! discards them when memory is short, so that a matrix may be larger than the memory.

use super::assemble::Entry;
use bytemuck::{AnyBitPattern, NoUninit};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::{CscMatrix, Stored};
use memmap2::Mmap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::marker::PhantomData;
use std::panic::{RefUnwindSafe, UnwindSafe};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tempfile::tempfile_in;

/// Number of bytes that are written at a time.
const BYTES_PER_WRITE: usize = 1 << 20;

/// Type of stored numbers.
pub(super) trait Number: AnyBitPattern + NoUninit + Send + Sync + UnwindSafe + RefUnwindSafe {}

impl Number for u32 {}
impl Number for f64 {}

/// Numbers that are written to a file without a name, which disappears with its last use.
pub(super) struct StoredNumbers<T> {
    out: BufWriter<File>,
    folder: PathBuf,
    count: usize,
    numbers: PhantomData<T>,
}

impl<T: Number> StoredNumbers<T> {
    /// Creates a file in `folder`.
    ///
    /// # Errors
    /// FB104 if no file can be created.
    pub(crate) fn new(folder: &Path) -> Result<Self, Diagnostic> {
        let file = tempfile_in(folder).map_err(|e| unwritable(folder, &e))?;
        let out = BufWriter::with_capacity(BYTES_PER_WRITE, file);
        Ok(Self { out, folder: folder.to_owned(), count: 0, numbers: PhantomData })
    }

    /// Appends a number.
    ///
    /// # Errors
    /// FB104 if the disk is full.
    pub(crate) fn push(&mut self, number: T) -> Result<(), Diagnostic> {
        self.count += 1;
        self.out.write_all(bytemuck::bytes_of(&number)).map_err(|e| unwritable(&self.folder, &e))
    }

    /// Returns all numbers, in the order in which they were appended.
    ///
    /// # Errors
    /// FB104 if the disk is full, FB101 if the file cannot be read again.
    pub(crate) fn lend(self) -> Result<Stored<T>, Diagnostic> {
        if self.count == 0 {
            return Ok(Vec::new().into());
        }
        let file = self.out.into_inner().map_err(|e| unwritable(&self.folder, e.error()))?;
        let map = mapped(&file, &self.folder)?;
        Ok(Stored::Lent(Arc::new(Lent { map, _file: file, numbers: PhantomData })))
    }
}

/// Compressed columns that are written to files.
pub(super) struct StoredColumns {
    col_ptr: Vec<usize>,
    rows: StoredNumbers<u32>,
    values: StoredNumbers<f64>,
    /// Column and row of the last entry.
    last: Option<(u32, u32)>,
    ascends: bool,
}

impl StoredColumns {
    /// Creates the files in `folder` for a matrix of `n` columns.
    ///
    /// # Errors
    /// The errors of [`StoredNumbers::new`].
    pub(crate) fn new(folder: &Path, n: usize) -> Result<Self, Diagnostic> {
        let (rows, values) = (StoredNumbers::new(folder)?, StoredNumbers::new(folder)?);
        Ok(Self { col_ptr: vec![0; n + 1], rows, values, last: None, ascends: true })
    }

    /// Appends an entry.
    ///
    /// # Errors
    /// The errors of [`StoredNumbers::push`].
    pub(crate) fn push(&mut self, entry: Entry) -> Result<(), Diagnostic> {
        let at = Some((entry.col, entry.row));
        self.ascends &= self.last < at;
        self.last = at;
        self.col_ptr[entry.col as usize + 1] += 1;
        self.rows.push(entry.row)?;
        self.values.push(entry.value)
    }

    /// Returns the matrix; `None` if entries did not come sorted, or one came twice.
    ///
    /// # Errors
    /// The errors of [`StoredNumbers::lend`].
    pub(crate) fn compress(mut self) -> Result<Option<CscMatrix>, Diagnostic> {
        if !self.ascends {
            return Ok(None);
        }
        let n = self.col_ptr.len() - 1;
        for j in 0..n {
            self.col_ptr[j + 1] += self.col_ptr[j];
        }
        Ok(Some(CscMatrix::from_parts(n, n, self.col_ptr, self.rows.lend()?, self.values.lend()?)))
    }
}

fn unwritable(folder: &Path, error: &std::io::Error) -> Diagnostic {
    let message = format!("the numbers of a matrix cannot be stored in {}: {error}", folder.display());
    Diagnostic::new(Code::OutputUnwritable, message)
}

// The one exception to `unsafe_code = "deny"` in this crate: a memory map is safe only while no program truncates its
// file. The files of this module have no name: no other program can open them, and this module does not write to them
// after mapping.
#[allow(unsafe_code)]
fn mapped(file: &File, folder: &Path) -> Result<Mmap, Diagnostic> {
    // SAFETY: the map is read-only and private to this module, and the file has no name.
    unsafe { Mmap::map(file) }.map_err(|e| {
        Diagnostic::new(Code::FileUnreadable, format!("file cannot be read: {e}")).in_file(folder)
    })
}

/// Mapped file of numbers.
struct Lent<T> {
    map: Mmap,
    /// File that stays open while it is mapped.
    _file: File,
    numbers: PhantomData<T>,
}

impl<T: Number> AsRef<[T]> for Lent<T> {
    fn as_ref(&self) -> &[T] {
        bytemuck::cast_slice(&self.map)
    }
}
