//! Unbalanced forces of many instants, at a cost that does not depend on the number of rows of the model, and the
//! compression of many force vectors to a few by proper orthogonal decomposition.

use super::principal::{Stages, principal};
use super::residual::NodalView;
use super::turning_products::TurningProducts;
use faer::Mat;
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{combine, gram, side_by_side, subtract_combination};
use flexbody_model::{FeModel, RigidAcceleration};
use flexbody_motion::scene::Instant;
use nalgebra::{Matrix3, Vector3};

/// Number of instants that are evaluated together. It limits the memory for the functions of time.
const BLOCK: usize = 256;

/// Projection of the forces of [`NodalView::unbalanced`]. These forces are fixed nodal vectors F times products phi of
/// the coordinates and velocities of the body: with S_a x = e_a x x, summed over the axes a and b,
/// ```text
/// r = sum f_l - K Psi q - D Psi q' - M Psi q'' - M R (V' - g, omega')
///     - M S_a Psi (omega'_a q + omega_a q') - S_a M Psi omega_a q' - S_a M R omega_a (V, omega)
///     - S_b M S_a Psi omega_b omega_a q - H Psi q = F phi
/// ```
///
/// with V, V' - g and R of [`Inertia`](super::residual::Inertia), and the stiffness of inertia H, which is linear in
/// V' - g, omega' and the products of omega. Forces of second order of nodes that turn are those of [`TurningProducts`].
///
/// P maps forces to modal forces and to amplitudes of compressed forces. P F is computed once; P r = (P F) phi then
/// holds at every instant.
pub(super) struct Projected<'v> {
    view: &'v NodalView<'v>,
    /// P F, with columns in the order of [`Projected::functions`].
    matrix: Mat<f64>,
    /// Axes about which the body may turn.
    turns: &'static [usize],
    /// Forces of second order; `None` if nodal rotations carry no mass.
    products: Option<TurningProducts>,
}

/// Amplitudes of the unbalanced forces.
pub(super) struct UnbalancedAmplitudes {
    /// Modal forces (nf x instants).
    pub in_modes: Mat<f64>,
    /// Amplitudes of the compressed forces (k x instants).
    pub compressed: Mat<f64>,
}

impl<'v> Projected<'v> {
    /// Projects the fixed vectors F. The forces are compressed by the basis of `compressed`; no amplitudes are computed
    /// if there is none. Forces of second order hold along `motion`.
    pub(super) fn new(view: &'v NodalView<'v>, compressed: Option<&Compressed>, motion: &[Instant]) -> Self {
        let turns: &[usize] = if view.model.dimension() == 2 { &[2] } else { &[0, 1, 2] };
        let project = |forces: Mat<f64>| {
            let unbalanced = view.part(forces);
            let along = compressed.map_or_else(Mat::new, |own| own.amplitudes(&unbalanced.forces));
            above(&unbalanced.in_modes, &along)
        };
        let rows = &view.rows;
        let weigh = |x: &Mat<f64>| rows.weigh(x.as_ref());
        let turned = |a: usize, x: &Mat<f64>| rows.turned(&Vector3::ith(a, 1.0), x);
        let project_inertia = |forces: Mat<f64>| project(rows.restrict(forces));
        // The columns of F, term by term: loads, elastic, damping and inertia forces of the modes.
        let mut parts: Vec<Mat<f64>> = view.loads.iter().map(|load| project(-&load.unit)).collect();
        parts.push(project(view.model.pencil().apply_stiffness(view.vectors.as_ref())));
        parts.push(project(view.damped.clone()));
        parts.push(project(view.weighted.clone()));
        // Inertia forces of rigid accelerations and of rotation.
        let heavy = weigh(&view.extended_rigid);
        parts.push(project_inertia(heavy.clone()));
        let [modes, weighted] = view.extended();
        for &a in turns {
            let heavy_turned = weigh(&turned(a, modes));
            parts.extend([turned(a, weighted), turned(a, &heavy)].map(project_inertia));
            parts.extend(turns.iter().map(|&b| project_inertia(turned(b, &heavy_turned))));
            parts.push(project_inertia(heavy_turned));
        }
        // Stiffness of inertia, for each unit acceleration.
        parts.extend(unit_accelerations(view).iter().map(|unit| {
            let mut forces = Mat::zeros(view.vectors.nrows(), view.vectors.ncols());
            for j in 0..forces.ncols() {
                rows.add_second_order(unit, view.vectors.col_as_slice(j), forces.col_as_slice_mut(j));
            }
            project(forces)
        }));
        let products = TurningProducts::new(view, motion);
        parts.extend(products.iter().flat_map(|products| products.vectors(view, project)));
        // All terms after the loads are subtracted from the loads.
        let matrix = -side_by_side(&parts.iter().map(Mat::as_ref).collect::<Vec<_>>());
        Self { view, matrix, turns, products }
    }

