//! Allocations that may fail.
//!
//! The program ends with exit code 4 if an allocation fails (`main.rs`), since almost no code could continue. Code that
//! can continue (for a size that a damaged file declares) allocates inside [`allow_failure`].

use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use std::cell::Cell;
use std::sync::OnceLock;

thread_local! {
    static ACCEPTS_FAILURE: Cell<bool> = const { Cell::new(false) };
}

/// Function that returns the number of bytes that may still be allocated; set by the program.
static AVAILABLE_BYTES: OnceLock<fn() -> Option<u64>> = OnceLock::new();

/// Sets the function that finds the number of bytes that may still be allocated. Only the first call has an effect.
pub fn set_left(find: fn() -> Option<u64>) {
    // Another run in the same process uses an equivalent function.
    let _ = AVAILABLE_BYTES.set(find);
}

/// Returns the number of bytes that may still be allocated; `None` if unknown, as in the library.
pub fn left() -> Option<u64> {
    AVAILABLE_BYTES.get().and_then(|find| find())
}

/// Runs `ask`, whose allocations may fail without ending the program.
pub fn allow_failure<T>(ask: impl FnOnce() -> T) -> T {
    let before = ACCEPTS_FAILURE.replace(true);
    let answer = ask();
    ACCEPTS_FAILURE.set(before);
    answer
}

/// Refuses work that needs more memory than is available, before it begins.
///
/// * `what`: subject of the message, such as "recording 100 instants".
/// * `needed`: bytes needed; `left`: bytes available, `None` if unknown.
/// * `help`: advice for the user.
///
/// # Errors
/// FB601 if the memory is insufficient.
pub fn refuse_beyond(left: Option<u64>, needed: f64, what: &str, help: &str) -> Result<()> {
    match left.map(|left| left as f64) {
        Some(left) if needed > left => {
            let message =
                format!("{what} takes {:.3} GB of memory, {:.3} GB are available", needed / 1e9, left / 1e9);
            Err(Diagnostic::new(Code::MemoryShort, message).with_help(help).into())
        }
        _ => Ok(()),
    }
}

/// Returns true if the current thread continues when an allocation fails.
pub fn accepts_failure() -> bool {
    ACCEPTS_FAILURE.get()
}
