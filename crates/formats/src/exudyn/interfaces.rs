//! Interfaces of a body for the markers of Exudyn, which refer to mesh nodes, counted from 0, with weights.
//!
//! `MarkerSuperElementRigid` takes the weighted mean of the nodes as its position and, by its "alternative
//! approach", the rotation that fits their displacements best. With equal weights this is the motion of an
//! interface of flexbody; `offset` is the vector from the mean to the reference point.

use super::mesh::{Mesh, MeshInterface};
use crate::export::hdf5_contents::{Hdf5Contents, Hdf5Entry};
use flexbody_body::flex_body::{FlexBody, Interface};
use nalgebra::Vector3;

/// Accompanying Python program: loads the body, puts a joint at each interface and drives one.
pub(crate) const SCRIPT: &str = include_str!("run.py");

/// Suffix that replaces the extension of the file in the name of the accompanying program.
pub(crate) const SCRIPT_NAME: &str = "_exudyn.py";

/// Returns the node numbers of the FE model and the interfaces in their order; the loader of Exudyn ignores
/// both.
pub(crate) fn entries(body: &FlexBody, mesh: &Mesh) -> Vec<Hdf5Entry> {
    let held = body.interfaces().iter().zip(&mesh.interfaces).enumerate();
    let interfaces = held.map(|(number, (own, nodes))| interface(number, own, nodes, mesh)).collect();
    let numbers = integers("nodeNumbers", mesh.numbers.clone());
    vec![numbers, Hdf5Contents::Group(interfaces).named("interfaces").with("datatype", "dict")]
}

fn interface(number: usize, interface: &Interface, own: &MeshInterface, mesh: &Mesh) -> Hdf5Entry {
    let count = own.nodes.len();
    let sum: Vector3<f64> = own.nodes.iter().map(|&i| Vector3::from(mesh.positions[i])).sum();
    let mean = sum / count as f64;
    let text =
        |name: &str, text: &str| Hdf5Contents::Text(text.to_owned()).named(name).with("datatype", "str");
    let list =
        |name: &str, values: &[f64]| Hdf5Contents::list(values).named(name).with("datatype", "ndarray");
    let members = vec![
        text("name", &interface.name),
        text("coupling", interface.coupling.map_or("not stated", |coupling| coupling.name())),
        text("marker", if own.turns { "rigid" } else { "position" }),
        integers("nodeNumbers", own.nodes.iter().map(|&i| mesh.numbers[i]).collect()),
        integers("meshNodeNumbers", own.nodes.iter().map(|&i| i as i64).collect()),
        list("weights", &vec![1.0 / count as f64; count]),
        list("referencePoint", own.reference.as_slice()),
        list("offset", (own.reference - mean).as_slice()),
    ];
    // HDF5 orders links by name.
    Hdf5Contents::Group(members).named(format!("interface{number:04}")).with("datatype", "dict")
}

fn integers(name: &str, values: Vec<i64>) -> Hdf5Entry {
    Hdf5Contents::Integers(vec![values.len()], values).named(name).with("datatype", "ndarray")
}
