//! Report of a body: its facts, the document made of them, and the summary.

mod completeness;
mod craig_bampton;
mod facts;
mod geometric_stiffness;
mod glossary;
mod heat_maps;
mod held;
mod lumped;
mod modes;
mod named_loads;
mod report;
mod summary;

pub use completeness::dropped_text;
pub use facts::Facts;
pub use report::render;
pub use summary::{summary, summary_html};
