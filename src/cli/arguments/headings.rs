//! Headings of options in the help. A heading of one command is beside its options.

pub(super) const MODEL: &str = "Model";
pub(super) const MODES: &str = "Modes";
pub(super) const COST: &str = "Accuracy and cost";
pub(super) const FRAME: &str = "Frame";
pub(super) const COMPARISON: &str = "Comparison with lumped masses";
pub(super) const STRESS: &str = "Stress from the deck";
pub(super) const SCENE: &str = "Scene";
pub(super) const FORMAT: &str = "Format";
pub(super) const LOSSES: &str = "Losses";
pub(super) const OUTPUT: &str = "Output";
