//! Decks of Nastran: lines of case control, then bulk data cards in free, small and large fields, with continuations,
//! comments and included files.

mod card;
mod lines;

use card::{Line, bare, card_fields, is_begin, is_include, without_comment};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_base::text::scanner::{self, Lines, excerpt, line_number};
use lines::{Apart, MAX_REPEATED_CARDS, Replication, ReplicationRequest};
use std::path::{Path, PathBuf};

pub(super) use card::{Card, components};
pub(super) use lines::MatrixLines;

/// Depth of included files above which a file is taken to include itself.
const MAX_INCLUDE_DEPTH: usize = 20;
/// Largest number of files of a deck.
const MAX_FILES: usize = 1000;

/// Part of a deck, in the order of the deck.
pub(super) enum Item<'a> {
    /// Line above the bulk data, without its comment.
    Control(&'a str),
    /// Line `BEGIN BULK` or `BEGIN SUPER`.
    Begin(&'a Place<'a>),
    Card(&'a Card, &'a Path),
    /// Consecutive DMIG cards, not yet read.
    Matrices(&'a MatrixLines<'a>),
}

/// Position in a file.
pub(super) struct Place<'a> {
    pub path: &'a Path,
    pub line: usize,
}

/// Returns true when a file that begins with `bytes` is a deck of Nastran or bulk data.
pub(super) fn is_bulk_data(bytes: &[u8]) -> bool {
    bytes.split(|&b| b == b'\n').any(|line| {
        let upper: Vec<u8> = line.iter().take(16).map(u8::to_ascii_uppercase).collect();
        let is_card = |name: &[u8]| {
            upper
                .strip_prefix(name)
                .is_some_and(|rest| matches!(rest.first(), Some(b' ' | b',' | b'*' | b'\t')))
        };
        is_begin(line) || upper.trim_ascii() == b"CEND" || is_card(b"GRID") || is_card(b"DMIG")
    })
}

/// Returns true when a line belongs to case control or executive control, or ends them.
fn is_control(line: &[u8]) -> bool {
    let line = &line[..line.len().min(40)];
    // The first letter excludes most lines.
    if !matches!(line.trim_ascii_start().first(), Some(b'b' | b'B' | b'c' | b'C' | b's' | b'S')) {
        return false;
    }
    let begins = |word: &[u8]| line.get(..word.len()).is_some_and(|begin| begin.eq_ignore_ascii_case(word));
    line.trim_ascii().eq_ignore_ascii_case(b"CEND") || begins(b"SOL ") || is_begin(line)
}

type Taken = Result<(), Diagnostic>;

/// Reads a deck with the files that it includes, and passes its parts to `take`. Returns the files, the main one first.
///
/// # Errors
/// FB101, FB106 for files that cannot be read; FB110 for continuations without a card, fields beyond the line, and
/// files that include themselves; FB301 for a matrix at the end of a file without a line end; the errors of `take`.
pub(super) fn read_deck(
    path: &Path,
    take: &mut dyn FnMut(Item<'_>) -> Taken,
) -> Result<Vec<SeenFile>, Diagnostic> {
    let file = InputFile::open(path)?;
    let has_control = Lines::of(file.bytes()).any(|line| is_control(line.text));
    let mut reading = BulkReader::new(!has_control, take);
    reading.file(path, &file, 0)?;
    reading.flush()?;
    Ok(reading.files)
}

/// Passes the cards of whole lines of bulk data to `take`. `above` is the number of lines above them in their file.
///
/// # Errors
/// FB110 for continuations without a card and fields beyond the line; the errors of `take`.
pub(super) fn read_cards(
    text: &[u8],
    path: &Path,
    above: usize,
    take: &mut dyn FnMut(&Card) -> Taken,
) -> Taken {
    let mut each = |item: Item<'_>| match item {
        Item::Card(card, _) => take(card),
        _ => Ok(()),
    };
    let mut reading = BulkReader::new(true, &mut each);
    for line in Lines::below(text, above) {
        reading.line(line.text, &Place { path, line: line.number })?;
    }
    reading.flush()
}

