//! Conversion of the record groups into a body.

use super::lumped::{Lumped, lumped};
use super::records::Records;
use crate::import::redundant::has_no_w2;
use crate::import::{ImportedBody, ImportedFrame};
use faer::Mat;
use flexbody_body::flex_body::{GeometricStiffness, LoadKind, UnitLoad};
use flexbody_body::invariants::{Numbered, TermGroups};
use nalgebra::{Matrix3, Vector3};

/// Groups of the invariants that couple rigid motion and modes.
pub(crate) const COUPLING: [usize; 5] = [14, 15, 16, 17, 18];

/// A body and its lumped masses.
pub(crate) struct Read {
    pub(crate) body: ImportedBody,
    pub(crate) lumped: Option<Lumped>,
}

/// Returns true if the coupling of the body is computed from lumped masses, as MBDyn does if the file has no
/// coupling groups.
pub(crate) fn from_masses(records: &Records) -> bool {
    records.has(11) && !COUPLING.iter().any(|group| records.has(*group))
}

/// Returns the missing coupling groups.
pub(crate) fn missing(records: &Records) -> Vec<String> {
    COUPLING.iter().filter(|group| !records.has(**group)).map(usize::to_string).collect()
}

/// Returns the body with mass, centre of mass and inertia from group 12, or from lumped masses; `None` if
/// both are missing.
pub(crate) fn body(records: &Records) -> Option<Read> {
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
pub(crate) enum Order {
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
pub(crate) fn by_columns(records: &Records, numbered: &Numbered) -> Numbered {
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
