//! Modes that two bodies have in common if one has fewer modes than the other.

use super::mode_pair::by_shape;
use crate::notation::numbers::{counted, frequency, frequency_range};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::runs;
use flexbody_body::flex_body::FlexBody;
use libm::log;
use std::ops::Range;

/// Paired modes of two bodies (indices from 0, ascending, the same number for both).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CommonModes {
    pub a: Vec<usize>,
    pub b: Vec<usize>,
    /// Sentences about the modes that were compared and those that were left out.
    pub notes: Vec<String>,
}

impl CommonModes {
    /// Pairs every mode of the body with fewer modes with a mode of the other body: with that of its shape, others in ascending
    /// order, so that the ratios of the frequencies deviate least. A mode that differs is thus compared with its
    /// neighbour and not reported as missing. For a repeated eigenvalue all modes are compared or none,
    /// because a part of its eigenspace is not determined.
    ///
    /// * `assurance`: modal assurance criterion of each mode of `a` with each mode of `b`; `None` if shapes cannot be compared.
    ///
    /// # Errors
    /// [`BodyIncomparable`](Code::BodyIncomparable) when no mode is left.
    pub(super) fn of(a: &FlexBody, b: &FlexBody, assurance: Option<&Mat<f64>>) -> Result<Self> {
        let (of_a, of_b) = (&a.modes().eigenvalue, &b.modes().eigenvalue);
        let is_first = of_a.len() <= of_b.len();
        let (fewer, more) = if is_first { (of_a, of_b) } else { (of_b, of_a) };
        let by_shape = match assurance {
            Some(all) if is_first => by_shape(all),
            Some(all) => by_shape(&all.transpose().to_owned()),
            None => vec![None; fewer.len()],
        };
        let partners = partners(fewer, more, &by_shape);
        let mut taken = partners.clone();
        taken.sort_unstable();
        // Modes whose cluster in the larger body is complete among the partners.
        let (kept, split): (Vec<usize>, Vec<usize>) =
            (0..fewer.len()).partition(|&i| is_whole(more, &taken, partners[i]));
        if kept.is_empty() {
            let message = "the bodies have no mode in common except parts of a repeated eigenvalue";
            return Err(Diagnostic::new(Code::BodyIncomparable, message)
                .with_help("convert both with all modes of the repeated eigenvalue")
                .into());
        }
        let mut of_more: Vec<usize> = kept.iter().map(|&i| partners[i]).collect();
        of_more.sort_unstable();
        let (a_modes, b_modes) = if is_first { (kept, of_more) } else { (of_more, kept) };
        // Notes on compared, omitted and undetermined modes.
        let mut notes = vec![format!(
            "{} in common {} compared: {} of the first body with {} of the second",
            counted(a_modes.len(), "mode"),
            if a_modes.len() == 1 { "is" } else { "are" },
            some_of(&a_modes, of_a.len()),
            some_of(&b_modes, of_b.len()),
        )];
        for (body, compared, which) in [(a, &a_modes, "first"), (b, &b_modes, "second")] {
            notes.extend(left_out(body, compared, which));
        }
        if !split.is_empty() {
            notes.push(
                "modes of a repeated eigenvalue that one body has only in part are not determined and were left out".to_owned(),
            );
        }
        Ok(Self { a: a_modes, b: b_modes, notes })
    }
}

/// Returns for each of the `fewer` eigenvalues the index of its partner among `more`: that of its shape if there is one, else the
/// nearest of those that are left.
fn partners(fewer: &[f64], more: &[f64], by_shape: &[Option<usize>]) -> Vec<usize> {
    let left: Vec<usize> = (0..fewer.len()).filter(|&i| by_shape[i].is_none()).collect();
    let free: Vec<usize> = (0..more.len()).filter(|&j| !by_shape.contains(&Some(j))).collect();
    let [of_left, of_free] = [(fewer, &left), (more, &free)]
        .map(|(values, places)| places.iter().map(|&i| values[i]).collect::<Vec<f64>>());
    let mut nearest = nearest(&of_left, &of_free).into_iter().map(|j| free[j]);
    by_shape.iter().filter_map(|partner| partner.or_else(|| nearest.next())).collect()
}

/// Returns for each of the `fewer` eigenvalues the index of its partner among `more` (both ascending): the
/// ascending choice with the smallest sum of |ln(lambda_i / lambda_j)|, found by dynamic programming.
fn nearest(fewer: &[f64], more: &[f64]) -> Vec<usize> {
    let (n, m) = (fewer.len(), more.len());
    let distance = |i: usize, j: usize| log(fewer[i] / more[j]).abs();
    // sums[i][j] is the smallest sum of the first i eigenvalues with partners among the first j.
    let mut sums = vec![vec![f64::INFINITY; m + 1]; n + 1];
    sums[0].fill(0.0);
    for i in 1..=n {
        for j in i..=m {
            sums[i][j] = sums[i][j - 1].min(sums[i - 1][j - 1] + distance(i - 1, j - 1));
        }
    }
    // Trace the choice back from the last eigenvalue.
    let (mut found, mut j) = (vec![0; n], m);
    for i in (1..=n).rev() {
        while j > i && sums[i][j] == sums[i][j - 1] {
            j -= 1;
        }
        j -= 1;
        found[i - 1] = j;
    }
    found
}

