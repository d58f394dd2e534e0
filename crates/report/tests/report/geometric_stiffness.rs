//! Geometric stiffness of unit loads compared with direct nodal products, closed forms of beams, and itself
//! in other axes.

use faer::{Mat, Scale};
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, FreeSurface, Loads};
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, IdentityCheck};
use flexbody_body::verification::verify;
use flexbody_eigen::Wanted;
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{
    Damping, FeModel, GeometricStiffness, LoadKind, NodeSet, RawMatrix, RawModel, UnitLoad,
};
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, Terms};
use flexbody_report::{Facts, Format, RunData, render};
use nalgebra::{Matrix3, Rotation3, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::file_bodies::age;
use oracle::mesh::{Assembly, Mesh, entries};
use oracle::random::Random;
use oracle::reference::{dense_modes, symmetric_eigen};
use std::path::PathBuf;

const SPIN: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Material with zero Poisson's ratio, so that a bar follows beam theory.
const BEAM: Material = Material { youngs: 210e9, poisson: 0.0, density: 7850.0 };

/// A body with its matrices.
struct Case {
    mesh: Mesh,
    body: Assembly,
    material: Material,
}

impl Case {
    fn new(mesh: Mesh, material: Material) -> Self {
        let body = mesh.assemble(&material, MassRule::Consistent);
        Self { mesh, body, material }
    }

    /// Returns a block without symmetry.
    fn skew_block() -> Self {
        let mesh = Mesh::from_cells(ElementKind::Hex8, &oracle::mesh::grid([4, 2, 1]), |p| {
            [0.2 * p[0] + 0.02 * p[1] * p[2], 0.1 * p[1] * (1.0 + 0.1 * p[0]), 0.07 * p[2] + 0.01 * p[0]]
        });
        Self::new(mesh, Material::STEEL)
    }

    /// Returns K_geo of the free body under the forces `load` (3n x 1) and the inertia forces that balance
    /// them.
    fn stressed(&self, load: &Mat<f64>) -> CscMatrix {
        let modes = dense_modes(&self.body);
        let modal = modes.shapes.transpose() * load;
        let amplitude = Mat::from_fn(modal.nrows(), 1, |p, _| modal[(p, 0)] / modes.eigenvalues[p]);
        let moved = &modes.shapes * &amplitude;
        self.mesh.geometric_stiffness(&self.material, &moved.col(0).iter().copied().collect::<Vec<_>>())
    }

    /// Returns K_geo of the free body under a unit force along an axis, half of it at each of two nodes.
    fn pulled(&self, nodes: [usize; 2], axis: usize) -> CscMatrix {
        let mut force = Mat::zeros(self.body.n_dofs(), 1);
        nodes.iter().for_each(|node| force[(3 * node + axis, 0)] = 0.5);
        self.stressed(&force)
    }

    /// Returns M times an acceleration of every node.
    fn inertia_load(&self, acceleration: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Mat<f64> {
        let mut load = Mat::zeros(self.body.n_dofs(), 1);
        for (row, column, value) in entries(&self.body.scalar_mass) {
            let a = acceleration(Vector3::from(self.body.nodes[column as usize]));
            (0..3).for_each(|k| load[(3 * row as usize + k, 0)] -= value * a[k]);
        }
        load
    }

    /// Returns the six matrices of the centrifugal stress of the body.
    fn spin(&self) -> Vec<GeometricStiffness<RawMatrix>> {
        let matrix = |&(k, l): &(usize, usize)| {
            let e = |axis: usize| Vector3::ith(axis, 1.0);
            // The coefficient of w_k w_l in w x (w x x).
            self.stressed(&self.inertia_load(|x| {
                if k == l {
                    e(k).cross(&e(k).cross(&x))
                } else {
                    e(k).cross(&e(l).cross(&x)) + e(l).cross(&e(k).cross(&x))
                }
            }))
        };
        SPIN.iter().enumerate().map(|(c, pair)| given(LoadKind::Spin, c, matrix(pair))).collect()
    }

    fn raw(&self, geometric_stiffness: Vec<GeometricStiffness<RawMatrix>>) -> RawModel {
        let interfaces = vec![NodeSet::new("tip", vec![1, 2]), NodeSet::new("side", vec![3, 4])];
        self.body.raw_model().with(|data| {
            data.geometric_stiffness = geometric_stiffness;
            data.interfaces = interfaces;
        })
    }
}

/// Returns the stiffness of a string between two nodes (indices): `size` times the identity at each node, and
/// its negative between them.
fn string(n: usize, [a, b]: [usize; 2], size: f64) -> CscMatrix {
    let entries = (0..3).flat_map(|k| {
        let [a, b] = [3 * a + k, 3 * b + k].map(|row| row as u32);
        [(a, a, size), (b, b, size), (a, b, -size), (b, a, -size)]
    });
    CscMatrix::from_triplets(n, n, &entries.collect::<Vec<_>>())
}

fn given(kind: LoadKind, component: usize, matrix: CscMatrix) -> GeometricStiffness<RawMatrix> {
    let matrix = RawMatrix { matrix, digits: 17, path: PathBuf::from("Kg.mtx") };
    GeometricStiffness { load: UnitLoad { kind, component }, matrix }
}

fn run(raw: RawModel, frame: BodyFrame, basis: BasisChoice) -> Result<Conversion> {
    let checked = FeModel::from_raw(raw)?;
    let mut settings =
        ConvertSettings { frame: frame.into(), basis, lumped: Vec::new(), ..ConvertSettings::default() };
    settings.modes.wanted = Wanted::Lowest(10);
    let mut done = convert(&checked.model, &settings, &Context::QUIET)?;
    done.diagnostics.splice(0..0, checked.diagnostics);
    Ok(done)
}

fn converted(raw: RawModel, frame: BodyFrame) -> FlexBody {
    run(raw, frame, BasisChoice::default()).expect("a sound body").body
}

fn refusal(raw: RawModel) -> flexbody_base::error::Error {
    run(raw, BodyFrame::Principal, BasisChoice::default()).expect_err("not to be converted")
}

/// Returns the shapes of a body in the axes of its model (3n x nf).
fn in_model_axes(body: &FlexBody) -> Mat<f64> {
    let (shape, axes) = (&body.modes().shape, body.frame().axes);
    Mat::from_fn(shape.nrows(), shape.ncols(), |row, j| {
        (0..3).map(|l| axes[(row % 3, l)] * shape[(row - row % 3 + l, j)]).sum()
    })
}

/// Returns Psi' A Psi, computed entry by entry.
fn product(a: &CscMatrix, shapes: &Mat<f64>) -> Mat<f64> {
    let mut out = Mat::zeros(shapes.ncols(), shapes.ncols());
    for (row, column, value) in entries(a) {
        for p in 0..shapes.ncols() {
            for q in 0..shapes.ncols() {
                out[(p, q)] += shapes[(row as usize, p)] * value * shapes[(column as usize, q)];
            }
        }
    }
    out
}

/// Returns the sum of the matrices of one kind times `amount` of each component.
fn sum<'a>(
    matrices: impl Iterator<Item = (&'a UnitLoad, &'a Mat<f64>)>,
    kind: &LoadKind,
    amount: &[f64],
) -> Mat<f64> {
    let of_kind = matrices.filter(|(load, _)| load.kind == *kind);
    of_kind.map(|(load, m)| m * Scale(amount[load.component])).reduce(|a, b| a + b).expect("a matrix")
}

fn stored(body: &FlexBody, kind: &LoadKind, amount: &[f64]) -> Mat<f64> {
    sum(body.geometric_stiffness().iter().map(|g| (&g.load, &g.matrix)), kind, amount)
}

fn products(w: &Vector3<f64>) -> Vec<f64> {
    SPIN.iter().map(|&(k, l)| w[k] * w[l]).collect()
}

fn assert_close(a: &Mat<f64>, b: &Mat<f64>, tolerance: f64, what: &str) {
    let error = (a - b).norm_max() / b.norm_max();
    assert!(error <= tolerance, "{what}: {error:e}");
}

#[test]
fn entries_are_the_nodal_products_of_the_turned_load_in_every_frame() {
    let case = Case::skew_block();
    let turn = Rotation3::from_euler_angles(0.5, -0.3, 1.2);
    let case = Case::new(case.mesh.moved(turn.matrix(), [0.3, 0.1, -2.0]), case.material);
    let mut all = case.spin();
    for k in 0..3 {
        let e = Vector3::ith(k, 1.0);
        let turned = case.stressed(&case.inertia_load(|x| e.cross(&x)));
        all.push(given(LoadKind::AngularAcceleration, k, turned));
        all.push(given(LoadKind::Force("tip".to_owned()), k, case.pulled([0, 1], k)));
    }
    // Only one axis of the kind is given; missing axes count as zero.
    all.push(given(LoadKind::Force("side".to_owned()), 1, case.pulled([2, 3], 1)));
    all.push(given(LoadKind::Named("heat".to_owned()), 0, all[3].matrix.matrix.clone()));
    for frame in [BodyFrame::Model, BodyFrame::Com, BodyFrame::Principal] {
        let done = run(case.raw(all.clone()), frame, BasisChoice::default()).expect("a sound body");
        let note = done.diagnostics.iter().find(|d| d.code() == Code::GeometricStiffnessPartial);
        let message = note.expect("two axes are missing").message();
        assert_eq!(message, "geometric stiffness is taken as zero for force x at `side`, force z at `side`");
        let body = done.body;
        let shapes = in_model_axes(&body);
        let direct: Vec<_> = all.iter().map(|g| (&g.load, product(&g.matrix.matrix, &shapes))).collect();
        let axes = body.frame().axes;
        for own in [Vector3::new(0.3, -1.1, 0.7), Vector3::new(-0.2, 0.1, 2.0)] {
            let w = axes * own;
            for kind in all.iter().map(|g| &g.load.kind) {
                let (amount, along) = match kind {
                    LoadKind::Spin => (products(&w), products(&own)),
                    LoadKind::Named(_) => (vec![1.0], vec![1.0]),
                    _ => (w.as_slice().to_vec(), own.as_slice().to_vec()),
                };
                let expected = sum(direct.iter().map(|(l, m)| (*l, m)), kind, &amount);
                let found = stored(&body, kind, &along);
                assert_close(&found, &expected, 1e-13, &format!("{frame:?} {kind:?}"));
            }
        }
    }
}

#[test]
fn a_turned_model_is_stiffened_by_the_turned_spin() {
    let case = Case::skew_block();
    let turn = Rotation3::from_euler_angles(-0.8, 0.4, 2.0);
    let turned = Case::new(case.mesh.moved(turn.matrix(), [1.0, 2.0, 3.0]), case.material);
    let a = converted(case.raw(case.spin()), BodyFrame::Principal);
    let b = converted(turned.raw(turned.spin()), BodyFrame::Principal);
    let (sa, sb) = (in_model_axes(&a), in_model_axes(&b));
    let signs: Vec<f64> = (0..sa.ncols())
        .map(|j| {
            let node = |s: &Mat<f64>, i: usize| Vector3::new(s[(i, j)], s[(i + 1, j)], s[(i + 2, j)]);
            let dots = (0..sa.nrows()).step_by(3).map(|i| (turn * node(&sa, i)).dot(&node(&sb, i)));
            dots.sum::<f64>().signum()
        })
        .collect();
    let spin = Vector3::new(20.0, -35.0, 12.0);
    let at = |body: &FlexBody, w: &Vector3<f64>| {
        let own = body.frame().axes.transpose() * w;
        stored(body, &LoadKind::Spin, &products(&own))
    };
    let first = at(&a, &spin);
    let signed = Mat::from_fn(10, 10, |p, q| signs[p] * signs[q] * first[(p, q)]);
    assert_close(&at(&b, &(turn * spin)), &signed, 1e-9, "turned");
    assert!((at(&b, &spin) - &signed).norm_max() > 0.1 * signed.norm_max());
}

/// Returns a bar along x about the origin, thinner along z than along y.
fn bar() -> Case {
    let mesh = Mesh::block(ElementKind::Hex8, [32, 1, 1], [1.0, 0.04, 0.03]);
    Case::new(mesh.moved(&Matrix3::identity(), [-0.5, -0.02, -0.015]), BEAM)
}

/// Returns slope and deflection at x / L = s of the first bending shape of a free beam, symmetric about its
/// middle.
fn first_bending(s: f64) -> (f64, f64) {
    let k = 4.730_040_744_862_704;
    let (a, b) = ((k / 2.0f64).cosh(), (k / 2.0f64).cos());
    (k * ((k * s).sinh() / a - (k * s).sin() / b), (k * s).cosh() / a + (k * s).cos() / b)
}

/// Returns the integral over the beam by Simpson's rule.
fn along_beam(f: impl Fn(f64) -> f64) -> f64 {
    let n = 2000;
    let weight = |i: usize| {
        if i == 0 || i == n {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    (0..=n).map(|i| weight(i) * f(i as f64 / n as f64 - 0.5)).sum::<f64>() / (3 * n) as f64
}

/// Returns the lowest mode whose motion is mainly along an axis.
fn bending_along(body: &FlexBody, axis: usize) -> usize {
    let s = body.invariants().s().unwrap();
    (0..body.n_modes()).find(|&j| s[axis][axis][(j, j)] > 0.9).expect("a bending mode")
}

#[test]
fn tension_raises_bending_frequencies_as_that_of_a_beam_and_pressure_lowers_them() {
    let case = bar();
    // A unit tension at both ends gives the uniform stress 1 / A.
    let ends = |i: usize| if case.body.nodes[i][0] < -0.49 { -0.25 } else { 0.25 };
    let at_end = |i: usize| case.body.nodes[i][0].abs() > 0.49;
    let pull = Mat::from_fn(case.body.n_dofs(), 1, |row, _| {
        if row % 3 == 0 && at_end(row / 3) { ends(row / 3) } else { 0.0 }
    });
    let tension = given(LoadKind::Named("tension".to_owned()), 0, case.stressed(&pull));
    let body = converted(case.raw(vec![tension]), BodyFrame::Com);
    let matrix = &body.geometric_stiffness()[0].matrix;
    for axis in [1, 2] {
        let mode = bending_along(&body, axis);
        let shape = along_beam(|s| first_bending(s).0.powi(2)) / along_beam(|s| first_bending(s).1.powi(2));
        assert!((shape - 49.48).abs() < 0.01, "{shape}");
        let mass_per_length = body.invariants().mass();
        let ratio = matrix[(mode, mode)] / (shape / mass_per_length);
        println!("tension, bending along {axis}: {ratio:.4} of the beam's");
        assert!((ratio - 1.0).abs() < 0.02, "axis {axis}: {ratio}");
    }
    let lowest = |force: f64| {
        let k = body.invariants().modal_stiffness() + matrix * Scale(force);
        symmetric_eigen(k.as_ref()).0[0]
    };
    assert!(lowest(1e4) > 1.001 * lowest(0.0) && lowest(-1e4) < 0.999 * lowest(0.0));
}

#[test]
fn a_spinning_beam_stiffens_as_its_centrifugal_tension_says_and_softens_without() {
    let case = bar();
    let body = converted(case.raw(case.spin()), BodyFrame::Com);
    // Tension rho A w^2 (L^2/4 - x^2) / 2 about z or y; none about x.
    let tension = along_beam(|s| 0.5 * (0.25 - s * s) * first_bending(s).0.powi(2))
        / along_beam(|s| first_bending(s).1.powi(2));
    for (spin_axis, bending) in [(2, 2), (2, 1), (1, 2), (1, 1)] {
        let mode = bending_along(&body, bending);
        let mut unit = vec![0.0; 6];
        unit[spin_axis] = 1.0;
        let found = stored(&body, &LoadKind::Spin, &unit)[(mode, mode)];
        println!("spin about {spin_axis}, bending along {bending}: {:.4} of the beam's", found / tension);
        assert!((found / tension - 1.0).abs() < 0.02, "{found} {tension}");
        // The centrifugal term subtracts 1 in the plane of rotation and 0 across it.
        let taken: f64 = (0..3)
            .filter(|k| *k != spin_axis)
            .map(|k| body.invariants().s().unwrap()[k][k][(mode, mode)])
            .sum();
        assert!(if bending == spin_axis { taken < 0.01 } else { taken > 0.99 });
        assert!(found > taken);
        // The equations of motion give the same at the rate of the first bending frequency.
        let (mut nu, lambda) = (vec![0.0; 16], body.modes().eigenvalue[mode]);
        nu[3 + spin_axis] = lambda.sqrt();
        let equations = EquationsOfMotion::new(&body, Terms::ALL);
        let mut evaluation = Evaluation::new(&equations);
        evaluation.set(&[0.0; 10], &nu);
        let (mut by_q, mut by_nu) = (vec![0.0; 16 * 10], vec![0.0; 16 * 16]);
        evaluation.jacobian(&[0.0; 16], &mut by_q, &mut by_nu);
        let stiffer = by_q[(6 + mode) * 10 + mode] / lambda - 1.0;
        assert!(
            (stiffer / (tension - taken) - 1.0).abs() < 0.1 && stiffer > 0.0,
            "{stiffer} {tension} {taken}"
        );
    }
}

#[test]
fn without_geometric_stiffness_the_report_tells_the_rate_and_centrifugal_loads_warn() {
    let turn = Rotation3::from_euler_angles(-0.8, 0.4, 2.0);
    let case = Case::skew_block();
    let case = Case::new(case.mesh.moved(turn.matrix(), [1.0, 2.0, 3.0]), case.material);
    let centrifugal = || BasisChoice::Free(FreeSurface { residual_vectors: vec![Loads::Centrifugal] });
    let done = run(case.raw(Vec::new()), BodyFrame::Com, centrifugal()).expect("a sound body");
    let warning = done.diagnostics.iter().find(|d| d.code() == Code::GeometricStiffnessNone);
    let invariants = done.body.invariants();
    let rates: Vec<f64> = (0..3).map(|k| done.body.softening_rate(k).expect("moves")).collect();
    for (axis, rate) in rates.iter().enumerate() {
        let nf = done.body.n_modes();
        let block = invariants.w2().expect("held");
        let taken = Mat::from_fn(nf, nf, |p, q| block[(axis * nf + p, axis * nf + q)]);
        for (part, lost) in [(0.0, false), (9.99, false), (10.01, true)] {
            let k = invariants.modal_stiffness() - &taken * Scale((part * rate).powi(2));
            let lowest = symmetric_eigen(k.as_ref()).0[0];
            assert_eq!(lowest < 0.0, lost, "axis {axis}, {part}: {lowest:e}");
        }
    }
    // The axes are those of the model in any frame of the body.
    let turned = run(case.raw(Vec::new()), BodyFrame::Principal, centrifugal()).expect("a sound body");
    assert!((turned.body.frame().axes - nalgebra::Matrix3::identity()).amax() > 0.1);
    for (axis, rate) in rates.iter().enumerate() {
        let other = turned.body.softening_rate(axis).expect("moves");
        assert!((other / rate - 1.0).abs() < 1e-9, "axis {axis}: {rate} {other}");
    }
    let words = |found: &[flexbody_base::diagnostic::Diagnostic]| {
        let told = found.iter().find(|d| d.code() == Code::GeometricStiffnessNone).expect("a warning");
        told.message().to_owned()
    };
    assert_eq!(words(&done.diagnostics), words(&turned.diagnostics));
    // The reported rate is the lowest of the missing stress stiffness about the axes of the model.
    let message = warning.expect("a warning").message();
    let words: Vec<&str> = message.split_whitespace().collect();
    let hertz = words.iter().position(|word| *word == "Hz").expect("a rate") - 1;
    let told: f64 = words[hertz].parse().expect("a number");
    let missing = (0..3).map(|axis| done.body.missing_rate(axis).expect("moves"));
    let slowest = missing.fold(f64::INFINITY, f64::min) / std::f64::consts::TAU;
    assert!((slowest / told - 1.0).abs() < 1e-3, "{slowest}: {message}");
    // The worst spin is the lowest over all axes, and one axis attains it.
    let rate = |part: f64| (0.01 / part).sqrt();
    let worst = rate(done.body.worst_spin().expect("moves").1);
    let about = |axis: &Vector3<f64>| rate(done.body.softening(&axis.normalize()).expect("moves"));
    let random = &mut Random(3);
    let slowest = (0..400).map(|_| about(&Vector3::from(random.vector::<3>()))).fold(f64::INFINITY, f64::min);
    assert!(slowest >= worst * (1.0 - 1e-4) && slowest < worst * 1.02, "{slowest} {worst}");
    let told = |body: &FlexBody, format| render(&Facts::new(body, &RunData::default()), format);
    let json: serde_json::Value = serde_json::from_str(&told(&done.body, Format::Json)).expect("JSON");
    for (axis, rate) in rates.iter().enumerate() {
        let hertz = json["modes"]["softening_hz"][axis].as_f64().expect("a number");
        assert!((hertz * std::f64::consts::TAU / rate - 1.0).abs() < 1e-14);
    }
    let text = told(&done.body, Format::Text);
    assert!(
        text.contains("spin        no geometric stiffness: about 1 % of a stiffness is missing at"),
        "{text}"
    );
    for axis in 0..3 {
        let hertz = json["modes"]["stress_hz"][axis].as_f64().expect("a number");
        let rate = done.body.missing_rate(axis).expect("moves");
        assert!((hertz * std::f64::consts::TAU / rate - 1.0).abs() < 1e-14);
    }

    let stiffened = run(case.raw(case.spin()), BodyFrame::Principal, centrifugal()).expect("a sound body");
    assert!(stiffened.diagnostics.iter().all(|d| d.code() != Code::GeometricStiffnessNone));
    let json: serde_json::Value = serde_json::from_str(&told(&stiffened.body, Format::Json)).expect("JSON");
    assert!(json["modes"]["softening_hz"].is_null());
    assert!(json["modes"]["stress_hz"].is_null());
    let alone = run(case.raw(Vec::new()), BodyFrame::Principal, BasisChoice::default()).expect("sound");
    assert!(alone.diagnostics.iter().all(|d| d.code() != Code::GeometricStiffnessNone));
}

fn failed(checks: &[IdentityCheck]) -> Vec<&'static str> {
    checks.iter().filter(|check| !check.passed).map(|check| check.name).collect()
}

#[test]
fn file_reports_and_recomputation_hold_what_was_given() {
    let case = Case::skew_block();
    let mut raw = case.raw(case.spin());
    raw.data.geometric_stiffness.push(given(LoadKind::Force("tip".to_owned()), 2, case.pulled([0, 1], 2)));
    let scaled: Vec<_> = entries(&raw.stiffness.matrix).map(|(r, c, v)| (r, c, 2e-6 * v)).collect();
    let n = case.body.n_dofs();
    let matrix = CscMatrix::from_triplets(n, n, &scaled);
    raw.data.damping = Some(Damping::Matrix(RawMatrix { matrix, ..raw.stiffness.clone() }));
    let body = converted(raw.clone(), BodyFrame::Principal);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("b.flex.h5");
    flexbody_file::write(&body, &path).expect("written");
    assert_eq!(flexbody_file::read(&path).expect("read"), body);

    let facts = Facts::new(&body, &RunData::default());
    let json: serde_json::Value = serde_json::from_str(&render(&facts, Format::Json)).expect("JSON");
    let schema =
        serde_json::from_str(include_str!("../../../../schemas/report.schema.json")).expect("a schema");
    assert!(jsonschema::validator_for(&schema).expect("a schema").is_valid(&json));
    // Largest |kappa| of K_geo v = kappa K_ff v, with diagonal K_ff.
    let g = &body.geometric_stiffness()[0];
    let lambda = &body.modes().eigenvalue;
    let relative = Mat::from_fn(10, 10, |p, q| g.matrix[(p, q)] / (lambda[p] * lambda[q]).sqrt());
    let norm = symmetric_eigen(relative.as_ref()).0.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let told = &json["modes"]["geometric_stiffness"][0];
    assert_eq!(told["load"], "spin xx");
    assert!((told["relative_norm"].as_f64().expect("a number") / norm - 1.0).abs() < 1e-9);
    assert!(render(&facts, Format::Html).contains("force z at `tip`"));
    assert!(render(&facts, Format::Text).contains("spin xz (body axes): up to"));

    let model = FeModel::from_raw(raw.clone()).expect("sound").model;
    let checks = verify(&body, &model).expect("the same nodes");
    assert_eq!(failed(&checks), Vec::<&str>::new());
    assert!(checks.iter().any(|check| check.name == "damping_recomputed"));
    let tampered = |change: &dyn Fn(&mut flexbody_body::flex_body::Parts)| {
        let mut parts = body.clone().into_parts();
        change(&mut parts);
        let path = folder.path().join("tampered.flex.h5");
        flexbody_file::write(&FlexBody::new(parts).expect("valid"), &path).expect("written");
        failed(&verify(&flexbody_file::read(&path).expect("read"), &model).expect("the same nodes"))
    };
    let damping = ["damping_recomputed"];
    assert_eq!(tampered(&|p| p.modes.damping_ratio[0] *= 1.001), damping);
    assert_eq!(tampered(&|p| p.modes.modal_damping.as_mut().expect("damped")[(0, 0)] *= 1.001), damping);
    assert_eq!(tampered(&|p| p.modes.modal_damping = None), damping);
    let geometric = ["geometric_stiffness_recomputed"];
    assert_eq!(tampered(&|p| p.geometric_stiffness[1].matrix[(0, 3)] *= 1.0 + 1e-6), geometric);
    let fewer = |p: &mut flexbody_body::flex_body::Parts| {
        p.geometric_stiffness.truncate(5);
        p.rotated_stiffness.truncate(5);
    };
    assert_eq!(tampered(&fewer), geometric);
    assert_eq!(
        tampered(&|p| p.rotated_stiffness[1].modes[(2, 1)] += 1e-5 * p.rotated_stiffness[1].modes.norm_max()),
        geometric
    );
    assert_eq!(tampered(&|p| p.rotated_stiffness.clear()), Vec::<&str>::new());
    let none = raw.with(|data| {
        data.geometric_stiffness = Vec::new();
        data.damping = None;
    });
    let none = FeModel::from_raw(none).expect("sound").model;
    let both = ["damping_recomputed", "geometric_stiffness_recomputed"];
    assert_eq!(failed(&verify(&body, &none).expect("the same nodes")), both);
}

#[test]
fn ratios_bands_and_rayleigh_damping_are_recomputed_too() {
    let case = Case::skew_block();
    for damping in [Damping::Ratio(0.02), Damping::Rayleigh { alpha: 3.0, beta: 1e-6 }] {
        let raw = case.body.raw_model().with(|data| data.damping = Some(damping));
        let model = FeModel::from_raw(raw.clone()).expect("sound").model;
        let body = converted(raw, BodyFrame::Principal);
        assert_eq!(failed(&verify(&body, &model).expect("the same nodes")), Vec::<&str>::new());
        let mut parts = body.into_parts();
        parts.modes.damping_ratio[9] *= 1.0 + 1e-9;
        let body = FlexBody::new(parts).expect("valid");
        assert_eq!(failed(&verify(&body, &model).expect("the same nodes")), ["damping_recomputed"]);
    }
}

#[test]
fn loads_and_matrices_that_do_not_fit_are_refused() {
    let case = Case::skew_block();
    let n = case.body.n_dofs();
    let one = |entries: &[(u32, u32, f64)]| CscMatrix::from_triplets(n, n, entries);
    let sound = || one(&[(3, 3, -1.0), (3, 40, 2.0), (40, 3, 2.0)]);
    assert!(
        run(
            case.raw(vec![given(LoadKind::Named("string".to_owned()), 0, string(n, [1, 13], 2.0))]),
            BodyFrame::Com,
            BasisChoice::default()
        )
        .is_ok()
    );
    let tip = |name: &str| LoadKind::Force(name.to_owned());
    for (list, code, said) in [
        (vec![given(LoadKind::Spin, 6, sound())], Code::ManifestSyntax, "has xx, yy, zz, xy, yz, xz"),
        (
            vec![given(LoadKind::Spin, 1, sound()), given(LoadKind::Spin, 1, sound())],
            Code::ManifestSyntax,
            "spin yy is given twice",
        ),
        (
            vec![given(LoadKind::Named(String::new()), 0, sound())],
            Code::ManifestSyntax,
            "has no name, or one that is too long",
        ),
        (
            vec![given(tip("top"), 0, sound())],
            Code::InterfaceNode,
            "force x at `top`; interfaces of the model: tip",
        ),
        (
            vec![given(tip("tip"), 0, one(&[(3, 4, 1.0)]))],
            Code::MatrixAsymmetric,
            "geometric stiffness matrix is not symmetric",
        ),
        (
            vec![given(tip("tip"), 0, one(&[(3, 40, 1.0), (40, 3, 1.0 + 1e-9)]))],
            Code::MatrixAsymmetric,
            "not symmetric",
        ),
        (
            vec![given(tip("tip"), 0, one(&[(3, 3, f64::NAN)]))],
            Code::MatrixNotFinite,
            "geometric stiffness matrix has NaN",
        ),
        (
            vec![given(LoadKind::Named("string".to_owned()), 0, string(n, [1, 13], 1e300))],
            Code::MatrixNotFinite,
            "load `string` overflows",
        ),
        (
            vec![given(tip("tip"), 0, CscMatrix::from_triplets(3, 3, &[(0, 0, 1.0)]))],
            Code::MatrixSizesDiffer,
            "geometric stiffness matrix 3",
        ),
    ] {
        let error = refusal(case.raw(list));
        assert!(error.has(code) && error.to_string().contains(said), "{code:?}: {error}");
    }
}

#[test]
fn bodies_of_one_pair_of_matrices_take_their_own_rows() {
    let mesh = Mesh::two_bodies(ElementKind::Hex8, 1);
    let case = Case::new(mesh, Material::STEEL);
    let mut raw = case.raw(Vec::new());
    raw.data.interfaces[0].nodes = vec![1];
    let n = case.body.n_dofs();
    let first = FeModel::bodies_from_raw(raw.clone()).expect("two bodies")[0].model.nodes().ids.clone();
    let others: Vec<i64> = (1..=16).filter(|id| !first.contains(id)).collect();
    let at = |id: i64| id as usize - 1;
    let row = |id: i64| 3 * at(id) as u32;
    let (mine, other) = (row(first[1]), row(others[0]));
    // A string under unit compression along x, from the tip to the node one unit away, pushes the tip along
    // x.
    let place = |id: i64| case.body.nodes[at(id)];
    let beside = |id: &i64| (0..3).all(|k| place(*id)[k] == place(1)[k] + if k == 0 { 1.0 } else { 0.0 });
    let neighbour = *first.iter().find(|id| beside(id)).expect("a unit cube");
    let own = string(n, [0, at(neighbour)], -1.0);
    let inside = [[first[0], first[1]], [others[0], others[1]]];
    let both: Vec<_> = inside
        .iter()
        .zip([1.0, 2.0])
        .flat_map(|(ends, size)| entries(&string(n, ends.map(at), size)).collect::<Vec<_>>())
        .collect();
    let both = CscMatrix::from_triplets(n, n, &both);
    raw.data.geometric_stiffness = vec![
        given(LoadKind::Named("heat".to_owned()), 0, both.clone()),
        given(LoadKind::Force("tip".to_owned()), 0, own),
    ];
    let bodies = FeModel::bodies_from_raw(raw.clone()).expect("two bodies");
    let kept = |b: usize| -> Vec<(String, f64)> {
        let all = bodies[b].model.geometric_stiffness().iter();
        all.map(|g| (g.load.label(), g.matrix.as_csc().values().iter().map(|v| v.abs()).sum())).collect()
    };
    assert_eq!(kept(0), [("load_heat".to_owned(), 12.0), ("force_x_tip".to_owned(), 12.0)]);
    assert_eq!(kept(1), [("load_heat".to_owned(), 24.0)]);

    raw.data.geometric_stiffness[1].matrix.matrix = both;
    let error = FeModel::bodies_from_raw(raw.clone()).expect_err("a force on another body");
    assert!(error.has(Code::BodiesCoupled) && error.to_string().contains("the interface belongs to body 1"));
    raw.data.geometric_stiffness[0].matrix.matrix =
        CscMatrix::from_triplets(n, n, &[(mine, other, 1.0), (other, mine, 1.0)]);
    let error = FeModel::bodies_from_raw(raw).expect_err("coupled");
    assert!(error.to_string().contains("geometric stiffness for load `heat` couples node"), "{error}");
}

#[test]
fn files_without_the_group_are_older_and_those_that_break_it_are_refused() {
    let case = Case::skew_block();
    let body = converted(case.raw(case.spin()), BodyFrame::Com);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("b.flex.h5");
    let changed = |change: &dyn Fn(&hdf5_metno::File)| {
        flexbody_file::write(&body, &path).expect("written");
        let file = hdf5_metno::File::open_rw(&path).expect("a file");
        change(&file);
        file.close().expect("closed");
        flexbody_file::read(&path)
    };
    // Digests exist since format 1.4.
    changed(&|file| {
        file.unlink("geometric_stiffness").expect("removed");
        file.unlink("rotated_stiffness").expect("removed");
    })
    .expect_err("changed");
    age(&path, 1, || {
        let error = flexbody_file::read(&path).err()?;
        Some(error.diagnostics()[0].message().to_owned())
    });
    let older = flexbody_file::read(&path).expect("readable");
    assert!(older.geometric_stiffness().is_empty());
    let text = |file: &hdf5_metno::File, place: &str, name: &str, value: &str| {
        let value: hdf5_metno::types::VarLenUnicode = value.parse().expect("text");
        let group = file.group(place).expect("a group");
        group.attr(name).expect("an attribute").write_scalar(&value).expect("written");
    };
    type Change<'a> = &'a dyn Fn(&hdf5_metno::File);
    let refused: [(Change<'_>, &str); 6] = [
        (
            &|f| f.relink("geometric_stiffness/spin_xx", "geometric_stiffness/spin_xw").expect("moved"),
            "/geometric_stiffness/spin_xw: expected a kind of load",
        ),
        (
            &|f| f.relink("geometric_stiffness/spin_xx", "geometric_stiffness/spin_zx").expect("moved"),
            "/geometric_stiffness/spin_zx: expected a kind of load",
        ),
        (
            &|f| f.unlink("geometric_stiffness/spin_yy/stiffness").expect("removed"),
            "/geometric_stiffness/spin_yy/stiffness: expected a dataset of 64-bit floats, found nothing",
        ),
        (
            &|f| text(f, "geometric_stiffness/spin_yy", "kind", "force"),
            "/geometric_stiffness/spin_yy@kind: expected `spin`, found \"force\"",
        ),
        (
            &|f| text(f, "geometric_stiffness/spin_yy", "axis", "xx"),
            "/geometric_stiffness/spin_yy@axis: expected `yy`",
        ),
        (
            &|f| text(f, "geometric_stiffness/spin_yy", "load_units", "kg"),
            "/geometric_stiffness/spin_yy@load_units: expected `s^-2`",
        ),
    ];
    for (change, said) in refused {
        let error = changed(change).expect_err(said);
        assert!(error.has(Code::BodySchema) && error.to_string().contains(said), "{said}: {error}");
    }
}
