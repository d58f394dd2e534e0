//! Command `flexbody recover`.

use super::arguments::RecoverArguments;
use super::outcome::{Outcome, format_of, refuse_replacing, refuse_warnings};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_body::flex_body::FlexBody;
use flexbody_motion::scene::{Envelope, LoadedHistory, RecoveredMotion};
use flexbody_report::{EnvelopeKind, Format, RecoveredFacts, RunData, recovered_csv};
use std::path::Path;

/// Kind of a file of recoveries over time.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    Csv,
    Hdf5,
}

impl Kind {
    /// Returns the kind of a file by its extension.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) for other extensions.
    pub(super) fn of(path: &Path) -> Result<Self> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("csv") => Ok(Self::Csv),
            Some("h5" | "hdf5") => Ok(Self::Hdf5),
            _ => {
                let message = format!("output {} has no known extension", path.display());
                let help = "give it the extension .csv or .h5";
                Err(Diagnostic::new(Code::Usage, message).with_help(help).into())
            }
        }
    }
}

impl Kind {
    /// Writes recoveries of `body` over a motion to the temporary file of `slot`.
    ///
    /// * `origin`: name and value of the attribute that says where the motion is from.
    pub(super) fn fill(
        self,
        body: &FlexBody,
        motion: &RecoveredMotion,
        origin: (&str, &str),
        slot: &OutputSlot,
    ) -> Result<()> {
        match self {
            Self::Csv => slot.fill(recovered_csv(motion).as_bytes()),
            Self::Hdf5 => flexbody_file::fill_recovered(body, motion, origin, slot),
        }
    }
}

pub(super) fn run(arguments: &RecoverArguments) -> Result<Outcome> {
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let kind = Kind::of(&arguments.output)?;
    let envelope = arguments.envelope.as_deref().map(EnvelopeKind::of).transpose()?;
    let outputs = || std::iter::once(&arguments.output).chain(&arguments.envelope).chain(&arguments.report);
    refuse_replacing([&arguments.body, &arguments.history].into_iter(), outputs())?;
    let slot = OutputSlot::prepare(&arguments.output)?;
    let envelope_slot = arguments.envelope.as_ref().map(OutputSlot::prepare).transpose()?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    let (body, diagnostics) = flexbody_file::read_with_notes(&arguments.body)?;
    let history = LoadedHistory::read(&arguments.history, &body)?;
    let mut recovered = history.recover(&body, &arguments.only)?;
    if envelope.is_some() {
        recovered = recovered.with_envelope();
    }
    let run = RunData { diagnostics, ..RunData::default() };
    refuse_warnings(arguments.printing, &run.diagnostics)?;
    kind.fill(&body, &recovered, ("history", &history.path.display().to_string()), &slot)?;
    if let (Some(kind), Some(slot), Some(found)) =
        (envelope, &envelope_slot, Envelope::of(&recovered, None))
    {
        slot.fill(&kind.bytes(&body, &found)?)?;
    }
    let facts = RecoveredFacts::new(&body, &history, &recovered, &run);
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(facts.render(format).as_bytes())?;
    }
    OutputSlot::commit_all(std::iter::once(slot).chain(envelope_slot).chain(reports))?;
    let (text, json) = (facts.render(Format::Terminal), facts.render(Format::Json));
    Ok(Outcome { text, json, diagnostics: run.diagnostics.clone(), passed: true })
}
