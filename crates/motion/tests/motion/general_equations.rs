//! Bodies whose mass matrix does not commute with rotations (theory section 6): equations in constant
//! invariants compared with the unreduced nodal body, and both with conservation laws.

use faer::Mat;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, RigidMotion, condense, condense_general, primary_differences};
use flexbody_eigen::Wanted;
use flexbody_linalg::CscMatrix;
use flexbody_model::{FeModel, LoadKind};
use nalgebra::{DMatrix, DVector, Vector3};
use oracle::equations::{Coriolis, State};
use oracle::general::{
    FIXTURES, GeneralBody, NodalBody, Row, RowKind, dense, nodal_rates, pack, random_body, random_matrix,
    rates, raw_fixture, reduced_rates, rigid_velocities, rows, to_faer, unpack,
};
use oracle::integrate;
use oracle::motion::{Drift, Kept};
use oracle::nodal::{deviation, random_state};
use oracle::random::Random;
use oracle::reference;
use serde_json::Value;

#[test]
fn invariants_give_the_accelerations_of_the_nodes() {
    for seed in 0..20 {
        let body = random_body(seed);
        let reduced = body.invariants();
        let (state, _) = random_state(&mut Random(1000 + seed), body.n_modes(), 0.7);
        let error = deviation(&body.accelerations(&state), &reduced.accelerations(&state));
        assert!(error < 1e-12, "seed {seed}: {error:e}");
        let y = pack(&state);
        let rate = nodal_rates(&body, &y);
        assert!((&rate - reduced_rates(&reduced, &y)).norm() < 1e-12 * rate.norm(), "seed {seed}");

        let scale = body.energy(&state);
        assert!((reduced.energy(&state) - scale).abs() < 1e-13 * scale, "seed {seed}");
        let difference = body.linear_momentum(&state) - reduced.linear_momentum(&state);
        assert!(difference.norm() < 1e-13 * body.linear_momentum(&state).norm(), "seed {seed}");
        let difference = body.angular_momentum(&state) - reduced.angular_momentum(&state);
        assert!(difference.norm() < 1e-13 * body.angular_momentum(&state).norm(), "seed {seed}");
        // M is general: the formulas for M = Ms kron I give different accelerations.
        let wrong =
            deviation(&body.accelerations(&state), &body.accelerations_for_rotation_invariant_mass(&state));
        assert!(wrong > 1e-2, "seed {seed}: {wrong:e}");
    }
}

/// For M = Ms kron I, including internal rows, section 6 equals section 3, and the nodal formula of [ZG19]
/// holds.
#[test]
fn rotation_invariant_mass_gives_the_equations_of_section_three() {
    for seed in 0..10 {
        let mut random = Random(500 + seed);
        let positions: Vec<[f64; 3]> = (0..6).map(|_| random.vector::<3>()).collect();
        let place = |node| if node < 6 { RowKind::Displacement } else { RowKind::Internal };
        let rows: Vec<Row> =
            (0..8).flat_map(|node| [0, 1, 2].map(|axis| Row { kind: place(node), node, axis })).collect();
        let a = random_matrix(&mut random, 8, 8);
        let mass = (&a * a.transpose()).kronecker(&DMatrix::<f64>::identity(3, 3));
        let a = random_matrix(&mut random, 24, 24);
        let (stiffness, shapes) = (&a * a.transpose(), random_matrix(&mut random, 24, 5));
        let body =
            NodalBody::new(&to_faer(&stiffness), &to_faer(&mass), &rows, &positions, &to_faer(&shapes));
        let general = body.invariants();
        let (state, _) = random_state(&mut random, 5, 0.7);
        let exact = general.accelerations(&state);
        let section_three = general.reduced.free_accelerations(&state, Coriolis::Correct);
        let error = deviation(&exact, &section_three);
        assert!(error < 1e-12, "seed {seed}: {error:e}");
        let error = deviation(&exact, &body.accelerations_for_rotation_invariant_mass(&state));
        assert!(error < 1e-12, "seed {seed}, nodes: {error:e}");
        let (c1, nf) = (&general.reduced.c1, 5);
        for (b, j, k) in (0..3).flat_map(|b| (0..nf).flat_map(move |j| (0..3).map(move |k| (b, j, k)))) {
            let axis = Vector3::from_fn(|i, _| f64::from(u8::from(i == b)));
            let expected = axis.cross(&Vector3::from_fn(|i, _| c1[(i, j)]))[k];
            assert!((general.w0[(k, b * nf + j)] - expected).abs() < 1e-13 * general.w0.norm(), "W0");
        }
    }
}

