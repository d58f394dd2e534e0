//! SID_FEM as an export format: the file around its arrays, and its losses.

use super::arrays::{StiffenedFrame, modal, places};
use super::dialect::{DIALECTS, Dialect, EMBS, Limits, ModalName, NAMES};
use super::text::Text;
use crate::export::Holding::{self, Held, NotApplicable};
use crate::export::frames::{frame_table, numbered_interfaces};
use crate::export::losses::{general_w0, geometric_stiffness, internal_rows, plane};
use crate::export::stresses::NodalStresses;
use crate::export::{ExportChecklist, ExportFormat, ExportFrame, ExportOptions, Exported, frames};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, TermGroup};
use flexbody_body::invariants::CauchySchwarz;
use flexbody_model::{LoadKind, UnitLoad};

/// SID_FEM text (Wallrapp, Standard Input Data of flexible members in multibody systems, 1993). The equations
/// of SID hold the inertia of a body to first order in q; every number in the file is exact.
pub(crate) struct Sid;

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

    fn checklist(&self, body: &FlexBody, options: &ExportOptions) -> ExportChecklist {
        let places = places(body, &options.points);
        let embs = *chosen(options) == EMBS;
        let holds = |load: &UnitLoad| match &load.kind {
            LoadKind::Acceleration | LoadKind::AngularAcceleration | LoadKind::Spin => true,
            LoadKind::Named(_) => false,
            kind => !embs && places.iter().any(|place| place.holds(kind)),
        };
        ExportChecklist {
            rigid_coupling: Held,
            plane: plane(body),
            deformed_inertia: Held,
            general_w0: general_w0(body),
            coriolis_force: if embs { coriolis_of_frame(body) } else { Held },
            general_w3: Held,
            separate_w2: Held,
            geometric_stiffness: geometric_stiffness(body, holds),
            // The stiffness of inertia is written like geometric stiffness.
            inertia_stiffness: Held,
            damping: Held,
            shapes: Held,
            rotations: Held,
            internal_rows: internal_rows(body),
            gravity: Held,
            interfaces: Held,
            surface: NotApplicable,
            origins_of_modes: NotApplicable,
            units: Held,
            storage: NotApplicable,
            recoveries: {
                let places = frames(body, &options.points);
                let found = NodalStresses::new(body, places.iter().map(|place| place.id));
                NodalStresses::holding(found.as_ref(), body, true)
            },
        }
    }

    fn interface_numbers(&self, body: &FlexBody, options: &ExportOptions) -> Vec<(String, i64)> {
        let (dialect, places) = (chosen(options), places(body, &options.points));
        numbered_interfaces(numbered(&places, dialect))
    }

    fn needs(&self, body: &FlexBody, options: &ExportOptions) -> Vec<String> {
        let (dialect, places) = (chosen(options), places(body, &options.points));
        let mut needs = Vec::new();
        if are_counted(&places, dialect) {
            needs.push(
                "frames have the row numbers of the table beside the file, not the node numbers".to_owned(),
            );
        }
        if *dialect == EMBS {
            let (frames, modes) = (places.len(), body.n_modes());
            needs.push(format!("set numNodes = {frames} and numModes = {modes} in EMBS_Body"));
            needs.push(
                "EMBS_Body needs a frame_ref whose origin is at rest: for a moving origin it counts omega x v twice"
                    .to_owned(),
            );
        }
        needs
    }

    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported> {
        let dialect = chosen(options);
        let places = places(body, &options.points);
        let columns = 3 * body.n_modes();
        if let Some(Limits { count, .. }) = dialect.limits
            && places.len().max(columns) > count
        {
            let message = format!(
                "sid cannot hold {} frames and {columns} columns of Gr in dialect {}: its reader accepts {count} of each at most",
                places.len(),
                dialect.name
            );
            let help = "choose fewer frames with --points";
            return Err(Diagnostic::new(Code::ExportLoses, message).with_help(help).into());
        }
        let mut exported = Exported::single(file(body, &places, dialect).into_bytes());
        let is_named = places.iter().any(|place| place.frame.name.is_some());
        if is_named || are_counted(&places, dialect) {
            let table = frame_table(numbered(&places, dialect));
            exported.beside.push(("frames.csv".into(), table.into_bytes()));
        }
        Ok(exported)
    }
}

