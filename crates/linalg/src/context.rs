//! Context of long work: its limits, its listener and the counter of its work.

use std::sync::{Mutex, PoisonError};

/// Progress report of long work to its [`Watch`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event<'a> {
    /// Start of a phase.
    Phase(&'a str),
    /// Plan of the work and its resources, known before it starts.
    Plan(&'a str),
    /// Number of runs (simulations) of the current phase, if it is known before the first.
    Runs(usize),
    /// Start of a run of the current phase. Fractions refer to this run until the next one starts.
    Run,
    /// Completed fraction of the current phase or, in a phase with runs, of the current run, 0 to 1.
    Fraction(f64),
    /// Advice to the user about work that takes long. Only the first of a command is worth showing.
    Advice(&'a str),
}

/// Callback that receives every progress report, from any thread of the work.
pub type Watch<'a> = &'a (dyn Fn(Event<'_>) + Sync);

/// Counts of the work of eigen-solvers and linear solvers, independent of the machine.
///
/// Tests compare them with recorded values: a slower algorithm fails without a measurement of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    /// Number of numeric factorisations (Cholesky and inertia counts).
    pub factorizations: u64,
    /// Number of columns solved with a factor.
    pub solved_columns: u64,
    /// Number of columns multiplied by K.
    pub stiffness_columns: u64,
    /// Number of columns multiplied by M.
    pub mass_columns: u64,
    /// Number of thick restarts of Lanczos.
    pub restarts: u64,
    /// Number of entries of one factor.
    pub factor_len: u64,
    /// Multiplications and additions of one factorisation.
    pub factor_flops: u64,
    /// Bytes of the factor that found the modes (0 without a factor).
    pub factor_bytes: u64,
}

/// Counter to which several parts of the work add.
#[derive(Debug, Default)]
pub struct WorkCounter(Mutex<Work>);

impl WorkCounter {
    /// Returns the counts so far.
    pub fn total(&self) -> Work {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Context of long work, passed by reference to all functions that take part in it.
///
/// ```
/// use flexbody_linalg::context::{Context, WorkCounter};
/// let counter = WorkCounter::default();
/// let context = Context { memory: Some(2_000_000_000), ..Context::QUIET }.with_counter(&counter);
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
    /// Context without limits, listener or counter.
    pub const QUIET: Self = Self { memory: None, longest: None, watch: &|_| {}, counter: None };
}

impl<'a> Context<'a> {
    /// Returns a context without limits or counter that reports to `watch`.
    pub fn with_listener(watch: Watch<'a>) -> Self {
        Self { watch, ..Context::QUIET }
    }

    /// Returns this context with its work counted by `counter`.
    pub fn with_counter<'b>(&self, counter: &'b WorkCounter) -> Context<'b>
    where
        'a: 'b,
    {
        Context { counter: Some(counter), ..*self }
    }

    /// Returns this context without a counter, for work that belongs to no result.
    pub fn without_counter(&self) -> Self {
        Self { counter: None, ..*self }
    }

    /// Returns this context without a listener, for work that reports no progress.
    pub fn without_listener(&self) -> Self {
        Self { watch: Context::QUIET.watch, ..*self }
    }

    /// Calls `add` with the counts, if there is a counter.
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

    /// Reports the number of runs of the current phase.
    pub fn runs(&self, count: usize) {
        (self.watch)(Event::Runs(count));
    }

    /// Reports that a run of the current phase begins.
    pub fn run(&self) {
        (self.watch)(Event::Run);
    }

    /// Reports advice about work that takes long.
    pub fn advice(&self, advice: &str) {
        (self.watch)(Event::Advice(advice));
    }

    /// Reports the fraction of the current phase, or of its current run, that is done, 0 to 1.
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
