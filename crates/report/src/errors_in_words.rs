//! Errors and numbers of modes in words.

use super::numbers::significant;
use flexbody_motion::scene::OutputErrors;

/// `attitude 0.001 rad, deflection 1 %, stress 1 %, reaction 1 %`.
pub(super) fn tolerances_in_words(attitude: f64, deflection: f64, stress: f64, reaction: f64) -> String {
    let parts = [("deflection", deflection), ("stress", stress), ("reaction", reaction)];
    let relative = parts.map(|(name, part)| format!("{name} {} %", significant(100.0 * part, 3)));
    format!("attitude {} rad, {}", significant(attitude, 3), relative.join(", "))
}

/// `attitude 1e-4 rad, deflection 0.2 %, stress 0.4 %`.
pub(super) fn errors_in_words(errors: &OutputErrors) -> String {
    let relative = |name: &str, error: Option<f64>| {
        error.map(|error| format!("{name} {} %", significant(100.0 * error, 3)))
    };
    let all = [
        Some(format!("attitude {} rad", significant(errors.attitude, 3))),
        relative("deflection", errors.deflection),
        relative("stress", errors.stress),
        relative("reaction", errors.reaction),
    ];
    all.into_iter().flatten().collect::<Vec<_>>().join(", ")
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
