//! Rows that the inertia of a model acts on, for any mass matrix.

use crate::directors::director_mass::{NodeMoments, RigidAcceleration};
use crate::rows::centre_and_length;
use crate::{DirectorMass, FeModel};
use faer::{Mat, MatRef};
use flexbody_linalg::{contiguous_mut, gram, parallel};
use nalgebra::{Matrix3, Vector3};
use std::borrow::Cow;

/// Rows that the inertia of a model acts on: those of the model or, if nodal rotations carry mass, points
/// and directors (theory section 6). Inertia forces of a moving body are computed on these rows and mapped
/// back by [`InertialRows::restrict`].
///
/// With directors, the velocity of the origin is omitted, V = 0, and the acceleration a = V' + omega x V -
/// g replaces V'. For a mass of points and directors both are equal, and the part of the mass that does not
/// turn with the nodes must not depend on a constant velocity. The rigid motions are then about the centre
/// of mass.
#[derive(Debug, Clone)]
pub struct InertialRows<'m> {
    model: &'m FeModel,
    directors: Option<Directors<'m>>,
    /// Reference point of the rigid motions, axes of the model.
    centre: Vector3<f64>,
}

#[derive(Debug, Clone)]
struct Directors<'m> {
    mass: &'m DirectorMass,
    /// Moments of every node of `mass`, about the centre and along the axes of the model.
    moments: Vec<NodeMoments>,
}

impl<'m> InertialRows<'m> {
    /// Creates the rows of `model`; rigid motions are about `origin` (axes of the model) or, with
    /// directors, about the centre of mass.
    pub fn new(model: &'m FeModel, origin: Vector3<f64>) -> Self {
        let Some(mass) = model.director_mass() else {
            return Self { model, directors: None, centre: origin };
        };
        let centre = model.centre_of_mass();
        let fields = mass.extend_rigid(model.rigid_fields(centre.into(), 1.0).as_ref());
        let moments = mass.moments(fields.as_ref(), &Matrix3::identity());
        Self { model, directors: Some(Directors { mass, moments }), centre }
    }

    /// Returns true if rotations of nodes carry mass, so that V is omitted.
    pub fn have_directors(&self) -> bool {
        self.directors.is_some()
    }

    /// Returns the reference point of the rigid motions, axes of the model.
    pub fn centre(&self) -> Vector3<f64> {
        self.centre
    }

