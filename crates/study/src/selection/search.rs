//! The search for a cheaper model, by measured motion.

use super::cases::{Case, sets_in, together, worst};
use super::trial::{ModeShare, Trial, TrialRuns, multiplications};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_motion::scene::{Measure, Scene, Tolerance, Trace};

/// Part of the rest that dropped terms may take before modes are dropped; all of it with the modes that are
/// kept.
const PART_OF_TERMS: f64 = 0.5;

/// Terms and modes that are chosen so far.
pub(super) struct Choice {
    pub groups: TermGroups,
    pub modes: Vec<usize>,
    pub shares: Vec<ModeShare>,
    pub chosen: Option<Trial>,
}

impl Choice {
    /// Keeps these modes.
    fn keep(&mut self, modes: Vec<usize>) {
        for (j, share) in self.shares.iter_mut().enumerate() {
            share.kept = modes.binary_search(&j).is_ok();
        }
        self.modes = modes;
    }
}

/// What modes do beside the tolerances.
fn weights(shares: &[ModeShare], tolerance: &Tolerance) -> Vec<f64> {
    let weight = |share: &ModeShare| {
        (share.deflection / tolerance.errors.deflection).max(share.stress / tolerance.errors.stress)
    };
    shares.iter().map(weight).collect()
}

/// Modes by their weights, most first.
fn by_weight(weights: &[f64]) -> Vec<usize> {
    let mut ranked: Vec<usize> = (0..weights.len()).collect();
    ranked.sort_by(|a, b| weights[*b].total_cmp(&weights[*a]).then(a.cmp(b)));
    ranked
}

/// Modes of a body by what they do in its motion in the scene, most first: the order in which
/// [`select`](super::select) keeps them. Of several load cases, for each the body in its frame, the scene and
/// the motion, by the most that each mode does beside the tolerances of any.
///
/// # Errors
/// FB212 where a scene does not fit the body.
pub fn liveliest_modes(cases: &[(&FlexBody, &Scene, &Trace)]) -> Result<Vec<usize>> {
    let mut weight = vec![0.0f64; cases.first().map_or(0, |(body, ..)| body.n_modes())];
    for (body, scene, motion) in cases {
        let case = Case::new(body, scene, &Context::QUIET)?;
        let own = weights(&case.runs().shares(motion), &scene.requirements.tolerance);
        weight.iter_mut().zip(own).for_each(|(weight, own)| *weight = weight.max(own));
    }
    Ok(by_weight(&weight))
}

/// A scene that models are tried in, with the motion that they are measured against.
pub(super) struct Tried<'s> {
    pub runs: TrialRuns<'s>,
    pub measure: Measure<'s>,
}

/// The scenes of one load case.
pub(super) struct TriedCase<'s> {
    pub tried: Vec<Tried<'s>>,
    /// What is left of the tolerances.
    pub budget: f64,
}

/// The search for a model that holds in all load cases.
pub(super) struct SelectionSearch<'s> {
    /// One at least.
    pub cases: &'s [TriedCase<'s>],
    /// Groups that have to stay: a run that turns slower than its scene allows shows of no term that it may
    /// be dropped.
    pub fixed: TermGroups,
    /// Whether something carries the body in a case: all groups stay then.
    pub carried: bool,
}

