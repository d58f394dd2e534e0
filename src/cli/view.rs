//! Command `flexbody view`.

use super::arguments::ViewArguments;
use super::outcome::{Outcome, refuse_replacing, refuse_warnings};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_file::read_simulation;
use flexbody_report::{Format, View};

pub(super) fn run(arguments: &ViewArguments) -> Result<Outcome> {
    let inputs = std::iter::once(&arguments.body).chain(&arguments.simulation);
    refuse_replacing(inputs, std::iter::once(&arguments.output))?;
    let slot = OutputSlot::prepare(&arguments.output)?;
    let (body, diagnostics) = flexbody_file::read_with_notes(&arguments.body)?;
    let motion = arguments.simulation.as_ref().map(read_simulation).transpose()?;
    let triangles = arguments.triangles.map(|most| most as usize);
    let view = View::new(&body, triangles, motion.as_ref()).map_err(|error| match &arguments.simulation {
        Some(path) => error.in_file(path),
        None => error.in_file(&arguments.body),
    })?;
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
