//! Features of a scene, each of which can be detected and removed.

use crate::subject::Subject;
use flexbody_motion::scene::{Attachment, Drive, History, Load, Point, VectorHistory};
use nalgebra::Vector3;

/// Returns the names of the features of a subject, ascending.
pub fn features(subject: &Subject) -> Vec<&'static str> {
    let scene = &subject.scene;
    let initial = &scene.initial;
    let carried_spin = scene.carried.as_ref().and_then(|carried| carried.spin.as_ref());
    let spin_start = scene.spin.as_ref().and_then(|spin| spin.start);
    let carried_start = carried_spin.and_then(|spin| spin.start);
    let drive = scene.carried.as_ref().and_then(|carried| carried.translation.as_ref());
    let world = |axes| axes == flexbody_motion::scene::Axes::World;
    let all = || scene.acting().chain(scene.driving()).filter(|history| !history.is_nothing());
    let has = |test: &dyn Fn(&VectorHistory) -> bool| all().any(test);
    let loads = |test: &dyn Fn(&Load) -> bool| scene.loads.iter().any(test);
    let mut found = vec![
        ("force", loads(&|load| !load.force.is_nothing())),
        ("moment", loads(&|load| !load.torque.is_nothing())),
        ("load at interface", loads(&|load| matches!(load.at, Point::Interface(_)))),
        ("named load", loads(&|load| load.is_named())),
        ("load in world axes", loads(&|load| world(load.axes))),
        ("load in model axes", loads(&|load| !world(load.axes))),
        ("sine", has(&|history| factor(history).is_some_and(|h| matches!(h, History::Sine { .. })))),
        ("ramp", has(&|history| factor(history).is_some_and(|h| matches!(h, History::Ramp { .. })))),
        ("table", has(&|history| factor(history).is_some_and(|h| matches!(h, History::Table { .. })))),
        ("cubic", has(&|history| factor(history).is_some_and(|h| matches!(h, History::Samples(_))))),
        ("columns", has(&|history| factor(history).is_none())),
        ("gravity", scene.gravity.is_some()),
        ("velocity", initial.velocity != Vector3::zeros()),
        ("turned start", initial.rotation != Vector3::zeros()),
        ("angular velocity", initial.angular_velocity != Vector3::zeros()),
        ("modes at the start", !initial.modes.is_empty()),
        ("static start", initial.settled),
        ("spin", scene.spin.as_ref().is_some_and(|spin| !spin.hold)),
        ("held spin", scene.spin.as_ref().is_some_and(|spin| spin.hold)),
        ("carried", scene.carried.is_some()),
        (
            "carried by a node",
            scene.carried.as_ref().is_some_and(|carried| matches!(carried.by, Point::Node(_))),
        ),
        ("carried and turned", carried_spin.is_some()),
        ("turned about a point", carried_spin.is_some_and(|spin| spin.through.is_some())),
        ("displaced", matches!(drive, Some(Drive::Displacement(_)))),
        ("driven by velocity", matches!(drive, Some(Drive::Velocity(_)))),
        ("driven by acceleration", matches!(drive, Some(Drive::Acceleration(_)))),
        ("damping of the scene", scene.requirements.damping.is_some()),
        ("damping of the model", subject.raw.data.damping.is_some()),
        ("geometric stiffness", !subject.raw.data.geometric_stiffness.is_empty()),
        ("limit of a recovery", !scene.requirements.recoveries.is_empty()),
        ("reaction", scene.prescribes()),
        ("several cases", subject.cases > 1 || subject.second.is_some()),
        ("attachment", scene.requirements.attachment != Attachment::default()),
        ("faster rotation allowed", scene.requirements.motion.angular_velocity.is_some()),
        ("attitude over time", spin_start.or(carried_start).is_some()),
        ("rotations of nodes", subject.raw.dofs.iter().flatten().any(|label| label.direction > 3)),
        ("plane", subject.raw.dimension == 2),
        ("singular mass", has_singular_mass(subject)),
    ];
    found.retain(|(_, there)| *there);
    found.into_iter().map(|(name, _)| name).collect()
}

/// Returns true for bodies with a singular mass matrix.
pub fn has_singular_mass(subject: &Subject) -> bool {
    subject.kind.contains("singular") || subject.kind.contains("massless")
}

/// Returns the factor of a vector along one direction.
fn factor(history: &VectorHistory) -> Option<&History> {
    match history {
        VectorHistory::Along { factor, .. } => Some(factor),
        VectorHistory::Columns(_) => None,
    }
}
