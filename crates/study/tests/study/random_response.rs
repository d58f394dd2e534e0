//! Rows of recoveries in frequency responses, accelerated interfaces, and random vibration, beside dense solutions of the
//! equations of all nodes and closed forms.

use crate::skewed_beam::skewed_beam;
use faer::Mat;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, RecoveryOperator};
use flexbody_motion::dynamics::NodalPoint;
use flexbody_motion::scene::StressPoint;
use flexbody_study::response::{Band, Direction, Place, RandomResponse, Response, ResponseRequest};
use nalgebra::{Complex, DMatrix};
use std::f64::consts::TAU;

/// Ratio of the damping of every mode.
const RATIO: f64 = 0.02;

/// Returns a skewed rubber beam with its stresses and an interface at each end.
fn model() -> FeModel {
    FeModel::from_raw(skewed_beam(4.0e4, 4)).expect("a sound model").model
}

fn body(model: &FeModel, modes: usize) -> FlexBody {
    let settings = ConvertSettings {
        modes: ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() },
        lumped: Vec::new(),
        ..ConvertSettings::default()
    };
    convert(model, &settings, &Context::QUIET).expect("a body").body
}

/// Dense equations of all nodes with the damping of all modes.
struct Dense {
    stiffness: DMatrix<f64>,
    mass: DMatrix<f64>,
    /// Damping of the free modes, and of those of the body held at its root.
    free_damping: DMatrix<f64>,
    held_damping: DMatrix<f64>,
    /// Unit loads of each interface (N x 6).
    root: DMatrix<f64>,
    tip: DMatrix<f64>,
    /// Operator of the stresses (rows x N).
    operator: DMatrix<f64>,
}

fn plain(a: &Mat<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}

/// Returns the damping of all modes of the body whose root has no mean motion, D = P' M Phi diag(2 zeta omega) Phi' M P. P
/// takes the rigid motion of the root from a motion, so that D damps the deformation alone.
fn damping_held_at(stiffness: &DMatrix<f64>, mass: &DMatrix<f64>, root: &DMatrix<f64>) -> DMatrix<f64> {
    let n = mass.nrows();
    let unit = DMatrix::<f64>::identity(n, n);
    // Motions without mean motion of the root, and their modes.
    let loads = root.clone().qr().q();
    let eigen = (&unit - &loads * loads.transpose()).symmetric_eigen();
    let held: Vec<usize> = (0..n).filter(|&j| eigen.eigenvalues[j] > 0.5).collect();
    let motions = eigen.eigenvectors.select_columns(&held);
    let reduced = |a: &DMatrix<f64>| motions.transpose() * a * &motions;
    let inverse = reduced(mass).cholesky().expect("positive definite").l().try_inverse().expect("regular");
    let modes = (&inverse * reduced(stiffness) * inverse.transpose()).symmetric_eigen();
    let shapes = &motions * inverse.transpose() * &modes.eigenvectors;
    // Rigid motions: the null space of K.
    let all = stiffness.clone().symmetric_eigen();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| all.eigenvalues[*a].abs().total_cmp(&all.eigenvalues[*b].abs()));
    let rigid = all.eigenvectors.select_columns(&order[..6]);
    let of_root = (root.transpose() * &rigid).try_inverse().expect("six motions of the root");
    let relative = &unit - rigid * of_root * root.transpose();
    let rates = shapes.transpose() * mass * relative;
    let c = modes.eigenvalues.map(|lambda| 2.0 * RATIO * lambda.sqrt());
    rates.transpose() * DMatrix::from_diagonal(&c) * rates
}