/// Returns the dialect of an export. Unknown names were rejected before.
fn chosen(options: &ExportOptions) -> &'static Dialect {
    let name = options.dialect.as_deref().unwrap_or(DIALECTS[0].name);
    DIALECTS.iter().find(|dialect| dialect.name == name).unwrap_or(&DIALECTS[0])
}

/// Returns the holding of the Coriolis force on the frame of modes that move the centre of mass, which
/// EMBSlib omits.
fn coriolis_of_frame(body: &FlexBody) -> Holding {
    /// Share of the bound that counts as rounding.
    const ROUNDING: f64 = 1e-9;
    let bound = CauchySchwarz::of(body.invariants());
    let c1 = body.invariants().c1();
    let of_mode = |k: usize| (0..3).map(|a| c1[(a, k)].abs()).fold(0.0, f64::max) / bound.c1(k);
    let share = (0..body.n_modes()).map(of_mode).fold(0.0, f64::max);
    Holding::held_but_for((share > ROUNDING).then(|| {
        format!(
            "the Coriolis force 2 omega x C1 qd on the frame, which EMBSlib omits: C1 is up to {share:.1e} of its Cauchy-Schwarz bound"
        )
    }))
}

/// Returns true if frames are numbered 1, 2, ... instead of by node and reference point.
fn are_counted(places: &[StiffenedFrame], dialect: &Dialect) -> bool {
    let beyond = |largest: i64| places.iter().any(|place| !(1..=largest).contains(&place.frame.id));
    dialect.largest_frame.is_some_and(beyond)
}

/// Returns the frames with their numbers in the file.
fn numbered<'p>(
    places: &'p [StiffenedFrame],
    dialect: &Dialect,
) -> impl Iterator<Item = (i64, &'p ExportFrame)> {
    let counted = are_counted(places, dialect);
    let number = move |(place, number): (&'p StiffenedFrame, i64)| {
        (if counted { number } else { place.frame.id }, &place.frame)
    };
    places.iter().zip(1i64..).map(number)
}

fn file(body: &FlexBody, places: &[StiffenedFrame], dialect: &Dialect) -> String {
    let nf = body.n_modes();
    let mut text = Text::new(dialect, nf);
    let mut head = format!("{:5}{nf:5}    :No. nodes, No. modes:{}", places.len(), comment(body, dialect));
    if let Some(Limits { first_line, .. }) = dialect.limits {
        // Leaves one byte for the end of the line in the buffer of the reader.
        let whole = |end: &usize| head.is_char_boundary(*end);
        head.truncate((0..first_line.min(head.len() + 1)).rev().find(whole).unwrap_or(0));
    }
    text.line(0, &head);
    text.line(1, "part");
    match dialect.modal_name {
        ModalName::Absent => text.line(6, "new modal"),
        ModalName::OfBody => text.value(6, "new modal", word(&body.source().name)),
        ModalName::Fixed(name) => text.value(6, "new modal", name),
    }
    refmod(body, &mut text);
    text.line(11, "frame");
    for (place, (number, _)) in places.iter().zip(numbered(places, dialect)) {
        text.value(16, "new node", format_args!("{number:6}"));
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

/// Returns a name as one word without a sign of equality, which readers take for the end of a key; empty for
/// a body without a name.
fn word(name: &str) -> String {
    let words = name.split(|c: char| c.is_whitespace() || c.is_control() || c == '=');
    words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join("_")
}

/// Returns the facts that the rest of the file does not contain: dialect, units, contents of Oe1 other than
/// W2, name.
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
    let without: Vec<&str> = TermGroup::ALL.iter().filter(|g| !groups.has(**g)).map(|g| g.name()).collect();
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
