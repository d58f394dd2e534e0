//! Conversion of a model as a user requests it, with every refusal of a contradictory request and of a result that was not
//! judged. The commands, the library and the Python package convert by this request.

use crate::reference::ReferenceError;
use crate::selection::Selection;
use crate::tailoring::{StatedParts, Tailoring, computed_basis, convert_for, convert_stated, loads_for};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::units::UnitSystem;
use flexbody_body::basis::{BasisChoice, BasisKind, ImportedShapes, ModeSettings};
use flexbody_body::convert::{Conversion, ConvertSettings, Lumping, MeshChoice, StressLoads, convert};
use flexbody_body::flex_body::{FlexBody, LoadKind, Storage, UnitLoad};
use flexbody_body::invariants::FrameChoice;
use flexbody_body::verification::accept;
use flexbody_eigen::{Accuracy, FactorChoice, Method, Wanted};
use flexbody_input::{ImportedColumns, LoadSource, MatrixLocation, read_imported};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::dynamics::indefinite_inertia;
use flexbody_motion::scene::LoadCases;
use std::path::{Path, PathBuf};

/// Message about residual vectors of a basis without free modes.
pub const RESIDUALS_NEED_FREE_MODES: &str = "residual vectors need --basis free or craig-chang; craig-bampton has the responses to loads at its interfaces: leave --residual-vectors out";

/// Request of a conversion. By default 20 free-surface modes, proved complete, about the centre of mass along the axes of
/// the model, compared with both lumped masses.
#[derive(Debug, Clone, PartialEq)]
pub struct ConversionRequest {
    /// Number of modes; `None` for those up to `max_frequency`, in the band of a scene, or the default number.
    pub modes: Option<usize>,
    /// Highest frequency of the modes; `None` for a number of modes. Unit: Hz.
    pub max_frequency: Option<f64>,
    /// Kind of the basis.
    pub basis: BasisKind,
    /// File of the shapes of an imported basis.
    pub shapes: Option<MatrixLocation>,
    /// Loads of residual vectors; `None` for those of the manifest or, without these, those of the scene.
    pub residual_vectors: Option<Vec<LoadSource>>,
    /// Accuracy of the modes.
    pub accuracy: Accuracy,
    /// Precision of the factor.
    pub factor: FactorChoice,
    /// Body frame.
    pub frame: FrameChoice,
    /// Lumped masses for comparison.
    pub lumped: Vec<Lumping>,
    /// True if the modes of each lumped mass are compared too.
    pub lumped_modes: bool,
    /// Surface of the body.
    pub mesh: MeshChoice,
    /// Loads whose stress stiffness is computed from the elements of the deck; `None` computes none, and lets the result
    /// [offer](Converted::offered_stiffness) what could be computed.
    pub stress_stiffness: Option<StressLoads>,
    /// Floats of shapes and of the inertia of the modes.
    pub storage: Storage,
    /// Parts of the body that are stated; `None` if a scene selects them, and for the whole body without a scene.
    pub stated: Option<StatedParts>,
    /// True if a body is returned although the selection for its scene does not hold, or cannot be judged.
    pub allow_unjudged: bool,
    /// File of the scene, which errors name; `None` for a scene that is no file.
    pub scene_file: Option<PathBuf>,
}

impl Default for ConversionRequest {
    fn default() -> Self {
        let ConvertSettings { lumped, mesh, .. } = ConvertSettings::default();
        Self {
            modes: None,
            max_frequency: None,
            basis: BasisKind::default(),
            shapes: None,
            residual_vectors: None,
            accuracy: Accuracy::default(),
            factor: FactorChoice::default(),
            frame: FrameChoice::default(),
            lumped,
            lumped_modes: false,
            mesh,
            stress_stiffness: None,
            storage: Storage::default(),
            stated: None,
            allow_unjudged: false,
            scene_file: None,
        }
    }
}

/// Result of a conversion.
#[derive(Debug, Clone)]
pub struct Converted {
    /// Body with the diagnostics and counters of its conversion.
    pub conversion: Conversion,
    /// Decisions about terms and modes; `None` without a scene, and if the parts were stated.
    pub selection: Option<Selection>,
    /// Loads whose stress stiffness the body does not have although the deck describes the elements; empty if the request
    /// states the loads, `none` among them.
    pub offered_stiffness: StressLoads,
}

impl Converted {
    fn new(conversion: Conversion, selection: Option<Selection>) -> Self {
        Self { conversion, selection, offered_stiffness: StressLoads::default() }
    }

    /// Returns the diagnostics of the conversion and of the selection.
    pub fn diagnostics(&self) -> Vec<Diagnostic> {
        let selected = self.selection.iter().flat_map(|selection| &selection.diagnostics);
        self.conversion.diagnostics.iter().chain(selected).cloned().collect()
    }

