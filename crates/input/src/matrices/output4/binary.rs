//! Binary files: records of Fortran, each between two lengths, in either byte order and with words of four or eight
//! bytes.

use super::columns::{ColumnRecord, Columns, Header, SINGLE_DIGITS, Stored, cut_off};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::InputFile;

/// Storage of the numbers of a file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Binary {
    is_big_endian: bool,
    /// Number of bytes of a word: 4 or 8.
    word: usize,
}

impl Binary {
    /// Returns the storage of a file that begins with `head`; `None` if it is no binary OUTPUT4 file.
    pub(super) fn of(head: &[u8]) -> Option<Self> {
        let length: [u8; 4] = head.get(..4)?.try_into().ok()?;
        let layout = [(24, 4), (48, 8)].into_iter().find_map(|(bytes, word)| {
            let is_big_endian = match bytes {
                _ if u32::from_le_bytes(length) == bytes => false,
                _ if u32::from_be_bytes(length) == bytes => true,
                _ => return None,
            };
            Some(Self { is_big_endian, word })
        })?;
        let (record, _) = layout.record(head, 0)?;
        let [_, _, form, kind] = [0, 1, 2, 3].map(|k| layout.integer(record, k));
        let name = &record[4 * layout.word..];
        let is_name = name.iter().all(|b| b.is_ascii_graphic() || matches!(b, b' ' | 0));
        ((1..=15).contains(&form?) && (1..=4).contains(&kind?) && is_name).then_some(layout)
    }

    /// Returns the positions of the columns of the matrices.
    ///
    /// # Errors
    /// FB301, FB303, FB304 for records that do not belong to a matrix.
    pub(super) fn contents(self, file: &InputFile) -> Result<Vec<Stored>, Diagnostic> {
        let bytes = file.bytes();
        let (mut at, mut all) = (0, Vec::new());
        while at < bytes.len() {
            let (record, next) = self.record(bytes, at).ok_or_else(|| cut_off("a header"))?;
            let [columns, rows, form, kind] = [0, 1, 2, 3].map(|k| self.integer(record, k).unwrap_or(0));
            let name = record.get(4 * self.word..).unwrap_or_default();
            let name = if self.word == 8 { Header::name_of_wide_words(name) } else { name.to_vec() };
            let mut stored = Stored::new(Header::new(columns, rows, form, kind, &name)?);
            let size = self.size(&stored.header);
            at = next;
            loop {
                let header = &stored.header;
                let (record, next) = self.record(bytes, at).ok_or_else(|| cut_off(&header.name))?;
                let column = self.integer(record, 0).ok_or_else(|| misread(header))?;
                let column = header.column(column)?;
                let bytes = at..next;
                at = next;
                let ColumnRecord::Number(column) = column else { break };
                stored.add(column, record.len() / size, bytes, 0);
            }
            all.push(stored);
        }
        Ok(all)
    }

    /// Returns the entries of some columns.
    ///
    /// # Errors
    /// FB301 for records that cannot be parsed, FB303 for indices outside the matrix, FB306 for values that are not
    /// finite.
    pub(super) fn columns(self, bytes: &[u8], header: &Header) -> Result<Columns, Diagnostic> {
        let mut columns = Columns::with_capacity(bytes.len() / self.size(header));
        columns.written = if self.size(header) == 4 { SINGLE_DIGITS } else { 17 };
        let mut at = 0;
        while let Some((record, next)) = self.record(bytes, at) {
            at = next;
            let column = self.integer(record, 0).ok_or_else(|| misread(header))?;
            let ColumnRecord::Number(column) = header.column(column)? else { break };
            self.column(record, header, column, &mut columns)?;
        }
        Ok(columns)
    }

    /// Returns the number of bytes of a value. A word of eight bytes holds any number.
    fn size(self, header: &Header) -> usize {
        if header.is_single() { self.word } else { 8 }
    }

