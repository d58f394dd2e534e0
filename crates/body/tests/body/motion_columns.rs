//! Static columns of the forces of motion, against static solutions of all nodes under the forces that the deformed body
//! exerts: M, D and cross products with the displacements of the nodes.

use crate::recovery::{Statics, body, bracket, error, mesh, rows_of};
use faer::Mat;
use flexbody_body::basis::{BasisChoice, CraigBampton, FreeSurface, Loads};
use flexbody_body::flex_body::{
    Carrier, FlexBody, LoadKind, ModalMotion, MotionLoad, Recovery, RecoveryState, TermDecision, TermGroup,
    TermGroups,
};
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_linalg::CscMatrix;
use flexbody_model::{Coupling, Damping, RawMatrix, RawModel, RecoveryOperator};
use nalgebra::{Matrix3, Vector3};
use oracle::random::Random;
use oracle::reference::dense;

/// Returns the bracket with dashpots between pairs of nodes, and with recoveries that have columns of the inertia of the deformation.
fn damped_bracket(coupling: Coupling) -> RawModel {
    let mut raw = bracket(&mesh(), coupling);
    raw.data.recoveries.iter_mut().for_each(|recovery| recovery.deformed_inertia = true);
    let n = raw.nodes.len();
    let mut random = Random(17);
    let mut entries = Vec::new();
    for pair in random.permutation(n).windows(2) {
        // A dashpot along the line between two nodes leaves rigid motion undamped.
        let [a, b] = [pair[0], pair[1]].map(|node| Vector3::from(raw.nodes.positions[node]));
        let (line, d) = ((b - a).normalize(), 40.0 * (1.1 + random.signed()));
        for (k, l) in (0..3).flat_map(|k| (0..3).map(move |l| (k, l))) {
            let rate = d * line[k] * line[l];
            let row = |node: usize, k: usize| (3 * node + k) as u32;
            for (i, j) in [(pair[0], pair[1]), (pair[1], pair[0])] {
                entries.extend([(row(i, k), row(i, l), rate), (row(i, k), row(j, l), -rate)]);
            }
        }
    }
    let matrix = CscMatrix::from_triplets(3 * n, 3 * n, &entries);
    raw.data.damping = Some(Damping::Matrix(RawMatrix { matrix, ..raw.stiffness.clone() }));
    raw
}

fn damping(raw: &RawModel) -> CscMatrix {
    match &raw.data.damping {
        Some(Damping::Matrix(damping)) => damping.matrix.clone(),
        _ => panic!("a damping matrix"),
    }
}

/// Returns the displacements of the nodes in the modes, along the axes of the model (N x nf).
fn vectors(body: &FlexBody) -> Mat<f64> {
    let (shape, axes) = (&body.modes().shape, body.frame().axes);
    Mat::from_fn(shape.nrows(), shape.ncols(), |row, j| {
        let first = row / 3 * 3;
        (0..3).map(|k| axes[(row % 3, k)] * shape[(first + k, j)]).sum::<f64>()
    })
}

/// Returns the nodal forces of one kind on the dense model (N x components nf), with cross products about body axes.
fn forces(body: &FlexBody, m: &Mat<f64>, d: &Mat<f64>, load: MotionLoad) -> Mat<f64> {
    let (psi, axes) = (vectors(body), body.frame().axes);
    let turned = |b: Matrix3<f64>| {
        let b = axes * b * axes.transpose();
        Mat::from_fn(psi.nrows(), psi.ncols(), |row, j| {
            let first = row / 3 * 3;
            (0..3).map(|k| b[(row % 3, k)] * psi[(first + k, j)]).sum::<f64>()
        })
    };
    let s = |k: usize| Vector3::<f64>::ith(k, 1.0).cross_matrix();
    let parts: Vec<Mat<f64>> = match load {
        MotionLoad::Damping => vec![d * &psi],
        MotionLoad::Acceleration => vec![m * &psi],
        MotionLoad::Turning => (0..3).map(|k| m * turned(s(k))).collect(),
        MotionLoad::Centrifugal => LoadKind::SPIN
            .iter()
            .map(|&(k, l)| m * turned(if k == l { s(k) * s(k) } else { s(k) * s(l) + s(l) * s(k) }))
            .collect(),
    };
    let nf = psi.ncols();
    Mat::from_fn(psi.nrows(), parts.len() * nf, |i, c| -parts[c / nf][(i, c % nf)])
}

/// Returns the rows of a recovery under the static response to the forces of one kind (rows x components nf).
fn whole(body: &FlexBody, recovery: &Recovery, load: MotionLoad) -> Mat<f64> {
    body.motion_rows(recovery, load).expect("columns of motion")
}

