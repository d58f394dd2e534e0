//! Comparison of the stresses of a recovery with the stiffness of its model under uniform strain (theory section 15).
//!
//! Under u = E x with a uniform strain E, a homogeneous elastic body has one stress s(E) at all points, and
//! s(E) : F V = u(E)'K u(F). With the six strains E_k of the components xx, yy, zz, xy, yz, xz the right side is the matrix
//! A_kl = u_k'K u_l, and component k of the stress under E_l is A_kl / V at every point: the stiffness says so without
//! elements and moduli. The stresses C_p (6 x 6) that the rows of a point give are therefore C_p = T A / V with the unit
//! matrix as T; a T that turns the tensor belongs to rows along other axes, and any other T to wrong rows.
//!
//! K says as well if it is the stiffness of such a body. The nodal forces of a uniform stress are s(E_k) a_i with one vector
//! a_i for each node, the integral of its shape function over the surface. Forces that no a_i gives belong to several
//! materials, to beams, shells and rigid connections, or to elements that fail the patch test.

use crate::rows::centre_and_length;
use crate::rows::neighbours::neighbours;
use crate::{
    AnsweredShapes, DofLabel, FeModel, ModelRecovery, Quantity, RecoveryOperator, STRAIN_NAMES, StressPoint,
    pascals,
};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::numbers::significant;
use flexbody_linalg::{combine, dense_cholesky, gram, solve_lower, solve_upper};
use libm::{log10, pow};
use nalgebra::{Matrix3, Matrix6, Vector3};
use std::collections::HashMap;

/// Components of a stress, in the order of [`StressPoint::rows`], as pairs of axes.
const COMPONENTS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Largest deviation of a component from the expected one, relative to it.
const MAX_DEVIATION: f64 = 0.1;
/// Largest part of the nodal forces that no vectors a_i give, for a body that counts as homogeneous.
const MAX_RESIDUAL: f64 = 0.05;
/// Smallest energy of a uniform strain relative to the largest, below which nothing resists it.
const MIN_RESISTANCE: f64 = 1e-6;
/// Largest deviation of the stiffness of an isotropic material, relative to its largest entry.
const MAX_ANISOTROPY: f64 = 0.01;
/// Largest factor between a stress and the expected one, either way, in a homogeneous body: the volumes of curved elements
/// are known to some percent.
const MAX_FACTOR: f64 = 1.5;
/// Largest such factor that is not reported where the body is not homogeneous: a composite or a gauge in a stiff inclusion
/// may have ten; kPa for Pa has a thousand.
const MAX_FACTOR_OF_ANY: f64 = 100.0;

/// Adds an error for each recovery whose stresses contradict the stiffness, and a note for each that cannot be compared.
///
/// * `density`: of the solid elements, in the units of the model; without it, sizes are not compared.
/// * `allowed`: true if the user states that contradictions are intended, which makes them warnings.
pub(crate) fn check_stresses(
    model: &FeModel,
    density: Option<f64>,
    allowed: bool,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let mut strained = None;
    for recovery in model.recoveries() {
        let (RecoveryOperator::Rows { labels, .. } | RecoveryOperator::Shapes { labels, .. }) =
            &recovery.operator
        else {
            continue;
        };
        if !labels.iter().any(|row| row.quantity == Quantity::Stress) {
            continue;
        }
        let mut points = StressPoint::among(labels);
        // A plane state does not resist the strains out of its plane.
        points.retain(|point| !point.is_plane());
        let compared = match points.is_empty() {
            true => Err("no point has all six components".to_owned()),
            false if model.dimension() != 3 => Err("the model is plane".to_owned()),
            false => {
                let strained = strained.get_or_insert_with(|| UniformStrains::new(model, density));
                strained.outcome(model, &recovery.operator, &points)
            }
        };
        diagnostics.extend(finding(recovery, compared, allowed));
    }
}

