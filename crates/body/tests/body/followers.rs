//! Points with mass that follow several nodes by constraints: their mass turns with the nodes, as a body of points
//! on them does.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, FrameChoice, Invariants, condense, primary_differences};
use flexbody_body::verification::{body_identities, verify};
use flexbody_eigen::{Method, Wanted};
use flexbody_input::{ModelFiles, read_model};
use flexbody_linalg::context::Context;
use flexbody_linalg::{CscMatrix, SymmetricMatrix};
use flexbody_model::{CheckedModel, FeModel, InertialRows, LoadKind, RawModel};
use nalgebra::{DMatrix, Rotation3, Vector3};
use oracle::carried_mass::{Carrier, POINT};
use oracle::fixtures;
use oracle::sheet::Sheet;
use oracle::turning::dense;
use std::fs;

fn converted(model: &FeModel, modes: usize) -> Conversion {
    let settings =
        ModeSettings { wanted: Wanted::Lowest(modes), method: Method::Dense, ..ModeSettings::default() };
    let frame = FrameChoice::Mean(BodyFrame::Model);
    convert(model, &ConvertSettings { modes: settings, frame, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("converts")
}

/// Returns the modes of a body by the rows of the model as read.
fn vectors(model: &FeModel, body: &FlexBody, raw: &RawModel) -> DMatrix<f64> {
    let own = body.vectors_of(model).expect("of this model");
    let labels = raw.dofs.as_ref().expect("labels");
    let place: std::collections::HashMap<(i64, u8), usize> = (0..own.nrows())
        .map(|row| model.label(row))
        .enumerate()
        .map(|(row, one)| ((one.node, one.direction), row))
        .collect();
    DMatrix::from_fn(labels.len(), own.ncols(), |i, j| {
        place.get(&(labels[i].node, labels[i].direction)).map_or(0.0, |row| own[(*row, j)])
    })
}

/// Returns the invariants of point masses (one per position) that move by `shapes`, about the origin of the model.
fn of_points(masses: &[f64], positions: &[[f64; 3]], shapes: &DMatrix<f64>, body: &FlexBody) -> Invariants {
    let entries: Vec<(u32, u32, f64)> =
        masses.iter().enumerate().map(|(i, mass)| (i as u32, i as u32, *mass)).collect();
    let mass = CscMatrix::from_triplets(masses.len(), masses.len(), &entries);
    let mass = SymmetricMatrix::new(mass).expect("a diagonal matrix is symmetric");
    let shapes = Mat::from_fn(shapes.nrows(), shapes.ncols(), |i, j| shapes[(i, j)]);
    condense(&mass, positions, shapes.as_ref(), body.invariants().modal_stiffness().clone())
}

/// Compares I0, W1, W2, W3 and the other invariants of a body with those of points.
fn assert_alike(body: &FlexBody, expected: &Invariants, limit: f64) {
    let found = body.invariants();
    let same = |a: &Mat<f64>, b: &Mat<f64>, what: &str| {
        // Free modes have no momentum: C1 and C2 are rounding of sums of this size.
        let size = match what {
            "C1" => expected.mass().sqrt(),
            "C2" => expected.inertia().trace().sqrt(),
            _ => b.norm_max(),
        };
        let difference = (a - b).norm_max() / size;
        assert!(difference < limit, "{what}: {difference:.1e}");
    };
    assert!((found.inertia() - expected.inertia()).norm() < limit * expected.inertia().norm());
    same(&found.w1().expect("W1"), &expected.w1().expect("W1"), "W1");
    same(&found.w2().expect("W2"), &expected.w2().expect("W2"), "W2");
    same(&found.w3().expect("W3"), &expected.w3().expect("W3"), "W3");
    same(found.c1(), expected.c1(), "C1");
    same(&found.c2(), &expected.c2(), "C2");
}

/// Checks a body with a carried mass against all of its points.
fn check(carrier: &Carrier, with_inertia: bool) {
    let CheckedModel { model, diagnostics, .. } =
        FeModel::from_raw(carrier.raw.clone()).unwrap_or_else(|error| panic!("{error}"));
    assert!(
        diagnostics.iter().all(|diagnostic| diagnostic.code() != Code::MassBlockStructure),
        "{diagnostics:?}"
    );
    let conversion = converted(&model, 12);
    let body = &conversion.body;
    assert_eq!(*body.nodes().ids.last().expect("nodes"), POINT);
    let psi = vectors(&model, body, &carrier.raw);
    // All points: the nodes with their own mass, and the masses of the point.
    let whole = dense(&carrier.raw.followers.as_ref().expect("a point").mass);
    let labels = carrier.raw.dofs.as_ref().expect("labels");
    let nodes = &carrier.raw.nodes;
    let first: Vec<usize> = (0..labels.len()).filter(|row| labels[*row].direction == 1).collect();
    let point_mass: f64 = whole[(labels.len(), labels.len())] / 6.0;
    let masses: Vec<f64> = first.iter().map(|row| whole[(*row, *row)]).chain(vec![point_mass; 6]).collect();
    let positions: Vec<[f64; 3]> =
        nodes.positions.iter().copied().chain(carrier.masses.iter().map(|x| (*x).into())).collect();
    let motions = carrier.motions(&psi);
    let moved = first.iter().flat_map(|row| *row..row + 3).map(|row| psi.row(row).into_owned());
    let rows: Vec<_> = moved.chain(motions.row_iter().map(|row| row.into_owned())).collect();
    let shapes = DMatrix::from_rows(&rows);
    let expected = of_points(&masses, &positions, &shapes, body);
    assert_alike(body, &expected, 1e-11);
    assert!(
        primary_differences(body.invariants(), body.invariants())
            .iter()
            .all(|primary_difference| primary_difference.1 == 0.0)
    );
    assert_turned(carrier, body, &psi, point_mass);
    // The body agrees with itself and with the model.
    let verified = verify(body, &model).expect("the same model");
    let broken: Vec<_> =
        body_identities(body).into_iter().chain(verified).filter(|check| !check.passed).collect();
    assert!(broken.is_empty(), "{broken:?}");
    assert_power(&model);
    assert_eq!(with_inertia, carrier.masses[0] != carrier.masses[1]);
}

/// Compares the stiffness of inertia with that of the masses on arms from the weighted mean of the nodes, which turn
/// by theta x (theta x r) / 2 in second order.
fn assert_turned(carrier: &Carrier, body: &FlexBody, psi: &DMatrix<f64>, mass: f64) {
    let turns = (&carrier.follows * psi).rows(3, 3).into_owned();
    let theta = |j: usize| Vector3::new(turns[(0, j)], turns[(1, j)], turns[(2, j)]);
    let second = |r: &Vector3<f64>, j: usize, k: usize| {
        0.5 * (theta(j).cross(&theta(k).cross(r)) + theta(k).cross(&theta(j).cross(r)))
    };
    let (mut compared, axis) = (0, |k: usize| Vector3::<f64>::ith(k, 1.0));
    for stiffness in &body.inertia_stiffness().expect("directors").stiffness {
        let at = |x: &Vector3<f64>| match (&stiffness.load.kind, stiffness.load.component) {
            (LoadKind::Acceleration, k) => Some(axis(k)),
            (LoadKind::AngularAcceleration, k) => Some(axis(k).cross(x)),
            (LoadKind::Spin, k @ 0..3) => Some(axis(k).cross(&axis(k).cross(x))),
            _ => None,
        };
        let nf = psi.ncols();
        let expected = Mat::from_fn(nf, nf, |j, k| {
            let of =
                |x: &Vector3<f64>| at(x).map_or(0.0, |g| mass * g.dot(&second(&(x - carrier.centre), j, k)));
            carrier.masses.iter().map(of).sum::<f64>()
        });
        if at(&carrier.place).is_some() {
            let difference = (&stiffness.matrix - &expected).norm_max();
            let size = expected.norm_max().max(mass * turns.amax().powi(2) * carrier.place.norm() * 1e-3);
            assert!(difference < 1e-9 * size, "{:?}: {difference:.1e} of {size:.1e}", stiffness.load);
            compared += 1;
        }
    }
    assert_eq!(compared, 9);
}

/// T'E T is M, for the maps between rows of the model and extended rows.
fn assert_power(model: &FeModel) {
    let rows = InertialRows::new(model, Vector3::zeros());
    let n = model.rows().len();
    let x = Mat::from_fn(n, 3, |i, j| (((i * 31 + j * 17) * 7919) % 1009) as f64 / 504.5 - 1.0);
    let extended = rows.extend(&x).into_owned();
    let found = rows.restrict(rows.weigh(extended.as_ref()));
    let expected = model.pencil().apply_mass(x.as_ref());
    assert!((&found - &expected).norm_max() < 1e-12 * expected.norm_max());
}

#[test]
fn a_mass_on_weighted_nodes_turns_with_them() {
    let sheet = Sheet::new(0.0, 0.0);
    let turn = Rotation3::from_euler_angles(0.4, -0.7, 1.1);
    let reversed: Vec<usize> = sheet.order().into_iter().rev().collect();
    for (turn, scale, order) in [
        (Rotation3::identity(), 1.0, sheet.order()),
        (turn, 1.0, reversed),
        (Rotation3::from_euler_angles(1.5, 0.2, -0.1), 1000.0, sheet.order()),
    ] {
        for with_inertia in [true, false] {
            check(&Carrier::new(sheet.raw(&turn, scale, &order), &turn, scale, with_inertia), with_inertia);
        }
    }
}

/// Without the points the same matrices have errors of the size of the mass: FB433, or W2 several times too small.
#[test]
fn the_matrices_alone_do_not_tell_with_what_the_mass_turns() {
    let sheet = Sheet::new(0.0, 0.0);
    let turn = Rotation3::identity();
    let carrier = Carrier::new(sheet.raw(&turn, 1.0, &sheet.order()), &turn, 1.0, true);
    let body = converted(&FeModel::from_raw(carrier.raw.clone()).expect("a body").model, 12).body;
    let alone = RawModel { followers: None, ..carrier.raw };
    assert!(FeModel::from_raw(alone.clone()).expect_err("foreign pairs").has(Code::MassOrder));
    let alone =
        FeModel::from_raw(RawModel { allow_implausible: true.into(), ..alone }).expect("allowed").model;
    let other = converted(&alone, 12).body;
    let [found, wrong] = [&body, &other].map(|body| body.invariants().w2().expect("W2"));
    assert!((&found - &wrong).norm_max() > 0.1 * found.norm_max());
    for (a, b) in body.modes().eigenvalue.iter().zip(&other.modes().eigenvalue) {
        assert!((a / b - 1.0).abs() < 1e-9);
    }
}

/// A solid of the FE program in which a grid follows five others as their mean (RBE3): its mass is that of the solid
/// before the constraint.
#[test]
fn a_grid_of_a_solid_that_follows_others_keeps_its_mass() {
    for cards in [
        "RBE3,901,,29,123,1.0,123,11,17\n,35,41,26\n",
        "RBE3,901,,29,123456,3.0,123,11,17\n,35,41,3.,123,26,ALPHA,1.-5\n",
    ] {
        let read = |cards: &str| {
            let folder = tempfile::tempdir().expect("a folder");
            let small = fixtures().join("small/nastran_op4");
            for name in ["job.bdf", "job.op4"] {
                fs::copy(small.join(name), folder.path().join(name)).expect("copied");
            }
            let path = folder.path().join("job.bdf");
            let text = fs::read_to_string(&path).expect("a deck");
            fs::write(&path, text.replace("ENDDATA", &format!("{cards}ENDDATA"))).expect("written");
            let files = ModelFiles::from_job(&path, None, Vec::new(), Some("m,kg,s")).expect("files");
            read_model(&files).unwrap_or_else(|error| panic!("{error}"))
        };
        let (whole, tied) = (read(""), read(cards));
        let follower = tied.followers.clone().expect("a point with mass");
        let model = FeModel::from_raw(tied.clone()).expect("a body").model;
        let body = converted(&model, 6).body;
        let psi = vectors(&model, &body, &tied);
        let moved = dense(&follower.follows).transpose() * &psi;
        let (labels, old) = (tied.dofs.as_ref().expect("labels"), whole.dofs.as_ref().expect("labels"));
        let shapes = Mat::from_fn(old.len(), psi.ncols(), |i, j| {
            match labels.iter().position(|label| *label == old[i]) {
                Some(row) => psi[(row, j)],
                None => moved[(usize::from(old[i].direction) - 1, j)],
            }
        });
        let nodes: Vec<i64> = old.iter().step_by(3).map(|label| label.node).collect();
        let place = |node: &i64| whole.nodes.ids.iter().position(|id| id == node).expect("a node");
        let positions: Vec<[f64; 3]> = nodes.iter().map(|node| whole.nodes.positions[place(node)]).collect();
        let all = whole.mass.matrix.n_cols();
        let first: Vec<usize> = (0..all).step_by(3).collect();
        let mass = SymmetricMatrix::symmetrised(whole.mass.matrix.clone()).principal(&first);
        let stiffness = body.invariants().modal_stiffness().clone();
        assert_alike(&body, &condense(&mass, &positions, shapes.as_ref(), stiffness), 1e-11);
        assert_power(&model);
        let broken: Vec<_> = verify(&body, &model)
            .expect("the same model")
            .into_iter()
            .filter(|check| !check.passed)
            .collect();
        assert!(broken.is_empty(), "{broken:?}");
    }
}
