//! The C99 header of a body: the committed template with its sizes on top, under names of its own.

use super::arrays::Content;
use super::layout::{ARRAYS, ArrayPosition, CHECKED_FROM, HEADER, VERSION, fixed_header, header_offset};
use flexbody_body::flex_body::FlexBody;
use std::fmt::Write;

/// The code, for a body that is called `flexbody`.
const TEMPLATE: &str = include_str!("body.h");

/// Longest part of a name that is the user's: C99 promises to tell names of 63 characters apart.
const LONGEST_NAME: usize = 24;

/// Header entries that the file must have, from the precision on.
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

/// The header that evaluates a file of `size` bytes whose arrays stand at `places`.
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

/// Name, modes and units of the body, for a comment.
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

/// The constants of a body as lines of C.
struct Defines(String);

impl Defines {
    fn put(&mut self, name: &str, value: &dyn std::fmt::Display) {
        writeln!(self.0, "#define FLEXBODY_{name} {value}").expect("strings take all text");
    }

    /// Sizes of the file and of the body.
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

    /// Places of the arrays, one by one and as the table of the file.
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

    /// What the code looks for in the file, and where.
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

/// Header entries that the code looks at one by one.
const EXAMINED: &[&str] = &["byte_order", "version", "size", "checksum", "precision"];

fn place<'p>(places: &'p [Option<ArrayPosition>], name: &str) -> Option<&'p ArrayPosition> {
    let at = ARRAYS.iter().position(|array| array.name == name)?;
    places[at].as_ref()
}

/// Indices of the frames that have names.
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

/// A name as a part of identifiers: small letters, digits and single underscores.
fn identifier(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let mut text = words.collect::<Vec<_>>().join("_").to_ascii_lowercase();
    text.truncate(LONGEST_NAME);
    text.trim_end_matches('_').to_owned()
}

/// A text for comments, which nothing in it can end.
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