/// Returns the diagnostic for the outcome of a comparison.
fn finding(
    recovery: &ModelRecovery,
    compared: Result<Agreement, String>,
    allowed: bool,
) -> Option<Diagnostic> {
    let name = &recovery.name;
    let diagnostic = match compared {
        Ok(Agreement::Full) => return None,
        Ok(Agreement::Turned(count)) => {
            let message = format!(
                "recovery `{name}`: {count} of its points have stresses along other axes than those of the model; sizes agree with the stiffness"
            );
            Diagnostic::new(Code::RecoveryUncompared, message)
        }
        Ok(Agreement::Far(factor)) => {
            let message = format!(
                "recovery `{name}`: its stresses are {} times those that the stiffness of the model gives",
                short(factor)
            );
            Diagnostic::new(Code::RecoveryScale, message)
        }
        Ok(Agreement::Contradiction(facts)) => {
            let code = if allowed { Code::RecoveryScale } else { Code::RecoveryContradicts };
            Diagnostic::new(code, format!("recovery `{name}`: under uniform strain {facts}"))
        }
        Err(why) => {
            let message =
                format!("recovery `{name}`: its stresses were not compared with the stiffness: {why}");
            Diagnostic::new(Code::RecoveryUncompared, message)
        }
    };
    Some(diagnostic.in_file(&recovery.path))
}

/// Returns a ratio in two digits, beyond a hundred in one: `0.5`, `1e6`.
fn in_digits(ratio: f64) -> String {
    if (0.01..100.0).contains(&ratio) { significant(ratio, 2) } else { short(ratio) }
}

/// Returns a ratio in one digit: `1e-6`, `0.004`, `300`.
fn short(ratio: f64) -> String {
    if (1e-3..1e4).contains(&ratio) {
        let digits = pow(10.0, log10(ratio).floor());
        return format!("{}", (ratio / digits).round() * digits);
    }
    format!("{ratio:.0e}")
}

/// Outcome of the comparison of a recovery.
enum Agreement {
    /// All points agree.
    Full,
    /// This number of points agrees along turned axes, the others as they are.
    Turned(usize),
    /// The body is not homogeneous, and the size of the stresses is off by this factor.
    Far(f64),
    /// The stresses contradict the stiffness, described by this text.
    Contradiction(String),
}

/// Displacements of the six uniform strains and the reaction of the stiffness to them.
struct UniformStrains {
    /// u_k (N x 6), about the centre of the nodes.
    fields: Mat<f64>,
    /// A_kl = u_k'K u_l in units of the model, symmetric positive definite for a body that resists every strain.
    energies: Matrix6<f64>,
    /// Part of the nodal forces that no vectors a_i give.
    residual: f64,
    /// True if K resists rotations of nodes.
    turns: bool,
    /// Volume of the solid elements.
    volume: Option<f64>,
    /// One unit of stress of the model in pascals.
    unit: f64,
}

impl UniformStrains {
    fn new(model: &FeModel, density: Option<f64>) -> Self {
        let fields = uniform_strains(model);
        let forces = model.pencil().apply_stiffness(fields.as_ref());
        let products = gram(fields.as_ref(), forces.as_ref());
        let energies = Matrix6::from_fn(|k, l| 0.5 * (products[(k, l)] + products[(l, k)]));
        let units = model.units();
        let first = model.rows().displacements();
        let turning = first..first + model.rows().rotations().len();
        Self {
            residual: residual(model, &forces, &energies),
            turns: turning
                .into_iter()
                .any(|row| model.stiffness().row(row).1.iter().any(|value| *value != 0.0)),
            volume: density.map(|density| volume(model, density)),
            unit: units.mass.to_si() / (units.length.to_si() * units.time.to_si().powi(2)),
            fields,
            energies,
        }
    }

    /// Compares the stresses of `points`, rows of an operator or answers to shapes.
    ///
    /// # Errors
    /// The reason why they cannot be compared.
    fn outcome(
        &self,
        model: &FeModel,
        operator: &RecoveryOperator,
        points: &[StressPoint],
    ) -> Result<Agreement, String> {
        let compared = self.rows(model, operator).and_then(|rows| self.compare(points, &rows));
        // Answers to other shapes show their size.
        match (compared, operator) {
            (Err(why), RecoveryOperator::Shapes { shapes, .. }) => {
                let factor = self.factor_of_shapes(model, shapes, points);
                factor.filter(is_far).map(Agreement::Far).ok_or(why)
            }
            (compared, _) => compared,
        }
    }

