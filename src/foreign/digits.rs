//! With how many digits a file of text writes its numbers.

/// Digits of numbers as they are written.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Digits {
    /// Most decimals of numbers without an exponent.
    decimals: usize,
    /// Whether a number has an exponent.
    exponents: bool,
    /// Most significant digits of any number.
    significant: usize,
    /// Numbers that are not zero.
    count: usize,
}

/// Fewer numbers say nothing: a small body by hand has short ones that are exact.
const FEW: usize = 20;

impl Digits {
    /// Takes a number into account.
    pub(super) fn see(&mut self, text: &str) {
        let mantissa = text.split(['e', 'E']).next().unwrap_or("");
        let digits = |part: &str| part.bytes().filter(u8::is_ascii_digit).count();
        let significant = digits(mantissa.trim_start_matches(['+', '-', '0', '.']));
        self.significant = self.significant.max(significant);
        self.count += usize::from(significant > 0);
        if mantissa.len() < text.len() {
            self.exponents = true;
        } else {
            self.decimals = self.decimals.max(mantissa.split_once('.').map_or(0, |(_, part)| digits(part)));
        }
    }

    /// Half a unit of the last digit of a number of size one, as far as the file shows it.
    pub(super) fn rounding(&self) -> f64 {
        if self.count < FEW {
            return 0.0;
        }
        let places = if self.exponents { self.significant.saturating_sub(1) } else { self.decimals };
        0.5 * 0.1f64.powi(i32::try_from(places).unwrap_or(i32::MAX))
    }

    /// `6 decimals without exponents`, `7 significant digits`.
    pub(super) fn words(&self) -> String {
        match self.exponents {
            true => format!("{} significant digits", self.significant),
            false => format!("{} decimals without exponents", self.decimals),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(texts: &[&str]) -> Digits {
        let mut digits = Digits::default();
        texts.iter().cycle().take(texts.len() * FEW).for_each(|text| digits.see(text));
        digits
    }

    #[test]
    fn rounding_is_half_a_unit_of_the_last_digit() {
        assert!((of(&["0.123456", "1.5", "-12.000001"]).rounding() - 5e-7).abs() < 1e-20);
        assert!((of(&["1.23456E+03", "-0.00e+00"]).rounding() - 5e-6).abs() < 1e-18);
        assert!(of(&["7", "1e-05", "0.12345678901234567"]).rounding() < 1e-15);
        assert_eq!(of(&["0.0", "0"]).rounding(), 0.0);
    }
}
