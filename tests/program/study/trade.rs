//! Trade studies: the expected candidate is recommended, errors agree with an independent comparison, and
//! only times depend on threads.

use crate::program::flexbody;
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, MassStructure, Storage, TermGroups};
use flexbody_body::invariants::BodyFrame;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::{
    Axes, Initial, LoadCases, Measure, ModeStart, OutputErrors, PerQuantity, Run, Scene, Scheme, simulate,
    trace, trace_at,
};
use flexbody_study::recipe::Recipe;
use flexbody_study::reference::PART_OF_FINE;
use flexbody_study::selection::select;
use flexbody_study::trade::{
    CandidateKind, Conversions, LumpedMass, Measured, Recommendation, ReferenceKind, Source, Trade, TradeRow,
    TradeSettings, WantedBodies, conversions, front, trade,
};
use nalgebra::Vector3;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::fixtures;
use oracle::flexible::{fixture, soft_block, unstressed};
use oracle::mesh::{Mesh, grid};
use oracle::scenes::nothing_happens;
use serde_json::Value;
use std::fs;

const QUICK: TradeSettings<'static> = TradeSettings { repeat: 1, reserved: &[], varied: None };

/// Returns a free tumble with `spin` radians per unit of time about an axis between the principal axes, over
/// `turns` turns.
fn tumble(spin: f64, turns: f64) -> Scene {
    let axis = Vector3::new(0.2, 1.0, 0.1).normalize();
    Scene {
        initial: Initial { angular_velocity: axis * spin, axes: Axes::Body, ..Initial::default() },
        ..nothing_happens("tumble", turns * std::f64::consts::TAU / spin, 1e-10)
    }
}

fn study(body: FlexBody, scene: &Scene) -> Trade {
    trade(
        &[Source::new("body", body, Recipe::File, None).expect("a body")],
        &scene.clone().into(),
        None,
        &QUICK,
        &Context::QUIET,
    )
    .expect("a study")
}

fn first_rate(body: &FlexBody) -> f64 {
    body.modes().eigenvalue[0].sqrt()
}

fn recommended(trade: &Trade) -> &TradeRow {
    &trade.rows[trade.recommended.row().expect("a recommendation")]
}

#[test]
fn a_body_that_stays_rigid_needs_one_mode_and_no_group() {
    let body = soft_block(6);
    let scene = tumble(1e-6 * first_rate(&body), 0.5);
    let mut scene = scene;
    // Fixed steps longer than the vibrations: six million periods are not resolved.
    scene.run.scheme =
        Scheme::Conserving { order: 4, step: scene.run.duration.map(|duration| duration / 60.0) };
    let found = study(body, &scene);
    let row = recommended(&found);
    assert_eq!(row.candidate.groups, TermGroups::NONE, "{row:?}");
    assert_eq!(row.candidate.modes, [0]);
    assert!(matches!(found.recommended, Recommendation::Cheapest(_)));
}

#[test]
fn a_soft_body_that_tumbles_fast_needs_every_group() {
    let body = soft_block(6);
    let mut scene = tumble(0.25 * first_rate(&body), 2.0);
    scene.initial.modes = vec![ModeStart { mode: 1, amplitude: 0.05, rate: 0.0 }];
    let found = study(body, &scene);
    assert_eq!(recommended(&found).candidate.groups, TermGroups::ALL);
    for row in &found.rows {
        if row.candidate.groups != TermGroups::ALL {
            let worst = row.outcome.as_ref().map_or(f64::INFINITY, |measured| measured.worst());
            assert!(worst > 1.0, "{row:?}");
        }
    }
}

