//! Bodies that need all digits of double precision, and tables with few digits: limitations are reported with
//! the remaining accuracy.

use flexbody_base::diagnostic::Code;
use flexbody_body::basis::ModeSettings;
use flexbody_eigen::{Accuracy, Method, Proof, Wanted};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Assembly, Mesh, grid};
use oracle::pipeline::{Body, solve};
use oracle::random::Random;
use oracle::reference::dense_modes;

const STEEL: Material = Material::STEEL;

/// Both methods at both accuracies that prove their modes.
const WAYS: [(Method, Accuracy); 4] = [
    (Method::Dense, Accuracy::Standard),
    (Method::Lanczos, Accuracy::Standard),
    (Method::Dense, Accuracy::Certified),
    (Method::Lanczos, Accuracy::Certified),
];

/// Computes the lowest modes with a proof by every method and accuracy; `what` names the case that fails.
fn in_every_way(what: &str, body: &Assembly, count: usize, check: impl Fn(&str, &Body)) {
    for (method, accuracy) in WAYS {
        let what = format!("{what}, {count} modes, {method:?}, {accuracy:?}");
        let settings =
            ModeSettings { wanted: Wanted::Lowest(count), accuracy, method, ..ModeSettings::default() };
        let found = solve(body.raw_model(), &settings).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(found.eigenvalues().len(), count, "{what}");
        assert_eq!(found.modes.solution.completeness.proof, Proof::InertiaCount, "{what}");
        check(&what, &found);
    }
}

fn assert_close(what: &str, found: &[f64], exact: &[f64], tolerance: f64) {
    for (j, (a, b)) in found.iter().zip(exact).enumerate() {
        assert!((a / b - 1.0).abs() < tolerance, "{what}, mode {j}: {a}, expected {b}");
    }
}

#[test]
fn node_tables_of_six_digits_are_enough() {
    // FE programs print coordinates with six to eight digits. Rigid motion is then known to 1e-6 only;
    // eigenvalues do not depend on it to first order.
    let turn = Random(3).rotation();
    let mesh = Mesh::bracket(ElementKind::Hex8, 5, 2, 0.125).moved(&turn, [0.3, 0.7, -0.2]);
    let body = mesh.assemble(&STEEL, MassRule::Consistent);
    let exact = dense_modes(&body).eigenvalues;
    for digits in [12, 9, 8, 7, 6] {
        let mut rounded = body.clone();
        for x in rounded.nodes.iter_mut().flatten() {
            *x = format!("{x:.*e}", digits - 1).parse().expect("a number");
        }
        in_every_way(&format!("{digits} digits"), &rounded, 12, |what, found| {
            assert_close(what, found.eigenvalues(), &exact, 1e-9);
        });
    }
}

/// Returns two steel blocks with a layer between them that is `ratio` times as stiff.
fn joined(ratio: f64) -> Assembly {
    let mesh = Mesh::block(ElementKind::Hex8, [7, 2, 2], [0.7, 0.2, 0.2]);
    let in_layer = |x: [f64; 3]| x[0] > 0.25 && x[0] < 0.35;
    let soft = Material { youngs: ratio * STEEL.youngs, ..STEEL };
    let blocks = mesh.part(|x| !in_layer(x)).assemble(&STEEL, MassRule::Consistent);
    blocks.plus(&mesh.part(in_layer).assemble(&soft, MassRule::Consistent))
}

#[test]
fn soft_joints_keep_six_low_modes_that_scale_with_their_stiffness() {
    // In the limit of two rigid blocks on a spring the six lowest eigenvalues are proportional to its
    // stiffness, and the others are those of the blocks.
    let reference = dense_modes(&joined(1e-5)).eigenvalues;
    for ratio in [1e-5, 1e-6, 1e-7, 1e-8] {
        let exact: Vec<f64> =
            reference.iter().enumerate().map(|(j, l)| if j < 6 { l * ratio / 1e-5 } else { *l }).collect();
        for count in [8, 30] {
            in_every_way(&format!("joint {ratio:e}"), &joined(ratio), count, |what, found| {
                assert_close(what, found.eigenvalues(), &exact, 1e-4);
            });
        }
    }
}

#[test]
#[ignore = "slow"]
fn thin_plates_tell_their_noise() {
    // 1 m x 0.7 m x 1 mm: rounding of K alone causes errors of 1e-6 to 1e-4 in the lowest eigenvalues.
    for (kind, cells) in [(ElementKind::Hex8, [8, 6, 1]), (ElementKind::Tet10, [4, 3, 1])] {
        let body = Mesh::block(kind, cells, [1.0, 0.7, 1e-3]).assemble(&STEEL, MassRule::Consistent);
        for count in [8, 40] {
            let mut first: Option<Vec<f64>> = None;
            for (method, accuracy) in WAYS {
                let what = format!("{kind:?}, {count} modes, {method:?}, {accuracy:?}");
                let settings = ModeSettings {
                    wanted: Wanted::Lowest(count),
                    accuracy,
                    method,
                    ..ModeSettings::default()
                };
                let found =
                    solve(body.raw_model(), &settings).unwrap_or_else(|error| panic!("{what}: {error}"));
                assert!(found.modes.diagnostics.iter().any(|d| d.code() == Code::NoiseFloor), "{what}");
                assert!(found.modes.rigid_noise > 1e-7 && found.modes.rigid_noise < 1e-3, "{what}");
                let exact = first.get_or_insert_with(|| found.eigenvalues().to_vec());
                assert_close(&what, found.eigenvalues(), exact, 1e-3);
            }
        }
    }
}

#[test]
#[ignore = "slow"]
fn twenty_six_nearly_equal_modes_are_all_found() {
    // Thirteen equal fingers on one bar, each with two first bending modes: clusters wider than any block.
    let mut cells = grid([25, 1, 1]);
    cells.extend((0..13).flat_map(|finger| (1..5).map(move |z| [2 * finger, 0, z])));
    let comb = Mesh::from_cells(ElementKind::Hex8, &cells, |[x, y, z]| {
        [0.01 * x, 0.01 * y, if z <= 1.0 { 0.05 * z } else { 0.03 + 0.02 * z }]
    });
    let body = comb.assemble(&STEEL, MassRule::Consistent);
    let exact = dense_modes(&body).eigenvalues;
    let widest = exact.windows(13).map(|group| group[12] / group[0]).fold(f64::MAX, f64::min);
    assert!(widest < 1.05, "thirteen modes within {widest}");
    for count in [5, 20, 50] {
        in_every_way("comb", &body, count, |what, found| {
            assert_close(what, found.eigenvalues(), &exact, 1e-10)
        });
    }
}
