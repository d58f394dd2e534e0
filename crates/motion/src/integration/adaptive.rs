//! Explicit steps, and exponential ones where oscillators alone hold these back.

use super::exponential::Exponential;
use super::{Explicit, Failure, System, Work};

/// Number of explicit steps after which exponential steps are tried; doubled after each change back.
const FEWEST_TAKEN: u32 = 8;
const MOST_TAKEN: u32 = 512;

/// Smallest ratio of the longest exponential to the longest explicit step with which exponential steps are tried.
const WORTHWHILE: f64 = 3.0;

/// Length of an explicit step that follows the fastest oscillator, relative to the longest stable one.
const FOLLOWING: f64 = 0.2;

/// Number of evaluations of an explicit step.
const RATES_OF_EXPLICIT: f64 = 12.0;

/// Largest cost of exponential steps, relative to that of the explicit ones before, with which they go on.
const MAX_COST: f64 = 0.8;

/// Length of the first exponential step relative to that of the explicit one before.
const FIRST: f64 = 2.0;

/// Number of exponential steps whose cost is judged together.
const JUDGED: u32 = 4;

/// Steps with error control: those of [`Explicit`], and exponential collocation while oscillators make explicit steps shorter than
/// the motion needs. A stiff part that follows its loads, or that has come to rest, is then passed in steps of the motion.
///
/// The oscillators are solved in closed form under the polynomial of degree 7 through eight values of everything else
/// (Hochbruck, Ostermann, Exponential integrators, Acta Numerica 19, 2010, section 2.2), to a hundredth of the tolerance.
///
/// Numbers of evaluations decide between the two, never the time that they take.
#[derive(Debug, Clone)]
pub struct Adaptive {
    explicit: Explicit,
    exponential: Option<Box<Exponential>>,
    /// Kind of the next step, and of the last one.
    is_exponential: bool,
    was_exponential: bool,
    /// Number of successive explicit steps, and the number from which exponential steps are tried.
    taken: u32,
    wait: u32,
    /// Length of the last explicit step that nothing shortened.
    length: f64,
    /// Steps, advance and evaluations of the exponential steps that are judged.
    steps: u32,
    advance: f64,
    rates: f64,
}

impl Adaptive {
    /// Creates the method from explicit steps for `system`. Exponential steps are not longer than those that
    /// [`Explicit::longest_at_rest`] allows; without oscillators there are none.
    pub fn new(explicit: Explicit, system: &dyn System) -> Self {
        let (stable, longest) = explicit.longest_steps();
        let is_stiff = !system.oscillators().is_empty() && longest > WORTHWHILE * stable;
        let exponential = is_stiff.then(|| Box::new(Exponential::new(system, explicit.tolerance(), longest)));
        Self {
            explicit,
            exponential,
            is_exponential: false,
            was_exponential: false,
            taken: 0,
            wait: FEWEST_TAKEN,
            length: stable,
            steps: 0,
            advance: 0.0,
            rates: 0.0,
        }
    }

    /// Returns the work done so far.
    pub fn work(&self) -> Work {
        let (own, other) =
            (self.explicit.work(), self.exponential.as_ref().map_or_else(Work::default, |one| one.work()));
        Work {
            steps: own.steps + other.steps,
            rejected: own.rejected + other.rejected,
            rates: own.rates + other.rates,
        }
    }

    /// Discards the last step, because f or the state jumps here.
    pub fn restart(&mut self) {
        self.explicit.restart();
        (self.taken, self.wait) = (0, FEWEST_TAKEN);
        if let (true, Some(exponential)) = (self.is_exponential, &mut self.exponential) {
            exponential.begin(self.length);
        }
    }

    /// Takes one step from `time`, at most to `end`, and returns its end.
    ///
    /// # Errors
    /// The errors of [`Explicit::step`].
    pub fn step(
        &mut self,
        system: &mut dyn System,
        time: f64,
        state: &mut [f64],
        end: f64,
    ) -> Result<f64, Failure> {
        if self.is_exponential
            && let Some(until) = self.exponential_step(system, time, state, end)?
        {
            self.was_exponential = true;
            return Ok(until);
        }
        self.was_exponential = false;
        let until = self.explicit.step(system, time, state, end)?;
        self.taken += 1;
        if let (true, true, Some(exponential)) = (self.taken >= self.wait, until < end, &mut self.exponential)
        {
            self.length = self.explicit.last_length().min(self.explicit.longest_steps().0);
            exponential.begin(FIRST * self.length);
            self.is_exponential = true;
            (self.steps, self.advance, self.rates) = (0, 0.0, 0.0);
        }
        Ok(until)
    }

    /// Takes an exponential step; `None` if explicit ones cost less.
    fn exponential_step(
        &mut self,
        system: &mut dyn System,
        time: f64,
        state: &mut [f64],
        end: f64,
    ) -> Result<Option<f64>, Failure> {
        let Some(exponential) = &mut self.exponential else { return Ok(None) };
        let before = exponential.work().rates;
        while exponential.proposed() >= self.length.min(end - time) {
            let Some(until) = exponential.step(system, time, state, end)? else { continue };
            // Steps that cost more than the explicit ones before are the last.
            self.steps += 1;
            self.advance += until - time;
            self.rates += (exponential.work().rates - before) as f64;
            if self.steps >= JUDGED {
                let costs_more = self.rates * self.length > MAX_COST * RATES_OF_EXPLICIT * self.advance;
                (self.steps, self.advance, self.rates) = (0, 0.0, 0.0);
                if costs_more {
                    self.change_back();
                } else {
                    self.wait = FEWEST_TAKEN;
                }
            }
            return Ok(Some(until));
        }
        self.change_back();
        Ok(None)
    }

    /// Computes the state at `time` within the last step, which ended in `after`.
    ///
    /// # Errors
    /// The failures of the system.
    ///
    /// # Panics
    /// When no step was taken since the start.
    pub fn interpolate(
        &mut self,
        system: &mut dyn System,
        time: f64,
        after: &[f64],
        state: &mut [f64],
    ) -> Result<(), Failure> {
        match &self.exponential {
            Some(exponential) if self.was_exponential => {
                exponential.interpolate(system, time, state);
                Ok(())
            }
            _ => self.explicit.interpolate(system, time, after, state),
        }
    }

    /// Returns true if the last step was exponential.
    pub(super) fn is_long(&self) -> bool {
        self.was_exponential
    }

    /// Returns the number of parts of the last step to be seen, a multiple of the `parts` of an explicit step: more where an
    /// oscillator rings visibly, but not more than of explicit steps that follow the fastest oscillator.
    pub(super) fn parts(&self, parts: usize) -> usize {
        match &self.exponential {
            Some(exponential) if self.was_exponential && parts > 1 => {
                let most = exponential.last_length() / (FOLLOWING * self.explicit.longest_steps().0);
                let finer = (exponential.points() / parts as f64).min(most).ceil().max(1.0);
                parts * finer as usize
            }
            _ => parts,
        }
    }

    fn change_back(&mut self) {
        self.is_exponential = false;
        self.explicit.restart();
        (self.taken, self.wait) = (0, MOST_TAKEN.min(2 * self.wait));
    }
}