/// State of reading a deck.
struct BulkReader<'t> {
    files: Vec<SeenFile>,
    in_bulk: bool,
    /// True after ENDDATA.
    ended: bool,
    /// Last card that was read, and its file.
    card: Card,
    card_path: PathBuf,
    /// True while continuations may extend the last card, which has not been passed on.
    is_open: bool,
    /// Continuations of the file that do not follow their cards.
    apart: Apart,
    /// Changes from card to card by the last line of replication.
    replication: Replication,
    /// Number of cards that lines `=(n)` have represented.
    repeated: i64,
    take: &'t mut dyn FnMut(Item<'_>) -> Taken,
}

impl<'t> BulkReader<'t> {
    fn new(in_bulk: bool, take: &'t mut dyn FnMut(Item<'_>) -> Taken) -> Self {
        let (files, card, card_path) = (Vec::new(), Card::default(), PathBuf::new());
        let (apart, replication) = (Apart::default(), Replication::default());
        let (ended, is_open, repeated) = (false, false, 0);
        Self { files, in_bulk, ended, card, card_path, is_open, apart, replication, repeated, take }
    }

    fn file(&mut self, path: &Path, file: &InputFile, depth: usize) -> Taken {
        if depth > MAX_INCLUDE_DEPTH || self.files.len() >= MAX_FILES {
            let message = format!(
                "included files are nested more than {MAX_INCLUDE_DEPTH} levels deep, or are more than {MAX_FILES}"
            );
            return Err(Diagnostic::new(Code::DeckSyntax, message)
                .in_file(path)
                .with_help("remove the INCLUDE with which a file includes itself"));
        }
        self.files.push(file.seen()?);
        let before = std::mem::replace(&mut self.apart, Apart::of(file));
        self.lines_of(path, file, depth)?;
        if !self.apart.is_empty() {
            self.flush()?;
            for (card, path) in self.apart.joined(path)? {
                (self.take)(Item::Card(&card, &path))?;
            }
        }
        self.apart = before;
        Ok(())
    }

    fn lines_of(&mut self, path: &Path, file: &InputFile, depth: usize) -> Taken {
        let mut lines = Lines::of(file.bytes());
        loop {
            let start = lines.at;
            let Some(scanner::Line { number, text: line }) = lines.next() else { break };
            if self.ended {
                return Ok(());
            }
            let at = Place { path, line: number };
            let bare = line.trim_ascii();
            if bare.is_empty() || bare.starts_with(b"$") {
                continue;
            }
            if self.in_bulk
                && let Some(matrices) = MatrixLines::at(file, start, number - 1)
            {
                self.flush()?;
                (lines.at, lines.number) = matrices.end();
                (self.take)(Item::Matrices(&matrices))?;
                if matrices.are_cut_off() {
                    return Err(cut_off(path, lines.number));
                }
            } else if is_include(bare) {
                let mut name = String::from_utf8_lossy(&bare[7..]).trim().to_owned();
                // A name in quotes may continue in the next lines.
                while unclosed(&name) {
                    let Some(more) = lines.next() else { break };
                    name += String::from_utf8_lossy(more.text).trim();
                }
                self.include(&name, &at, depth)?;
            } else {
                self.line(line, &at)?;
            }
        }
        self.refuse_cut_off(path, file.bytes())
    }

    fn include(&mut self, name: &str, at: &Place<'_>, depth: usize) -> Result<(), Diagnostic> {
        let name = name.split('$').next().filter(|_| !name.starts_with(['\'', '"'])).unwrap_or(name);
        let name = name.trim().trim_matches(['\'', '"']);
        let folder = at.path.parent().unwrap_or(Path::new(""));
        let main = self.files.first().and_then(|file| file.path.parent()).unwrap_or(folder);
        let beside = folder.join(name);
        let path = if beside.exists() { beside } else { main.join(name) };
        let file = InputFile::open(&path).map_err(|diagnostic| {
            let message = format!("{} is included: {}", path.display(), diagnostic.message());
            Diagnostic::new(diagnostic.code(), message).in_file(at.path).at_line(at.line)
        })?;
        self.flush()?;
        self.file(&path, &file, depth + 1)
    }

    fn line(&mut self, line: &[u8], at: &Place<'_>) -> Taken {
        let line = without_comment(line);
        if line.is_empty() {
            return Ok(());
        }
        if is_begin(line) {
            self.flush()?;
            self.in_bulk = true;
            return (self.take)(Item::Begin(at));
        } else if !self.in_bulk {
            return (self.take)(Item::Control(&String::from_utf8_lossy(line)));
        } else if line.get(..7).is_some_and(|begin| begin.eq_ignore_ascii_case(b"ENDDATA")) {
            self.flush()?;
            self.ended = true;
        } else {
            return self.bulk_line(line, at);
        }
        Ok(())
    }

    fn bulk_line(&mut self, line: &[u8], at: &Place<'_>) -> Taken {
        let line = Line::of(line);
        let head = line.head();
        let here = |diagnostic: Diagnostic| diagnostic.in_file(at.path).at_line(at.line);
        // A line of replication makes cards from the last one.
        match Replication::request(&line).map_err(here)? {
            None => {}
            Some(ReplicationRequest::One(replication)) => {
                self.replication = replication;
                return self.replicate(1, at);
            }
            Some(ReplicationRequest::Repeat(count)) => return self.replicate(count, at),
        }
        if matches!(head.first(), None | Some(b'+' | b'*')) {
            let refused = |what: &str| {
                let message = format!("`{}` continues {what}", excerpt(&line.text));
                Diagnostic::new(Code::DeckSyntax, message).in_file(at.path).at_line(at.line)
            };
            let (name, card) = (bare(head).to_ascii_uppercase(), &self.card);
            // A continuation elsewhere is stored until the end of the file; others must follow their card.
            let is_below = self.is_open && !name.is_empty() && name == card.continuation;
            if !is_below && self.apart.keep(&name, &line.text, at.line) {
                return Ok(());
            }
            if !self.is_open {
                return Err(refused("no card"));
            }
            if !name.is_empty() && !card.continuation.is_empty() && name != card.continuation {
                let help = "write the lines of a card one after the other";
                return Err(refused(&format!("another card than the {} above it", card.name)).with_help(help));
            }
        } else {
            let name = String::from_utf8_lossy(head).trim_end_matches('*').trim().to_uppercase();
            self.open(at)?;
            self.card.begin(name);
        }
        card_fields(&mut self.card, &line, at.line).map_err(here)
    }

    /// Passes on the last card, and begins another one.
    fn open(&mut self, at: &Place<'_>) -> Taken {
        self.flush()?;
        self.apart.close();
        if self.card_path != at.path {
            self.card_path = at.path.to_path_buf();
        }
        self.is_open = true;
        Ok(())
    }

    /// Makes `count` cards from the last one by replication.
    fn replicate(&mut self, count: i64, at: &Place<'_>) -> Taken {
        self.repeated = self.repeated.saturating_add(count);
        if self.repeated > MAX_REPEATED_CARDS {
            let message =
                format!("lines of repetition represent more than {MAX_REPEATED_CARDS} cards of the deck");
            let refused = Diagnostic::new(Code::DeckSyntax, message).in_file(at.path).at_line(at.line);
            return Err(refused.with_help("write the cards one by one"));
        }
        for _ in 0..count {
            let next = self.replication.next(&self.card);
            let mut next = next.map_err(|diagnostic| diagnostic.in_file(at.path).at_line(at.line))?;
            next.lines.push((0, at.line));
            self.open(at)?;
            self.card = next;
        }
        Ok(())
    }

    /// Passes on the last card, unless its continuation comes later.
    fn flush(&mut self) -> Taken {
        if !std::mem::take(&mut self.is_open) {
            return Ok(());
        }
        if self.apart.contains(&self.card.continuation) {
            self.apart.wait(self.card.clone(), self.card_path.clone());
            return Ok(());
        }
        (self.take)(Item::Card(&self.card, &self.card_path))
    }

    /// Returns FB301 if the last card belongs to a matrix and has no line end: digits may be missing.
    fn refuse_cut_off(&mut self, path: &Path, bytes: &[u8]) -> Taken {
        let is_matrix = self.is_open && self.card.name == "DMIG" && self.card_path == path;
        if is_matrix && !bytes.ends_with(b"\n") {
            return Err(cut_off(path, line_number(bytes, bytes.len())));
        }
        Ok(())
    }
}

fn cut_off(path: &Path, line: usize) -> Diagnostic {
    let message = "the matrix ends in a line without a line end: the file may be cut off";
    let diagnostic = Diagnostic::new(Code::MatrixSyntax, message).in_file(path).at_line(line);
    diagnostic.with_help("write the file again; if it is whole, end the last line")
}

fn unclosed(name: &str) -> bool {
    name.chars().next().is_some_and(|quote| matches!(quote, '\'' | '"') && !name[1..].contains(quote))
}
