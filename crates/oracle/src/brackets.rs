//! Small bodies with interfaces: a bracket of hexahedra and a plane strip held at two ends, and a soft block with one
//! interface.

use crate::elements::{ElementKind, MassRule, Material};
use crate::mesh::{Mesh, grid};
use crate::plane::rectangle;
use crate::random::Random;
use flexbody_model::{Coupling, NodeSet, RawModel, Reference};

const CELL: f64 = 0.05;

/// Returns a rotated and shifted bracket with its two ends as interfaces; the reference point of the second is far from
/// its nodes.
pub fn bracket(couplings: [Coupling; 2]) -> RawModel {
    let mesh = Mesh::bracket(ElementKind::Hex8, 4, 2, CELL);
    let end = |axis: usize| -> Vec<i64> {
        let kept = mesh.nodes.iter().enumerate().filter(|(_, x)| (x[axis] - 4.0 * CELL).abs() < 1e-9);
        kept.map(|(i, _)| i as i64 + 1).collect()
    };
    let sets = [end(0), end(2)];
    let turned = mesh.moved(&Random(3).rotation(), [0.7, -0.2, 1.1]);
    let mut raw = turned.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    let far = Reference::Point([0.5, 0.3, 0.9]);
    let references =
        [Reference::Centre, if couplings[1] == Coupling::Free { Reference::Centre } else { far }];
    raw.data.interfaces = ["first", "second"]
        .into_iter()
        .zip(sets)
        .zip(couplings.into_iter().zip(references))
        .map(|((name, nodes), (coupling, reference))| NodeSet {
            coupling: Some(coupling),
            reference,
            ..NodeSet::new(name, nodes)
        })
        .collect();
    raw
}

/// Returns a plane strip held at its ends.
pub fn strip(couplings: [Coupling; 2]) -> RawModel {
    let mut raw = rectangle(8, 3, 0.4, [0.3, -0.1]);
    let last = raw.nodes.len() as i64;
    let ends = [(1..=last).step_by(9).collect(), (9..=last).step_by(9).collect()];
    raw.data.interfaces = ["first", "second"]
        .into_iter()
        .zip(ends)
        .zip(couplings)
        .map(|((name, nodes), coupling)| NodeSet { coupling: Some(coupling), ..NodeSet::new(name, nodes) })
        .collect();
    raw
}

/// Returns a rubber-like block without symmetry, rotated and far from the origin of the model, with an interface.
pub fn footed_block() -> RawModel {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([4, 2, 2]), |[x, y, z]| {
        [0.3 * x + 0.03 * y, 0.2 * y * (1.0 - 0.05 * x), 0.2 * z * (1.0 + 0.1 * y)]
    });
    let ids: Vec<i64> =
        (0..mesh.nodes.len()).filter(|&i| mesh.nodes[i][0] < 0.1).map(|i| i as i64 + 1).collect();
    let turned = mesh.moved(&Random(11).rotation(), [2.0, -3.0, 1.0]);
    let mut raw = turned.assemble(&rubber, MassRule::Consistent).raw_model();
    raw.data.interfaces = vec![NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new("foot", ids) }];
    raw
}
