//! Settings of a frequency response.

use super::band::Band;
use flexbody_model::DampingRatios;

/// Settings of a frequency response.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseSettings {
    /// Frequency band.
    pub band: Band,
    /// Approximate number of frequencies of the curves.
    pub points: usize,
    /// Approximate number of frequencies at which the equations of all nodes are solved.
    pub solves: usize,
    /// Damping ratios of the modes; `None` to use those of the body.
    pub damping: Option<DampingRatios>,
    /// True if `damping` replaces the damping of the body. If false, a body with damping is refused.
    pub replaces_damping: bool,
    /// Largest relative error that is accepted.
    pub tolerance: f64,
}

impl ResponseSettings {
    /// Default number of frequencies of the curves: more are not visible in a plot.
    pub const POINTS: usize = 400;
    /// Default number of frequencies at which the equations are solved: enough for two dozen resonances.
    pub const SOLVES: usize = 80;
    /// Default tolerance of the relative error: less than half a decibel.
    pub const TOLERANCE: f64 = 0.05;
}
