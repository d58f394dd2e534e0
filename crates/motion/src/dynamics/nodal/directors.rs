//! Constants of the kinetic energy of nodes with rotational mass (theory section 6).

use super::motions::{Motions, add_motion};
use flexbody_linalg::multiply_vector;
use flexbody_model::{DirectorMass, FeModel};
use nalgebra::{Matrix6, Vector3, Vector6};

/// Mass of points and directors, and the remainder M_R of M, as they enter the kinetic energy of turned
/// nodes.
///
/// ```text
/// T = 1/2 Yd'E Yd + 1/2 y'M_R y + V_c'(omega x s_R + C1_R u'),    s_R = c_R + C1_R u,    C1_R = Phi_t'M_R
/// Yd: V + omega x (x + u) + u' at points, (omega + J theta') x d_a at the directors d_a = exp(theta~) e_a
/// y:  omega x (x - x_c + u) + u' at displacements, omega + theta' at rotations
/// ```
///
/// x_c is the centre of mass of the undeformed body and V_c = V + omega x x_c its velocity as a point of
/// the frame. V multiplies only omega x s + ds/dt of the first moment s(u), so that a constant velocity
/// adds the rate of a function of the state to T and does not change the motion.
#[derive(Debug, Clone)]
pub(super) struct Directors<'m> {
    pub mass: &'m DirectorMass,
    /// Number of directors of a node: 3, in the plane 2.
    pub dimension: usize,
    /// Number of rows of displacements.
    pub points: usize,
    /// Rows of the rotations about the three axes, for every node with directors.
    pub rotations: Vec<[Option<usize>; 3]>,
    /// E Phi_t at points and directors.
    pub translated: Vec<Vector3<f64>>,
    pub rest: Option<Rest>,
}

/// Constants of M_R, on extended rows.
#[derive(Debug, Clone)]
pub(super) struct Rest {
    /// M_R Phi_t.
    pub translated: Vec<Vector3<f64>>,
    /// c_R: M_R gives a rotation omega about x_c the linear momentum omega x c_R.
    pub first_moment: Vector3<f64>,
    /// x_c about the origin of the frame.
    pub centre: Vector3<f64>,
}

impl<'m> Directors<'m> {
    /// Creates the constants of `model` with the rigid motions `rigid` of its rows and R'M R =
    /// `rigid_mass`; `None` if no rotation carries mass.
    pub(super) fn new(model: &'m FeModel, rigid: &Motions, rigid_mass: &Matrix6<f64>) -> Option<Self> {
        let mass: &DirectorMass = model.director_mass()?;
        let points = model.rows().displacements();
        let mut directors = Self {
            mass,
            dimension: model.dimension(),
            points,
            rotations: rotations(model, mass),
            translated: Vec::new(),
            rest: None,
        };
        let fields: [Vec<f64>; 3] = std::array::from_fn(|k| {
            let mut field: Vec<f64> = rigid[..points].iter().map(|row| row[k]).collect();
            field.resize(mass.turning_rows(), 0.0);
            field
        });
        directors.translated = translated(&fields, |x, y| directors.weigh(x, y));
        directors.rest = Rest::new(&directors, rigid, &fields, rigid_mass);
        Some(directors)
    }

    /// Computes y = E x of points and directors.
    pub(super) fn weigh(&self, x: &[f64], y: &mut [f64]) {
        multiply_vector(self.mass.scalar(), self.dimension, x, y);
    }

    /// Returns the first row of director `a` of the node at `place`.
    pub(super) fn director(&self, place: usize, a: usize) -> usize {
        self.points + self.dimension * (self.dimension * place + a)
    }

    /// Returns the first extended row of the rotations of the node at `place`, and the axes of these
    /// rotations.
    pub(super) fn rest_rotations(&self, place: usize) -> (usize, std::ops::Range<usize>) {
        let axes = if self.dimension == 2 { 2..3 } else { 0..3 };
        (self.mass.turning_rows() + axes.len() * place, axes)
    }

