//! Search for a cheaper model, by measured motion.

use super::cases::{Case, sets_in, together, worst};
use super::trial::{ModeShare, Trial, TrialRuns, multiplications};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_motion::scene::{Measure, Scene, Tolerance, Trace};

/// Part of the remaining tolerances that dropped terms may take before modes are dropped. In the last search, with the
/// kept modes, they may take all of it.
const PART_OF_TERMS: f64 = 0.5;

/// Current choice of terms and modes.
pub(super) struct Choice {
    pub groups: TermGroups,
    pub modes: Vec<usize>,
    pub shares: Vec<ModeShare>,
    pub chosen: Option<Trial>,
}

impl Choice {
    /// Keeps the first `count` modes of the order `ranked`.
    pub(super) fn keep_most(&mut self, ranked: &[usize], count: usize) {
        let mut modes = ranked[..count].to_vec();
        modes.sort_unstable();
        self.keep(modes);
    }

    /// Sets the kept modes.
    pub(super) fn keep(&mut self, modes: Vec<usize>) {
        for (j, share) in self.shares.iter_mut().enumerate() {
            share.kept = modes.binary_search(&j).is_ok();
        }
        self.modes = modes;
    }
}

/// Returns the contribution of each mode relative to the tolerances: the larger of deflection and stress.
fn weights(shares: &[ModeShare], tolerance: &Tolerance) -> Vec<f64> {
    let weight = |share: &ModeShare| {
        (share.deflection / tolerance.errors.deflection).max(share.stress / tolerance.errors.stress)
    };
    shares.iter().map(weight).collect()
}

/// Returns the modes by descending weight.
fn by_weight(weights: &[f64]) -> Vec<usize> {
    let mut ranked: Vec<usize> = (0..weights.len()).collect();
    ranked.sort_by(|a, b| weights[*b].total_cmp(&weights[*a]).then(a.cmp(b)));
    ranked
}

/// Returns the modes of a body by their contribution to its motion, largest first. [`select`](super::select) keeps
/// modes in this order. `cases` holds, for each load case, the body in its frame, the scene and the motion; the largest
/// contribution relative to the tolerances of any case counts.
///
/// # Errors
/// FB212 if a scene does not match the body.
pub fn most_excited_modes(cases: &[(&FlexBody, &Scene, &Trace)]) -> Result<Vec<usize>> {
    let mut weight = vec![0.0f64; cases.first().map_or(0, |(body, ..)| body.n_modes())];
    for (body, scene, motion) in cases {
        let case = Case::new(body, scene, &Context::QUIET)?;
        let own = weights(&case.runs().shares(motion), &scene.requirements.tolerance);
        weight.iter_mut().zip(own).for_each(|(weight, own)| *weight = weight.max(own));
    }
    Ok(by_weight(&weight))
}

/// Scene in which models are tested, with the reference motion.
pub(super) struct TestScene<'s> {
    pub runs: TrialRuns<'s>,
    pub measure: Measure<'s>,
}

/// Scenes of one load case.
pub(super) struct TestedCase<'s> {
    pub scenes: Vec<TestScene<'s>>,
    /// Remaining part of the tolerances.
    pub budget: f64,
}

/// Search for a model that holds in all load cases.
pub(super) struct SelectionSearch<'s> {
    /// Load cases, at least one.
    pub cases: &'s [TestedCase<'s>],
    /// Groups that must be kept: a run that turns slower than its scene allows cannot show that a term may be dropped.
    pub fixed: TermGroups,
    /// True if the body is carried in a load case; all groups are then kept.
    pub carried: bool,
}

impl SelectionSearch<'_> {
    fn body(&self) -> &FlexBody {
        self.cases[0].scenes[0].runs.body
    }

    /// Measures a model in all load cases. It may use `part` of the remaining tolerances of each.
    fn measured(&self, modes: &[usize], groups: TermGroups, part: f64) -> Result<Trial> {
        let in_case = |case: &TestedCase<'_>| -> Result<Trial> {
            let measured = |TestScene { runs, measure }: &TestScene<'_>| -> Result<Trial> {
                Ok(runs.measured(measure, modes, groups, part * case.budget)?.0)
            };
            Ok(worst(case.scenes.iter().map(measured).collect::<Result<Vec<_>>>()?.into_iter()))
        };
        Ok(together(self.cases.iter().map(in_case).collect::<Result<Vec<_>>>()?))
    }

    /// Chooses the cheapest groups with all modes, and leaves a part of the tolerances for the modes.
    pub(super) fn terms(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        self.cheapest(PART_OF_TERMS, choice, trials)
    }

    /// Chooses cheaper groups with the kept modes, if these use less of the tolerances than was left for them.
    pub(super) fn fewer_terms(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        self.cheapest(1.0, choice, trials)
    }

    /// Chooses the first set of groups whose motion is within `part` of the tolerances.
    fn cheapest(&self, part: f64, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        // Proper subsets of the current groups that contain all fixed groups, cheapest first.
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

    /// Returns the modes by descending contribution, and records their shares.
    pub(super) fn ranked(&self, choice: &mut Choice) -> Vec<usize> {
        let mut weight = vec![0.0f64; self.body().n_modes()];
        choice.shares.clear();
        for case in self.cases {
            for TestScene { runs, measure } in &case.scenes {
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

    /// Chooses the fewest modes, in the order of their contribution, whose motion is within the tolerances.
    pub(super) fn modes(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        let ranked = self.ranked(choice);
        let first = |count: usize| {
            let mut modes = ranked[..count].to_vec();
            modes.sort_unstable();
            modes
        };
        // Errors nearly always decrease with more modes: bisect, and keep the smallest number that passed.
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

    /// Chooses the most accurate model of at most `most` multiplications: for every set of groups, as many modes as the
    /// cost allows. Returns false if every model costs more.
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
            // The cost grows with the number of modes: bisect.
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
            // Measure the set with these modes, and keep the most accurate.
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
