//! C99 header of a body: the committed template with the sizes of the body in front, under names of its own.

use super::arrays::Content;
use super::layout::{ARRAYS, ArrayPosition, CHECKED_FROM, HEADER, VERSION, fixed_header, header_offset};
use flexbody_body::flex_body::FlexBody;
use std::fmt::Write;

/// Code template for a body named `flexbody`.
const TEMPLATE: &str = include_str!("body.h");

/// Longest part of an identifier taken from the name of the body: C99 guarantees 63 significant characters
/// only.
const LONGEST_NAME: usize = 24;

/// Returns the header entries that the file must have, from the precision on.
pub(crate) fn expected(content: &Content, body: &FlexBody, precision: usize) -> [u32; 6] {
    [
        precision as u32,
        body.n_modes() as u32,
        content.translations as u32,
        content.axes as u32,
        content.frames.len() as u32,
        content.terms,
    ]
}

/// Returns the header that evaluates a file of `size` bytes with arrays at `places`.
pub(crate) fn header(
    body: &FlexBody,
    content: &Content,
    places: &[Option<ArrayPosition>],
    precision: usize,
    size: usize,
) -> String {
    let mut sizes = Defines(String::new());
    sizes.body(body, content, places, precision, size);
    sizes.arrays(places);
    sizes.file(&expected(content, body, precision));
    let real = if precision == 8 { "double" } else { "float" };
    sizes.0 += &format!("\ntypedef {real} flexbody_real;\n{}", frame_names(content));
    let text = TEMPLATE.replace("/* SIZES */", sizes.0.trim_end()).replace("SUMMARY", &summary(body));
    let own = identifier(&body.source().name);
    if own.is_empty() {
        return text;
    }
    text.replace("flexbody_", &format!("flexbody_{own}_"))
        .replace("FLEXBODY_", &format!("FLEXBODY_{}_", own.to_uppercase()))
}

/// Returns name, modes and units of the body for a comment.
fn summary(body: &FlexBody) -> String {
    let units = body.units();
    format!(
        "Body `{}`: {} modes, units {}, {}, {}.",
        plain(&body.source().name),
        body.n_modes(),
        plain(units.length.name()),
        plain(units.mass.name()),
        plain(units.time.name())
    )
}

/// Constants of a body as C macros.
struct Defines(String);

impl Defines {
    fn put(&mut self, name: &str, value: &dyn std::fmt::Display) {
        writeln!(self.0, "#define FLEXBODY_{name} {value}").expect("strings take all text");
    }

    /// Writes the sizes of the file and of the body.
    fn body(
        &mut self,
        body: &FlexBody,
        content: &Content,
        places: &[Option<ArrayPosition>],
        precision: usize,
        size: usize,
    ) {
        let columns = |name: &str| place(places, name).map_or(0, |place| place.columns);
        self.put("LAYOUT", &VERSION);
        self.put("BYTES", &format_args!("{size}u"));
        self.put("PRECISION", &precision);
        self.put("MODES", &body.n_modes());
        self.put("TRANSLATIONS", &content.translations);
        self.put("AXES", &content.axes);
        self.put("FRAMES", &content.frames.len());
        self.put("ROTATIONS", &(columns("frame_rotation") / content.axes));
        self.put("SECONDS", &(columns("frame_second") / body.n_modes()));
        self.put("HAS_W1", &(content.terms & 1));
    }

    /// Writes the positions of the arrays, individually and as the table of the file.
    fn arrays(&mut self, places: &[Option<ArrayPosition>]) {
        for (array, place) in ARRAYS.iter().zip(places) {
            let name = array.name.to_uppercase();
            self.put(&format!("HAS_{name}"), &u8::from(place.is_some()));
            if let Some(place) = place {
                self.put(&format!("OFFSET_{name}"), &format_args!("{}u", place.offset));
                self.put(&format!("COLUMNS_{name}"), &place.columns);
                self.put(&format!("STRIDE_{name}"), &place.stride);
            }
        }
        let entry = |place: &Option<ArrayPosition>| {
            let [offset, rows, columns, stride] = ArrayPosition::entry(place.as_ref());
            format!("{offset}u, {rows}u, {columns}u, {stride}u")
        };
        let entries: Vec<String> = places.iter().map(entry).collect();
        self.put("TABLE", &entries.join(", \\\n    "));
    }

    /// Writes the header values that the code checks, and their offsets.
    fn file(&mut self, expected: &[u32]) {
        let values: Vec<String> = expected.iter().map(|value| format!("{value}u")).collect();
        self.put("HEADER", &values.join(", "));
        for (name, ..) in HEADER.iter().filter(|(name, ..)| EXAMINED.contains(name)) {
            self.put(&format!("AT_{}", name.to_uppercase()), &header_offset(name));
        }
        self.put("AT_TABLE", &fixed_header());
        self.put("CHECKED_FROM", &CHECKED_FROM);
    }
}

/// Header entries that the code checks individually.
const EXAMINED: &[&str] = &["byte_order", "version", "size", "checksum", "precision"];

fn place<'p>(places: &'p [Option<ArrayPosition>], name: &str) -> Option<&'p ArrayPosition> {
    let at = ARRAYS.iter().position(|array| array.name == name)?;
    places[at].as_ref()
}

/// Returns macros with the indices of named frames.
fn frame_names(content: &Content) -> String {
    let own = |name: &str| identifier(name).to_uppercase();
    let named: Vec<(usize, i64, String)> = content
        .frames
        .iter()
        .enumerate()
        .filter_map(|(at, frame)| Some((at, frame.id, own(frame.name.as_ref()?))))
        .collect();
    if named.is_empty() {
        return String::new();
    }
    let lines: Vec<String> = named
        .iter()
        .map(|(at, number, name)| {
            let alone = named.iter().filter(|(.., other)| other == name).count() == 1;
            let name = if alone && !name.is_empty() { name.clone() } else { format!("{name}_AT_{at}") };
            format!("    FLEXBODY_FRAME_{name} = {at} /* number {number} */")
        })
        .collect();
    format!(
        "\n/* Indices of the frames of interfaces. */\nenum {{\n{}\n}};\n",
        lines.join(",\n").replace(" /*", ", /*").replace("*/,", "*/")
    )
}

/// Returns a name as a part of identifiers: lower-case letters, digits and single underscores.
fn identifier(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let mut text = words.collect::<Vec<_>>().join("_").to_ascii_lowercase();
    text.truncate(LONGEST_NAME);
    text.trim_end_matches('_').to_owned()
}

/// Returns a text for C comments, without characters that could end the comment.
fn plain(text: &str) -> String {
    let kept = |c: char| c.is_ascii_alphanumeric() || " .,_+-^()".contains(c);
    text.chars().take(80).map(|c| if kept(c) { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_bodies_become_identifiers() {
        assert_eq!(identifier("Turbine blade (v2)"), "turbine_blade_v2");
        assert_eq!(identifier("*/ système ??/"), "syst_me");
        assert_eq!(identifier("ä"), "");
        assert_eq!(identifier(&"a-".repeat(40)).len(), LONGEST_NAME - 1);
        assert_eq!(plain("a*/b\n??/"), "a__b____");
    }
}
