//! Skewed beam of rubber with an interface at each end.

use flexbody_model::{Coupling, NodeSet, RawModel};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, grid};

/// Length of an element along the beam.
const LENGTH: f64 = 0.4;

/// Returns a beam of `elements` bricks with its stresses and the interfaces `root` and `tip`.
pub(crate) fn skewed_beam(youngs: f64, elements: i32) -> RawModel {
    let rubber = Material { youngs, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([elements, 1, 1]), |[x, y, z]| {
        [LENGTH * x + 0.06 * y, 0.4 * y * (1.0 - 0.05 * x), 0.3 * z * (1.0 + 0.1 * y)]
    });
    let raw = mesh.assemble(&rubber, MassRule::Consistent).raw_model();
    let set = |name: &str, inside: &dyn Fn(f64) -> bool| {
        let nodes = raw.nodes.ids.iter().zip(&raw.nodes.positions).filter(|(_, at)| inside(at[0]));
        let nodes = nodes.map(|(id, _)| *id).collect();
        NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new(name, nodes) }
    };
    let end = LENGTH * f64::from(elements);
    let interfaces = vec![set("root", &|x| x < 0.1), set("tip", &|x| x > end - 0.05)];
    raw.with(|data| {
        data.interfaces = interfaces;
        data.recoveries = vec![mesh.stresses(&rubber)];
    })
}
