//! Substructures of Abaqus. `*SUBSTRUCTURE MATRIX OUTPUT, OUTPUT FILE=USER DEFINED, FILE NAME=part` writes
//! `part.mtx` in the form of a linear `*USER ELEMENT`: the retained nodes in comments, their directions, and the
//! lower triangles of the condensed matrices, row by row.

use super::deck::{Card, Deck, fields};
use super::{Found, both, missing};
use crate::assemble::{Entry, StoredEntries, assemble, check_size};
use crate::coordinates::line_aligned;
use crate::digits::{COUNTED, written_digits};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::input_file::SeenFile;
use flexbody_base::text::scanner::{Line, Lines, excerpt, integer, real};
use flexbody_linalg::parallel;
use flexbody_model::{DofLabel, RawMatrix};
use std::path::{Path, PathBuf};

const HELP: &str = "write it with *SUBSTRUCTURE MATRIX OUTPUT, STIFFNESS=YES, MASS=YES, OUTPUT FILE=USER DEFINED, FILE NAME=part (without .mtx)";

/// Model condensed to some of its nodes.
pub(super) struct Substructure {
    pub labels: Vec<DofLabel>,
    pub stiffness: RawMatrix,
    pub mass: RawMatrix,
    /// File of the substructure.
    pub seen: SeenFile,
}

/// Returns the file named by the last request of a deck for the matrices of a substructure, with a note if there are
/// several.
pub(super) fn file_of(deck: &Deck, path: &Path) -> Option<(PathBuf, Option<Diagnostic>)> {
    let requests = || {
        deck.cards()
            .iter()
            .filter(|card| card.keyword == "SUBSTRUCTUREMATRIXOUTPUT")
            .filter_map(|card| card.parameter("FILENAME"))
    };
    let name = requests().next_back()?;
    let file = path.with_file_name(format!("{name}.mtx"));
    let note = (requests().count() > 1).then(|| {
        let message =
            format!("the file has {} substructures: the last one, {name}, is used", requests().count());
        Diagnostic::new(Code::JobStep, message).in_file(&file)
    });
    Some((file, note))
}

impl Substructure {
    /// Reads the file of a substructure.
    ///
    /// # Errors
    /// FB101, FB106; FB109 if a matrix is missing; FB110 for lines that cannot be read; FB111 for degrees of freedom
    /// other than displacements and rotations; FB301, FB303, FB312.
    pub(super) fn read(path: &Path) -> Found<Self> {
        let deck = Deck::read(path)?;
        let mut elements = deck.cards().iter().filter(|card| card.keyword == "USERELEMENT");
        let (Some(element), None) = (elements.next(), elements.next()) else {
            let message = "expected one *USER ELEMENT, as a substructure is written";
            return Err(vec![Diagnostic::new(Code::DeckSyntax, message).in_file(path).with_help(HELP)]);
        };
        let file = SubstructureFile { deck: &deck, element, path };
        let labels = file.labels().map_err(|diagnostic| vec![diagnostic])?;
        let stored =
            if element.parameter("UNSYM").is_some() { StoredEntries::Full } else { StoredEntries::Triangle };
        let stiffness = file.matrix("STIFFNESS", labels.len(), stored);
        let (stiffness, mass) = both(stiffness, file.matrix("MASS", labels.len(), StoredEntries::Triangle))?;
        let (_, seen) = deck.seen()?.swap_remove(0);
        Ok(Self { labels, stiffness, mass, seen })
    }
}

struct SubstructureFile<'d> {
    deck: &'d Deck,
    element: &'d Card,
    path: &'d Path,
}

