//! Geometry of one element: positions, volumes and gradients of the shape functions at its integration points.

use crate::formulation::{Formulation, Strain};
use crate::shape::{Function, MAX_NODES};
use std::sync::OnceLock;

/// One number for each function of an element.
pub(crate) type PerFunction = [f64; MAX_NODES];

/// Functions of a formulation at a point of its rule, in natural coordinates.
struct TablePoint {
    /// Position.
    at: [f64; 3],
    /// Weight of the rule.
    weight: f64,
    /// Values of the functions of the nodes.
    values: PerFunction,
    /// Derivatives of these along each natural coordinate.
    slopes: [PerFunction; 3],
}

/// Integration point of one element.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point {
    /// Position.
    pub(crate) position: [f64; 3],
    /// Volume: weight of the rule times the determinant of the Jacobian.
    pub(crate) volume: f64,
    /// Derivatives of the functions along x, y and z.
    pub(crate) gradients: [PerFunction; 3],
    /// A third of the mean gradients less the gradients, if the mean dilatation replaces that of the point. The strains
    /// xx, yy and zz grow by the sum of its products with the displacements.
    pub(crate) dilation: Option<[PerFunction; 3]>,
}

/// Position and volume of an integration point. The volumes of all points add up to the volume of the element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointVolume {
    /// Position.
    pub position: [f64; 3],
    /// Weight of the rule times the determinant of the Jacobian.
    pub volume: f64,
}

impl Formulation {
    /// Returns positions and volumes of the points of an element; `None` if it is inverted or degenerate at one of them.
    ///
    /// # Panics
    /// If the number of nodes is another one.
    pub fn points(self, x: &[[f64; 3]]) -> Option<Vec<PointVolume>> {
        let place = |point: &Point| PointVolume { position: point.position, volume: point.volume };
        Some(self.geometry(x)?.iter().map(place).collect())
    }

    /// Returns the points of an element; `None` if it is inverted or degenerate at one of them.
    pub(crate) fn geometry(self, x: &[[f64; 3]]) -> Option<Vec<Point>> {
        assert_eq!(x.len(), self.n_nodes(), "nodes of an element: {}", self.name());
        if self.strain() == Strain::Mean {
            return Some(vec![self.mean_point(x)?]);
        }
        let table = self.table();
        let mut points = Vec::with_capacity(table.len());
        for entry in table {
            let (inverse, determinant) = inverse(&jacobian(x, &entry.slopes))?;
            // An inverted element has negative volumes.
            if determinant <= 0.0 {
                return None;
            }
            points.push(Point {
                position: interpolate(x, &entry.values),
                volume: entry.weight * determinant,
                gradients: gradients(&inverse, &entry.slopes),
                dilation: None,
            });
        }
        match self.strain() {
            Strain::Incompatible => self.add_incompatible(x, &mut points)?,
            Strain::MeanDilatation => add_dilation(&mut points),
            Strain::OfGradient | Strain::Mean => {}
        }
        Some(points)
    }

    /// Returns the point whose gradients are the means over the volume. Only the volume must be positive, as in CalculiX.
    fn mean_point(self, x: &[[f64; 3]]) -> Option<Point> {
        // The integrals of the gradients are polynomials, for which the rule is exact.
        let mut integrals = [[0.0; MAX_NODES]; 3];
        let mut volume = 0.0;
        for entry in self.table() {
            let jacobian = jacobian(x, &entry.slopes);
            let cofactors = cofactors(&jacobian);
            volume += entry.weight * determinant(&jacobian, &cofactors);
            let scaled = gradients(&cofactors, &entry.slopes);
            for (sum, row) in integrals.iter_mut().flatten().zip(scaled.iter().flatten()) {
                *sum += entry.weight * row;
            }
        }
        let gradients = integrals.map(|row| row.map(|value| value / volume));
        let share = 1.0 / x.len() as f64;
        let position = std::array::from_fn(|d| share * x.iter().map(|node| node[d]).sum::<f64>());
        (volume > 0.0).then_some(Point { position, volume, gradients, dilation: None })
    }

    /// Adds the gradients of the functions 1 - xi^2, 1 - eta^2 and 1 - zeta^2, with the Jacobian at the centre.
    fn add_incompatible(self, x: &[[f64; 3]], points: &mut [Point]) -> Option<()> {
        let centre = split(&self.shape().functions([0.0; 3])).1;
        let (inverse, _) = inverse(&jacobian(x, &centre))?;
        let nodes = self.n_nodes();
        for (point, entry) in points.iter_mut().zip(self.table()) {
            for (along, row) in inverse.iter().enumerate() {
                for (gradient, slope) in point.gradients.iter_mut().zip(row) {
                    gradient[nodes + along] = -2.0 * entry.at[along] * slope;
                }
            }
        }
        Some(())
    }

