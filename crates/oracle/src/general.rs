//! Bodies with any symmetric mass matrix (docs/theory.md section 6): the unreduced nodal body, and its equations in
//! constant invariants. Dense, as the theory prints it, without code of the library.

use super::equations::{ReducedBody, State, skew};
use super::random::Random;
use faer::Mat;
use flexbody_input::{read_manifest, read_model};
use flexbody_model::RawModel;
use nalgebra::{DMatrix, DVector, Matrix3, Quaternion, UnitQuaternion, Vector3};
use std::collections::HashMap;

/// Fixture models with rotations of nodes, rows without a position, or masses that do not commute with rotations.
pub const FIXTURES: [&str; 8] = [
    "frame_beams",
    "frame_lumped",
    "hex8_bubbles",
    "hex8_edges",
    "mpc_block",
    "plane_frame",
    "shell_folded",
    "spring_ends",
];

/// Reads a model of `fixtures/models` without checks.
pub fn raw_fixture(name: &str) -> RawModel {
    let folder = crate::fixtures().join("models").join(name);
    read_model(&read_manifest(folder.join("model.toml")).expect("manifest")).expect("readable")
}

/// Kind of the quantity in a matrix row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RowKind {
    /// Displacement of a node.
    Displacement,
    /// Rotation of a node.
    Rotation,
    /// Vector without a position that vanishes in rigid motion and rotates with the body.
    Internal,
    /// Director `node` % 3 of node `node` / 3: a vector e_a that rotates with its node.
    Director,
}

/// Matrix row: a component of a vector of the given kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Row {
    pub kind: RowKind,
    /// Index of the node in the positions; for an internal vector any unique number.
    pub node: usize,
    /// Component: 0, 1 or 2.
    pub axis: usize,
}

/// Returns the rows of a model with labels: nodes without coordinates carry internal vectors.
pub fn rows(raw: &RawModel) -> Vec<Row> {
    let index: HashMap<i64, usize> = raw.nodes.ids.iter().enumerate().map(|(i, &id)| (id, i)).collect();
    let row = |label: &flexbody_model::DofLabel| {
        let axis = usize::from(label.direction - 1) % 3;
        match index.get(&label.node) {
            Some(&node) if label.direction > 3 => Row { kind: RowKind::Rotation, node, axis },
            Some(&node) => Row { kind: RowKind::Displacement, node, axis },
            None => Row { kind: RowKind::Internal, node: label.node as usize, axis },
        }
    };
    raw.dofs.as_ref().expect("labels").iter().map(row).collect()
}

/// Converts a faer matrix to nalgebra.
pub fn dense(a: &Mat<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}

/// Returns Phi_t and Bx (N x 6): velocities of the rows for unit velocities and unit rotations about the origin.
pub fn rigid_velocities(rows: &[Row], positions: &[[f64; 3]]) -> DMatrix<f64> {
    let mut rigid = DMatrix::zeros(rows.len(), 6);
    for (i, row) in rows.iter().enumerate() {
        match row.kind {
            RowKind::Displacement => {
                rigid[(i, row.axis)] = 1.0;
                // Row k of -x~ is (e_1 x r)_k, (e_2 x r)_k, (e_3 x r)_k.
                let arm = -skew(&Vector3::from(positions[row.node]));
                (0..3).for_each(|a| rigid[(i, 3 + a)] = arm[(row.axis, a)]);
            }
            RowKind::Rotation => rigid[(i, 3 + row.axis)] = 1.0,
            RowKind::Director => {
                let arm = -skew(&Vector3::ith(row.node % 3, 1.0));
                (0..3).for_each(|a| rigid[(i, 3 + a)] = arm[(row.axis, a)]);
            }
            RowKind::Internal => {}
        }
    }
    rigid
}

/// Returns e_a x v for every vector of the rows, rotations included; components without a row count as zero.
pub fn turned(rows: &[Row], a: usize, x: &DMatrix<f64>) -> DMatrix<f64> {
    let place: HashMap<Row, usize> = rows.iter().enumerate().map(|(i, &row)| (row, i)).collect();
    let mut product = DMatrix::zeros(x.nrows(), x.ncols());
    for (i, row) in rows.iter().enumerate() {
        let (axis, sign) = match (3 + row.axis - a) % 3 {
            1 => ((a + 2) % 3, -1.0),
            2 => ((a + 1) % 3, 1.0),
            _ => continue,
        };
        if let Some(&partner) = place.get(&Row { axis, ..*row }) {
            product.set_row(i, &(x.row(partner) * sign));
        }
    }
    product
}

