//! Bodies that different settings of a conversion make of one model.

use super::{Source, Varied};
use crate::recipe::{ConversionRecipe, Recipe, SceneBasis};
use crate::reference::{
    Enriched, Enrichment, MotionBodies, ReferenceError, enrich, enrich_from, varied_errors,
};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, FreeSurface, Loads, ModeSettings};
use flexbody_body::convert::{ConvertSettings, Lumping, convert};
use flexbody_eigen::{Accuracy, Wanted};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::{LoadCases, Scene, SceneVariation};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fmt::Write;
use std::time::Instant;

/// Bodies of a study.
pub struct Conversions {
    /// Bodies, the reference first.
    pub sources: Vec<Source>,
    /// Truncation errors of the reference and of its versions before enrichment, in each load case; the last belongs to
    /// the reference.
    pub reference_errors: Vec<Vec<ReferenceError>>,
    /// Bodies and scenes of the variations.
    pub varied: Varied,
    /// Diagnostics about the reference.
    pub diagnostics: Vec<Diagnostic>,
}

/// Request for the bodies of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WantedBodies {
    /// Number of free modes of a usual conversion.
    pub modes: usize,
    /// True if the reference stands for the motion of all nodes: [`Enrichment::is_fine`].
    pub fine: bool,
}

/// Makes every conversion of a study for these load cases.
///
/// The reference has twice the requested number of modes, residual vectors of spin and interfaces, and the static
/// responses that [`enrich`] adds for any case. The other bodies have the requested number of modes, a half and a
/// quarter of it, with residual vectors and without; the requested number at the other levels of accuracy; shapes of
/// the motions of the reference; and the settings of the reference for the model with its whole mass lumped. Each
/// conversion is timed.
///
/// # Errors
/// The errors of [`convert`] and [`enrich`]. Accuracy `certified` is left out if it does not support the model.
pub fn conversions(
    model: &FeModel,
    cases: &LoadCases,
    wanted: WantedBodies,
    context: &Context<'_>,
) -> Result<Conversions> {
    let WantedBodies { modes, fine } = wanted;
    let conversions = ConversionContext::new(model, fine, context);
    // Reference body, enriched for the load cases.
    let finest = BodySettings {
        count: modes.saturating_mul(2),
        residual: true,
        accuracy: Accuracy::Standard,
        lumped: None,
        scene: SceneBasis::Enriched { is_fine: fine },
    };
    let mut responses = Mat::new();
    let make = |loads: &Mat<f64>| {
        responses.clone_from(loads);
        conversions.make(&finest, loads, ConvertSettings::default().lumped)
    };
    let enrichment = Enrichment { grows: true, is_fine: fine };
    let enriched = enrich(model, cases, enrichment, context, make, |(made, _)| made.body())?;
    let Enriched { made: (reference, mut diagnostics), rounds: reference_errors } = enriched;
    diagnostics.extend(warnings(cases, &reference_errors, enrichment.enough()));
    let mut sources = vec![reference];
    // Bodies with fewer modes or other accuracy.
    for body_settings in all_settings(modes) {
        let source = match conversions.make(&body_settings, &Mat::new(), Vec::new()) {
            Ok((source, _)) => source,
            Err(error)
                if body_settings.accuracy == Accuracy::Certified
                    && error.first_error().code() == Code::Usage =>
            {
                continue;
            }
            Err(error) => return Err(error),
        };
        let beside = source.beside(sources[0].body(), model);
        sources.push(beside.expect(OF_THE_MODEL));
    }
    // Bodies of shapes of the motion, and bodies of a lumped mass.
    let reference_error = |rounds: &Vec<ReferenceError>| rounds.last().map_or(0.0, |own| own.worst);
    let left: Vec<f64> = reference_errors.iter().map(|rounds| 1.0 - reference_error(rounds)).collect();
    for source in conversions.make_of_motion(&sources[0], &finest, cases, &left)? {
        sources.push(source.beside(sources[0].body(), model).expect(OF_THE_MODEL));
    }
    for lumping in lumpings(model) {
        match conversions.make_lumped(&finest, &responses, &lumping)? {
            Ok(source) => sources.push(source.beside(sources[0].body(), model).expect(OF_THE_MODEL)),
            Err(reason) => diagnostics.push(reason),
        }
    }
    let varied = conversions.varied(&finest, responses, &sources, cases)?;
    Ok(Conversions { sources, reference_errors, varied, diagnostics })
}