#[test]
fn the_reference_is_no_distance_from_itself_and_everything_else_is_some() {
    let body = soft_block(5);
    let found = study(body.clone(), &tumble(0.1 * first_rate(&body), 1.0));
    assert_eq!(found.reference, ReferenceKind::Full);
    let worst = |row: &TradeRow| row.outcome.as_ref().expect("a motion").worst();
    assert_eq!(worst(&found.rows[0]), 0.0);
    assert!(found.rows[1..].iter().all(|row| worst(row) > 0.0));
    // The candidates with all modes cover all eight sets of groups, lumped masses and single precision.
    let whole = found.rows.iter().filter(|row| row.candidate.modes.len() == 5);
    let of_kind = |kind: CandidateKind| whole.clone().filter(|row| row.candidate.kind() == kind).count();
    assert_eq!(
        [CandidateKind::Modes, CandidateKind::Groups, CandidateKind::Lumped, CandidateKind::Single]
            .map(of_kind),
        [1, 7, 2, 1]
    );
    let single =
        found.rows.iter().find(|row| row.candidate.storage == Storage::F32).expect("single precision");
    assert!((1e-9..1e-2).contains(&worst(single)), "{}", worst(single));
    // Errors fall along the front as costs rise.
    let cost = |row: usize| found.rows[row].outcome.as_ref().expect("a motion").multiplications;
    for pair in found.front.windows(2) {
        assert!(cost(pair[0]) < cost(pair[1]) && worst(&found.rows[pair[0]]) > worst(&found.rows[pair[1]]));
    }
}

#[test]
fn a_lumped_mass_has_the_error_of_two_simulations() {
    let body = soft_block(5);
    let scene = tumble(0.1 * first_rate(&body), 1.0);
    let found = study(body.clone(), &scene);
    let lumped =
        body.lumped().iter().find(|lumped| lumped.scheme == "diagonal-scaling").expect("a scheme").clone();
    let mut parts = body.clone().into_parts();
    // The modes keep their modal mass; all coupling with the rigid motion is summed over nodal masses.
    parts.invariants = lumped.invariants.with_modal_mass(body.invariants().modal_mass());
    parts.source.mass_structure = MassStructure::General;
    let other = FlexBody::new(parts).expect("a body");
    // With many output times a peak between two of them is hardly larger.
    let mut often = scene.clone();
    often.run.outputs = 6000;
    let [a, b] = [&body, &other].map(|body| simulate(body, &often, &Context::QUIET).expect("a motion").0);
    let energy = |q: &mut dyn Iterator<Item = f64>| -> f64 {
        q.zip(&body.modes().eigenvalue).map(|(q, lambda)| 0.5 * lambda * q * q).sum()
    };
    let apart =
        a.states.iter().zip(&b.states).map(|(a, b)| energy(&mut a.q.iter().zip(&b.q).map(|(a, b)| a - b)));
    let largest = a.states.iter().map(|a| energy(&mut a.q.iter().copied())).fold(0.0, f64::max);
    let stress = (apart.fold(0.0, f64::max) / largest).sqrt();
    let dots = a.states.iter().zip(&b.states).map(|(a, b)| {
        let dot: f64 = a.attitude.0.iter().zip(&b.attitude.0).map(|(a, b)| a * b).sum();
        2.0 * dot.abs().min(1.0).acos()
    });
    let attitude = dots.fold(0.0, f64::max);
    let row = found
        .rows
        .iter()
        .find(|row| row.candidate.lumped == Some(LumpedMass::Couplings("diagonal-scaling".to_owned())));
    let errors = row.expect("a row").outcome.as_ref().expect("a motion").decisive_case().errors;
    assert!(stress > 0.01, "a coarse mesh: {stress}");
    assert!((errors.stress.expect("a deformed body") / stress - 1.0).abs() < 2e-3, "{errors:?} {stress}");
    assert!((errors.attitude.expect("an attitude") / attitude - 1.0).abs() < 2e-3, "{errors:?} {attitude}");
}

#[test]
fn a_body_of_beams_has_candidates_of_lumped_mass_too() {
    let body = fixture("frame_beams", 4, BodyFrame::Model);
    let found = study(body.clone(), &tumble(0.05 * first_rate(&body), 0.2));
    let lumped = found.rows.iter().filter(|row| row.candidate.kind() == CandidateKind::Lumped);
    let worst: Vec<f64> = lumped.map(|row| row.outcome.as_ref().expect("a motion").worst()).collect();
    assert_eq!(worst.len(), body.lumped().len());
    assert!(!worst.is_empty() && worst.iter().all(|worst| *worst > 0.0), "{worst:?}");
}