/// A model of the fixtures about its centre of mass in model axes, with its reference numbers.
struct Fixture {
    body: NodalBody,
    eigenvalues: Vec<f64>,
    infinite: usize,
    reference: Value,
}

fn fixture(name: &str, modes: usize) -> Fixture {
    let folder = oracle::fixtures().join("models").join(name);
    let raw = raw_fixture(name);
    let text = std::fs::read_to_string(folder.join("expected.json")).expect("reference");
    let reference: Value = serde_json::from_str(&text).expect("JSON");
    let rows = rows(&raw);
    let (k, m) = (reference::dense(&raw.stiffness.matrix), reference::dense(&raw.mass.matrix));

    let rigid = rigid_velocities(&rows, &raw.nodes.positions);
    let block = rigid.transpose() * dense(&m) * &rigid;
    // Taken from the motions that a plane model has too.
    let com = Vector3::new(block[(1, 5)], -block[(0, 5)], block[(0, 4)]) / block[(0, 0)];
    let positions: Vec<[f64; 3]> =
        raw.nodes.positions.iter().map(|x| (Vector3::from(*x) - com).into()).collect();

    let found = reference::modes_of(&k, &m);
    assert_eq!(found.zero, if raw.dimension == 2 { 3 } else { 6 }, "{name}");
    let mut shapes = found.shapes.subcols(0, modes).to_owned();
    for mut shape in shapes.col_iter_mut() {
        let largest = (0..rows.len())
            .filter(|&i| rows[i].kind == RowKind::Displacement)
            .max_by(|&i, &j| shape[i].abs().total_cmp(&shape[j].abs()))
            .expect("displacements");
        if shape[largest] < 0.0 {
            shape *= faer::Scale(-1.0);
        }
    }
    Fixture {
        body: NodalBody::new(&k, &m, &rows, &positions, &shapes),
        eigenvalues: found.eigenvalues[..modes].to_vec(),
        infinite: found.infinite,
        reference,
    }
}

