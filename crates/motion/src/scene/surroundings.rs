//! A scene as forces and prescribed motion of one body.

use super::{Axes, Carried, Load, Point, Scene, Spin, VectorHistory};
use crate::dynamics::{
    AlongFrame, BodyPoint, Configuration, EquationsOfMotion, Evaluation, Motion, Place, Prescribed,
    Surroundings, Terms,
};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::flex_body::{FlexBody, Frame};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, Vector3};

/// Gravity, loads and prescribed motion of a scene.
pub(super) struct SceneForces<'a> {
    gravity: Option<Vector3<f64>>,
    loads: Vec<(BodyPoint, &'a Load)>,
    driving: Driving<'a>,
}

impl<'a> SceneForces<'a> {
    /// Resolves the names in `scene`; also returns the watched points.
    ///
    /// # Errors
    /// FB212 for nodes, interfaces and modes that the body does not have, for torques at points without an
    /// orientation, and for vectors that leave the plane of a plane body; one diagnostic per finding.
    pub(super) fn new(body: &FlexBody, scene: &'a Scene) -> Result<(Self, Vec<BodyPoint>)> {
        let mut diagnostics = Vec::new();
        let mut wrong = |message: String| diagnostics.push(Diagnostic::new(Code::SceneBody, message));
        for start in &scene.initial.modes {
            if start.mode >= body.n_modes() {
                wrong(format!(
                    "mode {} does not exist: the body has {} modes",
                    start.mode + 1,
                    body.n_modes()
                ));
            }
        }
        if body.dimension() == 2 {
            leaving_the_plane(scene).into_iter().for_each(|what| {
                wrong(format!(
                    "{what} leaves the plane of the body: vectors have z = 0, rotations x = y = 0"
                ));
            });
        }
        let terms = scene.run.terms;
        let mut point = |entry: &str, number: usize, place: &Point| {
            let diagnostics = body_point(body, terms, place);
            diagnostics.map_err(|why| wrong(format!("[[{entry}]] {number}: {why}"))).ok()
        };
        let watched =
            (1..).zip(&scene.watched).map(|(number, place)| point("watch", number, place)).collect();
        let loads: Option<Vec<_>> = (1..)
            .zip(&scene.loads)
            .map(|(number, load)| Some((point("load", number, &load.at)?, load)))
            .collect();
        for (point, load) in loads.iter().flatten() {
            if !load.torque.is_nothing() && !point.turns() {
                wrong(format!("a torque cannot act at {}: the place has no orientation", load.at));
            }
        }
        match (watched, loads) {
            (Some(watched), Some(loads)) if diagnostics.is_empty() => {
                let driving = Driving::new(body.frame(), scene);
                Ok((Self { gravity: scene.gravity, loads, driving }, watched))
            }
            _ => Err(Error::new(diagnostics)),
        }
    }
}

/// Returns the points of application of the loads of a scene on `body`, and the watched points.
///
/// # Errors
/// FB212 if the scene does not fit the body.
pub fn points_of(body: &FlexBody, scene: &Scene) -> Result<(Vec<BodyPoint>, Vec<BodyPoint>)> {
    let (forces, watched) = SceneForces::new(body, scene)?;
    Ok((forces.loads.into_iter().map(|(point, _)| point).collect(), watched))
}

