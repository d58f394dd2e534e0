//! Functions of time given by samples, with interpolation.

use nalgebra::{SMatrix, SVector};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Number of parts that a cubic piece is split into to bound its largest value: the bound is then too large
/// by less than 1/64 of the excess for the whole piece.
const PARTS: usize = 8;

/// Total change of a rate, relative to the largest value, below which the change is rounding and no
/// oscillation.
const RATE_ROUNDING: f64 = 1e-9;

/// Interpolation between two rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight lines: a kink at every row.
    Linear,
    /// Cubic spline with two continuous derivatives, whose third derivative is continuous at the second and
    /// the last but one row too (not-a-knot). Three rows give a parabola, two rows a line.
    Cubic,
}

/// Function of time with N components, given at rows. Copies share the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples<const N: usize>(Arc<Spline<N>>);

#[derive(Debug, Clone, PartialEq)]
struct Spline<const N: usize> {
    /// Times of the rows, ascending, at least two.
    times: Vec<f64>,
    /// Polynomial between each two rows.
    pieces: Vec<SplinePiece<N>>,
    /// Integral from the first row to each row.
    integrals: Vec<SVector<f64, N>>,
    interpolation: Interpolation,
    /// True if the first and the last value hold outside of the rows; otherwise the first and the last
    /// piece continue.
    held: bool,
}

/// Coefficients of 1, t, t^2 and t^3, with t from the beginning of the piece.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SplinePiece<const N: usize>([SVector<f64, N>; 4]);

/// Value and derivatives of a function at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample<const N: usize> {
    /// Value of the function.
    pub value: SVector<f64, N>,
    /// First derivative; at a kink the derivative after it.
    pub rate: SVector<f64, N>,
    /// Second derivative; at a kink the derivative after it.
    pub second: SVector<f64, N>,
}

/// Upper bounds of a function from time zero to an end time, in the Euclidean norm of its components. The
/// bounds are guaranteed, and too large by only a small part of the change between two rows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sizes {
    /// Value at time zero.
    pub start: f64,
    /// Largest value.
    pub largest: f64,
    /// Total variation.
    pub total: f64,
    /// Largest rate.
    pub rate: f64,
    /// Total variation of the rate, including jumps.
    pub rate_total: f64,
}

impl<const N: usize> Samples<N> {
    /// Creates the function with these values at ascending times.
    ///
    /// # Panics
    /// When there are fewer than two times, or another number of values.
    pub fn new(
        times: Vec<f64>,
        values: &[SVector<f64, N>],
        interpolation: Interpolation,
        held: bool,
    ) -> Self {
        assert!(times.len() >= 2 && times.len() == values.len(), "two rows or more, with a value each");
        let pieces: Vec<SplinePiece<N>> = match interpolation {
            Interpolation::Linear => times.windows(2).zip(values.windows(2)).map(SplinePiece::line).collect(),
            Interpolation::Cubic => {
                let slopes = slopes(&times, values);
                let ends = times.windows(2).zip(values.windows(2)).zip(slopes.windows(2));
                ends.map(|((times, values), slopes)| SplinePiece::cubic(times, values, slopes)).collect()
            }
        };
        let mut integrals = vec![SVector::zeros()];
        for (piece, ends) in pieces.iter().zip(times.windows(2)) {
            integrals.push(integrals[integrals.len() - 1] + piece.integral(ends[1] - ends[0]));
        }
        Self(Arc::new(Spline { times, pieces, integrals, interpolation, held }))
    }

    /// Returns the piece that contains a time, and the time since the beginning of the piece.
    fn piece_at(&self, time: f64) -> (usize, f64) {
        let Spline { times, pieces, .. } = &*self.0;
        let piece = times.partition_point(|&t| t <= time).saturating_sub(1).min(pieces.len() - 1);
        (piece, time - times[piece])
    }

    /// Returns the first and the last time.
    pub fn ends(&self) -> (f64, f64) {
        let times = &self.0.times;
        (times[0], times[times.len() - 1])
    }

