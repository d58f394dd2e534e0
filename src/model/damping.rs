//! Damping as a user states it.

/// Damping of a body. `D` stands for the matrix: its place in a file, what was read, or the matrix itself.
#[derive(Debug, Clone, PartialEq)]
pub enum Damping<D> {
    /// One ratio for every mode.
    Ratio(f64),
    /// Ratios by frequency, bands ascending, the last without end.
    Bands(Vec<DampingBand>),
    /// D = alpha M + beta K.
    Rayleigh {
        /// Unit: 1/time.
        alpha: f64,
        /// Unit: time.
        beta: f64,
    },
    /// D (N x N, rows as K), symmetric and positive semidefinite. Unit: mass/time.
    Matrix(D),
}

/// A range of frequencies with one damping ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DampingBand {
    /// The band ends here, the limit included, in hertz whatever the unit of time; infinite for the last.
    pub to_hz: f64,
    /// Damping ratio of its modes.
    pub ratio: f64,
}

impl<D> Damping<D> {
    /// `ratio`, `bands`, `rayleigh`, `matrix`: the key of the manifest.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Ratio(_) => "ratio",
            Self::Bands(_) => "bands",
            Self::Rayleigh { .. } => "rayleigh",
            Self::Matrix(_) => "matrix",
        }
    }

    /// The matrix, where damping is one.
    pub fn matrix(&self) -> Option<&D> {
        match self {
            Self::Matrix(matrix) => Some(matrix),
            _ => None,
        }
    }

    /// The same with a borrowed matrix.
    pub fn borrowed(&self) -> Damping<&D> {
        match self {
            Self::Ratio(ratio) => Damping::Ratio(*ratio),
            Self::Bands(bands) => Damping::Bands(bands.clone()),
            Self::Rayleigh { alpha, beta } => Damping::Rayleigh { alpha: *alpha, beta: *beta },
            Self::Matrix(matrix) => Damping::Matrix(matrix),
        }
    }

    /// The same with another matrix in place of this one.
    ///
    /// # Errors
    /// Those of `f`.
    pub fn try_map<E, X>(self, f: impl FnOnce(D) -> Result<E, X>) -> Result<Damping<E>, X> {
        Ok(match self {
            Self::Ratio(ratio) => Damping::Ratio(ratio),
            Self::Bands(bands) => Damping::Bands(bands),
            Self::Rayleigh { alpha, beta } => Damping::Rayleigh { alpha, beta },
            Self::Matrix(matrix) => Damping::Matrix(f(matrix)?),
        })
    }

    /// What is wrong with its numbers; nothing is known of the matrix here.
    pub fn problem(&self) -> Option<String> {
        let wrong = |ratio: &f64| !(0.0..1.0).contains(ratio);
        let ratio = |ratio: &f64| {
            format!("damping ratio {ratio} is not a number from 0 to less than 1 (2 % is 0.02)")
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
