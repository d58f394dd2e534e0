//! Stresses of recoveries compared with the stiffness of the model, under uniform strain.
//!
//! The field u = g y e_x (and its like) shears an isotropic solid uniformly: sigma_xy = G g at every point, and
//! u'K u = G g^2 V. With the volume V = m / density, which the mass matrix gives, vm^2 V^2 g^2 / (u'K u)^2 = 3 for any
//! mesh of one material, whatever its modulus. A wrong unit or exchanged nodes change it by orders of magnitude; several
//! materials and anisotropy by less.

use super::{FeModel, ModelRecovery, RecoveryOperator, StressPoint};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};

/// Largest ratio of the root mean square stress to the expected one, and of the expected to it, that is not reported. A
/// composite or a gauge in a stiff inclusion may have ten; kPa for Pa has a thousand.
const MAX_RATIO: f64 = 100.0;

/// Pairs of axes of the three shears.
const SHEARS: [(usize, usize); 3] = [(0, 1), (1, 2), (2, 0)];

/// Units of stress in pascals.
const UNITS: [(&str, f64); 12] = [
    ("Pa", 1.0),
    ("N/m^2", 1.0),
    ("N/m2", 1.0),
    ("kPa", 1e3),
    ("MPa", 1e6),
    ("N/mm^2", 1e6),
    ("N/mm2", 1e6),
    ("bar", 1e5),
    ("GPa", 1e9),
    ("psi", 6_894.757_293_168_361),
    ("ksi", 6_894_757.293_168_361),
    ("lbf/in^2", 6_894.757_293_168_361),
];

/// Adds a warning for each recovery whose stresses do not fit the stiffness of the model.
///
/// * `density`: of the solid elements, in the units of the model; without it nothing is compared.
pub(super) fn check_stress_scale(model: &FeModel, density: Option<f64>, found: &mut Vec<Diagnostic>) {
    let asked = model.recoveries();
    if asked.is_empty() || model.dimension() != 3 || density.is_none() {
        return;
    }
    let volume = total_mass(model) / density.unwrap_or(1.0);
    let strained = sheared(model);
    let energies = energies(model, &strained);
    for one in asked {
        if let Some(ratio) = stress_ratio(model, one, &strained, &energies, volume)
            && !(1.0 / MAX_RATIO..=MAX_RATIO).contains(&ratio)
        {
            let message = format!(
                "recovery `{}`: its stresses are {} times those that the stiffness of the model gives",
                one.name,
                short(ratio)
            );
            found.push(Diagnostic::new(Code::RecoveryScale, message).in_file(&one.path));
        }
    }
}

/// Returns a ratio in one digit: `1e-6`, `0.004`, `300`.
fn short(ratio: f64) -> String {
    if (1e-3..1e4).contains(&ratio) {
        let digits = 10f64.powf(ratio.log10().floor());
        return format!("{}", (ratio / digits).round() * digits);
    }
    format!("{ratio:.0e}")
}

fn total_mass(model: &FeModel) -> f64 {
    let fields = model.rigid_fields([0.0; 3], 1.0);
    let along = fields.as_ref().subcols(0, 1);
    let moved = model.pencil().apply_mass(along);
    (0..moved.nrows()).map(|i| along[(i, 0)] * moved[(i, 0)]).sum()
}

/// Returns the displacements of the three unit shears (N x 3): of each, the first axis moves with the second coordinate.
/// Rotations, which solids do not have, stay zero.
fn sheared(model: &FeModel) -> Mat<f64> {
    let mut fields = Mat::zeros(model.rows().len(), SHEARS.len());
    for (i, position) in model.nodes().positions.iter().enumerate() {
        for (c, (moved, along)) in SHEARS.into_iter().enumerate() {
            fields[(3 * i + moved, c)] = position[along];
        }
    }
    fields
}

/// Returns u'K u of each field.
fn energies(model: &FeModel, fields: &Mat<f64>) -> Vec<f64> {
    let forces = model.pencil().apply_stiffness(fields.as_ref());
    let energy = |c: usize| (0..fields.nrows()).map(|i| fields[(i, c)] * forces[(i, c)]).sum();
    (0..fields.ncols()).map(energy).collect()
}

/// Returns the root mean square of the equivalent stresses of a recovery relative to the expected one; `None` without
/// stresses in a known unit, or if nothing resists the shear.
fn stress_ratio(
    model: &FeModel,
    recovery: &ModelRecovery,
    fields: &Mat<f64>,
    energies: &[f64],
    volume: f64,
) -> Option<f64> {
    let RecoveryOperator::Rows { transposed, labels, .. } = &recovery.operator else { return None };
    let points = StressPoint::among(labels);
    let units = model.units();
    let of_model = units.mass.to_si() / (units.length.to_si() * units.time.to_si().powi(2));
    let mut sum = 0.0;
    for point in &points {
        let known = UNITS.iter().find(|(name, _)| *name == point.unit)?;
        for (c, energy) in energies.iter().enumerate() {
            let stress = |row: usize| -> f64 {
                let (rows, values) = transposed.column(row);
                rows.iter().zip(values).map(|(&row, value)| value * fields[(row as usize, c)]).sum()
            };
            let mut values = vec![0.0; labels.len()];
            point.rows.iter().for_each(|&row| values[row] = stress(row));
            // With g = 1: vm = sqrt(3) G and u'K u = G V.
            let expected = 3f64.sqrt() * energy / volume * of_model;
            sum += (point.von_mises(&values) * known.1 / expected).powi(2);
        }
    }
    let count = (points.len() * energies.len()) as f64;
    let ratio = (sum / count).sqrt();
    (count > 0.0 && ratio.is_finite()).then_some(ratio)
}