    /// Returns value and derivatives at a time.
    pub fn at(&self, time: f64) -> Sample<N> {
        let (first, last) = self.ends();
        if self.0.held && (time < first || time >= last) {
            let value = if time < first { self.row(0) } else { self.row(self.0.times.len() - 1) };
            return Sample { value, rate: SVector::zeros(), second: SVector::zeros() };
        }
        let (piece, since) = self.piece_at(time);
        self.0.pieces[piece].at(since)
    }

    /// Returns the value at a row.
    fn row(&self, row: usize) -> SVector<f64, N> {
        let Spline { times, pieces, .. } = &*self.0;
        match pieces.get(row) {
            Some(piece) => piece.0[0],
            None => pieces[row - 1].at(times[row] - times[row - 1]).value,
        }
    }

    /// Returns times and values of the rows.
    pub fn rows(&self) -> impl Iterator<Item = (f64, SVector<f64, N>)> + '_ {
        self.0.times.iter().enumerate().map(|(row, &time)| (time, self.row(row)))
    }

    /// Returns the integral from time zero to a time.
    pub fn integral(&self, time: f64) -> SVector<f64, N> {
        self.since_first_row(time) - self.since_first_row(0.0)
    }

    fn since_first_row(&self, time: f64) -> SVector<f64, N> {
        let (first, last) = self.ends();
        let count = self.0.times.len();
        if self.0.held && time < first {
            return self.row(0) * (time - first);
        }
        if self.0.held && time > last {
            return self.0.integrals[count - 1] + self.row(count - 1) * (time - last);
        }
        let (piece, since) = self.piece_at(time);
        self.0.integrals[piece] + self.0.pieces[piece].integral(since)
    }

    /// Returns the times at which the function is not smooth: the rows of straight lines, and the ends if
    /// the values hold outside.
    pub fn breaks(&self) -> Vec<f64> {
        let Spline { times, interpolation, held, .. } = &*self.0;
        let last = times.len() - 1;
        let inner = match interpolation {
            Interpolation::Linear => &times[1..last],
            Interpolation::Cubic => &[],
        };
        let (first, last) = (held.then_some(times[0]), held.then_some(times[last]));
        first.into_iter().chain(inner.iter().copied()).chain(last).collect()
    }

    /// Returns true if the second derivative exists everywhere between the first and the last row.
    pub fn is_smooth(&self) -> bool {
        self.0.interpolation == Interpolation::Cubic
    }

    /// Returns the shortest time between two rows if the function is smooth there; `None` for straight
    /// lines, whose rows are breaks.
    pub fn smooth_spacing(&self) -> Option<f64> {
        let spacings = self.0.times.windows(2).map(|ends| ends[1] - ends[0]);
        self.is_smooth().then(|| spacings.fold(f64::INFINITY, f64::min))
    }

    /// Estimates the frequency of the fastest part, in oscillations per time: the largest second derivative
    /// over the largest deviation of the rate from its mean from time zero to `end`, over 2 pi. A sine
    /// gives its frequency, a pulse about 1.6 over its width. Returns zero for straight lines, whose kinks
    /// are breaks.
    pub fn frequency_until(&self, end: f64) -> f64 {
        let may_oscillate = self.is_smooth() && end > 0.0 && end.is_finite();
        if !may_oscillate {
            return 0.0;
        }
        let mean = (self.at(end).value - self.at(0.0).value) / end;
        let (mut value, mut rate, mut second) = (0.0f64, 0.0f64, 0.0f64);
        for (piece, from, to) in self.pieces_until(end) {
            for time in [from, to] {
                let sample = piece.at(time);
                value = value.max(sample.value.norm());
                rate = rate.max((sample.rate - mean).norm());
                second = second.max(sample.second.norm());
            }
        }
        if rate * end <= RATE_ROUNDING * value { 0.0 } else { second / rate / TAU }
    }

    /// Returns the pieces from time zero to `end`, each with its first and last time since the beginning of
    /// the piece.
    fn pieces_until<'p>(&'p self, end: f64) -> impl Iterator<Item = (&'p SplinePiece<N>, f64, f64)> + 'p {
        let Spline { times, pieces, held, .. } = &*self.0;
        let last = pieces.len() - 1;
        let span = move |(at, piece): (usize, &'p SplinePiece<N>)| {
            let first_piece_goes_on = at == 0 && !held;
            let last_piece_goes_on = at == last && !held;
            let from = if first_piece_goes_on { 0.0 } else { times[at].max(0.0) };
            let to = if last_piece_goes_on { end } else { times[at + 1].min(end) };
            (from < to).then_some((piece, from - times[at], to - times[at]))
        };
        pieces.iter().enumerate().filter_map(span)
    }

    /// Returns upper bounds from time zero to `end`.
    pub fn sizes_until(&self, end: f64) -> Sizes {
        let end = if end.is_finite() { end } else { self.ends().1.max(0.0) };
        let start = self.at(0.0);
        let mut sizes = Sizes { start: start.value.norm(), largest: start.value.norm(), ..Sizes::default() };
        let mut before = start.rate;
        for (piece, from, to) in self.pieces_until(end) {
            sizes.rate_total += (piece.at(from).rate - before).norm();
            before = piece.at(to).rate;
            let parts = if self.is_smooth() { PARTS } else { 1 };
            for part in 0..parts {
                let at = |part: usize| from + (to - from) * (part as f64 / parts as f64);
                piece.bound(at(part), at(part + 1), &mut sizes);
            }
        }
        // A value that holds outside has no rate.
        let after = self.at(end);
        sizes.largest = sizes.largest.max(after.value.norm());
        sizes.rate_total += (after.rate - before).norm();
        sizes
    }

    /// Returns true if the function is zero from time zero to `end`.
    pub fn is_zero_until(&self, end: f64) -> bool {
        self.sizes_until(end).largest == 0.0
    }

    /// Returns the function multiplied by a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        self.turned(&(SMatrix::identity() * factor))
    }

    /// Returns linear combinations of the components.
    pub fn turned<const M: usize>(&self, matrix: &SMatrix<f64, M, N>) -> Samples<M> {
        let Spline { times, pieces, integrals, interpolation, held } = &*self.0;
        Samples(Arc::new(Spline {
            times: times.clone(),
            pieces: pieces.iter().map(|piece| SplinePiece(piece.0.map(|c| matrix * c))).collect(),
            integrals: integrals.iter().map(|integral| matrix * integral).collect(),
            interpolation: *interpolation,
            held: *held,
        }))
    }

    /// Returns one component.
    pub fn component(&self, component: usize) -> Samples<1> {
        let mut row = SMatrix::<f64, 1, N>::zeros();
        row[component] = 1.0;
        self.turned(&row)
    }
}

