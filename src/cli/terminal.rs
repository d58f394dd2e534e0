//! What the terminal shows of a body, and whether in colours.

use super::arguments::Printing;
use crate::report::{Facts, Format, render, summary};
use std::io::IsTerminal;

/// The summary of a body, or with `verbose` all that is known of it.
pub(super) fn body_text(facts: &Facts, verbose: bool, printing: Printing) -> String {
    if verbose { render(facts, Format::Text) } else { summary(facts, colours_of_stdout(printing)) }
}

/// Whether what is printed to stdout is to have colours.
fn colours_of_stdout(printing: Printing) -> bool {
    !printing.json && std::io::stdout().is_terminal() && are_wanted()
}

/// Whether what is printed to stderr is to have colours.
pub(super) fn colours_of_stderr() -> bool {
    std::io::stderr().is_terminal() && are_wanted()
}

/// `NO_COLOR`, set to anything, asks for none (no-color.org); a dumb terminal has none.
fn are_wanted() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !is_set("NO_COLOR") && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}