impl SubstructureFile<'_> {
    /// Returns node and direction of every row.
    fn labels(&self) -> Result<Vec<DofLabel>, Diagnostic> {
        let nodes = self.nodes()?;
        let changes = self.changes(nodes.len())?;
        let directions_at = |position: usize| {
            let known = changes.partition_point(|(from, _)| *from <= position);
            &changes[known - 1].1
        };
        let of_node = |(k, &node): (usize, &i64)| {
            directions_at(k + 1).iter().map(move |&direction| DofLabel { node, direction })
        };
        Ok(nodes.iter().enumerate().flat_map(of_node).collect())
    }

    /// Returns the retained nodes, which are listed in comments.
    fn nodes(&self) -> Result<Vec<i64>, Diagnostic> {
        let count = self.element.parameter("NODES").and_then(|count| count.parse::<usize>().ok());
        let (_, text) = self.deck.text(self.element);
        let lines = Lines::of(text).map(|line| line.text.trim_ascii_start());
        let listed = lines.skip_while(|line| !line.ends_with(b"ELEMENT NODES")).skip(1);
        let listed = listed.map_while(|line| line.strip_prefix(b"**")).map(<[u8]>::trim_ascii);
        let nodes: Option<Vec<i64>> = listed.flat_map(fields).map(integer).collect();
        match nodes {
            Some(nodes) if !nodes.is_empty() && Some(nodes.len()) == count => Ok(nodes),
            _ => {
                let message = "*USER ELEMENT: expected NODES=n and below `** ELEMENT NODES` so many node numbers in comments";
                Err(self.deck.about(self.element, Code::DeckSyntax, message).with_help(HELP))
            }
        }
    }

    /// Returns the positions (from 1) at which the directions of the nodes change, each with the directions from there
    /// on.
    fn changes(&self, nodes: usize) -> Result<Vec<(usize, Vec<u8>)>, Diagnostic> {
        let mut changes: Vec<(usize, Vec<u8>)> = Vec::new();
        for (line, text) in self.deck.data(self.element) {
            let numbers: Option<Vec<i64>> = fields(text).map(integer).collect();
            let numbers = numbers.filter(|numbers| numbers.len() > usize::from(!changes.is_empty()));
            let (position, directions) = match (&numbers, changes.last()) {
                (Some(numbers), None) => (Some(1), numbers.as_slice()),
                (Some(numbers), Some((before, _))) => {
                    let position = usize::try_from(numbers[0]).ok();
                    (position.filter(|at| (before + 1..=nodes).contains(at)), &numbers[1..])
                }
                (None, _) => (None, [].as_slice()),
            };
            let Some(position) = position else {
                let message = format!(
                    "expected the directions of the first node, or the position of a later node and its directions, found `{}`",
                    excerpt(text)
                );
                return Err(self.deck.at(self.element, line, Code::DeckSyntax, message).with_help(HELP));
            };
            changes.push((position, self.directions(line, directions)?));
        }
        if changes.is_empty() {
            let message = "*USER ELEMENT: the directions of its nodes are missing";
            return Err(self.deck.about(self.element, Code::DeckSyntax, message).with_help(HELP));
        }
        Ok(changes)
    }

    fn directions(&self, line: usize, numbers: &[i64]) -> Result<Vec<u8>, Diagnostic> {
        let direction = |&number: &i64| match number {
            1..=6 => Ok(number as u8),
            other => {
                let message = format!("degree of freedom {other} is not a displacement or rotation");
                let help = "retain displacements and rotations alone (*RETAINED NODAL DOFS, 1 to 6)";
                Err(self.deck.at(self.element, line, Code::DeckUnsupported, message).with_help(help))
            }
        };
        numbers.iter().map(direction).collect()
    }

    /// Returns the matrix of a type with `n` rows.
    fn matrix(&self, kind: &str, n: usize, stored: StoredEntries) -> Found<RawMatrix> {
        let is_meant =
            |card: &&Card| card.keyword == "MATRIX" && card.name("TYPE").is_some_and(|stated| stated == kind);
        let Some(card) = self.deck.cards().iter().find(is_meant) else {
            return Err(vec![missing(self.path, &format!("*MATRIX, TYPE={kind}"), HELP)]);
        };
        let in_file = |diagnostic: Diagnostic| vec![diagnostic.in_file(self.path)];
        let pieces = self.values(card)?;
        let count: usize = pieces.iter().map(|piece| piece.values.len()).sum();
        let expected = match stored {
            StoredEntries::Full => n * n,
            StoredEntries::Triangle => n * (n + 1) / 2,
        };
        if count != expected {
            let message =
                format!("*MATRIX, TYPE={kind}: expected {expected} values for {n} rows, found {count}");
            let help = "write the file again; it may be cut off";
            return Err(vec![self.deck.about(card, Code::DeckSyntax, message).with_help(help)]);
        }
        check_size(n as u64, n as u64, count as u64).map_err(in_file)?;
        let written = pieces.iter().map(|piece| piece.written).max().unwrap_or(0);
        // Number of values before each piece, from which its positions follow.
        let mut end = 0;
        let starts: Vec<usize> = pieces
            .iter()
            .map(|piece| {
                end += piece.values.len();
                end - piece.values.len()
            })
            .collect();
        let entries = parallel::map(pieces.into_iter().zip(starts), |(piece, start)| {
            in_rows(&piece.values, start, n, stored)
        });
        assemble(n, entries, stored, written, self.path).map_err(|diagnostic| vec![diagnostic])
    }

    /// Returns the numbers below a card.
    fn values(&self, card: &Card) -> Found<Vec<NumberLines>> {
        let (first, text) = self.deck.text(card);
        let pieces = parallel::map(line_aligned(text), NumberLines::parse);
        let mut above = first;
        for piece in &pieces {
            if let Some((line, text)) = &piece.bad {
                let message = format!("expected numbers, found `{text}`");
                return Err(vec![
                    self.deck.at(card, above + line, Code::DeckSyntax, message).with_help(HELP),
                ]);
            }
            above += piece.lines;
        }
        Ok(pieces)
    }
}

/// Numbers of some lines.
#[derive(Default)]
struct NumberLines {
    values: Vec<f64>,
    written: u8,
    lines: usize,
    /// First line with other text: its number within the piece, from 0, and the text.
    bad: Option<(usize, String)>,
}

impl NumberLines {
    fn parse(text: &[u8]) -> Self {
        let mut piece = Self { values: Vec::with_capacity(text.len() / 20), ..Self::default() };
        for Line { number, text } in Lines::of(text) {
            let line = text.trim_ascii_start();
            if !(line.is_empty() || line.starts_with(b"**")) {
                let before = piece.values.len();
                for field in fields(line) {
                    match real(field).filter(|value| value.is_finite()) {
                        Some(value) => piece.values.push(value),
                        None => _ = piece.bad.get_or_insert_with(|| (number - 1, excerpt(line))),
                    }
                }
                if before < COUNTED {
                    piece.written = fields(line).map(written_digits).fold(piece.written, u8::max);
                }
            }
            piece.lines = number;
        }
        piece
    }
}

/// Returns entries for values that begin at position `start`, counted row by row.
fn in_rows(values: &[f64], start: usize, n: usize, stored: StoredEntries) -> Vec<Entry> {
    let length = |row: usize| if stored == StoredEntries::Full { n } else { row + 1 };
    let (mut row, mut col) = (0, start);
    while col >= length(row) {
        col -= length(row);
        row += 1;
    }
    let next = |&value: &f64| {
        let entry = Entry { row: row as u32, col: col as u32, value };
        col += 1;
        if col == length(row) {
            (row, col) = (row + 1, 0);
        }
        entry
    };
    values.iter().map(next).collect()
}
