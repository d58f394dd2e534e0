//! Errors and numbers of modes in words.

use super::numbers::significant;
use flexbody_base::numbers::joined_runs;
use flexbody_motion::scene::OutputErrors;

/// Returns the error of a quantity in words: `0.001 rad` for the attitude, `1 %` for other quantities.
pub(super) fn error_in_words(quantity: &str, error: f64, digits: usize) -> String {
    match quantity {
        "attitude" => format!("{} rad", significant(error, digits)),
        _ => format!("{} %", significant(100.0 * error, digits)),
    }
}

/// Returns errors with three digits: `attitude 1e-4 rad, deflection 0.2 %, stress 0.4 %`.
pub(super) fn errors_in_words(errors: &OutputErrors) -> String {
    errors_to_digits(errors, 3)
}

/// Returns the known errors in words with the given number of significant digits.
pub(super) fn errors_to_digits(errors: &OutputErrors, digits: usize) -> String {
    let part =
        |(name, error): (&str, Option<f64>)| Some(format!("{name} {}", error_in_words(name, error?, digits)));
    errors.named().into_iter().filter_map(part).collect::<Vec<_>>().join(", ")
}

/// Returns ascending numbers with runs joined: 1-4, 7, 9-10.
pub(super) fn ranges(numbers: &[usize]) -> String {
    joined_runs(numbers, ", ")
}

/// Returns the inertia terms of a model: `W1, W2 and W3`.
pub(super) fn groups_in_words(names: &[&str]) -> String {
    match names {
        [] => "the inertia of the undeformed body only".to_owned(),
        [only] => (*only).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Returns a ratio as `60 %`, or `not known`.
pub(super) fn part_in_words(part: Option<f64>) -> String {
    part.map_or_else(|| "not known".to_owned(), |part| format!("{} %", significant(100.0 * part, 2)))
}

#[cfg(test)]
mod tests {
    #[test]
    fn runs_of_numbers_are_drawn_together() {
        assert_eq!(super::ranges(&[1, 2, 3, 5, 7, 8]), "1-3, 5, 7-8");
        assert_eq!(super::ranges(&[]), "");
    }

    #[test]
    fn groups_are_listed_with_an_and() {
        let none: &[&str] = &[];
        let lists = [none, &["W1"][..], &["W1", "W3"][..], &["W1", "W2", "W3"][..]];
        let expected = ["the inertia of the undeformed body only", "W1", "W1 and W3", "W1, W2 and W3"];
        assert_eq!(lists.map(super::groups_in_words), expected);
    }
}
