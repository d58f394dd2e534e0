//! Decides which terms and modes a body needs in a scene.

use super::norms::Norms;
use super::significance::{Significance, significances};
use super::situation::{Input, Situation};
use super::trial::{Bench, ModeShare, Trial};
use super::warnings::warnings;
use crate::diagnostic::Diagnostic;
use crate::error::Result;
use crate::flex_body::{FlexBody, Group, Groups, TermDecision};
use crate::progress::{Event, Watch};
use crate::scene::{ErrorHistory, Measure, Recording, Scene, damped, points_of};

/// Part of the tolerances that dropped terms may take by bounds; what is measured gets the rest.
const PART_OF_BOUNDS: f64 = 0.5;

/// Part of the rest that dropped terms may take before modes are dropped.
const PART_OF_TERMS: f64 = 0.5;

/// How far the run may stay behind the rotation that the scene allows for its measurements to count.
const SLACK_OF_RANGE: f64 = 1.01;

/// What was decided, and on what grounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Name of the scene.
    pub scene: String,
    /// Name of the body.
    pub body: String,
    /// Numbers that the decision follows from.
    pub inputs: Vec<Input>,
    /// Largest errors that are allowed; in the order attitude, deflection, stress, reaction.
    pub tolerance: [f64; 4],
    /// Sizes of all terms.
    pub significances: Vec<Significance>,
    /// Everything that was tried, in order.
    pub trials: Vec<Trial>,
    /// The decision about every group.
    pub terms: Vec<TermDecision>,
    /// Groups that are kept.
    pub groups: Groups,
    /// Modes that the body has.
    pub n_modes: usize,
    /// Modes that are kept (from 0).
    pub modes: Vec<usize>,
    /// What every mode of the body does, where a motion was integrated.
    pub shares: Vec<ModeShare>,
    /// Why these modes.
    pub mode_reason: String,
    /// The selected model, measured against all that the body holds; none where nothing was integrated.
    pub chosen: Option<Trial>,
    /// Multiplications of an evaluation with everything that the body holds.
    pub multiplications: usize,
    /// Guideline of [WP19] section 8 that the kept groups are nearest to.
    pub guideline: &'static str,
    /// What has to be said.
    pub diagnostics: Vec<Diagnostic>,
}

/// Every set of groups.
fn sets() -> impl Iterator<Item = Groups> {
    (0..8).map(|bits| Groups { w1: bits & 1 != 0, w2: bits & 2 != 0, w3: bits & 4 != 0 })
}

/// Sets of groups, cheapest first.
fn by_cost(bench: &Bench<'_>) -> Vec<Groups> {
    let held = bench.body.invariants().groups;
    let mut all: Vec<Groups> = sets().filter(|set| set.and(held) == *set).collect();
    all.sort_by_key(|&set| bench.multiplications(bench.body, set));
    all
}

/// What I0 and the eigenvalues alone rule out (tier 0): the groups that a body in this scene has to hold. `body` needs to hold none.
///
/// # Errors
/// FB212 where the scene does not fit the body; those of [`simulate`](crate::scene::simulate).
pub fn ruled_out(body: &FlexBody, scene: &Scene, memory: Option<u64>) -> Result<(Groups, Vec<Trial>)> {
    let body = &*damped(body, scene)?;
    let (loads, watched) = points_of(body, scene)?;
    let situation = Situation::new(body, scene, &loads);
    let bench = Bench { body, scene, situation: &situation, loads: &loads, watched: &watched, memory };
    let (trials, _) = bounded(&bench, false)?;
    let kept = trials.iter().find(|trial| trial.passed()).map_or(Groups::ALL, |trial| trial.kept);
    Ok((kept, trials))
}