/// Unreduced body with the nodal velocities vbar = B(q) nu for nu = (V, omega, qd) in body axes. If rotations carry
/// mass, the rows of the mass matrix are points, directors and rotations (docs/theory.md section 6, to first order in
/// q), and `couples_by_moment` puts s(q) = c + C1 q into the coupling of V and omega.
pub struct NodalBody {
    rows: Vec<Row>,
    stiffness: DMatrix<f64>,
    mass: DMatrix<f64>,
    couples_by_moment: bool,
    /// Modes Psi in the rows of K.
    own_shapes: DMatrix<f64>,
    /// Matrices Phi_t and Bx (N x 6).
    rigid: DMatrix<f64>,
    /// Modes Psi (N x nf) in the rows of M.
    shapes: DMatrix<f64>,
    /// Matrices whose column j is B_j e_a, for a = 1, 2, 3.
    modal: [DMatrix<f64>; 3],
}

impl NodalBody {
    /// Creates the body from K and M (N x N), the kinds of their rows, node positions in the body frame and Psi (N x
    /// nf).
    pub fn new(
        stiffness: &Mat<f64>,
        mass: &Mat<f64>,
        rows: &[Row],
        positions: &[[f64; 3]],
        shapes: &Mat<f64>,
    ) -> Self {
        let own_shapes = dense(shapes);
        let own_mass = dense(mass);
        let turns = rows.iter().enumerate().filter(|(_, row)| row.kind == RowKind::Rotation);
        let couples_by_moment = turns.clone().any(|(i, _)| own_mass.row(i).norm() > 0.0);
        let (rows, shapes, mass) = if couples_by_moment {
            on_directors(rows, &own_shapes, &own_mass)
        } else {
            (rows.to_vec(), own_shapes.clone(), own_mass)
        };
        let mut vectors = shapes.clone();
        for (i, row) in rows.iter().enumerate() {
            if row.kind == RowKind::Rotation {
                vectors.row_mut(i).fill(0.0);
            }
        }
        Self {
            stiffness: dense(stiffness),
            mass,
            couples_by_moment,
            own_shapes,
            rigid: rigid_velocities(&rows, positions),
            modal: [0, 1, 2].map(|a| turned(&rows, a, &vectors)),
            rows,
            shapes,
        }
    }

    /// Returns C1 (3 x nf).
    fn modal_momentum(&self) -> DMatrix<f64> {
        self.rigid.columns(0, 3).transpose() * (&self.mass * &self.shapes)
    }

    /// Returns the velocities that enter the nodal products: without V if s(q) makes the coupling.
    fn seen_by_nodes(&self, nu: &DVector<f64>) -> DVector<f64> {
        let mut seen = nu.clone();
        if self.couples_by_moment {
            seen.rows_mut(0, 3).fill(0.0);
        }
        seen
    }

    /// Returns the parts of dMc/dt nu and of dT/dq that the coupling by s(q) adds.
    fn of_flight(&self, state: &State) -> (DVector<f64>, DVector<f64>) {
        let nf = self.n_modes();
        let (mut rate, mut slope) = (DVector::zeros(6 + nf), DVector::zeros(nf));
        if self.couples_by_moment {
            let (velocity, w) = (state.axes.transpose() * state.velocity, state.omega);
            let c1 = self.modal_momentum();
            let moved = Vector3::from_iterator((&c1 * &state.qd).iter().copied());
            rate.rows_mut(0, 3).copy_from(&w.cross(&moved));
            rate.rows_mut(3, 3).copy_from(&moved.cross(&velocity));
            slope = c1.transpose() * velocity.cross(&w);
        }
        (rate, slope)
    }

    pub fn n_modes(&self) -> usize {
        self.shapes.ncols()
    }

    /// Returns the change of the rotation columns with the modal coordinates: sum_j q_j B_j (N x 3).
    fn modal_rotation(&self, q: &DVector<f64>) -> DMatrix<f64> {
        DMatrix::from_columns(&[0, 1, 2].map(|a| &self.modal[a] * q))
    }

