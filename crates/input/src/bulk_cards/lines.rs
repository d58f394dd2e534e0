//! Lines of bulk data cards: continuations that do not follow their card, whose names identify the card that they
//! continue; replication of fields; and the consecutive lines of DMIG cards.

use super::card::{
    Card, Line, bare, card_fields, fixed_fields, free_fields, is_begin, is_include, without_comment,
};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{self, Lines, excerpt, real, whole};
use std::collections::{HashMap, HashSet};
use std::ops::Range;
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

// Replication: `=` copies the field of the card above, `*(x)` adds x to that field, `==` copies all fields from there
// on, and `=(n)` repeats the line above it n times.

/// Largest number of cards that lines of repetition of a deck may represent together.
pub(super) const MAX_REPEATED_CARDS: i64 = 1_000_000;

/// Change of a field from card to card.
#[derive(Clone)]
enum Change {
    Same,
    /// Adds a number to the field.
    More(Vec<u8>),
    /// Replaces the field by this text.
    Text(Vec<u8>),
}

/// Changes that a line of replication makes to the card above it.
#[derive(Clone, Default)]
pub(super) struct Replication {
    changes: Vec<Change>,
}

/// Request of a line that begins with `=`.
pub(super) enum ReplicationRequest {
    /// One card.
    One(Replication),
    /// Number of cards, each made by the preceding replication.
    Repeat(i64),
}

impl Replication {
    /// Reads a line of replication. Returns `None` if it does not begin with `=`.
    ///
    /// # Errors
    /// FB110 for invalid counts, and fields beyond the line.
    pub(super) fn request(line: &Line<'_>) -> Result<Option<ReplicationRequest>, Diagnostic> {
        let Some(rest) = line.head().strip_prefix(b"=") else { return Ok(None) };
        if !rest.is_empty() && rest != b"=" {
            let count =
                whole(without_brackets(rest)).filter(|count| (1..=MAX_REPEATED_CARDS).contains(count));
            let message = "expected a number of repetitions, as in =(4)";
            return count.map(|count| Some(ReplicationRequest::Repeat(count))).ok_or_else(|| bad(message));
        }
        let mut given = Card::default();
        if line.is_free {
            free_fields(&mut given, &line.text, 8)?
        } else {
            fixed_fields(&mut given, &line.text, 8)
        }
        let mut changes = Vec::new();
        let mut all_same = rest == b"=";
        for k in 0..8 {
            let field = given.field(k);
            all_same |= field == b"==";
            changes.push(match field {
                _ if all_same => Change::Same,
                b"=" => Change::Same,
                [b'*', more @ ..] => Change::More(without_brackets(more).to_vec()),
                text => Change::Text(text.to_vec()),
            });
        }
        Ok(Some(ReplicationRequest::One(Self { changes })))
    }

    /// Returns the card that follows `card`.
    ///
    /// # Errors
    /// FB110 if there is no card of one line above, or a field is no number.
    pub(super) fn next(&self, card: &Card) -> Result<Card, Diagnostic> {
        if card.name.is_empty() || self.changes.is_empty() {
            return Err(bad("there is no card above to replicate"));
        }
        if card.lines.len() != 1 || card.name == "DMIG" {
            let message = format!("replication of a {} with continuations is not read", card.name);
            return Err(bad(&message).with_help("write the cards one by one"));
        }
        let mut next = Card::default();
        next.begin(card.name.clone());
        for (k, change) in self.changes.iter().enumerate() {
            let field = match change {
                Change::Same => card.field(k).to_vec(),
                Change::Text(text) => text.clone(),
                Change::More(more) => sum(card.field(k), more).ok_or_else(|| {
                    bad(&format!(
                        "field {} of the {} is not a number that can be incremented",
                        k + 1,
                        card.name
                    ))
                })?,
            };
            next.push(&field);
        }
        Ok(next)
    }
}