#[test]
fn errors_are_the_same_bits_at_one_and_two_threads() {
    let body = soft_block(6);
    let scene = tumble(0.1 * first_rate(&body), 1.0);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let mut found = pool.install(|| study(body.clone(), &scene));
        for row in &mut found.rows {
            let measured = row.outcome.as_mut().expect("a motion");
            let Some(timed) = &mut measured.timed else { continue };
            assert!(timed.evaluation > 0.0 && timed.seconds() > 0.0);
            timed.evaluation = 0.0;
            timed.runs.iter_mut().for_each(|run| run.seconds = 0.0);
        }
        for row in found.front.iter().copied().chain(found.recommended.row()).chain([0]) {
            let measured = found.rows[row].outcome.as_ref().expect("a motion");
            assert!(measured.timed.is_some(), "what somebody may take is timed");
        }
        found
    };
    assert_eq!(on(1), on(2));
}

/// Returns the errors of a candidate of `body` in `scene`, with the steps of `scheme`, relative to the motion of `body`;
/// `None` if the simulation stops.
fn errors_of_run(body: &FlexBody, scene: &Scene, row: &TradeRow, scheme: Scheme) -> Option<OutputErrors> {
    let reference = trace(body, scene, &Context::QUIET).expect("a motion").0;
    let source = Source::new("body", body.clone(), Recipe::File, None).expect("a body");
    let candidate = row.candidate.body(&source).expect("a body");
    let own = Scene { run: Run { scheme, ..scene.run.clone() }, ..scene.clone() };
    let motion = trace_at(&candidate, &own, &reference.time, &Context::QUIET).ok()?;
    Some(Measure::new(body, scene, &reference).of_subset(&motion, &row.candidate.modes).largest())
}

#[test]
fn steps_are_the_longest_that_the_tolerances_allow() {
    let body = soft_block(6);
    let free = tumble(0.1 * first_rate(&body), 1.0);
    let mut conserving = free.clone();
    conserving.run.scheme = Scheme::Conserving { order: 4, step: None };
    for scene in [free, conserving] {
        let found = study(body.clone(), &scene);
        let timed = found.rows.iter().filter_map(|row| Some((row, row.outcome.as_ref().ok()?)));
        let timed: Vec<_> = timed.filter_map(|(row, own)| Some((row, own, own.timed.as_ref()?))).collect();
        assert!(timed.len() > 5);
        for (row, measured, timed) in timed {
            let run = &timed.runs[0];
            // Error and time belong to one run.
            let again = errors_of_run(&body, &scene, row, run.scheme).expect("a motion");
            for ((name, a), (_, b)) in again.named().into_iter().zip(run.errors.errors.named()) {
                let (a, b) = (a.unwrap_or(0.0), b.unwrap_or(0.0));
                assert!((a - b).abs() <= 1e-9 * b, "{name}: {a} {b}, {row:?}");
            }
            let most = if measured.holds() { 1.0 } else { 1.1 * measured.worst() };
            assert!(run.errors.worst <= most, "{row:?}");
            // Longer steps are not enough.
            let longer = match run.scheme {
                Scheme::Adaptive { tolerance } if tolerance < 1e-2 => {
                    Scheme::Adaptive { tolerance: 3.34 * tolerance }
                }
                Scheme::Conserving { order, step: Some(step) }
                    if 20.0 * step < scene.run.duration.unwrap_or(0.0) =>
                {
                    Scheme::Conserving { order, step: Some(2.0 * step) }
                }
                _ => continue,
            };
            let longer = errors_of_run(&body, &scene, row, longer);
            let worst = longer.map_or(f64::INFINITY, |errors| errors.worst(&scene.requirements.tolerance));
            assert!(worst > most, "{row:?}: {worst}");
        }
    }
}

#[test]
fn a_cost_is_kept_by_the_most_accurate() {
    let body = soft_block(6);
    let mut scene = tumble(0.1 * first_rate(&body), 1.0);
    let costs = |trade: &Trade| -> Vec<(usize, f64)> {
        let measured = trade.rows.iter().map(|row| row.outcome.as_ref().expect("a motion"));
        measured.map(|measured| (measured.multiplications, measured.worst())).collect()
    };
    let dearest = costs(&study(body.clone(), &scene)).into_iter().map(|point| point.0).max().expect("rows");
    let allowed = dearest / 2;
    scene.requirements.multiplications = Some(allowed);
    let found = study(body.clone(), &scene);
    let Recommendation::MostAccurate(row) = found.recommended else { panic!("{:?}", found.recommended) };
    let all = costs(&found);
    assert!(all[row].0 <= allowed);
    assert!(all.iter().filter(|point| point.0 <= allowed).all(|point| point.1 >= all[row].1));
    scene.requirements.multiplications = Some(1);
    assert_eq!(study(body, &scene).recommended, Recommendation::None);
}

