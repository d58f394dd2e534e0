//! Elements of the drawings of charts: coordinates, lines and labels.

use crate::notation::markup::Plain;
use maud::{Markup, Render, html};

/// Number of lines and colours in the style sheet.
pub(crate) const STYLES: usize = 3;

/// A coordinate, written with the digits that a drawing needs.
pub(super) struct At(pub f64);

impl Render for At {
    fn render_to(&self, buffer: &mut String) {
        format!("{:.1}", self.0).render_to(buffer);
    }
}

/// Returns an SVG line of a class.
pub(super) fn segment(class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) -> Markup {
    html! { line class=(class) x1=(At(x1)) y1=(At(y1)) x2=(At(x2)) y2=(At(y2)) {} }
}

/// Returns a label with the given anchor: `start`, `middle` or `end`.
pub(super) fn label(class: &str, anchor: &str, [x, y]: [f64; 2], text: &str) -> Markup {
    html! { text class=(class) x=(At(x)) y=(At(y)) text-anchor=(anchor) { (Plain(text)) } }
}