    /// Returns B(q) (N x (6 + nf)).
    pub fn velocity_map(&self, q: &DVector<f64>) -> DMatrix<f64> {
        let mut map = DMatrix::zeros(self.mass.nrows(), 6 + self.n_modes());
        map.columns_mut(0, 6).copy_from(&self.rigid);
        let mut rotation = map.columns_mut(3, 3);
        rotation += self.modal_rotation(q);
        map.columns_mut(6, self.n_modes()).copy_from(&self.shapes);
        map
    }

    /// Returns Mc(q) = B'M B.
    pub fn mass_matrix(&self, q: &DVector<f64>) -> DMatrix<f64> {
        let map = self.velocity_map(q);
        let mut matrix = map.transpose() * &self.mass * map;
        if self.couples_by_moment {
            let lever = self.rigid.columns(0, 3).transpose() * (&self.mass * self.rigid.columns(3, 3));
            let first = Vector3::new(lever[(1, 2)], lever[(2, 0)], lever[(0, 1)]);
            let moment = first + Vector3::from_iterator((self.modal_momentum() * q).iter().copied());
            matrix.view_mut((0, 3), (3, 3)).copy_from(&-skew(&moment));
            matrix.view_mut((3, 0), (3, 3)).copy_from(&skew(&moment));
        }
        matrix
    }

    /// Returns the accelerations (R'' world, alpha body, q'') of the free undamped body from (p, h, pi) = B'M vbar,
    /// each term as nodal products.
    pub fn accelerations(&self, state: &State) -> DVector<f64> {
        let map = self.velocity_map(&state.q);
        let map_rate = self.modal_rotation(&state.qd);
        let nu = self.seen_by_nodes(&quasi_velocities(state));
        let weighted = &self.mass * (&map * &nu);
        let matrix = self.mass_matrix(&state.q);
        let momenta = &matrix * quasi_velocities(state);
        let mut rate = map.transpose() * (&self.mass * (&map_rate * state.omega));
        let mut rotation = rate.rows_mut(3, 3);
        rotation += map_rate.transpose() * &weighted;
        let mut energy_slope: DVector<f64> =
            (0..3).map(|a| self.modal[a].transpose() * &weighted * state.omega[a]).sum();
        if self.couples_by_moment {
            rate.rows_mut(0, 3).fill(0.0);
        }
        let (of_flight, slope) = self.of_flight(state);
        rate += of_flight;
        energy_slope += slope;
        let elastic = self.own_shapes.transpose() * (&self.stiffness * (&self.own_shapes * &state.q));
        solve(state, matrix, &momenta, &rate, &energy_slope, &elastic)
    }

    /// Returns the accelerations by the nodal formula of [ZG19], which moves the rotation of the body through M: B'M
    /// (vbar' + omega~ vbar). The formula is wrong if M is not rotation invariant.
    pub fn accelerations_for_rotation_invariant_mass(&self, state: &State) -> DVector<f64> {
        let map = self.velocity_map(&state.q);
        let velocity = DMatrix::from_columns(&[&map * quasi_velocities(state)]);
        let mut apparent = self.modal_rotation(&state.qd) * state.omega;
        for a in 0..3 {
            apparent += turned(&self.rows, a, &velocity).column(0) * state.omega[a];
        }
        let elastic = &self.stiffness * (&self.own_shapes * &state.q);
        let mut forces = -(map.transpose() * (&self.mass * apparent));
        let mut modal = forces.rows_mut(6, self.n_modes());
        modal -= self.own_shapes.transpose() * elastic;
        let weighted_map = &self.mass * &map;
        in_world(state, (map.transpose() * weighted_map).lu().solve(&forces).expect("mass"))
    }

