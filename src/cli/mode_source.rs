//! Modes of a conversion: those that this program finds, or those that are found outside of it.

use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, ModeSettings};
use flexbody_input::LoadSource;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_study::conversion::ConversionRequest;

/// Source of the modes of a conversion.
pub(super) trait ModeSource {
    /// Refuses what the modes of this source do not serve. `loads` are those of residual vectors; `has_scene` and
    /// `is_split` are true for a conversion for a scene, and of each of several bodies.
    ///
    /// # Errors
    /// FB801 for a request that needs another source.
    fn refuse(
        &self,
        request: &ConversionRequest,
        loads: &[LoadSource],
        has_scene: bool,
        is_split: bool,
    ) -> Result<()>;

    /// Returns the modes of `model`; `None` if this program must find them.
    ///
    /// # Errors
    /// The errors of the source.
    fn modes(
        &self,
        model: &FeModel,
        settings: &ModeSettings,
        context: &Context<'_>,
    ) -> Result<Option<BasisChoice>>;
}

/// This program as the source of modes.
pub(super) struct BuiltIn;

impl ModeSource for BuiltIn {
    fn refuse(&self, _: &ConversionRequest, _: &[LoadSource], _: bool, _: bool) -> Result<()> {
        Ok(())
    }

    fn modes(&self, _: &FeModel, _: &ModeSettings, _: &Context<'_>) -> Result<Option<BasisChoice>> {
        Ok(None)
    }
}