/// Trials by bounds, up to the first that passes; the motion without any group.
fn bounded(bench: &Bench<'_>, tier_1: bool) -> Result<(Vec<Trial>, Option<Recording>)> {
    let Bench { body, scene, situation, .. } = bench;
    let axis = situation.driven.as_ref().ok().and_then(|driven| driven.rotation.axis);
    let rigid = Norms::of_rigid(&body.invariants().inertia(), &body.modes().eigenvalue, axis.as_ref());
    let own = Norms::of_invariants(body.invariants(), &body.modes().eigenvalue, axis.as_ref());
    let simplest = match scene.run.duration {
        Some(_) if situation.driven.is_ok() => Some(bench.motion(body, Groups::NONE)?.0),
        _ => None,
    };
    let mut trials = Vec::new();
    let mut order: Vec<Groups> = sets().filter(|set| *set != Groups::ALL).collect();
    // W1 costs a multiple of nf, W2 six panels, W3 two times three.
    order.sort_by_key(|set| usize::from(set.w1) + 10 * usize::from(set.w2) + 11 * usize::from(set.w3));
    for kept in order {
        let tiers = [Some(&rigid), own.as_ref().filter(|_| tier_1)];
        for norms in tiers.into_iter().flatten() {
            let trial = bench.bounded(norms, simplest.as_ref(), kept, PART_OF_BOUNDS);
            let passed = trial.passed();
            trials.push(trial);
            if passed {
                return Ok((trials, simplest));
            }
        }
    }
    Ok((trials, simplest))
}

/// The terms and modes of `body` that `scene` needs.
///
/// Terms are dropped by whole groups, cheapest set first: by bounds of tier 0 and 1 where these leave half of the tolerances, else by
/// the error of a motion that is integrated (tier 2), if the scene says how long it lasts and does what it may do. Modes are ranked
/// by what they do in the motion, and the fewest are kept whose motion, with the kept groups, is within the tolerances.
///
/// # Errors
/// FB212 where the scene does not fit the body; those of [`simulate`](crate::scene::simulate).
pub fn select(body: &FlexBody, scene: &Scene, memory: Option<u64>, watch: Watch<'_>) -> Result<Selection> {
    let body = &*damped(body, scene)?;
    let (loads, watched) = points_of(body, scene)?;
    let situation = Situation::new(body, scene, &loads);
    let bench = Bench { body, scene, situation: &situation, loads: &loads, watched: &watched, memory };
    let held = body.invariants().groups;
    let inertia = body.invariants().inertia();
    let eigenvalues = &body.modes().eigenvalue;
    let rigid = Norms::of_rigid(&inertia, eigenvalues, None);
    let own = Norms::of_invariants(body.invariants(), eigenvalues, None);
    let significances = significances(&situation, &rigid, own.as_ref(), held);

    watch(Event::Phase("bounds"));
    let (mut trials, _) = bounded(&bench, true)?;
    let by_bounds = trials.iter().find(|trial| trial.passed()).cloned();
    let whole = by_bounds.as_ref().map_or(held, |trial| trial.kept.and(held));
    let all: Vec<usize> = (0..body.n_modes()).collect();
    let mut choice = Choice { groups: whole, modes: all.clone(), shares: Vec::new(), chosen: None };
    let mut diagnostics = Vec::new();
    let mode_reason;
    let mut short_of = None;
    match scene.run.duration {
        None => {
            let band = scene.requirements.band;
            let within = |&j: &usize| {
                let frequency = eigenvalues[j].sqrt() / std::f64::consts::TAU;
                // Residual vectors are what makes up for the modes beyond the band.
                let free = body.modes().provenance.get(j).is_none_or(|from| from == "free mode");
                band.is_none_or(|band| !free || frequency <= 2.0 * band)
            };
            let within: Vec<usize> = all.iter().copied().filter(within).collect();
            if !within.is_empty() {
                choice.modes = within;
            }
            mode_reason = match band {
                Some(band) => format!("free modes up to twice the highest frequency of interest, {band}"),
                None => "the scene has neither a duration nor a band: all".to_owned(),
            };
        }
        Some(_) => {
            watch(Event::Phase("reference motion"));
            let (reference, said) = bench.motion(body, whole)?;
            diagnostics.extend(said);
            let measure = Measure::new(body, &reference);
            let largest = reference.states.iter().map(|state| state.omega.norm()).fold(0.0, f64::max);
            if situation.spin.value > SLACK_OF_RANGE * largest {
                short_of = Some((largest, situation.spin.value));
            }
            watch(Event::Phase("trials"));
            let target = scene.requirements.multiplications;
            let search = Search { bench: &bench, measure: &measure, by_bounds: by_bounds.is_some() };
            mode_reason = match target {
                Some(most) => {
                    search.within_cost(most, &mut choice, &mut trials)?;
                    format!("the most accurate of at most {most} multiplications")
                }
                None => {
                    if short_of.is_none() {
                        search.terms(&mut choice, &mut trials)?;
                    }
                    search.modes(&mut choice, &mut trials)?;
                    "the fewest whose motion is within the tolerances".to_owned()
                }
            };
            let (chosen, history) = search.measured(&choice.modes, choice.groups)?;
            diagnostics.extend(warnings(&bench, &measure, &choice.modes, history.as_ref()));
            choice.chosen = Some(chosen);
        }
    }
    let terms = decisions(&bench, &choice, &trials, short_of);
    let tolerance = scene.requirements.tolerance;
    Ok(Selection {
        scene: scene.name.clone(),
        body: body.source().name.clone(),
        inputs: situation.inputs().into_iter().cloned().collect(),
        tolerance: [tolerance.attitude, tolerance.deflection, tolerance.stress, tolerance.reaction],
        significances,
        multiplications: bench.multiplications(body, held),
        terms,
        guideline: guideline(choice.groups),
        groups: choice.groups,
        n_modes: all.len(),
        modes: choice.modes,
        shares: choice.shares,
        mode_reason,
        chosen: choice.chosen,
        trials,
        diagnostics,
    })
}

