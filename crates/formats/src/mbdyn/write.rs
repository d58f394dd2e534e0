//! MBDyn: the `.fem` file of its modal joint (mbdyn/struct/modal.cc, commit ab748d7; manual, "Modal FEM
//! format").
//!
//! The file has numbered record groups of blank-separated numbers. The modal node lies in the origin of the
//! coordinates of the file, so that I4 and I8 are about the origin of the body frame: MBDyn moves groups 5 to
//! 7 and 12 when the joint names another origin, but not groups 15 and 16. Group 11, lumped masses, would be
//! added to groups 14 to 18 and is never written. I9_jk(a,b) of group 18 is in the a-th of three rows, in
//! column 3 (j nf + k) + b.

use crate::export::Holding::{self, Held, NotApplicable};
use crate::export::matrices::inertia;
use crate::export::stresses::{without_named_loads, without_recoveries};
use crate::export::{ExportChecklist, ExportFormat, ExportFrame, ExportOptions, Exported, frames, losses};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::provenance::generator;
use flexbody_body::flex_body::{FlexBody, LoadKind, UnitLoad};
use flexbody_body::invariants::Numbered;
use nalgebra::Matrix3;
use std::fmt::Write;

/// Export format of MBDyn.
pub(crate) struct Mbdyn;

const LEVEL_19: &str = "level19";
const LEVEL_13: &str = "level13";

