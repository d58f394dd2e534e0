//! Decides which terms and modes a body needs in a scene.

use super::basis::BEYOND_BAND;
use super::norms::Norms;
use super::participation::{Participation, participations};
use super::significance::{Significance, significances};
use super::situation::{Input, Situation};
use super::trial::{Bench, ModeShare, Trial, multiplications};
use super::variation::Variation;
use super::warnings::{growth_of, phase_drifts, resonances};
use crate::diagnostic::Diagnostic;
use crate::dynamics::BodyPoint;
use crate::error::Result;
use crate::flex_body::{FlexBody, Group, Groups, TermDecision};
use crate::progress::{Event, Watch};
use crate::scene::{Measure, Range, Scene, Tolerance, damped, points_of};
use nalgebra::Vector3;

/// Part of the tolerances that dropped terms may take by bounds; what is measured gets the rest.
const PART_OF_BOUNDS: f64 = 0.5;

/// Part of the rest that dropped terms may take before modes are dropped; all of it with the modes that are kept.
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
    /// What the selected modes lack of the static responses to the loads.
    pub participations: Vec<Participation>,
    /// Why these modes.
    pub mode_reason: String,
    /// The selected model, measured against all that the body holds; none where nothing was integrated.
    pub chosen: Option<Trial>,
    /// Multiplications of an evaluation with everything that the body holds.
    pub multiplications: usize,
    /// Guideline of [WP19] section 8 that the kept groups are nearest to.
    pub guideline: &'static str,
    /// The cost that the scene allows, where that decides.
    pub most_multiplications: Option<usize>,
    /// What has to be said.
    pub diagnostics: Vec<Diagnostic>,
}

impl Selection {
    /// Whether what was asked for holds: the cost, or else the tolerances as far as they were measured.
    pub fn holds(&self) -> bool {
        self.chosen.as_ref().is_none_or(|chosen| match self.most_multiplications {
            Some(most) => chosen.multiplications <= most,
            None => chosen.passed(),
        })
    }
}

/// Every set of groups, cheapest first: W1 costs a multiple of nf, W2 six products with matrices of the size of K_ff, W3 two times three.
fn sets() -> impl Iterator<Item = Groups> {
    (0..8).map(|bits| Groups { w1: bits & 1 != 0, w2: bits & 2 != 0, w3: bits & 4 != 0 })
}

/// What I0 and the eigenvalues alone rule out (tier 0): decisions about the groups that a body in this scene need not hold. `body` needs
/// to hold none.
///
/// # Errors
/// FB212 where the scene does not fit the body; those of [`simulate`](crate::scene::simulate).
pub fn rule_out(body: &FlexBody, scene: &Scene, memory: Option<u64>) -> Result<Vec<TermDecision>> {
    let body = &*damped(body, scene)?;
    let scenes = scenes(body, scene)?;
    let cases = scenes.iter().map(|one| Case::new(body, one, memory)).collect::<Result<Vec<_>>>()?;
    let trials = bounded(&cases, false)?;
    let Some(passed) = trials.iter().find(|trial| trial.passed()) else { return Ok(Vec::new()) };
    let rotation = &cases[0].situation.spin;
    Ok(passed.kept.dropped().map(|group| decision(group, false, passed, scene, rotation)).collect())
}