    /// Returns the constant coefficients of Mc(q).
    pub fn invariants(&self) -> GeneralBody {
        let nf = self.n_modes();
        let product = |a: &DMatrix<f64>, b: &DMatrix<f64>| a.transpose() * (&self.mass * b);
        let (translation, rotation) =
            (self.rigid.columns(0, 3).into_owned(), self.rigid.columns(3, 3).into_owned());
        let (mut w0, mut w1) = (DMatrix::zeros(3, 3 * nf), DMatrix::zeros(3, 3 * nf));
        let (mut w2, mut w3) = (DMatrix::zeros(3 * nf, 3 * nf), DMatrix::zeros(3 * nf, nf));
        for b in 0..3 {
            w0.columns_mut(b * nf, nf).copy_from(&product(&translation, &self.modal[b]));
            w3.rows_mut(b * nf, nf).copy_from(&product(&self.modal[b], &self.shapes));
            let first = product(&rotation, &self.modal[b]);
            for a in 0..3 {
                for (row, column) in [(a, b), (b, a)] {
                    let mut target = w1.view_mut((row, column * nf), (1, nf));
                    target += first.row(a);
                }
                w2.view_mut((a * nf, b * nf), (nf, nf)).copy_from(&product(&self.modal[a], &self.modal[b]));
            }
        }
        if self.couples_by_moment {
            let c1 = product(&translation, &self.shapes);
            for (b, j) in (0..3).flat_map(|b| (0..nf).map(move |j| (b, j))) {
                let own = Vector3::from_fn(|k, _| c1[(k, j)]);
                w0.set_column(b * nf + j, &Vector3::ith(b, 1.0).cross(&own));
            }
        }
        let moment = product(&translation, &rotation); // -c~
        let inertia = product(&rotation, &rotation);
        GeneralBody {
            reduced: ReducedBody {
                mass: product(&translation, &translation)[(0, 0)],
                first_moment: Vector3::new(moment[(1, 2)], moment[(2, 0)], moment[(0, 1)]),
                inertia: Matrix3::from_fn(|k, l| inertia[(k, l)]),
                c1: product(&translation, &self.shapes),
                c2: product(&rotation, &self.shapes),
                w1,
                w2,
                w3,
                modal_mass: product(&self.shapes, &self.shapes),
                modal_stiffness: self.own_shapes.transpose() * (&self.stiffness * &self.own_shapes),
            },
            w0,
        }
    }

    /// Returns (p, h, pi) = B'M vbar in body axes, about the origin of the frame.
    fn momenta(&self, state: &State) -> DVector<f64> {
        self.mass_matrix(&state.q) * quasi_velocities(state)
    }

    /// Returns the sum of kinetic and strain energy.
    pub fn energy(&self, state: &State) -> f64 {
        let displacement = &self.own_shapes * &state.q;
        0.5 * quasi_velocities(state).dot(&self.momenta(state))
            + 0.5 * displacement.dot(&(&self.stiffness * &displacement))
    }

    /// Returns the linear momentum in world axes.
    pub fn linear_momentum(&self, state: &State) -> Vector3<f64> {
        state.axes * self.momenta(state).fixed_rows::<3>(0)
    }

    /// Returns the angular momentum about the world origin, in world axes.
    pub fn angular_momentum(&self, state: &State) -> Vector3<f64> {
        state.axes * self.momenta(state).fixed_rows::<3>(3) + state.origin.cross(&self.linear_momentum(state))
    }
}

