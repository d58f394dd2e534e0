//! A body that is enriched for a scene until what it lacks of its model no longer counts.

use super::estimate::{Estimate, PART_OF_REFERENCE, ReferenceError};
use crate::base::error::Result;
use crate::base::progress::{Event, Watch};
use crate::body::flex_body::FlexBody;
use crate::model::FeModel;
use crate::motion::scene::Scene;
use crate::numerics::linalg::side_by_side;
use faer::Mat;

/// What a body still lacks, relative to the one before it, for its modes to be worth their cost.
const WORTH: f64 = 0.7;

/// How often a body is enriched at the most.
const MOST_ROUNDS: usize = 4;

/// A body with what it lacks of its model in a scene.
#[derive(Debug, Clone)]
pub struct Enriched<B> {
    /// What the body was last made as.
    pub made: B,
    /// What every body on the way lacked, the last one that of `made`; empty where nothing can be said.
    pub rounds: Vec<ReferenceError>,
}

impl<B> Enriched<B> {
    /// What the body lacks.
    pub fn error(&self) -> Option<&ReferenceError> {
        self.rounds.last()
    }
}

/// Makes a body of `model` with `make`, which gets nodal forces (N x k) whose static responses the body shall have beside its modes, none at
/// first. As long as the body lacks more than [`PART_OF_REFERENCE`] of the tolerances of `scene` in its own motion, the forces that its motion
/// leaves unbalanced at the nodes join these, while that pays. `grows`: whether `make` can follow.
///
/// # Errors
/// Those of `make` and of [`trace`](crate::motion::scene::trace).
pub fn enrich<B>(
    model: &FeModel,
    scene: &Scene,
    memory: Option<u64>,
    grows: bool,
    watch: Watch<'_>,
    mut make: impl FnMut(&Mat<f64>) -> Result<B>,
    body: impl Fn(&B) -> &FlexBody,
) -> Result<Enriched<B>> {
    let mut loads = Mat::zeros(model.rows().len(), 0);
    let mut made = make(&loads)?;
    let mut rounds: Vec<ReferenceError> = Vec::new();
    let mut poorer = None;
    for round in 0..=MOST_ROUNDS {
        watch(Event::Phase("what the body lacks of the model"));
        let Some(estimate) = Estimate::new(model, body(&made), scene, PART_OF_REFERENCE, memory)? else {
            break;
        };
        let Estimate { error, missing } = estimate;
        if let (Some(before), Some(earlier)) = (rounds.last(), poorer.take())
            && error.worst > WORTH * before.worst
        {
            // A shock excites modes without end: no number of responses follows it.
            made = earlier;
            break;
        }
        let enough = error.worst <= PART_OF_REFERENCE;
        rounds.push(error);
        if enough || !grows || round == MOST_ROUNDS || missing.ncols() == 0 {
            break;
        }
        loads = side_by_side(&[loads.as_ref(), missing.as_ref()]);
        poorer = Some(std::mem::replace(&mut made, make(&loads)?));
    }
    Ok(Enriched { made, rounds })
}
