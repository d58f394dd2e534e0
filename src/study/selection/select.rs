//! Decides which terms and modes a body needs in a scene.

use super::basis::BEYOND_BAND;
use super::cases::{Case, SLACK_OF_RANGE, bounded, scenes, worst};
use super::decisions::{Ground, decision, decisions, guideline};
use super::participation::{Participation, participations};
use super::search::{Choice, Search};
use super::significance::{Significance, significances};
use super::situation::{Input, Situation};
use super::trial::{ModeShare, Trial, multiplications};
use super::warnings::{phase_drifts, resonances};
use crate::base::diagnostic::Diagnostic;
use crate::base::error::Result;
use crate::base::progress::{Event, Watch};
use crate::body::flex_body::{FlexBody, Groups, TermDecision};
use crate::motion::scene::{Measure, Scene, Stage, Trace, damped, points_of};
use crate::study::reference::ReferenceError;

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
    /// The error that each of these decisions rests on.
    pub grounds: Vec<Option<Ground>>,
    /// Groups that are kept.
    pub groups: Groups,
    /// Modes that the body has.
    pub n_modes: usize,
    /// Frequency of each of them in hertz.
    pub frequencies_hz: Vec<f64>,
    /// Modes that are kept (from 0).
    pub modes: Vec<usize>,
    /// What every mode of the body does, where a motion was integrated.
    pub shares: Vec<ModeShare>,
    /// What the selected modes lack of the static responses to the loads.
    pub participations: Vec<Participation>,
    /// The reason for these modes.
    pub mode_reason: String,
    /// The selected model, measured against all that the body holds; none where nothing was integrated.
    pub chosen: Option<Trial>,
    /// Multiplications of an evaluation with everything that the body holds.
    pub multiplications: usize,
    /// Guideline of \[WP19\] section 8 that the kept groups are nearest to.
    pub guideline: &'static str,
    /// The cost that the scene allows, where that decides.
    pub most_multiplications: Option<usize>,
    /// What the body, and those before it that were enriched, lack of the model, the last one the body itself; empty where only a file is at
    /// hand, or nothing can be estimated.
    pub lacks: Vec<ReferenceError>,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

impl Selection {
    /// Whether what was asked for holds: the cost, or else the tolerances as far as they were measured, against a body that lacks no more than
    /// half of them itself.
    pub fn holds(&self) -> bool {
        let is_reference = self.lacks.last().is_none_or(ReferenceError::is_reference);
        self.chosen.as_ref().is_none_or(|chosen| match self.most_multiplications {
            Some(most) => chosen.multiplications <= most,
            None => chosen.passed() && is_reference,
        })
    }
}

/// What I0 and the eigenvalues alone rule out (tier 0): decisions about the groups that a body in this scene need not hold. `body` needs
/// to hold none.
///
/// # Errors
/// FB212 where the scene does not fit the body; those of [`simulate`](crate::motion::scene::simulate).
pub fn rule_out(body: &FlexBody, scene: &Scene, memory: Option<u64>) -> Result<Vec<TermDecision>> {
    if scene.carried.is_some() {
        return Ok(Vec::new());
    }
    let stage = Stage::new(body, scene)?;
    let (body, scene) = (&*damped(&stage.body, &stage.scene)?, &*stage.scene);
    let scenes = scenes(body, scene)?;
    let cases = scenes.iter().map(|one| Case::new(body, one, memory)).collect::<Result<Vec<_>>>()?;
    let trials = bounded(&cases, false)?;
    let Some(passed) = trials.iter().find(|trial| trial.passed()) else { return Ok(Vec::new()) };
    let rotation = &cases[0].situation.spin;
    Ok(passed.kept.dropped().map(|group| decision(group, false, passed, scene, rotation)).collect())
}

/// The terms and modes of `body` that `scene` needs.
///
/// Terms are dropped by whole groups, cheapest set first: by bounds of tier 0 and 1 where these leave half of the tolerances, else by
/// the error of a motion that is integrated (tier 2), if the scene says how long it lasts. Where the scene allows faster rotation than
/// its run has, everything holds for the run and for the run with the rotation scaled to that. Modes are ranked by what
/// they do in the motion, and the fewest are kept whose motion, with the kept groups, is within the tolerances.
///
/// # Errors
/// FB212 where the scene does not fit the body; those of [`simulate`](crate::motion::scene::simulate).
pub fn select(body: &FlexBody, scene: &Scene, memory: Option<u64>, watch: Watch<'_>) -> Result<Selection> {
    select_from(body, &[], scene, memory, watch)
}

