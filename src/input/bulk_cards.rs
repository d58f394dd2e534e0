//! Decks of Nastran: lines of case control, then bulk data cards in free, small and large fields, with
//! continuations, comments and included files.

use super::bytes::InputFile;
use super::coordinates::{excerpt, real};
use crate::base::diagnostic::{Code, Diagnostic};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Files that include one another deeper than this include themselves.
const DEEPEST: usize = 20;
/// A deck has no more files than these.
const MOST_FILES: usize = 1000;

/// What a deck is made of, in its order.
pub(super) enum Item<'a> {
    /// A line above the bulk data, without its comment.
    Control(&'a str),
    /// BEGIN BULK, BEGIN SUPER.
    Begin(&'a Place<'a>),
    Card(&'a Card, &'a Path),
}

/// Where something stands.
pub(super) struct Place<'a> {
    pub path: &'a Path,
    pub line: usize,
}

/// A bulk data card: its name and its fields, eight to a line of small fields, four to one of large fields.
#[derive(Default)]
pub(super) struct Card {
    /// In upper case, without asterisk.
    pub name: String,
    text: Vec<u8>,
    /// Where each field ends in the text.
    ends: Vec<usize>,
    /// The first field of each line, and the number of the line.
    lines: Vec<(usize, usize)>,
    /// Name that the continuation has to have, where one is given.
    continuation: Vec<u8>,
}

impl Card {
    /// A field, trimmed, from 0 for what follows the name; empty where the card has none.
    pub(super) fn field(&self, k: usize) -> &[u8] {
        let Some(&end) = self.ends.get(k) else { return b"" };
        let start = if k == 0 { 0 } else { self.ends[k - 1] };
        &self.text[start..end]
    }

    /// Number of fields, empty ones included.
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// A whole number; zero where the field is empty.
    pub(super) fn integer(&self, k: usize) -> Option<i64> {
        match self.field(k) {
            b"" => Some(0),
            field => whole(field),
        }
    }

    /// A finite real number; zero where the field is empty.
    pub(super) fn real(&self, k: usize) -> Option<f64> {
        match self.field(k) {
            b"" => Some(0.0),
            field => real(field).filter(|value| value.is_finite()),
        }
    }

    /// The line that a field stands in.
    pub(super) fn line_of(&self, k: usize) -> usize {
        let at = self.lines.partition_point(|(first, _)| *first <= k);
        self.lines.get(at.saturating_sub(1)).map_or(1, |(_, line)| *line)
    }

    /// The line that it begins in.
    pub(super) fn line(&self) -> usize {
        self.line_of(0)
    }

    fn begin(&mut self, name: String) {
        self.name = name;
        self.text.clear();
        self.ends.clear();
        self.lines.clear();
        self.continuation.clear();
    }

    fn push(&mut self, field: &[u8]) {
        self.text.extend_from_slice(field.trim_ascii());
        self.ends.push(self.text.len());
    }
}

/// A whole number as cards have it.
pub(super) fn whole(field: &[u8]) -> Option<i64> {
    std::str::from_utf8(field).ok()?.parse().ok()
}

/// Whether a file is a deck of Nastran or bulk data, by its first lines that say so.
pub(super) fn is_bulk_data(bytes: &[u8]) -> bool {
    const LOOKED_AT: usize = 1 << 20;
    let head = &bytes[..bytes.len().min(LOOKED_AT)];
    head.split(|&b| b == b'\n').any(|line| {
        let line: Vec<u8> = line.iter().take(16).map(u8::to_ascii_uppercase).collect();
        let is_card = |name: &[u8]| {
            line.strip_prefix(name)
                .is_some_and(|rest| matches!(rest.first(), Some(b' ' | b',' | b'*' | b'\t')))
        };
        is_begin(&line) || line.trim_ascii() == b"CEND" || is_card(b"GRID") || is_card(b"DMIG")
    })
}

/// Whether a line, in upper case, begins bulk data.
fn is_begin(line: &[u8]) -> bool {
    let rest = line.trim_ascii_start().strip_prefix(b"BEGIN").filter(|rest| rest.first() == Some(&b' '));
    rest.is_some_and(|rest| {
        [&b"BULK"[..], b"SUPER"].iter().any(|kind| rest.trim_ascii_start().starts_with(kind))
    })
}

