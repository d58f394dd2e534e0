//! Bulk data cards of Nastran, and the lines of which they are made: fields in free, small and large form.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::scanner::{field, real, whole};
use std::borrow::Cow;
use std::ops::Range;

/// Bulk data card: its name and its fields, eight per line of small fields, four per line of large fields.
#[derive(Clone, Default)]
pub(crate) struct Card {
    /// Name in upper case, without asterisk.
    pub name: String,
    pub(super) text: Vec<u8>,
    /// End of each field in the text.
    pub(super) ends: Vec<usize>,
    /// First field of each line, and the number of the line.
    pub(super) lines: Vec<(usize, usize)>,
    /// Name that the continuation must have, in upper case; empty if none is given.
    pub(super) continuation: Vec<u8>,
}

impl Card {
    /// Returns field `k`, trimmed, counted from 0 after the name; empty if the card does not have it.
    pub(crate) fn field(&self, k: usize) -> &[u8] {
        let Some(&end) = self.ends.get(k) else { return b"" };
        let start = if k == 0 { 0 } else { self.ends[k - 1] };
        &self.text[start..end]
    }

    /// Returns the number of fields, empty ones included.
    pub(crate) fn len(&self) -> usize {
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
    pub(crate) fn line_of(&self, k: usize) -> usize {
        let at = self.lines.partition_point(|(first, _)| *first <= k);
        self.lines.get(at.saturating_sub(1)).map_or(1, |(_, line)| *line)
    }

    /// Returns the number of the first line of the card.
    pub(crate) fn line(&self) -> usize {
        self.line_of(0)
    }

    pub(super) fn begin(&mut self, name: String) {
        self.name = name;
        self.text.clear();
        self.ends.clear();
        self.lines.clear();
        self.continuation.clear();
    }

    /// Sets the name of the continuation to that in the trimmed `field`.
    pub(super) fn continue_as(&mut self, field: &[u8]) {
        self.continuation.clear();
        self.continuation.extend(bare(field).iter().map(u8::to_ascii_uppercase));
    }

    /// Adds a trimmed field.
    pub(super) fn push(&mut self, field: &[u8]) {
        self.text.extend_from_slice(field);
        self.ends.push(self.text.len());
    }
}

/// Returns the components of a grid: digits from 0 to 6. Scalar points have 0 or none.
pub(crate) fn components(field: &[u8]) -> Option<Vec<u8>> {
    field.iter().map(|b| (b'0'..=b'6').contains(b).then(|| b - b'0')).collect()
}

/// Adds the fields of a line to a card.
pub(super) fn card_fields(card: &mut Card, line: &Line<'_>, number: usize) -> Result<(), Diagnostic> {
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

pub(super) fn fixed_fields(card: &mut Card, line: &[u8], fields: usize) {
    let width = 64 / fields;
    for k in 0..fields {
        card.push(field(line, 8 + k * width..8 + (k + 1) * width));
    }
    card.continue_as(field(line, 72..80));
}

pub(super) fn free_fields(card: &mut Card, line: &[u8], fields: usize) -> Result<(), Diagnostic> {
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

/// Line of a card, without its comment.
pub(super) struct Line<'a> {
    /// True if commas separate the fields.
    pub(super) is_free: bool,
    /// Text; without tabs if fields have fixed columns.
    pub(super) text: Cow<'a, [u8]>,
}

impl<'a> Line<'a> {
    pub(super) fn of(line: &'a [u8]) -> Self {
        let is_free = memchr::memchr(b',', line).is_some();
        Self { is_free, text: if is_free { Cow::Borrowed(line) } else { without_tabs(line) } }
    }

    /// Returns the text before the fields: the name of the card, or a continuation.
    pub(super) fn head(&self) -> &[u8] {
        self.part(0, 0..8)
    }

    /// Returns the k-th part between commas, or the part in fixed columns, trimmed; empty if the line is shorter.
    pub(super) fn part(&self, k: usize, columns: Range<usize>) -> &[u8] {
        if self.is_free {
            self.text.split(|&b| b == b',').nth(k).unwrap_or_default().trim_ascii()
        } else {
            field(&self.text, columns)
        }
    }
}

/// Returns a line without its comment.
pub(super) fn without_comment(line: &[u8]) -> &[u8] {
    line[..memchr::memchr(b'$', line).unwrap_or(line.len())].trim_ascii_end()
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

/// Returns the name of a continuation without its leading sign.
pub(super) fn bare(field: &[u8]) -> &[u8] {
    let first = field.iter().position(|b| !b"+*".contains(b)).unwrap_or(field.len());
    field[first..].trim_ascii()
}

/// Returns true when a line begins bulk data.
pub(super) fn is_begin(line: &[u8]) -> bool {
    let word = |text: &[u8], word: &[u8]| {
        text.get(..word.len()).is_some_and(|begin| begin.eq_ignore_ascii_case(word))
    };
    let line = line[..line.len().min(40)].trim_ascii_start();
    word(line, b"BEGIN ") && {
        let kind = line[6..].trim_ascii_start();
        word(kind, b"BULK") || word(kind, b"SUPER")
    }
}

pub(super) fn is_include(line: &[u8]) -> bool {
    let next = line.get(7);
    line.len() > 7
        && line[..7].eq_ignore_ascii_case(b"INCLUDE")
        && next.is_some_and(|b| matches!(b, b' ' | b'\t' | b'\'' | b'"'))
}
