//! Progress on a terminal, and the time of each phase.

use super::resources::cpu_seconds;
use crate::progress::Event;
use crate::report::Phase;
use indicatif::{ProgressBar, ProgressStyle};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Listens to a job: shows a bar for the current phase and adds up the time of each.
pub(super) struct Watcher {
    bar: ProgressBar,
    state: Mutex<State>,
}

struct State {
    name: String,
    wall: Instant,
    cpu: f64,
    phases: Vec<Phase>,
}

impl Watcher {
    /// Starts with the phase `first`. A hidden bar when `quiet`, or when stderr is not a terminal.
    pub(super) fn new(quiet: bool, first: &str) -> Self {
        let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(1000) };
        let style = ProgressStyle::with_template("{spinner} {msg:<22} {bar:30} {elapsed}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style);
        bar.set_message(first.to_owned());
        bar.enable_steady_tick(Duration::from_millis(200));
        let state =
            State { name: first.to_owned(), wall: Instant::now(), cpu: cpu_seconds(), phases: Vec::new() };
        Self { bar, state: Mutex::new(state) }
    }

    /// The listener to hand to a job.
    pub(super) fn hear(&self, event: Event<'_>) {
        match event {
            Event::Phase(name) => {
                self.close();
                self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).name = name.to_owned();
                self.bar.set_message(name.to_owned());
                self.bar.set_position(0);
            }
            Event::Fraction(part) => self.bar.set_position((1000.0 * part) as u64),
        }
    }

    /// Ends the current phase and gives all of them, in the order of their first occurrence.
    pub(super) fn finish(&self) -> Vec<Phase> {
        self.close();
        self.bar.finish_and_clear();
        std::mem::take(&mut self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).phases)
    }

    /// Removes the bar, so that something can be printed.
    pub(super) fn clear(&self) {
        self.bar.finish_and_clear();
    }

    fn close(&self) {
        let mut state = self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
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
