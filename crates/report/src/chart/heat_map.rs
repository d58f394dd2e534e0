//! Map of values in rows and columns, as cells of different strength.

use super::axis::Axis;
use super::svg::{At, label};
use crate::notation::markup::Plain;
use crate::notation::numbers::significant;
use libm::log10;
use maud::{Markup, Render, html};

/// Number of decades of the scale below 1, and number of colour steps.
pub(crate) const DECADES: i32 = 4;
pub(crate) const STEPS: usize = 12;

/// Layout of the drawing in its own units.
const LEFT: f64 = 44.0;
const TOP: f64 = 20.0;
const WIDEST: f64 = 430.0;

/// A map of values from 0 to 1 on a logarithmic scale.
pub(crate) struct Cells {
    pub description: String,
    /// Names of the rows; `None` for row numbers.
    pub names: Option<Vec<String>>,
    pub values: Vec<Vec<f64>>,
    /// Name of the cell in a row and a column, shown when the pointer is over it.
    pub place: fn(usize, usize) -> String,
}

/// Returns the colour step of a value, from 0; `None` below the scale.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // the value is not negative
pub(crate) fn step(value: f64) -> Option<usize> {
    let last = STEPS - 1;
    if value.is_nan() || value > 1.0 {
        return Some(last);
    }
    let steps = (log10(value) / f64::from(DECADES) + 1.0) * STEPS as f64;
    (steps >= 0.0).then(|| (steps as usize).min(last))
}

impl Render for Cells {
    fn render(&self) -> Markup {
        let (rows, columns) = (self.values.len(), self.values.first().map_or(0, Vec::len));
        let size = ((WIDEST - LEFT) / columns as f64).clamp(9.0, 24.0);
        let [width, height] = [columns, rows].map(|count| size * count as f64);
        let across = LEFT + width + 4.0;
        let shown = |i: &usize| size > 16.0 || *i == 0 || (*i + 1).is_multiple_of(5);
        let name =
            |i: usize| self.names.as_ref().map_or_else(|| (i + 1).to_string(), |names| names[i].clone());
        html! {
            svg viewBox=(format!("0 0 {across:.0} {:.0}", TOP + height + 4.0)) style=(format!("max-width:{across:.0}px"))
                role="img" aria-label=(self.description) {
                rect class="floor" x=(LEFT) y=(TOP) width=(At(width)) height=(At(height)) {}
                @for (i, row) in self.values.iter().enumerate() {
                    @for (j, &value) in row.iter().enumerate() {
                        @if let Some(step) = step(value) {
                            rect class={ "h" (step) } x=(At(LEFT + size * j as f64)) y=(At(TOP + size * i as f64))
                                width=(At(size)) height=(At(size)) {
                                title { (Plain(&(self.place)(i, j))) ": " (significant(value, 2)) }
                            }
                        }
                    }
                }
                @for j in (0..columns).filter(shown) {
                    (label("tick", "middle", [LEFT + size * (j as f64 + 0.5), TOP - 5.0], &(j + 1).to_string()))
                }
                @for i in (0..rows).filter(|i| self.names.is_some() || shown(i)) {
                    (label("tick", "end", [LEFT - 6.0, TOP + size * (i as f64 + 0.5) + 4.0], &name(i)))
                }
            }
        }
    }
}

/// Draws the colours of the scale with their values.
pub(crate) fn colour_scale() -> Markup {
    let width = 300.0 / STEPS as f64;
    let axis = Axis::decades("", [10f64.powi(-DECADES), 1.0].into_iter(), f64::from(DECADES));
    html! {
        svg class="scale" viewBox="0 0 360 34" aria-hidden="true" {
            @for step in 0..STEPS {
                rect class={ "h" (step) } x=(At(30.0 + width * step as f64)) y="2" width=(At(width)) height="12" {}
            }
            @for (at, text) in axis.iter().flat_map(Axis::ticks).step_by(2) {
                (label("tick", "middle", [30.0 + 300.0 * at, 28.0], text))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_thirds_of_decades_from_the_smallest_on() {
        for (value, expected) in [
            (0.0, None),
            (9e-5, None),
            (1.1e-4, Some(0)),
            (3e-4, Some(1)),
            (1e-2 * 1.0001, Some(6)),
            (0.9, Some(11)),
            (1.0, Some(11)),
            (1.5, Some(11)),
            (f64::NAN, Some(11)),
        ] {
            assert_eq!(step(value), expected, "{value}");
        }
    }
}