    /// Returns columns of the model (N rows) on these rows.
    pub fn extend<'x>(&self, x: &'x Mat<f64>) -> Cow<'x, Mat<f64>> {
        match &self.directors {
            Some(directors) => Cow::Owned(directors.mass.extend(x.as_ref())),
            None => Cow::Borrowed(x),
        }
    }

    /// Returns displacements, velocities and accelerations of the model on these rows, to second order if
    /// directors turn ([`DirectorMass::extend_turned`]).
    pub fn extend_turned(&self, motion: [&Mat<f64>; 3]) -> [Mat<f64>; 3] {
        match &self.directors {
            Some(directors) => directors.mass.extend_turned(motion.map(Mat::as_ref)),
            None => motion.map(Mat::clone),
        }
    }

    /// Returns unit translations along the axes of the model and unit rotations about the centre.
    pub fn rigid(&self) -> Mat<f64> {
        let fields = self.model.rigid_fields(self.centre.into(), 1.0);
        match &self.directors {
            Some(directors) => directors.mass.extend_rigid(fields.as_ref()),
            None => fields,
        }
    }

    /// Returns the product of the mass with columns of these rows.
    pub fn weigh(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        match &self.directors {
            Some(directors) => {
                let mut product = Mat::zeros(x.nrows(), x.ncols());
                directors.mass.multiply(x, product.as_mut());
                product
            }
            None => self.model.pencil().apply_mass(x),
        }
    }

    /// Returns forces on the rows of the model with the power of `forces` on these rows.
    pub fn restrict(&self, forces: Mat<f64>) -> Mat<f64> {
        match &self.directors {
            Some(directors) => directors.mass.restrict(forces.as_ref()),
            None => forces,
        }
    }

    /// Returns the moments (N rows of the model) that every column of `forces` on these rows gains by the rotations of the
    /// nodes, in column j of `turn(j)` ([`DirectorMass::add_turned_moments`]).
    pub fn turned_moments<'u>(
        &self,
        forces: &Mat<f64>,
        turn: impl Fn(usize) -> &'u [f64] + Sync,
    ) -> Mat<f64> {
        let mut moments = Mat::zeros(self.model.rows().len(), forces.ncols());
        if let Some(Directors { mass, .. }) = &self.directors {
            parallel::for_each(moments.col_iter_mut().enumerate(), |(j, moments)| {
                mass.add_turned_moments(forces.col_as_slice(j), turn(j), contiguous_mut(moments));
            });
        }
        moments
    }

    /// Returns, on these rows, the displacements of second order of directors that turn by `x` and by `y[j]`, for every j
    /// (theory 6.2a).
    pub fn second_order_motions(&self, x: &[f64], y: &[&[f64]]) -> Mat<f64> {
        let Some(Directors { mass, .. }) = &self.directors else { return Mat::zeros(x.len(), y.len()) };
        let mut motions = Mat::zeros(mass.rows(), y.len());
        parallel::for_each(motions.col_iter_mut().zip(y), |(motion, y)| {
            mass.add_second_order_motion(x, y, 1.0, contiguous_mut(motion));
        });
        motions
    }

    /// Returns the number of rows of vectors that turn with the body and come first.
    fn turning_rows(&self) -> usize {
        match &self.directors {
            Some(directors) => directors.mass.turning_rows(),
            None => self.model.rows().displacements(),
        }
    }

    /// Computes y += omega x x for every vector that turns with the body; column j with the j-th omega,
    /// axes of the model.
    pub fn add_turned(&self, omega: impl Fn(usize) -> Vector3<f64> + Sync, x: &Mat<f64>, y: &mut Mat<f64>) {
        parallel::for_each(y.col_iter_mut().enumerate(), |(j, y)| {
            self.add_turned_vector(&omega(j), x.col_as_slice(j), contiguous_mut(y));
        });
    }

    /// Returns S_a x: the turned vectors of every column, zero in all other rows.
    pub fn turned(&self, omega: &Vector3<f64>, x: &Mat<f64>) -> Mat<f64> {
        let mut turned = Mat::zeros(x.nrows(), x.ncols());
        self.add_turned(|_| *omega, x, &mut turned);
        turned
    }

    fn add_turned_vector(&self, omega: &Vector3<f64>, x: &[f64], y: &mut [f64]) {
        let end = self.turning_rows();
        add_turned(self.model.dimension(), &x[..end], omega, &mut y[..end]);
    }

    /// Returns sum_i x_i x y_i over the vectors that turn with the body.
    pub fn moment(&self, x: &[f64], y: &[f64]) -> Vector3<f64> {
        let (d, end) = (self.model.dimension(), self.turning_rows());
        let vector = |a: &[f64]| Vector3::from_fn(|k, _| if k < d { a[k] } else { 0.0 });
        let pairs = x[..end].chunks_exact(d).zip(y[..end].chunks_exact(d));
        pairs.fold(Vector3::zeros(), |sum, (x, y)| sum + vector(x).cross(&vector(y)))
    }

    /// Adds the moments H theta of the inertia of a rigid motion for the rotations theta in `u` (N rows of
    /// the model), of second order in T: the stiffness of inertia at the nodes.
    ///
    /// * `motion`: acceleration a of the centre minus gravity, angular acceleration and angular velocity,
    ///   axes of the model.
    pub fn add_second_order(&self, motion: &RigidAcceleration, u: &[f64], forces: &mut [f64]) {
        let Some(Directors { mass, moments }) = &self.directors else { return };
        mass.add_second_order(|place| moments[place].of(motion), u, forces);
    }
}

/// Computes y += omega x x for vectors of d components.
fn add_turned(d: usize, x: &[f64], omega: &Vector3<f64>, y: &mut [f64]) {
    let w = omega;
    if d == 2 {
        for (x, y) in x.as_chunks::<2>().0.iter().zip(y.as_chunks_mut::<2>().0) {
            y[0] -= w.z * x[1];
            y[1] += w.z * x[0];
        }
        return;
    }
    for (x, y) in x.as_chunks::<3>().0.iter().zip(y.as_chunks_mut::<3>().0) {
        y[0] += w.y * x[2] - w.z * x[1];
        y[1] += w.z * x[0] - w.x * x[2];
        y[2] += w.x * x[1] - w.y * x[0];
    }
}

impl FeModel {
    /// Returns the centre of mass, axes of the model, from R'MR = \[m I, -c~; c~, I0\] of rigid motions
    /// about the middle.
    pub fn centre_of_mass(&self) -> Vector3<f64> {
        let (middle, _) = centre_and_length(&self.nodes().positions);
        let rigid = self.rigid_fields(middle, 1.0);
        let g = gram(rigid.as_ref(), self.pencil().apply_mass(rigid.as_ref()).as_ref());
        let offset = match self.dimension() {
            2 => Vector3::new(g[(1, 2)], -g[(0, 2)], 0.0),
            _ => Vector3::from_fn(|k, _| {
                let (l, m) = ((k + 1) % 3, (k + 2) % 3);
                0.5 * (g[(l, 3 + m)] - g[(m, 3 + l)])
            }),
        };
        Vector3::from_fn(|k, _| middle[k] + offset[k] / g[(0, 0)])
    }
}
