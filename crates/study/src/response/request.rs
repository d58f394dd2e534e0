//! Request for a frequency response: what a user states, completed by a scene.

use super::band::Band;
use super::ends::Excitation;
use super::place::Place;
use super::study::{Response, ResponseEnds, ResponseSettings, respond};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisKind, ModeSettings};
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_input::LoadSource;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::{Point, Scene};
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Request for a frequency response. A scene supplies what is not stated: its loads, watched points, band and damping.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseRequest {
    /// Places of unit forces; empty for the places of the loads of the scene.
    pub from: Vec<Place>,
    /// Interface whose acceleration excites the body, in place of forces.
    pub base: Option<Place>,
    /// Rows of recoveries to compute: `NAME` for all rows of a recovery, `NAME:ROW` for one.
    pub rows: Vec<String>,
    /// Table of the spectral densities of a random excitation; `None` without.
    pub densities: Option<PathBuf>,
    /// Places of measured displacements; empty for the watched points of the scene.
    pub to: Vec<Place>,
    /// Frequency band; `None` for the band of the scene.
    pub band: Option<Band>,
    /// Damping ratio of all modes, for a body without damping.
    pub damping: Option<f64>,
    /// Largest relative error that is accepted.
    pub tolerance: f64,
    /// Approximate number of frequencies of the curves.
    pub points: usize,
    /// Approximate number of frequencies at which the equations of all nodes are solved.
    pub solves: usize,
}

impl Default for ResponseRequest {
    fn default() -> Self {
        Self {
            from: Vec::new(),
            base: None,
            rows: Vec::new(),
            densities: None,
            to: Vec::new(),
            band: None,
            damping: None,
            tolerance: ResponseSettings::TOLERANCE,
            points: ResponseSettings::POINTS,
            solves: ResponseSettings::SOLVES,
        }
    }
}

impl ResponseRequest {
    /// Possible numbers of frequencies of the curves.
    pub const POINTS: RangeInclusive<usize> = 2..=100_000;
    /// Possible numbers of frequencies at which the equations of all nodes are solved.
    pub const SOLVES: RangeInclusive<usize> = 2..=10_000;

    /// Computes the response of `body`, with its errors if its `model` is given. Returns the settings as well.
    ///
    /// # Errors
    /// FB801 if neither the request nor the scene states the band or the places, and for numbers that are not possible;
    /// the errors of [`respond`].
    pub fn respond(
        &self,
        model: Option<&FeModel>,
        body: &FlexBody,
        scene: Option<&Scene>,
        context: &Context<'_>,
    ) -> Result<(Response, ResponseSettings)> {
        self.refuse_impossible()?;
        let settings = self.settings(scene, body)?;
        let (from, to) = self.ends(scene, body)?;
        let ends =
            ResponseEnds { from: &from, to: &to, rows: &self.rows, densities: self.densities.as_deref() };
        let response = respond(model, body, &ends, &settings, context)?;
        Ok((response, settings))
    }

    /// Refuses numbers that are not possible, which a command line does not let pass.
    fn refuse_impossible(&self) -> Result<()> {
        let is_positive = self.tolerance.is_finite() && self.tolerance > 0.0;
        let is_ratio = self.damping.is_none_or(|ratio| ratio.is_finite() && ratio >= 0.0);
        let message = match () {
            () if !is_positive => format!("the tolerance is {}, expected a positive number", self.tolerance),
            () if !is_ratio => {
                "the damping ratio is not a finite number, 0 or larger (1 is critical)".to_owned()
            }
            () if !Self::POINTS.contains(&self.points) => {
                format!("{} points of the curves, expected 2 to 100000", self.points)
            }
            () if !Self::SOLVES.contains(&self.solves) => {
                format!("{} solves, expected 2 to 10000", self.solves)
            }
            () => return Ok(()),
        };
        Err(Diagnostic::new(Code::Usage, message).into())
    }

