//! Advice for ranges of motion: limits of small and large motion, the formula of an attached mass, and covariance.

use flexbody_body::flex_body::TermGroups;
use flexbody_body::invariants::BodyFrame;
use flexbody_study::advice::{Advice, AttachedMass, Ranges, advise};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::{body_of, soft_block};
use oracle::mesh::Mesh;

fn ranges(spin_hz: f64) -> Ranges {
    Ranges { spin_hz, deflection: None, attached: None, is_rotation_given: true, limit: 0.05 }
}

fn advice(ranges: Ranges) -> Advice {
    advise(&soft_block(6), ranges).expect("advice")
}

#[test]
fn a_slow_body_qualifies_for_guideline_one_and_a_fast_one_needs_all() {
    let first = soft_block(6).frequencies_hz()[0];
    let slow = advice(ranges(1e-6 * first));
    assert_eq!((slow.guideline().name, slow.groups), ("I", TermGroups::NONE));
    let fast = advice(ranges(0.5 * first));
    assert_eq!(fast.guideline().name, "IV");
    assert!(fast.groups.w1 && fast.groups.w3);
    // Guidelines keep more and more terms, so that what is left out never grows.
    for own in [&slow, &fast] {
        assert!(own.guidelines.windows(2).all(|pair| pair[0].ratio >= pair[1].ratio));
        assert_eq!(own.guidelines.last().map(|one| one.ratio), Some(0.0));
    }
}

#[test]
fn terms_follow_the_powers_of_spin_and_deflection() {
    let body = soft_block(6);
    let own = |spin: f64, deflection: f64| {
        let ranges = Ranges { deflection: Some(deflection), is_rotation_given: false, ..ranges(spin) };
        advise(&body, ranges).expect("advice").terms.iter().map(|term| term.size).collect::<Vec<_>>()
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
        let ranges = Ranges { attached, is_rotation_given: false, ..ranges(1.0) };
        advise(&body, ranges).expect("advice").terms[1].size
    };
    // An attached mass that grows beyond all bounds adds the inertia of the body's own mass at this distance.
    let (none, little, much, endless) = (size(0.0), size(1e-9), size(1e6), size(1e12));
    assert!((little - none).abs() < 1e-6 * none && much < none);
    assert!((endless - much).abs() < 1e-4 * much, "{much} {endless}");
    let unknown = Some(AttachedMass { mass: 1.0, interface: Some("nowhere".to_owned()) });
    assert!(advise(&body, Ranges { attached: unknown, ..ranges(1.0) }).is_err());
    for wrong in [f64::NAN, f64::INFINITY, -1.0] {
        assert!(advise(&body, ranges(wrong)).is_err());
        assert!(advise(&body, Ranges { limit: wrong, ..ranges(1.0) }).is_err());
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
    let ranges = Ranges { deflection: Some(deflection), is_rotation_given: false, ..ranges(1.0) };
    let size = advise(&body, ranges).expect("advice").terms[0].size;
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