/// Reads a deck with the files that it includes and gives what it is made of to `take`. The files, the main
/// one first.
///
/// # Errors
/// FB101, FB106 for files that cannot be read; FB110 for continuations without a card, fields beyond the
/// line, and files that include themselves; FB301 for a matrix at the end of a file that has no line end.
pub(super) fn read_deck(path: &Path, take: &mut dyn FnMut(Item<'_>)) -> Result<Vec<PathBuf>, Diagnostic> {
    let file = InputFile::open(path)?;
    let upper = |line: &[u8]| line.iter().take(40).map(u8::to_ascii_uppercase).collect::<Vec<u8>>();
    let has_control = file
        .bytes()
        .split(|&b| b == b'\n')
        .map(upper)
        .any(|line| line.trim_ascii() == b"CEND" || line.starts_with(b"SOL ") || is_begin(&line));
    let mut reading = Reading { files: Vec::new(), in_bulk: !has_control, ended: false, open: None, take };
    reading.file(path, &file, 0)?;
    reading.flush();
    Ok(reading.files)
}

/// A deck while it is read.
struct Reading<'t> {
    files: Vec<PathBuf>,
    in_bulk: bool,
    /// ENDDATA has come.
    ended: bool,
    /// The card that continuations go on with.
    open: Option<(Card, PathBuf)>,
    take: &'t mut dyn FnMut(Item<'_>),
}