/// Returns warnings and remarks about the truncation error of the reference, each with its load case if there are several.
fn warnings(cases: &LoadCases, reference_errors: &[Vec<ReferenceError>], enough: f64) -> Vec<Diagnostic> {
    let mut all = Vec::new();
    for (at, rounds) in reference_errors.iter().enumerate() {
        let Some(own) = rounds.last() else { continue };
        let found = own.warning(&cases[at], enough).into_iter().chain(own.remarks(&cases[at]));
        all.extend(found.map(|said| match cases.case_name(at) {
            Some(name) => said.about(format!("case `{name}`")),
            None => said,
        }));
    }
    all
}

/// Part of the remaining tolerances that bodies of the fewest shapes may take. The rest is for dropped terms.
const PART_OF_SHAPES: f64 = 0.9;

const OF_THE_MODEL: &str = "bodies that were made from the model";

/// Returns schemes that lump the whole mass of `model`. Empty if the mass is lumped already, or if rows without a
/// position or points that follow nodes carry mass that belongs to no node.
fn lumpings(model: &FeModel) -> Vec<Lumping> {
    let elsewhere = model.rows().vectors() > 0 || model.followers().is_some();
    if model.has_diagonal_mass() || elsewhere { Vec::new() } else { ConvertSettings::default().lumped }
}

/// Settings of a body of the study.
#[derive(Clone, PartialEq)]
struct BodySettings {
    /// Number of free modes.
    count: usize,
    /// True if the body has residual vectors.
    residual: bool,
    accuracy: Accuracy,
    /// Scheme by which the mass is lumped before the conversion; `None` for the consistent mass.
    lumped: Option<&'static str>,
    /// Contribution of the scene to the basis.
    scene: SceneBasis,
}

impl BodySettings {
    fn in_words(&self) -> String {
        let mut name = format!("{} free mode{}", self.count, if self.count == 1 { "" } else { "s" });
        if self.residual {
            name.push_str(", residual vectors");
        }
        if let Some(scheme) = self.lumped {
            let _ = write!(name, ", of a mass lumped by {scheme}");
        }
        if self.accuracy != Accuracy::Standard {
            name.push_str(&format!(", {}", self.accuracy.name()));
        }
        name
    }
}

/// Returns the settings of the bodies other than the reference, without duplicates.
fn all_settings(modes: usize) -> Vec<BodySettings> {
    let scene = SceneBasis::Without;
    let other = |accuracy| BodySettings { count: modes, residual: false, accuracy, lumped: None, scene };
    let mut all_settings = vec![other(Accuracy::Fast), other(Accuracy::Certified)];
    for part in [1, 2, 4] {
        let count = (modes / part).max(1);
        for residual in [true, false] {
            let body_settings =
                BodySettings { count, residual, accuracy: Accuracy::Standard, lumped: None, scene };
            if !all_settings.contains(&body_settings) {
                all_settings.push(body_settings);
            }
        }
    }
    all_settings
}

/// Common data of all conversions of a study.
struct ConversionContext<'m> {
    model: &'m FeModel,
    /// Loads of the residual vectors.
    loads: Vec<Loads>,
    /// True if the reference stands for the motion of all nodes.
    is_fine: bool,
    context: Context<'m>,
}