fn matrix(value: &Value) -> DMatrix<f64> {
    let number = |v: &Value| v.as_f64().expect("a number");
    let rows: Vec<Vec<f64>> = value
        .as_array()
        .expect("rows")
        .iter()
        .map(|row| row.as_array().expect("a row").iter().map(number).collect())
        .collect();
    DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

/// Two programs with two eigensolvers: the dense invariants computed by scipy for each fixture.
#[test]
fn invariants_of_the_fixtures_are_the_reference() {
    for name in FIXTURES {
        let fixture = fixture(name, 12);
        let reference = &fixture.reference;
        let lambda = reference["flexible_eigenvalues"].as_array().expect("eigenvalues");
        assert_eq!(lambda.len(), 12, "{name}");
        for (found, expected) in fixture.eigenvalues.iter().zip(lambda) {
            let error = (found / expected.as_f64().expect("a number") - 1.0).abs();
            assert!(error < 1e-10, "{name}: eigenvalue {error:e}");
        }
        assert_eq!(reference["eigenvalue_facts"]["infinite"], fixture.infinite, "{name}");
        let GeneralBody { reduced, w0 } = fixture.body.invariants();
        let size = reduced.inertia.norm().sqrt();
        let mass = reference["rigid_body"]["mass"].as_f64().expect("mass");
        assert!((reduced.mass / mass - 1.0).abs() < 1e-13, "{name}");
        assert!(reduced.first_moment.norm() < 1e-13 * size * mass.sqrt(), "{name}");
        let inertia = DMatrix::from_fn(3, 3, |k, l| reduced.inertia[(k, l)]);
        // Scaled by the Cauchy-Schwarz bounds: C1 and C2 vanish, and W0 if M is rotation invariant.
        for (what, found, scale) in [
            ("I0", &inertia, size * size),
            ("W0", &w0, mass.sqrt()),
            ("W1", &reduced.w1, size),
            ("W2", &reduced.w2, 1.0),
            ("W3", &reduced.w3, 1.0),
            ("C1", &reduced.c1, mass.sqrt()),
            ("C2", &reduced.c2, size),
            ("m_ff", &reduced.modal_mass, 1.0),
        ] {
            let expected = matrix(&reference["invariants"][what]);
            assert_eq!(found.shape(), expected.shape(), "{name} {what}");
            let error = (found - expected).norm() / scale;
            assert!(error < 1e-10, "{name} {what}: {error:e}");
        }
    }
}

const MODES: usize = 6;

/// Simulates a body spinning about its middle axis with a fifth of its first circular frequency, bent and
/// translating at the start.
fn tumble(fixture: &Fixture, periods: f64, rate: impl Fn(&DVector<f64>) -> DVector<f64>) -> Drift {
    let (body, omega) = (&fixture.body, fixture.eigenvalues.iter().map(|l| l.sqrt()).collect::<Vec<f64>>());
    let eigen = body.invariants().reduced.inertia.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let radius = eigen.eigenvalues[order[1]].sqrt();
    let [low, middle, high] = order.map(|i| eigen.eigenvectors.column(i).into_owned());
    let spin = 0.2 * omega[0];
    let start = State {
        origin: Vector3::new(0.3, -0.2, 0.5) * radius,
        axes: Random(7).rotation(),
        velocity: Vector3::new(0.2, 0.5, -0.4) * spin * radius,
        omega: (middle + 0.1 * low + 0.05 * high) * spin,
        q: DVector::from_fn(MODES, |j, _| 0.05 * radius * omega[0] / omega[j]),
        qd: DVector::zeros(MODES),
    };
    let kept = |state: &State| Kept {
        energy: body.energy(state),
        linear: body.linear_momentum(state),
        angular: body.angular_momentum(state),
    };
    let step = 0.6 / omega[MODES - 1];
    let steps = (periods * std::f64::consts::TAU / omega[0] / step).ceil() as usize;
    let (first, mut found, mut y) = (kept(&start), Drift::default(), pack(&start));
    for _ in 0..steps {
        y = integrate::step(&y, step, &rate);
        let state = unpack(&y);
        found.add(&first, &kept(&state), state.q.norm() / radius, state.omega.norm() * step);
    }
    found
}

#[test]
fn tumbling_bodies_keep_energy_and_momenta() {
    for name in ["frame_beams", "shell_folded", "mpc_block"] {
        let fixture = fixture(name, MODES);
        let reduced = fixture.body.invariants();
        let drift = tumble(&fixture, 20.0, |y| reduced_rates(&reduced, y));
        assert!(drift.deformation > 0.05 && drift.turns > 3.0, "{name}: {drift:?}");
        assert!(drift.worst() < 1e-10, "{name}: {drift:?}");
    }
}

/// Formulas for M = Ms kron I fail for a frame whose M is not of that kind, as theory section 6 warns.
#[test]
#[ignore = "slow"]
fn formulas_for_rotation_invariant_mass_drift_on_a_frame() {
    let fixture = fixture("frame_beams", MODES);
    let (body, exact) = (&fixture.body, fixture.body.invariants());
    // The nodal formula of [ZG19], and section 3 with the correct invariants although W3 is not skew.
    let nodes = |y: &DVector<f64>| rates(y, |s| body.accelerations_for_rotation_invariant_mass(s));
    let section_three =
        |y: &DVector<f64>| rates(y, |s| exact.reduced.free_accelerations(s, Coriolis::Correct));
    for (what, drift) in
        [("nodes", tumble(&fixture, 20.0, nodes)), ("section 3", tumble(&fixture, 20.0, section_three))]
    {
        // These formulas err by the mass that does not rotate with the nodes (7e-6 to 4e-5 and 1.3e-5 to
        // 1.2e-4 were measured); the correct ones conserve to 1e-10.
        assert!(drift.energy > 1e-6 && drift.angular > 2e-6, "{what}: {drift:?}");
    }
}

/// Returns the conversion of a fixture about its centre of mass in model axes.
fn converted(name: &str, modes: usize) -> Conversion {
    let raw = raw_fixture(name);
    let model = FeModel::from_raw(raw).expect("a body").model;
    let settings = ConvertSettings {
        modes: ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() },
        frame: BodyFrame::Com.into(),
        ..ConvertSettings::default()
    };
    convert(&model, &settings, &flexbody_linalg::context::Context::QUIET).expect("converts")
}

