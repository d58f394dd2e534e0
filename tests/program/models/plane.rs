//! Plane bodies: two displacements per node, three rigid motions (theory section 4).

use faer::Mat;
use faer::linalg::solvers::Solve;
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_body::verification::verify;
use flexbody_eigen::{Accuracy, Wanted};
use flexbody_input::{ModelFiles, read_model};
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, GeometricStiffness, LoadKind, NodeSet, RawMatrix, RawModel, UnitLoad, check};
use nalgebra::{Matrix2, Vector2};
use oracle::plane::{DENSITY, HEIGHT, LENGTH, YOUNGS, rectangle};
use oracle::random::Random;

fn model(raw: RawModel) -> FeModel {
    check(raw).expect("a sound body").model
}

fn settings(modes: usize, frame: BodyFrame) -> ConvertSettings {
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() };
    ConvertSettings { modes, frame: frame.into(), ..ConvertSettings::default() }
}

fn converted(model: &FeModel, modes: usize, frame: BodyFrame) -> Conversion {
    convert(model, &settings(modes, frame), &Context::QUIET).expect("a sound body")
}

fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{what}: {found}, expected {expected}");
}

#[test]
fn rigid_properties_of_a_turned_rectangle_are_exact() {
    let (angle, origin) = (0.3, [5.0, -2.0]);
    let body = converted(&model(rectangle(6, 3, angle, origin)), 5, BodyFrame::Principal).body;
    assert_eq!(body.dimension(), 2);
    assert_eq!(body.certificate().rigid_modes, 3);
    assert_eq!(
        body.certificate().negative_pivots,
        Some(3 + body.certificate().proved_modes.expect("proved"))
    );
    let (mass, inertia) = (DENSITY * LENGTH * HEIGHT, body.invariants().inertia());
    close(body.invariants().mass(), mass, 1e-13, "m");
    close(inertia[(2, 2)], mass * (LENGTH.powi(2) + HEIGHT.powi(2)) / 12.0, 1e-12, "J0");
    close(inertia[(0, 0)], mass * HEIGHT.powi(2) / 12.0, 1e-12, "axis along the length");
    let centre = Matrix2::new(angle.cos(), -angle.sin(), angle.sin(), angle.cos())
        * Vector2::new(0.5 * LENGTH, 0.5 * HEIGHT)
        + Vector2::from(origin);
    close(body.frame().origin.x, centre.x, 1e-13, "centre x");
    close(body.frame().origin.y, centre.y, 1e-13, "centre y");
    close(body.frame().axes[(0, 0)], angle.cos(), 1e-12, "first axis");
    assert_eq!(body.frame().axes.column(2).as_slice(), [0.0, 0.0, 1.0]);
}

