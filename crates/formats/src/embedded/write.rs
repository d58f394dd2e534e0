//! Writer of the file: header, table and arrays.

use super::arrays::{Array, Content, Numbers, loads};
use super::header::{expected, header};
use super::layout::{
    ALIGNMENT, ARRAYS, ArrayPosition, BYTE_ORDER, CHECKED_FROM, MAGIC, VERSION, fixed_header, header_bytes,
    header_offset,
};
use crate::export::Holding::{Held, NotApplicable};
use crate::export::losses::geometric_stiffness;
use crate::export::{ExportChecklist, ExportFormat, ExportOptions, Exported, Points, frames};
use flate2::Crc;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::flex_body::{FlexBody, LoadKind, UnitLoad};

/// The numbers of the equations of motion (theory 6 and 7.4) in a fixed little-endian layout, and a
/// freestanding C99 header that evaluates them in place. The dialects `double` and `float` are the number
/// types of file and header.
pub(crate) struct Embedded;

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
            geometric_stiffness: geometric_stiffness(body, holds),
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
