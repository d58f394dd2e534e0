//! Numbers for human readers. Files do not use these functions: their floats round-trip.

/// Returns a part in percent with the one digit that an estimate has; its second digit may hang on rounding.
pub fn about_percent(part: f64) -> String {
    let digit = format!("{:.0e}", 100.0 * part).parse().unwrap_or(f64::NAN);
    format!("{} %", significant(digit, 6))
}

/// Returns `value` with `digits` significant digits: plain between 1e-4 and 1e7, otherwise with an exponent; without
/// trailing zeros.
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "not finite".to_owned();
    }
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if value != 0.0 && !(-4..7).contains(&exponent) {
        return format!("{}e{exponent}", trimmed(mantissa));
    }
    let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
    let plain = trimmed(&format!("{value:.decimals$}")).to_owned();
    if plain == "-0" { "0".to_owned() } else { plain }
}

/// Parses a ratio as users write it: `0.01`, `1%` or `1 %`. Returns `None` for another text.
pub fn parse_ratio(text: &str) -> Option<f64> {
    match text.trim().strip_suffix('%') {
        Some(percent) => percent.trim_end().parse::<f64>().ok().map(|percent| percent / 100.0),
        None => text.trim().parse().ok(),
    }
}

/// Returns the first and last number of each run of consecutive numbers.
pub fn runs(numbers: &[usize]) -> Vec<(usize, usize)> {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b);
    runs.filter_map(|run| Some((*run.first()?, *run.last()?))).collect()
}

/// Returns ascending numbers as a list of runs with `separator` between them: `1-4,7,9-10`.
pub fn joined_runs(numbers: &[usize], separator: &str) -> String {
    let run = |(first, last): &(usize, usize)| match last - first {
        0 => first.to_string(),
        _ => format!("{first}-{last}"),
    };
    runs(numbers).iter().map(run).collect::<Vec<_>>().join(separator)
}

/// Removes the zeros at the end of a number with decimals.
fn trimmed(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_may_be_percentages() {
        for (text, ratio) in
            [("0.01", 0.01), ("1%", 0.01), (" 2.5 % ", 0.025), ("-1%", -0.01), ("1e-6", 1e-6)]
        {
            assert_eq!(parse_ratio(text), Some(ratio), "{text}");
        }
        for text in ["", "%", "1%%", "one", "% 1", "1 percent"] {
            assert_eq!(parse_ratio(text), None, "{text}");
        }
    }

    #[test]
    fn numbers_keep_their_significant_digits() {
        for (value, digits, expected) in [
            (0.0, 5, "0"),
            (-0.0, 5, "0"),
            (1234.5678, 5, "1234.6"),
            (999.999, 5, "1000"),
            (0.00012345678, 5, "0.00012346"),
            (0.000012345678, 5, "1.2346e-5"),
            (12345678.0, 5, "1.2346e7"),
            (9999999.9, 5, "1e7"),
            (123456.7, 5, "123457"),
            (-1.5, 5, "-1.5"),
            (1e300, 3, "1e300"),
            (5e-324, 3, "4.94e-324"),
            (f64::NAN, 3, "not finite"),
        ] {
            assert_eq!(significant(value, digits), expected);
        }
    }
}
