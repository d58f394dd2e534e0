//! Candidates of a trade study, and the bodies from which they are made.

use crate::recipe::{Origin, Recipe};
use crate::selection::first_of;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, LumpedBody, MassStructure, Storage, Subset, TermGroup, TermGroups};
use flexbody_model::FeModel;
use flexbody_motion::dynamics::Configuration;
use flexbody_motion::scene::{ErrorHistory, FramedScene, Measure, ModeStart, OtherModes, Scene, Trace};
use nalgebra::DVector;

/// Numbers of modes of the candidates: about three for each doubling of the work.
const LADDER: [usize; 14] = [1, 2, 4, 6, 10, 15, 20, 30, 40, 60, 80, 120, 160, 240];

/// Kind of a candidate, which is a series of the plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, strum::VariantArray)]
#[serde(rename_all = "lowercase")]
pub enum CandidateKind {
    /// Some of the modes, all groups of the kinetic energy.
    Modes,
    /// Some groups.
    Groups,
    /// Lumped mass, as multibody programs use it.
    Lumped,
    /// Single precision.
    Single,
}

impl CandidateKind {
    /// All kinds, in the order of plots.
    pub const ALL: &'static [Self] = <Self as strum::VariantArray>::VARIANTS;

    /// Returns the name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Modes => "all groups",
            Self::Groups => "some groups",
            Self::Lumped => "lumped mass",
            Self::Single => "single precision",
        }
    }
}

/// Lumped part of the mass and name of the scheme: the two practices of multibody programs.
#[derive(Debug, Clone, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
pub enum LumpedMass {
    /// Modes and modal mass of the consistent mass; the rigid body and all couplings are summed over nodal masses. This
    /// corresponds to a modal neutral file, which holds modes, generalised masses and nodal masses.
    Couplings(String),
    /// Whole mass lumped before the modes are computed: an FE model with a lumped mass matrix.
    Whole(String),
}

impl LumpedMass {
    /// Returns the name of the scheme.
    pub fn scheme(&self) -> &str {
        match self {
            Self::Couplings(scheme) | Self::Whole(scheme) => scheme,
        }
    }

    /// Returns the lumped part: `couplings` or `whole`.
    pub fn part(&self) -> &'static str {
        self.into()
    }
}

/// Body that could be used for a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Index of the [`Source`] that it is made of.
    pub source: usize,
    /// Modes of the source that it has (from 0), ascending.
    pub modes: Vec<usize>,
    /// Groups of the kinetic energy that it has.
    pub groups: TermGroups,
    /// Lumped part of its mass; `None` for a consistent mass.
    pub lumped: Option<LumpedMass>,
    /// Precision of its numbers.
    pub storage: Storage,
}

impl Candidate {
    fn whole(source: usize, nf: usize) -> Self {
        Self {
            source,
            modes: (0..nf).collect(),
            groups: TermGroups::ALL,
            lumped: None,
            storage: Storage::F64,
        }
    }

    /// Returns the kind: the respect in which it differs from the whole body of its source.
    pub fn kind(&self) -> CandidateKind {
        match self {
            Self { lumped: Some(_), .. } => CandidateKind::Lumped,
            Self { storage: Storage::F32, .. } => CandidateKind::Single,
            Self { groups, .. } if *groups != TermGroups::ALL => CandidateKind::Groups,
            _ => CandidateKind::Modes,
        }
    }

    /// Returns the names of its groups.
    pub fn group_names(&self) -> Vec<&'static str> {
        self.groups.kept().map(TermGroup::name).collect()
    }

    /// Returns the modes and groups of the source that the candidate keeps.
    pub fn subset(&self) -> Subset {
        Subset { modes: Some(self.modes.clone()), groups: self.groups, ..Subset::default() }
    }

    /// Returns the body of the candidate.
    ///
    /// # Errors
    /// The errors of [`FlexBody::new`], which only lumped masses cause.
    pub fn body(&self, source: &Source) -> Result<FlexBody> {
        let mut body = match &self.lumped {
            Some(LumpedMass::Couplings(scheme)) => source.with_lumped_couplings(scheme)?,
            Some(LumpedMass::Whole(_)) | None => source.body().clone(),
        };
        body = body.subset(&self.subset())?;
        Ok(match self.storage {
            Storage::F64 => body,
            Storage::F32 => body.rounded_to_f32()?,
        })
    }
}

