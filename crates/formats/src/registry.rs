//! Registry of the formats in which bodies are written for other programs.

#[cfg(feature = "embedded-c")]
use super::embedded;
use super::export::{AllowedLosses, ExportFormat, ExportOptions, Exported, Loss, Points};
use super::gltf::Gltf;
use super::vtk::Vtk;
use super::{adams, chrono, json, mbdyn, npz, openradioss, sid};
#[cfg(feature = "hdf5")]
use super::{exudyn, mbsim, simscape};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::units::UnitSystem;
use flexbody_body::convert::interface_compliance;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_motion::scene::{FrameMotion, FramedScene, LoadCases};
use std::borrow::Cow;

/// All export formats in the order of the documentation.
pub const FORMATS: &[&dyn ExportFormat] = &[
    #[cfg(feature = "hdf5")]
    &exudyn::write::Exudyn,
    &sid::write::Sid,
    &mbdyn::write::Mbdyn,
    #[cfg(feature = "hdf5")]
    &mbsim::write::Mbsim,
    &openradioss::OpenRadioss,
    &chrono::Chrono,
    #[cfg(feature = "hdf5")]
    &simscape::Simscape,
    &adams::AdamsInvariants,
    &npz::Npz,
    &json::Json,
    #[cfg(feature = "embedded-c")]
    &embedded::Embedded,
    &Vtk,
    &Gltf,
];

/// Names under which the format of Adams may be asked for.
const ADAMS: [&str; 2] = ["adams", "mnf"];

/// Returns the export format with this name, or that of a program with this name.
///
/// # Errors
/// [`Usage`](Code::Usage) for an unknown name, with the known names, and for Adams, whose format is not written.
pub fn find_format(name: &str) -> Result<&'static dyn ExportFormat> {
    let called = |format: &&dyn ExportFormat| format.name() == name || format.other_names().contains(&name);
    FORMATS.iter().copied().find(called).ok_or_else(|| {
        let (message, help) = if ADAMS.contains(&name) {
            (
                "modal neutral files (MNF) of Adams are proprietary and are not written".to_owned(),
                "export to adams-invariants to compare the nine invariants of an MNF with those of the body"
                    .to_owned(),
            )
        } else {
            let names: Vec<&str> = FORMATS.iter().map(|format| format.name()).collect();
            (format!("`{name}` is not an export format"), names.join(", "))
        };
        Diagnostic::new(Code::Usage, message).with_help(help).into()
    })
}

/// Writes `body` in a format. Warns of every property that the format cannot hold; notes state every setting
/// that the reading program needs, and the properties that a picture leaves out.
///
/// # Errors
/// [`Usage`](Code::Usage) for options that the format does not have, or nodes that the body does not have;
/// [`ExportLoses`](Code::ExportLoses), one diagnostic per loss, unless all of them are `allowed`; the errors of
/// [`RecordedMotion::body_in_frame`](flexbody_file::RecordedMotion::body_in_frame) and of [`ExportFormat::write`].
pub fn export(
    body: &FlexBody,
    format: &dyn ExportFormat,
    options: &ExportOptions,
    allowed: impl Into<AllowedLosses>,
) -> Result<(Exported, Vec<Diagnostic>)> {
    check_options(body, format, options)?;
    // A picture of a motion shows the body in the frame of the motion.
    let body = match &options.motion {
        Some(motion) => Cow::Owned(motion.body_in_frame(body)?),
        None => Cow::Borrowed(body),
    };
    let body = body.as_ref();
    let checklist = format.checklist(body, options);
    let numbers = format.interface_numbers(body, options);
    let numbered = (!numbers.is_empty()).then(|| {
        let all: Vec<String> = numbers.iter().map(|(name, number)| format!("`{name}` is {number}")).collect();
        let message = format!("interfaces have numbers in the file: {}", all.join(", "));
        Diagnostic::new(Code::ExportNumbers, message)
    });
    let unread = checklist.left_out_recoveries().map(|what| {
        let message = format!("the file {what}");
        Diagnostic::new(Code::ExportRecoveries, message)
    });
    // Losses are warnings if they are allowed, otherwise errors.
    let allowed = allowed.into();
    let told = |code: Code, loss: &Loss| {
        let message = format!("{} cannot hold {} ({})", format.name(), loss.text, loss.property);
        Diagnostic::new(code, message).with_help(help_of_loss(body, format, options, code, loss.property))
    };
    let losses = checklist.losses();
    let refused: Vec<Diagnostic> =
        losses.iter().filter(|loss| !allowed.allow(loss)).map(|loss| told(Code::ExportLoses, loss)).collect();
    if !refused.is_empty() {
        return Err(Error::new(refused));
    }
    let losses: Vec<Diagnostic> = losses.iter().map(|loss| told(Code::ExportLost, loss)).collect();
    let needs = format.needs(body, options).into_iter().map(|need| Diagnostic::new(Code::ExportNeeds, need));
    let left =
        format.leaves_out(body, options).into_iter().map(|what| Diagnostic::new(Code::ExportPicture, what));
    let exported = format.write(body, options)?;
    Ok((exported, losses.into_iter().chain(needs).chain(left).chain(unread).chain(numbered).collect()))
}

