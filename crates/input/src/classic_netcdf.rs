//! Files of classic netCDF: CDF-1, CDF-2 (64-bit offsets) and CDF-5 (64-bit data).
//! <https://docs.unidata.ucar.edu/nug/current/file_format_specifications.html>
//!
//! A file has a header (dimensions, attributes, variables) and the values of the variables, all with the most significant
//! byte first. The values of variables along the one unlimited dimension lie record by record at the end.

#[cfg(test)]
mod tests;

use super::number_type::NumberType;
use flexbody_base::memory::left;
use std::cell::Cell;
use std::collections::HashMap;

/// Result of reading a file. The error describes the problem.
pub(super) type Read<T> = Result<T, String>;

/// Returns true if a file begins like classic netCDF.
pub(super) fn is_classic(head: &[u8]) -> bool {
    matches!(head, [b'C', b'D', b'F', 1 | 2 | 5, ..])
}

const CUT_OFF: &str = "the header ends before its entries do: the file may be cut off";

/// Tags of the lists of the header.
const DIMENSIONS: u32 = 10;
const VARIABLES: u32 = 11;
const ATTRIBUTES: u32 = 12;

/// Type number of text.
const TEXT: u32 = 2;

/// Variable with its shape.
#[derive(Debug)]
pub(super) struct Variable {
    pub name: String,
    /// Lengths of the dimensions; the first of a variable along the records is the number of records.
    pub shape: Vec<usize>,
    /// Type of the numbers; `None` for text.
    kind: Option<NumberType>,
    /// First byte of the values.
    begin: usize,
    /// Number of bytes of one record, or of all values without records.
    bytes: usize,
    /// Number of records; `None` for a variable without the unlimited dimension.
    records: Option<usize>,
    /// Text attributes.
    texts: Vec<(String, String)>,
}

impl Variable {
    /// Returns true if the values have single precision.
    pub(super) fn is_single_precision(&self) -> bool {
        self.kind == Some(NumberType::Float)
    }

    /// Returns the attribute of this name; empty if there is no such text.
    pub(super) fn text(&self, name: &str) -> &str {
        self.texts.iter().find(|(known, _)| known == name).map_or("", |(_, text)| text)
    }
}

/// File of classic netCDF whose header was read.
pub(super) struct ClassicNetcdf<'f> {
    bytes: &'f [u8],
    variables: Vec<Variable>,
    /// Index of the first variable of each name.
    places: HashMap<String, usize>,
    /// Distance of the records of a variable.
    record_bytes: usize,
    /// Number of bytes of the variables that were read.
    read: Cell<usize>,
}

impl<'f> ClassicNetcdf<'f> {
    /// Reads the header.
    ///
    /// # Errors
    /// A description of the problem: another format, a header that is cut off, dimensions that do not exist.
    pub(super) fn open(bytes: &'f [u8]) -> Read<Self> {
        if !is_classic(bytes) {
            return Err("file does not begin like classic netCDF".to_owned());
        }
        Header { bytes, at: 4, version: bytes[3] }.read()
    }

    /// Returns the variable of this name.
    pub(super) fn variable(&self, name: &str) -> Option<&Variable> {
        self.places.get(name).map(|at| &self.variables[*at])
    }

    /// Returns the numbers of a variable, row by row.
    ///
    /// # Errors
    /// A description of the problem: text, or values beyond the end of the file or beyond the memory.
    pub(super) fn numbers(&self, variable: &Variable) -> Read<Vec<f64>> {
        let Some(kind) = variable.kind else {
            return Err(format!("variable `{}` holds text, expected numbers", variable.name));
        };
        let count = variable.shape.iter().product::<usize>();
        if left().is_some_and(|left| count.saturating_mul(8) as u64 > left) {
            return Err(format!(
                "variable `{}` has {count} numbers, more than fit the memory",
                variable.name
            ));
        }
        let pieces = self.pieces(variable)?;
        Ok(pieces.into_iter().flat_map(|piece| kind.decode(piece, true)).collect())
    }

    /// Returns the rows of text of a variable without the zeros and blanks at their ends.
    ///
    /// # Errors
    /// A description of the problem: no text, or text beyond the end of the file.
    pub(super) fn lines(&self, variable: &Variable) -> Read<Vec<String>> {
        let (None, Some(&length)) = (variable.kind, variable.shape.last()) else {
            return Err(format!("variable `{}` is not a list of texts", variable.name));
        };
        let bytes = self.pieces(variable)?.concat();
        Ok(bytes.chunks(length.max(1)).map(text_of).collect())
    }

