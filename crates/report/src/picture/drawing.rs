//! Drawn parts of a body: its surface, with fewer triangles if it is large, or its nodes as points.

use super::{Field, InitialView, MarkedPlace, Packed, Placed};
use crate::notation::markup::Plain;
use crate::notation::numbers::{counted, significant};
use faer::MatRef;
use flexbody_body::flex_body::{FlexBody, SurfaceMesh};
use maud::Render;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Half a step of a 16-bit number, relative to the largest.
#[cfg(feature = "hdf5")]
pub(crate) const HALF_STEP: f64 = 0.5 / STEPS;
/// Number of steps of a 16-bit number from zero to the largest.
const STEPS: f64 = 32767.0;

/// Smallest number of drawn nodes. Fewer nodes show no recognisable shape, however many modes share the page.
const MIN_NODES: usize = 300;

/// Nodes and triangles that a page draws.
pub(crate) struct Drawing<'b> {
    body: &'b FlexBody,
    mesh: Option<SurfaceMesh>,
    /// Drawn nodes, ascending.
    nodes: Vec<u32>,
    /// Positions of the drawn nodes in model coordinates. Unit: length.
    places: Vec<[f64; 3]>,
    /// Centre of the box around the drawn nodes. Unit: length.
    centre: Vector3<f64>,
    /// Half the largest extent of the box. Unit: length.
    half: f64,
    /// Largest component and largest displacement of each mode at the drawn nodes.
    sizes: Vec<[f64; 2]>,
}

impl<'b> Drawing<'b> {
    /// Builds the drawing of a body with at most `triangles` triangles or, without a number, as many as
    /// `max_bytes` bytes of text hold together with at most the first `modes` modes and `sets` sets of values.
    pub(crate) fn new(
        body: &'b FlexBody,
        triangles: Option<usize>,
        max_bytes: usize,
        modes: usize,
        sets: usize,
    ) -> Self {
        let modes = modes.min(body.n_modes());
        // A node needs six bytes for its position and six for each shape, two for each value, plus two
        // triangles; base64 writes three bytes as four letters.
        let most = (max_bytes / (8 + 8 * modes + 3 * sets + 32)).max(MIN_NODES);
        let positions = &body.nodes().positions;
        let mesh = body.mesh().and_then(|mesh| mesh.decimated(positions, triangles.unwrap_or(2 * most)));
        let nodes = match &mesh {
            Some(mesh) => mesh.drawn_nodes(),
            None => evenly(body.n_nodes(), most),
        };
        let frame = body.frame();
        let places: Vec<[f64; 3]> =
            nodes.iter().map(|&node| frame.to_model(positions[node as usize])).collect();
        let bound = |pick: fn(f64, f64) -> f64| {
            let first = places.first().copied().unwrap_or_default();
            Vector3::from(places.iter().fold(first, |own, x| [0, 1, 2].map(|k| pick(own[k], x[k]))))
        };
        let (low, high) = (bound(f64::min), bound(f64::max));
        let mut own = Self {
            body,
            mesh,
            nodes,
            places,
            centre: 0.5 * (low + high),
            half: (0.5 * (high - low)).amax(),
            sizes: Vec::new(),
        };
        own.sizes = (0..modes).map(|j| own.size(j)).collect();
        own
    }

    /// Returns the displacement of a drawn node in a mode, in body axes.
    fn displacement(&self, node: u32, j: usize) -> Vector3<f64> {
        let shape = &self.body.modes().shape;
        Vector3::from_fn(|k, _| shape[(3 * node as usize + k, j)])
    }

    fn size(&self, j: usize) -> [f64; 2] {
        let axes = &self.body.frame().axes;
        let larger = |own: [f64; 2], &node: &u32| {
            let u = axes * self.displacement(node, j);
            [own[0].max(u.amax()), own[1].max(u.norm())]
        };
        self.nodes.iter().fold([0.0; 2], larger)
    }

    /// Returns positions, shapes, values, triangles and edges in the form that the page reads.
    pub(crate) fn arrays(&self, fields: &[Field]) -> Vec<Packed> {
        let axes = self.body.frame().axes;
        let half = if self.half > 0.0 { self.half } else { 1.0 };
        let places = self.places.iter().map(|x| (Vector3::from(*x) - self.centre) / half);
        let shapes = (0..self.sizes.len()).flat_map(|j| {
            let scale = if self.sizes[j][0] > 0.0 { self.sizes[j][0] } else { 1.0 };
            self.nodes.iter().map(move |&node| axes * self.displacement(node, j) / scale)
        });
        let mut arrays = vec![
            Packed::i16("positions", places.flat_map(in_steps)),
            Packed::i16("shapes", shapes.flat_map(in_steps)),
        ];
        if !fields.is_empty() {
            arrays.push(Packed::i16("values", fields.iter().flat_map(|field| field.packed(self))));
        }
        if let Some(mesh) = &self.mesh {
            let own =
                |nodes: &[u32]| nodes.iter().filter_map(|&i| self.vertex(i as usize)).collect::<Vec<_>>();
            let parts =
                [("triangles", mesh.triangles().as_flattened()), ("edges", mesh.edges().as_flattened())];
            arrays.extend(parts.map(|(name, nodes)| Packed::indices(name, self.nodes.len(), &own(nodes))));
        }
        arrays
    }

    /// Returns the drawn nodes, ascending.
    pub(crate) fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Returns the number of modes in the drawing.
    pub(crate) fn modes(&self) -> usize {
        self.sizes.len()
    }

