//! Frequencies at which a response is evaluated.

use libm::pow;

/// Smallest ratio of the ends of a band whose frequencies are spaced by equal ratios.
const MIN_LOGARITHMIC_RATIO: f64 = 20.0;

/// Smallest relative half width of a resonance, used if damping makes it no wider.
const NARROWEST: f64 = 1e-3;

/// Smallest relative distance from the natural frequency at which the peak of a damped resonance is evaluated: at the
/// natural frequency itself the undamped dynamic stiffness is singular.
const MIN_PEAK_DISTANCE: f64 = 1e-6;

/// Damping ratio above which the peak of a resonance is evaluated. Resonances with less damping are sampled on both
/// sides of their pole.
const MIN_PEAK_DAMPING: f64 = 1e-5;

/// Largest relative distance below the natural frequency at which the peak of a strongly damped resonance is evaluated:
/// for damping ratios above 0.7 the response has no peak.
const MAX_PEAK_DISTANCE: f64 = 0.5;

/// Relative distance from a natural frequency without damping within which no response is evaluated, since it is
/// infinite at the frequency itself.
const POLE_DISTANCE: f64 = 1e-4;
/// Relative distance from a damped natural frequency within which no response is evaluated, since the undamped matrix
/// is nearly singular there.
const DAMPED_POLE_DISTANCE: f64 = 3e-7;

/// Relative difference below which natural frequencies belong to one cluster.
const CLUSTER_DISTANCE: f64 = 1e-6;

/// Positions around a resonance, in half widths, at which only the modal responses are evaluated.
const AROUND: [f64; 8] = [-8.0, -4.0, -2.0, -0.5, 0.5, 2.0, 4.0, 8.0];

/// Largest number of resonances that get frequencies of their own.
const MOST_RESONANCES: usize = 60;

/// Range of frequencies in hertz, 0 <= low < high.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    low: f64,
    high: f64,
}

/// Spacing of frequencies in a band.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spacing {
    /// Frequencies at equal differences.
    Linear,
    /// Frequencies at equal ratios.
    Logarithmic,
}

/// Natural frequency and damping ratio of a mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    /// Natural frequency, in hertz.
    pub hertz: f64,
    /// Damping ratio.
    pub ratio: f64,
}

/// Frequency in hertz, and whether the equations of all nodes are solved at it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frequency {
    pub hertz: f64,
    pub solved: bool,
}

impl Band {
    /// Returns the band; `None` if the ends are not 0 <= low < high with finite numbers.
    pub fn new(low: f64, high: f64) -> Option<Self> {
        (low >= 0.0 && high.is_finite() && low < high).then_some(Self { low, high })
    }

    /// Returns the lowest and the highest frequency.
    pub fn ends(&self) -> [f64; 2] {
        [self.low, self.high]
    }

    /// Returns the spacing: by equal ratios if the band is wide and does not begin at zero.
    pub fn spacing(&self) -> Spacing {
        if self.low > 0.0 && self.high / self.low >= MIN_LOGARITHMIC_RATIO {
            Spacing::Logarithmic
        } else {
            Spacing::Linear
        }
    }

    /// Returns `count` evenly spaced frequencies up to the end of the band. A free body has no finite response at zero;
    /// a band from zero begins one step above it.
    fn even(&self, count: usize) -> impl Iterator<Item = f64> + '_ {
        let steps = if self.low > 0.0 { count.max(2) - 1 } else { count.max(1) };
        let first = usize::from(self.low == 0.0);
        (first..=steps).map(move |i| {
            let part = i as f64 / steps as f64;
            match self.spacing() {
                _ if i == steps => self.high,
                Spacing::Linear => self.low + (self.high - self.low) * part,
                Spacing::Logarithmic => self.low * pow(self.high / self.low, part),
            }
        })
    }

    /// Returns about `points` frequencies in ascending order. At about `solves` of them the equations of all nodes are
    /// solved: half of these at the resonances, the rest evenly spaced. No equations are solved if `solves` is zero.
    pub(super) fn frequencies(
        &self,
        points: usize,
        solves: usize,
        resonances: &[Resonance],
    ) -> Vec<Frequency> {
        let within = |f: f64| f >= self.low && f <= self.high && f > 0.0;
        let mut inside: Vec<Resonance> = resonances.iter().copied().filter(|r| within(r.hertz)).collect();
        inside.sort_by(|a, b| a.hertz.total_cmp(&b.hertz));
        // Keep one resonance of each cluster, with the smallest damping ratio.
        inside.dedup_by(|next, kept| {
            let same = next.hertz <= kept.hertz * (1.0 + CLUSTER_DISTANCE);
            if same {
                kept.ratio = kept.ratio.min(next.ratio);
            }
            same
        });
        inside.truncate(MOST_RESONANCES);
        // Solves near resonances and evenly spaced; modal responses around resonances and at all points.
        let close = if solves == 0 { Vec::new() } else { closely(&inside, solves / 2) };
        let around = inside.iter().flat_map(|r| AROUND.map(|at| r.hertz * (1.0 + at * r.half_width())));
        let free = if solves == 0 { 0 } else { solves.saturating_sub(close.len()).max(2) };
        let spread: Vec<f64> = self.even(free.max(1)).filter(|_| free > 0).collect();
        let solved = close.into_iter().chain(spread).map(|hertz| Frequency { hertz, solved: true });
        let others = around.chain(self.even(points)).map(|hertz| Frequency { hertz, solved: false });
        // Check resonances just outside the band too: a band may end at a resonance.
        let evaluated = |f: &Frequency| within(f.hertz) && !resonances.iter().any(|r| r.is_pole_at(f.hertz));
        let mut all: Vec<Frequency> = solved.chain(others).filter(evaluated).collect();
        all.sort_by(|a, b| a.hertz.total_cmp(&b.hertz).then(b.solved.cmp(&a.solved)));
        all.dedup_by(|next, kept| next.hertz == kept.hertz);
        all
    }
}

