//! Constants of the kinetic energy of nodes with rotational mass (theory section 6).

use super::conditions::{Motions, add_motion};
use super::error::NodalError;
use flexbody_linalg::{SparseLdl, SymmetricMatrix, multiply_vector};
use flexbody_model::{DirectorMass, FeModel};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix6, Vector3, Vector6};

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
    fn has_rotation(&self, row: usize) -> bool {
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

// Exact condensation of massless motions (theory 6.13).

/// Pivot of M, relative to its diagonal entry, that counts as zero. Consistent masses stay above 1e-4, null
/// vectors leave 1e-15.
pub(super) const NULL_PIVOT: f64 = 1e-9;

/// Largest z'Mz of a null vector relative to that of the diagonal of M.
const NULL_MASS: f64 = 1e-10;

/// Limit of the numbers stored for null vectors (16 MB).
const DENSE: usize = 2_000_000;

/// Null space of M: Z = \[unit vectors of empty rows, others\], where the others have K z = 0 in the empty
/// rows.
#[derive(Debug, Clone)]
pub(super) struct Massless {
    /// Empty rows of M.
    rows: Vec<usize>,
    /// Factor of K on these rows.
    own: Option<SparseLdl>,
    /// The other null vectors, one after the other, and their products with K.
    vectors: Vec<f64>,
    weighted: Vec<f64>,
    /// Factor of Z'K Z of the other null vectors.
    factor: Option<Cholesky<f64, Dyn>>,
}

/// Work arrays for the products of [`Massless`].
#[derive(Debug, Clone)]
pub(super) struct Workspace {
    own: Vec<f64>,
    scratch: Vec<f64>,
    coefficients: DVector<f64>,
}

/// Returns true if a row of M is empty.
fn is_empty(model: &FeModel, row: usize) -> bool {
    let pencil = model.pencil();
    pencil.mass().row(row / pencil.block()).0.is_empty()
}

/// Returns an error if a null vector z has mass: `product` is M z, `diagonal` that of M.
fn refuse_mass(product: &[f64], z: &[f64], diagonal: &[f64]) -> Result<(), NodalError> {
    let mass: f64 = product.iter().zip(z).map(|(m, z)| m * z).sum();
    let scale: f64 = diagonal.iter().zip(z).map(|(d, z)| d * z * z).sum();
    if mass.is_nan() || mass.abs() > NULL_MASS * scale {
        return Err(NodalError::MassIndefinite);
    }
    Ok(())
}

/// Returns the factor of Z'K Z for null vectors Z and their products K Z, with `n` rows each.
fn null_stiffness(vectors: &[f64], weighted: &[f64], n: usize) -> Result<Cholesky<f64, Dyn>, NodalError> {
    let k = vectors.len() / n;
    let product = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let energy = DMatrix::from_fn(k, k, |i, j| product(&vectors[i * n..][..n], &weighted[j * n..][..n]));
    let energy = 0.5 * (&energy + energy.transpose());
    energy.cholesky().ok_or(NodalError::MasslessUnheld)
}

impl Massless {
    /// Finds the null space of the mass matrix that `factor` belongs to.
    pub(super) fn new(model: &FeModel, factor: &SparseLdl) -> Result<Self, NodalError> {
        let (pencil, stiffness) = (model.pencil(), model.stiffness());
        let (n, block) = (pencil.n(), pencil.block());
        // Empty rows of M are solved with their own factor; the other null vectors start from null pivots.
        let mut massless = Self::of_empty_rows(model)?;
        let starts: Vec<usize> = factor
            .null_rows()
            .iter()
            .flat_map(|&vertex| (0..block).map(move |k| vertex * block + k))
            .filter(|&row| !is_empty(model, row))
            .collect();
        let k = starts.len();
        if n * k > DENSE {
            return Err(NodalError::NullSpaceTooLarge { null_vectors: k, rows: n });
        }
        let (mut vectors, mut weighted) = (vec![0.0; n * k], vec![0.0; n * k]);
        let (mut scratch, mut workspace) = (vec![0.0; n], massless.workspace());
        let diagonal = pencil.mass_diagonal();
        for ((&start, z), kz) in starts.iter().zip(vectors.chunks_mut(n)).zip(weighted.chunks_mut(n)) {
            // A null vector of M from one null pivot.
            z[start] = 1.0;
            factor.solve_in_place(block, z, &mut scratch);
            // Scale to unit size, so that the products below work in any units.
            let size = z.iter().fold(0.0f64, |m, z| m.max(z.abs()));
            z.iter_mut().for_each(|z| *z /= size);
            // M z must be zero; then z is moved to static equilibrium with the empty rows.
            multiply_vector(pencil.mass(), block, z, &mut scratch);
            refuse_mass(&scratch, z, &diagonal)?;
            massless.project(stiffness, z, &mut workspace);
            multiply_vector(stiffness, 1, z, kz);
        }
        if k > 0 {
            massless.factor = Some(null_stiffness(&vectors, &weighted, n)?);
        }
        (massless.vectors, massless.weighted) = (vectors, weighted);
        Ok(massless)
    }

    /// Finds the empty rows of M, on which K must be regular; null vectors are not yet included.
    fn of_empty_rows(model: &FeModel) -> Result<Self, NodalError> {
        let rows: Vec<usize> = (0..model.pencil().n()).filter(|&row| is_empty(model, row)).collect();
        let own = (!rows.is_empty()).then(|| SparseLdl::new(&model.stiffness().principal(&rows), 0.0));
        let own = match own {
            Some(None) => return Err(NodalError::MasslessUnheld),
            Some(Some(own)) if !own.null_rows().is_empty() => return Err(NodalError::MasslessUnheld),
            own => own.flatten(),
        };
        Ok(Self { rows, own, vectors: Vec::new(), weighted: Vec::new(), factor: None })
    }

    /// Returns true if M has an inverse.
    pub(super) fn is_empty(&self) -> bool {
        self.rows.is_empty() && self.vectors.is_empty()
    }

    /// Returns true if there are null vectors besides the empty rows, or an empty row turns a node with
    /// directors. Such motions may have mass when nodes are turned.
    pub(super) fn turns(&self, directors: &Directors<'_>) -> bool {
        self.n_vectors() > 0 || self.rows.iter().any(|&row| directors.has_rotation(row))
    }

    /// Returns the number of null vectors besides the empty rows.
    pub(super) fn n_vectors(&self) -> usize {
        self.factor.as_ref().map_or(0, |factor| factor.l_dirty().nrows())
    }

    pub(super) fn workspace(&self) -> Workspace {
        let zeros = || vec![0.0; self.rows.len()];
        Workspace { own: zeros(), scratch: zeros(), coefficients: DVector::zeros(self.n_vectors()) }
    }

    /// Computes x <- T x, T = I - Z (Z'K Z)^-1 Z'K, which moves massless motions to static equilibrium.
    pub(super) fn project(&self, stiffness: &SymmetricMatrix, x: &mut [f64], workspace: &mut Workspace) {
        if let Some(own) = &self.own {
            // Displacements of the empty rows that balance the elastic forces of the other rows.
            self.rows.iter().for_each(|&row| x[row] = 0.0);
            for (force, &row) in workspace.own.iter_mut().zip(&self.rows) {
                let (columns, values) = stiffness.row(row);
                *force = -columns.iter().zip(values).map(|(&j, k)| k * x[j as usize]).sum::<f64>();
            }
            own.solve_in_place(1, &mut workspace.own, &mut workspace.scratch);
            self.rows.iter().zip(&workspace.own).for_each(|(&row, value)| x[row] = *value);
        }
        let Some(factor) = &self.factor else { return };
        // Coefficients -(Z'K Z)^-1 Z'K x of the null vectors.
        for (c, kz) in workspace.coefficients.iter_mut().zip(self.weighted.chunks(x.len())) {
            *c = -kz.iter().zip(&*x).map(|(kz, x)| kz * x).sum::<f64>();
        }
        factor.solve_mut(&mut workspace.coefficients);
        self.add_vectors(x, workspace);
    }

    /// Computes x <- x + Z (Z'K Z)^-1 Z'b, which adds the static response of massless motions to the forces
    /// b.
    pub(super) fn add_static(&self, b: &[f64], x: &mut [f64], workspace: &mut Workspace) {
        if let Some(own) = &self.own {
            workspace.own.iter_mut().zip(&self.rows).for_each(|(force, &row)| *force = b[row]);
            own.solve_in_place(1, &mut workspace.own, &mut workspace.scratch);
            self.rows.iter().zip(&workspace.own).for_each(|(&row, value)| x[row] += value);
        }
        let Some(factor) = &self.factor else { return };
        for (c, z) in workspace.coefficients.iter_mut().zip(self.vectors.chunks(x.len())) {
            *c = z.iter().zip(b).map(|(z, b)| z * b).sum();
        }
        factor.solve_mut(&mut workspace.coefficients);
        self.add_vectors(x, workspace);
    }

    fn add_vectors(&self, x: &mut [f64], workspace: &Workspace) {
        for (c, z) in workspace.coefficients.iter().zip(self.vectors.chunks(x.len())) {
            x.iter_mut().zip(z).for_each(|(x, z)| *x += c * z);
        }
    }
}