    /// Returns the rows of a recovery under the six strains (rows x 6).
    ///
    /// # Errors
    /// The reason why they are not known.
    fn rows(&self, model: &FeModel, operator: &RecoveryOperator) -> Result<Mat<f64>, String> {
        match operator {
            RecoveryOperator::Rows { transposed, labels, .. } => {
                let row = |i: usize, strain: usize| -> f64 {
                    let (rows, values) = transposed.column(i);
                    rows.iter()
                        .zip(values)
                        .map(|(&row, value)| value * self.fields[(row as usize, strain)])
                        .sum()
                };
                Ok(Mat::from_fn(labels.len(), COMPONENTS.len(), row))
            }
            RecoveryOperator::Shapes { shapes, .. } => {
                answers(model, &self.fields, shapes).ok_or_else(|| {
                    "the FE program was given no uniform strains: flexbody shapes --uniform-strains adds them"
                        .to_owned()
                })
            }
            RecoveryOperator::Cut { .. } => Err("a cut has no stresses".to_owned()),
        }
    }

    /// Compares the stresses of `points` among the values of all rows under the six strains (rows x 6).
    ///
    /// # Errors
    /// The reason why some of them cannot be compared.
    fn compare(&self, points: &[StressPoint], values: &Mat<f64>) -> Result<Agreement, String> {
        let of_point =
            |point: &StressPoint| Matrix6::from_fn(|k, l| point.rows[k].map_or(0.0, |row| values[(row, l)]));
        let stresses: Vec<Matrix6<f64>> = points.iter().map(of_point).collect();
        // Where K is not that of one solid, isotropic points are compared with themselves.
        let of_body = self.compliance();
        let expected = |stress: &Matrix6<f64>| of_body.or_else(|| isotropic(stress)?.try_inverse());
        let (mut unknown, mut turned, mut wrong) = (0, 0, Vec::new());
        for (point, stress) in points.iter().zip(&stresses) {
            let Some(expected) = expected(stress) else {
                unknown += 1;
                continue;
            };
            let relation = Relation::new(stress * expected);
            match relation.kind() {
                Kind::Same => {}
                Kind::Turned => turned += 1,
                Kind::Other => wrong.push((point, relation)),
            }
        }
        if let Some((point, relation)) = wrong.first() {
            let more = match wrong.len() - 1 {
                0 => String::new(),
                others => format!(", and {others} more of {} points", points.len()),
            };
            let facts = format!("{} at `{}`{more}", relation.facts(), point.name);
            return Ok(Agreement::Contradiction(facts));
        }
        let limit = if of_body.is_some() { MAX_FACTOR } else { MAX_FACTOR_OF_ANY };
        let factor = self.factor(points, &stresses).filter(|factor| !(1.0 / limit..=limit).contains(factor));
        match (factor, of_body) {
            (Some(factor), Some(_)) => {
                let facts = format!("they are {} times those of the stiffness", in_digits(factor));
                Ok(Agreement::Contradiction(facts))
            }
            (Some(factor), None) => Ok(Agreement::Far(factor)),
            (None, _) if unknown > 0 => {
                Err(format!("{unknown} of {} points; {}", points.len(), self.reason()))
            }
            (None, _) if turned > 0 => Ok(Agreement::Turned(turned)),
            (None, _) => Ok(Agreement::Full),
        }
    }

    /// Returns A^-1 if K is the stiffness of one homogeneous solid.
    fn compliance(&self) -> Option<Matrix6<f64>> {
        let sizes = self.energies.diagonal();
        let is_one = self.residual <= MAX_RESIDUAL && sizes.min() > MIN_RESISTANCE * sizes.max();
        self.energies.try_inverse().filter(|_| is_one)
    }

