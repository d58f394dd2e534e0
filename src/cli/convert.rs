//! Command `flexbody convert`.

use super::arguments::{ConvertArguments, Printing};
#[cfg(feature = "cluster")]
use super::cluster_folder::folder_around;
use super::conversion_request::{Scheme, lumping_schemes};
#[cfg(feature = "import")]
use super::convert_foreign::convert_foreign;
use super::convert_options::with_settings_of;
use super::mode_source::{BuiltIn, ModeSource};
use super::outcome::{
    BodyOutputs, Outcome, Reserved, format_of, refuse_replacing, refuse_replacing_read, refuse_warnings,
    size_of,
};
use super::resources::{context, peak_memory_bytes, resident_bytes, use_threads};
#[cfg(feature = "cluster")]
use super::slepc::Slepc;
use super::terminal::{Watcher, body_text};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::output::OutputSlot;
use flexbody_body::convert::Conversion;
use flexbody_eigen::PlannedAttempt;
use flexbody_input::{LoadSource, ModelFiles, read_model};
use flexbody_linalg::context::Event;
use flexbody_linalg::instruction_set;
use flexbody_model::{CheckedModel, FeModel};
use flexbody_motion::scene::LoadCases;
use flexbody_report::{Facts, Format, LumpedModes, Phase, RunData, SearchAttempt, SelectionFacts, render};
use flexbody_study::conversion::ConversionRequest;
use std::path::PathBuf;

pub(super) fn run(arguments: &ConvertArguments) -> Result<Outcome> {
    #[cfg(feature = "import")]
    if let Some(from) = arguments.foreign_format() {
        return convert_foreign(arguments, from);
    }
    let repeated = arguments.like.as_ref().map(|path| with_settings_of(arguments, path)).transpose()?;
    let arguments = repeated.as_ref().unwrap_or(arguments);
    #[cfg(feature = "cluster")]
    if let Some(slepc) = Slepc::of(arguments) {
        let mut conversion = ConversionRun::new(arguments)?;
        // Bodies that are solved elsewhere are large: their matrices may be kept beside the output.
        conversion.files.keep_in = Some(folder_around(&arguments.output));
        let outcome = conversion.run(&slepc)?;
        slepc.tidy();
        return Ok(outcome);
    }
    ConversionRun::new(arguments)?.run(&BuiltIn)
}

/// Conversion of the bodies of a model, with its files and outputs.
pub(super) struct ConversionRun {
    pub request: ConversionRequest,
    /// Lumped masses for comparison, before their files are read.
    pub schemes: Vec<Scheme>,
    pub files: ModelFiles,
    /// Load cases of the scene; `None` without a scene.
    pub cases: Option<LoadCases>,
    /// Files that are read besides those of the model, the lumped masses, loads, shapes and histories.
    pub also_read: Vec<PathBuf>,
    pub output: PathBuf,
    pub reports: Vec<PathBuf>,
    /// True if each of several bodies in the matrices is converted.
    pub split: bool,
    /// Largest memory in bytes; `None` for the free memory.
    pub memory_limit: Option<u64>,
    pub allow_long: bool,
    pub verbose: bool,
    pub printing: Printing,
}

/// Body with its files written, but not yet in their places.
struct Done {
    slots: Vec<OutputSlot>,
    outcome: Outcome,
}

impl ConversionRun {
    /// Returns the conversion that the command line requests, whose matrices stay in memory.
    ///
    /// # Errors
    /// FB801 for options that cannot be read; the errors of the manifest and of the scene.
    fn new(arguments: &ConvertArguments) -> Result<Self> {
        let read = |path| {
            let cases = LoadCases::read(path, arguments.case.as_deref())?;
            Ok::<_, Error>(cases.robust_if(arguments.robust))
        };
        Ok(Self {
            request: arguments.request()?,
            schemes: lumping_schemes(&arguments.lumped)?,
            files: arguments.model_files()?,
            cases: arguments.scene.as_deref().map(read).transpose()?,
            also_read: arguments.scene.iter().chain(&arguments.like).cloned().collect(),
            output: arguments.output.clone(),
            reports: arguments.report.clone(),
            split: arguments.split,
            memory_limit: arguments.memory_limit,
            allow_long: arguments.allow_long,
            verbose: arguments.verbose,
            printing: arguments.printing,
        })
    }

