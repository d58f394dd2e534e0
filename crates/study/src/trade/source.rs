//! A body that candidates are made of.

use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, LumpedBody, MassStructure};
use flexbody_model::FeModel;
use flexbody_motion::dynamics::Configuration;
use flexbody_motion::scene::{ErrorHistory, Measure, ModeStart, OtherModes, Scene, Stage, Trace};
use nalgebra::DVector;

/// A body, and how its modes are seen from those of the reference.
#[derive(Debug, Clone)]
pub struct Source {
    name: String,
    /// Without lumped comparators.
    body: FlexBody,
    lumped: Vec<LumpedBody>,
    /// Scheme by which the mass of the model was lumped before this body was made of it.
    lumped_by: Option<String>,
    /// What it took to make it. Unit: s.
    preprocessing: Option<f64>,
    /// G = Psi'K Psi_r (nf x nr) with the modes Psi_r of the reference; none of the reference itself.
    shared: Option<Mat<f64>>,
}

impl Source {
    /// The reference, or a body alone; with the time that it took to make it, where that is known.
    ///
    /// # Errors
    /// Every error of [`FlexBody::require_mean_axes`].
    pub fn new(name: impl Into<String>, body: FlexBody, preprocessing: Option<f64>) -> Result<Self> {
        body.require_mean_axes("trade")?;
        let mut parts = body.into_parts();
        let lumped = std::mem::take(&mut parts.lumped);
        let (name, body) = (name.into(), FlexBody::new(parts)?);
        Ok(Self { name, body, lumped, lumped_by: None, preprocessing, shared: None })
    }

    /// The same, as a body of a model whose mass was lumped by a scheme.
    pub fn of_lumped_mass(self, scheme: &str) -> Self {
        Self { lumped_by: Some(scheme.to_owned()), ..self }
    }

    /// The same as a candidate beside the body `reference` of the same model; `None` when one of them is not
    /// of `model`.
    pub fn beside(mut self, reference: &FlexBody, model: &FeModel) -> Option<Self> {
        self.shared = Some(self.body.stiffness_beside(reference, model)?);
        Some(self)
    }

    /// This source with its bodies in the frame of a scene.
    ///
    /// # Errors
    /// Those of [`Stage::new`].
    pub(super) fn staged(&self, scene: &Scene) -> Result<Self> {
        let mut parts = self.body.clone().into_parts();
        parts.lumped = self.lumped.clone();
        let whole = FlexBody::new(parts)?;
        let mut parts = Stage::new(&whole, scene)?.body.into_owned().into_parts();
        let lumped = std::mem::take(&mut parts.lumped);
        Ok(Self { body: FlexBody::new(parts)?, lumped, ..self.clone() })
    }

    /// Name of the source in reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The body, without lumped comparators.
    pub fn body(&self) -> &FlexBody {
        &self.body
    }

    /// Seconds that it took to make it.
    pub fn preprocessing(&self) -> Option<f64> {
        self.preprocessing
    }

    /// Lumping schemes.
    pub fn lumped(&self) -> impl Iterator<Item = &str> {
        self.lumped.iter().map(|lumped| lumped.scheme.as_str())
    }

    /// The scheme by which the mass was lumped before the modes were computed; `None` of a consistent mass.
    pub fn lumped_by(&self) -> Option<&str> {
        self.lumped_by.as_deref()
    }

    /// The body with its own modal mass and everything else summed over the nodal masses of a scheme; itself
    /// where there is none of that name.
    pub(super) fn with_lumped_couplings(&self, scheme: &str) -> Result<FlexBody> {
        let mut parts = self.body.clone().into_parts();
        if let Some(lumped) = self.lumped.iter().find(|lumped| lumped.scheme == scheme) {
            parts.invariants = lumped.invariants.clone().with_modal_mass(self.body.invariants().modal_mass());
            parts.source.mass_structure = MassStructure::General;
        }
        FlexBody::new(parts)
    }

    /// `scene` for a candidate with the `modes` of this body, a motion that starts as `start` of the
    /// reference does.
    ///
    /// Modes of the start are those of the reference; other modes take the part of its deformation that is
    /// nearest to it in elastic energy, q = L^-1 G q_r.
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

    /// Errors of the motion of a candidate with the `modes` of this body; `None` where its modes cannot be
    /// compared.
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
