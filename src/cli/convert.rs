//! Command `flexbody convert`.

use super::arguments::{ConvertArguments, EngineName, EnrichmentName, StatedArguments};
use super::convert_options::{convert_foreign, refuse_unjudged, with_settings_of};
use super::mode_source::ModeSource;
use super::models::of_manifest_or_job;
use super::outcome::{
    BodyOutputs, Outcome, Reserved, format_of, refuse_replacing, refuse_replacing_read, refuse_warnings,
};
use super::resources::{context, peak_memory_bytes, resident_bytes, use_threads};
use super::terminal::{Watcher, body_text};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_base::units::UnitSystem;
use flexbody_body::basis::{BasisChoice, BasisKind, ImportedShapes, ModeSettings};
use flexbody_body::convert::{Conversion, ConvertSettings, Lumping, MeshChoice, convert};
use flexbody_body::flex_body::{Storage, Subset};
use flexbody_body::invariants::LumpedScheme;
use flexbody_body::verification::accept;
use flexbody_eigen::{Accuracy, Method, PlannedAttempt, Wanted};
use flexbody_input::{
    ImportedColumns, LoadSource, MatrixLocation, ModelFiles, read_imported, read_model, read_nodal_masses,
};
use flexbody_linalg::context::{Context, Event};
use flexbody_linalg::instruction_set;
use flexbody_model::{CheckedModel, FeModel};
use flexbody_motion::dynamics::indefinite_inertia;
use flexbody_motion::scene::LoadCases;
use flexbody_report::{Facts, Format, LumpedModes, Phase, RunData, SearchAttempt, SelectionFacts, render};
use flexbody_study::selection::Selection;
use flexbody_study::tailoring::{
    StatedParts, Tailoring, computed_basis, convert_for, convert_stated, loads_for,
};

pub(super) fn run(arguments: &ConvertArguments) -> Result<Outcome> {
    if let Some(from) = &arguments.from {
        return convert_foreign(arguments, from);
    }
    let repeated = arguments.like.as_ref().map(|path| with_settings_of(arguments, path)).transpose()?;
    let arguments = repeated.as_ref().unwrap_or(arguments);
    let mode_source = ModeSource::of(arguments);
    let outcome = run_with(arguments, &mode_source)?;
    mode_source.tidy();
    Ok(outcome)
}