/// Sets of groups that are combined with numbers of modes, the cheapest first.
const SETS: [TermGroups; 3] =
    [TermGroups::NONE, TermGroups { w1: true, ..TermGroups::NONE }, TermGroups::ALL];

/// Largest error over its tolerance, with all modes, at which a set of groups is combined with fewer modes.
const MAX_ERROR_OF_GROUPS: f64 = 10.0;
/// Error over its tolerance below which more expensive sets of groups are not combined, since they cannot be
/// distinguished.
const PERFECT: f64 = 0.01;

/// Returns the candidates with all modes of a source, the reference first. Bodies that are `carried` have W2 and W3 only beside W1.
pub(super) fn whole_candidates(sources: &[Source], carried: bool) -> Vec<Candidate> {
    let mut all = Vec::new();
    for (source, of) in sources.iter().enumerate() {
        let whole = Candidate::whole(source, of.body().n_modes());
        if let Some(scheme) = of.lumped_by() {
            all.push(Candidate { lumped: Some(LumpedMass::Whole(scheme.to_owned())), ..whole });
            continue;
        }
        if source > 0 {
            // Modes of other sources differ from those of the reference: a few sets of groups suffice.
            all.extend(SETS.into_iter().rev().map(|groups| Candidate { groups, ..whole.clone() }));
            continue;
        }
        let subsets =
            (0..8).rev().map(|bits| TermGroups { w1: bits & 4 != 0, w2: bits & 2 != 0, w3: bits & 1 != 0 });
        all.extend(subsets.map(|groups| Candidate { groups, ..whole.clone() }));
        let couplings = |scheme: &str| Some(LumpedMass::Couplings(scheme.to_owned()));
        all.extend(of.lumped().map(|scheme| Candidate { lumped: couplings(scheme), ..whole.clone() }));
        all.push(Candidate { storage: Storage::F32, ..whole });
    }
    held(all, sources, carried)
}

/// Returns the candidates with some modes of the reference (the lowest, and the first of `most_excited`) and the sets of
/// groups that are useful. `worst_of` receives a set of groups and returns its largest error over its tolerance with
/// all modes.
pub(super) fn ladder(
    sources: &[Source],
    most_excited: &[usize],
    carried: bool,
    worst_of: impl Fn(TermGroups) -> f64,
) -> Vec<Candidate> {
    let body = sources[0].body();
    // Sets of groups whose errors with all modes are acceptable.
    let mut sets = Vec::new();
    for groups in SETS {
        let worst = worst_of(groups.and(body.groups()));
        sets.extend((worst <= MAX_ERROR_OF_GROUPS || groups == TermGroups::ALL).then_some(groups));
        if worst <= PERFECT {
            break;
        }
    }
    let whole = Candidate::whole(0, body.n_modes());
    let mut all = Vec::new();
    for &count in LADDER.iter().filter(|&&count| count < body.n_modes()).rev() {
        // The lowest modes, and the modes of largest contribution.
        for modes in [(0..count).collect(), first_of(most_excited, count)] {
            let with =
                |groups: &TermGroups| Candidate { modes: modes.clone(), groups: *groups, ..whole.clone() };
            all.extend(sets.iter().rev().map(with));
        }
    }
    held(all, sources, carried)
}

/// Restricts candidates to the groups that their source holds, and removes duplicates. Carried bodies have W2 and W3 only
/// beside W1.
fn held(mut all: Vec<Candidate>, sources: &[Source], carried: bool) -> Vec<Candidate> {
    for candidate in &mut all {
        let held = sources[candidate.source].body().groups();
        let groups = candidate.groups.and(held);
        candidate.groups = if carried { groups.in_carried_modes() } else { groups };
    }
    let mut distinct: Vec<Candidate> = Vec::with_capacity(all.len());
    for candidate in all {
        if !distinct.contains(&candidate) {
            distinct.push(candidate);
        }
    }
    distinct
}

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
    fn with_lumped_couplings(&self, scheme: &str) -> Result<FlexBody> {
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