/// The scene; and the same with the rotation scaled to the largest that it allows, where its own run stays behind that.
fn scenes(body: &FlexBody, scene: &Scene) -> Result<Vec<Scene>> {
    let (loads, _) = points_of(body, scene)?;
    let allowed = Situation::new(body, scene, &loads);
    let mut own = scene.clone();
    own.requirements.motion = Default::default();
    let (spin, acceleration) = match &scene.spin {
        Some(spin) => {
            let rate = Variation::of(&spin.rate, allowed.duration.value);
            (rate.largest, rate.rate)
        }
        // The accelerations of a free body grow like the square of its angular velocity.
        None => (scene.initial.angular_velocity.norm(), f64::INFINITY),
    };
    let velocity = allowed.spin.value / spin;
    let acceleration = match scene.requirements.motion.angular_acceleration {
        Some(_) => allowed.acceleration.value / acceleration,
        None => 0.0,
    };
    let factor = velocity.max(acceleration);
    if scene.requirements.motion == own.requirements.motion || scene.run.duration.is_none() {
        return Ok(vec![scene.clone()]);
    }
    if factor.is_nan() || factor <= SLACK_OF_RANGE {
        return Ok(vec![own]);
    }
    let mut scaled = own.clone();
    match (&scene.spin, &scene.requirements.motion.angular_velocity) {
        (Some(_), _) if factor.is_infinite() => return Ok(vec![scene.clone()]),
        // A free body that does not turn at first is given the rotation.
        (None, Some(range)) if factor.is_infinite() => {
            scaled.initial.angular_velocity = match range {
                Range::Axes(components) => *components,
                Range::Any(length) if body.dimension() == 2 => Vector3::z() * *length,
                Range::Any(length) => Vector3::repeat(length / 3f64.sqrt()),
            };
        }
        _ => scaled.initial.angular_velocity *= factor,
    }
    if let Some(spin) = &mut scaled.spin {
        spin.rate = spin.rate.scaled(factor);
    }
    Ok(vec![own, scaled])
}

/// A scene to try models in.
struct Case<'c> {
    body: &'c FlexBody,
    scene: &'c Scene,
    situation: Situation,
    loads: Vec<BodyPoint>,
    watched: Vec<BodyPoint>,
    memory: Option<u64>,
}

impl<'c> Case<'c> {
    fn new(body: &'c FlexBody, scene: &'c Scene, memory: Option<u64>) -> Result<Self> {
        let (loads, watched) = points_of(body, scene)?;
        let situation = Situation::new(body, scene, &loads);
        Ok(Self { body, scene, situation, loads, watched, memory })
    }

    fn bench(&self) -> Bench<'_> {
        let Self { body, scene, situation, loads, watched, memory } = self;
        Bench { body, scene, situation, loads, watched, memory: *memory }
    }
}

