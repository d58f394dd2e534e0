//! Command `flexbody view`.

use super::arguments::ViewArguments;
use super::outcome::Outcome;
use super::run::Run;
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_file::read_simulation;
use flexbody_report::{Colouring, View, read_envelope};

pub(super) fn run(arguments: &ViewArguments) -> Result<Outcome> {
    let ViewArguments { body, simulation, envelope, output, .. } = arguments;
    let inputs = [body].into_iter().chain(simulation).chain(envelope);
    let mut run = Run::begin(arguments.printing, inputs, [output], &[])?;
    let slot = OutputSlot::prepare(output)?;
    let named = simulation.as_ref().or(envelope.as_ref()).unwrap_or(body);
    let body = run.read_body(body)?;
    let motion = simulation.as_ref().map(read_simulation).transpose()?;
    let triangles = arguments.triangles.map(|most| most as usize);
    let envelope = envelope.as_deref().map(read_envelope).transpose()?;
    let recovery = arguments.recovery.as_deref().map(Colouring::Recovery);
    let colouring = recovery.or(envelope.as_ref().map(Colouring::Envelope));
    let view =
        View::new(&body, triangles, motion.as_ref(), colouring).map_err(|error| error.in_file(named))?;
    run.data()?;
    slot.fill(view.html().as_bytes())?;
    run.end([slot], |format| view.render(format), true)
}