    /// Converts with modes that this program finds, or those of `mode_source`.
    ///
    /// # Errors
    /// The errors of [`ConversionRequest::convert`], of the model and of the outputs.
    pub(super) fn run(mut self, mode_source: &dyn ModeSource) -> Result<Outcome> {
        let formats = self.reports.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
        let loads = self.request.loads(&self.files.residual_vectors, self.cases.as_ref());
        mode_source.refuse(&self.request, &loads, self.cases.is_some(), self.split)?;
        self.request.check(&loads, self.cases.is_some())?;
        if self.split && loads.iter().any(|set| set.file().is_some()) {
            let message = "--split cannot be used with nodal loads, whose rows belong to all bodies together";
            return Err(Diagnostic::new(Code::Usage, message).into());
        }
        // Outputs are checked before reading, although the number of bodies is known only afterwards.
        let places = self.outputs(self.split.then_some(1));
        self.refuse_overwriting(std::slice::from_ref(&places), &loads)?;
        let reserved = places.reserve()?;

        let watcher = self.watcher("reading");
        self.request.lumped = self.schemes.iter().map(Scheme::read).collect::<Result<Vec<_>>>()?;
        let raw = read_model(&self.files)?;
        // Check before the work: files that a deck includes or assigns are known now.
        refuse_replacing_read(places.all())?;
        watcher.hear(Event::Phase("checks"));
        if !self.split {
            let done = self.convert(FeModel::from_raw(raw)?, mode_source, reserved, &formats, &watcher)?;
            OutputSlot::commit_all(done.slots)?;
            return Ok(done.outcome);
        }
        // Several bodies: reserve the outputs of all before the first conversion.
        let bodies = FeModel::bodies_from_raw(raw)?;
        let mut all = vec![places];
        all.extend((2..=bodies.len()).map(|number| self.outputs(Some(number))));
        self.refuse_overwriting(&all, &loads)?;
        refuse_replacing_read(all.iter().flat_map(BodyOutputs::all))?;
        let mut slots = vec![reserved];
        for places in &all[1..] {
            slots.push(places.reserve()?);
        }
        let mut finished = Vec::<Done>::new();
        for (checked, reserved) in bodies.into_iter().zip(slots) {
            let watcher = if finished.is_empty() { &watcher } else { &self.watcher("start") };
            finished.push(self.convert(checked, mode_source, reserved, &formats, watcher)?);
        }
        together(finished)
    }

    fn watcher(&self, first: &str) -> Watcher {
        Watcher::new(self.printing.quiet || self.printing.json, first)
    }

    /// Returns the outputs of the body; of one of several bodies, with its number in every name.
    fn outputs(&self, number: Option<usize>) -> BodyOutputs {
        BodyOutputs::of(&self.output, &self.reports, number)
    }

    /// Refuses outputs that would replace an input or another output.
    fn refuse_overwriting(&self, outputs: &[BodyOutputs], loads: &[LoadSource]) -> Result<()> {
        let model = self.files.paths();
        let masses = self.schemes.iter().filter_map(Scheme::file);
        let shapes = self.request.shapes.iter().map(|location| &location.path);
        let loads = loads.iter().filter_map(LoadSource::file).map(|location| &location.path);
        let scenes = self.cases.iter().flat_map(|cases| cases.iter());
        let series = scenes.flat_map(|scene| &scene.series).map(|file| &file.path);
        let inputs = model.iter().chain(masses).chain(shapes).chain(loads).chain(&self.also_read);
        refuse_replacing(inputs.chain(series), outputs.iter().flat_map(BodyOutputs::all))
    }

    fn convert(
        &self,
        checked: CheckedModel,
        mode_source: &dyn ModeSource,
        reserved: Reserved,
        formats: &[Format],
        watcher: &Watcher,
    ) -> Result<Done> {
        let CheckedModel { model, diagnostics: early, .. } = checked;
        let done = refuse_warnings(self.printing, &early)
            .and_then(|()| self.convert_model(&model, &early, mode_source, reserved, formats, watcher));
        done.map_err(|error| {
            watcher.clear();
            let error = match model.number() {
                Some(number) => error.about(number),
                None => error,
            };
            if error.has(Code::WarningsDenied) { error } else { error.after(early) }
        })
    }

