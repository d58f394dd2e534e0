//! Bodies without some groups of their kinetic energy, carried: what they hold is what the whole carried body has.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{Carrier, FlexBody, Subset, TermGroups};
use flexbody_body::invariants::{BodyFrame, Invariants};
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use oracle::general::raw_fixture;

fn body_of(name: &str, frame: BodyFrame) -> FlexBody {
    let model = FeModel::from_raw(raw_fixture(name)).expect("a sound model").model;
    let settings = ConvertSettings {
        frame: frame.into(),
        modes: ModeSettings { wanted: Wanted::Lowest(6), ..ModeSettings::default() },
        ..ConvertSettings::default()
    };
    convert(&model, &settings, &Context::QUIET).expect("a body").body
}

/// Returns m_ff, C1, C2, W0 and the held groups of W1, W2 and W3 of a body, as matrices.
fn arrays(invariants: &Invariants) -> Vec<Mat<f64>> {
    let always = [invariants.modal_mass(), invariants.c1().clone(), invariants.c2(), invariants.w0()];
    let held = [invariants.w1(), invariants.w2(), invariants.w3()];
    always.into_iter().chain(held.into_iter().flatten()).collect()
}

fn with_groups(body: &FlexBody, groups: TermGroups) -> FlexBody {
    body.clone().subset(&Subset { groups, ..Subset::default() }).expect("a body")
}

/// Sets of groups of which a carried body loses none: W2 and W3 beside W1.
fn kept_by_carriers() -> impl Iterator<Item = TermGroups> {
    let all = (0..8).map(|bits| TermGroups { w1: bits & 1 != 0, w2: bits & 2 != 0, w3: bits & 4 != 0 });
    all.filter(|groups| groups.in_carried_modes() == *groups)
}

/// Groups are dropped before or after the modes change to those in which the carrier is at rest, with the same result: of
/// solids, of shells whose nodes have inertia of their own, and in the plane.
#[test]
fn groups_dropped_in_the_file_are_those_dropped_in_the_carried_body() {
    assert_eq!(kept_by_carriers().count(), 5);
    for (name, frame) in [
        ("bracket_hex20", BodyFrame::Com),
        ("bracket_hex20", BodyFrame::Principal),
        ("plane_frame", BodyFrame::Com),
    ] {
        let body = body_of(name, frame);
        let carrier = match body.interfaces().first() {
            Some(interface) => Carrier::Interface(interface.name.clone()),
            None => Carrier::Node(body.nodes().ids[0]),
        };
        let whole = body.carried(&carrier).expect("a carrier");
        for groups in kept_by_carriers() {
            let first = with_groups(&body, groups);
            let first = first.carried(&carrier).expect("a carrier");
            let last = with_groups(&whole, groups);
            assert_eq!(first.groups(), groups, "{name}");
            for (a, b) in arrays(first.invariants()).iter().zip(arrays(last.invariants())) {
                let difference = (a - &b).norm_max();
                assert!(difference <= 1e-12 * b.norm_max(), "{name} {groups:?}: {difference:e}");
            }
        }
    }
}

#[test]
fn groups_that_need_w1_are_refused_without_it() {
    let body = body_of("bracket_hex20", BodyFrame::Com);
    let carrier = Carrier::Interface(body.interfaces()[0].name.clone());
    for (groups, named) in [
        (TermGroups { w2: true, ..TermGroups::NONE }, "its W2 about"),
        (TermGroups { w2: true, w3: true, w1: false }, "its W2 and W3 about"),
    ] {
        let error = with_groups(&body, groups).carried(&carrier);
        let error = error.expect_err("a body without W1");
        assert!(error.has(Code::CarrierImpossible) && error.to_string().contains(named), "{error}");
    }
}
