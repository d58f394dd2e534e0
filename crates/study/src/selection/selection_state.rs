//! State of a selection: groups left open by bounds are decided by simulation.

use super::basis::BEYOND_BAND;
use super::cases::{SLACK_OF_RANGE, together, worst};
use super::demand::Demand;
use super::search::{Choice, SelectionSearch, TestScene, TestedCase};
use super::trial::Trial;
use super::varied::{VariedRuns, VariedSelection};
use super::warnings::{phase_drifts, resonances};
use crate::reference::{PART_OF_REFERENCE, ReferenceError};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_body::flex_body::TermGroups;
use flexbody_linalg::context::Context;
use flexbody_motion::scene::{LoadCases, Measure, Trace};

/// Trials and current choice of a selection.
pub(super) struct SelectionState<'s> {
    demands: &'s [Demand<'s>],
    pub choice: Choice,
    pub trials: Vec<Trial>,
    /// Largest angular velocity of the runs and the allowed one, for each load case; `None` if the runs reach the
    /// allowed one.
    pub short_of: Vec<Option<(f64, f64)>>,
    /// Measured trial of the chosen model in each load case.
    pub chosen_by_case: Vec<Trial>,
    /// Errors of the chosen model in variations of the scene.
    pub varied: Vec<VariedSelection>,
    /// Groups that the scene alone would drop, and that variations need.
    pub groups_of_variations: TermGroups,
    pub diagnostics: Vec<Diagnostic>,
}

