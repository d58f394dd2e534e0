//! Results of CalculiX (.frd): text with six digits, or text with blocks of 32-bit or 64-bit numbers. The blocks are
//! described in the manual of CalculiX GraphiX, section "Result format".

use super::step_values::{COMPONENTS, Place, Step, StepValues, unreadable};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{excerpt, field, integer, line_end, line_number, real};
use std::collections::HashMap;

/// Returns true if a file begins like results of CalculiX.
pub(super) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"    1C")
}

/// Number of characters of a value.
const WIDTH: usize = 12;

/// Number of values in a line.
const VALUES_PER_LINE: usize = 6;

/// Form of the numbers of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// Text with node numbers of five or ten characters.
    Text { start: usize },
    /// 32-bit floats.
    Single,
    /// 64-bit floats.
    Double,
}

impl Form {
    fn of(flag: &[u8]) -> Option<Self> {
        match flag {
            b"0" => Some(Self::Text { start: 8 }),
            b"1" => Some(Self::Text { start: 13 }),
            b"2" => Some(Self::Single),
            b"3" => Some(Self::Double),
            _ => None,
        }
    }

    /// Returns the number of significant decimal digits.
    fn digits(self) -> u8 {
        match self {
            Self::Text { .. } => 6,
            Self::Single => 7,
            Self::Double => 15,
        }
    }
}

/// Reads stresses and displacements of all steps.
///
/// # Errors
/// FB327.
pub(super) fn read(file: &InputFile) -> Diagnosed<StepValues> {
    let mut reading = FrdReading {
        file,
        bytes: file.bytes(),
        at: 0,
        steps: Vec::new(),
        number: None,
        digits: u8::MAX,
        materials: HashMap::new(),
    };
    reading.all()?;
    let FrdReading { steps, digits, materials, .. } = reading;
    let mut values = StepValues::of(steps, digits.min(15), file)?.with_stresses(file)?;
    let is_mixed = |place: &Place| match place {
        Place::Node(node) => (materials.get(node) == Some(&Material::Several)).then_some(*node),
        Place::Point { .. } => None,
    };
    values.averaged.over_materials = values.places.iter().filter_map(is_mixed).collect();
    Ok(values)
}

/// Materials of the elements at a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Material {
    One(i64),
    Several,
}

struct FrdReading<'f> {
    file: &'f InputFile,
    bytes: &'f [u8],
    /// First byte that is not read yet.
    at: usize,
    steps: Vec<Step>,
    /// Number of the last step, increment or mode.
    number: Option<i64>,
    /// Fewest digits of any block.
    digits: u8,
    materials: HashMap<i64, Material>,
}

/// Heading of a block of values (`100C`).
struct Heading {
    /// Number of the step, increment or mode.
    number: i64,
    count: usize,
    form: Form,
}

impl<'f> FrdReading<'f> {
    fn all(&mut self) -> Diagnosed<()> {
        let mut heading = None;
        while self.at < self.bytes.len() {
            let (start, line) = self.line();
            if line.starts_with(b"    2C") {
                self.skip_nodes(start, line)?;
            } else if line.starts_with(b"    3C") {
                self.elements(start, line)?;
            } else if line.starts_with(b"  100C") {
                heading = Some(self.heading(start, line)?);
            } else if line.starts_with(b" -4") {
                if let Some(heading) = heading.take() {
                    self.block(line, &heading)?;
                }
            } else if line.starts_with(b" 9999") {
                return Ok(());
            }
        }
        Err(unreadable(self.file, "the file is cut off: it does not end with 9999"))
    }

    /// Returns the start and the text of the next line, without its end.
    fn line(&mut self) -> (usize, &'f [u8]) {
        let start = self.at;
        let end = line_end(self.bytes, start);
        self.at = end;
        (start, self.bytes[start..end].trim_ascii_end())
    }

