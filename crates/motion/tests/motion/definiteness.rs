//! Deflections at which bodies with W3 and without W2 have an indefinite mass matrix: a closed form, and bodies
//! without such deflections.

use flexbody_base::diagnostic::Code;
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_body::invariants::BodyFrame;
use flexbody_motion::dynamics::{deflection_of_indefinite_inertia, indefinite_inertia};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::{body_of, soft_block};
use oracle::mesh::{Mesh, grid};
use oracle::partial::with_groups;

const W3_ONLY: TermGroups = TermGroups { w1: false, w2: false, w3: true };

/// Bar of unit square section with its first pair of bending modes.
fn bar(length: i32) -> FlexBody {
    let rubber = Material { youngs: 4.0, poisson: 0.0, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([length, 1, 1]), |place| place);
    body_of(mesh.assemble(&rubber, MassRule::Consistent).raw_model(), 2, BodyFrame::Principal)
}

/// The first bending modes of a free beam with the mass m move its ends by 2 / sqrt(m), and |Q'W3 e| = |q| about its
/// axis, where the inertia of a square section of width b is m b^2 / 6: the limit is 2 b / sqrt(6).
#[test]
fn a_slender_bar_reaches_the_limit_at_the_closed_form() {
    let limit = deflection_of_indefinite_inertia(&with_groups(&bar(60), W3_ONLY)).expect("a limit");
    let expected = 2.0 / 6f64.sqrt();
    assert!((limit / expected - 1.0).abs() < 0.01, "{limit} {expected}");
    let warning = indefinite_inertia(&with_groups(&bar(60), W3_ONLY)).expect("a warning");
    assert_eq!(warning.code(), Code::InertiaIndefinite);
    assert!(warning.message().contains("1.3"), "{}", warning.message());
}

#[test]
fn w2_and_stout_bodies_have_no_limit() {
    let slender = bar(60);
    for groups in [
        TermGroups::ALL,
        TermGroups { w2: true, ..W3_ONLY },
        TermGroups { w1: true, ..TermGroups::NONE },
        TermGroups::NONE,
    ] {
        assert_eq!(deflection_of_indefinite_inertia(&with_groups(&slender, groups)), None, "{groups:?}");
    }
    // The limit of a bar of four widths, 0.8 widths, is beyond a tenth of its length.
    for stout in [bar(4), soft_block(6)] {
        assert_eq!(indefinite_inertia(&with_groups(&stout, W3_ONLY)), None);
    }
}
