//! Points with the components of a stress among the rows of a recovery, their equivalent stress, and its comparison with the
//! stiffness of the model under uniform strain.
//!
//! The field u = g y e_x (and its like) shears an isotropic solid uniformly: sigma_xy = G g at every point, and
//! u'K u = G g^2 V. With the volume V = m / density, which the mass matrix gives, vm^2 V^2 g^2 / (u'K u)^2 = 3 for any
//! mesh of one material, whatever its modulus. A wrong unit or exchanged nodes change it by orders of magnitude; several
//! materials and anisotropy by less.

use super::stress_labels::{StressLabel, labels_of};
use super::{AnsweredShapes, FeModel, ModelRecovery, Quantity, RecoveryOperator, RecoveryRow};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use nalgebra::Matrix3;
use std::collections::HashMap;

/// Point of the part whose stresses are rows of a recovery.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StressPoint {
    /// Common part of the names of its rows.
    pub name: String,
    /// Unit of the stresses.
    pub unit: String,
    /// Indices of the rows xx, yy, zz, xy, yz, xz; `None` for a component of a plane state that is zero.
    pub rows: [Option<usize>; 6],
}

/// Components xx, yy and xy, in the order of [`StressPoint::rows`]: those of a plane stress.
const IN_PLANE: [usize; 3] = [0, 1, 3];

/// Components yz and xz, which a plane state does not have.
const OUT_OF_PLANE: [usize; 2] = [4, 5];

impl StressPoint {
    /// Returns the points among `rows`: stresses of one node, element and unit whose names end with their components and are
    /// equal before them. Components have any spelling of [`labels_of`]. A point has all six components; or xx, yy and xy, with or
    /// without zz, of a plane state whose other stresses are zero. The order is that of the first rows of the points.
    pub fn among(rows: &[RecoveryRow]) -> Vec<Self> {
        type Key<'r> = (&'r str, &'r str, Option<i64>, Option<i64>);
        let mut found: Vec<(Key<'_>, [Option<usize>; 6])> = Vec::new();
        let mut places = std::collections::HashMap::new();
        for (at, row) in rows.iter().enumerate().filter(|(_, row)| row.quantity == Quantity::Stress) {
            let Some(StressLabel { component, name }) = labels_of(row) else { continue };
            let key = (name, row.unit.as_str(), row.node, row.element);
            let place = *places.entry(key).or_insert_with(|| {
                found.push((key, [None; 6]));
                found.len() - 1
            });
            // A symmetric component may be given twice, as xy and yx.
            found[place].1[component].get_or_insert(at);
        }
        let complete = |((name, unit, ..), rows): (Key<'_>, [Option<usize>; 6])| {
            let is_whole = rows.iter().all(Option::is_some);
            let is_plane = IN_PLANE.iter().all(|at| rows[*at].is_some())
                && OUT_OF_PLANE.iter().all(|at| rows[*at].is_none());
            (is_whole || is_plane).then(|| Self { name: name.to_owned(), unit: unit.to_owned(), rows })
        };
        found.into_iter().filter_map(complete).collect()
    }

    /// Returns true if rows of the point are missing because its state is plane.
    pub fn is_plane(&self) -> bool {
        self.rows.iter().any(Option::is_none)
    }

    /// Returns the index of the row xx.
    ///
    /// # Panics
    /// When the point has no row xx, which [`StressPoint::among`] excludes.
    pub fn first_row(&self) -> usize {
        self.rows[0].expect("every point has the row xx")
    }

    /// Returns the stress xx, yy, zz, xy, yz, xz by the values of the rows; zero for components that a plane state does not have.
    pub fn stress(&self, value: impl Fn(usize) -> f64) -> [f64; 6] {
        self.rows.map(|row| row.map_or(0.0, &value))
    }

    /// Returns the equivalent stress of von Mises for the values of all rows of the recovery:
    /// sqrt(((s_xx - s_yy)^2 + (s_yy - s_zz)^2 + (s_zz - s_xx)^2) / 2 + 3 (s_xy^2 + s_yz^2 + s_xz^2)).
    pub fn von_mises(&self, values: &[f64]) -> f64 {
        Self::von_mises_of(&self.stress(|row| values[row]))
    }

    /// Returns the equivalent stress of von Mises of the stress xx, yy, zz, xy, yz, xz.
    pub fn von_mises_of([xx, yy, zz, xy, yz, xz]: &[f64; 6]) -> f64 {
        let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
    }

    /// Returns the principal stresses for the values of all rows of the recovery, the largest first.
    pub fn principal(&self, values: &[f64]) -> [f64; 3] {
        Self::principal_of(&self.stress(|row| values[row]))
    }

    /// Returns the equivalent stress of von Mises with the sign of the principal stress of the largest magnitude.
    pub fn signed_von_mises(&self, values: &[f64]) -> f64 {
        let [most, _, least] = self.principal(values);
        self.von_mises(values).copysign(if most >= -least { 1.0 } else { -1.0 })
    }

    /// Returns the principal stresses of the stress xx, yy, zz, xy, yz, xz, the largest first; NaN for a stress that is
    /// not finite.
    pub fn principal_of([xx, yy, zz, xy, yz, xz]: &[f64; 6]) -> [f64; 3] {
        let stress = Matrix3::new(*xx, *xy, *xz, *xy, *yy, *yz, *xz, *yz, *zz);
        if !stress.iter().all(|v| v.is_finite()) {
            return [f64::NAN; 3];
        }
        let mut values: [f64; 3] = stress.symmetric_eigenvalues().into();
        values.sort_by(|a, b| b.total_cmp(a));
        values
    }
}

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

/// Returns one unit of stress in pascals; `None` for an unknown unit.
pub fn pascals(unit: &str) -> Option<f64> {
    UNITS.iter().find(|(name, _)| *name == unit).map(|(_, pascals)| *pascals)
}

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
        let ratio = match &one.operator {
            RecoveryOperator::Shapes { shapes, labels } => {
                stress_ratio_of_shapes(model, shapes, labels, &energies, volume)
            }
            _ => stress_ratio(model, one, &strained, &energies, volume),
        };
        if let Some(ratio) = ratio
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
    // A plane state does not resist the shears out of its plane.
    let points: Vec<StressPoint> =
        StressPoint::among(labels).into_iter().filter(|point| !point.is_plane()).collect();
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
            // With g = 1: vm = sqrt(3) G and u'K u = G V.
            let expected = 3f64.sqrt() * energy / volume * of_model;
            sum += (StressPoint::von_mises_of(&point.stress(stress)) * known.1 / expected).powi(2);
        }
    }
    let count = (points.len() * energies.len()) as f64;
    let ratio = (sum / count).sqrt();
    (count > 0.0 && ratio.is_finite()).then_some(ratio)
}

