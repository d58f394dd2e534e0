//! Search for the smallest scene that still shows a violation.

use crate::subject::{Basis, Subject};
use flexbody_motion::scene::{Attachment, Axes, History, MotionRange, Scene, VectorHistory};
use nalgebra::Vector3;

/// Drops features as long as `fails` returns true; returns the last subject that fails.
pub fn smallest(subject: &Subject, fails: impl Fn(&Subject) -> bool) -> Subject {
    let mut smallest = subject.clone();
    loop {
        let simpler = simplifications(&smallest).into_iter().find(|simpler| fails(simpler));
        match simpler {
            Some(simpler) => smallest = simpler,
            None => return smallest,
        }
    }
}

/// Returns the subject with one feature less, for each feature.
fn simplifications(subject: &Subject) -> Vec<Subject> {
    let mut all = Vec::new();
    let mut model = |change: &dyn Fn(&mut Subject)| {
        let mut simpler = subject.clone();
        change(&mut simpler);
        all.push(simpler);
    };
    if subject.raw.data.damping.is_some() {
        model(&|simpler| simpler.raw.data.damping = None);
    }
    if subject.second.is_some() {
        model(&|simpler| simpler.second = None);
    }
    if !subject.raw.data.geometric_stiffness.is_empty() {
        model(&|simpler| simpler.raw.data.geometric_stiffness.clear());
    }
    if let Basis::Lowest(count @ 2..) = subject.basis {
        model(&|simpler| simpler.basis = Basis::Lowest(count / 2));
    }
    let scenes = simpler_scenes(&subject.scene).into_iter();
    all.extend(scenes.map(|scene| Subject { scene, ..subject.clone() }));
    all
}

/// Returns scenes with one feature less.
fn simpler_scenes(scene: &Scene) -> Vec<Scene> {
    let mut all: Vec<Scene> = Vec::new();
    let mut with = |change: &dyn Fn(&mut Scene)| {
        let mut simpler = scene.clone();
        change(&mut simpler);
        if simpler != *scene {
            all.push(simpler);
        }
    };
    for i in 0..scene.loads.len() {
        with(&|simpler| drop(simpler.loads.remove(i)));
        with(&|simpler| simpler.loads[i].torque = VectorHistory::nothing());
        if !scene.loads[i].is_named() {
            with(&|simpler| simpler.loads[i].axes = Axes::World);
        }
    }
    with(&|simpler| simpler.gravity = None);
    with(&|simpler| simpler.requirements.damping = None);
    with(&|simpler| simpler.requirements.recoveries.clear());
    with(&|simpler| simpler.requirements.motion = MotionRange::default());
    with(&|simpler| simpler.requirements.attachment = Attachment::default());
    with(&|simpler| simpler.initial.settled = false);
    with(&|simpler| simpler.initial.origin = Vector3::zeros());
    with(&|simpler| simpler.initial.velocity = Vector3::zeros());
    with(&|simpler| simpler.initial.angular_velocity = Vector3::zeros());
    with(&|simpler| simpler.initial.rotation = Vector3::zeros());
    with(&|simpler| simpler.spin = None);
    with(&|simpler| simpler.carried = None);
    with(&|simpler| simpler.carried.iter_mut().for_each(|carried| carried.spin = None));
    with(&|simpler| simpler.carried.iter_mut().for_each(|carried| carried.translation = None));
    let through = |simpler: &mut Scene| {
        let spins = simpler.carried.iter_mut().filter_map(|carried| carried.spin.as_mut());
        spins.for_each(|spin| spin.through = None);
    };
    with(&through);
    with(&|simpler| for_histories(simpler, constant));
    if scene.run.outputs > 2 {
        with(&|simpler| simpler.run.outputs = 2);
    }
    all
}

/// Calls `change` with every history of a scene along one direction.
fn for_histories(scene: &mut Scene, change: fn(&VectorHistory) -> VectorHistory) {
    for load in &mut scene.loads {
        (load.force, load.torque) = (change(&load.force), change(&load.torque));
    }
    crate::transformations::for_driving(scene, |history, driven| {
        if driven == crate::transformations::Driven::Turned {
            *history = change(history);
        }
    });
}

/// Returns a constant of about the same size.
fn constant(history: &VectorHistory) -> VectorHistory {
    match history {
        VectorHistory::Along { direction, factor } => VectorHistory::Along {
            direction: *direction,
            factor: History::Constant(factor.largest_until(f64::MAX).0),
        },
        VectorHistory::Columns(columns) => {
            let (_, row) = columns.rows().next().expect("a row");
            VectorHistory::constant(row)
        }
    }
}
