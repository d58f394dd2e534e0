//! Maxima that keep NaN. `f64::max` and `norm_max` of faer ignore a NaN, so that a later check of their result would
//! pass.

use faer::MatRef;

/// Returns the larger of two numbers; NaN if one of them is NaN.
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Returns zero for a number that is negative by rounding only; keeps NaN.
pub fn not_negative(value: f64) -> f64 {
    larger(value, 0.0)
}

/// Returns the largest of zero and some numbers; NaN if one of them is NaN.
pub fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, larger)
}

/// Returns the largest magnitude among the entries of a matrix; NaN if one of them is NaN.
pub fn largest_entry(a: MatRef<'_, f64>) -> f64 {
    largest((0..a.ncols()).flat_map(|j| (0..a.nrows()).map(move |i| a[(i, j)].abs())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Mat;

    #[test]
    fn a_nan_stays_wherever_it_stands() {
        for at in 0..5 {
            let values: Vec<f64> =
                (0..5).map(|i| if i == at { f64::NAN } else { 1.0 + f64::from(i) }).collect();
            assert!(largest(values.iter().copied()).is_nan());
            assert!(largest_entry(Mat::from_fn(5, 1, |i, _| values[i]).as_ref()).is_nan());
        }
        assert_eq!((largest([]), largest([1.0, 3.0, 2.0]), larger(-1.0, -2.0)), (0.0, 3.0, -1.0));
        assert_eq!(largest_entry(Mat::from_fn(2, 2, |i, j| i as f64 - 3.0 * j as f64).as_ref()), 3.0);
    }
}
