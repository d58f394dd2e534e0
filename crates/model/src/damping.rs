//! Damping given by the user.

use flexbody_base::text::walk::{Value, Walk};
use toml::de::DeValue;

/// Damping of a body. `D` is the type of the matrix: a path, a matrix as read, or the checked matrix.
#[derive(Debug, Clone, PartialEq, strum::IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
pub enum Damping<D> {
    /// One ratio for all modes.
    Ratio(f64),
    /// Ratios by frequency; bands ascend, the last has no end.
    Bands(Vec<DampingBand>),
    /// D = alpha M + beta K.
    Rayleigh {
        /// Mass-proportional factor. Unit: 1/time.
        alpha: f64,
        /// Stiffness-proportional factor. Unit: time.
        beta: f64,
    },
    /// D (N x N, rows as K), symmetric and positive semidefinite. Unit: mass/time.
    Matrix(D),
}

/// Range of frequencies with one damping ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DampingBand {
    /// End of the band, included, in hertz for any unit of time; infinite for the last band.
    pub to_hz: f64,
    /// Damping ratio of the modes in the band.
    pub ratio: f64,
}

/// Damping ratios of modes by their frequencies; bands ascend, the last has no end.
#[derive(Debug, Clone, PartialEq)]
pub struct DampingRatios(Vec<DampingBand>);

impl DampingRatios {
    /// Creates the ratios from `bands`.
    ///
    /// # Errors
    /// A text with the reason: no band; a ratio that is negative or not finite; ends that are not positive
    /// or do not ascend; a last band with an end.
    pub fn new(bands: Vec<DampingBand>) -> Result<Self, String> {
        match Damping::<()>::Bands(bands.clone()).problem() {
            Some(problem) => Err(problem),
            None => Ok(Self(bands)),
        }
    }

    /// Returns the bands.
    pub fn bands(&self) -> &[DampingBand] {
        &self.0
    }

    /// Returns the ratio at a frequency in hertz: that of the first band whose end is not below the
    /// frequency.
    pub fn at(&self, hertz: f64) -> f64 {
        ratio_at(&self.0, hertz)
    }
}

impl From<f64> for DampingRatios {
    /// Creates one ratio for all frequencies.
    fn from(ratio: f64) -> Self {
        Self(vec![DampingBand { to_hz: f64::INFINITY, ratio }])
    }
}

impl std::fmt::Display for DampingRatios {
    /// Formats the ratios as `0.02`, or `0.01 to 100 Hz, 0.1 to 1000 Hz, 1 above`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (last, closed) = self.0.split_last().expect("at least one band");
        closed.iter().try_for_each(|band| write!(f, "{} to {} Hz, ", band.ratio, band.to_hz))?;
        write!(f, "{}{}", last.ratio, if closed.is_empty() { "" } else { " above" })
    }
}

/// Returns the ratio of the first band that reaches `hertz`; the last one has no end.
pub fn ratio_at(bands: &[DampingBand], hertz: f64) -> f64 {
    bands.iter().find(|band| hertz <= band.to_hz).map_or(0.0, |band| band.ratio)
}

