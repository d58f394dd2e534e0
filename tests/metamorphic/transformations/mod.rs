//! Transformations that must not change the physics.

mod body;
mod histories;
mod model;
mod moved;
mod scene;
mod units;
mod world;

pub use histories::{Driven, for_driving};

use crate::correspondence::Correspondence;
use crate::subject::Subject;
use crate::support::random::Random;
use flexbody::base::error::Result;

/// Two subjects whose outputs must correspond.
#[derive(Debug, Clone)]
pub struct Pair {
    /// The one.
    pub original: Subject,
    /// The other.
    pub changed: Subject,
    /// How the outputs of the other follow from those of the one.
    pub map: Correspondence,
}

impl Pair {
    /// A changed subject beside the unchanged one.
    fn new(original: &Subject, changed: Subject, map: Correspondence) -> Self {
        Self { original: original.clone(), changed, map }
    }
}

/// A transformation: for a subject and random numbers the pair, or `None` where it does not apply.
type Apply = fn(&Subject, &mut Random) -> Result<Option<Pair>>;

/// All transformations by name.
pub const ALL: [(&str, Apply); 21] = [
    ("turn the world", world::turn),
    ("shift the world", world::shift),
    ("boost the world", world::boost),
    ("accelerate the world", world::accelerate),
    ("mirror the world and the model", world::mirror),
    ("turn the model", model::turn),
    ("shift the model", model::shift),
    ("renumber the nodes", model::renumber),
    ("permute the rows", model::permute),
    ("change the units", units::change),
    ("another frame", body::frame),
    ("another complete basis", body::basis),
    ("write and read the body", body::stored),
    ("write and read the scene", body::written),
    ("other axes of vectors", scene::axes),
    ("split a load", scene::split),
    ("refine a table", scene::refine),
    ("start later", scene::later),
    ("start from a state", scene::restart),
    ("repeat a case", scene::repeat),
    ("more outputs", scene::outputs),
];
