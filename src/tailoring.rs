//! A body made for one scene: a conversion that computes no more than the scene may need, and keeps no more than it needs.

use crate::convert::{Conversion, ConvertSettings, convert_for};
use crate::eigen::Resume;
use crate::error::Result;
use crate::flex_body::FlexBody;
use crate::model::FeModel;
use crate::progress::Watch;
use crate::scene::Scene;
use crate::selection::{Selection, rule_out, select};

/// Converts `model` to a body with the terms and modes that `scene` needs: what bounds of tier 0 rule out is never computed, the rest is
/// decided about the converted body. The scene becomes one of its sources.
///
/// # Errors
/// As [`convert`](crate::convert::convert) and [`select`].
pub fn convert_for_scene(
    model: &FeModel,
    settings: &ConvertSettings,
    scene: &Scene,
    resume: Resume<'_>,
    watch: Watch<'_>,
) -> Result<(Conversion, Selection)> {
    let memory = settings.modes.memory;
    let decide = |early: &FlexBody| rule_out(early, scene, memory);
    let mut conversion = convert_for(model, settings, Some(&decide), resume, watch)?;
    let selection = select(&conversion.body, scene, memory, watch)?;
    let reduced = conversion.body.reduced(&selection.modes, selection.groups, selection.terms.clone())?;
    let mut parts = reduced.into_parts();
    parts.source.files.extend(scene.source.clone());
    conversion.body = FlexBody::new(parts)?;
    Ok((conversion, selection))
}
