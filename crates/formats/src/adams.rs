//! The nine inertia invariants with the numbering and signs of Adams/Flex, for comparison with the output of
//! an MNF translator.

use super::export::Holding::{Held, NotApplicable};
use super::export::arrays::Nested;
use super::export::frames::{ExportFrame, frames};
use super::export::{ExportChecklist, ExportFormat, ExportOptions, Exported, losses};
use crate::export::stresses::{without_named_loads, without_recoveries};
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use serde_json::json;
use std::fmt::Write;

/// Export format of the invariants.
pub(crate) struct AdamsInvariants;

const TEXT: &str = "text";

impl ExportFormat for AdamsInvariants {
    fn name(&self) -> &'static str {
        "adams-invariants"
    }

    fn reader(&self) -> &'static str {
        "people and scripts: I1 to I9 in the numbering of Adams/Flex (not an MNF)"
    }

    fn dialects(&self) -> &'static [&'static str] {
        &["json", TEXT]
    }

    fn has_points(&self) -> bool {
        true
    }

    fn checklist(&self, body: &FlexBody, options: &ExportOptions) -> ExportChecklist {
        ExportChecklist {
            rigid_coupling: Held,
            plane: losses::plane(body),
            deformed_inertia: Held,
            general_w0: losses::general_w0(body),
            coriolis_force: Held,
            general_w3: Held,
            separate_w2: Held,
            geometric_stiffness: losses::geometric_stiffness(body, options, |_| false),
            inertia_stiffness: losses::inertia_stiffness(body, options, |_| false),
            damping: Held,
            shapes: Held,
            rotations: Held,
            internal_rows: losses::internal_rows(body),
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
        let (quantities, frames) = (quantities(body), frames(body, &options.points));
        let text = match options.dialect.as_deref() {
            Some(TEXT) => text(body, &quantities, &frames),
            _ => document(body, &quantities, &frames),
        };
        Ok(Exported::single(text.into_bytes()))
    }
}

const CONVENTIONS: &[&str] = &[
    "About the origin of the body frame, in body axes; s: undeformed position, phi_j: shape of mode j, dm: consistent mass.",
    "a~ is the matrix of the cross product: a~ b = a x b.",
    "Inertia about the origin: I7 - sum_j (I8_j + I8_j') q_j - sum_jk I9_jk q_j q_k.",
    "I8 has the sign of Adams; MBDyn uses the opposite sign. All other invariants are the same in MBDyn.",
    "A quantity without values belongs to a group of the kinetic energy that the body does not hold; the antisymmetric part of I8 is always written.",
    "MNF files are proprietary to Adams: this file is not an MNF, and Adams does not read it.",
];

/// An invariant or an accompanying quantity.
struct Quantity {
    name: &'static str,
    title: &'static str,
    formula: &'static str,
    units: &'static str,
    shape: Vec<usize>,
    /// Values in row-major order; `None` if the body does not hold the quantity.
    values: Option<Vec<f64>>,
}

/// Returns I1 to I9, then stiffness and damping of the modes.
fn quantities(body: &FlexBody) -> Vec<Quantity> {
    let nf = body.n_modes();
    let numbered = body.invariants().numbered();
    let rows = |a: &Mat<f64>| -> Vec<f64> { a.row_iter().flat_map(|row| row.iter().copied()).collect() };
    let triples = || (0..nf).flat_map(|j| [0, 1, 2].map(|a| (j, a)));
    let i5 = numbered
        .i5
        .as_ref()
        .map(|i5| triples().flat_map(|(j, a)| (0..nf).map(move |k| i5[(a * nf + j, k)])).collect());
    let i8 = triples().flat_map(|(j, a)| [0, 1, 2].map(|b| -numbered.i8[j][(a, b)])).collect();
    let i9 = numbered.i9.as_ref().map(|i9| {
        let block =
            |j: usize, k: usize| (0..9).map(move |place| i9[(place / 3 * nf + j, place % 3 * nf + k)]);
        (0..nf).flat_map(|j| (0..nf).flat_map(move |k| block(j, k))).collect()
    });
    let i7: Vec<f64> = numbered.i7.transpose().iter().copied().collect();
    let damping = losses::is_damped(body).then(|| rows(&body.damping()));
    let stiffness = rows(body.invariants().modal_stiffness());
    let one = |name, title, formula, units, shape: &[usize], values| Quantity {
        name,
        title,
        formula,
        units,
        shape: shape.to_vec(),
        values,
    };
    vec![
        one("I1", "mass", "int dm", "mass", &[1], Some(vec![numbered.i1])),
        one("I2", "first moment", "int s dm", "mass length", &[3], Some(numbered.i2.as_slice().to_vec())),
        one(
            "I3",
            "momentum of the modes, column j",
            "int phi_j dm",
            "mass^(1/2)",
            &[3, nf],
            Some(rows(&numbered.i3)),
        ),
        one(
            "I4",
            "angular momentum of the modes, column j",
            "int s~ phi_j dm",
            "mass^(1/2) length",
            &[3, nf],
            Some(rows(&numbered.i4)),
        ),
        one("I5", "for each mode j, column k", "int phi_j~ phi_k dm", "1", &[nf, 3, nf], i5),
        one("I6", "mass of the modes", "int phi_j' phi_k dm", "1", &[nf, nf], Some(rows(&numbered.i6))),
        one("I7", "inertia of the undeformed body", "int s~' s~ dm", "mass length^2", &[3, 3], Some(i7)),
        one("I8", "for each mode j", "int s~ phi_j~ dm", "mass^(1/2) length", &[nf, 3, 3], Some(i8)),
        one("I9", "for each pair of modes j, k", "int phi_j~ phi_k~ dm", "1", &[nf, nf, 3, 3], i9),
        one("K", "stiffness of the modes", "Phi' K Phi", "time^-2", &[nf, nf], Some(stiffness)),
        one("D", "damping of the modes", "Phi' D Phi", "time^-1", &[nf, nf], damping),
    ]
}

