//! Command `simulate`.

use super::{LOOKED_AT, STEP_ENDS, findings, number};
use crate::outputs::{Along, Output, Outputs, Values};
use crate::recoveries::SECTION;
use crate::subject::Subject;
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::Orientation;
use flexbody_motion::scene::{Carried, LoadedHistory, Recording, RecoveredMotion, simulate};
use flexbody_report::simulation_csv;
use nalgebra::{Matrix3, Vector3};

const LENGTH: [i32; 3] = [1, 0, 0];
const VELOCITY: [i32; 3] = [1, 0, -1];
const ACCELERATION: [i32; 3] = [1, 0, -2];
const FORCE: [i32; 3] = [1, 1, -2];
const ENERGY: [i32; 3] = [2, 1, -2];
const RATE: [i32; 3] = [0, 0, -1];

/// Scales for differences of a motion. A difference of the deflection by a part of the largest one is, at the
/// highest natural frequency of the body, a difference of the accelerations.
struct Sizes {
    extent: f64,
    deflection: f64,
    highest: f64,
    mass: f64,
}

impl Sizes {
    /// Deflections below this part of the extent do not count, like in verdicts.
    const LEAST: f64 = 1e-5;

    fn new(body: &FlexBody, recording: &Recording) -> Self {
        let positions = &body.nodes().positions;
        let far = |x: &[f64; 3]| (Vector3::from(*x) - Vector3::from(positions[0])).norm();
        let extent = positions.iter().map(far).fold(0.0, f64::max);
        let deflections = recording.paths.iter().flat_map(|path| &path.deflection);
        let largest = recording.extremes.deflection.value * body.extent();
        let deflection = deflections.map(|x| x.norm()).fold(largest, f64::max);
        Self {
            extent,
            deflection: deflection.max(Self::LEAST * extent),
            highest: body.modes().eigenvalue.iter().fold(0.0f64, |a, b| a.max(*b)).sqrt(),
            mass: body.invariants().mass(),
        }
    }

    /// Returns the inertia force of the deflections.
    fn force(&self) -> f64 {
        self.mass * self.deflection * self.highest * self.highest
    }
}

/// Runs `simulate` and returns all recorded outputs.
pub fn simulation(subject: &Subject) -> Result<Outputs> {
    let body = subject.body()?;
    let (recording, found) = simulate(&body, &subject.scenes()?[0], &Context::QUIET)?;
    let sizes = Sizes::new(&body, &recording);
    let mut outputs = Outputs { times: recording.time.clone(), all: Vec::new() };
    places(&recording, &sizes, &mut outputs);
    states(&recording, &sizes, &mut outputs);
    largest(&recording, &sizes, &mut outputs);
    if subject.by_table {
        outputs_of_rows(&of_table(&body, subject, &recording)?, &sizes, &mut outputs)
    } else {
        recording.recovered.iter().for_each(|rows| outputs_of_rows(rows, &sizes, &mut outputs))
    }
    outputs.all.extend(findings(&found));
    Ok(outputs)
}

/// Returns the rows of the recoveries as `recover` computes them from the table of the motion.
fn of_table(body: &FlexBody, subject: &Subject, recording: &Recording) -> Result<RecoveredMotion> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.csv");
    std::fs::write(&path, simulation_csv(recording)).expect("a table");
    let mut history = LoadedHistory::read(&path, body)?;
    history.carrier = subject.scene.carried.as_ref().map(Carried::carrier);
    history.recover(body, &[])
}

fn vectors(name: String, along: Along, unit: [i32; 3], rates: Vec<Vector3<f64>>, least: f64) -> Output {
    let values = Values::Vectors { along, axial: false, rates };
    Output { name, unit, values, derivative: None, least, by_instant: true, slack: 1.0 }
}

/// Marks vectors as axial: they change sign under reflection.
fn axial(output: Output) -> Output {
    match output.values {
        Values::Vectors { along, rates, .. } => {
            Output { values: Values::Vectors { along, axial: true, rates }, ..output }
        }
        _ => output,
    }
}

/// Returns a largest value of the motion.
fn peak(name: &str, unit: [i32; 3], value: f64, least: f64) -> Output {
    Output { slack: LOOKED_AT, ..number(name, unit, value, least) }
}

/// Adds the paths of the watched points.
fn places(recording: &Recording, sizes: &Sizes, outputs: &mut Outputs) {
    for (i, path) in recording.paths.iter().enumerate() {
        let name = |what: &str| format!("{what} of point {i}");
        let [d, highest] = [sizes.deflection, sizes.highest];
        let world = [
            ("place", LENGTH, &path.place, sizes.extent),
            ("velocity", VELOCITY, &path.velocity, d * highest),
            ("acceleration", ACCELERATION, &path.acceleration, d * highest * highest),
        ];
        for (derivative, (what, unit, values, least)) in world.into_iter().enumerate() {
            let output = vectors(name(what), Along::World, unit, values.clone(), least);
            outputs.all.push(Output { derivative: Some(derivative as u8), ..output });
        }
        outputs.all.push(vectors(name("deflection"), Along::Model, LENGTH, path.deflection.clone(), d));
    }
}

