//! Models with all their modes, for tests of the nodal equations.

use super::elements::{ElementKind, MassRule, Material};
use super::equations::State;
use super::general::{NodalBody, Row, RowKind, raw_fixture};
use super::mesh::{Mesh, grid};
use super::plane::rectangle;
use super::random::Random;
use super::reference;
use faer::Mat;
use flexbody_body::flex_body::Frame;
use flexbody_linalg::SymmetricMatrix;
use flexbody_model::{DofLabel, FeModel, RawModel};
use flexbody_motion::dynamics::{EulerParameters, NodalConfiguration};
use nalgebra::{DVector, Matrix3, UnitQuaternion, Vector3};

/// Checked model and all its flexible modes, by the dense oracle.
pub struct Unreduced {
    pub model: FeModel,
    /// Frame at the centre of mass, along the axes of the model.
    pub frame: Frame,
    pub positions: Vec<[f64; 3]>,
    pub rows: Vec<Row>,
    pub stiffness: Mat<f64>,
    pub mass: Mat<f64>,
    pub eigenvalues: Vec<f64>,
    /// Modes (N x (N - 6 - null vectors of M)) in the rows of the model.
    pub shapes: Mat<f64>,
    /// Root of the mean moment of inertia.
    pub size: f64,
    pub total_mass: f64,
}

/// Returns the dense matrix A kron I of a block structure.
fn full(a: &SymmetricMatrix, block: usize) -> Mat<f64> {
    let mut dense = Mat::zeros(a.n() * block, a.n() * block);
    for i in 0..a.n() {
        let (columns, values) = a.row(i);
        for (&j, &v) in columns.iter().zip(values) {
            (0..block).for_each(|k| dense[(block * i + k, block * j as usize + k)] = v);
        }
    }
    dense
}

impl Unreduced {
    pub fn new(raw: RawModel) -> Self {
        let model = FeModel::from_raw(raw).expect("a body").model;
        let pencil = model.pencil();
        let (stiffness, mass) = (full(pencil.stiffness(), 1), full(pencil.mass(), pencil.block()));
        let found = reference::modes_of(&stiffness, &mass);
        let node = |id: i64| model.nodes().ids.iter().position(|own| *own == id);
        let row = |i: usize| {
            let label = model.label(i);
            let axis = usize::from(label.direction - 1) % 3;
            match node(label.node) {
                Some(node) if label.direction > 3 => Row { kind: RowKind::Rotation, node, axis },
                Some(node) => Row { kind: RowKind::Displacement, node, axis },
                None => Row { kind: RowKind::Internal, node: label.node as usize, axis },
            }
        };
        let rows: Vec<Row> = (0..model.rows().len()).map(row).collect();
        let rigid = model.rigid_fields([0.0; 3], 1.0);
        let block = rigid.transpose() * &mass * &rigid;
        let (total_mass, z) = (block[(0, 0)], rigid.ncols() - 1);
        // The first moment is in the coupling of translation and rotation of R' M R.
        let com = match rigid.ncols() {
            3 => Vector3::new(block[(1, z)], -block[(0, z)], 0.0) / total_mass,
            _ => Vector3::new(block[(1, 5)], -block[(0, 5)], block[(0, 4)]) / total_mass,
        };
        let about = model.rigid_fields(com.into(), 1.0);
        let block = about.transpose() * &mass * &about;
        let frame = Frame { origin: com, axes: Matrix3::identity() };
        Self {
            positions: frame.to_body(&model.nodes().positions),
            frame,
            rows,
            stiffness,
            mass,
            eigenvalues: found.eigenvalues,
            shapes: found.shapes,
            size: block[(z, z)].sqrt(),
            total_mass,
            model,
        }
    }

    /// Reads a model of `fixtures/models`.
    pub fn fixture(name: &str) -> Self {
        Self::new(raw_fixture(name))
    }

    /// Returns the oracle with `shapes` (N x nf).
    pub fn oracle(&self, shapes: &Mat<f64>) -> NodalBody {
        NodalBody::new(&self.stiffness, &self.mass, &self.rows, &self.positions, shapes)
    }

