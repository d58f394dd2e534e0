//! Cards with columns of DMIG matrices, read independently of the cards above them except for the headers.

use crate::assemble::Entry;
use crate::bulk_cards::Card;
use crate::digits::written_digits;
use crate::recent::Recent;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::scanner::{BadLines, excerpt};
use std::path::Path;

/// Grid or scalar point with its component: 1 to 6, and 0 for a scalar point.
pub(crate) type Point = (i64, u8);

/// Name of each matrix whose header is above the columns, and true if its entries are real; complex columns are
/// skipped.
pub(super) type Heads = Vec<(String, bool)>;

/// Entries of some columns. Rows and columns of the entries are indices in `points`, where a point may occur more than
/// once.
pub(super) struct Columns {
    pub points: Vec<Point>,
    /// Index of the matrix, entries, and their largest number of written digits.
    pub runs: Vec<(usize, Vec<Entry>, u8)>,
    pub bad: BadLines,
    recent: Recent<Point>,
    /// Capacity in entries of the next run.
    capacity: usize,
}

impl Columns {
    /// Creates an empty list for cards with this number of bytes.
    pub(super) fn of(bytes: usize) -> Self {
        /// Bytes of an entry in large fields.
        const ENTRY: usize = 56;
        let (points, runs, bad) = (Vec::new(), Vec::new(), BadLines::default());
        Self { points, runs, bad, recent: Recent::new(), capacity: bytes / ENTRY }
    }

    /// Adds the entries of a card; for a bad card those before the error.
    pub(super) fn card(&mut self, card: &Card, path: &Path, heads: &Heads) {
        if let Err(bad) = self.column(card, path, heads) {
            self.bad.add(bad);
        }
    }

    /// Replaces indices in `points` by those in `place`.
    pub(super) fn numbered(mut self, place: &[u32]) -> Self {
        for entry in self.runs.iter_mut().flat_map(|(_, entries, _)| entries) {
            (entry.row, entry.col) = (place[entry.row as usize], place[entry.col as usize]);
        }
        self
    }

    fn column(&mut self, card: &Card, path: &Path, heads: &Heads) -> Result<(), Diagnostic> {
        let field = card.field(0);
        let Some(at) = heads.iter().rposition(|(name, _)| field.eq_ignore_ascii_case(name.as_bytes())) else {
            let message = format!("a column of DMIG {} comes before its header", upper(field));
            return Err(bad_card(card, 0, path, message));
        };
        let (name, is_real) = &heads[at];
        if !is_real {
            return Ok(());
        }
        if self.runs.last().is_none_or(|(matrix, ..)| *matrix != at) {
            self.runs.push((at, Vec::with_capacity(std::mem::take(&mut self.capacity)), 0));
        }
        let col = self.point(card, 1, path)?;
        for k in (4..card.len()).step_by(4) {
            if (k..k + 4).all(|k| card.field(k).is_empty()) {
                continue;
            }
            let row = self.point(card, k, path)?;
            let value = match (card.real(k + 2), card.real(k + 3)) {
                (Some(value), Some(0.0)) => value,
                (Some(_), Some(_)) => {
                    let message = format!("DMIG {name}: a real matrix has a complex entry");
                    return Err(bad_card(card, k, path, message));
                }
                _ => {
                    let text = excerpt(card.field(k + 2));
                    let message = format!("DMIG {name}: expected a finite number, found `{text}`");
                    return Err(bad_card(card, k, path, message));
                }
            };
            if let Some((_, entries, written)) = self.runs.last_mut() {
                *written = (*written).max(written_digits(card.field(k + 2)));
                entries.push(Entry { row, col, value });
            }
        }
        Ok(())
    }

    /// Returns the index of the point that two fields name.
    fn point(&mut self, card: &Card, k: usize, path: &Path) -> Result<u32, Diagnostic> {
        let component = card.integer(k + 1).filter(|component| (0..=6).contains(component));
        let id = card.integer(k).filter(|id| *id > 0);
        let (Some(id), Some(component)) = (id, component) else {
            let found = [k, k + 1].map(|k| excerpt(card.field(k)));
            let message = format!(
                "DMIG: expected a grid and a component from 0 to 6, found `{}`, `{}`",
                found[0], found[1]
            );
            return Err(bad_card(card, k, path, message));
        };
        let point = (id, component as u8);
        Ok(self.recent.place(point, point, &mut self.points))
    }
}

/// Returns a name in upper case, as in messages.
pub(super) fn upper(name: &[u8]) -> String {
    String::from_utf8_lossy(name).to_uppercase()
}

/// Returns FB301 for a field of a card.
pub(super) fn bad_card(card: &Card, field: usize, path: &Path, message: impl Into<String>) -> Diagnostic {
    Diagnostic::new(Code::MatrixSyntax, message)
        .in_file(path)
        .at_line(card.line_of(field))
        .with_help("write the matrix again")
}
