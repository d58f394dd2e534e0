//! Recoveries and named loads of a body, computed again from its model.

use crate::convert::{BodyModes, BodyOfModel, NodesInFrame, Recovered};
use crate::flex_body::{FlexBody, NamedLoad, Recovery, ReferenceConditions, Storage};
use crate::invariants::IdentityCheck;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_linalg::context::Context;
use flexbody_linalg::largest;
use flexbody_model::FeModel;

/// Limit of recomputed rows, relative to the largest of their kind: static responses are accurate to 1e-8 of the whole
/// response, and rows of stresses are differences of displacements.
const MAX_ROW_DIFFERENCE: f64 = 1e-6;
/// Roundings of stored numbers that a row may show: it sums products of stored modes.
const ROUNDINGS: f64 = 100.0;

/// Returns the limit of what is computed again from static responses, relative to the largest of its kind.
pub(super) fn limit_of_responses(storage: Storage) -> f64 {
    MAX_ROW_DIFFERENCE + ROUNDINGS * storage.rounding()
}

/// Compares the recoveries and named loads that both `body` and `model` have. Empty if they share none.
///
/// # Errors
/// The errors of the static responses of the model.
pub(super) fn recovery_checks(
    body: &FlexBody,
    model: &FeModel,
    modes: &BodyModes,
    place: &NodesInFrame,
    modal_stiffness: &Mat<f64>,
) -> Result<Vec<IdentityCheck>> {
    let is_shared = |own: &Recovery| model.recoveries().iter().any(|recovery| recovery.name == own.name);
    let is_named = |own: &NamedLoad| model.named_loads().iter().any(|named_load| named_load.name == own.name);
    if !body.recoveries().iter().any(is_shared) && !body.named_loads().iter().any(is_named) {
        return Ok(Vec::new());
    }
    let held_at = match body.conditions() {
        ReferenceConditions::Interface(name) => Some(name.as_str()),
        _ => None,
    };
    let lowest = body.modes().eigenvalue.iter().copied().fold(f64::INFINITY, f64::min);
    let of_model = BodyOfModel { model, modes, place, modal_stiffness, lowest, held_at, is_check: true };
    let found = of_model.recoveries(body.groups(), &Context::QUIET)?;
    let limit = limit_of_responses(body.storage());
    let rows = row_differences(body.recoveries(), &found);
    let loads = load_differences(body.named_loads(), &found.named_loads, model);
    let mut checks = Vec::new();
    if !rows.is_empty() {
        let formula = "R Psi, R G_r F and the offsets of every recovery, from the matrices";
        checks.push(IdentityCheck::new("recoveries_recomputed", formula, largest(rows), limit));
    }
    if !loads.is_empty() {
        let formula = "Psi' f, resultants and moments of every named load, from its nodal forces";
        checks.push(IdentityCheck::new("named_loads_recomputed", formula, largest(loads), limit));
    }
    Ok(checks)
}

/// Returns the differences of the parts of all recoveries that both have, relative to their sizes.
fn row_differences(stored: &[Recovery], found: &Recovered) -> Vec<f64> {
    let mut differences = Vec::new();
    for (recomputed, of_modes) in found.recoveries.iter().zip(&found.of_modes) {
        let Some(own) = stored.iter().find(|one| one.name == recomputed.name) else { continue };
        if own.rows != recomputed.rows {
            differences.push(f64::INFINITY);
            continue;
        }
        let offset = |recovery: &Recovery| Mat::from_fn(recovery.offset.len(), 1, |i, _| recovery.offset[i]);
        differences.push(relative(&offset(own), &offset(recomputed), 0.0));
        differences.push(relative(&own.modes, &recomputed.modes, 0.0));
        // Static columns are what the modes leave of a response: they are as accurate as the whole.
        differences.push(relative(&own.spin, &recomputed.spin, of_modes.spin.norm_max()));
        differences.push(relative(&own.named, &recomputed.named, of_modes.named.norm_max()));
        for (at, of_modes) in recomputed.loads.iter().zip(&of_modes.loads) {
            let stored = own.loads.iter().find(|load| load.interface == at.interface);
            let halves = |columns: &Mat<f64>| [0, 3].map(|first| columns.subcols(first, 3).to_owned());
            if let Some(stored) = stored {
                let three = halves(&stored.columns).into_iter().zip(halves(&at.columns));
                let sizes = halves(&of_modes.columns).map(|half| half.norm_max());
                differences.extend(three.zip(sizes).map(|((own, found), size)| relative(&own, &found, size)));
            }
        }
        for (at, of_modes) in recomputed.motion.iter().zip(&of_modes.motion) {
            let stored = own.motion.iter().find(|one| one.load == at.load);
            let size = of_modes.columns.norm_max();
            differences.push(stored.map_or(f64::INFINITY, |own| relative(&own.columns, &at.columns, size)));
        }
    }
    differences
}

/// Returns the differences of the parts of all named loads that both have, relative to their sizes.
fn load_differences(stored: &[NamedLoad], found: &[NamedLoad], model: &FeModel) -> Vec<f64> {
    let mut differences = Vec::new();
    for recomputed in found {
        let Some(own) = stored.iter().find(|one| one.name == recomputed.name) else { continue };
        if own.preload != recomputed.preload {
            differences.push(f64::INFINITY);
        }
        let column = |values: &[f64]| Mat::from_fn(values.len(), 1, |i, _| values[i]);
        let moments = |load: &NamedLoad| column(load.moments.as_slice());
        // The resultant of a preload is rounding.
        let nodal = model.named_loads().iter().filter(|load| load.name == recomputed.name);
        let nodal = largest(nodal.flat_map(|load| load.forces.iter().map(|force| force.abs())));
        let size = moments(recomputed).norm_max();
        differences.extend([
            relative(&column(&own.modal), &column(&recomputed.modal), 0.0),
            relative(&column(own.force.as_slice()), &column(recomputed.force.as_slice()), nodal),
            relative(&column(own.torque.as_slice()), &column(recomputed.torque.as_slice()), size),
            relative(&moments(own), &moments(recomputed), 0.0),
            relative(&own.turning, &recomputed.turning, 0.0),
        ]);
    }
    differences
}

/// Returns the largest difference of entries, relative to the largest entry of both or to `size`. Infinite for other
/// extents.
fn relative(stored: &Mat<f64>, found: &Mat<f64>, size: f64) -> f64 {
    if stored.shape() != found.shape() {
        return f64::INFINITY;
    }
    let scale = stored.norm_max().max(found.norm_max()).max(size);
    match (stored - found).norm_max() {
        0.0 => 0.0,
        difference => difference / scale,
    }
}
