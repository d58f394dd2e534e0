//! Axes of the vectors in a scene.

/// Axes that a vector is given in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Axes {
    /// Axes fixed in space.
    World,
    /// Axes of the model, turning with the body. For a body without a model they are the axes of its file.
    #[default]
    Model,
    /// Axes of the body frame of the flex-body file, turning with the body.
    Body,
}

impl Axes {
    /// Returns the name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::World => "world",
            Self::Model => "model",
            Self::Body => "body",
        }
    }
}
