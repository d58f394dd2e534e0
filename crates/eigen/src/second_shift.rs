//! A second shift, among the modes wanted. With a shift below all of them the last modes converge slowest, and
//! many modes take three columns each; with one between them, two.

use super::counters::Counters;
use super::problem::EigenProblem;
use flexbody_linalg::{Analysis, Indefinite};

/// Part of the modes wanted that the shift is to have below it by the Ritz values of a basis of as many vectors. These
/// are too high: it has a tenth more below it, in truth. (Columns solved for 200 modes without a second shift, and with
/// parts of 0.6 and 0.65: bar of 100,000 rows 632, 440, 440; cube of 100,000 rows 672, 440, 520; tetrahedra of 64,000
/// rows 600, 521, 400.)
const PART: f64 = 0.65;

/// Part of the modes wanted within which the widest gap is taken, on either side.
const REACH: f64 = 0.025;

/// With more modes below it than so many for each one wanted the shift is useless.
const MOST_BELOW: f64 = 1.2;

/// Backward error of the factor beyond which the shift is left: the modes are asked for to 1e-9 at the best.
const LARGEST_ERROR: f64 = 1e-12;

/// Modes wanted below which a basis of as many vectors tells too little of them.
const LEAST: usize = 40;

/// Columns that the shift saves for each mode wanted.
const SAVED: f64 = 0.9;

/// Operations of a factorisation that take as long as one of solving and orthogonalising.
const DENSER: f64 = 1.4;

/// The factor at the shift, and how many flexible modes are below it.
pub(super) struct SecondShift<'a> {
    pub factor: Indefinite<'a>,
    pub below: usize,
}

impl<'a> SecondShift<'a> {
    /// That for these Ritz values, ascending; `None` where there is no gap to put it into, or the factor is of no use.
    pub(super) fn new(
        problem: &EigenProblem<'_>,
        analysis: &'a Analysis,
        eigenvalues: &[f64],
        wanted: usize,
        counters: &mut Counters,
    ) -> Option<Self> {
        let sigma = among(eigenvalues, wanted)?;
        counters.factorizations += 1;
        let factor = Indefinite::new(analysis, &problem.pencil, sigma);
        let inertia = factor.inertia();
        let below = inertia.negative.checked_sub(problem.rigid.ncols())?;
        let is_good = inertia.zero == 0 && inertia.backward_error <= LARGEST_ERROR;
        let is_useful = below > 0 && below as f64 <= MOST_BELOW * wanted as f64;
        (is_good && is_useful).then_some(Self { factor, below })
    }
}

/// The middle of the widest gap of these eigenvalues near the [`PART`] of the modes wanted.
fn among(eigenvalues: &[f64], wanted: usize) -> Option<f64> {
    let part = |part: f64| (part * wanted as f64).round() as usize;
    let (middle, reach) = (part(PART), part(REACH).max(1));
    let near = eigenvalues.get(middle.checked_sub(reach)?..=middle + reach)?;
    let widest = near.windows(2).max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))?;
    let sigma = 0.5 * (widest[0] + widest[1]);
    (widest[0] > 0.0 && sigma > widest[0] && sigma < widest[1]).then_some(sigma)
}

/// Whether the columns that a second shift saves take longer than its factor, with a basis of so many vectors of
/// `n` rows.
pub(super) fn pays(analysis: &Analysis, n: usize, wanted: usize, basis: usize) -> bool {
    let column = 4.0 * analysis.factor_len() as f64 + 8.0 * n as f64 * basis as f64;
    wanted >= LEAST && analysis.flops() < DENSER * SAVED * wanted as f64 * column
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shift_is_in_the_widest_gap_near_its_place() {
        let mut eigenvalues: Vec<f64> = (0..200).map(f64::from).collect();
        // Wider ones are out of reach.
        eigenvalues[10..].iter_mut().for_each(|lambda| *lambda += 50.0);
        eigenvalues[118..].iter_mut().for_each(|lambda| *lambda += 2.0);
        assert_eq!(among(&eigenvalues, 180), Some(168.5));
        assert_eq!(among(&eigenvalues[..110], 180), None);
        assert_eq!(among(&[1.0; 200], 200), None);
        assert_eq!(among(&[-1.0; 200], 200), None);
    }
}
