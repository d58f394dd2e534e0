//! Printed results of CalculiX (.dat): stresses at integration points, displacements and the strain energy of the part,
//! with seven digits.

use super::step_values::{Place, Step, StepValues};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Line, Lines, excerpt, integer, real, words};

/// Beginnings of the headings of tables, without leading blanks.
const STRESSES: &[u8] = b"stresses (elem, integ.pnt.,sxx,syy,szz,sxy,sxz,syz)";
const DISPLACEMENTS: &[u8] = b"displacements (vx,vy,vz)";
const ENERGY: &[u8] = b"total internal energy";

/// Significant decimal digits of printed values.
const DIGITS: u8 = 7;

/// Places of xx, yy, zz, xy, yz and xz in a line of stresses.
const ORDER: [usize; 6] = [0, 1, 2, 3, 5, 4];

/// Returns true if a file begins like printed results of CalculiX: with the heading of a table.
pub(super) fn recognises(head: &[u8]) -> bool {
    let first = Lines::of(head).filter_map(Line::content).next();
    let has = |line: &[u8], part: &[u8]| line.windows(part.len()).any(|window| window == part);
    first.is_some_and(|line| has(line.text, b" for set ") && has(line.text, b" and time "))
}

/// Table that lines belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Table {
    Stresses,
    Displacements,
    Energy,
    /// A table that is not read.
    Other,
}

/// Reads the tables of all steps. A step ends where the time changes.
///
/// # Errors
/// FB327.
pub(super) fn read(file: &InputFile) -> Diagnosed<StepValues> {
    file.load().map_err(|diagnostic| vec![diagnostic])?;
    let mut steps: Vec<Step> = Vec::new();
    let (mut table, mut time) = (Table::Other, None);
    for Line { number, text } in Lines::of(file.bytes()).filter_map(Line::content) {
        let line = text.trim_ascii();
        let wrong = |what: &str| {
            let message = format!("expected {what}, found `{}`", excerpt(line));
            vec![Diagnostic::new(Code::FeResultsSyntax, message).in_file(file.path()).at_line(number)]
        };
        if line.first().is_some_and(u8::is_ascii_alphabetic) {
            let names =
                [(STRESSES, Table::Stresses), (DISPLACEMENTS, Table::Displacements), (ENERGY, Table::Energy)];
            let known = names.iter().find(|(name, _)| line.starts_with(name));
            table = known.map_or(Table::Other, |(_, table)| *table);
            if table != Table::Other {
                let own =
                    words(line).last().and_then(real).ok_or_else(|| wrong("a heading with its time"))?;
                if time != Some(own) {
                    steps.push(Step::default());
                }
                time = Some(own);
            }
            continue;
        }
        let Some(step) = steps.last_mut().filter(|_| table != Table::Other) else { continue };
        let words: Vec<&[u8]> = words(line).collect();
        let values =
            |from: usize| -> Option<Vec<f64>> { words.get(from..)?.iter().map(|w| real(w)).collect() };
        let whole = |at: usize| words.get(at).and_then(|word| integer(word));
        match table {
            Table::Stresses => {
                let place = whole(0).zip(whole(1)).map(|(element, point)| Place::Point { element, point });
                let values = values(2).filter(|values| values.len() == 6);
                let what = "an element, a point and six stresses along the axes of the model";
                let (place, values) = place.zip(values).ok_or_else(|| wrong(what))?;
                step.stresses.push((place, ORDER.map(|k| values[k])));
            }
            Table::Displacements => {
                let values = values(1).and_then(|values| <[f64; 3]>::try_from(values).ok());
                let one = whole(0).zip(values).ok_or_else(|| wrong("a node and three displacements"))?;
                step.displacements.push(one);
            }
            Table::Energy => {
                let energy = values(0).filter(|values| values.len() == 1).map(|values| values[0]);
                let energy = energy.ok_or_else(|| wrong("a strain energy"))?;
                step.energy = Some(step.energy.unwrap_or(0.0) + energy);
            }
            Table::Other => {}
        }
    }
    StepValues::of(steps, DIGITS, file)
}
