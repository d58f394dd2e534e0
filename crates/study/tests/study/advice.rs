//! Advice for ranges of motion: limits of small and large motion, the formula of an attached mass, and covariance.

use flexbody_body::flex_body::{FlexBody, TermGroup, TermGroups};
use flexbody_body::invariants::BodyFrame;
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::Terms;
use flexbody_motion::scene::{Measure, ModeStart, Run, Scene, Scheme, trace, trace_at};
use flexbody_study::advice::{Advice, AttachedMass, Ranges, advise};
use nalgebra::Vector3;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::{body_of, soft_block};
use oracle::mesh::{Mesh, grid};
use oracle::plane::rectangle;
use oracle::random::Random;
use std::f64::consts::TAU;

fn ranges(spin_hz: f64) -> Ranges {
    Ranges { spin_hz, deflection: None, duration: None, attached: None, is_rotation_given: true, limit: 0.05 }
}

/// Ranges for sizes, whose motions take no time.
fn sizes(spin_hz: f64) -> Ranges {
    Ranges { duration: Some(1e-6), ..ranges(spin_hz) }
}

fn advice(ranges: Ranges) -> Advice {
    advise(&soft_block(6), ranges, &Context::QUIET).expect("advice")
}

#[test]
fn a_slow_body_qualifies_for_guideline_one_and_a_fast_one_needs_all() {
    let first = soft_block(6).frequencies_hz()[0];
    // Beside vibrations of one per cent.
    let deflection = Some(0.01 * soft_block(6).extent());
    let slow = advice(Ranges { deflection, ..ranges(1e-6 * first) });
    assert_eq!((slow.guideline().name, slow.groups_by_size), ("I", TermGroups::NONE));
    let fast = advice(Ranges { deflection, ..ranges(0.3 * first) });
    assert_eq!(fast.guideline().name, "IV");
    assert!(fast.groups().w1 && fast.groups().w3);
    // Guidelines keep more and more terms, so that what is left out never grows.
    for own in [&slow, &fast] {
        assert!(own.guidelines.windows(2).all(|pair| pair[0].ratio >= pair[1].ratio));
        assert_eq!(own.guidelines.last().map(|guideline| guideline.ratio), Some(0.0));
    }
}

/// Without vibrations the centrifugal load is all that deflects a slowly turning body: without W1 nothing is left of it.
#[test]
fn the_centrifugal_load_is_kept_however_slowly_a_body_turns() {
    let body = soft_block(6);
    let first = body.frequencies_hz()[0];
    for is_rotation_given in [true, false] {
        let own = advice(Ranges { is_rotation_given, ..ranges(0.003 * first) });
        let motions = own.motions.as_ref().expect("motions");
        assert_eq!(own.groups(), TermGroups::NONE.with(TermGroup::W1));
        let without = motions.sets[0].errors.expect("errors");
        assert!((without.deflection.expect("a deflection") - 1.0).abs() < 0.05, "{without:?}");
        assert!(own.deflection == motions.deflection && motions.deflection < 1e-4 * body.extent());
    }
    // The deflection grows with the square of the rate, and is what sizes are compared with.
    let deflection = |rate: f64| advice(ranges(rate * first)).deflection;
    assert!((deflection(0.006) / deflection(0.003) - 4.0).abs() < 0.01);
}

/// Terms that are left out do not matter in motions of the ranges that were not sampled, here about ten other axes.
#[test]
fn advice_holds_in_motions_that_were_not_sampled() {
    let body = soft_block(6);
    let first = body.frequencies_hz()[0];
    let mut random = Random(7);
    for (rate, part) in [(0.02, None), (0.01, Some(0.01)), (0.1, Some(0.002))] {
        let deflection = part.map(|part| part * body.extent());
        let own = advice(Ranges { deflection, is_rotation_given: false, ..ranges(rate * first) });
        let motions = own.motions.as_ref().expect("motions");
        for _ in 0..10 {
            let axis = Vector3::from_fn(|_, _| random.signed()).normalize();
            let mut scene = free_flight(motions.duration);
            scene.initial.angular_velocity = axis * (TAU * rate * first);
            scene.initial.settled = part.is_none();
            scene.initial.modes =
                deflection.map_or_else(Vec::new, |deflection| vec![bent(&body, deflection)]);
            let measured = |groups: TermGroups| {
                let whole = trace(&body, &scene, &Context::QUIET).expect("a motion").0;
                let mut reduced = scene.clone();
                reduced.run.terms = Terms::ALL.held(groups);
                let measure = Measure::new(&body, &scene, &whole);
                let own = trace_at(&body, &reduced, &whole.time, &Context::QUIET).expect("a motion");
                measure.of_subset(&own, &(0..body.n_modes()).collect::<Vec<_>>()).largest()
            };
            let errors = measured(own.groups());
            // Twice the limit: twelve motions do not have the worst of all.
            assert!(errors.deflection.expect("a deflection") < 0.1, "{rate} {part:?} {axis:?}: {errors:?}");
            assert!(errors.attitude.expect("an attitude") < 0.1, "{rate} {part:?} {axis:?}: {errors:?}");
        }
    }
}

