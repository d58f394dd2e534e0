//! Closed forms of free-free beams, rods and shafts.

use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::Mesh;
use oracle::pipeline::modes;
use std::f64::consts::{PI, TAU};

const STEEL: Material = Material::STEEL;

/// Steel with zero Poisson's ratio: rods and beams follow the one-dimensional theories exactly or nearly so.
const NO_CONTRACTION: Material = Material { poisson: 0.0, ..STEEL };

/// Roots beta L of cos(b) cosh(b) = 1: bending of a free-free beam.
const BENDING_ROOTS: [f64; 3] = [4.730040744862704, 7.853204624095838, 10.995607838001671];

/// Returns the frequencies of Euler-Bernoulli bending for a square section of side h. Unit: Hz.
fn euler_bernoulli(material: &Material, length: f64, h: f64) -> [f64; 3] {
    BENDING_ROOTS
        .map(|b| (b / length).powi(2) * h * (material.youngs / (12.0 * material.density)).sqrt() / TAU)
}

/// Returns the first bending frequency of a free-free Timoshenko beam with a square section of side h: the
/// root near the Euler-Bernoulli frequency of the frequency equation of T. C. Huang (J. Appl. Mech. 28,
/// 1961).
fn timoshenko(material: &Material, length: f64, h: f64, shear_factor: f64) -> f64 {
    let (_, mu) = material.lame();
    let (area, inertia) = (h * h, h.powi(4) / 12.0);
    let r2 = inertia / (area * length * length);
    let s2 = material.youngs * inertia / (shear_factor * area * mu * length * length);
    let equation = |f: f64| {
        let b = TAU * f * length * length * (material.density * area / (material.youngs * inertia)).sqrt();
        let root = ((r2 - s2).powi(2) + 4.0 / (b * b)).sqrt();
        let alpha = (0.5 * (root - r2 - s2)).sqrt();
        let beta = (0.5 * (root + r2 + s2)).sqrt();
        let factor = b * b * r2 * (r2 - s2).powi(2) + 3.0 * r2 - s2;
        2.0 - 2.0 * (b * alpha).cosh() * (b * beta).cos()
            + b / (1.0 - b * b * r2 * s2).sqrt() * factor * (b * alpha).sinh() * (b * beta).sin()
    };
    let slender = euler_bernoulli(material, length, h)[0];
    let (mut low, mut high) = (0.7 * slender, 1.01 * slender);
    assert!(equation(low) * equation(high) < 0.0, "the root is not bracketed");
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if equation(low) * equation(middle) <= 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// Returns the frequencies of a square beam along x of length 1, with quadratic hexahedra half as long as its
/// thickness.
fn beam(material: &Material, slenderness: f64, across: i32) -> Vec<f64> {
    let h = 1.0 / slenderness;
    let mesh = Mesh::block(ElementKind::Hex20, [2 * slenderness as i32, across, across], [1.0, h, h]);
    modes(&mesh.assemble(material, MassRule::Consistent), 10).frequencies()
}

#[test]
fn slender_beam_converges_to_euler_bernoulli_with_the_square_of_its_thickness() {
    let deviation = |slenderness: f64| {
        let found = beam(&STEEL, slenderness, 1);
        let exact = euler_bernoulli(&STEEL, 1.0, 1.0 / slenderness);
        // A square section bends in two planes, so that every frequency is double.
        for pair in 0..3 {
            assert!((found[2 * pair] / found[2 * pair + 1] - 1.0).abs() < 1e-8, "{found:?}");
        }
        [0, 1, 2].map(|i| found[2 * i] / exact[i] - 1.0)
    };
    let (thick, slender) = (deviation(50.0), deviation(100.0));
    assert!(slender[0].abs() < 4e-4, "{slender:?}");
    for i in 0..3 {
        let order = (thick[i] / slender[i]).log2();
        assert!((order - 2.0).abs() < 0.02, "mode {i}: {order}");
    }
}

#[test]
fn thick_beam_follows_timoshenko() {
    for slenderness in [10.0, 20.0] {
        let found = beam(&NO_CONTRACTION, slenderness, 3)[0];
        // Without lateral contraction the shear factor of a rectangle is exactly 5/6.
        let exact = timoshenko(&NO_CONTRACTION, 1.0, 1.0 / slenderness, 5.0 / 6.0);
        let correction = exact / euler_bernoulli(&NO_CONTRACTION, 1.0, 1.0 / slenderness)[0] - 1.0;
        assert!(correction < -0.008, "shear and rotary inertia matter here: {correction}");
        assert!((found / exact - 1.0).abs() < 3e-3 * correction.abs(), "{slenderness}: {found} {exact}");
    }
}

#[test]
fn rod_vibrates_along_its_axis_as_the_discrete_closed_form_says() {
    // Without lateral contraction u(x) is an exact solution in linear elements of length d: consistent mass
    // gives lambda = 6 E / (rho d^2) (1 - cos k d) / (2 + cos k d), k = n pi / L, for any refinement.
    for cells in [4, 8, 16] {
        let length = 2.0;
        let mesh = Mesh::block(ElementKind::Hex8, [cells, 1, 1], [length, 0.3, 0.2]);
        let body = mesh.assemble(&NO_CONTRACTION, MassRule::Consistent);
        let all = modes(&body, body.n_dofs() - 6);
        let d = length / f64::from(cells);
        for n in 1..=cells {
            let c = (f64::from(n) * PI / f64::from(cells)).cos();
            let exact = 6.0 * STEEL.youngs / (STEEL.density * d * d) * (1.0 - c) / (2.0 + c);
            let nearest = all.eigenvalues().iter().map(|l| (l / exact - 1.0).abs()).fold(f64::MAX, f64::min);
            assert!(nearest < 1e-12, "{cells} cells, n = {n}: {nearest:e}");
        }
    }
}

#[test]
fn shaft_twists_at_multiples_of_the_shear_wave_frequency() {
    // A circular shaft does not warp: f_n = n c_T / (2 L) exactly, c_T = sqrt(mu / rho).
    let (radius, length) = (0.05, 0.3);
    let (_, mu) = STEEL.lame();
    let exact = (mu / STEEL.density).sqrt() / (2.0 * length);
    let errors: Vec<f64> = [1, 2, 4]
        .iter()
        .map(|&n| {
            let body = Mesh::cylinder(ElementKind::Hex8, n, 4 * n, radius, length)
                .assemble(&STEEL, MassRule::Consistent);
            let found = modes(&body, 8);
            let shapes = &found.modes.solution.vectors;
            let twist =
                (0..8).find(|&j| is_twist(&body.nodes, |i| shapes[(i, j)])).expect("a torsional mode");
            found.frequencies()[twist] / exact - 1.0
        })
        .collect();
    assert!(errors[2] > 0.0 && errors[2] < 2e-3, "{errors:?}");
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((order - 2.0).abs() < 0.05, "{errors:?}: order {order}");
    }
}

/// Returns true if a shape rotates sections about z: all motion is along (-y, x, 0).
fn is_twist(nodes: &[[f64; 3]], shape: impl Fn(usize) -> f64) -> bool {
    let (mut along, mut all) = (0.0, 0.0);
    for (i, x) in nodes.iter().enumerate() {
        let u = [0, 1, 2].map(|k| shape(3 * i + k));
        let radius = x[0].hypot(x[1]);
        if radius > 0.0 {
            along += ((x[0] * u[1] - x[1] * u[0]) / radius).powi(2);
        }
        all += u.iter().map(|v| v * v).sum::<f64>();
    }
    along > 0.99 * all
}
