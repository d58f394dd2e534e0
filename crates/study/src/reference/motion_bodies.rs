//! Bodies of the shapes that motions are made of, measured beside these motions.

use super::motion_shapes::MotionShapes;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::basis::BasisChoice;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::{
    LoadCases, Measure, OtherModes, OutputErrors, Scene, Stage, Trace, trace, trace_at,
};

/// The motions of a body in load cases, and what bodies of their shapes make of them.
pub struct MotionBodies<'m> {
    model: &'m FeModel,
    reference: &'m FlexBody,
    cases: Vec<Case<'m>>,
    shapes: MotionShapes,
}

/// A scene with the motion of the reference in it.
struct Case<'m> {
    scene: &'m Scene,
    /// The reference in the frame of the scene.
    staged: FlexBody,
    motion: Trace,
}

/// The body of the fewest shapes with small enough errors.
pub struct Fewest<B> {
    /// How many shapes it has.
    pub count: usize,
    /// What it was made as.
    pub made: B,
    /// Its errors in each case.
    pub errors: Vec<OutputErrors>,
    /// The largest of them over its tolerance, in each case.
    pub worst: Vec<f64>,
}

impl<'m> MotionBodies<'m> {
    /// Of the motions of `reference`, made of `model`, in `cases`. `None` where there are no shapes of them.
    ///
    /// # Errors
    /// Those of [`trace`].
    pub fn new(
        model: &'m FeModel,
        reference: &'m FlexBody,
        cases: &'m LoadCases,
        context: &Context<'_>,
    ) -> Result<Option<Self>> {
        let case = |scene: &'m Scene| -> Result<Case<'m>> {
            let (motion, _) = trace(reference, scene, &context.unheard())?;
            Ok(Case { scene, staged: Stage::new(reference, scene)?.body.into_owned(), motion })
        };
        let cases = cases.iter().map(case).collect::<Result<Vec<_>>>()?;
        let motions: Vec<_> = cases.iter().map(|case| (case.scene, &case.motion)).collect();
        let shapes = MotionShapes::new(model, reference, &motions)?;
        Ok(shapes.map(|shapes| Self { model, reference, cases, shapes }))
    }

    /// Numbers of shapes worth trying, ascending.
    pub fn counts(&self) -> Vec<usize> {
        self.shapes.counts()
    }

    /// The basis of the first `count` shapes.
    pub fn basis(&self, count: usize) -> BasisChoice {
        self.shapes.basis(count)
    }

    /// The fewest shapes, each number made with `make`, whose errors are in no case more than `most` of it
    /// times the tolerances. More shapes are nearly always better: the numbers worth trying are tried in
    /// turn, then twice as many each time, since reactions may take more than deformations; between the first
    /// that is good enough and the one before it there is a bisection. `None` where none is, or bodies cannot
    /// be compared.
    ///
    /// # Errors
    /// Those of `make`, and of the simulation of what it made.
    pub fn fewest<B>(
        &self,
        most: &[f64],
        mut make: impl FnMut(usize) -> Result<B>,
        body: impl Fn(&B) -> &FlexBody,
    ) -> Result<Option<Fewest<B>>> {
        let measures: Vec<Measure<'_>> = self.cases.iter().map(Case::measure).collect();
        let mut tried = |count: usize| -> Result<Option<Fewest<B>>> {
            let made = make(count)?;
            let Some(errors) = self.errors(&measures, body(&made))? else { return Ok(None) };
            let worst =
                |(case, errors): (&Case<'_>, &OutputErrors)| errors.worst(&case.scene.requirements.tolerance);
            let worst = self.cases.iter().zip(&errors).map(worst).collect();
            Ok(Some(Fewest { count, made, errors, worst }))
        };
        let is_enough = |own: &Fewest<B>| own.worst.iter().zip(most).all(|(worst, most)| worst <= most);
        let (mut too_few, mut found) = (0, None);
        for count in self.shapes.more_and_more() {
            let Some(own) = tried(count)? else { return Ok(None) };
            if is_enough(&own) {
                found = Some(own);
                break;
            }
            too_few = count;
        }
        let Some(mut found) = found else { return Ok(None) };
        while too_few + 1 < found.count {
            let count = too_few.midpoint(found.count);
            match tried(count)?.filter(is_enough) {
                Some(own) => found = own,
                None => too_few = count,
            }
        }
        Ok(Some(found))
    }

    /// The largest errors of the motion of `body` in each case; `None` where it cannot be compared with the
    /// reference, or where a scene starts modes of that by their number.
    fn errors(&self, measures: &[Measure<'_>], body: &FlexBody) -> Result<Option<Vec<OutputErrors>>> {
        // Rigid motions that the frame of a scene adds to the modes have no stiffness.
        let Some(shared) = body.stiffness_beside(self.reference, self.model) else { return Ok(None) };
        self.cases.iter().zip(measures).map(|(case, measure)| case.errors(measure, body, &shared)).collect()
    }
}

impl Case<'_> {
    /// What the motion is measured by.
    fn measure(&self) -> Measure<'_> {
        Measure::new(&self.staged, &self.motion)
    }

    /// The largest errors of the motion of `body`, which shares the stiffness Psi'K Psi_r with the reference.
    fn errors(
        &self,
        measure: &Measure<'_>,
        body: &FlexBody,
        shared: &Mat<f64>,
    ) -> Result<Option<OutputErrors>> {
        if !self.scene.initial.modes.is_empty() {
            return Ok(None);
        }
        let stage = Stage::new(body, self.scene)?;
        let Some(modes) = OtherModes::new(&stage.body, &self.staged, shared.as_ref()) else {
            return Ok(None);
        };
        let mut scene = stage.scene.into_owned();
        scene.run.scheme = self.motion.scheme;
        let motion = trace_at(&stage.body, &scene, &self.motion.time, &Context::QUIET)?;
        Ok(Some(measure.of_other(&motion, &modes).largest()))
    }
}
