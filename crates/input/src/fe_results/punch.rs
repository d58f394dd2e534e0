//! Punch files of Nastran (.pch): `DISPLACEMENT(SORT1,REAL,PUNCH) = ALL` with `STRESS(SORT1,REAL,PUNCH,CORNER) = ALL` for
//! solid elements, or with `GPSTRESS(PUNCH) = ALL` for volumes. Values have seven digits in three fields of 18 characters,
//! behind 18 characters for the number of the element or grid point, or for -CONT-.

use super::averaged::{Averaged, NodeStress};
use super::step_values::{Place, Step, StepValues, unreadable};
use crate::mode_files::is_punch;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Line, Lines, excerpt, field, integer, real, words};
use std::collections::BTreeMap;

/// Returns true if a file begins like a punch file with results.
pub(super) fn recognises(head: &[u8]) -> bool {
    is_punch(head)
}

/// Significant decimal digits of a value, as in 1.234567E-02.
const DIGITS: u8 = 7;

/// Number of columns of a line before its sequence number.
const COLUMNS: usize = 72;

/// Number of columns of a field.
const WIDTH: usize = 18;

/// Number of fields for the centre or a corner of a solid element: the grid point, and the normal stress, the shear, the
/// principal stress and the direction cosines of each axis with mean pressure and von Mises stress.
const FIELDS_OF_POINT: usize = 21;

/// Fields of xx, yy, zz, xy, yz and xz among those of a point.
const STRESSES_OF_POINT: [usize; 6] = [1, 9, 15, 2, 10, 16];

/// Number of fields of a grid point of a volume: xx, yy, zz, xy, yz, xz, mean pressure, von Mises stress.
const FIELDS_OF_VOLUME: usize = 8;

const REQUEST: &str = "request DISPLACEMENT(SORT1,REAL,PUNCH) = ALL and STRESS(SORT1,REAL,PUNCH,CORNER) = ALL above all subcases of a linear static run";

const SOLIDS_ALONE: &str = "request the stresses of solid elements alone, STRESS(SORT1,REAL,PUNCH,CORNER) = n for a SET n of them, or give those of shells as an operator";

/// Type of solid elements with its number of corners.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Solid {
    number: i64,
    corners: usize,
}

/// Solid elements of linear statics: CTETRA, CHEXA, CPENTA, CPYRAM.
const SOLIDS: [Solid; 4] = [
    Solid { number: 39, corners: 4 },
    Solid { number: 67, corners: 8 },
    Solid { number: 68, corners: 6 },
    Solid { number: 255, corners: 5 },
];

/// Elements that have no six stresses at a point and are passed over: rods, bars, beams, springs, dampers, gaps, bushes
/// and connectors.
const WITHOUT_TENSOR: [i64; 22] =
    [1, 2, 3, 10, 11, 12, 13, 14, 20, 21, 22, 23, 24, 34, 38, 40, 69, 100, 102, 117, 118, 126];

/// Names of elements whose stresses are refused.
const REFUSED: [(i64, &str); 15] = [
    (4, "CSHEAR"),
    (33, "CQUAD4"),
    (64, "CQUAD8"),
    (70, "CTRIAR"),
    (74, "CTRIA3"),
    (75, "CTRIA6"),
    (82, "CQUADR"),
    (95, "CQUAD4 of plies"),
    (96, "CQUAD8 of plies"),
    (97, "CTRIA3 of plies"),
    (98, "CTRIA6 of plies"),
    (144, "CQUAD4"),
    (227, "CTRIAR"),
    (228, "CQUADR"),
    (232, "CQUADR of plies"),
];

/// Kind of the lines below a heading.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Section {
    Displacements,
    /// Stresses of elements whose type is not known yet.
    Elements,
    Solids(Solid),
    GridPoints,
    /// Lines that are not read.
    Other,
}

/// Values of one subcase or mode.
#[derive(Debug, Default)]
struct Case {
    displacements: Vec<(i64, [f64; 3])>,
    /// Elements with stresses.
    elements: Vec<i64>,
    /// Stresses at the corners of elements.
    corners: Vec<NodeStress>,
    /// Stresses of grid points of volumes.
    grids: Vec<NodeStress>,
}

/// Line with its continuations.
struct Record<'f> {
    /// Number of its first line.
    line: usize,
    /// Number of the element or grid point, with a letter in displacements.
    head: &'f [u8],
    fields: Vec<&'f [u8]>,
}