/// The kinetic energy of every nodal motion equals that of the condensed terms: the mass matrix of theory
/// section 4, J0 = I0_zz, b = W1_zz / 2, and the z rows of C2 and W3.
#[test]
fn kinetic_energy_equals_that_of_the_nodes() {
    for &frame in BodyFrame::ALL {
        let model = model(rectangle(5, 2, 0.7, [1.0, 2.0]));
        let body = converted(&model, 12, frame).body;
        let invariants = body.invariants();
        let nf = invariants.n_modes();
        let (derived, i0) = (invariants.derived(), invariants.inertia());
        let (w1, w3) = (derived.w1.expect("held"), derived.w3.expect("held"));
        let shape = &body.modes().shape;
        let x = &body.nodes().positions;
        let mut random = Random(11);
        for _ in 0..20 {
            let v = Vector2::from(random.vector::<2>());
            let spin = random.signed();
            let q: Vec<f64> = (0..nf).map(|_| 3.0 * random.signed()).collect();
            let qd: Vec<f64> = (0..nf).map(|_| 3.0 * random.signed()).collect();
            let field = |coordinates: &[f64], row: usize| -> f64 {
                coordinates.iter().enumerate().map(|(j, c)| c * shape[(row, j)]).sum()
            };
            // Velocity v + theta' x r + u' in body axes.
            let velocity: Vec<[f64; 2]> = (0..x.len())
                .map(|i| {
                    let r = [x[i][0] + field(&q, 3 * i), x[i][1] + field(&q, 3 * i + 1)];
                    [v.x - spin * r[1] + field(&qd, 3 * i), v.y + spin * r[0] + field(&qd, 3 * i + 1)]
                })
                .collect();
            let mut nodal = 0.0;
            for i in 0..x.len() {
                let (columns, values) = model.scalar_mass().expect("a solid").row(i);
                for (&j, m) in columns.iter().zip(values) {
                    let other = velocity[j as usize];
                    nodal += 0.5 * m * (velocity[i][0] * other[0] + velocity[i][1] * other[1]);
                }
            }
            let modal = |f: &dyn Fn(usize) -> f64, c: &[f64]| -> f64 { (0..nf).map(|j| f(j) * c[j]).sum() };
            let s = [0, 1].map(|k| invariants.first_moment()[k] + modal(&|j| invariants.c1()[(k, j)], &q));
            let squared =
                |a: &[f64], b: &[f64]| -> f64 { modal(&|i| modal(&|j| derived.modal_mass[(i, j)], b), a) };
            let inertia = i0[(2, 2)] + modal(&|j| w1[(2, 2 * nf + j)], &q) + squared(&q, &q);
            let coupling = modal(&|j| derived.c2[(2, j)] + modal(&|i| w3[(2 * nf + i, j)], &q), &qd);
            let drift = [0, 1].map(|k| modal(&|j| invariants.c1()[(k, j)], &qd));
            let reduced = 0.5 * invariants.mass() * v.norm_squared()
                + 0.5 * inertia * spin * spin
                + 0.5 * squared(&qd, &qd)
                + spin * (v.y * s[0] - v.x * s[1])
                + v.x * drift[0]
                + v.y * drift[1]
                + spin * coupling;
            close(reduced, nodal, 1e-13, frame.name());
        }
    }
}

#[test]
fn identities_and_recomputation_hold() {
    let model = model(rectangle(7, 3, 1.1, [0.0, 0.0]));
    for accuracy in [Accuracy::Standard, Accuracy::Certified] {
        let mut settings = settings(9, BodyFrame::Principal);
        settings.modes.accuracy = accuracy;
        let body = convert(&model, &settings, &Context::QUIET).expect("a sound body").body;
        let checks = body.identities(BodyFrame::Principal);
        let recomputed = verify(&body, &model).expect("the same nodes");
        for check in checks.iter().chain(&recomputed) {
            assert!(check.passed, "{accuracy:?}, {}: {:e} > {:e}", check.name, check.value, check.limit);
        }
        assert_eq!(body.lumped().len(), 2);
    }
}

/// The first bending frequency of a slender bar agrees with Euler-Bernoulli theory up to shear and rotary
/// inertia.
#[test]
fn first_bending_frequency_is_that_of_a_beam() {
    let body = converted(&model(rectangle(160, 12, 0.0, [0.0, 0.0])), 1, BodyFrame::Principal).body;
    let (area, second) = (HEIGHT, HEIGHT.powi(3) / 12.0);
    let slenderness = 4.730_040_744_862_704f64;
    let omega = slenderness.powi(2) * (YOUNGS * second / (DENSITY * area * LENGTH.powi(4))).sqrt();
    // Shear and rotary inertia, which the theory neglects, lower the frequency by some 15 % at this
    // slenderness.
    let found = body.modes().eigenvalue[0].sqrt();
    assert!(found < omega && found > 0.75 * omega, "{found}, beam {omega}");
    // Halving the elements changes the frequency with the square of their size.
    let coarse = converted(&model(rectangle(40, 3, 0.0, [0.0, 0.0])), 1, BodyFrame::Principal).body;
    let middle = converted(&model(rectangle(80, 6, 0.0, [0.0, 0.0])), 1, BodyFrame::Principal).body;
    let value = |body: &FlexBody| body.modes().eigenvalue[0].sqrt();
    let order = ((value(&coarse) - value(&middle)) / (value(&middle) - found)).log2();
    assert!((1.8..2.2).contains(&order), "order {order}");
}

