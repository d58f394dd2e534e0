//! Charts of one axis or none: bars of values in groups, and a map of values in rows and columns, as cells of different
//! strength.

use super::{At, Axis, STYLES, label, segment};
use crate::html::Plain;
use crate::numbers::significant;
use maud::{Markup, Render, html};

/// Layout of the drawing in its own units: names of the groups, bars, values at their ends.
const NAMES: f64 = 172.0;
const PLOT: f64 = 560.0;
const VALUES: f64 = 168.0;
const BAR: f64 = 13.0;
const GAP: f64 = 11.0;
const TOP: f64 = 22.0;

/// Largest number of characters of the name of a group, and of a bar; longer ones are cut.
const LONGEST_GROUP: usize = 24;
const LONGEST_BAR: usize = 16;

/// Groups of bars.
pub(crate) struct Bars {
    pub description: String,
    pub caption: String,
    pub axis: Axis,
    pub groups: Vec<(String, Vec<Bar>)>,
}

/// A bar. An infinite value fills the plot; an unknown value (NaN) has a label only.
pub(crate) struct Bar {
    pub style: usize,
    pub value: f64,
    /// Text of the value, and name, shown at the end of the bar.
    pub label: String,
    pub name: String,
}

impl Render for Bars {
    fn render(&self) -> Markup {
        let mut top = TOP;
        let mut next = |bars: &[Bar]| {
            let own = top + 0.5 * GAP;
            top += bars.len() as f64 * BAR + GAP;
            own
        };
        let tops: Vec<f64> = self.groups.iter().map(|(_, bars)| next(bars)).collect();
        html! {
            figure {
                svg viewBox=(format!("0 0 {} {top}", NAMES + PLOT + VALUES)) role="img" aria-label=(self.description) {
                    @for (at, text) in self.axis.ticks() {
                        @let x = NAMES + PLOT * at;
                        (segment("grid", [x, TOP], [x, top]))
                        (label("tick", "middle", [x, 14.0], text))
                    }
                    @for ((name, bars), top) in self.groups.iter().zip(tops) {
                        "\n"
                        (label("", "end", [NAMES - 8.0, top + 0.5 * BAR * bars.len() as f64 + 4.0], &shortened(name, LONGEST_GROUP)))
                        @for (i, bar) in bars.iter().enumerate() { (self.bar(bar, top + BAR * i as f64)) }
                    }
                }
                figcaption { (self.caption) }
            }
        }
    }
}

impl Bars {
    fn bar(&self, bar: &Bar, y: f64) -> Markup {
        let part = if bar.value.is_infinite() { Some(1.0) } else { self.axis.at(bar.value.abs()) };
        let width = PLOT * part.unwrap_or(0.0);
        html! {
            rect class={ "s" (bar.style % STYLES) } x=(NAMES) y=(At(y)) width=(At(width)) height=(BAR - 2.0) {}
            text x=(At(NAMES + width + 5.0)) y=(At(y + BAR - 3.0)) {
                (Plain(&bar.label)) " " tspan class="tick" { (Plain(&shortened(&bar.name, LONGEST_BAR))) }
            }
        }
    }
}

/// Returns a name shortened to fit beside the bars.
fn shortened(name: &str, longest: usize) -> String {
    if name.chars().count() <= longest {
        return name.to_owned();
    }
    name.chars().take(longest - 1).chain(['…']).collect()
}

/// Number of decades of the scale below 1, and number of colour steps.
pub(crate) const DECADES: i32 = 4;
pub(crate) const STEPS: usize = 12;

/// Layout of the drawing in its own units.
const CELLS_LEFT: f64 = 44.0;
const CELLS_TOP: f64 = 20.0;
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
    let steps = (value.log10() / f64::from(DECADES) + 1.0) * STEPS as f64;
    (steps >= 0.0).then(|| (steps as usize).min(last))
}

impl Render for Cells {
    fn render(&self) -> Markup {
        let (rows, columns) = (self.values.len(), self.values.first().map_or(0, Vec::len));
        let size = ((WIDEST - CELLS_LEFT) / columns as f64).clamp(9.0, 24.0);
        let [width, height] = [columns, rows].map(|count| size * count as f64);
        let across = CELLS_LEFT + width + 4.0;
        let shown = |i: &usize| size > 16.0 || *i == 0 || (*i + 1).is_multiple_of(5);
        let name =
            |i: usize| self.names.as_ref().map_or_else(|| (i + 1).to_string(), |names| names[i].clone());
        html! {
            svg viewBox=(format!("0 0 {across:.0} {:.0}", CELLS_TOP + height + 4.0)) style=(format!("max-width:{across:.0}px"))
                role="img" aria-label=(self.description) {
                rect class="floor" x=(CELLS_LEFT) y=(CELLS_TOP) width=(At(width)) height=(At(height)) {}
                @for (i, row) in self.values.iter().enumerate() {
                    @for (j, &value) in row.iter().enumerate() {
                        @if let Some(step) = step(value) {
                            rect class={ "h" (step) } x=(At(CELLS_LEFT + size * j as f64)) y=(At(CELLS_TOP + size * i as f64))
                                width=(At(size)) height=(At(size)) {
                                title { (Plain(&(self.place)(i, j))) ": " (significant(value, 2)) }
                            }
                        }
                    }
                }
                @for j in (0..columns).filter(shown) {
                    (label("tick", "middle", [CELLS_LEFT + size * (j as f64 + 0.5), CELLS_TOP - 5.0], &(j + 1).to_string()))
                }
                @for i in (0..rows).filter(|i| self.names.is_some() || shown(i)) {
                    (label("tick", "end", [CELLS_LEFT - 6.0, CELLS_TOP + size * (i as f64 + 0.5) + 4.0], &name(i)))
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
