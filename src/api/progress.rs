//! How a long computation is watched, and stopped.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_linalg::context::{Context, Event};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// What a long computation is at.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Progress<'a> {
    /// A phase begins.
    Phase(&'a str),
    /// What is going to be done and what it needs, known before the work.
    Plan(&'a str),
    /// Part of the current phase that is done, 0 to 1.
    Fraction(f64),
}

/// Hears what a computation is at, from whichever of its threads, and says whether it is to go on. Where it
/// is not, the computation ends there and comes back with FB605; nothing is left of it. How soon depends on
/// how often there is something to hear: at every step of an integration and of a search for modes, but not
/// within the factorisation of a matrix.
pub type Listener<'a> = &'a (dyn Fn(Progress<'_>) -> ControlFlow<()> + Sync);

/// Hears nothing and lets everything go on.
pub(super) const NOBODY: Listener<'static> = &|_| ControlFlow::Continue(());

/// What unwinds a computation that its listener stops.
struct Stopped;

/// Does `work`, which `listener` hears of and may stop.
///
/// A computation is stopped by unwinding, on whichever thread it told its progress, without a message of a
/// panic: all that it works on is its own.
pub(super) fn heard<T>(listener: Listener<'_>, work: impl FnOnce(&Context<'_>) -> Result<T>) -> Result<T> {
    let watch = |event: Event<'_>| {
        let progress = match event {
            Event::Phase(name) => Progress::Phase(name),
            Event::Plan(text) => Progress::Plan(text),
            Event::Fraction(part) => Progress::Fraction(part),
        };
        if listener(progress).is_break() {
            resume_unwind(Box::new(Stopped));
        }
    };
    match catch_unwind(AssertUnwindSafe(|| work(&Context::heard_by(&watch)))) {
        Ok(done) => done,
        Err(payload) if payload.is::<Stopped>() => {
            Err(Diagnostic::new(Code::Stopped, "the computation was stopped").into())
        }
        Err(payload) => resume_unwind(payload),
    }
}