/// Returns the advice for a property that `format` loses: the options that allow the loss or measure its effect, and the
/// formats that hold the property.
fn help_of_loss(
    body: &FlexBody,
    format: &dyn ExportFormat,
    options: &ExportOptions,
    code: Code,
    property: &str,
) -> String {
    let holds = |other: &&&'static dyn ExportFormat| {
        let checklist = || other.checklist(body, &ExportOptions::default());
        other.name() != format.name()
            && !other.is_picture()
            && !COMPARISONS.contains(&other.name())
            && checklist().losses().iter().all(|loss| loss.property != property)
    };
    let others: Vec<&str> = FORMATS.iter().filter(holds).map(|other| other.name()).collect();
    let mut ways = Vec::new();
    if code == Code::ExportLoses {
        ways.push(format!("write the file without it by --allow-loss={property}"));
    } else if options.in_scene.is_empty() {
        ways.push("give --scene SCENE to measure the effect in your motion".to_owned());
    } else {
        ways.push("nothing to do if this effect is small enough for you".to_owned());
    }
    if !others.is_empty() {
        ways.push(format!("or export to a format that holds it: {}", others.join(", ")));
    }
    ways.join(", ")
}

/// Formats that hold numbers for comparisons and no body to simulate.
const COMPARISONS: [&str; 1] = ["adams-invariants"];

/// Writes `body` in a format like [`export`], in other `units` if they are given. The findings include a warning about
/// interfaces whose static compliance the modes do not contain, except for a picture.
///
/// # Errors
/// The errors of [`export`] and of [`flexbody_file::in_units`].
pub fn export_in_units(
    body: &FlexBody,
    format: &dyn ExportFormat,
    options: &ExportOptions,
    units: Option<&UnitSystem>,
    allowed: impl Into<AllowedLosses>,
) -> Result<(Exported, Vec<Diagnostic>)> {
    let body = match units {
        Some(units) => Cow::Owned(flexbody_file::in_units(body, units)?),
        None => Cow::Borrowed(body),
    };
    let (exported, mut findings) = export(&body, format, options, allowed)?;
    findings.extend(interface_compliance(&body).filter(|_| !format.is_picture()));
    Ok((exported, findings))
}

/// Returns the motion of `body` in the load cases of a scene, for [`ExportOptions::in_scene`]; empty if no loss of this
/// format depends on it.
///
/// # Errors
/// [`Usage`](Code::Usage) for options that the format does not have; the errors of [`FramedScene::new`], and those of
/// [`FrameMotion::in_cases`] where the motion counts.
pub fn motion_of_losses(
    body: &FlexBody,
    format: &dyn ExportFormat,
    options: &ExportOptions,
    cases: &LoadCases,
    context: &Context<'_>,
) -> Result<Vec<FrameMotion>> {
    check_options(body, format, options)?;
    let judged = |loss: &Loss| loss.is_slight || loss.property == "deformed-inertia";
    if format.checklist(body, options).losses().iter().any(judged) {
        return FrameMotion::in_cases(body, cases, context);
    }
    cases.iter().try_for_each(|scene| FramedScene::new(body, scene).map(drop))?;
    Ok(Vec::new())
}

fn check_options(body: &FlexBody, format: &dyn ExportFormat, options: &ExportOptions) -> Result<()> {
    let refuse =
        |message: String, help: String| Err(Diagnostic::new(Code::Usage, message).with_help(help).into());
    let name = format.name();
    if let Some(dialect) = &options.dialect
        && !format.dialects().contains(&dialect.as_str())
    {
        let known = format.dialects().join(", ");
        let help =
            if known.is_empty() { format!("leave --dialect out: {name} has no dialects") } else { known };
        return refuse(format!("`{dialect}` is not a dialect of {name}"), help);
    }
    if options.points != Points::Usual && !format.has_points() {
        return refuse(
            format!("{name} writes all nodes or none: --points does not apply"),
            "leave --points out".to_owned(),
        );
    }
    if (options.modes.is_some() || options.motion.is_some()) && !format.is_picture() {
        let help = "leave --modes and --simulation out, or export to vtk or gltf".to_owned();
        return refuse(format!("{name} always writes all modes of the body, and never a motion"), help);
    }
    if let Some(modes) = options.modes.filter(|modes| *modes > body.n_modes()) {
        let help = format!("give --modes {} or less", body.n_modes());
        return refuse(format!("the body has {} modes, not {modes}", body.n_modes()), help);
    }
    if options.points.of_interfaces() && body.interfaces().is_empty() {
        return refuse(
            "the body has no interfaces".to_owned(),
            "give --points nodes, or node numbers".to_owned(),
        );
    }
    if let Some(id) = options.points.named().iter().find(|&id| !body.nodes().ids.contains(id)) {
        let help = "list the nodes with flexbody inspect".to_owned();
        return refuse(format!("the body has no node {id}"), help);
    }
    Ok(())
}
