//! Request for a frequency response: what a user states, completed by a scene.

use super::band::Band;
use super::ends::{Excitation, ResponseEnds};
use super::place::Place;
use super::settings::ResponseSettings;
use super::study::{Response, respond};
use crate::conversion::{RESIDUALS_NEED_FREE_MODES, refuse_contradiction};
use crate::tailoring::computed_basis;
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
    /// Basis of the body that is made of a model without a body; `None` for free modes.
    pub basis: Option<BasisKind>,
    /// Number of modes of that body; `None` for the default number.
    pub modes: Option<usize>,
    /// Loads of its residual vectors; `None` for those of the manifest.
    pub residual_vectors: Option<Vec<LoadSource>>,
}

/// Response with the body that was made for it.
#[derive(Debug, Clone)]
pub struct Responded {
    /// Frequency response.
    pub response: Response,
    /// Settings, completed by those of the scene.
    pub settings: ResponseSettings,
    /// Body that was made; `None` if one was given.
    pub made: Option<FlexBody>,
    /// Warnings and notes about the body that was made and about the response.
    pub diagnostics: Vec<Diagnostic>,
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
            basis: None,
            modes: None,
            residual_vectors: None,
        }
    }
}

impl ResponseRequest {
    /// Possible numbers of frequencies of the curves.
    pub const POINTS: RangeInclusive<usize> = 2..=100_000;
    /// Possible numbers of frequencies at which the equations of all nodes are solved.
    pub const SOLVES: RangeInclusive<usize> = 2..=10_000;

    /// Refuses settings that contradict the inputs.
    ///
    /// * `has_model`: true if the model is given.
    /// * `has_body`: true if a body is given beside the model.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) for a body beside another body, for settings of a body that is not made, and for a basis that
    /// needs a scene or shapes.
    pub fn check(&self, has_model: bool, has_body: bool) -> Result<()> {
        let states_body = self.modes.is_some() || self.basis.is_some() || self.residual_vectors.is_some();
        refuse_contradiction(&[
            (
                has_body && !has_model,
                "give the model first (a manifest or a job), then the body that was made from it",
            ),
            (
                states_body && (has_body || !has_model),
                "--modes, --basis and --residual-vectors apply to a model without a body: the modes of a body file are fixed",
            ),
            (
                self.basis == Some(BasisKind::Scene),
                "--basis scene works only in convert: convert the model first, then give the body after the model",
            ),
            (
                self.basis == Some(BasisKind::Imported),
                "--basis imported works only in convert: convert the model first, then give the body after the model",
            ),
            (
                self.basis == Some(BasisKind::CraigBampton) && self.residual_vectors.is_some(),
                RESIDUALS_NEED_FREE_MODES,
            ),
        ])
    }

    /// Computes the response of a `body` of `model` with its errors, or without a body that of one that is made now.
    ///
    /// * `of_manifest`: loads of residual vectors that the manifest of the model states.
    ///
    /// # Errors
    /// The errors of [`ResponseRequest::check`], of the conversion, and of [`ResponseRequest::respond`].
    pub fn for_model(
        &self,
        model: &FeModel,
        of_manifest: &[LoadSource],
        body: Option<&FlexBody>,
        scene: Option<&Scene>,
        context: &Context<'_>,
    ) -> Result<Responded> {
        self.check(true, body.is_some())?;
        let conversion = match body {
            Some(_) => None,
            None => Some(self.body_of(model, of_manifest, context)?),
        };
        let of_body = conversion.as_ref().map_or_else(Vec::new, |made| made.diagnostics.clone());
        let made = conversion.map(|conversion| conversion.body);
        let body = made.as_ref().or(body).expect("a body is given or made");
        let (response, settings) = self.respond(Some(model), body, scene, context)?;
        let diagnostics = [of_body, response.diagnostics.clone()].concat();
        Ok(Responded { response, settings, made, diagnostics })
    }

    /// Computes the response of `body` without its model, so that its errors are not known.
    ///
    /// # Errors
    /// The errors of [`ResponseRequest::check`] and [`ResponseRequest::respond`].
    pub fn for_body(
        &self,
        body: &FlexBody,
        scene: Option<&Scene>,
        context: &Context<'_>,
    ) -> Result<Responded> {
        self.check(false, false)?;
        let (response, settings) = self.respond(None, body, scene, context)?;
        let diagnostics = response.diagnostics.clone();
        Ok(Responded { response, settings, made: None, diagnostics })
    }

    /// Converts a model to a body for a frequency response: without lumped comparators.
    fn body_of(
        &self,
        model: &FeModel,
        of_manifest: &[LoadSource],
        context: &Context<'_>,
    ) -> Result<Conversion> {
        let loads = self.residual_vectors.as_deref().unwrap_or(of_manifest);
        let wanted = Wanted::Lowest(self.modes.unwrap_or(ModeSettings::DEFAULT_COUNT));
        let settings = ConvertSettings {
            modes: ModeSettings { wanted, ..ModeSettings::default() },
            basis: computed_basis(self.basis.unwrap_or_default(), loads, model)?,
            lumped: Vec::new(),
            ..ConvertSettings::default()
        };
        convert(model, &settings, context)
    }

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
