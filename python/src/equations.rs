//! The equations of motion of one body.

use crate::arguments::{text, whole};
use crate::arrays::{matrix3, numbers, shaped, vector, vector3};
use crate::errors::{exception, value_error};
use crate::types::{Floats, Given};
use flexbody::dynamics::{self, BodyPoint, Evaluation};
use flexbody::{Code, Diagnostic, FlexBody};
use nalgebra::Vector3;
use pyo3::prelude::*;
use std::sync::Arc;

/// Equations of motion of one flexible body, for any integrator:
///
///     Mc(q) nu' + h(q, nu) + (0, 0, K_ff q + D q') = (F, tau, Q),    nu = (V, omega, q')
///
/// q (nf) are the modal coordinates, V the velocity of the origin of the body frame and omega its angular velocity,
/// both along body axes; nu has n = 6 + nf entries. A plane body has 3 + nf: V_x, V_y, omega_z, q'. F, tau (about the
/// origin) and Q are generalised forces with the power F'V + tau'omega + Q'q'. With the rotation A from body axes to
/// the world, the position R of the origin has the rate R' = A V, and Euler parameters p (cosine of half the angle
/// first) have the rate p' = p * (0, omega) / 2 as quaternions. Units are those of the body.
#[pyclass(frozen, module = "flexbody")]
pub struct EquationsOfMotion {
    body: Arc<FlexBody>,
    inner: Arc<dynamics::EquationsOfMotion>,
}

impl EquationsOfMotion {
    pub fn new(body: Arc<FlexBody>) -> Self {
        let inner = Arc::new(body.equations_of_motion());
        Self { body, inner }
    }

    fn at(&self, q: &Given<'_>, nu: Option<&Given<'_>>) -> PyResult<Evaluation<'_>> {
        evaluation(&self.inner, q, nu)
    }
}

/// Returns the equations at a state; at rest if no velocities are given.
fn evaluation<'e>(
    equations: &'e dynamics::EquationsOfMotion,
    q: &Given<'_>,
    nu: Option<&Given<'_>>,
) -> PyResult<Evaluation<'e>> {
    let q = numbers(Some(q), equations.n_modes(), "q")?;
    let nu = numbers(nu, equations.n_velocities(), "nu")?;
    let mut evaluation = Evaluation::new(equations);
    evaluation.set(&q, &nu);
    Ok(evaluation)
}

#[pymethods]
impl EquationsOfMotion {
    /// Number of modes nf.
    #[getter]
    fn n_modes(&self) -> usize {
        self.inner.n_modes()
    }

    /// Number of rigid motions: 6, or 3 for a plane body.
    #[getter]
    fn n_rigid(&self) -> usize {
        self.inner.n_rigid()
    }

    /// Number of velocities n in nu.
    #[getter]
    fn n_velocities(&self) -> usize {
        self.inner.n_velocities()
    }

    /// Returns the mass matrix Mc(q) (n x n).
    fn mass_matrix<'py>(&self, py: Python<'py>, q: Given<'py>) -> PyResult<Floats<'py>> {
        let n = self.inner.n_velocities();
        let mut matrix = vec![0.0; n * n];
        self.at(&q, None)?.mass_matrix(&mut matrix);
        shaped(py, matrix, [n, n])
    }

