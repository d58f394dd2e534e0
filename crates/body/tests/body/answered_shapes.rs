//! Recoveries from the answers of an FE program to shapes, against the operator that gives these answers.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, CraigBampton, FreeSurface};
use flexbody_body::convert::{
    Conversion, ConvertSettings, RecoveryShapes, ShapeColumn, convert, recovery_shapes,
};
use flexbody_body::flex_body::{FlexBody, MotionLoad, Recovery};
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_linalg::context::Context;
use flexbody_linalg::{column_products, combine, side_by_side};
use flexbody_model::{AnsweredShapes, Coupling, FeModel, ModelRecovery, NodeSet, RawModel, RecoveryOperator};
use oracle::craig_bampton::{lowest, model};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::Mesh;

const CELL: f64 = 0.05;

fn mesh() -> Mesh {
    let mesh = Mesh::bracket(ElementKind::Hex8, 4, 2, CELL);
    let skewed = |x: &[f64; 3]| [x[0] + 0.1 * x[1], x[1] * (1.0 + x[0]), x[2] - 0.2 * x[0] * x[1]];
    Mesh { nodes: mesh.nodes.iter().map(skewed).collect(), elements: mesh.elements }
}

/// Returns the bracket with interfaces at its ends and a recovery.
fn bracket(recovery: ModelRecovery) -> RawModel {
    let mut raw = mesh().assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    let lattice = Mesh::bracket(ElementKind::Hex8, 4, 2, CELL).nodes;
    let end = |axis: usize| {
        let at_end = lattice.iter().enumerate().filter(|(_, x)| (x[axis] - 4.0 * CELL).abs() < 1e-9);
        at_end.map(|(i, _)| i as i64 + 1).collect()
    };
    let set = |(name, axis): (&str, usize)| NodeSet {
        coupling: Some(Coupling::Averaging),
        ..NodeSet::new(name, end(axis))
    };
    raw.data.interfaces = [("first", 0), ("second", 2)].map(set).to_vec();
    raw.data.recoveries = vec![recovery];
    raw
}

fn operator() -> ModelRecovery {
    mesh().stresses(&Material::STEEL)
}

fn made(
    recovery: ModelRecovery,
    basis: BasisChoice,
    modes: usize,
    frame: impl Into<FrameChoice>,
) -> Result<Conversion> {
    let settings =
        ConvertSettings { modes: lowest(modes), basis, frame: frame.into(), ..ConvertSettings::default() };
    convert(&model(bracket(recovery)), &settings, &Context::QUIET)
}

fn free() -> BasisChoice {
    BasisChoice::Free(FreeSurface::default())
}

/// Returns what an FE program answers to the shapes of `body`.
fn answered(body: &FlexBody, model: &FeModel) -> (AnsweredShapes, Vec<ShapeColumn>) {
    answered_with(body, model, false)
}

/// Returns the answers to the shapes with those of the inertia of the deformation or without.
fn answered_with(
    body: &FlexBody,
    model: &FeModel,
    deformed_inertia: bool,
) -> (AnsweredShapes, Vec<ShapeColumn>) {
    let shapes = recovery_shapes(body, model, deformed_inertia, &Context::QUIET).expect("shapes");
    answers_to(shapes, model)
}

/// Returns the answers to shapes.
fn answers_to(shapes: RecoveryShapes, model: &FeModel) -> (AnsweredShapes, Vec<ShapeColumn>) {
    let RecoveryOperator::Rows { transposed, .. } = operator().operator else { panic!("an operator") };
    let u = &shapes.fields;
    // The rows of this model are in the order of its files.
    let answer = |row: usize, shape: usize| -> f64 {
        let (rows, values) = transposed.column(row);
        rows.iter().zip(values).map(|(at, value)| value * u[(*at as usize, shape)]).sum()
    };
    let energies = column_products(u.as_ref(), model.pencil().apply_stiffness(u.as_ref()).as_ref());
    let answered = AnsweredShapes {
        dofs: (0..u.nrows()).map(|row| model.label(row)).collect(),
        displacements: u.clone(),
        digits: 14,
        answers: Mat::from_fn(transposed.n_cols(), u.ncols(), answer),
        answer_digits: 15,
        energies: Some(energies.into_iter().map(|energy| 0.5 * energy).collect()),
    };
    (answered, shapes.columns)
}

fn recovery_of(shapes: AnsweredShapes) -> ModelRecovery {
    let RecoveryOperator::Rows { labels, .. } = operator().operator else { panic!("an operator") };
    ModelRecovery { operator: RecoveryOperator::Shapes { shapes, labels }, ..operator() }
}

