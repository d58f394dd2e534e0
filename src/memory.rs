//! Memory that is not to be had: who asks for it may say that it does without.
//!
//! The program ends with exit code 4 where an allocation fails (`main.rs`), since almost no code could go on. Code that can
//! go on (a size that a damaged file declares) asks inside [`or_go_without`].

use std::cell::Cell;

thread_local! {
    static GOES_WITHOUT: Cell<bool> = const { Cell::new(false) };
}

/// Runs `ask`, whose allocations may fail without ending the program.
pub fn or_go_without<T>(ask: impl FnOnce() -> T) -> T {
    let before = GOES_WITHOUT.replace(true);
    let answer = ask();
    GOES_WITHOUT.set(before);
    answer
}

/// Whether the code that runs on this thread goes on without the memory that it asks for.
pub fn goes_without() -> bool {
    GOES_WITHOUT.get()
}
