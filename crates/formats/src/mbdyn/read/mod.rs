//! MBDyn as an import format, recognised by its record groups, and the body that they describe.

mod records;

use crate::import::redundant::{ROUNDING, Redundant, asymmetry, has_no_w2, in_other_order, relative};
use crate::import::{AuditCheck, ImportFormat, ImportedBody, ImportedFile, ImportedFrame};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::text::InputFile;
use flexbody_body::flex_body::{GeometricStiffness, LoadKind, UnitLoad};
use flexbody_body::invariants::{Numbered, TermGroups};
use flexbody_linalg::larger;
use nalgebra::{Matrix3, Vector3};
use records::{GROUP, Records, Surplus};

/// Import format of MBDyn.
pub(crate) struct Mbdyn;

/// Number of bytes within which the first record group must begin.
const HEAD: usize = 1 << 16;

impl ImportFormat for Mbdyn {
    fn name(&self) -> &'static str {
        "mbdyn"
    }

    fn recognises(&self, file: &InputFile) -> bool {
        let head = &file.bytes()[..file.bytes().len().min(HEAD)];
        head.split(|byte| *byte == b'\n').any(|line| line.starts_with(GROUP.as_bytes()))
    }

    fn read(&self, file: &InputFile) -> Result<ImportedFile> {
        let records = Records::read(file)?;
        let Some(read) = body(&records) else {
            let message = "the file has no mass and inertia: record groups 11 and 12 are both missing";
            return Err(Diagnostic::new(Code::ForeignIncomplete, message).in_file(file.path()).into());
        };
        let newest = (1..=19).rev().find(|group| records.has(*group)).unwrap_or(10);
        let dialect = if newest > 13 { "level19" } else { "level13" };
        Ok(ImportedFile {
            format: "mbdyn",
            dialect: dialect.to_owned(),
            notes: notes(&records, newest),
            checks: checks(&records, &read),
            unsound: unsound(&records),
            body: read.body,
        })
    }
}

/// Returns the defects of a file with nonzero numbers that MBDyn skips: the header states other counts of
/// nodes or modes than the file has, and matrices are read wrongly.
fn unsound(records: &Records) -> Vec<String> {
    let numbers = records.skipped.iter().filter(|(_, surplus)| surplus.numbers && !surplus.zero);
    let sentence = |(group, surplus): &(Option<usize>, Surplus)| {
        let place = group
            .map_or_else(|| "before record group 1".to_owned(), |group| format!("of record group {group}"));
        format!("line {}: {} words {place} exceed the count in the header", surplus.line, surplus.words)
    };
    numbers.map(sentence).collect()
}

fn notes(records: &Records, newest: usize) -> Vec<String> {
    let mut notes = vec![
        format!("revision {}, {} nodes, {} modes", records.revision, records.n_nodes, records.n_modes),
        format!(
            "the last record group is {newest}; programs that do not know groups 14 to 19 reject files with a group above 13"
        ),
    ];
    if from_masses(records) {
        notes.push(
            "the invariants are computed from the lumped masses, as MBDyn does; MBDyn uses invariant 9 only if the joint has `use invariant 9`"
                .to_owned(),
        );
    }
    if COUPLING.iter().any(|group| records.has(*group)) {
        notes.push("invariants 4 and 8 are taken about the origin of the nodes: MBDyn does not move them with the origin of the joint".to_owned());
    }
    if records.general {
        notes.push(
            "the file states that the mass does not commute with rotations: record groups 9 and 18 need not agree"
                .to_owned(),
        );
    }
    let moves = |group: usize| records.get(group).is_some_and(|values| values.iter().any(|v| *v != 0.0));
    if moves(3) || moves(4) {
        notes.push(
            "the initial values of the modes (record groups 3 and 4) are not converted: a body has none"
                .to_owned(),
        );
    }
    if !records.ended {
        notes.push("the last line `** END OF FILE` is missing".to_owned());
    }
    notes
}

/// Groups of the invariants that couple rigid motion and modes.
const COUPLING: [usize; 5] = [14, 15, 16, 17, 18];

/// A body and its lumped masses.
struct Read {
    pub(crate) body: ImportedBody,
    pub(crate) lumped: Option<Lumped>,
}

/// Returns true if the coupling of the body is computed from lumped masses, as MBDyn does if the file has no
/// coupling groups.
fn from_masses(records: &Records) -> bool {
    records.has(11) && !COUPLING.iter().any(|group| records.has(*group))
}

