//! The text scanner behind the line readers: lines with their numbers, words across lines, fields by separator or
//! column, numbers, excerpts for messages, and the collector of bad lines.
//!
//! Blanks are those of ASCII. A reader adds what its format alone has: comments, keywords and continuations.

mod bad_lines;
mod fields;
mod lines;
mod numbers;

pub use bad_lines::BadLines;
pub use fields::{Separator, field, words};
pub use lines::{Line, Lines, Words, line_end, line_number};
pub use numbers::{integer, number, real, whole};

use crate::diagnostic::{Code, Diagnostic};

/// Returns the text, or its beginning, in printable form for a message.
pub fn excerpt(text: &[u8]) -> String {
    const MAX_CHARACTERS: usize = 60;
    match std::str::from_utf8(text) {
        Ok(text) if text.len() <= MAX_CHARACTERS && !text.contains(|c: char| c.is_control() && c != '\t') => {
            text.to_owned()
        }
        _ if text.len() <= MAX_CHARACTERS => text.escape_ascii().to_string(),
        _ => format!("{}...", text[..MAX_CHARACTERS].escape_ascii()),
    }
}

/// Returns the diagnostic about unexpected text.
pub fn expected(code: Code, what: &str, found: &[u8]) -> Diagnostic {
    Diagnostic::new(code, format!("expected {what}, found `{}`", excerpt(found)))
}

/// Returns the text without the byte order mark of UTF-8; `None` for UTF-16.
pub fn without_mark(text: &[u8]) -> Option<&[u8]> {
    if text.starts_with(b"\xff\xfe") || text.starts_with(b"\xfe\xff") {
        return None;
    }
    Some(text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text))
}
