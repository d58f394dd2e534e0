//! Archives of Ansys (`CDWRITE`, .cdb): nodes in NBLOCK, components of nodes in CMBLOCK, elements in EBLOCK,
//! all in fields of fixed width.

use super::ansys_list::axes;
use super::errors::syntax;
use crate::node_file::NodeFile;
use crate::sets::{Item, Members, NodeSets, SetList};
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Lines, excerpt, field, integer, real};
use flexbody_model::{ElementShape, Elements};
use std::collections::HashMap;

/// Returns true when the text is an archive.
pub(super) fn recognises(head: &str) -> bool {
    head.lines().any(|line| {
        let line = line.trim_start().to_uppercase();
        line.starts_with("NBLOCK,") || line.starts_with("/COM,ANSYS") || line.starts_with("/PREP7")
    })
}

/// Reads all blocks of nodes, all components of nodes, and the elements.
pub(super) fn read(file: &InputFile) -> Diagnosed<NodeFile> {
    let text: Vec<&[u8]> = Lines::of(file.bytes()).map(|line| line.text).collect();
    let mut read = NodeFile::default();
    let mut sets = SetList::default();
    let mut types = Types::default();
    let mut at = 0;
    while at < text.len() {
        let head = String::from_utf8_lossy(text[at]).trim().to_uppercase();
        at = if head.starts_with("NBLOCK,") {
            nodes(file, &text, at, &mut read)?
        } else if head.starts_with("CMBLOCK,") {
            component(file, &text, at, &mut sets)?
        } else if head.starts_with("EBLOCK,") {
            read_eblock(&text, at, &types, &mut read.elements)
        } else {
            types.learn(&head);
            at + 1
        };
    }
    read.sets = NodeSets::of_nodes(&read.nodes.ids, sets);
    Ok(read)
}

/// Returns the widths of the fields of a line, from a Fortran format as in `(3i9,6e21.13e3)`: number and width of
/// integers, then of reals.
fn widths(format: &[u8]) -> Option<[(usize, usize); 2]> {
    let text = String::from_utf8_lossy(format).trim().to_lowercase();
    let inner = text.strip_prefix('(')?.strip_suffix(')')?.to_owned();
    let group = |part: &str, letter: char| -> Option<(usize, usize)> {
        let (count, width) = part.trim().split_once(letter)?;
        let width = width.split('.').next()?;
        Some((if count.is_empty() { 1 } else { count.parse().ok()? }, width.parse().ok()?))
    };
    let mut parts = inner.split(',');
    let whole = group(parts.next()?, 'i')?;
    let reals = match parts.next() {
        Some(part) => group(part, 'e').or_else(|| group(part, 'g')).or_else(|| group(part, 'f'))?,
        None => (0, 0),
    };
    let fits = |(count, width): (usize, usize)| count <= 1000 && width <= 1000;
    (fits(whole) && fits(reals)).then_some([whole, reals])
}

/// Field of a line of fixed width.
struct Field {
    is_real: bool,
    columns: std::ops::Range<usize>,
}

/// Returns the fields of a line by a Fortran format of numbers, as in `(3i9,6e21.13e3)` or `(1i7,2i9,6e21.13)`.
fn fields(format: &[u8]) -> Option<Vec<Field>> {
    let text = String::from_utf8_lossy(format).trim().to_lowercase();
    let inner = text.strip_prefix('(')?.strip_suffix(')')?;
    let mut fields: Vec<Field> = Vec::new();
    let mut end = 0;
    for part in inner.split(',').map(str::trim) {
        let letter = part.find(|c: char| c.is_ascii_alphabetic())?;
        let is_real = !part[letter..].starts_with('i');
        if is_real && !part[letter..].starts_with(['e', 'd', 'f', 'g']) {
            return None;
        }
        let count: usize = if letter == 0 { 1 } else { part[..letter].parse().ok()? };
        let width: usize = part[letter + 1..].split('.').next()?.parse().ok()?;
        if !(1..=1000).contains(&width) || count > 1000 {
            return None;
        }
        for _ in 0..count {
            fields.push(Field { is_real, columns: end..end + width });
            end += width;
        }
    }
    Some(fields)
}