/// Returns the missing coupling groups.
fn missing(records: &Records) -> Vec<String> {
    COUPLING.iter().filter(|group| !records.has(**group)).map(usize::to_string).collect()
}

/// Returns the body with mass, centre of mass and inertia from group 12, or from lumped masses; `None` if
/// both are missing.
fn body(records: &Records) -> Option<Read> {
    let nf = records.n_modes;
    let square = |values: &[f64]| Mat::from_fn(nf, nf, |i, j| values[i * nf + j]);
    let matrix = |group: usize| records.get(group).map(square);
    let lumped = lumped(records);
    let mut inertia = match &lumped {
        Some(masses) if from_masses(records) => masses.numbered.clone(),
        _ => file(records, Order::Rows),
    };
    // In MBDyn the values of group 12 take precedence.
    match (records.get(12), &lumped) {
        (Some(values), _) => rigid(&mut inertia, values),
        (None, Some(masses)) => {
            (inertia.i1, inertia.i2, inertia.i7) =
                (masses.numbered.i1, masses.numbered.i2, masses.numbered.i7);
        }
        (None, None) => return None,
    }
    inertia.i6 = matrix(9)?;
    let mut omissions: Vec<String> = Vec::new();
    let missing = missing(records);
    if !missing.is_empty() && !from_masses(records) {
        omissions.push(format!(
            "the file has no record groups {}: the body is converted without the terms in them",
            missing.join(", ")
        ));
    } else if has_no_w2(&inertia) {
        inertia.i9 = None;
        omissions.push("invariant 9 is zero: the body is converted without W2".to_owned());
    }
    let (geometric_stiffness, named) = stiffening(records, &mut omissions, square);
    let turns = (0..records.n_nodes)
        .map(|node| (0..nf).any(|mode| (3..6).any(|component| records.shape(node, component, mode) != 0.0)));
    let frames = turns.enumerate().map(|(node, turns)| frame(records, node, turns, &named)).collect();
    let body = ImportedBody {
        name: String::new(),
        units: None,
        inertia,
        modal_stiffness: matrix(10)?,
        modal_damping: matrix(13),
        geometric_stiffness,
        frames,
        mesh: None,
        omissions,
    };
    Some(Read { body, lumped })
}

/// Storage order of the three-row matrices in groups 14 to 18.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    /// Row by row, as MBDyn reads them.
    Rows,
    /// Column by column, as the manual of MBDyn describes.
    Columns,
}

/// Returns groups 14 to 18 of the file.
fn file(records: &Records, order: Order) -> Numbered {
    let nf = records.n_modes;
    let at = |group: usize, a: usize, column: usize| {
        let entry = |values: &[f64]| match order {
            Order::Rows => values[a * (values.len() / 3) + column],
            Order::Columns => values[3 * column + a],
        };
        records.get(group).map_or(0.0, entry)
    };
    let i9 = |row: usize, column: usize| at(18, row / nf, 3 * (row % nf * nf + column % nf) + column / nf);
    let i5 = |row: usize, k: usize| at(17, row / nf, row % nf * nf + k);
    // Large arrays are allocated only if the file has them.
    Numbered {
        i1: 0.0,
        i2: Vector3::zeros(),
        i3: Mat::from_fn(3, nf, |a, j| at(14, a, j)),
        i4: Mat::from_fn(3, nf, |a, j| at(15, a, j)),
        i5: records.has(17).then(|| Mat::from_fn(3 * nf, nf, i5)),
        i6: Mat::zeros(nf, nf),
        i7: Matrix3::zeros(),
        i8: (0..nf).map(|j| Matrix3::from_fn(|a, b| at(16, a, 3 * j + b))).collect(),
        i9: records.has(18).then(|| Mat::from_fn(3 * nf, 3 * nf, i9)),
        groups: TermGroups { w1: records.has(16), ..TermGroups::ALL },
    }
}

/// Returns the invariants of the file in column order, with the same mass and modal mass.
fn by_columns(records: &Records, numbered: &Numbered) -> Numbered {
    Numbered {
        i1: numbered.i1,
        i2: numbered.i2,
        i6: numbered.i6.clone(),
        i7: numbered.i7,
        ..file(records, Order::Columns)
    }
}

/// Sets mass, first moment and inertia about the origin from mass, centre of mass and inertia about it.
fn rigid(numbered: &mut Numbered, values: &[f64]) {
    let center = Vector3::new(values[1], values[2], values[3]);
    numbered.i1 = values[0];
    numbered.i2 = center * numbered.i1;
    let about_center = Matrix3::from_fn(|i, j| values[4 + 3 * i + j]);
    numbered.i7 = about_center - center.cross_matrix() * center.cross_matrix() * numbered.i1;
}