/// What is decided so far.
struct Choice {
    groups: Groups,
    modes: Vec<usize>,
    shares: Vec<ModeShare>,
    chosen: Option<Trial>,
}

/// The search for a cheaper model, by measured motion.
struct Search<'s> {
    bench: &'s Bench<'s>,
    measure: &'s Measure<'s>,
    /// Whether terms were dropped by bounds already.
    by_bounds: bool,
}

impl Search<'_> {
    fn budget(&self) -> f64 {
        if self.by_bounds { 1.0 - PART_OF_BOUNDS } else { 1.0 }
    }

    fn measured(&self, modes: &[usize], groups: Groups) -> Result<(Trial, Option<ErrorHistory>)> {
        self.bench.measured(self.measure, modes, groups, self.budget())
    }

    /// The cheapest groups.
    fn terms(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        let all = choice.modes.clone();
        let now = self.bench.multiplications(self.bench.body, choice.groups);
        for groups in by_cost(self.bench) {
            let cheaper = self.bench.multiplications(self.bench.body, groups) < now;
            if !cheaper || groups.and(choice.groups) != groups {
                continue;
            }
            let budget = PART_OF_TERMS * self.budget();
            let (trial, _) = self.bench.measured(self.measure, &all, groups, budget)?;
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
        choice.shares = self.bench.shares(self.measure.recording());
        let tolerance = &self.bench.scene.requirements.tolerance;
        let weight = |j: &usize| {
            let share = &choice.shares[*j];
            (share.deflection / tolerance.deflection).max(share.stress / tolerance.stress)
        };
        let mut ranked: Vec<usize> = (0..choice.shares.len()).collect();
        ranked.sort_by(|a, b| weight(b).total_cmp(&weight(a)).then(a.cmp(b)));
        ranked
    }

    /// The fewest modes, in the order of what they do, whose motion is within the tolerances.
    fn modes(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        let ranked = self.ranked(choice);
        let first = |count: usize| {
            let mut modes = ranked[..count].to_vec();
            modes.sort_unstable();
            modes
        };
        // More modes are not always better, but nearly: bisection, and the last that passed counts.
        let (mut too_few, mut enough) = (0, ranked.len());
        while too_few + 1 < enough {
            let count = match too_few {
                0 if enough > 8 => enough / 2,
                _ => too_few.midpoint(enough),
            };
            let (trial, _) = self.measured(&first(count), choice.groups)?;
            if trial.passed() {
                enough = count;
            } else {
                too_few = count;
            }
            trials.push(trial);
        }
        choice.modes = first(enough);
        for (j, share) in choice.shares.iter_mut().enumerate() {
            share.kept = choice.modes.binary_search(&j).is_ok();
        }
        Ok(())
    }

    /// The most accurate model of at most `most` multiplications: for every set of groups as many modes as that allows.
    fn within_cost(&self, most: usize, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        let ranked = self.ranked(choice);
        let mut best: Option<(f64, Groups, Vec<usize>)> = None;
        for groups in by_cost(self.bench) {
            if groups.and(choice.groups) != groups {
                continue;
            }
            let cost = |count: usize| -> Result<usize> {
                let modes: Vec<usize> = (0..count).collect();
                let body =
                    self.bench.body.reduced(&modes, self.bench.body.invariants().groups, Vec::new())?;
                Ok(self.bench.multiplications(&body, groups))
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
            let (trial, _) = self.measured(&modes, groups)?;
            if best.as_ref().is_none_or(|(worst, ..)| trial.worst < *worst) {
                best = Some((trial.worst, groups, modes));
            }
            trials.push(trial);
        }
        if let Some((_, groups, modes)) = best {
            (choice.groups, choice.modes) = (groups, modes);
        }
        for (j, share) in choice.shares.iter_mut().enumerate() {
            share.kept = choice.modes.binary_search(&j).is_ok();
        }
        Ok(())
    }
}

/// The decision about every group, and the trial that it rests on.
fn decisions(
    bench: &Bench<'_>,
    choice: &Choice,
    trials: &[Trial],
    short_of: Option<(f64, f64)>,
) -> Vec<TermDecision> {
    let tolerance = &bench.scene.requirements.tolerance;
    let held = bench.body.invariants().groups;
    let all = bench.body.n_modes();
    let of_groups = |kept: Groups| trials.iter().rfind(move |trial| trial.modes == all && trial.kept == kept);
    let describe = |trial: &Trial| match &trial.errors {
        Some(errors) => {
            let (output, _, _) = errors.decisive(tolerance);
            let how = match trial.tier {
                2 => "measured over the run",
                1 => "bound with the norms of the invariants",
                _ => "bound from I0 and the frequencies",
            };
            format!("error of {output}, {how}")
        }
        None => trial.remark.clone(),
    };
    let numbers = |trial: &Trial| {
        trial.errors.as_ref().map_or((f64::INFINITY, 0.0), |errors| {
            let (_, error, allowed) = errors.decisive(tolerance);
            (error, allowed * trial.budget)
        })
    };
    let decide = |group: Group| {
        let kept = choice.groups.has(group);
        let basis = if kept {
            of_groups(choice.groups.and(Groups::NONE.with(group).complement()))
        } else {
            of_groups(choice.groups).or(choice.chosen.as_ref())
        };
        match basis {
            _ if !held.has(group) => TermDecision {
                group,
                kept: false,
                tier: 0,
                bound: 0.0,
                limit: 0.0,
                reason: "the body does not hold it".to_owned(),
            },
            Some(trial) => {
                let (bound, limit) = numbers(trial);
                let limit = if bound.is_finite() { limit } else { 0.0 };
                let mut reason = describe(trial);
                if let Some((reached, allowed)) = short_of.filter(|_| kept) {
                    reason = format!(
                        "{reason}; the run turns with {reached:.3e} only where the scene allows {allowed:.3e}, so nothing was measured"
                    );
                }
                TermDecision {
                    group,
                    kept,
                    tier: trial.tier,
                    bound: if bound.is_finite() { bound } else { 0.0 },
                    limit,
                    reason,
                }
            }
            None => TermDecision {
                group,
                kept,
                tier: 0,
                bound: 0.0,
                limit: 0.0,
                reason: "nothing says that it may be dropped".to_owned(),
            },
        }
    };
    Group::ALL.into_iter().map(decide).collect()
}

/// The guideline of [WP19] section 8 that a set of groups is nearest to.
fn guideline(groups: Groups) -> &'static str {
    match (groups.w1, groups.w2, groups.w3) {
        (false, false, false) => "I: inertia of the undeformed body",
        (true, false, false) => "II: constant centrifugal load, and W1 in the inertia with it",
        (_, true, false) | (true, false, true) => "III: inertia of the deformed body",
        (false, false, true) => "IV: Coriolis forces",
        (_, true, true) => "III and IV: inertia of the deformed body and Coriolis forces",
    }
}
