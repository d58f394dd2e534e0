//! Binary results of Nastran (.op2, words of 32 bits): the real eigenvectors of the tables OUGV1 and their
//! kin, in single precision. Records have their length before and behind them; between records stand keys (a
//! record of one word): a positive one says how many words the next record has, one that is not positive ends
//! a part of the table, zero the table.

use super::table::ModeTable;
use super::{Found, unreadable};
use crate::input::bytes::InputFile;
use crate::model::DofLabel;

/// Whether a file begins with a key of 32 or 64 bits.
pub(super) fn recognises(head: &[u8]) -> bool {
    let begins = |key: [u8; 8]| head.starts_with(&key);
    let is_key = |value: u8| {
        begins([4, 0, 0, 0, value, 0, 0, 0])
            || begins([0, 0, 0, 4, 0, 0, 0, value])
            || begins([8, 0, 0, 0, value, 0, 0, 0])
    };
    is_key(2) || is_key(3)
}

/// Digits of single precision.
const DIGITS: u8 = 7;

/// Words of the head of a part.
const IDENT: usize = 146;

/// Approach code of real eigenvalues, table codes of displacements and eigenvectors.
const REAL_EIGENVALUES: i32 = 2;
const SHAPES: [i32; 2] = [1, 7];

/// Words of a grid point: its number, its type, three displacements, three rotations.
const WIDE: usize = 8;

/// Type of a grid point, beside scalar points and others.
const GRID: i32 = 1;

const HELP: &str = "write it with PARAM,POST,-1, or give the shapes as an array: docs/fe_programs.md has the lines for pyNastran";

/// Tables of eigenvectors along the axes of the grid points.
const TABLES: &[&str] = &["OUGV1", "OUG1", "OUGV1PAT", "OPHIG"];

/// Reads the eigenvectors of all modes.
pub(super) fn read(file: &InputFile) -> Found<ModeTable> {
    let mut records = Records::new(file)?;
    let mut table = ModeTable::new(DIGITS, DIGITS);
    records.skip_label()?;
    while let Some(name) = records.table_name()? {
        let parts = records.parts(TABLES.contains(&name.as_str()))?;
        // A trailer, a name, then pairs of a head and its values.
        for pair in parts.get(2..).unwrap_or_default().chunks_exact(2) {
            add_mode(&mut table, file, &pair[0], &pair[1])?;
        }
    }
    if table.len() == 0 {
        return Err(unreadable(file, "no real eigenvectors are in the file (table OUGV1)", HELP));
    }
    Ok(table)
}

/// The values of a mode, if the part is one.
fn add_mode(table: &mut ModeTable, file: &InputFile, head: &[u32], values: &[u32]) -> Found<()> {
    let whole = |at: usize| head[at] as i32;
    if head.len() < IDENT || whole(0) / 10 != REAL_EIGENVALUES || !SHAPES.contains(&(whole(1) % 1000)) {
        return Ok(());
    }
    if whole(1) / 1000 != 0 || whole(8) != 1 || whole(9) != WIDE as i32 || !values.len().is_multiple_of(WIDE)
    {
        let message = "eigenvectors are complex, or not sorted by modes: real ones (SORT1) are read";
        return Err(unreadable(file, message, HELP));
    }
    table.begin(Some(f64::from(f32::from_bits(head[5]))));
    for point in values.chunks_exact(WIDE) {
        if point[1] as i32 != GRID {
            continue;
        }
        let node = i64::from(point[0] as i32 / 10);
        for (direction, value) in (1..).zip(&point[2..]) {
            table.set(file, None, DofLabel { node, direction }, f64::from(f32::from_bits(*value)))?;
        }
    }
    Ok(())
}

/// The records of a file.
struct Records<'f> {
    file: &'f InputFile,
    rest: &'f [u8],
    little: bool,
}

impl<'f> Records<'f> {
    fn new(file: &'f InputFile) -> Found<Self> {
        let rest = file.bytes();
        if rest.starts_with(&[8, 0, 0, 0]) {
            return Err(unreadable(file, "words have 64 bits, those of 32 bits are read", HELP));
        }
        Ok(Self { file, rest, little: rest.starts_with(&[4]) })
    }

    fn word(&self, bytes: &[u8]) -> Option<u32> {
        let bytes: [u8; 4] = bytes.try_into().ok()?;
        Some(if self.little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    fn broken<T>(&self) -> Found<T> {
        let at = self.file.bytes().len() - self.rest.len();
        Err(unreadable(self.file, format!("records do not follow each other at byte {at}"), HELP))
    }

    /// The bytes of the next record; `None` at the end of the file.
    fn record(&mut self) -> Found<Option<&'f [u8]>> {
        if self.rest.is_empty() {
            return Ok(None);
        }
        let length = self.rest.get(..4).and_then(|bytes| self.word(bytes)).unwrap_or(u32::MAX) as usize;
        let end = length.saturating_add(4);
        let closes = self.rest.get(end..end.saturating_add(4)).and_then(|bytes| self.word(bytes));
        if closes != Some(length as u32) {
            return self.broken();
        }
        let record = &self.rest[4..end];
        self.rest = &self.rest[end + 4..];
        Ok(Some(record))
    }

    /// The next key; `None` at the end of the file.
    fn key(&mut self) -> Found<Option<i32>> {
        match self.record()? {
            None => Ok(None),
            Some(record) => match self.word(record) {
                Some(key) => Ok(Some(key as i32)),
                None => self.broken(),
            },
        }
    }

    /// The record that a key announces.
    fn announced(&mut self, words: i32) -> Found<&'f [u8]> {
        match self.record()? {
            Some(record) if record.len() == 4 * words as usize => Ok(record),
            _ => self.broken(),
        }
    }

    /// The label of the tape, where there is one: a date, a name, eight more letters.
    fn skip_label(&mut self) -> Found<()> {
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

    /// Name of the next table; `None` behind the last.
    fn table_name(&mut self) -> Found<Option<String>> {
        match self.key()? {
            Some(2) => {
                let name = self.announced(2)?;
                Ok(Some(String::from_utf8_lossy(name).trim().to_owned()))
            }
            Some(0) | None => Ok(None),
            Some(_) => self.broken(),
        }
    }

    /// The words of every part of a table, where they are `wanted`.
    fn parts(&mut self, wanted: bool) -> Found<Vec<Vec<u32>>> {
        let mut parts: Vec<Vec<u32>> = Vec::new();
        // The first record of a part behind the first says of which kind it is, in one word.
        let mut kind_follows = false;
        loop {
            match self.key()? {
                Some(words) if words > 0 => {
                    let record = self.announced(words)?;
                    if !std::mem::take(&mut kind_follows)
                        && wanted
                        && let Some(part) = parts.last_mut()
                    {
                        part.extend(record.chunks_exact(4).filter_map(|bytes| self.word(bytes)));
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