    /// Returns the settings, completed by those of the scene.
    fn settings(&self, scene: Option<&Scene>, body: &FlexBody) -> Result<ResponseSettings> {
        let of_scene =
            scene.and_then(|scene| Band::new(0.0, scene.requirements.band? * body.units().hertz()));
        let band = self.band.or(of_scene).ok_or_else(|| {
            Diagnostic::new(Code::Usage, "no frequency band is given")
                .with_help("give --band 0..2000, or a --scene with a [band]")
        })?;
        Ok(ResponseSettings {
            band,
            points: self.points,
            solves: self.solves,
            damping: self.damping.map(Into::into).or_else(|| scene?.requirements.damping.clone()),
            replaces_damping: self.damping.is_none()
                && scene.is_some_and(|scene| scene.requirements.replaces_damping),
            tolerance: self.tolerance,
        })
    }

    /// Returns the excitation, and the places of measured displacements.
    fn ends(&self, scene: Option<&Scene>, body: &FlexBody) -> Result<(Excitation, Vec<Place>)> {
        let watched = scene.map_or_else(Vec::new, |scene| scene.watched.iter().collect());
        let to = chosen(&self.to, &watched);
        refuse_read_loads(to.iter().chain(&self.base), body)?;
        if to.is_empty() && self.rows.is_empty() && self.densities.is_none() {
            return Err(missing("displacements", "to", "watch").into());
        }
        if let Some(base) = &self.base {
            if !self.from.is_empty() {
                let message = "--base and --from are both given: a body is excited by one of the two";
                return Err(Diagnostic::new(Code::Usage, message).into());
            }
            return Ok((Excitation::Base(base.clone()), to));
        }
        let loaded = scene.map_or_else(Vec::new, |scene| scene.loads.iter().map(|load| &load.at).collect());
        let from = chosen(&self.from, &loaded);
        let from = from.iter().map(|place| place.resolved(body)).collect::<Result<Vec<_>>>()?;
        if from.is_empty() {
            return Err(missing("forces", "from", "load").into());
        }
        Ok((Excitation::Forces(from), to))
    }
}

/// Refuses named loads as places whose motion is read or prescribed.
fn refuse_read_loads<'p>(places: impl Iterator<Item = &'p Place>, body: &FlexBody) -> Result<()> {
    for place in places {
        if matches!(place.resolved(body)?.point, Point::NamedLoad(_)) {
            let message = format!(
                "`{}` is a named load: it excites the body and has no displacement",
                place.stated_name()
            );
            let help = "give it to --from; give a node or an interface to --to and --base";
            return Err(Diagnostic::new(Code::PlaceUnknown, message).with_help(help).into());
        }
    }
    Ok(())
}

/// Returns the stated places, or else those of a scene, each once. A scene may load a point twice.
fn chosen(stated: &[Place], of_scene: &[&Point]) -> Vec<Place> {
    let mut places = stated.to_vec();
    if places.is_empty() {
        places.extend(of_scene.iter().map(|point| Place::of((*point).clone())));
    }
    let mut once: Vec<Place> = Vec::new();
    places.into_iter().for_each(|place| {
        if !once.contains(&place) {
            once.push(place)
        }
    });
    once
}

fn missing(what: &str, option: &str, key: &str) -> Diagnostic {
    let help = format!("give --{option} INTERFACE or --{option} NODE, or a --scene with [[{key}]]");
    Diagnostic::new(Code::Usage, format!("no place of {what} is given")).with_help(help)
}

/// Converts a model to a body for a frequency response: without lumped comparators, and with the given number of modes.
///
/// # Errors
/// FB801 for a basis that needs a scene or imported shapes; the errors of [`convert`].
pub fn converted_for_response(
    model: &FeModel,
    basis: BasisKind,
    loads: &[LoadSource],
    modes: Option<usize>,
    context: &Context<'_>,
) -> Result<Conversion> {
    let wanted = Wanted::Lowest(modes.unwrap_or(ModeSettings::DEFAULT_COUNT));
    let settings = ConvertSettings {
        modes: ModeSettings { wanted, ..ModeSettings::default() },
        basis: crate::tailoring::computed_basis(basis, loads, model)?,
        lumped: Vec::new(),
        ..ConvertSettings::default()
    };
    convert(model, &settings, context)
}