impl<const N: usize> SplinePiece<N> {
    fn line((times, values): (&[f64], &[SVector<f64, N>])) -> Self {
        let slope = (values[1] - values[0]) / (times[1] - times[0]);
        Self([values[0], slope, SVector::zeros(), SVector::zeros()])
    }

    /// Creates a piece with these values and slopes at its ends.
    fn cubic(times: &[f64], values: &[SVector<f64, N>], slopes: &[SVector<f64, N>]) -> Self {
        let length = times[1] - times[0];
        let mean = (values[1] - values[0]) / length;
        let second = (mean * 3.0 - slopes[0] * 2.0 - slopes[1]) / length;
        let third = (slopes[0] + slopes[1] - mean * 2.0) / (length * length);
        Self([values[0], slopes[0], second, third])
    }

    fn at(&self, t: f64) -> Sample<N> {
        let [a, b, c, d] = &self.0;
        Sample {
            value: a + (b + (c + d * t) * t) * t,
            rate: b + (c * 2.0 + d * (3.0 * t)) * t,
            second: c * 2.0 + d * (6.0 * t),
        }
    }

    fn integral(&self, t: f64) -> SVector<f64, N> {
        let [a, b, c, d] = &self.0;
        (a + (b / 2.0 + (c / 3.0 + d * (t / 4.0)) * t) * t) * t
    }

