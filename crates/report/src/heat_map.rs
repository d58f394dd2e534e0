//! W1, W2 and W3 as heat maps over the modes: inline SVG, whose cells say their value.

use super::glossary::word;
use super::markup::section;
use super::numbers::significant;
use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{CauchySchwarz, Invariants};
use std::fmt::Write;

/// Modes that are shown at the most.
const MODES: usize = 40;
/// Decades of the scale, below 1, and colours of each.
const DECADES: usize = 4;
const COLOURS: usize = 3;
/// Pairs that are named.
const NAMED: usize = 3;
/// Places on the drawing, in its own units.
const LEFT: f64 = 44.0;
const TOP: f64 = 20.0;
const WIDEST: f64 = 430.0;

/// Moments and products of inertia: their names and places.
const INERTIA: [(&str, usize, usize); 6] =
    [("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2)];

/// The section with the maps of what the body holds.
pub(super) fn heat_maps(html: &mut String, body: &FlexBody) {
    let all = body.n_modes();
    if all == 0 {
        return;
    }
    let modes: Vec<usize> = (0..all.min(MODES)).collect();
    let invariants = body.invariants().with_modes(&modes);
    let maps = maps(&invariants);
    section(html, "How the modes act on the inertia");
    let some =
        if all > MODES { format!(" The first {MODES} of {all} modes are shown.") } else { String::new() };
    let _ = writeln!(
        html,
        "<p>Each cell is the size of an entry relative to the largest that it could have, on a logarithmic scale: the strongest colour stands for 1, and each of the {} steps down for a factor of {}. Empty cells are smaller than 1e-{DECADES}. Pointing at a cell shows its value.{some}</p>",
        DECADES * COLOURS,
        significant(10f64.powf(1.0 / COLOURS as f64), 2)
    );
    legend(html);
    html.push_str("<div class=\"maps\">\n");
    for map in maps {
        map.draw(html);
    }
    html.push_str("</div>\n");
}

/// One map: a value for each row and each mode.
struct Map {
    name: &'static str,
    reading: &'static str,
    /// Labels of the rows; none: the modes.
    rows: Option<Vec<&'static str>>,
    /// `None`: the body does not hold it.
    values: Option<Vec<Vec<f64>>>,
}

fn maps(invariants: &Invariants) -> [Map; 3] {
    let (nf, bound) = (invariants.n_modes(), CauchySchwarz::of(invariants));
    let part = |value: f64, bound: f64| if value == 0.0 { 0.0 } else { value.abs() / bound };
    let w1 = |w1: &Mat<f64>| {
        let row = |(_, k, l): (&str, usize, usize)| {
            (0..nf).map(|p| part(w1[(k, l * nf + p)], bound.w1(k, l, p))).collect()
        };
        INERTIA.map(row).to_vec()
    };
    // The largest entry of the blocks that belong to two modes.
    let by_modes = |w: &Mat<f64>| {
        let (below, beside) = (w.nrows() / nf, w.ncols() / nf);
        let largest = |p: usize, q: usize| {
            let blocks = (0..below).flat_map(|k| (0..beside).map(move |l| (k, l)));
            let entries = blocks.map(|(k, l)| w[(k * nf + p, l * nf + q)].abs());
            part(entries.fold(0.0, |a: f64, b| if a.is_nan() || a > b { a } else { b }), bound.s(p, q))
        };
        (0..nf).map(|p| (0..nf).map(|q| largest(p, q)).collect()).collect()
    };
    [
        Map {
            name: "W1",
            reading: "How the inertia follows the deflection, to first order. A strong cell says that deflecting this mode changes this moment or product of inertia (body axes), and that spin pushes on the mode in return.",
            rows: Some(INERTIA.map(|(name, ..)| name).to_vec()),
            values: invariants.w1().as_ref().map(w1),
        },
        Map {
            name: "W2",
            reading: "How two modes change the inertia together, to second order: centrifugal softening. Cells beside the diagonal say which modes a steady spin couples.",
            rows: None,
            values: invariants.w2().as_ref().map(by_modes),
        },
        Map {
            name: "W3",
            reading: "Coriolis and Euler forces of one mode on another when the body turns. The diagonal is empty; a pale map says that these forces hardly act between the modes.",
            rows: None,
            values: invariants.w3().as_ref().map(by_modes),
        },
    ]
}

/// The step of the scale that a value is in, from 0; `None` below the scale.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // from 0 on, before
fn step(value: f64) -> Option<usize> {
    let last = DECADES * COLOURS - 1;
    if value.is_nan() || value > 1.0 {
        return Some(last);
    }
    let steps = (value.log10() + DECADES as f64) * COLOURS as f64;
    (steps >= 0.0).then(|| (steps as usize).min(last))
}

impl Map {
    fn draw(&self, html: &mut String) {
        let wide = if self.rows.is_some() { " wide" } else { "" };
        let _ = writeln!(html, "<figure class=\"map{wide}\">");
        let Some(values) = &self.values else {
            let _ = writeln!(
                html,
                "<figcaption><strong>{}</strong> was left out of this body: nothing is known of it.</figcaption>\n</figure>",
                word(self.name)
            );
            return;
        };
        let _ = writeln!(
            html,
            "<figcaption><strong>{}.</strong> {} {}</figcaption>",
            word(self.name),
            self.reading,
            self.strongest(values)
        );
        self.cells(html, values);
        html.push_str("</figure>\n");
    }

    fn cells(&self, html: &mut String, values: &[Vec<f64>]) {
        let columns = values.first().map_or(0, Vec::len);
        let size = ((WIDEST - LEFT) / columns as f64).clamp(9.0, 24.0);
        let (width, height) = (LEFT + size * columns as f64 + 4.0, TOP + size * values.len() as f64 + 4.0);
        let _ = writeln!(
            html,
            "<svg viewBox=\"0 0 {width:.0} {height:.0}\" style=\"max-width:{width:.0}px\" role=\"img\" aria-label=\"Heat map of {}; the strongest entries are named above.\"><rect class=\"floor\" x=\"{LEFT}\" y=\"{TOP}\" width=\"{:.1}\" height=\"{:.1}\"/>",
            self.name,
            size * columns as f64,
            size * values.len() as f64
        );
        for (i, row) in values.iter().enumerate() {
            for (j, &value) in row.iter().enumerate() {
                let Some(step) = step(value) else { continue };
                let _ = write!(
                    html,
                    "<rect class=\"h{step}\" x=\"{:.1}\" y=\"{:.1}\" width=\"{size:.1}\" height=\"{size:.1}\"><title>{}: {}</title></rect>",
                    LEFT + size * j as f64,
                    TOP + size * i as f64,
                    self.place(i, j),
                    significant(value, 2)
                );
            }
        }
        html.push('\n');
        self.labels(html, columns, values.len(), size);
        html.push_str("</svg>\n");
    }

    fn labels(&self, html: &mut String, columns: usize, rows: usize, size: f64) {
        let shown = |i: usize| size > 16.0 || i == 0 || (i + 1).is_multiple_of(5);
        for j in (0..columns).filter(|&j| shown(j)) {
            let x = LEFT + size * (j as f64 + 0.5);
            let _ = write!(
                html,
                "<text class=\"tick\" x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                TOP - 5.0,
                j + 1
            );
        }
        for i in (0..rows).filter(|&i| self.rows.is_some() || shown(i)) {
            let name = self.rows.as_ref().map_or_else(|| (i + 1).to_string(), |rows| format!("I{}", rows[i]));
            let _ = write!(
                html,
                "<text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{name}</text>",
                LEFT - 6.0,
                TOP + size * (i as f64 + 0.5) + 4.0
            );
        }
        html.push('\n');
    }

    fn place(&self, i: usize, j: usize) -> String {
        match &self.rows {
            Some(rows) => format!("mode {}, I{}", j + 1, rows[i]),
            None if i == j => format!("mode {}", i + 1),
            None => format!("modes {} and {}", i + 1, j + 1),
        }
    }

    /// The largest entries in words; of pairs of modes those of two different ones.
    fn strongest(&self, values: &[Vec<f64>]) -> String {
        let cells = values
            .iter()
            .enumerate()
            .flat_map(|(i, row)| row.iter().enumerate().map(move |(j, &value)| (i, j, value)));
        let mut cells: Vec<(usize, usize, f64)> =
            cells.filter(|(i, j, value)| (self.rows.is_some() || i < j) && step(*value).is_some()).collect();
        cells.sort_by(|a, b| b.2.total_cmp(&a.2));
        cells.truncate(NAMED);
        if cells.is_empty() {
            return format!("No entry of two modes reaches 1e-{DECADES}.");
        }
        let named: Vec<String> = cells
            .iter()
            .map(|&(i, j, value)| format!("{} ({})", self.place(i, j), significant(value, 2)))
            .collect();
        format!("Strongest: {}.", named.join("; "))
    }
}

/// The colours of the scale.
fn legend(html: &mut String) {
    let steps = DECADES * COLOURS;
    let _ = write!(html, "<svg class=\"scale\" viewBox=\"0 0 360 34\" aria-hidden=\"true\">");
    let width = 300.0 / steps as f64;
    for step in 0..steps {
        let _ = write!(
            html,
            "<rect class=\"h{step}\" x=\"{:.1}\" y=\"2\" width=\"{width:.1}\" height=\"12\"/>",
            30.0 + width * step as f64
        );
    }
    for decade in (0..=DECADES).step_by(2) {
        let x = 30.0 + 300.0 * decade as f64 / DECADES as f64;
        let value = significant(10f64.powi(decade as i32 - DECADES as i32), 1);
        let _ =
            write!(html, "<text class=\"tick\" x=\"{x:.1}\" y=\"28\" text-anchor=\"middle\">{value}</text>");
    }
    html.push_str("</svg>\n");
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
