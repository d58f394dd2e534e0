//! Mass matrix of a model with nodal rotations as a mass of points and directors (theory section 6).
//!
//! A node with rotations is a point x with directors d_a = R e_a, a = 1..d, which turn with it. With the
//! blocks of M between node i and node j,
//!
//! ```text
//! M_tr,ij = -h_ij~ + N_ij            h_ij: first moment, N_ij: symmetric
//! M_rr,ij = tr(P_ij) I - P_ij'       P_ij' = tr(M_rr,ij)/2 I - M_rr,ij: second moment
//! M_tt,ij = mu_ij I + D_ij           mu_ij = tr(M_tt,ij)/d
//! ```
//!
//! the kinetic energy of points and directors is that of a solid. Their mass E_s = [mu, h; h', P], one
//! number for every pair of points and directors, is equal along every axis and does not change with the
//! rotations. The remaining parts N and D of M are multiplied by the velocities of the rows along the axes
//! of the body; they are called the rest. For a plane body, with the directors e_x, e_y, h = (M_y, -M_x) of
//! the column M_tr, P = M_rr/2 I and N = 0.

use crate::Followers;
use crate::directors::director_blocks::{Blocks, ROUNDING_ENTRY};
use crate::rows::Rows;
use faer::{Mat, MatMut, MatRef};
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{
    SymmetricMatrix, contiguous, contiguous_mut, multiply, multiply_vector, parallel, zeros,
};
use nalgebra::{Matrix3, Vector3};
use std::borrow::Cow;
use std::sync::Arc;

/// Part of the size of a second moment below which a negative eigenvalue is rounding.
const NEGATIVE_MOMENT: f64 = 1e-12;

/// M as a mass of points and directors, and the rest of M.
///
/// The mass multiplies columns of *extended rows*: displacements of the points (d each), then of the
/// directors (d for each of the d directors of a node with rotational mass), then, if there is a rest, the
/// rotations of these nodes (three each, in the plane one). [`DirectorMass::extend`] maps columns of a
/// model to extended rows, [`DirectorMass::restrict`] maps forces back.
///
/// Points that follow several nodes by constraints ([`Followers`]) have points and directors of their own: the
/// motion of the model is first mapped to *full rows*, on which the mass is that before the constraints.
#[derive(Debug, Clone)]
pub struct DirectorMass {
    dimension: usize,
    model_rows: usize,
    points: usize,
    /// Nodes with directors, ascending.
    nodes: Vec<u32>,
    /// Rotations of these nodes: index of the node in `nodes`, axis, and row of the model.
    rotations: Vec<Rotation>,
    /// E_s: points, then the d directors of each of the nodes.
    scalar: SymmetricMatrix,
    /// Rest N and D on extended rows.
    rest: Option<SymmetricMatrix>,
    followers: Option<Arc<Followers>>,
}

#[derive(Debug, Clone, Copy)]
struct Rotation {
    place: usize,
    axis: usize,
    /// Full row, which is a row of the model if no point follows nodes.
    row: usize,
}

impl DirectorMass {
    /// Creates the mass of points and directors from `m` (rows of the model, symmetric); `None` if no
    /// rotation carries mass.
    pub(crate) fn new(m: &SymmetricMatrix, rows: &Rows) -> Option<Self> {
        let blocks = Blocks::new(m, rows);
        blocks.turn().then(|| Self::of_blocks(blocks, rows))
    }

    /// Creates the mass of a model with `rows` rows whose nodes carry `followers`.
    pub(crate) fn with_followers(followers: &Arc<Followers>, rows: usize) -> Self {
        let full = followers.rows();
        let own = Self::of_blocks(Blocks::new(followers.mass(), full), full);
        Self { model_rows: rows, followers: Some(Arc::clone(followers)), ..own }
    }

    fn of_blocks(blocks: Blocks<'_>, rows: &Rows) -> Self {
        let rotations =
            rows.rotations().iter().zip(rows.displacements()..).filter_map(|(&(node, axis), row)| {
                let place = blocks.place(node as usize)? as usize;
                Some(Rotation { place, axis: axis.into(), row })
            });
        let rotations = rotations.collect();
        let (scalar, rest) = blocks.split();
        Self {
            dimension: rows.dimension,
            model_rows: rows.len(),
            points: blocks.points(),
            rotations,
            nodes: blocks.into_nodes(),
            scalar,
            rest,
            followers: None,
        }
    }

