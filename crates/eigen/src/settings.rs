//! The settings of the search: the wanted modes, their accuracy, the algorithm, and the precision of the factor.

use strum::{EnumString, IntoStaticStr, VariantArray};

/// Choice of the wanted modes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wanted {
    /// This number of lowest flexible modes.
    Lowest(usize),
    /// Every flexible mode with an eigenvalue below this value.
    Below(f64),
}

/// Guaranteed accuracy of the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum Accuracy {
    /// K-residual 1e-6; completeness is not proved.
    Fast,
    /// K-residual 1e-9 or the rounding floor of the matrices; completeness proved.
    #[default]
    Standard,
    /// K-residual 1e-12 or the rounding floor of the matrices; completeness proved from both sides; guaranteed bounds
    /// of every eigenvalue and, in a conversion, of the invariants.
    Certified,
}

impl Accuracy {
    /// Every accuracy, in the order of the documentation.
    pub const ALL: &'static [Self] = Self::VARIANTS;

    /// Returns the guaranteed K-residual |K psi - lambda M psi| / (|K psi| + |lambda| |M psi|).
    pub fn residual(self) -> f64 {
        match self {
            Self::Fast => 1e-6,
            Self::Standard => 1e-9,
            Self::Certified => 1e-12,
        }
    }

    /// Returns the name on the command line and in files.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the accuracy of this name; `None` for an unknown name.
    pub fn from_name(name: &str) -> Option<Self> {
        name.parse().ok()
    }
}

/// Algorithm that computes the modes.
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
    /// Wanted modes.
    pub wanted: Wanted,
    /// Accuracy of the modes.
    pub accuracy: Accuracy,
    /// Algorithm that computes the modes.
    pub method: Method,
    /// Requested precision of the factor.
    pub factor: FactorChoice,
    /// Number of multiplications and additions of a factorisation above which [`FactorChoice::Auto`] tries single
    /// precision for its speed.
    pub single_pays: f64,
    /// Number of multiplications and additions of a factorisation, per stored entry of K, above which modes are
    /// searched for without a factor if the choice is [`FactorChoice::Auto`]. [`Accuracy::Certified`] always uses a
    /// factor.
    pub multigrid_pays: f64,
}

impl EigenSettings {
    /// Default number of modes: the usual size of a modal basis.
    pub const DEFAULT_COUNT: usize = 20;
}

impl Default for EigenSettings {
    /// Returns the settings for 20 modes, proved complete, by the method that suits the size.
    fn default() -> Self {
        Self {
            wanted: Wanted::Lowest(Self::DEFAULT_COUNT),
            accuracy: Accuracy::default(),
            method: Method::Auto,
            factor: FactorChoice::default(),
            // Below this number, solving the columns of the corrections costs more than single precision saves.
            single_pays: 4e11,
            // Measured: a compact solid of 40,000 rows, a bar of 70,000. Thin bodies have cheaper factors, and more
            // deformation that no coarse level represents.
            multigrid_pays: 1.2e4,
        }
    }
}

/// Precision of the factor that the search solves with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// f64.
    Double,
    /// f32, with all residuals and projections in f64. It takes half the memory, and half the time where factorisation
    /// dominates.
    Single,
}

impl Precision {
    /// Returns the bytes of a number.
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
    /// Single precision where double does not fit the memory, or where single is faster; double again if conditioning
    /// defeats single precision.
    #[default]
    Auto,
    /// Always this precision.
    Always(Precision),
}

impl FactorChoice {
    /// Every choice, in the order of the documentation.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Always(Precision::Double), Self::Always(Precision::Single)];

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Always(Precision::Double) => "f64",
            Self::Always(Precision::Single) => "f32",
        }
    }
}
