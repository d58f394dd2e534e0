//! Multiplicities implied by the symmetry of a body, and frequencies of the sphere and the disc.

use flexbody_eigen::Method;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Assembly, Mesh};
use oracle::pipeline::{Body, modes, proved};
use oracle::reference::dense_modes;

/// Material with shear wave speed 1 and Poisson's ratio 0.3.
const UNIT: Material = Material { youngs: 2.6, poisson: 0.3, density: 1.0 };

/// Returns the sizes of the groups of eigenvalues that agree to 1e-10.
fn multiplicities(eigenvalues: &[f64]) -> Vec<usize> {
    eigenvalues.chunk_by(|a, b| b / a - 1.0 < 1e-10).map(<[f64]>::len).collect()
}

/// Returns the spherical Bessel function of the first kind.
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

/// Returns omega a / c_T of the two lowest vibrations of a free elastic sphere, both five-fold (degree 2):
/// Lamb, On the vibrations of an elastic sphere (1881); the spheroidal equation follows Eringen and Suhubi,
/// Elastodynamics II.
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

fn unit(mesh: &Mesh) -> Assembly {
    mesh.assemble(&UNIT, MassRule::Consistent)
}

fn angular(found: &Body) -> Vec<f64> {
    found.eigenvalues().iter().map(|l| l.sqrt()).collect()
}

#[test]
#[ignore = "slow"]
fn sphere_has_lambs_fivefold_modes_split_two_and_three_by_the_cubic_mesh() {
    let (torsional, spheroidal) = lamb();
    let meshes = [2, 4, 8].map(|n| {
        let found = modes(&unit(&Mesh::ball(ElementKind::Hex8, n, 1.0)), 10);
        let mut groups = multiplicities(found.eigenvalues());
        groups[..2].sort_unstable();
        groups[2..].sort_unstable();
        assert_eq!(groups, [2, 3, 2, 3], "{n}");
        angular(&found)
    });
    for (range, exact) in [(0..5, torsional), (5..10, spheroidal)] {
        let error =
            meshes.each_ref().map(|omega| omega[range.clone()].iter().sum::<f64>() / 5.0 / exact - 1.0);
        let split = meshes.each_ref().map(|omega| omega[range.end - 1] / omega[range.start] - 1.0);
        assert!(error[2] > 0.0 && error[2] < 8e-3 && split[2] < 3e-3, "{error:?} {split:?}");
        // Both errors fall with the square of the mesh width; convergence is delayed by the cells at the
        // edges of the cube, which the map to the sphere flattens.
        let order = (error[1] / error[2]).log2();
        assert!((order - 2.0).abs() < 0.25, "{error:?}: order {order}");
        assert!((split[1] / split[2]).log2() > 1.4, "{split:?}");
    }
}

#[test]
fn cube_has_single_double_and_triple_modes_only() {
    // The cubic group has irreducible representations of dimension 1, 2 and 3 only.
    let cube = unit(&Mesh::block(ElementKind::Hex8, [4; 3], [1.0; 3]));
    let all = multiplicities(&dense_modes(&cube).eigenvalues);
    assert!(all.iter().all(|&times| times <= 3), "{all:?}");
    // The library finds the same groups, including complete groups at the end.
    let found: Vec<usize> = all[..20].to_vec();
    let count = found.iter().sum();
    assert!([1, 2, 3].iter().all(|times| found.contains(times)), "{found:?}");
    for method in [Method::Dense, Method::Lanczos] {
        let body = proved(cube.raw_model(), count, method);
        assert_eq!(multiplicities(body.eigenvalues()), found, "{method:?}");
    }
}

#[test]
fn disc_has_double_modes_for_odd_numbers_of_nodal_diameters() {
    // A mesh with four-fold symmetry keeps pairs with an odd number of nodal diameters exactly; its split of
    // pairs with an even number falls with refinement.
    let split = [1, 2, 4].map(|n| {
        let found = modes(&unit(&Mesh::cylinder(ElementKind::Hex20, n, 1, 1.0, 0.1)), 5);
        assert_eq!(multiplicities(found.eigenvalues()), [1, 1, 1, 2], "{n}: (2,0) twice, (0,1), (3,0)");
        let omega = angular(&found);
        omega[1] / omega[0] - 1.0
    });
    assert!(split[2] < 2e-3 && (split[1] / split[2]).log2() > 2.0, "{split:?}");
}