/// Returns the invariants of a conversion with the signs of `like`; rotations may leave the signs
/// undetermined.
fn signed(conversion: &Conversion, like: &GeneralBody) -> GeneralBody {
    let own = conversion.body.invariants();
    let nf = own.n_modes();
    let w2 = own.w2().expect("held");
    // The relative sign of modes 0 and j is that of their largest product.
    let sign = |j: usize| {
        let products = (0..9).map(|ab| (ab / 3 * nf, ab % 3 * nf + j));
        let (a, b) = products
            .max_by(|&(a, b), &(c, d)| {
                like.reduced.w2[(a, b)].abs().total_cmp(&like.reduced.w2[(c, d)].abs())
            })
            .expect("nine products");
        if w2[(a, b)] * like.reduced.w2[(a, b)] < 0.0 { -1.0 } else { 1.0 }
    };
    let t = Mat::from_fn(nf, nf, |i, j| if i == j { sign(j) } else { 0.0 });
    let own = own.with_basis(t.as_ref());
    // The sign of the first mode follows from linear terms.
    let mut result = GeneralBody { reduced: oracle::nodal::reduced(&own), w0: dense(&own.w0()) };
    let linear = |body: &GeneralBody| body.reduced.w1.dot(&like.reduced.w1) + body.w0.dot(&like.w0);
    if linear(&result) < 0.0 {
        result.reduced.w1 *= -1.0;
        result.w0 *= -1.0;
    }
    result
}

/// Returns the rows for the rotation about z and in-plane displacements of a matrix with these blocks of
/// rows.
fn in_plane(a: &DMatrix<f64>, rows: &[usize], columns: &[usize]) -> DMatrix<f64> {
    a.select_rows(rows).select_columns(columns)
}

/// Compares the stiffness of inertia with the reference, which computes it from second-order displacements of
/// the directors; signs of modes are free.
fn assert_stiffness_of_inertia(name: &str, body: &FlexBody, reference: &Value) {
    let Some(own) = body.inertia_stiffness() else {
        return assert!(reference["K_a"].is_null(), "{name} turns");
    };
    let nf = body.n_modes();
    for (kind, what) in [
        (LoadKind::Acceleration, "K_a"),
        (LoadKind::AngularAcceleration, "K_alpha"),
        (LoadKind::Spin, "K_omega"),
    ] {
        let all = matrix(&reference[what]);
        let modes = all.ncols();
        for stiffness in own.stiffness.iter().filter(|stiffness| stiffness.load.kind == kind) {
            let expected = all.view((stiffness.load.component * modes, 0), (nf, nf));
            let error = (dense(&stiffness.matrix).abs() - expected.abs()).amax() / all.amax();
            assert!(error < 1e-9, "{name} {}: {error:e}", stiffness.load.label());
        }
    }
}

