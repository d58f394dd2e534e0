//! Recoveries of a random body, and their counterparts in a transformed model.

use crate::transformations::{rows, turned_rows};
use flexbody_linalg::CscMatrix;
use flexbody_model::{DofLabel, ModelRecovery, Quantity, RawModel, RecoveryOperator, RecoveryRow};
use nalgebra::{Matrix3, Vector3};
use oracle::mesh::entries;
use std::collections::HashMap;
use std::path::PathBuf;

/// Name of the recovery of relative elongations between nodes.
pub const GAUGES: &str = "gauges";

/// Name of the recovery of the forces and moments in a section.
pub const SECTION: &str = "section";

/// Largest number of gauges.
const MOST_GAUGES: usize = 5;

/// Number of nodes of the interfaces `root` and `tip` along x, which a section must not divide.
const AT_END: usize = 4;

/// Returns strain gauges between nodes, of every third model with the inertia of the deformation, and the section forces that
/// the half with larger x exerts on the rest. The elongation of a gauge from node a to node b is e (u_b - u_a)/L, with its
/// direction e and its length L.
pub fn of(raw: &RawModel) -> Vec<ModelRecovery> {
    let named = |name: &str, operator| ModelRecovery {
        name: name.to_owned(),
        operator,
        path: PathBuf::new(),
        deformed_inertia: name == GAUGES && raw.nodes.len().is_multiple_of(3),
    };
    let section = section(raw).map(|operator| named(SECTION, operator));
    std::iter::once(named(GAUGES, gauges(raw))).chain(section).collect()
}

/// Returns gauges from every third node to the one that follows it at a distance of two numbers.
fn gauges(raw: &RawModel) -> RecoveryOperator {
    let labels = rows(raw);
    let row: HashMap<DofLabel, u32> =
        labels.iter().enumerate().map(|(i, &label)| (label, i as u32)).collect();
    let place = |i: usize| Vector3::from(raw.nodes.positions[i]);
    let row_of =
        |i: usize, k: usize| row.get(&DofLabel { node: raw.nodes.ids[i], direction: k as u8 + 1 }).copied();
    let complete = |i: usize| (0..usize::from(raw.dimension)).all(|k| row_of(i, k).is_some());
    let ends = (0..raw.nodes.len().saturating_sub(2)).step_by(3).map(|i| [i, i + 2]);
    let pairs: Vec<[usize; 2]> = ends
        .filter(|[a, b]| complete(*a) && complete(*b) && (place(*b) - place(*a)).norm() > 0.0)
        .take(MOST_GAUGES)
        .collect();
    let mut all = Vec::new();
    for (gauge, &[a, b]) in pairs.iter().enumerate() {
        let along = place(b) - place(a);
        let share = along / along.norm_squared();
        for k in 0..usize::from(raw.dimension) {
            for (end, sign) in [(a, -1.0), (b, 1.0)] {
                all.extend(row_of(end, k).map(|row| (row, gauge as u32, sign * share[k])));
            }
        }
    }
    let label = |gauge: usize| RecoveryRow {
        name: format!("gauge {gauge}"),
        quantity: Quantity::Strain,
        component: "1".to_owned(),
        unit: String::new(),
        node: None,
        element: None,
    };
    RecoveryOperator::Rows {
        transposed: CscMatrix::from_triplets(labels.len(), pairs.len(), &all),
        labels: (0..pairs.len()).map(label).collect(),
        offset: None,
    }
}

/// Returns the section between the halves of a body that is large enough to leave both interfaces whole.
fn section(raw: &RawModel) -> Option<RecoveryOperator> {
    let mut order: Vec<usize> = (0..raw.nodes.len()).collect();
    order.sort_by(|&a, &b| raw.nodes.positions[b][0].total_cmp(&raw.nodes.positions[a][0]));
    let half = raw.nodes.len() / 2;
    let side = order.get(..half).filter(|_| half >= AT_END)?;
    let centre = side.iter().map(|&i| Vector3::from(raw.nodes.positions[i])).sum::<Vector3<f64>>();
    Some(RecoveryOperator::Cut {
        nodes: side.iter().map(|&i| raw.nodes.ids[i]).collect(),
        about: (centre / half as f64).into(),
    })
}

/// Returns the recoveries after a rotation or reflection of the model and its shift.
pub fn moved(
    raw: &RawModel,
    turn: &Matrix3<f64>,
    place: impl Fn([f64; 3]) -> [f64; 3],
) -> Vec<ModelRecovery> {
    let turned = turned_rows(raw, turn);
    changed(
        raw,
        |(row, value)| turned[row as usize].iter().map(|&(to, part)| (to, part * value)).collect(),
        place,
    )
}

/// Returns the recoveries with row i of the model at `place[i]`, and the nodes of the section in reverse order.
pub fn permuted(raw: &RawModel, place: &[u32]) -> Vec<ModelRecovery> {
    let mut all = changed(raw, |(row, value)| vec![(place[row as usize], value)], |x| x);
    for one in &mut all {
        if let RecoveryOperator::Cut { nodes, .. } = &mut one.operator {
            nodes.reverse();
        }
    }
    all
}

/// Returns the recoveries of a model whose lengths are `length` times larger numbers; strains keep their numbers.
pub fn scaled(raw: &RawModel, length: f64) -> Vec<ModelRecovery> {
    let labels = rows(raw);
    let factor = |row: u32| if labels[row as usize].direction > 3 { 1.0 } else { 1.0 / length };
    changed(raw, |(row, value)| vec![(row, value * factor(row))], |x| x.map(|x| x * length))
}

/// Gives the nodes of sections other numbers.
pub fn renumber(all: &mut [ModelRecovery], number: impl Fn(&mut i64)) {
    for one in all {
        if let RecoveryOperator::Cut { nodes, .. } = &mut one.operator {
            nodes.iter_mut().for_each(&number);
        }
    }
}

/// Returns the recoveries with every entry of an operator as the entries that `entry` makes of it, and the point of
/// the moments at its new `place`.
fn changed(
    raw: &RawModel,
    entry: impl Fn((u32, f64)) -> Vec<(u32, f64)>,
    place: impl Fn([f64; 3]) -> [f64; 3],
) -> Vec<ModelRecovery> {
    let mut all = raw.data.recoveries.clone();
    for one in &mut all {
        match &mut one.operator {
            RecoveryOperator::Rows { transposed, .. } => {
                let made = entries(transposed).flat_map(|(row, gauge, value)| {
                    entry((row, value)).into_iter().map(move |(i, v)| (i, gauge, v))
                });
                let made: Vec<_> = made.collect();
                *transposed = CscMatrix::from_triplets(transposed.n_rows(), transposed.n_cols(), &made);
            }
            RecoveryOperator::Cut { about, .. } => *about = place(*about),
            RecoveryOperator::Shapes { .. } => {}
        }
    }
    all
}