/// The same where it is known what `body`, and those before it, lack of the model in this scene: what is left of the tolerances.
///
/// # Errors
/// As [`select`].
pub fn select_from(
    body: &FlexBody,
    lacks: &[ReferenceError],
    scene: &Scene,
    memory: Option<u64>,
    watch: Watch<'_>,
) -> Result<Selection> {
    let stage = Stage::new(body, scene)?;
    let (body, scene) = (&*damped(&stage.body, &stage.scene)?, &*stage.scene);
    let (loads, _) = points_of(body, scene)?;
    let situation = Situation::new(body, scene, &loads);
    let scenes = scenes(body, scene)?;
    let cases = scenes.iter().map(|one| Case::new(body, one, memory)).collect::<Result<Vec<_>>>()?;
    let significances = significances(&situation, body);

    watch(Event::Phase("bounds"));
    let mut deciding = Deciding::new(body, scene, &cases, stage.found.clone())?;
    deciding.lacks(lacks);
    let mode_reason = match scene.run.duration {
        None => deciding.choose_by_band(),
        Some(_) => deciding.choose_by_motion(&situation.spin, watch)?,
    };
    let Deciding { choice, trials, diagnostics, short_of, .. } = deciding;
    let tolerance = scene.requirements.tolerance;
    let decided = decisions(body, scene, &situation.spin, &choice, &trials, short_of);
    let (terms, grounds) = decided.into_iter().unzip();
    Ok(Selection {
        scene: scene.name.clone(),
        body: body.source().name.clone(),
        inputs: situation.inputs().into_iter().cloned().collect(),
        tolerance: [tolerance.attitude, tolerance.deflection, tolerance.stress, tolerance.reaction],
        significances,
        multiplications: multiplications(body, body.invariants().groups()),
        terms,
        grounds,
        guideline: guideline(choice.groups),
        groups: choice.groups,
        n_modes: body.n_modes(),
        frequencies_hz: body.frequencies_hz(),
        participations: participations(body, scene, &loads, &choice.modes),
        modes: choice.modes,
        shares: choice.shares,
        mode_reason,
        chosen: choice.chosen,
        most_multiplications: scene.requirements.multiplications,
        trials,
        lacks: lacks.to_vec(),
        diagnostics: once(diagnostics),
    })
}

/// A selection on its way: what was tried and what is chosen so far.
struct Deciding<'s> {
    body: &'s FlexBody,
    scene: &'s Scene,
    cases: &'s [Case<'s>],
    /// The groups that bounds leave, where these rule out some.
    by_bounds: Option<Groups>,
    choice: Choice,
    trials: Vec<Trial>,
    /// Part of the tolerances that the body itself lacks of the model.
    reserved: f64,
    /// The largest rotation of the runs and that which the scene allows, where the runs stay behind it.
    short_of: Option<(f64, f64)>,
    diagnostics: Vec<Diagnostic>,
}