#[test]
fn conversions_have_these_invariants_and_move_like_the_nodes() {
    for name in FIXTURES {
        let nf = 8;
        let fixture = fixture(name, nf);
        let conversion = converted(name, nf);
        let expected = fixture.body.invariants();
        for (found, expected) in conversion.body.modes().eigenvalue.iter().zip(&fixture.eigenvalues) {
            assert!((found / expected - 1.0).abs() < 1e-10, "{name}: {found} {expected}");
        }
        let found = signed(&conversion, &expected);
        let size = expected.reduced.inertia.norm().sqrt();
        let mass = expected.reduced.mass.sqrt();
        assert!((found.reduced.mass / expected.reduced.mass - 1.0).abs() < 1e-13, "{name}");
        let plane = conversion.body.dimension() == 2;
        let (space, all): (Vec<usize>, Vec<usize>) = ((0..3).collect(), (0..3 * nf).collect());
        let (z, blocks, axes): (Vec<usize>, Vec<usize>, Vec<usize>) = if plane {
            (vec![2], (2 * nf..3 * nf).collect(), vec![0, 1])
        } else {
            (space.clone(), all, space)
        };
        let modes: Vec<usize> = (0..nf).collect();
        let inertia = |body: &GeneralBody| DMatrix::from_fn(3, 3, |k, l| body.reduced.inertia[(k, l)]);
        for (what, a, b, rows, columns, scale) in [
            ("I0", &inertia(&found), &inertia(&expected), &z, &z, size * size),
            ("W0", &found.w0, &expected.w0, &axes, &blocks, mass),
            ("W1", &found.reduced.w1, &expected.reduced.w1, &z, &blocks, size),
            ("W2", &found.reduced.w2, &expected.reduced.w2, &blocks, &blocks, 1.0),
            ("W3", &found.reduced.w3, &expected.reduced.w3, &blocks, &modes, 1.0),
            ("C1", &found.reduced.c1, &expected.reduced.c1, &axes, &modes, mass),
            ("C2", &found.reduced.c2, &expected.reduced.c2, &z, &modes, size),
            ("m_ff", &found.reduced.modal_mass, &expected.reduced.modal_mass, &modes, &modes, 1.0),
        ] {
            let error = (in_plane(a, rows, columns) - in_plane(b, rows, columns)).norm() / scale;
            assert!(error < 1e-9, "{name} {what}: {error:e}");
        }
        assert_stiffness_of_inertia(name, &conversion.body, &fixture.reference["invariants"]);
        if plane {
            continue;
        }
        // The unreduced nodes, moved by the modes of the conversion.
        let nodes = nodal_body(name, &conversion.body);
        let own = conversion.body.invariants();
        let own = GeneralBody { reduced: oracle::nodal::reduced(own), w0: dense(&own.w0()) };
        let (mut state, _) = random_state(&mut Random(77), nf, 0.05 * size);
        // Spin and modes have one time scale; otherwise elastic forces would dominate all others.
        let rate = fixture.eigenvalues[0].sqrt();
        state.omega *= 0.1 * rate;
        state.velocity *= rate * size;
        for j in 0..nf {
            state.q[j] *= fixture.eigenvalues[0] / fixture.eigenvalues[j];
            state.qd[j] *= rate;
        }
        // The origin of some bodies has no acceleration about the centre of mass.
        let scale = state.omega.norm_squared() * size / mass;
        let (a, b) = (nodes.accelerations(&state), own.accelerations(&state));
        let error = (a.rows(0, 3) - b.rows(0, 3)).norm() / scale.max(a.rows(0, 3).norm());
        assert!(error < 1e-10, "{name}: accelerations {error:e}");
        for (start, count) in [(3, 3), (6, nf)] {
            let (a, b) = (a.rows(start, count), b.rows(start, count));
            let error = (a - b).norm() / a.norm();
            assert!(error < 1e-10, "{name}: accelerations {error:e}");
        }
    }
}