/// Returns the largest difference of two recoveries, relative to the largest entry of each of their arrays.
fn difference(a: &Recovery, b: &Recovery) -> f64 {
    let columns = |recovery: &Recovery| -> Vec<Mat<f64>> {
        let loads = recovery.loads.iter().map(|at| at.columns.clone());
        [recovery.modes.clone(), recovery.spin.clone()].into_iter().chain(loads).collect()
    };
    let apart = |(a, b): (Mat<f64>, Mat<f64>)| (&a - &b).norm_max() / b.norm_max();
    columns(a).into_iter().zip(columns(b)).map(apart).fold(0.0, f64::max)
}

#[test]
fn answers_to_the_shapes_of_a_body_give_its_recovery() {
    let frames: [FrameChoice; 2] = [BodyFrame::Principal.into(), FrameChoice::Interface("first".into())];
    for frame in frames {
        let expected = made(operator(), free(), 8, frame.clone()).expect("converts").body;
        let (shapes, columns) = answered(&expected, &model(bracket(operator())));
        assert_eq!(columns.len(), 8 + 6 + 12);
        let found = made(recovery_of(shapes), free(), 8, frame).expect("converts");
        assert!(difference(&found.body.recoveries()[0], &expected.recoveries()[0]) < 1e-9);
        let codes: Vec<Code> = found.diagnostics.iter().map(|diagnostic| diagnostic.code()).collect();
        assert!(codes.contains(&Code::RecoveryMapped), "{codes:?}");
    }
}

/// The columns of the inertia of the deformation are steps too; without them the recovery is refused.
#[test]
fn answers_have_the_columns_of_the_inertia_of_the_deformation() {
    let deformed = |recovery: ModelRecovery| ModelRecovery { deformed_inertia: true, ..recovery };
    for basis in [free, || BasisChoice::CraigBampton(CraigBampton)] {
        let expected = made(deformed(operator()), basis(), 5, BodyFrame::Principal).expect("converts").body;
        let (shapes, columns) = answered_with(&expected, &model(bracket(operator())), true);
        assert!(columns.iter().any(|column| column.to_string() == "turning z of mode 2"), "{columns:?}");
        let answers = deformed(recovery_of(shapes));
        let found = made(answers, basis(), 5, BodyFrame::Principal).expect("converts").body;
        let (own, other) = (&found.recoveries()[0], &expected.recoveries()[0]);
        assert!(difference(own, other) < 1e-8);
        for load in MotionLoad::INERTIA {
            let rows = |body: &FlexBody, one: &Recovery| body.motion_rows(one, load).expect("columns");
            let (own, other) = (rows(&found, own), rows(&expected, other));
            let apart = (&own - &other).norm_max() / other.norm_max();
            assert!(apart < 1e-8, "{}: {apart:e}", load.name());
        }
        let (shapes, _) = answered(&expected, &model(bracket(operator())));
        let error =
            made(deformed(recovery_of(shapes)), basis(), 5, BodyFrame::Principal).expect_err("refused");
        assert!(error.has(Code::RecoveryUnanswered), "{error}");
    }
}

#[test]
fn fewer_modes_are_combinations_of_the_same_shapes() {
    let whole = made(operator(), free(), 8, BodyFrame::Principal).expect("converts").body;
    let (shapes, _) = answered(&whole, &model(bracket(operator())));
    let expected = made(operator(), free(), 3, BodyFrame::Principal).expect("converts").body;
    let found = made(recovery_of(shapes), free(), 3, BodyFrame::Principal).expect("converts").body;
    assert!(difference(&found.recoveries()[0], &expected.recoveries()[0]) < 1e-9);
}

#[test]
fn answers_to_craig_bampton_shapes_keep_rigid_interfaces() {
    let basis = || BasisChoice::CraigBampton(CraigBampton);
    let expected = made(operator(), basis(), 6, BodyFrame::Principal).expect("converts").body;
    let (shapes, _) = answered(&expected, &model(bracket(operator())));
    let found = made(recovery_of(shapes), basis(), 6, BodyFrame::Principal).expect("converts").body;
    assert!(difference(&found.recoveries()[0], &expected.recoveries()[0]) < 1e-8);
}

#[test]
fn modes_that_were_not_asked_for_are_refused() {
    let small = made(operator(), free(), 4, BodyFrame::Principal).expect("converts").body;
    let (shapes, _) = answered(&small, &model(bracket(operator())));
    let error = made(recovery_of(shapes), free(), 6, BodyFrame::Principal).expect_err("refused");
    assert!(error.has(Code::RecoveryUnanswered), "{error}");
    let message = error.first_error().message();
    assert!(message.contains("mode 5 (") && message.contains("mode 6 ("), "{message}");
}

