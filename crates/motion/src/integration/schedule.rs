//! Time loop shared by all integrators: output times, breaks, observers.

use super::{Adaptive, Explicit, Failure, Gauss, System, Work};

/// Relative difference of lengths that rounding of times explains.
const STEP_ROUNDING: f64 = 1e-9;

/// Relative distance before a break at which explicit steps end: a few roundings.
const BEFORE_BREAK: f64 = 4.0 * f64::EPSILON;

/// Integration method with its steps.
#[derive(Debug, Clone)]
pub enum Method {
    /// Steps as long as the tolerance and stability allow.
    Explicit(Explicit),
    /// Steps as long as the tolerance allows.
    Adaptive(Box<Adaptive>),
    /// Steps of constant length between two breaks, at most `step`.
    Gauss {
        /// Collocation method.
        method: Gauss,
        /// Longest step.
        step: f64,
    },
}

impl Method {
    /// Returns the work done so far.
    pub fn work(&self) -> Work {
        match self {
            Self::Explicit(method) => method.work(),
            Self::Adaptive(method) => method.work(),
            Self::Gauss { method, .. } => method.work(),
        }
    }

    fn restart(&mut self) {
        match self {
            Self::Explicit(method) => method.restart(),
            Self::Adaptive(method) => method.restart(),
            Self::Gauss { method, .. } => method.restart(),
        }
    }
}

/// Occasion of a state passed to an observer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ObserverEvent {
    /// Requested output time.
    Instant,
    /// Start of an interval without breaks: the first output time, and the far side of every break.
    Start,
    /// End of a step.
    End,
    /// Point within a step.
    Within,
    /// Point within a step that the motion alone limits: as far from its neighbours as the ends of other steps may be.
    Between,
}

/// Integrates from the first to the last of `instants` and passes the state at each of them to `observe`,
/// which may end the integration by returning an error. The steps do not depend on the times between:
/// within a step the explicit method interpolates, and the Gauss method takes a separate shorter step.
///
/// * `state`: y at the first time; afterwards, y at the last.
/// * `instants`: output times, ascending.
/// * `breaks`: times at which f jumps or has a kink, ascending. No step passes over one.
///
/// # Errors
/// Errors of the system, of the method, or of `observe`. The state is then that of the last good step.
///
/// # Panics
/// When the state has another number of entries than the system.
pub fn integrate<E: From<Failure>>(
    method: &mut Method,
    system: &mut dyn System,
    state: &mut [f64],
    instants: &[f64],
    breaks: &[f64],
    mut observe: impl FnMut(f64, &[f64]) -> Result<(), E>,
) -> Result<(), E> {
    integrate_closely(method, system, state, instants, breaks, 1, |event, time, state| match event {
        ObserverEvent::Instant => observe(time, state),
        ObserverEvent::Start | ObserverEvent::End | ObserverEvent::Within | ObserverEvent::Between => Ok(()),
    })
}

/// Integrates as [`integrate`] does. Besides the output times, `observe` gets the state at the start, at
/// the end of every step, at both sides of every break and, for the explicit method, at `parts` - 1 evenly
/// spaced points within every step. Times never descend; an output time at one of these points is passed
/// twice.
///
/// # Errors
/// The errors of [`integrate`].
///
/// # Panics
/// The panics of [`integrate`].
pub fn integrate_closely<E: From<Failure>>(
    method: &mut Method,
    system: &mut dyn System,
    state: &mut [f64],
    instants: &[f64],
    breaks: &[f64],
    parts: usize,
    mut observe: impl FnMut(ObserverEvent, f64, &[f64]) -> Result<(), E>,
) -> Result<(), E> {
    let (Some(&start), Some(&last)) = (instants.first(), instants.last()) else { return Ok(()) };
    observe(ObserverEvent::Start, start, state)?;
    observe(ObserverEvent::Instant, start, state)?;
    let mut wanted = Wanted { rest: &instants[1..] };
    let mut from = start;
    let inner = breaks.iter().filter(|&&at| start < at && at < last).map(|&at| (at, true));
    let ends_in_break = breaks.binary_search_by(|at| at.total_cmp(&last)).is_ok();
    for (stop, is_break) in inner.chain([(last, ends_in_break)]) {
        method.restart();
        // f at a break is that after it, but the last rate of an explicit step belongs to the time before
        // it.
        let piece = SmoothInterval { from, before: if is_break { just_before(stop) } else { stop } };
        match method {
            Method::Explicit(method) => {
                let method = DenseMethod::Explicit(method);
                dense_piece(method, system, state, piece, parts, &mut wanted, &mut observe)?;
            }
            Method::Adaptive(method) => {
                let method = DenseMethod::Adaptive(method);
                dense_piece(method, system, state, piece, parts, &mut wanted, &mut observe)?;
            }
            Method::Gauss { method, step } => {
                gauss_piece(method, *step, system, state, piece, &mut wanted, &mut observe)?;
            }
        }
        if piece.before < stop {
            observe(ObserverEvent::Start, stop, state)?;
        }
        while let Some(instant) = wanted.next_until(stop) {
            observe(ObserverEvent::Instant, instant, state)?;
        }
        from = stop;
    }
    Ok(())
}

/// Returns the last time before a break at which f still belongs to the time before it.
fn just_before(stop: f64) -> f64 {
    stop - BEFORE_BREAK * stop.abs()
}

