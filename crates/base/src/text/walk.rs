//! Settings in TOML: reads tables and collects everything that is wrong with them, each with its line.

use super::input_file::InputFile;
use super::quotes::without_foreign_quotes;
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::provenance::Fingerprint;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A table of a TOML document, with the places of its keys and values.
pub type TomlTable<'t> = DeTable<'t>;
/// A value of a TOML document, with its place.
pub type Value<'t> = Spanned<DeValue<'t>>;

/// Reads `path`, a `kind` of file, by `walk`, which returns `None` only with something in `found`. `syntax`
/// is the code of what is not as it should be.
///
/// # Errors
/// FB101, FB106 when it cannot be read; everything that was found, in the order of lines.
pub fn read_toml<T>(
    path: &Path,
    kind: &str,
    syntax: Code,
    walk: impl FnOnce(&mut Walk<'_>, &TomlTable<'_>) -> Option<T>,
) -> Result<T> {
    let file = InputFile::open(path)?;
    let text = std::str::from_utf8(file.bytes()).map_err(|e| {
        let line = line_at(file.bytes(), e.valid_up_to());
        Diagnostic::new(syntax, format!("{kind} is not UTF-8 text")).in_file(path).at_line(line)
    })?;
    let mut tables = Walk { path, text, syntax, line_ends: LineEnds::of(text), found: Vec::new() };
    let (document, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let message = error.message().to_owned();
        tables.complain(syntax, error.span().unwrap_or(0..0), message);
    }
    // After a syntax error the rest of the document is guesswork.
    let read = if errors.is_empty() { walk(&mut tables, document.get_ref()) } else { None };
    match read {
        Some(read) if tables.found.is_empty() => Ok(read),
        _ => Err(Error::new(tables.told())),
    }
}

/// The line (from 1) of the byte at `offset`.
fn line_at(text: &[u8], offset: usize) -> usize {
    1 + text[..offset.min(text.len())].iter().filter(|&&b| b == b'\n').count()
}

/// Places of the line ends of a text, ascending.
struct LineEnds(Vec<usize>);

impl LineEnds {
    fn of(text: &str) -> Self {
        Self(memchr::memchr_iter(b'\n', text.as_bytes()).collect())
    }

    /// The line (from 1) of the byte at `offset`.
    fn line_at(&self, offset: usize) -> usize {
        1 + self.0.partition_point(|end| *end < offset)
    }
}

/// Reads tables and collects what is wrong with them.
pub struct Walk<'a> {
    /// The file that is read.
    pub path: &'a Path,
    text: &'a str,
    syntax: Code,
    line_ends: LineEnds,
    /// Everything that is wrong so far.
    pub found: Vec<Diagnostic>,
}

impl Walk<'_> {
    /// Returns the findings in the order of lines, the first of them where there are many.
    fn told(mut self) -> Vec<Diagnostic> {
        /// Largest number of findings that are listed.
        const SHOWN: usize = 200;
        self.found.sort_by_key(Diagnostic::line);
        let more = self.found.len().saturating_sub(SHOWN);
        self.found.truncate(SHOWN);
        if more > 0 {
            let message = format!("{more} more findings are not shown");
            self.found.push(Diagnostic::new(self.syntax, message).in_file(self.path));
        }
        self.found.into_iter().map(|one| without_foreign_quotes(one, self.path)).collect()
    }

    /// SHA-256 of the file.
    pub fn fingerprint(&self) -> String {
        let mut all = Fingerprint::default();
        all.update(self.text.as_bytes());
        all.hex()
    }

    /// A finding about the text at `span`.
    pub fn at(&self, code: Code, span: Range<usize>, message: String) -> Diagnostic {
        let line = self.line_ends.line_at(span.start);
        Diagnostic::new(code, message).in_file(self.path).at_line(line)
    }

    /// Adds a diagnostic about the text at `span`.
    pub fn complain(&mut self, code: Code, span: Range<usize>, message: String) {
        self.found.push(self.at(code, span, message));
    }

    /// Complains that something is not as the file's contract says.
    pub fn wrong(&mut self, span: Range<usize>, message: String) {
        self.complain(self.syntax, span, message);
    }

    /// Complains about every key that is not in `known`, naming the nearest that is.
    pub fn known_keys(&mut self, table: &TomlTable, place: &str, known: &[&str]) {
        for key in table.keys() {
            let name = key.get_ref().as_ref();
            if known.contains(&name) {
                continue;
            }
            let nearest = known
                .iter()
                .map(|candidate| (strsim::damerau_levenshtein(name, candidate), candidate))
                .min()
                .filter(|&(distance, candidate)| distance <= 2 && distance < candidate.len());
            let unknown = format!("key `{name}` is not known in {place}");
            let unknown = self.at(self.syntax, key.span(), unknown);
            let help = match nearest {
                Some((_, candidate)) => format!("did you mean `{candidate}`?"),
                None => format!("known keys: {}", known.join(", ")),
            };
            self.found.push(unknown.with_help(help));
        }
    }

    /// Adds that `key` has a value of another type than `expected`.
    pub fn mistyped(&mut self, key: &str, value: &Value, expected: &str) {
        let message = format!("`{key}` is {}, expected {expected}", with_article(value.get_ref().type_str()));
        self.wrong(value.span(), message);
    }

    /// A table and where it stands.
    pub fn table<'t, 'i>(
        &mut self,
        table: &'t TomlTable<'i>,
        key: &str,
    ) -> Option<(&'t TomlTable<'i>, Range<usize>)> {
        let value = table.get(key)?;
        match value.get_ref() {
            DeValue::Table(inner) => Some((inner, value.span())),
            _ => {
                self.mistyped(key, value, "a table");
                None
            }
        }
    }

    /// A string that is not empty.
    pub fn string(&mut self, table: &TomlTable, key: &str) -> Option<String> {
        let value = table.get(key)?;
        match value.get_ref() {
            DeValue::String(text) if text.is_empty() => {
                self.wrong(value.span(), format!("`{key}` is empty"));
                None
            }
            DeValue::String(text) => Some(text.to_string()),
            _ => {
                self.mistyped(key, value, "a string");
                None
            }
        }
    }

    /// A number that must be there; `span` is that of its table.
    pub fn number(&mut self, table: &TomlTable, key: &str, span: &Range<usize>) -> Option<f64> {
        let Some(value) = table.get(key) else {
            self.wrong(span.clone(), format!("key `{key}` is missing"));
            return None;
        };
        let number = real(value);
        if number.is_none() {
            self.mistyped(key, value, "a number");
        }
        number
    }
}

/// The integer that `value` is, in any base that TOML has; `None` of other types and beyond 64 bits.
pub fn integer(value: &Value) -> Option<i64> {
    let number = value.get_ref().as_integer()?;
    i64::from_str_radix(number.as_str(), number.radix()).ok()
}

/// The number that `value` is, integers included; `None` of other types.
pub fn real(value: &Value) -> Option<f64> {
    match value.get_ref() {
        DeValue::Float(number) => number.as_str().parse().ok(),
        DeValue::Integer(_) => integer(value).map(|number| number as f64),
        _ => None,
    }
}

fn with_article(kind: &str) -> String {
    let article = if kind.starts_with(['a', 'i']) { "an" } else { "a" };
    format!("{article} {kind}")
}
