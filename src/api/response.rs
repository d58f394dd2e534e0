//! Frequency responses.

use super::progress::{Listener, heard};
use super::{Basis, FlexBody, Model, ReportFormat, Scene, report};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_report::{ResponseFacts, response_csv};
use flexbody_study::response::{
    self, Band, Place, RandomResponse, Responded, ResponseRequest, ResponseSettings,
};
use nalgebra::Complex;
use std::path::PathBuf;

/// Settings of a frequency response: places of unit forces and of measured displacements, and a band. A scene supplies
/// what is not stated: the places of its loads, its watched points, its band and its damping.
#[derive(Debug, Clone, Default)]
pub struct ResponseOptions {
    request: ResponseRequest,
    band: Option<(f64, f64)>,
    scene: Option<Scene>,
}

impl ResponseOptions {
    /// Adds a place of unit forces: an interface or a node number, optionally with a colon and directions of `x`, `y`,
    /// `z`, `rx`, `ry`, `rz` along the axes of the model (`big_end:z`, `17:x,rz`).
    pub fn from(mut self, place: &str) -> Self {
        self.request.from.push(Place::parse(place));
        self
    }

    /// Adds a place of measured displacements, in the form of [`ResponseOptions::from`].
    pub fn to(mut self, place: &str) -> Self {
        self.request.to.push(Place::parse(place));
        self
    }

    /// Sets the interface whose acceleration excites the body in place of forces, in the form of
    /// [`ResponseOptions::from`]; its other directions are at rest.
    pub fn base(mut self, place: &str) -> Self {
        self.request.base = Some(Place::parse(place));
        self
    }

    /// Adds rows of recoveries: `gauges` for all rows of a recovery, `gauges:ROW` for one.
    pub fn rows(mut self, rows: &str) -> Self {
        self.request.rows.push(rows.to_owned());
        self
    }

    /// Sets the table of the spectral densities of a random excitation, one-sided and per hertz.
    pub fn densities(mut self, path: impl Into<PathBuf>) -> Self {
        self.request.densities = Some(path.into());
        self
    }

    /// Sets the frequency band. Unit: Hz.
    pub fn band_hz(mut self, low: f64, high: f64) -> Self {
        self.band = Some((low, high));
        self
    }

    /// Sets the damping ratio of all modes, for a body without damping.
    pub fn damping_ratio(mut self, ratio: f64) -> Self {
        self.request.damping = Some(ratio);
        self
    }

    /// Sets the largest relative error that is accepted. Default 0.05.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.request.tolerance = tolerance;
        self
    }

    /// Sets the approximate number of frequencies of the curves. Default 400.
    pub fn points(mut self, count: usize) -> Self {
        self.request.points = count;
        self
    }

    /// Sets the approximate number of frequencies at which the equations of all nodes are solved. Default 80.
    pub fn solves(mut self, count: usize) -> Self {
        self.request.solves = count;
        self
    }

    /// Sets the scene that supplies what is not stated. It must have a single load case.
    pub fn scene(mut self, scene: &Scene) -> Self {
        self.scene = Some(scene.clone());
        self
    }

    /// Sets the basis of the body that [`Model::response`] makes if it is given none.
    pub fn basis(mut self, basis: Basis) -> Self {
        self.request.basis = Some(basis);
        self
    }

    /// Sets the number of modes of the body that [`Model::response`] makes if it is given none. Default 20.
    pub fn modes(mut self, count: usize) -> Self {
        self.request.modes = Some(count);
        self
    }

    /// Returns the request with its band.
    fn request(&self) -> Result<ResponseRequest> {
        let band = |(low, high)| {
            Band::new(low, high).ok_or_else(|| {
                let message = format!("the band is {low} to {high} Hz");
                Diagnostic::new(Code::Usage, message)
                    .with_help("give two frequencies in hertz, 0 or higher, the lower one first")
            })
        };
        Ok(ResponseRequest { band: self.band.map(band).transpose()?, ..self.request.clone() })
    }
}

