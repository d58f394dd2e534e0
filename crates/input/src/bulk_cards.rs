//! Decks of Nastran: lines of case control, then bulk data cards in free, small and large fields, with continuations,
//! comments and included files.

mod lines;

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_base::text::scanner::{self, Lines, excerpt, field, line_number, real, whole};
use lines::{Apart, MAX_REPEATED_CARDS, Replication, ReplicationRequest};
use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};

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

/// Bulk data card: its name and its fields, eight per line of small fields, four per line of large fields.
#[derive(Clone, Default)]
pub(super) struct Card {
    /// Name in upper case, without asterisk.
    pub name: String,
    text: Vec<u8>,
    /// End of each field in the text.
    ends: Vec<usize>,
    /// First field of each line, and the number of the line.
    lines: Vec<(usize, usize)>,
    /// Name that the continuation must have, in upper case; empty if none is given.
    continuation: Vec<u8>,
}

impl Card {
    /// Returns field `k`, trimmed, counted from 0 after the name; empty if the card does not have it.
    pub(super) fn field(&self, k: usize) -> &[u8] {
        let Some(&end) = self.ends.get(k) else { return b"" };
        let start = if k == 0 { 0 } else { self.ends[k - 1] };
        &self.text[start..end]
    }

    /// Returns the number of fields, empty ones included.
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Returns field `k` as a whole number; zero if it is empty, `None` if it is no whole number.
    pub(crate) fn integer(&self, k: usize) -> Option<i64> {
        match self.field(k) {
            b"" => Some(0),
            field => whole(field),
        }
    }

    /// Returns field `k` as a finite real number; zero if it is empty, `None` if it is no such number.
    pub(crate) fn real(&self, k: usize) -> Option<f64> {
        match self.field(k) {
            b"" => Some(0.0),
            field => real(field).filter(|value| value.is_finite()),
        }
    }

    /// Returns the number of the line with field `k`.
    pub(super) fn line_of(&self, k: usize) -> usize {
        let at = self.lines.partition_point(|(first, _)| *first <= k);
        self.lines.get(at.saturating_sub(1)).map_or(1, |(_, line)| *line)
    }

    /// Returns the number of the first line of the card.
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

    /// Sets the name of the continuation to that in the trimmed `field`.
    fn continue_as(&mut self, field: &[u8]) {
        self.continuation.clear();
        self.continuation.extend(bare(field).iter().map(u8::to_ascii_uppercase));
    }

    /// Adds a trimmed field.
    fn push(&mut self, field: &[u8]) {
        self.text.extend_from_slice(field);
        self.ends.push(self.text.len());
    }
}

/// Returns the components of a grid: digits from 0 to 6. Scalar points have 0 or none.
pub(super) fn components(field: &[u8]) -> Option<Vec<u8>> {
    field.iter().map(|b| (b'0'..=b'6').contains(b).then(|| b - b'0')).collect()
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

/// Returns true when a line begins bulk data.
fn is_begin(line: &[u8]) -> bool {
    let word = |text: &[u8], word: &[u8]| {
        text.get(..word.len()).is_some_and(|begin| begin.eq_ignore_ascii_case(word))
    };
    let line = line[..line.len().min(40)].trim_ascii_start();
    word(line, b"BEGIN ") && {
        let kind = line[6..].trim_ascii_start();
        word(kind, b"BULK") || word(kind, b"SUPER")
    }
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

/// Returns a line without its comment.
fn without_comment(line: &[u8]) -> &[u8] {
    line[..memchr::memchr(b'$', line).unwrap_or(line.len())].trim_ascii_end()
}

/// Line of a card, without its comment.
struct Line<'a> {
    /// True if commas separate the fields.
    is_free: bool,
    /// Text; without tabs if fields have fixed columns.
    text: Cow<'a, [u8]>,
}

impl<'a> Line<'a> {
    fn of(line: &'a [u8]) -> Self {
        let is_free = memchr::memchr(b',', line).is_some();
        Self { is_free, text: if is_free { Cow::Borrowed(line) } else { without_tabs(line) } }
    }

    /// Returns the text before the fields: the name of the card, or a continuation.
    fn head(&self) -> &[u8] {
        self.part(0, 0..8)
    }

    /// Returns the k-th part between commas, or the part in fixed columns, trimmed; empty if the line is shorter.
    fn part(&self, k: usize, columns: Range<usize>) -> &[u8] {
        if self.is_free {
            self.text.split(|&b| b == b',').nth(k).unwrap_or_default().trim_ascii()
        } else {
            field(&self.text, columns)
        }
    }
}

/// Returns the name of a continuation without its leading sign.
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

/// Replaces tabs by blanks up to the next column that is a multiple of eight.
fn without_tabs(line: &[u8]) -> Cow<'_, [u8]> {
    if memchr::memchr(b'\t', line).is_none() {
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

/// Adds the fields of a line to a card.
fn card_fields(card: &mut Card, line: &Line<'_>, number: usize) -> Taken {
    card.lines.push((card.ends.len(), number));
    let head = line.head();
    let is_large = head.starts_with(b"*") || head.ends_with(b"*") && !head.starts_with(b"+");
    let fields = if is_large { 4 } else { 8 };
    if line.is_free {
        return free_fields(card, &line.text, fields);
    }
    fixed_fields(card, &line.text, fields);
    Ok(())
}

fn fixed_fields(card: &mut Card, line: &[u8], fields: usize) {
    let width = 64 / fields;
    for k in 0..fields {
        card.push(field(line, 8 + k * width..8 + (k + 1) * width));
    }
    card.continue_as(field(line, 72..80));
}

fn free_fields(card: &mut Card, line: &[u8], fields: usize) -> Result<(), Diagnostic> {
    let mut given = line.split(|&b| b == b',').map(<[u8]>::trim_ascii).skip(1);
    for _ in 0..fields {
        card.push(given.next().unwrap_or_default());
    }
    card.continue_as(given.next().unwrap_or_default());
    if given.any(|field| !field.is_empty()) {
        let message = format!("the line has more than {fields} fields");
        return Err(Diagnostic::new(Code::DeckSyntax, message).with_help("begin a continuation line"));
    }
    Ok(())
}