    /// Refuses a body whose selection does not hold.
    ///
    /// # Errors
    /// [`SelectionUnjudged`](Code::SelectionUnjudged) after the diagnostics of the conversion, which state the reason.
    fn refuse_unjudged(&self) -> Result<()> {
        let Some(selection) = self.selection.as_ref().filter(|selection| !selection.holds()) else {
            return Ok(());
        };
        let unfit = selection.reference_errors.last().filter(|own| !ReferenceError::is_reference(own));
        let message = match unfit {
            Some(own) => {
                let error = match own.unknown {
                    Some(reason) => format!("not known ({reason})"),
                    None => format!("about {} of the tolerances, more than half", own.part_of_tolerances()),
                };
                format!(
                    "no file was written: the error of the reference body of {} modes is {error}, so that the selection cannot be judged",
                    own.modes
                )
            }
            None => {
                "no file was written: the selected modes and terms do not meet the tolerances of the scene"
                    .to_owned()
            }
        };
        let refused = Error::from(Diagnostic::new(Code::SelectionUnjudged, message));
        Err(refused.after(self.diagnostics()))
    }
}

impl ConversionRequest {
    /// Returns the loads of residual vectors: those requested, or those of the manifest or, without these, those of the
    /// load cases where the basis follows the scene.
    pub fn loads(&self, of_manifest: &[LoadSource], cases: Option<&LoadCases>) -> Vec<LoadSource> {
        let follows =
            self.basis.follows_scene() && self.accuracy != Accuracy::Certified && !self.lumped_modes;
        let default = || loads_for(cases.filter(|_| follows), of_manifest);
        self.residual_vectors.clone().unwrap_or_else(default)
    }

    /// Returns settings of the search for modes.
    pub fn mode_settings(&self, units: &UnitSystem) -> ModeSettings {
        let wanted = match (self.max_frequency, self.modes, self.basis) {
            (Some(hertz), ..) => Wanted::Below(units.eigenvalue_of(hertz)),
            (None, Some(modes), _) => Wanted::Lowest(modes),
            (None, None, BasisKind::Imported) => Wanted::Lowest(usize::MAX),
            (None, None, _) => Wanted::Lowest(ModeSettings::DEFAULT_COUNT),
        };
        let (accuracy, factor) = (self.accuracy, self.factor);
        ModeSettings { wanted, accuracy, method: Method::Auto, factor, ..ModeSettings::default() }
    }

    /// Refuses contradictory settings.
    ///
    /// * `loads`: loads of residual vectors, see [`ConversionRequest::loads`].
    /// * `has_scene`: true if the body is made for a scene.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) with the settings that contradict each other.
    pub fn check(&self, loads: &[LoadSource], has_scene: bool) -> Result<()> {
        if self.modes == Some(0) && self.basis != BasisKind::CraigBampton {
            let message = "--modes 0 leaves the body without modes: only --basis craig-bampton has static shapes besides";
            let help = "give --modes 1 or more, or --basis craig-bampton for static condensation";
            return Err(Diagnostic::new(Code::Usage, message).with_help(help).into());
        }
        refuse_contradiction(&self.rules(loads, has_scene))
    }