    /// Returns the root mean square of the equivalent stresses under the three shears relative to the expected
    /// one, sqrt(3) u'K u / V; `None` without a volume or a known unit, or if nothing resists a shear.
    fn factor(&self, points: &[StressPoint], stresses: &[Matrix6<f64>]) -> Option<f64> {
        let volume = self.volume?;
        let mut sum = 0.0;
        for (point, stress) in points.iter().zip(stresses) {
            let unit = pascals(&point.unit)?;
            for shear in 3..6 {
                let values: [f64; 6] = std::array::from_fn(|k| stress[(k, shear)]);
                let expected = 3f64.sqrt() * self.energies[(shear, shear)] / volume * self.unit;
                sum += (StressPoint::von_mises_of(&values) * unit / expected).powi(2);
            }
        }
        let factor = (sum / (3 * points.len()) as f64).sqrt();
        (factor.is_finite() && factor > 0.0).then_some(factor)
    }

    /// Returns the root mean square of the equivalent stresses of answered shapes relative to the expected one; `None` without
    /// a volume, without stresses in a known unit, or for shapes that do not move all nodes.
    ///
    /// The mean of vm^2 / (3 G) over the volume is the part of 2 U / V of a shape with the strain energy U that changes no
    /// volume. With G V from uniform shear, vm^2 = 6 U G V / V^2 for a shape of shear and less for others; stresses at nodes of
    /// a bent part are larger by a small factor.
    fn factor_of_shapes(
        &self,
        model: &FeModel,
        shapes: &AnsweredShapes,
        points: &[StressPoint],
    ) -> Option<f64> {
        let volume = self.volume?;
        let rows = displacement_rows(model, shapes)?;
        let (all, count) = (model.rows().len(), shapes.displacements.ncols());
        if shapes.dofs.len() != all || all != 3 * model.nodes().len() {
            return None;
        }
        let mut fields = Mat::zeros(all, count);
        for (at, row) in rows {
            (0..count).for_each(|c| fields[(row, c)] = shapes.displacements[(at, c)]);
        }
        let pascals = points.iter().map(|point| pascals(&point.unit)).collect::<Option<Vec<f64>>>()?;
        let of_shear = (3..6).map(|k| self.energies[(k, k)]).sum::<f64>() / 3.0;
        let forces = model.pencil().apply_stiffness(fields.as_ref());
        let (mut sum, mut expected) = (0.0, 0.0);
        for c in 0..count {
            let twice_energy: f64 = (0..all).map(|i| fields[(i, c)] * forces[(i, c)]).sum();
            expected += 3.0 * twice_energy * of_shear / volume.powi(2) * self.unit.powi(2);
            let square = |(point, pascals): (&StressPoint, &f64)| {
                (StressPoint::von_mises_of(&point.stress(|row| shapes.answers[(row, c)])) * pascals).powi(2)
            };
            sum += points.iter().zip(&pascals).map(square).sum::<f64>() / points.len() as f64;
        }
        let factor = (sum / expected).sqrt();
        factor.is_finite().then_some(factor)
    }

    /// Returns the reason why K is not that of a homogeneous solid.
    fn reason(&self) -> String {
        let sizes = self.energies.diagonal();
        if sizes.min() <= MIN_RESISTANCE * sizes.max() {
            return "nothing resists one of the uniform strains".to_owned();
        }
        let share = significant(100.0 * self.residual, 2);
        let causes = if self.turns {
            "shells, beams, rigid connections"
        } else {
            "several materials, rigid connections, or elements that fail the patch test"
        };
        format!(
            "{share} % of the forces under uniform strain are not those of one homogeneous solid ({causes})"
        )
    }
}

