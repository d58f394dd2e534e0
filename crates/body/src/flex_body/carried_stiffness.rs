//! Geometric stiffness of a carried body: the reaction at the carrier is one of its loads.
//!
//! A carried body is a free body under its inertia forces, its loads and the reaction. With its origin at
//! the carrier, the reaction follows from the motion of the frame and from the other loads (theory 7.6),
//!
//! ```text
//! f  = m (a - g) + al x c + w x (w x c) - sum F_p
//! mu = c x (a - g) + I0 al + w x I0 w - sum (x_p x F_p + M_p)
//! ```
//!
//! so that the geometric stiffness of the reaction becomes a part of that of the motion and of the loads.
//! If no geometric stiffness is given for loads at the carrier, the one of the motion includes the reaction,
//! because it was computed with the carrier held.

use super::{Carrier, FlexBody, GeometricStiffness, LoadKind, UnitLoad};
use faer::{Mat, Scale};
use nalgebra::Vector3;

/// Work of a unit load: its force, and its moment about the origin.
struct Resultant {
    force: Vector3<f64>,
    moment: Vector3<f64>,
}

impl Resultant {
    fn none() -> Self {
        Self { force: Vector3::zeros(), moment: Vector3::zeros() }
    }
}

impl FlexBody {
    /// Returns `given`, the geometric stiffness of this body in modes in which `carrier` is at rest, for the body that
    /// `carrier` carries at the origin: that of the reaction is added to that of the loads that cause it.
    pub(super) fn stiffness_with_reaction(
        &self,
        given: Vec<GeometricStiffness<Mat<f64>>>,
        carrier: &Carrier,
    ) -> Vec<GeometricStiffness<Mat<f64>>> {
        let Carrier::Interface(name) = carrier else { return given };
        let is_reaction = |load: &UnitLoad| load.kind.interface() == Some(name);
        let (reaction, mut all): (Vec<_>, Vec<_>) = given.into_iter().partition(|one| is_reaction(&one.load));
        if reaction.is_empty() {
            return all;
        }
        for load in self.loads_with_reaction(name) {
            let Resultant { force, moment } = self.reaction_to(&load);
            for stiffness in &reaction {
                let resultant =
                    if matches!(stiffness.load.kind, LoadKind::Force(_)) { force } else { moment };
                let amount = resultant[stiffness.load.component];
                if amount != 0.0 {
                    let part = &stiffness.matrix * Scale(amount);
                    match all.iter_mut().find(|known| known.load == load) {
                        Some(sum) => sum.matrix += part,
                        None => all.push(GeometricStiffness { load: load.clone(), matrix: part }),
                    }
                }
            }
        }
        all
    }

    /// Returns the unit loads that the carrier reacts to: motions of the frame, loads at other interfaces, named loads.
    fn loads_with_reaction(&self, carrier: &str) -> Vec<UnitLoad> {
        let mut kinds = vec![LoadKind::Acceleration, LoadKind::AngularAcceleration, LoadKind::Spin];
        for interface in self.interfaces() {
            if interface.name != carrier && interface.reference.is_some() {
                kinds.extend([
                    LoadKind::Force(interface.name.clone()),
                    LoadKind::Moment(interface.name.clone()),
                ]);
            }
        }
        kinds.extend(self.named_loads().iter().map(|load| LoadKind::Named(load.name.clone())));
        let of_kind = |kind: LoadKind| {
            let components = kind.of_dimension(self.dimension());
            components.iter().map(move |&component| UnitLoad { kind: kind.clone(), component })
        };
        kinds.into_iter().flat_map(of_kind).collect()
    }

    /// Returns the reaction at the origin to a unit load on the undeformed body.
    fn reaction_to(&self, load: &UnitLoad) -> Resultant {
        let (mass, c) = (self.invariants().mass(), self.invariants().first_moment());
        let inertia = self.invariants().inertia();
        let unit = |axis: usize| Vector3::ith(axis, 1.0);
        match &load.kind {
            LoadKind::Acceleration => {
                let a = unit(load.component);
                Resultant { force: a * mass, moment: c.cross(&a) }
            }
            LoadKind::AngularAcceleration => {
                let alpha = unit(load.component);
                Resultant { force: alpha.cross(&c), moment: inertia * alpha }
            }
            LoadKind::Spin => {
                let (k, l) = LoadKind::SPIN[load.component];
                let of = |k: usize, l: usize| Resultant {
                    force: unit(k).cross(&unit(l).cross(&c)),
                    moment: unit(k).cross(&(inertia * unit(l))),
                };
                let (one, other) = (of(k, l), of(l, k));
                if k == l {
                    one
                } else {
                    Resultant { force: one.force + other.force, moment: one.moment + other.moment }
                }
            }
            LoadKind::Force(at) => {
                let force = -unit(load.component);
                let point = self.interfaces().iter().find(|interface| interface.name == *at);
                let point = point
                    .and_then(|interface| interface.reference)
                    .map_or_else(Vector3::zeros, Vector3::from);
                Resultant { force, moment: point.cross(&force) }
            }
            LoadKind::Moment(_) => Resultant { force: Vector3::zeros(), moment: -unit(load.component) },
            LoadKind::Named(name) => {
                let load = self.named_loads().iter().find(|load| load.name == *name);
                let undeformed = vec![0.0; self.n_modes()];
                load.map_or_else(Resultant::none, |load| Resultant {
                    force: -load.resultant_force(),
                    moment: -load.torque_at(&undeformed),
                })
            }
        }
    }
}
