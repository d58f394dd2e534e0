//! Types of the numbers in binary files of meshes.

/// Type of the numbers of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NumberType {
    Signed(usize),
    Unsigned(usize),
    Float,
    Double,
}

impl NumberType {
    /// Returns the type of this name in XML files (`Float64`) or in legacy files (`double`).
    pub(crate) fn named(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "float32" | "float" => Self::Float,
            "float64" | "double" => Self::Double,
            "int8" | "char" | "signed_char" => Self::Signed(1),
            "int16" | "short" => Self::Signed(2),
            "int32" | "int" | "vtkidtype" => Self::Signed(4),
            "int64" | "long" | "vtktypeint64" => Self::Signed(8),
            "uint8" | "unsigned_char" => Self::Unsigned(1),
            "uint16" | "unsigned_short" => Self::Unsigned(2),
            "uint32" | "unsigned_int" => Self::Unsigned(4),
            "uint64" | "unsigned_long" | "vtktypeuint64" => Self::Unsigned(8),
            _ => return None,
        })
    }

    /// Returns the number of bytes of a number.
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::Signed(bytes) | Self::Unsigned(bytes) => bytes,
            Self::Float => 4,
            Self::Double => 8,
        }
    }

    pub(crate) fn is_whole(self) -> bool {
        matches!(self, Self::Signed(_) | Self::Unsigned(_))
    }

    /// Returns the numbers in `bytes`; incomplete bytes at the end are left out.
    pub(crate) fn decode(self, bytes: &[u8], big_endian: bool) -> Vec<f64> {
        bytes.chunks_exact(self.bytes()).map(|chunk| self.number(digits(chunk, big_endian))).collect()
    }

    fn number(self, digits: u64) -> f64 {
        match self {
            Self::Float => f64::from(f32::from_bits(digits as u32)),
            Self::Double => f64::from_bits(digits),
            Self::Unsigned(_) => digits as f64,
            Self::Signed(bytes) => {
                let unused = 64 - 8 * bytes as u32;
                (((digits << unused) as i64) >> unused) as f64
            }
        }
    }
}

/// Returns the whole number whose digits are `bytes`.
pub(crate) fn digits(bytes: &[u8], big_endian: bool) -> u64 {
    let append = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
    if big_endian { bytes.iter().fold(0, append) } else { bytes.iter().rev().fold(0, append) }
}
