//! Comparison of the frequencies in the texts of the modes with those of the matrices.

use crate::import::AuditCheck;
use crate::sid::read::arrays::Arrays;
use crate::sid::read::parse::Listed;
use flexbody_base::diagnostic::Code;
use std::f64::consts::TAU;

/// Relative tolerance of frequencies in texts, which are often those of the model before its reduction. A
/// smaller value reports the error of the reduction.
const FREQUENCY: f64 = 0.01;

/// Largest entries of Ke off the diagonal, relative to the diagonal, for which the diagonal gives the
/// frequencies.
const DIAGONAL: f64 = 1e-6;

/// Returns the frequency in a text such as `Eigen Mode 1 : 9.089 Hz` in the unit of the text, half a unit of
/// its last digit, and true if the unit is radians.
fn frequency_of(text: &str) -> Option<(f64, f64, bool)> {
    let words: Vec<&str> =
        text.split([' ', '\t', ':', '=', ',', ';']).filter(|word| !word.is_empty()).collect();
    let unit = |word: &str| {
        let word = word.to_lowercase();
        if word == "rad/s" { Some(true) } else { (word == "hz" || word.starts_with("1/")).then_some(false) }
    };
    words.windows(2).find_map(|pair| {
        let radians = unit(pair[1])?;
        let value: f64 = pair[0].replace(['D', 'd'], "e").parse().ok().filter(|v: &f64| v.is_finite())?;
        let (mantissa, exponent) = pair[0].split_once(['e', 'E', 'd', 'D']).unwrap_or((pair[0], "0"));
        let decimals = mantissa.split_once('.').map_or(0, |(_, decimals)| decimals.len()) as f64;
        let exponent: f64 = exponent.parse().unwrap_or(0.0);
        Some((value, 0.5 * 10f64.powf(exponent - decimals), radians))
    })
}

/// Returns the check of the text with the largest difference; `None` if no text has a frequency or the modes
/// are coupled by Ke.
pub(crate) fn frequencies(listed: &Listed<'_>, arrays: &Arrays) -> Option<AuditCheck> {
    let (ke, me, nq) = (&arrays.ke.m0, &arrays.me.m0, arrays.nq);
    let coupled = (0..nq).any(|i| {
        (0..nq).any(|j| i != j && ke[(i, j)].abs() > DIAGONAL * (ke[(i, i)] * ke[(j, j)]).abs().sqrt())
    });
    if coupled {
        return None;
    }
    // Compared values: mode, frequency of the text, frequency of the matrices, and the relative difference
    // beyond the digits of the text.
    let compared = |&(mode, text): &(usize, &str)| {
        let (said, half, radians) = frequency_of(text)?;
        let lambda = (mode < nq).then(|| ke[(mode, mode)] / me[(mode, mode)])?;
        let computed = lambda.sqrt() / if radians { 1.0 } else { TAU };
        let apart = ((said - computed).abs() - half).max(0.0) / computed;
        Some((mode, said / computed, if lambda > 0.0 { apart } else { f64::NAN }))
    };
    let all: Vec<(usize, f64, f64)> = listed.mode_texts.iter().filter_map(compared).collect();
    let &(mode, ratio, value) = all.iter().max_by(|a, b| a.2.total_cmp(&b.2))?;
    let known = [
        (TAU, "2 pi, as if radians per second were meant"),
        (1.0 / TAU, "1 / (2 pi), as if radians per second were meant"),
        (1000.0, "1000, as if milliseconds were mixed with seconds"),
        (0.001, "1/1000, as if milliseconds were mixed with seconds"),
        (
            1000f64.sqrt(),
            "sqrt(1000), as if a mass or length were in a unit 1000 times too large or too small",
        ),
        (
            0.001f64.sqrt(),
            "1/sqrt(1000), as if a mass or length were in a unit 1000 times too large or too small",
        ),
        (60.0, "60, as if revolutions per minute were meant"),
    ];
    let factor = known.iter().find(|(factor, _)| (ratio / factor - 1.0).abs() < FREQUENCY);
    let factor = factor.map_or_else(|| format!("{ratio:.4}"), |(_, words)| (*words).to_owned());
    Some(AuditCheck {
        name: "frequencies",
        formula: "frequency of the text of each mode = sqrt(Ke/Me) / (2 pi)",
        value,
        limit: FREQUENCY,
        code: Code::AuditUnits,
        meaning: format!(
            "the frequency in the text of mode {} differs from that of stiffness and mass by the factor {factor}",
            mode + 1
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_of_texts() {
        let (value, half, radians) = frequency_of("Eigen Mode    1 :        9.089 Hz").expect("a frequency");
        assert!(value == 9.089 && (half - 5e-4).abs() < 1e-16 && !radians);
        let (value, half, _) = frequency_of("Eigen Mode 3 : 1.25e-3 1/ms").expect("a frequency");
        assert!(value == 1.25e-3 && (half - 5e-6).abs() < 1e-18);
        assert_eq!(frequency_of("7 rad/s").map(|f| (f.0, f.2)), Some((7.0, true)));
        assert_eq!(frequency_of("MatMorembs ansatz function #1"), None);
    }
}
