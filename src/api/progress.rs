//! Progress and cancellation of long computations.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_linalg::context::{Context, Event};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// Progress report of a long computation.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Progress<'a> {
    /// Start of a phase.
    Phase(&'a str),
    /// Plan of the work and its needs, known before the work.
    Plan(&'a str),
    /// Number of runs (simulations) of the current phase, if it is known before the first.
    Runs(usize),
    /// Start of a run of the current phase. Fractions refer to this run until the next one starts.
    Run,
    /// Completed part of the current phase or, in a phase with runs, of the current run, 0 to 1.
    Fraction(f64),
    /// Advice about work that takes long, with an estimate of its time.
    Advice(&'a str),
}

/// Callback that receives progress reports, from any thread of the computation, and returns whether it shall continue.
/// On `Break` the computation ends with FB605 and without results. The delay depends on the reports: there is one at
/// every step of an integration and of a search for modes, but none within the factorisation of a matrix.
pub type Listener<'a> = &'a (dyn Fn(Progress<'_>) -> ControlFlow<()> + Sync);

/// Ignores all reports and lets everything continue.
pub(super) const NO_LISTENER: Listener<'static> = &|_| ControlFlow::Continue(());

/// Panic payload that unwinds a computation stopped by its listener.
struct Stopped;

/// Runs `work`, which reports to `listener` and may be stopped by it.
///
/// A computation is stopped by unwinding on the thread that reports, without a panic message. This is safe since the
/// computation owns all its data.
pub(super) fn heard<T>(listener: Listener<'_>, work: impl FnOnce(&Context<'_>) -> Result<T>) -> Result<T> {
    let watch = |event: Event<'_>| {
        let progress = match event {
            Event::Phase(name) => Progress::Phase(name),
            Event::Plan(text) => Progress::Plan(text),
            Event::Runs(count) => Progress::Runs(count),
            Event::Run => Progress::Run,
            Event::Fraction(part) => Progress::Fraction(part),
            Event::Advice(text) => Progress::Advice(text),
        };
        if listener(progress).is_break() {
            resume_unwind(Box::new(Stopped));
        }
    };
    match catch_unwind(AssertUnwindSafe(|| work(&Context::with_listener(&watch)))) {
        Ok(done) => done,
        Err(payload) if payload.is::<Stopped>() => {
            Err(Diagnostic::new(Code::Stopped, "the computation was stopped").into())
        }
        Err(payload) => resume_unwind(payload),
    }
}
