//! The largest of numbers that are checked afterwards. `f64::max` and `norm_max` of faer leave a NaN out, and
//! a check of what they give would pass; here a NaN stays.

use faer::MatRef;

/// The larger of two numbers, NaN when one of them is.
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Zero for what only rounding makes negative; NaN stays.
pub fn not_negative(value: f64) -> f64 {
    larger(value, 0.0)
}

/// The largest of zero and some numbers, NaN when one of them is.
pub fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, larger)
}

/// The largest magnitude among the entries of a matrix, NaN when one of them is.
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