/// Returns the unreduced model of a fixture with the modes of its body, including rotations and internal
/// rows.
fn nodal_body(name: &str, body: &FlexBody) -> NodalBody {
    let raw = raw_fixture(name);
    let (modes, ids) = (body.modes(), &body.nodes().ids);
    let rows = rows(&raw);
    let place =
        |node: usize| ids.iter().position(|id| *id == raw.nodes.ids[node]).expect("a node of the body");
    let shapes = Mat::from_fn(rows.len(), body.n_modes(), |i, j| {
        let Row { kind, node, axis } = rows[i];
        match kind {
            RowKind::Displacement => modes.shape[(3 * place(node) + axis, j)],
            RowKind::Rotation => modes.rotation.as_ref().expect("rotations")[(3 * place(node) + axis, j)],
            RowKind::Director => unreachable!("no row of a model"),
            RowKind::Internal => {
                let internal = modes.internal.as_ref().expect("rows without a place");
                let label = [node as i64, axis as i64 + 1];
                internal.shape[(internal.dofs.iter().position(|dof| *dof == label).expect("labelled"), j)]
            }
        }
    });
    let mut positions = raw.nodes.positions.clone();
    for (node, x) in positions.iter_mut().enumerate() {
        *x = body.nodes().positions[place(node)];
    }
    let (k, m) = (reference::dense(&raw.stiffness.matrix), reference::dense(&raw.mass.matrix));
    NodalBody::new(&k, &m, &rows, &positions, &shapes)
}

/// The invariants of the conversion conserve energy and momenta.
#[test]
fn converted_bodies_keep_energy_and_momenta() {
    for name in ["frame_beams", "shell_folded", "mpc_block"] {
        let fixture = fixture(name, MODES);
        let found = signed(&converted(name, MODES), &fixture.body.invariants());
        let drift = tumble(&fixture, 20.0, |y| reduced_rates(&found, y));
        assert!(drift.deformation > 0.05 && drift.turns > 3.0, "{name}: {drift:?}");
        assert!(drift.energy < 1e-9 && drift.linear < 1e-9 && drift.angular < 1e-9, "{name}: {drift:?}");
    }
}

/// Section 6 agrees with sections 2 to 3 for solids, in any frame.
#[test]
fn the_general_condensation_of_a_solid_is_that_of_its_scalar_mass() {
    for name in ["cube_hex8", "bracket_hex20"] {
        let raw = raw_fixture(name);
        let model = FeModel::from_raw(raw).expect("a body").model;
        let scalar = model.scalar_mass().expect("a solid");
        let n = 3 * scalar.n();
        let entries: Vec<(u32, u32, f64)> = (0..n as u32)
            .flat_map(|row| {
                let (columns, values) = scalar.row(row as usize / 3);
                columns.iter().zip(values).map(move |(&j, &v)| (row, 3 * j + row % 3, v)).collect::<Vec<_>>()
            })
            .collect();
        let whole = flexbody_linalg::SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &entries));
        let whole = whole.expect("symmetric");
        let mut random = Random(3);
        let shapes = Mat::from_fn(n, 5, |_, _| random.signed());
        let axes = random.rotation();
        let frame = flexbody_body::invariants::Frame { origin: Vector3::new(0.3, -0.1, 0.2), axes };
        let mut turned = shapes.clone();
        frame.rotate_shapes(&mut turned);
        let stiffness = Mat::identity(5, 5);
        let positions = frame.to_body(&model.nodes().positions);
        let expected = condense(scalar, &positions, turned.as_ref(), stiffness.clone());
        let mut fields = model.rigid_fields(frame.origin.into(), 1.0);
        frame.rotate_rigid(&mut fields);
        let motion = RigidMotion { fields: fields.as_ref(), displacements: n, axes };
        let general = condense_general(&whole, &motion, shapes.as_ref(), stiffness);
        for (what, error) in primary_differences(&expected, &general) {
            assert!(error < 1e-13, "{name} {what}: {error:e}");
        }
    }
}