/// Runs a conversion whose modes are found by this program or elsewhere.
pub(super) fn run_with(arguments: &ConvertArguments, mode_source: &ModeSource) -> Result<Outcome> {
    refuse_without_modes(arguments)?;
    let stated = stated_parts(&arguments.stated)?;
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let schemes = lumping_schemes(&arguments.lumped)?;
    // The command line takes precedence over the manifest.
    let asked = arguments.residual_vectors.as_deref().map(load_sources).transpose()?;
    let keep_in = mode_source.keeps_in(&arguments.output);
    let files = ModelFiles { keep_in, ..model_files(arguments)? };
    let read = |path| LoadCases::read(path, arguments.case.as_deref());
    let cases = arguments.scene.as_deref().map(read).transpose()?;
    let cases = cases.as_ref();
    let loads = asked.unwrap_or_else(|| residual_vectors(arguments, &files, cases));
    refuse_contradictions(arguments, &loads)?;
    // Outputs are checked before reading, although the number of bodies is known only afterwards.
    let places = BodyOutputs::of(arguments, arguments.split.then_some(1));
    refuse_overwriting(arguments, std::slice::from_ref(&places), &files, &schemes, &loads, cases)?;
    let reserved = places.reserve()?;
    let threads = use_threads(arguments.threads);

    let watcher = watcher(arguments, "reading");
    let lumped = schemes.iter().map(Scheme::read).collect::<Result<Vec<_>>>()?;
    let raw = read_model(&files)?;
    // Check before the work: files that a deck includes or assigns are known now.
    refuse_replacing_read(places.all())?;
    watcher.hear(Event::Phase("checks"));
    let job = Job {
        arguments,
        lumped: &lumped,
        loads: &loads,
        formats: &formats,
        cases,
        stated: stated.as_ref(),
        mode_source,
        threads,
    };
    if !arguments.split {
        let done = job.convert(FeModel::from_raw(raw)?, &places, reserved, &watcher)?;
        OutputSlot::commit_all(done.slots)?;
        return Ok(done.outcome);
    }
    // Several bodies: reserve the outputs of all before the first conversion.
    let bodies = FeModel::bodies_from_raw(raw)?;
    let mut all = vec![places];
    all.extend((2..=bodies.len()).map(|number| BodyOutputs::of(arguments, Some(number))));
    refuse_overwriting(arguments, &all, &files, &schemes, &loads, cases)?;
    refuse_replacing_read(all.iter().flat_map(BodyOutputs::all))?;
    let mut slots = vec![reserved];
    for places in &all[1..] {
        slots.push(places.reserve()?);
    }
    let (mut finished, mut diagnostics) = (Vec::<Done>::new(), Vec::<Diagnostic>::new());
    for ((checked, places), reserved) in bodies.into_iter().zip(&all).zip(slots) {
        let watcher = if finished.is_empty() { &watcher } else { &self::watcher(arguments, "start") };
        let done = job.convert(checked, places, reserved, watcher)?;
        // Diagnostics of the common matrices are reported once.
        let new = done
            .outcome
            .diagnostics
            .iter()
            .filter(|d| !diagnostics.contains(*d))
            .cloned()
            .collect::<Vec<_>>();
        diagnostics.extend(new);
        finished.push(done);
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

fn watcher(arguments: &ConvertArguments, first: &str) -> Watcher {
    Watcher::new(arguments.printing.quiet || arguments.printing.json, first)
}

/// Common data of all bodies of a run.
struct Job<'a> {
    arguments: &'a ConvertArguments,
    lumped: &'a [Lumping],
    loads: &'a [LoadSource],
    formats: &'a [Format],
    /// Load cases of the scene; `None` without a scene.
    cases: Option<&'a LoadCases>,
    /// Parts of the body that the command line states; `None` if a scene selects them.
    stated: Option<&'a StatedParts>,
    mode_source: &'a ModeSource,
    threads: usize,
}

/// Body with its files written, but not yet in their places.
struct Done {
    slots: Vec<OutputSlot>,
    outcome: Outcome,
}

impl Job<'_> {
    fn convert(
        &self,
        checked: CheckedModel,
        places: &BodyOutputs,
        reserved: Reserved,
        watcher: &Watcher,
    ) -> Result<Done> {
        let CheckedModel { model, diagnostics, .. } = checked;
        let early = diagnostics.clone();
        let done = refuse_warnings(self.arguments.printing, &early)
            .and_then(|()| self.convert_model(&model, diagnostics, places, reserved, watcher));
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
        mut diagnostics: Vec<Diagnostic>,
        places: &BodyOutputs,
        reserved: Reserved,
        watcher: &Watcher,
    ) -> Result<Done> {
        let Self { arguments, .. } = *self;
        let mut settings = self.settings(model, BasisChoice::default());
        let watch = |event: Event<'_>| watcher.hear(event);
        let context = context(arguments.memory_limit, arguments.allow_long, &watch);
        settings.basis = match self.mode_source.modes(model, &settings.modes, &context)? {
            Some(found) => found,
            None => basis(arguments, self.loads, model)?,
        };
        let (resident, peak) = (resident_bytes(), peak_memory_bytes());
        let (mut conversion, selection) = self.made(model, settings, &context)?;
        let selected = selection.as_ref().map(|selection| selection.diagnostics.iter().cloned());
        conversion.diagnostics.extend(selected.into_iter().flatten());
        refuse_unjudged(arguments, selection.as_ref(), &conversion.diagnostics)?;
        if arguments.storage == Storage::F32 {
            conversion.body = conversion.body.rounded_to_f32()?;
        }
        accept(&conversion.body)?;
        // Write the body, then the reports, into their temporary files.
        watcher.hear(Event::Phase("writing"));
        flexbody_file::fill_slot(&conversion.body, &reserved.body)?;
        let size = std::fs::metadata(reserved.body.temporary()).map(|meta| meta.len()).unwrap_or(0);
        let output = (places.body.display().to_string(), size);
        let phases = watcher.finish();
        let found = conversion.diagnostics.iter().cloned();
        diagnostics.extend(found.map(|diagnostic| match model.number() {
            Some(number) => diagnostic.about(number),
            None => diagnostic,
        }));
        refuse_warnings(arguments.printing, &diagnostics)?;
        let mut run = run_data(output, &conversion, diagnostics.clone(), phases, self.threads);
        // Reading may have taken more memory than the work will.
        run.memory_estimate_bytes =
            conversion.plan.as_ref().map(|plan| peak.unwrap_or(0).max(resident + plan.bytes()));
        let facts = Facts::new(&conversion.body, &run);
        for (slot, format) in reserved.reports.iter().zip(self.formats) {
            slot.fill(render(&facts, *format).as_bytes())?;
        }
        // The diagnostics are part of the body's report.
        let nothing = RunData::default();
        let decided = selection.as_ref().map(|selection| SelectionFacts::new(selection, &nothing));
        let text = body_text(&facts, arguments.verbose, arguments.printing)
            + &decided.map_or_else(String::new, |decided| {
                if arguments.verbose {
                    format!("\n{}", decided.render(Format::Terminal))
                } else {
                    format!("\n{}", decided.summary())
                }
            });
        let outcome = Outcome { text, json: render(&facts, Format::Json), diagnostics, passed: true };
        let slots = std::iter::once(reserved.body).chain(reserved.reports).collect();
        Ok(Done { slots, outcome })
    }

    /// Returns the body, with the selection of its terms and modes for a scene unless the command line states them.
    fn made(
        &self,
        model: &FeModel,
        settings: ConvertSettings,
        context: &Context<'_>,
    ) -> Result<(Conversion, Option<Selection>)> {
        let Some((path, cases)) = self.arguments.scene.as_ref().zip(self.cases) else {
            let mut conversion = convert(model, &settings, context)?;
            if let Some(stated) = self.stated {
                conversion.body = conversion.body.subset(&stated.subset)?;
                conversion = noted(conversion);
            }
            return Ok((conversion, None));
        };
        let tailoring = self.of_band(settings);
        let made = match self.stated {
            Some(stated) => {
                convert_stated(model, &tailoring, cases, stated, context).map(|made| (noted(made), None))
            }
            None => convert_for(model, &tailoring, cases, context).map(|(made, chosen)| (made, Some(chosen))),
        };
        made.map_err(|error| error.in_file(path))
    }

    /// Returns the settings with free modes by the band of the scene, unless their number or highest frequency is
    /// stated.
    fn of_band(&self, settings: ConvertSettings) -> Tailoring {
        let ConvertArguments { modes, max_frequency, basis, .. } = self.arguments;
        let by_band = modes.is_none() && max_frequency.is_none() && basis.follows_scene();
        Tailoring { settings, by_band, of_motion: *basis == BasisKind::Scene }
    }

    fn settings(&self, model: &FeModel, basis: BasisChoice) -> ConvertSettings {
        let Self { arguments, .. } = *self;
        ConvertSettings {
            modes: ModeSettings {
                wanted: wanted(arguments, model.units()),
                accuracy: arguments.accuracy,
                method: Method::Auto,
                factor: arguments.factor,
                ..ModeSettings::default()
            },
            basis,
            frame: arguments.frame.clone().unwrap_or_default(),
            lumped: self.lumped.to_vec(),
            lumped_modes: arguments.lumped_modes,
            mesh: match (arguments.no_mesh, arguments.mesh_triangles) {
                (true, _) => MeshChoice::Without,
                (false, Some(most)) => MeshChoice::AtMost(most as usize),
                (false, None) => MeshChoice::Whole,
            },
        }
    }
}

