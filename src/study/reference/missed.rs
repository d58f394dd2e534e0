//! The static responses that a body lacks along its motion, and which of them would improve it most.

use super::compressed::{Compressed, principal};
use super::grid::Grid;
use super::projected::{Projected, UnbalancedAmplitudes};
use super::residual::NodalView;
use crate::base::error::Result;
use crate::body::basis::free_static_responses;
use crate::body::flex_body::FlexBody;
use crate::body::invariants::symmetric_part;
use crate::motion::scene::Instant;
use crate::numerics::linalg::{combine, gram, larger, not_negative, subtract_combination};
use faer::Mat;

/// Responses that may join the body at once.
const MOST_RESPONSES: usize = 12;

/// Static responses E to the forces B that the motion of a body leaves unbalanced.
pub(super) struct Missed {
    /// B (N x k).
    pub forces: Mat<f64>,
    /// c (k x m): the unbalanced forces are B c(t).
    pub amplitudes: Mat<f64>,
    /// g (nf x m): what the unbalanced forces do to the modes.
    pub in_modes: Mat<f64>,
    /// E = K^+ B (N x k), beside the modes; where something carries the body, with the point at rest that
    /// does.
    pub responses: Mat<f64>,
    /// E'K E.
    pub energy: Mat<f64>,
}

impl Missed {
    /// Of a body in the `motion` that it makes at the instants of `grid`.
    ///
    /// # Errors
    /// Those of [`free_static_responses`].
    pub fn new(view: &NodalView<'_>, body: &FlexBody, motion: &[Instant], grid: &Grid) -> Result<Self> {
        let model = view.model;
        let few: Vec<Instant> = grid.few().into_iter().map(|i| motion[i].clone()).collect();
        let compressed = Compressed::new(model, &view.residual(&few));
        let UnbalancedAmplitudes { in_modes, compressed: amplitudes } =
            Projected::new(view, compressed.as_ref()).amplitudes(motion);
        let Some(compressed) = compressed else {
            let nothing = || Mat::zeros(view.vectors.nrows(), 0);
            let (forces, responses) = (nothing(), nothing());
            return Ok(Self { forces, amplitudes, in_modes, responses, energy: Mat::zeros(0, 0) });
        };
        let forces = compressed.basis;
        let mut responses = free_static_responses(model, forces.clone(), body.modes().eigenvalue[0])?;
        if let Some(held) = &view.held {
            held.hold(&mut responses);
        }
        // The part in the modes is that of rounding.
        let weighted = model.pencil().apply_stiffness(view.vectors.as_ref());
        let shared = gram(weighted.as_ref(), responses.as_ref());
        let part =
            Mat::from_fn(shared.nrows(), shared.ncols(), |p, j| shared[(p, j)] / body.modes().eigenvalue[p]);
        subtract_combination(responses.as_mut(), view.vectors.as_ref(), part.as_ref());
        let energy = gram(responses.as_ref(), model.pencil().apply_stiffness(responses.as_ref()).as_ref());
        let energy = symmetric_part(&energy);
        Ok(Self { forces, amplitudes, in_modes, responses, energy })
    }

    /// The fewest forces B y (N x p) whose responses leave of E z(t), at every instant, no more than `enough`
    /// of the root of the elastic energy. `moving`: z (k x m).
    pub fn dominant(&self, moving: &Mat<f64>, enough: f64) -> Mat<f64> {
        let none = || Mat::zeros(self.forces.nrows(), 0);
        let Some((turned, roots)) = principal(self.energy.clone(), 0.0, usize::MAX) else { return none() };
        // w = T'z with E'K E = T T': the elastic energy is |w|^2 / 2.
        let w = |k: usize, i: usize| -> f64 {
            roots[k] * (0..turned.nrows()).map(|row| turned[(row, k)] * moving[(row, i)]).sum::<f64>()
        };
        let w = Mat::from_fn(roots.len(), moving.ncols(), w);
        let covariance = combine(w.as_ref(), w.transpose().to_owned().as_ref());
        let Some((directions, _)) = principal(covariance, 0.0, MOST_RESPONSES) else { return none() };
        let along = gram(directions.as_ref(), w.as_ref());
        let left = |count: usize, i: usize| -> f64 {
            let whole: f64 = (0..w.nrows()).map(|k| w[(k, i)].powi(2)).sum();
            let taken: f64 = (0..count).map(|k| along[(k, i)].powi(2)).sum();
            not_negative(0.5 * (whole - taken)).sqrt()
        };
        let worst = |count: &usize| (0..w.ncols()).map(|i| left(*count, i)).fold(0.0, larger);
        let count =
            (0..directions.ncols()).find(|count| worst(count) <= enough).unwrap_or(directions.ncols());
        let y = Mat::from_fn(turned.nrows(), count, |row, p| {
            (0..roots.len()).map(|k| turned[(row, k)] / roots[k] * directions[(k, p)]).sum()
        });
        combine(self.forces.as_ref(), y.as_ref())
    }
}