    /// Returns the amplitudes along a motion, one column for every instant.
    pub(super) fn amplitudes(&self, motion: &[Instant]) -> UnbalancedAmplitudes {
        let (nf, rows) = (self.view.vectors.ncols(), self.matrix.nrows());
        let mut in_modes = Mat::zeros(nf, motion.len());
        let mut compressed = Mat::zeros(rows - nf, motion.len());
        for (at, block) in motion.chunks(BLOCK).enumerate() {
            let own = combine(self.matrix.as_ref(), self.functions(block).as_ref());
            let place = |all: &mut Mat<f64>, first: usize| {
                let part = own.as_ref().subrows(first, all.nrows());
                all.as_mut().subcols_mut(at * BLOCK, block.len()).copy_from(part);
            };
            place(&mut in_modes, 0);
            place(&mut compressed, nf);
        }
        UnbalancedAmplitudes { in_modes, compressed }
    }

    /// Returns phi at every instant, in the order of the columns of P F.
    fn functions(&self, motion: &[Instant]) -> Mat<f64> {
        let view = self.view;
        let free = view.along_model(motion, |now| view.free_acceleration(now));
        let moving = view.along_model(motion, |now| view.rigid_velocity(now));
        let loads: Vec<Mat<f64>> = (0..view.loads.len()).map(|at| view.load_amplitudes(motion, at)).collect();
        let units = unit_accelerations(view);
        let mut functions = Mat::zeros(self.matrix.ncols(), motion.len());
        for (i, now) in motion.iter().enumerate() {
            let column = functions.col_as_slice_mut(i);
            let mut places = column.iter_mut();
            let mut put = |value: f64| *places.next().expect("as many functions as vectors") = value;
            // The order is that of the columns of F: loads, elastic, damping and inertia forces.
            loads.iter().for_each(|load| load.col_as_slice(i).iter().for_each(|value| put(*value)));
            now.q.iter().chain(&now.qd).chain(&now.qdd).for_each(|value| put(*value));
            free.col_as_slice(i).iter().for_each(|value| put(*value));
            let (omega, rate): (Vector3<f64>, Vector3<f64>) =
                (view.axes * now.omega, view.axes * now.omega_rate);
            // Rotation about each axis.
            for &a in self.turns {
                now.qd.iter().for_each(|qd| put(omega[a] * qd));
                moving.col_as_slice(i).iter().for_each(|value| put(omega[a] * value));
                for &b in self.turns {
                    now.q.iter().for_each(|q| put(omega[b] * omega[a] * q));
                }
                now.q.iter().zip(&now.qd).for_each(|(q, qd)| put(rate[a] * q + omega[a] * qd));
            }
            // Stiffness of inertia: components of the rigid acceleration times q.
            let rigid = view.rigid_acceleration(now);
            for unit in &units {
                let amount = rigid.linear.dot(&unit.linear)
                    + rigid.angular.dot(&unit.angular)
                    + rigid.spin.component_mul(&unit.spin).sum();
                now.q.iter().for_each(|q| put(amount * q));
            }
            if let Some(products) = &self.products {
                products.amplitudes(view, now, &mut put);
            }
        }
        functions
    }
}

/// Returns unit accelerations that span the accelerations of every rigid motion: three linear, three angular, and the
/// six symmetric products of two axes (matrices of unit length). Empty if nodal rotations carry no mass.
fn unit_accelerations(view: &NodalView<'_>) -> Vec<RigidAcceleration> {
    if !view.rows.have_directors() {
        return Vec::new();
    }
    let (zero, none) = (Vector3::zeros(), Matrix3::zeros());
    let unit = |axis: usize| Vector3::ith(axis, 1.0);
    let linear = (0..3).map(|k| RigidAcceleration { linear: unit(k), angular: zero, spin: none });
    let angular = (0..3).map(|k| RigidAcceleration { linear: zero, angular: unit(k), spin: none });
    let pairs = (0..3).flat_map(|k| (k..3).map(move |l| (k, l)));
    let products = pairs.map(|(k, l)| {
        let both = unit(k) * unit(l).transpose();
        let spin = if k == l { both } else { (both + both.transpose()) * 0.5f64.sqrt() };
        RigidAcceleration { linear: zero, angular: zero, spin }
    });
    linear.chain(angular).chain(products).collect()
}