/// Returns the conversion with a warning if the stated terms let deflections make the inertia indefinite.
fn noted(mut conversion: Conversion) -> Conversion {
    conversion.diagnostics.extend(indefinite_inertia(&conversion.body));
    conversion
}

/// Returns the parts of the body that the command line states; `None` if it states none, so that a scene selects them.
fn stated_parts(arguments: &StatedArguments) -> Result<Option<StatedParts>> {
    let StatedArguments { terms, keep_modes, motion_shapes, enrichment } = arguments;
    if !arguments.states_any() {
        return Ok(None);
    }
    Ok(Some(StatedParts {
        motion_shapes: motion_shapes.map(|count| count as usize),
        subset: subset(terms.as_deref(), keep_modes.as_deref())?,
        is_fine: *enrichment == EnrichmentName::Fine,
    }))
}

/// Parses the modes and groups of terms that a command line states.
pub(super) fn subset(terms: Option<&str>, keep_modes: Option<&str>) -> Result<Subset> {
    Ok(Subset {
        modes: keep_modes.map(Subset::parse_modes).transpose()?,
        groups: terms.map(Subset::parse_groups).transpose()?.unwrap_or_default(),
    })
}

/// Returns the loads of residual vectors if the command line names none: those of the manifest or, without these, those
/// of the scene.
fn residual_vectors(
    arguments: &ConvertArguments,
    files: &ModelFiles,
    cases: Option<&LoadCases>,
) -> Vec<LoadSource> {
    let free = arguments.basis.follows_scene() && arguments.accuracy != Accuracy::Certified;
    loads_for(cases.filter(|_| free && !arguments.lumped_modes), &files.residual_vectors)
}

