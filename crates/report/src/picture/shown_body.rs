//! Data of a body for the script of a page: names, positions, modes and interfaces.

use super::drawing::Drawing;
use super::field::{Field, ShownField};
use super::initial_view::InitialView;
use super::principal_axes::Placed;
use crate::notation::markup::plain;
use crate::notation::numbers::frequency;
use crate::notation::units::UnitFacts;
use faer::MatRef;
use flexbody_base::provenance;
use flexbody_body::flex_body::{FlexBody, Interface, is_static};
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// Script that draws a body in a page from the data of the page.
pub(crate) const SCRIPT: &str = include_str!("view.js");

/// Texts and scalar data of a page for its script. Positions are in model axes.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct ShownBody<'a, M> {
    name: String,
    generator: String,
    units: UnitFacts,
    terms: Vec<(&'static str, String)>,
    /// Rotations about x and about z of the initial view, which shows the place of the largest value. Unit: rad.
    view: [f64; 2],
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
    /// Values that colour the picture. The page begins with the first of them if it was made for them.
    fields: Vec<ShownField<'a>>,
    starts_with_field: bool,
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
    /// Collects the data of `body` with the modes of `drawing`, the values of `fields`, the `terms` beside the picture,
    /// and the `motion`.
    pub(crate) fn new(
        body: &FlexBody,
        drawing: &Drawing<'_>,
        fields: &'a [Field],
        terms: Vec<(&'static str, String)>,
        motion: Option<&'a M>,
        starts_with_field: bool,
    ) -> Self {
        let placed = Placed::of(body);
        let first = fields.first().filter(|_| starts_with_field);
        let marked = first.and_then(|field| field.marked(body, drawing));
        Self {
            name: plain(&body.description().name),
            generator: provenance::generator(),
            units: UnitFacts::new(body.units()),
            terms,
            view: InitialView::of(drawing, body.dimension() == 2, marked.as_ref()).angles,
            vertices: drawing.vertices(),
            centre: drawing.centre(),
            half: drawing.half(),
            radius: drawing.radius(),
            modes: (0..drawing.modes()).map(|j| mode(body, drawing, j)).collect(),
            interfaces: interfaces(body, drawing),
            centre_of_mass: placed.centre_of_mass,
            principal: placed.principal,
            motion,
            fields: fields.iter().map(|field| field.shown(body, drawing)).collect(),
            starts_with_field,
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

/// Returns vectors in columns (3 x k) in other axes, one after the other.
fn turned(axes: &Matrix3<f64>, vectors: MatRef<'_, f64>) -> Vec<f64> {
    let one = |j: usize| axes * Vector3::from_fn(|k, _| vectors[(k, j)]);
    (0..vectors.ncols()).flat_map(|j| <[f64; 3]>::from(one(j))).collect()
}
