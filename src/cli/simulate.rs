//! Command `flexbody simulate`.

use super::arguments::{Printing, SimulateArguments};
use super::outcome::{Outcome, format_of, marked, refuse_replacing, refuse_replacing_read, refuse_warnings};
use super::recover::RowsFile;
use super::resources::{context, use_threads};
use super::terminal::Watcher;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Event;
use flexbody_motion::scene::{self as motion, Envelope, LoadCases, Recording, Scene, SimulationRequest};
use flexbody_report::{EnvelopeFacts, EnvelopeKind, Format, RunData, SimulationFacts, simulation_csv};
use std::path::{Path, PathBuf};

pub(super) fn run(arguments: &SimulateArguments) -> Result<Outcome> {
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let rows = arguments.rows.as_deref().map(RowsFile::of).transpose()?;
    let envelope = arguments.envelope.as_deref().map(EnvelopeKind::of).transpose()?;
    let request = SimulationRequest { needs_rows: rows.is_some(), needs_envelope: envelope.is_some() };
    let places = SimulationOutputs::of(arguments, None);
    let of_all_cases = || arguments.envelope.iter();
    refuse_replacing([&arguments.body, &arguments.scene].into_iter(), places.all().chain(of_all_cases()))?;
    // Outputs are checked before reading, although the load cases are known only afterwards.
    let reserved = places.reserve()?;
    let envelope_slot = arguments.envelope.as_ref().map(OutputSlot::prepare).transpose()?;
    let threads = use_threads(arguments.threads);

    let watcher = Watcher::new(arguments.printing.quiet || arguments.printing.json, "reading");
    let cases = LoadCases::read(&arguments.scene, arguments.case.as_deref())?;
    let of_case = |scene: &Scene| SimulationOutputs::of(arguments, scene.case_name());
    let all: Vec<SimulationOutputs> =
        if cases.len() == 1 { vec![places] } else { cases.iter().map(of_case).collect() };
    let series = cases.iter().flat_map(|scene| &scene.series).map(|file| &file.path);
    let inputs = [&arguments.body, &arguments.scene].into_iter().chain(series);
    let outputs = || all.iter().flat_map(SimulationOutputs::all).chain(of_all_cases());
    refuse_replacing(inputs, outputs())?;
    refuse_replacing_read(outputs())?;
    let slots = match &all[..] {
        [_] => vec![reserved],
        all => all.iter().map(SimulationOutputs::reserve).collect::<Result<Vec<_>>>()?,
    };
    let (body, notes) = flexbody_file::read_with_notes(&arguments.body)?;
    request.check(&body).map_err(|error| error.in_file(&arguments.body))?;
    let printing = arguments.printing;
    let path = &arguments.scene;
    let job = Job { path, printing, body: &body, request, formats: &formats, rows, threads };
    let several = cases.len() > 1;
    // Reports of load cases that draw the largest stresses of all are written after the last of them.
    let waits = several && envelope.is_some() && formats.contains(&Format::Html);
    let (mut done, mut waiting) = (Vec::new(), Vec::new());
    let mut of_all: Option<Envelope> = None;
    for (scene, slots) in cases.iter().zip(&slots) {
        let simulated = job.simulate(scene, several, &notes, &watcher)?;
        match (&mut of_all, simulated.envelope.clone()) {
            (Some(known), Some(own)) => known.join(own),
            (of_all, own) => *of_all = own,
        }
        if waits { waiting.push((simulated, slots)) } else { done.push(job.write(&simulated, slots, None)?) }
    }
    for (simulated, slots) in waiting {
        done.push(job.write(&simulated, slots, of_all.as_ref())?);
    }
    if let (Some(slot), Some(kind), Some(of_all)) = (&envelope_slot, envelope, &of_all) {
        slot.fill(&kind.bytes(&body, of_all)?)?;
    }
    // No file appears before everything is done.
    OutputSlot::commit_all(slots.into_iter().flat_map(Slots::into_all).chain(envelope_slot))?;
    let of_all = of_all.as_ref().filter(|_| several).map(|of_all| EnvelopeFacts::new(of_all, body.units()));
    Ok(together(done, of_all.as_ref()))
}

/// Joins the outcomes of all load cases, with their largest stresses; a single one is returned unchanged.
fn together(mut done: Vec<Outcome>, envelope: Option<&EnvelopeFacts<'_>>) -> Outcome {
    if done.len() == 1 {
        return done.remove(0);
    }
    let of_all = envelope.map(EnvelopeFacts::text).filter(|text| !text.is_empty());
    let texts: Vec<&str> = done.iter().map(|one| one.text.as_str()).chain(of_all.as_deref()).collect();
    let reports: Vec<&str> = done.iter().map(|one| one.json.trim_end()).collect();
    let mut diagnostics: Vec<Diagnostic> = Vec::new();
    for said in done.iter().flat_map(|outcome| &outcome.diagnostics) {
        if !diagnostics.contains(said) {
            diagnostics.push(said.clone());
        }
    }
    let of_all =
        envelope.map_or_else(String::new, |facts| format!(",\n\"envelope\": {}", facts.json().trim_end()));
    let json = format!("{{\n\"cases\": [\n{}\n]{of_all}\n}}", reports.join(",\n"));
    Outcome { text: texts.join("\n"), json, diagnostics, passed: true }
}

