//! Quantities of a motion that have tolerances in a scene.

/// One value for each quantity of a motion that has a tolerance in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct PerQuantity<T> {
    /// Attitude of the frame. The error is the angle between the frames. Unit: rad.
    pub attitude: T,
    /// Deflection of the watched points in body axes. The error is relative to the largest deflection of
    /// any of them, or to the smallest one that is compared ([`Resolution`](super::Resolution)). Without
    /// watched points, the nodes that move most in some mode along some axis are compared.
    pub deflection: T,
    /// Stress, estimated without stress recovery. The error is sqrt(V(u - u_ref) / max V(u_ref)), where V
    /// is the elastic energy of a deformation; the smallest energy that is compared replaces a smaller
    /// maximum.
    pub stress: T,
    /// Force F and torque T of the prescribed motion. The error is relative to the largest force or torque,
    /// or to one thousandth of w^2 m r or w^2 I, with the radius of gyration r and I = m r^2, or to one
    /// hundredth of the largest T / r or F r.
    pub reaction: T,
}

impl<T> PerQuantity<T> {
    /// Returns the values changed by `change`, which is called once for each quantity.
    pub fn map<U>(self, mut change: impl FnMut(T) -> U) -> PerQuantity<U> {
        PerQuantity {
            attitude: change(self.attitude),
            deflection: change(self.deflection),
            stress: change(self.stress),
            reaction: change(self.reaction),
        }
    }

    /// Returns the pairs of values of both.
    pub fn zip<U>(self, other: PerQuantity<U>) -> PerQuantity<(T, U)> {
        PerQuantity {
            attitude: (self.attitude, other.attitude),
            deflection: (self.deflection, other.deflection),
            stress: (self.stress, other.stress),
            reaction: (self.reaction, other.reaction),
        }
    }

    /// Returns references to the values.
    pub fn as_ref(&self) -> PerQuantity<&T> {
        PerQuantity {
            attitude: &self.attitude,
            deflection: &self.deflection,
            stress: &self.stress,
            reaction: &self.reaction,
        }
    }

    /// Returns the values with the names of their quantities.
    pub fn named(self) -> [(&'static str, T); 4] {
        [
            ("attitude", self.attitude),
            ("deflection", self.deflection),
            ("stress", self.stress),
            ("reaction", self.reaction),
        ]
    }
}

impl<T: Clone> PerQuantity<T> {
    /// Returns one value for all quantities.
    pub fn all(value: T) -> Self {
        Self { attitude: value.clone(), deflection: value.clone(), stress: value.clone(), reaction: value }
    }
}
