//! Fields of a line, by separator or by column.

/// Returns the words of a text, separated by blanks.
#[inline]
pub fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// Returns the field of a line in these columns, trimmed; empty if the line is shorter.
#[inline]
pub fn field(line: &[u8], columns: std::ops::Range<usize>) -> &[u8] {
    line.get(columns.start..columns.end.min(line.len())).unwrap_or_default().trim_ascii()
}

/// Separator of the fields of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Separator {
    /// One byte; two of them in a row have an empty field between them.
    Byte(u8),
    /// Any number of blanks and tabs.
    Blanks,
}

impl Separator {
    /// Returns the separator of a line: a semicolon, a tab, a comma or, without any of these, blanks.
    pub fn of(line: &[u8]) -> Self {
        [b';', b'\t', b','].into_iter().find(|byte| line.contains(byte)).map_or(Self::Blanks, Self::Byte)
    }

    /// Replaces `fields` by the fields of the line, without surrounding blanks and quotes. Separators inside quotes do
    /// not count.
    pub fn split_into<'a>(self, line: &'a [u8], fields: &mut Vec<&'a [u8]>) {
        fields.clear();
        let separates = |byte: u8| match self {
            Self::Byte(separator) => byte == separator,
            Self::Blanks => byte == b' ' || byte == b'\t',
        };
        let (mut from, mut quoted) = (0, false);
        for (at, &byte) in line.iter().enumerate() {
            quoted ^= byte == b'"';
            if separates(byte) && !quoted {
                fields.push(unquoted(&line[from..at]));
                from = at + 1;
            }
        }
        fields.push(unquoted(&line[from..]));
        if self == Self::Blanks {
            fields.retain(|field| !field.is_empty());
        }
    }

    /// Returns the fields of a line as [`Self::split_into`] does.
    pub fn split(self, line: &[u8]) -> Vec<&[u8]> {
        let mut fields = Vec::new();
        self.split_into(line, &mut fields);
        fields
    }
}

fn unquoted(field: &[u8]) -> &[u8] {
    let field = field.trim_ascii();
    field.strip_prefix(b"\"").and_then(|f| f.strip_suffix(b"\"")).map_or(field, <[u8]>::trim_ascii)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_end_with_their_line() {
        let line = b"  12  ab";
        assert_eq!([field(line, 0..4), field(line, 4..12), field(line, 8..12)], [&b"12"[..], b"ab", b""]);
    }

    #[test]
    fn fields_between_separators() {
        for (line, fields) in [
            ("a;b,c;", &["a", "b,c", ""][..]),
            ("\"x, far\" , \" y \",", &["x, far", "y", ""]),
            ("  1 \"2 3\"  4 ", &["1", "2 3", "4"]),
            ("1\t\t2", &["1", "", "2"]),
        ] {
            let found = Separator::of(line.as_bytes()).split(line.as_bytes());
            assert_eq!(found, fields.iter().map(|field| field.as_bytes()).collect::<Vec<_>>(), "{line}");
        }
    }
}