    /// Raises `sizes` to bounds of the piece between two times. A polynomial lies within the convex hull of
    /// its control points, and the integral of |f| over a length h is at most the root of h times that of
    /// |f|^2, which Gauss and Simpson quadrature give exactly.
    fn bound(&self, from: f64, to: f64, sizes: &mut Sizes) {
        let (a, b, h) = (self.at(from), self.at(to), to - from);
        let inner = [a.value + a.rate * (h / 3.0), b.value - b.rate * (h / 3.0)];
        for point in inner.iter().chain([&a.value, &b.value]) {
            sizes.largest = sizes.largest.max(point.norm());
        }
        for point in [&a.rate, &(a.rate + a.second * (h / 2.0)), &b.rate] {
            sizes.rate = sizes.rate.max(point.norm());
        }
        let (middle, aside) = (0.5 * (from + to), 0.5 * h * 0.6f64.sqrt());
        let square = |t: f64| self.at(t).rate.norm_squared();
        let mean =
            (5.0 * square(middle - aside) + 8.0 * square(middle) + 5.0 * square(middle + aside)) / 18.0;
        sizes.total += h * mean.sqrt();
        let square = a.second.norm_squared() + a.second.dot(&b.second) + b.second.norm_squared();
        sizes.rate_total += h * (square / 3.0).max(0.0).sqrt();
    }
}

