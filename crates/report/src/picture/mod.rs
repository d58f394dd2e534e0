//! Pictures of a body: selection of the drawn parts, data and script of an interactive picture, and a still
//! picture.

mod drawing;
mod field;
mod initial_view;

use crate::mass_properties::{centre_of_mass, inertia_about_com};
use crate::notation::markup::{Plain, plain};
use crate::notation::numbers::{counted, frequency};
use crate::notation::units::UnitFacts;
use drawing::{still, turned};
use field::ShownField;
use flexbody_base::provenance;
use flexbody_body::flex_body::{FlexBody, Interface, is_static};
use flexbody_body::invariants::principal_axes;
use maud::Render;
use serde::Serialize;

pub(super) use drawing::Drawing;
#[cfg(feature = "hdf5")]
pub(super) use drawing::HALF_STEP;
pub(super) use field::{Field, Fields};
use initial_view::{InitialView, MarkedPlace};

// Picture of a body in a report: an interactive drawing of its modes if scripts run, otherwise (and on
// paper) a still picture.

const PANEL: &str = include_str!("panel.html");

/// Size limit of positions, shapes and mesh in a report, in bytes; the report then stays below 4 MB.
const MAX_DRAWING_BYTES: usize = 2_600_000;
/// Largest number of modes that a report animates.
const MODES: usize = 60;

/// Parts of a report that draw its body.
pub(super) struct Embedded {
    /// Element with the picture.
    pub panel: String,
    /// Elements for the end of the page: data and script.
    pub scripts: String,
}

impl Embedded {
    /// Builds the picture of the modes of a body, which stresses may colour; `None` for a body without anything to draw.
    pub(crate) fn of_modes(body: &FlexBody) -> Option<Self> {
        let fields = Fields::of_modes(body, MODES);
        let drawing = Drawing::new(body, None, MAX_DRAWING_BYTES, MODES, fields.sets());
        Self::of(body, &drawing, &fields)
    }

    /// Builds the picture of a body at rest in the colours of `fields`; `None` for a body without anything to draw.
    pub(crate) fn of_fields(body: &FlexBody, fields: &Fields) -> Option<Self> {
        let drawing = Drawing::new(body, None, MAX_DRAWING_BYTES, 0, fields.sets());
        Self::of(body, &drawing, fields)
    }

    fn of(body: &FlexBody, drawing: &Drawing<'_>, fields: &Fields) -> Option<Self> {
        let still = still(body, fields.drawn.first())?;
        let shown =
            ShownBody::<()>::new(body, drawing, &fields.drawn, Vec::new(), None, drawing.modes() == 0);
        let arrays: String = drawing.arrays(&fields.drawn).iter().map(script).collect();
        let words = Plain(&drawn(body, drawing, fields)).render().into_string();
        let panel = PANEL.replace("{{STILL}}", &still).replace("{{DRAWN}}", &words);
        if drawing.modes() == 0 && fields.drawn.is_empty() {
            return Some(Self { panel, scripts: String::new() });
        }
        let scripts = format!(
            "<script type=\"application/json\" id=\"data\">{}</script>\n{arrays}<script>\n{SCRIPT}</script>\n",
            shown.json()
        );
        Some(Self { panel, scripts })
    }
}

/// Returns the drawn and the omitted parts in words.
fn drawn(body: &FlexBody, drawing: &Drawing<'_>, fields: &Fields) -> String {
    let mut words = vec![match drawing.kind() {
        "points" => "nodes as points, since the file has no surface".to_owned(),
        _ => drawing.in_words(),
    }];
    if drawing.vertices() < body.n_nodes() {
        words.push(format!("{} of {}", drawing.vertices(), counted(body.n_nodes(), "node")));
    }
    if (1..body.n_modes()).contains(&drawing.modes()) {
        words.push(format!("the first {} of {}", drawing.modes(), counted(body.n_modes(), "mode")));
    }
    words.extend(fields.left_out.iter().cloned());
    if drawing.modes() > 0 || fields.drawn.is_empty() {
        words.push("the axes 1, 2, 3 are principal axes of inertia, moments ascending".to_owned());
    }
    words.join("; ")
}

// Data of a body for the script of a page: names, positions, modes and interfaces.

/// Script that draws a body in a page from the data of the page.
pub(super) const SCRIPT: &str = include_str!("view.js");

/// Centre of mass and principal axes, in model axes.
struct Placed {
    pub centre_of_mass: [f64; 3],
    /// Principal axes, by ascending moments.
    pub principal: [[f64; 3]; 3],
}

impl Placed {
    fn of(body: &FlexBody) -> Self {
        let (frame, invariants) = (body.frame(), body.invariants());
        let axes = frame.axes * principal_axes(&inertia_about_com(invariants));
        Self {
            centre_of_mass: frame.to_model(centre_of_mass(invariants).into()),
            principal: [0, 1, 2].map(|k| axes.column(k).into_owned().into()),
        }
    }

    /// Returns the end of an axis of the given length from the centre of mass.
    fn axis_end(&self, axis: &[f64; 3], length: f64) -> [f64; 3] {
        [0, 1, 2].map(|k| self.centre_of_mass[k] + length * axis[k])
    }
}

/// Texts and scalar data of a page for its script. Positions are in model axes.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct ShownBody<'a, M> {
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
            name: plain(&body.source().name),
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

// Arrays of numbers as elements of a page: little-endian bytes in base64.

/// A named array.
#[derive(Debug, Clone)]
pub(super) struct Packed {
    name: &'static str,
    base64: String,
}

impl Packed {
    pub(crate) fn i16(name: &'static str, values: impl Iterator<Item = i16>) -> Self {
        Self::of_bytes(name, &values.flat_map(i16::to_le_bytes).collect::<Vec<u8>>())
    }

    /// Packs vertex indices as 16-bit integers if `vertices` is small enough, otherwise as 32-bit integers.
    pub(crate) fn indices(name: &'static str, vertices: usize, values: &[u32]) -> Self {
        let bytes: Vec<u8> = if vertices > usize::from(u16::MAX) {
            values.iter().flat_map(|value| value.to_le_bytes()).collect()
        } else {
            values.iter().flat_map(|value| value.to_le_bytes()[..2].to_vec()).collect()
        };
        Self::of_bytes(name, &bytes)
    }

    #[allow(clippy::cast_possible_truncation)] // 32 bits are enough for a picture
    #[cfg(feature = "hdf5")]
    pub(crate) fn f32(name: &'static str, values: &[f64]) -> Self {
        let bytes: Vec<u8> = values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
        Self::of_bytes(name, &bytes)
    }

    fn of_bytes(name: &'static str, bytes: &[u8]) -> Self {
        Self { name, base64: base64(bytes) }
    }
}

/// Returns the element of the page that holds an array.
pub(super) fn script(array: &Packed) -> String {
    format!("<script type=\"text/plain\" id=\"data-{}\">{}</script>\n", array.name, array.base64)
}

/// Returns bytes as base64 (RFC 4648, section 4).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let byte = |k: usize| u32::from(group.get(k).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for k in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * k)) as usize & 63];
            text.push(if k <= group.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        for (bytes, text) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
        ] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xfe]), "+//+");
    }

    #[test]
    fn indices_have_sixteen_bits_where_these_are_enough() {
        assert_eq!(Packed::indices("", 65535, &[0x0102]).base64, base64(&[2, 1]));
        assert_eq!(Packed::indices("", 65536, &[0x0102]).base64, base64(&[2, 1, 0, 0]));
    }
}