/// Stacks two matrices: `upper` above `lower`, which may have no rows.
fn above(upper: &Mat<f64>, lower: &Mat<f64>) -> Mat<f64> {
    let (first, all) = (upper.nrows(), upper.nrows() + lower.nrows());
    Mat::from_fn(all, upper.ncols(), |i, j| if i < first { upper[(i, j)] } else { lower[(i - first, j)] })
}

/// Part of the sum of squares (weighted by the inverse diagonal of K) that compression may drop. A larger value keeps
/// fewer forces.
const LEFT_OUT: f64 = 1e-12;

/// Largest number of compressed forces. Memory and static responses grow with it.
pub(super) const MOST_FORCES: usize = 32;

/// Basis B (N x k) of forces F, orthonormal in the norm that weights each row by the inverse diagonal of K. This norm
/// is about the energy of a force that acts at one row alone.
pub(super) struct Compressed {
    pub basis: Mat<f64>,
    /// Square roots of the row weights (N), and the basis multiplied by them (N x k).
    weights: Vec<f64>,
    weighted: Mat<f64>,
}

impl Compressed {
    /// Computes the first principal directions of `forces` (N x m). Returns `None` if the forces are zero or not
    /// finite.
    pub(super) fn new(model: &FeModel, forces: &Mat<f64>) -> Option<Self> {
        let diagonal = model.stiffness().diagonal();
        let weights: Vec<f64> =
            diagonal.iter().map(|k| if *k > 0.0 { k.sqrt().recip() } else { 0.0 }).collect();
        let weigh = |forces: &Mat<f64>| {
            Mat::from_fn(forces.nrows(), forces.ncols(), |i, j| weights[i] * forces[(i, j)])
        };
        let (mut rest, mut weighted_rest) = (forces.clone(), weigh(forces));
        let stages = Stages::new(&weighted_rest, LEFT_OUT);
        let mut basis = Mat::zeros(forces.nrows(), 0);
        while let Some(left_out) = stages.next(&weighted_rest, MOST_FORCES - basis.ncols()) {
            let squares = gram(weighted_rest.as_ref(), weighted_rest.as_ref());
            let most = MOST_FORCES - basis.ncols();
            let Some((directions, values)) = principal(squares, left_out, most) else { break };
            let unit =
                Mat::from_fn(directions.nrows(), directions.ncols(), |i, j| directions[(i, j)] / values[j]);
            let own = combine(rest.as_ref(), unit.as_ref());
            let weighted = weigh(&own);
            let shared = gram(weighted.as_ref(), weighted_rest.as_ref());
            subtract_combination(rest.as_mut(), own.as_ref(), shared.as_ref());
            subtract_combination(weighted_rest.as_mut(), weighted.as_ref(), shared.as_ref());
            basis = side_by_side(&[basis.as_ref(), own.as_ref()]);
        }
        if basis.ncols() == 0 {
            return None;
        }
        // The same space with directions that do not turn in it where principal directions have nearly one size.
        let own = gram(weigh(&basis).as_ref(), weigh(forces).as_ref());
        basis = combine(basis.as_ref(), directions_of_largest(own).as_ref());
        let weighted = weigh(&basis);
        Some(Self { basis, weights, weighted })
    }

    /// Returns C (k x m) such that B C is the best approximation of `forces` F (N x m) in the weighted norm.
    pub(super) fn amplitudes(&self, forces: &Mat<f64>) -> Mat<f64> {
        let weighted = Mat::from_fn(forces.nrows(), forces.ncols(), |i, j| self.weights[i] * forces[(i, j)]);
        gram(self.weighted.as_ref(), weighted.as_ref())
    }
}

/// Returns an orthonormal basis (k x p) of the columns of `rest` (k x m), each direction that of the largest column without
/// its part in the earlier directions. Principal directions whose sizes differ by d are determined to rounding over d,
/// these to rounding.
fn directions_of_largest(mut rest: Mat<f64>) -> Mat<f64> {
    let mut basis = Mat::zeros(rest.nrows(), 0);
    while basis.ncols() < rest.nrows() {
        let Some(largest) = first_largest(0..rest.ncols(), |&j| rest.col(j).norm_l2()) else { break };
        let size = rest.col(largest).norm_l2();
        if size.is_nan() || size <= 0.0 {
            break;
        }
        let own = Mat::from_fn(rest.nrows(), 1, |i, _| rest[(i, largest)] / size);
        // Subtract twice: little may be left.
        for _ in 0..2 {
            let along = gram(own.as_ref(), rest.as_ref());
            subtract_combination(rest.as_mut(), own.as_ref(), along.as_ref());
        }
        basis = side_by_side(&[basis.as_ref(), own.as_ref()]);
    }
    basis
}

