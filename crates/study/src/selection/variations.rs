//! Variations of the scene, on which a selection is judged whose terms and modes their motions did not choose.

use super::cases::Case;
use super::choice::Choice;
use super::demand::FramedTests;
use super::ranking::{by_weight, fewest, first_of, weights};
use super::trial::Trial;
use crate::reference::ReferenceError;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_motion::scene::{LoadCases, Measure, SceneVariation, Trace, ends_a_run};

/// Errors of a selected model in a variation of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct VariedSelection {
    /// Name of the variation.
    pub name: String,
    /// Name of the load case that it varies; `None` for a single scene.
    pub case: Option<String>,
    /// True if the scene file states the variation; false for a standard one.
    pub is_stated: bool,
    /// True if the model must hold in the variation: a stated one, or a standard one of a robust scene.
    pub is_required: bool,
    /// The selected model in the variation, measured against the whole body.
    pub chosen: Trial,
    /// The model that the scene alone would select; `None` if it is the selected one.
    pub of_scene: Option<Trial>,
    /// The groups that the scene alone would select, with all modes; `None` unless these groups fail in a variation.
    pub with_all_modes: Option<Trial>,
    /// Smallest model found that holds in the variation; `None` if the selected model does, if the variation is required, or
    /// if the whole body is no reference there.
    pub enough: Option<EnoughParts>,
    /// Truncation errors of the whole body in the variation; empty if no model is at hand.
    pub reference_errors: Vec<ReferenceError>,
}

/// Parts of a body that suffice in a variation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EnoughParts {
    /// Number of modes, those of the largest contribution to the scene.
    pub modes: usize,
    /// Groups.
    pub groups: TermGroups,
}

impl VariedSelection {
    /// Returns true if the selected model is within the tolerances in the variation, and the whole body is a reference
    /// there.
    pub fn holds(&self) -> bool {
        self.chosen.passed() && self.reference_errors.last().is_none_or(ReferenceError::is_reference)
    }

    /// Returns the warning about a model that does not hold; `None` if it does, or if it need not.
    pub(super) fn warning(&self) -> Option<Diagnostic> {
        if self.holds() || !self.is_required {
            return None;
        }
        let message = match self.reference_errors.last().filter(|own| !own.is_reference()) {
            Some(own) => format!(
                "the selection cannot be judged in this variation: the body with all its modes differs from the FE model by about {} of the tolerances (estimated)",
                own.part_of_tolerances()
            ),
            None => format!(
                "the selected modes and terms are off by {:.3} times the tolerances in this variation",
                self.chosen.worst
            ),
        };
        Some(Diagnostic::new(Code::VariationFails, message).about(format!("variation `{}`", self.name)))
    }
}

/// Variations in which a selection is judged, each with the motion of the whole body.
pub(super) struct VariedRuns<'v> {
    variations: Vec<&'v SceneVariation>,
    cases: Vec<Case<'v>>,
    references: Vec<Trace>,
    /// Truncation errors of the whole body in each variation; empty lists if none are known.
    reference_errors: Vec<&'v [ReferenceError]>,
    /// Notes about variations that cannot be simulated.
    pub diagnostics: Vec<Diagnostic>,
}

