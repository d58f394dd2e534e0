//! Continuations that do not follow their card. Their names identify the card that they continue.

use super::{Card, Line, bare, card_fields, without_comment};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Lines, excerpt};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Line of a continuation.
struct NumberedLine {
    text: Vec<u8>,
    number: usize,
}

/// Continuations of one file that do not follow their cards, with these cards, while the file is read.
#[derive(Default)]
pub(super) struct Apart {
    /// Names of these continuations, in upper case.
    names: HashSet<Vec<u8>>,
    lines: HashMap<Vec<u8>, Vec<NumberedLine>>,
    /// Last continuation that was read, and the name that a line must have to continue it.
    last: Option<(Vec<u8>, Vec<u8>)>,
    cards: Vec<(Card, PathBuf)>,
}

impl Apart {
    /// Finds the names of continuations of a file that do not follow the line with their name.
    pub(super) fn of(file: &InputFile) -> Self {
        let mut names = HashSet::new();
        let mut before: &[u8] = b"";
        each_line(file, |line| {
            if is_named(line) {
                let name = bare(Line::of(line).head()).to_ascii_uppercase();
                if !name.is_empty() && name != end_of(before) {
                    names.insert(name);
                }
            }
            before = line;
        });
        // Continuations whose name no line announces belong to the card above them.
        if !names.is_empty() {
            let mut ends = HashSet::new();
            each_line(file, |line| {
                ends.insert(end_of(line));
            });
            names.retain(|name| ends.contains(name));
        }
        Self { names, ..Self::default() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    pub(super) fn contains(&self, name: &[u8]) -> bool {
        !self.names.is_empty() && self.names.contains(name)
    }

    /// Stores a line of a continuation (with its name, in upper case) if it does not follow its card, or continues one
    /// that does not. Returns true when it stored the line.
    pub(super) fn keep(&mut self, name: &[u8], line: &[u8], number: usize) -> bool {
        let first = match &self.last {
            Some((first, next)) if name.is_empty() || name == next.as_slice() => first.clone(),
            _ if self.contains(name) => name.to_vec(),
            _ => return false,
        };
        self.lines.entry(first.clone()).or_default().push(NumberedLine { text: line.to_vec(), number });
        self.last = Some((first, end_of(line)));
        true
    }

    /// Ends the current continuation: another card begins.
    pub(super) fn close(&mut self) {
        self.last = None;
    }

    /// Stores a card whose continuation does not follow it.
    pub(super) fn wait(&mut self, card: Card, path: PathBuf) {
        self.cards.push((card, path));
    }

    /// Returns the cards with their continuations, at the end of the file.
    ///
    /// # Errors
    /// FB110 for lines that are no continuation, and for continuations without a card.
    pub(super) fn joined(&mut self, path: &Path) -> Result<Vec<(Card, PathBuf)>, Diagnostic> {
        let mut cards = std::mem::take(&mut self.cards);
        for (card, path) in &mut cards {
            while let Some(lines) = self.lines.remove(&card.continuation) {
                for NumberedLine { text, number } in lines {
                    card_fields(card, &Line::of(&text), number)
                        .map_err(|diagnostic| diagnostic.in_file(&*path).at_line(number))?;
                }
            }
        }
        let stray = self.lines.values().filter_map(|lines| lines.first()).min_by_key(|line| line.number);
        match stray {
            None => Ok(cards),
            Some(line) => {
                let message = format!("`{}` does not continue any card", excerpt(&line.text));
                Err(Diagnostic::new(Code::DeckSyntax, message).in_file(path).at_line(line.number))
            }
        }
    }
}

/// Passes the lines that are not empty, without comments, to `take`.
fn each_line<'f>(file: &'f InputFile, mut take: impl FnMut(&'f [u8])) {
    for line in Lines::of(file.bytes()) {
        let line = without_comment(line.text);
        if !line.is_empty() {
            take(line);
        }
    }
}

/// Returns true when a line is a continuation that may have a name. Continuations in punch files have none.
fn is_named(line: &[u8]) -> bool {
    matches!(line[0], b'+' | b'*') && line.get(1).is_some_and(|b| !b.is_ascii_whitespace())
}

/// Returns the name that the continuation of a line must have, in upper case; empty if the line gives none.
fn end_of(line: &[u8]) -> Vec<u8> {
    let line = Line::of(line);
    let is_large = line.head().ends_with(b"*") || line.head().starts_with(b"*");
    let fields = if is_large { 4 } else { 8 };
    bare(line.part(fields + 1, 72..80)).to_ascii_uppercase()
}
