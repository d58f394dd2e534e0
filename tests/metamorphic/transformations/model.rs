//! Transformations of the model.

use super::Pair;
use super::moved::Motion;
use super::world::{extent, turning};
use crate::correspondence::Correspondence;
use crate::draws::direction;
use crate::subject::Subject;
use crate::{carried_mass, named_loads, recoveries};
use flexbody_base::error::Result;
use flexbody_linalg::{CscMatrix, uniform};
use flexbody_model::{Damping, DofLabel, GeometricStiffness, LoadKind, RawMatrix, RawModel, UnitLoad};
use flexbody_motion::scene::Point;
use nalgebra::{Matrix3, Vector3};
use oracle::mesh::entries;
use oracle::random::Random;
use std::collections::{BTreeMap, HashMap};

/// Rotates the model about its origin.
pub fn turn(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let model = turning(subject, random);
    let map = Correspondence { model, ..Correspondence::default() };
    Ok(Some(Pair::new(subject, Motion::of_model(model, Vector3::zeros()).applied(subject), map)))
}

/// Shifts the model.
pub fn shift(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let by = direction(random, subject.dimension()) * (3.0 * extent(subject));
    let changed = Motion::of_model(Matrix3::identity(), by).applied(subject);
    Ok(Some(Pair::new(subject, changed, Correspondence::default())))
}

/// Renumbers the nodes.
pub fn renumber(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let order = random.permutation(subject.raw.nodes.len());
    // Labels of rows without a node keep their numbers, far below the new ones.
    let own: HashMap<i64, i64> =
        subject.raw.nodes.ids.iter().zip(order).map(|(&id, at)| (id, 1_000_000 + 17 * at as i64)).collect();
    let number = |id: &mut i64| *id = own.get(id).copied().unwrap_or(*id);
    let mut changed = subject.clone();
    let labels = rows(&subject.raw);
    changed.raw.dofs = Some(labels);
    changed.raw.nodes.ids.iter_mut().for_each(number);
    changed.raw.dofs.iter_mut().flatten().for_each(|label| number(&mut label.node));
    changed.raw.data.interfaces.iter_mut().flat_map(|set| &mut set.nodes).for_each(number);
    recoveries::renumber(&mut changed.raw.data.recoveries, number);
    let point = |point: &mut Point| {
        if let Point::Node(id) = point {
            number(id);
        }
    };
    let scene = &mut changed.scene;
    scene.loads.iter_mut().for_each(|load| point(&mut load.at));
    scene.watched.iter_mut().for_each(point);
    scene.carried.iter_mut().for_each(|carried| point(&mut carried.by));
    Ok(Some(Pair::new(subject, changed, Correspondence::default())))
}

/// Permutes the rows of the matrices, the node table and the nodes of the interfaces.
pub fn permute(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let raw = &subject.raw;
    let labels = rows(raw);
    let order = random.permutation(labels.len());
    let mut place = vec![0u32; order.len()];
    order.iter().enumerate().for_each(|(new, &old)| place[old] = new as u32);
    let permuted = |own: &RawMatrix| {
        let all: Vec<_> =
            entries(&own.matrix).map(|(i, j, v)| (place[i as usize], place[j as usize], v)).collect();
        RawMatrix { matrix: CscMatrix::from_triplets(order.len(), order.len(), &all), ..own.clone() }
    };
    let mut changed = subject.clone();
    (changed.raw.stiffness, changed.raw.mass) = (permuted(&raw.stiffness), permuted(&raw.mass));
    if let Some(Damping::Matrix(matrix)) = &raw.data.damping {
        changed.raw.data.damping = Some(Damping::Matrix(permuted(matrix)));
    }
    for stiffness in &mut changed.raw.data.geometric_stiffness {
        stiffness.matrix = permuted(&stiffness.matrix);
    }
    changed.raw.data.recoveries = recoveries::permuted(raw, &place);
    changed.raw.data.named_loads = named_loads::permuted(raw, &place);
    changed.raw.followers = carried_mass::permuted(raw, &place);
    changed.raw.dofs = Some(order.iter().map(|&old| labels[old]).collect());
    let nodes = random.permutation(raw.nodes.len());
    changed.raw.nodes.ids = nodes.iter().map(|&i| raw.nodes.ids[i]).collect();
    changed.raw.nodes.positions = nodes.iter().map(|&i| raw.nodes.positions[i]).collect();
    changed.raw.data.interfaces.iter_mut().for_each(|set| set.nodes.reverse());
    Ok(Some(Pair::new(subject, changed, Correspondence::default())))
}

