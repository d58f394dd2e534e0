//! The search for a cheaper model, by measured motion.

use super::cases::{Case, PART_OF_BOUNDS, sets_in, worst};
use super::trial::{ModeShare, Trial, TrialRuns, multiplications};
use crate::base::error::Result;
use crate::body::flex_body::{FlexBody, Groups};
use crate::motion::scene::{Measure, Scene, Tolerance, Trace};

/// Part of the rest that dropped terms may take before modes are dropped; all of it with the modes that are kept.
const PART_OF_TERMS: f64 = 0.5;

/// Terms and modes that are chosen so far.
pub(super) struct Choice {
    pub groups: Groups,
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

/// Modes by what they do beside the tolerances, most first.
fn by_share(shares: &[ModeShare], tolerance: &Tolerance) -> Vec<usize> {
    let weight = |j: &usize| {
        let share = &shares[*j];
        (share.deflection / tolerance.deflection).max(share.stress / tolerance.stress)
    };
    let mut ranked: Vec<usize> = (0..shares.len()).collect();
    ranked.sort_by(|a, b| weight(b).total_cmp(&weight(a)).then(a.cmp(b)));
    ranked
}

/// Modes of `body` by what they do in its `motion` in `scene`, most first: the order in which [`select`](super::select) keeps them.
///
/// # Errors
/// FB212 where the scene does not fit the body.
pub fn liveliest_modes(body: &FlexBody, scene: &Scene, motion: &Trace) -> Result<Vec<usize>> {
    let case = Case::new(body, scene, None)?;
    Ok(by_share(&case.runs().shares(motion), &scene.requirements.tolerance))
}

/// The scenes with their reference motions.
pub(super) struct Search<'s> {
    pub cases: &'s [(TrialRuns<'s>, Measure<'s>)],
    /// Whether terms were dropped by bounds already.
    pub by_bounds: bool,
    /// Part of the tolerances that the whole body lacks of the model.
    pub reserved: f64,
}

impl Search<'_> {
    /// What the body itself and bounds leave of the tolerances.
    pub fn budget(&self) -> f64 {
        let left = (1.0 - self.reserved).max(0.0);
        if !self.by_bounds {
            return left;
        }
        // What is measured is relative to a motion that may be larger than that of the whole body by as much as bounds allow.
        let Tolerance { deflection, stress, reaction, .. } = self.cases[0].0.scene.requirements.tolerance;
        (left - PART_OF_BOUNDS).max(0.0) / (1.0 + PART_OF_BOUNDS * deflection.max(stress).max(reaction))
    }

    fn body(&self) -> &FlexBody {
        self.cases[0].0.body
    }

    fn measured(&self, modes: &[usize], groups: Groups, budget: f64) -> Result<Trial> {
        let measured = |(runs, measure): &(TrialRuns<'_>, Measure<'_>)| -> Result<Trial> {
            Ok(runs.measured(measure, modes, groups, budget)?.0)
        };
        Ok(worst(self.cases.iter().map(measured).collect::<Result<Vec<_>>>()?.into_iter()))
    }

    /// The cheapest groups with all modes; they leave a part of the tolerances for these.
    pub fn terms(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        self.cheapest(PART_OF_TERMS * self.budget(), choice, trials)
    }

    /// Cheaper groups with the modes that are kept, where these take less of the tolerances than was left to them.
    pub fn fewer_terms(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        self.cheapest(self.budget(), choice, trials)
    }

    /// The first set of groups whose motion is within a part of the tolerances.
    fn cheapest(&self, budget: f64, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        let smaller = sets_in(self.cases[0].0.scene)
            .filter(|set| *set != choice.groups && set.and(choice.groups) == *set);
        for groups in smaller.collect::<Vec<_>>() {
            let trial = self.measured(&choice.modes, groups, budget)?;
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
        let mut by_case = self.cases.iter().map(|(runs, measure)| runs.shares(measure.trace()));
        choice.shares = by_case.next().unwrap_or_default();
        for other in by_case {
            for (share, other) in choice.shares.iter_mut().zip(other) {
                share.amplitude = share.amplitude.max(other.amplitude);
                share.deflection = share.deflection.max(other.deflection);
                share.stress = share.stress.max(other.stress);
            }
        }
        by_share(&choice.shares, &self.cases[0].0.scene.requirements.tolerance)
    }

    /// The fewest modes, in the order of what they do, whose motion is within the tolerances.
    pub fn modes(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
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
            let trial = self.measured(&first(count), choice.groups, self.budget())?;
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

    /// The most accurate model of at most `most` multiplications: for every set of groups as many modes as that allows.
    /// False where every model takes more.
    pub fn within_cost(&self, most: usize, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<bool> {
        let ranked = self.ranked(choice);
        let mut best: Option<(f64, Groups, Vec<usize>)> = None;
        for groups in sets_in(self.cases[0].0.scene) {
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
            let trial = self.measured(&modes, groups, self.budget())?;
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
