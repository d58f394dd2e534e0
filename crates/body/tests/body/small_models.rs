//! Bodies of one or a few elements: all their modes, singular mass matrices, dense and sparse methods
//! compared, and invalid bodies.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::ExitCode;
use flexbody_body::basis::{ModeSettings, free_surface};
use flexbody_eigen::{Accuracy, Method, Proof, Wanted};
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{RawModel, check};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Assembly, Mesh, entries};
use oracle::pipeline::{proved, solve, try_modes};
use oracle::reference::{dense_modes, unit_cube_eigenvalues};

const METHODS: [Method; 3] = [Method::Auto, Method::Dense, Method::Lanczos];

const UNIT: Material = Material { youngs: 1.0, poisson: 0.2, density: 1.0 };

fn assert_close(found: &[f64], exact: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), exact.len(), "{what}");
    for (j, (a, b)) in found.iter().zip(exact).enumerate() {
        assert!((a / b - 1.0).abs() < tolerance, "{what}, mode {j}: {a} {b} ({:e})", a / b - 1.0);
    }
}

fn one_element(kind: ElementKind) -> Assembly {
    let lattice = match kind {
        ElementKind::Hex8 | ElementKind::Hex20 => {
            return Mesh::block(kind, [1; 3], [1.0; 3]).assemble(&UNIT, MassRule::Consistent);
        }
        ElementKind::Tet4 | ElementKind::Tet10 => Mesh::block(kind, [1; 3], [1.0; 3]),
    };
    // The first of the six tetrahedra alone, with renumbered nodes.
    let element = &lattice.elements[0].1;
    let nodes = element.iter().map(|&i| lattice.nodes[i]).collect();
    let mesh = Mesh { nodes, elements: vec![(kind, (0..element.len()).collect())] };
    mesh.assemble(&UNIT, MassRule::Consistent)
}

#[test]
fn one_trilinear_cube_has_all_eighteen_modes_of_its_closed_form() {
    let (lambda, mu) = UNIT.lame();
    for method in METHODS {
        let found = proved(one_element(ElementKind::Hex8).raw_model(), 18, method);
        assert_close(found.eigenvalues(), &unit_cube_eigenvalues(lambda, mu), 1e-12, &format!("{method:?}"));
    }
}

#[test]
fn one_element_of_every_kind_has_all_its_modes() {
    for kind in [ElementKind::Tet4, ElementKind::Tet10, ElementKind::Hex8, ElementKind::Hex20] {
        let body = one_element(kind);
        let reference = dense_modes(&body);
        assert_eq!((reference.zero, reference.eigenvalues.len()), (6, body.n_dofs() - 6), "{kind:?}");
        for method in METHODS {
            let found = proved(body.raw_model(), body.n_dofs() - 6, method);
            assert_close(found.eigenvalues(), &reference.eigenvalues, 1e-11, &format!("{kind:?} {method:?}"));
        }
    }
}

#[test]
#[ignore = "slow"]
fn dense_and_sparse_paths_agree_with_the_reference() {
    for (kind, cells, rule) in [
        (ElementKind::Hex8, [5, 3, 2], MassRule::Consistent),
        (ElementKind::Tet4, [4, 2, 2], MassRule::Consistent),
        (ElementKind::Tet10, [2, 1, 1], MassRule::Consistent),
        (ElementKind::Hex20, [3, 1, 1], MassRule::Consistent),
        (ElementKind::Hex8, [5, 3, 2], MassRule::Reduced),
        (ElementKind::Tet10, [2, 1, 1], MassRule::Reduced),
    ] {
        let body = Mesh::block(kind, cells, [0.4, 0.15, 0.1]).assemble(&Material::STEEL, rule);
        let reference = dense_modes(&body);
        let what = format!("{kind:?} {rule:?}");
        for count in [1, 7, 20, reference.eigenvalues.len()] {
            for method in METHODS {
                let found = proved(body.raw_model(), count, method);
                assert_close(
                    found.eigenvalues(),
                    &reference.eigenvalues[..count],
                    1e-10,
                    &format!("{what} {count} {method:?}"),
                );
                let residual = found.modes.solution.residuals.iter().fold(0.0f64, |m, r| m.max(*r));
                assert!(residual < 1e-11, "{what} {count} {method:?}: residual {residual:e}");
            }
        }
    }
}