/// Parses the loads of residual vectors named on the command line.
pub(super) fn load_sources(text: &str) -> Result<Vec<LoadSource>> {
    let mut sets = Vec::new();
    let mut names: Vec<&str> = text.split(',').map(str::trim).filter(|name| !name.is_empty()).collect();
    if names == ["none"] {
        return Ok(sets);
    }
    for text in &names {
        let (name, hertz) = LoadSource::with_frequency(text);
        let loads = match (name, name.strip_prefix("loads=")) {
            ("centrifugal", _) => LoadSource::Centrifugal,
            ("interfaces", _) => LoadSource::Interfaces,
            (_, Some(path)) if !path.is_empty() => LoadSource::File(MatrixLocation::parse(path)),
            _ => {
                let message = format!("`{text}` is not a set of loads for residual vectors");
                return Err(Diagnostic::new(Code::Usage, message)
                    .with_help("give centrifugal, interfaces or loads=FILE, separated by commas; append @HZ for the responses at a frequency")
                    .into());
            }
        };
        sets.push(loads.at(hertz));
    }
    names.sort_unstable();
    if names.windows(2).any(|pair| pair[0] == pair[1]) {
        let message = format!("loads are named twice in `{text}`");
        return Err(Diagnostic::new(Code::Usage, message).into());
    }
    Ok(sets)
}

fn refuse_without_modes(arguments: &ConvertArguments) -> Result<()> {
    if arguments.modes == Some(0) && arguments.basis != BasisKind::CraigBampton {
        let message =
            "--modes 0 leaves the body without modes: only --basis craig-bampton has static shapes besides";
        return Err(Diagnostic::new(Code::Usage, message)
            .with_help("give --modes 1 or more, or --basis craig-bampton for static condensation")
            .into());
    }
    Ok(())
}

/// Message about residual vectors of a basis without free modes.
pub(super) const RESIDUALS_NEED_FREE_MODES: &str = "residual vectors need --basis free or craig-chang; craig-bampton has the responses to loads at its interfaces: leave --residual-vectors out";

