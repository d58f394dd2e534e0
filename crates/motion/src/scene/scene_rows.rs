//! Recoveries of a body during its simulation in a scene.

use super::row_extremes::RowSurvey;
use super::surroundings::SceneForces;
use super::{Point, RecoveredMotion, RowLayout, RowMap, RowStates, Scene};
use crate::dynamics::Snapshot;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_body::flex_body::FlexBody;

/// Recoveries of a body along its motion: states at the output times, extremes of the continuous motion.
pub(super) struct SceneRows {
    recoveries: Vec<RowMap>,
    /// Interface of each load of the scene among those with static columns; `None` for a place without.
    loaded: Vec<Option<usize>>,
    /// Interface that carries the body.
    carrier: Option<usize>,
    states: RowStates,
    survey: RowSurvey,
}

impl SceneRows {
    /// Creates the recoveries of a body in a scene in one frame, with warnings about loads that they do not see;
    /// `None` for a body without recoveries.
    ///
    /// * `envelope`: true to find the largest stresses of every point.
    pub(super) fn new(body: &FlexBody, scene: &Scene, envelope: bool) -> Option<(Self, Vec<Diagnostic>)> {
        let all = body.recoveries();
        if all.is_empty() {
            return None;
        }
        let layout = RowLayout::new(body.n_modes(), all);
        let recoveries: Vec<RowMap> = all.iter().map(|one| RowMap::new(one, &layout)).collect();
        let column = |place: &Point| match place {
            Point::Interface(name) => layout.interface(name),
            Point::Node(_) => None,
        };
        let carriers = scene.carried.iter().map(|carried| &carried.by);
        let unseen: Vec<String> = scene
            .loads
            .iter()
            .map(|load| &load.at)
            .chain(carriers)
            .filter(|place| column(place).is_none())
            .map(ToString::to_string)
            .collect();
        let rows = Self {
            loaded: scene.loads.iter().map(|load| column(&load.at)).collect(),
            carrier: scene.carried.as_ref().and_then(|carried| column(&carried.by)),
            states: RowStates::new(layout.clone()),
            survey: RowSurvey::new(&recoveries, layout.clone(), envelope),
            recoveries,
        };
        Some((rows, Vec::from_iter(unseen_loads(&unseen))))
    }

    /// Records the rows at an output time.
    pub(super) fn record(&mut self, time: f64, now: &Snapshot<'_>, forces: &SceneForces<'_>) {
        let z = self.state(time, now, forces);
        self.states.push(time, &z);
    }

    /// Takes a sampled state of the motion for the extremes.
    pub(super) fn see(&mut self, time: f64, now: &Snapshot<'_>, forces: &SceneForces<'_>) {
        let z = self.state(time, now, forces);
        self.survey.see(&self.recoveries, time, &z);
    }

    fn state(&self, time: f64, now: &Snapshot<'_>, forces: &SceneForces<'_>) -> Vec<f64> {
        let layout = &self.states.layout;
        let evaluation = now.evaluation();
        let mut z = layout.state(evaluation.modal_coordinates(), &evaluation.rigid_velocity().1);
        for (place, (_, force, torque)) in self.loaded.iter().zip(forces.acting(time, now.place())) {
            if let Some(place) = *place {
                layout.add_load(&mut z, place, &force, &torque);
            }
        }
        // The frame of a carried body has its origin at the reference point of the carrier.
        if let Some(carrier) = self.carrier {
            let (force, torque) = now.reaction();
            layout.add_load(&mut z, carrier, &force, &torque);
        }
        z
    }

    /// Returns the recoveries over the motion.
    pub(super) fn finish(self) -> RecoveredMotion {
        let (extremes, envelopes) = self.survey.finish(&self.recoveries);
        RecoveredMotion { recoveries: self.recoveries, states: self.states, extremes, envelopes }
    }
}

/// Returns a warning about the places of loads without static columns.
fn unseen_loads(places: &[String]) -> Option<Diagnostic> {
    let first = places.first()?;
    let more = if places.len() > 1 { format!(" and {} more", places.len() - 1) } else { String::new() };
    let message = format!(
        "recoveries have no static columns for the load at {first}{more}: stresses near it are those of the modes alone"
    );
    Some(Diagnostic::new(Code::RecoveryLoadUnseen, message))
}
