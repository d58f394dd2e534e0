//! SID_FEM as an export format: the file around its arrays, and what it cannot hold.

use super::arrays::{modal, places};
use super::dialect::{DIALECTS, Dialect, NAMES};
use super::text::Text;
use crate::base::error::Result;
use crate::body::flex_body::{FlexBody, Group};
use crate::formats::export::losses::{general_w0, geometric_stiffness, internal_rows, plane};
use crate::formats::export::{ExportFormat, ExportOptions, Exported};
use crate::model::{LoadKind, UnitLoad};

/// SID_FEM text (Wallrapp, Standard Input Data of flexible members in multibody systems, 1993). The equations
/// of SID have the inertia of a body to first order in q; the file has every number of the exact ones.
pub struct Sid;

impl ExportFormat for Sid {
    fn name(&self) -> &'static str {
        "sid"
    }

    fn reader(&self) -> &'static str {
        "Simpack, Neweul-M2, EMBSlib (Modelica), matflex, FEMBeam"
    }

    fn dialects(&self) -> &'static [&'static str] {
        &NAMES
    }

    fn has_points(&self) -> bool {
        true
    }

    fn losses(&self, body: &FlexBody, options: &ExportOptions) -> Vec<String> {
        let places = places(body, &options.points);
        let holds = |load: &UnitLoad| match &load.kind {
            LoadKind::Acceleration | LoadKind::AngularAcceleration | LoadKind::Spin => true,
            LoadKind::Named(_) => false,
            kind => places.iter().any(|place| place.holds(kind)),
        };
        [plane(body), general_w0(body), geometric_stiffness(body, holds), internal_rows(body)]
            .into_iter()
            .flatten()
            .collect()
    }

    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported> {
        let name = options.dialect.as_deref().unwrap_or(DIALECTS[0].name);
        // Names that are none are refused before.
        let dialect = DIALECTS.iter().find(|dialect| dialect.name == name).unwrap_or(&DIALECTS[0]);
        Ok(Exported::single(file(body, options, dialect).into_bytes()))
    }
}

fn file(body: &FlexBody, options: &ExportOptions, dialect: &Dialect) -> String {
    let nf = body.n_modes();
    let places = places(body, &options.points);
    let mut text = Text::new(dialect, nf);
    let head = format!("{:5}{nf:5}    :No. nodes, No. modes:{}", places.len(), comment(body, dialect));
    text.line(0, &head);
    text.line(1, "part");
    if dialect.named_modal {
        text.value(6, "new modal", word(&body.source().name));
    } else {
        text.line(6, "new modal");
    }
    refmod(body, &mut text);
    text.line(11, "frame");
    for place in &places {
        text.value(16, "new node", format_args!("{:6}", place.frame.id));
        text.value(21, "rframe", "body ref");
        place.objects().iter().for_each(|object| text.taylor(21, object));
        text.line(16, "end node");
    }
    text.line(11, "end frame");
    modal(body, dialect).iter().for_each(|object| text.taylor(11, object));
    text.line(6, "end modal");
    text.line(1, "end part");
    text.out
}

/// A name as one word without a sign of equality, which readers take for the end of a key; none of a body
/// without a name.
fn word(name: &str) -> String {
    let words = name.split(|c: char| c.is_whitespace() || c.is_control() || c == '=');
    words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join("_")
}

/// What the rest of the file does not tell: dialect, units, what Oe1 holds beside W2, name.
fn comment(body: &FlexBody, dialect: &Dialect) -> String {
    let mut facts =
        vec![concat!("flexbody ", env!("CARGO_PKG_VERSION")).to_owned(), format!("dialect {}", dialect.name)];
    let units = body.units();
    if units.stated {
        let [length, mass, time] = [&units.length, &units.mass, &units.time].map(|unit| unit.name());
        facts.push(format!("units {length} {mass} {time}"));
    }
    for kind in [LoadKind::Spin, LoadKind::AngularAcceleration] {
        if body.stiffening_loads().iter().any(|load| load.kind == kind) {
            facts.push(format!("geometric stiffness for {}", kind.name().replace('_', " ")));
        }
    }
    if body.invariants().general().is_some() {
        facts.push("general mass".to_owned());
    }
    let groups = body.groups();
    let without: Vec<&str> = Group::ALL.iter().filter(|g| !groups.has(**g)).map(|g| g.name()).collect();
    if !without.is_empty() {
        facts.push(format!("without {}", without.join(" ")));
    }
    let name = &body.source().name;
    if !name.is_empty() {
        facts.push(format!("body {}", name.replace(char::is_control, " ")));
    }
    facts.join(", ")
}

fn refmod(body: &FlexBody, text: &mut Text<'_>) {
    let time = &body.units().time;
    let unit = if time.to_si() == 1.0 { "Hz".to_owned() } else { format!("1/{}", time.name()) };
    text.line(11, "refmod");
    let mass = text.number(body.invariants().mass());
    text.value(16, "mass", mass);
    text.value(16, "nelastq", format_args!("{:6}", body.n_modes()));
    for (k, eigenvalue) in body.modes().eigenvalue.iter().enumerate() {
        let frequency = eigenvalue.sqrt() / std::f64::consts::TAU;
        let mode = k + 1;
        let said = format!("Eigen Mode {mode:4} : {frequency:14.8e} {unit}");
        text.value(16, &format!("ielastq ({mode:4})"), said);
    }
    text.line(11, "end refmod");
}