impl Dense {
    fn new(model: &FeModel, damped: &FlexBody) -> Self {
        let n = model.rows().len();
        let unit = Mat::<f64>::identity(n, n);
        let pencil = model.pencil();
        let (mass, stiffness) =
            (plain(&pencil.apply_mass(unit.as_ref())), plain(&pencil.apply_stiffness(unit.as_ref())));
        let vectors = plain(&damped.vectors_of(model).expect("of this model"));
        let c: Vec<f64> =
            damped.modes().eigenvalue.iter().map(|lambda| 2.0 * RATIO * lambda.sqrt()).collect();
        let weighted = &mass * vectors;
        let free_damping = &weighted * DMatrix::from_diagonal(&c.into()) * weighted.transpose();
        let loads = |name: &str| {
            plain(&NodalPoint::interface(model, name).expect("sound").expect("known").unit_loads(model))
        };
        let RecoveryOperator::Rows { transposed, .. } = &model.recoveries()[0].operator else {
            panic!("rows")
        };
        let operator = DMatrix::from_fn(transposed.n_cols(), n, |i, j| transposed.get(j, i));
        let root = loads("root");
        let held_damping = damping_held_at(&stiffness, &mass, &root);
        Self { stiffness, mass, free_damping, held_damping, root, tip: loads("tip"), operator }
    }

    fn dynamic(&self, omega: f64, damping: &DMatrix<f64>) -> DMatrix<Complex<f64>> {
        let n = self.mass.nrows();
        DMatrix::from_fn(n, n, |i, j| {
            let real = self.stiffness[(i, j)] - omega * omega * self.mass[(i, j)];
            Complex::new(real, omega * damping[(i, j)])
        })
    }

    /// Returns the stresses for unit forces and torques at the tip (rows x 6).
    fn forced(&self, hertz: f64) -> DMatrix<Complex<f64>> {
        let loads = self.tip.map(|value| Complex::new(value, 0.0));
        let u = self.dynamic(TAU * hertz, &self.free_damping).lu().solve(&loads).expect("regular");
        self.operator.map(|value| Complex::new(value, 0.0)) * u
    }

    /// Returns the stresses for unit accelerations of the root (rows x 6), whose motion is a condition with multipliers.
    fn driven(&self, hertz: f64) -> DMatrix<Complex<f64>> {
        let (n, omega) = (self.mass.nrows(), TAU * hertz);
        let dynamic = self.dynamic(omega, &self.held_damping);
        let matrix = DMatrix::from_fn(n + 6, n + 6, |i, j| match (i < n, j < n) {
            (true, true) => dynamic[(i, j)],
            (true, false) => Complex::new(self.root[(i, j - n)], 0.0),
            (false, true) => Complex::new(self.root[(j, i - n)], 0.0),
            (false, false) => Complex::default(),
        });
        let side = DMatrix::from_fn(n + 6, 6, |i, c| {
            Complex::new(if i == n + c { -1.0 / (omega * omega) } else { 0.0 }, 0.0)
        });
        let u = matrix.lu().solve(&side).expect("regular").rows(0, n).into_owned();
        self.operator.map(|value| Complex::new(value, 0.0)) * u
    }
}

fn request(hertz: [f64; 2]) -> ResponseRequest {
    ResponseRequest {
        band: Band::new(hertz[0], hertz[1]),
        damping: Some(RATIO),
        points: 40,
        solves: 6,
        tolerance: 10.0,
        ..ResponseRequest::default()
    }
}

fn answered(request: &ResponseRequest, model: Option<&FeModel>, body: &FlexBody) -> Response {
    request.respond(model, body, None, &Context::QUIET).expect("a response").0
}

fn all_directions(name: &str) -> Place {
    Place { directions: Direction::ALL.to_vec(), ..Place::parse(name) }
}

/// Returns the largest difference of all rows from `exact`, relative to the largest, over the frequencies of a response;
/// `full` compares the equations of all nodes where they were solved.
fn apart(response: &Response, full: bool, exact: impl Fn(f64) -> DMatrix<Complex<f64>>) -> f64 {
    let mut most = 0.0f64;
    for (at, &hertz) in response.frequencies.iter().enumerate() {
        let exact = exact(hertz);
        let size = exact.iter().map(|z| z.norm()).fold(0.0, f64::max);
        // Force and torque are in pairs of their own; functions run over the rows within each direction.
        let mut column = 0;
        for pair in &response.pairs {
            let rows = exact.nrows();
            for (i, function) in pair.functions.iter().enumerate() {
                let own = if full { function.full[at] } else { Some(function.reduced[at]) };
                let Some(own) = own else { continue };
                most = most.max((own - exact[(i % rows, column + i / rows)]).norm() / size);
            }
            column += pair.functions.len() / rows;
        }
    }
    most
}