/// Trials by bounds, up to the first set of groups that passes. Where the rotation is that of a run, the models that cost a multiple of nf
/// only are run; others are as dear as a measurement.
fn bounded(cases: &[Case<'_>], tier_1: bool) -> Result<Vec<Trial>> {
    let mut trials = Vec::new();
    let only_w1 = Groups::NONE.with(Group::W1);
    for kept in sets().filter(|set| *set != Groups::ALL) {
        let by_tier = cases.iter().map(|case| -> Result<Vec<Trial>> {
            let bench = case.bench();
            let Bench { body, scene, situation, .. } = bench;
            let (inertia, eigenvalues) = (body.invariants().inertia(), &body.modes().eigenvalue);
            let Ok(driven) = &situation.driven else { return Ok(Vec::new()) };
            let axis = driven.rotation.axis.as_ref();
            let of_run = scene.spin.is_some() && scene.run.duration.is_some() && axis.is_some();
            let held = body.invariants().groups;
            let runs = kept == Groups::NONE || kept == only_w1 && held.w1;
            if of_run && !runs {
                return Ok(Vec::new());
            }
            let run = if of_run { bench.fine_motion(kept)? } else { None };
            let rigid = Norms::of_rigid(&inertia, eigenvalues, axis);
            let own = Norms::of_invariants(body.invariants(), eigenvalues, axis).filter(|_| tier_1);
            let tiers = [Some(rigid), own].into_iter().flatten();
            Ok(tiers.map(|norms| bench.bounded(&norms, run.as_ref(), kept, PART_OF_BOUNDS)).collect())
        });
        let by_case: Vec<Vec<Trial>> = by_tier.collect::<Result<_>>()?;
        let tiers = by_case.iter().map(Vec::len).min().unwrap_or(0);
        for tier in 0..tiers {
            let trial = worst(by_case.iter().map(|trials| trials[tier].clone()));
            let passed = trial.passed();
            trials.push(trial);
            if passed {
                return Ok(trials);
            }
        }
    }
    Ok(trials)
}

/// The trial with the largest errors, one at least.
fn worst(trials: impl Iterator<Item = Trial>) -> Trial {
    trials.max_by(|a, b| a.worst.total_cmp(&b.worst)).expect("a scene to try it in")
}

/// The terms and modes of `body` that `scene` needs.
///
/// Terms are dropped by whole groups, cheapest set first: by bounds of tier 0 and 1 where these leave half of the tolerances, else by
/// the error of a motion that is integrated (tier 2), if the scene says how long it lasts. Where the scene allows faster rotation than
/// its run has, everything holds for the run and for the run with the rotation scaled to that. Modes are ranked by what
/// they do in the motion, and the fewest are kept whose motion, with the kept groups, is within the tolerances.
///
/// # Errors
/// FB212 where the scene does not fit the body; those of [`simulate`](crate::scene::simulate).
pub fn select(body: &FlexBody, scene: &Scene, memory: Option<u64>, watch: Watch<'_>) -> Result<Selection> {
    let body = &*damped(body, scene)?;
    let (loads, _) = points_of(body, scene)?;
    let situation = Situation::new(body, scene, &loads);
    let scenes = scenes(body, scene)?;
    let cases = scenes.iter().map(|one| Case::new(body, one, memory)).collect::<Result<Vec<_>>>()?;
    let held = body.invariants().groups;
    let eigenvalues = &body.modes().eigenvalue;
    let significances = significances(&situation, body);

    watch(Event::Phase("bounds"));
    let mut trials = bounded(&cases, true)?;
    let by_bounds = trials.iter().find(|trial| trial.passed()).map(|trial| trial.kept);
    let whole = by_bounds.map_or(held, |kept| kept.and(held));
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
                band.is_none_or(|band| !free || frequency <= BEYOND_BAND * band)
            };
            let within: Vec<usize> = all.iter().copied().filter(within).collect();
            if !within.is_empty() {
                choice.modes = within;
            }
            mode_reason = match band {
                Some(band) => {
                    format!("free modes up to {BEYOND_BAND} times the highest frequency of interest, {band}")
                }
                None => "the scene has neither a duration nor a band: all".to_owned(),
            };
        }
        Some(_) => {
            watch(Event::Phase("reference motion"));
            let mut references = Vec::new();
            for case in &cases {
                let (reference, said) = case.bench().motion(body, whole)?;
                diagnostics.extend(said);
                references.push(reference);
            }
            let measures = references.iter().map(|reference| Measure::new(body, reference));
            let tried: Vec<_> = cases.iter().map(Case::bench).zip(measures).collect();
            let speeds = references.iter().flat_map(|one| one.states.iter().map(|state| state.omega.norm()));
            let largest = speeds.fold(0.0, f64::max);
            if situation.spin.value > SLACK_OF_RANGE * largest
                && scene.requirements.motion.angular_velocity.is_some()
            {
                short_of = Some((largest, situation.spin.value));
            }
            watch(Event::Phase("trials"));
            let search = Search { cases: &tried, by_bounds: by_bounds.is_some() };
            mode_reason = match scene.requirements.multiplications {
                Some(most) => match search.within_cost(most, &mut choice, &mut trials)? {
                    true => format!("the most accurate of at most {most} multiplications"),
                    false => format!("no model takes {most} multiplications or fewer: everything is kept"),
                },
                None => {
                    if short_of.is_none() {
                        search.terms(&mut choice, &mut trials)?;
                    }
                    search.modes(&mut choice, &mut trials)?;
                    if short_of.is_none() {
                        search.fewer_terms(&mut choice, &mut trials)?;
                    }
                    "the fewest whose motion is within the tolerances".to_owned()
                }
            };
            let mut chosen = Vec::new();
            let mut growth = None;
            for (bench, measure) in &tried {
                let (trial, history) =
                    bench.measured(measure, &choice.modes, choice.groups, search.budget())?;
                let own = history.and_then(|history| growth_of(bench, measure, &history));
                growth = [growth, own].into_iter().flatten().reduce(f64::max);
                diagnostics.extend(resonances(bench, measure, &choice.modes));
                chosen.push(trial);
            }
            diagnostics.extend(growth.map(phase_drifts));
            choice.chosen = Some(worst(chosen.into_iter()));
        }
    }
    let terms = decisions(body, scene, &situation.spin, &choice, &trials, short_of);
    let tolerance = scene.requirements.tolerance;
    Ok(Selection {
        scene: scene.name.clone(),
        body: body.source().name.clone(),
        inputs: situation.inputs().into_iter().cloned().collect(),
        tolerance: [tolerance.attitude, tolerance.deflection, tolerance.stress, tolerance.reaction],
        significances,
        multiplications: multiplications(body, held),
        terms,
        guideline: guideline(choice.groups),
        groups: choice.groups,
        n_modes: all.len(),
        participations: participations(body, scene, &loads, &choice.modes),
        modes: choice.modes,
        shares: choice.shares,
        mode_reason,
        chosen: choice.chosen,
        most_multiplications: scene.requirements.multiplications,
        trials,
        diagnostics: once(diagnostics),
    })
}

