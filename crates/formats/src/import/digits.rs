//! Number of digits of the numbers in a text file.

/// Number format of a file or of a part of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Digits {
    /// Largest number of decimals of numbers without an exponent; `None` if all numbers have exponents.
    fixed: Option<u32>,
    /// True if there are numbers with an exponent.
    exponents: bool,
    /// Largest number of significant digits of any number.
    significant: u32,
    /// Count of nonzero numbers.
    count: usize,
}

/// Smallest count of numbers from which a number format is inferred. A smaller value would take the short
/// exact numbers of a small body written by hand for lost digits.
const MIN_NUMBERS: usize = 20;

impl Digits {
    /// Takes a number in its written form into account.
    pub(crate) fn see(&mut self, text: &str) {
        let mantissa = text.split(['e', 'E', 'd', 'D']).next().unwrap_or("");
        let digits = |part: &str| part.bytes().filter(u8::is_ascii_digit).count() as u32;
        let significant = digits(mantissa.trim_start_matches(['+', '-', '0', '.']));
        self.significant = self.significant.max(significant);
        self.count += usize::from(significant > 0);
        if mantissa.len() < text.len() {
            self.exponents = true;
        } else {
            let decimals = mantissa.split_once('.').map_or(0, |(_, decimals)| digits(decimals));
            self.fixed = self.fixed.max(Some(decimals));
        }
    }

    /// Returns the larger of both in each property.
    pub(crate) fn most(self, other: Self) -> Self {
        Self {
            fixed: self.fixed.max(other.fixed),
            exponents: self.exponents || other.exponents,
            significant: self.significant.max(other.significant),
            count: self.count + other.count,
        }
    }

    /// Returns true if there are too few numbers to infer the digits of the program.
    pub(crate) fn are_few(self) -> bool {
        self.count < MIN_NUMBERS
    }

    /// Returns the format in words: `6 decimals without exponents`, `7 significant digits`.
    pub(crate) fn words(self) -> String {
        match self.fixed.filter(|_| !self.exponents) {
            Some(decimals) => format!("{decimals} decimals without exponents"),
            None => format!("{} significant digits", self.significant),
        }
    }

    /// Returns half a unit of the last digit of an array with the largest number `size`. Short numbers in a
    /// file with longer ones are exact.
    pub(crate) fn rounding(self, size: f64) -> f64 {
        let half = |digits: u32| 0.5 * 0.1f64.powi(digits.min(400) as i32);
        match self.fixed.filter(|_| !self.exponents) {
            Some(decimals) => half(decimals),
            None => half(self.significant) * 10.0 * size,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_unit_of_the_last_digit() {
        let seen_in = |texts: &[&str]| {
            let mut digits = Digits::default();
            texts.iter().for_each(|text| digits.see(text));
            digits
        };
        let six = seen_in(&["0.123456", "1.5", "-12.000001"]);
        assert!((six.rounding(3.0) - 5e-7).abs() < 1e-20);
        let scientific = seen_in(&["1.23456D+03", "-0.00D+00"]);
        assert!((scientific.rounding(1.0) - 5e-6).abs() < 1e-18);
        let full = seen_in(&["7", "1e-05", "0.12345678901234567"]);
        assert!(full.rounding(7.0) < 1e-15);
        assert!(
            full.are_few()
                && !seen_in(&["1.5"; MIN_NUMBERS]).are_few()
                && seen_in(&["0.0"; MIN_NUMBERS]).are_few()
        );
    }
}