fn frame(records: &Records, node: usize, turns: bool, named: &[String]) -> ImportedFrame {
    let rows =
        |first: usize| Mat::from_fn(3, records.n_modes, |k, mode| records.shape(node, first + k, mode));
    let label = &records.labels[node];
    let is_interface = label.parse::<i64>().is_err() || named.contains(label);
    ImportedFrame {
        label: label.clone(),
        interface: is_interface.then(|| label.clone()),
        position: records.position(node),
        translation: rows(0),
        // Nodes of solid elements have zero rotations.
        rotation: turns.then(|| rows(3)),
    }
}

/// Returns group 19 and the labels of the nodes at which its forces act.
fn stiffening(
    records: &Records,
    omissions: &mut Vec<String>,
    square: impl Fn(&[f64]) -> Mat<f64>,
) -> (Vec<GeometricStiffness<Mat<f64>>>, Vec<String>) {
    let (mut all, mut named) = (Vec::new(), Vec::new());
    for (index, values) in &records.stiffening {
        let at = |offset: usize| records.labels.get(offset / 6).cloned();
        let load = match index {
            1..=6 => Some((LoadKind::Spin, index - 1)),
            7..=9 => Some((LoadKind::AngularAcceleration, index - 7)),
            10..=12 => Some((LoadKind::Acceleration, index - 10)),
            13.. => at(index - 13).map(|label| {
                named.push(label.clone());
                let component = (index - 13) % 6;
                let kind = if component < 3 { LoadKind::Force(label) } else { LoadKind::Moment(label) };
                (kind, component % 3)
            }),
            0 => None,
        };
        match load {
            Some((kind, component)) => {
                all.push(GeometricStiffness { load: UnitLoad { kind, component }, matrix: square(values) })
            }
            None => omissions.push(format!(
                "stress stiffening with index {index} is not converted: no load of the file has this index"
            )),
        }
    }
    (all, named)
}

// Invariants that MBDyn computes from lumped masses (record group 11) in Modal.cc, as sums over the nodes.

/// Invariants of the lumped masses of the nodes, and their negative masses.
pub(crate) struct Lumped {
    /// Invariants I1 to I9 about the origin; I6 is the modal mass of the lumped masses.
    pub(crate) numbered: Numbered,
    /// Number of nodes with a negative mass.
    pub(crate) negative: usize,
    /// Sum of the magnitudes of negative masses divided by the sum of all magnitudes.
    negative_share: f64,
}

/// Returns the lumped masses of record groups 8 and 11; `None` without group 11.
fn lumped(records: &Records) -> Option<Lumped> {
    let diagonal = records.get(11)?;
    let (n, nf) = (records.n_nodes, records.n_modes);
    let mut numbered = Numbered {
        i1: 0.0,
        i2: Vector3::zeros(),
        i3: Mat::zeros(3, nf),
        i4: Mat::zeros(3, nf),
        i5: None,
        i6: Mat::zeros(nf, nf),
        i7: Matrix3::zeros(),
        i8: vec![Matrix3::zeros(); nf],
        i9: None,
        groups: TermGroups::ALL,
    };
    let (mut i5, mut i9) = (Mat::zeros(3 * nf, nf), Mat::zeros(3 * nf, 3 * nf));
    let (mut negative, mut below, mut all) = (0, 0.0, 0.0);
    // Sums over the nodes with mass m, inertia J about the node, position x, shape psi and rotation theta.
    for node in 0..n {
        let [mass, _, _, jx, jy, jz] = *diagonal[6 * node..].first_chunk::<6>().expect("six per node");
        let x = Vector3::from(records.position(node));
        let inertia = Matrix3::from_diagonal(&Vector3::new(jx, jy, jz));
        let shape = |first: usize, j: usize| Vector3::from_fn(|k, _| records.shape(node, first + k, j));
        negative += usize::from(mass < 0.0);
        below += (-mass).max(0.0);
        all += mass.abs();
        // Rigid body: sum m, sum m x, sum J - m x~ x~.
        numbered.i1 += mass;
        numbered.i2 += x * mass;
        numbered.i7 += inertia - x.cross_matrix() * x.cross_matrix() * mass;
        for j in 0..nf {
            // Linear in a mode: sum m psi, sum m x~ psi + J theta, -sum m x~ psi~.
            let (psi, turn) = (shape(0, j), shape(3, j));
            let coupled = x.cross(&psi) * mass + inertia * turn;
            for a in 0..3 {
                numbered.i3[(a, j)] += mass * psi[a];
                numbered.i4[(a, j)] += coupled[a];
            }
            numbered.i8[j] -= x.cross_matrix() * psi.cross_matrix() * mass;
            for k in 0..nf {
                // Quadratic: sum m psi_j . psi_k + theta_j . J theta_k, sum m psi_j x psi_k, sum m psi_j~
                // psi_k~.
                let other = shape(0, k);
                numbered.i6[(j, k)] += psi.dot(&other) * mass + turn.dot(&(inertia * shape(3, k)));
                let (cross, double) = (psi.cross(&other), psi.cross_matrix() * other.cross_matrix());
                for a in 0..3 {
                    i5[(a * nf + j, k)] += mass * cross[a];
                    for b in 0..3 {
                        i9[(a * nf + j, b * nf + k)] += mass * double[(a, b)];
                    }
                }
            }
        }
    }
    (numbered.i5, numbered.i9) = (Some(i5), Some(i9));
    Some(Lumped { numbered, negative, negative_share: if all > 0.0 { below / all } else { 0.0 } })
}