    /// Returns the bytes of a variable: one piece for each record.
    fn pieces(&self, variable: &Variable) -> Read<Vec<&'f [u8]>> {
        let ends = || format!("the file ends before the values of `{}` do: it may be cut off", variable.name);
        let piece = |record: usize| {
            let begin = record.checked_mul(self.record_bytes)?.checked_add(variable.begin)?;
            self.bytes.get(begin..begin.checked_add(variable.bytes)?)
        };
        let count = variable.records.unwrap_or(1);
        // The last record exists before the list of all is made, whose length the header states.
        if variable.bytes == 0 || count == 0 {
            return Ok(Vec::new());
        }
        piece(count - 1).ok_or_else(ends)?;
        // Variables do not overlap: all together have no more bytes than the file.
        let read = variable.bytes.saturating_mul(count).saturating_add(self.read.get());
        self.read.set(read);
        if read > self.bytes.len() {
            return Err(format!(
                "variable `{}` lies where other variables lie: they have {read} bytes together, the file has {}",
                variable.name,
                self.bytes.len()
            ));
        }
        (0..count).map(|record| piece(record).ok_or_else(ends)).collect()
    }
}

/// Header while it is read.
struct Header<'f> {
    bytes: &'f [u8],
    /// First byte that is not read yet.
    at: usize,
    version: u8,
}

