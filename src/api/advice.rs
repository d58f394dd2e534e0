//! Advice on terms without a scene.

use super::{FlexBody, ReportFormat};
use flexbody_base::error::Result;
use flexbody_body::flex_body::TermGroup;
use flexbody_linalg::context::Context;
use flexbody_report::{AdviceFacts, RunData};
use flexbody_study::advice::{self, advise};
pub use flexbody_study::advice::{AttachedMass, Ranges};

/// Advice on the terms of the equations of motion that a body needs for ranges of its motion.
#[derive(Debug, Clone)]
pub struct Advice<'b> {
    inner: advice::Advice,
    body: &'b FlexBody,
}

impl FlexBody {
    /// Returns the terms that motions within ranges of spin and deflection need, and the guidelines of the literature, like
    /// `flexbody advise`.
    ///
    /// # Errors
    /// FB801 for ranges that are negative or not finite, and for an unknown interface; FB225 for a body without mean
    /// axes.
    pub fn advise(&self, ranges: Ranges) -> Result<Advice<'_>> {
        advise(&self.0, ranges, &Context::QUIET).map(|inner| Advice { inner, body: self })
    }
}

impl Advice<'_> {
    /// Returns the name of the first guideline that leaves out nothing above the limit: `I`, `II`, `III`, `III, free`
    /// or `IV`.
    pub fn guideline(&self) -> &'static str {
        self.inner.guideline().name
    }

    /// Returns the groups of the kinetic energy that the motions need; without motions those with a size above the limit.
    pub fn groups(&self) -> Vec<&'static str> {
        self.inner.groups().kept().map(TermGroup::name).collect()
    }

    /// Returns the report of `flexbody advise` on the body in the file `path`, which its command names.
    pub fn report(&self, path: &str, format: ReportFormat) -> String {
        let data = RunData { diagnostics: self.inner.warning().into_iter().collect(), ..RunData::default() };
        AdviceFacts::new(&self.inner, &self.body.0, path, &data).render(format.inner())
    }
}
