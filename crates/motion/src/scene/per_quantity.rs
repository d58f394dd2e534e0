//! The quantities of a motion that a scene bounds.

/// A value for each quantity of a motion that a scene bounds.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct PerQuantity<T> {
    /// Attitude of the frame. Errors: the angle between the frames. Unit: rad.
    pub attitude: T,
    /// Deflection of the watched points in body axes. Errors: relative to the largest deflection of any of them or to
    /// the least that counts ([`Resolution`](super::Resolution)). Without watched points: of the nodes that move most
    /// in some mode along some axis.
    pub deflection: T,
    /// Stress, as far as a body without stress recovery knows it. Errors: sqrt(V(u - u_ref) / max V(u_ref)), V being
    /// the elastic energy of a deformation; the least energy that counts instead of the largest where that is less.
    pub stress: T,
    /// Force F and torque T that the prescribed motion takes. Errors: relative to the largest force, or torque, or to a
    /// thousandth of w^2 m r, or w^2 I, with the radius of gyration r and I = m r^2, or to a hundredth of the largest
    /// T / r, or F r.
    pub reaction: T,
}

impl<T> PerQuantity<T> {
    /// The value of each quantity, changed by `change`.
    pub fn map<U>(self, mut change: impl FnMut(T) -> U) -> PerQuantity<U> {
        PerQuantity {
            attitude: change(self.attitude),
            deflection: change(self.deflection),
            stress: change(self.stress),
            reaction: change(self.reaction),
        }
    }

    /// The values of each quantity in both.
    pub fn zip<U>(self, other: PerQuantity<U>) -> PerQuantity<(T, U)> {
        PerQuantity {
            attitude: (self.attitude, other.attitude),
            deflection: (self.deflection, other.deflection),
            stress: (self.stress, other.stress),
            reaction: (self.reaction, other.reaction),
        }
    }

    /// References to the values.
    pub fn as_ref(&self) -> PerQuantity<&T> {
        PerQuantity {
            attitude: &self.attitude,
            deflection: &self.deflection,
            stress: &self.stress,
            reaction: &self.reaction,
        }
    }

    /// The values with the names of their quantities.
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
