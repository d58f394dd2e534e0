//! The C99 header of a body: the committed template with its sizes on top, under names of its own.

use super::arrays::Content;
use super::layout::{ARRAYS, ArrayPosition, CHECKED_FROM, HEADER, VERSION, fixed_header, header_offset};
use crate::body::flex_body::FlexBody;
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
    let own = plain(&body.source().name);
    let mut sizes = String::new();
    let mut define = |name: &str, value: &dyn std::fmt::Display| {
        writeln!(sizes, "#define FLEXBODY_{name} {value}").expect("strings take all text");
    };
    define("LAYOUT", &VERSION);
    define("BYTES", &format_args!("{size}u"));
    define("PRECISION", &precision);
    define("MODES", &body.n_modes());
    define("TRANSLATIONS", &content.translations);
    define("AXES", &content.axes);
    define("FRAMES", &content.frames.len());
    let columns = |name: &str| place(places, name).map_or(0, |place| place.columns);
    define("ROTATIONS", &(columns("frame_rotation") / content.axes));
    define("SECONDS", &(columns("frame_second") / body.n_modes()));
    define("HAS_W1", &(content.terms & 1));
    for (array, place) in ARRAYS.iter().zip(places) {
        let name = array.name.to_uppercase();
        define(&format!("HAS_{name}"), &u8::from(place.is_some()));
        if let Some(place) = place {
            define(&format!("OFFSET_{name}"), &format_args!("{}u", place.offset));
            define(&format!("COLUMNS_{name}"), &place.columns);
            define(&format!("STRIDE_{name}"), &place.stride);
        }
    }
    let entries: Vec<String> = places
        .iter()
        .map(|place| {
            let [offset, rows, columns, stride] = ArrayPosition::entry(place.as_ref());
            format!("{offset}u, {rows}u, {columns}u, {stride}u")
        })
        .collect();
    define("TABLE", &entries.join(", \\\n    "));
    let values: Vec<String> =
        expected(content, body, precision).iter().map(|value| format!("{value}u")).collect();
    define("HEADER", &values.join(", "));
    for (name, ..) in HEADER.iter().filter(|(name, ..)| EXAMINED.contains(name)) {
        define(&format!("AT_{}", name.to_uppercase()), &header_offset(name));
    }
    define("AT_TABLE", &fixed_header());
    define("CHECKED_FROM", &CHECKED_FROM);
    let real = if precision == 8 { "double" } else { "float" };
    sizes += &format!("\ntypedef {real} flexbody_real;\n{}", frame_names(content));

    let units = body.units();
    let summary = format!(
        "Body `{own}`: {} modes, units {}, {}, {}.",
        body.n_modes(),
        plain(units.length.name()),
        plain(units.mass.name()),
        plain(units.time.name())
    );
    let text = TEMPLATE.replace("/* SIZES */", sizes.trim_end()).replace("SUMMARY", &summary);
    let own = identifier(&body.source().name);
    if own.is_empty() {
        return text;
    }
    text.replace("flexbody_", &format!("flexbody_{own}_"))
        .replace("FLEXBODY_", &format!("FLEXBODY_{}_", own.to_uppercase()))
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