/// Returns the k-th field of a width. Trailing fields may be missing.
fn nth_field(line: &[u8], k: usize, width: usize) -> &[u8] {
    field(line, k * width..(k + 1) * width)
}

fn nodes(file: &InputFile, text: &[&[u8]], head: usize, read: &mut NodeFile) -> Diagnosed<usize> {
    let all = text.get(head + 1).and_then(|line| fields(line)).unwrap_or_default();
    let (reals, whole): (Vec<&Field>, Vec<&Field>) = all.iter().partition(|field| field.is_real);
    let (Some(number), false) = (whole.first(), reals.is_empty()) else {
        let message = "the line below NBLOCK is not a format such as (3i9,6e21.13e3)".to_owned();
        return Err(syntax(file, head + 2, message));
    };
    for (k, line) in text.iter().enumerate().skip(head + 2) {
        let end = line.trim_ascii();
        if end.starts_with(b"N,") || end.starts_with(b"-1") {
            return Ok(k + 1);
        }
        if end.is_empty() {
            continue;
        }
        let id = integer(field(line, number.columns.clone()));
        // Three coordinates, and three angles of rotated nodes.
        let mut values = [0.0; 6];
        let mut good = id.is_some();
        for (value, place) in values.iter_mut().zip(&reals) {
            let text = field(line, place.columns.clone());
            // Zeros at the end of a line are left out.
            match if text.is_empty() { Some(0.0) } else { real(text) } {
                Some(number) => *value = number,
                None => good = false,
            }
        }
        let (Some(id), true) = (id, good) else {
            return Err(syntax(
                file,
                k + 1,
                format!("NBLOCK: expected a node and coordinates, found `{}`", excerpt(end)),
            ));
        };
        read.nodes.ids.push(id);
        let [x, y, z, xy, yz, zx] = values;
        read.nodes.positions.push([x, y, z]);
        read.axes.extend(axes([xy, yz, zx]).map(|axes| (id, axes)));
    }
    Err(syntax(file, text.len(), "file ends within NBLOCK: it may be cut off".to_owned()))
}

/// Reads a component, which is a set if its members are nodes. Returns the index of the line after it.
fn component(file: &InputFile, text: &[&[u8]], head: usize, sets: &mut SetList) -> Diagnosed<usize> {
    let line = String::from_utf8_lossy(text[head]).into_owned();
    let words: Vec<&str> = line.split(',').map(str::trim).collect();
    let of_nodes = words.get(2).is_some_and(|kind| kind.to_uppercase().starts_with("NODE"));
    let count = words
        .get(3)
        .and_then(|count| count.split('!').next())
        .and_then(|count| count.trim().parse::<usize>().ok());
    let format = text.get(head + 1).and_then(|line| widths(line));
    let (Some(name), Some(count), Some([(per_line, width), _])) = (words.get(1), count, format) else {
        return Err(syntax(
            file,
            head + 1,
            format!(
                "CMBLOCK: expected a name, a kind, a count and a format, found `{}`",
                excerpt(text[head])
            ),
        ));
    };
    let lines = count.div_ceil(per_line.max(1));
    let mut items = Vec::new();
    let mut numbers: Vec<i64> = Vec::new();
    let mut last = None;
    for k in 0..count {
        let line = text.get(head + 2 + k / per_line.max(1)).copied().unwrap_or_default();
        let Some(member) = integer(nth_field(line, k % per_line.max(1), width)) else {
            return Err(syntax(
                file,
                head + 3 + k / per_line.max(1),
                format!("CMBLOCK `{name}`: expected {count} numbers"),
            ));
        };
        // A negative number ends a range that the preceding number begins.
        match last {
            Some(first) if member < 0 => {
                let last = member.saturating_neg();
                items.push(Item::own(Members::Numbers(std::mem::take(&mut numbers))));
                items.push(Item::own(Members::Range { first, last, step: 1 }));
            }
            _ => numbers.push(member),
        }
        last = Some(member.saturating_abs());
    }
    items.push(Item::own(Members::Numbers(numbers)));
    if of_nodes {
        sets.add(name, items);
    }
    Ok(head + 2 + lines)
}

// Elements of an archive of Ansys, for drawing the part. Unreadable elements are left out and reported.

