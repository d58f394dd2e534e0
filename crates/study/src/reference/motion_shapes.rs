//! Shapes made of motions: what a body does in a scene, or in several load cases, by as few shapes as that
//! takes.

use super::compressed::principal;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, ImportedShapes};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::symmetric_part;
use flexbody_linalg::{combine, dense_cholesky, gram, larger, side_by_side, solve_upper};
use flexbody_model::FeModel;
use flexbody_motion::scene::{Scene, Stage, Trace};

/// Parts of the tolerances that so many shapes may leave out of the motion, each a number of shapes worth
/// trying: what a reduced body makes of its own motion may be better or worse than the best that its shapes
/// allow.
const PARTS: [f64; 6] = [2.0, 1.0, 0.5, 0.25, 0.1, 0.03];

/// Shapes at the most.
const MOST: usize = 120;

/// The part of the sum of energies that no shape is made for.
const LEFT_OUT: f64 = 1e-16;

/// Principal directions of motions in elastic energy (proper orthogonal decomposition): with K_ff = L L' and
/// y = L' q of the instants of a motion, over the largest |y| of that motion and what its scene allows, the
/// eigenvectors u of the mean of y y' give the shapes Psi L'^-1 u. Of all sets of as many shapes the first r
/// leave out the least of the elastic energy, on average over each motion.
#[derive(Debug, Clone)]
pub(super) struct MotionShapes {
    /// N x k, rows and axes of the model.
    shapes: Mat<f64>,
    /// Largest root of the elastic energy that the first r shapes leave out, relative to the largest of its
    /// motion, over what the scene of that motion allows, for r = 0 to k.
    left: Vec<f64>,
}

impl MotionShapes {
    /// Of motions of `body`, made of `model`, each with its scene. `None` where there are none, where the
    /// body has other rows than the model, or where nothing deforms.
    ///
    /// # Errors
    /// Those of [`Stage::new`].
    pub(super) fn new(
        model: &FeModel,
        body: &FlexBody,
        motions: &[(&Scene, &Trace)],
    ) -> Result<Option<Self>> {
        let Some((scene, _)) = motions.first() else { return Ok(None) };
        let stage = Stage::new(body, scene)?;
        let body = &*stage.body;
        let stiffness = symmetric_part(body.invariants().modal_stiffness());
        let (Some(vectors), Some(lower)) = (body.vectors_of(model), dense_cholesky(stiffness)) else {
            return Ok(None);
        };
        let weighted: Vec<Mat<f64>> =
            motions.iter().map(|(scene, motion)| weighed(&lower, scene, motion)).collect();
        let mut sum = Mat::zeros(body.n_modes(), body.n_modes());
        for (weighted, (_, motion)) in weighted.iter().zip(motions) {
            sum += mean_of_products(weighted, &motion.time);
        }
        let Some((directions, _)) = principal(sum, LEFT_OUT, MOST) else { return Ok(None) };
        let all = side_by_side(&weighted.iter().map(Mat::as_ref).collect::<Vec<_>>());
        let left = left_out(&all, &directions);
        let combinations = solve_upper(&lower, &directions);
        Ok(Some(Self { shapes: combine(vectors.as_ref(), combinations.as_ref()), left }))
    }

    /// Numbers of shapes worth trying, ascending.
    pub(super) fn counts(&self) -> Vec<usize> {
        let most = self.shapes.ncols();
        let count = |part: f64| self.left.iter().position(|left| *left <= part).unwrap_or(most).max(1);
        let mut counts: Vec<usize> = PARTS.map(count).to_vec();
        counts.dedup();
        counts
    }

    /// These numbers, then twice as many each time up to all shapes.
    pub(super) fn more_and_more(&self) -> Vec<usize> {
        let (mut counts, most) = (self.counts(), self.shapes.ncols());
        while let Some(last) = counts.last().filter(|last| **last < most) {
            counts.push((2 * last).min(most));
        }
        counts
    }

    /// The basis of the first `count` shapes.
    pub(super) fn basis(&self, count: usize) -> BasisChoice {
        BasisChoice::Imported(ImportedShapes::of_motion(self.shapes.as_ref().subcols(0, count).to_owned()))
    }
}

/// y of the instants of a motion, in columns: relative to the largest of it, over what its scene allows.
fn weighed(lower: &Mat<f64>, scene: &Scene, motion: &Trace) -> Mat<f64> {
    let instants = Mat::from_fn(lower.nrows(), motion.q.len(), |j, i| motion.q[i][j]);
    let weighted = gram(lower.as_ref(), instants.as_ref());
    let largest = (0..weighted.ncols()).map(|i| weighted.col(i).norm_l2()).fold(0.0, larger);
    let tolerance = &scene.requirements.tolerance.errors;
    let unit = largest * tolerance.stress.min(tolerance.deflection);
    // Of a body that stays rigid there is nothing to be left out.
    if unit > 0.0 { weighted * faer::Scale(unit.recip()) } else { weighted }
}

/// The mean over the time of a motion of y y', for the columns y of `weighted`.
fn mean_of_products(weighted: &Mat<f64>, time: &[f64]) -> Mat<f64> {
    let last = time.len() - 1;
    let whole = time[last] - time[0];
    let share = |i: usize| 0.5 * (time[(i + 1).min(last)] - time[i.saturating_sub(1)]) / whole;
    let shared = Mat::from_fn(time.len(), weighted.nrows(), |i, j| share(i) * weighted[(j, i)]);
    symmetric_part(&combine(weighted.as_ref(), shared.as_ref()))
}

/// The largest that the first r of the `directions` leave out of any of the columns of `weighted`, for every
/// r.
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
