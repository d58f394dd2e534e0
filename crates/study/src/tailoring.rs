//! Conversion of a body for one scene: with the terms and modes that the scene needs, or with those that a
//! recommendation states.

use crate::reference::{
    Enriched, Enrichment, FewestShapes, MAX_REFERENCE_ERROR, MotionBodies, ReferenceError, enrich,
    varied_errors,
};
use crate::selection::{Selection, WantedResponses, largest_eigenvalue, rule_out, select_judged};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, BasisKind, CraigBampton, CraigChang, FreeSurface, Loads, UserLoads};
use flexbody_body::convert::{Condensation, Conversion, ConvertSettings, ModalModel, convert};
use flexbody_body::flex_body::{FlexBody, Subset};
use flexbody_eigen::{Accuracy, Wanted};
use flexbody_input::{LoadSource, read_shapes};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::LoadCases;

/// Settings of a conversion for a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Tailoring {
    /// Settings of the conversion before the selection.
    pub settings: ConvertSettings,
    /// True if the band of the scene sets the number of modes: all up to twice the band, if there are any.
    pub by_band: bool,
    /// True if shapes made of the motion replace the modes of the simulation, if fewer shapes suffice.
    pub of_motion: bool,
}

/// Parts of a body that a user or a recommendation states, instead of a selection.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StatedParts {
    /// Number of shapes of the motion that replace the modes, those of most elastic energy; `None` to keep the modes.
    pub motion_shapes: Option<usize>,
    /// Modes and groups of terms that the body keeps.
    pub subset: Subset,
    /// True if the body is enriched until its truncation error is within a hundredth of the tolerances, instead of a
    /// tenth.
    pub is_fine: bool,
}

impl Tailoring {
    /// Makes a body with everything that any of the load cases may need, and enriches it until its truncation error is
    /// small there.
    ///
    /// # Errors
    /// The errors of [`convert`] and [`enrich`].
    pub fn convert(
        &self,
        model: &FeModel,
        cases: &LoadCases,
        context: &Context<'_>,
    ) -> Result<Enriched<Conversion>> {
        self.enriched(model, cases, false, context, |modal| Ok(modal.condense()))
    }

