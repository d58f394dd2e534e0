//! How precisely a body keeps its large arrays.

/// Precision of the shapes and of the inertia of the modes, in memory and in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Storage {
    /// 64-bit floats.
    #[default]
    F64,
    /// Rounded to 32-bit floats.
    F32,
}

impl Storage {
    /// Every choice, in the order of the documentation.
    pub const ALL: [Storage; 2] = [Self::F64, Self::F32];

    /// Name in files, reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::F32 => "f32",
        }
    }

    /// Returns the storage of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }

    /// What rounding of the arrays may add to sums of entries that are relative to their Cauchy-Schwarz
    /// bounds; zero for 64-bit floats, whose rounding every limit knows.
    pub fn rounding(self) -> f64 {
        match self {
            Self::F64 => 0.0,
            Self::F32 => 8.0 * f64::from(f32::EPSILON),
        }
    }

    /// How many roundings of 64-bit floats one of these is.
    pub fn roundings(self) -> f64 {
        match self {
            Self::F64 => 1.0,
            Self::F32 => f64::from(f32::EPSILON) / f64::EPSILON,
        }
    }
}