// Checks of the record groups.

/// Largest relative rounding of a number that is not reported as lost digits. A larger value accepts files
/// with fewer digits.
const MAX_DIGIT_ROUNDING: f64 = 1e-8;

/// Number of last-digit roundings that an identity may accumulate. A smaller value reports rounding as
/// contradictions.
const TERMS: f64 = 10.0;

fn checks(records: &Records, read: &Read) -> Vec<AuditCheck> {
    let mut all = vec![digits(records), surplus(records)];
    all.extend(masses(records, read));
    if missing(records).is_empty() {
        all.extend(identities(records, read));
    } else if !from_masses(records) {
        all.push(coupling(records));
    }
    if let Some(damping) = &read.body.modal_damping {
        all.push(AuditCheck {
            name: "damping_symmetric",
            formula: "record group 13 = its transpose",
            value: asymmetry(damping),
            limit: ROUNDING + TERMS * records.rounding(),
            code: Code::AuditIdentity,
            meaning: "the damping of mode j by mode k differs from that of mode k by mode j".to_owned(),
        });
    }
    all
}

fn digits(records: &Records) -> AuditCheck {
    AuditCheck {
        name: "digits",
        formula: "half a unit of the last digit of numbers of size one",
        value: records.rounding(),
        limit: MAX_DIGIT_ROUNDING,
        code: Code::AuditDigits,
        meaning: format!("numbers are written with {}", records.digits.words()),
    }
}

/// Checks for text that MBDyn silently skips. A matrix of another size than the header states is then read
/// wrongly.
fn surplus(records: &Records) -> AuditCheck {
    let in_words = |(group, surplus): &(Option<usize>, Surplus)| {
        let zeros = if surplus.zero { ", all zero" } else { "" };
        let place =
            group.map_or("before record group 1".to_owned(), |group| format!("after record group {group}"));
        format!("{} words{zeros}, in line {} {place}", surplus.words, surplus.line)
    };
    let all: Vec<String> = records.skipped.iter().map(in_words).collect();
    AuditCheck {
        name: "no_more_than_the_header_says",
        formula: "number of words beyond the counts of the header",
        value: records.skipped.iter().map(|(_, surplus)| surplus.words as f64).sum(),
        limit: 0.0,
        code: Code::AuditSurplus,
        meaning: format!(
            "the file has more words than its header states, and MBDyn skips them without a message: {}",
            if all.is_empty() { "nothing".to_owned() } else { all.join("; ") }
        ),
    }
}

fn coupling(records: &Records) -> AuditCheck {
    let missing = missing(records);
    AuditCheck {
        name: "coupling_there",
        formula: "record groups 14 to 18, share that is missing",
        value: missing.len() as f64 / COUPLING.len() as f64,
        limit: 0.0,
        code: Code::AuditCoupling,
        meaning: format!(
            "record groups {} and lumped masses are missing: the motion of the body does not excite the modes, nor the modes the body",
            missing.join(", ")
        ),
    }
}