/// Returns rows, shapes and mass with directors, dense and from the blocks M_tr = -h~ + N, M_rr = tr(P) I - P'. A plane
/// body has h = (M_y, -M_x), P = M_rr / 2 I.
fn on_directors(
    rows: &[Row],
    shapes: &DMatrix<f64>,
    mass: &DMatrix<f64>,
) -> (Vec<Row>, DMatrix<f64>, DMatrix<f64>) {
    let place: HashMap<Row, usize> = rows.iter().enumerate().map(|(i, &row)| (row, i)).collect();
    let plane = rows.iter().all(|row| (row.kind == RowKind::Rotation) == (row.axis == 2));
    let axes = if plane { 2 } else { 3 };
    // Nodes with rotations, and the vectors of the other rows.
    let mut nodes: Vec<usize> =
        rows.iter().filter(|row| row.kind == RowKind::Rotation).map(|row| row.node).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let mut vectors: Vec<(RowKind, usize)> =
        rows.iter().filter(|row| row.kind != RowKind::Rotation).map(|row| (row.kind, row.node)).collect();
    vectors.sort_unstable_by_key(|(kind, node)| (*kind == RowKind::Internal, *node));
    vectors.dedup();

    // Extended rows: points and internal vectors, directors, rotations.
    let mut all: Vec<Row> = vectors
        .iter()
        .flat_map(|&(kind, node)| (0..axes).map(move |axis| Row { kind, node, axis }))
        .collect();
    let directors = nodes.iter().flat_map(|&node| (0..axes).map(move |a| 3 * node + a));
    all.extend(
        directors.flat_map(|node| (0..axes).map(move |axis| Row { kind: RowKind::Director, node, axis })),
    );
    all.extend(
        nodes.iter().flat_map(|&node| (0..3).map(move |axis| Row { kind: RowKind::Rotation, node, axis })),
    );
    let at: HashMap<Row, usize> = all.iter().enumerate().map(|(i, &row)| (row, i)).collect();
    let director =
        |node: usize, a: usize, axis: usize| at[&Row { kind: RowKind::Director, node: 3 * node + a, axis }];

    // Blocks M of the given mass between two vectors; missing rows count as zero.
    let entry = |a: Row, b: Row| match (place.get(&a), place.get(&b)) {
        (Some(&i), Some(&j)) => mass[(i, j)],
        _ => 0.0,
    };
    let block = |(kind, node): (RowKind, usize), (other, second): (RowKind, usize)| {
        Matrix3::from_fn(|k, l| {
            entry(Row { kind, node, axis: k }, Row { kind: other, node: second, axis: l })
        })
    };
    let mut e = DMatrix::zeros(all.len(), all.len());
    for &(kind, node) in &vectors {
        for &(other, second) in &vectors {
            // M_tt between points is kept.
            let own = block((kind, node), (other, second));
            for (k, l) in (0..axes).flat_map(|k| (0..axes).map(move |l| (k, l))) {
                e[(at[&Row { kind, node, axis: k }], at[&Row { kind: other, node: second, axis: l }])] =
                    own[(k, l)];
            }
        }
        for &second in &nodes {
            // M_tr = -h~ + N: h couples the point to the directors, N to the rotations.
            let own = block((kind, node), (RowKind::Rotation, second));
            let (moment, symmetric) = if plane {
                (Vector3::new(own[(1, 2)], -own[(0, 2)], 0.0), Matrix3::zeros())
            } else {
                (
                    Vector3::new(
                        own[(1, 2)] - own[(2, 1)],
                        own[(2, 0)] - own[(0, 2)],
                        own[(0, 1)] - own[(1, 0)],
                    ) * 0.5,
                    (own + own.transpose()) * 0.5,
                )
            };
            for k in 0..axes {
                let i = at[&Row { kind, node, axis: k }];
                for a in 0..axes {
                    let j = director(second, a, k);
                    (e[(i, j)], e[(j, i)]) = (moment[a], moment[a]);
                }
                for b in 0..3 {
                    let j = at[&Row { kind: RowKind::Rotation, node: second, axis: b }];
                    (e[(i, j)], e[(j, i)]) = (symmetric[(k, b)], symmetric[(k, b)]);
                }
            }
        }
    }
    for (&node, &second) in nodes.iter().flat_map(|node| nodes.iter().map(move |second| (node, second))) {
        // P = tr(M_rr) / 2 I - M_rr' couples the directors.
        let own = block((RowKind::Rotation, node), (RowKind::Rotation, second));
        let p = if plane {
            Matrix3::identity() * (0.5 * own[(2, 2)])
        } else {
            Matrix3::identity() * (0.5 * own.trace()) - own.transpose()
        };
        for (a, b, axis) in
            (0..axes).flat_map(|a| (0..axes).flat_map(move |b| (0..axes).map(move |k| (a, b, k))))
        {
            e[(director(node, a, axis), director(second, b, axis))] = p[(a, b)];
        }
    }

    // Shapes in the extended rows: a director moves by theta x e_a.
    let mut extended = DMatrix::zeros(all.len(), shapes.ncols());
    for (i, row) in all.iter().enumerate() {
        for j in 0..shapes.ncols() {
            let value = |row: Row| place.get(&row).map_or(0.0, |&i| shapes[(i, j)]);
            extended[(i, j)] = match row.kind {
                RowKind::Director => {
                    let angle = |axis| value(Row { kind: RowKind::Rotation, node: row.node / 3, axis });
                    Vector3::new(angle(0), angle(1), angle(2)).cross(&Vector3::ith(row.node % 3, 1.0))
                        [row.axis]
                }
                _ => value(*row),
            };
        }
    }
    (all, extended, e)
}

