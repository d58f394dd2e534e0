//! What a body lacks of the model that it was made of, estimated along its motion in a scene.

use super::grid::Grid;
use super::lack::{Found, Lack, energy_scale};
use super::missed::Missed;
use super::residual::NodalView;
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::Result;
use crate::body::flex_body::FlexBody;
use crate::model::FeModel;
use crate::motion::scene::{OutputErrors, Point, Scene, Stage, damped_once, instants, nodal_point, trace};
use faer::Mat;

/// Part of the tolerances that the reference of a study may lack of the model without a word.
pub const PART_OF_REFERENCE: f64 = 0.1;

/// The same of a reference that stands for the motion of all nodes.
pub const PART_OF_FINE: f64 = 0.01;

/// Part of the tolerances that a body may lack of the model and still be a reference: others get the rest.
pub const MOST_LACKING: f64 = 0.5;

/// The elastic energy of what the body lacks, after so many responses of the motion joined it, is below this
/// part of what is allowed.
const PART_OF_RESPONSES: f64 = 0.1;

/// What a body lacks of the model that it was made of, in a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceError {
    /// Number of modes of the body.
    pub modes: usize,
    /// Its errors against the motion of all nodes, estimated: the responses, with their inertia, to what the
    /// equations of all nodes leave unbalanced along its motion, how these move the modes that it has, how
    /// they turn a free body, and what a prescribed motion takes of them. Of a motion of so many periods that
    /// it is not followed there is no reaction.
    pub errors: OutputErrors,
    /// The largest of them over its tolerance.
    pub worst: f64,
    /// When the estimate of the elastic energy is largest.
    pub time: f64,
}

impl ReferenceError {
    /// Whether others may be measured against the body: against what is left of the tolerances.
    pub fn is_reference(&self) -> bool {
        self.worst <= MOST_LACKING
    }

    /// The warning about a body that lacks more than `enough` of the tolerances.
    pub fn warning(&self, scene: &Scene, enough: f64) -> Option<Diagnostic> {
        if self.worst <= enough {
            return None;
        }
        let message = format!(
            "the body of {} modes that everything is measured against lacks {:.0} % of the tolerances itself, most at t = {:.2e}",
            self.modes,
            100.0 * self.worst,
            self.time
        );
        let warning = Diagnostic::new(Code::ReferenceLacks, message);
        let begins_with_shock = scene.acting().any(|history| history.at(0.0).0.norm() != 0.0);
        Some(match begins_with_shock && !scene.initial.settled {
            true => warning.with_help(
                "loads that act at time 0 begin with a shock: start with [initial] deformation = \"static\", or with loads that begin at zero",
            ),
            false => warning,
        })
    }
}

/// An estimate, and what would improve the body.
pub(super) struct Estimate {
    pub error: ReferenceError,
    /// Nodal forces (N x k) whose static responses the body lacks most, so many as it takes to come within
    /// what is allowed.
    pub missing: Mat<f64>,
}

impl Estimate {
    /// Estimates what `body`, made of `model`, lacks in `scene`. `allowed` is the part of the tolerances that
    /// it may lack. `None` where nothing can be said: for a scene without a duration, and a body that is
    /// carried through a motion of very many periods.
    ///
    /// # Errors
    /// Those of [`trace`] and of static responses.
    pub fn new(
        model: &FeModel,
        body: &FlexBody,
        scene: &Scene,
        allowed: f64,
        memory: Option<u64>,
    ) -> Result<Option<Self>> {
        let Some(duration) = scene.run.duration else { return Ok(None) };
        let stage = Stage::new(body, scene)?;
        let given = scene.requirements.damping.is_some();
        let (body, scene) = damped_once(stage.body, stage.scene)?;
        let (body, scene) = (&*body, &*scene);
        let at = |point: &Point| Ok(nodal_point(model, point)?.unit_loads(model));
        let loads = scene.loads.iter().map(|load| at(&load.at)).collect::<Result<Vec<_>>>()?;
        let watched = scene.watched.iter().map(at).collect::<Result<Vec<_>>>()?;
        let carrier = scene.carried.as_ref().map(|carried| nodal_point(model, &carried.by)).transpose()?;
        let of_model = model.damping().filter(|_| !given);
        let Some(view) = NodalView::new(model, body, loads, carrier.as_ref(), of_model) else {
            return Ok(None);
        };
        let (motion, _) = trace(body, scene, memory, |_| ())?;
        let grid = Grid::new(body, scene, &motion, duration);
        if carrier.is_some() && !grid.is_fine {
            return Ok(None);
        }
        let mut same_steps = scene.clone();
        same_steps.run.scheme = motion.scheme;
        let looked_at = instants(body, &same_steps, &grid.times)?;
        let missed = Missed::new(&view, body, &looked_at, &grid)?;
        let lack = Lack::new(&view, body, &missed, &looked_at, &grid, scene.initial.settled);
        let Found { errors, time } = lack.errors(scene, body, &motion, &watched);
        let tolerance = &scene.requirements.tolerance;
        let error = ReferenceError { modes: body.n_modes(), worst: errors.worst(tolerance), time, errors };
        let enough = PART_OF_RESPONSES * allowed * tolerance.stress.min(tolerance.deflection);
        let missing = missed.dominant(&lack.of_responses(), enough * energy_scale(&motion));
        Ok(Some(Self { error, missing }))
    }
}
