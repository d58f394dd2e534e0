//! States and accelerations of bodies whose rotations carry mass.

use super::NodalEvaluation;
use super::conditions::{halves, sums};
use super::drive::Drive;
use super::inversion::Given;
use crate::integration::Failure;
use nalgebra::{Vector3, Vector6};

impl NodalEvaluation<'_> {
    /// Sets the velocities from the displacements and w of a state and the momenta (p, h) along free
    /// components; afterwards p, h and w are those of the resulting motion.
    pub(super) fn set_turned(&mut self, given: &Given, momenta: &Vector6<f64>) -> Result<(), Failure> {
        let body = self.equations;
        let Some(turned) = &mut self.turned else { return Ok(()) };
        turned.turn(&self.u, &self.conditions);
        self.vbar.copy_from_slice(&self.w);
        let resultant = body.onto_frame(&self.u, &self.w);
        let nu = given.solve(turned, momenta, &resultant, &mut self.vbar)?;
        self.move_frame(&nu);
        if let Some(turned) = &mut self.turned {
            (self.p, self.h) = halves(&turned.kinetics.go(&nu, &self.ud, &mut self.w));
        }
        self.drive = Some(Drive::of_turned(given.components));
        Ok(())
    }

    /// Computes V' and omega' in the axes of the frame, and u'' (N), with the `given` rates. Sets lambda,
    /// and the reaction of driving forces on the frame.
    ///
    /// With the forces g on the rows and the drifts d and e of w and (p, h) at constant velocities, M(u) v =
    /// g - d + C'(B'C')^-1 ((p', h') - e - B'(g - d)) for v = B (V', omega') + u''.
    pub(super) fn turned_accelerations(
        &mut self,
        given: &Given,
        udd: &mut [f64],
    ) -> Result<(Vector3<f64>, Vector3<f64>), Failure> {
        self.find_forces();
        let wanted = self.momentum_rates();
        let body = self.equations;
        let Some(turned) = &mut self.turned else { return Ok((Vector3::zeros(), Vector3::zeros())) };
        let drift = turned.kinetics.drifts(&self.ud, &mut self.first);
        turned.restrict(&mut self.first);
        for ((udd, force), drift) in udd.iter_mut().zip(&self.w_rate).zip(&self.first) {
            *udd = force - drift;
        }
        let resultant = body.onto_frame(&self.u, udd);
        let nu = given.solve(turned, &(wanted - drift), &resultant, udd)?;
        body.add_frame(-1.0, &nu, &self.u, udd);
        body.massless.project(body.stiffness(), udd, &mut self.workspace);

        let rates = turned.kinetics.momenta(&nu, udd, &mut self.second);
        turned.restrict(&mut self.second);
        for ((rest, drift), force) in self.second.iter_mut().zip(&self.first).zip(&self.w_rate) {
            *rest += drift - force;
        }
        // The remainder is C'lambda.
        self.multipliers = body.rigid_part.tr_mul(&sums(&body.rigid, &self.second));
        if let Some(drive) = &mut self.drive {
            let taken = rates + drift - wanted;
            drive.reaction = given.or_own(&Vector6::zeros(), &taken);
        }
        let (linear, angular) = halves(&nu);
        let to_frame = body.frame.axes.transpose();
        Ok((to_frame * linear, to_frame * angular))
    }

    /// Computes the forces for the accelerations nu = (V', omega') in model axes and u'', as
    /// [`NodalEvaluation::balance`] returns them.
    pub(super) fn turned_balance(
        &mut self,
        nu: &Vector6<f64>,
        udd: &[f64],
        forces: &mut [f64],
    ) -> (Vector3<f64>, Vector3<f64>) {
        let Some(turned) = &mut self.turned else { return (Vector3::zeros(), Vector3::zeros()) };
        let drift = turned.kinetics.drifts(&self.ud, forces);
        let rates = turned.kinetics.momenta(nu, udd, &mut self.first);
        forces.iter_mut().zip(&self.first).for_each(|(force, rate)| *force += rate);
        self.first.fill(0.0);
        turned.kinetics.add_slope(&self.ud, &mut self.first);
        forces.iter_mut().zip(&self.first).for_each(|(force, slope)| *force -= slope);
        let (linear, angular) = halves(&(rates + drift));
        let force = linear + self.omega.cross(&self.p);
        let torque = angular + self.omega.cross(&self.h) + self.velocity.cross(&self.p);
        self.take_inertia_forces(forces);
        let to_frame = self.equations.frame.axes.transpose();
        (to_frame * force, to_frame * torque)
    }
}