#[test]
fn a_candidate_that_cannot_be_simulated_is_a_row_that_says_so() {
    let mut parts = soft_block(4).into_parts();
    // The modes move the centre of mass by more than their mass allows, so that no motion can be computed.
    let c1 = &mut parts.lumped[0].invariants.primary_mut().c1;
    c1.fill(1e3);
    let body = FlexBody::new(parts).expect("a body");
    let scheme = body.lumped()[0].scheme.clone();
    let found = study(body.clone(), &tumble(0.1 * first_rate(&body), 0.2));
    let failed: Vec<&TradeRow> = found.rows.iter().filter(|row| row.outcome.is_err()).collect();
    assert_eq!(failed.len(), 1);
    assert_eq!(failed[0].candidate.lumped, Some(LumpedMass::Couplings(scheme)));
    assert_eq!(failed[0].outcome.as_ref().err().map(|failed| failed.0.code()), Some(Code::SimulationStopped));
    assert!(found.recommended.row().is_some());
}

/// Returns a model of a rubber-like block with few nodes.
fn model() -> FeModel {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([4, 2, 1]), |[x, y, z]| {
        [0.3 * x + 0.03 * y, 0.3 * y * (1.0 - 0.05 * x), 0.3 * z * (1.0 + 0.1 * y)]
    });
    FeModel::from_raw(mesh.assemble(&rubber, MassRule::Consistent).raw_model()).expect("a body").model
}

/// Returns the usual settings of a study with this number of modes.
fn wanted(modes: usize) -> WantedBodies {
    WantedBodies { modes, fine: false }
}

/// Returns conversions without information about the scene.
fn without_scene(model: &FeModel, modes: usize) -> Conversions {
    let mut scene = tumble(1.0, 1.0);
    scene.run.duration = None;
    conversions(model, &scene.clone().into(), wanted(modes), &Context::QUIET).expect("bodies")
}

#[test]
fn a_reference_is_enriched_for_the_scene_and_tells_what_it_lacks() {
    let model = model();
    let rate = first_rate(without_scene(&model, 4).sources[0].body());
    let scene = tumble(0.15 * rate, 0.5);
    let made = conversions(&model, &scene.clone().into(), wanted(4), &Context::QUIET).expect("bodies");
    let [reference_errors] = &made.reference_errors[..] else {
        panic!("one scene: {:?}", made.reference_errors)
    };
    let (first, own) = (&reference_errors[0], reference_errors.last().expect("an estimate"));
    assert_eq!(own.modes, made.sources[0].body().n_modes());
    assert!(first.modes < own.modes && own.worst < 0.7 * first.worst, "{reference_errors:?}");
    // Errors of the reference that matter are reported.
    assert!(
        made.diagnostics.iter().any(|one| one.code() == Code::ReferenceIncomplete),
        "{:?}",
        made.diagnostics
    );
}

