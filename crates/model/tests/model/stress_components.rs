//! Notes about stresses of recoveries that are read as plane states, and about those of which no equivalent stress is formed.

use flexbody_base::diagnostic::Code;
use flexbody_model::{FeModel, RawModel, RecoveryOperator, StressPoint};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, grid};

/// Components of the operator of stresses, in its order.
const SIX: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];

fn model() -> RawModel {
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([2, 1, 1]), |[x, y, z]| [x, y + 0.1 * x, z]);
    let raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    RawModel { recoveries: vec![mesh.stresses(&Material::STEEL)], ..raw }
}

/// Returns the number of points and the messages of a model whose components have other names; an empty name leaves the row out as a
/// stress.
fn told(components: [&str; 6]) -> (usize, Vec<(Code, String)>) {
    let mut raw = model();
    let RecoveryOperator::Rows { labels, .. } = &mut raw.recoveries[0].operator else { panic!("rows") };
    for (at, label) in labels.iter_mut().enumerate() {
        let new = components[at % 6];
        label.name = label.name.replace(SIX[at % 6], new);
        new.clone_into(&mut label.component);
        if new.is_empty() {
            label.quantity = flexbody_model::Quantity::Force;
            label.name = format!("left out {at}");
        }
    }
    let points = StressPoint::among(labels).len();
    let diagnostics = FeModel::from_raw(raw).expect("a sound model").diagnostics;
    let own = [Code::RecoveryPlane, Code::RecoveryNoEquivalent];
    let found = diagnostics.iter().filter(|one| own.contains(&one.code()));
    (points, found.map(|one| (one.code(), one.message().to_owned())).collect())
}

#[test]
fn usual_spellings_of_the_components_are_points() {
    for six in [
        SIX,
        ["XX", "YY", "ZZ", "XY", "YZ", "ZX"],
        ["11", "22", "33", "12", "23", "31"],
        ["S11", "S22", "S33", "S12", "S23", "S13"],
    ] {
        let (points, said) = told(six);
        assert!(points == 16 && said.is_empty(), "{six:?}: {points} {said:?}");
    }
}

#[test]
fn plane_states_are_stated() {
    let (points, said) = told(["xx", "yy", "", "xy", "", ""]);
    assert_eq!((points, said[0].0), (16, Code::RecoveryPlane));
    assert!(
        said.len() == 1 && said[0].1.contains("no stresses zz, yz and xz: they count as zero"),
        "{said:?}"
    );
    let (points, said) = told(["xx", "yy", "zz", "xy", "", ""]);
    assert_eq!(points, 16);
    assert!(said[0].1.contains("no stresses yz and xz: they count as zero"), "{said:?}");
}

#[test]
fn stresses_without_an_equivalent_stress_are_stated() {
    for (components, reason) in [
        (["a", "b", "c", "d", "e", "f"], "not all of them are known components"),
        (["rr", "tt", "zz", "rt", "tz", "rz"], "not all of them are known components"),
        (["xx", "", "zz", "", "", "xz"], "neither all six nor those of a plane state"),
    ] {
        let (points, said) = told(components);
        assert!(points == 0 && said.len() == 1, "{components:?}: {said:?}");
        assert_eq!(said[0].0, Code::RecoveryNoEquivalent);
        assert!(said[0].1.contains(reason), "{components:?}: {said:?}");
    }
    // Single stresses, as of gauges, are no tensors.
    for components in [["xx", "", "", "", "", ""], ["xx", "yy", "", "", "", ""]] {
        let (points, said) = told(components);
        assert!(points == 0 && said.is_empty(), "{components:?}: {said:?}");
    }
}
