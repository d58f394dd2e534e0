//! Text of a document for a terminal.

use super::blocks::Block;
use super::table::Table;
use super::terms::{Term, Tone, listed};
use crate::notation::markup::plain;
use flexbody_base::diagnostic::{Diagnostic, Severity};

/// Default width of a text: columns that every terminal has.
const DEFAULT_COLUMNS: usize = 80;
/// Width of the label column in characters.
const LABEL_COLUMNS: usize = 12;
/// Character that stands for a space at which a line must not break.
pub(crate) const KEEP: &str = "\u{a0}";

/// Terminal that a text is written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Screen {
    /// True if labels are coloured.
    is_coloured: bool,
    columns: usize,
}

impl Screen {
    /// Smallest width in columns; narrower summaries are unreadable.
    const NARROWEST: usize = 40;
    /// Largest width in columns; longer lines are hard to read.
    const WIDEST: usize = 100;

    /// Returns the terminal with coloured labels if `is_coloured` is true.
    pub fn coloured(self, is_coloured: bool) -> Self {
        Self { is_coloured, ..self }
    }

    /// Returns the terminal with the given number of columns, limited to the readable range.
    pub fn with_columns(self, columns: usize) -> Self {
        Self { columns: columns.clamp(Self::NARROWEST, Self::WIDEST), ..self }
    }
}

impl Default for Screen {
    /// Returns the settings for a file, or for a terminal of unknown size.
    fn default() -> Self {
        Self { is_coloured: false, columns: DEFAULT_COLUMNS }
    }
}

