//! Demands of a scene, or of one of several load cases, on a body: tolerances, the static responses that a basis must
//! contain, and those that the selected modes represent (theory section 8).

use super::cases::{Case, bounded, scenes};
use super::shapes::{FixedInterfaceModes, Pool, PoolShapes};
use super::situation::{PointRows, Situation};
use super::trial::Trial;
use crate::reference::ReferenceError;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::BodyPoint;
use flexbody_motion::scene::{
    FramedScene, Load, LoadCases, PerQuantity, Point, Scene, StressError, Tolerance, damped_once, points_of,
};
use nalgebra::Vector3;
use std::borrow::Cow;
use std::f64::consts::TAU;

/// Body and scene in one frame, with the scenes in which models are tested: this scene and, if it allows faster
/// rotation than its run has, the scene with its rotation scaled to that.
pub(super) struct FramedTests<'s> {
    pub body: Cow<'s, FlexBody>,
    pub scene: Cow<'s, Scene>,
    diagnostics: Vec<Diagnostic>,
    scenes: Vec<Scene>,
    /// Fixed-interface modes of a Craig-Bampton body that may be left out.
    pub fixed: Option<FixedInterfaceModes<'s>>,
}

impl<'s> FramedTests<'s> {
    pub(super) fn new(body: &'s FlexBody, scene: &'s Scene) -> Result<Self> {
        let fixed = FixedInterfaceModes::new(body, scene);
        let FramedScene { body, scene, diagnostics } = FramedScene::new(body, scene)?;
        let (body, scene) = damped_once(body, scene)?;
        let scenes = scenes(&body, &scene)?;
        Ok(Self { body, scene, diagnostics, scenes, fixed })
    }
}

/// Demand of a scene: the motion that it implies, the groups that bounds leave open, and the remaining tolerances.
pub(super) struct Demand<'c> {
    /// Name of the load case; `None` for a single scene.
    pub name: Option<&'c str>,
    pub body: &'c FlexBody,
    pub scene: &'c Scene,
    pub situation: Situation,
    pub loads: Vec<BodyPoint>,
    /// Fixed-interface modes of a Craig-Bampton body that may be left out.
    fixed: Option<&'c FixedInterfaceModes<'c>>,
    /// Scenes in which models are tested.
    pub cases: Vec<Case<'c>>,
    /// Warnings and notes about scene and body.
    pub diagnostics: &'c [Diagnostic],
    /// Trials by bounds.
    pub bounds: Vec<Trial>,
    /// Groups that bounds do not rule out, and the part of the tolerances that their bound takes; `None` if bounds rule out
    /// no group.
    pub by_bounds: Option<(TermGroups, f64)>,
    /// Truncation errors of the body and of its versions before enrichment.
    pub reference_errors: &'c [ReferenceError],
    /// Error of the missing stress stiffness of the spin; `None` if it is a small part of the tolerances or was not measured.
    pub stress_error: Option<StressError>,
    /// Largest angular velocity of the runs and the allowed one; `None` if the runs reach the allowed one.
    pub short_of: Option<(f64, f64)>,
}

impl<'c> Demand<'c> {
    /// Creates the demand of the load case `name`. Bounds use norms of the invariants if `tier_1` is set.
    pub(super) fn new(
        framed: &'c FramedTests<'_>,
        name: Option<&'c str>,
        context: &Context<'c>,
        tier_1: bool,
    ) -> Result<Self> {
        let (body, scene) = (&*framed.body, &*framed.scene);
        let (loads, _) = points_of(body, scene)?;
        let case = |scene| Ok(Case::new(body, scene, context)?.with_fixed(framed.fixed.as_ref()));
        let cases = framed.scenes.iter().map(case).collect::<Result<Vec<_>>>()?;
        let bounds = bounded(&cases, tier_1)?;
        Ok(Self {
            name,
            body,
            scene,
            situation: Situation::new(body, scene, &loads),
            loads,
            fixed: framed.fixed.as_ref(),
            cases,
            diagnostics: &framed.diagnostics,
            by_bounds: bounds.iter().find(|trial| trial.passed()).map(|trial| (trial.kept, trial.worst)),
            bounds,
            reference_errors: &[],
            stress_error: None,
            short_of: None,
        })
    }

