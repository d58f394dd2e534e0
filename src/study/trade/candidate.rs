//! What is tried.

use super::Source;
use crate::base::error::Result;
use crate::body::flex_body::{FlexBody, Group, Groups, Storage, TermDecision};
use crate::motion::scene::Trace;

/// Mode counts of a ladder: about three to a doubling of the work.
const LADDER: [usize; 14] = [1, 2, 4, 6, 10, 15, 20, 30, 40, 60, 80, 120, 160, 240];

/// What sets a candidate apart: a series of the plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Some of the modes, all groups of the kinetic energy.
    Modes,
    /// Some groups.
    Groups,
    /// Invariants of a lumped mass, with the modes of the consistent one.
    Lumped,
    /// Single precision.
    Single,
}

impl Kind {
    /// All kinds, in the order of plots.
    pub const ALL: [Kind; 4] = [Self::Modes, Self::Groups, Self::Lumped, Self::Single];

    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Modes => "all groups",
            Self::Groups => "some groups",
            Self::Lumped => "lumped mass",
            Self::Single => "single precision",
        }
    }
}

/// A body that could be used for a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Number of the [`Source`] that it is made of.
    pub source: usize,
    /// Modes of the source that it has (from 0), ascending.
    pub modes: Vec<usize>,
    /// Groups of the kinetic energy that it has.
    pub groups: Groups,
    /// Lumping scheme whose invariants it has.
    pub lumped: Option<String>,
    /// Precision of its numbers.
    pub storage: Storage,
}

impl Candidate {
    fn whole(source: usize, nf: usize) -> Self {
        Self { source, modes: (0..nf).collect(), groups: Groups::ALL, lumped: None, storage: Storage::F64 }
    }

    /// The kind: in what it differs from the whole body of its source.
    pub fn kind(&self) -> Kind {
        match self {
            Self { lumped: Some(_), .. } => Kind::Lumped,
            Self { storage: Storage::F32, .. } => Kind::Single,
            Self { groups, .. } if *groups != Groups::ALL => Kind::Groups,
            _ => Kind::Modes,
        }
    }

    /// Names of its groups.
    pub fn group_names(&self) -> Vec<&'static str> {
        Group::ALL.into_iter().filter(|group| self.groups.has(*group)).map(Group::name).collect()
    }

    /// The body.
    ///
    /// # Errors
    /// None for candidates of [`candidates`]; those of [`FlexBody::new`].
    pub(super) fn body(&self, source: &Source) -> Result<FlexBody> {
        let mut body = match &self.lumped {
            Some(scheme) => source.with_lumped_mass(scheme)?,
            None => source.body().clone(),
        };
        let all = self.modes.len() == body.n_modes();
        if !all || self.groups != body.groups() {
            let decide = |group: Group| TermDecision {
                group,
                kept: false,
                tier: 2,
                bound: f64::INFINITY,
                limit: f64::INFINITY,
                reason: "a candidate of a trade study".to_owned(),
            };
            body = body.reduced(&self.modes, self.groups, self.groups.dropped().map(decide).collect())?;
        }
        Ok(match self.storage {
            Storage::F64 => body,
            Storage::F32 => body.rounded_to_f32()?,
        })
    }
}

/// Every candidate of the sources, the first of which is the reference; `motion` is that of the reference. Bodies that are `carried` keep all
/// groups.
pub(super) fn candidates(sources: &[Source], motion: &Trace, carried: bool) -> Vec<Candidate> {
    let mut all = Vec::new();
    for (source, of) in sources.iter().enumerate() {
        let nf = of.body().n_modes();
        let whole = Candidate::whole(source, nf);
        let sensible = [Groups::ALL, Groups { w1: true, ..Groups::NONE }, Groups::NONE];
        if source > 0 {
            // Their modes are those of the reference, or others: what counts is how many and which.
            all.extend(sensible.map(|groups| Candidate { groups, ..whole.clone() }));
            continue;
        }
        all.push(whole.clone());
        let subsets =
            (0..7).rev().map(|bits| Groups { w1: bits & 4 != 0, w2: bits & 2 != 0, w3: bits & 1 != 0 });
        all.extend(subsets.map(|groups| Candidate { groups, ..whole.clone() }));
        all.extend(of.lumped().map(|scheme| Candidate { lumped: Some(scheme.to_owned()), ..whole.clone() }));
        all.push(Candidate { storage: Storage::F32, ..whole.clone() });
        let by_energy = by_energy(of.body(), motion);
        for &count in LADDER.iter().filter(|&&count| count < nf).rev() {
            let lowest: Vec<usize> = (0..count).collect();
            let mut liveliest = by_energy[..count].to_vec();
            liveliest.sort_unstable();
            let mut orders = vec![lowest];
            orders.extend((liveliest != orders[0]).then_some(liveliest));
            for modes in orders {
                all.extend(sensible.map(|groups| Candidate {
                    modes: modes.clone(),
                    groups,
                    ..whole.clone()
                }));
            }
        }
    }
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

/// Modes by the largest elastic energy that they have in a motion, the largest first.
fn by_energy(body: &FlexBody, motion: &Trace) -> Vec<usize> {
    let energy: Vec<f64> = (0..body.n_modes())
        .map(|j| {
            let most = motion.extremes.amplitudes[j];
            body.modes().eigenvalue[j] * most * most
        })
        .collect();
    let mut order: Vec<usize> = (0..energy.len()).collect();
    order.sort_by(|&a, &b| energy[b].total_cmp(&energy[a]));
    order
}