/// Returns a node, the reference point of an interface or a named load of `body`, with geometric stiffness if `terms`
/// contain it; or the reason why there is no such point.
pub fn body_point(body: &FlexBody, terms: Terms, place: &Point) -> std::result::Result<BodyPoint, String> {
    match place {
        Point::Node(number) => {
            let at = body.nodes().ids.iter().position(|id| id == number);
            at.map(|at| BodyPoint::node(body, at)).ok_or_else(|| format!("the body has no node {number}"))
        }
        Point::NamedLoad(name) => {
            let load = body.named_loads().iter().find(|load| load.name == *name);
            load.map(|load| BodyPoint::named_load(body, load, terms)).ok_or_else(|| {
                let all: Vec<&str> = body.named_loads().iter().map(|load| load.name.as_str()).collect();
                let known = if all.is_empty() { "it has none".to_owned() } else { all.join(", ") };
                format!("the body has no named load `{name}`: {known}")
            })
        }
        Point::Interface(name) => {
            let interface = body.interfaces().iter().find(|interface| interface.name == *name);
            let interface = interface.ok_or_else(|| {
                let all: Vec<&str> = body.interfaces().iter().map(|i| i.name.as_str()).collect();
                let known = if all.is_empty() { "it has none".to_owned() } else { all.join(", ") };
                format!("the body has no interface `{name}`: {known}")
            })?;
            BodyPoint::interface(body, interface, terms).ok_or_else(|| {
                format!("interface `{name}` has no reference point: give one of its nodes instead")
            })
        }
    }
}

/// Returns the vectors of a scene that leave the plane of a plane body.
fn leaving_the_plane(scene: &Scene) -> Vec<String> {
    let in_plane = |v: &Vector3<f64>| v.z == 0.0;
    let about_normal = |v: &Vector3<f64>| v.x == 0.0 && v.y == 0.0;
    let moves_in_plane = |v: &VectorHistory| !v.has_component(2);
    let turns_about_normal = |v: &VectorHistory| !v.has_component(0) && !v.has_component(1);
    let initial = &scene.initial;
    let mut checks = vec![
        // If the initial rotation leaves the plane, the position says nothing: report the rotation only.
        (in_plane(&initial.origin) || !about_normal(&initial.rotation), "`origin`".to_owned()),
        (in_plane(&initial.velocity), "`velocity`".to_owned()),
        (about_normal(&initial.rotation), "`rotation`".to_owned()),
        (about_normal(&initial.angular_velocity), "`angular_velocity`".to_owned()),
        (scene.gravity.as_ref().is_none_or(in_plane), "`gravity`".to_owned()),
        (
            scene.spin.as_ref().is_none_or(|spin| turns_about_normal(&spin.velocity)),
            "`axis` of [spin]".to_owned(),
        ),
    ];
    let carried = scene.carried.as_ref();
    if let Some(spin) = carried.and_then(|carried| carried.spin.as_ref()) {
        checks.push((turns_about_normal(&spin.velocity), "`axis` of [carried.spin]".to_owned()));
        let through = spin.through.as_ref().is_none_or(in_plane);
        checks.push((through, "`through` of [carried.spin]".to_owned()));
    }
    if let Some(translation) = carried.and_then(|carried| carried.translation.as_ref()) {
        let stays = moves_in_plane(translation.history());
        checks.push((stays, "`direction` of [carried.translation]".to_owned()));
    }
    for load in &scene.loads {
        checks.push((moves_in_plane(&load.force), format!("`force` at {}", load.at)));
        checks.push((turns_about_normal(&load.torque), format!("`torque` at {}", load.at)));
    }
    checks.into_iter().filter(|(fits, _)| !fits).map(|(_, what)| what).collect()
}

impl SceneForces<'_> {
    /// Returns gravity along the axes of the body.
    pub(super) fn gravity(&self, place: &Place) -> Vector3<f64> {
        self.gravity.map_or_else(Vector3::zeros, |gravity| place.axes.tr_mul(&gravity))
    }

    /// Returns the magnitude of the acceleration of gravity.
    fn gravity_size(&self) -> f64 {
        self.gravity.map_or(0.0, |gravity| gravity.norm())
    }

    /// Returns force and torque of every load along the axes of the body, with its point of application.
    pub(super) fn acting(
        &self,
        time: f64,
        place: &Place,
    ) -> impl Iterator<Item = (&BodyPoint, Vector3<f64>, Vector3<f64>)> {
        let axes = place.axes;
        self.loads.iter().map(move |(point, load)| {
            let (force, torque) = load.at_time(time);
            match load.axes {
                Axes::World => (point, axes.tr_mul(&force), axes.tr_mul(&torque)),
                // The frame of the body is the frame of the scene.
                Axes::Model | Axes::Body => (point, force, torque),
            }
        })
    }
}

