//! Integration rules: points in natural coordinates and their weights.

/// Point of an integration rule.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RulePoint {
    /// Position in natural coordinates.
    pub(crate) at: [f64; 3],
    /// Weight; the weights of a rule add up to the volume of the shape in natural coordinates.
    pub(crate) weight: f64,
}

/// Integration rule. Points stand in the order of Abaqus and CalculiX.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rule {
    /// Tetrahedron: its centre, exact for linear functions.
    Tet1,
    /// Tetrahedron: four points, exact for quadratic functions.
    Tet4,
    /// Wedge: the centre of the triangle times two Gauss points along the axis.
    Wedge2,
    /// Wedge: three points in the triangle times two Gauss points along the axis.
    Wedge6,
    /// Wedge: three points in the triangle times three Gauss points along the axis.
    Wedge9,
    /// Hexahedron: 2 x 2 x 2 Gauss points.
    Hex8,
    /// Hexahedron: 3 x 3 x 3 Gauss points.
    Hex27,
}

impl Rule {
    /// Returns the number of points.
    pub(crate) const fn n_points(self) -> usize {
        match self {
            Self::Tet1 => 1,
            Self::Wedge2 => 2,
            Self::Tet4 => 4,
            Self::Wedge6 => 6,
            Self::Hex8 => 8,
            Self::Wedge9 => 9,
            Self::Hex27 => 27,
        }
    }

    /// Returns the points.
    pub(crate) fn points(self) -> Vec<RulePoint> {
        match self {
            Self::Tet1 => vec![RulePoint { at: [0.25; 3], weight: 1.0 / 6.0 }],
            Self::Tet4 => tet4(),
            Self::Wedge2 => wedge(&[[1.0 / 3.0; 2]], &gauss2()),
            Self::Wedge6 => wedge(&TRIANGLE3, &gauss2()),
            Self::Wedge9 => wedge(&TRIANGLE3, &gauss3()),
            Self::Hex8 => hex(&gauss2()),
            Self::Hex27 => hex(&gauss3()),
        }
    }
}

/// Three points inside a triangle, exact for quadratic functions.
const TRIANGLE3: [[f64; 2]; 3] = [[1.0 / 6.0, 1.0 / 6.0], [2.0 / 3.0, 1.0 / 6.0], [1.0 / 6.0, 2.0 / 3.0]];

/// Returns position and weight of two Gauss points between -1 and 1.
fn gauss2() -> [(f64, f64); 2] {
    let place = (1.0_f64 / 3.0).sqrt();
    [(-place, 1.0), (place, 1.0)]
}

/// Returns position and weight of three Gauss points between -1 and 1.
fn gauss3() -> [(f64, f64); 3] {
    let place = 0.6_f64.sqrt();
    [(-place, 5.0 / 9.0), (0.0, 8.0 / 9.0), (place, 5.0 / 9.0)]
}

fn tet4() -> Vec<RulePoint> {
    let near = 0.25 - 0.05 * 5.0_f64.sqrt();
    let far = 1.0 - 3.0 * near;
    let place = |corner: usize| {
        let mut at = [near; 3];
        if corner > 0 {
            at[corner - 1] = far;
        }
        RulePoint { at, weight: 1.0 / 24.0 }
    };
    (0..4).map(place).collect()
}

/// Returns the points of all layers along the axis, one layer after the other; weights of the triangle are equal.
fn wedge(triangle: &[[f64; 2]], line: &[(f64, f64)]) -> Vec<RulePoint> {
    let share = 0.5 / triangle.len() as f64;
    let layer = |&(z, weight): &(f64, f64)| {
        triangle.iter().map(move |&[x, y]| RulePoint { at: [x, y, z], weight: share * weight })
    };
    line.iter().flat_map(layer).collect()
}

/// Returns the points of a hexahedron, the first coordinate running fastest.
fn hex(line: &[(f64, f64)]) -> Vec<RulePoint> {
    let mut points = Vec::with_capacity(line.len().pow(3));
    for (z, third) in line {
        for (y, second) in line {
            for (x, first) in line {
                points.push(RulePoint { at: [*x, *y, *z], weight: first * second * third });
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_add_up_to_the_volume_and_points_to_the_centre() {
        let shapes = [
            (vec![Rule::Tet1, Rule::Tet4], 1.0 / 6.0, [0.25; 3]),
            (vec![Rule::Wedge2, Rule::Wedge6, Rule::Wedge9], 1.0, [1.0 / 3.0, 1.0 / 3.0, 0.0]),
            (vec![Rule::Hex8, Rule::Hex27], 8.0, [0.0; 3]),
        ];
        for (rules, volume, centre) in shapes {
            for rule in rules {
                let points = rule.points();
                assert_eq!(points.len(), rule.n_points());
                let total: f64 = points.iter().map(|point| point.weight).sum();
                assert!((total - volume).abs() < 1e-14, "{rule:?}");
                for (d, place) in centre.into_iter().enumerate() {
                    let moment: f64 = points.iter().map(|point| point.weight * point.at[d]).sum();
                    assert!((moment - volume * place).abs() < 1e-14, "{rule:?} {d}");
                }
            }
        }
    }
}
