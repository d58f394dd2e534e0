//! Nodal equations with prescribed motion of the frame.

use super::NodalEvaluation;
use super::conditions::{add_motion, halves, joined, sums};
use super::drive::Drive;
use super::equations::NodalEquations;
use super::inversion::{Conditions, Given};
use crate::dynamics::{AlongFrame, Prescribed};
use crate::integration::Failure;
use nalgebra::{Vector3, Vector6};

impl NodalEquations<'_> {
    /// Returns the prescribed components of (V, omega), or of their rates: model axes, zero elsewhere.
    fn given(&self, prescribed: &Prescribed) -> Vector6<f64> {
        let or_zero = |v: Option<AlongFrame>| v.unwrap_or_default().0;
        self.in_model(&or_zero(prescribed.linear), &or_zero(prescribed.angular))
    }

    /// Removes the part C'mu from w that makes R'w vanish. With prescribed motion w is defined only up to
    /// C'mu.
    pub(super) fn take_conditions(&self, w: &mut [f64]) {
        let part = self.rigid_part.tr_mul(&sums(&self.rigid, w));
        add_motion(&self.conditions, -1.0, &part, w);
    }
}

impl NodalEvaluation<'_> {
    /// Sets a state without loads, with prescribed `velocities` of the frame, V and omega in its axes.
    ///
    /// w of the state is defined up to C'mu, and P is the momentum along the free components; L is not
    /// used. With E = C M^-1 C' and B'C' at the displacements u,
    ///
    /// ```text
    /// E mu - C B (V, omega) = -C M^-1 w
    /// (B'C' mu)_k = (p, h)_k - (B'w)_k    or    (V, omega)_k = what is given
    /// ```
    ///
    /// # Errors
    /// The error [`Failure::Rates`] of [`NodalEvaluation::set`].
    ///
    /// # Panics
    /// The panics of [`NodalEvaluation::set`].
    pub fn set_driven(&mut self, state: &[f64], velocities: &Prescribed) -> Result<(), Failure> {
        if *velocities == Prescribed::NOTHING {
            return self.set(state);
        }
        let body = self.equations;
        let momenta = self.go_to(state);
        let at_rest = body.conditions_at(&self.u);
        let given = mask(velocities);
        if self.turned.is_some() {
            self.conditions = Conditions::new(&at_rest);
            return self.set_turned(&Given { components: given, motion: body.given(velocities) }, &momenta);
        }
        let drive = Drive::new(&body.answer, &at_rest, given);

        // vbar = M^-1 w, before the conditions of the frame hold.
        self.vbar.copy_from_slice(&self.w);
        body.solve(&mut self.vbar, &mut self.first);
        // Right-hand side: missing momenta in the free components, given velocities in the others.
        let missing = momenta - body.onto_frame(&self.u, &self.w);
        let given_values = body.given(velocities);
        let frame = Vector6::from_fn(|k, _| if given[k] { given_values[k] } else { missing[k] });
        let conditions = -sums(&body.conditions, &self.vbar);
        // Multipliers mu and frame motion nu; add C'mu to w and its response to vbar.
        let (mu, nu) = drive.solve(&conditions, &frame)?;
        add_motion(&body.conditions, 1.0, &mu, &mut self.w);
        add_motion(&body.answered, 1.0, &mu, &mut self.vbar);
        (self.p, self.h) = halves(&body.onto_frame(&self.u, &self.w));
        self.move_frame(&nu);
        self.drive = Some(drive);
        Ok(())
    }

    /// Computes V' and omega' in the axes of the frame, and u'' (N), under the loads with prescribed
    /// `rates` of (V, omega): the rates of the components in the axes of the frame. Afterwards
    /// [`NodalEvaluation::driving_force`] returns the force of the prescribed motion.
    ///
    /// # Errors
    /// The error [`Failure::Rates`] of [`NodalEvaluation::set`].
    ///
    /// # Panics
    /// When the state was set with other prescribed components, or the length of `udd` is not N.
    pub fn driven_accelerations(
        &mut self,
        rates: &Prescribed,
        udd: &mut [f64],
    ) -> Result<(Vector3<f64>, Vector3<f64>), Failure> {
        assert_eq!(udd.len(), self.u.len(), "one entry per row");
        let drive = self.drive.take().filter(|drive| drive.given == mask(rates));
        let mut drive = drive.expect("a state that was set with what is given");
        let body = self.equations;
        if self.turned.is_some() {
            self.drive = Some(drive);
            let given = Given { components: mask(rates), motion: body.given(rates) };
            return self.turned_accelerations(&given, udd);
        }
        // u'' under the loads, before the conditions of the frame hold.
        let wanted = self.find_forces();
        udd.copy_from_slice(&self.w_rate);
        body.solve(udd, &mut self.first);
        body.add_turned(-1.0, &self.omega, &self.ud, udd);

        // Multipliers and frame accelerations from the missing momentum rates and the given accelerations.
        let missing = wanted - body.onto_frame(&self.u, &self.w_rate);
        let given_values = body.given(rates);
        let frame = Vector6::from_fn(|k, _| if drive.given[k] { given_values[k] } else { missing[k] });
        let conditions = -sums(&body.conditions, udd);
        let (lambda, nu) = drive.solve(&conditions, &frame)?;
        self.multipliers = lambda;
        add_motion(&body.conditions, 1.0, &lambda, &mut self.w_rate);
        add_motion(&body.answered, 1.0, &lambda, udd);
        // u'' without the motion of the frame, massless motions in static equilibrium.
        body.add_frame(-1.0, &nu, &self.u, udd);
        body.massless.project(body.stiffness(), udd, &mut self.workspace);
        // The force of the prescribed motion makes up the difference of the momentum rates.
        let taken = body.onto_frame(&self.u, &self.w_rate) - wanted;
        drive.reaction = Vector6::from_fn(|k, _| if drive.given[k] { taken[k] } else { 0.0 });
        self.drive = Some(drive);
        let (linear, angular) = halves(&nu);
        let to_frame = body.frame.axes.transpose();
        Ok((to_frame * linear, to_frame * angular))
    }

    /// Returns force and torque of the prescribed motion in the last
    /// [`NodalEvaluation::driven_accelerations`], in addition to the loads, about the origin of the frame
    /// and along its axes; zero along free components.
    pub fn driving_force(&self) -> (Vector3<f64>, Vector3<f64>) {
        let reaction = self.drive.as_ref().map_or_else(Vector6::zeros, |drive| drive.reaction);
        let (force, torque) = halves(&reaction);
        let to_frame = self.equations.frame.axes.transpose();
        (to_frame * force, to_frame * torque)
    }

    /// Returns (p', h') along the axes of the frame, without the contribution of driving forces.
    pub(super) fn momentum_rates(&self) -> Vector6<f64> {
        let torque = self.torque - self.omega.cross(&self.h) - self.velocity.cross(&self.p);
        joined(&(self.force - self.omega.cross(&self.p)), &torque)
    }

    /// Returns B'w' of a body without prescribed motion: (p', h') minus the contribution of u' to the rate
    /// of B'w.
    pub(super) fn wanted(&self) -> Vector6<f64> {
        let turned = self.equations.moment(&self.ud, &self.w);
        self.momentum_rates() - joined(&Vector3::zeros(), &turned)
    }
}

// Prescribed motion of the frame, and the twelve equations for its free part.

/// Returns true for each prescribed component of (V, omega).
fn mask(prescribed: &Prescribed) -> [bool; 6] {
    std::array::from_fn(|k| if k < 3 { prescribed.linear.is_some() } else { prescribed.angular.is_some() })
}
