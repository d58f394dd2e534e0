//! Report on a run of another program: its errors relative to a reference motion.

use super::errors::{errors_in_words, tolerances_in_words};
use crate::document::{Block, Document, Format, State, Term};
use crate::notation::numbers::{counted, significant};
use crate::run_data::RunData;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::generator;
use flexbody_motion::scene::{OutputErrors, Tolerance};
use flexbody_study::measured_run::MeasuredRun;
use serde::Serialize;

/// Facts of a measured run.
#[derive(Debug, Clone, Serialize)]
pub struct MeasuredRunFacts<'a> {
    format: &'static str,
    format_major: u8,
    format_minor: u8,
    generator: String,
    scene: &'a str,
    body: &'a str,
    /// File of the run.
    history: String,
    modes: usize,
    reference_modes: usize,
    /// Number of instants that were compared.
    instants: usize,
    /// Errors relative to the reference; `None` for quantities that the run does not have.
    errors: OutputErrors,
    tolerance: Tolerance,
    /// Largest ratio of error to tolerance.
    worst: f64,
    growth: Option<f64>,
    holds: bool,
    diagnostics: &'a [Diagnostic],
}

impl<'a> MeasuredRunFacts<'a> {
    /// Collects the facts of the run in the file `history` of the body called `body`.
    pub fn new(measured: &'a MeasuredRun, body: &'a str, history: String, run: &'a RunData) -> Self {
        Self {
            format: "flexbody-measured-run",
            format_major: 1,
            format_minor: 0,
            generator: generator(),
            scene: &measured.scene,
            body,
            history,
            modes: measured.modes,
            reference_modes: measured.reference_modes,
            instants: measured.instants,
            errors: measured.errors,
            tolerance: measured.tolerance,
            worst: measured.worst,
            growth: measured.growth,
            holds: measured.holds(),
            diagnostics: &run.diagnostics,
        }
    }

    /// Renders the facts in a format, ending with a line break.
    pub fn render(&self, format: Format) -> String {
        Document::render(self, format, || self.document())
    }

    fn document(&self) -> Document<'_> {
        let verdict = if self.holds {
            "the run is within the tolerances"
        } else {
            "the run is not within the tolerances"
        };
        let worst = format!("the largest error is {} % of its tolerance", significant(100.0 * self.worst, 3));
        let growth = self.growth.map(|growth| {
            let words = format!("{} times more than the motion", significant(growth, 2));
            Term::new(
                "Growth",
                format!("from the first to the second half of the run the error grows {words}"),
            )
        });
        let reference = if self.reference_modes == self.modes {
            "the body itself, with the accuracy of the scene".to_owned()
        } else {
            format!("a body of {}", counted(self.reference_modes, "mode"))
        };
        let run = format!(
            "{}, {} with {}",
            self.history,
            counted(self.instants, "instant"),
            counted(self.modes, "mode")
        );
        let mut terms = vec![
            Term::text("Measured", format!("{}: {}, {verdict}", self.scene, self.body)),
            Term::new("Run", run),
            Term::new("Reference", reference),
            Term::new("Errors", format!("{}: {worst}", errors_in_words(&self.errors))),
            Term::new("Tolerances", tolerances_in_words(&self.tolerance.errors)),
        ];
        terms.extend(growth);
        let head = format!("{}{}.", verdict[..1].to_uppercase(), &verdict[1..]);
        let state = if self.holds { State::Good } else { State::Open };
        let blocks = vec![
            Block::Verdict { state, head, rest: String::new() },
            Block::Terms(terms),
            Block::Diagnostics(self.diagnostics),
        ];
        Document { name: self.scene, kind: "Measured run", generator: &self.generator, blocks }
    }
}
