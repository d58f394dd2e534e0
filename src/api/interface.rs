//! Interfaces: sets of nodes that joints and loads act on.

use super::matrix::shown;
use super::{FlexBody, Matrix};
use flexbody_model::Coupling;

/// Interface of a body, in body axes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Interface {
    /// Name of the interface.
    pub name: String,
    /// Numbers of its nodes.
    pub node_ids: Vec<i64>,
    /// Coupling to the reference point; `None` if none was stated.
    pub coupling: Option<Coupling>,
    /// Reference point; `None` for a free interface. Unit: length.
    pub reference: Option<[f64; 3]>,
    /// Displacement of the reference point by the modes (3 x nf); `None` without such a point. Unit: 1/sqrt(mass).
    pub translation: Option<Matrix>,
    /// Rotation of the reference point by the modes (3 x nf); `None` if the nodes do not determine one. Unit: 1/(length
    /// sqrt(mass)).
    pub rotation: Option<Matrix>,
}

/// K and M in the interface coordinates of a Craig-Bampton body, in body axes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct InterfaceCoordinates {
    /// Names of the nc coordinates: motions of the interfaces, then amplitudes of the fixed-interface modes.
    pub names: Vec<String>,
    /// Stiffness K (nc x nc).
    pub stiffness: Matrix,
    /// Mass M (nc x nc).
    pub mass: Matrix,
    /// Transformation B (nc x nf): coordinates B q for the modal coordinates q.
    pub of_modes: Matrix,
}

impl FlexBody {
    /// Returns the interfaces of the body.
    pub fn interfaces(&self) -> Vec<Interface> {
        let (nodes, modes) = (self.0.nodes(), self.0.modes());
        let rotation = modes.rotation.as_ref().map(|rotation| rotation.as_ref());
        let show = |interface: &flexbody_body::flex_body::Interface| {
            let rows = interface.rows(nodes, modes.shape.as_ref(), rotation, self.0.dimension());
            Interface {
                name: interface.name.clone(),
                node_ids: interface.nodes.iter().map(|&node| nodes.ids[node]).collect(),
                coupling: interface.coupling,
                reference: interface.reference,
                translation: rows.as_ref().map(|rows| shown(rows.translation.as_ref())),
                rotation: rows.and_then(|rows| rows.rotation.map(|rotation| shown(rotation.as_ref()))),
            }
        };
        self.0.interfaces().iter().map(show).collect()
    }

    /// Returns K and M in interface coordinates; `None` for a body that was not made by
    /// [`Basis::CraigBampton`](super::Basis::CraigBampton).
    pub fn interface_coordinates(&self) -> Option<InterfaceCoordinates> {
        let own = self.0.coordinates()?;
        Some(InterfaceCoordinates {
            names: own.names.clone(),
            stiffness: shown(own.stiffness.as_ref()),
            mass: shown(own.mass.as_ref()),
            of_modes: shown(own.of_modes.as_ref()),
        })
    }
}
