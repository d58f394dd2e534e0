//! Decks of CalculiX that assemble the stiffness with the stress of each unit load, for geometric stiffness without
//! element code.
//!
//! The stress of a load is the initial stress of the undeformed part. A static step with all nodes held makes it the
//! stress of the step before the perturbation step, in which the stiffness is stored. No displacement and no load is in
//! that stiffness, so that its difference from K is the stress stiffness alone.

use super::shapes::NodalShapes;
use flexbody_body::convert::ShapeColumn;
use flexbody_linalg::ties::first_largest;
use flexbody_model::{LoadKind, UnitLoad};
use libm::log10;
use std::collections::HashSet;
use std::fmt::Write as _;
use std::io::{self, Write};

/// Steps after the initial stress.
const STEPS: &str = "*STEP\n*STATIC\n*BOUNDARY\nFLEXBODY_ALL, 1, 3\n*END STEP\n\
    *STEP, PERTURBATION\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n1\n*BOUNDARY, OP=NEW\n*END STEP\n";

/// Stresses of all steps at the integration points.
#[derive(Debug, Clone, Copy)]
pub struct StepStresses<'a> {
    /// Element and integration point of every stress.
    pub points: &'a [(i64, i64)],
    /// Stresses xx, yy, zz, xy, yz, xz of each step and point.
    pub stresses: &'a [Vec<[f64; 6]>],
}

/// Decks with the stresses of the unit loads.
#[derive(Debug, Clone, Copy)]
pub struct StiffeningDecks<'a> {
    /// Whole static responses to the unit loads.
    pub shapes: &'a NodalShapes,
    /// Cards of nodes, elements and materials.
    pub elements: &'a [u8],
    /// Numbers and nodes of the solid elements.
    pub solids: &'a [(i64, Vec<i64>)],
    /// Stresses of these responses.
    pub stresses: StepStresses<'a>,
}

impl StiffeningDecks<'_> {
    /// Returns a message if the stresses are not those of all solid elements in all shapes.
    pub fn problem(&self, nodes: &[i64], displacements: &[Vec<[f64; 3]>], tolerance: f64) -> Option<String> {
        let count = self.shapes.count();
        if self.stresses.stresses.len() != count || displacements.len() != count {
            let steps = self.stresses.stresses.len();
            return Some(format!("the results have {steps} steps, expected those of {count} unit loads"));
        }
        let apart = |step: usize| self.shapes.difference(step, nodes, &displacements[step]);
        let worst = first_largest(0..count, |step| apart(*step))?;
        if nodes.is_empty() || apart(worst) > tolerance {
            return Some(format!(
                "displacements of step {} differ from those of its unit load by {:.1e} of the largest, expected at most {tolerance:.0e}",
                worst + 1,
                apart(worst)
            ));
        }
        let stressed: HashSet<i64> = self.stresses.points.iter().map(|(element, _)| *element).collect();
        let missing = self.solids.iter().find(|(id, _)| !stressed.contains(id));
        missing.map(|(id, _)| format!("element {id} has no stresses"))
    }

    /// Returns the unit load of a step and the size of the load whose stress is in its deck.
    pub fn load(&self, step: usize) -> (&UnitLoad, f64) {
        let (column, factor) = self.shapes.columns().nth(step).expect("a step");
        let ShapeColumn::Load(load) = column else { panic!("shapes of unit loads") };
        (load, factor * self.amplification(step))
    }

    /// Returns the power of ten by which the stress of a step is raised: the stress stiffness then is about as large as
    /// K, so that hardly a digit is lost by their difference. The deck is linear in the stress.
    fn amplification(&self, step: usize) -> f64 {
        let strain = self.shapes.strain(step, self.solids);
        if strain > 0.0 { 10f64.powi(-log10(strain).round() as i32) } else { 1.0 }
    }

    /// Writes the deck of a step.
    ///
    /// # Errors
    /// Errors of `out`.
    pub fn write(&self, step: usize, out: &mut impl Write) -> io::Result<()> {
        let (load, size) = self.load(step);
        writeln!(out, "*HEADING\nStiffness with the stress of {size:e} units of {load}")?;
        out.write_all(self.elements)?;
        self.shapes.write_all_nodes(out)?;
        writeln!(out, "*INITIAL CONDITIONS, TYPE=STRESS")?;
        let amplification = self.amplification(step);
        for ((element, point), stress) in self.stresses.points.iter().zip(&self.stresses.stresses[step]) {
            write!(out, "{element}, {point}")?;
            // CalculiX has xz before yz.
            for component in [0, 1, 2, 3, 5, 4] {
                write!(out, ", {:.9e}", stress[component] * amplification)?;
            }
            writeln!(out)?;
        }
        out.write_all(STEPS.as_bytes())
    }

    /// Returns the tables of a manifest that read the stiffness matrices; `file` is the path of that of a step.
    pub fn manifest(&self, file: impl Fn(usize) -> String) -> String {
        let mut out = String::new();
        for step in 0..self.shapes.count() {
            let (load, size) = self.load(step);
            let _ = writeln!(out, "[[geometric_stiffness]]");
            let _ = writeln!(out, "with_stress = {}", quoted(&file(step)));
            let _ = writeln!(out, "load_size = {size:e}");
            let value = match &load.kind {
                LoadKind::Named(name) => name.as_str(),
                _ => load.axis(),
            };
            let _ = writeln!(out, "{} = {}", load.kind.name(), quoted(value));
            if let Some(interface) = load.kind.interface() {
                let _ = writeln!(out, "interface = {}", quoted(interface));
            }
        }
        out
    }
}

/// Returns a text as a basic string of TOML.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for character in text.chars() {
        match character {
            '"' | '\\' => out.extend(['\\', character]),
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// Returns the script that runs CalculiX on the deck of the unit loads, makes the decks with their stresses, and runs
/// CalculiX on these.
///
/// * `ask`: deck of the unit loads without its extension.
/// * `words`: command that makes the decks of the stresses.
/// * `decks`: these decks without their extension.
pub fn stiffening_script(ask: &str, words: &[String], decks: &[String]) -> String {
    let mut out = String::from("#!/bin/sh\nset -e\n");
    let _ = writeln!(out, "ccx -i {}", in_shell(ask));
    let words: Vec<String> = words.iter().map(|word| in_shell(word)).collect();
    let _ = writeln!(out, "{}", words.join(" "));
    for deck in decks {
        let _ = writeln!(out, "ccx -i {}", in_shell(deck));
    }
    out
}

/// Returns a word as a shell reads it.
fn in_shell(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:@%+".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_names_keep_their_characters() {
        assert_eq!(in_shell("a/b-1.inp"), "a/b-1.inp");
        assert_eq!(in_shell("it's here"), "'it'\\''s here'");
        assert_eq!(quoted("a \"b\" \\ \u{7}ä"), r#""a \"b\" \\ \u0007ä""#);
    }
}
