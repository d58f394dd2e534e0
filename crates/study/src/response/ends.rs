//! Ends of transfer functions: the excitation of a body, and the displacements and recovery rows that are read off it.

use super::place::{Direction, Place};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::convert::recovery_loads;
use flexbody_body::flex_body::{FlexBody, LOAD_COMPONENTS, MotionLoad, Recovery};
use flexbody_linalg::side_by_side;
use flexbody_model::{FeModel, RecoveryRow};
use flexbody_motion::scene::Point;
use nalgebra::{Complex, DMatrix};
use std::path::Path;

/// Largest number of rows of recoveries whose transfer functions are computed. More rows make large tables.
const MOST_ROWS: usize = 2000;

/// Excitation of a body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Excitation {
    /// Unit forces and torques at places.
    Forces(Vec<Place>),
    /// Unit accelerations of an interface that moves as prescribed: along its directions, with all other directions at
    /// rest. All displacements without directions.
    Base(Place),
}

impl Excitation {
    /// Returns the places with the directions of the excitation.
    pub fn places(&self) -> &[Place] {
        match self {
            Self::Forces(places) => places,
            Self::Base(place) => std::slice::from_ref(place),
        }
    }

    /// Returns the places of the forces whose responses are computed: a moving interface takes forces and torques along
    /// all directions.
    pub(super) fn loaded(&self, dimension: usize) -> Vec<Place> {
        match self {
            Self::Forces(places) => places.clone(),
            Self::Base(place) => vec![Place { directions: of_interface(dimension), ..place.clone() }],
        }
    }
}

/// Returns all directions in which an interface moves.
fn of_interface(dimension: usize) -> Vec<Direction> {
    match dimension {
        2 => vec![Direction::X, Direction::Y, Direction::Rz],
        _ => Direction::ALL.to_vec(),
    }
}

/// Place of displacements, or a recovery whose rows are read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    /// Displacements and rotations of a place.
    Place(Place),
    /// Rows of the recovery with this name.
    Recovery(String),
}

impl std::fmt::Display for Target {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Place(place) => write!(f, "{place}"),
            Self::Recovery(name) => write!(f, "recovery {name}"),
        }
    }
}

/// Quantity that is read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Output {
    /// Displacement or rotation along a direction.
    Direction(Direction),
    /// Row of a recovery.
    Row(RecoveryRow),
}

impl Output {
    /// Returns the name: a direction, or the name of a row.
    pub fn name(&self) -> &str {
        match self {
            Self::Direction(direction) => direction.name(),
            Self::Row(row) => &row.name,
        }
    }
}

/// Ends of the transfer functions of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseEnds<'e> {
    /// Excitation.
    pub from: &'e Excitation,
    /// Places of displacements.
    pub to: &'e [Place],
    /// Rows of recoveries: `NAME` for all rows of a recovery, `NAME:ROW` for one.
    pub rows: &'e [String],
    /// Table of the spectral densities of a random excitation.
    pub densities: Option<&'e Path>,
}

/// Rows of one recovery of a body that are read.
#[derive(Debug, Clone)]
pub(super) struct ChosenRows<'b> {
    pub recovery: &'b Recovery,
    pub rows: Vec<usize>,
}

/// Returns the rows of recoveries that are stated as `NAME` for all rows of a recovery or `NAME:ROW` for one.
///
/// # Errors
/// [`PlaceUnknown`](Code::PlaceUnknown) for unknown names and for too many rows.
pub(super) fn chosen_rows<'b>(body: &'b FlexBody, stated: &[String]) -> Result<Vec<ChosenRows<'b>>> {
    let mut chosen: Vec<ChosenRows<'b>> = Vec::new();
    for text in stated {
        let (recovery, rows) = found_rows(body, text)?;
        match chosen.iter_mut().find(|one| one.recovery.name == recovery.name) {
            Some(known) => known.rows.extend(rows),
            None => chosen.push(ChosenRows { recovery, rows }),
        }
    }
    for recovery in &mut chosen {
        recovery.rows.sort_unstable();
        recovery.rows.dedup();
    }
    let count: usize = chosen.iter().map(|recovery| recovery.rows.len()).sum();
    if count > MOST_ROWS {
        let message =
            format!("{count} rows of recoveries are asked for, at most {MOST_ROWS} have transfer functions");
        let help = "name rows as NAME:ROW; --psd computes the stresses of all points without them";
        return Err(Diagnostic::new(Code::PlaceUnknown, message).with_help(help).into());
    }
    Ok(chosen)
}