    /// Returns h(q, nu) (n): the inertia forces at zero acceleration.
    fn velocity_forces<'py>(&self, py: Python<'py>, q: Given<'py>, nu: Given<'py>) -> PyResult<Floats<'py>> {
        Ok(vector(py, self.at(&q, Some(&nu))?.velocity_forces()))
    }

    /// Returns Mc(q) nu' + h(q, nu) + (0, 0, K_ff q + D q') (n): the forces that must be applied for the accelerations
    /// nu', which are zero by default.
    #[pyo3(signature = (q, nu, acceleration=None))]
    fn forces<'py>(
        &self,
        py: Python<'py>,
        q: Given<'py>,
        nu: Given<'py>,
        acceleration: Option<Given<'py>>,
    ) -> PyResult<Floats<'py>> {
        let n = self.inner.n_velocities();
        let acceleration = numbers(acceleration.as_ref(), n, "acceleration")?;
        let mut forces = vec![0.0; n];
        self.at(&q, Some(&nu))?.balance(&acceleration, &mut forces);
        Ok(vector(py, &forces))
    }

    /// Returns nu' (n) from Mc(q) nu' = applied - h(q, nu) - (0, 0, K_ff q + D q'); without `applied` for the free
    /// body.
    ///
    /// Raises NumericalError, an ArithmeticError, if the mass matrix of the deformed body is not positive definite.
    #[pyo3(signature = (q, nu, applied=None))]
    fn accelerations<'py>(
        &self,
        py: Python<'py>,
        q: Given<'py>,
        nu: Given<'py>,
        applied: Option<Given<'py>>,
    ) -> PyResult<Floats<'py>> {
        let n = self.inner.n_velocities();
        let applied = numbers(applied.as_ref(), n, "applied")?;
        let mut acceleration = vec![0.0; n];
        let solved = self.at(&q, Some(&nu))?.accelerations(&applied, &mut acceleration);
        solved.map_err(|error| {
            exception(py, &Diagnostic::new(Code::SimulationStopped, error.to_string()).into())
        })?;
        Ok(vector(py, &acceleration))
    }

    /// Returns the derivatives of `forces` by q (n x nf) and by nu (n x n), at constant accelerations. The derivative
    /// by the accelerations is the mass matrix.
    #[pyo3(signature = (q, nu, acceleration=None))]
    fn jacobians<'py>(
        &self,
        py: Python<'py>,
        q: Given<'py>,
        nu: Given<'py>,
        acceleration: Option<Given<'py>>,
    ) -> PyResult<(Floats<'py>, Floats<'py>)> {
        let (n, nf) = (self.inner.n_velocities(), self.inner.n_modes());
        let acceleration = numbers(acceleration.as_ref(), n, "acceleration")?;
        let (mut by_q, mut by_nu) = (vec![0.0; n * nf], vec![0.0; n * n]);
        self.at(&q, Some(&nu))?.jacobian(&acceleration, &mut by_q, &mut by_nu);
        Ok((shaped(py, by_q, [n, nf])?, shaped(py, by_nu, [n, n])?))
    }

    /// Returns the generalised forces (n) of uniform gravity A'g (3), given along body axes. Unit of gravity:
    /// length/time^2.
    fn gravity<'py>(&self, py: Python<'py>, q: Given<'py>, g: Given<'py>) -> PyResult<Floats<'py>> {
        let mut forces = vec![0.0; self.inner.n_velocities()];
        self.at(&q, None)?.add_gravity(&vector3(&g, "g")?, &mut forces);
        Ok(vector(py, &forces))
    }

    /// Returns Mc(q) nu (n): linear momentum, angular momentum about the origin, both along body axes, and the momenta
    /// of the modes.
    fn momenta<'py>(&self, py: Python<'py>, q: Given<'py>, nu: Given<'py>) -> PyResult<Floats<'py>> {
        let n = self.inner.n_velocities();
        let rates = numbers(Some(&nu), n, "nu")?;
        let mut matrix = vec![0.0; n * n];
        self.at(&q, Some(&nu))?.mass_matrix(&mut matrix);
        let product = |row: &[f64]| row.iter().zip(&rates).map(|(m, rate)| m * rate).sum();
        Ok(vector(py, &matrix.chunks_exact(n).map(product).collect::<Vec<f64>>()))
    }

    /// Returns the kinetic energy T = nu' Mc(q) nu / 2. Unit: mass length^2/time^2.
    fn kinetic_energy(&self, q: Given<'_>, nu: Given<'_>) -> PyResult<f64> {
        Ok(self.at(&q, Some(&nu))?.kinetic_energy())
    }

    /// Returns the elastic energy U = q' K_ff q / 2. Unit: mass length^2/time^2.
    fn elastic_energy(&self, q: Given<'_>) -> PyResult<f64> {
        Ok(self.inner.elastic_energy(&numbers(Some(&q), self.inner.n_modes(), "q")?))
    }

    /// Returns I(q) = I0 + W1 Q + Q'W2 Q (3 x 3), about the origin, in body axes. Unit: mass length^2.
    fn inertia<'py>(&self, py: Python<'py>, q: Given<'py>) -> PyResult<Floats<'py>> {
        matrix3(py, &self.at(&q, None)?.inertia())
    }

    /// Returns the first moment c + C1 q (3) of the deformed body. Unit: mass length.
    fn first_moment<'py>(&self, py: Python<'py>, q: Given<'py>) -> PyResult<Floats<'py>> {
        Ok(vector(py, self.at(&q, None)?.first_moment().as_slice()))
    }

    /// Returns the node of this number (`Body.node_ids`; without `node_ids` its index from 0) as a point for forces and
    /// motion.
    #[pyo3(signature = (number: "int"))]
    fn node(&self, py: Python<'_>, number: &Bound<'_, PyAny>) -> PyResult<Point> {
        let number = whole(number, "number")?;
        let inner = self.body.node_point(number).map_err(|error| exception(py, &error))?;
        Ok(Point { equations: Arc::clone(&self.inner), inner, name: format!("node {number}") })
    }

    /// Returns the reference point of the interface of this name.
    #[pyo3(signature = (name: "str"))]
    fn interface(&self, py: Python<'_>, name: &Bound<'_, PyAny>) -> PyResult<Point> {
        let name = text(name, "name")?;
        let inner = self.body.interface_point(&name).map_err(|error| exception(py, &error))?;
        Ok(Point { equations: Arc::clone(&self.inner), inner, name: format!("interface {name}") })
    }

    fn __repr__(&self) -> String {
        format!("<flexbody.EquationsOfMotion of {:?}: {} modes>", self.body.name(), self.inner.n_modes())
    }
}