/// Returns the sum of two numbers as the text of a field.
fn sum(field: &[u8], more: &[u8]) -> Option<Vec<u8>> {
    let field: &[u8] = if field.is_empty() { b"0" } else { field };
    if let (Some(a), Some(b)) = (whole(field), whole(more)) {
        return Some(a.checked_add(b)?.to_string().into_bytes());
    }
    let sum = real(field)? + real(more)?;
    sum.is_finite().then(|| format!("{sum:e}").into_bytes())
}

fn without_brackets(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"(").and_then(|text| text.strip_suffix(b")")).unwrap_or(text).trim_ascii()
}

fn bad(message: &str) -> Diagnostic {
    Diagnostic::new(Code::DeckSyntax, message)
}

// Consecutive DMIG cards of a deck, cut into parts that can be read independently.

/// Bytes of cards that one thread reads at a time.
const BYTES_PER_TASK: usize = 1 << 20;

/// Lines of consecutive DMIG cards.
pub(crate) struct MatrixLines<'a> {
    pub file: &'a InputFile,
    /// Parts in the order of the file.
    pub parts: Vec<LineRange>,
    /// Last line of the last card, from 1.
    last_line: usize,
}

/// Part of whole cards: the headers of matrices, or columns.
pub(crate) struct LineRange {
    pub bytes: Range<usize>,
    /// Number of lines above the part.
    pub above: usize,
    pub is_header: bool,
}

impl<'a> MatrixLines<'a> {
    /// Finds the cards from the byte `start` of the file on, where a line begins with `above` lines above it. Returns
    /// `None` if that line begins another card.
    pub(super) fn at(file: &'a InputFile, start: usize, above: usize) -> Option<Self> {
        let bytes = file.bytes();
        let (mut parts, mut last_line): (Vec<LineRange>, usize) = (Vec::new(), above);
        let mut lines = Lines::starting_at(bytes, start, above);
        loop {
            let at = lines.at;
            let Some(scanner::Line { number, text: line }) = lines.next() else { break };
            let end = lines.at;
            if begins_matrix(line) {
                let is_header = is_header(line);
                match parts.last_mut() {
                    Some(part) if !is_header && !part.is_header && part.bytes.len() < BYTES_PER_TASK => {
                        part.bytes.end = end;
                    }
                    _ => parts.push(LineRange { bytes: at..end, above: last_line, is_header }),
                }
            } else {
                match parts.last_mut() {
                    Some(part) if continues(line) => part.bytes.end = end,
                    _ => break,
                }
            }
            last_line = number;
        }
        (!parts.is_empty()).then_some(Self { file, parts, last_line })
    }

    /// Returns the byte after the last card, and the number of lines up to there.
    pub(super) fn end(&self) -> (usize, usize) {
        (self.parts.last().map_or(0, |part| part.bytes.end), self.last_line)
    }

    /// Returns true when the last card ends the file without a line end.
    pub(super) fn are_cut_off(&self) -> bool {
        let (end, _) = self.end();
        end == self.file.bytes().len() && !self.file.bytes().ends_with(b"\n")
    }
}

/// Returns true when a line begins a DMIG card.
fn begins_matrix(line: &[u8]) -> bool {
    line.get(..4).is_some_and(|name| name.eq_ignore_ascii_case(b"DMIG"))
        && matches!(Line::of(without_comment(line)).head()[4..], [] | [b'*'])
}

/// Returns true when a card of a matrix is its header: the second field is 0.
fn is_header(line: &[u8]) -> bool {
    let line = Line::of(without_comment(line));
    let columns = if line.head().ends_with(b"*") { 24..40 } else { 16..24 };
    line.part(2, columns) == b"0"
}

/// Returns true when a line continues a card, is empty or is a comment.
fn continues(line: &[u8]) -> bool {
    if matches!(line.first(), Some(b'*' | b'+' | b'$')) {
        return true;
    }
    let bare = line.trim_ascii();
    if bare.is_empty() || bare.starts_with(b"$") {
        return true;
    }
    let line = without_comment(line);
    !is_include(bare) && !is_begin(line) && matches!(Line::of(line).head().first(), None | Some(b'*' | b'+'))
}