    /// Converts with `condense`, with more static responses in each round, until the truncation error of the body is
    /// small enough: a tenth of the tolerances, or a hundredth if `is_fine`.
    fn enriched(
        &self,
        model: &FeModel,
        cases: &LoadCases,
        is_fine: bool,
        context: &Context<'_>,
        condense: impl Fn(&ModalModel<'_>) -> Result<Condensation>,
    ) -> Result<Enriched<Conversion>> {
        let make = |loads: &Mat<f64>| {
            let with_loads = self.with_motion(loads);
            let band_settings = with_loads.settings_of_band(cases);
            let modal = with_loads.find_modes(band_settings.as_ref(), model, context)?;
            let condensed = condense(&modal)?;
            modal.finish(condensed, context)
        };
        let Self { settings, .. } = self;
        let grows = settings.modes.accuracy != Accuracy::Certified
            && settings.basis.with_motion(&Mat::new()).is_some();
        let enrichment = Enrichment { grows, is_fine };
        enrich(model, cases, enrichment, context, make, |made| &made.body)
    }

    /// Returns a body of the fewest shapes of the motions of `whole` that leave half of the tolerances to dropped
    /// terms. Returns `whole` with a warning if no number of shapes suffices.
    ///
    /// # Errors
    /// The errors of [`trace`](flexbody_motion::scene::trace) and of the conversion.
    fn fewest_shapes(
        &self,
        model: &FeModel,
        cases: &LoadCases,
        whole: Enriched<Conversion>,
        context: &Context<'_>,
        condense: impl Fn(&ModalModel<'_>) -> Result<Condensation>,
    ) -> Result<Enriched<Conversion>> {
        let Enriched { made: mut reference, rounds } = whole;
        let last_errors = || rounds.iter().map(|rounds| rounds.last());
        if last_errors().flatten().any(|error| !error.is_reference()) {
            let message = "the error of the body from whose motion the shapes would be computed is itself more than half of the tolerances";
            reference.diagnostics.push(Diagnostic::new(Code::MotionWithoutBasis, message));
            return Ok(Enriched { made: reference, rounds });
        }
        // The shapes may take what the truncation error of the whole body leaves.
        let reference_errors: Vec<f64> =
            last_errors().map(|error| error.map_or(0.0, |error| error.worst)).collect();
        let bodies = MotionBodies::new(model, &reference.body, cases, context)?;
        let make = |bodies: &MotionBodies<'_>, count: usize| -> Result<Conversion> {
            let settings = self.settings_of_shapes(bodies.basis(count));
            let modal = ModalModel::find(model, &settings, context)?;
            let condensed = condense(&modal)?;
            modal.finish(condensed, context)
        };
        let most: Vec<f64> = reference_errors.iter().map(|error| MAX_REFERENCE_ERROR - error).collect();
        let fewest = bodies
            .as_ref()
            .map(|bodies| bodies.fewest(&most, |count| make(bodies, count), |made| &made.body));
        if let Some(FewestShapes { made, errors, worst, .. }) = fewest.transpose()?.flatten() {
            let modes = made.body.n_modes();
            let rounds = errors.into_iter().zip(worst).zip(reference_errors).map(
                |((errors, worst), reference_error)| {
                    vec![ReferenceError {
                        modes,
                        errors,
                        worst: reference_error + worst,
                        time: 0.0,
                        unknown: None,
                        coupling: None,
                    }]
                },
            );
            return Ok(Enriched { rounds: rounds.collect(), made });
        }
        let message = "every number of shapes leaves an error of more than half of the tolerances; the other half is needed for dropped terms";
        reference.diagnostics.push(Diagnostic::new(Code::MotionWithoutBasis, message));
        Ok(Enriched { made: reference, rounds })
    }

    /// Returns the body of the first `count` shapes of the motions of `reference`.
    fn of_shapes(
        &self,
        model: &FeModel,
        cases: &LoadCases,
        reference: &FlexBody,
        count: usize,
        context: &Context<'_>,
    ) -> Result<Conversion> {
        let bodies = MotionBodies::new(model, reference, cases, context)?;
        let most = bodies.as_ref().map_or(0, MotionBodies::most);
        let Some(bodies) = bodies.filter(|_| (1..=most).contains(&count)) else {
            let message =
                format!("{count} shapes of the motion are requested, but the motion has only {most}");
            let help = "request a smaller number, or leave it out to get the smallest number that suffices";
            return Err(Diagnostic::new(Code::Usage, message).with_help(help).into());
        };
        convert(model, &self.settings_of_shapes(bodies.basis(count)), context)
    }

    /// Returns settings that use all modes of the given shapes.
    fn settings_of_shapes(&self, basis: BasisChoice) -> ConvertSettings {
        let mut settings = ConvertSettings { basis, ..self.settings.clone() };
        settings.modes.wanted = Wanted::Lowest(usize::MAX);
        settings
    }

    /// Returns these settings with the static responses to `loads` in the basis.
    fn with_motion(&self, loads: &Mat<f64>) -> Self {
        let mut tailoring = self.clone();
        if let Some(basis) = self.settings.basis.with_motion(loads) {
            tailoring.settings.basis = basis;
        }
        tailoring
    }

    /// Returns settings with the modes up to the highest band of the load cases; `None` if no band decides.
    fn settings_of_band(&self, cases: &LoadCases) -> Option<ConvertSettings> {
        let highest = largest_eigenvalue(cases).filter(|_| self.by_band)?;
        let mut settings = self.settings.clone();
        settings.modes.wanted = Wanted::Below(highest);
        Some(settings)
    }

    /// Computes the modes of `band_settings`. Uses the settings without a band if there is none, or if the body has no
    /// mode in the band.
    fn find_modes<'m>(
        &'m self,
        band_settings: Option<&'m ConvertSettings>,
        model: &'m FeModel,
        context: &Context<'_>,
    ) -> Result<ModalModel<'m>> {
        let Some(band_settings) = band_settings else {
            return ModalModel::find(model, &self.settings, context);
        };
        match ModalModel::find(model, band_settings, context) {
            Err(error) if error.has(Code::NoModes) => ModalModel::find(model, &self.settings, context),
            found => found,
        }
    }
}

