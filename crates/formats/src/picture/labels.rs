//! Names of modes in pictures, and names of files.

use crate::export::ExportOptions;
use flexbody_body::flex_body::{FlexBody, is_static};

/// Number of significant digits of a frequency.
const DIGITS: usize = 5;

/// Returns `mode_001 (123.4 Hz)` for each of the first `count` modes, or `mode_021 (residual vector: tip x)`
/// for a static shape, whose frequency is no resonance.
pub(crate) fn mode_names(body: &FlexBody, count: usize) -> Vec<String> {
    let width = body.n_modes().to_string().len().max(3);
    let name = |(j, hertz): (usize, &f64)| {
        let origin = body.modes().provenance.get(j).map(String::as_str).unwrap_or_default();
        let what = if is_static(origin) { printable(origin) } else { format!("{} Hz", rounded(*hertz)) };
        format!("mode_{:0width$} ({what})", j + 1)
    };
    body.frequencies_hz().iter().enumerate().take(count).map(name).collect()
}

/// Returns a text of a body for a picture file. Characters that XML forbids or that control a terminal are
/// replaced.
pub(crate) fn printable(text: &str) -> String {
    let strange = |c: char| c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}');
    text.chars().map(|c| if strange(c) { '\u{fffd}' } else { c }).collect()
}

/// Returns advice on the file name if viewers, which detect formats by the extension, would not recognise it.
pub(crate) fn named(options: &ExportOptions, extension: &str) -> Option<String> {
    let name = options.name.as_ref()?;
    let known = name.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension));
    let wanted = name.with_extension(extension);
    let wanted = wanted.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    (!known).then(|| format!("viewers recognise this format by the extension of the file: name it {wanted}"))
}

/// Returns a number with a few digits.
pub(crate) fn rounded(value: f64) -> String {
    let text = format!("{value:.*e}", DIGITS - 1);
    match text.parse::<f64>() {
        Ok(value) if value == 0.0 || (1e-3..1e7).contains(&value) => value.to_string(),
        Ok(value) => format!("{value:e}"),
        Err(_) => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_have_five_digits() {
        for (value, text) in [
            (123.4, "123.4"),
            (1_234_567.0, "1234600"),
            (0.012_345_678, "0.012346"),
            (1e-9, "1e-9"),
            (0.0, "0"),
            (3.0e15, "3e15"),
        ] {
            assert_eq!(rounded(value), text);
        }
    }

    #[test]
    fn what_xml_cannot_hold_is_replaced() {
        assert_eq!(printable("a\u{1}b\n\u{fffe}é"), "a\u{fffd}b\u{fffd}\u{fffd}é");
    }
}