impl<'s> Deciding<'s> {
    /// All modes, and what bounds leave of the groups.
    fn new(
        body: &'s FlexBody,
        scene: &'s Scene,
        cases: &'s [Case<'s>],
        diagnostics: Vec<Diagnostic>,
    ) -> Result<Self> {
        let trials = bounded(cases, true)?;
        let by_bounds = trials.iter().find(|trial| trial.passed()).map(|trial| trial.kept);
        let held = body.invariants().groups();
        let choice = Choice {
            groups: by_bounds.map_or(held, |kept| kept.and(held)),
            modes: (0..body.n_modes()).collect(),
            shares: Vec::new(),
            chosen: None,
        };
        Ok(Self { body, scene, cases, by_bounds, choice, trials, reserved: 0.0, short_of: None, diagnostics })
    }

    /// Reserves what the body lacks of the model.
    fn lacks(&mut self, rounds: &[ReferenceError]) {
        let Some(own) = rounds.last() else { return };
        self.reserved = if own.is_reference() { own.worst } else { 0.0 };
        self.diagnostics.extend(own.warning(self.scene));
    }

    /// Chooses the modes of the band of the scene, all without one; gives the reason.
    fn choose_by_band(&mut self) -> String {
        let band = self.scene.requirements.band;
        let modes = self.body.modes();
        let within = |&j: &usize| {
            let frequency = modes.eigenvalue[j].sqrt() / std::f64::consts::TAU;
            // Residual vectors are what makes up for the modes beyond the band.
            let free = modes.provenance.get(j).is_none_or(|from| from == "free mode");
            band.is_none_or(|band| !free || frequency <= BEYOND_BAND * band)
        };
        let within: Vec<usize> = self.choice.modes.iter().copied().filter(within).collect();
        if !within.is_empty() {
            self.choice.modes = within;
        }
        match band {
            Some(band) => {
                format!("free modes up to {BEYOND_BAND} times the highest frequency of interest, {band}")
            }
            None => "the scene has neither a duration nor a band: all".to_owned(),
        }
    }

    /// Chooses terms and modes by motion that is integrated; gives the reason for the modes.
    fn choose_by_motion(&mut self, spin: &Input, watch: Watch<'_>) -> Result<String> {
        watch(Event::Phase("reference motion"));
        let references = self.reference_motions()?;
        let (body, cases) = (self.body, self.cases);
        let measures = references.iter().map(|reference| Measure::new(body, reference));
        let measured: Vec<_> = cases.iter().map(Case::runs).zip(measures).collect();
        let largest = references.iter().map(|one| one.extremes.spin).fold(0.0, f64::max);
        if spin.value > SLACK_OF_RANGE * largest && self.scene.requirements.motion.angular_velocity.is_some()
        {
            self.short_of = Some((largest, spin.value));
        }
        watch(Event::Phase("trials"));
        let search =
            Search { cases: &measured, by_bounds: self.by_bounds.is_some(), reserved: self.reserved };
        let reason = self.search(&search)?;
        self.measure_choice(&search)?;
        Ok(reason)
    }

    /// The motion of the whole body, as far as bounds leave it whole, in every case.
    fn reference_motions(&mut self) -> Result<Vec<Trace>> {
        let mut references = Vec::new();
        for case in self.cases {
            let (reference, said) = case.runs().motion(self.choice.groups)?;
            self.diagnostics.extend(said);
            references.push(reference);
        }
        Ok(references)
    }

    /// Drops terms and modes; gives the reason for the modes.
    fn search(&mut self, search: &Search<'_>) -> Result<String> {
        let (choice, trials) = (&mut self.choice, &mut self.trials);
        if let Some(most) = self.scene.requirements.multiplications {
            return Ok(match search.within_cost(most, choice, trials)? {
                true => format!("the most accurate of at most {most} multiplications"),
                false => format!("no model takes {most} multiplications or fewer: everything is kept"),
            });
        }
        // A run that turns slower than the scene allows shows of no term that it may be dropped.
        let shows_terms = self.short_of.is_none();
        if shows_terms {
            search.terms(choice, trials)?;
        }
        search.modes(choice, trials)?;
        if shows_terms {
            search.fewer_terms(choice, trials)?;
        }
        Ok("the fewest whose motion is within the tolerances".to_owned())
    }

    /// Measures the chosen model in every case, and says what may go wrong with it.
    fn measure_choice(&mut self, search: &Search<'_>) -> Result<()> {
        let mut chosen = Vec::new();
        let mut growth = None;
        for (runs, measure) in search.cases {
            let (modes, groups) = (&self.choice.modes, self.choice.groups);
            let (trial, history) = runs.measured(measure, modes, groups, search.budget())?;
            let tolerance = &self.scene.requirements.tolerance;
            let own = history.and_then(|history| history.growth(measure.trace(), tolerance));
            growth = [growth, own].into_iter().flatten().reduce(f64::max);
            self.diagnostics.extend(resonances(runs, measure, modes));
            chosen.push(trial);
        }
        self.diagnostics.extend(growth.map(phase_drifts));
        self.choice.chosen = Some(worst(chosen.into_iter()));
        Ok(())
    }
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
