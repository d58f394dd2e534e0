//! Body in the frames of a frequency response, with its loads and outputs, and its response as a sum over the modes.

use super::band::Resonance;
use super::ends::{BaseMotion, ChosenRows, Excitation, ResponseEnds, chosen_rows};
use super::modal_sum::ModalSum;
use super::place::{Direction, Place, PlaceRows};
use super::settings::ResponseSettings;
use faer::Mat;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{Carrier, FlexBody};
use flexbody_linalg::side_by_side;
use flexbody_motion::scene::{Point, Requirements};
use nalgebra::{Matrix6, Vector3};
use std::borrow::Cow;

/// Body with the damping of the settings: in mean axes, which uncouple rigid motion from the modes, and about the centre of
/// mass, to which places refer.
pub(super) struct FramedBody {
    pub damped: FlexBody,
    pub at_centre: FlexBody,
    /// Eigenvalues of the body held at its moving interface; none without one. Unit: 1/time^2.
    held: Vec<f64>,
    /// beta of damping in proportion to the stiffness, which the static columns of recoveries have too; 0 for other
    /// damping. Unit: time.
    pub lag: f64,
    /// Warning about modes that leave out much of the deformation which the acceleration of the base causes.
    pub unresolved: Option<Diagnostic>,
}

impl FramedBody {
    pub(super) fn new(body: &FlexBody, settings: &ResponseSettings, excitation: &Excitation) -> Result<Self> {
        let mean = body.in_mean_axes()?;
        let (mut held_eigenvalues, mut unresolved) = (Vec::new(), None);
        let (damped, lag) = match excitation {
            // Damping ratios are those of the modes of the body as it is held.
            Excitation::Base(Place { point: Point::Interface(name), .. }) => {
                let carrier = Carrier::Interface(name.clone());
                let held = mean.carried(&carrier)?;
                unresolved = held.unresolved(&carrier, &mean);
                held_eigenvalues = held.eigenvalues_in_frame().unwrap_or_default();
                let damped = damped(&held, settings)?;
                let lag = damped.stiffness_damping();
                if damped.damping() == mean.damping() {
                    (mean.into_owned(), lag)
                } else {
                    (mean.with_damping_of(&damped)?, lag)
                }
            }
            _ => {
                let damped = damped(&mean, settings)?.into_owned();
                let lag = damped.stiffness_damping();
                (damped, lag)
            }
        };
        let centre = damped.invariants().first_moment() / damped.invariants().mass();
        let at_centre = damped.in_model_axes(centre)?;
        Ok(Self { damped, at_centre, held: held_eigenvalues, lag, unresolved })
    }

    /// Returns the modal damping; `None` without damping.
    pub(super) fn damping(&self) -> Option<Mat<f64>> {
        Some(self.damped.damping()).filter(|c| c.norm_max() > 0.0)
    }

    /// Returns the resonances of a sum, and those of the body held at its moving interface.
    pub(super) fn resonances(&self, sum: &ModalSum) -> Vec<Resonance> {
        let units = self.damped.units();
        let mut all: Vec<Resonance> = sum.resonances().map(|found| in_hertz(units, found)).collect();
        let ratio = all.iter().map(|one| one.ratio).fold(f64::INFINITY, f64::min);
        all.extend(self.held.iter().map(|&square| in_hertz(units, (square, ratio))));
        all
    }
}

/// Loads and outputs of a body.
pub(super) struct Read<'b> {
    /// Places of the loads.
    pub from: Vec<Place>,
    /// Places of displacements, the moving interface last.
    pub to: Vec<Place>,
    pub rows: Vec<ChosenRows<'b>>,
    pub base: Option<BaseMotion>,
}

impl<'b> Read<'b> {
    pub(super) fn new(body: &'b FlexBody, ends: &ResponseEnds<'_>) -> Result<Self> {
        let dimension = body.dimension();
        let displacements = ends.to.iter().map(|place| place.directions_of(dimension).len()).sum();
        let base = BaseMotion::new(ends.from, displacements, dimension)?;
        let from = ends.from.loaded(dimension);
        let own = base.as_ref().map_or(&[][..], |_| &from);
        Ok(Self { to: [ends.to, own].concat(), rows: chosen_rows(body, ends.rows)?, base, from })
    }

    /// Returns the names of the displacements and rotations that are read.
    pub(super) fn displacements(&self, dimension: usize) -> Vec<String> {
        let count = self.to.len() - usize::from(self.base.is_some());
        let named = numbered(&self.to[..count], dimension);
        let of_place = |(place, directions): (&Place, Vec<(usize, Direction)>)| {
            let name = |(_, direction): (usize, Direction)| format!("{place} {}", direction.name());
            directions.into_iter().map(name).collect::<Vec<_>>()
        };
        named.flat_map(of_place).collect()
    }

    /// Returns, for every output, true if it moves with the body: false for rows of recoveries.
    pub(super) fn moving(&self, dimension: usize) -> Vec<bool> {
        let places = self.to.iter().map(|place| place.directions_of(dimension).len()).sum();
        let rows = self.rows.iter().map(|row| row.rows.len()).sum();
        [vec![true; places], vec![false; rows]].concat()
    }
}

/// Returns the body with the damping ratios of the settings, if they state any.
fn damped<'b>(body: &'b FlexBody, settings: &ResponseSettings) -> Result<Cow<'b, FlexBody>> {
    let ResponseSettings { damping, replaces_damping, .. } = settings;
    let stated = Requirements {
        damping: damping.clone(),
        replaces_damping: *replaces_damping,
        ..Requirements::default()
    };
    stated.damped(body, "--damping or the scene")
}

