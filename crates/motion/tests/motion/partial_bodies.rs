//! Bodies that hold only some modes and some groups of the kinetic energy: the remaining terms are unchanged,
//! and the body is valid.

use flexbody_base::diagnostic::Code;
use flexbody_body::flex_body::{FlexBody, TermDecision, TermGroup, TermGroups};
use flexbody_body::invariants::{BodyFrame, error_norms, primary_differences};
use flexbody_motion::dynamics::{
    Balance, Configuration, EmptySpace, EquationsOfMotion, EulerParameters, Evaluation, Orientation, Terms,
};
use nalgebra::Vector3;
use oracle::flexible::{body_of, fixture, moving_state, soft_block};
use oracle::general::quasi_velocities;
use oracle::motion::{conserving, run};
use oracle::partial::{combinations, decisions, with_groups};
use oracle::plane::rectangle;
use oracle::random::Random;

/// Returns solids, a general mass, and both in the plane.
fn bodies() -> [FlexBody; 4] {
    [
        soft_block(8),
        fixture("frame_beams", 6, BodyFrame::Model),
        body_of(rectangle(5, 2, 0.7, [1.0, 2.0]), 6, BodyFrame::Com),
        fixture("plane_frame", 6, BodyFrame::Principal),
    ]
}

#[test]
fn all_modes_and_all_groups_are_the_body_itself() {
    for body in bodies() {
        let all: Vec<usize> = (0..body.n_modes()).collect();
        assert_eq!(body.reduced(&all, TermGroups::ALL, Vec::new()).expect("a body"), body);
        // A body that already lacks groups keeps its decisions.
        let partial = with_groups(&body, TermGroups { w1: true, ..TermGroups::NONE });
        assert_eq!(partial.reduced(&all, TermGroups::ALL, Vec::new()).expect("a body"), partial);
    }
}

#[test]
fn what_is_held_is_what_the_full_body_has_and_nothing_else_is_there() {
    for body in bodies() {
        let full = body.invariants();
        for groups in combinations() {
            let partial = with_groups(&body, groups);
            let own = partial.invariants();
            assert_eq!(own.w1(), full.w1().filter(|_| groups.w1));
            assert_eq!(own.w2(), full.w2().filter(|_| groups.w2));
            assert_eq!(own.w3(), full.w3().filter(|_| groups.w3));
            assert_eq!((own.inertia(), own.c2(), own.w0()), (full.inertia(), full.c2(), full.w0()));
            assert_eq!((own.modal_mass(), own.c1()), (full.modal_mass(), full.c1()));
            assert_eq!(partial.groups(), groups);
            let failed: Vec<_> =
                partial.identities(BodyFrame::Model).into_iter().filter(|check| !check.passed).collect();
            assert!(failed.is_empty(), "{groups:?}: {failed:?}");
            // Only terms held by both bodies are compared.
            for (name, difference) in primary_differences(own, full) {
                assert_eq!(difference, 0.0, "{groups:?}: {name}");
            }
            for lumped in partial.lumped() {
                assert_eq!(lumped.comparison, error_norms(own, &lumped.invariants));
                for group in TermGroup::ALL {
                    let told = lumped.comparison.iter().any(|(name, _)| name.starts_with(group.name()));
                    assert_eq!(told, groups.has(group), "{groups:?}");
                }
            }
        }
    }
}