/// Element types by their local numbers, as defined by `ET,1,186`.
#[derive(Debug, Default)]
struct Types(HashMap<i64, i64>);

/// Numbers of solid element types.
const SOLIDS: &[i64] = &[
    5, 45, 46, 62, 64, 65, 72, 73, 92, 95, 96, 98, 147, 148, 164, 168, 185, 186, 187, 190, 191, 226, 227, 285,
];
/// Numbers of shell and plane element types.
const SHELLS: &[i64] =
    &[2, 28, 41, 42, 43, 63, 82, 91, 93, 99, 143, 145, 146, 150, 162, 163, 181, 182, 183, 281];
/// Numbers of beam, pipe and link element types with two end nodes.
const BEAMS: &[i64] = &[1, 3, 4, 8, 10, 16, 23, 24, 44, 54, 59, 161, 180, 188, 288];
/// Numbers of beam element types with a middle node.
const LONG_BEAMS: &[i64] = &[189, 289];
/// Numbers of element types that are not drawn.
const NOT_DRAWN: &[i64] = &[
    14, 21, 27, 39, 40, 50, 151, 152, 153, 154, 156, 169, 170, 171, 172, 173, 174, 175, 176, 177, 178, 179,
    184,
];

/// Shape class of the elements of a type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    Solid,
    Shell,
    /// Two end nodes; a third node defines the orientation of the beam.
    Beam,
    /// Two end nodes and a node in the middle.
    LongBeam,
    /// Masses, springs, contact and surface loads, which are not drawn.
    Nothing,
    Unknown,
}

impl Types {
    /// Records a type from a line in upper case, if it is `ET,number,type`.
    fn learn(&mut self, line: &str) {
        let mut words = line.split(',').map(str::trim);
        if words.next() != Some("ET") {
            return;
        }
        let number = words.next().and_then(|word| word.parse().ok());
        let digits = words.next().map(|word| word.trim_start_matches(|c: char| !c.is_ascii_digit()));
        if let (Some(number), Some(kind)) = (number, digits.and_then(|digits| digits.parse().ok())) {
            self.0.insert(number, kind);
        }
    }

    fn look(&self, number: i64) -> (String, Look) {
        let Some(&kind) = self.0.get(&number) else {
            return (format!("type number {number}"), Look::Unknown);
        };
        let looks = [
            (SOLIDS, Look::Solid),
            (SHELLS, Look::Shell),
            (BEAMS, Look::Beam),
            (LONG_BEAMS, Look::LongBeam),
            (NOT_DRAWN, Look::Nothing),
        ];
        let look =
            looks.iter().find(|(kinds, _)| kinds.contains(&kind)).map_or(Look::Unknown, |(_, look)| *look);
        (format!("element type {kind}"), look)
    }
}

/// Number of fields of a line of an element before its nodes.
const BEFORE_NODES: usize = 11;

/// Reads the block whose heading is the line `head`. Returns the index of the line after it.
fn read_eblock(text: &[&[u8]], head: usize, types: &Types, read: &mut Elements) -> usize {
    let line = String::from_utf8_lossy(text[head]).to_uppercase();
    let solid = line.split(',').nth(2).is_some_and(|kind| kind.trim() == "SOLID");
    let width = text.get(head + 1).and_then(|line| widths(line)).map_or(0, |[(_, width), _]| width);
    let end = (head + 2..text.len()).find(|&k| text[k].trim_ascii() == b"-1").unwrap_or(text.len());
    if !solid || width == 0 {
        read.leave_out("EBLOCK in another form than SOLID", 1);
        return end + 1;
    }
    let mut at = (head + 2).min(end);
    while at < end {
        at = match element(&text[at..end], width) {
            Some(element) => {
                add(&element, types, read);
                at + element.lines
            }
            None => {
                read.leave_out("EBLOCK with lines that cannot be read", 1);
                return end + 1;
            }
        };
    }
    end + 1
}

struct Element {
    type_number: i64,
    nodes: Vec<i64>,
    lines: usize,
}

