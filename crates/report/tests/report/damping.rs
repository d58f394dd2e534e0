//! Damping of the modes: ratios, Rayleigh damping and matrices, compared with closed forms and with each
//! other.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_base::units::UnitSystem;
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::invariants::BodyFrame;
use flexbody_eigen::Wanted;
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{Damping, DampingBand, FeModel, RawMatrix, RawModel};
use flexbody_report::{Facts, Format, RunData, render};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Assembly, Mesh, entries};

fn block() -> Assembly {
    Mesh::block(ElementKind::Hex8, [4, 2, 2], [0.4, 0.15, 0.1])
        .assemble(&Material::STEEL, MassRule::Consistent)
}

fn damped(damping: Damping<RawMatrix>) -> RawModel {
    block().raw_model().with(|data| data.damping = Some(damping))
}

fn run(raw: RawModel, frame: BodyFrame) -> Result<Conversion> {
    let checked = FeModel::from_raw(raw)?;
    let mut settings =
        ConvertSettings { frame: frame.into(), lumped: Vec::new(), ..ConvertSettings::default() };
    settings.modes.wanted = Wanted::Lowest(12);
    let mut done = convert(&checked.model, &settings, &Context::QUIET)?;
    done.diagnostics.splice(0..0, checked.diagnostics);
    Ok(done)
}

fn converted(damping: Damping<RawMatrix>) -> Conversion {
    run(damped(damping), BodyFrame::Principal).unwrap()
}

fn matrix(n: usize, entries: &[(u32, u32, f64)]) -> Damping<RawMatrix> {
    let raw = block().raw_model().stiffness;
    Damping::Matrix(RawMatrix { matrix: CscMatrix::from_triplets(n, n, entries), ..raw })
}

/// Returns alpha M + beta K as a matrix.
fn rayleigh_matrix(alpha: f64, beta: f64) -> Damping<RawMatrix> {
    let raw = block().raw_model();
    let mut all: Vec<_> = entries(&raw.mass.matrix).map(|(r, c, v)| (r, c, alpha * v)).collect();
    all.extend(entries(&raw.stiffness.matrix).map(|(r, c, v)| (r, c, beta * v)));
    matrix(raw.mass.matrix.n_cols(), &all)
}

#[test]
fn ratios_are_kept_as_they_are_and_give_a_diagonal_matrix() {
    let done = converted(Damping::Ratio(0.02));
    let modes = done.body.modes();
    assert_eq!(modes.damping_ratio, vec![0.02; 12]);
    let d = modes.modal_damping.as_ref().unwrap();
    for i in 0..12 {
        for j in 0..12 {
            let expected = if i == j { 0.04 * modes.eigenvalue[j].sqrt() } else { 0.0 };
            assert!((d[(i, j)] - expected).abs() <= 4e-16 * expected, "{i} {j}: {}", d[(i, j)]);
        }
    }
    assert_eq!(done.body.source().settings["damping"]["ratio"], 0.02);
}

#[test]
fn bands_are_in_hertz_whatever_the_unit_of_time() {
    let undamped = run(block().raw_model(), BodyFrame::Principal).unwrap().body;
    assert_eq!((undamped.modes().modal_damping.as_ref(), undamped.modes().damping_ratio[3]), (None, 0.0));
    let hertz = undamped.frequencies_hz();
    let band = |to_hz, ratio| DampingBand { to_hz, ratio };
    let split = 0.5 * (hertz[4] + hertz[5]);
    let mut raw = damped(Damping::Bands(vec![band(split, 0.01), band(f64::INFINITY, 0.05)]));
    // The body in milliseconds: the numbers of K are multiplied by 1e-6.
    raw.data.description.units = UnitSystem::parse("m", "kg", "ms").unwrap();
    let n = raw.stiffness.matrix.n_cols();
    let all: Vec<_> = entries(&raw.stiffness.matrix).map(|(r, c, v)| (r, c, 1e-6 * v)).collect();
    raw.stiffness.matrix = CscMatrix::from_triplets(n, n, &all);
    let body = run(raw, BodyFrame::Principal).unwrap().body;
    let expected: Vec<f64> = (0..12).map(|j| if j <= 4 { 0.01 } else { 0.05 }).collect();
    assert_eq!(body.modes().damping_ratio, expected);
}

#[test]
fn a_matrix_of_rayleigh_damping_gives_what_rayleigh_damping_gives() {
    let (alpha, beta) = (300.0, 2e-6);
    let stated = converted(Damping::Rayleigh { alpha, beta });
    let given = converted(rayleigh_matrix(alpha, beta));
    let (a, b) = (stated.body.modes(), given.body.modes());
    assert_eq!(a.eigenvalue, b.eigenvalue);
    let (da, db) = (a.modal_damping.as_ref().unwrap(), b.modal_damping.as_ref().unwrap());
    for i in 0..12 {
        for j in 0..12 {
            let size = (da[(i, i)] * da[(j, j)]).sqrt();
            assert!((da[(i, j)] - db[(i, j)]).abs() <= 1e-12 * size, "{i} {j}");
        }
        let omega = a.eigenvalue[i].sqrt();
        let closed = 0.5 * (alpha / omega + beta * omega);
        assert!((a.damping_ratio[i] / closed - 1.0).abs() <= 1e-12, "mode {i}");
        assert!((b.damping_ratio[i] / closed - 1.0).abs() <= 1e-12, "mode {i}");
    }
    // Mass-proportional damping resists rigid motion, stiffness-proportional damping does not.
    let warned = |done: &Conversion| done.diagnostics.iter().any(|d| d.code() == Code::DampingRigid);
    assert!(warned(&given) && warned(&stated));
    assert!(!warned(&converted(rayleigh_matrix(0.0, beta))));
    assert!(!warned(&converted(Damping::Rayleigh { alpha: 0.0, beta })));
}