/// Rows under forces and under accelerations are those of dense solutions: of the body with all modes, and of all nodes;
/// with few modes the static columns leave little of the error that the modes alone have.
#[test]
fn rows_are_those_of_dense_equations() {
    let model = model();
    let whole = body(&model, usize::MAX);
    let dense = Dense::new(&model, &whole);
    let first = whole.frequencies_hz()[0];
    let forced = ResponseRequest {
        from: vec![all_directions("tip")],
        rows: vec!["stress".to_owned()],
        ..request([0.1 * first, 2.5 * first])
    };
    let driven = ResponseRequest { from: Vec::new(), base: Some(all_directions("root")), ..forced.clone() };
    let of_all = answered(&forced, Some(&model), &whole);
    assert!(apart(&of_all, false, |hertz| dense.forced(hertz)) < 1e-8);
    assert!(apart(&of_all, true, |hertz| dense.forced(hertz)) < 1e-8);
    let of_all = answered(&driven, Some(&model), &whole);
    assert!(apart(&of_all, false, |hertz| dense.driven(hertz)) < 1e-6);
    assert!(apart(&of_all, true, |hertz| dense.driven(hertz)) < 1e-6);
    // Far below the first frequency few modes with their columns are nearly exact.
    let slow = ResponseRequest { band: Band::new(0.02 * first, 0.1 * first), ..forced.clone() };
    let few = body(&model, 4);
    let with = apart(&answered(&slow, None, &few), false, |hertz| dense.forced(hertz));
    assert!(with < 1e-3, "{with}");
    // The estimate of the error is near the measured one where few modes lack something.
    let response = answered(&ResponseRequest { points: 12, ..forced }, Some(&model), &body(&model, 8));
    for errors in response.pairs.iter().filter_map(|pair| pair.errors.as_ref()) {
        let effectivity = errors.effectivity.expect("errors above rounding");
        assert!(effectivity.least > 0.7 && effectivity.most < 1.5, "{effectivity:?}");
    }
}

/// Returns the response to the densities in a table.
pub(crate) fn random(
    request: &ResponseRequest,
    model: Option<&FeModel>,
    body: &FlexBody,
    table: &str,
) -> RandomResponse {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("psd.csv");
    std::fs::write(&path, table).expect("written");
    let request = ResponseRequest { densities: Some(path), ..request.clone() };
    answered(&request, model, body).random.expect("densities")
}

/// Returns root mean squares of all rows and of the von Mises stress, by the trapezoidal rule with many frequencies.
fn summed(
    points: &[StressPoint],
    [low, high]: [f64; 2],
    response: impl Fn(f64) -> DMatrix<Complex<f64>>,
    density: impl Fn(f64) -> DMatrix<Complex<f64>>,
) -> (Vec<f64>, Vec<f64>) {
    const COUNT: usize = 6000;
    let (mut rows, mut of_points) = (Vec::new(), vec![0.0; points.len()]);
    for i in 0..=COUNT {
        let hertz = low + (high - low) * i as f64 / COUNT as f64;
        let weight = (high - low) / COUNT as f64 * if i == 0 || i == COUNT { 0.5 } else { 1.0 };
        let h = response(hertz);
        let spectrum = &h * density(hertz) * h.adjoint();
        rows.resize(h.nrows(), 0.0);
        for (r, value) in rows.iter_mut().enumerate() {
            *value += weight * spectrum[(r, r)].re;
        }
        for (point, value) in points.iter().zip(&mut of_points) {
            let s = |a: usize, b: usize| {
                spectrum[(point.rows[a].expect("a solid"), point.rows[b].expect("a solid"))].re
            };
            let normal = s(0, 0) + s(1, 1) + s(2, 2) - s(0, 1) - s(1, 2) - s(2, 0);
            *value += weight * (normal + 3.0 * (s(3, 3) + s(4, 4) + s(5, 5)));
        }
    }
    let roots = |all: Vec<f64>| all.into_iter().map(f64::sqrt).collect();
    (roots(rows), roots(of_points))
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().copied().fold(0.0, f64::max);
    a.iter().zip(b).map(|(a, b)| (a - b).abs() / size).fold(0.0, f64::max)
}

