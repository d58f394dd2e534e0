//! Memory that is not to be had: who asks for it may say that it does without.
//!
//! The program ends with exit code 4 where an allocation fails (`main.rs`), since almost no code could go on.
//! Code that can go on (a size that a damaged file declares) asks inside [`or_go_without`].

use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use std::cell::Cell;
use std::sync::OnceLock;

thread_local! {
    static GOES_WITHOUT: Cell<bool> = const { Cell::new(false) };
}

/// Tells the bytes that may still be allocated; set by the program.
static LEFT: OnceLock<fn() -> Option<u64>> = OnceLock::new();

/// Sets how the bytes that may still be allocated are found; the first call counts.
pub fn tell_left(find: fn() -> Option<u64>) {
    // A second run in the same process finds them in the same way.
    let _ = LEFT.set(find);
}

/// Bytes that may still be allocated; `None` where it is not known, as in the library.
pub fn left() -> Option<u64> {
    LEFT.get().and_then(|find| find())
}

/// Runs `ask`, whose allocations may fail without ending the program.
pub fn or_go_without<T>(ask: impl FnOnce() -> T) -> T {
    let before = GOES_WITHOUT.replace(true);
    let answer = ask();
    GOES_WITHOUT.set(before);
    answer
}

/// Refuses work whose data take more memory than there is, before it begins.
///
/// * `what`: subject of the message, as in "recording 100 instants".
/// * `needed`: bytes; `left`: bytes that there are, `None` where it is not known.
/// * `help`: what the user can do.
///
/// # Errors
/// FB601.
pub fn refuse_beyond(left: Option<u64>, needed: f64, what: &str, help: &str) -> Result<()> {
    match left.map(|left| left as f64) {
        Some(left) if needed > left => {
            let message = format!("{what} takes {:.3} GB, {:.3} GB are left", needed / 1e9, left / 1e9);
            Err(Diagnostic::new(Code::MemoryShort, message).with_help(help).into())
        }
        _ => Ok(()),
    }
}

/// Whether the code that runs on this thread goes on without the memory that it asks for.
pub fn goes_without() -> bool {
    GOES_WITHOUT.get()
}