#[test]
fn all_modes_of_a_small_plate_are_found() {
    let raw = rectangle(3, 2, 0.2, [0.0, 0.0]);
    let n = 2 * raw.nodes.len();
    let dense = |a: &CscMatrix| Mat::from_fn(n, n, |i, j| a.get(i, j));
    let (k, m) = (dense(&raw.stiffness.matrix), dense(&raw.mass.matrix));
    let body = converted(&model(raw), 1000, BodyFrame::Principal).body;
    assert_eq!(body.n_modes(), n - 3);
    // Rigid eigenvalues are zero, so that the flexible ones add up to the trace of M^-1 K.
    let trace = m.partial_piv_lu().solve(&k).diagonal().column_vector().iter().sum::<f64>();
    close(body.modes().eigenvalue.iter().sum(), trace, 1e-11, "trace");
}

#[test]
fn what_leaves_the_plane_is_refused() {
    let mut raw = rectangle(2, 2, 0.0, [0.0, 0.0]);
    let mut labels = Vec::new();
    for &node in &raw.nodes.ids {
        labels.extend([1, 3].map(|direction| flexbody_model::DofLabel { node, direction }));
    }
    raw.dofs = Some(labels);
    let error = check(raw).expect_err("direction 3");
    assert!(error.has(Code::DirectionOutOfPlane), "{error}");
    let mut raw = rectangle(2, 2, 0.0, [0.0, 0.0]);
    raw.nodes.positions[3][2] = 1.0;
    assert!(check(raw).expect_err("z").has(Code::DirectionOutOfPlane));
    let raw = RawModel { dimension: 3, ..rectangle(2, 2, 0.0, [0.0, 0.0]) };
    assert!(check(raw).expect_err("two rows per node").has(Code::DofCount));
}

