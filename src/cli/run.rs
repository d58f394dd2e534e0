//! Run of a command: refusal of outputs that would replace an input, progress, diagnostics, reports, and the outcome after
//! all files are in their places.

use super::arguments::{JobArguments, Printing};
use super::models::read_checked;
use super::outcome::{Outcome, format_of, refuse_replacing, refuse_replacing_read, refuse_warnings};
use super::resources::{context, use_threads};
use super::terminal::Watcher;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_body::flex_body::FlexBody;
use flexbody_input::ModelFiles;
use flexbody_linalg::context::{Context, Event};
use flexbody_model::FeModel;
use flexbody_motion::scene::LoadCases;
use flexbody_report::{Format, RunData};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Listener of the work of a command.
type Listener = Box<dyn Fn(Event<'_>) + Sync>;

/// Run of a command with at most one set of output files.
pub(super) struct Run {
    printing: Printing,
    /// All output files.
    outputs: Vec<PathBuf>,
    /// Reserved reports with their formats.
    reports: Vec<(OutputSlot, Format)>,
    /// Progress with its listener; `None` for a command that is done at once.
    progress: Option<(Arc<Watcher>, Listener)>,
    diagnostics: Vec<Diagnostic>,
}

impl Run {
    /// Begins a run: refuses outputs that would replace an input or another output, and reserves the `reports`. The command
    /// reserves its `other` outputs itself.
    ///
    /// # Errors
    /// FB801 for reports of unknown formats; FB107 for an output that would replace a file; FB104, FB105 and FB602 for
    /// outputs that cannot be written.
    pub(super) fn begin<'p>(
        printing: Printing,
        inputs: impl IntoIterator<Item = &'p PathBuf>,
        other: impl IntoIterator<Item = &'p PathBuf>,
        reports: &'p [PathBuf],
    ) -> Result<Self> {
        let formats = reports.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
        let outputs: Vec<PathBuf> = other.into_iter().chain(reports).cloned().collect();
        refuse_replacing(inputs.into_iter(), outputs.iter())?;
        let slots = reports.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
        let reports = slots.into_iter().zip(formats).collect();
        Ok(Self { printing, outputs, reports, progress: None, diagnostics: Vec::new() })
    }

    /// Shows the progress from here on, beginning with the phase of reading.
    pub(super) fn with_progress(mut self) -> Self {
        let watcher = Arc::new(Watcher::new(self.printing.quiet || self.printing.json, "reading"));
        let heard = Arc::clone(&watcher);
        self.progress = Some((watcher, Box::new(move |event| heard.hear(event))));
        self
    }

    /// Returns the context of work, with limits of time and of the memory that is free now.
    pub(super) fn context(&self, allow_long: bool) -> Context<'_> {
        let watch = self.progress.as_ref().map_or(Context::QUIET.watch, |(_, listener)| listener.as_ref());
        context(None, allow_long, watch)
    }

    /// Adds diagnostics, which the outcome and the reports contain.
    pub(super) fn note(&mut self, diagnostics: impl IntoIterator<Item = Diagnostic>) {
        self.diagnostics.extend(diagnostics);
    }

    /// Reads a scene file: all load cases, or the one of that name. Refuses outputs that would replace one of its
    /// histories.
    ///
    /// # Errors
    /// The errors of [`LoadCases::read`]; FB107.
    pub(super) fn read_cases(&self, path: &Path, case: Option<&str>) -> Result<LoadCases> {
        let cases = LoadCases::read(path, case)?;
        let series = cases.iter().flat_map(|scene| &scene.series).map(|file| &file.path);
        refuse_replacing(series, self.outputs.iter())?;
        self.refuse_read()?;
        Ok(cases)
    }

    /// Refuses outputs that would replace a file that was read.
    ///
    /// # Errors
    /// FB107.
    pub(super) fn refuse_read(&self) -> Result<()> {
        refuse_replacing_read(self.outputs.iter())
    }

    /// Reads a flex-body file, with its notes among the diagnostics.
    ///
    /// # Errors
    /// The errors of the flex-body file.
    pub(super) fn read_body(&mut self, path: &Path) -> Result<FlexBody> {
        let (body, notes) = flexbody_file::read_with_notes(path)?;
        self.note(notes);
        Ok(body)
    }

    /// Reads and checks a model, with its diagnostics among those of the run. Refuses outputs that would replace one of its
    /// files.
    ///
    /// # Errors
    /// The errors of the model; FB107.
    pub(super) fn read_model(&mut self, path: &Path, job: &JobArguments) -> Result<(ModelFiles, FeModel)> {
        let (files, checked) = read_checked(path, job, self.outputs.iter())?;
        self.note(checked.diagnostics);
        Ok((files, checked.model))
    }

    /// Ends the work and returns its data for the reports.
    ///
    /// # Errors
    /// All diagnostics, if warnings are denied and there is one.
    pub(super) fn data(&mut self) -> Result<RunData> {
        let mut data = RunData { diagnostics: self.diagnostics.clone(), ..RunData::default() };
        if let Some((watcher, _)) = &self.progress {
            data.phases = watcher.finish();
            data.threads = use_threads(None);
        }
        refuse_warnings(self.printing, &data.diagnostics)?;
        Ok(data)
    }

    /// Writes the reports, puts them and the `other` files in their places, and returns the outcome.
    ///
    /// * `render`: returns the report in a format; called for each report, for the terminal and for JSON.
    /// * `passed`: true if the checks of the command passed.
    ///
    /// # Errors
    /// FB104 and FB602 if a file cannot be written; no file appears then.
    pub(super) fn end(
        self,
        other: impl IntoIterator<Item = OutputSlot>,
        render: impl Fn(Format) -> String,
        passed: bool,
    ) -> Result<Outcome> {
        let printed = Printed { text: render(Format::Terminal), json: render(Format::Json) };
        self.end_with(other, render, printed, passed)
    }

    /// Does the work of [`Run::end`] for a command that prints other texts than those of its reports.
    ///
    /// # Errors
    /// The errors of [`Run::end`].
    pub(super) fn end_with(
        self,
        other: impl IntoIterator<Item = OutputSlot>,
        report: impl Fn(Format) -> String,
        printed: Printed,
        passed: bool,
    ) -> Result<Outcome> {
        for (slot, format) in &self.reports {
            slot.fill(report(*format).as_bytes())?;
        }
        let reports = self.reports.into_iter().map(|(slot, _)| slot);
        // No file appears before everything is done.
        OutputSlot::commit_all(other.into_iter().chain(reports))?;
        let Printed { text, json } = printed;
        Ok(Outcome { text, json, diagnostics: self.diagnostics, passed })
    }
}

/// Texts that a command prints: for people, and with `--json`.
pub(super) struct Printed {
    pub text: String,
    pub json: String,
}
