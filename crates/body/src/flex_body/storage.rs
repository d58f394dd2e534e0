//! Storage precision of the large arrays of a body.

use strum::{EnumString, IntoStaticStr, VariantArray};

/// Precision of the shapes and of the inertia of the modes, in memory and in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum Storage {
    /// 64-bit floats.
    #[default]
    F64,
    /// Rounded to 32-bit floats.
    F32,
}

impl Storage {
    /// All choices, in the order of the documentation.
    pub const ALL: &'static [Self] = Self::VARIANTS;

    /// Returns the name in files, reports and on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the storage with the given name.
    pub fn from_name(name: &str) -> Option<Self> {
        name.parse().ok()
    }

    /// Returns the additional rounding error of sums of array entries relative to their Cauchy-Schwarz
    /// bounds; zero for 64-bit floats, whose rounding all limits include.
    pub fn rounding(self) -> f64 {
        match self {
            Self::F64 => 0.0,
            Self::F32 => 8.0 * f64::from(f32::EPSILON),
        }
    }

    /// Returns the rounding unit of this storage in units of the rounding unit of 64-bit floats.
    pub fn roundings(self) -> f64 {
        match self {
            Self::F64 => 1.0,
            Self::F32 => f64::from(f32::EPSILON) / f64::EPSILON,
        }
    }
}