#[test]
fn geometric_stiffness_of_a_plane_body_is_about_z_and_in_its_plane() {
    let raw = rectangle(4, 2, 0.7, [1.0, 2.0]);
    let raw = raw.with(|data| data.interfaces = vec![NodeSet::new("corner", vec![1])]);
    let n = 2 * raw.nodes.len();
    let last = raw.nodes.len() - 1;
    // Strings from the first node to two others apply a unit force along an axis to it.
    let ends = [last, 4];
    let line = |end: usize| [0, 1].map(|k| raw.nodes.positions[end][k] - raw.nodes.positions[0][k]);
    let ratios = |axis: usize| {
        let lines = nalgebra::Matrix2::from_columns(&ends.map(|end| line(end).into()));
        lines.try_inverse().expect("two directions") * nalgebra::Vector2::ith(axis, 1.0)
    };
    let matrix_of = |ratios: nalgebra::Vector2<f64>| {
        let string = |(&end, &ratio): (&usize, &f64)| {
            (0..2).flat_map(move |k| {
                let [a, b] = [k, 2 * end + k].map(|row| row as u32);
                [(a, a, -ratio), (b, b, -ratio), (a, b, ratio), (b, a, ratio)]
            })
        };
        let all: Vec<_> = ends.iter().zip(ratios.iter()).flat_map(string).collect();
        CscMatrix::from_triplets(n, n, &all)
    };
    let given = |kind: LoadKind, component: usize| GeometricStiffness {
        matrix: RawMatrix { matrix: matrix_of(ratios(component)), ..raw.stiffness.clone() },
        load: UnitLoad { kind, component },
    };
    let with = |geometric_stiffness| raw.clone().with(|data| data.geometric_stiffness = geometric_stiffness);
    let force = || LoadKind::Force("corner".to_owned());
    let sound = model(with(vec![given(LoadKind::Named("strings".to_owned()), 0), given(force(), 0)]));
    let body = converted(&sound, 6, BodyFrame::Principal).body;
    let (axes, shape) = (body.frame().axes, &body.modes().shape);
    // Displacements of the first node relative to the end of a string, in the plane of the model.
    let stroke = |end: usize, j: usize| -> [f64; 2] {
        [0, 1].map(|k| (0..3).map(|l| axes[(k, l)] * (shape[(l, j)] - shape[(3 * end + l, j)])).sum())
    };
    // A force along x of the model has the components axes' x in the body frame.
    let expected =
        [("load_strings", 1.0), ("force_x_corner", axes[(0, 0)]), ("force_y_corner", axes[(0, 1)])];
    assert_eq!(body.geometric_stiffness().len(), expected.len());
    for (one, (label, part)) in body.geometric_stiffness().iter().zip(expected) {
        assert_eq!(one.load.label(), label);
        for p in 0..6 {
            for q in 0..6 {
                let pulls = ratios(0);
                let terms = ends.iter().zip(pulls.iter()).map(|(&end, ratio)| {
                    let [p, q] = [stroke(end, p), stroke(end, q)];
                    -ratio * part * (p[0] * q[0] + p[1] * q[1])
                });
                let (product, size) = terms.fold((0.0, 0.0), |(sum, size), t: f64| (sum + t, size + t.abs()));
                assert!((one.matrix[(p, q)] - product).abs() <= 1e-12 * (size + 1e-3), "{label} {p} {q}");
            }
        }
    }
    for check in verify(&body, &sound).expect("the same nodes") {
        assert!(check.passed, "{}: {:e} > {:e}", check.name, check.value, check.limit);
    }
    for (kind, component) in
        [(LoadKind::Spin, 0), (LoadKind::Acceleration, 2), (LoadKind::AngularAcceleration, 1)]
    {
        let load = UnitLoad { kind, component };
        let error = check(with(vec![GeometricStiffness { load, ..given(force(), 0) }]))
            .expect_err("out of the plane");
        assert!(error.to_string().contains("a body of dimension 2 has"), "{error}");
    }
}

/// A plate with two holes, meshed and assembled by scikit-fem, if the file is available.
#[test]
fn plane_stress_plate_agrees_with_its_reference() {
    let shared = oracle::shared();
    let folder = shared.join("models/i_plane_stress");
    let Ok(text) = std::fs::read_to_string(folder.join("ref.json")) else { return };
    let reference: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let files = ModelFiles::from_arguments(
        folder.join("K.mtx.gz"),
        folder.join("M.mtx.gz"),
        folder.join("nodes.csv"),
        Some(folder.join("dofs.csv")),
        Some("mm,t,s"),
    )
    .expect("files");
    let raw = read_model(&ModelFiles { dimension: 2, ..files }).expect("readable");
    let body = converted(&model(raw), 20, BodyFrame::Com).body;
    let rigid = &reference["consistent"];
    close(body.invariants().mass(), rigid["mass"].as_f64().expect("mass"), 1e-13, "m");
    close(body.invariants().inertia()[(2, 2)], rigid["inertia_com"][2][2].as_f64().expect("J0"), 1e-12, "J0");
    for k in 0..2 {
        close(body.frame().origin[k], rigid["com"][k].as_f64().expect("com"), 1e-13, "centre");
    }
    let lambda = reference["modes"]["lambda_"].as_array().expect("eigenvalues");
    for (found, expected) in body.modes().eigenvalue.iter().zip(lambda) {
        close(*found, expected.as_f64().expect("a number"), 1e-10, "lambda");
    }
    // The reference has an inertia count of another program, and the row sums of the mass matrix.
    let sylvester = &reference["modes"]["sylvester"];
    let (shift, count) = (&sylvester["lam"], &sylvester["count"]);
    let below = body.modes().eigenvalue.iter().filter(|l| **l < shift.as_f64().expect("a shift")).count();
    assert_eq!(Some(3 + below as u64), count.as_u64());
    let row_sum = body.lumped().iter().find(|lumped| lumped.scheme == "row-sum").expect("by default");
    let inertia = reference["rowsum_lumped"]["inertia_com"][2][2].as_f64().expect("J0");
    close(row_sum.invariants.inertia()[(2, 2)], inertia, 1e-12, "J0 of row sums");
    assert_eq!(Some(row_sum.negative_masses as u64), reference["rowsum_negative_rows"].as_u64());
}