/// Adds the motion of the frame, energy and reactions.
fn states(recording: &Recording, sizes: &Sizes, outputs: &mut Outputs) {
    let states = &recording.states;
    let origins = states.iter().map(|state| state.origin).collect();
    let origin = vectors("origin".to_owned(), Along::World, LENGTH, origins, sizes.extent);
    outputs.all.push(Output { derivative: Some(0), ..origin });
    let axes: Vec<Matrix3<f64>> = states.iter().map(|state| state.attitude.axes()).collect();
    outputs.all.push(Output {
        values: Values::Attitudes(axes),
        ..vectors("attitude".to_owned(), Along::World, [0; 3], Vec::new(), 1.0)
    });
    let turning = sizes.deflection / sizes.extent * sizes.highest;
    let omega = states.iter().map(|state| state.omega).collect();
    outputs.all.push(axial(vectors("angular velocity".to_owned(), Along::Model, RATE, omega, turning)));
    let energies = recording.balances.iter().map(|balance| balance.elastic).collect();
    let least = sizes.mass * (sizes.deflection * sizes.highest).powi(2);
    let energy = Output {
        values: Values::Numbers(energies),
        ..vectors("elastic energy".to_owned(), Along::World, ENERGY, Vec::new(), least)
    };
    outputs.all.push(energy);
    if let Some(reactions) = &recording.reactions {
        let (force, torque): (Vec<_>, Vec<_>) = reactions.iter().copied().unzip();
        outputs.all.push(vectors("reaction force".to_owned(), Along::Model, FORCE, force, sizes.force()));
        let torque =
            vectors("reaction torque".to_owned(), Along::Model, ENERGY, torque, sizes.force() * sizes.extent);
        outputs.all.push(axial(torque));
    }
}

/// Adds the largest values of the whole motion.
fn largest(recording: &Recording, sizes: &Sizes, outputs: &mut Outputs) {
    let extremes = &recording.extremes;
    let energy = sizes.mass * (sizes.deflection * sizes.highest).powi(2);
    let turning = sizes.deflection / sizes.extent * sizes.highest;
    outputs.all.extend([
        peak(
            "largest deflection of the body",
            [0; 3],
            extremes.deflection.value,
            sizes.deflection / sizes.extent,
        ),
        peak("largest elastic energy", ENERGY, extremes.elastic, energy),
        Output { slack: STEP_ENDS, ..peak("largest spin", RATE, extremes.spin, turning) },
        peak("largest reaction force", FORCE, extremes.reaction.0, sizes.force()),
        peak("largest reaction torque", ENERGY, extremes.reaction.1, sizes.force() * sizes.extent),
    ]);
    for (i, largest) in extremes.watched.iter().enumerate() {
        outputs.all.push(peak(
            &format!("largest deflection of point {i}"),
            LENGTH,
            largest.value,
            sizes.deflection,
        ));
    }
}

/// Adds the rows of the recoveries, and the largest gauge.
fn outputs_of_rows(recovered: &RecoveredMotion, sizes: &Sizes, outputs: &mut Outputs) {
    for (map, extremes) in recovered.recoveries.iter().zip(&recovered.extremes) {
        let rows: Vec<Vec<f64>> = recovered.states.iter().map(|z| map.values(z)).collect();
        match map.name.as_str() {
            SECTION => section(&rows, sizes, outputs),
            name => {
                let strain = sizes.deflection / sizes.extent;
                for gauge in 0..map.rows.len() {
                    let values = Values::Numbers(rows.iter().map(|y| y[gauge]).collect());
                    let named = format!("{name}, {}", map.rows[gauge].name);
                    let output = vectors(named, Along::Model, [0; 3], Vec::new(), strain);
                    outputs.all.push(Output { values, ..output });
                }
                // All gauges are strains: one quantity and unit.
                let largest = extremes.rows.first().map_or(0.0, |row| row.value.abs());
                outputs.all.push(peak(&format!("largest of {name}"), [0; 3], largest, strain));
            }
        }
    }
}

/// Adds force and moment in a section; in the plane they are two forces and the moment about z.
fn section(rows: &[Vec<f64>], sizes: &Sizes, outputs: &mut Outputs) {
    let vector = |of: &dyn Fn(&[f64]) -> Vector3<f64>| rows.iter().map(|y| of(y)).collect();
    let force = vector(&|y| match y.len() {
        6 => Vector3::new(y[0], y[1], y[2]),
        _ => Vector3::new(y[0], y[1], 0.0),
    });
    let moment = vector(&|y| match y.len() {
        6 => Vector3::new(y[3], y[4], y[5]),
        _ => Vector3::new(0.0, 0.0, y[2]),
    });
    let least = sizes.force();
    outputs.all.push(vectors("section force".to_owned(), Along::Model, FORCE, force, least));
    let moment = vectors("section moment".to_owned(), Along::Model, ENERGY, moment, least * sizes.extent);
    outputs.all.push(axial(moment));
}