    /// Returns the full rows for rows of the model.
    fn full<'x>(&self, x: &'x [f64]) -> Cow<'x, [f64]> {
        match &self.followers {
            Some(followers) => Cow::Owned(followers.lift(x)),
            None => Cow::Borrowed(x),
        }
    }

    /// Adds forces to `forces` on the rows of the model; `add` adds them to those on full rows.
    fn add_on_full_rows(&self, forces: &mut [f64], add: impl FnOnce(&mut [f64])) {
        let Some(followers) = &self.followers else { return add(forces) };
        let mut full = vec![0.0; followers.rows().len()];
        add(&mut full);
        followers.add_restricted(&full, forces);
    }

    /// Returns true if points of the mass follow nodes of the model.
    pub fn has_followers(&self) -> bool {
        self.followers.is_some()
    }

    /// Returns the largest entry of the rest of the mass `m`, as [`DirectorMass::new`] finds it, relative
    /// to sqrt(M_ii M_jj): the part of M that does not turn with the nodes. Zero for lumped masses and
    /// rigid regions of solids. Consistent beams and shells have a rest; its effect falls with the square
    /// of the element size to that of the rotary inertia of their sections. Returns `None` if no rotation
    /// carries mass.
    pub(crate) fn rest_share(m: &SymmetricMatrix, rows: &Rows) -> Option<f64> {
        let blocks = Blocks::new(m, rows);
        blocks.turn().then(|| Self::share(m, rows))
    }

    /// Returns the largest entry of the rest of the mass `m`, which may have no rotations, relative to
    /// sqrt(M_ii M_jj); zero if it is rounding.
    pub(crate) fn share(m: &SymmetricMatrix, rows: &Rows) -> f64 {
        let share = Blocks::new(m, rows).share();
        if share > ROUNDING_ENTRY { share } else { 0.0 }
    }

    /// Returns the nodes with directors, ascending. Points that follow nodes come after nodes and vectors of the
    /// model.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Returns E_s: one number for every pair of points and directors, points first, then the directors of
    /// each of the nodes.
    pub fn scalar(&self) -> &SymmetricMatrix {
        &self.scalar
    }

    /// Returns N and D on extended rows; `None` if E_s is all of M.
    pub fn rest(&self) -> Option<&SymmetricMatrix> {
        self.rest.as_ref()
    }

    /// Returns the node with the most negative second moment of its own mass (index among all nodes), this
    /// moment (mass length^2), and the number of such nodes; `None` if the moments of all nodes are positive
    /// semidefinite up to rounding.
    pub fn negative_moments(&self) -> Option<(u32, f64, usize)> {
        let smallest = |place: usize| {
            let moment = self.own_moment(place);
            let size = moment.diagonal().abs().sum();
            let value = moment.symmetric_eigenvalues().min();
            (value < -NEGATIVE_MOMENT * size).then_some((self.nodes[place], value))
        };
        let negative: Vec<_> = (0..self.nodes.len()).filter_map(smallest).collect();
        let (node, value) = first_largest(negative.iter().copied(), |pair| -pair.1)?;
        Some((node, value, negative.len()))
    }

    /// Returns P_ii of the node at `place`; the third axis of a plane node is zero.
    fn own_moment(&self, place: usize) -> Matrix3<f64> {
        let first = self.points + self.dimension * place;
        let mut moment = Matrix3::zeros();
        for a in 0..self.dimension {
            let (columns, values) = self.scalar.row(first + a);
            for (&column, value) in columns.iter().zip(values) {
                let b = (column as usize).wrapping_sub(first);
                if b < self.dimension {
                    moment[(a, b)] = *value;
                }
            }
        }
        moment
    }

    /// Returns the number of extended rows.
    pub fn rows(&self) -> usize {
        self.turning_rows() + if self.rest.is_some() { self.turns() * self.nodes.len() } else { 0 }
    }

    /// Returns the number of extended rows that turn with the body and come first: vectors of points and
    /// directors.
    pub fn turning_rows(&self) -> usize {
        self.dimension * self.scalar.n()
    }

    /// Returns the number of rotations of a node.
    fn turns(&self) -> usize {
        if self.dimension == 2 { 1 } else { 3 }
    }

    /// Returns the first extended row of director `a` of the node at `place`.
    fn director(&self, place: usize, a: usize) -> usize {
        let d = self.dimension;
        d * (self.points + d * place + a)
    }

    /// Returns the first extended row of the rotations of the node at `place`, if there is a rest.
    fn rotation(&self, place: usize) -> usize {
        self.turning_rows() + self.turns() * place
    }

    /// Returns velocities of the extended rows for those of the rows of the model, to first order and along
    /// the axes of the model: theta x e_a for a director.
    ///
    /// # Panics
    /// When `shapes` does not have one row per row of the model.
    pub fn extend(&self, shapes: MatRef<'_, f64>) -> Mat<f64> {
        assert_eq!(shapes.nrows(), self.model_rows, "one row per row of the model");
        let mut extended = zeros(self.rows(), shapes.ncols());
        each_column(shapes, &mut extended, |from, to| self.extend_vector(from, to));
        extended
    }

    /// Extends one column into `extended`; see [`DirectorMass::extend`].
    pub fn extend_vector(&self, shape: &[f64], extended: &mut [f64]) {
        let points = self.dimension * self.points;
        let shape = self.full(shape);
        extended[..points].copy_from_slice(&shape[..points]);
        extended[points..].fill(0.0);
        for &Rotation { place, axis, row } in &self.rotations {
            self.turn(place, axis, shape[row], extended);
        }
    }

    /// Returns displacements, velocities and accelerations of the extended rows to second order of the
    /// rotations: a director moves by theta x e_a + theta x (theta x e_a) / 2.
    ///
    /// * `motion`: rows of the model, their rates and accelerations, along the axes of the model.
    ///
    /// # Panics
    /// When a matrix does not have one row per row of the model, or the numbers of columns differ.
    pub fn extend_turned(&self, motion: [MatRef<'_, f64>; 3]) -> [Mat<f64>; 3] {
        let mut extended = motion.map(|x| self.extend(x));
        for column in 0..motion[0].ncols() {
            let [turn, rate, acceleration] = motion.map(|x| contiguous(x.col(column)));
            let [value, first, second] = extended.each_mut().map(|x| x.col_as_slice_mut(column));
            self.add_second_order_motion(turn, turn, 0.5, value);
            self.add_second_order_motion(turn, rate, 1.0, first);
            self.add_second_order_motion(turn, acceleration, 1.0, second);
            self.add_second_order_motion(rate, rate, 1.0, second);
        }
        extended
    }

    /// Adds `factor` times the displacements of second order, (theta x (phi x e_a) + phi x (theta x e_a)) / 2, to the
    /// directors of every node; theta from `x` and phi from `y` (N rows of the model).
    ///
    /// # Panics
    /// When a vector has another length.
    pub fn add_second_order_motion(&self, x: &[f64], y: &[f64], factor: f64, extended: &mut [f64]) {
        let [x, y] = [x, y].map(|u| self.full(u));
        for (place, rotations) in self.turning_nodes() {
            let [theta, phi] = [&x, &y].map(|u| rotation_vector(rotations, u).cross_matrix());
            let second = (theta * phi + phi * theta) * (0.5 * factor);
            for a in 0..self.dimension {
                let row = self.director(place, a);
                (0..self.dimension).for_each(|k| extended[row + k] += second[(k, a)]);
            }
        }
    }

    /// Adds the rotation of a node about an axis of the model to its directors.
    fn turn(&self, place: usize, axis: usize, angle: f64, extended: &mut [f64]) {
        // e_axis x e_a = e_b and e_axis x e_b = -e_a for the cyclic order (axis, a, b).
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        extended[self.director(place, a) + b] += angle;
        extended[self.director(place, b) + a] -= angle;
        if self.rest.is_some() {
            extended[self.rotation(place) + if self.dimension == 2 { 0 } else { axis }] += angle;
        }
    }

    /// Returns unit translations and unit rotations of the extended rows from those of the model (N x 6, in
    /// the plane N x 3, along its axes, rotations not divided by a length). Directors and rotations of
    /// nodes turn independently of the rows of rotations that their nodes have.
    ///
    /// # Panics
    /// When `fields` does not have one row per row of the model.
    pub fn extend_rigid(&self, fields: MatRef<'_, f64>) -> Mat<f64> {
        assert_eq!(fields.nrows(), self.model_rows, "one row per row of the model");
        let (d, points) = (self.dimension, self.dimension * self.points);
        let mut extended = zeros(self.rows(), fields.ncols());
        each_column(fields, &mut extended, |from, to| {
            to[..points].copy_from_slice(&self.full(from)[..points])
        });
        for column in d..fields.ncols() {
            let axis = if d == 2 { 2 } else { column - 3 };
            let extended = extended.col_as_slice_mut(column);
            (0..self.nodes.len()).for_each(|place| self.turn(place, axis, 1.0, extended));
        }
        extended
    }

    /// Returns forces on the rows of the model with the power of forces on the extended rows: forces f_a on
    /// directors become moments sum_a e_a x f_a on the rotations of their node.
    ///
    /// # Panics
    /// When `forces` does not have one row per extended row.
    pub fn restrict(&self, forces: MatRef<'_, f64>) -> Mat<f64> {
        assert_eq!(forces.nrows(), self.rows(), "one row per extended row");
        let mut restricted = zeros(self.model_rows, forces.ncols());
        each_column(forces, &mut restricted, |from, to| self.restrict_vector(from, to));
        restricted
    }

    /// Restricts one column into `restricted`; see [`DirectorMass::restrict`].
    pub fn restrict_vector(&self, forces: &[f64], restricted: &mut [f64]) {
        restricted.fill(0.0);
        self.add_on_full_rows(restricted, |restricted| {
            let points = self.dimension * self.points;
            restricted[..points].copy_from_slice(&forces[..points]);
            for &Rotation { place, axis, row } in &self.rotations {
                let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
                restricted[row] = forces[self.director(place, a) + b] - forces[self.director(place, b) + a];
                if self.rest.is_some() {
                    let turn = if self.dimension == 2 { 0 } else { axis };
                    restricted[row] += forces[self.rotation(place) + turn];
                }
            }
        });
    }

    /// Adds the moments that `forces` on extended rows gain by the rotations theta in `u` (N rows of the model), to first
    /// order in theta: sum_a ((theta x e_a) x f_a + e_a x (f_a x theta)) / 2 for every node. With the moments of
    /// [`DirectorMass::restrict`] they have the power of forces on directors that move as
    /// [`DirectorMass::extend_turned`] says.
    ///
    /// # Panics
    /// When a vector has another length.
    pub fn add_turned_moments(&self, forces: &[f64], u: &[f64], restricted: &mut [f64]) {
        let d = self.dimension;
        let u = self.full(u);
        self.add_on_full_rows(restricted, |restricted| {
            for (place, rotations) in self.turning_nodes() {
                let theta = rotation_vector(rotations, &u);
                let gained = |a: usize| {
                    let row = self.director(place, a);
                    let force = Vector3::from_fn(|k, _| if k < d { forces[row + k] } else { 0.0 });
                    let axis = Vector3::ith(a, 1.0);
                    theta.cross(&axis).cross(&force) + axis.cross(&force.cross(&theta))
                };
                let moment = (0..d).map(gained).sum::<Vector3<f64>>() * 0.5;
                rotations.iter().for_each(|rotation| restricted[rotation.row] += moment[rotation.axis]);
            }
        });
    }

    /// Computes y = E x of extended rows.
    ///
    /// # Panics
    /// When the sizes disagree.
    pub fn multiply(&self, x: MatRef<'_, f64>, mut y: MatMut<'_, f64>) {
        let turning = self.turning_rows();
        if let Some(rest) = &self.rest {
            multiply(rest, 1, x, y.as_mut());
            let mut product = zeros(turning, x.ncols());
            multiply(&self.scalar, self.dimension, x.subrows(0, turning), product.as_mut());
            let mut head = y.subrows_mut(0, turning);
            head += product;
        } else {
            multiply(&self.scalar, self.dimension, x, y);
        }
    }

    /// Computes y = E x for one column; `scratch` has the length of `y`.
    pub fn multiply_vector(&self, x: &[f64], y: &mut [f64], scratch: &mut [f64]) {
        let turning = self.turning_rows();
        multiply_vector(&self.scalar, self.dimension, &x[..turning], &mut y[..turning]);
        if let Some(rest) = &self.rest {
            multiply_vector(rest, 1, x, scratch);
            y[turning..].fill(0.0);
            y.iter_mut().zip(scratch).for_each(|(y, rest)| *y += *rest);
        }
    }

    /// Adds H theta to the moments on the rotations of every node, in the rows of the model: theta from
    /// `u`, H for the node at an index of [`DirectorMass::nodes`].
    ///
    /// # Panics
    /// When `u` or `forces` does not have one entry per row of the model.
    pub fn add_second_order(&self, h: impl Fn(usize) -> Matrix3<f64>, u: &[f64], forces: &mut [f64]) {
        assert!(u.len() == self.model_rows && forces.len() == u.len(), "one row per row of the model");
        let u = self.full(u);
        self.add_on_full_rows(forces, |forces| {
            for (place, rotations) in self.turning_nodes() {
                let moment = h(place) * rotation_vector(rotations, &u);
                rotations.iter().for_each(|rotation| forces[rotation.row] += moment[rotation.axis]);
            }
        });
    }

    /// Returns the rotations that the rows of the model have of every node, with the index of the node in
    /// [`DirectorMass::nodes`].
    fn turning_nodes(&self) -> impl Iterator<Item = (usize, &[Rotation])> {
        self.rotations.chunk_by(|a, b| a.place == b.place).map(|rotations| (rotations[0].place, rotations))
    }

    /// Returns the moments of the mass that turns with every node, about the point and along the axes of
    /// the rigid motions `fields` of the extended rows; the columns of `axes` are these axes in the axes of
    /// the model.
    ///
    /// * `fields`: result of [`DirectorMass::extend_rigid`], turned to these axes.
    pub fn moments(&self, fields: MatRef<'_, f64>, axes: &Matrix3<f64>) -> Vec<NodeMoments> {
        let mut product = zeros(self.rows(), fields.ncols());
        self.multiply(fields, product.as_mut());
        let d = self.dimension;
        let vector = |row: usize, column: usize| {
            Vector3::from_fn(|k, _| if k < d { product[(row + k, column)] } else { 0.0 })
        };
        let axis = |k: usize| axes.column(k).into_owned();
        let of_node = |place: usize| {
            let (mut first, mut second) = (Vector3::zeros(), Matrix3::zeros());
            for a in 0..d {
                let row = self.director(place, a);
                first[a] = (0..d).map(|k| vector(row, k).dot(&axis(k))).sum::<f64>() / d as f64;
                // The sum over the axes k of e_k x (e_k x z) is -2 z, in the plane -z.
                let turned = |k: usize, column: usize| axis(k).cross(&vector(row, column));
                let z = match d {
                    2 => -turned(2, 2),
                    _ => (0..3).map(|k| turned(k, 3 + k)).sum::<Vector3<f64>>() * -0.5,
                };
                second.set_row(a, &z.transpose());
            }
            NodeMoments { first: axes.transpose() * first, second: axes.transpose() * second * axes }
        };
        (0..self.nodes.len()).map(of_node).collect()
    }
}