impl Reading<'_> {
    fn file(&mut self, path: &Path, file: &InputFile, depth: usize) -> Result<(), Diagnostic> {
        if depth > DEEPEST || self.files.len() >= MOST_FILES {
            let message =
                format!("files include one another more than {DEEPEST} levels deep, or {MOST_FILES} times");
            return Err(Diagnostic::new(Code::DeckSyntax, message)
                .in_file(path)
                .with_help("a file includes itself: take the INCLUDE out"));
        }
        self.files.push(path.to_path_buf());
        let mut lines = file.bytes().split(|&b| b == b'\n').enumerate().map(|(k, line)| (k + 1, line));
        while let Some((number, line)) = lines.next() {
            if self.ended {
                return Ok(());
            }
            let at = Place { path, line: number };
            let bare = line.trim_ascii();
            if bare.is_empty() || bare.starts_with(b"$") {
                continue;
            }
            if is_include(bare) {
                let mut name = String::from_utf8_lossy(&bare[7..]).trim().to_owned();
                // A name between quotes may go on in the next lines.
                while unclosed(&name) {
                    let Some((_, more)) = lines.next() else { break };
                    name += String::from_utf8_lossy(more).trim();
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
        let main = self.files.first().and_then(|path| path.parent()).unwrap_or(folder);
        let beside = folder.join(name);
        let path = if beside.exists() { beside } else { main.join(name) };
        let file = InputFile::open(&path).map_err(|diagnostic| {
            let message = format!("{} is included: {}", path.display(), diagnostic.message());
            Diagnostic::new(diagnostic.code(), message).in_file(at.path).at_line(at.line)
        })?;
        self.flush();
        self.file(&path, &file, depth + 1)
    }

    fn line(&mut self, line: &[u8], at: &Place<'_>) -> Result<(), Diagnostic> {
        let end = line.iter().position(|&b| b == b'$').unwrap_or(line.len());
        let line = line[..end].trim_ascii_end();
        if line.is_empty() {
            return Ok(());
        }
        let upper: Vec<u8> = line.iter().take(40).map(u8::to_ascii_uppercase).collect();
        if is_begin(&upper) {
            self.flush();
            self.in_bulk = true;
            (self.take)(Item::Begin(at));
        } else if !self.in_bulk {
            (self.take)(Item::Control(&String::from_utf8_lossy(line)));
        } else if upper.starts_with(b"ENDDATA") {
            self.flush();
            self.ended = true;
        } else {
            return self.bulk_line(line, at);
        }
        Ok(())
    }

    fn bulk_line(&mut self, line: &[u8], at: &Place<'_>) -> Result<(), Diagnostic> {
        let is_free = line.contains(&b',');
        let line = if is_free { Cow::Borrowed(line) } else { without_tabs(line) };
        let head = match is_free {
            true => line.split(|&b| b == b',').next().unwrap_or_default(),
            false => &line[..line.len().min(8)],
        };
        let head = head.trim_ascii();
        let (is_large, goes_on) = match head.first() {
            None => (false, true),
            Some(b'+') => (false, true),
            Some(b'*') => (true, true),
            Some(_) => (head.ends_with(b"*"), false),
        };
        if goes_on {
            let refused = |what: &str| {
                let message = format!("`{}` continues {what}", excerpt(&line));
                Diagnostic::new(Code::DeckSyntax, message).in_file(at.path).at_line(at.line)
            };
            let Some((card, _)) = &self.open else { return Err(refused("no card")) };
            let name = bare(head);
            if !name.is_empty() && !card.continuation.is_empty() && name != card.continuation {
                let help = "write the lines of a card one after the other";
                return Err(refused(&format!("another card than the {} above it", card.name)).with_help(help));
            }
        } else {
            self.flush();
            let name = String::from_utf8_lossy(head).trim_end_matches('*').trim().to_uppercase();
            let mut card = Card::default();
            card.begin(name);
            self.open = Some((card, at.path.to_path_buf()));
        }
        let (card, _) = self.open.as_mut().expect("a card is open");
        card.lines.push((card.ends.len(), at.line));
        let fields = if is_large { 4 } else { 8 };
        match is_free {
            true => free_fields(card, &line, fields).map_err(|d| d.in_file(at.path).at_line(at.line)),
            false => {
                fixed_fields(card, &line, fields);
                Ok(())
            }
        }
    }

    /// Gives the card that has been read.
    fn flush(&mut self) {
        if let Some((card, path)) = self.open.take() {
            (self.take)(Item::Card(&card, &path));
        }
    }

    /// FB301 where the last card is of a matrix and has no line end: digits may be missing.
    fn refuse_cut_off(&mut self, path: &Path, bytes: &[u8]) -> Result<(), Diagnostic> {
        match &self.open {
            Some((card, own)) if card.name == "DMIG" && own == path && !bytes.ends_with(b"\n") => {
                let message = "the matrix ends in a line without a line end: the file may be cut off";
                let line = bytes.iter().filter(|&&b| b == b'\n').count() + 1;
                let diagnostic = Diagnostic::new(Code::MatrixSyntax, message).in_file(path).at_line(line);
                Err(diagnostic.with_help("write the file again; if it is whole, end the last line"))
            }
            _ => Ok(()),
        }
    }
}

/// A continuation without the sign that it begins with.
fn bare(field: &[u8]) -> &[u8] {
    let first = field.iter().position(|b| !b"+*".contains(b)).unwrap_or(field.len());
    field[first..].trim_ascii()
}

fn is_include(line: &[u8]) -> bool {
    let next = line.get(7);
    line.len() > 7
        && line[..7].eq_ignore_ascii_case(b"INCLUDE")
        && next.is_some_and(|b| matches!(b, b' ' | b'\t' | b'\'' | b'"'))
}

fn unclosed(name: &str) -> bool {
    name.chars().next().is_some_and(|quote| matches!(quote, '\'' | '"') && !name[1..].contains(quote))
}

/// Tabs go on to the next column that is a multiple of eight.
fn without_tabs(line: &[u8]) -> Cow<'_, [u8]> {
    if !line.contains(&b'\t') {
        return Cow::Borrowed(line);
    }
    let mut wide = Vec::new();
    for &b in line {
        match b {
            b'\t' => wide.resize((wide.len() / 8 + 1) * 8, b' '),
            b => wide.push(b),
        }
    }
    Cow::Owned(wide)
}

fn fixed_fields(card: &mut Card, line: &[u8], fields: usize) {
    let width = 64 / fields;
    let part = |from: usize, to: usize| line.get(from..line.len().min(to)).unwrap_or_default();
    for k in 0..fields {
        card.push(part(8 + k * width, 8 + (k + 1) * width));
    }
    card.continuation = bare(part(72, 80).trim_ascii()).to_vec();
}

fn free_fields(card: &mut Card, line: &[u8], fields: usize) -> Result<(), Diagnostic> {
    let mut given = line.split(|&b| b == b',').skip(1);
    for _ in 0..fields {
        card.push(given.next().unwrap_or_default());
    }
    card.continuation = bare(given.next().unwrap_or_default().trim_ascii()).to_vec();
    if given.any(|field| !field.trim_ascii().is_empty()) {
        let message = format!("the line has more than {fields} fields");
        return Err(Diagnostic::new(Code::DeckSyntax, message).with_help("begin a continuation line"));
    }
    Ok(())
}