#[test]
fn some_modes_are_slices_of_all() {
    for body in bodies() {
        let kept = [0, 2, 5];
        let partial = body.reduced(&kept, TermGroups::ALL, Vec::new()).expect("a body");
        let (nf, full, own) = (body.n_modes(), body.invariants(), partial.invariants());
        let at = |index: usize| index / kept.len() * nf + kept[index % kept.len()];
        let (w0, w1, w2, w3) = (full.w0(), full.w1(), full.w2(), full.w3());
        let (w1, w2, w3) = (w1.expect("held"), w2.expect("held"), w3.expect("held"));
        let (own_w1, own_w2, own_w3) = (own.w1(), own.w2(), own.w3());
        let (own_w1, own_w2, own_w3) = (own_w1.expect("held"), own_w2.expect("held"), own_w3.expect("held"));
        for column in 0..3 * kept.len() {
            for k in 0..3 {
                assert_eq!(own_w1[(k, column)], w1[(k, at(column))]);
                assert_eq!(own.w0()[(k, column)], w0[(k, at(column))]);
            }
            for row in 0..3 * kept.len() {
                assert_eq!(own_w2[(row, column)], w2[(at(row), at(column))]);
            }
            for (j, &mode) in kept.iter().enumerate() {
                assert_eq!(own_w3[(column, j)], w3[(at(column), mode)]);
            }
        }
        for (j, &mode) in kept.iter().enumerate() {
            assert_eq!(partial.modes().eigenvalue[j], body.modes().eigenvalue[mode]);
            assert_eq!(partial.modes().shape.col(j), body.modes().shape.col(mode));
            assert_eq!(own.c2()[(2, j)], full.c2()[(2, mode)]);
            assert_eq!(own.modal_stiffness()[(j, j)], full.modal_stiffness()[(mode, mode)]);
        }
        for (lumped, all) in partial.lumped().iter().zip(body.lumped()) {
            assert_eq!(lumped.invariants, all.invariants.with_modes(&kept));
            assert_eq!(lumped.comparison, error_norms(own, &lumped.invariants));
        }
    }
}

#[test]
fn the_proof_that_no_mode_is_missing_stays_with_the_lowest_modes_only() {
    let body = soft_block(8);
    let of = |modes: &[usize]| body.reduced(modes, TermGroups::ALL, Vec::new()).expect("a body");
    assert!(body.certificate().proved_modes.is_some());
    let lowest = of(&[0, 1, 2]);
    assert_eq!(lowest.certificate(), body.certificate());
    let others = of(&[0, 2, 3]);
    assert_eq!(others.certificate().proved_modes, None);
    assert!(others.certificate().remark.contains("3 of 8 modes were kept"), "{:?}", others.certificate());
}

#[test]
fn equations_have_the_terms_that_are_asked_for_and_held() {
    let mut random = Random(3);
    for body in bodies() {
        let (nf, states) = (body.n_modes(), if body.dimension() == 3 { 3 } else { 0 });
        for groups in combinations() {
            let TermGroups { w1, w2, w3 } = groups;
            let partial = EquationsOfMotion::new(&with_groups(&body, groups), Terms::ALL);
            let masked = EquationsOfMotion::new(&body, Terms { w1, w2, w3, ..Terms::ALL });
            assert_eq!(partial.terms(), masked.terms());
            assert_eq!(partial.multiplications(), masked.multiplications());
            for _ in 0..states {
                let state = moving_state(&mut random, &body);
                let velocities = quasi_velocities(&state);
                let of = |equations: &EquationsOfMotion| {
                    let mut evaluation = Evaluation::new(equations);
                    evaluation.set(state.q.as_slice(), velocities.as_slice());
                    let mut rates = vec![0.0; 6 + nf];
                    evaluation.accelerations(&vec![0.0; 6 + nf], &mut rates).expect("a body");
                    (rates, evaluation.kinetic_energy(), evaluation.angular_momentum())
                };
                // Equal numbers in the same order give equal bits.
                assert_eq!(of(&partial), of(&masked), "{groups:?}");
            }
        }
    }
}

#[test]
fn a_body_without_groups_keeps_its_energy_and_momenta() {
    for body in [soft_block(6), fixture("shell_folded", 6, BodyFrame::Model)] {
        for groups in combinations() {
            let partial = with_groups(&body, groups);
            let partial = partial.reduced(&[0, 1, 3, 5], groups, Vec::new()).expect("a body");
            let equations = EquationsOfMotion::new(&partial, Terms::ALL);
            let lambda = &partial.modes().eigenvalue;
            let (rate, radius) = (lambda[0].sqrt(), partial.invariants().inertia()[(2, 2)].sqrt());
            let start = Configuration {
                origin: Vector3::new(0.3, -0.2, 0.5),
                attitude: EulerParameters([1.0, 0.0, 0.0, 0.0]),
                velocity: Vector3::new(0.2, 0.5, -0.4) * (0.1 * rate * radius),
                omega: Vector3::new(0.1, 1.0, 0.05) * (0.2 * rate),
                q: lambda.iter().map(|l| 0.05 * radius * rate / l.sqrt()).collect(),
                qd: vec![0.0; 4],
            };
            let step = 0.15 / lambda[3].sqrt();
            let instants: Vec<f64> = (0..=10).map(|i| f64::from(i) * 150.0 * step).collect();
            let (places, balances) =
                run(&equations, &EmptySpace, &start, conserving(6, step), &instants, &[]);
            let energy = |b: &Balance| b.kinetic + b.elastic;
            for balance in &balances {
                let first = &balances[0];
                let linear = (balance.linear - first.linear).norm() / first.linear.norm();
                let angular = (balance.angular - first.angular).norm() / first.angular.norm();
                let drift = (energy(balance) / energy(first) - 1.0).abs();
                assert!(
                    linear < 1e-13 && angular < 1e-12 && drift < 1e-8,
                    "{groups:?}: {linear:e} {angular:e} {drift:e}"
                );
            }
            let turned = (places[10].attitude.axes() - places[0].attitude.axes()).norm();
            assert!(turned > 0.1 && places[10].q != places[0].q, "it moves");
        }
    }
}