impl<D> Damping<D> {
    /// Returns the key of the manifest: `ratio`, `bands`, `rayleigh` or `matrix`.
    pub fn name(&self) -> &'static str {
        self.into()
    }

    /// Returns the matrix, if damping is given by one.
    pub fn matrix(&self) -> Option<&D> {
        match self {
            Self::Matrix(matrix) => Some(matrix),
            _ => None,
        }
    }

    /// Returns the damping with a borrowed matrix.
    pub fn borrowed(&self) -> Damping<&D> {
        match self {
            Self::Ratio(ratio) => Damping::Ratio(*ratio),
            Self::Bands(bands) => Damping::Bands(bands.clone()),
            Self::Rayleigh { alpha, beta } => Damping::Rayleigh { alpha: *alpha, beta: *beta },
            Self::Matrix(matrix) => Damping::Matrix(matrix),
        }
    }

    /// Returns the damping with its matrix converted by `f`, which is called only for a matrix.
    ///
    /// # Errors
    /// The errors of `f`.
    pub fn try_map<E, X>(self, f: impl FnOnce(D) -> Result<E, X>) -> Result<Damping<E>, X> {
        Ok(match self {
            Self::Ratio(ratio) => Damping::Ratio(ratio),
            Self::Bands(bands) => Damping::Bands(bands),
            Self::Rayleigh { alpha, beta } => Damping::Rayleigh { alpha, beta },
            Self::Matrix(matrix) => Damping::Matrix(f(matrix)?),
        })
    }

    /// Returns the first error in the numbers; a matrix is not checked here.
    pub fn problem(&self) -> Option<String> {
        let wrong = |ratio: &f64| !(ratio.is_finite() && *ratio >= 0.0);
        let ratio = |ratio: &f64| {
            format!(
                "damping ratio {ratio} is not a finite number from 0 (2 % is 0.02, critical damping is 1)"
            )
        };
        match self {
            Self::Ratio(value) => wrong(value).then(|| ratio(value)),
            Self::Bands(bands) => {
                let (last, closed) = match bands.split_last() {
                    Some(parts) => parts,
                    None => return Some("damping has no bands".to_owned()),
                };
                if let Some(band) = bands.iter().find(|band| wrong(&band.ratio)) {
                    return Some(ratio(&band.ratio));
                }
                if let Some(band) = closed.iter().find(|b| !(b.to_hz > 0.0 && b.to_hz.is_finite())) {
                    return Some(format!(
                        "damping band ends at {} Hz, expected a positive frequency",
                        band.to_hz
                    ));
                }
                if let Some(pair) = closed.windows(2).find(|pair| pair[0].to_hz >= pair[1].to_hz) {
                    let (a, b) = (pair[0].to_hz, pair[1].to_hz);
                    return Some(format!(
                        "damping bands end at {a} Hz and then at {b} Hz, expected ascending ends"
                    ));
                }
                (last.to_hz != f64::INFINITY).then(|| {
                    format!("the last damping band ends at {} Hz, expected a band without end", last.to_hz)
                })
            }
            Self::Rayleigh { alpha, beta } => {
                let bad = [("alpha", alpha), ("beta", beta)]
                    .into_iter()
                    .find(|(_, v)| !(v.is_finite() && **v >= 0.0));
                bad.map(|(name, v)| format!("`{name}` of the Rayleigh damping is {v}, expected a finite number that is not negative"))
            }
            Self::Matrix(_) => None,
        }
    }
}

/// Keys of a damping band.
pub const DAMPING_BAND_KEYS: &[&str] = &["to_hz", "ratio"];

/// Reads damping ratios by frequency from manifests and scenes: a list of `{ to_hz, ratio }` with ends in
/// hertz. The values are not checked. If it returns `None`, it has added a diagnostic to `walk`.
pub fn damping_bands(walk: &mut Walk<'_>, value: &Value) -> Option<Vec<DampingBand>> {
    const EXPECTED: &str = "a list of tables { to_hz, ratio }, the last without to_hz";
    let DeValue::Array(list) = value.get_ref() else {
        walk.mistyped("bands", value, EXPECTED);
        return None;
    };
    let mut bands = Vec::new();
    for item in list.iter() {
        let DeValue::Table(table) = item.get_ref() else {
            walk.mistyped("bands", item, EXPECTED);
            return None;
        };
        walk.known_keys(table, "a damping band", DAMPING_BAND_KEYS);
        let end = table.contains_key("to_hz").then(|| walk.number(table, "to_hz", &item.span()));
        let ratio = walk.number(table, "ratio", &item.span())?;
        bands.push(DampingBand { to_hz: end.unwrap_or(Some(f64::INFINITY))?, ratio });
    }
    Some(bands)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_ends_at_its_limit() {
        let band = |to_hz, ratio| DampingBand { to_hz, ratio };
        let bands = [band(10.0, 0.01), band(20.0, 0.1), band(f64::INFINITY, 1.0)];
        let ratios = DampingRatios::new(bands.to_vec()).expect("bands");
        for (hertz, ratio) in
            [(1e-9, 0.01), (10.0, 0.01), (10.0f64.next_up(), 0.1), (20.5, 1.0), (1e300, 1.0)]
        {
            assert_eq!(ratios.at(hertz), ratio, "{hertz}");
        }
        assert_eq!(ratios.to_string(), "0.01 to 10 Hz, 0.1 to 20 Hz, 1 above");
        assert_eq!(DampingRatios::from(0.02).to_string(), "0.02");
        for (bands, part) in [
            (vec![], "no bands"),
            (vec![band(f64::INFINITY, -0.1)], "not a finite number from 0"),
            (vec![band(f64::INFINITY, f64::INFINITY)], "not a finite number from 0"),
            (vec![band(10.0, 0.1)], "expected a band without end"),
            (vec![band(10.0, 0.1), band(5.0, 0.1), band(f64::INFINITY, 0.1)], "ascending"),
            (vec![band(0.0, 0.1), band(f64::INFINITY, 0.1)], "positive frequency"),
        ] {
            let problem = DampingRatios::new(bands).expect_err("refused");
            assert!(problem.contains(part), "{problem}");
        }
    }
}