/// Time interval without breaks.
#[derive(Debug, Clone, Copy)]
struct SmoothInterval {
    from: f64,
    /// End of the interval, just before the break.
    before: f64,
}

/// Output times that are still to come.
struct Wanted<'i> {
    rest: &'i [f64],
}

impl Wanted<'_> {
    /// Returns the next output time if it is not after `time`.
    fn next_until(&mut self, time: f64) -> Option<f64> {
        let (&first, rest) = self.rest.split_first()?;
        (first <= time).then(|| {
            self.rest = rest;
            first
        })
    }

    /// Returns the next output time if it is before `time`.
    fn next_before(&mut self, time: f64) -> Option<f64> {
        self.rest.first().filter(|&&first| first < time)?;
        self.next_until(time)
    }
}

/// Method with states between the ends of its steps.
enum DenseMethod<'m> {
    Explicit(&'m mut Explicit),
    Adaptive(&'m mut Adaptive),
}

impl DenseMethod<'_> {
    /// Takes one step from `time`, at most to `end`, and returns its end.
    fn step(
        &mut self,
        system: &mut dyn System,
        time: f64,
        state: &mut [f64],
        end: f64,
    ) -> Result<f64, Failure> {
        match self {
            Self::Explicit(method) => method.step(system, time, state, end),
            Self::Adaptive(method) => method.step(system, time, state, end),
        }
    }

    /// Computes the state `within` at `time` within the last step, which ended in `after`.
    fn interpolate(
        &mut self,
        system: &mut dyn System,
        time: f64,
        after: &[f64],
        within: &mut [f64],
    ) -> Result<(), Failure> {
        match self {
            Self::Explicit(method) => method.interpolate(system, time, after, within),
            Self::Adaptive(method) => method.interpolate(system, time, after, within),
        }
    }

    /// Returns the number of parts of the last step to be seen, a multiple of the `parts` of an explicit step, and true if the
    /// motion alone limited that step.
    fn seen(&self, parts: usize) -> (usize, bool) {
        match self {
            Self::Explicit(_) => (parts, false),
            Self::Adaptive(method) => (method.parts(parts), method.is_long()),
        }
    }
}

/// Integrates over an interval; states at output times and at points within a step are interpolated.
fn dense_piece<E: From<Failure>>(
    mut method: DenseMethod<'_>,
    system: &mut dyn System,
    state: &mut [f64],
    piece: SmoothInterval,
    parts: usize,
    wanted: &mut Wanted<'_>,
    observe: &mut impl FnMut(ObserverEvent, f64, &[f64]) -> Result<(), E>,
) -> Result<(), E> {
    let mut within = vec![0.0; state.len()];
    let mut time = piece.from;
    while time < piece.before {
        let end = method.step(system, time, state, piece.before)?;
        finite(state, time)?;
        let (all, is_long) = method.seen(parts);
        let finer = all / parts;
        for part in 1..=all {
            let place = if part < all { time + (end - time) * (part as f64 / all as f64) } else { end };
            while let Some(instant) = wanted.next_before(place) {
                method.interpolate(system, instant, state, &mut within)?;
                observe(ObserverEvent::Instant, instant, &within)?;
            }
            if part < all {
                method.interpolate(system, place, state, &mut within)?;
                let is_between = is_long && part % finer == 0;
                let event = if is_between { ObserverEvent::Between } else { ObserverEvent::Within };
                observe(event, place, &within)?;
            }
        }
        observe(ObserverEvent::End, end, state)?;
        time = end;
    }
    Ok(())
}

/// Integrates over an interval in equal steps of the Gauss method; a separate shorter step reaches an
/// output time within a step.
fn gauss_piece<E: From<Failure>>(
    method: &mut Gauss,
    longest: f64,
    system: &mut dyn System,
    state: &mut [f64],
    piece: SmoothInterval,
    wanted: &mut Wanted<'_>,
    observe: &mut impl FnMut(ObserverEvent, f64, &[f64]) -> Result<(), E>,
) -> Result<(), E> {
    let span = piece.before - piece.from;
    if span <= 0.0 {
        return Ok(());
    }
    let mut aside: Option<Gauss> = None;
    let mut before = state.to_vec();
    let steps = (span / longest * (1.0 - STEP_ROUNDING)).ceil().max(1.0) * f64::from(method.refinement());
    let length = span / steps;
    let (mut time, mut taken) = (piece.from, 0.0);
    while taken < steps {
        before.copy_from_slice(state);
        method.step(system, time, state, length)?;
        finite(state, time)?;
        taken += 1.0;
        let end = if taken < steps { piece.from + taken * length } else { piece.before };
        // An output time within rounding of the end of the step is at the end.
        while let Some(instant) = wanted.next_before(end - STEP_ROUNDING * length) {
            let aside = aside.get_or_insert_with(|| method.clone());
            let mut within = before.clone();
            aside.restart();
            aside.step(system, time, &mut within, instant - time)?;
            finite(&within, time)?;
            observe(ObserverEvent::Instant, instant, &within)?;
        }
        while let Some(instant) = wanted.next_before(end) {
            observe(ObserverEvent::Instant, instant, state)?;
        }
        observe(ObserverEvent::End, end, state)?;
        time = end;
    }
    Ok(())
}

/// Returns an error if the state is not finite; `time` is that of the last good state.
fn finite(state: &[f64], time: f64) -> Result<(), Failure> {
    if state.iter().all(|y| y.is_finite()) { Ok(()) } else { Err(Failure::NotFinite { time }) }
}
