//! Still picture of a body for print and for pages without running scripts: SVG, drawn from back to front.

use super::drawing::Drawing;
use super::field::Field;
use super::initial_view::{InitialView, MarkedPlace};
use super::principal_axes::Placed;
use crate::notation::markup::Plain;
use crate::notation::numbers::significant;
use flexbody_body::flex_body::FlexBody;
use maud::Render;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Largest number of triangles; more make the page larger.
const TRIANGLES: usize = 1800;

/// Size limit for the positions of nodes without a surface, in bytes: some 1500 points.
const MAX_DRAWING_BYTES: usize = 60_000;

/// Size on the page in its own units; the height follows the shape of the part.
const WIDTH: f64 = 560.0;
const MIN_HEIGHT: f64 = 200.0;
const MAX_HEIGHT: f64 = 460.0;
const MARGIN: f64 = 26.0;

/// Length of the principal axes, relative to the radius of the drawing.
const AXIS_LENGTH: f64 = 0.75;

/// Grid steps per page unit for the coordinates of surfaces. A larger value gives finer coordinates and a
/// larger file.
const GRID_STEPS_PER_UNIT: f64 = 5.0;

/// Number of brightness steps of the shading.
const SHADE_COUNT: f64 = 14.0;

/// Colour of the part in full light (red, green, blue).
const PART_COLOUR: [f64; 3] = [185.0, 198.0, 214.0];

/// Returns the picture, coloured by a field with one set of values; `None` if there is nothing to draw.
pub(super) fn still(body: &FlexBody, field: Option<&Field>) -> Option<String> {
    let drawing = Drawing::new(body, Some(TRIANGLES), MAX_DRAWING_BYTES, 0, 0);
    let tones = field.and_then(|field| Tones::of(body, &drawing, field));
    if drawing.vertices() == 0 {
        return None;
    }
    let placed = Placed::of(body);
    let marked = tones.as_ref().map(|tones| &tones.marked);
    let view = Projection::onto_page(&drawing, &placed, body.dimension() == 2, marked)?;
    let content = match &tones {
        Some(_) => "coloured by stress, with its scale, the place of the largest value",
        None => "with its principal axes of inertia 1, 2 and 3 at the centre of mass",
    };
    let mut svg = format!(
        "<svg class=\"still\" viewBox=\"0 0 {WIDTH} {:.0}\" role=\"img\" aria-label=\"The part, undeformed, {content} and the axes of the model in the corner.\">\n",
        view.height
    );
    if drawing.triangle_corners().is_empty() && drawing.edge_ends().is_empty() {
        points(&mut svg, &drawing, &view, tones.as_ref())
    } else {
        surface(&mut svg, &drawing, &view, tones.as_ref())
    }
    if let Some(tones) = &tones {
        tones.mark(&mut svg, &drawing, &view);
        tones.legend(&mut svg, &view);
    } else {
        principal_axes(&mut svg, &placed, &view);
    }
    corner(&mut svg, &view);
    svg.push_str("</svg>\n");
    Some(svg)
}

/// Projection from model coordinates to the page, with the initial view of the moving picture.
struct Projection {
    turn: Matrix3<f64>,
    centre: Vector3<f64>,
    radius: f64,
    scale: f64,
    /// Position on the page of the corner of the box around the part.
    shift: [f64; 2],
    height: f64,
}

