//! Command `flexbody recover`.

use super::arguments::RecoverArguments;
use super::outcome::Outcome;
use super::run::{Printed, Run};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_body::flex_body::{Carrier, FlexBody};
use flexbody_input::read_steps;
use flexbody_motion::scene::{Channels, Envelope, LoadedHistory, RecoveredMotion, RecoveryRequest};
use flexbody_report::{EnvelopeKind, Format, RecoveredFacts, channels_csv, recovered_csv};
use std::path::{Path, PathBuf};

/// Kind of a file of recoveries over time.
#[derive(Debug, Clone, Copy)]
pub(super) enum RowsFile {
    Csv,
    Hdf5,
}

impl RowsFile {
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

    /// Writes channels of the steps of an FE program to the temporary file of `slot`.
    fn fill_channels(
        self,
        body: &FlexBody,
        channels: &Channels,
        history: &LoadedHistory,
        slot: &OutputSlot,
    ) -> Result<()> {
        match self {
            Self::Csv => slot.fill(channels_csv(channels).as_bytes()),
            Self::Hdf5 => {
                flexbody_file::fill_channels(body, channels, &history.path.display().to_string(), slot)
            }
        }
    }

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
    let RecoverArguments { body, history, shapes, output, channels, envelope, .. } = arguments;
    let kind = output.as_deref().map(RowsFile::of).transpose()?;
    let of_channels = channels.as_deref().map(RowsFile::of).transpose()?;
    let of_envelope = envelope.as_deref().map(EnvelopeKind::of).transpose()?;
    let request = RecoveryRequest { only: arguments.only.clone(), needs_envelope: of_envelope.is_some() };
    let inputs = [body, history].into_iter().chain(shapes);
    let outputs = output.iter().chain(channels).chain(envelope);
    let mut run = Run::begin(arguments.printing, inputs, outputs, &arguments.report)?;
    let prepare = |path: &Option<PathBuf>| path.as_ref().map(OutputSlot::prepare).transpose();
    let (slot, channel_slot, envelope_slot) = (prepare(output)?, prepare(channels)?, prepare(envelope)?);
    let body = run.read_body(body)?;
    let mut history = LoadedHistory::read(history, &body)?;
    history.carrier = arguments.carried_by.as_ref().map(|name| Carrier::named(&body, name));
    let mut found = None;
    if let (Some(steps), Some(kind), Some(slot)) = (shapes, of_channels, &channel_slot) {
        let channels = channels_of(&body, &history, steps)?;
        kind.fill_channels(&body, &channels, &history, slot)?;
        found = Some(channels);
    }
    let needs_rows = kind.is_some() || of_envelope.is_some() || !arguments.report.is_empty();
    if !needs_rows && body.recoveries().is_empty() {
        run.data()?;
        let printed =
            Printed { text: channels_in_words(found.as_ref()), json: channels_json(found.as_ref()) };
        return run.end_with(channel_slot, |_| String::new(), printed, true);
    }
    let recovered = request.run(&body, &history)?;
    run.note(recovered.diagnostics);
    let data = run.data()?;
    let motion = &recovered.motion;
    if let (Some(kind), Some(slot)) = (kind, &slot) {
        kind.fill(&body, motion, ("history", &history.path.display().to_string()), slot)?;
    }
    if let (Some(kind), Some(slot), Some(found)) = (of_envelope, &envelope_slot, Envelope::of(motion, None)) {
        slot.fill(&kind.bytes(&body, &found)?)?;
    }
    let facts = RecoveredFacts::new(&body, &history, motion, &data);
    let text = facts.render(Format::Terminal) + &channels_in_words(found.as_ref());
    let printed = Printed { text, json: facts.render(Format::Json) };
    let files = slot.into_iter().chain(channel_slot).chain(envelope_slot);
    run.end_with(files, |format| facts.render(format), printed, true)
}

/// Returns the channels of the steps in an archive of `flexbody shapes`.
fn channels_of(body: &FlexBody, history: &LoadedHistory, steps: &Path) -> Result<Channels> {
    history.channels(body, &read_steps(steps)?).map_err(|error| error.in_file(steps))
}

/// Returns the numbers of channels and instants in words; empty without channels.
fn channels_in_words(channels: Option<&Channels>) -> String {
    channels.map_or_else(String::new, |own| {
        let (steps, instants) = (own.names.len() - 1, own.times.len());
        format!("Channels    {steps} steps and a constant, {instants} instants\n")
    })
}

fn channels_json(channels: Option<&Channels>) -> String {
    let names = channels.map(|own| &own.names);
    let instants = channels.map(|own| own.times.len());
    format!("{:#}", serde_json::json!({ "channels": names, "instants": instants }))
}