    fn convert_model(
        &self,
        model: &FeModel,
        early: &[Diagnostic],
        mode_source: &dyn ModeSource,
        reserved: Reserved,
        formats: &[Format],
        watcher: &Watcher,
    ) -> Result<Done> {
        let watch = |event: Event<'_>| watcher.hear(event);
        let context = context(self.memory_limit, self.allow_long, &watch);
        let solved = mode_source.modes(model, &self.request.mode_settings(model.units()), &context)?;
        let (resident, peak) = (resident_bytes(), peak_memory_bytes());
        let of_manifest = &self.files.residual_vectors;
        let made = self.request.convert(model, of_manifest, self.cases.as_ref(), solved, &context)?;
        let found = made.diagnostics().into_iter().map(|diagnostic| match model.number() {
            Some(number) => diagnostic.about(number),
            None => diagnostic,
        });
        let diagnostics: Vec<Diagnostic> = early.iter().cloned().chain(found).collect();
        let conversion = &made.conversion;
        // Write the body, then the reports, into their temporary files.
        watcher.hear(Event::Phase("writing"));
        flexbody_file::fill_slot(&conversion.body, &reserved.body)?;
        let output = (reserved.body.path().display().to_string(), size_of(&reserved.body));
        let phases = watcher.finish();
        refuse_warnings(self.printing, &diagnostics)?;
        let mut run = run_data(output, conversion, diagnostics.clone(), phases);
        run.offered_stiffness = made.offered_stiffness.names();
        // Reading may have taken more memory than the work will.
        run.memory_estimate_bytes =
            conversion.plan.as_ref().map(|plan| peak.unwrap_or(0).max(resident + plan.bytes()));
        let facts = Facts::new(&conversion.body, &run);
        for (slot, format) in reserved.reports.iter().zip(formats) {
            slot.fill(render(&facts, *format).as_bytes())?;
        }
        // The diagnostics are part of the body's report.
        let nothing = RunData::default();
        let decided = made.selection.as_ref().map(|selection| SelectionFacts::new(selection, &nothing));
        let decided = decided.map_or_else(String::new, |decided| {
            format!("\n{}", if self.verbose { decided.render(Format::Terminal) } else { decided.summary() })
        });
        let text = body_text(&facts, self.verbose, self.printing) + &decided;
        let outcome = Outcome { text, json: render(&facts, Format::Json), diagnostics, passed: true };
        let slots = std::iter::once(reserved.body).chain(reserved.reports).collect();
        Ok(Done { slots, outcome })
    }
}

/// Puts the files of several bodies in their places and joins their outcomes.
fn together(finished: Vec<Done>) -> Result<Outcome> {
    // Diagnostics of the common matrices are reported once.
    let mut diagnostics = Vec::<Diagnostic>::new();
    for done in &finished {
        let new = done.outcome.diagnostics.iter().filter(|own| !diagnostics.contains(*own)).cloned();
        let new: Vec<Diagnostic> = new.collect();
        diagnostics.extend(new);
    }
    // No file appears before everything is done.
    let (slots, outcomes): (Vec<_>, Vec<_>) =
        finished.into_iter().map(|done| (done.slots, done.outcome)).unzip();
    OutputSlot::commit_all(slots.into_iter().flatten())?;
    let texts: Vec<String> = outcomes.iter().map(|outcome| outcome.text.clone()).collect();
    let reports: Vec<&str> = outcomes.iter().map(|outcome| outcome.json.trim_end()).collect();
    let json = format!("{{\n\"bodies\": [\n{}\n]\n}}", reports.join(",\n"));
    Ok(Outcome { text: texts.join("\n"), json, diagnostics, passed: true })
}

fn search_attempt(attempt: &PlannedAttempt) -> SearchAttempt {
    SearchAttempt {
        way: attempt.way.name().to_owned(),
        bytes: attempt.needs.bytes,
        failure: attempt.failure.clone(),
    }
}

fn run_data(
    output: (String, u64),
    conversion: &Conversion,
    diagnostics: Vec<Diagnostic>,
    phases: Vec<Phase>,
) -> RunData {
    let work = &conversion.work;
    let counters = [
        ("factorizations", work.factorizations),
        ("solved_columns", work.solved_columns),
        ("stiffness_columns", work.stiffness_columns),
        ("mass_columns", work.mass_columns),
        ("condensed_columns", conversion.condensed_columns),
        ("restarts", work.restarts),
        ("factor_len", work.factor_len),
        ("factor_flops", work.factor_flops),
        ("factor_bytes", work.factor_bytes),
    ];
    let lumped_modes = conversion
        .lumped_modes
        .iter()
        .map(|pipeline| LumpedModes {
            scheme: pipeline.scheme.clone(),
            frequencies_hz: pipeline
                .eigenvalues
                .iter()
                .map(|&lambda| conversion.body.units().frequency_of(lambda))
                .collect(),
            subspace_cosine: pipeline.subspace_cosine,
            comparison: pipeline.comparison.clone(),
            remark: pipeline.remark.clone(),
            caution: pipeline.caution.clone(),
        })
        .collect();
    RunData {
        phases,
        peak_memory_bytes: peak_memory_bytes(),
        memory_estimate_bytes: None,
        threads: use_threads(None),
        instructions: instruction_set().to_owned(),
        diagnostics,
        attempts: conversion.plan.iter().flat_map(|plan| plan.attempts.iter().map(search_attempt)).collect(),
        counters: counters.iter().map(|&(name, count)| (name.to_owned(), count)).collect(),
        accuracy: conversion.body.source().settings["accuracy"].as_str().unwrap_or_default().to_owned(),
        offered_stiffness: Vec::new(),
        output: Some(output),
        lumped_modes,
    }
}