/// Returns true if every mode of the cluster that contains the mode `of` is among the `partners`.
fn is_whole(more: &[f64], partners: &[usize], of: usize) -> bool {
    let below = (1..=of).rev().take_while(|&j| close(more, j)).count();
    let above = (of + 1..more.len()).take_while(|&j| close(more, j)).count();
    (of - below..=of + above).all(|j| partners.binary_search(&j).is_ok())
}

/// Returns mode numbers from 1 in words: `all 12`, `modes 1 to 12`, `modes 1, 2, 5 to 7`.
fn some_of(modes: &[usize], of: usize) -> String {
    if modes.len() == of {
        return format!("all {of}");
    }
    let range = |&(first, last): &(usize, usize)| match last - first {
        0 => (first + 1).to_string(),
        1 => format!("{}, {}", first + 1, last + 1),
        _ => format!("{} to {}", first + 1, last + 1),
    };
    let ranges: Vec<String> = runs(modes).iter().map(range).collect();
    format!("{} {}", if modes.len() == 1 { "mode" } else { "modes" }, ranges.join(", "))
}

fn left_out(body: &FlexBody, compared: &[usize], which: &str) -> Option<String> {
    let rest: Vec<usize> = (0..body.n_modes()).filter(|j| compared.binary_search(j).is_err()).collect();
    let (first, last) = (*rest.first()?, *rest.last()?);
    let hertz = body.frequencies_hz();
    let range = if rest.len() == 1 {
        format!("at {}", frequency(hertz[first], 5))
    } else {
        format!("from {}", frequency_range([hertz[first], hertz[last]], 5))
    };
    Some(format!("not compared: {} of the {which} body, {range}", some_of(&rest, usize::MAX)))
}

// Clusters of modes whose basis is not reproducible between two computations.

/// Relative gap of eigenvalues below which neighbours are compared as one space. Rounding p of the
/// eigenproblem rotates two modes with the relative gap g by p/g: with p = 1e-13, modes further apart than
/// this agree to 1e-8. A smaller value would show rounding of closer modes as a difference.
const CLUSTER_GAP: f64 = 1e-5;

/// Returns true if the eigenvalue `i` (from 1) of `values` (ascending) belongs to the same cluster as its
/// predecessor.
fn close(values: &[f64], i: usize) -> bool {
    values[i] - values[i - 1] <= CLUSTER_GAP * values[i]
}

/// Returns the ranges of modes that are close to each other in `a` or in `b` (both ascending, of equal
/// length).
pub(super) fn clusters(a: &[f64], b: &[f64]) -> Vec<Range<usize>> {
    let mut ranges = Vec::new();
    let mut start = 0;
    for i in 1..=a.len() {
        if i == a.len() || !(close(a, i) || close(b, i)) {
            ranges.push(start..i);
            start = i;
        }
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partners_are_nearest_in_ascending_order() {
        assert_eq!(nearest(&[1.0, 2.0], &[1.0, 2.0, 3.0]), [0, 1]);
        assert_eq!(nearest(&[2.0, 9.0], &[1.0, 2.0, 3.0, 4.0, 9.0]), [1, 4]);
        assert_eq!(
            nearest(&[1.0, 2.2, 3.0], &[1.0, 2.0, 3.0, 4.0]),
            [0, 1, 2],
            "a mode that differs keeps its place"
        );
        assert_eq!(nearest(&[5.0, 5.0], &[5.0, 5.0, 5.0]).len(), 2);
        assert!(nearest(&[], &[1.0]).is_empty());
    }

    #[test]
    fn partners_have_one_shape_where_one_has_it() {
        // The mode at 2 has the shape of the one at 2.3, beside which another mode is nearer; two modes have exchanged their order.
        assert_eq!(partners(&[1.0, 2.0], &[1.0, 2.05, 2.3], &[Some(0), Some(2)]), [0, 2]);
        assert_eq!(partners(&[1.0, 2.0, 3.0], &[1.0, 2.1, 2.9, 3.1], &[None, Some(2), Some(1)]), [0, 2, 1]);
        assert_eq!(partners(&[1.0, 2.0, 3.0], &[1.0, 2.1, 2.9], &[None, None, Some(0)]), [1, 2, 0]);
    }

    #[test]
    fn a_part_of_a_repeated_eigenvalue_is_no_mode_in_common() {
        let more = [1.0, 2.0, 2.0, 3.0];
        assert!(is_whole(&more, &[0, 1, 2], 1));
        assert!(!is_whole(&more, &[0, 1], 1));
        assert!(is_whole(&more, &[0, 1], 0));
    }

    #[test]
    fn modes_are_named_by_ranges() {
        assert_eq!(some_of(&[0, 1, 2], 3), "all 3");
        assert_eq!(some_of(&[0, 1, 2], 5), "modes 1 to 3");
        assert_eq!(some_of(&[1], 5), "mode 2");
        assert_eq!(some_of(&[0, 1, 4, 6, 7, 8], 20), "modes 1, 2, 5, 7 to 9");
    }

    #[test]
    fn modes_close_in_either_body_are_one_space() {
        let (a, b) = ([1.0, 1.0 + 1e-9, 2.0, 3.0], [1.0, 1.1, 2.0, 2.0 + 1e-7]);
        assert_eq!(clusters(&a, &b), [0..2, 2..4]);
        assert_eq!(clusters(&b, &a), [0..2, 2..4]);
        assert!(clusters(&[], &[]).is_empty());
    }
}