/// Returns the answers of an FE program to the six uniform strains (rows x 6); `None` if they are not among its shapes. A
/// shape is a strain if it is a multiple of it with a rigid motion.
fn answers(model: &FeModel, fields: &Mat<f64>, shapes: &AnsweredShapes) -> Option<Mat<f64>> {
    /// Largest difference of a shape from a strain with a rigid motion, relative to the strain, by root mean squares: a rigid
    /// mode among the shapes is no strain, whatever rounding left in it.
    const MAX_DIFFERENCE: f64 = 1e-4;
    let rows = displacement_rows(model, shapes)?;
    let displacements =
        Mat::from_fn(rows.len(), shapes.displacements.ncols(), |i, c| shapes.displacements[(rows[i].0, c)]);
    let (centre, length) = centre_and_length(&model.nodes().positions);
    let rigid = model.rigid_fields(centre, length);
    let strain_of = |strain: usize| -> Option<Vec<f64>> {
        // Least squares of the strain and the rigid motions.
        let columns = Mat::from_fn(rows.len(), 7, |i, c| match c {
            0 => fields[(rows[i].1, strain)],
            c => rigid[(rows[i].1, c - 1)],
        });
        let factor = dense_cholesky(gram(columns.as_ref(), columns.as_ref()))?;
        let along = gram(columns.as_ref(), displacements.as_ref());
        let fitted = solve_upper(&factor, &solve_lower(&factor, &along));
        let left = &displacements - combine(columns.as_ref(), fitted.as_ref());
        let size = columns.col(0).norm_l2();
        let is_strain = |c: &usize| {
            fitted[(0, *c)] != 0.0 && left.col(*c).norm_l2() <= MAX_DIFFERENCE * fitted[(0, *c)].abs() * size
        };
        let shape = (0..left.ncols()).find(is_strain)?;
        Some(
            (0..shapes.answers.nrows())
                .map(|row| shapes.answers[(row, shape)] / fitted[(0, shape)])
                .collect(),
        )
    };
    let all: Vec<Vec<f64>> = (0..COMPONENTS.len()).map(strain_of).collect::<Option<_>>()?;
    Some(Mat::from_fn(shapes.answers.nrows(), COMPONENTS.len(), |row, strain| all[strain][row]))
}

/// Returns the rows of displacements among those of the shapes, each with that of the model; `None` for a node that the
/// model does not have.
fn displacement_rows(model: &FeModel, shapes: &AnsweredShapes) -> Option<Vec<(usize, usize)>> {
    let place: HashMap<i64, usize> = model.nodes().ids.iter().enumerate().map(|(i, id)| (*id, i)).collect();
    let displacements = shapes.dofs.iter().enumerate().filter(|(_, dof)| (1..=3).contains(&dof.direction));
    let of_model = |(at, dof): (usize, &DofLabel)| {
        Some((at, 3 * place.get(&dof.node)? + usize::from(dof.direction) - 1))
    };
    displacements.map(of_model).collect()
}

/// Returns true for a factor that no composite and no gauge in a stiff inclusion has.
fn is_far(factor: &f64) -> bool {
    !(1.0 / MAX_FACTOR_OF_ANY..=MAX_FACTOR_OF_ANY).contains(factor)
}

/// Returns the displacements of the six uniform strains (N x 6) with u = E_k x about the centre of the nodes: E_k has one at
/// a normal component, one half at both places of a shear. Rotations of the material are zero, so that those of nodes stay.
pub fn uniform_strains(model: &FeModel) -> Mat<f64> {
    let mut fields = Mat::zeros(model.rows().len(), COMPONENTS.len());
    let (centre, _) = centre_and_length(&model.nodes().positions);
    for (i, position) in model.nodes().positions.iter().enumerate() {
        let arm: [f64; 3] = std::array::from_fn(|k| position[k] - centre[k]);
        for (c, (a, b)) in COMPONENTS.into_iter().enumerate() {
            fields[(3 * i + a, c)] += 0.5 * arm[b];
            fields[(3 * i + b, c)] += 0.5 * arm[a];
        }
    }
    fields
}

/// Returns the part of the nodal forces K u_k that no vectors a_i give, by the root of the sums of squares; every strain
/// counts relative to its energy.
fn residual(model: &FeModel, forces: &Mat<f64>, energies: &Matrix6<f64>) -> f64 {
    let scale: [f64; 6] =
        std::array::from_fn(|k| energies[(k, k)].abs().sqrt().max(f64::MIN_POSITIVE).recip());
    // s(E_k) by its columns, and the normal matrix of the least squares for a_i.
    let stress: [Matrix3<f64>; 6] = std::array::from_fn(|k| {
        let mut tensor = Matrix3::zeros();
        for (c, (a, b)) in COMPONENTS.into_iter().enumerate() {
            tensor[(a, b)] = energies[(c, k)] * scale[k];
            tensor[(b, a)] = tensor[(a, b)];
        }
        tensor
    });
    let normal: Matrix3<f64> = stress.iter().map(|s| s.transpose() * s).sum();
    let Some(inverse) = normal.try_inverse() else { return 1.0 };
    let (mut left, mut all) = (0.0, 0.0);
    for i in 0..model.nodes().len() {
        let force: [Vector3<f64>; 6] =
            std::array::from_fn(|k| Vector3::from_fn(|axis, _| forces[(3 * i + axis, k)] * scale[k]));
        let area = inverse * stress.iter().zip(&force).map(|(s, f)| s.transpose() * f).sum::<Vector3<f64>>();
        all += force.iter().map(Vector3::norm_squared).sum::<f64>();
        left += stress.iter().zip(&force).map(|(s, f)| (f - s * area).norm_squared()).sum::<f64>();
    }
    // Moments at nodes, and forces at rows without a place.
    for row in 3 * model.nodes().len()..forces.nrows() {
        let others: f64 = (0..6).map(|k| (forces[(row, k)] * scale[k]).powi(2)).sum();
        all += others;
        left += others;
    }
    if all > 0.0 { (left / all).sqrt() } else { 1.0 }
}