impl Projection {
    fn onto_page(
        drawing: &Drawing<'_>,
        placed: &Placed,
        is_plane: bool,
        marked: Option<&MarkedPlace>,
    ) -> Option<Self> {
        let mut own = Self {
            turn: InitialView::of(drawing, is_plane, marked).turn(),
            centre: drawing.centre().into(),
            radius: drawing.radius(),
            scale: 1.0,
            shift: [0.0; 2],
            height: 0.0,
        };
        // Box around the part and its principal axes, as seen by the viewer.
        let axes = placed.principal.map(|axis| placed.axis_end(&axis, AXIS_LENGTH * own.radius));
        let seen: Vec<Vector3<f64>> = drawing.places().iter().chain(&axes).map(|x| own.turned(x)).collect();
        let bound =
            |k: usize, pick: fn(f64, f64) -> f64, from: f64| seen.iter().map(|p| p[k]).fold(from, pick);
        let low = [0, 1].map(|k| bound(k, f64::min, f64::INFINITY));
        let high = [0, 1].map(|k| bound(k, f64::max, f64::NEG_INFINITY));
        let [wide, tall] = [0, 1].map(|k| high[k] - low[k]);
        // Largest scale at which the box fits the page within its margins.
        let inner_size = [WIDTH - 2.0 * MARGIN, MAX_HEIGHT - 2.0 * MARGIN];
        own.scale = (inner_size[0] / wide).min(inner_size[1] / tall);
        own.height = (own.scale * tall + 2.0 * MARGIN).max(MIN_HEIGHT);
        // Centre the box on the page.
        own.shift = [
            0.5 * (WIDTH - own.scale * (low[0] + high[0])),
            0.5 * (own.height + own.scale * (low[1] + high[1])),
        ];
        let numbers = [own.scale, own.height, own.shift[0], own.shift[1]];
        numbers.iter().all(|x| x.is_finite()).then_some(own)
    }

    /// Returns a point relative to the centre of the part, in the axes of the page; the third axis points to
    /// the viewer.
    fn turned(&self, x: &[f64; 3]) -> Vector3<f64> {
        self.turn * (Vector3::from(*x) - self.centre)
    }

    fn at(&self, seen: &Vector3<f64>) -> [f64; 2] {
        [self.shift[0] + self.scale * seen.x, self.shift[1] - self.scale * seen.y]
    }
}

