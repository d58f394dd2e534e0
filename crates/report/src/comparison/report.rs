//! Report on the comparison of two bodies, for people, programs and automated checks.

use super::body_comparison::{BodyComparison, ComparisonRow};
use super::mode_pair::{ModePair, signed_percent};
use crate::document::text::{self, Screen};
use crate::document::{Block, Document, Inline, Span, State, Table, Term, cells, heading, html, json};
use crate::notation::markup::{Plain, plain};
use crate::notation::numbers::significant;
use flexbody_base::provenance::generator;
use maud::{PreEscaped, html};
use std::path::Path;

/// Formats of the report of a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ComparisonFormat {
    /// Text for a terminal.
    Text,
    /// JSON for programs, identical to the results of `--json`.
    Json,
    /// One HTML file for people and archives, without scripts or external resources.
    Html,
    /// JUnit XML with a test case for each quantity.
    JUnit,
    /// Markdown table for comments and summaries.
    Markdown,
}

impl ComparisonFormat {
    /// Returns the format for a file name that ends in `.txt`, `.json`, `.html`, `.xml` or `.md`, in any
    /// case.
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

/// A comparison with the names of the two files.
#[derive(Debug, Clone, Copy)]
pub struct ComparisonReport<'a> {
    /// Result of the comparison.
    pub comparison: &'a BodyComparison,
    /// File of the reference.
    pub a: &'a str,
    /// File of the body that is compared with the reference.
    pub b: &'a str,
}

impl BodyComparison {
    /// Returns the comparison as a table for a terminal.
    pub fn text(&self) -> String {
        ComparisonReport { comparison: self, a: &self.a, b: &self.b }.render(ComparisonFormat::Text)
    }
}