/// Refuses contradictory options. `loads` are the loads of residual vectors.
fn refuse_contradictions(arguments: &ConvertArguments, loads: &[LoadSource]) -> Result<()> {
    let basis = arguments.basis;
    let residual = !loads.is_empty();
    let slepc = arguments.engine.engine == EngineName::Slepc;
    let searches_free_modes = basis.searches_free_modes();
    let coupled = matches!(basis, BasisKind::CraigBampton | BasisKind::CraigChang);
    let message = match arguments {
        ConvertArguments { scene: None, .. } if basis == BasisKind::Scene => "--basis scene needs --scene",
        ConvertArguments { stated: StatedArguments { motion_shapes: Some(_), .. }, .. }
            if basis != BasisKind::Scene =>
        {
            "--motion-shapes needs --basis scene"
        }
        ConvertArguments { stated: StatedArguments { motion_shapes: None, .. }, .. }
            if basis == BasisKind::Scene && arguments.stated.states_any() =>
        {
            "--basis scene with --terms or --keep-modes needs the number of shapes: --motion-shapes"
        }
        ConvertArguments { stated: StatedArguments { enrichment: EnrichmentName::Fine, .. }, .. }
            if !arguments.stated.states_any() =>
        {
            "--enrichment fine needs --terms, --keep-modes or --motion-shapes: a selection takes the standard one"
        }
        ConvertArguments { split: true, stated: StatedArguments { keep_modes: Some(_), .. }, .. } => {
            "--keep-modes takes the modes of one body: --split has several"
        }
        ConvertArguments { accuracy: Accuracy::Certified, .. } if basis == BasisKind::Scene => {
            "the modes of this basis are not eigenvectors and cannot be certified"
        }
        ConvertArguments { shapes: Some(_), .. } if basis != BasisKind::Imported => {
            "--shapes needs --basis imported"
        }
        ConvertArguments { storage: Storage::F32, accuracy: Accuracy::Certified, .. } => {
            "--storage f32 rounds the numbers that --accuracy certified guarantees: use --storage f64"
        }
        _ if slepc && basis != BasisKind::Free => "--engine slepc finds free modes: it needs --basis free",
        _ if slepc && residual => "residual vectors need the factor of --engine built-in",
        ConvertArguments { scene: Some(_), .. } if slepc => "--scene needs --engine built-in",
        ConvertArguments { split: true, .. } if slepc => {
            "--engine slepc converts a single body: leave --split out"
        }
        ConvertArguments { accuracy: Accuracy::Certified, .. } if slepc => {
            "--accuracy certified needs --engine built-in"
        }
        _ if residual && !searches_free_modes => RESIDUALS_NEED_FREE_MODES,
        ConvertArguments { split: true, .. } if loads.iter().any(|set| set.file().is_some()) => {
            "--split cannot be used with nodal loads, whose rows belong to all bodies together"
        }
        ConvertArguments { lumped_modes: true, .. } if residual => {
            "--lumped-modes compares free-surface modes, not residual vectors"
        }
        ConvertArguments { accuracy: Accuracy::Certified, .. } if residual => {
            "residual vectors are not eigenvectors and cannot be certified"
        }
        ConvertArguments { accuracy: Accuracy::Certified, .. } if coupled => {
            "the modes of this basis are not eigenvectors and cannot be certified"
        }
        ConvertArguments { lumped_modes: true, .. } if basis != BasisKind::Free => {
            "--lumped-modes compares free-surface modes: it needs --basis free"
        }
        _ => return Ok(()),
    };
    Err(Diagnostic::new(Code::Usage, message).into())
}

/// Returns the basis, with the shapes that it needs.
fn basis(arguments: &ConvertArguments, loads: &[LoadSource], model: &FeModel) -> Result<BasisChoice> {
    match (arguments.basis, &arguments.shapes) {
        (BasisKind::Imported, Some(shapes)) => {
            let location = MatrixLocation::parse(shapes);
            let imported = match read_imported(&location, &model.row_counts(), "shapes")? {
                ImportedColumns::Rows(raw) => ImportedShapes::new(model, raw),
                ImportedColumns::Modes(raw) => ImportedShapes::of_modes(model, raw),
            };
            imported.map(BasisChoice::Imported)
        }
        (kind, _) => computed_basis(kind, loads, model),
    }
}

/// Lumping scheme named on the command line.
enum Scheme {
    Ready(Lumping),
    User(std::path::PathBuf),
}

impl Scheme {
    fn read(&self) -> Result<Lumping> {
        match self {
            Self::Ready(lumping) => Ok(lumping.clone()),
            Self::User(path) => read_nodal_masses(path).map(Lumping::User),
        }
    }
}

