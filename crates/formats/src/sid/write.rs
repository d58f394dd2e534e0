//! SID_FEM text: Standard Input Data of a flexible body after Wallrapp, in the dialects that programs read.

use super::text::{Blocks, DIALECTS, Dialect, EMBS, Limits, ModalName, NAMES, Taylor, Text};
use crate::export::Holding::{self, Held, NotApplicable};
use crate::export::frames::{frame_table, numbered_interfaces};
use crate::export::losses::{general_w0, geometric_stiffness, internal_rows, is_damped, plane};
use crate::export::stresses::{NodalStresses, without_named_loads};
use crate::export::{ExportChecklist, ExportFormat, ExportFrame, ExportOptions, Exported, frames};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, TermGroup};
use flexbody_body::invariants::{CauchySchwarz, Numbered};
use flexbody_model::{LoadKind, UnitLoad};
use flexbody_motion::dynamics::{Stiffening, stiffness_under};
use nalgebra::Matrix3;

// SID_FEM as an export format: the file around its arrays, and its losses.

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

    fn other_names(&self) -> &'static [&'static str] {
        &["simpack"]
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
            geometric_stiffness: geometric_stiffness(body, options, holds),
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
            named_loads: without_named_loads(body),
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
        ModalName::OfBody => text.value(6, "new modal", word(&body.description().name)),
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
    let without: Vec<&str> = body.groups().dropped().map(TermGroup::name).collect();
    if !without.is_empty() {
        facts.push(format!("without {}", without.join(" ")));
    }
    let name = &body.description().name;
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

// Arrays of SID from the numbered invariants and the geometric stiffness of a body.

/// Indices of the components (11, 22, 33, 12, 13, 23), the order of J.
const INERTIA: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Returns (K + K') / 2 for the components of a kind of load; `None` if the body has none of them.
fn stiffness(body: &FlexBody, kind: &LoadKind) -> Option<Vec<Mat<f64>>> {
    let (nf, entry) = (body.n_modes(), stiffness_under(body, kind, Stiffening::All)?);
    let symmetric_part = |component: usize| Mat::from_fn(nf, nf, |i, j| entry(component, i, j));
    Some((0..kind.components().len()).map(symmetric_part).collect())
}

fn per_mode(nf: usize, matrix: impl FnMut(usize) -> Mat<f64>) -> Vec<Mat<f64>> {
    (0..nf).map(matrix).collect()
}

/// Returns J in the form of the dialect.
fn inertia(dialect: &Dialect, i: &Matrix3<f64>) -> Mat<f64> {
    let i = 0.5 * (i + i.transpose());
    if dialect.square_inertia {
        Mat::from_fn(3, 3, |k, l| i[(k, l)])
    } else {
        Mat::from_fn(6, 1, |at, _| i[INERTIA[at]])
    }
}

/// Returns the columns of Gr or Ge in the order of the dialect, from `entry(row, axis, mode)`.
fn blocks(nrow: usize, nf: usize, order: Blocks, entry: impl Fn(usize, usize, usize) -> f64) -> Mat<f64> {
    let mut all = Mat::zeros(nrow, 3 * nf);
    for row in 0..nrow {
        for a in 0..3 {
            for k in 0..nf {
                all[(row, order.column(a, k, nf))] = entry(row, a, k);
            }
        }
    }
    all
}

/// Returns the arrays from mdCM to De in the order of the file.
///
/// The elastic forces (7.3) of theory section 7 are in Ct(q) (a - g), Cr(q) alpha and Oe(q) of the spin
/// products. The rows of translation and rotation then have the same Ct(q), Cr(q) as (7.4).
fn modal(body: &FlexBody, dialect: &Dialect) -> Vec<Taylor> {
    let terms = Terms::new(body);
    let Terms { numbered, nf, w1, .. } = &terms;
    let nf = *nf;
    let [first_moment, inertia_name] = dialect.moments;
    vec![
        Taylor::linear(
            first_moment,
            Mat::from_fn(3, 1, |a, _| numbered.i2[a]),
            per_mode(nf, |k| Mat::from_fn(3, 1, |a, _| numbered.i3[(a, k)])),
        ),
        Taylor {
            structure: if dialect.square_inertia {
                super::text::Structure::Symmetric
            } else {
                super::text::Structure::Full
            },
            ..Taylor::linear(
                inertia_name,
                inertia(dialect, &numbered.i7),
                per_mode(nf, |k| inertia(dialect, &w1[k])),
            )
        },
        terms.ct(),
        terms.cr(),
        Taylor::symmetric("Me", numbered.i6.clone()),
        Taylor::constant("Gr", blocks(3, nf, dialect.gr, |row, a, k| 2.0 * numbered.i8[k][(row, a)])),
        // The Coriolis force needs the skew part only; for a solid the symmetric part is zero.
        Taylor::constant("Ge", blocks(nf, nf, dialect.ge, |k, a, l| terms.w3(a, l, k) - terms.w3(a, k, l))),
        terms.oe(),
        Taylor::zero("ksigma", nf, 1),
        Taylor::symmetric("Ke", body.invariants().modal_stiffness().clone()),
        if is_damped(body) { Taylor::symmetric("De", body.damping()) } else { Taylor::zero("De", nf, nf) },
    ]
}

/// Terms of a body from which the arrays are formed.
struct Terms {
    numbered: Numbered,
    nf: usize,
    /// I8 + I8' of every mode.
    w1: Vec<Matrix3<f64>>,
    /// Geometric stiffness for acceleration, angular acceleration and spin; `None` without.
    acceleration: Option<Vec<Mat<f64>>>,
    turn: Option<Vec<Mat<f64>>>,
    spin: Option<Vec<Mat<f64>>>,
}

impl Terms {
    fn new(body: &FlexBody) -> Self {
        let numbered = body.invariants().numbered();
        Self {
            nf: body.n_modes(),
            w1: numbered.i8.iter().map(|i8| i8 + i8.transpose()).collect(),
            numbered,
            acceleration: stiffness(body, &LoadKind::Acceleration),
            turn: stiffness(body, &LoadKind::AngularAcceleration),
            spin: stiffness(body, &LoadKind::Spin),
        }
    }

    /// Returns entry (l, k) of the block of I5 for an axis; zero without W3.
    fn w3(&self, a: usize, l: usize, k: usize) -> f64 {
        self.numbered.i5.as_ref().map_or(0.0, |i5| i5[(a * self.nf + l, k)])
    }

    fn ct(&self) -> Taylor {
        let nf = self.nf;
        let mut ct = Taylor::constant("Ct", Mat::from_fn(nf, 3, |k, a| self.numbered.i3[(a, k)]));
        let linear = |stiff: &Vec<Mat<f64>>| per_mode(nf, |l| Mat::from_fn(nf, 3, |k, a| stiff[a][(k, l)]));
        ct.m1 = self.acceleration.as_ref().map(linear);
        ct
    }

    fn cr(&self) -> Taylor {
        let nf = self.nf;
        let turned = |a: usize, k: usize, l: usize| entry(self.turn.as_ref(), a, k, l);
        Taylor::linear(
            "Cr",
            Mat::from_fn(nf, 3, |k, a| self.numbered.i4[(a, k)]),
            per_mode(nf, |l| Mat::from_fn(nf, 3, |k, a| self.w3(a, l, k) + turned(a, k, l))),
        )
    }

    fn oe(&self) -> Taylor {
        let nf = self.nf;
        let constant = |k: usize, pair: usize| {
            let (a, b) = LoadKind::SPIN[pair];
            if a == b { -0.5 * self.w1[k][(a, a)] } else { -self.w1[k][(a, b)] }
        };
        Taylor::linear(
            "Oe",
            Mat::from_fn(nf, 6, constant),
            per_mode(nf, |l| Mat::from_fn(nf, 6, |k, pair| self.centrifugal(k, l, pair))),
        )
    }

    /// Returns an entry of Oe1 for a pair of axes: W2 plus geometric stiffness for spin.
    fn centrifugal(&self, k: usize, l: usize, pair: usize) -> f64 {
        let nf = self.nf;
        let (a, b) = LoadKind::SPIN[pair];
        let both = |i9: &Mat<f64>| {
            let sum = i9[(a * nf + k, b * nf + l)] + i9[(a * nf + l, b * nf + k)];
            if a == b { 0.5 * sum } else { sum }
        };
        self.numbered.i9.as_ref().map_or(0.0, both) + entry(self.spin.as_ref(), pair, k, l)
    }
}

/// Returns an entry of a component of geometric stiffness; zero without.
fn entry(stiffness: Option<&Vec<Mat<f64>>>, component: usize, i: usize, j: usize) -> f64 {
    stiffness.map_or(0.0, |stiffness| stiffness[component][(i, j)])
}

/// A frame with the stiffness of a unit force and a unit moment at it.
struct StiffenedFrame {
    pub(crate) frame: ExportFrame,
    force: Option<Vec<Mat<f64>>>,
    moment: Option<Vec<Mat<f64>>>,
    /// Stresses of the undeformed body (6 x 1) and in every mode; `None` for a body without stresses of nodes.
    stresses: Option<(Mat<f64>, Vec<Mat<f64>>)>,
}

impl StiffenedFrame {
    /// Returns origin, phi, psi, AP and, for a body with stresses of nodes, sigma (xx, yy, zz, xy, yz, xz). The second-order motion (7.5) is in phi1 and psi1.
    pub(crate) fn objects(&self) -> Vec<Taylor> {
        let ExportFrame { position, translation, rotation, .. } = &self.frame;
        let nf = translation.ncols();
        let second = |stiff: &Option<Vec<Mat<f64>>>| {
            let second_order =
                |stiff: &Vec<Mat<f64>>, l: usize| Mat::from_fn(3, nf, |a, k| -stiff[a][(k, l)]);
            stiff.as_ref().map(|stiff| per_mode(nf, |l| second_order(stiff, l)))
        };
        let phi = Taylor { m1: second(&self.force), ..Taylor::constant("phi", translation.clone()) };
        let psi = match rotation {
            Some(rotation) => {
                Taylor { m1: second(&self.moment), ..Taylor::constant("psi", rotation.clone()) }
            }
            None => Taylor::zero("psi", 3, nf),
        };
        let turned = |k: usize| {
            let skew = rotation.as_ref().map_or_else(Matrix3::zeros, |rotation| {
                nalgebra::Vector3::from_fn(|a, _| rotation[(a, k)]).cross_matrix()
            });
            Mat::from_fn(3, 3, |i, j| skew[(i, j)])
        };
        let sigma = self.stresses.clone().map(|(rest, modes)| Taylor::linear("sigma", rest, modes));
        let objects = vec![
            Taylor::linear(
                "origin",
                Mat::from_fn(3, 1, |a, _| position[a]),
                per_mode(nf, |k| Mat::from_fn(3, 1, |a, _| translation[(a, k)])),
            ),
            phi,
            psi,
            Taylor::linear("AP", Mat::identity(3, 3), per_mode(nf, turned)),
        ];
        objects.into_iter().chain(sigma).collect()
    }

    /// Returns true if a force or moment of this kind acts at the frame and the file has its stiffness.
    pub(crate) fn holds(&self, kind: &LoadKind) -> bool {
        kind.interface() == self.frame.name.as_deref()
            && match kind {
                LoadKind::Force(_) => self.force.is_some(),
                LoadKind::Moment(_) => self.moment.is_some(),
                _ => false,
            }
    }
}

/// Returns the frames of the file. Stiffness of forces at an interface belongs to the reference point.
fn places(body: &FlexBody, points: &crate::export::Points) -> Vec<StiffenedFrame> {
    let frames = frames(body, points);
    let stresses = NodalStresses::new(body, frames.iter().map(|frame| frame.id));
    let place = |(at, frame): (usize, ExportFrame)| {
        let interface = body.interfaces().iter().find(|interface| {
            Some(&interface.name) == frame.name.as_ref() && interface.reference == Some(frame.position)
        });
        let stiffness_for = |kind: fn(String) -> LoadKind| {
            interface.and_then(|interface| stiffness(body, &kind(interface.name.clone())))
        };
        let moment = if frame.rotation.is_some() { stiffness_for(LoadKind::Moment) } else { None };
        let column = |values: [f64; 6]| Mat::from_fn(6, 1, |c, _| values[c]);
        let of_modes = |own: &NodalStresses<'_>| per_mode(body.n_modes(), |k| column(own.in_mode(at, k)));
        let stresses = stresses.as_ref().map(|own| (column(own.at_rest(at)), of_modes(own)));
        StiffenedFrame { force: stiffness_for(LoadKind::Force), moment, stresses, frame }
    };
    frames.into_iter().enumerate().map(place).collect()
}
