//! Selections from Craig-Bampton bodies: fixed-interface modes go, motions of the interfaces stay, and the selected body moves like
//! the whole one in simulations of its own.

use crate::selection_carried::difference;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_model::Coupling;
use flexbody_motion::scene::LoadCases;
use flexbody_study::selection::{Selection, select};
use oracle::brackets::bracket;
use oracle::craig_bampton::{body, model};
use std::path::Path;

/// Number of fixed-interface modes of the body.
const FIXED: usize = 8;

fn link() -> FlexBody {
    body(&model(bracket([Coupling::Rigid, Coupling::Rigid])), FIXED)
}

/// Returns a scene with the tolerances, a force at the second interface over time, and more lines.
fn cases(tolerance: f64, history: &str, more: &str) -> LoadCases {
    let text = format!(
        "[run]\nduration = 0.004\n[tolerance]\ndeflection = {tolerance}\nstress = {tolerance}\nreaction = {tolerance}\n\
         [carried]\ninterface = \"first\"\n[[load]]\ninterface = \"second\"\nforce = [300, -200, 100]\nhistory = {history}\n\
         [[watch]]\ninterface = \"second\"\n{more}"
    );
    LoadCases::parse(&text, Path::new("link.toml")).unwrap_or_else(|error| panic!("{error}"))
}

/// Force that grows within a few periods of the first mode, and one that strikes within a fraction of a period.
const SLOW: &str = "{ from = 0, to = 1, start = 0, duration = 0.004 }";
const FAST: &str = "{ times = [0.0, 0.0003, 0.0006, 0.0009], values = [0, 1, 0, 0] }";

fn selected(body: &FlexBody, cases: &LoadCases) -> Selection {
    select(body, &[], cases, &Context::QUIET).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_slow_load_at_an_interface_needs_the_motions_of_the_interfaces_alone() {
    let (body, scene) = (link(), cases(0.02, SLOW, ""));
    let selection = selected(&body, &scene);
    let choice = selection.fixed_interface.as_ref().expect("fixed-interface modes are picked");
    assert_eq!((choice.kept.len(), choice.of), (0, FIXED));
    let own = selection.body(&body).expect("a body");
    assert!(own.n_modes() == 6 && selection.n_modes == 6 && selection.modes.len() == 6);
    assert!(selection.holds());
    let error = difference(&body, &own, &scene);
    assert!(error < 0.02, "{error}");
    // What the trial measured is what the two motions show.
    assert!(selection.chosen.expect("measured").worst <= 1.0);
    // Any other direction of the load needs no other modes.
    assert!(selection.varied.iter().all(|variation| variation.holds()));
}

#[test]
fn a_fast_load_needs_some_fixed_interface_modes() {
    let (body, scene) = (link(), cases(0.25, FAST, ""));
    let selection = selected(&body, &scene);
    let choice = selection.fixed_interface.as_ref().expect("fixed-interface modes are picked");
    assert!((1..FIXED).contains(&choice.kept.len()), "{choice:?}");
    let own = selection.body(&body).expect("a body");
    assert_eq!(own.n_modes(), body.n_modes() - FIXED + choice.kept.len());
    let error = difference(&body, &own, &scene);
    assert!(error < 0.25, "{error}");
    let none = body.with_fixed_interface_modes(&[]).expect("a body");
    assert!(difference(&body, &none, &scene) > 0.25);
    assert!(selection.shares.len() == FIXED && selection.frequencies_hz.len() == own.n_modes());
    // As a requirement, variations keep more of them.
    let robust = selected(&body, &cases(0.25, FAST, "[[variation]]\nname = \"harder\"\nscale = 1.1\n"));
    assert!(robust.holds());
}

/// A scene that starts modes by their numbers picks from these modes.
#[test]
fn modes_that_a_scene_names_are_picked_as_modes() {
    let (body, scene) = (link(), cases(0.05, SLOW, "[initial]\nmode = [{ number = 1, amplitude = 1e-6 }]\n"));
    let selection = selected(&body, &scene);
    assert!(selection.fixed_interface.is_none() && selection.n_modes == body.n_modes());
}
