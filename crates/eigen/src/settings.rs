//! Settings of the eigen-solver: the wanted modes, their accuracy, the method and the precision of the factor.

/// Which modes are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wanted {
    /// The lowest so many flexible modes.
    Lowest(usize),
    /// Every flexible mode with an eigenvalue below this one.
    Below(f64),
}

/// Promises about the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Accuracy {
    /// K-residual 1e-6; completeness is not proved.
    Fast,
    /// K-residual 1e-9 or the rounding floor of the matrices; completeness proved.
    #[default]
    Standard,
    /// K-residual 1e-12 or the rounding floor; completeness proved from both sides; guaranteed bounds of
    /// every eigenvalue and, in a conversion, of the invariants.
    Certified,
}

impl Accuracy {
    /// Every accuracy, in the order of the documentation.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Standard, Self::Certified];

    /// K-residual |K psi - lambda M psi| / (|K psi| + |lambda| |M psi|) that is promised.
    pub fn residual(self) -> f64 {
        match self {
            Self::Fast => 1e-6,
            Self::Standard => 1e-9,
            Self::Certified => 1e-12,
        }
    }

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Standard => "standard",
            Self::Certified => "certified",
        }
    }

    /// Returns the accuracy of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }
}

/// Which algorithm computes the modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Dense for small models or when most modes are wanted, Lanczos otherwise.
    Auto,
    /// Dense generalised eigenproblem.
    Dense,
    /// Shift-invert block Lanczos with thick restart.
    Lanczos,
}

/// Settings of the eigen-solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EigenSettings {
    /// Which modes.
    pub wanted: Wanted,
    /// Accuracy of the modes.
    pub accuracy: Accuracy,
    /// Algorithm.
    pub method: Method,
    /// Precision of the factor.
    pub factor: FactorChoice,
    /// Multiplications and additions of a factorisation above which [`FactorChoice::Auto`] tries single
    /// precision for its speed.
    pub single_pays: f64,
    /// Multiplications and additions of a factorisation, for each stored entry of K, above which modes are
    /// searched for without a factor, where [`FactorChoice::Auto`] leaves that open. Those of
    /// [`Accuracy::Certified`] never are.
    pub multigrid_pays: f64,
}

impl EigenSettings {
    /// Number of modes when nothing else is said: the usual size of a modal basis.
    pub const DEFAULT_COUNT: usize = 20;
}

impl Default for EigenSettings {
    /// 20 modes, proved, by the method that suits the size.
    fn default() -> Self {
        Self {
            wanted: Wanted::Lowest(Self::DEFAULT_COUNT),
            accuracy: Accuracy::default(),
            method: Method::Auto,
            factor: FactorChoice::default(),
            // Below, the columns that its corrections solve cost what the factorisation saves.
            single_pays: 4e11,
            // Measured: a compact solid of 40,000 rows, a bar of 70,000. What is thin has less to factor, and
            // more that no coarse level sees.
            multigrid_pays: 1.2e4,
        }
    }
}

/// Numbers of the factor that the search solves with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// f64.
    Double,
    /// f32, with all residuals and projections in f64: half the memory, and half the time where factorisation
    /// dominates.
    Single,
}

impl Precision {
    /// Bytes of a number.
    pub(super) fn bytes(self) -> u64 {
        match self {
            Self::Double => 8,
            Self::Single => 4,
        }
    }
}

/// Requested precision of the factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FactorChoice {
    /// Single where double does not fit the memory, or where it is faster; back to double where conditioning
    /// defeats it.
    #[default]
    Auto,
    /// This one.
    Always(Precision),
}

impl FactorChoice {
    /// Every choice, in the order of the documentation.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Always(Precision::Double), Self::Always(Precision::Single)];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Always(Precision::Double) => "f64",
            Self::Always(Precision::Single) => "f32",
        }
    }
}

/// The promise about a K-residual: the tolerance, or what rounding leaves of it (measured: up to 6 times the
/// estimate).
pub(super) fn keeps(residual: f64, floor: f64, tolerance: f64) -> bool {
    residual <= tolerance.max(30.0 * floor)
}