impl Resonance {
    /// Returns the half width of the resonance relative to its frequency.
    fn half_width(&self) -> f64 {
        self.ratio.clamp(NARROWEST, 0.1)
    }

    /// Returns true if the frequency is too close to the resonance to be evaluated.
    fn is_pole_at(&self, hertz: f64) -> bool {
        let nearest = if self.ratio <= MIN_PEAK_DAMPING { POLE_DISTANCE } else { DAMPED_POLE_DISTANCE };
        (hertz / self.hertz - 1.0).abs() < nearest
    }

    /// Returns the frequencies of the peak and of both its sides, the most significant first.
    fn evaluated(&self) -> [f64; 3] {
        let side = self.half_width();
        let peak = if self.ratio > MIN_PEAK_DAMPING {
            (self.ratio * self.ratio).clamp(MIN_PEAK_DISTANCE, MAX_PEAK_DISTANCE)
        } else {
            0.3 * side
        };
        [-peak, side, -side].map(|at| self.hertz * (1.0 + at))
    }
}

/// Returns at most `most` frequencies at resonances: three for each, or the peak of each, or the peaks of some.
fn closely(resonances: &[Resonance], most: usize) -> Vec<f64> {
    let of_each = if 3 * resonances.len() <= most { 3 } else { 1 };
    let stride = resonances.len().div_ceil(most.max(1)).max(1);
    let evaluated = resonances.iter().step_by(stride).flat_map(|r| r.evaluated().into_iter().take(of_each));
    evaluated.take(most).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_lie_in_the_band_and_at_its_resonances() {
        let band = Band::new(0.0, 100.0).expect("a band");
        let resonances =
            [(30.0, 0.02), (80.0, 0.0), (400.0, 0.01)].map(|(hertz, ratio)| Resonance { hertz, ratio });
        let found = band.frequencies(50, 20, &resonances);
        assert!(found.windows(2).all(|pair| pair[0].hertz < pair[1].hertz));
        assert!(found.iter().all(|f| f.hertz > 0.0 && f.hertz <= 100.0));
        let solved: Vec<f64> = found.iter().filter(|f| f.solved).map(|f| f.hertz).collect();
        assert_eq!(solved.len(), 20);
        assert_eq!(solved.last(), Some(&100.0));
        // The damped peak is solved for; there is no frequency at the undamped pole.
        assert!(solved.contains(&(30.0 * (1.0 - 0.02 * 0.02))));
        assert!(found.iter().all(|f| (f.hertz - 80.0).abs() > 1e-3));
        assert!(solved.iter().any(|f| (f - 80.0).abs() < 0.05));
        assert!(band.frequencies(50, 0, &resonances).iter().all(|f| !f.solved));
        // A band that ends at a resonance has its last frequency just below it.
        for end in [30.0, 30.0 * (1.0 - 1e-12)] {
            let ends_there = Band::new(0.0, end).expect("a band").frequencies(50, 20, &resonances);
            assert!(ends_there.iter().all(|f| f.hertz < 30.0 * (1.0 - 1e-7)));
        }
        // A repeated natural frequency is evaluated once.
        let twice = [resonances[0], resonances[0], resonances[1], resonances[2]];
        assert_eq!(band.frequencies(50, 20, &twice), found);
    }

    #[test]
    fn more_resonances_than_solves_leave_some_of_them() {
        let band = Band::new(1.0, 1000.0).expect("a band");
        assert_eq!(band.spacing(), Spacing::Logarithmic);
        let resonances: Vec<Resonance> =
            (1..50).map(|i| Resonance { hertz: 20.0 * f64::from(i), ratio: 0.01 }).collect();
        let found = band.frequencies(100, 10, &resonances);
        assert_eq!(found.iter().filter(|f| f.solved).count(), 10);
        assert_eq!((found[0].hertz, found.last().map(|f| f.hertz)), (1.0, Some(1000.0)));
    }

    #[test]
    fn what_is_no_band_is_none() {
        for (low, high) in [(1.0, 1.0), (2.0, 1.0), (-1.0, 1.0), (0.0, f64::INFINITY), (f64::NAN, 1.0)] {
            assert_eq!(Band::new(low, high), None);
        }
    }
}