/// Reads displacements and stresses of all subcases in the order of their numbers, and of the modes of each.
///
/// # Errors
/// FB327.
pub(super) fn read(file: &InputFile) -> Diagnosed<StepValues> {
    let mut reading = Reading {
        file,
        section: Section::Other,
        subcase: None,
        mode: 0,
        record: None,
        cases: BTreeMap::new(),
    };
    for Line { number, text } in Lines::of(file.bytes()) {
        let line = &text[..text.len().min(COLUMNS)];
        if line.starts_with(b"$") {
            reading.finish()?;
            reading.heading(number, line)?;
        } else if reading.section != Section::Other && !line.trim_ascii().is_empty() {
            reading.line(number, line)?;
        }
    }
    reading.finish()?;
    steps(reading.cases, file)
}

struct Reading<'f> {
    file: &'f InputFile,
    section: Section,
    /// Number of the subcase of the section.
    subcase: Option<i64>,
    /// Number of the mode of the section; 0 in statics.
    mode: i64,
    record: Option<Record<'f>>,
    cases: BTreeMap<(i64, i64), Case>,
}

impl<'f> Reading<'f> {
    /// Returns FB327 at a line.
    fn wrong(&self, line: usize, message: impl Into<String>, help: &str) -> Vec<Diagnostic> {
        let diagnostic = Diagnostic::new(Code::FeResultsSyntax, message).in_file(self.file.path());
        vec![diagnostic.at_line(line).with_help(help)]
    }

    /// Takes a line of a heading, `$NAME` or `$NAME = value`.
    fn heading(&mut self, at: usize, line: &[u8]) -> Diagnosed<()> {
        let line = line.trim_ascii();
        let is = |name: &str| line.starts_with(name.as_bytes());
        let value = || {
            let after = line.splitn(2, |byte| *byte == b'=').nth(1)?;
            words(after).next().and_then(integer)
        };
        if ["$TITLE", "$SUBTITLE", "$LABEL", "$REAL OUTPUT", "$VOLUME"].iter().any(|name| is(name)) {
            return Ok(());
        } else if is("$SUBCASE") {
            let what = || format!("expected the number of a subcase, found `{}`", excerpt(line));
            self.subcase = Some(value().ok_or_else(|| self.wrong(at, what(), REQUEST))?);
        } else if is("$ELEMENT TYPE") {
            if self.section == Section::Elements {
                self.section = self.section_of(at, value(), line)?;
            }
        } else if is("$EIGENVALUE") {
            // $EIGENVALUE =  3.9478418E+05  MODE =     1
            let number = line.rsplit(|byte| *byte == b'=').next().and_then(|text| integer(text.trim_ascii()));
            let what = || format!("expected an eigenvalue with its mode, found `{}`", excerpt(line));
            self.mode = number.ok_or_else(|| self.wrong(at, what(), REQUEST))?;
        } else if let Some(what) = other_form(line) {
            if self.section != Section::Other {
                let message = format!("{what}, expected real values of subcases or modes");
                return Err(self.wrong(at, message, REQUEST));
            }
        } else if !line.contains(&b'=') {
            // A line with a value is one about the section that it stands in.
            (self.subcase, self.mode) = (None, 0);
            self.section = match line {
                b"$DISPLACEMENTS" | b"$EIGENVECTOR" => Section::Displacements,
                b"$ELEMENT STRESSES" => Section::Elements,
                b"$GRID POINT STRESSES" | b"$STRESSES AT GRID POINTS" => Section::GridPoints,
                _ => Section::Other,
            };
        }
        Ok(())
    }

    /// Returns the section of stresses of elements of a type.
    fn section_of(&self, at: usize, number: Option<i64>, line: &[u8]) -> Diagnosed<Section> {
        let Some(number) = number else {
            let message = format!("expected a type of elements, found `{}`", excerpt(line));
            return Err(self.wrong(at, message, REQUEST));
        };
        if let Some(solid) = SOLIDS.iter().find(|solid| solid.number == number) {
            return Ok(Section::Solids(*solid));
        }
        if WITHOUT_TENSOR.contains(&number) {
            return Ok(Section::Other);
        }
        let name = REFUSED.iter().find(|(known, _)| *known == number).map(|(_, name)| *name);
        let message = match name {
            Some(name) => format!(
                "stresses of {name} elements (type {number}) are along axes of the elements and have three components"
            ),
            None => format!("stresses of elements of type {number} are not read"),
        };
        Err(self.wrong(at, message, SOLIDS_ALONE))
    }

