//! Results of CalculiX (.frd, text): the displacements of every mode of a `*FREQUENCY` step, with five decimals, in
//! fields of fixed width that touch each other.

use super::mode_table::{ModeTable, syntax, unexpected, unreadable};
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Line, Lines, field, integer, real, words};
use flexbody_model::DofLabel;
use std::f64::consts::TAU;

/// Returns true when a file begins like results of CalculiX.
pub(super) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"    1C")
}

/// Significant digits of a displacement (12 characters as in -1.23456E-02), and of an eigenvalue.
const DIGITS: (u8, u8) = (6, 7);

/// Number of characters of a displacement.
const WIDTH: usize = 12;

/// Kind of the analysis in the heading of a block: vibration.
const FREQUENCY: &[u8] = b"2";

/// Parameters above the blocks of a mode.
#[derive(Debug, Default)]
struct Head {
    /// True if the step has modes.
    mode: bool,
    modal_mass: Option<f64>,
    modal_stiffness: Option<f64>,
}

/// Block of values by nodes.
struct Block {
    eigenvalue: f64,
    /// Column where the number of a node ends and the values begin.
    start: usize,
    expected: i64,
    read: i64,
}

/// Reads the displacements of all modes.
pub(super) fn read(file: &InputFile) -> Diagnosed<ModeTable> {
    let mut table = ModeTable::new(DIGITS.0, DIGITS.1);
    let (mut head, mut pending, mut block): (Head, Option<Block>, Option<Block>) = Default::default();
    for Line { number: at, text: line } in Lines::of(file.bytes()) {
        // Within a block: lines of nodes, lines of component names, and the end with the announced number of nodes.
        if let Some(open) = &mut block {
            if line.starts_with(b" -1") {
                open.node(&mut table, file, at, line)?;
                continue;
            } else if line.starts_with(b" -2") || line.starts_with(b" -5") {
                continue;
            }
            let whole = block.take().filter(|open| open.read == open.expected && line.starts_with(b" -3"));
            if whole.is_none() {
                return Err(syntax(
                    file,
                    at,
                    "a block of displacements has another number of nodes than its head states",
                ));
            }
        }
        // Outside: parameters, the heading of a block (100C), and the name of its quantity (-4).
        if line.starts_with(b"    1P") {
            head.parameter(file, at, line)?;
        } else if line.starts_with(b"  100C") {
            pending = head.block(file, at, line)?;
        } else if line.starts_with(b" -4") {
            let name = field(line, 5..13);
            if name.starts_with(b"DISPI") && pending.is_some() {
                let help = "give real modes: those of a model without cyclic symmetry and damping";
                return Err(unreadable(file, "modes have imaginary parts", help));
            }
            block = pending.take().filter(|_| name == b"DISP");
            if let Some(block) = &block {
                table.begin(Some(block.eigenvalue));
            }
        }
    }
    match block {
        Some(_) => Err(unreadable(
            file,
            "file ends within a block of displacements",
            "run the job again: the file may be cut off",
        )),
        None if table.len() == 0 => Err(unreadable(
            file,
            "no displacements of modes are in the file",
            "write *NODE FILE with the line U in a step of *FREQUENCY",
        )),
        None => Ok(table),
    }
}

impl Head {
    /// Reads a line with a parameter of the step: `1PMODE`, `1PGM` and `1PGK` (modal mass and stiffness), `1PHID`
    /// (nodal diameter of a cyclic structure, -1 without).
    fn parameter(&mut self, file: &InputFile, at: usize, line: &[u8]) -> Diagnosed<()> {
        let mut words = words(&line[6..]);
        let (Some(name), Some(value)) = (words.next(), words.next()) else { return Ok(()) };
        match name {
            b"STEP" => *self = Self::default(),
            b"MODE" => self.mode = true,
            b"GM" => self.modal_mass = real(value),
            b"GK" => self.modal_stiffness = real(value),
            b"HID" if integer(value).is_some_and(|diameter| diameter >= 0) => {
                let message = "modes belong to a nodal diameter of a cyclic structure";
                return Err(syntax(file, at, message));
            }
            _ => {}
        }
        Ok(())
    }

    /// Returns the block of a mode from the heading of a block; `None` for other blocks.
    fn block(&mut self, file: &InputFile, at: usize, line: &[u8]) -> Diagnosed<Option<Block>> {
        if !self.mode || field(line, 56..58) != FREQUENCY {
            return Ok(None);
        }
        let expected = integer(field(line, 24..36)).filter(|count| *count > 0);
        let (Some(hertz), Some(expected)) = (real(field(line, 12..24)), expected) else {
            return Err(unexpected(file, at, "frequency and number of nodes of a mode", line));
        };
        let start = match field(line, 73..75) {
            b"0" => 8,
            b"1" => 13,
            _ => {
                let help = "use *NODE FILE, which writes text, instead of *NODE OUTPUT";
                return Err(unreadable(file, "results are written in binary", help));
            }
        };
        let eigenvalue = match (self.modal_mass, self.modal_stiffness) {
            (Some(mass), Some(stiffness)) if mass > 0.0 => stiffness / mass,
            _ => (TAU * hertz).powi(2),
        };
        Ok(Some(Block { eigenvalue, start, expected, read: 0 }))
    }
}

impl Block {
    /// Reads the displacements of a node.
    fn node(&mut self, table: &mut ModeTable, file: &InputFile, at: usize, line: &[u8]) -> Diagnosed<()> {
        let node = line.get(3..self.start).and_then(|field| integer(field.trim_ascii()));
        let value =
            |k: usize| real(line.get(self.start + WIDTH * k..self.start + WIDTH * (k + 1))?.trim_ascii());
        let (Some(node), Some(x), Some(y), Some(z)) = (node, value(0), value(1), value(2)) else {
            return Err(unexpected(file, at, "a node and three displacements", line));
        };
        for (direction, value) in (1..).zip([x, y, z]) {
            table.set(file, Some(at), DofLabel { node, direction }, value)?;
        }
        self.read += 1;
        Ok(())
    }
}
