//! What a body is to do, and what it needs for that.

use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_motion::scene::{self, read_case, read_cases};
use flexbody_study::selection;
use std::path::Path;

/// What a body is to do: gravity, loads, prescribed motion, duration, tolerances (docs/simulate.md).
#[derive(Debug, Clone)]
pub struct Scene(pub(super) scene::Scene);

impl Scene {
    /// Reads a scene file.
    ///
    /// # Errors
    /// FB101, FB106 when it or a file of its histories cannot be read; FB211, FB213 for what is wrong in it
    /// and FB215 to FB217 in these files, all of it; FB219 when it has load cases.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        read_case(path, None).map(Self)
    }

    /// Reads one load case of a scene file.
    ///
    /// # Errors
    /// As [`Scene::read`]; FB219 when there is no such case.
    pub fn read_case(path: impl AsRef<Path>, name: &str) -> Result<Self> {
        read_case(path, Some(name)).map(Self)
    }

    /// Reads all load cases of a scene file, in its order; of a file without cases that is one scene.
    ///
    /// # Errors
    /// As [`Scene::read`], without FB219.
    pub fn read_cases(path: impl AsRef<Path>) -> Result<Vec<Self>> {
        Ok(read_cases(path)?.into_iter().map(Self).collect())
    }

    /// Name; of a load case that of the scene, a colon and its own.
    pub fn name(&self) -> &str {
        &self.0.name
    }
}

/// Which terms and modes a body needs in a scene.
#[derive(Debug, Clone)]
pub struct Selection(pub(super) selection::Selection);

impl Selection {
    /// The modes that are kept (from 0).
    pub fn modes(&self) -> &[usize] {
        &self.0.modes
    }

    /// Names of the groups of the kinetic energy with the reason why each is kept or not.
    pub fn groups(&self) -> Vec<(&'static str, bool, &str)> {
        self.0.terms.iter().map(|term| (term.group.name(), term.kept, term.reason.as_str())).collect()
    }

    /// Whether the tolerances of the scene hold, as far as they were measured.
    pub fn holds(&self) -> bool {
        self.0.holds()
    }

    /// Warnings and notes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.0.diagnostics
    }
}