#[test]
fn conversions_are_measured_against_the_motion_of_all_nodes() {
    let model = model();
    let Conversions { sources, reference_errors, .. } = without_scene(&model, 4);
    assert!(reference_errors.iter().all(Vec::is_empty));
    assert!(sources.iter().all(|source| source.preprocessing().is_some_and(|seconds| seconds > 0.0)));
    let rate = first_rate(sources[0].body());
    let mut scene = tumble(0.15 * rate, 0.5);
    scene.run.scheme = Scheme::Adaptive { tolerance: 1e-9 };
    let found =
        trade(&sources, &scene.clone().into(), Some(&model), &QUICK, &Context::QUIET).expect("a study");
    assert_eq!(found.reference, ReferenceKind::Nodal);
    let stress = |row: &TradeRow| {
        let measured = row.outcome.as_ref().expect("a motion");
        measured.decisive_case().errors.stress.expect("a deformed body")
    };
    // Under a sudden spin eight modes with residual vectors are accurate, one mode is not, and no candidate
    // without W1 is.
    let of = |source: &str, groups: TermGroups| {
        let row = found.rows.iter().find(|row| {
            row.source == source
                && row.candidate.groups == groups
                && row.candidate.kind() != CandidateKind::Lumped
        });
        stress(row.expect("a row"))
    };
    let (whole, one) = (of(sources[0].name(), TermGroups::ALL), of("1 free mode", TermGroups::ALL));
    assert!(whole > 0.0 && whole < 0.1 && one > 0.9, "{whole} {one}");
    assert!(of(sources[0].name(), TermGroups::NONE) > 0.5);
    // Residual vectors represent the response of the truncated modes to spin.
    let (with, without) =
        (of("4 free modes, residual vectors", TermGroups::ALL), of("4 free modes", TermGroups::ALL));
    assert!(whole < with && with < without && without < one, "{whole} {with} {without} {one}");
    // Errors relative to the largest body differ at most by the error of that body relative to all nodes.
    let reduced = trade(&sources, &scene.clone().into(), None, &QUICK, &Context::QUIET).expect("a study");
    let mut both = 0;
    for a in &found.rows {
        // The candidates differ: the reference decides which sets of groups are not worth testing.
        let Some(b) = reduced.rows.iter().find(|b| a.candidate == b.candidate) else { continue };
        assert!((stress(a) - stress(b)).abs() <= 1.1 * whole, "{a:?} {b:?}");
        both += 1;
    }
    assert!(both > 20, "{both} candidates of both studies");
}

#[test]
fn a_fine_reference_stands_for_the_motion_of_all_nodes() {
    let model = model();
    let rate = first_rate(without_scene(&model, 4).sources[0].body());
    let mut scene = tumble(0.05 * rate, 0.5);
    scene.initial.settled = true;
    scene.run.scheme = Scheme::Adaptive { tolerance: 1e-9 };
    let reference_error = |fine: bool| {
        let wanted = WantedBodies { modes: 4, fine };
        let made = conversions(&model, &scene.clone().into(), wanted, &Context::QUIET).expect("bodies");
        (made.reference_errors[0].last().expect("an estimate").worst, made.sources)
    };
    let (usual, _) = reference_error(false);
    let (fine, sources) = reference_error(true);
    assert!(fine <= PART_OF_FINE && usual > PART_OF_FINE, "{fine} {usual}");
    // The estimate agrees with the error relative to all nodes, which the study did not use.
    let found =
        trade(&sources[..1], &scene.clone().into(), Some(&model), &QUICK, &Context::QUIET).expect("a study");
    let whole = found.rows[0].outcome.as_ref().expect("a motion").worst();
    assert!((0.3..3.0).contains(&(fine / whole)), "{fine} {whole}");
}

#[test]
fn a_wholly_lumped_mass_has_modes_of_its_own() {
    let model = model();
    let Conversions { sources, diagnostics, .. } = without_scene(&model, 3);
    assert!(diagnostics.iter().all(|one| one.code() != Code::LumpedWithoutBody), "{diagnostics:?}");
    let modes = ModeSettings { wanted: Wanted::Lowest(6), ..ModeSettings::default() };
    let settings = ConvertSettings { modes, lumped_modes: true, ..ConvertSettings::default() };
    let pipelines = convert(&model, &settings, &Context::QUIET).expect("a body").lumped_modes;
    assert_eq!(pipelines.len(), 2);
    for pipeline in &pipelines {
        let of = |source: &&Source| source.lumped_by() == Some(&pipeline.scheme);
        let own = sources.iter().find(of).expect("a source").body();
        for (j, eigenvalue) in pipeline.eigenvalues.iter().enumerate() {
            assert!((own.modes().eigenvalue[j] / eigenvalue - 1.0).abs() < 1e-9, "mode {j} of {pipeline:?}");
        }
        // On a coarse mesh the eigenvalues of the lumped mass differ from those of the consistent mass.
        let exact = sources[0].body().modes().eigenvalue[0];
        assert!((pipeline.eigenvalues[0] / exact - 1.0).abs() > 1e-3, "{pipeline:?}");
    }
    let scene = tumble(0.05 * first_rate(sources[0].body()), 0.1);
    let found = trade(&sources, &scene.clone().into(), None, &QUICK, &Context::QUIET).expect("a study");
    let whole = found.rows.iter().filter(|row| matches!(row.candidate.lumped, Some(LumpedMass::Whole(_))));
    let worst: Vec<f64> = whole.map(|row| row.outcome.as_ref().expect("a motion").worst()).collect();
    assert!(worst.len() == 2 && worst.iter().all(|worst| *worst > 0.0), "{worst:?}");
    assert!(found.front.iter().all(|&row| found.rows[row].candidate.lumped.is_none()));
}