impl Surroundings for SceneForces<'_> {
    fn add_forces(&self, time: f64, place: &Place, evaluation: &Evaluation<'_>, forces: &mut [f64]) {
        if self.gravity.is_some() {
            evaluation.add_gravity(&self.gravity(place), forces);
        }
        for (point, force, torque) in self.acting(time, place) {
            point.add_force(evaluation, &force, forces);
            if torque != Vector3::zeros() {
                point.add_torque(evaluation, &torque, forces);
            }
        }
    }

    fn prescribed(&self, time: f64, axes: &Matrix3<f64>) -> (Prescribed, Prescribed) {
        self.driving.at(time, axes)
    }
}

// Motion of the frame prescribed by a scene.

/// Prescribed motion of the frame of a body in a scene.
#[derive(Debug, Clone, Copy)]
pub struct Driving<'a> {
    spin: Option<&'a Spin>,
    carried: Option<CarriedMotion<'a>>,
}

/// Prescribed motion of the frame of a carried body.
#[derive(Debug, Clone, Copy)]
struct CarriedMotion<'a> {
    carried: &'a Carried,
    /// Vector from the axis of rotation to the origin of the frame, axes of the frame.
    arm: Vector3<f64>,
}

impl<'a> CarriedMotion<'a> {
    fn new(frame: &Frame, scene: &'a Scene) -> Option<Self> {
        let carried = scene.carried.as_ref()?;
        let through = carried.spin.as_ref().and_then(|spin| spin.through);
        let arm = through.map_or_else(Vector3::zeros, |through| frame.origin - through);
        Some(Self { carried, arm })
    }

    /// Computes V = omega x arm + A'd', and V' = alpha x arm + A'd'' - omega x A'd', for the displacement d
    /// of the axis, along the axes A of the frame.
    fn at(&self, time: f64, axes: &Matrix3<f64>) -> (Prescribed, Prescribed) {
        let nothing = (Vector3::zeros(), Vector3::zeros());
        let (omega, alpha) = self.carried.spin.as_ref().map_or(nothing, |spin| spin.at(time, axes));
        let (velocity, acceleration) =
            self.carried.translation.as_ref().map_or(nothing, |drive| drive.at(time));
        let (velocity, acceleration) = (axes.tr_mul(&velocity), axes.tr_mul(&acceleration));
        let linear = omega.cross(&self.arm) + velocity;
        let rate = alpha.cross(&self.arm) + acceleration - omega.cross(&velocity);
        let both = |linear, angular| Prescribed {
            linear: Some(AlongFrame(linear)),
            angular: Some(AlongFrame(angular)),
        };
        (both(linear, omega), both(rate, alpha))
    }
}

impl<'a> Driving<'a> {
    /// Collects the prescribed motion of `frame` in `scene`; `frame` belongs to a body in its
    /// [`FramedScene`](super::FramedScene).
    pub fn new(frame: &Frame, scene: &'a Scene) -> Self {
        Self { spin: scene.spin.as_ref(), carried: CarriedMotion::new(frame, scene) }
    }

    /// Returns the velocities at a time and their rates, along the axes of the frame, whose `axes` in the
    /// world are given.
    pub fn at(&self, time: f64, axes: &Matrix3<f64>) -> (Prescribed, Prescribed) {
        if let Some(carried) = &self.carried {
            return carried.at(time, axes);
        }
        let Some(spin) = self.spin else { return (Prescribed::NOTHING, Prescribed::NOTHING) };
        let (omega, alpha) = spin.at(time, axes);
        let linear = spin.hold.then(AlongFrame::default);
        let about = |angular| Prescribed { linear, angular: Some(AlongFrame(angular)) };
        (about(omega), about(alpha))
    }
}

// Static equilibrium of the deformation with the loads and the motion at time zero.

/// Value, or the reason why there is no equilibrium.
type Outcome<T> = std::result::Result<T, String>;

/// Deformation and its residual.
type Trial = (DVector<f64>, DVector<f64>);

/// Limit of Newton steps. Each step squares the error, so that more steps mean divergence.
const MAX_STEPS: usize = 40;

