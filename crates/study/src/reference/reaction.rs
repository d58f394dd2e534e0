//! Reaction of a prescribed motion, from the displacements of all nodes.

use super::residual::{Displacements, Inertia, NodalView};
use faer::{Mat, MatRef};
use flexbody_linalg::{combine, gram};
use flexbody_motion::scene::Instant;
use nalgebra::Vector3;

impl NodalView<'_> {
    /// Returns the reaction at every instant: force and torque about the origin of the frame, axes of the model, that
    /// the motion of the frame in `motion` requires with the nodal displacements `field`. With the momenta p = R_t'w
    /// and h = (R_r + B(u))'w,
    ///
    /// ```text
    /// p' + omega x p - F,    h' + omega x h + V x p - tau
    /// ```
    ///
    /// (theory 6.17, without the elastic forces, which balance each other). Directors turn to second order: their
    /// rotations also move their mass against each other, theta' x (theta' x e_a) and so on.
    pub(super) fn reactions(
        &self,
        motion: &[Instant],
        field: &Displacements,
    ) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let Inertia { u, ud, momentum, change } = self.inertia_of_turned(motion, field);
        // Resultants of momentum, its change and the loads.
        let momenta = self.resultants(self.extended_rigid.as_ref(), &momentum);
        let changes = self.resultants(self.extended_rigid.as_ref(), &change);
        let loads = self.resultants(self.rigid.as_ref(), &self.loads_of(motion));
        let shifts = self.shifts(motion, &field.u);
        let at = |i: usize| {
            let [u, ud, w, change] = [&u, &ud, &momentum, &change].map(|x| x.col_as_slice(i));
            let (velocity, _) = self.rigid_velocity(&motion[i]);
            let (velocity, omega) = (self.axes * velocity, self.axes * motion[i].omega);
            let (p, h) = (momenta[i].0, momenta[i].1 + self.rows.moment(u, w));
            let force = changes[i].0 + omega.cross(&p);
            let turning = changes[i].1 + self.rows.moment(u, change) + self.rows.moment(ud, w);
            let about_centre = turning + omega.cross(&h) + velocity.cross(&p);
            // Rigid motions about the centre of mass give torques about that centre: transfer the force to the origin.
            let torque = about_centre + self.centre.cross(&force);
            (force - loads[i].0, torque - loads[i].1 - shifts[i])
        };
        (0..motion.len()).map(at).collect()
    }

    /// Returns force and torque, about the reference point of the `rigid` motions, of each column of `forces`.
    fn resultants(&self, rigid: MatRef<'_, f64>, forces: &Mat<f64>) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let all = gram(rigid, forces.as_ref());
        let of = |i: usize| match self.model.dimension() {
            2 => (Vector3::new(all[(0, i)], all[(1, i)], 0.0), Vector3::new(0.0, 0.0, all[(2, i)])),
            _ => (Vector3::from_fn(|k, _| all[(k, i)]), Vector3::from_fn(|k, _| all[(3 + k, i)])),
        };
        (0..forces.ncols()).map(of).collect()
    }

    /// Returns the torque that the loads gain by the displacements `u` of their points, at every instant.
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

    /// Returns the displacement of the point with the unit loads `unit`, axes of the model, for every column.
    pub(super) fn moved(&self, unit: MatRef<'_, f64>, displacements: MatRef<'_, f64>) -> Vec<Vector3<f64>> {
        let d = self.model.dimension();
        let moved = gram(unit.subcols(0, d), displacements);
        let of = |i: usize| Vector3::from_fn(|k, _| if k < d { moved[(k, i)] } else { 0.0 });
        (0..moved.ncols()).map(of).collect()
    }

    /// Returns the displacements Psi q + X y of all rows at the given instants, with rates and accelerations. `columns`
    /// is X, `amplitudes` are y, y' and y''.
    pub(super) fn field(
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
