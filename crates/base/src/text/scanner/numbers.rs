//! Numbers in fields.

/// Returns the whole number in a field; `None` if it is none.
#[inline]
pub fn whole(field: &[u8]) -> Option<i64> {
    /// Number of digits that fit into an i64, whichever digits they are.
    const MAX_DIGITS: usize = 18;
    let digits = match field {
        [b'+' | b'-', digits @ ..] => digits,
        digits => digits,
    };
    if digits.is_empty() || digits.len() > MAX_DIGITS {
        return std::str::from_utf8(field).ok()?.parse().ok();
    }
    let mut number = 0;
    for digit in digits {
        number = 10 * number + i64::from(digit.is_ascii_digit().then(|| digit - b'0')?);
    }
    Some(if field[0] == b'-' { -number } else { number })
}

/// Returns the whole number in a field. `3.0` and `3e0`, as numerical tools write them, are accepted.
#[inline]
pub fn integer(field: &[u8]) -> Option<i64> {
    whole(field).or_else(|| {
        let value = fast_float2::parse::<f64, _>(field).ok()?;
        // Beyond 2^53 a float does not determine the whole number.
        (value.fract() == 0.0 && value.abs() <= 9_007_199_254_740_992.0).then_some(value as i64)
    })
}

/// Returns the number in a field. The exponent may have the letter D, as Fortran writes it.
#[inline]
pub fn number(field: &[u8]) -> Option<f64> {
    match exponent_letter(field).filter(|&at| matches!(field[at], b'd' | b'D')) {
        Some(at) => with_exponent(&field[..at], &field[at + 1..]),
        None => fast_float2::parse(field).ok(),
    }
}

/// Returns the number in a field in any form of Fortran: `1.0D+05`, `1.0Q5`, and `1.0-105` of exponents with three
/// digits. In fields without a separator or column of their own the last form is ambiguous: see [`number`].
#[inline]
pub fn real(field: &[u8]) -> Option<f64> {
    if let Some(at) = exponent_letter(field).filter(|&at| matches!(field[at], b'd' | b'D' | b'q' | b'Q')) {
        return with_exponent(&field[..at], &field[at + 1..]);
    }
    if let Ok(value) = fast_float2::parse(field) {
        return Some(value);
    }
    let sign = (1..field.len()).find(|&k| matches!(field[k], b'+' | b'-'))?;
    if !matches!(field[sign - 1], b'0'..=b'9' | b'.') {
        return None;
    }
    with_exponent(&field[..sign], &field[sign..])
}

/// Returns the position of the last byte that is neither a digit nor a sign: only those follow the letter of an
/// exponent.
#[inline]
fn exponent_letter(field: &[u8]) -> Option<usize> {
    field.iter().rposition(|b| !matches!(b, b'0'..=b'9' | b'+' | b'-'))
}

/// Parses a mantissa and an exponent with the letter E between them.
fn with_exponent(mantissa: &[u8], exponent: &[u8]) -> Option<f64> {
    let length = mantissa.len() + 1 + exponent.len();
    let (mut short, mut long) = ([0; 64], Vec::new());
    let text = match short.get_mut(..length) {
        Some(text) => text,
        None => {
            long.resize(length, 0);
            &mut long[..]
        }
    };
    text[..mantissa.len()].copy_from_slice(mantissa);
    text[mantissa.len()] = b'e';
    text[mantissa.len() + 1..].copy_from_slice(exponent);
    fast_float2::parse(&*text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers() {
        for (text, value) in [("7", 7), ("-3", -3), ("+4", 4), ("1.0", 1), ("2.000e+01", 20)] {
            assert_eq!(integer(text.as_bytes()), Some(value), "{text}");
            assert_eq!(whole(text.as_bytes()), Some(value).filter(|_| !text.contains('.')), "{text}");
        }
        for text in ["", "1.5", "x", "nan", "inf", "1e300", "1 2", "+", "9223372036854775808"] {
            assert_eq!(integer(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn numbers_in_every_form() {
        for (text, value) in [
            ("1.0D+05", 1e5),
            ("1.0d5", 1e5),
            ("-1.5Q-3", -1.5e-3),
            ("+2.5e+1", 25.0),
            ("1.25-105", 1.25e-105),
            ("-.5+003", -500.0),
            (".5", 0.5),
            ("5.", 5.0),
        ] {
            assert_eq!(real(text.as_bytes()), Some(value), "{text}");
            let is_fortran_only = matches!(text, "-1.5Q-3" | "1.25-105" | "-.5+003");
            assert_eq!(number(text.as_bytes()), Some(value).filter(|_| !is_fortran_only), "{text}");
        }
        for text in ["", "D", "1.0D", "1,5", "--1", "1e5e5", "0x10", "1_000", "+", "1-", "e5", "1.5-2-3"] {
            assert_eq!((real(text.as_bytes()), number(text.as_bytes())), (None, None), "{text}");
        }
    }
}