/// Point of a body: a node, or the reference point of an interface. All vectors are along body axes.
#[pyclass(frozen, module = "flexbody")]
pub struct Point {
    equations: Arc<dynamics::EquationsOfMotion>,
    inner: BodyPoint,
    name: String,
}

#[pymethods]
impl Point {
    /// True if the point has an orientation: it then has an angular velocity, and accepts torques.
    #[getter]
    fn turns(&self) -> bool {
        self.inner.turns()
    }

    /// Returns the position r(q) (3) in the deformed body. Unit: length.
    fn place<'py>(&self, py: Python<'py>, q: Given<'py>) -> PyResult<Floats<'py>> {
        Ok(vector(py, self.inner.place(&evaluation(&self.equations, &q, None)?).as_slice()))
    }

    /// Returns the velocity V + omega x r + dr/dt (3). Unit: length/time.
    fn velocity<'py>(&self, py: Python<'py>, q: Given<'py>, nu: Given<'py>) -> PyResult<Floats<'py>> {
        Ok(vector(py, self.inner.velocity(&evaluation(&self.equations, &q, Some(&nu))?).as_slice()))
    }

    /// Returns the acceleration J nu' + drift (3) relative to the world. Unit: length/time^2.
    fn acceleration<'py>(
        &self,
        py: Python<'py>,
        q: Given<'py>,
        nu: Given<'py>,
        acceleration: Given<'py>,
    ) -> PyResult<Floats<'py>> {
        let rates = numbers(Some(&acceleration), self.equations.n_velocities(), "acceleration")?;
        let evaluation = evaluation(&self.equations, &q, Some(&nu))?;
        Ok(vector(py, self.inner.acceleration(&evaluation, &rates).as_slice()))
    }

    /// Returns the angular velocity (3) of the axes of the point; None for a point without orientation. Unit: 1/time.
    fn angular_velocity<'py>(
        &self,
        py: Python<'py>,
        q: Given<'py>,
        nu: Given<'py>,
    ) -> PyResult<Option<Floats<'py>>> {
        let evaluation = evaluation(&self.equations, &q, Some(&nu))?;
        Ok(self.inner.angular_velocity(&evaluation).map(|omega| vector(py, omega.as_slice())))
    }

    /// Returns the Jacobian J(q) (3 x n), with velocity = J nu: a force f at the point is the generalised force J'f.
    fn jacobian<'py>(&self, py: Python<'py>, q: Given<'py>) -> PyResult<Floats<'py>> {
        let (n, evaluation) = (self.equations.n_velocities(), evaluation(&self.equations, &q, None)?);
        let mut rows = vec![0.0; 3 * n];
        for (axis, row) in rows.chunks_exact_mut(n).enumerate() {
            self.inner.add_force(&evaluation, &Vector3::ith(axis, 1.0), row);
        }
        shaped(py, rows, [3, n])
    }

    /// Returns the generalised forces (n) of a force and a torque at the point.
    ///
    /// Raises InputError, a ValueError, for a torque at a point without orientation.
    #[pyo3(signature = (q, force, torque=None))]
    fn generalised_force<'py>(
        &self,
        py: Python<'py>,
        q: Given<'py>,
        force: Given<'py>,
        torque: Option<Given<'py>>,
    ) -> PyResult<Floats<'py>> {
        let evaluation = evaluation(&self.equations, &q, None)?;
        let mut forces = vec![0.0; self.equations.n_velocities()];
        self.inner.add_force(&evaluation, &vector3(&force, "force")?, &mut forces);
        if let Some(torque) = torque {
            if !self.inner.turns() {
                let message = format!("{} has no orientation: no torque acts on it", self.name);
                return Err(value_error(py, message));
            }
            self.inner.add_torque(&evaluation, &vector3(&torque, "torque")?, &mut forces);
        }
        Ok(vector(py, &forces))
    }

    fn __repr__(&self) -> String {
        format!("<flexbody.Point: {}>", self.name)
    }
}
