//! Errors of lumped masses as bars on a logarithmic axis: inline SVG, readable without colour.

use super::lumped::{LumpedFacts, distinct};
use super::markup::escape;
use super::numbers::percent;

/// Power of ten at the left end: errors below 0.0001 % are of no consequence and have no bar.
const LOWEST: i32 = -6;
/// Places on the drawing, in its own units.
const LABEL: f64 = 112.0;
const PLOT: f64 = 560.0;
const VALUES: f64 = 168.0;
const BAR: f64 = 13.0;
const GAP: f64 = 11.0;
const TOP: f64 = 22.0;
/// Colours of the style sheet; more schemes repeat them, the labels tell them apart.
const COLOURS: usize = 3;

/// The worst norm of each invariant for each scheme; empty without errors to draw.
pub(super) fn bar_chart(lumped: &[LumpedFacts]) -> String {
    let norms = lumped.iter().flat_map(|l| &l.errors.worst_by_invariant);
    let invariants = distinct(norms.map(|norm| norm.invariant.as_str()));
    if invariants.is_empty() {
        return String::new();
    }
    let values = lumped.iter().flat_map(|l| &l.errors.worst_by_invariant).map(|norm| norm.value);
    let largest = values.filter(|v| v.is_finite()).fold(1.0, f64::max);
    let bars = Bars { lumped, highest: (largest.log10().ceil() as i32).clamp(0, 300) };
    let row = lumped.len() as f64 * BAR + GAP;
    let (width, height) = (LABEL + PLOT + VALUES, TOP + invariants.len() as f64 * row);
    let mut svg = format!(
        "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"Bar chart of the worst relative error of each invariant; the numbers are in the table below.\">\n"
    );
    bars.draw_decades(&mut svg, height);
    for (i, invariant) in invariants.iter().enumerate() {
        bars.draw_invariant(&mut svg, TOP + i as f64 * row + 0.5 * GAP, row, invariant);
    }
    svg.push_str("</svg>\n");
    svg
}

/// Bars over decades of errors, up to the highest.
struct Bars<'l> {
    lumped: &'l [LumpedFacts],
    highest: i32,
}

impl Bars<'_> {
    fn place(&self, decade: f64) -> f64 {
        LABEL + PLOT * (decade - f64::from(LOWEST)) / f64::from(self.highest - LOWEST)
    }

    fn draw_decades(&self, svg: &mut String, height: f64) {
        let step = usize::try_from((self.highest - LOWEST) / 8 + 1).unwrap_or(1);
        for decade in (LOWEST..=self.highest).step_by(step) {
            let x = self.place(f64::from(decade));
            svg.push_str(&format!(
                "<line class=\"grid\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{TOP}\" y2=\"{height}\"/><text class=\"tick\" x=\"{x:.1}\" y=\"14\" text-anchor=\"middle\">{}</text>\n",
                percent(10f64.powi(decade))
            ));
        }
    }

    /// The name of an invariant and the bars of all schemes, from `top` on.
    fn draw_invariant(&self, svg: &mut String, top: f64, row: f64, invariant: &str) {
        let middle = top + 0.5 * (row - GAP) + 4.0;
        let name = escape(&shortened(invariant));
        svg.push_str(&format!(
            "<text x=\"{:.1}\" y=\"{middle:.1}\" text-anchor=\"end\">{name}</text>\n",
            LABEL - 8.0
        ));
        for (j, scheme) in self.lumped.iter().enumerate() {
            // The last of a name counts, as in a table by names.
            let mut norms = scheme.errors.worst_by_invariant.iter().rev();
            let Some(norm) = norms.find(|norm| norm.invariant == *invariant) else { continue };
            let y = top + j as f64 * BAR;
            let decade = norm.value.abs().log10().clamp(f64::from(LOWEST), f64::from(self.highest));
            let end = if decade.is_nan() { LABEL } else { self.place(decade) };
            svg.push_str(&format!(
                "<rect class=\"s{}\" x=\"{LABEL}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\">{} <tspan class=\"tick\">{}</tspan></text>\n",
                j % COLOURS,
                end - LABEL,
                BAR - 2.0,
                end + 5.0,
                y + BAR - 3.0,
                percent(norm.value),
                escape(&shortened(&scheme.scheme)),
            ));
        }
    }
}

/// A name that fits beside the bars.
fn shortened(name: &str) -> String {
    const LONGEST: usize = 16;
    if name.chars().count() <= LONGEST {
        return name.to_owned();
    }
    name.chars().take(LONGEST - 1).chain(['…']).collect()
}