/// Limit of halvings of a Newton step that does not reduce the residual.
const MAX_HALVINGS: usize = 30;

/// Residual of the equilibrium relative to its largest summand, in the norm of K_ff^-1, at which Newton's
/// method ends.
const RESIDUAL: f64 = 1e-12;

/// Residual below which an equilibrium is accepted if Newton's method cannot improve it further, the rest
/// being rounding.
const ROUNDING: f64 = 1e-10;

/// Step of the finite differences in modal coordinates, relative to the size of the deformation in the norm
/// of K_ff.
const DIFFERENCE: f64 = 1e-4;

/// Sets the deformation q of `start` to equilibrium, q'' = 0 with q' = 0, by Newton's method on r(q) = m_ff
/// q''.
///
/// The frame moves as given by the scene and the loads. Except for torques, r is a polynomial of low degree
/// in q; its derivatives are central differences.
///
/// # Errors
/// FB540 if there is no equilibrium near the undeformed body, or if the equilibrium is unstable.
pub(super) fn settle(
    body: &FlexBody,
    scene: &Scene,
    equations: &EquationsOfMotion,
    forces: &SceneForces<'_>,
    start: &mut Configuration,
) -> Result<()> {
    let none = |why: &str| {
        let message = format!("`{}` has no static deformation at time zero: {why}", scene.name);
        Error::from(
            Diagnostic::new(Code::SimulationStopped, message)
                .with_help("remove `deformation` from [initial]"),
        )
    };
    let mut balance = Balance::new(body, equations, forces, start.clone())
        .ok_or_else(|| none("the stiffness of the modes is not positive definite"))?;
    balance.solve().map_err(|reason| none(&reason))?;
    start.q.copy_from_slice(balance.start.q.as_slice());
    Ok(())
}

/// Modal forces r(q) of a body that does not vibrate.
struct Balance<'a> {
    equations: &'a EquationsOfMotion,
    forces: &'a SceneForces<'a>,
    start: Configuration,
    mass: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
    /// Upper bound, in the norm of K_ff^-1, of inertia and gravity forces on the whole mass; forces that
    /// are small compared with it are rounding.
    of_mass: f64,
}

impl<'a> Balance<'a> {
    fn new(
        body: &FlexBody,
        equations: &'a EquationsOfMotion,
        forces: &'a SceneForces<'a>,
        start: Configuration,
    ) -> Option<Self> {
        let (invariants, n) = (body.invariants(), body.n_modes());
        let stiffness = invariants.symmetric_stiffness();
        let factor = stiffness.clone().cholesky()?;
        let m = invariants.modal_mass();
        let mut balance = Self {
            equations,
            forces,
            start,
            mass: DMatrix::from_fn(n, n, |i, j| m[(i, j)]),
            stiffness,
            factor,
            of_mass: 0.0,
        };
        balance.of_mass = balance.largest_load(body);
        Some(balance)
    }

    /// Returns sqrt(m) (|a| + r |omega|^2 + r |alpha|) / Omega_1 at the start, with the acceleration a of
    /// the origin and gravity, and the radius of gyration r.
    fn largest_load(&self, body: &FlexBody) -> f64 {
        let (mut motion, state) = Motion::new(self.equations, self.forces, &self.start);
        let Ok(rates) = motion.accelerations(0.0, &state) else { return 0.0 };
        let (linear, angular, _) = self.equations.split(rates);
        let mass = body.invariants().mass();
        let radius = (body.invariants().inertia().trace() / mass).sqrt();
        let acceleration = linear.norm() + self.forces.gravity_size();
        let turning = self.start.omega.norm_squared() + angular.norm();
        let lowest = body.modes().eigenvalue.first().copied().unwrap_or(1.0);
        mass.sqrt() * (acceleration + radius * turning) / lowest.sqrt()
    }

