//! Units of single values by their names, such as `MPa`, `N mm` or `lb in^2/s^2`, as rows of tables state them.

use super::units::{LENGTH, MASS, PREFIXES, TIME, Unit};

/// Unit of a value: its size in SI and its powers of mass, length and time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedUnit {
    /// Size in kg, m and s.
    pub to_si: f64,
    /// Powers of mass, length and time.
    pub powers: [i32; 3],
}

/// Units with SI prefixes: name and powers of mass, length and time.
const PREFIXED: [(&str, [i32; 3]); 4] =
    [("Pa", [1, -1, -2]), ("N", [1, 1, -2]), ("J", [1, 2, -2]), ("W", [1, 2, -3])];

/// Other derived units: name, size in SI, and powers of mass, length and time.
const OTHERS: [(&str, f64, [i32; 3]); 8] = [
    ("bar", 1e5, [1, -1, -2]),
    ("psi", 6_894.757_293_168_361, [1, -1, -2]),
    ("ksi", 6_894_757.293_168_361, [1, -1, -2]),
    ("lbf", 4.448_221_615_260_5, [1, 1, -2]),
    ("kip", 4_448.221_615_260_5, [1, 1, -2]),
    ("Hz", 1.0, [0, 0, -1]),
    ("rad", 1.0, [0; 3]),
    ("deg", std::f64::consts::PI / 180.0, [0; 3]),
];

/// Largest power of a factor that is read.
const MAX_POWER: i32 = 9;

impl NamedUnit {
    /// Parses factors with blanks or `*` between them, each with a power such as `^2` or `2`; factors after `/` divide. A factor
    /// may be a size in brackets, such as `[0.2 m]`. Returns `None` for a name that is not known.
    pub fn parse(text: &str) -> Option<Self> {
        let mut unit = Self { to_si: 1.0, powers: [0; 3] };
        for (at, part) in text.split('/').enumerate() {
            let sign = if at == 0 { 1 } else { -1 };
            for factor in factors(part)? {
                unit = unit.times(Self::factor(factor)?, sign);
            }
        }
        Some(unit)
    }

    /// Returns the factor that takes values in this unit to values in `other`; `None` for units of other quantities.
    pub fn factor_to(self, other: Self) -> Option<f64> {
        (self.powers == other.powers).then(|| self.to_si / other.to_si)
    }

    fn times(self, other: Self, power: i32) -> Self {
        let powers = std::array::from_fn(|k| self.powers[k] + power * other.powers[k]);
        Self { to_si: self.to_si * other.to_si.powi(power), powers }
    }

    fn factor(text: &str) -> Option<Self> {
        if let Some(size) = text.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            let (number, unit) = size.split_once(' ')?;
            let number: f64 =
                number.parse().ok().filter(|number: &f64| number.is_finite() && *number > 0.0)?;
            let unit = Self::base(unit)?;
            return Some(Self { to_si: number * unit.to_si, ..unit });
        }
        let name = text.trim_end_matches(|c: char| c.is_ascii_digit());
        let power = match &text[name.len()..] {
            "" => 1,
            digits => digits.parse().ok().filter(|power| (1..=MAX_POWER).contains(power))?,
        };
        let name = name.strip_suffix('^').unwrap_or(name);
        let none = Self { to_si: 1.0, powers: [0; 3] };
        Some(none.times(Self::base(name).or_else(|| Self::derived(name))?, power))
    }

    fn base(name: &str) -> Option<Self> {
        let tables = [(MASS, [1, 0, 0]), (LENGTH, [0, 1, 0]), (TIME, [0, 0, 1])];
        tables.into_iter().find_map(|(table, powers)| {
            Unit::named(name, table).map(|unit| Self { to_si: unit.to_si(), powers })
        })
    }

    fn derived(name: &str) -> Option<Self> {
        if let Some((_, to_si, powers)) = OTHERS.into_iter().find(|(known, ..)| *known == name) {
            return Some(Self { to_si, powers });
        }
        PREFIXED.into_iter().find_map(|(known, powers)| {
            let written = name.strip_suffix(known)?;
            let (power, _) = PREFIXES.iter().find(|(_, prefix)| *prefix == written)?;
            Some(Self { to_si: 10f64.powi(*power), powers })
        })
    }
}

/// Returns the factors of a product, a size in brackets as one; `None` for an open bracket or a product without factors.
fn factors(text: &str) -> Option<Vec<&str>> {
    let mut found = Vec::new();
    let mut rest = text.trim_matches(' ');
    while !rest.is_empty() {
        let end = if rest.starts_with('[') {
            rest.find(']')? + 1
        } else {
            rest.find([' ', '*']).unwrap_or(rest.len())
        };
        found.push(&rest[..end]);
        rest = rest[end..].trim_start_matches([' ', '*']);
    }
    (!found.is_empty()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factor(from: &str, to: &str) -> Option<f64> {
        NamedUnit::parse(from)?.factor_to(NamedUnit::parse(to)?)
    }

    #[test]
    fn units_of_one_quantity_are_converted() {
        for (from, to, expected) in [
            ("MPa", "Pa", 1e6),
            ("N/mm^2", "MPa", 1.0),
            ("N/mm2", "kPa", 1e3),
            ("N mm", "N m", 1e-3),
            ("kN*m", "N mm", 1e6),
            ("mm", "m", 1e-3),
            ("in", "[0.0254 m]", 1.0),
            ("N [0.2 m]", "N m", 0.2),
            ("psi", "lbf/in^2", 1.0),
            ("lb in/s^2", "N", 0.453_592_37 * 0.0254),
            ("t mm/s^2", "N", 1.0),
            ("mJ", "N mm", 1.0),
            ("deg", "rad", std::f64::consts::PI / 180.0),
        ] {
            let found = factor(from, to).unwrap_or_else(|| panic!("{from} in {to}"));
            assert!((found / expected - 1.0).abs() < 1e-12, "{from} in {to}: {found}");
        }
    }

    #[test]
    fn other_quantities_and_unknown_names_are_not() {
        for (from, to) in
            [("MPa", "N"), ("mm", "s"), ("N mm", "N"), ("stress", "MPa"), ("", "mm"), ("N/", "N")]
        {
            assert_eq!(factor(from, to), None, "{from} in {to}");
        }
        for text in ["[0.2 m", "[m]", "[-1 m]", "mm^99", "2", "^2", "xPa"] {
            assert_eq!(NamedUnit::parse(text), None, "{text}");
        }
    }
}