/// Invariants of a body with any mass matrix: those of the file, and W0 (3 x 3nf) with the columns Phi_t'M B_j e_b at b
/// nf + j, which are e_b x C1_j if M is rotation invariant.
pub struct GeneralBody {
    pub reduced: ReducedBody,
    pub w0: DMatrix<f64>,
}

impl GeneralBody {
    /// Returns [W Q]_kb = sum_j W_k,(b nf + j) q_j.
    fn contracted(&self, w: &DMatrix<f64>, q: &DVector<f64>) -> Matrix3<f64> {
        let nf = q.len();
        Matrix3::from_fn(|k, b| w.view((k, b * nf), (1, nf)).transpose().dot(q))
    }

    /// Returns Mc(q) for (V, omega, qd), all in body axes.
    pub fn mass_matrix(&self, q: &DVector<f64>) -> DMatrix<f64> {
        let body = &self.reduced;
        let nf = q.len();
        let translation_rotation = self.contracted(&self.w0, q) - skew(&body.first_moment);
        let rotation_modes = body.coupling_at(q);
        let mut matrix = DMatrix::zeros(6 + nf, 6 + nf);
        matrix.view_mut((0, 0), (3, 3)).copy_from(&(Matrix3::identity() * body.mass));
        matrix.view_mut((0, 3), (3, 3)).copy_from(&translation_rotation);
        matrix.view_mut((3, 0), (3, 3)).copy_from(&translation_rotation.transpose());
        matrix.view_mut((0, 6), (3, nf)).copy_from(&body.c1);
        matrix.view_mut((6, 0), (nf, 3)).copy_from(&body.c1.transpose());
        matrix.view_mut((3, 3), (3, 3)).copy_from(&body.inertia_at(q));
        matrix.view_mut((3, 6), (3, nf)).copy_from(&rotation_modes);
        matrix.view_mut((6, 3), (nf, 3)).copy_from(&rotation_modes.transpose());
        matrix.view_mut((6, 6), (nf, nf)).copy_from(&body.modal_mass);
        matrix
    }

    /// Returns the accelerations (R'' world, alpha body, q'') of the free undamped body.
    pub fn accelerations(&self, state: &State) -> DVector<f64> {
        let body = &self.reduced;
        let nf = state.q.len();
        let nu = quasi_velocities(state);
        let (velocity, w) = (nu.fixed_rows::<3>(0).into_owned(), state.omega);
        let matrix = self.mass_matrix(&state.q);
        let momenta = &matrix * &nu;

        // Term dMc/dt nu.
        let kron = |q: &DVector<f64>| DMatrix::<f64>::identity(3, 3).kronecker(q);
        let (q, qd) = (kron(&state.q), kron(&state.qd));
        let mixed = q.transpose() * &body.w2 * &qd;
        let inertia_rate =
            self.contracted(&body.w1, &state.qd) + Matrix3::from_fn(|k, l| mixed[(k, l)] + mixed[(l, k)]);
        let translation_rate = self.contracted(&self.w0, &state.qd);
        let coupling_rate = qd.transpose() * &body.w3;
        let mut rate = DVector::zeros(6 + nf);
        rate.rows_mut(0, 3).copy_from(&(translation_rate * w));
        let of_rotation = translation_rate.transpose() * velocity + inertia_rate * w;
        rate.rows_mut(3, 3).copy_from(&(of_rotation + &coupling_rate * &state.qd));
        rate.rows_mut(6, nf).copy_from(&(coupling_rate.transpose() * w));

        // Term dT/dq_j = omega' (B_j'M Phi_t V + B_j'M Bx omega + sum_i q_i B_j'M B_i omega + B_j'M Psi qd).
        let spin = w.transpose().kronecker(&DMatrix::<f64>::identity(nf, nf));
        let energy_slope = spin
            * (self.w0.transpose() * velocity
                + body.w1.transpose() * w * 0.5
                + &body.w2 * (&q * w)
                + &body.w3 * &state.qd);
        let elastic = &body.modal_stiffness * &state.q;
        solve(state, matrix, &momenta, &rate, &energy_slope, &elastic)
    }