impl<'m> ConversionContext<'m> {
    fn new(model: &'m FeModel, is_fine: bool, context: &Context<'m>) -> Self {
        let mut loads = vec![Loads::Centrifugal];
        if !model.interfaces().is_empty() {
            loads.push(Loads::Interfaces);
        }
        Self { model, loads, is_fine, context: *context }
    }

    /// Returns the conversion that makes the body of body settings.
    fn recipe(&self, body_settings: &BodySettings) -> Recipe {
        let residual_vectors = match (body_settings.residual, self.loads.len()) {
            (false, _) => Vec::new(),
            (true, 1) => vec!["centrifugal"],
            (true, _) => vec!["centrifugal", "interfaces"],
        };
        let BodySettings { count: modes, accuracy, scene, .. } = *body_settings;
        Recipe::Conversion(ConversionRecipe { modes, residual_vectors, accuracy, scene })
    }

    /// Returns the settings of a conversion with `modes` modes and without lumped comparators.
    fn settings(&self, modes: usize) -> ConvertSettings {
        ConvertSettings {
            modes: ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() },
            lumped: Vec::new(),
            ..ConvertSettings::default()
        }
    }

    /// Converts the model, with the static responses to `motion` in the basis, and measures the time.
    fn make(
        &self,
        body_settings: &BodySettings,
        motion: &Mat<f64>,
        lumped: Vec<Lumping>,
    ) -> Result<(Source, Vec<Diagnostic>)> {
        let residual_vectors = if body_settings.residual { self.loads.clone() } else { Vec::new() };
        let basis = BasisChoice::Free(FreeSurface { residual_vectors });
        let own = self.settings(body_settings.count);
        let settings = ConvertSettings {
            modes: ModeSettings { accuracy: body_settings.accuracy, ..own.modes },
            basis: basis.with_motion(motion).expect("free modes take responses"),
            lumped,
            ..own
        };
        let start = Instant::now();
        let conversion = convert(self.model, &settings, &self.context)?;
        let seconds = start.elapsed().as_secs_f64();
        let source = Source::new(
            body_settings.in_words(),
            conversion.body,
            self.recipe(body_settings),
            Some(seconds),
        )?;
        Ok((source, conversion.diagnostics))
    }

    /// Makes the reference of the variations: the reference of the study, made by `finest` with the static `responses`. For
    /// required variations it is enriched further, and all sources of the study are related to it; for others it stays as it
    /// is, with its error there.
    fn varied(
        &self,
        finest: &BodySettings,
        responses: Mat<f64>,
        sources: &[Source],
        cases: &LoadCases,
    ) -> Result<Varied> {
        let variations = cases.variations(self.model.dimension());
        let scenes: Vec<Scene> = variations.iter().map(|variation| variation.scene.clone()).collect();
        let has_runs = scenes.iter().all(|scene| scene.run.duration.is_some());
        let Some(scenes) = LoadCases::new(scenes).filter(|_| has_runs) else {
            return Ok(Varied::default());
        };
        self.context.phase("reference of the variations");
        let make = |loads: &Mat<f64>| Ok(self.make(finest, loads, Vec::new())?.0);
        if !cases.requires_variations() {
            let reference_errors = varied_errors(self.model, sources[0].body(), cases, &self.context)?;
            return Ok(Varied { variations, reference_errors, ..Varied::default() });
        }
        let enrichment = Enrichment { grows: true, is_fine: false };
        let Enriched { made, rounds: reference_errors } =
            enrich_from(responses, self.model, &scenes, enrichment, &self.context, make, Source::body)?;
        let warning = |(one, rounds): (&SceneVariation, &Vec<ReferenceError>)| {
            let warning = rounds.last()?.warning(&one.scene, enrichment.enough())?;
            Some(warning.about(format!("variation `{}`", one.name)))
        };
        let diagnostics = variations.iter().zip(&reference_errors).filter_map(warning).collect();
        let related = |source: &Source| source.clone().beside(made.body(), self.model).expect(OF_THE_MODEL);
        let related: Vec<Source> = sources.iter().map(related).collect();
        let sources = std::iter::once(made).chain(related).collect();
        let are_stated = cases.states_variations();
        Ok(Varied { variations, are_stated, are_required: true, sources, reference_errors, diagnostics })
    }

    /// Makes bodies of shapes of the motion of `reference` in `cases`: for all candidate numbers of shapes, and for the
    /// fewest whose errors are within the parts `left` of the tolerances. `finest` made the reference. Their time includes that of the reference and
    /// its motion.
    fn make_of_motion(
        &self,
        reference: &Source,
        finest: &BodySettings,
        cases: &LoadCases,
        left: &[f64],
    ) -> Result<Vec<Source>> {
        if cases.iter().any(|scene| scene.run.duration.is_none()) {
            return Ok(Vec::new());
        }
        let start = Instant::now();
        let Some(bodies) = MotionBodies::new(self.model, reference.body(), cases, &self.context)? else {
            return Ok(Vec::new());
        };
        let before = start.elapsed().as_secs_f64() + reference.preprocessing().unwrap_or(0.0);
        let mut made = BTreeMap::new();
        let mut make = |count: usize| match made.entry(count) {
            Entry::Occupied(known) => Ok(Source::clone(known.get())),
            Entry::Vacant(new) => Ok(new.insert(self.of_shapes(&bodies, finest, count, before)?).clone()),
        };
        let mut counts = bodies.counts();
        counts.iter().try_for_each(|count| make(*count).map(drop))?;
        let most: Vec<f64> = left.iter().map(|left| PART_OF_SHAPES * left).collect();
        let fewest = bodies.fewest(&most, make, Source::body)?;
        counts.extend(fewest.map(|own| own.count));
        Ok(made.into_iter().filter(|(count, _)| counts.contains(count)).map(|(_, own)| own).collect())
    }

    /// Makes the body of the first `count` shapes of a motion of the reference, made by `finest`, that took `before`
    /// seconds.
    fn of_shapes(
        &self,
        bodies: &MotionBodies<'_>,
        finest: &BodySettings,
        count: usize,
        before: f64,
    ) -> Result<Source> {
        let start = Instant::now();
        let settings = ConvertSettings { basis: bodies.basis(count), ..self.settings(usize::MAX) };
        let body = convert(self.model, &settings, &self.context)?.body;
        let name = format!("{count} shape{} of the motion", if count == 1 { "" } else { "s" });
        let scene = SceneBasis::Shapes { count, is_fine: self.is_fine };
        let recipe = self.recipe(&BodySettings { scene, ..finest.clone() });
        Source::new(name, body, recipe, Some(before + start.elapsed().as_secs_f64()))
    }

    /// Makes the body of the model with its whole mass lumped. Returns the reason as a diagnostic if there is no such
    /// body.
    fn make_lumped(
        &self,
        body_settings: &BodySettings,
        motion: &Mat<f64>,
        lumping: &Lumping,
    ) -> Result<std::result::Result<Source, Diagnostic>> {
        let masses = lumping.masses(self.model)?;
        let scheme = masses.scheme().name();
        let no_body = |why: String| {
            let message = format!("no candidate has its whole mass lumped by {scheme}: {why}");
            Ok(Err(Diagnostic::new(Code::LumpedWithoutBody, message)))
        };
        if masses.negative() > 0 {
            return no_body(format!("{} nodal masses are negative", masses.negative()));
        }
        let lumped = self.model.with_nodal_masses(masses.masses());
        let name = BodySettings { lumped: Some(scheme), ..body_settings.clone() };
        let own = ConversionContext { model: &lumped, loads: self.loads.clone(), ..*self };
        match own.make(&name, motion, Vec::new()) {
            Ok((source, _)) => Ok(Ok(source.of_lumped_mass(scheme))),
            Err(error) => no_body(error.first_error().message().to_owned()),
        }
    }
}