    /// Returns the next `count` records of `size` bytes.
    fn records(&mut self, count: usize, size: usize) -> Diagnosed<std::slice::ChunksExact<'f, u8>> {
        let end = count.checked_mul(size).and_then(|bytes| self.at.checked_add(bytes));
        let Some(end) = end.filter(|end| *end <= self.bytes.len()) else {
            return Err(unreadable(self.file, "the file is cut off within a block of numbers"));
        };
        let records = self.bytes[self.at..end].chunks_exact(size);
        self.at = end;
        Ok(records)
    }

    /// Returns FB327 at the line that begins at a byte.
    fn wrong(&self, start: usize, what: &str, found: &[u8]) -> Vec<Diagnostic> {
        let message = format!("expected {what}, found `{}`", excerpt(found));
        let diagnostic = Diagnostic::new(Code::FeResultsSyntax, message).in_file(self.file.path());
        vec![diagnostic.at_line(line_number(self.bytes, start))]
    }

    /// Passes the block of the nodes.
    fn skip_nodes(&mut self, start: usize, line: &[u8]) -> Diagnosed<()> {
        let (count, form) = self.counted(start, line)?;
        match form {
            Form::Text { .. } => self.skip_text(),
            Form::Single => self.records(count, 4 + 3 * 4).map(drop)?,
            Form::Double => self.records(count, 4 + 3 * 8).map(drop)?,
        }
        Ok(())
    }

    /// Passes lines to the end of a block of text.
    fn skip_text(&mut self) {
        while self.at < self.bytes.len() && !self.line().1.starts_with(b" -3") {}
    }

    /// Returns the number of records and the form of the numbers from the heading of nodes or elements.
    fn counted(&self, start: usize, line: &[u8]) -> Diagnosed<(usize, Form)> {
        let count = integer(field(line, 24..36)).and_then(|count| usize::try_from(count).ok());
        let form = Form::of(field(line, 73..75));
        count.zip(form).ok_or_else(|| self.wrong(start, "a number of records and their form", line))
    }

    /// Reads the materials at the nodes from the elements.
    fn elements(&mut self, start: usize, line: &'f [u8]) -> Diagnosed<()> {
        let (count, form) = self.counted(start, line)?;
        if let Form::Text { start } = form {
            return self.elements_in_text(start - 3);
        }
        for _ in 0..count {
            let head = integers(self.records(1, 16)?.next().unwrap_or_default());
            let &[_, kind, _, material] = head.as_slice() else { continue };
            let Some(nodes) = nodes_of_kind(kind) else {
                return Err(self.wrong(start, "elements of known types", format!("type {kind}").as_bytes()));
            };
            let members = integers(self.records(1, 4 * nodes)?.next().unwrap_or_default());
            members.into_iter().for_each(|node| self.has_material(node, material));
        }
        Ok(())
    }

    /// Reads elements whose node numbers have `width` characters.
    fn elements_in_text(&mut self, width: usize) -> Diagnosed<()> {
        let mut material = 0;
        while self.at < self.bytes.len() {
            let (start, line) = self.line();
            let numbers =
                || line.get(3..).unwrap_or_default().chunks(width).map(|part| integer(part.trim_ascii()));
            if line.starts_with(b" -3") {
                return Ok(());
            } else if line.starts_with(b" -1") {
                let own = line.rsplit(|b| *b == b' ').next().and_then(integer);
                material = own.ok_or_else(|| self.wrong(start, "an element with its material", line))?;
            } else if line.starts_with(b" -2") {
                let nodes: Option<Vec<i64>> = numbers().collect();
                let nodes = nodes.ok_or_else(|| self.wrong(start, "nodes of an element", line))?;
                nodes.into_iter().for_each(|node| self.has_material(node, material));
            }
        }
        Ok(())
    }

    fn has_material(&mut self, node: i64, material: i64) {
        let known = self.materials.entry(node).or_insert(Material::One(material));
        if *known != Material::One(material) {
            *known = Material::Several;
        }
    }

    fn heading(&self, start: usize, line: &[u8]) -> Diagnosed<Heading> {
        let (count, form) = self.counted(start, line)?;
        match integer(field(line, 58..63)) {
            Some(number) => Ok(Heading { number, count, form }),
            None => Err(self.wrong(start, "the number of a step", line)),
        }
    }

    /// Reads a block of displacements or stresses; passes others.
    fn block(&mut self, line: &'f [u8], heading: &Heading) -> Diagnosed<()> {
        let name = field(line, 5..13);
        let components = self.components();
        let wanted: Option<Vec<usize>> = match name {
            b"DISP" => named(&components, ["D1", "D2", "D3"].iter().map(|name| (*name).to_owned())),
            b"STRESS" => {
                // The file has SZX for xz.
                let names = COMPONENTS.map(|name| if name == "xz" { "zx" } else { name });
                named(&components, names.iter().map(|name| format!("S{}", name.to_uppercase())))
            }
            _ => None,
        };
        let records = self.values(heading, components.len(), wanted.is_some())?;
        let Some(wanted) = wanted else { return Ok(()) };
        self.digits = self.digits.min(heading.form.digits());
        let is_stress = name == b"STRESS";
        let has_values =
            |step: &Step| if is_stress { !step.stresses.is_empty() } else { !step.displacements.is_empty() };
        // Each step, increment or mode has one block of displacements and one of stresses, in any order.
        let is_new = self.number != Some(heading.number) || self.steps.last().is_none_or(has_values);
        if is_new {
            self.steps.push(Step::default());
        }
        self.number = Some(heading.number);
        let step = self.steps.last_mut().expect("a step was begun");
        let place = |values: &[f64], k: usize| values[wanted[k]];
        for (node, values) in &records {
            if is_stress {
                step.stresses.push((Place::Node(*node), std::array::from_fn(|k| place(values, k))));
            } else {
                step.displacements.push((*node, std::array::from_fn(|k| place(values, k))));
            }
        }
        Ok(())
    }

    /// Reads the names of the stored components of a block.
    fn components(&mut self) -> Vec<&'f [u8]> {
        let mut names = Vec::new();
        while self.bytes[self.at..].starts_with(b" -5") {
            let (_, line) = self.line();
            // A component that GraphiX computes from others has a mark and no values.
            if field(line, 33..38) != b"1" {
                names.push(field(line, 5..13));
            }
        }
        names
    }

    /// Reads the numbers of the nodes and their values.
    fn values(
        &mut self,
        heading: &Heading,
        components: usize,
        wanted: bool,
    ) -> Diagnosed<Vec<(i64, Vec<f64>)>> {
        let Heading { count, form, .. } = *heading;
        match form {
            Form::Text { .. } if !wanted => {
                self.skip_text();
                Ok(Vec::new())
            }
            Form::Text { start } => self.values_in_text(count, start, components),
            Form::Single => {
                let of = |record: &[u8]| {
                    let values =
                        record[4..].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
                    (integers(&record[..4])[0], values.map(f64::from).collect())
                };
                Ok(self.records(count, 4 + 4 * components)?.map(of).collect())
            }
            Form::Double => {
                let of = |record: &[u8]| {
                    let values = record[4..].chunks_exact(8);
                    let value = |b: &[u8]| f64::from_le_bytes(b.try_into().expect("eight bytes"));
                    (integers(&record[..4])[0], values.map(value).collect())
                };
                Ok(self.records(count, 4 + 8 * components)?.map(of).collect())
            }
        }
    }

    fn values_in_text(
        &mut self,
        count: usize,
        start: usize,
        components: usize,
    ) -> Diagnosed<Vec<(i64, Vec<f64>)>> {
        let mut records: Vec<(i64, Vec<f64>)> = Vec::new();
        while self.at < self.bytes.len() {
            let (at, line) = self.line();
            let wrong = || self.wrong(at, "a node and its values", line);
            let more = || -> Option<Vec<f64>> {
                let text = line.get(start..)?;
                text.chunks(WIDTH).take(VALUES_PER_LINE).map(|value| real(value.trim_ascii())).collect()
            };
            if line.starts_with(b" -1") {
                let node = line.get(3..start).and_then(|field| integer(field.trim_ascii()));
                records.push(node.zip(more()).ok_or_else(wrong)?);
            } else if line.starts_with(b" -2") {
                let more = more().ok_or_else(wrong)?;
                records.last_mut().ok_or_else(wrong)?.1.extend(more);
            } else if line.starts_with(b" -3") {
                let is_whole = |(_, values): &(i64, Vec<f64>)| values.len() == components;
                if records.len() != count || !records.iter().all(is_whole) {
                    return Err(self.wrong(
                        at,
                        &format!("{count} nodes with {components} values each"),
                        line,
                    ));
                }
                return Ok(records);
            } else {
                return Err(wrong());
            }
        }
        Err(unreadable(self.file, "the file is cut off within a block of numbers"))
    }
}

/// Returns the places of the components with these names; `None` if one is missing.
fn named(components: &[&[u8]], names: impl Iterator<Item = String>) -> Option<Vec<usize>> {
    names.map(|name| components.iter().position(|known| *known == name.as_bytes())).collect()
}

/// Returns 32-bit integers.
fn integers(bytes: &[u8]) -> Vec<i64> {
    bytes.chunks_exact(4).map(|b| i64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]]))).collect()
}

/// Returns the number of nodes of an element type of the format.
fn nodes_of_kind(kind: i64) -> Option<usize> {
    const NODES: [usize; 12] = [8, 6, 4, 20, 15, 10, 3, 6, 4, 8, 2, 3];
    NODES.get(usize::try_from(kind - 1).ok()?).copied()
}
