//! The number of decimal digits that the values of a matrix really carry.
//!
//! FE programs write 6, 14 or 17 digits, and scripts copy a 14-digit value as 17 digits (`7.9642450142449999e+08` is
//! 796424501.4245). The relevant digits are those of the shortest decimal number that reads back as the value.

use std::collections::HashSet;

/// Number of examined entries, evenly spread.
const SAMPLES: usize = 20_000;

/// Number of digits from which on the digits of the values are accepted without further evidence.
const MIN_DIGITS: u8 = 10;

/// Returns the number of significant decimal digits (1 to 17) of `count` values; `value(k)` returns the k-th. `written`
/// is the largest number of digits with which the file writes a value (17 for binary files).
///
/// Few digits mean rounding only if there is evidence: the mass matrix of a uniform mesh holds a few exact short
/// numbers. Such a matrix counts as exact (17), and so does one of a few numbers of which most are much shorter than the
/// longest, as sums of short numbers of different sizes are (`1e12 + 1.296e6`): of numbers that are rounded to some digits
/// nine in ten have all of these, and 99 in a hundred all but one.
pub(super) fn significant_digits(count: usize, written: u8, value: impl Fn(usize) -> f64) -> u8 {
    let step = count.div_ceil(SAMPLES).max(1);
    let (mut digits, mut distinct) = (0u8, HashSet::new());
    let mut text = String::new();
    // Number of distinct values with each number of digits.
    let mut with_digits = [0; 18];
    for k in (0..count).step_by(step) {
        let v = value(k).abs();
        if v != 0.0 && distinct.insert(v.to_bits()) {
            let own = shortest(v, &mut text);
            with_digits[usize::from(own.min(17))] += 1;
            digits = digits.max(own);
        }
    }
    let exact = (digits <= 4 && distinct.len() <= 32) || (written >= MIN_DIGITS && distinct.len() <= 256);
    let long: usize = with_digits[usize::from(digits.min(17)).saturating_sub(1)..].iter().sum();
    // A file that writes three digits more than the longest number has would have shown the digits of other numbers.
    let are_sums = written >= digits.saturating_add(3) && distinct.len() <= 256 && 2 * long < distinct.len();
    match digits {
        MIN_DIGITS.. if are_sums => 17,
        MIN_DIGITS.. => digits,
        _ if exact => 17,
        _ if written < MIN_DIGITS => written.max(digits),
        _ => digits,
    }
}

/// Returns the number of digits of the shortest decimal number that reads back as `v`.
fn shortest(v: f64, text: &mut String) -> u8 {
    use std::fmt::Write;
    text.clear();
    write!(text, "{v:e}").expect("writing to a String cannot fail");
    let mantissa = text.split('e').next().unwrap_or("");
    mantissa.bytes().filter(u8::is_ascii_digit).count() as u8
}

/// Number of values per piece of a file whose written digits are counted.
pub(super) const COUNTED: usize = 512;

/// Returns the number of written significant digits: leading zeros and the exponent do not count.
pub(super) fn written_digits(number: &[u8]) -> u8 {
    let mantissa = number.iter().take_while(|b| matches!(b, b'0'..=b'9' | b'.' | b'+' | b'-'));
    let digits = mantissa.filter(|b| b.is_ascii_digit()).skip_while(|&&b| b == b'0').count();
    digits.min(17) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn digits(values: &[f64], written: u8) -> u8 {
        significant_digits(values.len(), written, |k| values[k])
    }

    #[test]
    fn values_rounded_before_they_were_written_in_full_are_seen_through() {
        let padded: f64 = "7.9642450142449999e+08".parse().unwrap();
        assert_eq!(digits(&[padded, 1.0], 17), 13);
        assert_eq!(digits(&[0.1 + 0.2], 17), 17);
    }

    #[test]
    fn short_exact_numbers_count_as_exact() {
        assert_eq!(digits(&[1000.0, -1000.0, 0.25], 4), 17); // springs
        assert_eq!(digits(&[6.132_812_5e-4, 1.226_562_5e-3], 17), 17); // uniform mesh, long fields
        let springs = [1e4, 1.296e6, 2.592e6, 3.36e6, 6.72e6, 6.73e6, 2.1e9, 1e12, 1e12 + 1.296e6];
        assert_eq!(digits(&springs, 17), 17); // sums of springs and a stiff joint
        assert_eq!(digits(&springs, 10), 10); // a file without room for more digits
    }

    #[test]
    fn rounded_numbers_count_as_written() {
        let rounded: Vec<f64> =
            (1..200).map(|k| format!("{:.5e}", (k as f64).sqrt()).parse().unwrap()).collect();
        assert_eq!(digits(&rounded, 6), 6);
        let long: Vec<f64> =
            (1..200).map(|k| format!("{:.11e}", (k as f64).sqrt()).parse().unwrap()).collect();
        assert_eq!(digits(&long, 17), 12);
        let many: Vec<f64> =
            (1..2000).map(|k| format!("{:.5e}", (k as f64).sqrt()).parse().unwrap()).collect();
        assert_eq!(digits(&many, 17), 6); // a binary file of rounded numbers
    }

    #[test]
    fn digits_as_written() {
        for (text, expected) in [("1.50e+3", 3), ("-0.0012D-10", 2), ("+100", 3), ("0.", 0)] {
            assert_eq!(written_digits(text.as_bytes()), expected, "{text}");
        }
    }
}
