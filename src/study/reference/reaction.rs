//! What a prescribed motion takes, of the displacements of all nodes.

use super::residual::{Displacements, Inertia, NodalView};
use crate::motion::scene::Instant;
use crate::numerics::linalg::{combine, gram};
use faer::{Mat, MatRef};
use nalgebra::Vector3;

impl NodalView<'_> {
    /// Force and torque about the origin of the frame, axes of the model, that a motion of the frame as in
    /// `motion` takes of the nodes with the displacements `field`, at every instant: with the momenta
    /// p = R_t'w and h = (R_r + B(u))'w,
    ///
    /// ```text
    /// p' + omega x p - F,    h' + omega x h + V x p - tau
    /// ```
    ///
    /// (theory 6.17, without the elastic forces, which balance each other).
    pub fn reactions(&self, motion: &[Instant], field: &Displacements) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let Displacements { u, ud, .. } = field;
        let Inertia { momentum, change } = self.inertia(motion, field);
        let momenta = self.resultants(&momentum);
        let changes = self.resultants(&change);
        let loads = self.resultants(&self.loads_of(motion));
        let shifts = self.shifts(motion, u);
        let at = |i: usize| {
            let column = |x: &Mat<f64>| x.col_as_slice(i).to_vec();
            let (u, ud, w) = (column(u), column(ud), column(&momentum));
            let (velocity, omega) = (self.axes * motion[i].velocity, self.axes * motion[i].omega);
            let (p, h) = (momenta[i].0, momenta[i].1 + self.moment(&u, &w));
            let force = changes[i].0 + omega.cross(&p) - loads[i].0;
            let turning = changes[i].1 + self.moment(&u, &column(&change)) + self.moment(&ud, &w);
            (force, turning + omega.cross(&h) + velocity.cross(&p) - loads[i].1 - shifts[i])
        };
        (0..motion.len()).map(at).collect()
    }

    /// Force and torque about the origin of the frame of nodal `forces`, column by column.
    fn resultants(&self, forces: &Mat<f64>) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let all = gram(self.rigid.as_ref(), forces.as_ref());
        let of = |i: usize| match self.model.dimension() {
            2 => (Vector3::new(all[(0, i)], all[(1, i)], 0.0), Vector3::new(0.0, 0.0, all[(2, i)])),
            _ => (Vector3::from_fn(|k, _| all[(k, i)]), Vector3::from_fn(|k, _| all[(3 + k, i)])),
        };
        (0..forces.ncols()).map(of).collect()
    }

    /// Torque of the loads by what the displacements `u` shift them, at every instant.
    fn shifts(&self, motion: &[Instant], u: &Mat<f64>) -> Vec<Vector3<f64>> {
        let mut torques = vec![Vector3::zeros(); motion.len()];
        for (at, unit) in self.loads.iter().enumerate() {
            let moved = self.moved(unit.as_ref(), u.as_ref());
            for (i, torque) in torques.iter_mut().enumerate() {
                *torque += moved[i].cross(&(self.axes * motion[i].loads[at].0));
            }
        }
        torques
    }

    /// Displacement of the point with the unit loads `unit`, axes of the model, of every column.
    pub fn moved(&self, unit: MatRef<'_, f64>, displacements: MatRef<'_, f64>) -> Vec<Vector3<f64>> {
        let d = self.model.dimension();
        let moved = gram(unit.subcols(0, d), displacements);
        let of = |i: usize| Vector3::from_fn(|k, _| if k < d { moved[(k, i)] } else { 0.0 });
        (0..moved.ncols()).map(of).collect()
    }

    /// sum_i x_i x y_i over the displacements of the nodes.
    fn moment(&self, x: &[f64], y: &[f64]) -> Vector3<f64> {
        let (d, end) = (self.model.dimension(), self.model.rows().displacements());
        let vector = |a: &[f64]| Vector3::from_fn(|k, _| if k < d { a[k] } else { 0.0 });
        let pairs = x[..end].chunks_exact(d).zip(y[..end].chunks_exact(d));
        pairs.fold(Vector3::zeros(), |sum, (x, y)| sum + vector(x).cross(&vector(y)))
    }

    /// Displacements Psi q + X y of all rows at some instants, with their rates and accelerations: `columns`
    /// are X, `amplitudes` y, y' and y''.
    pub fn field(
        &self,
        motion: &[Instant],
        columns: MatRef<'_, f64>,
        amplitudes: [MatRef<'_, f64>; 3],
    ) -> Displacements {
        let own = |of: fn(&Instant) -> &Vec<f64>, y: MatRef<'_, f64>| {
            self.displacements(motion, of) + combine(columns, y.to_owned().as_ref())
        };
        let [y, yd, ydd] = amplitudes;
        Displacements { u: own(|now| &now.q, y), ud: own(|now| &now.qd, yd), udd: own(|now| &now.qdd, ydd) }
    }
}
