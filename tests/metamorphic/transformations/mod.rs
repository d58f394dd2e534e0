//! Transformations that must not change the physics.

mod body;
mod histories;
mod model;
mod moved;
mod scene;
mod units;
mod world;

pub use histories::{Driven, for_driving};
pub use model::{rows, turned, turned_rows};

use crate::correspondence::Correspondence;
use crate::subject::Subject;
use flexbody_base::error::Result;
use oracle::random::Random;

/// Two subjects whose outputs must correspond.
#[derive(Debug, Clone)]
pub struct Pair {
    /// Original subject.
    pub original: Subject,
    /// Transformed subject.
    pub changed: Subject,
    /// Relations between the outputs of the two.
    pub map: Correspondence,
}

impl Pair {
    /// Returns a changed subject with the unchanged one.
    fn new(original: &Subject, changed: Subject, map: Correspondence) -> Self {
        Self { original: original.clone(), changed, map }
    }
}

/// A transformation. Returns the pair for a subject and random numbers, or `None` if it does not apply.
type Apply = fn(&Subject, &mut Random) -> Result<Option<Pair>>;

/// Commands that a transformation is crossed with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// `simulate` alone: a complete basis is not a subject of verdicts, and a part of a motion has other
    /// largest values.
    Simulation,
    /// Commands that take a body.
    Body,
    /// Commands that use a scene.
    Scene,
    /// All commands.
    All,
}

/// A transformation with its name and reach.
pub struct Transformation {
    /// Name of the transformation.
    pub name: &'static str,
    /// Commands that it is crossed with.
    pub reach: Reach,
    /// Function that applies the transformation.
    pub apply: Apply,
}

const fn of(name: &'static str, reach: Reach, apply: Apply) -> Transformation {
    Transformation { name, reach, apply }
}

/// All transformations.
pub const ALL: [Transformation; 24] = [
    of("turn the world", Reach::Scene, world::turn),
    of("shift the world", Reach::Scene, world::shift),
    of("boost the world", Reach::Scene, world::boost),
    of("accelerate the world", Reach::Scene, world::accelerate),
    of("mirror the world and the model", Reach::All, world::mirror),
    of("turn the model", Reach::All, model::turn),
    of("shift the model", Reach::All, model::shift),
    of("renumber the nodes", Reach::All, model::renumber),
    of("permute the rows", Reach::All, model::permute),
    of("round the matrices", Reach::All, model::round),
    of("change the units", Reach::All, units::change),
    of("another frame", Reach::All, body::frame),
    of("another complete basis", Reach::Simulation, body::basis),
    of("write and read the body", Reach::Body, body::stored),
    of("write and read the scene", Reach::Scene, body::written),
    of("recover the table", Reach::Simulation, body::by_table),
    of("other axes of vectors", Reach::Scene, scene::axes),
    of("split a load", Reach::Scene, scene::split),
    of("refine a table", Reach::Scene, scene::refine),
    of("start later", Reach::Scene, scene::later),
    of("start from a state", Reach::Simulation, scene::restart),
    of("repeat a case", Reach::Scene, scene::repeat),
    of("more outputs", Reach::Scene, scene::outputs),
    of("watch more", Reach::Simulation, scene::watch),
];
