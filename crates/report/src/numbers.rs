//! Numbers and texts in readable form. JSON never uses these functions: its floats round-trip.

pub(super) use flexbody_base::numbers::significant;

/// Returns a relative error in percent with three digits.
pub(super) fn percent(ratio: f64) -> String {
    format!("{} %", significant(100.0 * ratio, 3))
}

/// Returns a duration.
pub(super) fn duration(seconds: f64) -> String {
    if seconds < 0.9995 {
        format!("{:.0} ms", 1e3 * seconds)
    } else if seconds < 99.5 {
        format!("{seconds:.2} s")
    } else {
        format!("{seconds:.0} s")
    }
}

/// Returns the times of a run: `3.25 s wall, 6.26 s CPU`.
pub(super) fn times(wall_seconds: f64, cpu_seconds: f64) -> String {
    format!("{} wall, {} CPU", duration(wall_seconds), duration(cpu_seconds))
}

/// Returns a size in memory or on disk with a decimal prefix.
pub(super) fn bytes(count: u64) -> String {
    let prefixes = [(1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let found = prefixes.iter().find(|(size, _)| count as f64 >= *size);
    found.map_or(format!("{count} B"), |(size, unit)| {
        format!("{} {unit}", significant(count as f64 / size, 3))
    })
}

/// Returns `count` with an English noun in singular or plural.
pub(super) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Returns a fragment with an upper-case first letter.
pub(super) fn sentence(fragment: &str) -> String {
    let mut characters = fragment.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}

/// Returns three values and their unit.
pub(super) fn triple(values: &[f64; 3], unit: &str) -> String {
    let [x, y, z] = values.map(|v| significant(v, 6));
    format!("{x}, {y}, {z} {unit}")
}

/// Returns three coordinates; values that are rounding relative to `size` are written as zero.
pub(super) fn coordinates(values: &[f64; 3], size: f64, unit: &str) -> String {
    triple(&values.map(|v| if v.abs() <= 1e-12 * size { 0.0 } else { v }), unit)
}

/// Returns a text from a file for one line of a terminal or a page. Characters that control a terminal or
/// change the direction of text are replaced.
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
