//! Relative difference of two transfer functions between two places.

use libm::log10;
use nalgebra::{Complex, DMatrix};
use serde::Serialize;

/// Error below which rounding dominates; its ratio to an estimate is not evaluated.
const ROUNDING: f64 = 1e-7;

/// Error and the frequency at which it occurs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct At {
    /// Frequency, in hertz.
    pub hertz: f64,
    /// Error, relative or in decibels.
    pub value: f64,
}

/// Ratio of the estimated to the measured error, at frequencies where the measured error exceeds rounding.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Effectivity {
    /// Smallest ratio.
    pub least: f64,
    /// Median of the ratios.
    pub median: f64,
    /// Largest ratio.
    pub most: f64,
}

/// Errors of a body between two places, over the directions that count there.
#[derive(Debug, Clone, PartialEq)]
pub struct PairErrors {
    /// Error |H_r - H| / |H| at every frequency, in the Frobenius norm over the directions; `None` where the equations
    /// of all nodes were not solved.
    pub measured: Vec<Option<f64>>,
    /// Estimated error at every frequency; infinite or NaN at resonances without damping.
    pub estimated: Vec<f64>,
    /// Largest measured error.
    pub largest: Option<At>,
    /// Largest ratio of the amplitudes |H_r| / |H|, in decibels, by magnitude; measured.
    pub decibels: Option<At>,
    /// Largest error: measured where the equations were solved, estimated elsewhere.
    pub worst: Option<At>,
    /// Highest frequency up to which no error, measured or else estimated, exceeds the tolerance; `None` if the first
    /// error exceeds it.
    pub accurate_to: Option<f64>,
    /// Quality of the estimate; `None` if no measured error exceeds rounding.
    pub effectivity: Option<Effectivity>,
}

/// Responses between two places at one frequency: reduced, enriched, and that of all nodes if it was solved for.
pub(super) struct Compared<'a> {
    pub hertz: f64,
    pub reduced: &'a DMatrix<Complex<f64>>,
    pub enriched: &'a DMatrix<Complex<f64>>,
    pub full: Option<&'a DMatrix<Complex<f64>>>,
}

impl PairErrors {
    /// Compares responses at frequencies in ascending order.
    pub(super) fn new(compared: &[Compared<'_>], tolerance: f64) -> Self {
        // Measured errors where the equations of all nodes were solved, estimates everywhere.
        let measured: Vec<Option<f64>> =
            compared.iter().map(|at| at.full.map(|full| relative(at.reduced, full))).collect();
        let estimated: Vec<f64> = compared.iter().map(|at| relative(at.reduced, at.enriched)).collect();
        let decibels = compared.iter().filter_map(|at| {
            let ratio = norm(at.reduced) / norm(at.full?);
            Some(At { hertz: at.hertz, value: 20.0 * log10(ratio) })
        });
        // The measured error takes precedence over the estimate.
        let both: Vec<At> = (0..compared.len())
            .map(|i| At { hertz: compared[i].hertz, value: measured[i].unwrap_or(estimated[i]) })
            .collect();
        // NaN counts as an error above the tolerance.
        let first_bad = both.iter().position(|at| at.value.is_nan() || at.value > tolerance);
        let accurate_to = match first_bad {
            None => both.last().map(|at| at.hertz),
            Some(bad) => bad.checked_sub(1).map(|last| both[last].hertz),
        };
        let at_solves =
            (0..compared.len()).filter_map(|i| Some(At { hertz: compared[i].hertz, value: measured[i]? }));
        Self {
            largest: largest(at_solves),
            decibels: largest(decibels),
            worst: largest(both.into_iter()),
            accurate_to,
            effectivity: effectivity(&measured, &estimated),
            measured,
            estimated,
        }
    }
}

/// Returns |A - B| / |B|; zero if both are zero.
fn relative(a: &DMatrix<Complex<f64>>, b: &DMatrix<Complex<f64>>) -> f64 {
    let apart = norm(&(a - b));
    if apart == 0.0 { 0.0 } else { apart / norm(b) }
}

/// Returns the Frobenius norm.
fn norm(a: &DMatrix<Complex<f64>>) -> f64 {
    a.iter().map(Complex::norm_sqr).sum::<f64>().sqrt()
}

/// Returns the error of largest magnitude; NaN counts as larger than any number.
fn largest(errors: impl Iterator<Item = At>) -> Option<At> {
    errors.reduce(|most, next| {
        let larger = !most.value.is_nan() && (next.value.is_nan() || next.value.abs() > most.value.abs());
        if larger { next } else { most }
    })
}

fn effectivity(measured: &[Option<f64>], estimated: &[f64]) -> Option<Effectivity> {
    let ratio = |(measured, estimated): (&Option<f64>, &f64)| {
        measured.filter(|measured| *measured > ROUNDING).map(|measured| estimated / measured)
    };
    let mut ratios: Vec<f64> = measured.iter().zip(estimated).filter_map(ratio).collect();
    ratios.sort_by(f64::total_cmp);
    Some(Effectivity { least: *ratios.first()?, median: ratios[ratios.len() / 2], most: *ratios.last()? })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(re: f64) -> DMatrix<Complex<f64>> {
        DMatrix::from_element(1, 1, Complex::new(re, 0.0))
    }

    #[test]
    fn errors_are_measured_where_that_is_possible() {
        let full = [number(1.0), number(2.0), number(-4.0)];
        let reduced = [number(1.01), number(2.4), number(-3.0)];
        let enriched = [number(1.0), number(2.1), number(-4.0)];
        let compared: Vec<Compared<'_>> = (0..3)
            .map(|i| Compared {
                hertz: 10.0 * (i + 1) as f64,
                reduced: &reduced[i],
                enriched: &enriched[i],
                full: (i != 1).then_some(&full[i]),
            })
            .collect();
        let errors = PairErrors::new(&compared, 0.05);
        assert_eq!(errors.measured[1], None);
        assert!((errors.estimated[1] - 0.3 / 2.1).abs() < 1e-15);
        assert_eq!(errors.largest, Some(At { hertz: 30.0, value: 0.25 }));
        assert!((errors.decibels.expect("one").value - 20.0 * 0.75f64.log10()).abs() < 1e-12);
        assert_eq!(errors.accurate_to, Some(10.0));
        let Effectivity { least, most, .. } = errors.effectivity.expect("two ratios");
        assert!((least - 1.0).abs() < 1e-12 && (most - 1.0).abs() < 1e-12);
        let bad = PairErrors::new(&compared[1..], 0.05);
        assert_eq!((bad.accurate_to, bad.worst.map(|at| at.hertz)), (None, Some(30.0)));
    }

    #[test]
    fn what_is_not_a_number_is_the_worst() {
        let (one, nothing) = (number(1.0), number(f64::NAN));
        let at = |hertz: f64, reduced| Compared { hertz, reduced, enriched: &one, full: None };
        let errors = PairErrors::new(&[at(1.0, &one), at(2.0, &nothing), at(3.0, &one)], 0.05);
        assert!(errors.worst.is_some_and(|at| at.value.is_nan() && at.hertz == 2.0));
        assert_eq!(errors.accurate_to, Some(1.0));
    }
}