    /// Returns a state of all modes with spin, translation and modal rates on one time scale, so that no force hides
    /// the others.
    pub fn moving_state(&self, seed: u64, deformation: f64) -> State {
        let mut random = Random(seed);
        let (lambda, nf) = (&self.eigenvalues, self.eigenvalues.len());
        let (rate, size) = (lambda[0].sqrt(), self.size);
        let plane = self.model.dimension() == 2;
        let flat = |v: Vector3<f64>| if plane { Vector3::new(v.x, v.y, 0.0) } else { v };
        let along_z = |v: Vector3<f64>| if plane { Vector3::z() * v.z } else { v };
        let turn = UnitQuaternion::from_scaled_axis(along_z(Vector3::from(random.vector::<3>()) * 2.0));
        State {
            origin: flat(Vector3::from(random.vector::<3>())),
            axes: turn.to_rotation_matrix().into_inner(),
            velocity: flat(Vector3::from(random.vector::<3>())) * (rate * size / self.total_mass.sqrt()),
            omega: along_z(Vector3::from(random.vector::<3>())) * (0.5 * rate),
            q: DVector::from_fn(nf, |j, _| deformation * size * lambda[0] / lambda[j] * random.signed()),
            qd: DVector::from_fn(nf, |j, _| {
                deformation * size * rate * (lambda[0] / lambda[j]).sqrt() * random.signed()
            }),
        }
    }
}

/// Returns a state of the oracle with its displacements, u = `shapes` q.
pub fn configuration(shapes: &Mat<f64>, state: &State) -> NodalConfiguration {
    let turn = UnitQuaternion::from_matrix(&state.axes);
    let lifted = |q: &DVector<f64>| times(shapes, q).as_slice().to_vec();
    NodalConfiguration {
        origin: state.origin,
        attitude: EulerParameters([turn.w, turn.i, turn.j, turn.k]),
        velocity: state.velocity,
        omega: state.omega,
        u: lifted(&state.q),
        ud: lifted(&state.qd),
    }
}

/// Returns degrees of freedom that hold a body: three of one node, two of another and one of a third, all far apart.
pub fn holding(model: &FeModel) -> Vec<DofLabel> {
    let x: Vec<Vector3<f64>> = model.nodes().positions.iter().map(|x| Vector3::from(*x)).collect();
    let farthest =
        |f: &dyn Fn(usize) -> f64| (0..x.len()).max_by(|&i, &j| f(i).total_cmp(&f(j))).expect("nodes");
    let first = farthest(&|i| x[i].norm());
    let second = farthest(&|i| (x[i] - x[first]).norm());
    let along = x[second] - x[first];
    let third = farthest(&|i| along.cross(&(x[i] - x[first])).norm());
    let directions = |v: Vector3<f64>| {
        let mut order = [0u8, 1, 2];
        order.sort_by(|&i, &j| v[i as usize].abs().total_cmp(&v[j as usize].abs()));
        order
    };
    let label = |i: usize, k: u8| DofLabel { node: model.nodes().ids[i], direction: k + 1 };
    if model.dimension() == 2 {
        let across = u8::from(along.x.abs() > along.y.abs());
        return vec![label(first, 0), label(first, 1), label(second, across)];
    }
    let [across, also, _] = directions(along);
    let [.., normal] = directions(along.cross(&(x[third] - x[first])));
    vec![
        label(first, 0),
        label(first, 1),
        label(first, 2),
        label(second, across),
        label(second, also),
        label(third, normal),
    ]
}

/// Returns a matrix times a vector.
pub fn times(a: &Mat<f64>, x: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(a.nrows(), |i, _| (0..a.ncols()).map(|j| a[(i, j)] * x[j]).sum())
}

/// Returns a rubber block without symmetry.
pub fn soft_block(kind: ElementKind, cells: [i32; 3]) -> RawModel {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(kind, &grid(cells), |[x, y, z]| {
        [0.5 * x + 0.06 * y, 0.4 * y * (1.0 - 0.05 * x), 0.3 * z * (1.0 + 0.1 * y)]
    });
    mesh.assemble(&rubber, MassRule::Consistent).raw_model()
}

/// Returns a plane body of bilinear elements.
pub fn soft_plate() -> RawModel {
    rectangle(4, 2, 0.7, [1.0, 2.0])
}