impl<'s> SelectionState<'s> {
    /// Starts with all modes, and with the groups that bounds leave open in at least one load case.
    pub(super) fn new(demands: &'s [Demand<'s>]) -> Self {
        let mut diagnostics = Vec::new();
        let mut trials = Vec::new();
        for (at, demand) in demands.iter().enumerate() {
            diagnostics.extend(demand.found.iter().cloned().map(|said| demand.about(said)));
            let warning =
                demand.reference_errors.last().and_then(|own| own.warning(demand.scene, PART_OF_REFERENCE));
            let remark = demand.reference_errors.last().and_then(ReferenceError::coupling_remark);
            diagnostics.extend(remark.into_iter().chain(warning).map(|said| demand.about(said)));
            let case = (demands.len() > 1).then_some(at);
            trials.extend(demand.bounds.iter().map(|trial| Trial { case, ..trial.clone() }));
        }
        let choice = Choice {
            groups: demands.iter().fold(TermGroups::NONE, |groups, demand| groups.or(demand.groups())),
            modes: (0..demands[0].body.n_modes()).collect(),
            shares: Vec::new(),
            chosen: None,
        };
        let short_of = vec![None; demands.len()];
        let (chosen_by_case, varied) = (Vec::new(), Vec::new());
        let groups_of_variations = TermGroups::NONE;
        Self { demands, choice, trials, short_of, chosen_by_case, varied, groups_of_variations, diagnostics }
    }

    /// Returns true if all load cases have a duration, so that motion can be measured.
    pub(super) fn has_run(&self) -> bool {
        self.demands.iter().all(|demand| demand.scene.run.duration.is_some())
    }

    /// Chooses the modes up to the highest band of the load cases, or all modes if one case has no band. Returns the
    /// reason.
    pub(super) fn choose_by_band(&mut self) -> String {
        let bands = self.demands.iter().map(|demand| demand.scene.requirements.band);
        let band = bands.collect::<Option<Vec<f64>>>().map(|bands| bands.into_iter().fold(0.0, f64::max));
        let modes = self.demands[0].body.modes();
        let within = |&j: &usize| {
            let frequency = modes.eigenvalue[j].sqrt() / std::f64::consts::TAU;
            // Residual vectors are kept: they replace the modes beyond the band.
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
            None => "all modes, because the scene has neither a duration nor a band".to_owned(),
        }
    }

    /// Chooses terms and modes by integrated motion, and judges them on variations of the scene. Returns the reason for
    /// the modes.
    pub(super) fn choose_by_motion(
        &mut self,
        cases_with_variations: &LoadCases,
        varied: Option<&VariedRuns<'_>>,
        context: &Context<'_>,
    ) -> Result<String> {
        context.phase("reference motion");
        let references = self.reference_motions()?;
        let demands = self.demands;
        let both = demands.iter().zip(&references);
        let cases: Vec<TestedCase<'_>> =
            both.map(|(demand, motions)| Self::tested_case(demand, motions)).collect();
        context.phase("trials");
        let fixed = demands.iter().zip(&self.short_of).filter(|(_, short)| short.is_some());
        let search = SelectionSearch {
            cases: &cases,
            fixed: fixed.fold(TermGroups::NONE, |fixed, (demand, _)| fixed.or(demand.groups())),
            carried: demands.iter().any(|demand| demand.scene.carried.is_some()),
        };
        let mut reason = self.search(&search)?;
        if let Some(varied) = varied {
            context.phase("variations");
            reason = self.judge(&search, varied, cases_with_variations, reason)?;
        }
        self.measure_choice(&search)?;
        Ok(reason)
    }

    fn tested_case<'t>(demand: &'t Demand<'t>, references: &'t [Trace]) -> TestedCase<'t> {
        let scenes = demand.cases.iter().zip(references);
        TestedCase {
            scenes: scenes
                .map(|(case, trace)| TestScene {
                    runs: case.runs(),
                    measure: Measure::new(demand.body, trace),
                })
                .collect(),
            budget: demand.budget(),
        }
    }

    /// Returns the motion of the whole body, with the groups that bounds do not rule out, in every scene of every load
    /// case.
    fn reference_motions(&mut self) -> Result<Vec<Vec<Trace>>> {
        let mut by_case = Vec::new();
        for (demand, short_of) in self.demands.iter().zip(&mut self.short_of) {
            let mut references = Vec::new();
            for case in &demand.cases {
                let (reference, said) =
                    case.runs().motion(demand.groups()).map_err(|error| match demand.name {
                        Some(name) => error.about(format!("case `{name}`")),
                        None => error,
                    })?;
                self.diagnostics.extend(said.into_iter().map(|said| demand.about(said)));
                references.push(reference);
            }
            let largest = references.iter().map(|one| one.extremes.spin).fold(0.0, f64::max);
            let allowed = demand.situation.spin.value;
            let is_given = demand.scene.requirements.motion.angular_velocity.is_some();
            if allowed > SLACK_OF_RANGE * largest && is_given {
                *short_of = Some((largest, allowed));
            }
            by_case.push(references);
        }
        Ok(by_case)
    }

    /// Drops terms and modes. Returns the reason for the modes.
    fn search(&mut self, search: &SelectionSearch<'_>) -> Result<String> {
        let (choice, trials) = (&mut self.choice, &mut self.trials);
        if let Some(most) = self.demands[0].scene.requirements.multiplications {
            return Ok(if search.within_cost(most, choice, trials)? {
                format!("the smallest error with at most {most} multiplications")
            } else {
                format!("no model needs {most} multiplications or fewer: everything is kept")
            });
        }
        search.terms(choice, trials)?;
        search.modes(choice, trials)?;
        search.fewer_terms(choice, trials)?;
        let within = match self.demands.len() {
            1 => "the tolerances",
            _ => "the tolerances of every load case",
        };
        Ok(format!("the fewest modes whose motion is within {within}"))
    }

    /// Judges the choice on variations, adds terms and modes until it holds there, and returns the reason for the modes.
    fn judge(
        &mut self,
        search: &SelectionSearch<'_>,
        varied: &VariedRuns<'_>,
        cases: &LoadCases,
        reason: String,
    ) -> Result<String> {
        let is_limited = self.demands[0].scene.requirements.multiplications.is_some();
        let held = self.demands[0].body.groups();
        let ranked = search.ranked(&mut self.choice);
        let modes = self.choice.modes.clone();
        self.choice.keep(modes.clone());
        let groups = self.choice.groups;
        self.varied = varied.judge(&mut self.choice, &ranked, held, is_limited, cases)?;
        self.groups_of_variations = self.choice.groups.and(groups.complement());
        self.diagnostics.extend(self.varied.iter().filter_map(VariedSelection::warning));
        if modes == self.choice.modes {
            return Ok(reason);
        }
        Ok(format!(
            "{reason}; with {} more, so that variations of the scene hold",
            self.choice.modes.len() - modes.len()
        ))
    }

    /// Measures the chosen model in every scene, and adds warnings about it.
    fn measure_choice(&mut self, search: &SelectionSearch<'_>) -> Result<()> {
        for (demand, case) in self.demands.iter().zip(search.cases) {
            let mut chosen = Vec::new();
            let mut growth = None;
            for TestScene { runs, measure } in &case.scenes {
                let (modes, groups) = (&self.choice.modes, self.choice.groups);
                let (trial, history) = runs.measured(measure, modes, groups, case.budget)?;
                let own = history.and_then(|history| history.growth(measure.trace(), demand.tolerance()));
                growth = [growth, own].into_iter().flatten().reduce(f64::max);
                let said = resonances(runs, measure, modes).into_iter();
                self.diagnostics.extend(said.map(|said| demand.about(said)));
                chosen.push(trial);
            }
            self.diagnostics.extend(growth.map(|growth| demand.about(phase_drifts(growth))));
            self.chosen_by_case.push(worst(chosen.into_iter()));
        }
        self.choice.chosen = Some(together(self.chosen_by_case.clone()));
        Ok(())
    }
}