    /// Reads the values of one column.
    fn column(
        self,
        record: &[u8],
        header: &Header,
        column: u32,
        columns: &mut Columns,
    ) -> Result<(), Diagnostic> {
        let misread = || misread(header);
        let start = self.integer(record, 1).ok_or_else(misread)?;
        let words =
            self.integer(record, 2).and_then(|words| usize::try_from(words).ok()).ok_or_else(misread)?;
        let data = record.get(3 * self.word..).ok_or_else(misread)?;
        let data = words.checked_mul(self.word).and_then(|bytes| data.get(..bytes)).ok_or_else(misread)?;
        // A start other than zero marks a dense column.
        if start != 0 {
            return self.values(data, header, start, column, columns);
        }
        // A sparse column consists of strings, each with one or two words of start and length.
        let mut rest = data;
        while !rest.is_empty() {
            let first = self.integer(rest, 0).ok_or_else(misread)?;
            let (start, length, head) = if header.is_big {
                (self.integer(rest, 1).ok_or_else(misread)?, first.saturating_sub(1), 2)
            } else {
                let (start, length) = Header::unpacked(first);
                (start, length, 1)
            };
            let bytes = usize::try_from(length).ok().filter(|words| *words > 0);
            let bytes = bytes.and_then(|words| words.checked_mul(self.word)).ok_or_else(misread)?;
            let from = head * self.word;
            let end = from.checked_add(bytes).ok_or_else(misread)?;
            self.values(rest.get(from..end).ok_or_else(misread)?, header, start, column, columns)?;
            rest = &rest[end..];
        }
        Ok(())
    }

    /// Reads consecutive values of a column.
    fn values(
        self,
        data: &[u8],
        header: &Header,
        start: i64,
        column: u32,
        columns: &mut Columns,
    ) -> Result<(), Diagnostic> {
        let size = self.size(header);
        if !data.len().is_multiple_of(size) {
            return Err(misread(header));
        }
        let first = header.first_row(start, data.len() / size)?;
        let (eight, _) = data.as_chunks::<8>();
        let (four, _) = data.as_chunks::<4>();
        match (size, self.is_big_endian) {
            (8, false) => columns.extend(first, column, eight.iter().map(|b| f64::from_le_bytes(*b))),
            (8, true) => columns.extend(first, column, eight.iter().map(|b| f64::from_be_bytes(*b))),
            (_, false) => columns.extend(first, column, four.iter().map(|b| f32::from_le_bytes(*b).into())),
            (_, true) => columns.extend(first, column, four.iter().map(|b| f32::from_be_bytes(*b).into())),
        }
    }

    /// Returns the record at a byte of the file, and the start of the next one.
    fn record(self, bytes: &[u8], at: usize) -> Option<(&[u8], usize)> {
        let length = |at: usize| -> Option<usize> {
            let four: [u8; 4] = bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
            let length = if self.is_big_endian { i32::from_be_bytes(four) } else { i32::from_le_bytes(four) };
            usize::try_from(length).ok()
        };
        let record_length = length(at)?;
        let end = (at + 4).checked_add(record_length)?;
        let record = bytes.get(at + 4..end)?;
        (length(end)? == record_length).then_some((record, end + 4))
    }

    /// Returns the k-th word as an integer.
    fn integer(self, bytes: &[u8], k: usize) -> Option<i64> {
        let word = bytes.get(k * self.word..(k + 1) * self.word)?;
        let big = self.is_big_endian;
        Some(match <[u8; 8]>::try_from(word) {
            Ok(eight) => {
                if big {
                    i64::from_be_bytes(eight)
                } else {
                    i64::from_le_bytes(eight)
                }
            }
            Err(_) => {
                let four = <[u8; 4]>::try_from(word).ok()?;
                i64::from(if big { i32::from_be_bytes(four) } else { i32::from_le_bytes(four) })
            }
        })
    }
}

fn misread(header: &Header) -> Diagnostic {
    let message = format!("a record of matrix {} is not that of a column", header.name);
    Diagnostic::new(Code::MatrixSyntax, message).with_help("write the file again with OUTPUT4")
}
