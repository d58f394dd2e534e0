//! Interfaces of a body for Exudyn's markers, which take hold of mesh nodes, counted from 0, with weights.
//!
//! `MarkerSuperElementRigid` takes the weighted mean of the nodes as its place and, by its "alternative approach", the rotation that fits their
//! displacements best. With equal weights this is the motion of our interfaces; `offset` leads from the mean to the reference point.

use crate::body::flex_body::{FlexBody, Interface};
use crate::formats::export::hdf5_contents::{Hdf5Contents, Hdf5Entry};
use faer::Mat;
use nalgebra::Vector3;

/// The program beside the file: loads the body, puts a joint at each interface and drives one.
pub(crate) const SCRIPT: &str = include_str!("run.py");

/// What takes the place of the file's extension in the name of that program.
pub(crate) const SCRIPT_NAME: &str = "_exudyn.py";

/// The numbers that nodes have in the FE model, and the interfaces in their order; Exudyn's loader passes over both.
pub(crate) fn entries(body: &FlexBody) -> Vec<Hdf5Entry> {
    let numbers = integers("nodeNumbers", body.nodes().ids.clone());
    let interfaces = body.interfaces().iter().enumerate().map(|(i, one)| interface(body, i, one)).collect();
    vec![numbers, Hdf5Contents::Group(interfaces).named("interfaces").with("datatype", "dict")]
}

fn interface(body: &FlexBody, number: usize, interface: &Interface) -> Hdf5Entry {
    let (nodes, count) = (&interface.nodes, interface.nodes.len());
    let mean =
        nodes.iter().map(|&i| Vector3::from(body.nodes().positions[i])).sum::<Vector3<f64>>() / count as f64;
    // A free interface has no reference point of its own.
    let reference = interface.reference.map_or(mean, Vector3::from);
    let text =
        |name: &str, text: &str| Hdf5Contents::Text(text.to_owned()).named(name).with("datatype", "str");
    let list =
        |name: &str, values: &[f64]| Hdf5Contents::list(values).named(name).with("datatype", "ndarray");
    let members = vec![
        text("name", &interface.name),
        text("coupling", interface.coupling.map_or("not stated", |coupling| coupling.name())),
        text("marker", if turns(body, interface) { "rigid" } else { "position" }),
        integers("nodeNumbers", nodes.iter().map(|&i| body.nodes().ids[i]).collect()),
        integers("meshNodeNumbers", nodes.iter().map(|&i| i as i64).collect()),
        list("weights", &vec![1.0 / count as f64; count]),
        list("referencePoint", reference.as_slice()),
        list("offset", (reference - mean).as_slice()),
    ];
    // The order of links in HDF5 is that of their names.
    Hdf5Contents::Group(members).named(format!("interface{number:04}")).with("datatype", "dict")
}

/// Whether the positions of the nodes determine a rotation: Exudyn's bodies have no others.
fn turns(body: &FlexBody, interface: &Interface) -> bool {
    let about = Interface { reference: interface.reference.or(Some([0.0; 3])), ..interface.clone() };
    let still = Mat::zeros(3 * body.n_nodes(), 1);
    about.rows(body.nodes(), still.as_ref(), None, 3).is_some_and(|rows| rows.rotation.is_some())
}

fn integers(name: &str, values: Vec<i64>) -> Hdf5Entry {
    Hdf5Contents::Integers(vec![values.len()], values).named(name).with("datatype", "ndarray")
}