impl<'f> Header<'f> {
    fn read(mut self) -> Read<ClassicNetcdf<'f>> {
        let stated = self.records()?;
        let lengths = self.dimensions()?;
        self.attributes()?;
        let mut variables = Vec::new();
        for _ in 0..self.list(VARIABLES)? {
            variables.push(self.variable(&lengths)?);
        }
        let bytes_of_records =
            || variables.iter().filter(|variable| variable.records.is_some()).map(|variable| variable.bytes);
        // The records of a variable alone follow each other without padding.
        let record_bytes = match bytes_of_records().count() {
            1 => bytes_of_records().sum(),
            _ => bytes_of_records()
                .try_fold(0usize, |sum, bytes| sum.checked_add(padded(bytes)?))
                .ok_or(CUT_OFF)?,
        };
        // A file that was being written does not state its number of records.
        let first = variables
            .iter()
            .filter(|variable| variable.records.is_some())
            .map(|variable| variable.begin)
            .min();
        let records = match (stated, first) {
            (Some(stated), _) => stated,
            (None, Some(first)) if record_bytes > 0 => self.bytes.len().saturating_sub(first) / record_bytes,
            (None, _) => 0,
        };
        for variable in variables.iter_mut().filter(|variable| variable.records.is_some()) {
            variable.records = Some(records);
            variable.shape[0] = records;
            size(&variable.shape, 1).ok_or(CUT_OFF)?;
        }
        let mut places = HashMap::new();
        for (at, variable) in variables.iter().enumerate() {
            places.entry(variable.name.clone()).or_insert(at);
        }
        Ok(ClassicNetcdf { bytes: self.bytes, variables, places, record_bytes, read: Cell::new(0) })
    }

    fn take(&mut self, count: usize) -> Read<&'f [u8]> {
        let end = self.at.checked_add(count).ok_or(CUT_OFF)?;
        let taken = self.bytes.get(self.at..end).ok_or(CUT_OFF)?;
        self.at = end;
        Ok(taken)
    }

    fn word(&mut self) -> Read<u32> {
        let bytes = self.take(4)?;
        Ok(u32::from_be_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    /// Reads a whole number of 32 bits, or of 64 bits if `is_long`.
    fn number(&mut self, is_long: bool) -> Read<usize> {
        let high = if is_long { u64::from(self.word()?) } else { 0 };
        let number = high << 32 | u64::from(self.word()?);
        usize::try_from(number).map_err(|_| CUT_OFF.to_owned())
    }

    /// Reads a count or a length, which CDF-5 writes with 64 bits.
    fn count(&mut self) -> Read<usize> {
        self.number(self.version == 5)
    }

    /// Reads the number of records; `None` if the file does not state it.
    fn records(&mut self) -> Read<Option<usize>> {
        let begin = self.at;
        let count = self.count()?;
        let is_open = self.bytes[begin..self.at].iter().all(|byte| *byte == 0xff);
        Ok((!is_open).then_some(count))
    }

    /// Reads the tag of a list and its number of entries.
    fn list(&mut self, tag: u32) -> Read<usize> {
        let found = self.word()?;
        let count = self.count()?;
        if found == tag || found == 0 && count == 0 {
            return Ok(count);
        }
        Err(format!("the header has the tag {found} of a list, expected {tag}"))
    }

    fn name(&mut self) -> Read<String> {
        let length = self.count()?;
        let name = text_of(self.take(length)?);
        self.take(padded(length).ok_or(CUT_OFF)? - length)?;
        Ok(name)
    }

    /// Reads the lengths of the dimensions; `None` is the unlimited one.
    fn dimensions(&mut self) -> Read<Vec<Option<usize>>> {
        let mut lengths = Vec::new();
        for _ in 0..self.list(DIMENSIONS)? {
            self.name()?;
            let length = self.count()?;
            lengths.push((length != 0).then_some(length));
        }
        Ok(lengths)
    }

    /// Reads a list of attributes. Returns those of text.
    fn attributes(&mut self) -> Read<Vec<(String, String)>> {
        let mut texts = Vec::new();
        for _ in 0..self.list(ATTRIBUTES)? {
            let name = self.name()?;
            let kind = self.word()?;
            let count = self.count()?;
            let length = count.checked_mul(bytes_of(kind)?).ok_or(CUT_OFF)?;
            let value = self.take(length)?;
            self.take(padded(length).ok_or(CUT_OFF)? - length)?;
            if kind == TEXT {
                texts.push((name, text_of(value)));
            }
        }
        Ok(texts)
    }

    fn variable(&mut self, lengths: &[Option<usize>]) -> Read<Variable> {
        let name = self.name()?;
        let mut dimensions = Vec::new();
        for _ in 0..self.count()? {
            let at = self.count()?;
            dimensions
                .push(*lengths.get(at).ok_or_else(|| format!("variable `{name}` has no dimension {at}"))?);
        }
        let texts = self.attributes()?;
        let kind = self.word()?;
        // The size of large variables is not stated, so that it is computed for all.
        self.count()?;
        let begin = self.number(self.version != 1)?;
        let has_records = dimensions.first().is_some_and(Option::is_none);
        if dimensions.iter().skip(1).any(Option::is_none) {
            return Err(format!("variable `{name}` has its records not in its first dimension"));
        }
        let shape: Vec<usize> = dimensions.iter().map(|length| length.unwrap_or(0)).collect();
        let of_record = if has_records { &shape[1..] } else { &shape };
        let bytes = size(of_record, bytes_of(kind)?);
        let bytes = bytes.ok_or_else(|| format!("variable `{name}` is larger than any file"))?;
        let kind = number_type(kind);
        Ok(Variable { name, kind, begin, bytes, records: has_records.then_some(0), texts, shape })
    }
}

/// Returns the product of lengths and the number of bytes of a value; `None` if it is too large.
fn size(shape: &[usize], bytes: usize) -> Option<usize> {
    shape.iter().try_fold(bytes, |product, length| product.checked_mul(*length))
}

/// Returns a number of bytes rounded up to a whole number of four.
fn padded(bytes: usize) -> Option<usize> {
    bytes.checked_next_multiple_of(4)
}

/// Returns text up to its first zero, without blanks at its end.
fn text_of(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).trim_end().to_owned()
}

/// Returns the type of numbers of this number in the format; `None` for text.
fn number_type(kind: u32) -> Option<NumberType> {
    Some(match kind {
        1 => NumberType::Signed(1),
        3 => NumberType::Signed(2),
        4 => NumberType::Signed(4),
        5 => NumberType::Float,
        6 => NumberType::Double,
        7 => NumberType::Unsigned(1),
        8 => NumberType::Unsigned(2),
        9 => NumberType::Unsigned(4),
        10 => NumberType::Signed(8),
        11 => NumberType::Unsigned(8),
        _ => return None,
    })
}

/// Returns the number of bytes of a value of a type.
fn bytes_of(kind: u32) -> Read<usize> {
    match number_type(kind) {
        Some(kind) => Ok(kind.bytes()),
        None if kind == TEXT => Ok(1),
        None => Err(format!("values have the type {kind}, which netCDF does not know")),
    }
}
