//! How long work tells what it is doing, without knowing who listens.

/// What a long computation is at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event<'a> {
    /// A phase begins.
    Phase(&'a str),
    /// What is going to be done and what it needs, known before the work.
    Plan(&'a str),
    /// Part of the current phase that is done, 0 to 1.
    Fraction(f64),
}

/// A listener; [`SILENT`] when nobody listens.
pub type Watch<'a> = &'a (dyn Fn(Event<'_>) + Sync);

/// Nobody listens.
pub const SILENT: Watch<'static> = &|_| {};
