//! Points with the components of a stress among the rows of a recovery, their equivalent and principal stresses.

use crate::recovery::stress_labels::{StressLabel, labels_of};
use crate::{Quantity, RecoveryRow};
use nalgebra::Matrix3;

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
    /// equal before them. Components have any usual spelling (`ZX`, `13`, `sigma_xx`). A point has all six components; or xx, yy and xy, with or
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