/// A path of the drawing with its depth and paint.
struct PaintedPath {
    depth: f64,
    paint: Paint,
    path: String,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Paint {
    /// Brightness, and the colour of the value.
    Face(u8, Option<u8>),
    Edge,
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // colours are from 0 to 255
/// Draws triangles and edges from back to front; consecutive pieces with the same paint form one path.
fn surface(svg: &mut String, drawing: &Drawing<'_>, view: &Projection, tones: Option<&Tones>) {
    let seen: Vec<Vector3<f64>> = drawing.places().iter().map(|x| view.turned(x)).collect();
    let mut pieces: Vec<PaintedPath> = Vec::new();
    for corners in drawing.triangle_corners() {
        let tone = tones.and_then(|tones| tones.of_triangle(&corners));
        let corners = corners.map(|i| seen[i as usize]);
        let path = path(view, &corners) + "Z";
        let depth = corners.iter().map(|p| p.z).sum::<f64>() / 3.0;
        pieces.push(PaintedPath { depth, paint: Paint::Face(shade(&corners), tone), path });
    }
    for ends in drawing.edge_ends() {
        let ends = ends.map(|i| seen[i as usize]);
        // An edge is drawn slightly in front of its faces, so that they do not cover it.
        let depth = 0.5 * (ends[0].z + ends[1].z) + 0.02 * view.radius;
        pieces.push(PaintedPath { depth, paint: Paint::Edge, path: path(view, &ends) });
    }
    pieces.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    let _ = writeln!(svg, "<g class=\"faces\" transform=\"scale({})\">", 1.0 / GRID_STEPS_PER_UNIT);
    let mut rest = pieces.as_slice();
    while let Some(first) = rest.first() {
        let count = rest.iter().take_while(|piece| piece.paint == first.paint).count();
        let (run, behind) = rest.split_at(count);
        let paths: String = run.iter().map(|piece| piece.path.as_str()).collect();
        let _ = match first.paint {
            Paint::Face(shade, tone) => {
                let light = f64::from(shade) / SHADE_COUNT;
                let colour = tone.map_or(PART_COLOUR, tone_colour);
                let [r, g, b] = colour.map(|part| (part * light).round() as u8);
                writeln!(svg, "<path color=\"#{r:02x}{g:02x}{b:02x}\" d=\"{paths}\"/>")
            }
            Paint::Edge => writeln!(svg, "<path class=\"edge\" d=\"{paths}\"/>"),
        };
        rest = behind;
    }
    svg.push_str("</g>\n");
}

/// Returns an SVG path, `M10 20l5-3`: the first point, then relative steps.
fn path(view: &Projection, points: &[Vector3<f64>]) -> String {
    let mut path = String::new();
    let mut before = [0.0; 2];
    for (i, point) in points.iter().enumerate() {
        let at = view.at(point).map(|x| (GRID_STEPS_PER_UNIT * x).round());
        let [x, y] = [0, 1].map(|k| at[k] - before[k]);
        let _ = match i {
            0 => write!(path, "M{x} {y}l"),
            _ => write!(path, "{}{x} {y}", if i == 1 || x < 0.0 { "" } else { " " }),
        };
        before = at;
    }
    path
}

/// Returns the brightness of a triangle from its angle to the light.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // the value is from 0 to SHADES
fn shade([a, b, c]: &[Vector3<f64>; 3]) -> u8 {
    let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
    let light = Vector3::new(0.25, 0.35, 1.0).normalize();
    ((0.45 + 0.55 * normal.dot(&light).abs()) * SHADE_COUNT).round() as u8
}

/// Draws nodes as points in three layers by depth; points at the back are fainter. Points with values have their colours.
fn points(svg: &mut String, drawing: &Drawing<'_>, view: &Projection, tones: Option<&Tones>) {
    let mut layers: BTreeMap<(usize, Option<u8>), String> = BTreeMap::new();
    for (vertex, place) in drawing.places().iter().enumerate() {
        let seen = view.turned(place);
        let layer = match seen.z / view.radius {
            depth if depth < -0.25 => 0,
            depth if depth < 0.25 => 1,
            _ => 2,
        };
        let [x, y] = view.at(&seen);
        let tone = tones.and_then(|tones| tones.of_vertex(vertex));
        let _ = write!(layers.entry((layer, tone)).or_default(), "M{x:.1} {y:.1}h0");
    }
    let size = if drawing.vertices() > 400 { 2.2 } else { 4.0 };
    for ((layer, tone), path) in layers {
        let colour = tone.map_or_else(String::new, |tone| format!(" style=\"stroke:{}\"", hex(tone)));
        let _ = writeln!(svg, "<path class=\"node n{layer}\" stroke-width=\"{size}\"{colour} d=\"{path}\"/>");
    }
}

// Colours of values.

/// Number of colours of a still picture.
const TONES: f64 = 20.0;

/// Length of the scale of colours on the page.
const SCALE_LENGTH: f64 = 130.0;

/// Colours of the vertices of a still picture.
struct Tones {
    /// Value of each vertex relative to the largest; `None` without a value.
    levels: Vec<Option<f64>>,
    /// Largest value with its unit.
    largest: String,
    /// Place of the largest value.
    marked: MarkedPlace,
}

impl Tones {
    fn of(body: &FlexBody, drawing: &Drawing<'_>, field: &Field) -> Option<Self> {
        let (values, unit, node) = field.single()?;
        let largest = values[node];
        let level = |value: f64| if largest > 0.0 { value / largest } else { 0.0 };
        let of_node = |&node: &u32| Some(values[node as usize]).filter(|value| !value.is_nan()).map(level);
        Some(Self {
            levels: drawing.nodes().iter().map(of_node).collect(),
            largest: format!("{} {unit}", significant(largest, 4)),
            marked: field.marked(body, drawing)?,
        })
    }

    fn of_vertex(&self, vertex: usize) -> Option<u8> {
        self.levels[vertex].map(tone)
    }

    /// Returns the colour of the mean of three values; `None` unless all are known.
    fn of_triangle(&self, corners: &[u32; 3]) -> Option<u8> {
        let [a, b, c] = corners.map(|vertex| self.levels[vertex as usize]);
        Some(tone((a? + b? + c?) / 3.0))
    }

    /// Marks the largest value by a ring, which is dashed and labelled where the surface hides its place.
    fn mark(&self, svg: &mut String, drawing: &Drawing<'_>, view: &Projection) {
        let [x, y] = view.at(&view.turned(&self.marked.position));
        let is_hidden = self.marked.is_hidden(drawing, &view.turn);
        let class = if is_hidden { "largest behind" } else { "largest" };
        let _ = writeln!(svg, "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"6\"/>");
        if is_hidden {
            let (x, y) = (x + 10.0, y + 4.0);
            let _ = writeln!(svg, "<text class=\"model\" x=\"{x:.1}\" y=\"{y:.1}\">behind</text>");
        }
    }

    /// Draws the scale of the colours.
    fn legend(&self, svg: &mut String, view: &Projection) {
        let (from, top) = (WIDTH - SCALE_LENGTH - MARGIN, view.height - MARGIN);
        let width = SCALE_LENGTH / (TONES + 1.0);
        for k in 0..=(TONES as u8) {
            let (left, colour) = (from + width * f64::from(k), hex(k));
            let _ = write!(
                svg,
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"8\" fill=\"{colour}\"/>",
                width + 0.3
            );
        }
        let text = |svg: &mut String, x: f64, anchor: &str, text: &str| {
            let text = Plain(text).render().into_string();
            let _ = writeln!(
                svg,
                "<text class=\"model\" x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{text}</text>",
                top - 5.0
            );
        };
        text(svg, from, "start", "0");
        text(svg, from + SCALE_LENGTH, "end", &self.largest);
    }
}

/// Returns the number of the colour of a value from 0 to 1.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // clamped to the range
fn tone(level: f64) -> u8 {
    (level * TONES).round().clamp(0.0, TONES) as u8
}

/// Polynomials of the colours of the page, which are close to those of `viridis` (van der Walt and Smith, CC0): red,
/// green, blue, by ascending powers.
const COLOURS: [[f64; 7]; 3] = [
    [0.278, 0.105, -0.331, -4.634, 6.228, 4.776, -5.435],
    [0.005, 1.404, 0.215, -5.799, 14.18, -13.745, 4.646],
    [0.334, 1.385, 0.095, -19.332, 56.691, -65.353, 26.312],
];

/// Returns a colour by its number (red, green, blue, to 255).
fn tone_colour(tone: u8) -> [f64; 3] {
    let t = f64::from(tone) / TONES;
    COLOURS.map(|p| 255.0 * p.iter().rev().fold(0.0, |sum, a| sum * t + a).clamp(0.0, 1.0))
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // colours are from 0 to 255
fn hex(tone: u8) -> String {
    let [r, g, b] = tone_colour(tone).map(|part| part.round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn principal_axes(svg: &mut String, placed: &Placed, view: &Projection) {
    let from = view.at(&view.turned(&placed.centre_of_mass));
    for (k, axis) in placed.principal.iter().enumerate() {
        let end = placed.axis_end(axis, AXIS_LENGTH * view.radius);
        arrow(svg, &format!("a{k}"), &(k + 1).to_string(), from, view.at(&view.turned(&end)));
    }
}

/// Draws the axes of the model in a corner.
fn corner(svg: &mut String, view: &Projection) {
    let from = [34.0, view.height - 34.0];
    for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
        let axis = view.turn.column(k);
        arrow(svg, "model", name, from, [from[0] + 24.0 * axis[0], from[1] - 24.0 * axis[1]]);
    }
}

/// Draws a line with its name at the end.
fn arrow(svg: &mut String, class: &str, name: &str, [x, y]: [f64; 2], [to_x, to_y]: [f64; 2]) {
    let away = |from: f64, to: f64| if (to - from).abs() < 1.0 { 0.0 } else { 9.0 * (to - from).signum() };
    let (near, below) = (to_x + away(x, to_x), to_y + 0.6 * away(y, to_y) + 4.0);
    let _ = writeln!(
        svg,
        "<line class=\"axis {class}\" x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{to_x:.1}\" y2=\"{to_y:.1}\"/><text class=\"{class}\" x=\"{near:.1}\" y=\"{below:.1}\" text-anchor=\"middle\">{name}</text>"
    );
}