/// Correlated accelerations of the root, whose densities change over the band, give the root mean squares of the dense
/// equations; the estimated error of few modes is that of their difference from all modes.
#[test]
fn random_vibration_of_a_base_is_that_of_dense_equations() {
    let model = model();
    let whole = body(&model, usize::MAX);
    let dense = Dense::new(&model, &whole);
    let first = whole.frequencies_hz()[0];
    let band = [0.3 * first, 1.8 * first];
    let table = format!(
        "hertz,root:y,root:z,root:y * root:z re,root:y * root:z im\n{0},2.0,1.0,0.5,0.8\n{1},4.0,3.0,-1.0,0.0\n{2},1.0,3.0,0.3,0.2\n",
        band[0], first, band[1]
    );
    let density = |hertz: f64| {
        let rows: [(f64, [f64; 2], [f64; 2]); 3] = [
            (band[0], [2.0, 1.0], [0.5, 0.8]),
            (first, [4.0, 3.0], [-1.0, 0.0]),
            (band[1], [1.0, 3.0], [0.3, 0.2]),
        ];
        let at = if hertz <= first { 0 } else { 1 };
        let ((f0, a, x), (f1, b, y)) = (rows[at], rows[at + 1]);
        let part = (hertz - f0) / (f1 - f0);
        let own = [0, 1].map(|k| (a[k].ln() + (b[k] / a[k]).ln() * (hertz / f0).ln() / (f1 / f0).ln()).exp());
        let coherence = [0, 1].map(|k| {
            let (low, high) = (x[k] / (a[0] * a[1]).sqrt(), y[k] / (b[0] * b[1]).sqrt());
            low + (high - low) * part
        });
        let cross = Complex::new(coherence[0], coherence[1]) * (own[0] * own[1]).sqrt();
        DMatrix::from_row_slice(
            2,
            2,
            &[Complex::new(own[0], 0.0), cross, cross.conj(), Complex::new(own[1], 0.0)],
        )
    };
    let base = Place { directions: vec![Direction::Y, Direction::Z], ..Place::parse("root") };
    let asked = ResponseRequest { base: Some(base), ..request(band) };
    let found = random(&asked, Some(&model), &whole, &table);
    let stress = &found.recoveries[0];
    let driven = |hertz: f64| dense.driven(hertz).columns(1, 2).into_owned();
    let (rows, points) = summed(&stress.points, band, driven, density);
    let (of_rows, of_points) =
        (largest_difference(&stress.rms, &rows), largest_difference(&stress.von_mises, &points));
    assert!(of_rows < 1e-4 && of_points < 1e-4, "{of_rows:e} {of_points:e}");
    assert!(stress.errors.expect("a model").rows < 1e-4, "{:?}", stress.errors);
    // Few modes: the estimate is the error that all points show.
    let few = random(&asked, Some(&model), &body(&model, 8), &table);
    let true_error = largest_difference(&few.recoveries[0].von_mises, &points);
    let estimate = few.recoveries[0].errors.expect("a model").von_mises.expect("points");
    println!("estimate {estimate:.2e}, difference of the mean squares {true_error:.2e}");
    assert!(true_error < 1.1 * estimate, "{true_error:e} {estimate:e}");
}

