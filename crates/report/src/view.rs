//! Page that shows a body in motion by WebGL: one file with all its data. All quantities are computed here;
//! the script of the page only rotates and animates them.

use crate::document::{Format, json};
use crate::notation::markup::{Plain, plain};
use crate::notation::numbers::{bytes, counted, significant};
use crate::notation::units::UnitFacts;
use crate::picture::{Drawing, Field, Fields, HALF_STEP, Packed, SCRIPT, ShownBody, script};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_file::RecordedMotion;
use flexbody_motion::scene::Envelope;
use maud::Render;
use serde::Serialize;

const PAGE: &str = include_str!("view/page.html");
const STYLE: &str = include_str!("view/view.css");

/// Size limit of positions, shapes and mesh in a page, in bytes. With the motion of a simulation and the
/// script a page stays below 10 MB.
const MAX_DRAWING_BYTES: usize = 7_000_000;

/// Facts and markup of a page.
#[derive(Debug, Clone)]
pub struct View {
    facts: ViewFacts,
    page: String,
}

/// Contents of a page, for terminals and programs.
#[derive(Debug, Clone, Serialize)]
struct ViewFacts {
    model: String,
    modes: usize,
    /// Kind of drawing: `surface`, `lines` or `points`.
    drawn: &'static str,
    nodes: usize,
    drawn_nodes: usize,
    triangles: usize,
    edges: usize,
    /// Half a step of the 16-bit positions. Unit: length.
    position_error: f64,
    /// Half a step of the 16-bit shapes, relative to the largest component of each mode.
    shape_error: f64,
    /// Number of simulated times in the page; `None` without a simulation.
    instants: Option<usize>,
    /// Stresses that colour the body.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    colours: Vec<String>,
    /// Recoveries that cannot be drawn, with reasons.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    not_drawn: Vec<String>,
    bytes: usize,
}

/// Stresses that colour the body in a page.
#[derive(Debug, Clone, Copy)]
pub enum Colouring<'a> {
    /// Equivalent stresses of the modes in the recovery of this name.
    Recovery(&'a str),
    /// Largest equivalent stresses of a motion.
    Envelope(&'a Envelope),
}

impl Colouring<'_> {
    /// Returns the values of the page.
    ///
    /// # Errors
    /// [`RecoveryUnknown`](Code::RecoveryUnknown) for a recovery that the body does not have, and for recoveries of which
    /// none can be drawn.
    fn fields(self, body: &FlexBody) -> Result<Fields> {
        let refuse = |message: String, help: String| {
            Err(Diagnostic::new(Code::RecoveryUnknown, message).with_help(help).into())
        };
        match self {
            Self::Recovery(name) => {
                let Some(recovery) = body.recoveries().iter().find(|recovery| recovery.name == name) else {
                    let known: Vec<&str> =
                        body.recoveries().iter().map(|recovery| recovery.name.as_str()).collect();
                    let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
                    return refuse(
                        format!("the body has no recovery `{name}`"),
                        format!("name one of its recoveries: {known}"),
                    );
                };
                match Field::of_modes(body, recovery, body.n_modes()) {
                    Ok(field) => Ok(Fields { drawn: vec![field], ..Fields::default() }),
                    Err(reason) => refuse(
                        format!("recovery `{name}` cannot be drawn: {reason}"),
                        "name a recovery with the six stresses of nodes".to_owned(),
                    ),
                }
            }
            Self::Envelope(envelope) => {
                let scope = match envelope.cases.len() {
                    0 => "the run".to_owned(),
                    count => counted(count, "load case"),
                };
                let fields = Fields::of_envelopes(body, &[(scope, envelope)]);
                if fields.drawn.is_empty() {
                    return refuse(
                        format!("no stresses can be drawn: {}", fields.left_out.join("; ")),
                        "give the largest stresses of nodes of this body".to_owned(),
                    );
                }
                Ok(fields)
            }
        }
    }
}