/// Returns the loads whose static responses join the modes by default: the loads `stated` with the model or, without
/// these, the loads of the load cases.
pub fn loads_for(cases: Option<&LoadCases>, stated: &[LoadSource]) -> Vec<LoadSource> {
    if !stated.is_empty() {
        return stated.to_vec();
    }
    let WantedResponses { centrifugal, interfaces } =
        cases.map_or_else(WantedResponses::default, WantedResponses::of_any);
    let loads = [(centrifugal, LoadSource::Centrifugal), (interfaces, LoadSource::Interfaces)];
    loads.into_iter().filter(|(wanted, _)| *wanted).map(|(_, load)| load).collect()
}

/// Returns a basis of the given kind, computed from the model. It contains residual vectors of `loads` if the kind
/// takes them.
///
/// # Errors
/// [`Usage`](Code::Usage) for imported shapes, which are not computed from the model; errors of the files of loads.
pub fn computed_basis(kind: BasisKind, loads: &[LoadSource], model: &FeModel) -> Result<BasisChoice> {
    let residual_vectors = || read_loads(loads, model);
    match kind {
        BasisKind::Free | BasisKind::Scene => {
            Ok(BasisChoice::Free(FreeSurface { residual_vectors: residual_vectors()? }))
        }
        BasisKind::CraigBampton => Ok(BasisChoice::CraigBampton(CraigBampton)),
        BasisKind::CraigChang => {
            Ok(BasisChoice::CraigChang(CraigChang { residual_vectors: residual_vectors()? }))
        }
        BasisKind::Imported => {
            let message = "imported shapes are not computed from the model";
            let help = "read them from a file with flexbody convert --basis imported --shapes FILE";
            Err(Diagnostic::new(Code::Usage, message).with_help(help).into())
        }
    }
}

/// Reads the files that the loads of residual vectors need.
///
/// # Errors
/// The errors of [`read_shapes`] and [`UserLoads::new`].
fn read_loads(loads: &[LoadSource], model: &FeModel) -> Result<Vec<Loads>> {
    loads.iter().map(|set| read_set(set, model)).collect()
}

fn read_set(set: &LoadSource, model: &FeModel) -> Result<Loads> {
    match set {
        LoadSource::Centrifugal => Ok(Loads::Centrifugal),
        LoadSource::Interfaces => Ok(Loads::Interfaces),
        LoadSource::File(location) => {
            let raw = read_shapes(location, &model.row_counts(), "loads")?;
            UserLoads::new(model, raw).map(Loads::User)
        }
        LoadSource::At { loads, hertz } => {
            Ok(Loads::At { loads: Box::new(read_set(loads, model)?), hertz: *hertz })
        }
    }
}

/// Converts `model` to a body with the terms and modes that the load cases need. Terms that bounds of tier 0 rule out
/// are not computed; the rest is decided for the converted body. The scene files become sources of the body.
///
/// # Errors
/// The errors of [`convert`], [`enrich`] and [`select_judged`].
pub fn convert_for(
    model: &FeModel,
    tailoring: &Tailoring,
    cases: &LoadCases,
    context: &Context<'_>,
) -> Result<(Conversion, Selection)> {
    refuse_unfit(tailoring, cases)?;
    let condense = |modal: &ModalModel<'_>| {
        // Only the products of M with rigid motion are computed before the scenes rule out groups.
        let linear = modal.condense_linear();
        let terms = rule_out(&modal.body(&linear)?, cases, context)?;
        Ok(modal.condense_selected(linear, terms))
    };
    let mut enriched = tailoring.enriched(model, cases, false, context, condense)?;
    if tailoring.of_motion {
        enriched = tailoring.fewest_shapes(model, cases, enriched, context, condense)?;
    }
    let Enriched { made: mut conversion, rounds } = enriched;
    let varied_reference_errors = varied_errors(model, &conversion.body, cases, context)?;
    let selection = select_judged(&conversion.body, &rounds, &varied_reference_errors, cases, context)?;
    conversion.body = with_sources(selection.body(&conversion.body)?, cases)?;
    Ok((conversion, selection))
}