impl ExportFormat for Mbdyn {
    fn name(&self) -> &'static str {
        "mbdyn"
    }

    fn reader(&self) -> &'static str {
        "MBDyn, modal joint (.fem)"
    }

    fn dialects(&self) -> &'static [&'static str] {
        &[LEVEL_19, LEVEL_13]
    }

    fn has_points(&self) -> bool {
        true
    }

    fn checklist(&self, body: &FlexBody, options: &ExportOptions) -> ExportChecklist {
        let places = frames(body, &options.points);
        let exact = is_exact(options);
        let no_coupling = (!exact).then(|| {
            "the coupling of rigid motion and modes (record groups 14 to 18), which programs of level 13 reject: modes vibrate as if the body did not move".to_owned()
        });
        ExportChecklist {
            rigid_coupling: Holding::held_but_for(no_coupling),
            plane: losses::plane(body),
            // Without coupling the other inertia terms are lost with it.
            deformed_inertia: if exact { Held } else { NotApplicable },
            general_w0: if exact { losses::general_w0(body) } else { NotApplicable },
            coriolis_force: if exact { Held } else { NotApplicable },
            general_w3: if exact { losses::general_w3(body, options) } else { NotApplicable },
            separate_w2: if exact { Held } else { NotApplicable },
            geometric_stiffness: losses::geometric_stiffness(body, options, |load| {
                exact && tag(load, &places).is_some()
            }),
            inertia_stiffness: losses::inertia_stiffness(body, options, |_| exact),
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

    fn needs(&self, body: &FlexBody, options: &ExportOptions) -> Vec<String> {
        let places = frames(body, &options.points);
        let tagged = tagged(body, &places);
        let Some(largest) = tagged.iter().map(|(tag, _)| *tag).max().filter(|_| is_exact(options)) else {
            return Vec::new();
        };
        let mut needs = vec![
            "MBDyn evaluates geometric stiffness (record group 19) only with `use automatic differentiation` in its control data, and otherwise ignores it without a message".to_owned(),
        ];
        if let Some(node) = largest.checked_sub(LOADS_OF_MOTION + 1).map(|index| index / 6 + 1) {
            needs.push(format!(
                "MBDyn reads geometric stiffness of forces at interfaces only in a joint with {node} or more interface nodes, in the order of the file"
            ));
        }
        needs
    }

    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported> {
        if !is_exact(options) && !body.conditions().is_mean() {
            let message = format!(
                "mbdyn cannot hold a body in the frame `{}` in dialect {LEVEL_13}: its modes need the coupling of record groups 14 to 18",
                body.conditions()
            );
            let help = format!("use --dialect {LEVEL_19}, or convert the model with --frame com");
            return Err(Diagnostic::new(Code::ExportLoses, message).with_help(help).into());
        }
        let places = frames(body, &options.points);
        let mut file = File(head(body));
        let numbered = inertia(body);
        file.nodes(&places, body.n_modes());
        file.matrix(9, "MODAL MASS MATRIX", &numbered.i6);
        file.matrix(10, "MODAL STIFFNESS MATRIX", body.invariants().modal_stiffness());
        file.rigid(&numbered);
        if losses::is_damped(body) {
            file.matrix(13, "MODAL DAMPING MATRIX", &body.damping());
        }
        if is_exact(options) {
            file.coupling(&numbered);
            file.stress_stiffness(body, &places);
        }
        file.0.push_str("**\n** END OF FILE\n");
        Ok(Exported::single(file.0.into_bytes()))
    }
}

fn is_exact(options: &ExportOptions) -> bool {
    options.dialect.as_deref() != Some(LEVEL_13)
}

/// Comment line that marks a general mass for the reader of flexbody; no number of the file states it.
const GENERAL_MASS: &str =
    "** GENERAL MASS: IT DOES NOT COMMUTE WITH ROTATIONS, RECORD GROUPS 9 AND 18 NEED NOT AGREE\n";

/// Returns the comment lines with provenance, units and reference point. The length of a line is limited
/// because MBDyn reads lines into a buffer of limited size.
fn head(body: &FlexBody) -> String {
    const LONGEST_NAME: usize = 200;
    let units = body.units();
    let printable = |c: char| if c.is_control() { ' ' } else { c };
    let name: String = body.description().name.chars().map(printable).take(LONGEST_NAME).collect();
    let general = body.invariants().general().map_or("", |_| GENERAL_MASS);
    // A name alone could be read as a record group.
    format!(
        "** BODY {name}, WRITTEN BY {}\n** UNITS {}, {}, {}; ALL ABOUT THE ORIGIN OF THE NODES, WHICH IS THAT OF THE MODAL NODE\n{general}",
        generator(),
        units.length.name(),
        units.mass.name(),
        units.time.name()
    )
}

/// Returns the label of a place: the name of its interface if the name is a single word and the interface has
/// no other place, otherwise the number.
fn label(places: &[ExportFrame], place: &ExportFrame) -> String {
    let alone = |name: &&String| {
        places.iter().filter(|other| other.name.as_ref() == Some(*name)).count() == 1
            && !name.is_empty()
            && !name.contains(|c: char| c.is_whitespace() || c.is_control() || c == '*')
            && name.parse::<i64>().is_err()
    };
    place.name.as_ref().filter(alone).cloned().unwrap_or_else(|| place.id.to_string())
}

/// Returns the index of a unit load in record group 19: 1 to 6 products of angular velocities, 7 to 9 angular
/// and 10 to 12 linear acceleration, then six for each place, force and moment. The joint must list the
/// interface nodes in the order of the file.
fn tag(load: &UnitLoad, places: &[ExportFrame]) -> Option<usize> {
    let first = match &load.kind {
        LoadKind::Spin => 1,
        LoadKind::AngularAcceleration => 7,
        LoadKind::Acceleration => 10,
        LoadKind::Force(at) | LoadKind::Moment(at) => {
            let is_there = |place: &ExportFrame| place.name.as_ref() == Some(at);
            let index = places.iter().position(is_there)?;
            // A load that acts at several nodes belongs to none of them.
            if places[index + 1..].iter().any(is_there) {
                return None;
            }
            LOADS_OF_MOTION + 1 + 6 * index + if matches!(load.kind, LoadKind::Moment(_)) { 3 } else { 0 }
        }
        LoadKind::Named(_) => return None,
    };
    Some(first + load.component)
}

/// Number of indices of record group 19 for velocities and accelerations; the indices of the nodes follow.
const LOADS_OF_MOTION: usize = 12;

/// Returns the matrices of record group 19 with their indices.
fn tagged(body: &FlexBody, places: &[ExportFrame]) -> Vec<(usize, Mat<f64>)> {
    let loads = body.stiffening_loads().into_iter();
    loads.filter_map(|load| Some((tag(&load, places)?, body.stiffness_under(&load)?))).collect()
}

/// Text of the file under construction.
struct File(String);

impl File {
    fn line(&mut self, text: &str) {
        self.0.push_str(text);
        self.0.push('\n');
    }

    fn group(&mut self, number: usize, title: &str) {
        self.line("**");
        self.line(&format!("** RECORD GROUP {number}, {title}"));
    }

    fn row(&mut self, values: impl IntoIterator<Item = f64>) {
        for value in values {
            write!(self.0, " {value:.16e}").expect("a string takes all");
        }
        self.0.push('\n');
    }

    fn matrix(&mut self, number: usize, title: &str, a: &Mat<f64>) {
        self.group(number, title);
        self.rows(a);
    }

    fn rows(&mut self, a: &Mat<f64>) {
        for i in 0..a.nrows() {
            self.row(a.row(i).iter().copied());
        }
    }

    fn nodes(&mut self, places: &[ExportFrame], nf: usize) {
        self.group(1, "HEADER");
        self.line("**   REVISION.  NODES.  NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES.");
        self.line(&format!("REV0 {} {nf} 0 0 0", places.len()));
        self.group(2, "FINITE ELEMENT NODE LIST");
        for place in places {
            self.line(&label(places, place));
        }
        for (k, axis) in ["X", "Y", "Z"].into_iter().enumerate() {
            self.group(5 + k, &format!("NODAL {axis} COORDINATES"));
            for place in places {
                self.row([place.position[k]]);
            }
        }
        self.group(8, "MODE SHAPES");
        for j in 0..nf {
            self.line(&format!("**    NORMAL MODE SHAPE # {}", j + 1));
            for place in places {
                let turn = |k: usize| place.rotation.as_ref().map_or(0.0, |rotation| rotation[(k, j)]);
                self.row((0..3).map(|k| place.translation[(k, j)]).chain((0..3).map(turn)));
            }
        }
    }

    /// Writes mass, centre of mass and the inertia about it.
    fn rigid(&mut self, numbered: &Numbered) {
        let center = numbered.i2 / numbered.i1;
        let steiner =
            (Matrix3::identity() * center.norm_squared() - center * center.transpose()) * numbered.i1;
        let inertia = numbered.i7 - steiner;
        self.group(12, "GLOBAL INERTIA");
        self.row([numbered.i1]);
        self.row(center.iter().copied());
        for i in 0..3 {
            self.row(inertia.row(i).iter().copied());
        }
    }

    fn coupling(&mut self, numbered: &Numbered) {
        let nf = numbered.i8.len();
        self.matrix(14, "INVARIANT 3", &numbered.i3);
        self.matrix(15, "INVARIANT 4", &numbered.i4);
        self.group(16, "INVARIANT 8");
        for a in 0..3 {
            self.row(numbered.i8.iter().flat_map(|i8| i8.row(a).iter().copied().collect::<Vec<_>>()));
        }
        self.group(17, "INVARIANT 5");
        for a in 0..3 {
            let pairs = (0..nf).flat_map(|j| (0..nf).map(move |k| (j, k)));
            self.row(pairs.map(|(j, k)| numbered.i5.as_ref().map_or(0.0, |i5| i5[(a * nf + j, k)])));
        }
        self.group(18, "INVARIANT 9");
        for a in 0..3 {
            let columns = (0..nf).flat_map(|j| (0..3 * nf).map(move |column| (j, column / 3, column % 3)));
            let entry = |(j, k, b): (usize, usize, usize)| {
                numbered.i9.as_ref().map_or(0.0, |i9| i9[(a * nf + j, b * nf + k)])
            };
            self.row(columns.map(entry));
        }
    }

    fn stress_stiffness(&mut self, body: &FlexBody, places: &[ExportFrame]) {
        let tagged = tagged(body, places);
        if tagged.is_empty() {
            return;
        }
        self.group(19, "STRESS STIFFENING MATRICES");
        self.line(&tagged.len().to_string());
        for (tag, matrix) in tagged {
            self.line(&tag.to_string());
            self.rows(&matrix);
        }
    }
}