    /// Takes a line of values.
    fn line(&mut self, at: usize, line: &'f [u8]) -> Diagnosed<()> {
        let mut fields: Vec<&[u8]> =
            (1..=3).map(|place| field(line, place * WIDTH..(place + 1) * WIDTH)).collect();
        while fields.last().is_some_and(|last| last.is_empty()) {
            fields.pop();
        }
        let head = field(line, 0..WIDTH);
        if head != b"-CONT-" {
            self.finish()?;
            self.record = Some(Record { line: at, head, fields });
            return Ok(());
        }
        match &mut self.record {
            Some(record) => record.fields.extend(fields),
            None => return Err(self.wrong(at, "-CONT- continues no line", REQUEST)),
        }
        Ok(())
    }

    /// Takes the record that ends before a heading, before the next record or with the file.
    fn finish(&mut self) -> Diagnosed<()> {
        let Some(record) = self.record.take() else { return Ok(()) };
        let Some(subcase) = self.subcase else {
            return Err(self.wrong(record.line, "values come before the number of their subcase", REQUEST));
        };
        let key = (subcase, self.mode);
        match self.section {
            Section::Displacements => {
                if let Some(displacement) = self.displacement(&record)? {
                    self.cases.entry(key).or_default().displacements.push(displacement);
                }
            }
            Section::Solids(solid) => {
                let (element, corners) = self.solid(&record, solid)?;
                let case = self.cases.entry(key).or_default();
                case.elements.push(element);
                case.corners.extend(corners);
            }
            Section::GridPoints => {
                let grid = self.grid_point(&record)?;
                self.cases.entry(key).or_default().grids.push(grid);
            }
            Section::Elements => {
                return Err(self.wrong(
                    record.line,
                    "stresses come before the type of their elements",
                    REQUEST,
                ));
            }
            Section::Other => {}
        }
        Ok(())
    }

    /// Returns the displacements of a grid point; `None` for a scalar point or a coordinate of a mode.
    fn displacement(&self, record: &Record<'_>) -> Diagnosed<Option<(i64, [f64; 3])>> {
        let mut head = words(record.head);
        let number = head.next().and_then(integer);
        let letter = head.next();
        if number.is_some()
            && letter.is_some_and(|letter| [&b"S"[..], b"E", b"M", b"H", b"L"].contains(&letter))
        {
            return Ok(None);
        }
        let values: Option<Vec<f64>> = record.fields.iter().map(|field| real(field)).collect();
        match (number, letter, values.as_deref()) {
            (Some(node), Some(b"G"), Some(&[x, y, z, _, _, _])) => Ok(Some((node, [x, y, z]))),
            _ => Err(self.unexpected(record, "a grid point with three displacements and three rotations")),
        }
    }

    /// Returns the number of a solid element and the stresses at its corners.
    fn solid(&self, record: &Record<'_>, solid: Solid) -> Diagnosed<(i64, Vec<NodeStress>)> {
        let wrong = |message: String, help: &str| Err(self.wrong(record.line, message, help));
        let Some((element, (&[system, _, active], points))) =
            integer(record.head).zip(record.fields.split_first_chunk::<3>())
        else {
            return Err(self.unexpected(record, "an element with its coordinate system and its grid points"));
        };
        if integer(system) != Some(0) {
            let message = format!(
                "stresses of element {element} are along the coordinate system `{}`, expected 0, the basic one",
                excerpt(system)
            );
            return wrong(message, "set CORDM of PSOLID to 0");
        }
        if points.len() == FIELDS_OF_POINT {
            let message = format!("element {element} has stresses at its centre alone");
            return wrong(message, REQUEST);
        }
        let expected = FIELDS_OF_POINT * (solid.corners + 1);
        if points.len() != expected || integer(active).is_some_and(|count| count != solid.corners as i64) {
            let message = format!(
                "element {element} has {} values, expected {expected} for its centre and {} corners",
                points.len(),
                solid.corners
            );
            return wrong(message, "write the file again: it may be cut off");
        }
        // The first point is the centre.
        let mut corners = Vec::with_capacity(solid.corners);
        for point in points.chunks_exact(FIELDS_OF_POINT).skip(1) {
            let node = integer(point[0]).filter(|node| *node > 0);
            let values: Option<Vec<f64>> = STRESSES_OF_POINT.iter().map(|&at| real(point[at])).collect();
            let Some((node, values)) = node.zip(values.and_then(|values| <[f64; 6]>::try_from(values).ok()))
            else {
                let message = format!("element {element} has a corner without a grid point or a stress");
                return wrong(message, REQUEST);
            };
            corners.push((node, values));
        }
        Ok((element, corners))
    }