/// Returns the root mean square of the equivalent stresses of answered shapes relative to the expected one; `None` without stresses
/// in a known unit, or for shapes that do not move all nodes.
///
/// The mean of vm^2 / (3 G) over the volume is the part of 2 U / V of a shape with the strain energy U that changes no volume. With
/// G V from uniform shear, vm^2 = 6 U G V / V^2 for a shape of shear and less for others; stresses at nodes of a bent part are
/// larger by a small factor.
fn stress_ratio_of_shapes(
    model: &FeModel,
    shapes: &AnsweredShapes,
    labels: &[RecoveryRow],
    energies: &[f64],
    volume: f64,
) -> Option<f64> {
    let nodes = model.nodes();
    let place: HashMap<i64, usize> = nodes.ids.iter().copied().zip(0..).collect();
    let rows = model.rows().len();
    let count = shapes.displacements.ncols();
    let mut fields = Mat::zeros(rows, count);
    for (at, dof) in shapes.dofs.iter().enumerate().filter(|(_, dof)| dof.direction <= 3) {
        let row = 3 * place.get(&dof.node)? + usize::from(dof.direction) - 1;
        (0..count).for_each(|c| fields[(row, c)] = shapes.displacements[(at, c)]);
    }
    if shapes.dofs.len() != rows || rows != 3 * nodes.ids.len() {
        return None;
    }
    let points = StressPoint::among(labels);
    let pascals = points.iter().map(|point| pascals(&point.unit)).collect::<Option<Vec<f64>>>()?;
    let units = model.units();
    let of_model = units.mass.to_si() / (units.length.to_si() * units.time.to_si().powi(2));
    let of_shear = energies.iter().sum::<f64>() / energies.len() as f64;
    let forces = model.pencil().apply_stiffness(fields.as_ref());
    let (mut sum, mut expected) = (0.0, 0.0);
    for c in 0..count {
        let twice_energy: f64 = (0..rows).map(|i| fields[(i, c)] * forces[(i, c)]).sum();
        expected += 3.0 * twice_energy * of_shear / volume.powi(2) * of_model.powi(2);
        let square = |(point, pascals): (&StressPoint, &f64)| {
            (StressPoint::von_mises_of(&point.stress(|row| shapes.answers[(row, c)])) * pascals).powi(2)
        };
        sum += points.iter().zip(&pascals).map(square).sum::<f64>() / points.len() as f64;
    }
    let ratio = (sum / expected).sqrt();
    ratio.is_finite().then_some(ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, component: &str, node: i64) -> RecoveryRow {
        RecoveryRow {
            name: name.to_owned(),
            quantity: Quantity::Stress,
            component: component.to_owned(),
            unit: "MPa".to_owned(),
            node: Some(node),
            element: None,
        }
    }

    #[test]
    fn points_are_the_complete_ones_in_any_order_of_rows() {
        let mut rows: Vec<RecoveryRow> =
            ["xz", "xx", "zz", "xy", "yz", "yy"].iter().map(|c| row(&format!("p_{c}"), c, 7)).collect();
        rows.insert(2, row("q xx", "xx", 8));
        let points = StressPoint::among(&rows);
        assert_eq!(points.len(), 1);
        assert_eq!((points[0].name.as_str(), points[0].rows), ("p", [1, 6, 3, 4, 5, 0].map(Some)));
        // Uniaxial tension, pure shear, and a pressure.
        let values = |set: &[(usize, f64)]| {
            let mut all = vec![0.0; 7];
            set.iter().for_each(|(at, value)| all[*at] = *value);
            all
        };
        assert_eq!(points[0].von_mises(&values(&[(1, -3.0)])), 3.0);
        assert!((points[0].von_mises(&values(&[(4, 2.0)])) - 12f64.sqrt()).abs() < 1e-15);
        assert_eq!(points[0].von_mises(&values(&[(1, 5.0), (6, 5.0), (3, 5.0)])), 0.0);
        // Principal stresses of shear, and the sign of tension and of compression.
        let shear = points[0].principal(&values(&[(4, 2.0)]));
        assert!(shear.iter().zip([2.0, 0.0, -2.0]).all(|(a, b)| (a - b).abs() < 1e-15), "{shear:?}");
        assert_eq!(points[0].signed_von_mises(&values(&[(1, 3.0)])), 3.0);
        assert_eq!(points[0].signed_von_mises(&values(&[(1, -3.0)])), -3.0);
        assert!(points[0].principal(&values(&[(1, f64::NAN)])).iter().all(|v| v.is_nan()));
        // A row of another node completes no point.
        rows[1].node = Some(9);
        assert!(StressPoint::among(&rows).is_empty());
    }
    /// Returns the points of rows with these names, whose components are their last word.
    fn points(labels: &[&str]) -> Vec<StressPoint> {
        let of = |label: &&str| row(label, label.rsplit(' ').next().expect("a component"), 7);
        StressPoint::among(&labels.iter().map(of).collect::<Vec<_>>())
    }

    #[test]
    fn plane_states_are_points_and_other_parts_of_a_stress_are_not() {
        let plane = points(&["p xx", "p yy", "p xy"]);
        assert_eq!(plane[0].rows, [Some(0), Some(1), None, Some(2), None, None]);
        assert!(plane[0].is_plane() && plane[0].first_row() == 0);
        // sqrt(xx^2 - xx yy + yy^2 + 3 xy^2), and the eigenvalues of the stress in the plane beside zero.
        let values = [3.0, -1.0, 2.0];
        assert!((plane[0].von_mises(&values) - 25f64.sqrt()).abs() < 1e-14);
        let expected = [1.0 + 8f64.sqrt(), 0.0, 1.0 - 8f64.sqrt()];
        let principal = plane[0].principal(&values);
        assert!(principal.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14), "{principal:?}");
        // Plane strain and axial symmetry have the stress across the plane as well.
        assert_eq!(
            points(&["p S11", "p S22", "p S33", "p S12"])[0].rows,
            [Some(0), Some(1), Some(2), Some(3), None, None]
        );
        for part in [&["p xx", "p yy"][..], &["p xx", "p zz", "p xz"], &["p xx", "p yy", "p xy", "p yz"]] {
            assert!(points(part).is_empty(), "{part:?}");
        }
    }

    #[test]
    fn points_have_any_usual_spelling_of_the_components() {
        for six in [
            ["XX", "YY", "ZZ", "XY", "YZ", "ZX"],
            ["11", "22", "33", "12", "23", "13"],
            ["S11", "S22", "S33", "S12", "S23", "S31"],
            ["sxx", "syy", "szz", "sxy", "syz", "szx"],
            ["SX", "SY", "SZ", "SXY", "SYZ", "SXZ"],
            ["sigma_xx", "sigma_yy", "sigma_zz", "tau_xy", "tau_yz", "tau_zx"],
        ] {
            let labels = six.map(|component| format!("p {component}"));
            let found = points(&labels.each_ref().map(String::as_str));
            assert_eq!(found.len(), 1, "{six:?}");
            assert_eq!(
                (found[0].name.as_str(), found[0].rows),
                ("p", [0, 1, 2, 3, 4, 5].map(Some)),
                "{six:?}"
            );
        }
        // Both halves of a symmetric tensor.
        let nine = points(&["p xx", "p xy", "p xz", "p yx", "p yy", "p yz", "p zx", "p zy", "p zz"]);
        assert_eq!(nine[0].rows, [0, 4, 8, 1, 5, 2].map(Some));
    }
}
