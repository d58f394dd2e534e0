//! W1, W2 and W3 as maps over the modes.

use super::glossary::word;
use crate::chart::{Cells, DECADES, STEPS, step};
use crate::document::{Block, Inline, Span, heading};
use crate::notation::numbers::significant;
use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{CauchySchwarz, Invariants};
use flexbody_linalg::ties::sort_descending;
use libm::pow;

/// Largest number of modes in a map.
const MODES: usize = 40;

/// Number of pairs that are named.
const NAMED: usize = 3;

/// Names and indices of the moments and products of inertia.
const INERTIA: [(&str, usize, usize); 6] =
    [("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2)];

/// Returns the section with the maps of the groups that the body holds; empty without modes.
pub(super) fn heat_maps<'a>(body: &FlexBody) -> Vec<Block<'a>> {
    let all = body.n_modes();
    if all == 0 {
        return Vec::new();
    }
    let modes: Vec<usize> = (0..all.min(MODES)).collect();
    let some =
        if all > MODES { format!(" The first {MODES} of {all} modes are shown.") } else { String::new() };
    let factor = significant(pow(10.0, f64::from(DECADES) / STEPS as f64), 2);
    let reading = format!(
        "Each cell is the size of an entry relative to the largest that it could have, on a logarithmic scale: the strongest colour stands for 1, and each of the {STEPS} steps down for a factor of {factor}. Empty cells are smaller than 1e-{DECADES}. Pointing at a cell shows its value.{some}"
    );
    let maps = maps(&body.invariants().with_modes(&modes)).map(Map::drawn).into();
    vec![heading("Effect of the modes on the inertia"), Block::Paragraph(reading), Block::Maps(maps)]
}

/// A map with a value for each row and each mode.
struct Map {
    name: &'static str,
    reading: &'static str,
    /// True for W1, whose rows are moments and products of inertia; false if rows are modes.
    is_by_moments: bool,
    /// Values of the map; `None` if the body does not hold the group.
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
    // Takes the largest entry of the blocks that belong to two modes.
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
            reading: "Change of the inertia with the deflection, to first order. A strong cell means that this mode changes this moment or product of inertia (body axes), and that spin excites the mode in return.",
            is_by_moments: true,
            values: invariants.w1().as_ref().map(w1),
        },
        Map {
            name: "W2",
            reading: "Change of the inertia by two modes together, to second order (centrifugal softening). Cells off the diagonal show which modes a steady spin couples.",
            is_by_moments: false,
            values: invariants.w2().as_ref().map(by_modes),
        },
        Map {
            name: "W3",
            reading: "Coriolis and Euler forces of one mode on another when the body turns. The diagonal is empty; a pale map means that these forces hardly act between the modes.",
            is_by_moments: false,
            values: invariants.w3().as_ref().map(by_modes),
        },
    ]
}

impl Map {
    /// Returns the map with its text.
    fn drawn(self) -> (Inline, Option<Cells>) {
        let name = |dot: &str| match word(self.name) {
            Span::Word(name, meaning) => Span::Word(name + dot, meaning),
            other => other,
        };
        let Some(values) = self.values else {
            let left_out = " is not in this body: its entries are not known.";
            return (Inline::from(name("")).then(left_out), None);
        };
        let strongest = strongest(&values, self.is_by_moments);
        let cells = Cells {
            description: format!("Heat map of {}; the strongest entries are named above.", self.name),
            names: self.is_by_moments.then(|| INERTIA.map(|(name, ..)| format!("I{name}")).to_vec()),
            values,
            place: if self.is_by_moments { moment_of_mode } else { mode_or_pair },
        };
        (Inline::from(name(".")).then(format!(" {} {strongest}", self.reading)), Some(cells))
    }
}

/// Returns the name of a cell of W1.
fn moment_of_mode(i: usize, j: usize) -> String {
    format!("mode {}, I{}", j + 1, INERTIA[i].0)
}

/// Returns the name of a cell of W2 or W3.
fn mode_or_pair(i: usize, j: usize) -> String {
    if i == j { format!("mode {}", i + 1) } else { format!("modes {} and {}", i + 1, j + 1) }
}

/// Returns the largest entries in words; for maps of mode pairs only pairs of two different modes.
fn strongest(values: &[Vec<f64>], is_by_moments: bool) -> String {
    let rows = values.iter().enumerate();
    let cells = rows.flat_map(|(i, row)| row.iter().enumerate().map(move |(j, &value)| (i, j, value)));
    let mut cells: Vec<(usize, usize, f64)> =
        cells.filter(|(i, j, value)| (is_by_moments || i < j) && step(*value).is_some()).collect();
    sort_descending(&mut cells, |cell| cell.2);
    cells.truncate(NAMED);
    if cells.is_empty() {
        return format!("No entry of two modes reaches 1e-{DECADES}.");
    }
    let place = if is_by_moments { moment_of_mode } else { mode_or_pair };
    let named = cells.iter().map(|&(i, j, value)| format!("{} ({})", place(i, j), significant(value, 2)));
    format!("Strongest: {}.", named.collect::<Vec<_>>().join("; "))
}
