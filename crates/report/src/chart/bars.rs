//! Charts of one axis: bars of values in groups.

use super::axis::Axis;
use super::svg::{At, STYLES, label, segment};
use crate::notation::markup::Plain;
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