fn lumping_schemes(text: &str) -> Result<Vec<Scheme>> {
    let mut schemes = Vec::new();
    for scheme in text.split(',').map(str::trim).filter(|scheme| *scheme != "none") {
        let (name, path) = scheme.split_once('=').map_or((scheme, None), |(name, path)| (name, Some(path)));
        schemes.push(match (LumpedScheme::from_name(name), path) {
            (Some(LumpedScheme::RowSum), None) => Scheme::Ready(Lumping::RowSum),
            (Some(LumpedScheme::DiagonalScaling), None) => Scheme::Ready(Lumping::DiagonalScaling),
            (Some(LumpedScheme::User), Some(path)) if !path.is_empty() => Scheme::User(path.into()),
            _ => {
                let message = format!("`{scheme}` is not a lumping scheme");
                return Err(Diagnostic::new(Code::LumpedScheme, message).into());
            }
        });
    }
    let mut names: Vec<&str> =
        text.split(',').map(|name| name.split('=').next().unwrap_or(name).trim()).collect();
    names.sort_unstable();
    if names.windows(2).any(|pair| pair[0] == pair[1]) {
        let message = format!("a lumping scheme is named twice in `{text}`");
        return Err(Diagnostic::new(Code::LumpedScheme, message).into());
    }
    Ok(schemes)
}

pub(super) fn model_files(arguments: &ConvertArguments) -> Result<ModelFiles> {
    let mut files = stated_files(arguments)?;
    files.allow_implausible |= arguments.allow_implausible;
    files.keep_soft_rotations |= arguments.keep_soft_rotations;
    Ok(files)
}

fn stated_files(arguments: &ConvertArguments) -> Result<ModelFiles> {
    match (&arguments.model, &arguments.stiffness, &arguments.mass, &arguments.nodes) {
        (Some(model), ..) => of_manifest_or_job(model, &arguments.job),
        (None, Some(stiffness), Some(mass), Some(nodes)) => ModelFiles::from_arguments(
            stiffness,
            mass,
            nodes,
            arguments.dofs.clone(),
            arguments.job.units.as_deref(),
        )
        .and_then(|files| arguments.job.state_in(files)),
        _ => {
            Err(Diagnostic::new(Code::Usage, "give a manifest, a job, or --stiffness, --mass and --nodes")
                .into())
        }
    }
}

/// Refuses outputs that would replace an input or another output.
fn refuse_overwriting(
    arguments: &ConvertArguments,
    outputs: &[BodyOutputs],
    files: &ModelFiles,
    schemes: &[Scheme],
    loads: &[LoadSource],
    cases: Option<&LoadCases>,
) -> Result<()> {
    let masses = schemes.iter().filter_map(|scheme| match scheme {
        Scheme::User(path) => Some(path),
        Scheme::Ready(_) => None,
    });
    let shapes = arguments.shapes.as_ref().map(|path| MatrixLocation::parse(path).path);
    let loads = loads.iter().filter_map(LoadSource::file).map(|location| &location.path);
    let own = files.paths();
    let inputs =
        own.iter().chain(masses).chain(&shapes).chain(loads).chain(&arguments.scene).chain(&arguments.like);
    let series = cases
        .into_iter()
        .flat_map(|cases| cases.iter())
        .flat_map(|scene| &scene.series)
        .map(|file| &file.path);
    refuse_replacing(inputs.chain(series), outputs.iter().flat_map(BodyOutputs::all))
}

pub(super) fn wanted(arguments: &ConvertArguments, units: &UnitSystem) -> Wanted {
    match arguments.max_frequency {
        Some(hertz) => Wanted::Below(units.eigenvalue_of(hertz)),
        None => Wanted::Lowest(match (arguments.modes, arguments.basis) {
            (Some(modes), _) => modes as usize,
            (None, BasisKind::Imported) => usize::MAX,
            (None, _) => ModeSettings::DEFAULT_COUNT,
        }),
    }
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
    threads: usize,
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
        threads,
        instructions: instruction_set().to_owned(),
        diagnostics,
        attempts: conversion.plan.iter().flat_map(|plan| plan.attempts.iter().map(search_attempt)).collect(),
        counters: counters.iter().map(|&(name, count)| (name.to_owned(), count)).collect(),
        accuracy: conversion.body.source().settings["accuracy"].as_str().unwrap_or_default().to_owned(),
        output: Some(output),
        lumped_modes,
    }
}
