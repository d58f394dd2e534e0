//! Settings in TOML: reads tables and collects all errors, each with its line.

use super::input_file::InputFile;
use super::quotes::without_foreign_quotes;
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::provenance::Fingerprint;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Table of a TOML document, with the positions of its keys and values.
pub type TomlTable<'t> = DeTable<'t>;
/// Value of a TOML document, with its position.
pub type Value<'t> = Spanned<DeValue<'t>>;

/// Reads `path`, a file of the given `kind`, with `walk`, which may return `None` only if `diagnostics` has an entry.
/// `syntax` is the code of violations.
///
/// # Errors
/// FB101, FB106 if the file cannot be read; all findings, in the order of lines.
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
    parse_toml(text, path, syntax, walk)
}

/// Reads a TOML document with `walk`, like [`read_toml`]. `path` is the file that messages name, in whose folder other
/// files are found.
///
/// # Errors
/// All findings, in the order of lines.
pub fn parse_toml<T>(
    text: &str,
    path: &Path,
    syntax: Code,
    walk: impl FnOnce(&mut Walk<'_>, &TomlTable<'_>) -> Option<T>,
) -> Result<T> {
    let mut tables = Walk { path, text, syntax, line_ends: LineEnds::of(text), diagnostics: Vec::new() };
    let (document, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let message = error.message().to_owned();
        tables.complain(syntax, error.span().unwrap_or(0..0), message);
    }
    // After a syntax error the rest of the document is unreliable.
    let read = if errors.is_empty() { walk(&mut tables, document.get_ref()) } else { None };
    match read {
        Some(read) if tables.diagnostics.is_empty() => Ok(read),
        _ => Err(Error::new(tables.into_findings())),
    }
}

/// Returns the line (from 1) of the byte at `offset`.
fn line_at(text: &[u8], offset: usize) -> usize {
    1 + text[..offset.min(text.len())].iter().filter(|&&b| b == b'\n').count()
}

/// Positions of the line ends of a text, ascending.
struct LineEnds(Vec<usize>);

impl LineEnds {
    fn of(text: &str) -> Self {
        Self(memchr::memchr_iter(b'\n', text.as_bytes()).collect())
    }

    /// Returns the line (from 1) of the byte at `offset`.
    fn line_at(&self, offset: usize) -> usize {
        1 + self.0.partition_point(|end| *end < offset)
    }
}

/// Reader of tables that collects errors.
pub struct Walk<'a> {
    /// File that is read.
    pub path: &'a Path,
    text: &'a str,
    syntax: Code,
    line_ends: LineEnds,
    /// All findings so far.
    pub diagnostics: Vec<Diagnostic>,
}

impl Walk<'_> {
    /// Returns the findings in the order of lines, up to a limit.
    fn into_findings(mut self) -> Vec<Diagnostic> {
        /// Largest number of findings that are listed.
        const MAX_SHOWN: usize = 200;
        self.diagnostics.sort_by_key(Diagnostic::line);
        let more = self.diagnostics.len().saturating_sub(MAX_SHOWN);
        self.diagnostics.truncate(MAX_SHOWN);
        if more > 0 {
            let message = format!("{more} more findings are not shown");
            self.diagnostics.push(Diagnostic::new(self.syntax, message).in_file(self.path));
        }
        self.diagnostics.into_iter().map(|one| without_foreign_quotes(one, self.path)).collect()
    }

    /// Returns the SHA-256 of the file.
    pub fn fingerprint(&self) -> String {
        let mut all = Fingerprint::default();
        all.update(self.text.as_bytes());
        all.hex()
    }

    /// Returns a diagnostic about the text at `span`.
    pub fn at(&self, code: Code, span: Range<usize>, message: String) -> Diagnostic {
        let line = self.line_ends.line_at(span.start);
        Diagnostic::new(code, message).in_file(self.path).at_line(line)
    }

    /// Adds a diagnostic about the text at `span`.
    pub fn complain(&mut self, code: Code, span: Range<usize>, message: String) {
        self.diagnostics.push(self.at(code, span, message));
    }

    /// Adds a violation of the file's format.
    pub fn wrong(&mut self, span: Range<usize>, message: String) {
        self.complain(self.syntax, span, message);
    }

    /// Adds a diagnostic for every key that is not in `known`, with the most similar known key.
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
                None => format!("use one of the keys {}", known.join(", ")),
            };
            self.diagnostics.push(unknown.with_help(help));
        }
    }

    /// Adds that `key` has a value of another type than `expected`.
    pub fn mistyped(&mut self, key: &str, value: &Value, expected: &str) {
        let message = format!("`{key}` is {}, expected {expected}", with_article(value.get_ref().type_str()));
        self.wrong(value.span(), message);
    }

    /// Returns a table and its position; `None` if it is missing or has another type.
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

    /// Returns a non-empty string; `None` if it is missing or invalid.
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

    /// Returns a required number. `span` is the position of its table.
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

/// Returns the integer of `value`, in any base of TOML; `None` for other types and beyond 64 bits.
pub fn integer(value: &Value) -> Option<i64> {
    let number = value.get_ref().as_integer()?;
    i64::from_str_radix(number.as_str(), number.radix()).ok()
}

/// Returns the number of `value`, integers included; `None` for other types.
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