/// Returns the rotation vector of a node, from its rotations in `u` (N rows of the model).
fn rotation_vector(rotations: &[Rotation], u: &[f64]) -> Vector3<f64> {
    let mut theta = Vector3::zeros();
    rotations.iter().for_each(|rotation| theta[rotation.axis] = u[rotation.row]);
    theta
}

/// Computes every column of `to` from that of `from`, on all threads.
fn each_column(from: MatRef<'_, f64>, to: &mut Mat<f64>, make: impl Fn(&[f64], &mut [f64]) + Sync) {
    let columns = from.col_iter().zip(to.col_iter_mut());
    parallel::for_each(columns, |(from, to)| make(contiguous(from), contiguous_mut(to)));
}

/// Moments of the mass that turns with a node, about the origin of a frame and along its axes: the products
/// of the rows of its directors with the rigid motions of the whole body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeMoments {
    /// h_a = sum over the points of E_s with director a. Unit: mass length.
    pub first: Vector3<f64>,
    /// Row a: z_a = sum of E_s of director a with the positions of points and directors. Unit: mass
    /// length^2.
    pub second: Matrix3<f64>,
}

impl NodeMoments {
    /// Returns H = sym(G) - tr(G) I with G = sum_a e_a g_a', g_a = h_a a + alpha x z_a + omega x (omega x
    /// z_a): the stiffness for the rotations of the node due to the inertia of a rigid motion. `motion` is
    /// about the point and along the axes of the moments.
    pub fn of(&self, motion: &RigidAcceleration) -> Matrix3<f64> {
        // omega x (omega x z) = (omega omega' - omega^2 I) z.
        let turning = motion.angular.cross_matrix() + motion.spin - Matrix3::identity() * motion.spin.trace();
        let g = self.first * motion.linear.transpose() + self.second * turning.transpose();
        0.5 * (g + g.transpose()) - Matrix3::identity() * g.trace()
    }
}

/// Acceleration of a rigid motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidAcceleration {
    /// Acceleration of the reference point of the motion minus gravity. Unit: length/time^2.
    pub linear: Vector3<f64>,
    /// Angular acceleration. Unit: 1/time^2.
    pub angular: Vector3<f64>,
    /// omega omega', the products of the angular velocity. Unit: 1/time^2.
    pub spin: Matrix3<f64>,
}

impl RigidAcceleration {
    /// Creates the acceleration of a motion with the angular velocity `omega`.
    pub fn new(linear: Vector3<f64>, angular: Vector3<f64>, omega: &Vector3<f64>) -> Self {
        Self { linear, angular, spin: omega * omega.transpose() }
    }
}
