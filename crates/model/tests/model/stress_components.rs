//! Notes about stresses of recoveries that are read as plane states, and about those of which no equivalent stress is formed.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::units::UnitSystem;
use flexbody_linalg::CscMatrix;
use flexbody_model::{AnsweredShapes, DofLabel, FeModel, RawModel, RecoveryOperator, StressPoint};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, entries, grid};

/// Components of the operator of stresses, in its order.
const SIX: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];

fn model() -> RawModel {
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([2, 1, 1]), |[x, y, z]| [x, y + 0.1 * x, z]);
    let raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    raw.with(|data| data.recoveries = vec![mesh.stresses(&Material::STEEL)])
}

/// Returns the number of points and the messages of a model whose components have other names; an empty name leaves the row out as a
/// stress.
fn told(components: [&str; 6]) -> (usize, Vec<(Code, String)>) {
    let mut raw = model();
    let RecoveryOperator::Rows { labels, .. } = &mut raw.data.recoveries[0].operator else { panic!("rows") };
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
    let found = diagnostics.iter().filter(|diagnostic| own.contains(&diagnostic.code()));
    (points, found.map(|diagnostic| (diagnostic.code(), diagnostic.message().to_owned())).collect())
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

/// Stresses of shapes in Pa for a model in mm are a million times those of its stiffness.
#[test]
fn stresses_of_shapes_in_another_unit_are_reported() {
    let said = |factor: f64| {
        let mut raw = model();
        raw.data.description.units = UnitSystem::parse("mm", "t", "s").expect("units");
        let scaled = |matrix: &CscMatrix, factor: f64| {
            let all: Vec<_> = entries(matrix).map(|(r, c, v)| (r, c, factor * v)).collect();
            CscMatrix::from_triplets(matrix.n_rows(), matrix.n_cols(), &all)
        };
        // The model of metres in millimetres and tonnes: stiffness in N/mm, stresses in MPa per mm.
        raw.stiffness.matrix = scaled(&raw.stiffness.matrix, 1e-3);
        raw.mass.matrix = scaled(&raw.mass.matrix, 1e-3);
        raw.nodes.positions.iter_mut().flatten().for_each(|x| *x *= 1e3);
        let RecoveryOperator::Rows { transposed, labels, .. } = &raw.data.recoveries[0].operator else {
            panic!("rows")
        };
        let (n, rows) = (transposed.n_rows(), transposed.n_cols());
        let dof = |row: usize| DofLabel { node: raw.nodes.ids[row / 3], direction: 1 + (row % 3) as u8 };
        let mut labels = labels.clone();
        labels.iter_mut().for_each(|label| label.unit = "MPa".to_owned());
        let shapes = AnsweredShapes {
            dofs: (0..n).map(dof).collect(),
            displacements: Mat::identity(n, n),
            digits: 15,
            answers: Mat::from_fn(rows, n, |i, j| factor * 1e-9 * transposed.get(j, i)),
            answer_digits: 15,
            energies: None,
        };
        raw.data.recoveries[0].operator = RecoveryOperator::Shapes { shapes, labels };
        let diagnostics = FeModel::from_raw(raw).expect("a sound model").diagnostics;
        diagnostics
            .iter()
            .find(|diagnostic| diagnostic.code() == Code::RecoveryScale)
            .map(|diagnostic| diagnostic.message().to_owned())
    };
    assert_eq!(said(1.0), None);
    for factor in [1e6, 1e-3] {
        assert!(said(factor).is_some_and(|text| text.contains("times those that the stiffness")), "{factor}");
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