#[test]
fn conserving_scenes_with_damping_are_measured_against_the_nodes() {
    let model = model();
    let Conversions { sources, .. } = without_scene(&model, 4);
    let rate = first_rate(sources[0].body());
    let mut scene = tumble(0.15 * rate, 0.3);
    scene.requirements.damping = Some(0.02.into());
    scene.run.scheme = Scheme::Conserving { order: 4, step: Some(0.1 / rate) };
    let found =
        trade(&sources, &scene.clone().into(), Some(&model), &QUICK, &Context::QUIET).expect("a study");
    let nodal = found.cases[0].nodal.expect("the nodes are the reference");
    assert_eq!((nodal.rows, nodal.scheme, nodal.error), (model.rows().len(), scene.run.scheme, None));
    let row = |at: usize| found.rows[at].outcome.as_ref().expect("a motion");
    let first = row(0).decisive_case();
    assert!(first.worst > 0.0 && first.errors.stress.expect("deformed") < 0.1, "{:?}", first.errors);
    let full = trade(&sources, &scene.clone().into(), None, &QUICK, &Context::QUIET).expect("a study");
    assert!(full.cases[0].nodal.is_none());
    assert_eq!(full.rows[0].outcome.as_ref().expect("a motion").worst(), 0.0);
    // Work beyond the time limit is refused before it begins.
    let hasty = Context { longest: Some(1e-6), ..Context::QUIET };
    let error = trade(&sources, &scene.clone().into(), Some(&model), &QUICK, &hasty).expect_err("refused");
    assert_eq!(error.diagnostics()[0].code(), Code::WorkLong);
}

/// `trade` recommends the modes that `select` selects, because both use one search.
#[test]
fn a_study_and_a_selection_take_the_same_modes() {
    let body = soft_block(9);
    let mut scene = tumble(0.05 * first_rate(&body), 0.3);
    scene.initial.settled = true;
    scene.requirements.tolerance.errors.deflection = 0.2;
    scene.requirements.tolerance.errors.stress = 0.2;
    let found = study(body.clone(), &scene);
    let row = recommended(&found);
    let taken = select(&body, &[], &scene.clone().into(), &Context::QUIET).expect("a selection");
    assert!(taken.holds() && taken.modes.len() < 9, "{:?}", taken.modes);
    assert!(row.candidate.modes.len() < 9 && row.candidate.modes.len() <= taken.modes.len(), "{row:?}");
    if row.candidate.groups == taken.groups {
        assert_eq!(row.candidate.modes, taken.modes);
    }
    // One mode fewer in the same order exceeds the tolerances.
    let fewer = found.rows.iter().filter(|one| {
        one.candidate.groups == row.candidate.groups
            && one.candidate.modes.len() + 1 == row.candidate.modes.len()
            && one.candidate.kind() == row.candidate.kind()
    });
    let worst: Vec<f64> = fewer.map(|one| one.outcome.as_ref().expect("a motion").worst()).collect();
    assert!(row.candidate.modes.len() == 1 || worst.iter().all(|worst| *worst > 1.0), "{worst:?}");
    assert!(row.candidate.modes.len() == 1 || !worst.is_empty());
}

/// Returns two load cases of a body: a slow tumble with a strict tolerance, and a fast tumble.
fn two_cases(body: &FlexBody) -> [Scene; 2] {
    let rate = first_rate(body);
    let mut slow = tumble(0.02 * rate, 0.05);
    slow.initial.modes = vec![ModeStart { mode: 2, amplitude: 0.02, rate: 0.0 }];
    slow.requirements.tolerance.errors.deflection = 0.02;
    slow.requirements.tolerance.errors.stress = 0.02;
    let mut fast = tumble(0.15 * rate, 0.3);
    fast.requirements.tolerance.errors =
        PerQuantity { attitude: 0.05, reaction: 0.01, ..PerQuantity::all(0.3) };
    [slow, fast]
}

