//! A named load of a random body, and its counterparts in a transformed model.

use crate::transformations::{rows, turned_rows};
use flexbody_model::{ModelLoad, RawModel};
use nalgebra::Matrix3;
use std::path::PathBuf;

/// Name of the load.
pub const WIND: &str = "wind";

/// Returns a load with forces at all nodes, moments where nodes have rotations with a stiffness, and a resultant.
pub fn of(raw: &RawModel) -> Vec<ModelLoad> {
    let force = |(row, label): (usize, &flexbody_model::DofLabel)| {
        let has_place = raw.nodes.ids.contains(&label.node);
        let size = if label.direction > 3 { 0.1 } else { 1.0 };
        let is_empty = [&raw.stiffness, &raw.mass].iter().all(|one| one.matrix.column(row).0.is_empty());
        if has_place && !is_empty { size * (0.7 * (row + 1) as f64).sin() } else { 0.0 }
    };
    let forces = rows(raw).iter().enumerate().map(force).collect();
    vec![ModelLoad { name: WIND.to_owned(), forces, preload: false, path: PathBuf::new() }]
}

/// Returns the loads after a rotation or reflection of the model.
pub fn turned(raw: &RawModel, turn: &Matrix3<f64>) -> Vec<ModelLoad> {
    let places = turned_rows(raw, turn);
    changed(raw, |row, value| places[row].iter().map(|&(to, part)| (to as usize, part * value)).collect())
}

/// Returns the loads with row i of the model at `place[i]`.
pub fn permuted(raw: &RawModel, place: &[u32]) -> Vec<ModelLoad> {
    changed(raw, |row, value| vec![(place[row] as usize, value)])
}

/// Returns the loads in units with `force` times larger numbers of forces, and `length` times larger ones of lengths.
pub fn scaled(raw: &RawModel, force: f64, length: f64) -> Vec<ModelLoad> {
    let labels = rows(raw);
    changed(raw, |row, value| {
        let factor = if labels[row].direction > 3 { force * length } else { force };
        vec![(row, value * factor)]
    })
}

/// Returns the loads with every force as the forces that `entry` makes of it.
fn changed(raw: &RawModel, entry: impl Fn(usize, f64) -> Vec<(usize, f64)>) -> Vec<ModelLoad> {
    let mut all = raw.data.named_loads.clone();
    for load in &mut all {
        let mut forces = vec![0.0; load.forces.len()];
        for (row, &value) in load.forces.iter().enumerate() {
            entry(row, value).into_iter().for_each(|(to, part)| forces[to] += part);
        }
        load.forces = forces;
    }
    all
}