    fn momenta(&self, state: &State) -> DVector<f64> {
        self.mass_matrix(&state.q) * quasi_velocities(state)
    }

    /// Returns the sum of kinetic and strain energy.
    pub fn energy(&self, state: &State) -> f64 {
        0.5 * quasi_velocities(state).dot(&self.momenta(state))
            + 0.5 * state.q.dot(&(&self.reduced.modal_stiffness * &state.q))
    }

    /// Returns the linear momentum in world axes.
    pub fn linear_momentum(&self, state: &State) -> Vector3<f64> {
        state.axes * self.momenta(state).fixed_rows::<3>(0)
    }

    /// Returns the angular momentum about the world origin, in world axes.
    pub fn angular_momentum(&self, state: &State) -> Vector3<f64> {
        state.axes * self.momenta(state).fixed_rows::<3>(3) + state.origin.cross(&self.linear_momentum(state))
    }
}

/// Returns nu = (V, omega, qd) with the velocity V of the origin in body axes.
pub fn quasi_velocities(state: &State) -> DVector<f64> {
    let velocity = state.axes.transpose() * state.velocity;
    let parts = velocity.iter().chain(state.omega.iter()).chain(state.qd.iter());
    DVector::from_iterator(6 + state.qd.len(), parts.copied())
}

/// Solves Mc nu' from p' + w x p = 0, h' + w x h + V x p = 0, d/dt pi - dT/dq + K q = 0, where `rate` is dMc/dt nu.
fn solve(
    state: &State,
    mut matrix: DMatrix<f64>,
    momenta: &DVector<f64>,
    rate: &DVector<f64>,
    energy_slope: &DVector<f64>,
    elastic: &DVector<f64>,
) -> DVector<f64> {
    let (p, h) = (momenta.fixed_rows::<3>(0).into_owned(), momenta.fixed_rows::<3>(3).into_owned());
    let velocity = state.axes.transpose() * state.velocity;
    let mut forces = -rate;
    let mut translation = forces.rows_mut(0, 3);
    translation -= state.omega.cross(&p);
    let mut rotation = forces.rows_mut(3, 3);
    rotation -= state.omega.cross(&h) + velocity.cross(&p);
    let mut modal = forces.rows_mut(6, elastic.len());
    modal += energy_slope - elastic;
    // Motions that a plane body does not have get no force and unit mass.
    (0..6).filter(|&k| matrix[(k, k)] == 0.0).collect::<Vec<_>>().iter().for_each(|&k| matrix[(k, k)] = 1.0);
    in_world(state, matrix.lu().solve(&forces).expect("the mass matrix is positive definite"))
}

/// Replaces V' by R'' = A (V' + omega x V).
fn in_world(state: &State, mut rates: DVector<f64>) -> DVector<f64> {
    let velocity = state.axes.transpose() * state.velocity;
    let own = rates.fixed_rows::<3>(0).into_owned();
    rates.rows_mut(0, 3).copy_from(&(state.axes * (own + state.omega.cross(&velocity))));
    rates
}

/// Packs a state into y = (R, Euler parameters, R', omega, q, qd) for time integration.
pub fn pack(state: &State) -> DVector<f64> {
    let turn = UnitQuaternion::from_matrix(&state.axes);
    let mut y = state.origin.iter().copied().collect::<Vec<f64>>();
    y.extend([turn.w, turn.i, turn.j, turn.k]);
    y.extend(state.velocity.iter().chain(state.omega.iter()).chain(state.q.iter()).chain(state.qd.iter()));
    DVector::from_vec(y)
}

/// Returns the state that [`pack`] has packed.
pub fn unpack(y: &DVector<f64>) -> State {
    let nf = (y.len() - 13) / 2;
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(y[3], y[4], y[5], y[6]));
    State {
        origin: y.fixed_rows::<3>(0).into_owned(),
        axes: turn.to_rotation_matrix().into_inner(),
        velocity: y.fixed_rows::<3>(7).into_owned(),
        omega: y.fixed_rows::<3>(10).into_owned(),
        q: y.rows(13, nf).into_owned(),
        qd: y.rows(13 + nf, nf).into_owned(),
    }
}

