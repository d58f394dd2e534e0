//! Headings of options in the help.

pub(super) const MODEL: &str = "Model";
pub(super) const MODES: &str = "Modes";
pub(super) const COST: &str = "Accuracy and cost";
pub(super) const FRAME: &str = "Frame";
pub(super) const COMPARISON: &str = "Comparison with lumped masses";
pub(super) const SCENE: &str = "Scene";
pub(super) const CLUSTER: &str = "Cluster";
pub(super) const FORMAT: &str = "Format";
pub(super) const LOSSES: &str = "Losses";
pub(super) const PLACES: &str = "Places and frequencies";
pub(super) const OUTPUT: &str = "Output";