    /// Returns the rotations of the node at `place` from the rows of the model, zero about axes without a
    /// row.
    pub(super) fn turn_of(&self, place: usize, x: &[f64]) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.rotations[place][axis].map_or(0.0, |row| x[row]))
    }

    /// Returns true if a row of the model turns a node with directors.
    pub(super) fn has_rotation(&self, row: usize) -> bool {
        self.rotations.iter().flatten().flatten().any(|&own| own == row)
    }
}

impl Rest {
    /// Creates the constants of M_R; `None` if E is the whole mass. `fields`: translations at points and
    /// directors.
    fn new(
        directors: &Directors<'_>,
        rigid: &Motions,
        fields: &[Vec<f64>; 3],
        rigid_mass: &Matrix6<f64>,
    ) -> Option<Self> {
        let rest = directors.mass.rest()?;
        let extended = |field: &[f64]| {
            let mut field = field.to_vec();
            field.resize(directors.mass.rows(), 0.0);
            field
        };
        let weigh = |x: &[f64], y: &mut [f64]| multiply_vector(rest, 1, x, y);
        let translated = translated(&std::array::from_fn(|k| extended(&fields[k])), weigh);
        // R'M R = [m I, -c~; c~, I0]; for a plane body only the last column of c~ exists.
        let centre = column_of_skew(rigid_mass, directors.dimension) / rigid_mass[(0, 0)];
        let mut coupling = Matrix6::zeros();
        for axis in if directors.dimension == 2 { 2..3 } else { 0..3 } {
            let unit = Vector3::ith(axis, 1.0);
            let mut motion = Vector6::zeros();
            motion.fixed_rows_mut::<3>(0).copy_from(&centre.cross(&unit));
            motion[3 + axis] = 1.0;
            let mut field = vec![0.0; directors.mass.rows()];
            add_motion(&rigid[..directors.points], 1.0, &motion, &mut field);
            for place in 0..directors.rotations.len() {
                let (first, axes) = directors.rest_rotations(place);
                field[first + axis - axes.start] = 1.0;
            }
            let momentum: Vector3<f64> = field.iter().zip(&translated).map(|(x, row)| row * *x).sum();
            coupling.fixed_view_mut::<3, 1>(0, 3 + axis).copy_from(&momentum);
        }
        let first_moment = column_of_skew(&coupling, directors.dimension);
        Some(Self { translated, first_moment, centre })
    }
}

/// Returns c of the block -c~ in the rows of translation and the columns of rotation.
fn column_of_skew(both: &Matrix6<f64>, dimension: usize) -> Vector3<f64> {
    let z = if dimension == 2 { 0.0 } else { both[(0, 4)] };
    Vector3::new(both[(1, 5)], -both[(0, 5)], z)
}

/// Returns the products of a mass with the three translations, one vector per row.
fn translated(fields: &[Vec<f64>; 3], weigh: impl Fn(&[f64], &mut [f64])) -> Vec<Vector3<f64>> {
    let mut rows = vec![Vector3::zeros(); fields[0].len()];
    let mut product = vec![0.0; rows.len()];
    for (k, field) in fields.iter().enumerate() {
        weigh(field, &mut product);
        rows.iter_mut().zip(&product).for_each(|(row, value)| row[k] = *value);
    }
    rows
}

/// Returns the rows of the rotations about the three axes, for every node with directors.
fn rotations(model: &FeModel, mass: &DirectorMass) -> Vec<[Option<usize>; 3]> {
    let mut rotations = vec![[None; 3]; mass.nodes().len()];
    let first = model.rows().displacements();
    for (row, &(node, axis)) in (first..).zip(model.rows().rotations()) {
        if let Ok(place) = mass.nodes().binary_search(&node) {
            rotations[place][usize::from(axis)] = Some(row);
        }
    }
    rotations
}
