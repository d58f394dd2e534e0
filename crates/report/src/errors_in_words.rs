//! Errors and numbers of modes in words.

use super::numbers::significant;
use flexbody_motion::scene::OutputErrors;

/// Error of a quantity in words: `0.001 rad` of the attitude, `1 %` of others.
pub(super) fn error_in_words(quantity: &str, error: f64, digits: usize) -> String {
    match quantity {
        "attitude" => format!("{} rad", significant(error, digits)),
        _ => format!("{} %", significant(100.0 * error, digits)),
    }
}

/// `attitude 1e-4 rad, deflection 0.2 %, stress 0.4 %`.
pub(super) fn errors_in_words(errors: &OutputErrors) -> String {
    errors_to_digits(errors, 3)
}

/// Known errors in words, with the given number of significant digits.
pub(super) fn errors_to_digits(errors: &OutputErrors, digits: usize) -> String {
    let part =
        |(name, error): (&str, Option<f64>)| Some(format!("{name} {}", error_in_words(name, error?, digits)));
    errors.named().into_iter().filter_map(part).collect::<Vec<_>>().join(", ")
}

/// Ascending numbers with runs drawn together: 1-4, 7, 9-10.
pub(super) fn ranges(numbers: &[usize]) -> String {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for &number in numbers {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => runs.push((number, number)),
        }
    }
    let run = |(first, last): &(usize, usize)| match last - first {
        0 => first.to_string(),
        _ => format!("{first}-{last}"),
    };
    runs.iter().map(run).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    #[test]
    fn runs_of_numbers_are_drawn_together() {
        assert_eq!(super::ranges(&[1, 2, 3, 5, 7, 8]), "1-3, 5, 7-8");
        assert_eq!(super::ranges(&[]), "");
    }
}
