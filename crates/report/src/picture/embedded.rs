//! Picture of a body in a report: an interactive drawing of its modes if scripts run, otherwise (and on
//! paper) a still picture.

use super::arrays::script;
use super::drawing::Drawing;
use super::shown::{SCRIPT, ShownBody};
use super::still::still;
use crate::numbers::counted;
use flexbody_body::flex_body::FlexBody;

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
    /// Builds the picture; `None` for a body without anything to draw.
    pub(crate) fn of(body: &FlexBody) -> Option<Self> {
        let still = still(body)?;
        let drawing = Drawing::new(body, None, MAX_DRAWING_BYTES, MODES);
        let shown = ShownBody::<()>::new(body, &drawing, Vec::new(), None);
        let arrays: String = drawing.arrays().iter().map(script).collect();
        let panel = PANEL.replace("{{STILL}}", &still).replace("{{DRAWN}}", &drawn(body, &drawing));
        if drawing.modes() == 0 {
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
fn drawn(body: &FlexBody, drawing: &Drawing<'_>) -> String {
    let mut words = vec![match drawing.kind() {
        "points" => "nodes as points, since the file has no surface".to_owned(),
        _ => drawing.in_words(),
    }];
    if drawing.vertices() < body.n_nodes() {
        words.push(format!("{} of {}", drawing.vertices(), counted(body.n_nodes(), "node")));
    }
    if drawing.modes() < body.n_modes() {
        words.push(format!("the first {} of {}", drawing.modes(), counted(body.n_modes(), "mode")));
    }
    words.join("; ")
}
