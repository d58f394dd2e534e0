//! Craig-Bampton bodies with some of their fixed-interface modes, beside conversions with fewer and dense solutions.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::{BasisChoice, CraigBampton};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_body::verification::body_identities;
use flexbody_model::{Coupling, RawModel};
use nalgebra::Vector3;
use oracle::brackets::{bracket, strip};
use oracle::craig_bampton::{body, close, converted, model};
use oracle::reference::symmetric_eigen;

fn models() -> Vec<RawModel> {
    let couplings = [[Coupling::Rigid, Coupling::Averaging], [Coupling::Free, Coupling::Rigid]];
    couplings.into_iter().flat_map(|pair| [bracket(pair), strip(pair)]).collect()
}

fn hold(body: &FlexBody) {
    let checks = body_identities(body).into_iter().chain(body.parts().interface_identities());
    for check in checks {
        assert!(check.passed, "{}: {:e} > {:e}", check.name, check.value, check.limit);
    }
}

/// The lowest fixed-interface modes give the body that a conversion with as many gives.
#[test]
fn the_lowest_give_the_body_of_a_conversion_with_fewer() {
    for raw in models() {
        let model = model(raw);
        let whole = body(&model, 6);
        for count in 0..6 {
            let kept: Vec<usize> = (0..count).collect();
            let fewer = whole.with_fixed_interface_modes(&kept).expect("a body");
            let expected = body(&model, count);
            hold(&fewer);
            assert_eq!(fewer.n_modes(), expected.n_modes());
            for (own, other) in fewer.modes().eigenvalue.iter().zip(&expected.modes().eigenvalue) {
                close(*own, *other, 1e-8, "lambda");
            }
            // Of modes with an eigenvalue of their own, the shapes but for their sign.
            let lambda = &expected.modes().eigenvalue;
            for j in 0..lambda.len() {
                let apart = |other: usize| (lambda[other] / lambda[j] - 1.0).abs() > 1e-3;
                if (0..lambda.len()).filter(|other| *other != j).all(apart) {
                    let (a, b) = (fewer.modes().shape.col(j), expected.modes().shape.col(j));
                    let sign = a.transpose() * b;
                    let difference = a - b * faer::Scale(sign.signum());
                    assert!(difference.norm_max() < 1e-6 * b.norm_max(), "mode {j} of {count}");
                }
            }
            assert_eq!(fewer.certificate().fixed_interface.as_ref().map(|fixed| fixed.modes), Some(count));
            let is_proved = |body: &FlexBody| {
                body.certificate().fixed_interface.as_ref().is_some_and(|fixed| fixed.is_proved())
            };
            assert!(is_proved(&fewer) == is_proved(&whole));
        }
    }
}

/// Any choice gives the eigenvalues of K and M in the coordinates that are left, by a dense solution.
#[test]
fn any_choice_gives_the_modes_of_the_coordinates_that_are_left() {
    for raw in models() {
        let zero = if raw.dimension == 2 { 3 } else { 6 };
        let whole = body(&model(raw), 6);
        for kept in [vec![1, 4], vec![5], vec![0, 2, 3, 4, 5]] {
            let fewer = whole.with_fixed_interface_modes(&kept).expect("a body");
            hold(&fewer);
            let coordinates = whole.coordinates().expect("a Craig-Bampton basis");
            let first = coordinates.names.len() - 6;
            let left: Vec<usize> = (0..first).chain(kept.iter().map(|at| first + at)).collect();
            let block = |of: &Mat<f64>| Mat::from_fn(left.len(), left.len(), |i, j| of[(left[i], left[j])]);
            let (stiffness, mass) = (block(&coordinates.stiffness), block(&coordinates.mass));
            let lower = mass.llt(faer::Side::Lower).expect("positive definite");
            let half = |a: &Mat<f64>| {
                use faer::linalg::solvers::Solve;
                lower.L().partial_piv_lu().solve(a)
            };
            let lambda = symmetric_eigen(half(&half(&stiffness).transpose().to_owned()).as_ref()).0;
            assert_eq!(lambda.len() - zero, fewer.n_modes());
            for (own, other) in fewer.modes().eigenvalue.iter().zip(&lambda[zero..]) {
                close(*own, *other, 1e-8, "lambda");
            }
            assert_eq!(fewer.fixed_interface_amplitudes().expect("amplitudes").nrows(), kept.len());
            let names = &fewer.coordinates().expect("coordinates").names;
            assert_eq!(names.last(), Some(&format!("fixed-interface mode {}", kept.len())));
        }
    }
}

/// Loads at the interfaces that balance each other deform the body without its fixed-interface modes as they deform the whole
/// one.
#[test]
fn the_static_response_to_loads_at_the_interfaces_stays() {
    let whole = body(&model(bracket([Coupling::Rigid, Coupling::Rigid])), 6);
    let fewer = whole.with_fixed_interface_modes(&[]).expect("a body");
    let compliance = |body: &FlexBody| {
        let [first, second] = [0, 1].map(|at| body.static_modal_coordinates().at_interfaces[at].1.clone());
        let place = |at: usize| Vector3::from(body.interfaces()[at].reference.expect("a reference point"));
        let arm = (place(1) - place(0)).cross_matrix();
        // A load at the second interface, and the one at the first that balances it.
        let balance = Mat::from_fn(6, 6, |i, j| match (i < 3, j < 3) {
            (false, true) => -arm[(i - 3, j)],
            (true, false) => 0.0,
            _ => -f64::from(i == j),
        });
        let response = second + first * balance;
        response.transpose() * body.invariants().modal_stiffness() * &response
    };
    let (own, expected) = (compliance(&fewer), compliance(&whole));
    assert!((own - &expected).norm_max() < 1e-8 * expected.norm_max());
}

#[test]
fn bodies_without_interface_coordinates_and_wrong_numbers_are_refused() {
    let model = model(bracket([Coupling::Rigid, Coupling::Rigid]));
    let whole = body(&model, 3);
    assert_eq!(whole.with_fixed_interface_modes(&[0, 1, 2]).expect("all"), whole);
    for kept in [vec![3], vec![1, 0], vec![0, 0]] {
        let error = whole.with_fixed_interface_modes(&kept).expect_err("refused");
        assert!(error.has(Code::Usage), "{error}");
    }
    let free = converted(&model, BasisChoice::default(), 6, BodyFrame::Principal).body;
    assert!(free.fixed_interface_amplitudes().is_none());
    assert!(free.with_fixed_interface_modes(&[]).expect_err("refused").has(Code::Usage));
    let static_alone =
        converted(&model, BasisChoice::CraigBampton(CraigBampton), 0, BodyFrame::Principal).body;
    assert!(static_alone.fixed_interface_amplitudes().is_none());
}
