//! Modes whose strain energy cannot be told from zero.

use super::failure::EigenFailure;
use super::noise::energy_noise;
use super::problem::EigenProblem;
use super::refine::Refined;
/// Energy this many standard deviations above the noise of the entries of K is real.
pub(super) const NOISE_FACTOR: f64 = 30.0;

/// Eigenvalues that cannot be told from zero are mechanisms; clearly negative ones an indefinite K.
pub(super) fn check_zero_energy(problem: &EigenProblem<'_>, refined: &Refined) -> Result<(), EigenFailure> {
    let lowest = refined.vectors.as_ref().subcols(0, refined.vectors.ncols().min(32));
    let noise = energy_noise(problem.pencil.stiffness(), lowest, problem.input_error);
    if let Some(&lambda) = refined.eigenvalues.first()
        && lambda < -NOISE_FACTOR * noise[0]
    {
        let vector = refined.vectors.as_ref().subcols(0, 1).to_owned();
        return Err(EigenFailure::NegativeEigenvalue { eigenvalue: lambda, vector });
    }
    let count = refined.eigenvalues.iter().zip(&noise).take_while(|(l, n)| **l <= NOISE_FACTOR * **n).count();
    if count > 0 {
        return Err(EigenFailure::ZeroEnergy {
            count,
            eigenvalues: refined.eigenvalues[..count].to_vec(),
            vectors: refined.vectors.as_ref().subcols(0, count).to_owned(),
        });
    }
    Ok(())
}