impl ComparisonReport<'_> {
    /// Renders the report in a format, ending with a line break.
    pub fn render(&self, format: ComparisonFormat) -> String {
        match format {
            ComparisonFormat::Text => text::render(&self.blocks(), Screen::default()),
            ComparisonFormat::Json => json(self.comparison),
            ComparisonFormat::Html => html::render(&Document {
                name: &self.title(),
                kind: "Comparison of two bodies",
                generator: &generator(),
                blocks: self.blocks(),
            }),
            ComparisonFormat::JUnit => self.junit(),
            ComparisonFormat::Markdown => self.markdown(),
        }
    }

    fn title(&self) -> String {
        format!("{} compared with {}", plain(self.b), plain(self.a))
    }

    /// Returns the result of the comparison as a sentence.
    fn verdict(&self) -> String {
        match self.failures() {
            0 => "The bodies agree.".to_owned(),
            count => format!("The bodies differ in {count} of {} quantities.", self.comparison.rows().len()),
        }
    }

    fn failures(&self) -> usize {
        self.comparison.rows().iter().filter(|row| !row.passed).count()
    }

    fn blocks<'b>(&self) -> Vec<Block<'b>> {
        let state = if self.comparison.passed() { State::Good } else { State::Open };
        let row = |row: &ComparisonRow| {
            let [difference, tolerance] = numbers(row);
            let outcome =
                if row.passed { Span::Plain("agrees".to_owned()) } else { Span::Error("DIFFERS".to_owned()) };
            let mut cells = cells([row.quantity.to_owned(), difference, tolerance]);
            cells.extend([outcome.into(), row.meaning.into()]);
            cells
        };
        let rows = self.comparison.rows().iter().map(row).collect();
        let heads = ["Quantity", "Difference", "Tolerance", "", "Relative to"];
        let table = Table::new("Largest differences, without units", heads, &[0, 3, 4], rows);
        let compared = vec![Term::page("reference", self.a), Term::page("compared body", self.b)];
        let mut blocks = vec![
            Block::Verdict { state, head: self.verdict(), rest: String::new() },
            Block::Terms(compared),
            heading("Differences"),
            Block::Table(table.in_text(|head| head != "Relative to")),
            heading("Frequencies"),
            self.frequencies(),
            heading("Notes"),
        ];
        blocks.extend(self.many_frequencies());
        blocks.extend(self.comparison.remarks().into_iter().map(Block::Paragraph));
        blocks.extend(self.comparison.notes().iter().map(|note| Block::Line(format!("note: {note}"))));
        let left_out = self.comparison.not_compared().iter();
        blocks.extend(left_out.map(|entry| Block::Line(format!("not compared: {entry}"))));
        blocks.push(Block::Line(match self.failures() {
            0 => "the bodies agree".to_owned(),
            1 => "the bodies DIFFER in 1 quantity".to_owned(),
            count => format!("the bodies DIFFER in {count} quantities"),
        }));
        blocks
    }

    /// Returns the table of the frequencies, mode by mode.
    fn frequencies<'b>(&self) -> Block<'b> {
        let has_shapes = self.comparison.modes().iter().any(|pair| pair.assurance.is_some());
        let mut heads = vec!["Mode", "Mode of second", "First (Hz)", "Second (Hz)", "Difference"];
        heads.extend(has_shapes.then_some("MAC"));
        let rows = self
            .comparison
            .modes()
            .iter()
            .map(|pair| frequency_cells(pair).into_iter().map(Inline::from).collect())
            .collect();
        let caption = format!("Frequencies of the modes, {}", self.comparison.paired().in_words());
        let is_short = self.comparison.modes().len() <= MAX_MODES_IN_TEXT;
        Block::Table(Table::new(caption, heads, &[], rows).in_text(|_| is_short))
    }

    /// Returns the line about frequencies whose table is too long for a text.
    fn many_frequencies<'b>(&self) -> Option<Block<'b>> {
        let modes = self.comparison.modes();
        let worst = self.comparison.worst_mode().filter(|_| modes.len() > MAX_MODES_IN_TEXT)?;
        Some(Block::Line(format!(
            "frequencies of {} modes, {}: the largest difference is {} (mode {}); --report FILE.html has all of them",
            modes.len(),
            self.comparison.paired().in_words(),
            signed_percent(worst.difference),
            worst.mode_a,
        )))
    }

    fn junit(&self) -> String {
        let (rows, title) = (self.comparison.rows(), self.title());
        let (tests, failures) = (rows.len(), self.failures());
        let failure = |row: &ComparisonRow| {
            let [difference, tolerance] = numbers(row);
            let of_mode = || self.comparison.worst_mode().map(|worst| format!(", {}", worst.in_words()));
            let named = (row.quantity == "frequency").then(of_mode).flatten().unwrap_or_default();
            let message = format!("difference {difference}, tolerance {tolerance}{named}");
            html! { failure message=(message) { (Plain(row.meaning)) } }
        };
        let suites = html! {
            (PreEscaped("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"))
            testsuites name="flexbody compare" tests=(tests) failures=(failures) errors="0" {
                "\n"
                testsuite name=(Plain(&title)) tests=(tests) failures=(failures) errors="0" {
                    @for row in rows {
                        "\n"
                        testcase classname=(Plain(&title)) name=(row.quantity) {
                            @if !row.passed { (failure(row)) }
                        }
                    }
                    "\n"
                    system-out { @for note in self.comparison.remarks() { (Plain(&note)) "\n" } }
                    "\n"
                }
                "\n"
            }
        };
        suites.into_string() + "\n"
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
        text.push_str(&format!("\nFrequencies, modes {}:\n\n", self.comparison.paired().in_words()));
        text.push_str(
            "| mode | mode of second | first (Hz) | second (Hz) | difference | MAC |\n|---|---|---|---|---|---|\n",
        );
        for pair in self.comparison.modes() {
            let mut cells = frequency_cells(pair);
            cells.resize(6, String::new());
            text.push_str(&format!("| {} |\n", cells.join(" | ")));
        }
        for note in self.comparison.remarks() {
            text.push_str(&format!("\n* {}\n", cell(&note)));
        }
        text
    }
}

/// Largest number of modes whose frequencies a text lists.
const MAX_MODES_IN_TEXT: usize = 25;

/// Returns the cells of a pair of modes: numbers, frequencies, difference and, if it is known, assurance.
fn frequency_cells(pair: &ModePair) -> Vec<String> {
    let mut cells = vec![
        pair.mode_a.to_string(),
        pair.mode_b.to_string(),
        significant(pair.frequency_a_hz, 7),
        significant(pair.frequency_b_hz, 7),
        if pair.is_of_strangers() { "no partner".to_owned() } else { signed_percent(pair.difference) },
    ];
    cells.extend(pair.assurance.map(|assurance| format!("{assurance:.4}")));
    cells
}

fn numbers(row: &ComparisonRow) -> [String; 2] {
    [row.difference, row.tolerance].map(|value| significant(value, 3))
}

fn outcome(row: &ComparisonRow) -> &'static str {
    if row.passed { "agrees" } else { "differs" }
}