/// Converts `model` to a body that is enriched for the load cases and has the `stated` parts, without a selection: the
/// body that a recommendation of `trade` or `select` names.
///
/// # Errors
/// The errors of [`convert`], [`enrich`] and [`FlexBody::subset`]; FB801 if the motion has fewer shapes than stated.
pub fn convert_stated(
    model: &FeModel,
    tailoring: &Tailoring,
    cases: &LoadCases,
    stated: &StatedParts,
    context: &Context<'_>,
) -> Result<Conversion> {
    refuse_frame(tailoring)?;
    let condense = |modal: &ModalModel<'_>| Ok(modal.condense());
    let enriched = tailoring.enriched(model, cases, stated.is_fine, context, condense)?;
    let mut conversion = match stated.motion_shapes {
        Some(count) => {
            refuse_without_run(cases)?;
            tailoring.of_shapes(model, cases, &enriched.made.body, count, context)?
        }
        None => enriched.made,
    };
    conversion.body = with_sources(conversion.body.subset(&stated.subset)?, cases)?;
    Ok(conversion)
}

/// Returns the body with the scene and its histories among its sources.
fn with_sources(body: FlexBody, cases: &LoadCases) -> Result<FlexBody> {
    let mut parts = body.into_parts();
    let series = cases.iter().flat_map(|scene| &scene.series).map(|file| &file.source);
    for source in cases.iter().filter_map(|scene| scene.source.as_ref()).chain(series) {
        // Load cases share their scene file, and may share histories.
        if cases.len() == 1 || !parts.source.files.contains(source) {
            parts.source.files.push(source.clone());
        }
    }
    FlexBody::new(parts)
}

/// Returns an error if the settings or the scenes permit no conversion with selection, or no basis of a motion.
fn refuse_unfit(tailoring: &Tailoring, cases: &LoadCases) -> Result<()> {
    refuse_frame(tailoring)?;
    if !tailoring.of_motion {
        return Ok(());
    }
    if cases.iter().any(|scene| !scene.initial.modes.is_empty()) {
        let message = "--basis scene: `initial.mode` of the scene names modes by number, but the modes of this basis result from the simulated motion";
        let help = "remove `initial.mode` from the scene, or choose another --basis";
        return Err(Diagnostic::new(Code::Usage, message).with_help(help).into());
    }
    refuse_without_run(cases)
}

/// Returns an error if the body frame is fixed to an interface.
fn refuse_frame(tailoring: &Tailoring) -> Result<()> {
    if tailoring.settings.frame.interface().is_none() {
        return Ok(());
    }
    let message = "terms and modes can be chosen for a scene only if the body frame is at the centre of mass or that of the model, not fixed to an interface";
    let help = "leave --scene out, or use --frame com, principal or model";
    Err(Diagnostic::new(Code::Usage, message).with_help(help).into())
}

/// Returns an error if a scene has no simulated motion from which shapes could be computed.
fn refuse_without_run(cases: &LoadCases) -> Result<()> {
    if cases.iter().all(|scene| scene.run.duration.is_some()) {
        return Ok(());
    }
    let message = "--basis scene: the shapes are computed from a simulated motion, but the scene has no [run] with a duration";
    let help = "add `duration` under [run] in the scene file";
    Err(Diagnostic::new(Code::Usage, message).with_help(help).into())
}
