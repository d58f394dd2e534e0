//! Text about a body for the terminal: its width and colours.

use super::arguments::Printing;
use flexbody_base::diagnostic::printable;
use flexbody_report::{Facts, Format, Screen, render, summary};
use std::borrow::Cow;
use std::io::IsTerminal;

/// Returns the summary of a body, or with `verbose` all facts about it.
pub(super) fn body_text(facts: &Facts, verbose: bool, printing: Printing) -> String {
    if verbose { render(facts, Format::Text) } else { summary(facts, stdout_screen(printing)) }
}

/// Returns the properties of the screen of stdout.
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

/// Returns the columns of a terminal: the value of `COLUMNS`, else the value that the terminal reports.
fn columns(said: Option<&str>, own: Option<usize>) -> Option<usize> {
    said.and_then(|said| said.trim().parse().ok()).or(own).filter(|columns| *columns > 0)
}

/// Returns true if output to stderr shall have colours.
pub(super) fn colours_of_stderr() -> bool {
    std::io::stderr().is_terminal() && are_wanted()
}

/// Returns true if colours are allowed: not if `NO_COLOR` is set and not empty (no-color.org), or on a dumb terminal.
fn are_wanted() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !is_set("NO_COLOR") && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Returns a text for stdout in which only colour commands, which this program uses, are left. Other terminal commands
/// are escaped, since names come from files.
pub(super) fn for_terminal(text: &str) -> Cow<'_, str> {
    const COLOUR: &str = "\u{1b}[";
    let Some(first) = text.find(COLOUR) else { return printable(text) };
    let mut shown = printable(&text[..first]).into_owned();
    for part in text[first..].split(COLOUR).skip(1) {
        let length = part.find(|c: char| !c.is_ascii_digit() && c != ';').unwrap_or(part.len());
        let is_colour = part[length..].starts_with('m');
        shown += if is_colour { COLOUR } else { "\\u{1b}[" };
        shown += &printable(part);
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_commands_to_a_terminal_only_colours_are_left() {
        for (text, shown) in [
            ("plain\ttext\n", "plain\ttext\n"),
            ("\u{1b}[1;31mred\u{1b}[0m", "\u{1b}[1;31mred\u{1b}[0m"),
            ("a\u{1b}[2Jb\u{1b}]0;t\u{7}", "a\\u{1b}[2Jb\\u{1b}]0;t\\u{7}"),
            ("\u{1b}[31mname\u{9b}31m\r", "\u{1b}[31mname\\u{9b}31m\\u{d}"),
        ] {
            assert_eq!(for_terminal(text), shown);
        }
    }

    #[test]
    fn what_the_user_says_of_the_terminal_counts_more_than_what_it_says() {
        assert_eq!(columns(Some("60"), Some(120)), Some(60));
        assert_eq!(columns(Some("many"), Some(120)), Some(120));
        assert_eq!(columns(None, Some(0)), None);
        assert_eq!(columns(None, None), None);
    }
}
