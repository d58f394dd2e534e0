//! The comparison of two bodies as a report: for people, for programs, and for what runs checks unattended.

use super::comparison::{BodyComparison, ComparisonRow};
use super::markup::{escape, page, section, table, terms, texts};
use super::numbers::{plain, significant};
use super::render;
use flexbody_base::provenance::generator;
use std::path::Path;

/// Formats of the report of a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ComparisonFormat {
    /// For a terminal.
    Text,
    /// For programs: what `--json` has as its results.
    Json,
    /// For people and archives: one file, no scripts, nothing loaded from elsewhere.
    Html,
    /// Test cases as JUnit has them in XML, a test case for each quantity.
    JUnit,
    /// A table in Markdown, for comments and summaries.
    Markdown,
}

impl ComparisonFormat {
    /// The format that a file name asks for: `.txt`, `.json`, `.html`, `.xml` or `.md`, in any case.
    pub fn from_path(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "txt" => Some(Self::Text),
            "json" => Some(Self::Json),
            "html" => Some(Self::Html),
            "xml" => Some(Self::JUnit),
            "md" => Some(Self::Markdown),
            _ => None,
        }
    }
}

/// The comparison of files, which have these names.
#[derive(Debug, Clone, Copy)]
pub struct ComparisonReport<'a> {
    /// What was found.
    pub comparison: &'a BodyComparison,
    /// File of the reference.
    pub a: &'a str,
    /// File of what is compared with it.
    pub b: &'a str,
}

impl ComparisonReport<'_> {
    /// Writes the report, ending with a line break.
    pub fn render(&self, format: ComparisonFormat) -> String {
        match format {
            ComparisonFormat::Text => self.comparison.text(),
            ComparisonFormat::Json => render::json(self.comparison),
            ComparisonFormat::Html => self.html(),
            ComparisonFormat::JUnit => self.junit(),
            ComparisonFormat::Markdown => self.markdown(),
        }
    }

    fn title(&self) -> String {
        format!("{} beside {}", plain(self.b), plain(self.a))
    }

    /// What it comes to, in a sentence.
    fn verdict(&self) -> String {
        match self.failures() {
            0 => "The bodies agree.".to_owned(),
            count => format!("The bodies differ in {count} of {} quantities.", self.comparison.rows().len()),
        }
    }

    fn failures(&self) -> usize {
        self.comparison.rows().iter().filter(|row| !row.passed).count()
    }

    fn html(&self) -> String {
        let mut content = String::new();
        section(&mut content, "Verdict");
        let class = if self.comparison.passed() { "quiet" } else { "error" };
        content.push_str(&format!("<p class=\"{class}\">{}</p>\n", escape(&self.verdict())));
        terms(&mut content, [("reference", escape(self.a)), ("compared with it", escape(self.b))]);
        section(&mut content, "Differences");
        let cells = |row: &ComparisonRow| {
            let [difference, tolerance] = numbers(row);
            vec![row.quantity.to_owned(), difference, tolerance, outcome(row).to_owned(), escape(row.meaning)]
        };
        let rows: Vec<_> = self.comparison.rows().iter().map(cells).collect();
        let head = texts(["Quantity", "Difference", "Tolerance", "", "Relative to"]);
        table(&mut content, "Largest differences, without units", &head, &[0, 3, 4], &rows);
        section(&mut content, "Notes");
        for note in self.comparison.remarks() {
            content.push_str(&format!("<p>{}</p>\n", escape(&note)));
        }
        page(&self.title(), "Comparison of two bodies", &generator(), &content)
    }

    fn junit(&self) -> String {
        let (rows, title) = (self.comparison.rows(), escape(&self.title()));
        let counts = format!("tests=\"{}\" failures=\"{}\" errors=\"0\"", rows.len(), self.failures());
        let mut xml = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"flexbody compare\" {counts}>\n<testsuite name=\"{title}\" {counts}>\n"
        );
        for row in rows {
            let name = escape(row.quantity);
            xml.push_str(&format!("<testcase classname=\"{title}\" name=\"{name}\""));
            if row.passed {
                xml.push_str("/>\n");
                continue;
            }
            let [difference, tolerance] = numbers(row);
            let message = escape(&format!("difference {difference}, tolerance {tolerance}"));
            let meaning = escape(row.meaning);
            xml.push_str(&format!("><failure message=\"{message}\">{meaning}</failure></testcase>\n"));
        }
        let notes: Vec<String> = self.comparison.remarks().iter().map(|note| escape(note)).collect();
        xml.push_str(&format!("<system-out>{}</system-out>\n", notes.join("\n")));
        xml + "</testsuite>\n</testsuites>\n"
    }

    fn markdown(&self) -> String {
        let cell = |text: &str| plain(text).replace('|', "\\|");
        let mut text = format!("### {}\n\n{}\n\n", cell(&self.title()), self.verdict());
        text.push_str("| quantity | difference | tolerance | | relative to |\n|---|---|---|---|---|\n");
        for row in self.comparison.rows() {
            let [difference, tolerance] = numbers(row);
            let (outcome, meaning) = (outcome(row), cell(row.meaning));
            text.push_str(&format!(
                "| {} | {difference} | {tolerance} | {outcome} | {meaning} |\n",
                row.quantity
            ));
        }
        for note in self.comparison.remarks() {
            text.push_str(&format!("\n* {}\n", cell(&note)));
        }
        text
    }
}

fn numbers(row: &ComparisonRow) -> [String; 2] {
    [row.difference, row.tolerance].map(|value| significant(value, 3))
}

fn outcome(row: &ComparisonRow) -> &'static str {
    if row.passed { "agrees" } else { "differs" }
}
