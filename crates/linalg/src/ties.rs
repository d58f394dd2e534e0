//! Choices among computed values. Values that differ by rounding alone are equal, and the order of the items decides:
//! the choice is the same on every processor, whatever the last bits of its sums.

/// Relative difference up to which two values are equal. Rounding changes the quantities that are compared by up to
/// 1e-9 of themselves (perturbed matrices, `tests/decisions`); a larger margin prefers an item over a better one.
pub const TIE_MARGIN: f64 = 1e-6;

/// Returns the first item whose value is the largest, up to [`TIE_MARGIN`]. NaN counts as larger than every number.
/// Returns `None` if there is no item.
pub fn first_largest<T>(items: impl IntoIterator<Item = T>, value: impl Fn(&T) -> f64) -> Option<T> {
    let items: Vec<(f64, T)> = items.into_iter().map(|item| (value(&item), item)).collect();
    let largest = items.iter().map(|(value, _)| *value).max_by(f64::total_cmp)?;
    items.into_iter().find(|(value, _)| !is_below(*value, largest)).map(|(_, item)| item)
}

/// Returns the first item whose value is the smallest, up to [`TIE_MARGIN`]. NaN counts as larger than every number.
/// Returns `None` if there is no item.
pub fn first_smallest<T>(items: impl IntoIterator<Item = T>, value: impl Fn(&T) -> f64) -> Option<T> {
    let items: Vec<(f64, T)> = items.into_iter().map(|item| (value(&item), item)).collect();
    let smallest = items.iter().map(|(value, _)| *value).min_by(f64::total_cmp)?;
    items.into_iter().find(|(value, _)| !is_below(smallest, *value)).map(|(_, item)| item)
}

/// Sorts items by descending value. Items keep their order if their values are equal up to [`TIE_MARGIN`] of the first
/// of them.
pub fn sort_descending<T: Clone>(items: &mut [T], value: impl Fn(&T) -> f64) {
    let values: Vec<f64> = items.iter().map(value).collect();
    reorder(items, descending(&values));
}

/// Sorts items by ascending value. Items keep their order if their values are equal up to [`TIE_MARGIN`] of the first
/// of them.
pub fn sort_ascending<T: Clone>(items: &mut [T], value: impl Fn(&T) -> f64) {
    let values: Vec<f64> = items.iter().map(value).collect();
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    group_ties(&mut order, |first, other| is_below(values[first], values[other]));
    reorder(items, order);
}

fn reorder<T: Clone>(items: &mut [T], order: Vec<usize>) {
    let sorted: Vec<T> = order.into_iter().map(|at| items[at].clone()).collect();
    items.clone_from_slice(&sorted);
}

/// Returns the indices of the values in descending order. Indices ascend among values that are equal up to
/// [`TIE_MARGIN`] of the largest of them.
pub fn descending(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    group_ties(&mut order, |first, other| is_below(values[other], values[first]));
    order
}

/// Sorts the indices within each group of equal values of a sorted order. A group ends where a value differs from the
/// first one of the group.
fn group_ties(order: &mut [usize], differs: impl Fn(usize, usize) -> bool) {
    let mut from = 0;
    while from < order.len() {
        let first = order[from];
        let count = order[from..].iter().take_while(|&&other| !differs(first, other)).count();
        order[from..from + count].sort_unstable();
        from += count;
    }
}

/// Returns true if `value` is smaller than `largest` by more than [`TIE_MARGIN`].
fn is_below(value: f64, largest: f64) -> bool {
    match (value.is_nan(), largest.is_nan()) {
        (true, _) => false,
        (false, true) => true,
        // The difference from infinity is not finite, whatever the other value.
        _ if value.is_infinite() || largest.is_infinite() => value < largest,
        _ => largest - value > TIE_MARGIN * largest.abs().max(value.abs()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_does_not_decide() {
        let up = 1.0 + 1e-12;
        assert_eq!(first_largest([1.0, up, 0.5], |x| *x), Some(1.0));
        assert_eq!(first_largest([-1.0, -up], |x| *x), Some(-1.0));
        assert_eq!(first_smallest([2.0, up, 1.0], |x| *x), Some(up));
        assert_eq!(descending(&[1.0, 2.0, up, 2.0 * up, 0.0]), [1, 3, 0, 2, 4]);
        let mut ascending = [up, 2.0, 1.0, 0.5];
        sort_ascending(&mut ascending, |x| *x);
        assert_eq!(ascending, [0.5, up, 1.0, 2.0]);
        let mut named = [("a", 1.0), ("b", 2.0), ("c", up)];
        sort_descending(&mut named, |pair| pair.1);
        assert_eq!(named.map(|pair| pair.0), ["b", "a", "c"]);
    }

    #[test]
    fn a_difference_beyond_the_margin_decides() {
        assert_eq!(first_largest([1.0, 1.0 + 1e-5], |x| *x), Some(1.0 + 1e-5));
        assert_eq!(first_smallest([1.0, 1.0 - 1e-5], |x| *x), Some(1.0 - 1e-5));
        assert_eq!(first_largest(Vec::<f64>::new(), |x| *x), None);
    }

    #[test]
    fn infinity_and_nan_are_the_largest() {
        let all = [1.0, f64::INFINITY, f64::INFINITY];
        assert_eq!(descending(&all), [1, 2, 0]);
        let mut ascending = [f64::NAN, f64::INFINITY, 1.0];
        sort_ascending(&mut ascending, |x| *x);
        assert!(ascending[..2] == [1.0, f64::INFINITY] && ascending[2].is_nan());
        assert!(first_largest([1.0, f64::NAN, f64::INFINITY], |x| *x).is_some_and(f64::is_nan));
        assert_eq!(first_smallest([f64::NAN, 3.0, f64::INFINITY], |x| *x), Some(3.0));
        assert_eq!(first_smallest([f64::INFINITY, f64::NEG_INFINITY], |x| *x), Some(f64::NEG_INFINITY));
    }
}