    /// Returns the positions of the vertices in model coordinates.
    pub(crate) fn places(&self) -> &[[f64; 3]] {
        &self.places
    }

    /// Returns the vertices of every triangle.
    pub(super) fn triangle_corners(&self) -> Vec<[u32; 3]> {
        let triangles = self.mesh.iter().flat_map(SurfaceMesh::triangles);
        triangles.filter_map(|nodes| self.vertices_of(nodes)).collect()
    }

    /// Returns the vertices of every edge.
    fn edge_ends(&self) -> Vec<[u32; 2]> {
        let edges = self.mesh.iter().flat_map(SurfaceMesh::edges);
        edges.filter_map(|nodes| self.vertices_of(nodes)).collect()
    }

    fn vertices_of<const N: usize>(&self, nodes: &[u32; N]) -> Option<[u32; N]> {
        let mut own = [0; N];
        for (vertex, &node) in own.iter_mut().zip(nodes) {
            *vertex = self.vertex(node as usize)?;
        }
        Some(own)
    }

    /// Returns the vertex of the page that draws a node of the body; `None` if the node is not drawn.
    pub(crate) fn vertex(&self, node: usize) -> Option<u32> {
        let node = u32::try_from(node).ok()?;
        self.nodes.binary_search(&node).ok().and_then(|at| u32::try_from(at).ok())
    }

    pub(crate) fn vertices(&self) -> usize {
        self.nodes.len()
    }

    pub(crate) fn triangles(&self) -> usize {
        self.mesh.as_ref().map_or(0, |mesh| mesh.triangles().len())
    }

    pub(crate) fn edges(&self) -> usize {
        self.mesh.as_ref().map_or(0, |mesh| mesh.edges().len())
    }

    /// Returns the kind of drawing: `surface`, `lines` or `points`.
    pub(crate) fn kind(&self) -> &'static str {
        match (self.triangles(), self.edges()) {
            (0, 0) => "points",
            (0, _) => "lines",
            _ => "surface",
        }
    }

    /// Returns the size of the drawing: `1200 triangles, thinned from 4000`.
    pub(crate) fn in_words(&self) -> String {
        let all = self.body.mesh().map_or(0, |mesh| mesh.triangles().len());
        match self.kind() {
            "points" => "not in the file: nodes are drawn as points".to_owned(),
            "lines" => counted(self.edges(), "line"),
            _ if self.triangles() < all => {
                format!("{}, thinned from {all}", counted(self.triangles(), "triangle"))
            }
            _ => counted(all, "triangle"),
        }
    }

    pub(crate) fn centre(&self) -> [f64; 3] {
        self.centre.into()
    }

    /// Returns the length that the integer 32767 stands for in the positions. Unit: length.
    pub(crate) fn half(&self) -> f64 {
        self.half
    }

    /// Returns the largest distance of a drawn node from the centre; 1 for a single node.
    pub(crate) fn radius(&self) -> f64 {
        let distance = |x: &[f64; 3]| (Vector3::from(*x) - self.centre).norm();
        let radius = self.places.iter().map(distance).fold(0.0, f64::max);
        if radius > 0.0 { radius } else { 1.0 }
    }

    /// Returns the component of the shape of mode `j` that the integer 32767 stands for.
    pub(crate) fn scale(&self, j: usize) -> f64 {
        self.sizes[j][0]
    }

    /// Returns the largest displacement of a drawn node in mode `j`.
    pub(crate) fn largest(&self, j: usize) -> f64 {
        self.sizes[j][1]
    }

    /// Returns the largest rounding error of the drawn position of a node along an axis.
    #[cfg(feature = "hdf5")]
    pub(crate) fn position_error(&self) -> f64 {
        self.half * HALF_STEP
    }
}

/// Rounds numbers from -1 to 1 to 16-bit integers.
#[allow(clippy::cast_possible_truncation)] // values are clamped to the range
fn in_steps(x: Vector3<f64>) -> [i16; 3] {
    [x.x, x.y, x.z].map(|x| (x * STEPS).round().clamp(-STEPS, STEPS) as i16)
}

/// Returns at most `most` equally spaced indices below `n`.
fn evenly(n: usize, most: usize) -> Vec<u32> {
    let count = n.min(most);
    (0..count).filter_map(|i| u32::try_from(i as u128 * n as u128 / count as u128).ok()).collect()
}

/// Returns vectors in columns (3 x k) in other axes, one after the other.
pub(super) fn turned(axes: &Matrix3<f64>, vectors: MatRef<'_, f64>) -> Vec<f64> {
    let one = |j: usize| axes * Vector3::from_fn(|k, _| vectors[(k, j)]);
    (0..vectors.ncols()).flat_map(|j| <[f64; 3]>::from(one(j))).collect()
}

// Still picture of a body for print and for pages without running scripts: SVG, drawn from back to front.

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
pub(crate) fn still(body: &FlexBody, field: Option<&Field>) -> Option<String> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_of_many_nodes_are_spread_over_all() {
        assert_eq!(evenly(10, 4), [0, 2, 5, 7]);
        assert_eq!(evenly(3, 300), [0, 1, 2]);
        assert_eq!(evenly(0, 300), [] as [u32; 0]);
    }

    #[test]
    fn steps_round_to_the_nearest() {
        let x = Vector3::new(1.0, -1.0, 0.4 / STEPS);
        assert_eq!(in_steps(x), [32767, -32767, 0]);
    }
}