impl<'v> VariedRuns<'v> {
    /// Simulates the whole body in every variation. `reference_errors` are its truncation errors there. Unless the scene
    /// file states the variations, one whose simulation stops is left out.
    ///
    /// # Errors
    /// The errors of [`trace`](flexbody_motion::scene::trace).
    pub(super) fn new(
        all: &'v [SceneVariation],
        cases: &LoadCases,
        framed: &'v [FramedTests<'_>],
        reference_errors: &'v [Vec<ReferenceError>],
        context: &Context<'v>,
    ) -> Result<Self> {
        let mut runs = Self {
            variations: Vec::new(),
            cases: Vec::new(),
            references: Vec::new(),
            reference_errors: Vec::new(),
            diagnostics: Vec::new(),
        };
        for (at, (tests, one)) in framed.iter().zip(all).enumerate() {
            let case = Case::new(&tests.body, &tests.scene, context)?.with_fixed(tests.fixed.as_ref());
            let motion = case.runs().motion(tests.body.groups());
            match motion {
                Ok((motion, _)) => runs.references.push(motion),
                Err(error) => match stops(&error, one).filter(|_| !cases.requires_variations()) {
                    Some(note) => {
                        runs.diagnostics.push(note);
                        continue;
                    }
                    None => return Err(error.about(format!("variation `{}`", one.name))),
                },
            }
            runs.cases.push(case);
            runs.variations.push(one);
            runs.reference_errors.push(reference_errors.get(at).map_or(&[], Vec::as_slice));
        }
        Ok(runs)
    }

    /// Returns true if there is no variation.
    pub(super) fn is_empty(&self) -> bool {
        self.variations.is_empty()
    }

    /// Measures a model in every variation; `measures` belong to the references.
    fn measured(&self, measures: &[Measure<'_>], choice: &Choice) -> Result<Vec<Trial>> {
        let trial = |(at, (case, measure)): (usize, (&Case<'v>, &Measure<'_>))| {
            let budget = ReferenceError::left(self.reference_errors[at]);
            Ok(case.runs().measured_of(choice.pool, measure, &choice.modes, choice.groups, budget)?.0)
        };
        self.cases.iter().zip(measures).enumerate().map(trial).collect()
    }

    /// Returns the measures of all variations. They look at all nodes and instants of the references: made once for all
    /// models.
    fn measures(&self) -> Vec<Measure<'_>> {
        let both = self.cases.iter().zip(&self.references);
        both.map(|(case, reference)| Measure::new(case.body, case.scene, reference)).collect()
    }

    /// Returns the modes of `choice`, then the others by their contribution to the motion in some of the variations, largest
    /// first.
    fn order(&self, choice: &Choice, of: &[usize], measures: &[Measure<'_>]) -> Vec<usize> {
        let mut weight: Vec<f64> = Vec::new();
        for &at in of {
            let runs = self.cases[at].runs();
            let shares = runs.shares(choice.pool, measures[at].trace());
            let own = weights(&shares, &runs.scene.requirements.tolerance);
            weight.resize(own.len(), 0.0);
            weight.iter_mut().zip(own).for_each(|(weight, own)| *weight = weight.max(own));
        }
        let others = by_weight(&weight).into_iter().filter(|mode| choice.modes.binary_search(mode).is_err());
        choice.modes.iter().copied().chain(others).collect()
    }

    /// Measures `choice` in each variation. Where it does not hold, looks for the fewest further modes with which its groups
    /// hold there, or else all groups of `held`.
    pub(super) fn tell(
        &self,
        choice: &Choice,
        held: TermGroups,
        cases: &LoadCases,
    ) -> Result<Vec<VariedSelection>> {
        let measures = self.measures();
        let tell = |(at, chosen): (usize, Trial)| {
            let reference_errors = self.reference_errors[at].to_vec();
            let is_reference = reference_errors.last().is_none_or(ReferenceError::is_reference);
            let enough = if chosen.passed() || !is_reference {
                None
            } else {
                self.enough(at, &measures, choice, held)?
            };
            Ok(VariedSelection {
                name: self.variations[at].name.clone(),
                case: cases.case_name(self.variations[at].case).map(str::to_owned),
                is_stated: false,
                is_required: false,
                chosen,
                of_scene: None,
                with_all_modes: None,
                enough,
                reference_errors,
            })
        };
        self.measured(&measures, choice)?.into_iter().enumerate().map(tell).collect()
    }

    /// Returns the fewest modes, those of `choice` among them, with which the model holds in the variation `at`: by bisection
    /// with the groups of `choice` or, if these fail with all modes, with those of `held`. `None` if everything is not enough.
    fn enough(
        &self,
        at: usize,
        measures: &[Measure<'_>],
        choice: &Choice,
        held: TermGroups,
    ) -> Result<Option<EnoughParts>> {
        let ranked = self.order(choice, &[at], measures);
        let budget = ReferenceError::left(self.reference_errors[at]);
        let passes = |count: usize, groups: TermGroups| -> Result<bool> {
            let (runs, modes) = (self.cases[at].runs(), first_of(&ranked, count));
            Ok(runs.measured_of(choice.pool, &measures[at], &modes, groups, budget)?.0.passed())
        };
        let sets: &[TermGroups] = if choice.groups == held { &[held] } else { &[choice.groups, held] };
        for &groups in sets {
            if !passes(ranked.len(), groups)? {
                continue;
            }
            // The shapes of the choice with its own groups have failed. Counted from 1, since none may be enough.
            let too_few = choice.modes.len() + 1 - usize::from(groups != choice.groups);
            let modes = fewest(too_few, ranked.len() + 1, |above| passes(above - 1, groups))? - 1;
            let runs = self.cases[at].runs();
            let others = runs.body.n_modes() - runs.number_of(choice.pool);
            return Ok(Some(EnoughParts { modes: others + modes, groups }));
        }
        Ok(None)
    }

    /// Judges `choice`. Unless the scene limits the cost, modes are added in the order of their contribution to the variations
    /// until the model is within the tolerances of each; before, all groups of `held` if those of `choice` are not enough even
    /// with all modes. Returns the errors in each variation.
    pub(super) fn judge(
        &self,
        choice: &mut Choice,
        held: TermGroups,
        is_limited: bool,
        cases: &LoadCases,
    ) -> Result<Vec<VariedSelection>> {
        let measures = self.measures();
        let ranked = self.order(choice, &(0..self.cases.len()).collect::<Vec<_>>(), &measures);
        let of_scene = self.measured(&measures, choice)?;
        let mut chosen = of_scene.clone();
        let passed = |trials: &[Trial]| trials.iter().all(Trial::passed);
        let mut with_all_modes = None;
        if !is_limited && !passed(&chosen) && choice.groups != held {
            // Groups are at fault only if they fail with all modes.
            let modes = choice.modes.clone();
            choice.keep_most(&ranked, ranked.len());
            let whole = self.measured(&measures, choice)?;
            choice.keep(modes);
            if !passed(&whole) {
                choice.groups = held;
                chosen = self.measured(&measures, choice)?;
                with_all_modes = Some(whole);
            }
        }
        if !is_limited && !passed(&chosen) {
            let enough = fewest(choice.modes.len(), ranked.len(), |count| {
                choice.keep_most(&ranked, count);
                Ok(passed(&self.measured(&measures, choice)?))
            })?;
            choice.keep_most(&ranked, enough);
            chosen = self.measured(&measures, choice)?;
        }
        let is_changed = chosen != of_scene;
        let row = |(at, (chosen, before)): (usize, (Trial, Trial))| VariedSelection {
            name: self.variations[at].name.clone(),
            case: cases.case_name(self.variations[at].case).map(str::to_owned),
            is_stated: cases.states_variations(),
            is_required: true,
            chosen,
            of_scene: is_changed.then_some(before),
            with_all_modes: with_all_modes.as_ref().map(|all: &Vec<Trial>| all[at].clone()),
            enough: None,
            reference_errors: self.reference_errors[at].to_vec(),
        };
        Ok(chosen.into_iter().zip(of_scene).enumerate().map(row).collect())
    }
}

/// Returns a note that a variation judges nothing, if `error` says that its simulation stopped.
pub(crate) fn stops(error: &Error, variation: &SceneVariation) -> Option<Diagnostic> {
    let first = error.diagnostics().first()?;
    error.diagnostics().iter().all(|diagnostic| ends_a_run(diagnostic.code())).then(|| {
        let message = format!("variation `{}` judges nothing: {}", variation.name, first.message());
        Diagnostic::new(Code::VariationStops, message)
    })
}

/// Returns the body and every variation in one frame.
pub(super) fn framed_variations<'s>(
    body: &'s FlexBody,
    variations: &'s [SceneVariation],
) -> Result<Vec<FramedTests<'s>>> {
    let in_frame = |one: &'s SceneVariation| {
        FramedTests::new(body, &one.scene).map_err(|error| error.about(format!("variation `{}`", one.name)))
    };
    variations.iter().map(in_frame).collect()
}