/// Changes every entry of K and M by up to 1e-15 of itself, as another order of the sums behind it does on another
/// processor: decisions and texts must stay.
pub fn round(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    const CHANGE: f64 = 1e-15;
    let seed = random.next_u64() >> 1;
    let rounded = |own: &RawMatrix, seed: u64| {
        // Both triangles have the same change.
        let factor = |i: u32, j: u32| 1.0 + CHANGE * uniform(seed, u64::from(i.min(j)), u64::from(i.max(j)));
        let all: Vec<_> = entries(&own.matrix).map(|(i, j, v)| (i, j, v * factor(i, j))).collect();
        let n = own.matrix.n_rows();
        RawMatrix { matrix: CscMatrix::from_triplets(n, n, &all), ..own.clone() }
    };
    let mut changed = subject.clone();
    changed.raw.stiffness = rounded(&subject.raw.stiffness, seed);
    changed.raw.mass = rounded(&subject.raw.mass, seed + 1);
    Ok(Some(Pair::new(subject, changed, Correspondence::default())))
}

/// Returns the label of every row of a model.
pub fn rows(raw: &RawModel) -> Vec<DofLabel> {
    let directions = 1..=raw.dimension;
    let all = || {
        raw.nodes
            .ids
            .iter()
            .flat_map(|&node| directions.clone().map(move |direction| DofLabel { node, direction }))
    };
    raw.dofs.clone().unwrap_or_else(|| all().collect())
}

/// Returns for every row of a model the rows of the same vector, and the coefficients of the rotation.
pub fn turned_rows(raw: &RawModel, turn: &Matrix3<f64>) -> Vec<Vec<(u32, f64)>> {
    turned(&rows(raw), turn)
}

/// Returns for every one of these rows the rows of the same vector, and the coefficients of the rotation.
pub fn turned(labels: &[DofLabel], turn: &Matrix3<f64>) -> Vec<Vec<(u32, f64)>> {
    let place: HashMap<DofLabel, u32> =
        labels.iter().enumerate().map(|(i, &label)| (label, i as u32)).collect();
    let of_row = |label: &DofLabel| {
        let (first, axis) = (1 + (label.direction - 1) / 3 * 3, usize::from(label.direction - 1) % 3);
        let turn = if first == 4 { turn * turn.determinant() } else { *turn };
        let other = |k: usize| {
            Some((*place.get(&DofLabel { node: label.node, direction: first + k as u8 })?, turn[(k, axis)]))
        };
        (0..3).filter_map(other).filter(|(_, coefficient)| *coefficient != 0.0).collect()
    };
    labels.iter().map(of_row).collect()
}

/// Returns T A T' of a matrix on the rows of a model, with the rotation T of all vectors.
pub fn conjugated(raw: &RawModel, matrix: &CscMatrix, turn: &Matrix3<f64>) -> CscMatrix {
    combined(raw, &[(1.0, matrix)], turn)
}

/// Returns T A T' of a weighted sum of matrices.
fn combined(raw: &RawModel, terms: &[(f64, &CscMatrix)], turn: &Matrix3<f64>) -> CscMatrix {
    let turned = turned_rows(raw, turn);
    let mut sums: BTreeMap<(u32, u32), f64> = BTreeMap::new();
    for (factor, matrix) in terms {
        for (row, column, value) in entries(matrix) {
            for &(i, a) in &turned[row as usize] {
                for &(j, b) in turned[column as usize].iter().filter(|(j, _)| *j >= i) {
                    *sums.entry((i, j)).or_default() += factor * value * (a * b);
                }
            }
        }
    }
    let upper = sums.iter().map(|(&(i, j), &value)| (i, j, value));
    let lower = sums.iter().filter(|((i, j), _)| i != j).map(|(&(i, j), &value)| (j, i, value));
    let all: Vec<_> = upper.chain(lower).collect();
    CscMatrix::from_triplets(turned.len(), turned.len(), &all)
}

/// Returns the geometric stiffness of the rotated unit loads.
pub fn geometric(raw: &RawModel, turn: &Matrix3<f64>) -> Vec<GeometricStiffness<RawMatrix>> {
    let all = &raw.data.geometric_stiffness;
    let own = |one: &GeometricStiffness<RawMatrix>| {
        let same_kind = all.iter().filter(|other| other.load.kind == one.load.kind);
        let terms: Vec<(f64, &CscMatrix)> = same_kind
            .map(|other| (share(&one.load, &other.load, turn), &other.matrix.matrix))
            .filter(|(share, _)| *share != 0.0)
            .collect();
        let matrix = RawMatrix { matrix: combined(raw, &terms, turn), ..one.matrix.clone() };
        GeometricStiffness { load: one.load.clone(), matrix }
    };
    all.iter().map(own).collect()
}

/// Returns the part of the old unit load `old` in the new one.
fn share(new: &UnitLoad, old: &UnitLoad, turn: &Matrix3<f64>) -> f64 {
    match new.kind {
        LoadKind::Spin => {
            let ((k, l), (a, b)) = (LoadKind::SPIN[new.component], LoadKind::SPIN[old.component]);
            // Coefficient of w'_k w'_l in w_a w_b with w = T' w'.
            let product = |k: usize, l: usize| turn[(k, a)] * turn[(l, b)];
            if k == l { product(k, k) } else { product(k, l) + product(l, k) }
        }
        LoadKind::AngularAcceleration | LoadKind::Moment(_) => {
            turn.determinant() * turn[(new.component, old.component)]
        }
        _ => turn[(new.component, old.component)],
    }
}