/// Returns y' from the accelerations (R'' world, alpha body, q'').
pub fn rates(y: &DVector<f64>, accelerations: impl Fn(&State) -> DVector<f64>) -> DVector<f64> {
    let state = unpack(y);
    let nf = state.q.len();
    let found = accelerations(&state);
    let turn = Quaternion::new(y[3], y[4], y[5], y[6]) * Quaternion::from_imag(state.omega) * 0.5;
    let mut rate = DVector::zeros(y.len());
    rate.rows_mut(0, 3).copy_from(&state.velocity);
    rate.rows_mut(3, 4).copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
    rate.rows_mut(7, 6).copy_from(&found.rows(0, 6));
    rate.rows_mut(13, nf).copy_from(&state.qd);
    rate.rows_mut(13 + nf, nf).copy_from(&found.rows(6, nf));
    rate
}

/// Returns y' of the unreduced body.
pub fn nodal_rates(body: &NodalBody, y: &DVector<f64>) -> DVector<f64> {
    rates(y, |state| body.accelerations(state))
}

/// Returns y' by the invariants.
pub fn reduced_rates(body: &GeneralBody, y: &DVector<f64>) -> DVector<f64> {
    rates(y, |state| body.accelerations(state))
}

/// Returns a matrix of random entries between -1 and 1.
pub fn random_matrix(random: &mut Random, rows: usize, columns: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rows, columns, |_, _| random.signed())
}

/// Converts an nalgebra matrix to faer.
pub fn to_faer(a: &DMatrix<f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}

/// Returns a random body: five nodes, three of them with rotations, two internal vectors, all rows in random order, and
/// four random shapes. M is the mass of points and directors: a random positive definite matrix between them, and a
/// twentieth of it that depends on the direction and vanishes in rigid motion.
pub fn random_body(seed: u64) -> NodalBody {
    let mut random = Random(seed);
    let positions: Vec<[f64; 3]> = (0..5).map(|_| random.vector::<3>()).collect();
    let vectors = (0..5)
        .map(|node| (RowKind::Displacement, node))
        .chain((0..3).map(|node| (RowKind::Rotation, node)))
        .chain((7..9).map(|node| (RowKind::Internal, node)));
    let ordered: Vec<Row> =
        vectors.flat_map(|(kind, node)| [0, 1, 2].map(|axis| Row { kind, node, axis })).collect();
    let rows: Vec<Row> = random.permutation(ordered.len()).into_iter().map(|i| ordered[i]).collect();
    let n = rows.len();
    let square = |random: &mut Random, n: usize| {
        let a = random_matrix(random, n, n);
        &a * a.transpose() / n as f64
    };
    // Points 0 to 4, internal vectors 5 and 6, directors 7 + 3 node + a.
    let of_vectors = square(&mut random, 7 + 9).kronecker(&DMatrix::<f64>::identity(3, 3));
    let mut lift = DMatrix::zeros(of_vectors.nrows(), n);
    for (i, row) in rows.iter().enumerate() {
        match row.kind {
            RowKind::Displacement => lift[(3 * row.node + row.axis, i)] = 1.0,
            RowKind::Internal => lift[(3 * (row.node - 2) + row.axis, i)] = 1.0,
            RowKind::Rotation => {
                for a in 0..3 {
                    let turned = Vector3::ith(row.axis, 1.0).cross(&Vector3::ith(a, 1.0));
                    (0..3).for_each(|k| lift[(3 * (7 + 3 * row.node + a) + k, i)] = turned[k]);
                }
            }
            RowKind::Director => unreachable!("no row of a model"),
        }
    }
    let (any, stiffness) = (square(&mut random, n) * 0.05, square(&mut random, n));
    let rigid = rigid_velocities(&rows, &positions);
    let gram = (rigid.transpose() * &rigid).try_inverse().expect("regular");
    let elastic = DMatrix::identity(n, n) - &rigid * gram * rigid.transpose();
    let mass = lift.transpose() * of_vectors * lift + elastic.transpose() * any * elastic;
    let mass = (&mass + mass.transpose()) * 0.5;
    let shapes = random_matrix(&mut random, n, 4);
    NodalBody::new(&to_faer(&stiffness), &to_faer(&mass), &rows, &positions, &to_faer(&shapes))
}
