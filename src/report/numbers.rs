//! Numbers and texts as people read them. JSON never uses these: its floats round-trip.

/// `value` with `digits` significant digits: plain between 1e-4 and 1e7, else with an exponent; no trailing
/// zeros.
pub(super) fn significant(value: f64, digits: usize) -> String {
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

fn trimmed(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

/// A relative error in percent, three digits.
pub(super) fn percent(ratio: f64) -> String {
    format!("{} %", significant(100.0 * ratio, 3))
}

/// A duration.
pub(super) fn duration(seconds: f64) -> String {
    if seconds < 0.9995 {
        format!("{:.0} ms", 1e3 * seconds)
    } else if seconds < 99.5 {
        format!("{seconds:.2} s")
    } else {
        format!("{seconds:.0} s")
    }
}

/// A size in memory or on disk, decimal prefixes.
pub(super) fn bytes(count: u64) -> String {
    let prefixes = [(1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let found = prefixes.iter().find(|(size, _)| count as f64 >= *size);
    found.map_or(format!("{count} B"), |(size, unit)| {
        format!("{} {unit}", significant(count as f64 / size, 3))
    })
}

/// `count` things, with the plural of English nouns.
pub(super) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Text of a file for one line of a terminal or a page: what could steer a terminal or turn the direction of
/// the text is replaced.
pub(super) fn plain(text: &str) -> String {
    let steers = |c: char| {
        c.is_control()
            || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
    };
    text.chars().map(|c| if steers(c) { '\u{fffd}' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn sizes_and_durations_have_the_fitting_unit() {
        assert_eq!(
            [bytes(0), bytes(999), bytes(1000), bytes(1_234_567_890)],
            ["0 B", "999 B", "1 kB", "1.23 GB"]
        );
        assert_eq!(
            [0.0, 0.0125, 0.9996, 59.999, 100.0].map(duration),
            ["0 ms", "12 ms", "1.00 s", "60.00 s", "100 s"]
        );
    }

    #[test]
    fn text_cannot_steer_a_terminal() {
        assert_eq!(plain("a\u{1b}[31mb\n\u{202e}c"), "a\u{fffd}[31mb\u{fffd}\u{fffd}c");
        assert_eq!(plain("Kurbelgehäuse 日本"), "Kurbelgehäuse 日本");
    }
}