/// Each diagnostic once.
fn once(diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let mut kept: Vec<Diagnostic> = Vec::new();
    for diagnostic in diagnostics {
        if !kept.contains(&diagnostic) {
            kept.push(diagnostic);
        }
    }
    kept
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
    cases: &'s [(Bench<'s>, Measure<'s>)],
    /// Whether terms were dropped by bounds already.
    by_bounds: bool,
}

impl Search<'_> {
    fn budget(&self) -> f64 {
        if !self.by_bounds {
            return 1.0;
        }
        // What is measured is relative to a motion that may be larger than that of the whole body by as much as bounds allow.
        let Tolerance { deflection, stress, reaction, .. } = self.cases[0].0.scene.requirements.tolerance;
        (1.0 - PART_OF_BOUNDS) / (1.0 + PART_OF_BOUNDS * deflection.max(stress).max(reaction))
    }

    fn body(&self) -> &FlexBody {
        self.cases[0].0.body
    }

    fn measured(&self, modes: &[usize], groups: Groups, budget: f64) -> Result<Trial> {
        let of_case = |(bench, measure): &(Bench<'_>, Measure<'_>)| -> Result<Trial> {
            Ok(bench.measured(measure, modes, groups, budget)?.0)
        };
        Ok(worst(self.cases.iter().map(of_case).collect::<Result<Vec<_>>>()?.into_iter()))
    }

    /// The cheapest groups.
    fn terms(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        let now = multiplications(self.body(), choice.groups);
        for groups in sets() {
            let cheaper = multiplications(self.body(), groups) < now;
            if !cheaper || groups.and(choice.groups) != groups {
                continue;
            }
            let trial = self.measured(&choice.modes, groups, PART_OF_TERMS * self.budget())?;
            let passed = trial.passed();
            trials.push(trial);
            if passed {
                choice.groups = groups;
                break;
            }
        }
        Ok(())
    }

    /// Cheaper groups with the modes that are kept, where these take less of the tolerances than was left to them.
    fn fewer_terms(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        let smaller = sets().filter(|set| *set != choice.groups && set.and(choice.groups) == *set);
        for groups in smaller.collect::<Vec<_>>() {
            let trial = self.measured(&choice.modes, groups, self.budget())?;
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
        let mut of_cases = self.cases.iter().map(|(bench, measure)| bench.shares(measure.recording()));
        choice.shares = of_cases.next().unwrap_or_default();
        for other in of_cases {
            for (share, other) in choice.shares.iter_mut().zip(other) {
                share.amplitude = share.amplitude.max(other.amplitude);
                share.deflection = share.deflection.max(other.deflection);
                share.stress = share.stress.max(other.stress);
            }
        }
        let tolerance = &self.cases[0].0.scene.requirements.tolerance;
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
            let trial = self.measured(&first(count), choice.groups, self.budget())?;
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
    /// Whether there is one.
    fn within_cost(&self, most: usize, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<bool> {
        let ranked = self.ranked(choice);
        let mut best: Option<(f64, Groups, Vec<usize>)> = None;
        for groups in sets() {
            if groups.and(choice.groups) != groups {
                continue;
            }
            let cost = |count: usize| -> Result<usize> {
                let modes: Vec<usize> = (0..count).collect();
                let body = self.body().reduced(&modes, self.body().invariants().groups, Vec::new())?;
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
            (choice.groups, choice.modes) = (groups, modes);
        }
        for (j, share) in choice.shares.iter_mut().enumerate() {
            share.kept = choice.modes.binary_search(&j).is_ok();
        }
        Ok(found)
    }
}

/// The decision about every group, and the trial that it rests on.
fn decisions(
    body: &FlexBody,
    scene: &Scene,
    rotation: &Input,
    choice: &Choice,
    trials: &[Trial],
    short_of: Option<(f64, f64)>,
) -> Vec<TermDecision> {
    let held = body.invariants().groups;
    let of_groups = |kept: Groups| trials.iter().rfind(move |trial| trial.kept == kept);
    let within = |kept: Groups| trials.iter().find(move |trial| trial.kept == kept && trial.passed());
    let decide = |group: Group| {
        let kept = choice.groups.has(group);
        let undecided = |kept: bool, reason: &str| TermDecision {
            group,
            kept,
            tier: 0,
            bound: 0.0,
            limit: 0.0,
            reason: reason.to_owned(),
        };
        if !held.has(group) {
            let earlier = body.terms().iter().find(|decision| decision.group == group);
            return earlier.cloned().unwrap_or_else(|| undecided(false, "the body does not hold it"));
        }
        let basis = if kept {
            of_groups(choice.groups.and(Groups::without(group)))
        } else {
            within(choice.groups).or(choice.chosen.as_ref())
        };
        let mut decided = match basis {
            Some(trial) => decision(group, kept, trial, scene, rotation),
            None => undecided(kept, "nothing shows that it may be dropped"),
        };
        if let Some((reached, allowed)) = short_of.filter(|_| kept) {
            decided.reason = format!(
                "{}; the run turns with {reached:.3e} only where the scene allows {allowed:.3e}, so nothing was measured",
                decided.reason
            );
        }
        decided
    };
    Group::ALL.into_iter().map(decide).collect()
}

/// The decision that a trial without `group` leads to.
fn decision(group: Group, kept: bool, trial: &Trial, scene: &Scene, rotation: &Input) -> TermDecision {
    let errors = trial.errors.as_ref().filter(|_| trial.worst.is_finite());
    let decisive = errors.map(|errors| errors.decisive(&scene.requirements.tolerance));
    let how = match trial.tier {
        2 => "measured over the run",
        1 => "bound with the norms of the invariants",
        _ => "bound from I0 and the frequencies",
    };
    let reason = match (&decisive, trial.remark.as_str()) {
        (Some((output, ..)), _) => format!("error of {output}, {how}; rotation from {}", rotation.source),
        (None, "") => format!("no finite {how}"),
        (None, remark) => remark.to_owned(),
    };
    let (bound, limit) = decisive.map_or((0.0, 0.0), |(_, error, allowed)| (error, allowed * trial.budget));
    TermDecision { group, kept, tier: trial.tier, bound, limit, reason }
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
