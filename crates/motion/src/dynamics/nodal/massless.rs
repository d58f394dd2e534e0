//! Exact condensation of massless motions (theory 6.13).

use super::NodalError;
use super::directors::Directors;
use flexbody_linalg::{SparseLdl, SymmetricMatrix, multiply_vector};
use flexbody_model::FeModel;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

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