#[test]
fn a_dashpot_couples_modes_as_its_end_points_move_in_every_frame() {
    // Damper c between uy of node 1 and uz of the last node.
    let c = 50.0;
    let n = block().raw_model().stiffness.matrix.n_cols() as u32;
    let (p, q) = (1, n - 1);
    let dashpot = [(p, p, c), (q, q, c), (p, q, -c), (q, p, -c)];
    for frame in [BodyFrame::Model, BodyFrame::Principal] {
        let done = run(damped(matrix(n as usize, &dashpot)), frame).unwrap();
        let (body, modes) = (&done.body, done.body.modes());
        let moved = |row: u32, mode: usize| -> f64 {
            let (node, k) = (row as usize / 3, row as usize % 3);
            (0..3).map(|l| body.frame().axes[(k, l)] * modes.shape[(3 * node + l, mode)]).sum()
        };
        let stroke: Vec<f64> = (0..12).map(|j| moved(p, j) - moved(q, j)).collect();
        let largest = stroke.iter().fold(0.0f64, |m, s| m.max(s.abs()));
        let d = modes.modal_damping.as_ref().unwrap();
        for i in 0..12 {
            for j in 0..12 {
                let error = (d[(i, j)] - c * stroke[i] * stroke[j]).abs();
                assert!(error <= 1e-13 * c * largest * largest, "{frame:?} {i} {j}: {error:e}");
            }
            let ratio = c * stroke[i] * stroke[i] / (2.0 * modes.eigenvalue[i].sqrt());
            assert!((modes.damping_ratio[i] - ratio).abs() <= 1e-13 * c * largest * largest);
        }
    }
}

#[test]
fn damping_is_in_the_file_and_in_every_report() {
    let body = converted(rayleigh_matrix(0.0, 2e-6)).body;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("b.flex.h5");
    flexbody_file::write(&body, &path).unwrap();
    assert_eq!(flexbody_file::read(&path).unwrap(), body);
    let facts = Facts::new(&body, &RunData::default());
    let json: serde_json::Value = serde_json::from_str(&render(&facts, Format::Json)).unwrap();
    let schema = serde_json::from_str(include_str!("../../../../schemas/report.schema.json")).unwrap();
    assert!(jsonschema::validator_for(&schema).unwrap().is_valid(&json));
    assert_eq!(json["modes"]["damping"]["lowest_ratio"], body.modes().damping_ratio[0]);
    for format in [Format::Text, Format::Html] {
        assert!(render(&facts, format).to_lowercase().contains("ratios from "), "{format:?}");
    }
}

#[test]
fn damping_that_feeds_energy_is_refused_and_overdamped_modes_are_told() {
    let n = block().raw_model().stiffness.matrix.n_cols();
    let inner = matrix(n, &[(1, 1, 1.0), (40, 40, 1.0), (1, 40, -2.0), (40, 1, -2.0)]);
    let error = run(damped(inner), BodyFrame::Model).unwrap_err();
    assert!(error.has(Code::DampingIndefinite), "{error}");
    for (damping, code) in [
        (Damping::Ratio(-0.1), Code::ManifestSyntax),
        (Damping::Ratio(f64::NAN), Code::ManifestSyntax),
        (Damping::Bands(Vec::new()), Code::ManifestSyntax),
        (Damping::Rayleigh { alpha: f64::INFINITY, beta: 0.0 }, Code::ManifestSyntax),
        (Damping::Rayleigh { alpha: 0.0, beta: 1e308 }, Code::DampingIndefinite),
        (matrix(n, &[(3, 3, f64::NAN)]), Code::MatrixNotFinite),
        (matrix(n, &[(3, 4, 1.0)]), Code::MatrixAsymmetric),
        (matrix(n, &[(3, 3, -1.0)]), Code::DiagonalNegative),
        (matrix(n - 3, &[(3, 3, 1.0)]), Code::MatrixSizesDiffer),
    ] {
        let error = run(damped(damping), BodyFrame::Principal).unwrap_err();
        assert!(error.has(code), "{code:?}: {error}");
    }
    let done = converted(Damping::Rayleigh { alpha: 0.0, beta: 1.0 });
    let told = done.diagnostics.iter().find(|d| d.code() == Code::ModesOverdamped).unwrap();
    assert!(told.message().starts_with("12 of 12 modes are overdamped, mode 12 most"), "{}", told.message());
}
