//! Text about a body for the terminal: its width and colours.

use super::arguments::Printing;
use super::resources::{cpu_seconds, has_thread};
use flexbody_base::diagnostic::printable;
use flexbody_linalg::context::Event;
use flexbody_report::{Facts, Format, Phase, Screen, render, summary};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::borrow::Cow;
use std::io::{IsTerminal, Write as _};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Returns the summary of a body, or with `verbose` all facts about it.
pub(super) fn body_text(facts: &Facts, verbose: bool, printing: Printing) -> String {
    if verbose { render(facts, Format::Terminal) } else { summary(facts, stdout_screen(printing)) }
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

// Progress on a terminal with the remaining time of each phase, and the duration of each phase.

/// Environment variable for tests: the program panics at the start of the phase that it names.
const PANIC_AT: &str = "FLEXBODY_TEST_PANIC";

/// Listener of a job: shows a bar for the current phase and adds up the time of each phase.
pub(super) struct Watcher {
    bar: ProgressBar,
    quiet: bool,
    state: Mutex<State>,
}

struct State {
    name: String,
    /// Number of the current run of the phase, from 1; 0 before the first.
    run: usize,
    /// Number of runs of the phase; 0 if it is not known.
    runs: usize,
    /// True after the first advice, which is the only one that is shown.
    advised: bool,
    wall: Instant,
    cpu: f64,
    phases: Vec<Phase>,
}

impl Watcher {
    /// Starts with the phase `first`. The bar is hidden if `quiet` is set or stderr is not a terminal.
    pub(super) fn new(quiet: bool, first: &str) -> Self {
        let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(1000) };
        let style = ProgressStyle::with_template("{spinner} {msg:<22} {bar:30} {elapsed} {left}")
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .with_key("left", |state: &ProgressState, out: &mut dyn std::fmt::Write| {
                if let Some(left) = time_left(state.elapsed(), state.fraction().into()) {
                    // Errors of writing the progress are ignored.
                    let _ = write!(out, "{left}");
                }
            });
        bar.set_style(style);
        bar.set_message(first.to_owned());
        // The tick needs a thread of its own.
        if !bar.is_hidden() && has_thread() {
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        let state = State {
            name: first.to_owned(),
            run: 0,
            runs: 0,
            advised: false,
            wall: Instant::now(),
            cpu: cpu_seconds(),
            phases: Vec::new(),
        };
        Self { bar, quiet, state: Mutex::new(state) }
    }

    /// Receives an event of a job.
    pub(super) fn hear(&self, event: Event<'_>) {
        match event {
            Event::Phase(name) => {
                assert!(std::env::var_os(PANIC_AT).is_none_or(|at| at != name), "{PANIC_AT} is {name}");
                self.close();
                let mut state = self.state();
                state.name = name.to_owned();
                (state.run, state.runs) = (0, 0);
                drop(state);
                self.bar.set_message(name.to_owned());
                self.bar.reset();
            }
            Event::Plan(text) => self.bar.println(text),
            Event::Runs(count) => self.state().runs = count,
            Event::Run => self.begin_run(),
            Event::Fraction(part) => {
                let State { run, runs, .. } = *self.state();
                self.bar.set_position((1000.0 * part_of_phase(part, run, runs)) as u64);
            }
            Event::Advice(text) => self.advise(text),
        }
    }

    /// Shows the number of the run that begins. If the number of runs is not known, the bar starts again, for this run.
    fn begin_run(&self) {
        let mut state = self.state();
        state.run += 1;
        self.bar.set_message(run_in_words(&state.name, state.run, state.runs));
        if state.runs == 0 {
            self.bar.reset();
        }
    }

    /// Prints the first advice of the command to stderr, also where no bar is shown.
    fn advise(&self, text: &str) {
        let first = !std::mem::replace(&mut self.state().advised, true);
        if first && !self.quiet {
            // Errors of writing the advice are ignored, as those of the bar are.
            self.bar.suspend(|| drop(writeln!(std::io::stderr(), "note: {text}")));
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends the current phase and returns all phases, in the order of their first occurrence.
    pub(super) fn finish(&self) -> Vec<Phase> {
        self.close();
        self.bar.finish_and_clear();
        std::mem::take(&mut self.state().phases)
    }

    /// Removes the bar, so that other text can be printed.
    pub(super) fn clear(&self) {
        self.bar.finish_and_clear();
    }

    fn close(&self) {
        let mut state = self.state();
        let (wall, cpu) = (Instant::now(), cpu_seconds());
        let (wall_seconds, cpu_seconds) = ((wall - state.wall).as_secs_f64(), cpu - state.cpu);
        let name = state.name.clone();
        match state.phases.iter_mut().find(|phase| phase.name == name) {
            Some(phase) => {
                phase.wall_seconds += wall_seconds;
                phase.cpu_seconds += cpu_seconds;
            }
            None => state.phases.push(Phase { name, wall_seconds, cpu_seconds }),
        }
        (state.wall, state.cpu) = (wall, cpu);
    }
}

/// Returns the completed part of a phase, of whose run number `run` (from 1) the part `part` is done. The part of the run
/// if the number of runs is not known (0).
fn part_of_phase(part: f64, run: usize, runs: usize) -> f64 {
    if runs == 0 { part } else { (run.max(1) as f64 - 1.0 + part) / runs as f64 }
}

/// Returns the text beside the bar in run number `run` of a phase; a single run needs no number.
fn run_in_words(phase: &str, run: usize, runs: usize) -> String {
    match (run, runs) {
        (_, 1) | (1, 0) => phase.to_owned(),
        (_, 0) => format!("{phase}, run {run}"),
        _ => format!("{phase}, run {run} of {runs}"),
    }
}

/// Returns the remaining time of a phase in words, if `fraction` of it took `elapsed`; `None` if it is too early for an
/// estimate.
fn time_left(elapsed: Duration, fraction: f64) -> Option<String> {
    if !(0.02..1.0).contains(&fraction) || elapsed < Duration::from_secs(1) {
        return None;
    }
    let seconds = elapsed.as_secs_f64() * (1.0 - fraction) / fraction;
    Some(match seconds.ceil() as u64 {
        seconds @ 0..100 => format!("about {seconds} s left"),
        seconds @ 100..6000 => format!("about {} min left", seconds.div_ceil(60)),
        seconds => format!("about {:.1} h left", seconds as f64 / 3600.0),
    })
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

    #[test]
    fn the_bar_counts_runs_and_covers_all_of_them_where_their_number_is_known() {
        assert_eq!(part_of_phase(0.5, 1, 0), 0.5);
        assert_eq!(part_of_phase(0.5, 3, 0), 0.5);
        assert_eq!(part_of_phase(0.5, 3, 4), 0.625);
        assert_eq!(part_of_phase(1.0, 4, 4), 1.0);
        let words = |run, runs| run_in_words("trials", run, runs);
        assert_eq!([words(1, 0), words(3, 0)], ["trials", "trials, run 3"]);
        assert_eq!([words(1, 1), words(2, 3)], ["trials", "trials, run 2 of 3"]);
    }

    #[test]
    fn the_time_left_is_told_when_there_is_something_to_tell_it_from() {
        let left = |seconds, fraction| time_left(Duration::from_secs(seconds), fraction);
        assert_eq!(left(10, 0.25).as_deref(), Some("about 30 s left"));
        assert_eq!(left(100, 0.25).as_deref(), Some("about 5 min left"));
        assert_eq!(left(3600, 0.25).as_deref(), Some("about 3.0 h left"));
        for (seconds, fraction) in [(0, 0.5), (10, 0.0), (10, 0.01), (10, 1.0), (10, f64::NAN)] {
            assert_eq!(left(seconds, fraction), None, "{seconds} {fraction}");
        }
    }
}