fn found_rows<'b>(body: &'b FlexBody, text: &str) -> Result<(&'b Recovery, Vec<usize>)> {
    let named = |name: &str| body.recoveries().iter().find(|recovery| recovery.name == name);
    if let Some(recovery) = named(text) {
        return Ok((recovery, (0..recovery.rows.len()).collect()));
    }
    let unknown = |message: String, known: Vec<&str>| -> Error {
        let known = if known.is_empty() {
            "there is none".to_owned()
        } else {
            format!("there are {}", known.join(", "))
        };
        Diagnostic::new(Code::PlaceUnknown, message).with_help(known).into()
    };
    let of_recovery = text.split_once(':').and_then(|(name, row)| Some((named(name)?, row)));
    let Some((recovery, row)) = of_recovery else {
        let known = body.recoveries().iter().map(|recovery| recovery.name.as_str()).collect();
        return Err(unknown(format!("the body has no recovery `{text}`"), known));
    };
    let rows: Vec<usize> = (0..recovery.rows.len()).filter(|&at| recovery.rows[at].name == row).collect();
    if rows.is_empty() {
        let known = recovery.rows.iter().take(10).map(|row| row.name.as_str()).collect();
        return Err(unknown(format!("recovery `{}` has no row `{row}`", recovery.name), known));
    }
    Ok((recovery, rows))
}

impl ChosenRows<'_> {
    /// Returns the labels of the rows.
    pub(super) fn labels(&self) -> impl Iterator<Item = &RecoveryRow> {
        self.rows.iter().map(|&row| &self.recovery.rows[row])
    }

    /// Returns the rows in the modes, as outputs (nf x rows).
    pub(super) fn modal(&self) -> Mat<f64> {
        Mat::from_fn(self.recovery.modes.ncols(), self.rows.len(), |j, i| {
            self.recovery.modes[(self.rows[i], j)]
        })
    }

    /// Returns the rows for unit first and second time derivatives of the modal coordinates, as outputs (nf x rows each):
    /// static columns of damping and of inertia; `None` if the recovery has neither.
    pub(super) fn of_rates(&self) -> Option<[Mat<f64>; 2]> {
        let columns = RATE_LOADS.map(|load| self.recovery.of_motion(load));
        let chosen = |columns: Option<&Mat<f64>>| {
            Mat::from_fn(self.recovery.modes.ncols(), self.rows.len(), |j, i| {
                columns.map_or(0.0, |columns| columns[(self.rows[i], j)])
            })
        };
        columns.iter().any(Option::is_some).then(|| columns.map(chosen))
    }

    /// Returns the static rows outside the modes for unit loads of `places` on `body` (rows x inputs); zero for loads at
    /// nodes.
    pub(super) fn direct(&self, places: &[Place], body: &FlexBody) -> Mat<f64> {
        let all = static_columns(self.recovery, places, body);
        Mat::from_fn(self.rows.len(), all.ncols(), |i, c| all[(self.rows[i], c)])
    }

    /// Returns the nodal forces R' of the rows (N x rows).
    ///
    /// # Errors
    /// [`PlaceUnknown`](Code::PlaceUnknown) for a recovery that is known for some shapes only.
    pub(super) fn loads(&self, model: &FeModel) -> Result<Mat<f64>> {
        let name = &self.recovery.name;
        let asked = model.recoveries().iter().find(|recovery| recovery.name == *name);
        asked.and_then(|asked| recovery_loads(model, asked, &self.rows)).ok_or_else(|| {
            let message =
                format!("the rows of recovery `{name}` are not known for the displacements of all nodes");
            let help = "give the flex-body file alone: its response is computed without an error";
            Diagnostic::new(Code::PlaceUnknown, message).with_help(help).into()
        })
    }
}

