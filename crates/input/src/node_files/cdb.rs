//! Archives of Ansys (`CDWRITE`, .cdb): nodes in NBLOCK, components of nodes in CMBLOCK, elements in EBLOCK,
//! all in fields of fixed width.

mod eblock;

use super::ansys_axes::axes;
use super::{Found, NodeFile, syntax};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Lines, excerpt, field, integer, real};

/// Returns true when the text is an archive.
pub(super) fn recognises(head: &str) -> bool {
    head.lines().any(|line| {
        let line = line.trim_start().to_uppercase();
        line.starts_with("NBLOCK,") || line.starts_with("/COM,ANSYS") || line.starts_with("/PREP7")
    })
}

/// Reads all blocks of nodes, all components of nodes, and the elements.
pub(super) fn read(file: &InputFile) -> Found<NodeFile> {
    let text: Vec<&[u8]> = Lines::of(file.bytes()).map(|line| line.text).collect();
    let mut read = NodeFile::default();
    let mut types = eblock::Types::default();
    let mut at = 0;
    while at < text.len() {
        let head = String::from_utf8_lossy(text[at]).trim().to_uppercase();
        at = if head.starts_with("NBLOCK,") {
            nodes(file, &text, at, &mut read)?
        } else if head.starts_with("CMBLOCK,") {
            component(file, &text, at, &mut read)?
        } else if head.starts_with("EBLOCK,") {
            eblock::elements(&text, at, &types, &mut read.elements)
        } else {
            types.learn(&head);
            at + 1
        };
    }
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

/// Returns the k-th field of a width. Trailing fields may be missing.
fn nth_field(line: &[u8], k: usize, width: usize) -> &[u8] {
    field(line, k * width..(k + 1) * width)
}

fn nodes(file: &InputFile, text: &[&[u8]], head: usize, read: &mut NodeFile) -> Found<usize> {
    let format = text.get(head + 1).and_then(|line| widths(line));
    let Some([(count, width), (reals, length)]) = format.filter(|[whole, reals]| whole.1 > 0 && reals.1 > 0)
    else {
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
        let id = integer(nth_field(line, 0, width));
        // Three coordinates, and three angles of rotated nodes.
        let mut values = [0.0; 6];
        let mut good = id.is_some();
        for (axis, value) in values.iter_mut().enumerate().take(reals) {
            let start = count * width + axis * length;
            let text = field(line, start..start + length);
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

fn component(file: &InputFile, text: &[&[u8]], head: usize, read: &mut NodeFile) -> Found<usize> {
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
    let mut known = read.nodes.ids.clone();
    known.sort_unstable();
    let mut members: Vec<i64> = Vec::new();
    for k in 0..count {
        let line = text.get(head + 2 + k / per_line.max(1)).copied().unwrap_or_default();
        let Some(member) = integer(nth_field(line, k % per_line.max(1), width)) else {
            return Err(syntax(
                file,
                head + 3 + k / per_line.max(1),
                format!("CMBLOCK `{name}`: expected {count} numbers"),
            ));
        };
        match members.last() {
            // A negative number ends a range that the preceding number begins.
            Some(&first) if member < 0 => {
                let after = known.partition_point(|id| *id <= first);
                members.extend(known[after..].iter().take_while(|id| **id <= member.saturating_neg()));
            }
            _ => members.push(member),
        }
    }
    if of_nodes {
        read.sets.push(((*name).to_owned(), members));
    }
    Ok(head + 2 + lines)
}