/// Transfer function from one direction at a place to one direction at another, in the units of the body and radians.
/// The real part is in phase with the force.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TransferFunction {
    /// Place of the force: `interface tip`, `node 17`.
    pub from: String,
    /// Direction of the force or torque: `x`, `y`, `z`, `rx`, `ry` or `rz`.
    pub from_direction: &'static str,
    /// Place of the displacement: `interface tip`, `node 17`, or the recovery of the row: `recovery gauges`.
    pub to: String,
    /// Direction of the displacement or rotation, or the name of the row.
    pub to_direction: String,
    /// Response of the body at every frequency.
    pub reduced: Vec<Complex<f64>>,
    /// Response of all nodes at every frequency; `None` where their equations were not solved.
    pub full: Vec<Option<Complex<f64>>>,
}

/// Frequency response of a body between places.
#[derive(Debug, Clone)]
pub struct Response {
    inner: response::Response,
    settings: ResponseSettings,
    diagnostics: Vec<Diagnostic>,
}

impl Model {
    /// Computes the frequency response of `body`, which was made of this model, or without one of a body that is made
    /// now, like `flexbody response model.toml`. The equations of all nodes give its errors.
    ///
    /// # Errors
    /// FB801 if a band or a place is missing, and for numbers that are not possible; FB219 for a scene with several load
    /// cases; FB707 for a body of another model; FB218 for a place that it does not have; the errors of
    /// [`Model::convert`]; FB605 if the listener stops it.
    pub fn response(
        &self,
        body: Option<&FlexBody>,
        options: &ResponseOptions,
        listener: Listener<'_>,
    ) -> Result<Response> {
        let (request, scene) = (options.request()?, options.scene.as_ref());
        let scene = scene.map(|scene| scene.0.single()).transpose()?;
        let body = body.map(|body| &body.0);
        let responded = heard(listener, |context| {
            request.for_model(&self.checked, &self.residual_vectors, body, scene, context)
        })?;
        Ok(Response::new(responded, self.diagnostics()))
    }
}

impl FlexBody {
    /// Computes the frequency response of the body without its model, so that its errors are unknown.
    ///
    /// # Errors
    /// FB801 if a band or a place is missing, and for numbers that are not possible; FB219 for a scene with several load
    /// cases; FB218 for a place that the body does not have; FB605 if the listener stops it.
    pub fn response(&self, options: &ResponseOptions, listener: Listener<'_>) -> Result<Response> {
        let (request, scene) = (options.request()?, options.scene.as_ref());
        let scene = scene.map(|scene| scene.0.single()).transpose()?;
        let responded = heard(listener, |context| request.for_body(&self.0, scene, context))?;
        Ok(Response::new(responded, &[]))
    }
}

impl Response {
    /// Returns a response, with `earlier` diagnostics before its own.
    fn new(responded: Responded, earlier: &[Diagnostic]) -> Self {
        let Responded { response: inner, settings, diagnostics, .. } = responded;
        Self { inner, settings, diagnostics: [earlier, &diagnostics].concat() }
    }

    /// Returns the frequencies, ascending. Unit: Hz.
    pub fn frequencies_hz(&self) -> &[f64] {
        &self.inner.frequencies
    }

    /// Returns the transfer functions from every direction at each loaded place to every direction at each measured
    /// place.
    pub fn functions(&self) -> Vec<TransferFunction> {
        let pairs = self.inner.pairs.iter();
        let functions = pairs.flat_map(|pair| pair.functions.iter().map(move |function| (pair, function)));
        functions
            .map(|(pair, function)| TransferFunction {
                from: pair.from.to_string(),
                from_direction: function.from.name(),
                to: pair.to.to_string(),
                to_direction: function.to.name().to_owned(),
                reduced: function.reduced.clone(),
                full: function.full.clone(),
            })
            .collect()
    }

    /// Returns the root mean squares under random excitation; `None` without spectral densities.
    pub fn random(&self) -> Option<&RandomResponse> {
        self.inner.random.as_ref()
    }

    /// Returns true if no error exceeds the tolerance, or if no error is known.
    pub fn holds(&self) -> bool {
        self.inner.holds(self.settings.tolerance)
    }

    /// Returns warnings and notes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// Returns the report of `flexbody response`.
    pub fn report(&self, format: ReportFormat) -> String {
        let run = report::run(&self.diagnostics);
        ResponseFacts::new(&self.inner, &self.settings, &run).render(format.inner())
    }

    /// Returns the table of `flexbody response --csv`: one line per frequency.
    pub fn csv(&self) -> String {
        response_csv(&self.inner)
    }
}