/// Returns the volume of the solid elements: the mass over the density, where the mass of a node counts up to that of the
/// box around the node and those that K couples with it. What exceeds the box is a concentrated mass.
fn volume(model: &FeModel, density: f64) -> f64 {
    let fields = model.rigid_fields([0.0; 3], 1.0);
    let along = fields.as_ref().subcols(0, 1);
    let moved = model.pencil().apply_mass(along);
    let positions = &model.nodes().positions;
    let mut volume = 0.0;
    for i in 0..positions.len() {
        let of_mass = moved[(3 * i, 0)] / density;
        let around = neighbours(model.stiffness(), model.rows(), i, |_, _, value| value != 0.0);
        let near = || around.iter().map(|&j| j as usize).filter(|&j| j < positions.len()).chain([i]);
        let extent = |axis: usize| {
            let ends = near()
                .map(|j| positions[j][axis])
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            ends.1 - ends.0
        };
        volume += of_mass.min(extent(0) * extent(1) * extent(2));
    }
    volume
}

/// Returns the isotropic stiffness whose normal stresses are those of `stress` (component x strain) in any order and of either
/// sign, with the shear modulus that follows from them; `None` if there is none.
///
/// The stress of a solid element under uniform strain is that of its material, whatever surrounds it: a and b of the normal
/// stresses, 3 x 3, are lambda + 2 mu and lambda.
fn isotropic(stress: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let normal = stress.fixed_view::<3, 3>(0, 0);
    let place = |k: usize| normal.row(k).iamax_full().1;
    let places = [place(0), place(1), place(2)];
    let [mut along, mut across] = [0.0, 0.0];
    for (k, place) in places.into_iter().enumerate() {
        along += normal[(k, place)] / 3.0;
        across += (normal.row(k).sum() - normal[(k, place)]) / 6.0;
    }
    let lame = (across * along.signum(), 0.5 * (along - across).abs());
    let expected = Matrix6::from_fn(|k, l| match (k < 3, l < 3) {
        (true, true) if k == l => lame.0 + 2.0 * lame.1,
        (true, true) => lame.0,
        (false, false) if k == l => lame.1,
        _ => 0.0,
    });
    let is_near = |a: f64, b: f64| (a - b).abs() <= MAX_ANISOTROPY * along.abs();
    let is_isotropic = (0..3).all(|k| {
        (0..3).all(|l| is_near(normal[(k, l)], if l == places[k] { along } else { across }))
            && (3..6).all(|l| is_near(stress[(k, l)], 0.0) && is_near(stress[(l, k)], 0.0))
    });
    let is_permutation = places.iter().sum::<usize>() == 3 && places[0] != places[1];
    let is_stiff = lame.1 > MAX_ANISOTROPY * along.abs() && 3.0 * lame.0 + 2.0 * lame.1 > 0.0;
    (is_isotropic && is_permutation && is_stiff).then_some(expected)
}

/// Relation of a stress from rows to that of the stiffness, by components: s_rows = size T s.
struct Relation {
    /// Normal stresses under a hydrostatic stress of one; of rows without these, their middle factor.
    size: f64,
    /// T.
    map: Matrix6<f64>,
}

