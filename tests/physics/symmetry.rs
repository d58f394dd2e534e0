//! Multiplicities that the symmetry of a body dictates, and the frequencies of the sphere and the disc.

use crate::support::elements::{Kind, MassRule, Material};
use crate::support::mesh::Mesh;
use crate::support::pipeline::modes;

/// Shear wave speed 1, Poisson's ratio 0.3.
const UNIT: Material = Material { youngs: 2.6, poisson: 0.3, density: 1.0 };

/// Sizes of the groups of eigenvalues that agree to 1e-10.
fn multiplicities(eigenvalues: &[f64]) -> Vec<usize> {
    eigenvalues.chunk_by(|a, b| b / a - 1.0 < 1e-10).map(<[f64]>::len).collect()
}

/// Spherical Bessel function of the first kind.
fn bessel(order: usize, x: f64) -> f64 {
    let (mut low, mut high) = (x.sin() / x, x.sin() / (x * x) - x.cos() / x);
    for n in 1..order {
        (low, high) = (high, (2 * n + 1) as f64 / x * high - low);
    }
    if order == 0 { low } else { high }
}

fn root(equation: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    assert!(equation(low) * equation(high) < 0.0, "the root is not bracketed");
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if equation(low) * equation(middle) <= 0.0 { high = middle } else { low = middle }
    }
    low
}

/// omega a / c_T of the two lowest vibrations of a free elastic sphere, both five-fold (degree 2): Lamb, On the
/// vibrations of an elastic sphere (1881); the spheroidal equation as in Eringen and Suhubi, Elastodynamics II.
fn lamb() -> (f64, f64) {
    let torsional = root(|x| bessel(2, x) - x * bessel(3, x), 2.0, 3.0);
    let speeds = ((1.0 - 2.0 * UNIT.poisson) / (2.0 - 2.0 * UNIT.poisson)).sqrt();
    let spheroidal = |b: f64| {
        let a = speeds * b;
        let normal_p = (2.0 - b * b / 2.0) * bessel(2, a) + 2.0 * a * bessel(3, a);
        let normal_s = 6.0 * (bessel(2, b) - b * bessel(3, b));
        let shear_p = bessel(2, a) - a * bessel(3, a);
        let shear_s = (3.0 - b * b / 2.0) * bessel(2, b) + b * bessel(3, b);
        normal_p * shear_s - normal_s * shear_p
    };
    (torsional, root(spheroidal, 2.0, 3.0))
}

#[test]
fn sphere_has_lambs_fivefold_modes_split_two_and_three_by_the_cubic_mesh() {
    let (torsional, spheroidal) = lamb();
    let mut errors = Vec::new();
    let mut splits = Vec::new();
    for n in [2, 4, 8] {
        let found = modes(&Mesh::ball(Kind::Hex8, n, 1.0).assemble(&UNIT, MassRule::Consistent), 10);
        let mut groups = multiplicities(found.eigenvalues());
        eprintln!("{groups:?} {:?}", found.eigenvalues().iter().map(|l| l.sqrt()).collect::<Vec<_>>());
        groups[..2].sort();
        groups[2..].sort();
        assert_eq!(groups, [2, 3, 2, 3], "{n}");
        let omega: Vec<f64> = found.eigenvalues().iter().map(|l| l.sqrt()).collect();
        errors.push([(&omega[..5], torsional), (&omega[5..], spheroidal)].map(|(five, exact)| five.iter().sum::<f64>() / 5.0 / exact - 1.0));
        splits.push([omega[4] / omega[0] - 1.0, omega[9] / omega[5] - 1.0]);
    }
    eprintln!("{errors:?} {splits:?}");
}

#[test]
fn cube_has_single_double_and_triple_modes_only() {
    let found = modes(&Mesh::block(Kind::Hex8, [6; 3], [1.0; 3]).assemble(&UNIT, MassRule::Consistent), 40);
    eprintln!("{:?} {:?}", multiplicities(found.eigenvalues()), found.eigenvalues());
}

#[test]
fn disc_has_double_modes_for_odd_numbers_of_nodal_diameters() {
    for n in [1, 2, 4, 8] {
        let found = modes(&Mesh::cylinder(Kind::Hex20, n, 1, 1.0, 0.1).assemble(&UNIT, MassRule::Consistent), 12);
        eprintln!("{:?} {:?}", multiplicities(found.eigenvalues()), found.eigenvalues());
    }
}