#[test]
fn a_candidate_is_as_good_as_it_is_in_the_worst_case() {
    let body = unstressed(soft_block(6));
    let scenes = two_cases(&body);
    let sources = [Source::new("body", body.clone(), Recipe::File, None).expect("a body")];
    let settings = TradeSettings { reserved: &[0.1], ..QUICK };
    let cases = LoadCases::new(scenes.to_vec()).expect("two cases");
    let both = trade(&sources, &cases, None, &settings, &Context::QUIET).expect("a study");
    let alone = scenes.each_ref().map(|scene| study(body.clone(), scene));
    let most = [0.9, 1.0];
    let mut shared = 0;
    for row in &both.rows {
        let measured = row.outcome.as_ref().expect("a motion");
        for (own, study) in measured.by_case.iter().zip(&alone) {
            // The tested candidates differ between the studies; only common ones are compared.
            let Some(same) = study.rows.iter().find(|one| one.candidate == row.candidate) else { continue };
            let same = same.outcome.as_ref().expect("a motion");
            assert_eq!((own, measured.multiplications), (same.decisive_case(), same.multiplications));
            shared += 1;
        }
        let worst: Vec<f64> = measured.by_case.iter().map(|own| own.worst).collect();
        assert_eq!(measured.worst(), worst[0].max(worst[1]));
        assert_eq!(measured.holds(), worst.iter().zip(most).all(|(worst, most)| *worst <= most), "{worst:?}");
    }
    assert!(shared > 30, "{shared}");

    // The recommendation is the cheapest candidate that passes in both cases; each case states the candidates
    // it rules out.
    let measured = |row: &TradeRow| row.outcome.as_ref().expect("a motion").clone();
    let taken = measured(recommended(&both));
    assert!(taken.holds());
    let exact = both.rows.iter().filter(|row| row.candidate.kind() != CandidateKind::Lumped).map(measured);
    let cheaper: Vec<_> = exact.filter(|own| own.multiplications < taken.multiplications).collect();
    assert!(cheaper.len() > 5 && cheaper.iter().all(|own| !own.holds()), "{cheaper:?}");
    for (at, case) in both.cases.iter().enumerate() {
        let beyond = |own: &&Measured, at: usize| own.by_case[at].worst > most[at];
        let here: Vec<_> = cheaper.iter().filter(|own| beyond(own, at)).collect();
        let only = here.iter().filter(|own| !beyond(own, 1 - at)).count();
        assert_eq!((case.ruled_out, case.ruled_out_alone), (here.len(), only), "case {at}");
        assert_eq!(case.reserved, [0.1, 0.0][at]);
        let own = measured(&both.rows[case.alone.row().expect("a candidate")]);
        assert!(own.by_case[at].worst <= most[at] && own.multiplications <= taken.multiplications);
    }
    assert!(both.cases.iter().all(|case| case.ruled_out_alone > 0), "{:?}", both.cases);
    // The cost of two cases is the sum of both runs.
    let steps = |trade: &Trade| measured(&trade.rows[0]).timed.expect("the reference is timed").work().steps;
    assert_eq!(steps(&both), alone.iter().map(steps).sum::<u64>());
}

#[test]
fn a_front_has_nothing_that_another_beats() {
    let body = soft_block(3);
    let mut rows = study(body.clone(), &tumble(0.1 * first_rate(&body), 0.2)).rows;
    rows.truncate(5);
    for (row, (cost, worst)) in rows.iter_mut().zip([(10, 1.0), (20, 2.0), (5, 3.0), (10, 0.5), (30, 0.5)]) {
        let measured = row.outcome.as_mut().expect("a motion");
        (measured.multiplications, measured.by_case[0].worst) = (cost, worst);
    }
    assert_eq!(front(&rows), [2, 3]);
    rows[3].outcome.as_mut().expect("a motion").by_case[0].worst = f64::NAN;
    assert_eq!(front(&rows), [2, 0, 4]);
}

