//! Conversion of two bodies to common units and reference conditions, before they are compared.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::flex_body::{FlexBody, Frame, Recovery, ReferenceConditions};
use nalgebra::{Matrix3, Vector3};
use std::borrow::Cow;

/// Two bodies in the units of the first and with the same reference conditions.
pub(super) struct Comparable<'b> {
    pub a: Cow<'b, FlexBody>,
    pub b: Cow<'b, FlexBody>,
    /// Sentences about the conversion.
    pub notes: Vec<String>,
    /// Entries of the file that the conversion leaves out, as `name (paths)`.
    pub left_out: Vec<String>,
}

impl<'b> Comparable<'b> {
    /// Returns two bodies that can be compared, as they are or converted.
    ///
    /// # Errors
    /// [`BodyIncomparable`](Code::BodyIncomparable) for other dimensions, for units of which only one body states its own, and
    /// for reference conditions that cannot be changed to mean axes.
    pub(super) fn of(a: &'b FlexBody, b: &'b FlexBody) -> Result<Self> {
        let mut problems = problems_of_units(a, b);
        if a.dimension() != b.dimension() {
            let (a, b) = (a.dimension(), b.dimension());
            problems.push(incomparable(format!("the first body has dimension {a}, the second {b}")));
        }
        if !problems.is_empty() {
            return Err(Error::new(problems));
        }
        let b = in_units_of(a, b)?;
        let mut bodies = Self { a: Cow::Borrowed(a), b, notes: Vec::new(), left_out: Vec::new() };
        if !have_the_same_modes(a.conditions(), bodies.b.conditions()) {
            bodies.convert_to_mean_axes()?;
        }
        Ok(bodies)
    }

    /// Returns an error if the numbers of modes differ.
    pub(super) fn require_equal_numbers_of_modes(&self) -> Result<()> {
        let (a, b) = (self.a.n_modes(), self.b.n_modes());
        if a == b {
            return Ok(());
        }
        let message = format!("the first body has {a} modes, the second {b}");
        let help = "compare with --common, which uses the modes that both bodies have and names the others";
        Err(incomparable(message).with_help(help).into())
    }

    /// Converts both bodies to mean axes, in which the modes of a body do not depend on the place of its frame. The frame of a body
    /// with unstated conditions has no known place.
    fn convert_to_mean_axes(&mut self) -> Result<()> {
        let [first, second] = [self.a.conditions().clone(), self.b.conditions().clone()];
        if [&first, &second].into_iter().any(|own| *own == ReferenceConditions::Unstated) {
            return Err(different(&first, &second, "").into());
        }
        for body in [&mut self.a, &mut self.b] {
            if body.conditions().is_mean() {
                continue;
            }
            let converted =
                body.in_mean_axes().map_err(|error| refused(&first, &second, &error))?.into_owned();
            *body = Cow::Owned(converted);
        }
        self.notes.push(format!(
            "the reference conditions differ ({first} in the first body, {second} in the second): both bodies are compared in mean axes, with the frequencies of the free body"
        ));
        self.remove_recoveries_of_rigid_motion()
    }

    /// Removes the recoveries that rigid motion changes: their rows are known relative to the frame of their file only.
    fn remove_recoveries_of_rigid_motion(&mut self) -> Result<()> {
        for body in [&mut self.a, &mut self.b] {
            let of_frame = |recovery: &&Recovery| !recovery.ignores_rigid_motion();
            let names: Vec<String> =
                body.recoveries().iter().filter(of_frame).map(|recovery| recovery.name.clone()).collect();
            if names.is_empty() {
                continue;
            }
            let mut parts = body.parts().clone();
            parts.recoveries.retain(Recovery::ignores_rigid_motion);
            *body = Cow::Owned(FlexBody::new(parts)?);
            for name in names {
                let entry = format!(
                    "rows of displacements, which are relative to the frame of the body (/recovery/{name})"
                );
                if !self.left_out.contains(&entry) {
                    self.left_out.push(entry);
                }
            }
        }
        Ok(())
    }
}

fn incomparable(message: String) -> Diagnostic {
    Diagnostic::new(Code::BodyIncomparable, message)
}

/// Returns the error about reference conditions that cannot be changed to mean axes.
fn refused(first: &ReferenceConditions, second: &ReferenceConditions, reason: &Error) -> Error {
    let reasons: Vec<&str> = reason.diagnostics().iter().map(Diagnostic::message).collect();
    different(first, second, &format!("; they cannot be changed to mean axes: {}", reasons.join("; "))).into()
}

/// Returns the error about different reference conditions, with a `reason` at its end.
fn different(first: &ReferenceConditions, second: &ReferenceConditions, reason: &str) -> Diagnostic {
    let message = format!(
        "the modes belong to different reference conditions: {first} in the first body, {second} in the second{reason}"
    );
    incomparable(message).with_help("convert both with the same --frame")
}

/// Returns an error for each unit that differs if only one body states its units: assumed ones may be wrong.
fn problems_of_units(a: &FlexBody, b: &FlexBody) -> Vec<Diagnostic> {
    let (ua, ub) = (a.units(), b.units());
    if ua.stated && ub.stated {
        return Vec::new();
    }
    let pairs =
        [("length", &ua.length, &ub.length), ("mass", &ua.mass, &ub.mass), ("time", &ua.time, &ub.time)];
    let differ = pairs.into_iter().filter(|(_, x, y)| x.to_si() != y.to_si());
    let problem = |(what, x, y): (&str, &flexbody_base::units::Unit, &flexbody_base::units::Unit)| {
        let message = format!(
            "unit of {what} is `{}` in the first body and `{}` in the second, and only one body states its units",
            x.name(),
            y.name()
        );
        incomparable(message).with_help("convert the model of the other body again, with its units stated")
    };
    differ.map(problem).collect()
}

/// Returns `b` in the units of `a`, if both bodies state their units; else `b` as it is.
fn in_units_of<'b>(a: &FlexBody, b: &'b FlexBody) -> Result<Cow<'b, FlexBody>> {
    let (ua, ub) = (a.units(), b.units());
    let pairs = [(&ua.length, &ub.length), (&ua.mass, &ub.mass), (&ua.time, &ub.time)];
    let are_equal = pairs.iter().all(|(a, b)| a.to_si() == b.to_si());
    if are_equal || !(ua.stated && ub.stated) {
        return Ok(Cow::Borrowed(b));
    }
    flexbody_file::in_units(b, ua).map(Cow::Owned)
}

/// Returns true if two reference conditions may be the same; a file of another program does not state its
/// conditions.
fn have_the_same_modes(a: &ReferenceConditions, b: &ReferenceConditions) -> bool {
    use ReferenceConditions::{MeanAxes, Unstated};
    match (a, b) {
        (Unstated, MeanAxes) | (MeanAxes, Unstated) => false,
        (Unstated, _) | (_, Unstated) => true,
        _ => a == b,
    }
}

/// Returns true if the place of the body frame in the model is known.
pub(super) fn is_placed(body: &FlexBody) -> bool {
    body.source().n_dofs > 0
}

/// Returns the body with its frame declared as the frame of the model.
pub(super) fn in_own_frame(body: &FlexBody) -> Result<FlexBody> {
    let mut parts = body.parts().clone();
    parts.frame = Frame { origin: Vector3::zeros(), axes: Matrix3::identity() };
    FlexBody::new(parts)
}
