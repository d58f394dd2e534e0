//! The elimination of rows that follow others by constraints: u = T u_n, so that K and M become T' K T and T' M T.

use super::constraints::{Constraint, Relation};
use crate::matrices::dmig::Point;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::CscMatrix;
use flexbody_model::{NodeAxes as Axes, Nodes};
use nalgebra::{Matrix6, Vector3, Vector6};
use std::collections::{BTreeMap, HashMap};

/// Part of the largest singular value of a rigid body or an average below which singular values count as zero.
const SINGULAR: f64 = 1e-10;

/// Number of constraints that a message names.
const MAX_NAMED: usize = 8;

/// Point as a weighted sum of others.
pub(super) type Sum = Vec<(Point, f64)>;

/// Dependent points, each as a sum of independent points.
pub(super) struct Followers {
    sums: BTreeMap<Point, Sum>,
    /// Names of the constraints.
    names: Vec<String>,
}

/// Positions of grids and the axes of their rows.
pub(super) struct GridPlaces<'b> {
    positions: HashMap<i64, Vector3<f64>>,
    axes: &'b HashMap<i64, Axes>,
}

impl<'b> GridPlaces<'b> {
    pub(super) fn new(nodes: &Nodes, axes: &'b HashMap<i64, Axes>) -> Self {
        let grids = nodes.ids.iter().zip(&nodes.positions);
        Self { positions: grids.map(|(id, x)| (*id, Vector3::from(*x))).collect(), axes }
    }

    /// Returns true when rows of the grid are along other axes than those of the model.
    pub(super) fn are_turned(&self, grid: i64) -> bool {
        self.axes.contains_key(&grid)
    }

    fn position(&self, grid: i64, of: &Constraint) -> Result<Vector3<f64>, Diagnostic> {
        let known = self.positions.get(&grid).copied();
        known.ok_or_else(|| of.refused(format!("grid {grid} is not in the deck")))
    }

    /// Returns the unit vector along a component.
    pub(super) fn axis(&self, (grid, component): Point) -> Vector3<f64> {
        let k = usize::from(component.max(1) - 1) % 3;
        match self.axes.get(&grid) {
            Some(axes) => Vector3::from(axes[k]),
            None => Vector3::ith(k, 1.0),
        }
    }

    /// Returns the motion of a point by three translations at `origin` and three rotations times `length`.
    fn rigid(
        &self,
        point: Point,
        origin: Vector3<f64>,
        length: f64,
        of: &Constraint,
    ) -> Result<Vector6<f64>, Diagnostic> {
        let axis = self.axis(point);
        if point.1 == 0 {
            return Err(of.refused(format!("scalar point {} cannot be a part of it", point.0)));
        }
        let (along, about) = if point.1 <= 3 {
            (axis, (self.position(point.0, of)? - origin).cross(&axis) / length)
        } else {
            (Vector3::zeros(), axis / length)
        };
        Ok(Vector6::new(along.x, along.y, along.z, about.x, about.y, about.z))
    }
}

impl Followers {
    /// Finds the dependent points of `constraints`.
    ///
    /// # Errors
    /// FB111 for constraints that are not supported, make a point dependent twice, or follow one another in a circle.
    pub(super) fn new(constraints: &[&Constraint], places: &GridPlaces<'_>) -> Result<Self, Diagnostic> {
        let mut direct: BTreeMap<Point, (Sum, &Constraint)> = BTreeMap::new();
        for constraint in constraints {
            for (point, sum) in sums(constraint, places)? {
                if let Some((_, other)) = direct.insert(point, (sum, constraint)) {
                    let why = format!("{} is also dependent by {}", named(point), other.name);
                    return Err(constraint.refused(why));
                }
            }
        }
        let mut names: Vec<String> = constraints.iter().map(|constraint| constraint.name.clone()).collect();
        names.dedup();
        let mut all = Self { sums: BTreeMap::new(), names };
        // Every round solves the points whose sums have no unsolved dependent points.
        while !direct.is_empty() {
            let ready = |sum: &Sum| sum.iter().all(|(other, _)| !direct.contains_key(other));
            let solved: Vec<Point> =
                direct.iter().filter(|(_, (sum, _))| ready(sum)).map(|(point, _)| *point).collect();
            if solved.is_empty() {
                let (point, (_, constraint)) = direct.first_key_value().expect("some are left");
                let why = format!("{} depends on itself through other constraints", named(*point));
                return Err(constraint.refused(why));
            }
            for point in solved {
                let (sum, _) = direct.remove(&point).expect("it was listed");
                let sum = all.free(&sum);
                all.sums.insert(point, sum);
            }
        }
        Ok(all)
    }

