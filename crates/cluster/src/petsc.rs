//! Matrices and vectors in the binary form of PETSc: written for `MatLoad` and `VecLoad`, vectors read from `VecView`.
//! All numbers are big-endian.

use faer::MatRef;
use flexbody_base::provenance::Fingerprint;
use std::io::{BufWriter, Read, Result, Write};

const MATRIX: i64 = 1_211_216;
const VECTOR: i64 = 1_211_214;

/// Size of the integers of a file, which depends on the configuration of PETSc.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum IndexBytes {
    Four,
    Eight,
}

impl IndexBytes {
    /// Returns the size with this number of bytes; `None` for other numbers than 4 and 8.
    pub(crate) fn of(bytes: u64) -> Option<Self> {
        match bytes {
            4 => Some(Self::Four),
            8 => Some(Self::Eight),
            _ => None,
        }
    }

    /// Returns the number of bytes.
    pub(crate) fn bytes(self) -> u64 {
        match self {
            Self::Four => 4,
            Self::Eight => 8,
        }
    }

    /// Returns the largest integer.
    pub(crate) fn largest(self) -> u64 {
        match self {
            Self::Four => i32::MAX as u64,
            Self::Eight => i64::MAX as u64,
        }
    }

    fn put(self, to: &mut impl Write, number: i64) -> Result<()> {
        match self {
            // Numbers that do not fit were refused earlier.
            Self::Four => to.write_all(&(number as i32).to_be_bytes()),
            Self::Eight => to.write_all(&number.to_be_bytes()),
        }
    }

    fn get(self, from: &mut impl Read) -> Result<i64> {
        let mut bytes = [0; 8];
        match self {
            Self::Four => {
                from.read_exact(&mut bytes[..4])?;
                let [a, b, c, d, ..] = bytes;
                Ok(i64::from(i32::from_be_bytes([a, b, c, d])))
            }
            Self::Eight => {
                from.read_exact(&mut bytes)?;
                Ok(i64::from_be_bytes(bytes))
            }
        }
    }
}

/// Writer that computes the fingerprint of the bytes.
struct Sealing<W> {
    out: W,
    fingerprint: Fingerprint,
}

impl<W: Write> Write for Sealing<W> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let written = self.out.write(bytes)?;
        self.fingerprint.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> Result<()> {
        self.out.flush()
    }
}

/// Size of the write buffer in bytes.
const BUFFER_BYTES: usize = 1 << 20;

fn sealing<W: Write>(out: W, fill: impl FnOnce(&mut BufWriter<Sealing<W>>) -> Result<()>) -> Result<String> {
    let mut to = BufWriter::with_capacity(BUFFER_BYTES, Sealing { out, fingerprint: Fingerprint::default() });
    fill(&mut to)?;
    let mut sealing = to.into_inner().map_err(std::io::IntoInnerError::into_error)?;
    sealing.flush()?;
    Ok(sealing.fingerprint.hex())
}

/// Square matrix, given row by row.
pub(super) trait Rows {
    /// Returns the number of rows.
    fn n(&self) -> usize;

    /// Returns the number of entries of all rows.
    fn entries(&self) -> u64;

    /// Replaces `entries` by columns, ascending, and values of a row.
    fn row(&self, row: usize, entries: &mut Vec<(u32, f64)>);
}

/// Writes a matrix row by row, without a copy of it. Returns the SHA-256 of the bytes.
pub(super) fn write_matrix(out: impl Write, rows: &impl Rows, index: IndexBytes) -> Result<String> {
    let (n, mut entries) = (rows.n(), Vec::new());
    sealing(out, |to| {
        // PETSc stores header, row lengths, column indices and values one after the other: pass over the rows for each.
        for number in [MATRIX, n as i64, n as i64, rows.entries() as i64] {
            index.put(to, number)?;
        }
        for row in 0..n {
            rows.row(row, &mut entries);
            index.put(to, entries.len() as i64)?;
        }
        for row in 0..n {
            rows.row(row, &mut entries);
            entries.iter().try_for_each(|(column, _)| index.put(to, i64::from(*column)))?;
        }
        for row in 0..n {
            rows.row(row, &mut entries);
            entries.iter().try_for_each(|(_, value)| to.write_all(&value.to_be_bytes()))?;
        }
        Ok(())
    })
}

/// Writes columns as consecutive vectors. Returns the SHA-256 of the bytes.
pub(super) fn write_vectors(out: impl Write, columns: MatRef<'_, f64>, index: IndexBytes) -> Result<String> {
    sealing(out, |to| {
        for j in 0..columns.ncols() {
            index.put(to, VECTOR)?;
            index.put(to, columns.nrows() as i64)?;
            columns.col(j).iter().try_for_each(|value| to.write_all(&value.to_be_bytes()))?;
        }
        Ok(())
    })
}

/// Reads the next vector of `n` numbers; `None` if the file holds something else.
pub(super) fn read_vector(from: &mut impl Read, n: usize, index: IndexBytes) -> Result<Option<Vec<f64>>> {
    if index.get(from)? != VECTOR || index.get(from)? != n as i64 {
        return Ok(None);
    }
    let (mut values, mut bytes) = (Vec::with_capacity(n), [0; 8]);
    for _ in 0..n {
        from.read_exact(&mut bytes)?;
        values.push(f64::from_be_bytes(bytes));
    }
    Ok(Some(values))
}
