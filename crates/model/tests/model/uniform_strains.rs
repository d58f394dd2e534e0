//! Comparison of stresses with the stiffness under uniform strain: right rows of any element, unit, place and axes pass,
//! each kind of wrong rows is refused, and bodies that are not homogeneous are left alone with a note.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::units::UnitSystem;
use flexbody_linalg::CscMatrix;
use flexbody_model::{FeModel, RawModel, RecoveryOperator};
use nalgebra::{Matrix3, Matrix6};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, entries};
use oracle::random::Random;

/// Components of a stress as pairs of axes.
const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

fn steel(mesh: &Mesh) -> RawModel {
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    raw.data.description.units = UnitSystem::parse("m", "kg", "s").expect("units");
    raw.data.recoveries = vec![mesh.stresses(&Material::STEEL)];
    raw
}

/// Returns a skewed bracket, turned and moved.
fn bracket(kind: ElementKind) -> Mesh {
    let mesh = Mesh::bracket(kind, 3, 2, 0.01);
    let skewed = |x: &[f64; 3]| [x[0] + 0.1 * x[1], x[1] * (1.0 + x[0]), x[2] - 0.2 * x[0] * x[1]];
    let mesh = Mesh { nodes: mesh.nodes.iter().map(skewed).collect(), elements: mesh.elements };
    mesh.moved(&Random(3).rotation(), [0.7, -0.2, 1.1])
}

/// Returns the model with the six rows of each point replaced by `map` times them.
fn mapped(mut raw: RawModel, map: &Matrix6<f64>) -> RawModel {
    let RecoveryOperator::Rows { transposed, .. } = &mut raw.data.recoveries[0].operator else {
        panic!("rows")
    };
    let place = |(row, column, value): (u32, u32, f64)| {
        let (point, component) = (column / 6, column as usize % 6);
        (0..6).map(move |k| (row, 6 * point + k as u32, map[(k, component)] * value))
    };
    let all: Vec<_> = entries(transposed).flat_map(place).filter(|entry| entry.2 != 0.0).collect();
    *transposed = CscMatrix::from_triplets(transposed.n_rows(), transposed.n_cols(), &all);
    raw
}

fn said(raw: RawModel) -> Vec<Diagnostic> {
    let all = match FeModel::from_raw(raw) {
        Ok(checked) => checked.diagnostics,
        Err(error) => error.diagnostics().to_vec(),
    };
    let codes = [Code::RecoveryContradicts, Code::RecoveryUncompared, Code::RecoveryScale];
    all.into_iter().filter(|diagnostic| codes.contains(&diagnostic.code())).collect()
}

/// Returns the message if it is the only one and an error.
fn refusal(raw: RawModel) -> String {
    let found = said(raw);
    assert!(found.len() == 1 && found[0].code() == Code::RecoveryContradicts, "{found:?}");
    found[0].message().to_owned()
}

/// Returns the map of the components of a stress that turns it by `axes`: s' = Q s Q'.
fn turn(axes: &Matrix3<f64>) -> Matrix6<f64> {
    let mut map = Matrix6::zeros();
    for (column, (c, d)) in PAIRS.into_iter().enumerate() {
        let mut stress = Matrix3::zeros();
        (stress[(c, d)], stress[(d, c)]) = (1.0, 1.0);
        let turned = axes * stress * axes.transpose();
        PAIRS.into_iter().enumerate().for_each(|(k, (a, b))| map[(k, column)] = turned[(a, b)]);
    }
    map
}

/// Returns the unit map with two rows exchanged.
fn exchanged(a: usize, b: usize) -> Matrix6<f64> {
    let mut map = Matrix6::identity();
    map.swap_rows(a, b);
    map
}

/// Returns the unit map with one row times a factor.
fn scaled(rows: impl IntoIterator<Item = usize>, factor: f64) -> Matrix6<f64> {
    let mut map = Matrix6::identity();
    rows.into_iter().for_each(|row| map[(row, row)] = factor);
    map
}

#[test]
fn right_stresses_pass_in_every_element_place_and_unit() {
    for kind in [ElementKind::Hex8, ElementKind::Tet4, ElementKind::Tet10, ElementKind::Hex20] {
        assert!(said(steel(&bracket(kind))).is_empty(), "{kind:?}");
        // In mm, t, s: stresses in MPa.
        let mesh = bracket(kind);
        let mesh = Mesh { nodes: mesh.nodes.iter().map(|x| x.map(|v| 1e3 * v)).collect(), ..mesh };
        let material = Material {
            youngs: Material::STEEL.youngs * 1e-6,
            density: Material::STEEL.density * 1e-12,
            ..Material::STEEL
        };
        let mut raw = mesh.assemble(&material, MassRule::Consistent).raw_model();
        raw.data.description.units = UnitSystem::parse("mm", "t", "s").expect("units");
        raw.data.recoveries = vec![mesh.stresses(&material)];
        let RecoveryOperator::Rows { labels, .. } = &mut raw.data.recoveries[0].operator else {
            panic!("rows")
        };
        labels.iter_mut().for_each(|label| "MPa".clone_into(&mut label.unit));
        assert!(said(raw).is_empty(), "{kind:?} in mm");
    }
}

