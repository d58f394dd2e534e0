//! Charts of reports: inline SVG, readable without colour and without scripts.

mod axis;
mod bars;
mod heat_map;
mod panels;
mod svg;

pub(crate) use axis::{Axis, Scale};
pub(crate) use bars::{Bar, Bars};
pub(crate) use heat_map::{Cells, DECADES, STEPS, colour_scale, step};
pub(crate) use panels::{Chart, Mark, Panel, Series};
pub(crate) use svg::STYLES;