/// Returns the rows of the static solutions of all nodes (rows x loads): stresses, and T_S'K u of the cut.
fn exact(raw: &RawModel, statics: &Statics, name: &str, loads: &Mat<f64>) -> Mat<f64> {
    let operator =
        &raw.data.recoveries.iter().find(|recovery| recovery.name == name).expect("a recovery").operator;
    let solved: Vec<Vec<f64>> = (0..loads.ncols())
        .map(|c| {
            let u = statics.solve(&loads.as_ref().subcols(c, 1).to_owned());
            match operator {
                RecoveryOperator::Rows { transposed, .. } => rows_of(transposed, &u),
                RecoveryOperator::Cut { nodes, about } => statics.section(&u, nodes, about),
                RecoveryOperator::Shapes { .. } => unreachable!(),
            }
        })
        .collect();
    Mat::from_fn(solved[0].len(), solved.len(), |i, c| solved[c][i])
}

fn numbers(a: &Mat<f64>) -> Vec<f64> {
    (0..a.ncols()).flat_map(|c| a.col(c).iter().copied().collect::<Vec<_>>()).collect()
}

/// Bodies of one model in several bases, frames and units, and after reductions.
fn bodies(raw: &RawModel) -> Vec<(&'static str, FlexBody)> {
    let at = |frame: BodyFrame| FrameChoice::from(frame);
    let free = |modes: usize, frame: FrameChoice| body(raw.clone(), BasisChoice::default(), modes, frame);
    let vectors = FreeSurface { residual_vectors: vec![Loads::Interfaces] };
    let craig = |frame| body(raw.clone(), BasisChoice::CraigBampton(CraigBampton), 2, frame);
    let nine = free(9, at(BodyFrame::Principal));
    let dropped =
        |group| TermDecision { group, kept: false, tier: 2, bound: 0.0, limit: 0.0, reason: String::new() };
    let fewer = nine.reduced(&[0, 2, 3, 6], TermGroups::ALL, Vec::new()).expect("reduced");
    let without = TermGroups::without(TermGroup::W2);
    let without_w2 = nine.reduced(&[1, 4], without, vec![dropped(TermGroup::W2)]).expect("reduced");
    let without = TermGroups::without(TermGroup::W3);
    let without_w3 = nine.reduced(&[1, 4], without, vec![dropped(TermGroup::W3)]).expect("reduced");
    let held = craig(FrameChoice::Interface("second".to_owned()));
    let carried = nine.carried(&Carrier::Interface("first".to_owned())).expect("carried");
    let few_held = held.reduced(&[0, 1, 4, 7], TermGroups::ALL, Vec::new()).expect("reduced");
    let mean = few_held.in_mean_axes().expect("mean axes").into_owned();
    vec![
        ("free modes", free(5, at(BodyFrame::Com))),
        ("model axes", free(3, at(BodyFrame::Model))),
        ("residual vectors", body(raw.clone(), BasisChoice::Free(vectors), 2, BodyFrame::Principal)),
        ("Craig-Bampton", craig(at(BodyFrame::Com))),
        ("frame on an interface", held),
        ("fewer modes of a frame on an interface", few_held),
        ("in mean axes", mean),
        ("carried", carried),
        ("fewer modes", fewer),
        ("without W2", without_w2),
        ("without W3", without_w3),
        ("nine modes", nine),
    ]
}

/// Modes and static columns together have the static response of all nodes to every force of motion, in every basis and
/// frame, and after reductions.
#[test]
fn forces_of_motion_deform_the_body_as_all_nodes() {
    let raw = damped_bracket(Coupling::Averaging);
    let (m, d) = (dense(&raw.mass.matrix), dense(&damping(&raw)));
    let statics = Statics::new(&raw, false);
    for (which, body) in bodies(&raw) {
        for &load in MotionLoad::ALL {
            let loads = forces(&body, &m, &d, load);
            for recovery in body.recoveries() {
                let expected = exact(&raw, &statics, &recovery.name, &loads);
                let own = whole(&body, recovery, load);
                let found = error(&numbers(&own), &numbers(&expected));
                assert!(found < 1e-8, "{which}, {}, {}: {found:e}", recovery.name, load.name());
            }
        }
    }
}

/// Rigid interfaces of a Craig-Bampton basis stay rigid under the forces of motion.
#[test]
fn rigid_interfaces_stay_rigid_under_forces_of_motion() {
    let raw = damped_bracket(Coupling::Rigid);
    let body = body(raw.clone(), BasisChoice::CraigBampton(CraigBampton), 2, BodyFrame::Principal);
    let (m, d) = (dense(&raw.mass.matrix), dense(&damping(&raw)));
    let [rigid, deforming] = [true, false].map(|rigid| Statics::new(&raw, rigid));
    for &load in MotionLoad::ALL {
        let loads = forces(&body, &m, &d, load);
        let own = numbers(&whole(&body, &body.recoveries()[0], load));
        let error = |statics| error(&own, &numbers(&exact(&raw, statics, "stress", &loads)));
        assert!(error(&rigid) < 1e-8, "{}: {:e}", load.name(), error(&rigid));
        assert!(error(&deforming) > 1e-3, "{}: {:e}", load.name(), error(&deforming));
    }
}

