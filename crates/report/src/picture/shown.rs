//! Data of a body for the script of a page: names, positions, modes and interfaces.

use super::drawing::{Drawing, turned};
use crate::facts::UnitFacts;
use crate::mass_properties::{centre_of_mass, inertia_about_com};
use crate::numbers::{frequency, plain};
use flexbody_base::provenance;
use flexbody_body::flex_body::{FlexBody, Interface, is_static};
use flexbody_body::invariants::principal_axes;
use serde::Serialize;

/// Script that draws a body in a page from the data of the page.
pub(crate) const SCRIPT: &str = include_str!("view.js");

/// Centre of mass and principal axes, in model axes.
pub(super) struct Placed {
    pub centre_of_mass: [f64; 3],
    /// Principal axes, by ascending moments.
    pub principal: [[f64; 3]; 3],
}

impl Placed {
    pub(super) fn of(body: &FlexBody) -> Self {
        let (frame, invariants) = (body.frame(), body.invariants());
        let axes = frame.axes * principal_axes(&inertia_about_com(invariants));
        Self {
            centre_of_mass: frame.to_model(centre_of_mass(invariants).into()),
            principal: [0, 1, 2].map(|k| axes.column(k).into_owned().into()),
        }
    }

    /// Returns the end of an axis of the given length from the centre of mass.
    pub(super) fn axis_end(&self, axis: &[f64; 3], length: f64) -> [f64; 3] {
        [0, 1, 2].map(|k| self.centre_of_mass[k] + length * axis[k])
    }
}

/// Texts and scalar data of a page for its script. Positions are in model axes.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct ShownBody<'a, M> {
    name: String,
    generator: String,
    units: UnitFacts,
    terms: Vec<(&'static str, String)>,
    /// True for a body of two dimensions; its initial view is from above.
    plane: bool,
    vertices: usize,
    centre: [f64; 3],
    half: f64,
    radius: f64,
    modes: Vec<ShownMode>,
    interfaces: Vec<ShownInterface>,
    centre_of_mass: [f64; 3],
    /// Principal axes, by ascending moments.
    principal: [[f64; 3]; 3],
    motion: Option<&'a M>,
}

#[derive(Serialize)]
struct ShownMode {
    label: String,
    kind: String,
    /// Component that the integer 32767 stands for: the largest component of the shape at a drawn node.
    scale: f64,
    /// Largest displacement of a drawn node.
    largest: f64,
}

#[derive(Serialize)]
struct ShownInterface {
    name: String,
    reference: Option<[f64; 3]>,
    /// Drawn nodes of the interface.
    nodes: Vec<u32>,
    /// Displacement of the reference point in each mode, three numbers per mode.
    motion: Vec<f64>,
}

impl<'a, M: Serialize> ShownBody<'a, M> {
    /// Collects the data of `body` with the modes of `drawing`, the `terms` beside the picture, and the
    /// `motion`.
    pub(crate) fn new(
        body: &FlexBody,
        drawing: &Drawing<'_>,
        terms: Vec<(&'static str, String)>,
        motion: Option<&'a M>,
    ) -> Self {
        let placed = Placed::of(body);
        Self {
            name: plain(&body.source().name),
            generator: provenance::generator(),
            units: UnitFacts::new(body.units()),
            terms,
            plane: body.dimension() == 2,
            vertices: drawing.vertices(),
            centre: drawing.centre(),
            half: drawing.half(),
            radius: drawing.radius(),
            modes: (0..drawing.modes()).map(|j| mode(body, drawing, j)).collect(),
            interfaces: interfaces(body, drawing),
            centre_of_mass: placed.centre_of_mass,
            principal: placed.principal,
            motion,
        }
    }

    /// Returns the data as JSON in which no text can end the element of the page.
    pub(crate) fn json(&self) -> String {
        let json = serde_json::to_string(self).expect("structs of numbers and texts are valid JSON");
        json.replace('<', "\\u003c")
    }
}

fn mode(body: &FlexBody, drawing: &Drawing<'_>, j: usize) -> ShownMode {
    let hertz = frequency(body.frequencies_hz()[j], 5);
    let origin = body.modes().provenance.get(j).map_or("mode", String::as_str);
    let (label, kind) = if is_static(origin) {
        (format!("{}: {origin}", j + 1), format!("{origin}; its eigenvalue corresponds to {hertz}"))
    } else {
        (format!("{}: {hertz}", j + 1), origin.to_owned())
    };
    ShownMode {
        label: plain(&label),
        kind: plain(&kind),
        scale: drawing.scale(j),
        largest: drawing.largest(j),
    }
}

fn interfaces(body: &FlexBody, drawing: &Drawing<'_>) -> Vec<ShownInterface> {
    let axes = &body.frame().axes;
    let rotation = body.modes().rotation.as_ref().map(|rotation| rotation.as_ref());
    let one = |interface: &Interface| {
        let rows = interface.rows(body.nodes(), body.modes().shape.as_ref(), rotation, body.dimension());
        let turned = rows.as_ref().map(|rows| turned(axes, rows.translation.as_ref()));
        let mut motion = turned.unwrap_or_else(|| vec![0.0; 3 * body.n_modes()]);
        motion.truncate(3 * drawing.modes());
        ShownInterface {
            name: plain(&interface.name),
            reference: interface.reference.map(|x| body.frame().to_model(x)),
            nodes: interface.nodes.iter().filter_map(|&node| drawing.vertex(node)).collect(),
            motion,
        }
    };
    body.interfaces().iter().map(one).collect()
}