    /// Returns the first names of constraints, and the number of the others.
    pub(super) fn some_names(&self) -> String {
        let some = self.names[..self.names.len().min(MAX_NAMED)].join(", ");
        match self.names.len().saturating_sub(MAX_NAMED) {
            0 => some,
            more => format!("{some} and {more} more"),
        }
    }

    /// Returns a sum in terms of independent points.
    fn free(&self, sum: &Sum) -> Sum {
        let mut free: BTreeMap<Point, f64> = BTreeMap::new();
        for (point, factor) in sum {
            match self.sums.get(point) {
                None => *free.entry(*point).or_default() += factor,
                Some(sum) => sum.iter().for_each(|(p, f)| *free.entry(*p).or_default() += factor * f),
            }
        }
        free.into_iter().filter(|(_, factor)| *factor != 0.0).collect()
    }

    /// Returns the dependent points, each with the independent points that it is the sum of.
    pub(super) fn sums(&self) -> &BTreeMap<Point, Sum> {
        &self.sums
    }

    fn contains(&self, point: &Point) -> bool {
        self.sums.contains_key(point)
    }

    /// Returns the points that others follow.
    pub(super) fn leaders(&self) -> impl Iterator<Item = Point> + '_ {
        self.sums.values().flatten().map(|(point, _)| *point)
    }

    /// Returns the elimination of the dependent points from the rows `points` (ascending).
    ///
    /// # Errors
    /// FB112 if a point that another one follows is not among them.
    pub(super) fn eliminate(&self, points: &[Point]) -> Result<Elimination, Diagnostic> {
        let left: Vec<Point> = points.iter().filter(|point| !self.contains(point)).copied().collect();
        let place = |point: &Point| {
            left.binary_search(point).map(|row| row as u32).map_err(|_| {
                let message = format!("rows depend by constraints on {}, which has no rows", named(*point));
                Diagnostic::new(Code::DeckRows, message)
            })
        };
        let (mut follows, mut picks) = (Vec::new(), Vec::new());
        for (row, point) in (0u32..).zip(points) {
            match self.sums.get(point) {
                None => {
                    let entry = (place(point)?, row, 1.0);
                    follows.push(entry);
                    picks.push(entry);
                }
                Some(sum) => {
                    for (leader, factor) in sum {
                        follows.push((place(leader)?, row, *factor));
                    }
                }
            }
        }
        let matrix = |entries: &[_]| CscMatrix::from_triplets(left.len(), points.len(), entries);
        Ok(Elimination { follows: matrix(&follows), picks: matrix(&picks), points: left })
    }
}

/// Elimination of the dependent rows.
pub(super) struct Elimination {
    /// Matrix whose column i holds the remaining rows that row i follows, with their factors.
    pub follows: CscMatrix,
    /// Matrix whose column i holds the remaining row that is row i, if there is one.
    pub picks: CscMatrix,
    /// Points of the remaining rows.
    pub points: Vec<Point>,
}

fn named((grid, component): Point) -> String {
    match component {
        0 => format!("scalar point {grid}"),
        _ => format!("component {component} of grid {grid}"),
    }
}

/// Returns the dependent points of one constraint, each with its sum.
fn sums(of: &Constraint, places: &GridPlaces<'_>) -> Result<Vec<(Point, Sum)>, Diagnostic> {
    match &of.relation {
        Relation::Rigid { independent, dependent } => rigid(of, independent, dependent, places),
        Relation::Rod { grids, dependent } => rod(of, *grids, *dependent, places),
        Relation::Average { reference, components, weighted } => {
            average(of, *reference, components, weighted, places)
        }
        Relation::Sum { terms, .. } => {
            let (point, first) = terms[0];
            let others = terms[1..].iter().filter(|(_, factor)| *factor != 0.0);
            Ok(vec![(point, others.map(|(other, factor)| (*other, -factor / first)).collect())])
        }
        Relation::Unsupported { .. } => Err(of.refused("constraints of this kind are not supported")),
    }
}

