//! Progress of a phase whose runs are made in parallel.

use flexbody_linalg::context::{Context, Event};
use std::sync::{Mutex, PoisonError};

/// Progress of a phase: reports the finished part of all of its tasks, each with one or more runs.
pub(super) struct Progress<'w> {
    context: &'w Context<'w>,
    tasks: f64,
    /// Sum of the finished parts of all tasks.
    done: Mutex<f64>,
}

impl<'w> Progress<'w> {
    /// Reports the phase `phase` with `tasks` tasks.
    pub(super) fn new(context: &'w Context<'w>, phase: &str, tasks: usize) -> Self {
        context.phase(phase);
        Self { context, tasks: tasks as f64, done: Mutex::new(0.0) }
    }

    /// Reports that a task is finished whose progress was not followed.
    pub(super) fn step(&self) {
        self.add(1.0);
    }

    /// Does a task of `runs` runs with a context without limits, whose progress counts for the phase.
    pub(super) fn follow<T>(&self, runs: usize, task: impl FnOnce(&Context<'_>) -> T) -> T {
        // Number of runs begun, and the part of the task that was reported.
        let state = Mutex::new((0usize, 0.0f64));
        let report = |state: &mut (usize, f64), part: f64| {
            if part > state.1 {
                self.add(part - state.1);
                state.1 = part;
            }
        };
        let watch = |event: Event<'_>| {
            let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
            match event {
                Event::Run => state.0 += 1,
                Event::Fraction(part) => {
                    let part = (state.0.max(1) as f64 - 1.0 + part) / runs.max(1) as f64;
                    report(&mut state, part.min(1.0));
                }
                Event::Advice(text) => self.context.advice(text),
                Event::Phase(_) | Event::Plan(_) | Event::Runs(_) => {}
            }
        };
        let done = task(&Context::with_listener(&watch));
        report(&mut state.lock().unwrap_or_else(PoisonError::into_inner), 1.0);
        done
    }

    fn add(&self, part: f64) {
        // The lock is held while the sum is reported, so that the reported parts never descend.
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        *done += part;
        self.context.fraction((*done / self.tasks).min(1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_all_tasks_add_up_to_the_phase() {
        let heard = Mutex::new(Vec::new());
        let watch = |event: Event<'_>| {
            if let Event::Fraction(part) = event {
                heard.lock().expect("a thread that panicked").push(part);
            }
        };
        let context = Context::with_listener(&watch);
        let progress = Progress::new(&context, "errors", 2);
        progress.follow(2, |context| {
            context.run();
            context.fraction(0.5);
            context.run();
            context.fraction(0.5);
        });
        progress.step();
        assert_eq!(heard.into_inner().expect("a thread that panicked"), [0.125, 0.375, 0.5, 1.0]);
    }
}
