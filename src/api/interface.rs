//! Interfaces: sets of nodes that joints and loads act on.

use super::matrix::shown;
use super::{FlexBody, Matrix};
use flexbody_model::Coupling;

/// An interface of a body, in body axes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Interface {
    /// Name.
    pub name: String,
    /// Numbers of its nodes.
    pub node_ids: Vec<i64>,
    /// How it is coupled to its reference point, where that was stated.
    pub coupling: Option<Coupling>,
    /// The reference point; none of a free interface. Unit: length.
    pub reference: Option<[f64; 3]>,
    /// What the modes do at the reference point: its displacement (3 x nf); none without such a point. Unit:
    /// 1/sqrt(mass).
    pub translation: Option<Matrix>,
    /// Its rotation (3 x nf); none where the nodes do not determine one. Unit: 1/(length sqrt(mass)).
    pub rotation: Option<Matrix>,
}

/// K and M in the coordinates that a Craig-Bampton body has at its interfaces, in body axes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct InterfaceCoordinates {
    /// What each of the nc coordinates is: motions of the interfaces, then amplitudes of the fixed-interface
    /// modes.
    pub names: Vec<String>,
    /// K (nc x nc).
    pub stiffness: Matrix,
    /// M (nc x nc).
    pub mass: Matrix,
    /// B (nc x nf): coordinates B q for the modal coordinates q.
    pub of_modes: Matrix,
}

impl FlexBody {
    /// The interfaces.
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

    /// K and M in interface coordinates; `None` of a body that was not made by
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
