//! Bodies whose modes are made of the shapes of motions, and their errors in these motions.

use super::principal::principal;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, ImportedShapes};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::symmetric_part;
use flexbody_linalg::context::Context;
use flexbody_linalg::{combine, dense_cholesky, gram, larger, side_by_side, solve_upper};
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
            let (motion, _) = trace(reference, scene, context)?;
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
        Measure::new(&self.framed_body, self.scene, &self.motion)
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

// Shapes made of motions: the deformation of a body in one or several load cases, spanned by as few shapes as
// possible.

/// Parts of the tolerances that the shapes may leave out of the motion; each gives one candidate number of shapes.
/// Several are needed because the motion of the reduced body may be more or less accurate than the best approximation
/// by its shapes.
const PARTS: [f64; 6] = [2.0, 1.0, 0.5, 0.25, 0.1, 0.03];

/// Largest number of shapes.
const MAX_SHAPES: usize = 120;

/// Part of the sum of energies for which no shape is made. A larger value gives fewer shapes.
const LEFT_OUT: f64 = 1e-16;

/// Principal directions of motions in elastic energy (proper orthogonal decomposition).
///
/// With K_ff = L L', y = L' q at the instants of a motion is divided by the largest |y| of that motion and by the
/// tolerance of its scene. The eigenvectors u of the mean of y y' give the shapes Psi L'^-1 u. Of all sets of r shapes,
/// the first r leave out the least elastic energy, on average over each motion.
#[derive(Debug, Clone)]
struct MotionShapes {
    /// Shapes (N x k), in rows and axes of the model.
    shapes: Mat<f64>,
    /// Largest root of the elastic energy that the first r shapes leave out, relative to the largest of its motion and
    /// to the tolerance of its scene, for r = 0 to k.
    left: Vec<f64>,
}

impl MotionShapes {
    /// Computes the shapes of `motions` of `body`, made of `model`, each with its scene. Returns `None` if there are no
    /// motions, if the body has other rows than the model, or if nothing deforms.
    ///
    /// # Errors
    /// The errors of [`FramedScene::new`].
    pub(super) fn new(
        model: &FeModel,
        body: &FlexBody,
        motions: &[(&Scene, &Trace)],
    ) -> Result<Option<Self>> {
        let Some((scene, _)) = motions.first() else { return Ok(None) };
        let framed = FramedScene::new(body, scene)?;
        let body = &*framed.body;
        let stiffness = symmetric_part(body.invariants().modal_stiffness());
        let (Some(vectors), Some(lower)) = (body.vectors_of(model), dense_cholesky(stiffness)) else {
            return Ok(None);
        };
        // Sum the mean of y y' over all motions; its eigenvectors are the principal directions.
        let weighted: Vec<Mat<f64>> =
            motions.iter().map(|(scene, motion)| weighed(&lower, scene, motion)).collect();
        let mut sum = Mat::zeros(body.n_modes(), body.n_modes());
        for (weighted, (_, motion)) in weighted.iter().zip(motions) {
            sum += mean_of_products(weighted, &motion.time);
        }
        let Some((directions, _)) = principal(sum, LEFT_OUT, MAX_SHAPES) else { return Ok(None) };
        // Transform back to shapes, and measure the energy that the first r shapes leave out.
        let all = side_by_side(&weighted.iter().map(Mat::as_ref).collect::<Vec<_>>());
        let left = left_out(&all, &directions);
        let combinations = solve_upper(&lower, &directions);
        Ok(Some(Self { shapes: combine(vectors.as_ref(), combinations.as_ref()), left }))
    }

    /// Returns the numbers of shapes that are candidates for a body, ascending.
    pub(super) fn counts(&self) -> Vec<usize> {
        let most = self.shapes.ncols();
        let count = |part: f64| self.left.iter().position(|left| *left <= part).unwrap_or(most).max(1);
        let mut counts: Vec<usize> = PARTS.map(count).to_vec();
        counts.dedup();
        counts
    }

    /// Returns the number of all shapes.
    pub(super) fn most(&self) -> usize {
        self.shapes.ncols()
    }

    /// Returns the candidate numbers, then doubled numbers up to all shapes.
    fn more_and_more(&self) -> Vec<usize> {
        let (mut counts, most) = (self.counts(), self.shapes.ncols());
        while let Some(last) = counts.last().filter(|last| **last < most) {
            counts.push((2 * last).min(most));
        }
        counts
    }

    /// Returns the basis of the first `count` shapes.
    pub(super) fn basis(&self, count: usize) -> BasisChoice {
        BasisChoice::Imported(ImportedShapes::of_motion(self.shapes.as_ref().subcols(0, count).to_owned()))
    }
}

/// Returns y at the instants of a motion, in columns, divided by its largest length and by the tolerance of the scene.
fn weighed(lower: &Mat<f64>, scene: &Scene, motion: &Trace) -> Mat<f64> {
    let instants = Mat::from_fn(lower.nrows(), motion.q.len(), |j, i| motion.q[i][j]);
    let weighted = gram(lower.as_ref(), instants.as_ref());
    let largest = (0..weighted.ncols()).map(|i| weighted.col(i).norm_l2()).fold(0.0, larger);
    let tolerance = &scene.requirements.tolerance.errors;
    let unit = largest * tolerance.stress.min(tolerance.deflection);
    // A body that stays rigid is not scaled.
    if unit > 0.0 { weighted * faer::Scale(unit.recip()) } else { weighted }
}

/// Returns the mean of y y' over the time of a motion, by the trapezoidal rule, for the columns y of `weighted`.
fn mean_of_products(weighted: &Mat<f64>, time: &[f64]) -> Mat<f64> {
    let last = time.len() - 1;
    let whole = time[last] - time[0];
    let share = |i: usize| 0.5 * (time[(i + 1).min(last)] - time[i.saturating_sub(1)]) / whole;
    let shared = Mat::from_fn(time.len(), weighted.nrows(), |i, j| share(i) * weighted[(j, i)]);
    symmetric_part(&combine(weighted.as_ref(), shared.as_ref()))
}

/// Returns, for every r, the largest length that the first r `directions` leave out of any column of `weighted`.
fn left_out(weighted: &Mat<f64>, directions: &Mat<f64>) -> Vec<f64> {
    let parts = gram(directions.as_ref(), weighted.as_ref());
    let rests = weighted - directions * &parts;
    let mut left = vec![0.0f64; directions.ncols() + 1];
    for i in 0..weighted.ncols() {
        let mut rest = rests.col(i).squared_norm_l2();
        for r in (0..left.len()).rev() {
            left[r] = larger(left[r], rest);
            if r > 0 {
                rest += parts[(r - 1, i)] * parts[(r - 1, i)];
            }
        }
    }
    left.into_iter().map(f64::sqrt).collect()
}
