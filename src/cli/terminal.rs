//! What the terminal shows of a body, in how many columns, and whether in colours.

use super::arguments::Printing;
use crate::report::{Facts, Format, Screen, render, summary};
use std::io::IsTerminal;

/// The summary of a body, or with `verbose` all that is known of it.
pub(super) fn body_text(facts: &Facts, verbose: bool, printing: Printing) -> String {
    if verbose { render(facts, Format::Text) } else { summary(facts, stdout_screen(printing)) }
}

/// What stdout is shown on.
fn stdout_screen(printing: Printing) -> Screen {
    let stdout = std::io::stdout();
    if printing.json || !stdout.is_terminal() {
        return Screen::default();
    }
    let own = terminal_size::terminal_size_of(&stdout).map(|(width, _)| usize::from(width.0));
    let columns = columns(std::env::var("COLUMNS").ok().as_deref(), own);
    let screen = Screen::default().coloured(are_wanted());
    columns.map_or(screen, |columns| screen.with_columns(columns))
}

/// The columns of a terminal: what `COLUMNS` says, else what the terminal itself says.
fn columns(said: Option<&str>, own: Option<usize>) -> Option<usize> {
    said.and_then(|said| said.trim().parse().ok()).or(own).filter(|columns| *columns > 0)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_user_says_of_the_terminal_counts_more_than_what_it_says() {
        assert_eq!(columns(Some("60"), Some(120)), Some(60));
        assert_eq!(columns(Some("many"), Some(120)), Some(120));
        assert_eq!(columns(None, Some(0)), None);
        assert_eq!(columns(None, None), None);
    }
}
