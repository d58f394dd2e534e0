//! Bodies whose modes are made of the shapes of motions, and their errors in these motions.

use super::motion_shapes::MotionShapes;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::basis::BasisChoice;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::{
    FramedScene, LoadCases, Measure, OtherModes, OutputErrors, Scene, Trace, trace, trace_at,
};

/// Motions of a reference body in load cases, and bodies whose modes are made of the shapes of these motions.
pub struct MotionBodies<'m> {
    model: &'m FeModel,
    reference: &'m FlexBody,
    cases: Vec<Case<'m>>,
    shapes: MotionShapes,
}

/// Scene with the motion of the reference in this scene.
struct Case<'m> {
    scene: &'m Scene,
    /// The reference in the frame of the scene.
    framed_body: FlexBody,
    motion: Trace,
}

/// Body with the fewest shapes whose errors are small enough.
pub struct FewestShapes<B> {
    /// Number of shapes.
    pub count: usize,
    /// Result of the closure `make` for this body.
    pub made: B,
    /// Largest errors in each load case.
    pub errors: Vec<OutputErrors>,
    /// Largest error over its tolerance, in each load case.
    pub worst: Vec<f64>,
}

impl<'m> MotionBodies<'m> {
    /// Simulates `reference`, made of `model`, in `cases` and computes the shapes of its motions. Returns `None` if
    /// there are no shapes.
    ///
    /// # Errors
    /// The errors of [`trace`] and of [`FramedScene::new`].
    pub fn new(
        model: &'m FeModel,
        reference: &'m FlexBody,
        cases: &'m LoadCases,
        context: &Context<'_>,
    ) -> Result<Option<Self>> {
        let case = |scene: &'m Scene| -> Result<Case<'m>> {
            let (motion, _) = trace(reference, scene, &context.without_listener())?;
            Ok(Case { scene, framed_body: FramedScene::new(reference, scene)?.body.into_owned(), motion })
        };
        let cases = cases.iter().map(case).collect::<Result<Vec<_>>>()?;
        let motions: Vec<_> = cases.iter().map(|case| (case.scene, &case.motion)).collect();
        let shapes = MotionShapes::new(model, reference, &motions)?;
        Ok(shapes.map(|shapes| Self { model, reference, cases, shapes }))
    }

    /// Returns the numbers of shapes that are candidates for a body, ascending.
    pub fn counts(&self) -> Vec<usize> {
        self.shapes.counts()
    }

    /// Returns the number of all shapes.
    pub fn most(&self) -> usize {
        self.shapes.most()
    }

    /// Returns the basis of the first `count` shapes, at most [`MotionBodies::most`].
    pub fn basis(&self, count: usize) -> BasisChoice {
        self.shapes.basis(count)
    }

    /// Returns the body with the fewest shapes whose largest error, over its tolerance, is at most `most` in every load
    /// case. `make` receives a number of shapes and returns a body; `body` returns the body of that result.
    ///
    /// The candidates are tested in ascending order, then doubled, since reactions may need more shapes than
    /// deformations. Between the first sufficient number and the one before it the search bisects; errors nearly always
    /// decrease with more shapes. Returns `None` if no number suffices, or if the bodies cannot be compared with the
    /// reference.
    ///
    /// # Errors
    /// The errors of `make`, and of the simulation of the body that it returned.
    pub fn fewest<B>(
        &self,
        most: &[f64],
        mut make: impl FnMut(usize) -> Result<B>,
        body: impl Fn(&B) -> &FlexBody,
    ) -> Result<Option<FewestShapes<B>>> {
        let measures: Vec<Measure<'_>> = self.cases.iter().map(Case::measure).collect();
        let mut attempt = |count: usize| -> Result<Option<FewestShapes<B>>> {
            let made = make(count)?;
            let Some(errors) = self.errors(&measures, body(&made))? else { return Ok(None) };
            let worst =
                |(case, errors): (&Case<'_>, &OutputErrors)| errors.worst(&case.scene.requirements.tolerance);
            let worst = self.cases.iter().zip(&errors).map(worst).collect();
            Ok(Some(FewestShapes { count, made, errors, worst }))
        };
        let is_enough = |own: &FewestShapes<B>| own.worst.iter().zip(most).all(|(worst, most)| worst <= most);
        let (mut too_few, mut found) = (0, None);
        // Ascend to the first sufficient number, then bisect below it.
        for count in self.shapes.more_and_more() {
            let Some(own) = attempt(count)? else { return Ok(None) };
            if is_enough(&own) {
                found = Some(own);
                break;
            }
            too_few = count;
        }
        let Some(mut found) = found else { return Ok(None) };
        while too_few + 1 < found.count {
            let count = too_few.midpoint(found.count);
            match attempt(count)?.filter(is_enough) {
                Some(own) => found = own,
                None => too_few = count,
            }
        }
        Ok(Some(found))
    }

    /// Returns the largest errors of the motion of `body` in each load case. Returns `None` if the body cannot be
    /// compared with the reference, or if a scene states initial values of modes, whose numbers refer to the
    /// reference.
    fn errors(&self, measures: &[Measure<'_>], body: &FlexBody) -> Result<Option<Vec<OutputErrors>>> {
        // Rigid motions that the frame of a scene adds to the modes have no stiffness and do not matter here.
        let Some(shared) = body.stiffness_beside(self.reference, self.model) else { return Ok(None) };
        self.cases.iter().zip(measures).map(|(case, measure)| case.errors(measure, body, &shared)).collect()
    }
}

impl Case<'_> {
    /// Returns the measure for errors relative to the reference motion.
    fn measure(&self) -> Measure<'_> {
        Measure::new(&self.framed_body, &self.motion)
    }

    /// Returns the largest errors of the motion of `body`. `shared` is the stiffness Psi'K Psi_r that couples its modes
    /// to those of the reference.
    fn errors(
        &self,
        measure: &Measure<'_>,
        body: &FlexBody,
        shared: &Mat<f64>,
    ) -> Result<Option<OutputErrors>> {
        if !self.scene.initial.modes.is_empty() {
            return Ok(None);
        }
        let framed = FramedScene::new(body, self.scene)?;
        let Some(modes) = OtherModes::new(&framed.body, &self.framed_body, shared.as_ref()) else {
            return Ok(None);
        };
        let mut scene = framed.scene.into_owned();
        scene.run.scheme = self.motion.scheme;
        let motion = trace_at(&framed.body, &scene, &self.motion.time, &Context::QUIET)?;
        Ok(Some(measure.of_other(&motion, &modes).largest()))
    }
}