/// Forces of motion whose amplitudes are the first and the second time derivatives of the modal coordinates. Others are
/// of second order in the motion, and vanish in a linear response about rest.
pub(super) const RATE_LOADS: [MotionLoad; 2] = [MotionLoad::Damping, MotionLoad::Acceleration];

/// Returns all rows of a recovery of `body` under unit loads of `places`, outside the modes (rows x inputs).
pub(super) fn static_columns(recovery: &Recovery, places: &[Place], body: &FlexBody) -> Mat<f64> {
    let of_place = |place: &Place| {
        if let Some(column) = place.named_column(body) {
            return Mat::from_fn(recovery.rows.len(), 1, |i, _| recovery.named[(i, column)]);
        }
        let columns =
            recovery.loads.iter().find(|load| place.point == Point::Interface(load.interface.clone()));
        let directions = place.directions_of(body.dimension());
        Mat::from_fn(recovery.rows.len(), directions.len(), |i, at| {
            let component = directions[at] as usize;
            debug_assert!(component < LOAD_COMPONENTS);
            columns.map_or(0.0, |load| load.columns[(i, component)])
        })
    };
    side_by_side(&places.iter().map(of_place).collect::<Vec<_>>().iter().map(Mat::as_ref).collect::<Vec<_>>())
}

/// Change from forces at an interface to its accelerations: with the response H_a of its motion, forces f accelerate it
/// by a = -w^2 H_a f, so that H (-w^2 H_a)^-1 is the response to accelerations.
#[derive(Debug, Clone)]
pub(super) struct BaseMotion {
    /// Directions of the prescribed acceleration among all of the interface.
    columns: Vec<usize>,
    /// Number of all directions.
    all: usize,
    /// First row of the motion of the interface in a response.
    first: usize,
}

impl BaseMotion {
    /// Creates the change for an excitation; `None` for forces. `first` is the first row of the motion of the interface in
    /// a response.
    ///
    /// # Errors
    /// [`PlaceUnknown`](Code::PlaceUnknown) for a base that is no interface.
    pub(super) fn new(excitation: &Excitation, first: usize, dimension: usize) -> Result<Option<Self>> {
        let Excitation::Base(place) = excitation else { return Ok(None) };
        if let Point::Node(number) = place.point {
            let message = format!("node {number} cannot carry the body: a base is an interface");
            return Err(Diagnostic::new(Code::PlaceUnknown, message).into());
        }
        let all = of_interface(dimension);
        let column = |direction: Direction| {
            all.iter().position(|known| *known == direction).ok_or_else(|| {
                let message =
                    format!("{place} has no direction {}: the body lies in a plane", direction.name());
                Error::from(Diagnostic::new(Code::PlaceUnknown, message))
            })
        };
        let columns = place.directions_of(dimension).into_iter().map(column).collect::<Result<Vec<_>>>()?;
        Ok(Some(Self { columns, all: all.len(), first }))
    }

    /// Returns the forces at the interface (all x inputs) for unit accelerations at the circular frequency `omega`.
    ///
    /// * `own`: displacements and rotations of the interface for unit forces and torques.
    fn forces(&self, omega: f64, own: DMatrix<Complex<f64>>) -> DMatrix<Complex<f64>> {
        let unit = DMatrix::from_fn(self.all, self.columns.len(), |i, c| {
            Complex::new(f64::from(u8::from(i == self.columns[c])), 0.0)
        });
        let accelerations = own * Complex::new(-omega * omega, 0.0);
        let unknown =
            || DMatrix::from_element(self.all, self.columns.len(), Complex::new(f64::NAN, f64::NAN));
        accelerations.lu().solve(&unit).unwrap_or_else(unknown)
    }

    /// Returns the forces at the interface for unit accelerations, from the response to forces.
    pub(super) fn forces_of(&self, omega: f64, response: &DMatrix<Complex<f64>>) -> DMatrix<Complex<f64>> {
        self.forces(omega, response.rows(self.first, self.all).into_owned())
    }

    /// Returns the response to accelerations from that to forces, which contains the motion of the interface.
    pub(super) fn applied(&self, omega: f64, response: &DMatrix<Complex<f64>>) -> DMatrix<Complex<f64>> {
        response * self.forces_of(omega, response)
    }
}
