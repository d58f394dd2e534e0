//! Bodies of the shapes that a motion is made of, measured beside that motion.

use super::motion_shapes::MotionShapes;
use crate::base::error::Result;
use crate::body::basis::BasisChoice;
use crate::body::flex_body::FlexBody;
use crate::model::FeModel;
use crate::motion::scene::{Measure, OtherModes, OutputErrors, Scene, Stage, Trace, trace, trace_at};

/// A motion of a body, and what bodies of its shapes make of it.
pub struct MotionBodies<'m> {
    model: &'m FeModel,
    reference: &'m FlexBody,
    /// The reference in the frame of the scene.
    staged: FlexBody,
    scene: &'m Scene,
    motion: Trace,
    shapes: MotionShapes,
}

/// The body of the fewest shapes with small enough errors.
pub struct Fewest<B> {
    /// How many shapes it has.
    pub count: usize,
    /// What it was made as.
    pub made: B,
    /// Its errors.
    pub errors: OutputErrors,
    /// The largest of them over its tolerance.
    pub worst: f64,
}

impl<'m> MotionBodies<'m> {
    /// Of the motion of `reference`, made of `model`, in `scene`. `None` where there are no shapes of it.
    ///
    /// # Errors
    /// Those of [`trace`].
    pub fn new(
        model: &'m FeModel,
        reference: &'m FlexBody,
        scene: &'m Scene,
        memory: Option<u64>,
    ) -> Result<Option<Self>> {
        let (motion, _) = trace(reference, scene, memory, |_| ())?;
        let shapes = MotionShapes::new(model, reference, scene, &motion)?;
        let staged = Stage::new(reference, scene)?.body.into_owned();
        Ok(shapes.map(|shapes| Self { model, reference, staged, scene, motion, shapes }))
    }

    /// Numbers of shapes worth trying, ascending.
    pub fn counts(&self) -> Vec<usize> {
        self.shapes.counts(&self.scene.requirements.tolerance)
    }

    /// The basis of the first `count` shapes.
    pub fn basis(&self, count: usize) -> BasisChoice {
        self.shapes.basis(count)
    }

    /// As [`MotionShapes::damped`].
    ///
    /// # Errors
    /// Those of [`FlexBody::new`].
    pub fn damped(&self, made: FlexBody) -> Result<FlexBody> {
        self.shapes.damped(self.model, made)
    }

    /// The fewest shapes, each number made with `make`, whose errors are no more than `most` times the
    /// tolerances. More shapes are nearly always better: the numbers worth trying are tried in turn, and
    /// between the first that is good enough and the one before it there is a bisection. `None` where none
    /// is, or bodies cannot be compared.
    ///
    /// # Errors
    /// Those of `make`, and of the simulation of what it made.
    pub fn fewest<B>(
        &self,
        most: f64,
        mut make: impl FnMut(usize) -> Result<B>,
        body: impl Fn(&B) -> &FlexBody,
    ) -> Result<Option<Fewest<B>>> {
        let measure = Measure::new(&self.staged, &self.motion);
        let mut tried = |count: usize| -> Result<Option<Fewest<B>>> {
            let made = make(count)?;
            let errors = self.errors(&measure, body(&made))?;
            let worst = |errors: &OutputErrors| errors.worst(&self.scene.requirements.tolerance);
            Ok(errors.map(|errors| Fewest { count, made, worst: worst(&errors), errors }))
        };
        let (mut too_few, mut found) = (0, None);
        for count in self.counts() {
            let Some(own) = tried(count)? else { return Ok(None) };
            if own.worst <= most {
                found = Some(own);
                break;
            }
            too_few = count;
        }
        let Some(mut found) = found else { return Ok(None) };
        while too_few + 1 < found.count {
            let count = too_few.midpoint(found.count);
            match tried(count)? {
                Some(own) if own.worst <= most => found = own,
                _ => too_few = count,
            }
        }
        Ok(Some(found))
    }

    /// The largest errors of the motion of `body`; `None` where it cannot be compared with the reference, or
    /// where the scene starts modes of that by their number.
    fn errors(&self, measure: &Measure<'_>, body: &FlexBody) -> Result<Option<OutputErrors>> {
        if !self.scene.initial.modes.is_empty() {
            return Ok(None);
        }
        // Rigid motions that the frame of a scene adds to the modes have no stiffness.
        let shared = body.stiffness_beside(self.reference, self.model);
        let stage = Stage::new(body, self.scene)?;
        let modes = shared.and_then(|shared| OtherModes::new(&stage.body, &self.staged, shared.as_ref()));
        let Some(modes) = modes else { return Ok(None) };
        let mut scene = stage.scene.into_owned();
        scene.run.scheme = self.motion.scheme;
        let motion = trace_at(&stage.body, &scene, &self.motion.time, None)?;
        Ok(Some(measure.of_other(&motion, &modes).largest()))
    }
}