    /// Returns r(q) = m_ff q''.
    fn residual(&mut self, q: &DVector<f64>) -> Outcome<DVector<f64>> {
        self.start.q.copy_from_slice(q.as_slice());
        let (mut motion, state) = Motion::new(self.equations, self.forces, &self.start);
        let rates = motion.accelerations(0.0, &state).map_err(|failure| failure.to_string())?;
        Ok(&self.mass * DVector::from_column_slice(self.equations.split(rates).2))
    }

    /// Returns |f| in the norm of K_ff^-1.
    fn norm(&self, force: &DVector<f64>) -> f64 {
        force.dot(&self.factor.solve(force)).max(0.0).sqrt()
    }

    /// Returns the largest summand of the equilibrium at q with the residual r: elastic forces, all other
    /// forces, and the bound of forces on the whole mass.
    fn scale(&self, q: &DVector<f64>, residual: &DVector<f64>) -> f64 {
        let elastic = &self.stiffness * q;
        self.norm(&elastic).max(self.norm(&(residual + elastic))).max(self.of_mass)
    }

    /// Returns dr/dq by central differences.
    fn derivative(&mut self, q: &DVector<f64>, size: f64) -> Outcome<DMatrix<f64>> {
        let n = q.len();
        let mut derivative = DMatrix::zeros(n, n);
        for j in 0..n {
            let step = DIFFERENCE * size / self.stiffness[(j, j)].sqrt();
            let moved = |step: f64| {
                let mut moved = q.clone();
                moved[j] += step;
                moved
            };
            let change = self.residual(&moved(step))? - self.residual(&moved(-step))?;
            derivative.set_column(j, &(change / (2.0 * step)));
        }
        Ok(derivative)
    }

    fn solve(&mut self) -> Outcome<()> {
        let mut q = DVector::from_column_slice(&self.start.q);
        let mut residual = self.residual(&q)?;
        for _ in 0..MAX_STEPS {
            let (left, scale) = (self.norm(&residual), self.scale(&q, &residual));
            if left <= RESIDUAL * scale {
                return self.accept(&q, scale);
            }
            let derivative = self.derivative(&q, scale)?;
            let Some(step) = derivative.lu().solve(&-&residual) else {
                return Err("the spin makes the stiffness of some motion zero or negative".to_owned());
            };
            match self.shortened(&q, &step, left)? {
                Some((moved, rest)) => (q, residual) = (moved, rest),
                None if left <= ROUNDING * scale => return self.accept(&q, scale),
                None => break,
            }
        }
        Err("the iteration diverges under the forces on the deformed body".to_owned())
    }

    /// Returns the first of q + step, q + step / 2, ... with a residual smaller than `left`.
    fn shortened(&mut self, q: &DVector<f64>, step: &DVector<f64>, left: f64) -> Outcome<Option<Trial>> {
        for halvings in 0..MAX_HALVINGS {
            let moved = q + step * 0.5f64.powi(halvings as i32);
            // A state without accelerations is too far away.
            let Ok(rest) = self.residual(&moved) else { continue };
            if self.norm(&rest) < left {
                return Ok(Some((moved, rest)));
            }
        }
        Ok(None)
    }

    /// Accepts the equilibrium q if it is stable: all motions q'' = m_ff^-1 (dr/dq) q oscillate.
    fn accept(&mut self, q: &DVector<f64>, scale: f64) -> Outcome<()> {
        let size = if scale > 0.0 { scale } else { 1.0 };
        let derivative = self.derivative(q, size)?;
        self.start.q.copy_from_slice(q.as_slice());
        let lower = self.factor.l();
        let half = lower.solve_lower_triangular(&-derivative).expect("a factor");
        let relative = lower.solve_lower_triangular(&half.transpose()).expect("a factor");
        // Relative to K_ff, whose eigenvalues become 1.
        let relative = Mat::from_fn(relative.nrows(), relative.ncols(), |i, j| relative[(i, j)]);
        let eigenvalues = relative.eigenvalues();
        let stable = eigenvalues.is_ok_and(|values| values.iter().all(|value| value.re > 0.0));
        if stable {
            Ok(())
        } else {
            Err("the spin makes the stiffness of some motion zero or negative".to_owned())
        }
    }
}
