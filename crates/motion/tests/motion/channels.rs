//! Channels of FE steps: the superposition of their results is the recovery.

use crate::recovery::arm_model;
use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_body::convert::recovery_shapes;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_linalg::context::Context;
use flexbody_model::{CheckedModel, FeModel, ModelLoad, NodeSet, RawModel, RecoveryOperator, ShapeSteps};
use flexbody_motion::scene::{AmplitudeHistory, LoadHistory, LoadedHistory};
use nalgebra::Vector3;
use oracle::flexible::body_of;
use std::path::PathBuf;

const MODES: usize = 6;

/// Returns the arm with two interfaces, values at rest, a named load and a preload.
fn model() -> RawModel {
    let mut raw = arm_model();
    let column = |first: i64| (0..6).map(|row| first + 7 * row).collect();
    raw.data.interfaces = vec![NodeSet::new("root", column(1)), NodeSet::new("free tip", column(7))];
    for recovery in &mut raw.data.recoveries {
        if let RecoveryOperator::Rows { labels, offset, .. } = &mut recovery.operator {
            *offset = Some((0..labels.len()).map(|row| 0.01 * (row as f64).sin()).collect());
        }
    }
    raw.data.named_loads = named_loads(&raw);
    raw
}

/// Returns a load with a resultant, and a preload: two opposite forces along the line between two nodes.
fn named_loads(raw: &RawModel) -> Vec<ModelLoad> {
    let rows = 3 * raw.nodes.len();
    let named = |name: &str, preload: bool, forces: Vec<f64>| ModelLoad {
        name: name.to_owned(),
        forces,
        preload,
        path: PathBuf::new(),
    };
    let [a, b] = [raw.nodes.positions[2], raw.nodes.positions[9]].map(Vector3::from);
    let mut pair = vec![0.0; rows];
    for k in 0..3 {
        pair[3 * 2 + k] = 0.02 * (b - a)[k];
        pair[3 * 9 + k] = -0.02 * (b - a)[k];
    }
    let wave = (0..rows).map(|row| 1e-3 * (0.7 * row as f64).sin()).collect();
    vec![named("wind", false, wave), named("bolts", true, pair)]
}

/// Returns a motion with all coordinates, spin about all axes, and loads at both interfaces and of the named load.
fn history() -> LoadedHistory {
    let count = 12;
    let wave = |seed: f64| move |i: usize| (1.3 * seed + 0.7 * i as f64 * (1.0 + 0.1 * seed)).sin();
    let vector = |seed: f64, i: usize| Vector3::from_fn(|k, _| wave(seed + 0.37 * k as f64)(i));
    let load = |name: &str, seed: f64| LoadHistory {
        interface: name.to_owned(),
        values: (0..count).map(|i| [0.02 * vector(seed, i), 0.003 * vector(seed + 9.0, i)]).collect(),
    };
    LoadedHistory {
        path: PathBuf::from("run.csv"),
        time: (0..count).map(|i| 0.1 * i as f64).collect(),
        q: (0..count).map(|i| (0..MODES).map(|j| 1e-3 * wave(j as f64)(i)).collect()).collect(),
        carrier: None,
        is_of_carried: false,
        is_in_mean_axes: false,
        rate: None,
        acceleration: None,
        angular_acceleration: None,
        angular_velocity: Some((0..count).map(|i| 0.4 * vector(3.1, i)).collect()),
        loads: vec![load("root", 4.0), load("free tip", 6.0)],
        named: vec![AmplitudeHistory {
            load: "wind".to_owned(),
            values: (0..count).map(wave(8.0)).collect(),
        }],
    }
}

/// Returns the steps of a body, and the answers of an FE program with the operator of the model (rows x steps).
fn steps(body: &FlexBody, model: &FeModel) -> (ShapeSteps, Mat<f64>) {
    let shapes = recovery_shapes(body, model, false, &Context::QUIET).expect("shapes");
    let RecoveryOperator::Rows { transposed, .. } = &model.recoveries()[0].operator else {
        panic!("an operator")
    };
    let answers = Mat::from_fn(transposed.n_cols(), shapes.factors.len(), |row, step| {
        let (places, values) = transposed.column(row);
        places.iter().zip(values).map(|(&at, value)| value * shapes.fields[(at as usize, step)]).sum()
    });
    let nodes = model.nodes().ids.clone();
    let displacement = |step: usize, node: usize| [0, 1, 2].map(|k| shapes.fields[(3 * node + k, step)]);
    let steps = ShapeSteps {
        columns: shapes.columns.iter().map(ToString::to_string).collect(),
        displacements: (0..shapes.factors.len())
            .map(|step| (0..nodes.len()).map(|node| displacement(step, node)).collect())
            .collect(),
        factors: shapes.factors,
        modes_follow_spin: body.groups().w1,
        nodes,
    };
    (steps, answers)
}

