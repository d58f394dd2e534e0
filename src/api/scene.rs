//! Scenes, and the selection of terms and modes for them.

use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_motion::scene::LoadCases;
use flexbody_study::recipe::{Origin, selected_from_file};
use flexbody_study::selection;
use std::path::Path;

/// Scene for a body (docs/reference/scenes.md): one or more load cases, each with gravity, loads, prescribed motion,
/// duration and tolerances.
#[derive(Debug, Clone)]
pub struct Scene(pub(super) LoadCases);

impl Scene {
    /// Reads a scene file with all its load cases.
    ///
    /// # Errors
    /// FB101, FB106 if the scene file or a file of its histories cannot be read; FB211, FB213 for errors in the scene
    /// and FB215 to FB217 in its history files, all together.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        LoadCases::read(path, None).map(Self)
    }

    /// Reads the load case `name` of a scene file, or with `None` a scene file without load cases.
    ///
    /// # Errors
    /// The errors of [`Scene::read`]; FB219 if there is no such case, or if there are load cases and `name` is `None`.
    pub fn read_case(path: impl AsRef<Path>, name: Option<&str>) -> Result<Self> {
        LoadCases::read_single(path, name).map(|case| Self(case.into()))
    }

    /// Joins the load cases of several scenes, in order. Returns `None` if there are none.
    pub fn of_cases(scenes: impl IntoIterator<Item = Self>) -> Option<Self> {
        let cases = scenes.into_iter().flat_map(|scene| scene.0.to_vec()).collect();
        LoadCases::new(cases).map(Self)
    }

    /// Returns the load cases, at least one, each as a scene of its own.
    pub fn cases(&self) -> Vec<Self> {
        self.0.iter().map(|case| Self(case.clone().into())).collect()
    }

    /// Returns the name of the scene; for a single load case, the name of its scene, a colon and its own name.
    pub fn name(&self) -> &str {
        self.0.name()
    }
}

/// Terms and modes that a body needs in a scene.
#[derive(Debug, Clone)]
pub struct Selection {
    pub(super) inner: selection::Selection,
    /// True if it was made for a body; false if the body was made for it.
    pub(super) is_of_body: bool,
}

impl Selection {
    /// Returns the indices of the kept modes (from 0).
    pub fn modes(&self) -> &[usize] {
        &self.inner.modes
    }

    /// Returns the groups of the kinetic energy: name, whether it is kept, and the reason.
    pub fn groups(&self) -> Vec<(&'static str, bool, &str)> {
        self.inner.terms.iter().map(|term| (term.group.name(), term.kept, term.reason.as_str())).collect()
    }

    /// Returns true if the tolerances of the scene hold, as far as they were measured.
    pub fn holds(&self) -> bool {
        self.inner.holds()
    }

    /// Returns the command that makes exactly the selected body from the flex-body file `body` that was judged. Returns
    /// `None` for a selection of [`Model::convert_for`](crate::Model::convert_for), which has made the body.
    pub fn command(&self, body: &str) -> Option<String> {
        let origin = Origin { input: vec![body.to_owned()], scene: String::new(), case: None };
        self.is_of_body.then(|| selected_from_file(&self.inner, &origin))
    }

    /// Returns warnings and notes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.inner.diagnostics
    }
}
