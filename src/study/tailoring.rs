//! A body made for one scene: a conversion that computes no more than the scene may need, and keeps no more than it needs.

use crate::base::diagnostic::Code;
use crate::base::error::Result;
use crate::base::progress::Watch;
use crate::body::convert::{Conversion, ConvertSettings, Decide, convert_for};
use crate::body::flex_body::FlexBody;
use crate::model::FeModel;
use crate::motion::scene::Scene;
use crate::numerics::eigen::{Resume, Wanted};
use crate::study::selection::{Selection, largest_eigenvalue, rule_out, select};

/// How a body is made for a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Tailoring {
    /// Settings of the conversion: what there is to select from.
    pub settings: ConvertSettings,
    /// Whether a band of the scene replaces the wanted modes: all up to twice the band, if there are any.
    pub by_band: bool,
}

impl Tailoring {
    /// A body with everything that `scene` may need, less what `decide` rules out.
    ///
    /// # Errors
    /// As [`convert_for`].
    pub fn convert(
        &self,
        model: &FeModel,
        scene: &Scene,
        decide: Option<Decide<'_>>,
        resume: Resume<'_>,
        watch: Watch<'_>,
    ) -> Result<Conversion> {
        let Some(highest) = largest_eigenvalue(scene).filter(|_| self.by_band) else {
            return convert_for(model, &self.settings, decide, resume, watch);
        };
        let mut settings = self.settings.clone();
        settings.modes.wanted = Wanted::Below(highest);
        match convert_for(model, &settings, decide, resume, watch) {
            // A body that is stiff in the band.
            Err(error) if error.diagnostics().iter().any(|d| d.code() == Code::NoModes) => {
                convert_for(model, &self.settings, decide, Resume::default(), watch)
            }
            other => other,
        }
    }
}

/// Converts `model` to a body with the terms and modes that `scene` needs: what bounds of tier 0 rule out is never computed, the rest is
/// decided about the converted body. The scene becomes one of its sources.
///
/// # Errors
/// As [`convert`](crate::body::convert::convert) and [`select`].
pub fn convert_for_scene(
    model: &FeModel,
    tailoring: &Tailoring,
    scene: &Scene,
    resume: Resume<'_>,
    watch: Watch<'_>,
) -> Result<(Conversion, Selection)> {
    let memory = tailoring.settings.modes.memory;
    let decide = |early: &FlexBody| rule_out(early, scene, memory);
    let mut conversion = tailoring.convert(model, scene, Some(&decide), resume, watch)?;
    let selection = select(&conversion.body, scene, memory, watch)?;
    let reduced = conversion.body.reduced(&selection.modes, selection.groups, selection.terms.clone())?;
    let mut parts = reduced.into_parts();
    parts.source.files.extend(scene.source.clone());
    conversion.body = FlexBody::new(parts)?;
    Ok((conversion, selection))
}