fn document(body: &FlexBody, quantities: &[Quantity], frames: &[ExportFrame]) -> String {
    let quantity = |one: &Quantity| {
        json!({
            "name": one.name, "title": one.title, "formula": one.formula, "units": one.units, "shape": one.shape,
            "values": one.values.as_ref().map(|values| Nested(&one.shape, values)),
        })
    };
    let rows =
        |a: &Mat<f64>| -> Vec<Vec<f64>> { a.row_iter().map(|row| row.iter().copied().collect()).collect() };
    let frame = |follower: &ExportFrame| {
        json!({
            "node": follower.id, "name": follower.name, "position": follower.position,
            "translation": rows(&follower.translation), "rotation": follower.rotation.as_ref().map(rows),
        })
    };
    let units = body.units();
    let lines = |list: Vec<serde_json::Value>| {
        let lines: Vec<String> = list.iter().map(ToString::to_string).collect();
        format!("[\n{}\n]", lines.join(",\n"))
    };
    format!(
        "{{\n\"format\": \"adams-invariants\",\n\"version\": 1,\n\"units\": {},\n\"conventions\": {},\n\"quantities\": {},\n\"frames\": {}\n}}\n",
        json!({"length": units.length.name(), "mass": units.mass.name(), "time": units.time.name()}),
        lines(CONVENTIONS.iter().map(|line| json!(line)).collect()),
        lines(quantities.iter().map(quantity).collect()),
        lines(frames.iter().map(frame).collect()),
    )
}

fn text(body: &FlexBody, quantities: &[Quantity], frames: &[ExportFrame]) -> String {
    let mut out =
        String::from("# The nine inertia invariants, numbering and signs of Adams/Flex, version 1\n");
    for line in CONVENTIONS {
        write_line(&mut out, format_args!("# {line}"));
    }
    let units = body.units();
    let (length, mass, time) = (units.length.name(), units.mass.name(), units.time.name());
    write_line(&mut out, format_args!("# units: length {length}, mass {mass}, time {time}"));
    for quantity in quantities {
        let shape: Vec<String> = quantity.shape.iter().map(ToString::to_string).collect();
        let Quantity { name, title, formula, units, .. } = quantity;
        write_line(&mut out, format_args!("\n# {title}: {formula}, in {units}"));
        match &quantity.values {
            None => write_line(&mut out, format_args!("{name} none")),
            Some(values) => {
                write_line(&mut out, format_args!("{name} {}", shape.join(" ")));
                lines(&mut out, values, quantity.shape.last().copied().unwrap_or(1));
            }
        }
    }
    write_line(
        &mut out,
        format_args!(
            "\n# node number, position; displacement and, where it is known, rotation of each mode (rows x, y, z)"
        ),
    );
    for frame in frames {
        if let Some(name) = &frame.name {
            write_line(&mut out, format_args!("# {}", name.escape_default()));
        }
        let [x, y, z] = frame.position;
        write_line(&mut out, format_args!("frame {} {x:e} {y:e} {z:e}", frame.id));
        for (kind, rows) in [("translation", Some(&frame.translation)), ("rotation", frame.rotation.as_ref())]
        {
            if let Some(rows) = rows {
                write_line(&mut out, format_args!("{kind} 3 {}", rows.ncols()));
                let values: Vec<f64> = rows.row_iter().flat_map(|row| row.iter().copied()).collect();
                lines(&mut out, &values, rows.ncols());
            }
        }
    }
    out
}

/// Writes rows of numbers that round-trip exactly.
fn lines(out: &mut String, values: &[f64], columns: usize) {
    for row in values.chunks(columns) {
        let row: Vec<String> = row.iter().map(|v| format!("{v:e}")).collect();
        write_line(out, format_args!("{}", row.join(" ")));
    }
}

fn write_line(out: &mut String, line: std::fmt::Arguments<'_>) {
    writeln!(out, "{line}").expect("writing to a String cannot fail");
}