#[test]
fn the_program_writes_what_its_schema_says() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let manifest = fixtures().join("models/cube_hex8/model.toml");
    let manifest = manifest.to_str().expect("a path");
    let made = flexbody(place, &["convert", manifest, "--modes", "4", "-o", "body.flex.h5", "--quiet"]);
    assert!(made.status.success());
    let body = flexbody_file::read(place.join("body.flex.h5")).expect("a body");
    let period = std::f64::consts::TAU / first_rate(&body);
    let scene = |more: &str| {
        let text = format!(
            "[run]\nduration = {}\noutputs = 20\n[initial]\nangular_velocity = [{}, {}, 0]\n{more}",
            4.0 * period,
            0.02 / period,
            0.4 / period
        );
        fs::write(place.join("scene.toml"), text).expect("written");
    };
    scene("");
    let words = ["trade", "body.flex.h5", "--scene", "scene.toml", "--repeat", "1"];
    let with = |more: &[&str]| flexbody(place, &[&words[..], more].concat());
    let files = ["t.html", "t.json", "t.txt"];
    let mut more = vec!["--csv", "t.csv", "--threads", "2", "--json", "--bodies", "."];
    files.iter().for_each(|file| more.extend(["--report", file]));
    let run = with(&more);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let facts: Value = serde_json::from_slice::<Value>(&run.stdout).expect("JSON")["results"].take();
    let schema: Value =
        serde_json::from_str(include_str!("../../../schemas/trade-report.schema.json")).expect("a schema");
    let schema = jsonschema::validator_for(&schema).expect("a schema");
    let wrong: Vec<String> = schema.iter_errors(&facts).map(|error| error.to_string()).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
    let rows = facts["rows"].as_array().expect("rows");
    let lines = facts["verdict"].as_array().expect("lines");
    let labels: Vec<&str> = lines.iter().map(|line| line["label"].as_str().expect("a label")).collect();
    assert_eq!(labels, ["Asked", "Recommended", "Why", "Error", "Saves", "Run", "Variations", "Command"]);
    // Every measured candidate was written as a body.
    for (at, row) in rows.iter().enumerate() {
        let path = place.join(format!("candidate_{:03}.flex.h5", at + 1));
        assert_eq!(path.exists(), !row["measured"].is_null(), "{row}");
        if path.exists() {
            let own = flexbody_file::read(&path).expect("a body");
            assert_eq!(own.n_modes() as u64, row["modes"].as_u64().expect("a number"));
        }
    }
    let table = fs::read_to_string(place.join("t.csv")).expect("a table");
    assert_eq!(table.lines().count(), rows.len() + 1);
    let columns = table.lines().next().expect("a head").split(',').count();
    assert!(table.lines().all(|line| line.split(',').count() == columns), "{table}");
    let page = fs::read_to_string(place.join("t.html")).expect("a page");
    assert!(page.contains("<svg") && page.contains("recommended") && !page.contains("NaN"));
    let text = fs::read_to_string(place.join("t.txt")).expect("a text");
    assert!(text.contains("\nRecommended ") && text.lines().any(|line| line.starts_with('>')), "{text}");
    let left: Vec<_> = fs::read_dir(place).expect("a folder").collect();
    let bodies = rows.iter().filter(|row| !row["measured"].is_null()).count();
    assert_eq!(left.len(), 2 + 4 + bodies, "{left:?}");

    // No candidate is that cheap, and the command fails like for a tolerance.
    scene("[cost]\nmultiplications = 1\n");
    let run = with(&[]);
    assert_eq!(run.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&run.stdout).contains("no candidate needs so few multiplications"));
    for (more, said) in [
        (&["--reference", "nodal"][..], "give the model"),
        (&["--modes", "3"], "give the model"),
        (&["--csv", "scene.toml"], "is an input"),
        (&["--report", "t.pdf"], "no known extension"),
    ] {
        let run = with(more);
        assert_eq!(run.status.code(), Some(2), "{more:?}");
        assert!(String::from_utf8_lossy(&run.stderr).contains(said), "{more:?}");
    }
    // No output replaces a matrix of the model.
    let matrix = fixtures().join("models/cube_hex8/K.mtx.gz");
    let words = ["trade", manifest, "--scene", "scene.toml", "--csv", matrix.to_str().expect("a path")];
    assert_eq!(flexbody(place, &words).status.code(), Some(2));
}
