//! Numbers of a matrix that are kept in a file instead of in memory. The system reads them when they are touched
//! and forgets them when memory is short, so that a matrix may be larger than that.

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

/// Bytes that are written at a time.
const PIECE: usize = 1 << 20;

/// What is kept so.
pub(super) trait Number: AnyBitPattern + NoUninit + Send + Sync + UnwindSafe + RefUnwindSafe {}

impl Number for u32 {}
impl Number for f64 {}

/// Numbers on their way into a file without a name, which goes when nobody needs it any more.
pub(super) struct Kept<T> {
    out: BufWriter<File>,
    folder: PathBuf,
    count: usize,
    numbers: PhantomData<T>,
}

impl<T: Number> Kept<T> {
    /// In a file in `folder`.
    ///
    /// # Errors
    /// FB104 when none can be made there.
    pub(crate) fn new(folder: &Path) -> Result<Self, Diagnostic> {
        let file = tempfile_in(folder).map_err(|e| unwritable(folder, &e))?;
        let out = BufWriter::with_capacity(PIECE, file);
        Ok(Self { out, folder: folder.to_owned(), count: 0, numbers: PhantomData })
    }

    /// # Errors
    /// FB104 when the disk is full.
    pub(crate) fn push(&mut self, number: T) -> Result<(), Diagnostic> {
        self.count += 1;
        self.out.write_all(bytemuck::bytes_of(&number)).map_err(|e| unwritable(&self.folder, &e))
    }

    /// All of them, in the order in which they came.
    ///
    /// # Errors
    /// FB104 when the disk is full, FB101 when the file cannot be read again.
    pub(crate) fn lend(self) -> Result<Stored<T>, Diagnostic> {
        if self.count == 0 {
            return Ok(Vec::new().into());
        }
        let file = self.out.into_inner().map_err(|e| unwritable(&self.folder, e.error()))?;
        let map = mapped(&file, &self.folder)?;
        Ok(Stored::Lent(Arc::new(Lent { map, _file: file, numbers: PhantomData })))
    }
}

/// Compressed columns on their way into files.
pub(super) struct KeptColumns {
    col_ptr: Vec<usize>,
    rows: Kept<u32>,
    values: Kept<f64>,
    /// Column and row of the last entry.
    last: Option<(u32, u32)>,
    ascends: bool,
}

impl KeptColumns {
    /// # Errors
    /// As [`Kept::new`].
    pub(crate) fn new(folder: &Path, n: usize) -> Result<Self, Diagnostic> {
        let (rows, values) = (Kept::new(folder)?, Kept::new(folder)?);
        Ok(Self { col_ptr: vec![0; n + 1], rows, values, last: None, ascends: true })
    }

    /// # Errors
    /// As [`Kept::push`].
    pub(crate) fn push(&mut self, entry: Entry) -> Result<(), Diagnostic> {
        let at = Some((entry.col, entry.row));
        self.ascends &= self.last < at;
        self.last = at;
        self.col_ptr[entry.col as usize + 1] += 1;
        self.rows.push(entry.row)?;
        self.values.push(entry.value)
    }

    /// The matrix; `None` where entries did not come sorted, or one came twice.
    ///
    /// # Errors
    /// As [`Kept::lend`].
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
    let message = format!("the numbers of a matrix cannot be kept in {}: {error}", folder.display());
    Diagnostic::new(Code::OutputUnwritable, message)
}

// The one exception to `unsafe_code = "deny"` in this room: a memory map is sound only while nobody truncates the file
// under it. The files of this module have no name: no other program can open them, and nothing here writes to them.
#[allow(unsafe_code)]
fn mapped(file: &File, folder: &Path) -> Result<Mmap, Diagnostic> {
    // SAFETY: the map is read-only and private to this module, and the file has no name.
    unsafe { Mmap::map(file) }.map_err(|e| {
        Diagnostic::new(Code::FileUnreadable, format!("file cannot be read: {e}")).in_file(folder)
    })
}

/// A file of numbers.
struct Lent<T> {
    map: Mmap,
    /// Open as long as it is mapped.
    _file: File,
    numbers: PhantomData<T>,
}

impl<T: Number> AsRef<[T]> for Lent<T> {
    fn as_ref(&self) -> &[T] {
        bytemuck::cast_slice(&self.map)
    }
}