/// Returns the slopes at the rows of the cubic spline with two continuous derivatives and not-a-knot
/// conditions at its ends (de Boor, A Practical Guide to Splines, chapter IV). The equations are
/// tridiagonal, and their elimination needs no pivoting.
fn slopes<const N: usize>(times: &[f64], values: &[SVector<f64, N>]) -> Vec<SVector<f64, N>> {
    let last = times.len() - 1;
    let h: Vec<f64> = times.windows(2).map(|ends| ends[1] - ends[0]).collect();
    let mean: Vec<SVector<f64, N>> =
        values.windows(2).zip(&h).map(|(ends, h)| (ends[1] - ends[0]) / *h).collect();
    match last {
        1 => return vec![mean[0]; 2],
        2 => {
            let second = (mean[1] - mean[0]) / (h[0] + h[1]);
            return vec![mean[0] - second * h[0], mean[0] + second * h[0], mean[1] + second * h[1]];
        }
        _ => (),
    }
    // Pivot, entry right of it, and right side of each row after elimination.
    let ends = h[0] + h[1];
    let mut pivots = vec![h[1]];
    let mut right = vec![ends];
    let mut sides = vec![(mean[0] * ((h[0] + 2.0 * ends) * h[1]) + mean[1] * (h[0] * h[0])) / ends];
    for i in 1..last {
        let factor = h[i] / pivots[i - 1];
        pivots.push(2.0 * (h[i - 1] + h[i]) - factor * right[i - 1]);
        right.push(h[i - 1]);
        let side = (mean[i - 1] * h[i] + mean[i] * h[i - 1]) * 3.0;
        sides.push(side - sides[i - 1] * factor);
    }
    let (b, a) = (h[last - 1], h[last - 2]);
    let ends = a + b;
    let factor = ends / pivots[last - 1];
    let pivot = a - factor * right[last - 1];
    let side = (mean[last - 2] * (b * b) + mean[last - 1] * ((2.0 * ends + b) * a)) / ends;
    let mut slopes = vec![(side - sides[last - 1] * factor) / pivot; last + 1];
    for i in (0..last).rev() {
        slopes[i] = (sides[i] - slopes[i + 1] * right[i]) / pivots[i];
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector1, Vector3};

    /// Returns ascending times from 0 to 1 with uneven spacing.
    fn uneven(count: usize) -> Vec<f64> {
        let at = |i: usize| i as f64 / (count - 1) as f64;
        (0..count).map(|i| at(i) + 0.08 * (TAU * at(i)).sin()).collect()
    }

    #[test]
    fn cubics_are_exact_and_other_functions_converge_with_order_four() {
        let cubic = |t: f64| Vector1::new(1.0 - 2.0 * t + 3.0 * t * t - 4.0 * t * t * t);
        for count in 4..9 {
            let times = uneven(count);
            let values: Vec<_> = times.iter().map(|&t| cubic(t)).collect();
            let samples = Samples::new(times, &values, Interpolation::Cubic, false);
            for i in 0..=50 {
                let t = f64::from(i) / 50.0;
                let sample = samples.at(t);
                assert!((sample.value - cubic(t)).norm() < 1e-13);
                assert!((sample.rate[0] - (-2.0 + 6.0 * t - 12.0 * t * t)).abs() < 1e-11);
                assert!((sample.second[0] - (6.0 - 24.0 * t)).abs() < 1e-9);
                let integral = t - t * t + t.powi(3) - t.powi(4);
                assert!((samples.integral(t)[0] - integral).abs() < 1e-13);
            }
        }
        let errors = |count: usize| -> [f64; 3] {
            let times = uneven(count);
            let values: Vec<_> = times.iter().map(|&t| Vector1::new((5.0 * t).sin())).collect();
            let samples = Samples::new(times, &values, Interpolation::Cubic, false);
            (0..=1000).fold([0.0; 3], |worst: [f64; 3], i| {
                let t = f64::from(i) / 1000.0;
                let (sin, cos) = (5.0 * t).sin_cos();
                let sample = samples.at(t);
                let errors =
                    [sample.value[0] - sin, sample.rate[0] - 5.0 * cos, sample.second[0] + 25.0 * sin];
                std::array::from_fn(|k| worst[k].max(errors[k].abs()))
            })
        };
        let (few, many) = (errors(41), errors(81));
        for (derivative, (few, many)) in few.into_iter().zip(many).enumerate() {
            let order = (few / many).log2();
            assert!(
                (order - (4.0 - derivative as f64)).abs() < 0.35,
                "derivative {derivative}: order {order}"
            );
        }
    }

    #[test]
    fn few_rows_are_lines_and_parabolas() {
        let line = Samples::new(
            vec![0.0, 2.0],
            &[Vector1::new(1.0), Vector1::new(5.0)],
            Interpolation::Cubic,
            false,
        );
        assert_eq!((line.at(0.5).value[0], line.at(3.0).value[0]), (2.0, 7.0));
        let square = |t: f64| Vector1::new(t * t - t);
        let times = vec![0.0, 0.5, 2.0];
        let values: Vec<_> = times.iter().map(|&t| square(t)).collect();
        let parabola = Samples::new(times, &values, Interpolation::Cubic, false);
        for t in [0.1, 0.5, 0.9, 1.7] {
            assert!(
                (parabola.at(t).value - square(t)).norm() < 1e-15
                    && (parabola.at(t).second[0] - 2.0).abs() < 1e-14
            );
        }
    }

    /// Two derivatives are continuous at rows, values outside are held or continued, and integrals are
    /// those of the values.
    #[test]
    fn a_spline_is_smooth_and_stays_where_it_is_told() {
        let times = uneven(12);
        let values: Vec<_> =
            times.iter().map(|&t| Vector3::new((7.0 * t).sin(), t, (3.0 * t).cos())).collect();
        for held in [false, true] {
            let samples = Samples::new(times.clone(), &values, Interpolation::Cubic, held);
            for &t in &times[1..11] {
                let (a, b) = (samples.at(t - 1e-9), samples.at(t + 1e-9));
                assert!((a.rate - b.rate).norm() < 1e-6 && (a.second - b.second).norm() < 1e-4);
            }
            assert_eq!(samples.breaks(), if held { vec![0.0, 1.0] } else { vec![] });
            let outside = samples.at(1.5);
            assert_eq!(outside.rate == Vector3::zeros(), held);
            assert_eq!((outside.value - values[11]).norm() == 0.0, held);
            for t in [-0.3, 0.2, 0.77, 1.4] {
                let step = 1e-5;
                let slope = (samples.integral(t + step) - samples.integral(t - step)) / (2.0 * step);
                assert!((slope - samples.at(t).value).norm() < 1e-8, "{held} at {t}");
            }
            assert_eq!(samples.integral(0.0), Vector3::zeros());
        }
        let lines = Samples::new(times.clone(), &values, Interpolation::Linear, false);
        assert_eq!(lines.breaks(), times[1..11]);
        assert_eq!(lines.at(times[3]).value, values[3]);
    }

    /// Dense samples of a function never exceed its bounds, and the bounds are close if the rows are.
    #[test]
    fn bounds_hold_and_are_close() {
        for (count, close, interpolation) in [
            (60, 1.01, Interpolation::Cubic),
            (7, 1.3, Interpolation::Cubic),
            (9, 1.0 + 1e-5, Interpolation::Linear),
        ] {
            let times: Vec<f64> = uneven(count).iter().map(|t| 1.4 * t - 0.2).collect();
            let value = |t: f64| Vector3::new((6.0 * t).sin(), 0.3 * t, (4.0 * t).cos() - t * t);
            let values: Vec<_> = times.iter().map(|&t| value(t)).collect();
            let samples = Samples::new(times, &values, interpolation, false);
            let many = 200_000;
            let seen: Vec<_> = (0..=many).map(|i| samples.at(f64::from(i) / f64::from(many))).collect();
            let most = |size: fn(&Sample<3>) -> f64| seen.iter().map(size).fold(0.0, f64::max);
            let total = |part: fn(&Sample<3>) -> Vector3<f64>| {
                seen.windows(2).map(|pair| (part(&pair[1]) - part(&pair[0])).norm()).sum::<f64>()
            };
            let bounds = samples.sizes_until(1.0);
            for (real, bound) in [
                (seen[0].value.norm(), bounds.start),
                (most(|s| s.value.norm()), bounds.largest),
                (total(|s| s.value), bounds.total),
                (most(|s| s.rate.norm()), bounds.rate),
                (total(|s| s.rate), bounds.rate_total),
            ] {
                assert!(real <= bound * (1.0 + 1e-9) && bound <= close * real, "{count}: {real}, {bound}");
            }
        }
    }

    #[test]
    fn the_frequency_is_that_of_the_fastest_part() {
        let times: Vec<f64> = (0..400).map(|i| f64::from(i) / 399.0).collect();
        let fastest = |value: &dyn Fn(f64) -> f64| {
            let values: Vec<_> = times.iter().map(|&t| Vector1::new(value(t))).collect();
            Samples::new(times.clone(), &values, Interpolation::Cubic, false).frequency_until(1.0)
        };
        assert!((fastest(&|t| 3.0 + 100.0 * t + (TAU * 7.0 * t).sin()) / 7.0 - 1.0).abs() < 0.01);
        let pulse = fastest(&|t| (-((t - 0.5) / 0.02).powi(2) / 2.0).exp());
        assert!((pulse * TAU * 0.02 / 1.65 - 1.0).abs() < 0.02, "{pulse}");
        assert_eq!((fastest(&|_| 4.0), fastest(&|t| 2.0 * t)), (0.0, 0.0));
    }

    #[test]
    fn a_hundred_thousand_rows_are_one_smooth_function() {
        let times: Vec<f64> = (0..100_000).map(|i| f64::from(i) * 1e-5).collect();
        let values: Vec<_> = times.iter().map(|&t| Vector1::new((TAU * 5.0 * t).sin())).collect();
        let samples = Samples::new(times, &values, Interpolation::Cubic, false);
        assert!(samples.breaks().is_empty());
        assert!((samples.frequency_until(0.9) / 5.0 - 1.0).abs() < 1e-3);
        assert!((samples.integral(0.25)[0] - (1.0 - (TAU * 1.25).cos()) / (TAU * 5.0)).abs() < 1e-12);
    }
}