/// Kind of a [`Relation`].
enum Kind {
    /// T = 1.
    Same,
    /// T turns the stress: s_rows = Q s Q'.
    Turned,
    /// Any other.
    Other,
}

impl Relation {
    fn new(map: Matrix6<f64>) -> Self {
        let of_pressure: [f64; 3] = std::array::from_fn(|k| map.row(k).columns(0, 3).sum());
        let hydrostatic = of_pressure.iter().sum::<f64>() / 3.0;
        let is_known = |part: &f64| (part - hydrostatic).abs() <= MAX_DEVIATION * hydrostatic.abs();
        // Rows that hold other components leave no hydrostatic stress: then the middle of their largest factors.
        let mut factors: [f64; 6] = std::array::from_fn(|k| map.row(k).amax());
        factors.sort_by(f64::total_cmp);
        let size = if of_pressure.iter().all(is_known) { hydrostatic } else { factors[2] };
        let size = if size == 0.0 { 1.0 } else { size };
        Self { size, map: map / size }
    }

    fn kind(&self) -> Kind {
        let is_near = |map: &Matrix6<f64>| (self.map - map).amax() <= MAX_DEVIATION;
        // A NaN is near nothing.
        match self.size > 0.0 {
            true if is_near(&Matrix6::identity()) => Kind::Same,
            true if self.turn().is_some_and(|turn| is_near(&turn)) => Kind::Turned,
            _ => Kind::Other,
        }
    }

    /// Returns the map of the turn Q whose columns follow from the stresses e_a e_a': T(e_a e_a') = q_a q_a'. Their
    /// signs follow from the shears T(e_x e_y' + e_y e_x') and T(e_x e_z' + e_z e_x').
    fn turn(&self) -> Option<Matrix6<f64>> {
        let column = |c: usize| {
            let mut tensor = Matrix3::zeros();
            for (k, (a, b)) in COMPONENTS.into_iter().enumerate() {
                tensor[(a, b)] = self.map[(k, c)];
                tensor[(b, a)] = self.map[(k, c)];
            }
            tensor
        };
        let axis = |c: usize| -> Option<Vector3<f64>> {
            let solved = column(c).try_symmetric_eigen(f64::EPSILON, 100)?;
            Some(solved.eigenvectors.column(solved.eigenvalues.imax()).into_owned())
        };
        let first = axis(0)?;
        let signed = |c: usize, shear: usize| -> Option<Vector3<f64>> {
            let axis = axis(c)?;
            Some(axis * first.dot(&(column(shear) * axis)).signum())
        };
        let axes = Matrix3::from_columns(&[first, signed(1, 3)?, signed(2, 5)?]);
        Some(Matrix6::from_fn(|k, l| {
            let ((a, b), (c, d)) = (COMPONENTS[k], COMPONENTS[l]);
            let of_pair = axes[(a, c)] * axes[(b, d)];
            if c == d { of_pair } else { of_pair + axes[(a, d)] * axes[(b, c)] }
        }))
    }

    /// Returns the components that differ, in words: `xy is 2 xy, yy is zz`.
    fn facts(&self) -> String {
        let sign = self.size.signum();
        let one = |k: usize| {
            let row = self.map.row(k) * sign;
            let most = row.iamax_full().1;
            let factor = row[most];
            let rest = (0..6).filter(|&l| l != most).map(|l| row[l].abs()).fold(0.0, f64::max);
            let name = STRAIN_NAMES[k];
            match factor.abs() {
                size if !size.is_finite() => Some(format!("`{name}` is not finite")),
                size if size <= MAX_DEVIATION => Some(format!("`{name}` is zero")),
                size if rest > MAX_DEVIATION * size => Some(format!("`{name}` is a mixture of components")),
                _ if most == k && (factor - 1.0).abs() <= MAX_DEVIATION => None,
                _ if (factor - 1.0).abs() <= MAX_DEVIATION => {
                    Some(format!("`{name}` is {}", STRAIN_NAMES[most]))
                }
                _ => Some(format!("`{name}` is {} {}", significant(factor, 2), STRAIN_NAMES[most])),
            }
        };
        let differing: Vec<String> = (0..6).filter_map(one).collect();
        if differing.is_empty() { "components are combined".to_owned() } else { differing.join(", ") }
    }
}
