//! Groups left open by bounds are decided by simulation: the state of a selection, the search for a cheaper model by
//! measured motion, and warnings about a selection whose errors are within the tolerances.

use super::cases::{Case, SLACK_OF_RANGE, sets_in, together, worst};
use super::choice::Choice;
use super::demand::{BEYOND_BAND, Demand};
use super::ranking::{by_weight, fewest, first_of, weights};
use super::shapes::Pool;
use super::situation::PointRows;
use super::trial::{Trial, TrialRuns, multiplications};
use super::variations::{VariedRuns, VariedSelection};
use crate::reference::PART_OF_REFERENCE;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::FREE_MODE;
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_linalg::ties::{TIE_MARGIN, first_largest};
use flexbody_motion::scene::{Axes, History, LoadCases, Measure, Scene, StressError, Trace, VectorHistory};
use std::f64::consts::TAU;

/// Trials and current choice of a selection.
pub(super) struct SelectionState<'s> {
    demands: &'s [Demand<'s>],
    pub choice: Choice,
    pub trials: Vec<Trial>,
    /// Largest angular velocity of the runs and the allowed one, for each load case; `None` if the runs reach the
    /// allowed one.
    pub short_of: Vec<Option<(f64, f64)>>,
    /// Error of the missing stress stiffness of the spin in each load case.
    pub stress_errors: Vec<Option<StressError>>,
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
            diagnostics.extend(demand.diagnostics.iter().cloned().map(|said| demand.about(said)));
            let warning =
                demand.reference_errors.last().and_then(|own| own.warning(demand.scene, PART_OF_REFERENCE));
            let remarks = demand.reference_errors.last().map(|own| own.remarks(demand.scene));
            diagnostics.extend(remarks.into_iter().flatten().chain(warning).map(|said| demand.about(said)));
            let case = (demands.len() > 1).then_some(at);
            trials.extend(demand.bounds.iter().map(|trial| Trial { case, ..trial.clone() }));
        }
        let groups = demands.iter().fold(TermGroups::NONE, |groups, demand| groups.or(demand.groups()));
        let choice = Choice::of_modes(groups, demands[0].body.n_modes());
        let (short_of, stress_errors) = (vec![None; demands.len()], vec![None; demands.len()]);
        let (chosen_by_case, varied) = (Vec::new(), Vec::new());
        let groups_of_variations = TermGroups::NONE;
        Self {
            demands,
            choice,
            trials,
            short_of,
            stress_errors,
            chosen_by_case,
            varied,
            groups_of_variations,
            diagnostics,
        }
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
            let free = modes.provenance.get(j).is_none_or(|from| from == FREE_MODE);
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
        context.runs(self.demands.iter().map(|demand| demand.cases.len()).sum());
        let references = self.reference_motions()?;
        let demands = self.demands;
        let all = demands.iter().zip(&references).zip(&self.stress_errors);
        let cases: Vec<TestedCase<'_>> = all
            .map(|((demand, motions), stress)| Self::tested_case(demand, motions, stress.as_ref()))
            .collect();
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
            reason = self.judge(varied, cases_with_variations, reason)?;
        }
        self.measure_choice(&search)?;
        Ok(reason)
    }

    fn tested_case<'t>(
        demand: &'t Demand<'t>,
        references: &'t [Trace],
        stress_error: Option<&StressError>,
    ) -> TestedCase<'t> {
        let scenes = demand.cases.iter().zip(references);
        TestedCase {
            scenes: scenes
                .map(|(case, trace)| TestScene {
                    runs: case.runs(),
                    measure: Measure::new(demand.body, case.runs().scene, trace),
                })
                .collect(),
            budget: demand.budget(stress_error),
        }
    }

    /// Returns the motion of the whole body, with the groups that bounds do not rule out, in every scene of every load
    /// case.
    fn reference_motions(&mut self) -> Result<Vec<Vec<Trace>>> {
        let mut by_case = Vec::new();
        let of_cases = self.short_of.iter_mut().zip(&mut self.stress_errors);
        for (demand, (short_of, stress_error)) in self.demands.iter().zip(of_cases) {
            let mut references = Vec::new();
            for case in &demand.cases {
                let (reference, said) =
                    case.runs().motion(demand.groups()).map_err(|error| match demand.name {
                        Some(name) => error.about(format!("case `{name}`")),
                        None => error,
                    })?;
                self.diagnostics.extend(said.into_iter().map(|said| demand.about(said)));
                let own = case.runs().stress_error(demand.groups(), &reference)?;
                *stress_error = first_largest(stress_error.take().into_iter().chain(own), |one| one.worst);
                references.push(reference);
            }
            let warning = stress_error.as_ref().and_then(|own| own.warning(demand.body));
            self.diagnostics.extend(warning.map(|said| demand.about(said)));
            let largest = references.iter().map(|reference| reference.extremes.spin).fold(0.0, f64::max);
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
        search.shapes(choice, trials)?;
        search.fewer_terms(choice, trials)?;
        let within = match self.demands.len() {
            1 => "the tolerances",
            _ => "the tolerances of every load case",
        };
        Ok(match choice.pool {
            Pool::Modes => format!("the fewest modes whose motion is within {within}"),
            Pool::FixedInterface => format!(
                "all motions of the interfaces, and the fewest fixed-interface modes with which the motion is within {within}"
            ),
        })
    }

    /// Judges the choice on variations, and returns the reason for the modes. Terms and modes are added until it holds there if
    /// the variations are required.
    fn judge(&mut self, varied: &VariedRuns<'_>, cases: &LoadCases, reason: String) -> Result<String> {
        let is_limited = self.demands[0].scene.requirements.multiplications.is_some();
        let held = self.demands[0].body.groups();
        let modes = self.choice.modes.clone();
        if !cases.requires_variations() {
            self.varied = varied.tell(&self.choice, held, cases)?;
            return Ok(reason);
        }
        let groups = self.choice.groups;
        self.varied = varied.judge(&mut self.choice, held, is_limited, cases)?;
        self.groups_of_variations = self.choice.groups.and(groups.complement());
        self.diagnostics.extend(self.varied.iter().filter_map(VariedSelection::warning));
        if modes == self.choice.modes {
            return Ok(reason);
        }
        Ok(format!(
            "{reason}; with {} more, without which the errors exceed the tolerances in variations of the scene",
            self.choice.modes.len() - modes.len()
        ))
    }

    /// Measures the chosen model in every scene, and adds warnings about it.
    fn measure_choice(&mut self, search: &SelectionSearch<'_>) -> Result<()> {
        for (demand, case) in self.demands.iter().zip(search.cases) {
            let mut chosen = Vec::new();
            let mut growth = None;
            for TestScene { runs, measure } in &case.scenes {
                let Choice { pool, modes, groups, .. } = &self.choice;
                let (trial, history) = runs.measured_of(*pool, measure, modes, *groups, case.budget)?;
                let own = history.and_then(|history| history.growth(measure.trace(), demand.tolerance()));
                growth = [growth, own].into_iter().flatten().reduce(f64::max);
                let said = resonances(runs, measure, *pool, modes).into_iter();
                self.diagnostics.extend(said.map(|said| demand.about(said)));
                chosen.push(trial);
            }
            self.diagnostics.extend(growth.map(|growth| demand.about(phase_drifts(growth))));
            self.chosen_by_case.push(worst(chosen.into_iter()));
        }
        self.choice.chosen = Some(together(self.chosen_by_case.clone()));
        let count = self.choice.modes.len();
        if count < self.choice.ranked.len() {
            let more = first_of(&self.choice.ranked, count + 1);
            self.choice.next = Some(search.measured(self.choice.pool, &more, self.choice.groups, 1.0)?);
        }
        Ok(())
    }
}

