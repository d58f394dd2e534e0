//! SID_FEM text represents the body. The equations of motion are evaluated from the file in the form used by
//! public readers.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::text::InputFile;
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_body::invariants::BodyFrame;
use flexbody_formats::export::{ExportFormat, ExportOptions, Points};
use flexbody_formats::find_import_format;
use flexbody_formats::import::ImportedFile;
use flexbody_formats::{export, find_format};
use flexbody_model::{GeometricStiffness, LoadKind, UnitLoad};
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, Terms};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use oracle::flexible::{fixture, stressed};
use oracle::partial::{combinations, with_groups};
use oracle::random::Random;

const MOTION: [LoadKind; 3] = [LoadKind::Spin, LoadKind::Acceleration, LoadKind::AngularAcceleration];

const MODES: usize = 5;

fn models() -> Vec<String> {
    let folder = oracle::fixtures().join("models");
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("fixtures")
        .map(|entry| entry.expect("entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn sid() -> &'static dyn ExportFormat {
    find_format("sid").expect("a format")
}

/// Returns the body of a model with random geometric stiffness for the motion of its frame in place of its
/// own.
fn strained(model: &str, random: &mut Random) -> FlexBody {
    let mut parts = fixture(model, MODES, BodyFrame::Model).into_parts();
    parts.geometric_stiffness.clear();
    parts.rotated_stiffness.clear();
    stressed(FlexBody::new(parts).expect("valid parts"), &MOTION, 1e-3, random)
}

fn dialect(name: &str) -> ExportOptions {
    ExportOptions { dialect: Some(name.to_owned()), ..ExportOptions::default() }
}

fn text(body: &FlexBody, options: &ExportOptions) -> String {
    let (exported, _) = export(body, sid(), options, true).expect("exports");
    String::from_utf8(exported.file).expect("text")
}

fn read(text: &str) -> ImportedFile {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("body.SID_FEM");
    std::fs::write(&path, text).expect("writes");
    let file = InputFile::open(&path).expect("opens");
    let format = find_import_format("sid").expect("a format");
    assert!(format.recognises(&file));
    format.read(&file).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns max |a - b| relative to max |b|.
fn apart(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
    assert_eq!((a.nrows(), a.ncols()), (b.nrows(), b.ncols()));
    let (d, size) = ((a - b).norm_max(), b.norm_max());
    if d == 0.0 { 0.0 } else { d / size }
}

fn same(a: &Mat<f64>, b: &Mat<f64>, what: &str) {
    let apart = apart(a, b);
    assert!(apart <= 1e-15, "{what}: {apart:e}");
}

fn stiffness(body: &[GeometricStiffness<Mat<f64>>], load: &UnitLoad) -> Option<Mat<f64>> {
    body.iter().find(|one| one.load == *load).map(|stiffness| stiffness.matrix.clone())
}

/// Arrays of the text, read by the test itself.
struct Arrays {
    nq: usize,
    lines: Vec<String>,
    dialect: &'static str,
}

impl Arrays {
    fn new(text: &str, dialect: &'static str, nq: usize) -> Self {
        let lines = text.lines().map(|line| line.split_whitespace().collect()).collect();
        Self { nq, lines, dialect }
    }

    fn names(&self, name: &'static str) -> &'static str {
        match (self.dialect, name) {
            ("morembs", "mdCM") => "mCM",
            ("morembs", "J") => "mmi",
            _ => name,
        }
    }

    fn section(&self, name: &'static str) -> &[String] {
        let name = self.names(name);
        let start = self.lines.iter().rposition(|line| line == name).expect("an object");
        let end = self.lines.iter().rposition(|line| *line == format!("end{name}")).expect("its end");
        &self.lines[start..end]
    }

    fn entry(&self, name: &'static str, key: &str) -> Option<f64> {
        let prefix = format!("{key}=");
        let line = self.section(name).iter().find_map(|line| line.strip_prefix(&prefix))?;
        Some(line.replace('D', "e").parse().expect("a number"))
    }

    fn m0(&self, name: &'static str, i: usize, j: usize) -> f64 {
        self.entry(name, &format!("m0({},{})", i + 1, j + 1)).unwrap_or(0.0)
    }

    fn m1(&self, name: &'static str, i: usize, j: usize, k: usize) -> f64 {
        let [first, middle, last] = match self.dialect {
            "fembeam" => [i, j, k],
            // Numbers in the storage order of EMBSlib, whose Modelica part takes them row by row.
            "embs" => {
                let (rows, at) = (self.rows(name), i * self.nq + k);
                [at % rows, at / rows, j]
            }
            _ => [i, k, j],
        };
        self.entry(name, &format!("m1({},{},{})", first + 1, middle + 1, last + 1)).unwrap_or(0.0)
    }

    fn rows(&self, name: &'static str) -> usize {
        let stated = self.section(name).iter().find_map(|line| line.strip_prefix("nrow="));
        stated.expect("a size").parse().expect("a number")
    }

    /// Returns a symmetric matrix, of which some dialects list one triangle.
    fn square(&self, name: &'static str) -> DMatrix<f64> {
        let entry = |i: usize, j: usize| self.entry(name, &format!("m0({},{})", i + 1, j + 1));
        DMatrix::from_fn(self.nq, self.nq, |i, j| entry(i, j).or_else(|| entry(j, i)).unwrap_or(0.0))
    }

    /// Returns M0 + sum_k M1_k q_k.
    fn at(&self, name: &'static str, nrow: usize, ncol: usize, q: &[f64]) -> DMatrix<f64> {
        DMatrix::from_fn(nrow, ncol, |i, j| {
            let moved: f64 = q.iter().enumerate().map(|(k, q)| self.m1(name, i, j, k) * q).sum();
            self.m0(name, i, j) + moved
        })
    }

    fn inertia(&self, q: &[f64]) -> Matrix3<f64> {
        if self.dialect == "fembeam" {
            // One triangle of J0 is listed.
            return Matrix3::from_fn(|i, j| {
                let moved: f64 = (0..self.nq).map(|k| self.m1("J", i, j, k) * q[k]).sum();
                self.m0("J", i.max(j), i.min(j)) + moved
            });
        }
        let j = self.at("J", 6, 1, q);
        Matrix3::new(j[0], j[3], j[4], j[3], j[1], j[5], j[4], j[5], j[2])
    }

    /// Returns Gr(qd) (3 x 3) or Ge(qd) (nq x 3), in the column order of the dialect.
    fn gyroscopic(&self, name: &'static str, nrow: usize, qd: &[f64]) -> DMatrix<f64> {
        let by_modes =
            ["fembeam", "embs"].contains(&self.dialect) || (self.dialect == "py-sid" && name == "Gr");
        DMatrix::from_fn(nrow, 3, |i, a| {
            let column = |k: usize| if by_modes { 3 * k + a } else { a * self.nq + k };
            qd.iter().enumerate().map(|(k, qd)| self.m0(name, i, column(k)) * qd).sum()
        })
    }

    /// Returns the left side of the equations of SID: forces (3), torques (3), modal forces.
    fn balance(&self, state: &State) -> DVector<f64> {
        let State { a, alpha, omega, q, qd, qdd } = state;
        let nq = self.nq;
        let mass: f64 = {
            let line = self.lines.iter().find_map(|line| line.strip_prefix("mass=")).expect("mass");
            line.replace('D', "e").parse().expect("a number")
        };
        let v3 = |m: DMatrix<f64>| Vector3::new(m[0], m[1], m[2]);
        let (rate, acceleration) = (DVector::from_column_slice(qd), DVector::from_column_slice(qdd));
        let moment = v3(self.at("mdCM", 3, 1, q));
        let (ct, cr) = (self.at("Ct", nq, 3, q), self.at("Cr", nq, 3, q));
        let j = self.inertia(q);
        let along = |c: &DMatrix<f64>, x: &DVector<f64>| {
            let y = c.transpose() * x;
            Vector3::new(y[0], y[1], y[2])
        };
        let force = mass * a - moment.cross(alpha)
            + along(&ct, &acceleration)
            + omega.cross(&omega.cross(&moment))
            + 2.0 * omega.cross(&along(&ct, &rate));
        let gr = self.gyroscopic("Gr", 3, qd) * DVector::from_column_slice(omega.as_slice());
        let torque = moment.cross(a)
            + j * alpha
            + along(&cr, &acceleration)
            + Vector3::new(gr[0], gr[1], gr[2])
            + omega.cross(&(j * omega));
        let w = omega;
        let products = [w.x * w.x, w.y * w.y, w.z * w.z, w.x * w.y, w.y * w.z, w.x * w.z];
        let modal = ct * DVector::from_column_slice(a.as_slice())
            + cr * DVector::from_column_slice(alpha.as_slice())
            + self.square("Me") * acceleration
            + self.gyroscopic("Ge", nq, qd) * DVector::from_column_slice(omega.as_slice())
            + self.at("Oe", nq, 6, q) * DVector::from_column_slice(&products)
            + self.square("Ke") * DVector::from_column_slice(q)
            + self.square("De") * rate;
        let rigid = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
        DVector::from_iterator(6 + nq, rigid.into_iter().chain(modal.iter().copied()))
    }
}

/// Accelerations of the origin and of the frame in body axes, and the modal state.
struct State {
    a: Vector3<f64>,
    alpha: Vector3<f64>,
    omega: Vector3<f64>,
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

impl State {
    /// Returns a state with modal coordinates and rates of the relative size `size` to the inertia of the
    /// body; a plane body moves in its plane.
    fn random(body: &FlexBody, size: f64, random: &mut Random) -> Self {
        let (nf, plane) = (body.n_modes(), body.dimension() == 2);
        let inertia = body.invariants().inertia().trace().sqrt();
        let rate = body.modes().eigenvalue[0].sqrt();
        let length = inertia / body.invariants().mass().sqrt();
        let mut vector = |scale: f64| Vector3::from(random.vector::<3>()) * scale;
        let (mut a, mut alpha, mut omega) = (vector(length * rate * rate), vector(rate * rate), vector(rate));
        if plane {
            (a.z, alpha.x, alpha.y, omega.x, omega.y) = (0.0, 0.0, 0.0, 0.0, 0.0);
        }
        let mut modal = |scale: f64| (0..nf).map(|_| scale * inertia * random.signed()).collect();
        Self { a, alpha, omega, q: modal(size), qd: modal(size * rate), qdd: modal(size * rate * rate) }
    }

    /// Returns the forces of the equations of the body, in the order and with the zeros of SID.
    fn own(&self, body: &FlexBody) -> DVector<f64> {
        let equations = EquationsOfMotion::new(body, Terms::ALL);
        let mut evaluation = Evaluation::new(&equations);
        let rigid: &[usize] = if body.dimension() == 2 { &[0, 1, 5] } else { &[0, 1, 2, 3, 4, 5] };
        let put = |linear: &Vector3<f64>, angular: &Vector3<f64>, modal: &[f64]| -> Vec<f64> {
            let of = |&i: &usize| if i < 3 { linear[i] } else { angular[i - 3] };
            rigid.iter().map(of).chain(modal.iter().copied()).collect()
        };
        // For V = 0, V' is the acceleration of the origin.
        evaluation.set(&self.q, &put(&Vector3::zeros(), &self.omega, &self.qd));
        let mut forces = vec![0.0; equations.n_velocities()];
        evaluation.balance(&put(&self.a, &self.alpha, &self.qdd), &mut forces);
        DVector::from_vec(forces)
    }

    /// Selects the rigid rows of SID that a plane body has.
    fn rows(body: &FlexBody, all: &DVector<f64>) -> DVector<f64> {
        let rigid: &[usize] = if body.dimension() == 2 { &[0, 1, 5] } else { &[0, 1, 2, 3, 4, 5] };
        let values = rigid.iter().map(|&i| all[i]).chain(all.iter().skip(6).copied());
        DVector::from_vec(values.collect())
    }
}

/// Returns the largest difference of the equations of SID and of the body relative to the largest entry: of
/// force, torque and modal forces.
fn equations_apart(body: &FlexBody, arrays: &Arrays, state: &State) -> [f64; 3] {
    let (sid, own) = (State::rows(body, &arrays.balance(state)), state.own(body));
    let d = if body.dimension() == 2 { 2 } else { 3 };
    let r = if body.dimension() == 2 { 3 } else { 6 };
    let n = own.len();
    [0..d, d..r, r..n].map(|range| {
        let (sid, own) = (sid.rows(range.start, range.len()), own.rows(range.start, range.len()));
        (sid - own).amax() / own.amax()
    })
}

/// Returns true for a mass that commutes with rotations, which has no W0 of its own.
fn is_solid(body: &FlexBody) -> bool {
    body.invariants().general().is_none()
}

#[test]
#[ignore = "slow"]
fn every_dialect_of_every_fixture_is_read_back_as_the_body() {
    for model in models() {
        let plain = fixture(&model, MODES, BodyFrame::Principal);
        let mut random = Random(3);
        let bodies = [plain, strained(&model, &mut random)];
        for (body, own_stiffness) in bodies.iter().zip([false, true]) {
            for name in sid().dialects() {
                let options = dialect(name);
                let imported = read(&text(body, &options));
                assert_eq!(imported.dialect, *name, "{model}");
                let failed: Vec<_> = imported.checks.iter().filter_map(|check| check.finding()).collect();
                assert!(failed.is_empty(), "{model} {name}: {failed:?}");
                let (found, own) = (&imported.body, body.invariants().numbered());
                assert_eq!(found.inertia.i1, own.i1);
                assert_eq!(found.inertia.i2, own.i2);
                same(&found.inertia.i3, &own.i3, "I3");
                same(&found.inertia.i4, &own.i4, "I4");
                same(&found.inertia.i6, &own.i6, "I6");
                assert!((found.inertia.i7 - own.i7).amax() <= 1e-15 * own.i7.amax());
                for (a, b) in found.inertia.i8.iter().zip(&own.i8) {
                    let scale = own.i8.iter().map(|i8| i8.amax()).fold(0.0, f64::max);
                    assert!(
                        (a - b).amax() <= 1e-15 * scale,
                        "{model} {name} I8: {:e}",
                        (a - b).amax() / scale
                    );
                }
                same(&found.modal_stiffness, body.invariants().modal_stiffness(), "Ke");
                let i5 = own.i5.as_ref().expect("held");
                let stated = found.inertia.i5.clone().unwrap_or_else(|| Mat::zeros(i5.nrows(), i5.ncols()));
                if is_solid(body) && !own_stiffness {
                    same(&stated, i5, "I5");
                }
                let spin_alone = !own_stiffness && model != "turbine_blade";
                if is_solid(body) && spin_alone {
                    let i9 = found.inertia.i9.as_ref().expect("Oe1 and Cr1 give it");
                    same(i9, own.i9.as_ref().expect("held"), "I9");
                }
                for &component in LoadKind::Acceleration.of_dimension(body.dimension()) {
                    let load = UnitLoad { kind: LoadKind::Acceleration, component };
                    let there = stiffness(&found.geometric_stiffness, &load);
                    match (there, body.stiffness_under(&load)) {
                        (Some(a), Some(b)) => same(&a, &b, &load.label()),
                        (a, b) => assert_eq!(a.is_some(), b.is_some(), "{model} {}", load.label()),
                    }
                }
                assert_eq!(found.units.as_ref(), body.units().stated.then_some(body.units()));
                assert_eq!(found.name, body.description().name);
            }
        }
    }
}

#[test]
#[ignore = "slow"]
fn the_equations_of_the_file_are_those_of_the_body_to_first_order() {
    for model in models() {
        let own = fixture(&model, MODES, BodyFrame::Model);
        let mut random = Random(17);
        for body in [&own, &strained(&model, &mut random)] {
            for name in sid().dialects() {
                let arrays = Arrays::new(&text(body, &dialect(name)), name, MODES);
                // Undeformed and without modal motion the equations are exact.
                let rest = State { qd: vec![0.0; MODES], ..State::random(body, 0.0, &mut random) };
                let worst = equations_apart(body, &arrays, &rest);
                assert!(worst.iter().all(|v| *v < 1e-12), "{model} {name}: {worst:?}");
                if !is_solid(body) {
                    continue;
                }
                // The difference is of second order: a tenth of the modal motion gives a hundredth.
                let mut state = State::random(body, 1e-3, &mut random);
                let large = difference(body, &arrays, &state);
                for v in state.q.iter_mut().chain(&mut state.qd).chain(&mut state.qdd) {
                    *v *= 0.1;
                }
                let small = difference(body, &arrays, &state);
                let scale = state.own(body).amax();
                // Modal forces have no second-order terms.
                for row in 0..large.len() {
                    let bound = 0.012 * large.amax() + 1e-12 * scale;
                    assert!(
                        small[row].abs() <= bound,
                        "{model} {name} row {row}: {} {}",
                        small[row],
                        large.amax()
                    );
                }
            }
        }
    }
}

fn difference(body: &FlexBody, arrays: &Arrays, state: &State) -> DVector<f64> {
    State::rows(body, &arrays.balance(state)) - state.own(body)
}

/// The modal forces of a solid without geometric stiffness are exact in SID at any deformation.
#[test]
fn modal_forces_of_solids_are_exact_at_any_deformation() {
    for model in ["bracket_hex20", "cube_hex8", "gear_disc"] {
        let body = fixture(model, MODES, BodyFrame::Model);
        let mut random = Random(5);
        for name in sid().dialects() {
            let arrays = Arrays::new(&text(&body, &dialect(name)), name, MODES);
            for _ in 0..3 {
                let state = State::random(&body, 0.3, &mut random);
                let [force, torque, modal] = equations_apart(&body, &arrays, &state);
                assert!(force < 1e-12 && modal < 1e-11, "{model} {name}: {force:e} {modal:e}");
                assert!(torque > 1e-6, "the inertia of second order is not in SID");
            }
        }
    }
}

#[test]
fn bodies_without_groups_and_with_damping_are_written() {
    let body = fixture("bracket_hex20", MODES, BodyFrame::Principal);
    for groups in combinations() {
        let partial = with_groups(&body, groups);
        let imported = read(&text(&partial, &ExportOptions::default()));
        let failed: Vec<_> = imported.checks.iter().filter_map(|check| check.finding()).collect();
        assert!(failed.is_empty(), "{groups:?}: {failed:?}");
        assert_eq!(imported.body.inertia.groups, groups);
        assert!(groups == TermGroups::ALL || text(&partial, &ExportOptions::default()).contains("without W"));
    }
    let mut parts = body.into_parts();
    parts.modes.damping_ratio = vec![0.02; MODES];
    let damped = FlexBody::new(parts).expect("valid parts");
    for name in sid().dialects() {
        let found = read(&text(&damped, &dialect(name))).body.modal_damping.expect("damping");
        for (j, eigenvalue) in damped.modes().eigenvalue.iter().enumerate() {
            assert_eq!(found[(j, j)], 2.0 * 0.02 * eigenvalue.sqrt());
        }
    }
}

#[test]
fn frames_are_interfaces_or_the_nodes_that_are_asked_for() {
    let body = fixture("turbine_blade", MODES, BodyFrame::Model);
    let mut random = Random(1);
    let at_tip = [LoadKind::Force("tip".to_owned()), LoadKind::Moment("tip".to_owned())];
    let body = stressed(body, &at_tip, 1e-3, &mut random);
    let some = body.nodes().ids[3];
    for (points, count) in
        [(Points::Usual, 2), (Points::Nodes, body.n_nodes()), (Points::Some(vec![some]), 1)]
    {
        let options = ExportOptions { points: points.clone(), ..ExportOptions::default() };
        let losses = sid().checklist(&body, &options).losses();
        // Forces at the tip need its reference point.
        assert_eq!(losses.is_empty(), points == Points::Usual, "{losses:?}");
        let imported = read(&text(&body, &options)).body;
        assert_eq!(imported.frames.len(), count);
        let expected = flexbody_formats::export::frames(&body, &points);
        for (frame, own) in imported.frames.iter().zip(&expected) {
            assert_eq!(frame.label, own.id.to_string());
            assert_eq!(frame.position, own.position);
            same(&frame.translation, &own.translation, "phi");
            assert_eq!(frame.rotation.is_some(), own.rotation.is_some());
        }
    }
    let imported = read(&text(&body, &ExportOptions::default())).body;
    let tip = imported.frames[1].interface.clone().expect("its forces have geometric stiffness");
    for kind in [LoadKind::Force as fn(String) -> LoadKind, LoadKind::Moment] {
        for component in 0..3 {
            let of = |name: &str| UnitLoad { kind: kind(name.to_owned()), component };
            let found = stiffness(&imported.geometric_stiffness, &of(&tip)).expect("phi1 and psi1");
            same(&found, &stiffness(body.geometric_stiffness(), &of("tip")).expect("given"), "K at the tip");
        }
    }
}

/// Readers of FEMBS and PY_SID files split the line at a sign of equality; MatMorembs and FEMBeam write none.
#[test]
fn the_part_has_a_name_in_the_dialects_that_have_one() {
    let mut parts = fixture("hex8_edges", 4, BodyFrame::Model).into_parts();
    for (name, word) in [("Rotor = 2, left", "= Rotor_2,_left"), ("", "=")] {
        parts.description.name = name.to_owned();
        let body = FlexBody::new(parts.clone()).expect("valid parts");
        for (dialect_name, named) in
            [("fembs", word), ("py-sid", word), ("morembs", ""), ("fembeam", ""), ("embs", "= body")]
        {
            let text = text(&body, &dialect(dialect_name));
            let line = text.lines().nth(2).expect("a third line").trim();
            let rest = line.strip_prefix("new modal").expect("the part").trim();
            assert_eq!(rest, named, "{dialect_name}");
        }
    }
}

#[test]
fn what_cannot_be_held_is_told() {
    let said = |model: &str| {
        sid().checklist(&fixture(model, MODES, BodyFrame::Model), &ExportOptions::default()).losses()
    };
    assert!(said("bracket_hex20").is_empty() && said("turbine_blade").is_empty());
    assert!(said("plane_frame").iter().any(|loss| loss.text.contains("plane")));
    // The stiffness of inertia is written like geometric stiffness.
    assert!(said("frame_beams").is_empty(), "{:?}", said("frame_beams"));
    let body = fixture("bracket_hex20", MODES, BodyFrame::Model);
    let body = stressed(body, &[LoadKind::Named("bolts".to_owned())], 1.0, &mut Random(2));
    let (_, warnings) = export(&body, sid(), &ExportOptions::default(), false).expect("with the loss");
    assert!(warnings.iter().any(|warning| warning.message().contains("times load `bolts`")), "{warnings:?}");
    let lost = warnings.iter().filter(|warning| warning.code() == Code::ExportLost);
    assert_eq!(lost.count(), 1, "{warnings:?}");
}

/// Names of arrays that the reader of EMBSlib detects anywhere in a line.
const KEYWORDS: [&str; 13] =
    ["refmod", "frame", "mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "ksigma", "Ke", "De"];

#[test]
fn embs_has_keywords_in_the_heads_of_its_arrays_alone_and_lines_that_its_reader_holds() {
    let mut parts = fixture("bracket_hex20", 12, BodyFrame::Model).into_parts();
    let long = "Kurbel größer ".repeat(90);
    for name in ["Crank", "Gear", "Joint_A", "frame refmod mass Me De", "", "Größe 日本 mdCM", &long] {
        parts.description.name = name.to_owned();
        let body = FlexBody::new(parts.clone()).expect("valid parts");
        let text = text(&body, &dialect("embs"));
        let mut inside: Vec<&str> = Vec::new();
        for (number, line) in text.lines().enumerate().skip(2) {
            assert!(line.len() < 100, "{line}");
            let words = line.trim();
            if let Some(ended) = words.strip_prefix("end ") {
                inside.retain(|one| *one != ended);
            } else if inside.is_empty() {
                let found = KEYWORDS.iter().find(|keyword| words.contains(**keyword));
                assert!(found.is_none_or(|keyword| *keyword == words), "{name}, line {number}: {line}");
                inside.extend(found.copied().filter(|keyword| *keyword == words));
            }
            // Counts have five digits at most, numbers 19 characters before the exponent.
            if let Some((key, value)) = words.split_once("= ") {
                let digits = |text: &str| text.split(|c: char| !c.is_ascii_digit()).map(str::len).max();
                assert!(digits(key).is_none_or(|most| most <= 5), "{line}");
                let number =
                    key.starts_with('m') && value.trim().starts_with(|c: char| "-0123456789".contains(c));
                assert!(
                    !number || value.trim().split('D').next().is_some_and(|base| base.len() <= 19),
                    "{line}"
                );
                assert!(!number || value.contains('D'), "{line}");
            }
        }
        assert_eq!(
            text.lines().filter(|line| line.contains(" mass ")).count(),
            if name.contains(" mass ") { 2 } else { 1 }
        );
        let first = text.lines().next().expect("a line");
        assert!(first.len() < 511 && first.contains("dialect embs"), "{}", first.len());
        let start: String = name.trim().chars().take(9).collect();
        assert!(read(&text).body.name.starts_with(&start), "{name}");
    }
}

#[test]
fn embs_counts_its_frames_and_says_beside_which_is_which() {
    let mut parts = fixture("turbine_blade", MODES, BodyFrame::Model).into_parts();
    parts.nodes.ids.iter_mut().for_each(|id| *id += 3_000_000);
    let body = FlexBody::new(parts).expect("valid parts");
    let some = body.nodes().ids[3];
    for (name, counted) in [("embs", true), ("morembs", true), ("fembs", false)] {
        let options = ExportOptions { points: Points::InterfacesAnd(vec![some]), ..dialect(name) };
        let (exported, told) = export(&body, sid(), &options, true).expect("exports");
        let places = flexbody_formats::export::frames(&body, &options.points);
        let imported = read(&String::from_utf8(exported.file).expect("text")).body;
        let labels: Vec<String> = imported.frames.iter().map(|frame| frame.label.clone()).collect();
        let ids: Vec<i64> = places.iter().map(|place| place.id).collect();
        if !counted {
            assert_eq!(labels, ids.iter().map(i64::to_string).collect::<Vec<_>>());
            // Frames have the numbers of nodes, and the table says which interface a number above them is.
            let (ending, table) = &exported.beside[0];
            let table = String::from_utf8(table.clone()).expect("text");
            assert_eq!((ending.as_ref(), table.lines().count()), ("frames.csv", 1 + ids.len()));
            continue;
        }
        assert_eq!(labels, ["1", "2", "3"]);
        let [(ending, table)] = &exported.beside[..] else { panic!("a table") };
        assert_eq!(ending, "frames.csv");
        let table = String::from_utf8(table.clone()).expect("text");
        let rows: Vec<String> =
            table.lines().map(|line| line.split(',').take(3).collect::<Vec<_>>().join(",")).collect();
        let row = |(i, place): (usize, &flexbody_formats::export::ExportFrame)| {
            format!("{},{},\"{}\"", i + 1, place.id, place.name.as_deref().unwrap_or(""))
        };
        let expected: Vec<String> = places.iter().enumerate().map(row).collect();
        assert_eq!(rows[1..], expected);
        let noted = |part: &str| told.iter().any(|told| told.message().contains(part));
        assert!(noted("table beside the file"), "{told:?}");
        assert_eq!(noted("numNodes = 3 and numModes = 5"), name == "embs", "{told:?}");
    }
}

#[test]
fn what_embslib_leaves_out_is_told() {
    let body = fixture("turbine_blade", MODES, BodyFrame::Model);
    let body = stressed(body, &[LoadKind::Force("tip".to_owned())], 1e-3, &mut Random(1));
    assert!(sid().checklist(&body, &ExportOptions::default()).losses().is_empty());
    let told = sid().checklist(&body, &dialect("embs")).losses();
    assert!(matches!(&told[..], [loss] if loss.text.starts_with("the geometric stiffness for ")), "{told:?}");
    // The modes move the centre of mass.
    let body = oracle::file_bodies::body(2, 4, 3, 1, 0);
    let coriolis = |name: &str| {
        sid().checklist(&body, &dialect(name)).losses().iter().any(|loss| loss.text.contains("Coriolis"))
    };
    assert!(coriolis("embs") && !coriolis("fembeam"));
}

#[test]
fn more_frames_than_the_reader_of_embslib_counts_are_refused() {
    let body = oracle::file_bodies::body(1, 100_000, 1, 0, 0);
    let options = ExportOptions { points: Points::Nodes, ..dialect("embs") };
    let refused = export(&body, sid(), &options, true).expect_err("100000 frames");
    let said = refused.to_string();
    assert!(said.contains("FB720") && said.contains("100000 frames") && said.contains("--points"), "{said}");
    let options = ExportOptions { points: Points::Some(vec![body.nodes().ids[7]]), ..options };
    assert!(export(&body, sid(), &options, true).is_ok());
}