#[test]
fn mixed_and_turned_shapes_give_the_same_recovery() {
    let expected = made(operator(), free(), 5, BodyFrame::Principal).expect("converts").body;
    let reference = model(bracket(operator()));
    let (mut shapes, columns) = answered(&expected, &reference);
    // Combinations of neighbouring shapes with a rigid translation, as FE programs may have them.
    let n = columns.len();
    let mixing = Mat::from_fn(n, n, |i, j| {
        if i == j {
            1.0
        } else if i + 1 == j {
            0.4
        } else {
            0.0
        }
    });
    shapes.displacements = combine(shapes.displacements.as_ref(), mixing.as_ref());
    shapes.answers = combine(shapes.answers.as_ref(), mixing.as_ref());
    shapes.energies = None;
    for (row, dof) in shapes.dofs.iter().enumerate().filter(|(_, dof)| dof.direction == 2) {
        assert!(dof.node > 0);
        (0..n).for_each(|j| shapes.displacements[(row, j)] += 1e-3);
    }
    let found = made(recovery_of(shapes), free(), 5, BodyFrame::Principal).expect("converts").body;
    assert!(difference(&found.recoveries()[0], &expected.recoveries()[0]) < 1e-8);
}

#[test]
fn another_stiffness_of_the_fe_program_is_refused() {
    let body = made(operator(), free(), 4, BodyFrame::Principal).expect("converts").body;
    let (shapes, _) = answered(&body, &model(bracket(operator())));
    let scaled = |factor: f64, first: f64| {
        let energies = shapes.energies.iter().flatten().enumerate();
        let energies = energies.map(|(k, energy)| energy * if k == 0 { first } else { factor });
        recovery_of(AnsweredShapes { energies: Some(energies.collect()), ..shapes.clone() })
    };
    for factor in [1.05, 1e-6] {
        let error = made(scaled(factor, factor), free(), 4, BodyFrame::Principal).expect_err("refused");
        assert!(error.has(Code::RecoveryEnergy), "{error}");
    }
    let found = made(scaled(1.0, 0.97), free(), 4, BodyFrame::Principal).expect("converts");
    assert!(found.diagnostics.iter().any(|diagnostic| diagnostic.code() == Code::RecoveryEnergyDiffers));
}

/// Answers are held to the stiffness where the FE program was given the uniform strains too, and only then.
#[test]
fn answers_to_uniform_strains_are_held_to_the_stiffness() {
    let known = model(bracket(operator()));
    let body = made(operator(), free(), 4, BodyFrame::Com).expect("converts").body;
    let shapes = recovery_shapes(&body, &known, false, &Context::QUIET).expect("shapes");
    let with = shapes.clone().with_uniform_strains(&known).expect("a solid");
    assert_eq!(with.columns.len(), shapes.columns.len() + 6);
    // Rigid modes of an FE program, with the rounding of its results, are no strains.
    let (centre, length) = ([0.1; 3], 0.2);
    let rigid = known.rigid_fields(centre, length);
    let rounding = |i: usize, j: usize| 1e-9 * ((31 * i + 17 * j) as f64).sin();
    let rigid = Mat::from_fn(rigid.nrows(), 6, |i, j| rigid[(i, j)] + rounding(i, j));
    let with_rigid = |shapes: RecoveryShapes| RecoveryShapes {
        columns: (0..6).map(ShapeColumn::Mode).chain(shapes.columns).collect(),
        factors: [1.0; 6].into_iter().chain(shapes.factors).collect(),
        fields: side_by_side(&[rigid.as_ref(), shapes.fields.as_ref()]),
    };
    let codes = |change: &dyn Fn(usize) -> f64, shapes: RecoveryShapes| -> Vec<Code> {
        let (mut answered, _) = answers_to(shapes, &known);
        let answers = &answered.answers;
        answered.answers = Mat::from_fn(answers.nrows(), answers.ncols(), |i, j| change(i) * answers[(i, j)]);
        let found = match FeModel::from_raw(bracket(recovery_of(answered))) {
            Ok(checked) => checked.diagnostics,
            Err(error) => error.diagnostics().to_vec(),
        };
        let judged = [Code::RecoveryContradicts, Code::RecoveryUncompared];
        found.iter().map(|diagnostic| diagnostic.code()).filter(|code| judged.contains(code)).collect()
    };
    assert_eq!(codes(&|_| 1.0, with.clone()), []);
    assert_eq!(codes(&|_| 1.0, with_rigid(with.clone())), []);
    assert_eq!(codes(&|_| 1.0, with_rigid(shapes.clone())), [Code::RecoveryUncompared]);
    assert_eq!(codes(&|_| 1.0, shapes), [Code::RecoveryUncompared]);
    // Shears of engineering, a sign, and another unit of stress.
    assert_eq!(codes(&|row| if row % 6 < 3 { 1.0 } else { 2.0 }, with.clone()), [Code::RecoveryContradicts]);
    assert_eq!(
        codes(&|row| if row % 6 == 4 { -1.0 } else { 1.0 }, with.clone()),
        [Code::RecoveryContradicts]
    );
    assert_eq!(codes(&|_| 1e6, with), [Code::RecoveryContradicts]);
}
