//! Axes that vectors of a scene are along.

/// Axes that a vector is given in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Axes {
    /// Fixed in space.
    World,
    /// Those of the model, turning with the body. Of a body that came without a model these are those of its
    /// file.
    #[default]
    Model,
    /// Those of the body frame of the flex-body file, turning with the body.
    Body,
}

impl Axes {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::World => "world",
            Self::Model => "model",
            Self::Body => "body",
        }
    }
}