/// One mode under white noise at a node, which has no static columns, has the mean square S phi^2 / (8 zeta w^3); the mean
/// squares of coherent inputs of equal and of opposite sign are on average those of inputs apart.
#[test]
fn random_vibration_has_its_closed_form() {
    let model = model();
    let one = body(&model, 1);
    let (first, lambda) = (one.frequencies_hz()[0], one.modes().eigenvalue[0]);
    let band = [1e-3 * first, 400.0 * first];
    let node = model.nodes().ids[7];
    let asked = ResponseRequest { from: vec![Place::parse(&format!("{node}:y"))], ..request(band) };
    let table = format!("hertz,{node}:y\n{},3.0\n{},3.0\n", band[0], band[1]);
    let found = random(&asked, None, &one, &table);
    let mode = one.vectors_of(&model).expect("of this model");
    let RecoveryOperator::Rows { transposed, .. } = &model.recoveries()[0].operator else { panic!("rows") };
    let of_coordinate = (3.0 * mode[(3 * 7 + 1, 0)].powi(2) / (8.0 * RATIO * lambda.powf(1.5))).sqrt();
    let row = |i: usize| (0..mode.nrows()).map(|j| transposed.get(j, i) * mode[(j, 0)]).sum::<f64>();
    let expected: Vec<f64> = (0..transposed.n_cols()).map(|i| row(i).abs() * of_coordinate).collect();
    let apart = largest_difference(&found.recoveries[0].rms, &expected);
    assert!(apart < 1e-4, "{apart:e}");
    let (name, rms) = &found.inputs[0];
    assert_eq!(*name, format!("{node}:y"));
    assert!((rms / (3.0 * (band[1] - band[0])).sqrt() - 1.0).abs() < 1e-9);
    let both = ResponseRequest {
        from: vec![Place::parse("tip:y"), Place::parse("root:y")],
        ..request([0.5 * first, 2.0 * first])
    };
    let cross = "tip:y,root:y,tip:y * root:y re,tip:y * root:y im";
    let at = |columns: &str, values: &str| {
        let table = format!("hertz,{columns}\n{},{values}\n{},{values}\n", 0.5 * first, 2.0 * first);
        random(&both, None, &one, &table).recoveries[0].von_mises.clone()
    };
    let coherent = at(cross, "1,1,1,0");
    let opposite = at(cross, "1,1,-1,0");
    let apart = at("tip:y,root:y", "1,1");
    for ((plus, minus), sum) in coherent.iter().zip(&opposite).zip(&apart) {
        let mean = (0.5 * (plus * plus + minus * minus)).sqrt();
        assert!((mean - sum).abs() < 1e-9 * sum, "{mean} {sum}");
    }
}

/// Densities that no random process has, and tables without an input, are refused with a code.
#[test]
fn impossible_densities_are_refused() {
    let model = model();
    let whole = body(&model, 4);
    let asked =
        ResponseRequest { from: vec![Place::parse("tip:y"), Place::parse("root:y")], ..request([1.0, 50.0]) };
    let cross = "hertz,tip:y,root:y,tip:y * root:y re,tip:y * root:y im";
    for (table, code) in [
        (format!("{cross}\n1,1,1,2,0\n50,1,1,0,0\n"), "FB216"),
        (format!("{cross}\n1,0,1,0.1,0\n50,1,1,0,0\n"), "FB216"),
        ("hertz,tip:y\n1,-1\n50,1\n".to_owned(), "FB216"),
        ("hertz,tip:x\n1,1\n50,1\n".to_owned(), "FB215"),
        ("hertz,tip:y,root:y,tip:y * root:y re\n1,1,1,0\n50,1,1,0\n".to_owned(), "FB215"),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("psd.csv");
        std::fs::write(&path, &table).expect("written");
        let request = ResponseRequest { densities: Some(path), ..asked.clone() };
        let error = request.respond(None, &whole, None, &Context::QUIET).expect_err("refused");
        assert_eq!(error.first_error().code().id(), code, "{table}: {error}");
    }
    let undamped = ResponseRequest { damping: None, ..asked };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("psd.csv");
    std::fs::write(&path, "hertz,tip:y\n1,1\n50,1\n").expect("written");
    let request = ResponseRequest { densities: Some(path), ..undamped };
    assert!(request.respond(None, &whole, None, &Context::QUIET).is_err());
}