fn free_flight(duration: f64) -> Scene {
    let run = Run {
        duration: Some(duration),
        outputs: 1,
        most_steps: Run::MOST_STEPS,
        scheme: Scheme::Adaptive { tolerance: 1e-8 },
        terms: Terms::ALL,
    };
    Scene { resolved: true, ..Scene::new("free flight", run) }
}

/// Returns the start in the second mode that moves a node by `deflection`.
fn bent(body: &FlexBody, deflection: f64) -> ModeStart {
    let shape = &body.modes().shape;
    let length = |node: usize| (0..3).map(|k| shape[(3 * node + k, 1)].powi(2)).sum::<f64>().sqrt();
    let largest = (0..body.n_nodes()).map(length).fold(0.0, f64::max);
    ModeStart { mode: 1, amplitude: deflection / largest, rate: 0.0 }
}

#[test]
fn motions_are_sampled_where_there_can_be_any() {
    let body = body_of(rectangle(5, 2, 0.7, [1.0, 2.0]), 6, BodyFrame::Com);
    let first = body.frequencies_hz()[0];
    let own = |ranges: Ranges| advise(&body, ranges, &Context::QUIET).expect("advice").motions;
    let plane = own(Ranges { duration: Some(3.0), ..ranges(0.01 * first) }).expect("motions");
    assert_eq!((plane.count, plane.duration), (4, 3.0));
    assert!(own(ranges(0.0)).expect_err("nothing moves").contains("nothing moves"));
    let attached = Some(AttachedMass { mass: 1.0, interface: None });
    let free = Ranges { attached, is_rotation_given: false, ..ranges(0.01 * first) };
    assert!(own(free).expect_err("no motion").contains("attached mass"));
    for wrong in [0.0, -1.0, f64::NAN] {
        assert!(advise(&body, Ranges { duration: Some(wrong), ..ranges(0.1) }, &Context::QUIET).is_err());
    }
}

#[test]
fn terms_follow_the_powers_of_spin_and_deflection() {
    let body = soft_block(6);
    let own = |spin: f64, deflection: f64| {
        let ranges = Ranges { deflection: Some(deflection), is_rotation_given: false, ..sizes(spin) };
        advise(&body, ranges, &Context::QUIET)
            .expect("advice")
            .terms
            .iter()
            .map(|term| term.size)
            .collect::<Vec<_>>()
    };
    let (one, faster, further) = (own(1.0, 1e-3), own(2.0, 1e-3), own(1.0, 2e-3));
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
    // Factors for twice the spin and twice the deflection, in the order of the terms.
    let powers = [(1.0, 2.0), (1.0, 4.0), (1.0, 4.0), (4.0, 0.5), (4.0, 1.0), (2.0, 1.0), (4.0, 1.0)];
    for (at, (of_spin, of_deflection)) in powers.into_iter().enumerate() {
        assert!(close(faster[at], of_spin * one[at]), "term {at}");
        assert!(close(further[at], of_deflection * one[at]), "term {at}");
    }
}

#[test]
fn an_attached_mass_reduces_the_terms_beside_the_inertia() {
    let body = soft_block(6);
    let size = |mass: f64| {
        let attached = Some(AttachedMass { mass, interface: None });
        let ranges = Ranges { attached, is_rotation_given: false, ..sizes(1.0) };
        advise(&body, ranges, &Context::QUIET).expect("advice").terms[1].size
    };
    // An attached mass that grows beyond all bounds adds the inertia of the body's own mass at this distance.
    let (none, little, much, endless) = (size(0.0), size(1e-9), size(1e6), size(1e12));
    assert!((little - none).abs() < 1e-6 * none && much < none);
    assert!((endless - much).abs() < 1e-4 * much, "{much} {endless}");
    let unknown = Some(AttachedMass { mass: 1.0, interface: Some("nowhere".to_owned()) });
    assert!(advise(&body, Ranges { attached: unknown, ..sizes(1.0) }, &Context::QUIET).is_err());
    for wrong in [f64::NAN, f64::INFINITY, -1.0] {
        assert!(advise(&body, ranges(wrong), &Context::QUIET).is_err());
        assert!(advise(&body, Ranges { limit: wrong, ..sizes(1.0) }, &Context::QUIET).is_err());
    }
}

