//! Scenes, and the selection of terms and modes for them.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_motion::scene::LoadCases;
use flexbody_study::recipe::{Origin, selected_from_file, selected_from_model};
use flexbody_study::selection;
use serde::Serialize;
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

    /// Returns the scene with its standard variations as a requirement: a body that is made for it holds in these motions too.
    /// The key `robust` of a scene file does the same.
    pub fn robust(self) -> Self {
        Self(self.0.robust())
    }

    /// Reads the text of a scene file with all its load cases. Files of histories are found in `folder`. A scene without a
    /// name is called `scene`.
    ///
    /// ```
    /// let scene = flexbody::Scene::parse("[run]\nduration = 0.1\n[initial]\nangular_velocity = [0, 0, 30]\n", "")?;
    /// assert_eq!(scene.name(), "scene");
    /// # Ok::<(), flexbody::Error>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Scene::read`], apart from those of reading the scene file.
    pub fn parse(text: &str, folder: impl AsRef<Path>) -> Result<Self> {
        LoadCases::parse(text, &folder.as_ref().join(NAME)).map(Self)
    }

    /// Makes a scene of values with the keys of a scene file: a structure, a map, or `serde_json::json!`. Files of
    /// histories are found in `folder`.
    ///
    /// ```
    /// use flexbody::Scene;
    /// let values = serde_json::json!({
    ///     "run": { "duration": 0.1 },
    ///     "gravity": [0.0, 0.0, -9.81],
    ///     "load": [{ "interface": "tip", "force": [0, 0, 1] }],
    /// });
    /// assert_eq!(Scene::from_values(&values, "")?.cases().len(), 1);
    /// # Ok::<(), flexbody::Error>(())
    /// ```
    ///
    /// # Errors
    /// FB211 for values that a scene file cannot hold; the errors of [`Scene::parse`], which name the value instead of a
    /// line.
    pub fn from_values(values: &impl Serialize, folder: impl AsRef<Path>) -> Result<Self> {
        let text = toml::to_string(values).map_err(|error| {
            let message = format!("the values cannot be those of a scene: {}", error.to_string().trim_end());
            let help = "use maps with names as keys, lists, texts, finite numbers, true and false, and leave out what is not stated";
            Diagnostic::new(Code::SceneSyntax, message).with_help(help)
        })?;
        let path = folder.as_ref().join(NAME);
        let of_value = |found: Diagnostic| of_value(found, &text, &path);
        LoadCases::parse(&text, &path)
            .map(Self)
            .map_err(|error| Error::new(error.into_diagnostics().into_iter().map(of_value).collect()))
    }

    /// Returns the load case `name` or, with `None`, the scene if it has no load cases.
    ///
    /// # Errors
    /// FB219 if there is no such case, or if there are load cases and `name` is `None`.
    pub fn case(&self, name: Option<&str>) -> Result<Self> {
        self.0.only(name).map(Self)
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

/// Name of a scene that is not a file.
const NAME: &str = "scene";

/// Returns a finding about a line of `text`, which was made of values, as a finding about the value in this line.
fn of_value(found: Diagnostic, text: &str, path: &Path) -> Diagnostic {
    let Some(line) = found.line().filter(|_| found.file() == Some(path)) else { return found };
    let lines: Vec<&str> = text.lines().take(line).collect();
    let Some(value) = lines.last() else { return found };
    // The table that the value is in, and its number in a list.
    let header = lines.iter().rev().find(|line| line.starts_with('['));
    let place = header.map_or_else(String::new, |header| {
        let number = lines.iter().filter(|line| *line == header).count();
        let number = if header.starts_with("[[") { format!(" {number}") } else { String::new() };
        format!(" in {header}{number}")
    });
    // The message may name the table already.
    let named = header.map(|header| format!(" in {header}"));
    let message = named.as_deref().and_then(|named| found.message().strip_suffix(named));
    let message = message.unwrap_or(found.message());
    let value = if value.starts_with('[') { String::new() } else { format!(": `{value}`") };
    Diagnostic::new(found.code(), format!("{message}{place}{value}")).with_help(found.help())
}

/// Terms and modes that a body needs in a scene.
#[derive(Debug, Clone)]
pub struct Selection {
    pub(super) inner: selection::Selection,
    pub(super) subject: Subject,
}

/// Thing that a selection was made for.
#[derive(Debug, Clone)]
pub(super) enum Subject {
    /// A body.
    Body,
    /// A model with the requested number of modes, and the name of the scene file.
    Model { modes: Option<usize>, scene: Option<String> },
    /// A body that was made for the scene.
    Conversion,
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

    /// Returns the command that makes exactly the selected body from the file `input`: the flex-body file, or the model of
    /// [`Model::select`](crate::Model::select), with the name of the scene file. Returns `None` for a selection of
    /// [`Model::convert_for`](crate::Model::convert_for), which has made the body, and for a model with a scene of no file.
    pub fn command(&self, input: &str) -> Option<String> {
        let origin =
            |scene: &str| Origin { input: vec![input.to_owned()], scene: scene.to_owned(), case: None };
        match &self.subject {
            Subject::Body => Some(selected_from_file(&self.inner, &origin(""))),
            Subject::Model { modes, scene } => {
                scene.as_ref().map(|scene| selected_from_model(&self.inner, &origin(scene), *modes))
            }
            Subject::Conversion => None,
        }
    }

    /// Returns warnings and notes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.inner.diagnostics
    }
}
