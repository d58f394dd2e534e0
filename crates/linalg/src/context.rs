//! The context of long work: the limits it keeps, the listener it reports to, and the counter of what it did.

use std::sync::{Mutex, PoisonError};

/// A report of long work to its [`Watch`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event<'a> {
    /// A phase begins.
    Phase(&'a str),
    /// The plan of the work and the resources it needs, known before it starts.
    Plan(&'a str),
    /// Fraction of the current phase that is done, 0 to 1.
    Fraction(f64),
}

/// A listener for progress.
pub type Watch<'a> = &'a (dyn Fn(Event<'_>) + Sync);

/// Counts of the work of eigen-solvers and linear solvers, independent of the machine.
///
/// Tests compare them with recorded values: a slower algorithm fails without a measurement of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    /// Numeric factorisations (Cholesky and inertia counts).
    pub factorizations: u64,
    /// Columns solved with a factor.
    pub solved_columns: u64,
    /// Columns multiplied by K.
    pub stiffness_columns: u64,
    /// Columns multiplied by M.
    pub mass_columns: u64,
    /// Thick restarts of Lanczos.
    pub restarts: u64,
    /// Numbers in one factor.
    pub factor_len: u64,
    /// Multiplications and additions of one factorisation.
    pub factor_flops: u64,
    /// Bytes of the factor that found the modes (0 without a factor).
    pub factor_bytes: u64,
}

/// A counter that several parts of the work add to.
#[derive(Debug, Default)]
pub struct WorkCounter(Mutex<Work>);

impl WorkCounter {
    /// Returns the counts so far.
    pub fn total(&self) -> Work {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The context of long work, handed down by reference through all functions that take part in it.
///
/// ```
/// use flexbody_linalg::context::{Context, WorkCounter};
/// let counter = WorkCounter::default();
/// let context = Context { memory: Some(2_000_000_000), ..Context::QUIET }.counted_by(&counter);
/// context.count(|work| work.solved_columns += 4);
/// assert_eq!(counter.total().solved_columns, 4);
/// ```
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// Bytes that the work may allocate in addition to the memory in use; `None` for no limit.
    pub memory: Option<u64>,
    /// Seconds that the work may take by its own estimate, made before it starts; `None` for no limit.
    pub longest: Option<f64>,
    /// Listener for progress.
    pub watch: Watch<'a>,
    /// Counter of the work; `None` if the work is not counted.
    pub counter: Option<&'a WorkCounter>,
}

impl Context<'static> {
    /// A context without limits, listener or counter.
    pub const QUIET: Self = Self { memory: None, longest: None, watch: &|_| {}, counter: None };
}

impl<'a> Context<'a> {
    /// Returns a context without limits or counter that reports to `watch`.
    pub fn heard_by(watch: Watch<'a>) -> Self {
        Self { watch, ..Context::QUIET }
    }

    /// Returns this context with its work counted by `counter`.
    pub fn counted_by<'b>(&self, counter: &'b WorkCounter) -> Context<'b>
    where
        'a: 'b,
    {
        Context { counter: Some(counter), ..*self }
    }

    /// Returns this context without a counter, for work that belongs to no result.
    pub fn uncounted(&self) -> Self {
        Self { counter: None, ..*self }
    }

    /// Returns this context without a listener, for work that reports no progress.
    pub fn unheard(&self) -> Self {
        Self { watch: Context::QUIET.watch, ..*self }
    }

    /// Returns this context without limits of memory and time.
    pub fn unlimited(&self) -> Self {
        Self { memory: None, longest: None, ..*self }
    }

    /// Adds to the counts.
    pub fn count(&self, add: impl FnOnce(&mut Work)) {
        if let Some(WorkCounter(work)) = self.counter {
            add(&mut work.lock().unwrap_or_else(PoisonError::into_inner));
        }
    }

    /// Reports that a phase begins.
    pub fn phase(&self, name: &str) {
        (self.watch)(Event::Phase(name));
    }

    /// Reports the plan of the work.
    pub fn plan(&self, plan: &str) {
        (self.watch)(Event::Plan(plan));
    }

    /// Reports the fraction of the current phase that is done, 0 to 1.
    pub fn fraction(&self, done: f64) {
        (self.watch)(Event::Fraction(done));
    }

    /// Returns the number of bytes that may still be allocated: the limit, or the largest number if there is no limit.
    pub fn available(&self) -> u64 {
        self.memory.unwrap_or(u64::MAX)
    }
}

impl std::fmt::Debug for Context<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { memory, longest, watch: _, counter } = self;
        let mut context = f.debug_struct("Context");
        context
            .field("memory", memory)
            .field("longest", longest)
            .field("counter", counter)
            .finish_non_exhaustive()
    }
}