/// A mass as large as that of a rectangle, in its corner at r^2 = 3 I0 / m, adds m/2 r^2 = 1.5 I0; an endless mass adds
/// m r^2 = 3 I0. The terms beside I0 shrink by this, those beside elastic forces do not change, and the Coriolis force
/// grows with the period of the first mode.
#[test]
fn a_mass_in_a_corner_of_a_rectangle_multiplies_the_inertia_by_known_factors() {
    let body = body_of(rectangle(5, 2, 0.7, [1.0, 2.0]), 6, BodyFrame::Com);
    let own = |masses: f64| {
        let attached = AttachedMass { mass: masses * body.invariants().mass(), interface: None };
        let ranges = Ranges { attached: Some(attached), is_rotation_given: false, ..sizes(1.0) };
        advise(&body, ranges, &Context::QUIET).expect("advice")
    };
    let without = own(0.0);
    assert!((without.first_frequency_hz / body.frequencies_hz()[0] - 1.0).abs() < 1e-12);
    for (masses, inertia) in [(1.0, 2.5), (1e12, 4.0)] {
        let with = own(masses);
        let ratio = |at: usize| with.terms[at].size / without.terms[at].size;
        for beside_inertia in [0, 1, 2, 7] {
            assert!((ratio(beside_inertia) * inertia - 1.0).abs() < 1e-9, "{masses} {beside_inertia}");
        }
        for elastic in [3, 4, 6] {
            assert!((ratio(elastic) - 1.0).abs() < 1e-12, "{masses} {elastic}");
        }
        let slower = without.first_frequency_hz / with.first_frequency_hz;
        assert!(slower > 1.1 && (ratio(5) / slower - 1.0).abs() < 1e-12, "{masses} {slower}");
    }
}

/// Root of 1 - cos x cosh x + a x (sin x cosh x - cos x sinh x): the first x^2 of bending of a free beam with a times its
/// mass at one end.
fn beam_with_mass(a: f64) -> f64 {
    let residual = |x: f64| 1.0 - x.cos() * x.cosh() + a * x * (x.sin() * x.cosh() - x.cos() * x.sinh());
    let (mut low, mut high) = (3.9, 4.8);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if residual(middle) > 0.0 { low = middle } else { high = middle }
    }
    low * low
}

#[test]
fn the_first_frequency_of_a_beam_with_a_mass_at_its_end_is_the_closed_form() {
    let rubber = Material { youngs: 4.0, poisson: 0.0, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([60, 1, 1]), |place| place);
    let body = body_of(mesh.assemble(&rubber, MassRule::Consistent).raw_model(), 16, BodyFrame::Principal);
    let own = |masses: f64| {
        let attached = AttachedMass { mass: masses * body.invariants().mass(), interface: None };
        let first = body.frequencies_hz()[0];
        let ranges = Ranges { attached: Some(attached), is_rotation_given: true, ..sizes(0.1 * first) };
        advise(&body, ranges, &Context::QUIET).expect("advice")
    };
    // Without a mass 4.7300^2, with an endless one, about which the beam swings, 3.9266^2.
    assert!((beam_with_mass(0.0) - 22.3733).abs() < 1e-4 && (beam_with_mass(1e9) - 15.4182).abs() < 1e-4);
    for masses in [0.1, 1.0, 1e9] {
        let ratio = own(masses).first_frequency_hz / own(0.0).first_frequency_hz;
        let expected = beam_with_mass(masses) / beam_with_mass(0.0);
        assert!((ratio / expected - 1.0).abs() < 0.01, "{masses}: {ratio} {expected}");
        // Both bending modes couple with the norm 1 about the axis of the beam: the Coriolis force has the size 2 w / Omega_1.
        let size = own(masses).terms[5].size;
        assert!((size * ratio / 0.2 - 1.0).abs() < 0.01, "{masses}: {size}");
    }
}

/// A bent beam with a wheel at its end changes a product of inertia and no moment of inertia.
#[test]
fn changes_of_products_of_inertia_count() {
    let shaft = (0..8).map(|x| [x, 0, 0]);
    let wheel = (-3..4).flat_map(|y| (-3..4).map(move |z| [8, y, z]));
    let cells: Vec<[i32; 3]> = shaft.chain(wheel).collect();
    let steel = Material { youngs: 2.1e11, poisson: 0.3, density: 7850.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &cells, |[x, y, z]| [0.1 * x, 0.02 * y, 0.021 * z]);
    let body = body_of(mesh.assemble(&steel, MassRule::Consistent).raw_model(), 1, BodyFrame::Principal);
    let deflection = 0.01 * body.extent();
    let ranges = Ranges { deflection: Some(deflection), is_rotation_given: false, ..sizes(1.0) };
    let size = advise(&body, ranges, &Context::QUIET).expect("advice").terms[0].size;
    // The change of every entry of the inertia, with one mode.
    let (w1, inertia, shape) =
        (body.invariants().w1().expect("W1"), body.invariants().inertia(), &body.modes().shape);
    let length = |node: usize| (0..3).map(|k| shape[(3 * node + k, 0)].powi(2)).sum::<f64>().sqrt();
    let q = deflection / (0..body.n_nodes()).map(length).fold(0.0, f64::max);
    let change = |a: usize, b: usize| {
        0.5 * (w1[(a, b)] + w1[(b, a)]).abs() * q / (inertia[(a, a)] * inertia[(b, b)]).sqrt()
    };
    let moments = (0..3).map(|a| change(a, a)).fold(0.0, f64::max);
    let products = [(0, 1), (1, 2), (0, 2)].map(|(a, b)| change(a, b)).into_iter().fold(0.0, f64::max);
    assert!(moments < 1e-6 * products, "{moments} {products}");
    assert!((size - products).abs() < 1e-9 * products, "{size} {products}");
}
