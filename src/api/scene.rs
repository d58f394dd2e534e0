//! What a body is to do, and what it needs for that.

use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_motion::scene::LoadCases;
use flexbody_study::selection;
use std::path::Path;

/// What a body is to do (docs/simulate.md): one or more load cases, each with gravity, loads, prescribed motion, duration
/// and tolerances.
#[derive(Debug, Clone)]
pub struct Scene(pub(super) LoadCases);

impl Scene {
    /// Reads a scene file with all its load cases.
    ///
    /// # Errors
    /// FB101, FB106 when it or a file of its histories cannot be read; FB211, FB213 for what is wrong in it
    /// and FB215 to FB217 in these files, all of it.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        LoadCases::read(path, None).map(Self)
    }

    /// Reads the load case of a scene file that has this name, or with `None` a scene file without load cases.
    ///
    /// # Errors
    /// As [`Scene::read`]; FB219 when there is no such case, or there are load cases and none is named.
    pub fn read_case(path: impl AsRef<Path>, name: Option<&str>) -> Result<Self> {
        LoadCases::read_single(path, name).map(|case| Self(case.into()))
    }

    /// Joins the load cases of several scenes, in their order. Returns `None` without any.
    pub fn of_cases(scenes: impl IntoIterator<Item = Self>) -> Option<Self> {
        let cases = scenes.into_iter().flat_map(|scene| scene.0.to_vec()).collect();
        LoadCases::new(cases).map(Self)
    }

    /// The load cases, one or more, each as a scene of its own.
    pub fn cases(&self) -> Vec<Self> {
        self.0.iter().map(|case| Self(case.clone().into())).collect()
    }

    /// Name of the scene; of a single load case that of its scene, a colon and its own.
    pub fn name(&self) -> &str {
        self.0.name()
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