    /// Returns the shapes of a pool.
    pub(super) fn shapes(&self, pool: Pool) -> PoolShapes<'c> {
        PoolShapes::new(pool, self.body, self.fixed)
    }

    /// Returns the groups that the body holds and that bounds do not rule out.
    pub(super) fn groups(&self) -> TermGroups {
        let held = self.body.invariants().groups();
        self.by_bounds.map_or(held, |(kept, _)| kept.and(held))
    }

    pub(super) fn tolerance(&self) -> &'c Tolerance {
        &self.scene.requirements.tolerance
    }

    /// Returns the part of the tolerances left after the truncation error of the body, the missing stress stiffness and the
    /// bounds.
    pub(super) fn budget(&self, stress_error: Option<&StressError>) -> f64 {
        let left = ReferenceError::left(self.reference_errors) * StressError::left(stress_error);
        let Some((_, bound)) = self.by_bounds else { return left };
        // Measured errors are relative to a motion with groups dropped by bounds, which may be larger than that of the
        // whole body by as much as the bounds allow.
        let PerQuantity { deflection, stress, reaction, .. } = self.tolerance().errors;
        (left - bound).max(0.0) / (1.0 + bound * deflection.max(stress).max(reaction))
    }

    /// Returns the diagnostic with the name of the load case, if there are several.
    pub(super) fn about(&self, said: Diagnostic) -> Diagnostic {
        match self.name {
            Some(name) => said.about(format!("case `{name}`")),
            None => said,
        }
    }
}

/// Loads of a scene whose static responses the basis should contain, so that only modes that the motion excites are
/// needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WantedResponses {
    /// True if the body turns: static responses to centrifugal loads.
    pub centrifugal: bool,
    /// True if forces or torques act at interfaces: static responses to these.
    pub interfaces: bool,
}

impl WantedResponses {
    /// Returns the responses that at least one load case requires.
    pub fn of_any(cases: &LoadCases) -> Self {
        cases.iter().map(Self::of).fold(Self::default(), |all, own| Self {
            centrifugal: all.centrifugal || own.centrifugal,
            interfaces: all.interfaces || own.interfaces,
        })
    }

    /// Returns the responses that `scene` requires.
    pub fn of(scene: &Scene) -> Self {
        let motion = scene.requirements.motion.angular_velocity.is_some_and(|range| range.length() > 0.0);
        let turns = scene.initial.angular_velocity.norm() > 0.0;
        let at_interface = |load: &Load| matches!(load.at, Point::Interface(_));
        Self {
            centrifugal: motion || turns || scene.rotation().is_some(),
            // The reaction is a load at the interface that carries the body.
            interfaces: scene.carried.is_some() || scene.loads.iter().any(at_interface),
        }
    }
}

/// Ratio of the highest free mode to the highest frequency of interest. Loads excite modes above it statically. A
/// larger value gives more modes.
pub const BEYOND_BAND: f64 = 2.0;

/// Returns the largest eigenvalue of the wanted free modes, from the highest band of the load cases; `None` if no case
/// states a band.
pub fn largest_eigenvalue(cases: &LoadCases) -> Option<f64> {
    let bands = cases.iter().filter_map(|scene| scene.requirements.band);
    bands.reduce(f64::max).map(|band| (TAU * BEYOND_BAND * band).powi(2))
}

// Static response to each load that the selected modes represent (theory section 8).

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
            Point::Node(_) | Point::NamedLoad(_) => false,
        };
        for direction in load.force.directions() {
            let forces = (0..eigenvalues.len()).map(|j| psi.column(j).dot(&direction)).collect();
            let [x, y, z] = direction.into();
            let name = if load.is_named() {
                load.at.to_string()
            } else {
                format!("force {x}, {y}, {z} at {}", load.at)
            };
            add(name, forces, &at_interface);
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
