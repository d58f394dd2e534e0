//! Candidates of a trade study.

use super::Source;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, Storage, Subset, TermGroup, TermGroups};

/// Numbers of modes of the candidates: about three for each doubling of the work.
const LADDER: [usize; 14] = [1, 2, 4, 6, 10, 15, 20, 30, 40, 60, 80, 120, 160, 240];

/// Kind of a candidate, which is a series of the plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
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
    pub const ALL: [CandidateKind; 4] = [Self::Modes, Self::Groups, Self::Lumped, Self::Single];

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
#[derive(Debug, Clone, PartialEq, Eq)]
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
        match self {
            Self::Couplings(_) => "couplings",
            Self::Whole(_) => "whole",
        }
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
        TermGroup::ALL.into_iter().filter(|group| self.groups.has(*group)).map(TermGroup::name).collect()
    }

    /// Returns the modes and groups of the source that the candidate keeps.
    pub fn subset(&self) -> Subset {
        Subset { modes: Some(self.modes.clone()), groups: self.groups }
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

/// Returns the candidates with all modes of a source, the reference first. Bodies that are `carried` keep all groups.
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

/// Returns the first `count` modes of an order, ascending.
pub(super) fn first_of(order: &[usize], count: usize) -> Vec<usize> {
    let mut modes = order[..count].to_vec();
    modes.sort_unstable();
    modes
}

/// Restricts candidates to the groups that their source holds, and removes duplicates. Carried bodies keep all groups.
fn held(mut all: Vec<Candidate>, sources: &[Source], carried: bool) -> Vec<Candidate> {
    for candidate in &mut all {
        let held = sources[candidate.source].body().groups();
        candidate.groups = if carried { held } else { candidate.groups.and(held) };
    }
    let mut distinct: Vec<Candidate> = Vec::with_capacity(all.len());
    for candidate in all {
        if !distinct.contains(&candidate) {
            distinct.push(candidate);
        }
    }
    distinct
}