#[test]
fn an_evaluation_of_inertia_alone_takes_a_tenth_at_ninety_modes() {
    let body = fixture("bracket_hex20", 90, BodyFrame::Principal);
    let rigid = with_groups(&body, TermGroups::NONE);
    let of = |body: &FlexBody| EquationsOfMotion::new(body, Terms::ALL).multiplications();
    // 2 panels of 32 rows for terms linear in q, 12 rows in forces and momenta, 33 in the elimination, 4 of
    // K_ff and D.
    assert_eq!(of(&rigid), 90 * (2 * 32 + 12 + 33 + 4));
    // W1 has 6 rows; W2 17 panels and 18 rows; W3 twice 9 panels and 6 rows.
    assert_eq!(of(&body), of(&rigid) + 90 * (6 + 17 * 32 + 18 + 2 * 9 * 32 + 6));
    assert!(of(&body) >= 10 * of(&rigid));
}

#[test]
fn decisions_must_be_those_of_the_body() {
    let body = soft_block(4);
    let all = [0, 1, 2, 3];
    let refused = |modes: &[usize], groups: TermGroups, terms: Vec<TermDecision>, code: Code, said: &str| {
        let error = body.reduced(modes, groups, terms).expect_err(said);
        let found = error.diagnostics().iter().find(|d| d.message().contains(said));
        assert_eq!(found.map(|d| d.code()), Some(code), "{error}");
    };
    refused(&[], TermGroups::ALL, vec![], Code::Usage, "expected ascending indices below 4");
    refused(&[1, 0], TermGroups::ALL, vec![], Code::Usage, "expected ascending indices");
    refused(&[0, 4], TermGroups::ALL, vec![], Code::Usage, "expected ascending indices");
    let without_w1 = TermGroups { w1: false, ..TermGroups::ALL };
    let schema = Code::BodySchema;
    refused(&all, without_w1, vec![], schema, "does not hold W1, but no decision of `terms` drops it");
    refused(&all, TermGroups::ALL, decisions(without_w1), schema, "drops W1, but `invariants` holds it");
    refused(
        &all,
        TermGroups::NONE,
        decisions(without_w1),
        schema,
        "keeps W2, but `invariants` does not hold it",
    );
    let twice = [decisions(without_w1), decisions(without_w1)].concat();
    refused(&all, without_w1, twice, schema, "two decisions about W1");
    let with = |change: &dyn Fn(&mut TermDecision)| {
        let mut terms = decisions(without_w1);
        change(&mut terms[0]);
        terms
    };
    refused(&all, without_w1, with(&|t| t.bound = f64::NAN), schema, "`terms.W1.bound` is NaN");
    refused(&all, without_w1, with(&|t| t.limit = -1.0), schema, "`terms.W1.limit` is -1e0");
    refused(&all, without_w1, with(&|t| t.reason = "\0".to_owned()), schema, "contains a NUL");
    // Entries must agree with the stated groups.
    let mut parts = with_groups(&body, without_w1).into_parts();
    parts.invariants.primary_mut().ibar[0][0][1] = 1.0;
    let error = FlexBody::new(parts).expect_err("entries of W1");
    assert!(error.to_string().contains("entries of groups that it does not hold"), "{error}");
}
