//! Conversions for a scene: terms ruled out by the scene are not computed, and the others are unchanged.

use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{Conversion, ConvertSettings, ModalModel, convert};
use flexbody_body::flex_body::{TermDecision, TermGroups};
use flexbody_body::invariants::{BodyFrame, primary_differences};
use flexbody_body::verification::verify;
use flexbody_eigen::{Accuracy, Wanted};
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{Damping, FeModel};
use oracle::partial::{combinations, decisions};
use oracle::plane::rectangle;

const MODES: usize = 6;

fn settings() -> ConvertSettings {
    let modes = ModeSettings { wanted: Wanted::Lowest(MODES), ..ModeSettings::default() };
    ConvertSettings { modes, frame: BodyFrame::Principal.into(), ..ConvertSettings::default() }
}

fn fixture(name: &str) -> FeModel {
    let folder = oracle::fixtures().join("models").join(name);
    let raw = read_model(&read_manifest(folder.join("model.toml")).expect("manifest")).expect("readable");
    FeModel::from_raw(raw).expect("a body").model
}

fn decided(model: &FeModel, settings: &ConvertSettings, terms: &[TermDecision]) -> Conversion {
    let modal = ModalModel::find(model, settings, &Context::QUIET).expect("modes");
    let condensed = modal.condense_selected(modal.condense_linear(), terms.to_vec());
    modal.finish(condensed, &Context::QUIET).expect("converts")
}

/// Returns models with the number of columns of rigid motion, and of all condensed columns.
fn models() -> [(FeModel, u64, u64); 4] {
    let nf = MODES as u64;
    let mut damped = rectangle(6, 3, 0.3, [5.0, -2.0]);
    damped.data.damping = Some(Damping::Rayleigh { alpha: 0.1, beta: 1e-6 });
    [
        (fixture("connecting_rod"), 4, 4 + 3 * nf),
        (fixture("shell_folded"), 6, 6 + 4 * nf),
        (FeModel::from_raw(damped).expect("a body").model, 4, 4 + 3 * nf),
        (fixture("plane_frame"), 3, 3 + 2 * nf),
    ]
}

#[test]
#[ignore = "slow"]
fn what_is_ruled_out_is_not_multiplied_and_the_rest_is_the_same() {
    for (model, rigid, all) in models() {
        let name = model.name();
        let whole = convert(&model, &settings(), &Context::QUIET).expect("converts");
        assert_eq!(whole.condensed_columns, all, "{name}");
        let modes: Vec<usize> = (0..whole.body.n_modes()).collect();
        for groups in combinations() {
            let terms = decisions(groups);
            let found = decided(&model, &settings(), &terms);
            let linear = !groups.w2 && !groups.w3;
            assert_eq!(
                found.condensed_columns,
                if linear { rigid } else { rigid + all },
                "{name}: {groups:?}"
            );
            let expected = whole.body.reduced(&modes, groups, terms).expect("a body");
            if !linear {
                assert_eq!(found.body, expected, "{name}: {groups:?}");
                continue;
            }
            assert_eq!((found.body.groups(), found.body.terms()), (groups, expected.terms()));
            let (own, other) = (found.body.invariants(), expected.invariants());
            for (what, difference) in primary_differences(other, own) {
                assert!(difference < 1e-12, "{name}: {groups:?}: {what} {difference:e}");
            }
            for (own, other) in found.body.lumped().iter().zip(expected.lumped()) {
                assert_eq!(own.invariants.groups(), groups);
                for ((what, a), (same, b)) in own.comparison.iter().zip(&other.comparison) {
                    assert!(what == same && (a - b).abs() < 1e-11, "{name}: {groups:?}: {what} {a} {b}");
                }
                assert_eq!(own.comparison.len(), other.comparison.len());
            }
            let failed: Vec<_> = found
                .body
                .identities(BodyFrame::Principal)
                .into_iter()
                .chain(verify(&found.body, &model).expect("comparable"))
                .filter(|check| !check.passed)
                .collect();
            assert!(failed.is_empty(), "{name}: {groups:?}: {failed:?}");
        }
    }
}

#[test]
fn a_decision_is_made_on_what_the_body_will_have() {
    for (model, ..) in models() {
        let body = convert(&model, &settings(), &Context::QUIET).expect("converts").body;
        let near = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * b.abs(), "{a} is not {b}");
        let settings = settings();
        let modal = ModalModel::find(&model, &settings, &Context::QUIET).expect("modes");
        let linear = modal.condense_linear();
        let early = modal.body(&linear).expect("a body");
        assert_eq!(early.groups(), TermGroups { w1: true, ..TermGroups::NONE });
        near(early.invariants().mass(), body.invariants().mass());
        near(early.invariants().inertia()[(2, 2)], body.invariants().inertia()[(2, 2)]);
        assert_eq!((early.frame(), early.nodes()), (body.frame(), body.nodes()));
        assert_eq!(
            (early.modes().eigenvalue.as_slice(), &early.modes().shape),
            (body.modes().eigenvalue.as_slice(), &body.modes().shape)
        );
        assert_eq!(early.interfaces(), body.interfaces());
        for (found, expected) in early.modes().damping_ratio.iter().zip(&body.modes().damping_ratio) {
            near(*found, *expected);
        }
        let condensed = modal.condense_selected(linear, Vec::new());
        let found = modal.finish(condensed, &Context::QUIET).expect("converts");
        assert_eq!(found.body, body, "nothing was decided");
    }
}

#[test]
fn certified_digits_are_those_of_the_whole() {
    let (model, ..) = &models()[2];
    let mut settings = settings();
    settings.modes.accuracy = Accuracy::Certified;
    let whole = convert(model, &settings, &Context::QUIET).expect("converts").body;
    let terms = decisions(TermGroups::NONE);
    let found = decided(model, &settings, &terms).body;
    let modes: Vec<usize> = (0..whole.n_modes()).collect();
    let expected = whole.reduced(&modes, TermGroups::NONE, terms).expect("a body");
    assert_eq!((found.invariants(), found.certificate()), (expected.invariants(), expected.certificate()));
    assert!(verify(&found, model).expect("comparable").iter().all(|check| check.passed));
}
