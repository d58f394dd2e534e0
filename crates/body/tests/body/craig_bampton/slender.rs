//! Slender bodies with many fixed-interface modes, whose summands cancel.

use super::*;

/// For a bar of 5000 times its width with a third of its modes, B'M B = I holds to the rounding of its
/// summands, which exceeds the limit of other bodies; a wrong mass is still detected.
#[test]
fn many_modes_of_a_slender_bar_hold_to_the_rounding_of_their_summands() {
    let mesh = Mesh::block(ElementKind::Hex8, [60, 1, 1], [1.0, 2e-4, 2e-4]);
    let end = |at: f64| -> Vec<i64> {
        let nodes = (1..).zip(&mesh.nodes);
        nodes.filter(|(_, x)| (x[0] - at).abs() < 1e-9).map(|(id, _)| id).collect()
    };
    let set = |name: &str, at| NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new(name, end(at)) };
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    raw.data.interfaces = vec![set("left", 0.0), set("right", 1.0)];
    let body = body(&model(raw), 240);
    let mass = |body: &FlexBody| {
        let checks = body.parts().interface_identities();
        checks.into_iter().find(|check| check.name == "interface_mass").expect("a check")
    };
    let check = mass(&body);
    assert!(check.passed && check.value > 1e-9, "{check:?}");
    assert_eq!(broken(&body), [""; 0]);
    for (entry, change) in [((0, 0), 1.0 + 1e-5), ((20, 20), 1.0 + 1e-3)] {
        let mut parts = body.clone().into_parts();
        parts.coordinates.as_mut().expect("coordinates").mass[entry] *= change;
        let check = parts.interface_identities().into_iter().find(|check| check.name == "interface_mass");
        assert!(!check.expect("a check").passed, "{entry:?}");
    }
}