impl SelectionSearch<'_> {
    fn body(&self) -> &FlexBody {
        self.cases[0].tried[0].runs.body
    }

    /// A model tried in all load cases; it may spend `part` of what is left of the tolerances of each.
    fn measured(&self, modes: &[usize], groups: TermGroups, part: f64) -> Result<Trial> {
        let in_case = |case: &TriedCase<'_>| -> Result<Trial> {
            let measured = |Tried { runs, measure }: &Tried<'_>| -> Result<Trial> {
                Ok(runs.measured(measure, modes, groups, part * case.budget)?.0)
            };
            Ok(worst(case.tried.iter().map(measured).collect::<Result<Vec<_>>>()?.into_iter()))
        };
        Ok(together(self.cases.iter().map(in_case).collect::<Result<Vec<_>>>()?))
    }

    /// The cheapest groups with all modes; they leave a part of the tolerances for these.
    pub(super) fn terms(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        self.cheapest(PART_OF_TERMS, choice, trials)
    }

    /// Cheaper groups with the modes that are kept, where these take less of the tolerances than was left to
    /// them.
    pub(super) fn fewer_terms(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        self.cheapest(1.0, choice, trials)
    }

    /// The first set of groups whose motion is within a part of the tolerances.
    fn cheapest(&self, part: f64, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        let smaller = sets_in(self.carried)
            .filter(|set| *set != choice.groups && set.and(choice.groups) == *set)
            .filter(|set| set.and(self.fixed) == self.fixed);
        for groups in smaller.collect::<Vec<_>>() {
            let trial = self.measured(&choice.modes, groups, part)?;
            let passed = trial.passed();
            trials.push(trial);
            if passed {
                choice.groups = groups;
                break;
            }
        }
        Ok(())
    }

    /// Modes by what they do, most first.
    fn ranked(&self, choice: &mut Choice) -> Vec<usize> {
        let mut weight = vec![0.0f64; self.body().n_modes()];
        choice.shares.clear();
        for case in self.cases {
            for Tried { runs, measure } in &case.tried {
                let shares = runs.shares(measure.trace());
                let own = weights(&shares, &runs.scene.requirements.tolerance);
                weight.iter_mut().zip(own).for_each(|(weight, own)| *weight = weight.max(own));
                if choice.shares.is_empty() {
                    choice.shares = shares;
                    continue;
                }
                for (share, other) in choice.shares.iter_mut().zip(shares) {
                    share.amplitude = share.amplitude.max(other.amplitude);
                    share.deflection = share.deflection.max(other.deflection);
                    share.stress = share.stress.max(other.stress);
                }
            }
        }
        by_weight(&weight)
    }

    /// The fewest modes, in the order of what they do, whose motion is within the tolerances.
    pub(super) fn modes(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        let ranked = self.ranked(choice);
        let first = |count: usize| {
            let mut modes = ranked[..count].to_vec();
            modes.sort_unstable();
            modes
        };
        // More modes are not always better, but nearly: bisection, and the last that passed counts.
        let (mut too_few, mut enough) = (0, ranked.len());
        while too_few + 1 < enough {
            let count = too_few.midpoint(enough);
            let trial = self.measured(&first(count), choice.groups, 1.0)?;
            if trial.passed() {
                enough = count;
            } else {
                too_few = count;
            }
            trials.push(trial);
        }
        choice.keep(first(enough));
        Ok(())
    }

    /// The most accurate model of at most `most` multiplications: for every set of groups as many modes as
    /// that allows. False where every model takes more.
    pub(super) fn within_cost(
        &self,
        most: usize,
        choice: &mut Choice,
        trials: &mut Vec<Trial>,
    ) -> Result<bool> {
        let ranked = self.ranked(choice);
        let mut best: Option<(f64, TermGroups, Vec<usize>)> = None;
        for groups in sets_in(self.carried) {
            if groups.and(choice.groups) != groups {
                continue;
            }
            let cost = |count: usize| -> Result<usize> {
                let modes: Vec<usize> = (0..count).collect();
                let body = self.body().reduced(&modes, self.body().invariants().groups(), Vec::new())?;
                Ok(multiplications(&body, groups))
            };
            // The cost grows with the number of modes.
            let (mut fits, mut exceeds) = (0, ranked.len() + 1);
            while fits + 1 < exceeds {
                let count = fits.midpoint(exceeds);
                if cost(count)? <= most { fits = count } else { exceeds = count }
            }
            if fits == 0 {
                continue;
            }
            let mut modes = ranked[..fits].to_vec();
            modes.sort_unstable();
            let trial = self.measured(&modes, groups, 1.0)?;
            if best.as_ref().is_none_or(|(worst, ..)| trial.worst < *worst) {
                best = Some((trial.worst, groups, modes));
            }
            trials.push(trial);
        }
        let found = best.is_some();
        if let Some((_, groups, modes)) = best {
            choice.groups = groups;
            choice.keep(modes);
        }
        Ok(found)
    }
}