/// A job with elements in the plane needs `--dimension 2` or `dimension = 2`; without them the error names
/// both.
#[test]
fn plane_jobs_are_read_with_their_dimension() {
    let folder = tempfile::tempdir().expect("a folder");
    let raw = rectangle(2, 1, 0.0, [0.0, 0.0]);
    let labels = raw.dofs.clone().unwrap_or_else(|| {
        let of = |&node: &i64| [1, 2].map(|direction| flexbody_model::DofLabel { node, direction });
        raw.nodes.ids.iter().flat_map(of).collect()
    });
    for (name, own) in [("job_STIF1.mtx", &raw.stiffness), ("job_MASS1.mtx", &raw.mass)] {
        let mut text = String::new();
        for column in 0..labels.len() {
            let (rows, values) = own.matrix.column(column);
            for (row, value) in rows.iter().zip(values) {
                let (a, b) = (labels[*row as usize], labels[column]);
                text += &format!("{},{}, {},{}, {value:?}\n", a.node, a.direction, b.node, b.direction);
            }
        }
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    let nodes: String = raw
        .nodes
        .ids
        .iter()
        .zip(&raw.nodes.positions)
        .map(|(id, x)| format!("{id}, {:?}, {:?}\n", x[0], x[1]))
        .collect();
    std::fs::write(folder.path().join("job.inp"), format!("*NODE\n{nodes}")).expect("written");
    std::fs::write(folder.path().join("model.toml"), "[model]\ndimension = 2\n[files]\njob = \"job.inp\"\n")
        .expect("written");
    let convert = |words: &[&str]| {
        let words: Vec<&str> =
            ["convert"].iter().chain(words).chain(&["--modes", "2", "-o", "b.h5"]).copied().collect();
        crate::program::flexbody(folder.path(), &words)
    };
    let told = convert(&["job.inp"]);
    assert_eq!(told.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&told.stderr).contains("--dimension 2"));
    for words in [&["job.inp", "--dimension", "2"][..], &["model.toml"]] {
        let done = convert(words);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        assert!(String::from_utf8_lossy(&done.stdout).contains("3 rigid modes"));
    }
    let told = convert(&["model.toml", "--dimension", "2"]);
    assert!(told.status.code() == Some(2) && String::from_utf8_lossy(&told.stderr).contains("[model]"));
}

/// Shapes stay in the plane and are M-orthonormal there.
#[test]
fn shapes_are_orthonormal_in_the_plane() {
    let model = model(rectangle(6, 2, 0.4, [3.0, 1.0]));
    let body = converted(&model, 8, BodyFrame::Principal).body;
    let shape = &body.modes().shape;
    let mut gram = Mat::<f64>::zeros(8, 8);
    for i in 0..model.nodes().len() {
        let (columns, values) = model.scalar_mass().expect("a solid").row(i);
        for (&j, m) in columns.iter().zip(values) {
            for p in 0..8 {
                for q in 0..8 {
                    for k in 0..3 {
                        gram[(p, q)] += m * shape[(3 * i + k, p)] * shape[(3 * j as usize + k, q)];
                    }
                }
            }
        }
    }
    assert!((&gram - Mat::<f64>::identity(8, 8)).norm_max() < 1e-12);
}
