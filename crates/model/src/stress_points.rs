//! Points with all six stresses among the rows of a recovery, and their equivalent and principal stresses.

use super::{Quantity, RecoveryRow};
use nalgebra::Matrix3;

/// Components of a stress, in the order of [`StressPoint::rows`].
const COMPONENTS: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];

/// Point of the part whose six stresses are rows of a recovery.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StressPoint {
    /// Common part of the names of its rows.
    pub name: String,
    /// Unit of the stresses.
    pub unit: String,
    /// Indices of the rows xx, yy, zz, xy, yz, xz.
    pub rows: [usize; 6],
}

impl StressPoint {
    /// Returns the points among `rows`: six stresses of one node, element and unit whose names end with their
    /// components and are equal before them. The order is that of their first rows.
    pub fn among(rows: &[RecoveryRow]) -> Vec<Self> {
        type Key<'r> = (&'r str, &'r str, Option<i64>, Option<i64>);
        let mut found: Vec<(Key<'_>, [Option<usize>; 6])> = Vec::new();
        let mut places = std::collections::HashMap::new();
        for (at, row) in rows.iter().enumerate().filter(|(_, row)| row.quantity == Quantity::Stress) {
            let Some(component) = COMPONENTS.iter().position(|component| *component == row.component) else {
                continue;
            };
            let Some(name) = row.name.strip_suffix(COMPONENTS[component]) else { continue };
            let key =
                (name.trim_end_matches([' ', '_', '-', '.', ':']), row.unit.as_str(), row.node, row.element);
            let place = *places.entry(key).or_insert_with(|| {
                found.push((key, [None; 6]));
                found.len() - 1
            });
            found[place].1[component] = Some(at);
        }
        let complete = |((name, unit, ..), rows): (Key<'_>, [Option<usize>; 6])| {
            let [Some(a), Some(b), Some(c), Some(d), Some(e), Some(f)] = rows else { return None };
            Some(Self { name: name.to_owned(), unit: unit.to_owned(), rows: [a, b, c, d, e, f] })
        };
        found.into_iter().filter_map(complete).collect()
    }

    /// Returns the equivalent stress of von Mises for the values of all rows of the recovery:
    /// sqrt(((s_xx - s_yy)^2 + (s_yy - s_zz)^2 + (s_zz - s_xx)^2) / 2 + 3 (s_xy^2 + s_yz^2 + s_xz^2)).
    pub fn von_mises(&self, values: &[f64]) -> f64 {
        Self::von_mises_of(&self.rows.map(|row| values[row]))
    }

    /// Returns the equivalent stress of von Mises of the stress xx, yy, zz, xy, yz, xz.
    pub fn von_mises_of([xx, yy, zz, xy, yz, xz]: &[f64; 6]) -> f64 {
        let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
    }

    /// Returns the principal stresses for the values of all rows of the recovery, the largest first.
    pub fn principal(&self, values: &[f64]) -> [f64; 3] {
        Self::principal_of(&self.rows.map(|row| values[row]))
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
        assert_eq!((points[0].name.as_str(), points[0].rows), ("p", [1, 6, 3, 4, 5, 0]));
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
}