/// Checks lumped masses: no other coupling group is present, all are positive, and the modes belong to them.
fn masses(records: &Records, read: &Read) -> Vec<AuditCheck> {
    let Some(lumped) = &read.lumped else { return Vec::new() };
    let n = records.n_nodes;
    let nf = records.n_modes;
    let beside = !from_masses(records);
    let twice = AuditCheck {
        name: "lumped_masses_alone",
        formula: "no record group 11 beside 14 to 18",
        value: f64::from(u8::from(beside)),
        limit: 0.0,
        code: Code::AuditIdentity,
        meaning:
            "the file has both lumped masses and invariants: MBDyn adds the sums over the masses to the invariants of the file, which then count twice"
                .to_owned(),
    };
    let negative = AuditCheck {
        name: "lumped_masses_positive",
        formula: "share of negative lumped masses",
        value: lumped.negative_share,
        limit: 0.0,
        code: Code::AuditLumped,
        meaning: format!("{} of {n} lumped masses are negative", lumped.negative),
    };
    // Differences between the sums over the masses and groups 9 and 12.
    let (own, sums) = (&read.body.inertia.i6, &lumped.numbered.i6);
    let size = |j: usize, k: usize| (own[(j, j)] * own[(k, k)]).abs().sqrt();
    let modal = (0..nf)
        .flat_map(|j| (0..nf).map(move |k| (j, k)))
        .map(|(j, k)| relative((own[(j, k)] - sums[(j, k)]).abs(), size(j, k)))
        .fold(0.0, larger);
    let total = relative((read.body.inertia.i1 - lumped.numbered.i1).abs(), read.body.inertia.i1.abs());
    let tensor =
        relative((read.body.inertia.i7 - lumped.numbered.i7).abs().max(), read.body.inertia.i7.abs().max());
    let consistent = AuditCheck {
        name: "lumped_masses_carry_modes",
        formula: "record groups 9 and 12 = sums over the masses of record group 11",
        value: larger(modal, larger(total, tensor)),
        limit: ROUNDING + TERMS * records.rounding(),
        code: Code::AuditLumped,
        meaning: format!(
            "the coupling of rigid motion and modes comes from {n} lumped masses, but the modes come from another mass matrix: modal mass differs by {modal:.1e}, mass by {total:.1e}, inertia by {tensor:.1e}"
        ),
    };
    vec![twice, negative, consistent]
}

/// Checks the redundant information of groups 9 and 14 to 18.
fn identities(records: &Records, read: &Read) -> Vec<AuditCheck> {
    let redundant = Redundant::new(&read.body.inertia);
    let limit = ROUNDING + TERMS * records.rounding();
    let identity = |name, formula, value, meaning: &str| AuditCheck {
        name,
        formula,
        value,
        limit,
        code: Code::AuditIdentity,
        meaning: meaning.to_owned(),
    };
    // Identities between invariants that follow from each other.
    let mut all = vec![
        identity(
            "i4_of_i8",
            "invariant 4 = skew part of invariant 8",
            redundant.i4_of_i8(),
            "groups 15 and 16 state different couplings of modes and rotation: they refer to different points, or group 16 is transposed",
        ),
        identity(
            "i5_antisymmetric",
            "invariant 5_jk = -invariant 5_kj",
            redundant.i5_antisymmetric(),
            "a mode has moment of momentum with itself",
        ),
        identity(
            "i9_symmetric",
            "invariant 9_jk = transpose of invariant 9_kj",
            redundant.i9_symmetric(),
            "the inertia of a pair of modes differs between (j, k) and (k, j)",
        ),
        identity(
            "i5_of_i9",
            "invariant 5_jk = skew part of invariant 9_jk",
            redundant.i5_of_i9(),
            "groups 17 and 18 state different couplings of pairs of modes to rotation: group 18 is transposed, or one of them has the opposite sign",
        ),
    ];
    if !records.general && read.body.inertia.i9.is_some() {
        let mut lumped = redundant.lumped(
            "modal_mass_of_i9",
            "modal mass = half the trace of -invariant 9_jk",
            "record group 18",
        );
        lumped.limit = limit;
        all.push(lumped);
    }
    find_column_order(records, read, &mut all);
    all
}

/// Distinguishes groups stored column by column from wrong groups: their identities hold in that order.
fn find_column_order(records: &Records, read: &Read, checks: &mut [AuditCheck]) {
    let columns = by_columns(records, &read.body.inertia);
    let redundant = Redundant::new(&columns);
    let seen_by = [
        ("i4_of_i8", redundant.i4_of_i8()),
        ("i5_antisymmetric", redundant.i5_antisymmetric()),
        ("i9_symmetric", redundant.i9_symmetric()),
        ("i5_of_i9", redundant.i5_of_i9()),
        ("modal_mass_of_i9", redundant.i6_of_i9()),
    ];
    let meaning = "groups 14 to 18 are stored column by column, as the manual describes them; MBDyn reads them row by row";
    in_other_order(checks, &seen_by, meaning);
}
