//! A scene as forces and prescribed motion of one body.

use super::driving::Driving;
use super::{Axes, Load, Point, Scene, VectorHistory};
use crate::dynamics::{BodyPoint, Evaluation, Place, Prescribed, Surroundings, Terms};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::flex_body::FlexBody;
use nalgebra::{Matrix3, Vector3};

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
        let mut found = Vec::new();
        let mut wrong = |message: String| found.push(Diagnostic::new(Code::SceneBody, message));
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
        let mut points = |place: &Point| body_point(body, terms, place).map_err(&mut wrong).ok();
        let watched = scene.watched.iter().map(&mut points).collect();
        let loads: Option<Vec<_>> = scene.loads.iter().map(|load| Some((points(&load.at)?, load))).collect();
        for (point, load) in loads.iter().flatten() {
            if !load.torque.is_nothing() && !point.turns() {
                wrong(format!("a torque cannot act at {}: the place has no orientation", load.at));
            }
        }
        match (watched, loads) {
            (Some(watched), Some(loads)) if found.is_empty() => {
                let driving = Driving::new(body.frame(), scene);
                Ok((Self { gravity: scene.gravity, loads, driving }, watched))
            }
            _ => Err(Error::new(found)),
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

/// Returns a node or the reference point of an interface of `body`, with geometric stiffness if `terms`
/// contain it; or the reason why there is no such point.
pub fn body_point(body: &FlexBody, terms: Terms, place: &Point) -> std::result::Result<BodyPoint, String> {
    match place {
        Point::Node(number) => {
            let at = body.nodes().ids.iter().position(|id| id == number);
            at.map(|at| BodyPoint::node(body, at)).ok_or_else(|| format!("the body has no node {number}"))
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
    pub(super) fn gravity_size(&self) -> f64 {
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
