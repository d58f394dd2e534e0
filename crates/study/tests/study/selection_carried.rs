//! Selections for bodies that a moving interface carries: the groups and modes that the motion needs, and what motions near it
//! would need.

use flexbody_body::basis::{BasisChoice, CraigBampton, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, Subset, TermGroups};
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, NodeSet};
use flexbody_motion::scene::{LoadCases, simulate};
use flexbody_study::selection::{Selection, rule_out, select};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::Mesh;
use std::path::Path;

/// Returns a bar along x of 20 Craig-Bampton modes with the interface `root` at its end.
fn bar() -> FlexBody {
    let mesh = Mesh::block(ElementKind::Hex20, [10, 1, 1], [0.5, 0.02, 0.03]);
    let raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    let near = raw.nodes.ids.iter().zip(&raw.nodes.positions).filter(|(_, at)| at[0] < 1e-9);
    let root = NodeSet::new("root", near.map(|(id, _)| *id).collect());
    let interfaces = vec![NodeSet { coupling: Some(Coupling::Rigid), ..root }];
    let model = FeModel::from_raw(raw.with(|data| data.interfaces = interfaces)).expect("sound").model;
    let settings = ConvertSettings {
        basis: BasisChoice::CraigBampton(CraigBampton),
        modes: ModeSettings { wanted: Wanted::Lowest(20), ..ModeSettings::default() },
        ..ConvertSettings::default()
    };
    convert(&model, &settings, &Context::QUIET).expect("a body").body
}

/// Returns a scene whose carrier moves along an axis, or turns with a rate.
fn cases(carrier: &str, more: &str) -> LoadCases {
    let text = format!(
        "{more}[run]\nduration = 0.01\n[tolerance]\ndeflection = 0.01\nstress = 0.01\nreaction = 0.01\n\
         [carried]\ninterface = \"root\"\n{carrier}\n"
    );
    LoadCases::parse(&text, Path::new("carried.toml")).unwrap_or_else(|error| panic!("{error}"))
}

fn shaken() -> &'static str {
    "[carried.translation]\ndirection = [1, 0, 0]\nacceleration = { from = 0, to = 1, start = 0, duration = 0.002 }"
}

fn spun(rate: f64) -> String {
    format!("[carried.spin]\naxis = [0, 0, 1]\nrate = {rate}\n[initial]\ndeformation = \"static\"")
}

fn selected(body: &FlexBody, cases: &LoadCases) -> Selection {
    select(body, &[], cases, &Context::QUIET).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the largest difference between two bodies of elastic energy and reaction over a run, relative to the largest.
pub fn difference(whole: &FlexBody, own: &FlexBody, cases: &LoadCases) -> f64 {
    let [a, b] = [whole, own].map(|body| simulate(body, &cases[0], &Context::QUIET).expect("a motion").0);
    let energy = |at: usize, of: &flexbody_motion::scene::Recording| of.balances[at].elastic.sqrt();
    let reaction =
        |at: usize, of: &flexbody_motion::scene::Recording| of.reactions.as_ref().expect("a reaction")[at];
    let count = a.time.len();
    let (mut largest, mut differs) = ([0.0f64; 3], [0.0f64; 3]);
    for at in 0..count {
        let ((fa, ta), (fb, tb)) = (reaction(at, &a), reaction(at, &b));
        let sizes = [energy(at, &a), fa.norm(), ta.norm()];
        let apart = [(energy(at, &a) - energy(at, &b)).abs(), (fa - fb).norm(), (ta - tb).norm()];
        for k in 0..3 {
            largest[k] = largest[k].max(sizes[k]);
            differs[k] = differs[k].max(apart[k]);
        }
    }
    // A torque that is small beside the force counts beside it.
    largest[2] = largest[2].max(1e-2 * largest[1] * whole.extent());
    (0..3).map(|k| differs[k] / largest[k]).fold(0.0, f64::max)
}

/// A bar that is shaken along its axis needs three modes and no group, by a bound, and says what a turned motion needs. The
/// recommended body moves like the whole one in a simulation of its own.
#[test]
fn a_bar_shaken_along_its_axis_takes_a_few_modes_and_no_group() {
    let (body, scene) = (bar(), cases(shaken(), ""));
    let selection = selected(&body, &scene);
    assert_eq!(selection.groups, TermGroups::NONE);
    assert!(selection.terms.iter().all(|term| !term.kept && term.tier == 0 && term.bound <= term.limit));
    assert!(selection.modes.len() <= 4, "{:?}", selection.modes);
    assert!(selection.holds());
    let own = selection.body(&body).expect("a body");
    assert!(difference(&body, &own, &scene) < 0.01);
    // The same bound rules the groups out before they are computed.
    let linear =
        body.clone().subset(&Subset { groups: TermGroups::NONE, ..Subset::default() }).expect("a body");
    let ruled_out = rule_out(&linear, &scene, &Context::QUIET);
    assert_eq!(ruled_out.expect("decisions").len(), 3);

    let told: Vec<(&str, bool)> =
        selection.varied.iter().map(|variation| (&*variation.name, variation.holds())).collect();
    let turned = |axis: &str| format!("translation turned by 10 degrees about {axis}");
    let (y, z) = (turned("y"), turned("z"));
    assert_eq!(told, [(&*y, false), (&*z, false), ("translation larger by 10 %", true)]);
    for varied in &selection.varied[..2] {
        let enough = varied.enough.expect("a body that holds");
        assert!(enough.modes > selection.modes.len() && enough.modes < 20, "{enough:?}");
    }
    // As a requirement they add modes.
    let robust = selected(&body, &cases(shaken(), "robust = true\n"));
    assert!(
        robust.modes.len() > selection.modes.len() && robust.varied.iter().all(|variation| variation.holds())
    );
    assert!(robust.holds());
}

/// Rotation needs W1, whose centrifugal load is all that stretches the bar, and no more while it is slow.
#[test]
fn a_turning_carrier_needs_w1() {
    let body = bar();
    let slow = cases(&spun(20.0), "");
    let selection = selected(&body, &slow);
    assert!(selection.groups.w1, "{:?}", selection.terms);
    assert_eq!(selection.groups.in_carried_modes(), selection.groups);
    assert!(selection.groups != TermGroups::ALL, "{:?}", selection.groups);
    let own = selection.body(&body).expect("a body");
    assert!(difference(&body, &own, &slow) < 0.011, "{}", difference(&body, &own, &slow));
}