fn in_hertz(units: &UnitSystem, (square, ratio): (f64, f64)) -> Resonance {
    Resonance { hertz: units.frequency_of(square), ratio }
}

/// Returns the response of a body in a frame along the axes of the model about its centre of mass: rigid motion of the
/// undeformed body plus the modes, to which rigid motion does not couple at rest; rows of recoveries with their static
/// columns.
///
/// # Errors
/// [`PlaceUnknown`](Code::PlaceUnknown) for a place or direction that the body does not have.
pub(super) fn reduced_sum(
    body: &FlexBody,
    read: &Read<'_>,
    damping: Option<Mat<f64>>,
    lag: f64,
) -> Result<ModalSum> {
    let rows = |places: &[Place]| places.iter().map(|place| place.rows(body)).collect::<Result<Vec<_>>>();
    let joined = |rows: &[PlaceRows], part: fn(&PlaceRows) -> &Mat<f64>, count: usize| match rows {
        [] => Mat::zeros(count, 0),
        rows => side_by_side(&rows.iter().map(|place| part(place).as_ref()).collect::<Vec<_>>()),
    };
    let nf = body.n_modes();
    let (from, to) = (rows(&read.from)?, rows(&read.to)?);
    let (forces, motions) = (joined(&from, |place| &place.rigid, 6), joined(&to, |place| &place.rigid, 6));
    let compliance = rigid_compliance(body);
    let of_recoveries: Vec<Mat<f64>> = read.rows.iter().map(ChosenRows::modal).collect();
    let count = motions.ncols() + of_recoveries.iter().map(Mat::ncols).sum::<usize>();
    let rigid = Mat::from_fn(count, forces.ncols(), |o, i| {
        let row = |k: usize| (0..6).map(|l| compliance[(k, l)] * forces[(l, i)]).sum::<f64>();
        if o < motions.ncols() { (0..6).map(|k| motions[(k, o)] * row(k)).sum() } else { 0.0 }
    });
    let mut direct = Mat::zeros(count, forces.ncols());
    let mut first = motions.ncols();
    for row in &read.rows {
        let own = row.direct(&read.from, body);
        direct.as_mut().subrows_mut(first, own.nrows()).copy_from(&own);
        first += own.nrows();
    }
    let places = joined(&to, |place| &place.modal, nf);
    let outputs: Vec<_> = std::iter::once(&places).chain(&of_recoveries).map(Mat::as_ref).collect();
    let outputs_of_rates = of_rates(&read.rows, nf, places.ncols());
    Ok(ModalSum {
        stiffness: body.modes().eigenvalue.clone(),
        mass: vec![1.0; body.n_modes()],
        damping,
        inputs: joined(&from, |place| &place.modal, nf),
        outputs: side_by_side(&outputs),
        outputs_of_rates,
        rigid,
        direct: Some(direct),
        lag,
    })
}

/// Returns the outputs of the first and second time derivatives of the modal coordinates (nf x outputs each), which only rows
/// of recoveries have; `None` if none has.
///
/// * `before`: number of outputs before the rows.
fn of_rates(rows: &[ChosenRows<'_>], nf: usize, before: usize) -> Option<[Mat<f64>; 2]> {
    let own: Vec<_> = rows.iter().map(|row| (row.rows.len(), row.of_rates())).collect();
    own.iter().any(|(_, rates)| rates.is_some()).then(|| {
        std::array::from_fn(|order| {
            let none = |count: usize| Mat::zeros(nf, count);
            let of_rows = own.iter().map(|(count, rates)| match rates {
                Some(rates) => rates[order].clone(),
                None => none(*count),
            });
            let parts: Vec<Mat<f64>> = std::iter::once(none(before)).chain(of_rows).collect();
            side_by_side(&parts.iter().map(Mat::as_ref).collect::<Vec<_>>())
        })
    })
}

/// Returns the accelerations of the undeformed body for unit forces and torques about its centre of mass; for a plane
/// body, those in the plane.
fn rigid_compliance(body: &FlexBody) -> Matrix6<f64> {
    let (mass, inertia) = (body.invariants().mass(), body.invariants().inertia());
    let mut compliance = Matrix6::zeros();
    if body.dimension() == 2 {
        compliance.set_diagonal(&nalgebra::Vector6::new(1.0, 1.0, 0.0, 0.0, 0.0, 0.0).unscale(mass));
        compliance[(5, 5)] = 1.0 / inertia[(2, 2)];
        return compliance;
    }
    compliance.fixed_view_mut::<3, 3>(0, 0).set_diagonal(&Vector3::repeat(1.0 / mass));
    if let Some(inverse) = inertia.try_inverse() {
        compliance.fixed_view_mut::<3, 3>(3, 3).copy_from(&inverse);
    }
    compliance
}

/// Returns every place with its directions, which are numbered over all places.
pub(super) fn numbered(
    places: &[Place],
    dimension: usize,
) -> impl Iterator<Item = (&Place, Vec<(usize, Direction)>)> {
    let mut next = 0;
    places.iter().map(move |place| {
        let directions = place.directions_of(dimension).into_iter();
        let numbered = directions.map(|direction| {
            next += 1;
            (next - 1, direction)
        });
        (place, numbered.collect())
    })
}
