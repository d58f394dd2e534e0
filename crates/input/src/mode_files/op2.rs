//! Binary results of Nastran (.op2): the real eigenvectors of the tables OUGV1 and similar ones, in words of 32 bits
//! (single precision) or 64 bits (double precision, as ILP64 builds write them). Records have their length before and
//! after them. Between records are keys (records of one word): a positive key is the number of words of the next
//! record, a key that is not positive ends a part of the table, and zero ends the table.

use super::mode_table::{ModeTable, unreadable};
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::InputFile;
use flexbody_model::DofLabel;

/// Returns true when a file begins with a key of 32 or 64 bits.
pub(super) fn recognises(head: &[u8]) -> bool {
    let begins = |key: [u8; 8]| head.starts_with(&key);
    let is_key = |value: u8| {
        begins([4, 0, 0, 0, value, 0, 0, 0])
            || begins([0, 0, 0, 4, 0, 0, 0, value])
            || begins([8, 0, 0, 0, value, 0, 0, 0])
            || begins([0, 0, 0, 8, 0, 0, 0, 0])
    };
    is_key(2) || is_key(3)
}

/// Number of digits of single and of double precision.
const DIGITS: [u8; 2] = [7, 15];

/// Number of words of the head of a part.
const HEAD_WORDS: usize = 146;

/// Approach code of real eigenvalues, table codes of displacements and eigenvectors.
const REAL_EIGENVALUES: i64 = 2;
const SHAPES: [i64; 2] = [1, 7];

/// Number of words per grid point: its number, its type, three displacements, three rotations.
const WORDS_PER_POINT: usize = 8;

/// Type of a grid point, unlike scalar points and others.
const GRID: i64 = 1;

const HELP: &str = "write it with PARAM,POST,-1, or give the shapes as an array: docs/how_to/import_modes.md has the lines for pyNastran";

/// Names of tables of eigenvectors along the axes of the grid points.
const TABLES: &[&str] = &["OUGV1", "OUG1", "OUGV1PAT", "OPHIG"];

/// Reads the eigenvectors of all modes.
pub(super) fn read(file: &InputFile) -> Diagnosed<ModeTable> {
    let mut records = Records::new(file);
    let digits = DIGITS[usize::from(records.wide)];
    let mut table = ModeTable::new(digits, digits).along_nodes();
    records.skip_label()?;
    while let Some(name) = records.table_name()? {
        let parts = records.parts(TABLES.contains(&name.as_str()))?;
        // A table has a trailer, a name, then pairs of a head and its values.
        for pair in parts.get(2..).unwrap_or_default().chunks_exact(2) {
            add_mode(&mut table, &records, &pair[0], &pair[1])?;
        }
    }
    if table.len() == 0 {
        return Err(unreadable(file, "no real eigenvectors are in the file (table OUGV1)", HELP));
    }
    Ok(table)
}

/// Adds the values of a mode, if the part is one.
fn add_mode(table: &mut ModeTable, records: &Records<'_>, head: &[u64], values: &[u64]) -> Diagnosed<()> {
    let file = records.file;
    let whole = |at: usize| records.whole(head[at]);
    if head.len() < HEAD_WORDS || whole(0) / 10 != REAL_EIGENVALUES || !SHAPES.contains(&(whole(1) % 1000)) {
        return Ok(());
    }
    if whole(1) / 1000 != 0
        || whole(8) != 1
        || whole(9) != WORDS_PER_POINT as i64
        || !values.len().is_multiple_of(WORDS_PER_POINT)
    {
        let message =
            "eigenvectors are complex or not sorted by modes, expected real ones sorted by modes (SORT1)";
        return Err(unreadable(file, message, HELP));
    }
    table.begin(Some(records.real(head[5])));
    for point in values.chunks_exact(WORDS_PER_POINT) {
        if records.whole(point[1]) != GRID {
            continue;
        }
        let node = records.whole(point[0]) / 10;
        for (direction, value) in (1..).zip(&point[2..]) {
            table.set(file, None, DofLabel { node, direction }, records.real(*value))?;
        }
    }
    Ok(())
}

/// Records of a file. Their lengths have 32 bits, their words and keys 32 or 64.
struct Records<'f> {
    file: &'f InputFile,
    rest: &'f [u8],
    little: bool,
    /// True for words of 64 bits.
    wide: bool,
}

impl<'f> Records<'f> {
    fn new(file: &'f InputFile) -> Self {
        let rest = file.bytes();
        // The length of the first key is that of a word.
        let head = rest.get(..4).unwrap_or_default();
        Self { file, rest, little: head.starts_with(&[4]) || head.starts_with(&[8]), wide: head.contains(&8) }
    }