fn checked(raw: RawModel) -> FeModel {
    let CheckedModel { model, .. } = FeModel::from_raw(raw).expect("a model");
    model
}

/// Results of the FE program, superposed by the channels, are the rows of the recovery, in any frame of the body.
#[test]
fn superposed_results_are_the_rows_of_the_recovery() {
    let model = checked(model());
    let history = history();
    for frame in [BodyFrame::Com, BodyFrame::Model, BodyFrame::Principal] {
        let body = body_of(self::model(), MODES, frame);
        let (steps, answers) = steps(&body, &model);
        assert!(steps.factors.iter().any(|factor| (factor - 1.0).abs() > 0.1), "shapes are scaled");
        assert_eq!(steps.columns.len(), MODES + 6 + 12 + 2);
        let channels = history.channels(&body, &steps).expect("channels");
        assert_eq!(channels.names.last().map(String::as_str), Some("constant"));
        let recovered = history.recover(&body, &[]).expect("rows");
        let map = &recovered.recoveries[0];
        let offset = &body.recoveries()[0].offset;
        let (mut worst, mut largest) = (0.0f64, 0.0f64);
        for (i, z) in recovered.states.iter().enumerate() {
            for (row, expected) in map.values(z).into_iter().enumerate() {
                let terms = channels.values[i].iter().enumerate().map(|(step, factor)| {
                    factor * if step < steps.columns.len() { answers[(row, step)] } else { offset[row] }
                });
                let terms: Vec<f64> = terms.collect();
                let size: f64 = terms.iter().map(|term| term.abs()).sum();
                worst = worst.max((terms.iter().sum::<f64>() - expected).abs() / size);
                largest = largest.max(expected.abs());
            }
        }
        println!("{frame:?}: {worst:.1e}");
        assert!(worst < 1e-12 && largest > 1e-3, "{frame:?}: {worst:e} {largest:e}");
    }
}

#[test]
fn steps_of_another_body_are_refused() {
    let model = checked(model());
    let body = body_of(self::model(), MODES, BodyFrame::Com);
    let (known, _) = steps(&body, &model);
    let history = history();
    let refused = |change: &dyn Fn(&mut ShapeSteps), part: &str| {
        let mut other = known.clone();
        change(&mut other);
        let error = history.channels(&body, &other).expect_err(part);
        assert_eq!(error.first_error().code(), Code::RecoveryShapes, "{error}");
        assert!(error.to_string().contains(part), "{error}");
    };
    refused(&|steps| steps.displacements.swap(1, 2), "step 2 is not mode 2 of the body");
    refused(&|steps| steps.factors[3] *= 1.01, "step 4 is not mode 4 of the body");
    refused(&|steps| steps.nodes[0] += 1000, "nodes of the steps");
    refused(&|steps| steps.columns[0] = "mode 7".to_owned(), "no step is mode 1");
    refused(&|steps| steps.columns[8] = "elsewhere Fx".to_owned(), "no mode and no load");
    refused(&|steps| steps.modes_follow_spin = false, "with other terms");
    refused(&|steps| steps.factors.truncate(3), "do not fit each other");
    let fewer = body_of(self::model(), MODES - 1, BodyFrame::Com);
    let error = history.channels(&fewer, &known).expect_err("fewer modes");
    assert!(error.to_string().contains("the steps have 6 modes, the body has 5"), "{error}");
    // A step that is moved by a rigid motion has the same stresses.
    let mut moved = known.clone();
    moved.displacements[2].iter_mut().for_each(|u| u[1] += 0.5);
    assert!(history.channels(&body, &moved).is_ok());
    let still = LoadedHistory { angular_velocity: None, ..history.clone() };
    assert_eq!(still.channels(&body, &known).expect_err("no spin").first_error().code(), Code::SeriesColumn);
}