impl View {
    /// Builds the page of `body` with at most `triangles` triangles or, without a number, as many as keep the
    /// page below 10 MB. With a `motion` the page plays the simulation instead of the modes. The largest stresses of a
    /// motion without this motion colour the body at rest.
    ///
    /// # Errors
    /// FB735 if the motion belongs to another body; FB221 for stresses that cannot be drawn, and for stresses of the modes
    /// in a simulation; the errors of [`FlexBody::carried`].
    pub fn new(
        body: &FlexBody,
        triangles: Option<usize>,
        motion: Option<&RecordedMotion>,
        colouring: Option<Colouring<'_>>,
    ) -> Result<Self> {
        if let (Some(_), Some(Colouring::Recovery(name))) = (motion, colouring) {
            let message = format!("recovery `{name}` colours modes, and a simulation has none");
            let help = "draw the largest stresses of the simulation: simulate --envelope FILE.csv, then view --envelope FILE.csv";
            return Err(Diagnostic::new(Code::RecoveryUnknown, message).with_help(help).into());
        }
        let fields = colouring.map(|colouring| colouring.fields(body)).transpose()?.unwrap_or_default();
        let body_in_frame = motion.map(|motion| motion.body_in_frame(body)).transpose()?;
        let body = body_in_frame.as_ref().unwrap_or(body);
        let is_still = motion.is_none() && matches!(colouring, Some(Colouring::Envelope(_)));
        let modes = if is_still { 0 } else { usize::MAX };
        let drawing = Drawing::new(body, triangles, MAX_DRAWING_BYTES, modes, fields.sets());
        let shown = motion.map(|motion| ShownMotion::new(motion, body));
        let mut arrays = drawing.arrays(fields.array(&drawing));
        arrays.extend(shown.iter().flat_map(ShownMotion::arrays));
        let entries = terms(body, &drawing, &fields, shown.as_ref());
        let data =
            ShownBody::new(body, &drawing, &fields.drawn, entries, shown.as_ref(), colouring.is_some());
        let mut facts = ViewFacts {
            model: body.description().name.clone(),
            modes: if is_still { 0 } else { body.n_modes() },
            drawn: drawing.kind(),
            nodes: body.n_nodes(),
            drawn_nodes: drawing.vertices(),
            triangles: drawing.triangles(),
            edges: drawing.edges(),
            position_error: drawing.position_error(),
            shape_error: HALF_STEP,
            instants: shown.as_ref().map(ShownMotion::instants),
            colours: fields.drawn.iter().map(|field| field.label().to_owned()).collect(),
            not_drawn: fields.left_out.clone(),
            bytes: 0,
        };
        let page = page(&facts.model, &data, &arrays);
        facts.bytes = page.len();
        Ok(Self { facts, page })
    }

    /// Returns the HTML of the page.
    pub fn html(&self) -> &str {
        &self.page
    }

    /// Renders the facts of the drawing.
    pub fn render(&self, format: Format) -> String {
        match format {
            Format::Json => json(&self.facts),
            Format::Html => self.page.clone(),
            Format::Text | Format::Terminal => self.facts.text(),
        }
    }
}

impl ViewFacts {
    fn text(&self) -> String {
        let what = match self.drawn {
            "surface" => format!("{} of the surface", counted(self.triangles, "triangle")),
            "lines" => counted(self.edges, "line"),
            _ => "points".to_owned(),
        };
        let moving = match self.instants {
            Some(instants) => format!("a simulation of {}", counted(instants, "instant")),
            None if self.modes == 0 && !self.colours.is_empty() => "at rest".to_owned(),
            None => counted(self.modes, "mode"),
        };
        let colours = self.colours.iter().map(|label| format!("colours: {}\n", plain(label)));
        let left_out = self.not_drawn.iter().map(|reason| plain(reason) + "\n");
        let more: String = colours.chain(left_out).collect();
        format!(
            "{}: {what} on {} of {}, {moving}, {}\n{more}",
            plain(&self.model),
            self.drawn_nodes,
            counted(self.nodes, "node"),
            bytes(self.bytes as u64)
        )
    }
}

/// Returns names and values for the list beside the picture of the body.
fn terms(
    body: &FlexBody,
    drawing: &Drawing<'_>,
    fields: &Fields,
    motion: Option<&ShownMotion>,
) -> Vec<(&'static str, String)> {
    let units = UnitFacts::new(body.units());
    let drawn = match drawing.vertices() {
        all if all == body.n_nodes() => format!("all {}", counted(all, "node")),
        some => format!("{some} of {}", counted(body.n_nodes(), "node")),
    };
    let mut terms = vec![
        ("Mass", format!("{} {}", significant(body.invariants().mass(), 6), units.mass())),
        ("Drawn", drawn),
        ("Surface", drawing.in_words()),
        (
            "Rounded",
            format!(
                "places to {} {}, shapes to 1/65534 of the largest of each mode",
                significant(drawing.position_error(), 2),
                units.length()
            ),
        ),
    ];
    let words = fields.drawn.iter().filter_map(Field::in_words).chain(fields.left_out.iter().cloned());
    terms.extend(words.map(|words| ("Stresses", plain(&words))));
    if let Some(motion) = motion {
        terms.push(("Scene", plain(motion.scene())));
        terms.push(("Instants", motion.in_words()));
    }
    terms
}