#[test]
fn wrong_stresses_are_refused_with_the_components_that_differ() {
    let with = |map: &Matrix6<f64>| refusal(mapped(steel(&bracket(ElementKind::Hex8)), map));
    for (map, facts) in [
        (scaled(3..6, 2.0), "`xy` is 2 xy, `yz` is 2 yz, `xz` is 2 xz"),
        (scaled(3..6, 0.5), "`xy` is 0.5 xy, `yz` is 0.5 yz, `xz` is 0.5 xz"),
        (exchanged(3, 4), "`xy` is yz, `yz` is xy"),
        (exchanged(1, 2), "`yy` is zz, `zz` is yy"),
        (scaled([4], -1.0), "`yz` is -1 yz"),
        (scaled(0..6, -1.0), "`xx` is -1 xx"),
        (scaled([5], 0.0), "`xz` is zero"),
    ] {
        let message = with(&map);
        assert!(message.contains(facts), "{message}");
    }
    // Rows shifted by one.
    let shifted = Matrix6::from_fn(|k, l| f64::from(u8::from((k + 1) % 6 == l)));
    assert!(with(&shifted).contains("`xx` is yy"), "{}", with(&shifted));
    // Sizes.
    for factor in [0.5, 10.0, 30.0] {
        let message = with(&scaled(0..6, factor));
        assert!(message.contains(&format!("are {factor} times")), "{message}");
    }
    // Another unit than the rows say; an unknown one cannot be compared.
    let in_unit = |unit: &str| {
        let mut raw = steel(&bracket(ElementKind::Hex8));
        let RecoveryOperator::Rows { labels, .. } = &mut raw.data.recoveries[0].operator else {
            panic!("rows")
        };
        labels.iter_mut().for_each(|label| unit.clone_into(&mut label.unit));
        raw
    };
    assert!(refusal(in_unit("MPa")).contains("are 1e6 times"), "{}", refusal(in_unit("MPa")));
    assert!(said(in_unit("slug/in/s^2")).is_empty());
    // The user may mean it.
    let mut raw = mapped(steel(&bracket(ElementKind::Hex8)), &scaled(0..6, 2.5));
    raw.allow_implausible = true.into();
    assert!(said(raw).iter().all(|diagnostic| diagnostic.code() == Code::RecoveryScale));
}

/// A concentrated mass adds no volume, and stresses along other axes agree with the stiffness by their invariants.
#[test]
fn concentrated_masses_and_other_axes_are_sound() {
    let mesh = bracket(ElementKind::Hex8);
    let mut raw = steel(&mesh);
    let heavy: Vec<_> = (0..3).map(|k| (k, k, 50.0)).collect();
    let all: Vec<_> = entries(&raw.mass.matrix).chain(heavy).collect();
    raw.mass.matrix = CscMatrix::from_triplets(mesh.nodes.len() * 3, mesh.nodes.len() * 3, &all);
    assert!(said(raw).is_empty());
    for seed in 0..5 {
        let found = said(mapped(steel(&mesh), &turn(&Random(seed).rotation())));
        assert!(found.len() == 1 && found[0].code() == Code::RecoveryUncompared, "{found:?}");
        assert!(found[0].message().contains("along other axes"), "{found:?}");
    }
}

/// Parts of different materials: the stress of a point is that of its material, and its components are compared with each
/// other where the material is isotropic.
#[test]
fn points_of_several_materials_are_compared_each_for_itself() {
    let mesh = bracket(ElementKind::Hex8);
    let middle = mesh.nodes.iter().map(|x| x[0]).sum::<f64>() / mesh.nodes.len() as f64;
    let soft = Material { youngs: 0.3 * Material::STEEL.youngs, poisson: 0.4, ..Material::STEEL };
    let parts = [(mesh.part(|x| x[0] < middle), &Material::STEEL), (mesh.part(|x| x[0] >= middle), &soft)];
    let [first, second] = parts.clone().map(|(part, material)| part.assemble(material, MassRule::Consistent));
    let mut raw = first.plus(&second).raw_model();
    raw.data.description.units = UnitSystem::parse("m", "kg", "s").expect("units");
    for (part, material) in &parts {
        raw.data.recoveries = vec![part.stresses(material)];
        assert!(said(raw.clone()).is_empty(), "{:?}", said(raw));
        for (map, facts) in [
            (scaled(3..6, 2.0), "`xy` is 2 xy, `yz` is 2 yz, `xz` is 2 xz"),
            (exchanged(3, 4), "`xy` is yz, `yz` is xy"),
            (exchanged(0, 2), "`xx` is zz, `zz` is xx"),
            (scaled(0..6, -1.0), "`xx` is -1 xx"),
        ] {
            let message = refusal(mapped(raw.clone(), &map));
            assert!(message.contains(facts), "{message}");
        }
        // The size is known roughly: kPa for Pa are reported. A mixture is no isotropic material.
        assert!(said(mapped(raw.clone(), &scaled(0..6, 30.0))).is_empty());
        let found = said(mapped(raw.clone(), &scaled(0..6, 1e3)));
        assert!(found.len() == 1 && found[0].code() == Code::RecoveryScale, "{found:?}");
        let found = said(mapped(raw.clone(), &scaled([1], 1.3)));
        assert!(found.len() == 1 && found[0].code() == Code::RecoveryUncompared, "{found:?}");
        assert!(found[0].message().contains("several materials"), "{found:?}");
    }
}