/// The modes of a free body hold their own inertia: M psi_j deforms the body as psi_j does. Those of a reduced
/// Craig-Bampton body do not.
#[test]
fn eigenmodes_need_no_columns_of_their_acceleration() {
    let raw = damped_bracket(Coupling::Averaging);
    let part = |body: &FlexBody| {
        let recovery = &body.recoveries()[0];
        let columns = recovery.of_motion(MotionLoad::Acceleration).expect("columns");
        columns.norm_max() / whole(body, recovery, MotionLoad::Acceleration).norm_max()
    };
    assert!(part(&body(raw.clone(), BasisChoice::default(), 6, BodyFrame::Com)) < 1e-8);
    let craig = body(raw, BasisChoice::CraigBampton(CraigBampton), 1, BodyFrame::Com);
    assert!(part(&craig) > 1e-3, "{:e}", part(&craig));
}

/// Proportional damping of a free body and modal ratios need no columns; a recovery has those of inertia only if they are
/// asked for.
#[test]
fn columns_are_there_where_they_are_needed() {
    let coupled = |coupling: Coupling, damping: Option<Damping<_>>, basis: BasisChoice, inertia: bool| {
        let mut raw = damped_bracket(coupling);
        raw.data.damping = damping;
        raw.data.recoveries.iter_mut().for_each(|recovery| recovery.deformed_inertia = inertia);
        let body = body(raw, basis, 4, BodyFrame::Com);
        body.recoveries()[0].motion.iter().map(|one| one.load).collect::<Vec<_>>()
    };
    let kinds = |damping, basis, inertia| coupled(Coupling::Averaging, damping, basis, inertia);
    let rayleigh = || Some(Damping::Rayleigh { alpha: 3.0, beta: 1e-5 });
    let matrix = || damped_bracket(Coupling::Averaging).data.damping;
    let craig = || BasisChoice::CraigBampton(CraigBampton);
    assert_eq!(kinds(None, BasisChoice::default(), false), []);
    assert_eq!(kinds(Some(Damping::Ratio(0.02)), craig(), false), []);
    assert_eq!(kinds(rayleigh(), BasisChoice::default(), false), []);
    assert_eq!(coupled(Coupling::Rigid, rayleigh(), BasisChoice::default(), false), []);
    assert_eq!(kinds(rayleigh(), craig(), false), [MotionLoad::Damping]);
    assert_eq!(kinds(matrix(), BasisChoice::default(), false), [MotionLoad::Damping]);
    assert_eq!(kinds(matrix(), BasisChoice::default(), true), MotionLoad::ALL);
}

/// Rows of one motion do not depend on the axes of the body.
#[test]
fn rows_of_a_motion_do_not_depend_on_axes() {
    let raw = damped_bracket(Coupling::Averaging);
    let plain = body(raw.clone(), BasisChoice::default(), 4, BodyFrame::Com);
    let mut random = Random(23);
    let mut many = |size: f64| (0..4).map(|_| size * random.signed()).collect::<Vec<f64>>();
    let (q, rate, acceleration) = (many(1e-4), many(1e-1), many(1e3));
    let (w, alpha) = (Vector3::new(200.0, -70.0, 120.0), Vector3::new(3e4, 2e4, -5e4));
    let rows = |body: &FlexBody| {
        let axes = body.frame().axes.transpose() * plain.frame().axes;
        let motion = ModalMotion {
            q: &q,
            rate: &rate,
            acceleration: &acceleration,
            angular_velocity: axes * w,
            angular_acceleration: axes * alpha,
        };
        let loads = [[0.0; 6]; 2];
        body.recoveries()[0].values(&RecoveryState { motion, loads: &loads, named: &[] })
    };
    let expected = rows(&plain);
    let turned = body(raw, BasisChoice::default(), 4, BodyFrame::Principal);
    let sign = |j: usize| {
        let (a, b) = (vectors(&plain), vectors(&turned));
        let product: f64 = (0..a.nrows()).map(|i| a[(i, j)] * b[(i, j)]).sum();
        product.signum()
    };
    assert!((0..4).all(|j| sign(j) == 1.0), "modes have one sign in every frame");
    let found = rows(&turned);
    assert!(error(&found, &expected) < 1e-9, "{:e}", error(&found, &expected));
}
