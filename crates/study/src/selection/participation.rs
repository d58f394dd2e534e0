//! Static response to each load that the selected modes represent (theory section 8).

use super::rows::PointRows;
use flexbody_body::flex_body::FlexBody;
use flexbody_motion::dynamics::BodyPoint;
use flexbody_motion::scene::{Point, Scene};
use nalgebra::Vector3;

/// Missing part of the static response to a load, relative, in the norm of K: sqrt(1 - sum_kept (f_p^2 / lambda_p) /
/// sum_all).
#[derive(Debug, Clone, PartialEq)]
pub struct Participation {
    /// Name of the load.
    pub load: String,
    /// Part that the selected modes miss of the response of all modes of the body.
    pub selected: f64,
    /// Parts that the modes of the body miss of the response of all nodes, with its residual vectors and without them;
    /// `None` if this was not recorded at the conversion.
    pub body: Option<(f64, f64)>,
}

/// Returns the missing parts for the loads of `scene` at `points` and for steady spin about its axis. Each force is
/// taken in its first direction or, if the direction changes, along every axis that it has. Loads that cause no
/// deformation are left out.
pub fn participations(
    body: &FlexBody,
    scene: &Scene,
    points: &[BodyPoint],
    selected: &[usize],
) -> Vec<Participation> {
    let rows = PointRows::new(body);
    let eigenvalues = &body.modes().eigenvalue;
    let mut all = Vec::new();
    let mut add = |load: String, forces: Vec<f64>, recorded: &dyn Fn(&str) -> bool| {
        // Elastic energy of the static response in each mode: f_p^2 / lambda_p.
        let part = |j: usize| forces[j] * forces[j] / eigenvalues[j];
        let whole: f64 = (0..eigenvalues.len()).map(part).sum();
        let kept: f64 = selected.iter().map(|&j| part(j)).sum();
        let records = body.modes().truncation.iter().filter(|record| recorded(&record.load));
        let worst =
            records.map(|record| (record.after, record.before)).reduce(|a, b| (a.0.max(b.0), a.1.max(b.1)));
        if whole > 0.0 && all.iter().all(|one: &Participation| one.load != load) {
            let selected = (1.0 - kept / whole).max(0.0).sqrt();
            all.push(Participation { load, selected, body: worst });
        }
    };
    for (load, point) in scene.loads.iter().zip(points) {
        let psi = rows.of(point);
        let at_interface = |name: &str| match &load.at {
            Point::Interface(interface) => {
                name.strip_prefix(interface.as_str()).is_some_and(|rest| rest.starts_with(' '))
            }
            Point::Node(_) => false,
        };
        for direction in load.force.directions() {
            let forces = (0..eigenvalues.len()).map(|j| psi.column(j).dot(&direction)).collect();
            let [x, y, z] = direction.into();
            add(format!("force {x}, {y}, {z} at {}", load.at), forces, &at_interface);
        }
    }
    // Steady spin: W1'w w / 2 along its axis.
    let axis = match scene.rotation() {
        Some(velocity) => velocity.main_direction(),
        None => scene.initial.angular_velocity.try_normalize(0.0),
    };
    if let (Some(axis), Some(w1)) = (axis, body.invariants().w1()) {
        let nf = eigenvalues.len();
        let force = |j: usize| {
            let row = |b: usize| axis.dot(&Vector3::from_fn(|a, _| w1[(a, b * nf + j)]));
            (0..3).map(|b| row(b) * axis[b]).sum::<f64>() / 2.0
        };
        let centrifugal = |name: &str| name.starts_with("centrifugal");
        add("centrifugal load of the spin".to_owned(), (0..nf).map(force).collect(), &centrifugal);
    }
    all
}
