//! Command `flexbody view`.

use super::arguments::ViewArguments;
use super::outcome::{Outcome, refuse_replacing, refuse_warnings};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_file::read_simulation;
use flexbody_report::{Colouring, Format, View, read_envelope};

pub(super) fn run(arguments: &ViewArguments) -> Result<Outcome> {
    let inputs = std::iter::once(&arguments.body).chain(&arguments.simulation).chain(&arguments.envelope);
    refuse_replacing(inputs, std::iter::once(&arguments.output))?;
    let slot = OutputSlot::prepare(&arguments.output)?;
    let (body, diagnostics) = flexbody_file::read_with_notes(&arguments.body)?;
    let motion = arguments.simulation.as_ref().map(read_simulation).transpose()?;
    let triangles = arguments.triangles.map(|most| most as usize);
    let envelope = arguments.envelope.as_deref().map(read_envelope).transpose()?;
    let recovery = arguments.recovery.as_deref().map(Colouring::Recovery);
    let colouring = recovery.or(envelope.as_ref().map(Colouring::Envelope));
    let named = arguments.simulation.as_ref().or(arguments.envelope.as_ref()).unwrap_or(&arguments.body);
    let view =
        View::new(&body, triangles, motion.as_ref(), colouring).map_err(|error| error.in_file(named))?;
    refuse_warnings(arguments.printing, &diagnostics)?;
    slot.fill(view.html().as_bytes())?;
    slot.commit()?;
    Ok(Outcome {
        text: view.render(Format::Terminal),
        json: view.render(Format::Json),
        diagnostics,
        passed: true,
    })
}
