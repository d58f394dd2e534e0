//! A free shaft spinning about its axis compared with Rayleigh's differential equation.

use faer::Mat;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, LoadKind};
use flexbody_body::invariants::BodyFrame;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use nalgebra::Vector3;
use oracle::beams::{SHAFT_YOUNGS, shaft};

/// Returns the first bending frequency s > 0 in fixed axes of the mode that whirls with the spin, or against
/// it if `spin` is negative:
///
/// ```text
/// E I w'''' - m s^2 w + (s^2 - 2 spin s) m r^2 w'' = 0,    m: mass per length, r^2 = I / A
/// ```
///
/// with free ends and s between `low` and `high`, by bisection on deflections a cosh(alpha x) + b cos(beta x).
fn rayleigh(width: f64, spin: f64, [mut low, mut high]: [f64; 2]) -> f64 {
    let (mass, rotary) = (width * width, width.powi(4) / 12.0);
    let bending = SHAFT_YOUNGS * rotary;
    // Determinant of the moment E I w'' and the shear force E I w''' + c w' at x = 1/2.
    let ends = |s: f64| {
        let c = rotary * (s * s - 2.0 * spin * s);
        let root = (c * c + 4.0 * bending * mass * s * s).sqrt();
        let (alpha, beta) = (((root - c) / (2.0 * bending)).sqrt(), ((root + c) / (2.0 * bending)).sqrt());
        let (hyperbolic, circular) = (0.5 * alpha, 0.5 * beta);
        alpha.powi(2) * hyperbolic.cosh() * (bending * beta.powi(3) - c * beta) * circular.sin()
            + beta.powi(2) * circular.cos() * (bending * alpha.powi(3) + c * alpha) * hyperbolic.sinh()
    };
    assert!(ends(low) * ends(high) < 0.0, "one root between {low} and {high}");
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if ends(low) * ends(middle) < 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

fn body(parts: usize, width: f64) -> FlexBody {
    let model = FeModel::from_raw(shaft(parts, width)).expect("a body").model;
    let modes = ModeSettings { wanted: Wanted::Lowest(6), ..ModeSettings::default() };
    let settings = ConvertSettings { modes, frame: BodyFrame::Com.into(), ..ConvertSettings::default() };
    convert(&model, &settings, &Context::QUIET).expect("converts").body
}

/// Returns the frequencies of vibration in axes that rotate with the body at `spin` about x, ascending, from
/// q'' + spin (W3' - W3) q' + (K - spin^2 W2 + spin^2 K^w) q = 0 for this axis.
fn turning_rates(body: &FlexBody, spin: f64) -> Vec<f64> {
    let n = body.n_modes();
    let axis = Vector3::from(body.frame().axes.transpose() * Vector3::x());
    let (w2, w3) = (body.invariants().w2().expect("held"), body.invariants().w3().expect("held"));
    let own = body.inertia_stiffness().expect("nodes that turn");
    let stiffening = |i: usize, j: usize| -> f64 {
        let spins = own.stiffness.iter().filter(|stiffness| stiffness.load.kind == LoadKind::Spin);
        let along = |component: usize| axis[LoadKind::SPIN[component].0] * axis[LoadKind::SPIN[component].1];
        spins.map(|spin| along(spin.load.component) * spin.matrix[(i, j)]).sum()
    };
    let softening = |i: usize, j: usize| -> f64 {
        (0..9).map(|at| axis[at / 3] * w2[((at / 3) * n + i, (at % 3) * n + j)] * axis[at % 3]).sum()
    };
    let coriolis = |i: usize, j: usize| -> f64 { (0..3).map(|k| axis[k] * w3[(k * n + i, j)]).sum() };
    let stiffness = body.invariants().modal_stiffness();
    let system = Mat::from_fn(2 * n, 2 * n, |row, j| match (row.checked_sub(n), j.checked_sub(n)) {
        (None, _) => f64::from(u8::from(j == row + n)),
        (Some(i), None) => spin * spin * (softening(i, j) - stiffening(i, j)) - stiffness[(i, j)],
        (Some(i), Some(j)) => spin * (coriolis(i, j) - coriolis(j, i)),
    });
    let eigenvalues = system.eigenvalues().expect("eigenvalues");
    let mut rates: Vec<f64> = eigenvalues.iter().map(|value| value.im).filter(|rate| *rate > 0.0).collect();
    rates.sort_by(f64::total_cmp);
    rates
}

/// Both first frequencies of a spinning shaft converge to those of Rayleigh's equation with the square of the
/// element size.
#[test]
fn a_spinning_shaft_whirls_as_rayleighs_equation_says() {
    for width in [0.04, 0.1] {
        let errors = [4, 8, 16].map(|parts| {
            let body = body(parts, width);
            let first = body.modes().eigenvalue[0].sqrt();
            let spin = 0.5 * first;
            let rates = turning_rates(&body, spin);
            // In axes that rotate with the shaft, forward whirl is slower and backward whirl is faster.
            let found = [rates[1] - spin, rates[0] + spin].map(|rate| rate / first - 1.0);
            let still = rayleigh(width, 0.0, [0.9 * first, 1.1 * first]);
            let expected = [-0.5, 0.5]
                .map(|part| rayleigh(width, part * still, [0.9 * still, 1.1 * still]) / still - 1.0);
            assert!(expected[1] - expected[0] > 0.002, "the sections turn: {expected:?}");
            [0, 1].map(|at| (found[at] / expected[at] - 1.0).abs())
        });
        for at in [0, 1] {
            let [coarse, middle, fine] = errors.map(|error| error[at]);
            assert!(coarse > 3.5 * middle && middle > 3.5 * fine && fine < 0.02, "{width}: {errors:?}");
        }
    }
}