/// Part of the remaining tolerances that dropped terms may take before modes are dropped. In the last search, with the
/// kept modes, they may take all of it.
const PART_OF_TERMS: f64 = 0.5;

/// Number of modes, relative to that of the body with some fixed-interface modes and all motions of its interfaces, below
/// which modes are picked instead. A larger value takes fewer modes, which hold under fewer other loads.
const PART_OF_MODES: f64 = 0.75;

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
        let own = weights(&case.runs().shares(Pool::Modes, motion), &scene.requirements.tolerance);
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
struct SelectionSearch<'s> {
    /// Load cases, at least one.
    pub cases: &'s [TestedCase<'s>],
    /// Groups that must be kept: a run that turns slower than its scene allows cannot show that a term may be dropped.
    pub fixed: TermGroups,
    /// True if the body is carried in a load case; W2 and W3 are then kept only beside W1.
    pub carried: bool,
}

impl SelectionSearch<'_> {
    fn body(&self) -> &FlexBody {
        self.cases[0].scenes[0].runs.body
    }

    /// Measures a model with `shapes` of a pool in all load cases. It may use `part` of the remaining tolerances of each.
    fn measured(&self, pool: Pool, shapes: &[usize], groups: TermGroups, part: f64) -> Result<Trial> {
        let in_case = |case: &TestedCase<'_>| -> Result<Trial> {
            let measured = |TestScene { runs, measure }: &TestScene<'_>| -> Result<Trial> {
                Ok(runs.measured_of(pool, measure, shapes, groups, part * case.budget)?.0)
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
    fn fewer_terms(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        self.cheapest(1.0, choice, trials)
    }

    /// Chooses the first set of groups whose motion is within `part` of the tolerances.
    fn cheapest(&self, part: f64, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        // Proper subsets of the current groups that contain all fixed groups, cheapest first.
        let smaller = sets_in(self.carried)
            .filter(|set| *set != choice.groups && set.and(choice.groups) == *set)
            .filter(|set| set.and(self.fixed) == self.fixed);
        for groups in smaller.collect::<Vec<_>>() {
            let trial = self.measured(choice.pool, &choice.modes, groups, part)?;
            let passed = trial.passed();
            trials.push(trial);
            if passed {
                choice.groups = groups;
                break;
            }
        }
        Ok(())
    }

    /// Returns the number of shapes of a pool.
    fn number_of(&self, pool: Pool) -> usize {
        self.cases[0].scenes[0].runs.number_of(pool)
    }

    /// Returns true if fixed-interface modes may be left out in every scene.
    fn has_fixed_interface_modes(&self) -> bool {
        let scenes = self.cases.iter().flat_map(|case| &case.scenes);
        scenes.into_iter().all(|scene| scene.runs.fixed.is_some())
    }

    /// Returns the shapes of the pool by descending contribution, and records their shares.
    pub(super) fn ranked(&self, choice: &mut Choice) -> Vec<usize> {
        let mut weight = vec![0.0f64; self.number_of(choice.pool)];
        choice.shares.clear();
        for case in self.cases {
            for TestScene { runs, measure } in &case.scenes {
                let shares = runs.shares(choice.pool, measure.trace());
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
                    share.recovery = [share.recovery, other.recovery].into_iter().flatten().reduce(f64::max);
                }
            }
        }
        by_weight(&weight)
    }

    /// Chooses the pool from which the fewest shapes make a body of the fewest modes within the tolerances: fixed-interface
    /// modes, where the body has them, or modes.
    fn shapes(&self, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        let nf = self.body().n_modes();
        if !self.has_fixed_interface_modes() {
            return self.fewest_modes(nf, choice, trials);
        }
        // None may be enough beside motions of the interfaces that deform the body: counted from 1.
        choice.pool = Pool::FixedInterface;
        let ranked = self.ranked(choice);
        let passes = |above: usize| {
            let kept = first_of(&ranked, above - 1);
            trials.push(self.measured(Pool::FixedInterface, &kept, choice.groups, 1.0)?);
            Ok(trials[trials.len() - 1].passed())
        };
        let enough = fewest(usize::from(nf == ranked.len()), ranked.len() + 1, passes)? - 1;
        // Without motions of the interfaces other loads there hardly deform the body: modes must be clearly fewer.
        let mut of_modes = Choice::of_modes(choice.groups, nf);
        let most = ((nf - ranked.len() + enough) as f64 * PART_OF_MODES).ceil() as usize;
        self.fewest_modes(most, &mut of_modes, trials)?;
        if of_modes.modes.len() < most {
            *choice = of_modes;
        } else {
            choice.keep_most(&ranked, enough);
            choice.ranked = ranked;
        }
        Ok(())
    }

    /// Chooses the fewest modes, in the order of their contribution, whose motion is within the tolerances, or the first
    /// `most`, which are not tried.
    fn fewest_modes(&self, most: usize, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<()> {
        let ranked = self.ranked(choice);
        let passes = |count: usize| {
            trials.push(self.measured(Pool::Modes, &first_of(&ranked, count), choice.groups, 1.0)?);
            Ok(trials[trials.len() - 1].passed())
        };
        let enough = fewest(0, most, passes)?;
        choice.keep_most(&ranked, enough);
        choice.ranked = ranked;
        Ok(())
    }

    /// Chooses the most accurate model of at most `most` multiplications: for every set of groups, as many modes as the
    /// cost allows. Returns false if every model costs more.
    fn within_cost(&self, most: usize, choice: &mut Choice, trials: &mut Vec<Trial>) -> Result<bool> {
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
            let modes = first_of(&ranked, fits);
            // Measure the set with these modes, and keep the most accurate.
            let trial = self.measured(Pool::Modes, &modes, groups, 1.0)?;
            if best.as_ref().is_none_or(|(worst, ..)| trial.worst < *worst * (1.0 - TIE_MARGIN)) {
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

/// Relative distance from a mode's frequency within which a load is resonant. Three half widths of the resonance count
/// if these are larger.
const RESONANCE_DISTANCE: f64 = 0.1;

/// Returns the warning that the errors of the selected model grow `growth` times faster than its motion.
fn phase_drifts(growth: f64) -> Diagnostic {
    let message = format!(
        "from the first half of the run to the second, the errors of the selected model grow {growth:.1} times more than the motion"
    );
    Diagnostic::new(Code::PhaseDrifts, message)
}

/// Returns warnings about dropped shapes of a pool that a load excites near their frequency.
fn resonances(runs: &TrialRuns<'_>, measure: &Measure<'_>, pool: Pool, kept: &[usize]) -> Vec<Diagnostic> {
    let (body, scene) = (runs.body, runs.scene);
    let (rows, shapes) = (PointRows::new(body), runs.shapes(pool));
    let spin = measure.trace().extremes.spin;
    let mut diagnostics = Vec::new();
    for (load, point) in scene.loads.iter().zip(runs.loads) {
        // Seen from the body, a force that is fixed in space turns backwards with the spin.
        let turning = if load.axes == Axes::World { spin } else { 0.0 };
        let rates: Vec<f64> = match &load.force {
            VectorHistory::Along { factor: History::Sine { frequency, .. }, .. } => {
                [-1.0, 0.0, 1.0].iter().map(|sign| (TAU * frequency + sign * turning).abs()).collect()
            }
            _ => vec![turning],
        };
        let modal = shapes.rows(rows.of(point));
        for (j, lambda) in shapes.eigenvalues().iter().enumerate() {
            let moved =
                modal.column(j).norm() * load.force.main_direction().map_or(0.0, |along| along.norm());
            let near = |rate: &&f64| {
                let width = RESONANCE_DISTANCE.max(3.0 * shapes.damping_ratio(j));
                (*rate / lambda.sqrt() - 1.0).abs() < width
            };
            if moved == 0.0 || kept.binary_search(&j).is_ok() {
                continue;
            }
            if let Some(rate) = rates.iter().find(near) {
                let message = format!(
                    "{} {} of frequency {:.4e} is dropped, but the load at {} excites it at {:.4e} (oscillations per unit of time)",
                    shapes.noun(),
                    j + 1,
                    lambda.sqrt() / TAU,
                    load.at,
                    rate / TAU
                );
                diagnostics.push(Diagnostic::new(Code::ResonanceDropped, message));
            }
        }
    }
    diagnostics
}
