//! Picture of a body in a report: an interactive drawing of its modes if scripts run, otherwise (and on
//! paper) a still picture.

use super::drawing::Drawing;
use super::field::Fields;
use super::packed::script;
use super::shown_body::{SCRIPT, ShownBody};
use super::still::still;
use crate::notation::markup::Plain;
use crate::notation::numbers::counted;
use flexbody_body::flex_body::FlexBody;
use maud::Render;

/// Style of the element with the picture.
pub(crate) const EMBEDDED_STYLE: &str = include_str!("embedded.css");

const PANEL: &str = include_str!("panel.html");

/// Size limit of positions, shapes and mesh in a report, in bytes; the report then stays below 4 MB.
const MAX_DRAWING_BYTES: usize = 2_600_000;

/// Largest number of modes that a report animates.
const MODES: usize = 60;

/// Parts of a report that draw its body.
pub(crate) struct Embedded {
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
        let arrays: String = drawing.arrays(fields.array(drawing)).iter().map(script).collect();
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