    /// Returns each contradiction: true if the request has it, and the message about it.
    fn rules(&self, loads: &[LoadSource], has_scene: bool) -> [(bool, &'static str); 10] {
        let of_motion = self.basis == BasisKind::Scene;
        let is_certified = self.accuracy == Accuracy::Certified;
        let states_shapes = self.stated.as_ref().is_some_and(|stated| stated.motion_shapes.is_some());
        let has_residuals = !loads.is_empty();
        let is_coupled = matches!(self.basis, BasisKind::CraigBampton | BasisKind::CraigChang);
        [
            (of_motion && !has_scene, "--basis scene needs --scene"),
            (states_shapes && !of_motion, "--motion-shapes needs --basis scene"),
            (
                of_motion && self.stated.is_some() && !states_shapes,
                "--basis scene with --terms or --keep-modes needs the number of shapes: --motion-shapes",
            ),
            (
                is_certified && (of_motion || is_coupled && !has_residuals),
                "the modes of this basis are not eigenvectors and cannot be certified",
            ),
            (self.shapes.is_some() && self.basis != BasisKind::Imported, "--shapes needs --basis imported"),
            (
                is_certified && self.storage == Storage::F32,
                "--storage f32 rounds the numbers that --accuracy certified guarantees: use --storage f64",
            ),
            (has_residuals && !self.basis.searches_free_modes(), RESIDUALS_NEED_FREE_MODES),
            (
                has_residuals && self.lumped_modes,
                "--lumped-modes compares free-surface modes, not residual vectors",
            ),
            (has_residuals && is_certified, "residual vectors are not eigenvectors and cannot be certified"),
            (
                self.lumped_modes && self.basis != BasisKind::Free,
                "--lumped-modes compares free-surface modes: it needs --basis free",
            ),
        ]
    }

    /// Converts `model`. The body passes every check of `flexbody check`; for load cases it has the terms and modes that
    /// they need, or the stated ones.
    ///
    /// * `of_manifest`: loads of residual vectors that the manifest of the model states.
    /// * `solved`: basis of modes that another program has found; `None` to compute the basis.
    ///
    /// # Errors
    /// The errors of [`ConversionRequest::check`]; the errors of [`convert`], [`convert_for`] and [`convert_stated`];
    /// [`SelectionUnjudged`](Code::SelectionUnjudged) for a body whose selection does not hold, unless it is allowed;
    /// [`BodyUntrustworthy`](Code::BodyUntrustworthy) if an identity does not hold.
    pub fn convert(
        &self,
        model: &FeModel,
        of_manifest: &[LoadSource],
        cases: Option<&LoadCases>,
        solved: Option<BasisChoice>,
        context: &Context<'_>,
    ) -> Result<Converted> {
        let loads = self.loads(of_manifest, cases);
        self.check(&loads, cases.is_some())?;
        let settings = ConvertSettings {
            modes: self.mode_settings(model.units()),
            basis: solved.map_or_else(|| self.basis(model, &loads), Ok)?,
            frame: self.frame.clone(),
            lumped: self.lumped.clone(),
            lumped_modes: self.lumped_modes,
            mesh: self.mesh,
            stress_stiffness: self.stress_stiffness.unwrap_or_default(),
        };
        let mut made = match cases {
            Some(cases) => self
                .for_cases(model, settings, cases, context)
                .map_err(|error| in_scene_file(error, self.scene_file.as_deref()))?,
            None => self.without_scene(model, &settings, context)?,
        };
        if !self.allow_unjudged {
            made.refuse_unjudged()?;
        }
        if self.storage == Storage::F32 {
            made.conversion.body = made.conversion.body.rounded_to_f32()?;
        }
        accept(&made.conversion.body)?;
        if self.stress_stiffness.is_none() && model.describes_elements() {
            made.offered_stiffness = absent_stiffness(&made.conversion.body);
        }
        Ok(made)
    }

    /// Returns the basis, with the shapes that it needs.
    fn basis(&self, model: &FeModel, loads: &[LoadSource]) -> Result<BasisChoice> {
        let (BasisKind::Imported, Some(location)) = (self.basis, &self.shapes) else {
            return computed_basis(self.basis, loads, model);
        };
        let imported = match read_imported(location, &model.row_counts(), "shapes")? {
            ImportedColumns::Rows(raw) => ImportedShapes::new(model, raw),
            ImportedColumns::Modes(raw) => ImportedShapes::of_modes(model, raw),
        };
        imported.map(BasisChoice::Imported)
    }

    fn without_scene(
        &self,
        model: &FeModel,
        settings: &ConvertSettings,
        context: &Context<'_>,
    ) -> Result<Converted> {
        let mut conversion = convert(model, settings, context)?;
        if let Some(stated) = &self.stated {
            conversion.body = conversion.body.subset(&stated.subset)?;
            conversion = noted(conversion);
        }
        Ok(Converted::new(conversion, None))
    }

    fn for_cases(
        &self,
        model: &FeModel,
        settings: ConvertSettings,
        cases: &LoadCases,
        context: &Context<'_>,
    ) -> Result<Converted> {
        let by_band = self.modes.is_none() && self.max_frequency.is_none() && self.basis.follows_scene();
        let tailoring = Tailoring { settings, by_band, of_motion: self.basis == BasisKind::Scene };
        if let Some(stated) = &self.stated {
            let conversion = noted(convert_stated(model, &tailoring, cases, stated, context)?);
            return Ok(Converted::new(conversion, None));
        }
        let (conversion, selection) = convert_for(model, &tailoring, cases, context)?;
        Ok(Converted::new(conversion, Some(selection)))
    }
}

/// Returns the loads of motion and interfaces whose geometric stiffness the body does not have. A body with that of spin
/// lacks none: what its maker left out is not wanted.
fn absent_stiffness(body: &FlexBody) -> StressLoads {
    if body.has_spin_stiffness() || body.missing_stiffness(true).is_empty() {
        return StressLoads::default();
    }
    let is_at_interface = |one: &UnitLoad| matches!(one.kind, LoadKind::Force(_) | LoadKind::Moment(_));
    let interfaces = body.interfaces().iter().any(|interface| interface.reference.is_some())
        && !body.geometric_stiffness().iter().any(|stiffness| is_at_interface(&stiffness.load));
    StressLoads { spin: true, interfaces, loads: false }
}

/// Refuses the first contradiction that a request has.
///
/// * `rules`: true if the request has the contradiction, and the message about it.
///
/// # Errors
/// [`Usage`](Code::Usage) with that message.
pub fn refuse_contradiction(rules: &[(bool, &str)]) -> Result<()> {
    match rules.iter().find(|(contradicts, _)| *contradicts) {
        Some((_, message)) => Err(Diagnostic::new(Code::Usage, *message).into()),
        None => Ok(()),
    }
}

/// Returns the error with the file of the scene where its diagnostics name no file.
pub(crate) fn in_scene_file(error: Error, file: Option<&Path>) -> Error {
    match file {
        Some(file) => error.in_file(file),
        None => error,
    }
}

/// Returns the conversion with a warning if the stated terms let deflections make the inertia indefinite.
fn noted(mut conversion: Conversion) -> Conversion {
    conversion.diagnostics.extend(indefinite_inertia(&conversion.body));
    conversion
}
