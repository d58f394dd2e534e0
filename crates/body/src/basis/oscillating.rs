//! Responses of a model to harmonic forces, for estimates.

use super::coupled_model::CoupledModel;
use super::failure::explain;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_eigen::{EigenFailure, dynamic_responses_twice};
use flexbody_linalg::context::Context;
use flexbody_linalg::{combine, gram, side_by_side, subtract_combination};
use nalgebra::DMatrix;

/// Returns the responses x = (K - w^2 M)^-1 f to harmonic `loads` f (N x m) at w, and the responses
/// y = (K - w^2 M)^-1 M x to their inertia, as \[x, y\]. With x and y in its basis, a reduced model has the exact
/// transfer functions of the loads at w, and their slope. Returns `None` if w^2 is an eigenvalue to
/// rounding.
///
/// * `conditions`: C' (N x c) of a model with constraints, C x = C y = 0; `None`: the free model, without
///   rigid motion.
/// * `square`: w^2 > 0.
///
/// # Errors
/// Failures of the factorisation: exit code 3.
pub fn oscillating_responses(
    model: &CoupledModel<'_>,
    loads: Mat<f64>,
    conditions: Option<&Mat<f64>>,
    square: f64,
) -> Result<Option<Mat<f64>>> {
    let rigid = match conditions {
        Some(_) => Mat::zeros(model.pencil().n(), 0),
        None => model.rigid_modes()?,
    };
    let problem = model.problem(rigid.as_ref());
    let count = loads.ncols();
    let no_conditions = Mat::zeros(loads.nrows(), 0);
    let conditions = model.restrict(conditions.unwrap_or(&no_conditions).clone());
    // The constraint forces C'm make C x = 0: compute the response to C' together with the others.
    let (mut x, mut to_conditions) = (Mat::new(), Mat::new());
    let further = |all: &Mat<f64>| {
        to_conditions = all.as_ref().subcols(count, conditions.ncols()).to_owned();
        x = all.as_ref().subcols(0, count).to_owned();
        hold(&mut x, &conditions, &to_conditions);
        model.pencil().apply_mass(x.as_ref())
    };
    let all = side_by_side(&[model.restrict(loads).as_ref(), conditions.as_ref()]);
    let [_, mut y] = match dynamic_responses_twice(&problem, all, further, square, &Context::QUIET) {
        Ok(responses) => responses,
        Err(EigenFailure::Inaccurate { .. }) => return Ok(None),
        Err(failure) => return Err(explain(model.model(), failure)),
    };
    hold(&mut y, &conditions, &to_conditions);
    let both = side_by_side(&[x.as_ref(), y.as_ref()]);
    Ok(both.is_all_finite().then(|| model.expand(&both).into_owned()))
}

/// x <- x - X_C (C X_C)^-1 C x, with the responses X_C to the `conditions` C'. Gives NaN if the conditions
/// depend on each other.
fn hold(x: &mut Mat<f64>, conditions: &Mat<f64>, to_conditions: &Mat<f64>) {
    let count = conditions.ncols();
    if count == 0 {
        return;
    }
    let product = gram(conditions.as_ref(), to_conditions.as_ref());
    let inverse = DMatrix::from_fn(count, count, |i, j| product[(i, j)]).try_inverse();
    let inverse =
        Mat::from_fn(count, count, |i, j| inverse.as_ref().map_or(f64::NAN, |inverse| inverse[(i, j)]));
    let moved = combine(inverse.as_ref(), gram(conditions.as_ref(), x.as_ref()).as_ref());
    subtract_combination(x.as_mut(), to_conditions.as_ref(), moved.as_ref());
}