    /// Returns the number of bytes of a word.
    fn width(&self) -> usize {
        if self.wide { 8 } else { 4 }
    }

    /// Returns the bits of a word or a length.
    fn bits(&self, bytes: &[u8]) -> u64 {
        let add = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
        if self.little { bytes.iter().rev().fold(0, add) } else { bytes.iter().fold(0, add) }
    }

    fn word(&self, bytes: &[u8]) -> Option<u64> {
        (bytes.len() == self.width()).then(|| self.bits(bytes))
    }

    /// Returns a word as a whole number.
    fn whole(&self, word: u64) -> i64 {
        if self.wide { word as i64 } else { i64::from(word as u32 as i32) }
    }

    /// Returns a word as a real number.
    fn real(&self, word: u64) -> f64 {
        if self.wide { f64::from_bits(word) } else { f64::from(f32::from_bits(word as u32)) }
    }

    /// Returns the letters of a record, four per word.
    fn letters(&self, record: &[u8]) -> String {
        let letters: Vec<u8> =
            record.chunks(self.width()).flat_map(|word| &word[..word.len().min(4)]).copied().collect();
        String::from_utf8_lossy(&letters).trim_matches([' ', '\0']).to_owned()
    }

    fn broken<T>(&self) -> Diagnosed<T> {
        let at = self.file.bytes().len() - self.rest.len();
        Err(unreadable(self.file, format!("records do not follow each other at byte {at}"), HELP))
    }

    /// Returns the bytes of the next record; `None` at the end of the file.
    fn record(&mut self) -> Diagnosed<Option<&'f [u8]>> {
        if self.rest.is_empty() {
            return Ok(None);
        }
        let length_at = |at: usize| {
            let bytes = self.rest.get(at..at.saturating_add(4))?;
            usize::try_from(self.bits(bytes)).ok()
        };
        let length = length_at(0).unwrap_or(usize::MAX);
        let end = length.saturating_add(4);
        if length_at(end) != Some(length) {
            return self.broken();
        }
        let record = &self.rest[4..end];
        self.rest = &self.rest[end + 4..];
        Ok(Some(record))
    }

    /// Returns the next key; `None` at the end of the file.
    fn key(&mut self) -> Diagnosed<Option<i64>> {
        match self.record()? {
            None => Ok(None),
            Some(record) => match self.word(record) {
                Some(key) => Ok(Some(self.whole(key))),
                None => self.broken(),
            },
        }
    }

    /// Returns the record that a key announces.
    fn announced(&mut self, words: i64) -> Diagnosed<&'f [u8]> {
        match self.record()? {
            Some(record) if record.len() as u64 == (words as u64).saturating_mul(self.width() as u64) => {
                Ok(record)
            }
            _ => self.broken(),
        }
    }

    /// Skips the label of the tape, if there is one: a date, a name, eight more letters.
    fn skip_label(&mut self) -> Diagnosed<()> {
        let start = self.rest;
        if self.key()? != Some(3) {
            self.rest = start;
            return Ok(());
        }
        self.announced(3)?;
        loop {
            match self.key()? {
                Some(words) if words > 0 => self.announced(words)?,
                Some(0) | None => return Ok(()),
                Some(_) => continue,
            };
        }
    }

    /// Returns the name of the next table; `None` after the last.
    fn table_name(&mut self) -> Diagnosed<Option<String>> {
        match self.key()? {
            Some(2) => {
                let name = self.announced(2)?;
                Ok(Some(self.letters(name)))
            }
            Some(0) | None => Ok(None),
            Some(_) => self.broken(),
        }
    }

    /// Returns the words of every part of a table if they are `wanted`.
    fn parts(&mut self, wanted: bool) -> Diagnosed<Vec<Vec<u64>>> {
        let mut parts: Vec<Vec<u64>> = Vec::new();
        // Each part after the first begins with a record of one word, its kind.
        let mut kind_follows = false;
        loop {
            match self.key()? {
                Some(words) if words > 0 => {
                    let record = self.announced(words)?;
                    if !std::mem::take(&mut kind_follows)
                        && wanted
                        && let Some(part) = parts.last_mut()
                    {
                        part.extend(record.chunks_exact(self.width()).filter_map(|bytes| self.word(bytes)));
                    }
                }
                Some(0) => {
                    parts.retain(|part| !part.is_empty());
                    return Ok(parts);
                }
                Some(_) => {
                    kind_follows = !parts.is_empty();
                    parts.push(Vec::new());
                }
                None => return self.broken(),
            }
        }
    }
}
