//! Axes of charts: range of values, scale and tick marks.

use crate::notation::numbers::significant;
use libm::{log10, pow};

/// Approximate number of intervals between the ticks of a linear axis; the step is rounded to 1, 2 or 5 times
/// a power of ten.
const INTERVALS: f64 = 4.0;

/// Largest number of labels of a logarithmic axis; more labels would overlap on the smallest panel.
const MOST_LABELS: f64 = 7.0;

/// Number of decades below which the multiples 2 and 5 of powers of ten are labelled as well.
const FEW_DECADES: f64 = 2.0;

/// Scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scale {
    /// Equal steps for equal differences.
    Linear,
    /// Equal steps for equal ratios; values that are not positive are not drawn.
    Logarithmic,
}

impl Scale {
    fn of(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Logarithmic => log10(value),
        }
    }
}

/// Range of values with its ticks.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    /// Quantity or unit shown beside the axis.
    pub label: String,
    scale: Scale,
    ends: [f64; 2],
    ticks: Vec<(f64, String)>,
}

impl Axis {
    /// Returns the linear axis between round values around all `values`; `None` if no value is finite.
    pub(crate) fn around(label: &str, values: impl Iterator<Item = f64>) -> Option<Self> {
        let finite = values.filter(|value| value.is_finite());
        let (mut low, mut high) = finite
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low > high {
            return None;
        }
        if low == high {
            let margin = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
            (low, high) = (low - margin, high + margin);
        }
        let step = round_step((high - low) / INTERVALS);
        let (first, last) = ((low / step).floor(), (high / step).ceil());
        let marked = (0..=(last - first) as usize).map(|i| (first + i as f64) * step);
        Some(Self::new(label, Scale::Linear, [first * step, last * step], marked))
    }

    /// Returns the axis from the first to the last value; `None` if the range is empty.
    pub(crate) fn between(label: &str, scale: Scale, ends: [f64; 2]) -> Option<Self> {
        let [low, high] = ends.map(|end| scale.of(end));
        if !(low.is_finite() && high.is_finite() && low < high) {
            return None;
        }
        let marked: Vec<f64> = match scale {
            Scale::Linear => {
                (0..=INTERVALS as u32).map(|i| low + (high - low) * f64::from(i) / INTERVALS).collect()
            }
            Scale::Logarithmic => {
                let factors = if high - low < FEW_DECADES { &[1.0, 2.0, 5.0][..] } else { &[1.0] };
                let powers = (low.floor() as i32..=high.floor() as i32).map(|power| 10f64.powi(power));
                let all = powers.flat_map(|power| factors.iter().map(move |factor| factor * power));
                all.filter(|value| (ends[0]..=ends[1]).contains(value)).collect()
            }
        };
        Some(Self::new(label, scale, ends, marked.into_iter()))
    }

    /// Returns the logarithmic axis over whole decades around all positive `values`, limited to the `most`
    /// highest decades; `None` without a positive value.
    pub(crate) fn decades(label: &str, values: impl Iterator<Item = f64>, most: f64) -> Option<Self> {
        let positive = values.filter(|value| *value > 0.0 && value.is_finite()).map(log10);
        let (low, high) = positive.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), power| {
            (low.min(power.floor()), high.max(power.ceil()))
        });
        if low > high {
            return None;
        }
        let high = high.min(f64::from(f64::MAX_10_EXP));
        let low = low.min(high - 1.0).max(high - most);
        let step = ((high - low) / MOST_LABELS).ceil() as usize;
        let marked = (0..=(high - low) as usize).step_by(step).map(|i| 10f64.powi(low as i32 + i as i32));
        Some(Self::new(label, Scale::Logarithmic, [low, high].map(|power| 10f64.powi(power as i32)), marked))
    }

    /// Returns the axis of angles from -180 to 180 degrees.
    #[cfg(any(test, feature = "response"))]
    pub(crate) fn degrees() -> Self {
        let marked = (-2..=2).map(|quarter| 90.0 * f64::from(quarter));
        Self::new("degrees", Scale::Linear, [-180.0, 180.0], marked)
    }

    fn new(label: &str, scale: Scale, ends: [f64; 2], marked: impl Iterator<Item = f64>) -> Self {
        let ticks = marked.map(|value| (value, significant(value, 4))).collect();
        Self { label: label.to_owned(), scale, ends, ticks }
    }

    /// Returns the axis with other tick labels.
    pub(crate) fn with_labels(mut self, label: impl Fn(f64) -> String) -> Self {
        self.ticks.iter_mut().for_each(|(value, text)| *text = label(*value));
        self
    }

    /// Returns the first and the last value.
    #[cfg(feature = "hdf5")]
    pub(crate) fn ends(&self) -> [f64; 2] {
        self.ends
    }

    /// Returns the position of a value on the axis, from 0 to 1; a value beyond an end is placed at that end.
    /// `None` for a value that the scale cannot show.
    pub(crate) fn at(&self, value: f64) -> Option<f64> {
        let [low, high] = self.ends.map(|end| self.scale.of(end));
        let at = self.scale.of(value);
        at.is_finite().then(|| (at.clamp(low, high) - low) / (high - low))
    }

    /// Returns positions and labels of the ticks.
    pub(crate) fn ticks(&self) -> impl Iterator<Item = (f64, &str)> {
        self.ticks.iter().filter_map(|(value, label)| Some((self.at(*value)?, label.as_str())))
    }
}

/// Returns the smallest of 1, 2 and 5 times a power of ten that is not below `step`.
fn round_step(step: f64) -> f64 {
    let power = pow(10.0, log10(step).floor());
    let round = [1.0, 2.0, 5.0, 10.0].into_iter().find(|factor| factor * power >= step * (1.0 - 1e-12));
    round.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: Option<Axis>) -> String {
        axis.expect("a range").ticks().map(|(_, label)| label.to_owned()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn marked_values_are_round() {
        for (step, round) in [(0.013, 0.02), (1.0, 1.0), (2.1e5, 5e5), (7e-12, 1e-11)] {
            assert!((round_step(step) / round - 1.0).abs() < 1e-12, "{step}");
        }
        assert_eq!(labels(Axis::around("", [0.1, 0.9].into_iter())), "0 0.2 0.4 0.6 0.8 1");
        assert_eq!(labels(Axis::decades("", [0.02, 30.0].into_iter(), 9.0)), "0.01 0.1 1 10 100");
        assert_eq!(labels(Axis::between("", Scale::Logarithmic, [3.0, 5000.0])), "10 100 1000");
        assert_eq!(labels(Axis::between("", Scale::Logarithmic, [300.0, 900.0])), "500");
        assert_eq!(labels(Axis::between("", Scale::Linear, [0.0, 2.0])), "0 0.5 1 1.5 2");
    }

    #[test]
    fn a_value_without_a_place_is_none() {
        let axis = Axis::decades("", [1e-2, 1.0].into_iter(), 9.0).expect("a range");
        assert_eq!([1e-3, 0.1, 5.0].map(|value| axis.at(value)), [Some(0.0), Some(0.5), Some(1.0)]);
        assert_eq!([0.0, -1.0, f64::NAN, f64::INFINITY].map(|value| axis.at(value)), [None; 4]);
        assert!(Axis::around("", [f64::NAN].into_iter()).is_none());
        assert!(Axis::between("", Scale::Linear, [1.0, 1.0]).is_none());
        assert!(Axis::decades("", [0.0].into_iter(), 9.0).is_none());
    }
}