#[cfg(test)]
mod tests {
    use super::super::residual::SceneLoad;
    use super::*;
    use flexbody_body::basis::{CoupledModel, ModeSettings};
    use flexbody_body::convert::{ConvertSettings, convert};
    use flexbody_eigen::Wanted;
    use flexbody_input::{read_manifest, read_model};
    use flexbody_linalg::context::Context;
    use flexbody_linalg::uniform;
    use flexbody_model::FeModel;
    use flexbody_motion::scene::{Point, nodal_point};

    /// Returns random instants, with elastic forces as large as the inertia forces. At most four modes move alone, so that
    /// few combinations of the modes describe the motion.
    fn instants(eigenvalues: &[f64]) -> Vec<Instant> {
        let modes = eigenvalues.len();
        let value = |i: usize, j: usize| uniform(7, i as u64, j as u64);
        let vector = |i: usize, j: usize| Vector3::from_fn(|k, _| value(i, 10 * j + k));
        let many = |i: usize, j: usize| -> Vec<f64> {
            let four: Vec<f64> = (0..4).map(|k| value(i, 1000 * j + k)).collect();
            (0..modes).map(|k| four[k % 4] * if k < 4 { 1.0 } else { uniform(8, k as u64, 1) }).collect()
        };
        let at = |i: usize| Instant {
            time: i as f64,
            velocity: vector(i, 1),
            velocity_rate: vector(i, 2),
            omega: vector(i, 3),
            omega_rate: vector(i, 4),
            q: many(i, 1).iter().zip(eigenvalues).map(|(q, lambda)| q / lambda).collect(),
            qd: many(i, 2),
            qdd: many(i, 3),
            gravity: vector(i, 5),
            row_state: Vec::new(),
            loads: vec![(vector(i, 6), vector(i, 7))],
        };
        (0..BLOCK + 3).map(at).collect()
    }

    /// Removes all rotation except that about the normal of the plane.
    fn in_plane(mut motion: Vec<Instant>) -> Vec<Instant> {
        for now in &mut motion {
            for axial in [&mut now.omega, &mut now.omega_rate] {
                *axial = Vector3::new(0.0, 0.0, axial.z);
            }
        }
        motion
    }

    fn difference(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
        (a - b).norm_max() / b.norm_max()
    }

    /// The projection equals the forces at all nodes, instant by instant: solids, nodal rotations, a plane model; free
    /// and carried.
    #[test]
    fn amplitudes_are_those_of_the_forces_at_all_nodes() {
        for (name, carried, modes) in [
            ("bracket_hex20", false, 4),
            ("shell_folded", false, 4),
            ("shell_folded", true, 4),
            ("plane_frame", false, 4),
            ("shell_folded", false, 16),
        ] {
            let files =
                read_manifest(format!("../../fixtures/models/{name}/model.toml")).expect("a manifest");
            let raw = read_model(&files).expect("a model");
            let model = FeModel::from_raw(raw).expect("a sound model").model;
            let modes = ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() };
            let settings = ConvertSettings { modes, lumped: Vec::new(), ..ConvertSettings::default() };
            let body = convert(&model, &settings, &Context::QUIET).expect("a body").body;
            let at =
                |node: usize| nodal_point(&model, &Point::Node(model.nodes().ids[node])).expect("a node");
            let load = SceneLoad::new(&model, &at(3));
            let carrier = carried.then(|| at(0));
            let view = NodalView::new(
                CoupledModel::uncoupled(&model),
                &body,
                vec![load],
                carrier.as_ref(),
                model.damping(),
            );
            let view = view.unwrap_or_else(|| panic!("{name}: a view"));
            let motion = instants(&body.modes().eigenvalue);
            let motion = if model.dimension() == 2 { in_plane(motion) } else { motion };
            let direct = view.unbalanced(&motion);
            let compressed = Compressed::new(&model, &view.residual(&motion[..20])).expect("forces");
            let own = Projected::new(&view, Some(&compressed), &motion).amplitudes(&motion);
            let apart = difference(&own.in_modes, &direct.in_modes);
            assert!(apart < 1e-9, "{name}: {apart:.1e}");
            let apart = difference(&own.compressed, &compressed.amplitudes(&direct.forces));
            assert!(apart < 1e-9, "{name}: {apart:.1e}");
        }
    }
}