/// Reads the element that begins on the first of the lines; returns `None` if it cannot be read.
fn element(text: &[&[u8]], width: usize) -> Option<Element> {
    let number = |line: &[u8], k: usize| integer(nth_field(line, k, width));
    let first = *text.first()?;
    let count = usize::try_from(number(first, 8)?).ok().filter(|count| (1..=100).contains(count))?;
    let type_number = number(first, 1)?;
    let mut nodes = Vec::with_capacity(count);
    let mut lines = 1;
    let mut k = BEFORE_NODES;
    while nodes.len() < count {
        let line = text.get(lines - 1)?;
        match number(line, k) {
            Some(node) => {
                nodes.push(node);
                k += 1;
            }
            // The nodes continue in the next line.
            None if k > 0 && nth_field(line, k, width).is_empty() => {
                lines += 1;
                k = 0;
            }
            None => return None,
        }
    }
    Some(Element { type_number, nodes, lines })
}

fn add(element: &Element, types: &Types, read: &mut Elements) {
    let (name, look) = types.look(element.type_number);
    let nodes = &element.nodes;
    let shape = match (look, nodes.len()) {
        (Look::Nothing, _) => return,
        (Look::Solid, 4 | 10) => ElementShape::Tetrahedron,
        (Look::Solid, 5 | 13) => ElementShape::Pyramid,
        (Look::Solid, 6 | 15) => ElementShape::Wedge,
        (Look::Solid, 8 | 20) => ElementShape::Hexahedron,
        (Look::Shell, 3 | 6) => ElementShape::Triangle,
        (Look::Shell, 4 | 8) => ElementShape::Quadrilateral,
        (Look::Beam, 2..) | (Look::LongBeam, 3..) => ElementShape::Line,
        _ => return read.leave_out(&name, 1),
    };
    let nodes = match look {
        Look::Beam => nodes[..2].to_vec(),
        Look::LongBeam => nodes[..3].to_vec(),
        _ => with_all_middles(shape, nodes),
    };
    read.add(&name, shape, &nodes);
}

/// Replaces missing mid-edge nodes, which have the number 0, by a corner of their edge.
fn with_all_middles(shape: ElementShape, nodes: &[i64]) -> Vec<i64> {
    let mut nodes = nodes.to_vec();
    for (k, &[corner, _]) in shape.edges().iter().enumerate() {
        let corner = nodes[corner];
        if let Some(middle) = nodes.get_mut(shape.corners() + k).filter(|node| **node == 0) {
            *middle = corner;
        }
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_follow_any_format_of_numbers() {
        let of = |format: &str| {
            let found = fields(format.as_bytes())?;
            Some(found.into_iter().map(|field| (field.is_real, field.columns)).collect::<Vec<_>>())
        };
        let workbench = of("(1i7,2i9,6e21.13)").expect("a format");
        assert_eq!(workbench[..4], [(false, 0..7), (false, 7..16), (false, 16..25), (true, 25..46)]);
        assert_eq!(workbench.len(), 9);
        assert_eq!(of("(3i9,6e21.13e3)").expect("a format")[3], (true, 27..48));
        assert_eq!(of("(I8, 2F16.8)"), Some(vec![(false, 0..8), (true, 8..24), (true, 24..40)]));
        for bad in ["3i9", "(something)", "(i0,3e9.2)", "(3i99999999999999999,6e21.13)", "(2000i8)"] {
            assert_eq!(of(bad), None, "{bad}");
        }
    }

    #[test]
    fn nodes_of_workbench_are_read_by_the_format_of_their_block() {
        let mut text = String::from("/PREP7\nNBLOCK,6,SOLID,12,2\n(1i7,2i9,6e21.13)\n");
        for (id, x) in [(5, 0.25), (12, -1.5)] {
            text += &format!("{id:7}{:9}{:9}{x:21.13e}{:21.13e}{:21.13e}\n", 0, 0, 2.0 * x, 3.0 * x);
        }
        text += "N,R5.3,LOC,-1,\n";
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("part.cdb");
        std::fs::write(&path, text).expect("written");
        let found = read(&InputFile::open(&path).expect("a file")).expect("nodes").nodes;
        assert_eq!(found.ids, [5, 12]);
        assert_eq!(found.positions, [[0.25, 0.5, 0.75], [-1.5, -3.0, -4.5]]);
    }
}