/// Renders the whole page.
fn page(title: &str, data: &ShownBody<'_, ShownMotion>, arrays: &[Packed]) -> String {
    let facts = data.json();
    let title = Plain(title).render().into_string();
    let arrays: String = arrays.iter().map(script).collect();
    let parts =
        [("STYLE", STYLE), ("SCRIPT", SCRIPT), ("TITLE", &title), ("FACTS", &facts), ("ARRAYS", &arrays)];
    let mut page =
        String::with_capacity(PAGE.len() + STYLE.len() + SCRIPT.len() + facts.len() + arrays.len());
    let mut rest = PAGE;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, behind) = after.split_once("}}").unwrap_or((after, ""));
        page.push_str(before);
        page.push_str(parts.iter().find(|(own, _)| *own == name).map_or("", |(_, text)| text));
        rest = behind;
    }
    page + rest
}

// Motion of a simulation for playback in a page.

/// Largest count of numbers for all output times of a page; a longer recording is thinned to equal steps.
const MAX_NUMBERS: usize = 400_000;

/// Output times of a motion.
#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "camelCase")]
struct ShownMotion {
    scene: String,
    /// Origin of the frame in model coordinates.
    origin_in_model: [f64; 3],
    /// Largest deflection. Unit: length.
    largest: f64,
    /// Centre of the box around the path of the origin; `reach` is the largest distance of the path from it.
    middle: [f64; 3],
    reach: f64,
    #[serde(skip)]
    written: usize,
    #[serde(skip)]
    time: Vec<f64>,
    #[serde(skip)]
    q: Vec<f64>,
    #[serde(skip)]
    origins: Vec<f64>,
    #[serde(skip)]
    attitudes: Vec<f64>,
}

impl ShownMotion {
    /// Collects the output times of a motion, or some at equal steps including the first and the last.
    fn new(motion: &RecordedMotion, body: &FlexBody) -> Self {
        let written = motion.time.len();
        let chosen = motion.some_instants(MAX_NUMBERS / (8 + motion.modes));
        let some = |of: &[f64], width: usize| -> Vec<f64> {
            chosen.iter().flat_map(|&i| &of[i * width..(i + 1) * width]).copied().collect()
        };
        // Box around the path of the origin, and the largest distance of the path from its centre.
        let origins = some(&motion.origins, 3);
        let bound = |k: usize, pick: fn(f64, f64) -> f64, start: f64| {
            origins.iter().skip(k).step_by(3).copied().fold(start, pick)
        };
        let middle = [0, 1, 2]
            .map(|k| 0.5 * (bound(k, f64::min, f64::INFINITY) + bound(k, f64::max, f64::NEG_INFINITY)));
        let middle = middle.map(|x| if x.is_finite() { x } else { 0.0 });
        let distance = |x: &[f64; 3]| (0..3).map(|k| (x[k] - middle[k]).powi(2)).sum::<f64>().sqrt();
        let reach = origins.as_chunks::<3>().0.iter().map(distance).fold(0.0, f64::max);
        Self {
            scene: motion.scene.clone(),
            origin_in_model: motion.origin_in_model,
            largest: motion.largest_deflection * body.extent(),
            middle,
            reach,
            written,
            time: some(&motion.time, 1),
            q: some(&motion.q, motion.modes),
            attitudes: some(&motion.attitudes, 4),
            origins,
        }
    }

    fn arrays(&self) -> Vec<Packed> {
        vec![
            Packed::f32("times", &self.time),
            Packed::f32("q", &self.q),
            Packed::f32("origins", &self.origins),
            Packed::f32("attitudes", &self.attitudes),
        ]
    }

    fn instants(&self) -> usize {
        self.time.len()
    }

    fn scene(&self) -> &str {
        &self.scene
    }

    /// Returns the number of times: `2000 of 100000 instants`.
    fn in_words(&self) -> String {
        if self.written == self.time.len() {
            self.written.to_string()
        } else {
            format!("{} of {}", self.time.len(), counted(self.written, "instant"))
        }
    }
}