    /// Returns the stresses at a grid point of a volume.
    fn grid_point(&self, record: &Record<'_>) -> Diagnosed<NodeStress> {
        let node = integer(record.head);
        let values: Option<Vec<f64>> = record.fields.iter().map(|field| real(field)).collect();
        let values = values.filter(|values| values.len() == FIELDS_OF_VOLUME);
        match node.zip(values.as_deref().and_then(<[f64]>::first_chunk::<6>)) {
            Some((node, values)) => Ok((node, *values)),
            None => {
                let numbers = record.fields.iter().filter(|field| real(field).is_some()).count();
                let message = format!(
                    "expected a grid point of a volume with eight values, found `{}` with {numbers}",
                    excerpt(record.head)
                );
                let help = "request GPSTRESS(PUNCH) of a VOLUME with SYSTEM BASIC, not of a SURFACE, or STRESS of elements";
                Err(self.wrong(record.line, message, help))
            }
        }
    }

    fn unexpected(&self, record: &Record<'_>, what: &str) -> Vec<Diagnostic> {
        let found = format!("`{}` with {} values", excerpt(record.head), record.fields.len());
        let help = "write the file again: it may be cut off";
        self.wrong(record.line, format!("expected {what}, found {found}"), help)
    }
}

/// Returns a clause about a heading of values in another form; `None` for any other heading.
fn other_form(line: &[u8]) -> Option<&'static str> {
    let forms: [(&[&str], &str); 4] = [
        (&["$REAL-IMAGINARY", "$MAGNITUDE"], "values are complex"),
        (&["$POINT ID", "$ELEMENT ID"], "values are sorted by points or elements (SORT2)"),
        (&["$FREQUENCY", "$TIME"], "values are those of a frequency or an instant"),
        (&["$SURFACE", "$PUNCHED IN MATERIAL"], "stresses are along the axes of a surface or of a material"),
    ];
    let is = |names: &[&str]| names.iter().any(|name| line.starts_with(name.as_bytes()));
    forms.into_iter().find(|(names, _)| is(names)).map(|(_, what)| what)
}

/// Returns the values of all subcases with the stresses of each node averaged over the corners of its elements.
fn steps(cases: BTreeMap<(i64, i64), Case>, file: &InputFile) -> Diagnosed<StepValues> {
    let about = |message: String| -> Vec<Diagnostic> {
        unreadable(file, message).into_iter().map(|found| found.with_help(REQUEST)).collect()
    };
    let (mut steps, mut averaged, mut elements) = (Vec::new(), Averaged::default(), None);
    for ((subcase, mode), mut case) in cases {
        let named = if mode == 0 { format!("subcase {subcase}") } else { format!("mode {mode}") };
        if case.displacements.is_empty() {
            return Err(about(format!("{named} has stresses and no displacements")));
        }
        if case.corners.is_empty() == case.grids.is_empty() {
            let found =
                if case.grids.is_empty() { "no stresses" } else { "stresses of elements and of grid points" };
            return Err(about(format!("{named} has {found}")));
        }
        case.elements.sort_unstable();
        if let Some(twice) = case.elements.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(about(format!("{named} has stresses of element {} twice", twice[0])));
        }
        if *elements.get_or_insert_with(|| case.elements.clone()) != case.elements {
            return Err(about(format!("{named} has stresses of other elements than those before")));
        }
        case.grids.sort_by_key(|(node, _)| *node);
        if let Some(twice) = case.grids.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err(about(format!("{named} has stresses of grid point {} twice", twice[0].0)));
        }
        case.corners.sort_by_key(|(node, _)| *node);
        let mut stresses = case.grids;
        stresses.extend(case.corners.chunk_by(|one, other| one.0 == other.0).map(mean));
        averaged.add_step(&case.corners, &stresses);
        let stresses = stresses.into_iter().map(|(node, values)| (Place::Node(node), values)).collect();
        steps.push(Step { stresses, displacements: case.displacements, energy: None });
    }
    let mut values = StepValues::of(steps, DIGITS, file)?.with_stresses(file)?;
    values.averaged = averaged;
    Ok(values)
}

/// Returns the mean of the stresses at the corners at one node.
fn mean(corners: &[NodeStress]) -> NodeStress {
    let sum = |k: usize| corners.iter().map(|(_, values)| values[k]).sum::<f64>();
    (corners[0].0, std::array::from_fn(|k| sum(k) / corners.len() as f64))
}
