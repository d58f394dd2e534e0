//! Table of the commands: the name, the options of printing, the threads and the work of each.

use super::arguments::{Command, Printing};
#[cfg(feature = "import")]
use super::audit;
use super::outcome::Outcome;
#[cfg(feature = "response")]
use super::response;
use super::{
    advise, check, compare, completions, convert, doctor, explain, export, inspect, measure, recipe, recover,
    reduce, select, shapes, simulate, trade, view,
};
#[cfg(feature = "cluster")]
use super::{assemble, batch, prepare};
use flexbody_base::error::Result;

/// Command of a command line, ready to run.
pub(super) struct Invocation<'a> {
    pub name: &'static str,
    pub printing: Printing,
    /// Number of threads; `None` for all processors.
    pub threads: Option<u16>,
    run: Box<dyn Fn() -> Result<Outcome> + Sync + 'a>,
}

impl<'a> Invocation<'a> {
    /// Returns the invocation of a parsed command.
    pub(super) fn of(command: &'a Command) -> Self {
        match command {
            Command::Convert(of) => Self::new("convert", &**of, of.printing, convert::run).on(of.threads),
            #[cfg(feature = "cluster")]
            Command::Prepare(of) => Self::new("prepare", of, of.printing, prepare::run),
            #[cfg(feature = "cluster")]
            Command::Assemble(of) => Self::new("assemble", of, of.printing, assemble::run).on(of.threads),
            #[cfg(feature = "cluster")]
            Command::Batch(of) => Self::new("batch", of, of.printing, batch::run),
            Command::Inspect(of) => Self::new("inspect", of, of.printing, inspect::run),
            Command::Check(of) => Self::new("check", of, of.printing, check::run),
            Command::Compare(of) => Self::new("compare", of, of.printing, compare::run),
            Command::Select(of) => Self::new("select", of, of.printing, select::run).on(of.threads),
            Command::Simulate(of) => Self::new("simulate", of, of.printing, simulate::run).on(of.threads),
            Command::Trade(of) => Self::new("trade", of, of.printing, trade::run).on(of.threads),
            #[cfg(feature = "response")]
            Command::Response(of) => Self::new("response", &**of, of.printing, response::run).on(of.threads),
            Command::Measure(of) => Self::new("measure", of, of.printing, measure::run),
            Command::Recover(of) => Self::new("recover", of, of.printing, recover::run),
            Command::Shapes(of) => Self::new("shapes", &**of, of.printing, shapes::run),
            Command::Reduce(of) => Self::new("reduce", of, of.printing, reduce::run),
            Command::Advise(of) => Self::new("advise", of, of.printing, advise::run),
            Command::View(of) => Self::new("view", of, of.printing, view::run),
            Command::Export(of) => Self::new("export", of, of.printing, export::run),
            #[cfg(feature = "import")]
            Command::Audit(of) => Self::new("audit", of, of.printing, audit::run),
            Command::Recipe(of) => Self::new("recipe", of, of.printing, recipe::run),
            Command::Explain(of) => Self::new("explain", of, of.printing, explain::run),
            Command::Doctor(of) => Self::new("doctor", of, of.printing, |_| doctor::run()),
            Command::Completions(of) => Self::new("completions", of, of.printing, completions::completions),
            Command::Man(of) => Self::new("man", of, of.printing, completions::man),
        }
    }

    fn new<A: Sync>(
        name: &'static str,
        arguments: &'a A,
        printing: Printing,
        run: fn(&A) -> Result<Outcome>,
    ) -> Self {
        Self { name, printing, threads: None, run: Box::new(move || run(arguments)) }
    }

    /// Returns the invocation with this number of threads.
    fn on(self, threads: Option<u16>) -> Self {
        Self { threads, ..self }
    }

    /// Runs the command.
    ///
    /// # Errors
    /// The errors of the command.
    pub(super) fn run(&self) -> Result<Outcome> {
        (self.run)()
    }
}