#[test]
fn singular_mass_gives_its_finite_modes_and_says_so() {
    for (kind, cells) in [(ElementKind::Hex8, [3, 2, 1]), (ElementKind::Tet10, [1, 1, 1])] {
        let body = Mesh::block(kind, cells, [0.3, 0.2, 0.1]).assemble(&Material::STEEL, MassRule::Reduced);
        let reference = dense_modes(&body);
        assert!(reference.infinite > 0);
        for method in METHODS {
            // The largest possible request is limited to the finite modes.
            let found = try_modes(body.raw_model(), body.n_dofs() - 6, method).expect("a sound body");
            assert_close(found.eigenvalues(), &reference.eigenvalues, 1e-10, &format!("{kind:?} {method:?}"));
            let has = |code| found.modes.diagnostics.iter().any(|d| d.code() == code);
            assert!(has(Code::ModesClamped), "{method:?}: {:?}", found.modes.diagnostics);
            assert!(has(Code::MassMatrixSingular), "{method:?}: {:?}", found.modes.diagnostics);
        }
    }
}

#[test]
fn nodes_without_mass_are_counted_on_every_path() {
    let mut body = Mesh::block(ElementKind::Hex8, [4, 2, 2], [0.4, 0.2, 0.1])
        .assemble(&Material::STEEL, MassRule::Consistent)
        .with_lumped_mass();
    let massless = [7u32, 20];
    let kept: Vec<_> = entries(&body.scalar_mass).filter(|(row, ..)| !massless.contains(row)).collect();
    let n = body.nodes.len();
    body.scalar_mass = CscMatrix::from_triplets(n, n, &kept);
    let at_most = body.n_dofs() - 6 - 3 * massless.len();
    for method in METHODS {
        let settings = ModeSettings {
            wanted: Wanted::Lowest(10),
            accuracy: Accuracy::Standard,
            method,
            ..ModeSettings::default()
        };
        let found = solve(body.raw_model(), &settings).expect("a sound body");
        let note = found.modes.diagnostics.iter().find(|d| d.code() == Code::MassMatrixSingular);
        let message = note.map(|d| d.message()).unwrap_or_default();
        assert!(message.contains(&format!("{at_most} of {} flexible modes", body.n_dofs() - 6)), "{message}");
        assert!(found.model.has_diagonal_mass(), "massless nodes do not make it another kind of mass");
    }
}

#[test]
fn every_mode_below_a_frequency_is_found() {
    let body = Mesh::block(ElementKind::Hex8, [4; 3], [1.0; 3]).assemble(&UNIT, MassRule::Consistent);
    let reference = dense_modes(&body);
    let model = check(body.raw_model()).expect("a sound body").model;
    for count in [1usize, 2, 3, 10, 40] {
        // Compares between groups of repeated eigenvalues only.
        let (below, above) = (reference.eigenvalues[count - 1], reference.eigenvalues[count]);
        if above / below < 1.0 + 1e-6 {
            continue;
        }
        for method in METHODS {
            let wanted = Wanted::Below(0.5 * (below + above));
            let settings =
                ModeSettings { wanted, accuracy: Accuracy::Standard, method, ..ModeSettings::default() };
            let found = free_surface(&model, &settings, &Context::QUIET).expect("a sound body");
            assert_eq!(found.solution.eigenvalues.len(), count, "{method:?}");
            assert_eq!(found.solution.completeness.proof, Proof::InertiaCount);
        }
    }
}

/// Returns the codes and exit codes with which a model is refused.
fn refusal(raw: RawModel, method: Method) -> Vec<(Code, ExitCode)> {
    match try_modes(raw, 10, method) {
        Ok(body) => panic!("accepted: {:?}", body.eigenvalues()),
        Err(error) => error.diagnostics().iter().map(|d| (d.code(), d.code().exit_code())).collect(),
    }
}

#[test]
fn mechanisms_and_separate_bodies_are_refused() {
    for method in METHODS {
        for (kind, n) in [(ElementKind::Hex8, 1), (ElementKind::Hex8, 3), (ElementKind::Tet10, 2)] {
            let hinge = Mesh::hinge(kind, n).assemble(&UNIT, MassRule::Consistent);
            assert_eq!(
                refusal(hinge.raw_model(), method),
                [(Code::Mechanism, ExitCode::Untrustworthy)],
                "{kind:?} {n}"
            );
            let two = Mesh::two_bodies(kind, n).assemble(&UNIT, MassRule::Consistent);
            assert_eq!(refusal(two.raw_model(), method), [(Code::BodiesSeveral, ExitCode::Untrustworthy)]);
        }
    }
}

#[test]
fn negative_row_sum_masses_are_refused() {
    let body =
        Mesh::block(ElementKind::Tet10, [2, 1, 1], [2.0, 1.0, 1.0]).assemble(&UNIT, MassRule::Consistent);
    let lumped = body.with_lumped_mass();
    let codes = refusal(lumped.raw_model(), Method::Auto);
    assert!(codes.iter().all(|(_, exit)| *exit == ExitCode::Untrustworthy), "{codes:?}");
}
