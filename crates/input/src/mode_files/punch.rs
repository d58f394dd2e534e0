//! Punch files of Nastran (.pch): `DISPLACEMENT(PUNCH) = ALL` in SOL 103 writes two lines for every grid point of every
//! mode, with seven digits.

use super::mode_table::{ModeTable, syntax, unexpected, unreadable};
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Line, Lines, integer, real, words};
use flexbody_model::DofLabel;

/// Returns true when a file begins like a punch file with results.
pub(super) fn recognises(head: &[u8]) -> bool {
    let first = head.trim_ascii_start();
    const HEADS: [&[u8]; 8] = [
        b"$TITLE",
        b"$SUBTITLE",
        b"$LABEL",
        b"$EIGENVECTOR",
        b"$DISPLACEMENTS",
        b"$SUBCASE",
        b"$ELEMENT STRESSES",
        b"$GRID POINT STRESSES",
    ];
    HEADS.iter().any(|word| first.starts_with(word))
}

/// Number of digits of a value and of an eigenvalue, as in 1.234567E-02.
const DIGITS: u8 = 7;

/// Number of columns of a line before its sequence number.
const COLUMNS: usize = 72;

/// Kind of the lines below a heading.
#[derive(Debug, Clone, Copy, PartialEq)]
enum SectionKind {
    /// Shapes of modes.
    Modes,
    /// Other results.
    Other,
}

/// Reads the eigenvectors of all modes.
pub(super) fn read(file: &InputFile) -> Diagnosed<ModeTable> {
    let mut table = ModeTable::new(DIGITS, DIGITS).along_nodes();
    let mut kind = SectionKind::Other;
    let mut is_mode = false;
    // Node whose rotations are on the next line.
    let mut node: Option<i64> = None;
    for Line { number: at, text: line } in Lines::of(file.bytes()) {
        let line = &line[..line.len().min(COLUMNS)];
        if line.starts_with(b"$") {
            if let Some(node) = node {
                return Err(syntax(file, at, format!("the second line of grid point {node} is missing")));
            }
            kind = kind_of(line, kind);
            if kind == SectionKind::Modes {
                refuse_other_forms(file, at, line)?;
                match eigenvalue(file, at, line)? {
                    Some(value) => {
                        table.begin(Some(value));
                        is_mode = true;
                    }
                    None => is_mode &= !line.starts_with(b"$TITLE"),
                }
            }
        } else if kind == SectionKind::Modes && is_mode && !line.trim_ascii().is_empty() {
            node = grid_line(&mut table, file, at, line, node)?;
        }
    }
    match node {
        Some(_) => {
            Err(unreadable(file, "file ends within a grid point", "write the file again: it may be cut off"))
        }
        None if table.len() == 0 => Err(unreadable(
            file,
            "no eigenvectors are in the file",
            "run SOL 103 with DISPLACEMENT(SORT1,REAL,PUNCH) = ALL",
        )),
        None => Ok(table),
    }
}

/// Returns the kind of the lines below a line of the heading; `before` if the line does not state it.
fn kind_of(line: &[u8], before: SectionKind) -> SectionKind {
    const HEADS: &[&[u8]] = &[
        b"$TITLE",
        b"$SUBTITLE",
        b"$LABEL",
        b"$REAL",
        b"$MAGNITUDE",
        b"$SUBCASE",
        b"$EIGENVALUE",
        b"$POINT",
    ];
    let line = line.trim_ascii();
    match line {
        b"$EIGENVECTOR" | b"$DISPLACEMENTS" => SectionKind::Modes,
        _ if HEADS.iter().any(|head| line.starts_with(head)) => before,
        _ => SectionKind::Other,
    }
}

fn refuse_other_forms(file: &InputFile, at: usize, line: &[u8]) -> Diagnosed<()> {
    let what = if line.starts_with(b"$REAL-IMAGINARY") || line.starts_with(b"$MAGNITUDE") {
        "eigenvectors are complex"
    } else if line.starts_with(b"$POINT") {
        "values are sorted by grid points (SORT2)"
    } else {
        return Ok(());
    };
    let message = format!("{what}, expected real eigenvectors, mode by mode");
    Err(syntax(file, at, message)
        .into_iter()
        .map(|d| d.with_help("write DISPLACEMENT(SORT1,REAL,PUNCH) = ALL"))
        .collect())
}

/// Reads a line `$EIGENVALUE =  3.947842E+05  MODE =  1`.
fn eigenvalue(file: &InputFile, at: usize, line: &[u8]) -> Diagnosed<Option<f64>> {
    let Some(rest) = line.strip_prefix(b"$EIGENVALUE") else { return Ok(None) };
    let mut words = words(rest);
    let value = match words.next() {
        Some(b"=") => words.next().and_then(real),
        _ => None,
    };
    match value {
        Some(value) => Ok(Some(value)),
        None => Err(unexpected(file, at, "an eigenvalue", line)),
    }
}

/// Reads a line of a grid point (its number, G and three displacements; below it -CONT- and three rotations). Returns
/// the node whose rotations must follow.
fn grid_line(
    table: &mut ModeTable,
    file: &InputFile,
    at: usize,
    line: &[u8],
    before: Option<i64>,
) -> Diagnosed<Option<i64>> {
    let mut words = words(line);
    let bad = || Err(unexpected(file, at, "a grid point with three values, or -CONT- and three more", line));
    let (first, node) = match (words.next(), before) {
        (Some(b"-CONT-"), Some(node)) => (4, node),
        (Some(number), None) => match (integer(number), words.next()) {
            (Some(node), Some(b"G")) => (1, node),
            _ => return bad(),
        },
        _ => return bad(),
    };
    let values: Option<Vec<f64>> = words.map(real).collect();
    let Some(&[x, y, z]) = values.as_deref() else { return bad() };
    for (direction, value) in (first..).zip([x, y, z]) {
        table.set(file, Some(at), DofLabel { node, direction }, value)?;
    }
    Ok((first == 1).then_some(node))
}