/// Common data of all load cases of a run.
struct Job<'a> {
    path: &'a Path,
    printing: Printing,
    body: &'a FlexBody,
    request: SimulationRequest,
    formats: &'a [Format],
    rows: Option<RowsFile>,
    threads: usize,
}

/// Motion of one load case.
struct Simulated {
    recording: Recording,
    run: RunData,
    /// Largest stresses of every point, if they were asked for.
    envelope: Option<Envelope>,
}

impl Job<'_> {
    /// Simulates a scene. `notes` are the diagnostics of the body.
    fn simulate(
        &self,
        scene: &Scene,
        several: bool,
        notes: &[Diagnostic],
        watcher: &Watcher,
    ) -> Result<Simulated> {
        let name = scene.case_name().filter(|_| several).map(|name| format!("case `{name}`"));
        let watch = |event: Event<'_>| watcher.hear(event);
        // The motion and its diagnostics, which name the load case if there are several.
        let run = self.request.run(self.body, scene, &context(None, true, &watch));
        let motion::Simulated { recording, diagnostics: found } = run.map_err(|error| {
            let error = error.in_file(self.path);
            match &name {
                Some(name) => error.about(name),
                None => error,
            }
        })?;
        let found = found.into_iter().map(|said| match &name {
            Some(name) => said.about(name),
            None => said,
        });
        let diagnostics = notes.iter().cloned().chain(found).collect();
        let run =
            RunData { phases: watcher.finish(), diagnostics, threads: self.threads, ..RunData::default() };
        refuse_warnings(self.printing, &run.diagnostics)?;
        let case = scene.case_name().filter(|_| several);
        let envelope = recording.recovered.as_ref().and_then(|rows| Envelope::of(rows, case));
        Ok(Simulated { recording, run, envelope })
    }

    /// Writes a motion and its reports to their temporary files, which the caller puts in place after all load cases.
    /// `of_all` are the largest stresses of all load cases if there are several.
    fn write(&self, done: &Simulated, slots: &Slots, of_all: Option<&Envelope>) -> Result<Outcome> {
        let Simulated { recording, run, envelope } = done;
        let mut facts = SimulationFacts::new(recording, self.body.units(), run);
        let mut drawn = Vec::new();
        match (envelope, of_all) {
            (Some(own), Some(all)) => {
                drawn.push(("this load case".to_owned(), own));
                drawn.push((format!("all {} load cases", all.cases.len()), all));
            }
            (Some(own), None) => drawn.push(("the run".to_owned(), own)),
            (None, _) => {}
        }
        if !drawn.is_empty() && self.formats.contains(&Format::Html) {
            facts = facts.with_picture(self.body, &drawn);
        }
        if let Some(slot) = &slots.motion {
            flexbody_file::fill_simulation(recording, self.body.units(), slot)?;
        }
        if let Some(slot) = &slots.table {
            slot.fill(simulation_csv(recording).as_bytes())?;
        }
        if let (Some(slot), Some(kind), Some(recovered)) = (&slots.rows, self.rows, &recording.recovered) {
            kind.fill(self.body, recovered, ("scene", &recording.scene), slot)?;
        }
        for (slot, format) in slots.reports.iter().zip(self.formats) {
            slot.fill(facts.render(*format).as_bytes())?;
        }
        let (text, json) = (facts.render(Format::Terminal), facts.render(Format::Json));
        Ok(Outcome { text, json, diagnostics: run.diagnostics.clone(), passed: true })
    }
}

/// Output files of one simulation.
struct SimulationOutputs {
    motion: Option<PathBuf>,
    table: Option<PathBuf>,
    rows: Option<PathBuf>,
    reports: Vec<PathBuf>,
}

/// Reserved output files of one simulation.
struct Slots {
    motion: Option<OutputSlot>,
    table: Option<OutputSlot>,
    rows: Option<OutputSlot>,
    reports: Vec<OutputSlot>,
}

impl SimulationOutputs {
    /// Returns the outputs that the command line names; for one of several load cases, with its name in every file
    /// name.
    fn of(arguments: &SimulateArguments, case: Option<&str>) -> Self {
        let place = |path: &PathBuf| case.map_or_else(|| path.clone(), |case| marked(path, case));
        Self {
            motion: arguments.output.as_ref().map(place),
            table: arguments.csv.as_ref().map(place),
            rows: arguments.rows.as_ref().map(place),
            reports: arguments.report.iter().map(place).collect(),
        }
    }

    fn all(&self) -> impl Iterator<Item = &PathBuf> {
        self.motion.iter().chain(&self.table).chain(&self.rows).chain(&self.reports)
    }

    fn reserve(&self) -> Result<Slots> {
        Ok(Slots {
            motion: self.motion.as_ref().map(flexbody_file::prepare_output).transpose()?,
            table: self.table.as_ref().map(OutputSlot::prepare).transpose()?,
            rows: self.rows.as_ref().map(OutputSlot::prepare).transpose()?,
            reports: self.reports.iter().map(OutputSlot::prepare).collect::<Result<_>>()?,
        })
    }
}

impl Slots {
    fn into_all(self) -> impl Iterator<Item = OutputSlot> {
        self.motion.into_iter().chain(self.table).chain(self.rows).chain(self.reports)
    }
}
