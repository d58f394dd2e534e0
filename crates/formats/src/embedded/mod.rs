//! A body as a binary file that real-time programs evaluate in place, with a C99 header that evaluates it.

mod layout;

use crate::export::Holding::{Held, NotApplicable};
use crate::export::losses::geometric_stiffness;
use crate::export::stresses::{without_named_loads, without_recoveries};
use crate::export::{ExportChecklist, ExportFormat, ExportOptions, Exported, Points, frames};
use flate2::Crc;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::flex_body::{FlexBody, LoadKind, UnitLoad};
use layout::{
    ALIGNMENT, ARRAYS, Array, ArrayPosition, BYTE_ORDER, CHECKED_FROM, Content, HEADER, MAGIC, Numbers,
    VERSION, fixed_header, header_bytes, header_offset, loads,
};
use std::fmt::Write;

pub use layout::embedded_markdown;

/// The numbers of the equations of motion (theory 6 and 7.4) in a fixed little-endian layout, and a
/// freestanding C99 header that evaluates them in place. The dialects `double` and `float` are the number
/// types of file and header.
pub(super) struct Embedded;

impl ExportFormat for Embedded {
    fn name(&self) -> &'static str {
        "embedded"
    }

    fn reader(&self) -> &'static str {
        "real-time programs, with the C99 header written beside it"
    }

    fn dialects(&self) -> &'static [&'static str] {
        &["double", "float"]
    }

    fn has_points(&self) -> bool {
        true
    }

    fn checklist(&self, body: &FlexBody, options: &ExportOptions) -> ExportChecklist {
        let frames = frames(body, &options.points);
        let held: Vec<_> = frames.iter().flat_map(|frame| loads(body, &frames, frame)).collect();
        // Interfaces may be omitted on request.
        let asked = options.points == Points::Usual || options.points.of_interfaces();
        let holds = |load: &UnitLoad| match load.kind.interface() {
            Some(_) => !asked || held.iter().any(|(_, one)| one.load == *load),
            None => !matches!(load.kind, LoadKind::Named(_)),
        };
        ExportChecklist {
            rigid_coupling: Held,
            plane: Held,
            deformed_inertia: Held,
            general_w0: Held,
            coriolis_force: Held,
            general_w3: Held,
            separate_w2: Held,
            geometric_stiffness: geometric_stiffness(body, options, holds),
            inertia_stiffness: Held,
            damping: Held,
            shapes: Held,
            rotations: Held,
            internal_rows: NotApplicable,
            gravity: Held,
            interfaces: Held,
            surface: NotApplicable,
            origins_of_modes: NotApplicable,
            units: Held,
            storage: NotApplicable,
            named_loads: without_named_loads(body),
            recoveries: without_recoveries(body),
        }
    }

    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported> {
        let precision = if options.dialect.as_deref() == Some("float") { 4 } else { 8 };
        let content = Content::new(body, &options.points, precision)?;
        let (file, places) = bytes(body, &content, precision)?;
        let header = header(body, &content, &places, precision, file.len());
        Ok(Exported { file, beside: vec![("h".into(), header.into_bytes())] })
    }
}

fn bytes(
    body: &FlexBody,
    content: &Content,
    precision: usize,
) -> Result<(Vec<u8>, Vec<Option<ArrayPosition>>)> {
    let mut file = vec![0; header_bytes()];
    // Arrays, each at a multiple of the alignment, with its position for the table.
    let mut places = Vec::new();
    for (described, array) in ARRAYS.iter().zip(&content.arrays) {
        let Some(array) = array else {
            places.push(None);
            continue;
        };
        places.push(Some(ArrayPosition {
            offset: file.len(),
            rows: array.rows,
            columns: array.columns,
            stride: array.stride,
        }));
        append(&mut file, array, precision).map_err(|value| {
            let message = format!("embedded cannot hold {value:e} of `{}` as a 32-bit float", described.name);
            refused(message, "use --dialect double, or other units with --to-units")
        })?;
        file.resize(file.len().next_multiple_of(ALIGNMENT), 0);
    }
    let size = u32::try_from(file.len()).map_err(|_| {
        refused(
            format!("embedded cannot hold {} bytes: the largest size is 4 GiB", file.len()),
            "choose fewer nodes with --points",
        )
    })?;

    // Header entries, whose space was left free.
    let mut put =
        |name: &str, bytes: &[u8]| file[header_offset(name)..][..bytes.len()].copy_from_slice(bytes);
    put("magic", &MAGIC);
    put("byte_order", &BYTE_ORDER.to_le_bytes());
    put("version", &VERSION.to_le_bytes());
    put("size", &size.to_le_bytes());
    put("precision", &expected(content, body, precision).map(u32::to_le_bytes).concat());
    let units = body.units();
    for (name, unit) in [("length", &units.length), ("mass", &units.mass), ("time", &units.time)] {
        put(name, &unit.to_si().to_le_bytes());
    }
    // Table of the positions of the arrays.
    let table: Vec<u8> = places
        .iter()
        .flat_map(|place| ArrayPosition::entry(place.as_ref()))
        .flat_map(u32::to_le_bytes)
        .collect();
    file[fixed_header()..][..table.len()].copy_from_slice(&table);
    // The checksum covers everything after itself.
    let mut checksum = Crc::new();
    checksum.update(&file[CHECKED_FROM..]);
    file[header_offset("checksum")..][..4].copy_from_slice(&checksum.sum().to_le_bytes());
    Ok((file, places))
}

/// Appends the numbers. Fails with a number that is too large for the precision, or with the largest number
/// of an array if that is too small.
fn append(file: &mut Vec<u8>, array: &Array, precision: usize) -> std::result::Result<(), f64> {
    match &array.numbers {
        Numbers::I32(values) => file.extend(values.iter().flat_map(|v| v.to_le_bytes())),
        Numbers::I64(values) => file.extend(values.iter().flat_map(|v| v.to_le_bytes())),
        Numbers::Real(values) if precision == 8 => file.extend(values.iter().flat_map(|v| v.to_le_bytes())),
        Numbers::Real(values) => {
            let largest = values.iter().copied().fold(0.0, |most: f64, v| most.max(v.abs()));
            if largest != 0.0 && !(f32::MIN_POSITIVE..=f32::MAX).contains(&(largest as f32)) {
                return Err(largest);
            }
            file.extend(values.iter().flat_map(|v| (*v as f32).to_le_bytes()));
        }
    }
    Ok(())
}

fn refused(message: String, help: &str) -> Error {
    Diagnostic::new(Code::ExportLoses, message).with_help(help).into()
}

// C99 header of a body: the committed template with the sizes of the body in front, under names of its own.

/// Code template for a body named `flexbody`.
const TEMPLATE: &str = include_str!("body.h");

/// Longest part of an identifier taken from the name of the body: C99 guarantees 63 significant characters
/// only.
const LONGEST_NAME: usize = 24;

/// Returns the header entries that the file must have, from the precision on.
fn expected(content: &Content, body: &FlexBody, precision: usize) -> [u32; 6] {
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
fn header(
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
    let own = identifier(&body.description().name);
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
        plain(&body.description().name),
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
