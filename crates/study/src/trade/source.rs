//! Bodies from which candidates are made.

use super::Candidate;
use crate::recipe::{Origin, Recipe};
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, LumpedBody, MassStructure};
use flexbody_model::FeModel;
use flexbody_motion::dynamics::Configuration;
use flexbody_motion::scene::{ErrorHistory, FramedScene, Measure, ModeStart, OtherModes, Scene, Trace};
use nalgebra::DVector;

/// Body, and the coupling of its modes to those of the reference.
#[derive(Debug, Clone)]
pub struct Source {
    name: String,
    /// Body without lumped comparators.
    body: FlexBody,
    lumped: Vec<LumpedBody>,
    /// Scheme by which the mass of the model was lumped before the conversion; `None` for a consistent mass.
    lumped_by: Option<String>,
    /// Conversion that makes the body.
    recipe: Recipe,
    /// Time of the conversion; `None` if unknown. Unit: s.
    preprocessing: Option<f64>,
    /// G = Psi'K Psi_r (nf x nr) with the modes Psi_r of the reference; `None` for the reference itself.
    shared: Option<Mat<f64>>,
}

impl Source {
    /// Creates a source from the reference or a single body, made by `recipe`. `preprocessing` is the time of the
    /// conversion, if known. Unit: s.
    ///
    /// # Errors
    /// The errors of [`FlexBody::require_mean_axes`] and [`FlexBody::new`].
    pub fn new(
        name: impl Into<String>,
        body: FlexBody,
        recipe: Recipe,
        preprocessing: Option<f64>,
    ) -> Result<Self> {
        body.require_mean_axes("trade")?;
        let mut parts = body.into_parts();
        let lumped = std::mem::take(&mut parts.lumped);
        let (name, body) = (name.into(), FlexBody::new(parts)?);
        Ok(Self { name, body, lumped, lumped_by: None, recipe, preprocessing, shared: None })
    }

    /// Marks the source as a body of a model whose mass was lumped by `scheme`.
    pub fn of_lumped_mass(self, scheme: &str) -> Self {
        Self { lumped_by: Some(scheme.to_owned()), ..self }
    }

    /// Relates the source to the body `reference` of the same model. Returns `None` if one of the two does not belong
    /// to `model`.
    pub fn beside(mut self, reference: &FlexBody, model: &FeModel) -> Option<Self> {
        self.shared = Some(self.body.stiffness_beside(reference, model)?);
        Some(self)
    }

    /// Returns the source with its bodies in the frame of a scene.
    ///
    /// # Errors
    /// The errors of [`FramedScene::new`].
    pub(super) fn in_frame_of(&self, scene: &Scene) -> Result<Self> {
        let mut parts = self.body.clone().into_parts();
        parts.lumped = self.lumped.clone();
        let whole = FlexBody::new(parts)?;
        let mut parts = FramedScene::new(&whole, scene)?.body.into_owned().into_parts();
        let lumped = std::mem::take(&mut parts.lumped);
        Ok(Self { body: FlexBody::new(parts)?, lumped, ..self.clone() })
    }

    /// Returns the name of the source in reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the command that makes the body of `candidate`; `None` for a lumped mass, which serves for comparison.
    pub fn command(&self, candidate: &Candidate, origin: &Origin) -> Option<String> {
        let (subset, n_modes) = (candidate.subset(), self.body.n_modes());
        let is_exact = candidate.lumped.is_none() && self.lumped_by.is_none();
        is_exact.then(|| self.recipe.command(origin, &subset, n_modes, candidate.storage))
    }

    /// Returns the body, without lumped comparators.
    pub fn body(&self) -> &FlexBody {
        &self.body
    }

    /// Returns the time of the conversion, if known. Unit: s.
    pub fn preprocessing(&self) -> Option<f64> {
        self.preprocessing
    }

    /// Returns the lumping schemes of the comparators.
    pub fn lumped(&self) -> impl Iterator<Item = &str> {
        self.lumped.iter().map(|lumped| lumped.scheme.as_str())
    }

    /// Returns the scheme by which the mass was lumped before the modes were computed; `None` for a consistent mass.
    pub fn lumped_by(&self) -> Option<&str> {
        self.lumped_by.as_deref()
    }

    /// Returns the body with its own modal mass and all other invariants summed over the nodal masses of a scheme.
    /// Returns the body unchanged if no comparator has that scheme.
    pub(super) fn with_lumped_couplings(&self, scheme: &str) -> Result<FlexBody> {
        let mut parts = self.body.clone().into_parts();
        if let Some(lumped) = self.lumped.iter().find(|lumped| lumped.scheme == scheme) {
            parts.invariants = lumped.invariants.clone().with_modal_mass(self.body.invariants().modal_mass());
            parts.source.mass_structure = MassStructure::General;
        }
        FlexBody::new(parts)
    }

    /// Returns `scene` for a candidate with the `modes` of this body, with a motion that starts like `start` of the
    /// reference.
    ///
    /// Initial values of modes refer to the reference. Other modes get the projection of its deformation in elastic
    /// energy, q = L^-1 G q_r.
    pub(super) fn scene(
        &self,
        scene: &Scene,
        body: &FlexBody,
        modes: &[usize],
        start: &Configuration,
    ) -> Scene {
        let Some(shared) = &self.shared else { return scene.of_modes(modes) };
        let mut own = scene.clone();
        if own.initial.modes.is_empty() {
            return own;
        }
        // Solve L q = G q_r for displacements and rates, and start every mode with its part.
        let stiffness = body.invariants().symmetric_stiffness().cholesky();
        let part = |q: &[f64]| {
            let product = |&mode: &usize| q.iter().enumerate().map(|(j, q)| shared[(mode, j)] * q).sum();
            let sides = DVector::from_iterator(modes.len(), modes.iter().map(product));
            stiffness.as_ref().map_or_else(|| DVector::zeros(modes.len()), |factor| factor.solve(&sides))
        };
        let (q, qd) = (part(&start.q), part(&start.qd));
        let start_of = |mode: usize| ModeStart { mode, amplitude: q[mode], rate: qd[mode] };
        own.initial.modes = (0..modes.len()).map(start_of).collect();
        own
    }

    /// Returns the errors of the motion of a candidate with the `modes` of this body; `None` if its modes cannot be
    /// compared with those of the reference.
    pub(super) fn errors(
        &self,
        measure: &Measure<'_>,
        body: &FlexBody,
        modes: &[usize],
        motion: &Trace,
    ) -> Option<ErrorHistory> {
        let Some(shared) = &self.shared else { return Some(measure.of_subset(motion, modes)) };
        let shared = Mat::from_fn(modes.len(), shared.ncols(), |i, j| shared[(modes[i], j)]);
        let other = OtherModes::new(body, measure.body(), shared.as_ref())?;
        Some(measure.of_other(motion, &other))
    }
}
