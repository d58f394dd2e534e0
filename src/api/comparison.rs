//! Comparison of two bodies.

use super::FlexBody;
use flexbody_base::error::Result;
use flexbody_report::{
    BodyComparison, ComparisonFormat, ComparisonReport, ComparisonRow, ModePair, Tolerances,
};

/// Comparison of two bodies, independent of the signs and bases of their modes.
#[derive(Debug, Clone)]
pub struct Comparison {
    inner: BodyComparison,
    reference: String,
    other: String,
}

impl FlexBody {
    /// Compares `other` with this body, like `flexbody compare`.
    ///
    /// # Errors
    /// FB707 if dimensions or numbers of modes differ, units of which only one body states its own, or reference conditions that
    /// cannot be changed to mean axes.
    pub fn compare(&self, other: &FlexBody, tolerances: &Tolerances) -> Result<Comparison> {
        let inner = flexbody_report::compare(&self.0, &other.0, tolerances)?;
        Ok(Comparison { inner, reference: self.name().to_owned(), other: other.name().to_owned() })
    }

    /// Compares the modes and the groups of the kinetic energy that `other` and this body have in common, like
    /// `flexbody compare --common`.
    ///
    /// # Errors
    /// FB707 if units or dimensions differ, or if the bodies have no mode in common.
    pub fn compare_common(&self, other: &FlexBody, tolerances: &Tolerances) -> Result<Comparison> {
        let inner = flexbody_report::compare_common(&self.0, &other.0, tolerances)?;
        Ok(Comparison { inner, reference: self.name().to_owned(), other: other.name().to_owned() })
    }
}

impl Comparison {
    /// Sets the names of the reference and of the other body in reports, such as the paths of their files.
    pub fn named(mut self, reference: impl Into<String>, other: impl Into<String>) -> Self {
        (self.reference, self.other) = (reference.into(), other.into());
        self
    }

    /// Returns true if every quantity is within its tolerance.
    pub fn passed(&self) -> bool {
        self.inner.passed()
    }

    /// Returns the compared quantities.
    pub fn rows(&self) -> &[ComparisonRow] {
        self.inner.rows()
    }

    /// Returns the pairs of modes with their frequencies, in the order of the modes of the reference.
    pub fn modes(&self) -> &[ModePair] {
        self.inner.modes()
    }

    /// Returns the report of `flexbody compare --report`.
    pub fn report(&self, format: ComparisonFormat) -> String {
        ComparisonReport { comparison: &self.inner, a: &self.reference, b: &self.other }.render(format)
    }
}