    /// Returns the functions at the points of the rule, which are computed once.
    fn table(self) -> &'static [TablePoint] {
        static TABLES: [OnceLock<Vec<TablePoint>>; Formulation::ALL.len()] =
            [const { OnceLock::new() }; Formulation::ALL.len()];
        TABLES[self as usize].get_or_init(|| {
            let entry = |point: &crate::rule::RulePoint| {
                let (values, slopes) = split(&self.shape().functions(point.at));
                TablePoint { at: point.at, weight: point.weight, values, slopes }
            };
            self.rule().points().iter().map(entry).collect()
        })
    }
}

/// Replaces the dilatation of each point by the mean over the volume.
fn add_dilation(points: &mut [Point]) {
    let volume: f64 = points.iter().map(|point| point.volume).sum();
    let mut mean = [[0.0; MAX_NODES]; 3];
    for point in points.iter() {
        let share = point.volume / volume;
        for (sum, row) in mean.iter_mut().flatten().zip(point.gradients.iter().flatten()) {
            *sum += share * row;
        }
    }
    for point in points {
        let difference = |d: usize| std::array::from_fn(|n| (mean[d][n] - point.gradients[d][n]) / 3.0);
        point.dilation = Some(std::array::from_fn(difference));
    }
}

/// Returns values and derivatives of functions, with zeros behind the last one.
fn split(functions: &[Function]) -> (PerFunction, [PerFunction; 3]) {
    let mut values = [0.0; MAX_NODES];
    let mut slopes = [[0.0; MAX_NODES]; 3];
    for (n, function) in functions.iter().enumerate() {
        values[n] = function.value;
        for (row, slope) in slopes.iter_mut().zip(function.slope) {
            row[n] = slope;
        }
    }
    (values, slopes)
}

/// Returns the derivatives of the position (row: along x, y, z) for the natural coordinates (column).
fn jacobian(x: &[[f64; 3]], slopes: &[PerFunction; 3]) -> [[f64; 3]; 3] {
    let mut jacobian = [[0.0; 3]; 3];
    for (n, position) in x.iter().enumerate() {
        for (row, coordinate) in jacobian.iter_mut().zip(position) {
            for (entry, slope) in row.iter_mut().zip(slopes) {
                *entry += coordinate * slope[n];
            }
        }
    }
    jacobian
}

/// Returns the inverse of a matrix times its determinant.
fn cofactors(matrix: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let minor = |i: usize, j: usize| {
        let ([a, b], [c, d]) = ([(i + 1) % 3, (i + 2) % 3], [(j + 1) % 3, (j + 2) % 3]);
        matrix[a][c] * matrix[b][d] - matrix[a][d] * matrix[b][c]
    };
    std::array::from_fn(|row| std::array::from_fn(|column| minor(column, row)))
}

/// Returns the determinant of a matrix with its cofactors.
fn determinant(matrix: &[[f64; 3]; 3], cofactors: &[[f64; 3]; 3]) -> f64 {
    (0..3).map(|k| matrix[0][k] * cofactors[k][0]).sum()
}

/// Returns inverse and determinant of a matrix; `None` if it is singular.
fn inverse(matrix: &[[f64; 3]; 3]) -> Option<([[f64; 3]; 3], f64)> {
    let cofactors = cofactors(matrix);
    let determinant = determinant(matrix, &cofactors);
    let inverse = cofactors.map(|row| row.map(|value| value / determinant));
    (determinant != 0.0 && determinant.is_finite()).then_some((inverse, determinant))
}

/// Returns derivatives along x, y and z, where `inverse` has those of the natural coordinates (row) for x, y, z (column).
fn gradients(inverse: &[[f64; 3]; 3], slopes: &[PerFunction; 3]) -> [PerFunction; 3] {
    let mut gradients = [[0.0; MAX_NODES]; 3];
    for (d, row) in gradients.iter_mut().enumerate() {
        for (n, value) in row.iter_mut().enumerate() {
            *value =
                slopes[0][n] * inverse[0][d] + slopes[1][n] * inverse[1][d] + slopes[2][n] * inverse[2][d];
        }
    }
    gradients
}

/// Returns the position of a point.
fn interpolate(x: &[[f64; 3]], values: &PerFunction) -> [f64; 3] {
    let sum = |d: usize| x.iter().zip(values).map(|(position, value)| position[d] * value).sum();
    std::array::from_fn(sum)
}