/// Returns the sums u_d = G_d G_i^-1 u_i, where G holds the rigid motions of the points.
fn rigid(
    of: &Constraint,
    independent: &[Point],
    dependent: &[Point],
    places: &GridPlaces<'_>,
) -> Result<Vec<(Point, Sum)>, Diagnostic> {
    let &[first, .., _] = independent else {
        return Err(of.refused("six independent components are needed"));
    };
    if independent.len() != 6 {
        return Err(of.refused(format!("it has {} independent components instead of six", independent.len())));
    }
    let origin = places.position(first.0, of)?;
    let length = longest(independent.iter().chain(dependent), origin, of, places)?;
    let mut motions = Matrix6::zeros();
    for (k, point) in independent.iter().enumerate() {
        motions.set_row(k, &places.rigid(*point, origin, length, of)?.transpose());
    }
    let inverse = inverted(motions)
        .ok_or_else(|| of.refused("its independent components do not prevent all rigid motions"))?;
    let follow = |point: &Point| {
        let factors = places.rigid(*point, origin, length, of)?.transpose() * inverse;
        Ok((
            *point,
            independent.iter().copied().zip(factors.iter().copied()).filter(|term| term.1 != 0.0).collect(),
        ))
    };
    dependent.iter().map(follow).collect()
}

/// Returns the component that keeps the distance of two grids constant: e.(u_b - u_a) = 0.
fn rod(
    of: &Constraint,
    [a, b]: [i64; 2],
    dependent: Point,
    places: &GridPlaces<'_>,
) -> Result<Vec<(Point, Sum)>, Diagnostic> {
    // Coefficients of the constraint in all displacements of both grids, solved for the dependent one.
    let line = places.position(b, of)? - places.position(a, of)?;
    let along = |grid: i64, sign: f64| {
        (1..=3).map(move |component| ((grid, component), sign * line.dot(&places.axis((grid, component)))))
    };
    let all: Sum = along(a, -1.0).chain(along(b, 1.0)).collect();
    let dependent_factor =
        all.iter().find(|(point, _)| *point == dependent).map_or(0.0, |(_, factor)| *factor);
    if dependent_factor.abs() <= SINGULAR * line.norm() {
        return Err(of.refused("its dependent component is perpendicular to the rod"));
    }
    let others = all.into_iter().filter(|(point, factor)| *point != dependent && *factor != 0.0);
    Ok(vec![(dependent, others.map(|(point, factor)| (point, -factor / dependent_factor)).collect())])
}

/// Returns the rigid motion q that fits the weighted motions best, q = (B' W B)^-1 B' W u. Weights of rotations are
/// multiplied by the square of the mean distance of the grids from the reference grid.
fn average(
    of: &Constraint,
    reference: i64,
    components: &[u8],
    weighted: &[(Point, f64)],
    places: &GridPlaces<'_>,
) -> Result<Vec<(Point, Sum)>, Diagnostic> {
    let origin = places.position(reference, of)?;
    let grids: std::collections::BTreeSet<i64> = weighted.iter().map(|((grid, _), _)| *grid).collect();
    // Mean distance of the grids, by which rotations become lengths.
    let mut distance = 0.0;
    for grid in &grids {
        distance += (places.position(*grid, of)? - origin).norm() / grids.len() as f64;
    }
    let length = if distance > 0.0 { distance } else { 1.0 };
    // Normal matrix B' W B of the weighted fit.
    let mut normal = Matrix6::zeros();
    let mut rows = Vec::new();
    for &(point, weight) in weighted {
        let weight = if point.1 > 3 { weight * length * length } else { weight };
        let row = places.rigid(point, origin, length, of)?;
        normal += weight * row * row.transpose();
        rows.push((point, weight * row));
    }
    let inverse = inverted(normal)
        .ok_or_else(|| of.refused("the components that it averages do not determine all rigid motions"))?;
    // Each component of the reference grid follows the fitted motion b (B' W B)^-1 B' W u.
    let follow = |component: &u8| {
        let point = (reference, *component);
        let weights = places.rigid(point, origin, length, of)?.transpose() * inverse;
        let mut sum: BTreeMap<Point, f64> = BTreeMap::new();
        rows.iter().for_each(|(other, row)| *sum.entry(*other).or_default() += (weights * row)[0]);
        Ok((point, sum.into_iter().filter(|(_, factor)| *factor != 0.0).collect()))
    };
    components.iter().map(follow).collect()
}

fn longest<'p>(
    points: impl Iterator<Item = &'p Point>,
    origin: Vector3<f64>,
    of: &Constraint,
    places: &GridPlaces<'_>,
) -> Result<f64, Diagnostic> {
    let mut longest = 0.0f64;
    for (grid, _) in points {
        longest = longest.max((places.position(*grid, of)? - origin).norm());
    }
    Ok(if longest > 0.0 { longest } else { 1.0 })
}

/// Returns the inverse; `None` for a singular matrix.
fn inverted(matrix: Matrix6<f64>) -> Option<Matrix6<f64>> {
    let values = matrix.singular_values();
    (values.min() > SINGULAR * values.max()).then(|| matrix.try_inverse()).flatten()
}