/// Writes the blocks of a document that belong to a text, with its diagnostics at the end, ending with a line break.
pub(crate) fn render(blocks: &[Block<'_>], screen: Screen) -> String {
    let mut text = Text { text: String::new(), label: String::new(), screen };
    text.blocks(blocks);
    for block in blocks {
        if let Block::Diagnostics(found) = block {
            text.diagnostics(found);
        }
    }
    text.finish()
}

/// Writes the blocks of a document that belong to a text, without its diagnostics, ending with a line break.
pub(super) fn render_results(blocks: &[Block<'_>], screen: Screen) -> String {
    let mut text = Text { text: String::new(), label: String::new(), screen };
    text.blocks(blocks);
    text.finish()
}

struct Text {
    text: String,
    /// Label of the previous term.
    label: String,
    screen: Screen,
}

impl Text {
    fn finish(mut self) -> String {
        self.text.truncate(self.text.trim_end().len());
        self.text + "\n"
    }

    fn blocks(&mut self, blocks: &[Block<'_>]) {
        for block in blocks {
            match block {
                Block::Terms(terms) => self.terms(terms),
                Block::Table(table) => self.table(table),
                Block::Line(line) => self.line(line),
                Block::Gap => self.gap(),
                Block::Picture(_, blocks) => self.blocks(blocks),
                _ => {}
            }
        }
    }

    fn line(&mut self, line: &str) {
        self.text.push_str(plain(line).replace(KEEP, " ").trim_end());
        self.text.push('\n');
        self.label.clear();
    }

    fn gap(&mut self) {
        if !self.text.is_empty() && !self.text.ends_with("\n\n") {
            self.line("");
        }
    }

    fn terms(&mut self, terms: &[Term]) {
        for term in terms {
            let Some((label, value)) = &term.text else { continue };
            let shown = if *label == self.label { "" } else { label };
            self.entry(term, shown, value);
            self.label.clone_from(label);
        }
    }

    /// Writes a text under a label. The maximum number of lines of the term holds for lines of the default
    /// width.
    fn entry(&mut self, term: &Term, label: &str, value: &str) {
        let columns = self.screen.columns - LABEL_COLUMNS;
        let most = term.lines
            * (DEFAULT_COLUMNS - LABEL_COLUMNS).div_ceil(columns.min(DEFAULT_COLUMNS - LABEL_COLUMNS));
        let mut lines = wrapped(&plain(value), columns);
        if lines.len() > most {
            lines.truncate(most);
            if let Some(last) = lines.last_mut() {
                *last = last.chars().take(columns - 2).collect::<String>() + " …";
            }
        }
        let [of_label, of_text] = codes(term.tone);
        for (i, line) in lines.iter().enumerate() {
            let label = format!("{:LABEL_COLUMNS$}", if i == 0 { label } else { "" });
            let line = line.replace(KEEP, " ");
            self.painted(of_label, if line.is_empty() { label.trim_end() } else { &label });
            self.painted(of_text, line.trim_end());
            self.text.push('\n');
        }
    }

    fn painted(&mut self, code: &str, text: &str) {
        if self.screen.is_coloured && !code.is_empty() && !text.trim().is_empty() {
            self.text.push_str(&format!("\u{1b}[{code}m{text}\u{1b}[0m"))
        } else {
            self.text.push_str(text)
        }
    }

    /// Writes the columns of a table that belong to a text.
    fn table(&mut self, table: &Table) {
        let lines: Vec<Vec<String>> = std::iter::once(&table.heads)
            .chain(&table.rows)
            .map(|row| table.in_text.iter().map(|&i| row[i].text()).collect())
            .collect();
        let length = |cell: &String| cell.chars().count();
        let widths: Vec<usize> = (0..table.in_text.len())
            .map(|at| lines.iter().map(|line| length(&line[at])).max().unwrap_or(0))
            .collect();
        for (number, line) in lines.iter().enumerate().filter(|(_, line)| !line.is_empty()) {
            let cells = table.in_text.iter().zip(line).zip(&widths).map(|((i, cell), &width)| {
                if table.left.contains(i) { format!("{cell:width$}") } else { format!("{cell:>width$}") }
            });
            self.line(&cells.collect::<Vec<_>>().join("  "));
            let row = number.checked_sub(1).map(|row| &table.rows[row]);
            let below = row.zip(table.below).map(|(row, column)| row[column].text());
            if let Some(below) = below.filter(|below| !below.is_empty()) {
                self.line(&format!("    {below}"));
            }
        }
    }

    fn diagnostics(&mut self, found: &[Diagnostic]) {
        for (severity, label) in
            [(Severity::Error, "errors"), (Severity::Warning, "warnings"), (Severity::Note, "notes")]
        {
            let own: Vec<_> = found.iter().filter(|diagnostic| diagnostic.severity() == severity).collect();
            self.terms(&listed(label, &own, |own| format!("{} {}", own.code().id(), own.message())));
        }
    }
}

/// Returns the ECMA-48 (SGR) colour codes of the label and of the value of a term.
fn codes(tone: Tone) -> [&'static str; 2] {
    match tone {
        Tone::Title => ["36", "1"],
        Tone::Plain => ["36", ""],
        Tone::Good => ["32", ""],
        Tone::Warning => ["33", ""],
        Tone::Bad => ["1;31", "31"],
    }
}

/// Splits a text into lines of at most `width` characters; longer words are broken.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    let mut used = 0;
    for word in text.split(' ') {
        let characters: Vec<char> = word.chars().collect();
        let chunks: Vec<&[char]> =
            if characters.is_empty() { vec![&[]] } else { characters.chunks(width).collect() };
        for chunk in chunks {
            let gap = usize::from(used > 0);
            if used + gap + chunk.len() > width {
                lines.push(String::new());
                used = 0;
            }
            let line = lines.last_mut().expect("never empty");
            if used > 0 {
                line.push(' ');
                used += 1;
            }
            line.extend(chunk);
            used += chunk.len();
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::super::inline::Inline;
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_cells() {
        let row = |cells: [&str; 3]| cells.map(Inline::from).to_vec();
        let rows = vec![row(["a", "1", ""]), row(["longer", "10", "remark"])];
        let table = Table::new("", ["Name", "Value", "Remark"], &[0], rows).in_text(|head| head != "Remark");
        let text = render(&[Block::Table(Table { below: Some(2), ..table })], Screen::default());
        assert_eq!(text, "Name    Value\na           1\nlonger     10\n    remark\n");
    }

    #[test]
    fn a_label_stands_once_before_the_terms_that_have_it() {
        let terms = [("a", "1"), ("a", "2"), ("b", "3")].map(|(label, value)| Term::text(label, value));
        let text = render(&[Block::Terms(terms.into())], Screen::default());
        assert_eq!(text, "a           1\n            2\nb           3\n");
    }

    #[test]
    fn words_wrap_and_long_words_break() {
        assert_eq!(wrapped("ab cd efghijklm", 5), ["ab cd", "efghi", "jklm"]);
        assert_eq!(wrapped("a   b", 80), ["a   b"], "columns of a table stay");
        assert_eq!(wrapped("", 5), [""]);
    }
}
