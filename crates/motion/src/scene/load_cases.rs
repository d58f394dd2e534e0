//! Load cases of a scene file.

use super::read_cases::{parse_cases, read_cases};
use super::{Scene, SceneVariation, Tolerance, Variations};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use std::ops::Deref;
use std::path::Path;

/// Load cases of one body: one or more scenes, in the order of their file, and the variations that a body made for them
/// is judged on.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadCases {
    cases: Vec<Scene>,
    variations: Variations,
}

impl From<Scene> for LoadCases {
    fn from(scene: Scene) -> Self {
        Self { cases: vec![scene], variations: Variations::Without }
    }
}

impl Deref for LoadCases {
    type Target = [Scene];

    fn deref(&self) -> &[Scene] {
        &self.cases
    }
}

impl LoadCases {
    /// Returns the load cases in their order, or `None` for an empty list.
    pub fn new(cases: Vec<Scene>) -> Option<Self> {
        (!cases.is_empty()).then_some(Self { cases, variations: Variations::Without })
    }

    /// Reads the load cases of a scene file: the case with the given name, or all for `None`. A file
    /// without `[[case]]` is a single scene.
    ///
    /// # Errors
    /// FB101, FB106 if the scene file or a file of its histories cannot be read; FB211 for syntax errors,
    /// for unknown, missing or mistyped keys, and for impossible values; FB213 for contradictions; FB215 to
    /// FB217 for errors in files of histories; one diagnostic per finding, in the order of lines. FB219 if
    /// the scene has no case of that name.
    pub fn read(path: impl AsRef<Path>, case: Option<&str>) -> Result<Self> {
        let path = path.as_ref();
        let (cases, variations) = read_cases(path)?;
        let all = Self { cases, variations };
        let Some(name) = case else { return Ok(all) };
        all.named(name).map_err(|error| error.in_file(path))
    }

    /// Reads the load cases of the text of a scene file. `path` is the file that messages name, in whose folder the files
    /// of histories are found.
    ///
    /// # Errors
    /// The errors of [`LoadCases::read`] apart from FB101, FB106 and FB219 of the scene file.
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let (cases, variations) = parse_cases(text, path)?;
        Ok(Self { cases, variations })
    }

    /// Returns the load case with the given name, with its variations.
    ///
    /// # Errors
    /// FB219 if there is no case of that name.
    pub fn named(&self, name: &str) -> Result<Self> {
        let names = names(&self.cases);
        match names.iter().position(|other| *other == name) {
            Some(at) => {
                let variations = self.variations.clone().of_case(at);
                Ok(Self { cases: vec![self.cases[at].clone()], variations })
            }
            None => Err(unknown_case(name, &names).into()),
        }
    }

    /// Returns the load case with the given name or, for `None`, the scene without load cases.
    ///
    /// # Errors
    /// FB219 if there is no case of that name, or if there are load cases and none is named.
    pub fn only(&self, case: Option<&str>) -> Result<Self> {
        let names = names(&self.cases);
        match case {
            Some(name) => self.named(name),
            None if names.is_empty() => Ok(self.clone()),
            None => Err(ambiguous(&names).into()),
        }
    }

    /// Reads the load case with the given name from a scene file or, for `None`, a scene without load
    /// cases.
    ///
    /// # Errors
    /// The errors of [`LoadCases::read`]; FB219 if the scene has load cases and none is named.
    pub fn read_single(path: impl AsRef<Path>, case: Option<&str>) -> Result<Scene> {
        let mut cases = Self::read(&path, case)?;
        let names = names(&cases);
        if case.is_none() && !names.is_empty() {
            return Err(ambiguous(&names).in_file(path).into());
        }
        Ok(cases.cases.swap_remove(0))
    }

    /// Returns the only load case.
    ///
    /// # Errors
    /// FB219 if there are several.
    pub fn single(&self) -> Result<&Scene> {
        match &self.cases[..] {
            [scene] => Ok(scene),
            all => Err(ambiguous(&all.iter().map(Scene::short_name).collect::<Vec<_>>()).into()),
        }
    }

    /// Returns the name of the scene that the load cases belong to; for a single load case its full name.
    pub fn name(&self) -> &str {
        let first = &self.cases[0];
        first.case.as_ref().filter(|_| self.len() > 1).map_or(&first.name, |case| &case.scene)
    }

    /// Returns the name of a load case (from 0) if there are several; `None` for a single scene.
    pub fn case_name(&self, at: usize) -> Option<&str> {
        (self.len() > 1).then(|| self.cases[at].short_name())
    }

    /// Adds the name of a load case (from 0) to an error if there are several.
    pub fn about(&self, at: usize, error: Error) -> Error {
        match self.case_name(at) {
            Some(name) => error.about(format!("case `{name}`")),
            None => error,
        }
    }

    /// Returns the variations that a body for these load cases is judged on, for a body of 2 or 3 dimensions: those of
    /// the scene file, or the standard ones.
    pub fn variations(&self, dimension: usize) -> Vec<SceneVariation> {
        match &self.variations {
            Variations::Without => Vec::new(),
            Variations::Stated(stated) => stated.clone(),
            Variations::Standard | Variations::Robust => {
                let of_case = |(case, scene): (usize, &Scene)| {
                    let varied = scene.standard_variations(dimension);
                    varied.into_iter().map(move |(name, scene)| SceneVariation { name, case, scene })
                };
                self.iter().enumerate().flat_map(of_case).collect()
            }
        }
    }

    /// Returns the variations that the scene file states.
    pub fn stated_variations(&self) -> &Variations {
        &self.variations
    }

    /// Returns true if the scene file states its variations.
    pub fn states_variations(&self) -> bool {
        matches!(self.variations, Variations::Stated(_))
    }

    /// Returns true if a body has to hold in the variations: those that the scene file states, or the standard ones of a
    /// robust scene.
    pub fn requires_variations(&self) -> bool {
        matches!(self.variations, Variations::Stated(_) | Variations::Robust)
    }

    /// Returns the load cases with the standard variations as a requirement, unless the scene file states its own.
    pub fn robust(self) -> Self {
        let variations = match self.variations {
            Variations::Without | Variations::Standard => Variations::Robust,
            stated => stated,
        };
        Self { variations, ..self }
    }

    /// Returns the load cases, [robust](Self::robust) if `is_robust`.
    pub fn robust_if(self, is_robust: bool) -> Self {
        if is_robust { self.robust() } else { self }
    }

    /// Returns the load cases without variations.
    pub fn without_variations(self) -> Self {
        Self { variations: Variations::Without, ..self }
    }

    /// Returns the smallest tolerance of each quantity over all load cases, with the smallest compared
    /// deflection of the first case.
    pub fn least_tolerance(&self) -> Tolerance {
        self[1..].iter().fold(self[0].requirements.tolerance, |least, scene| {
            let errors_of_case = scene.requirements.tolerance.errors;
            Tolerance { errors: least.errors.zip(errors_of_case).map(|(a, b)| a.min(b)), ..least }
        })
    }
}

/// Returns the names of the load cases of a scene file; empty for a scene without cases.
fn names(cases: &[Scene]) -> Vec<&str> {
    cases.iter().filter_map(Scene::case_name).collect()
}

fn ambiguous(names: &[&str]) -> Diagnostic {
    let message = format!("the scene has the load cases {}, but only one can be used here", names.join(", "));
    Diagnostic::new(Code::SceneCase, message)
}

fn unknown_case(name: &str, names: &[&str]) -> Diagnostic {
    if names.is_empty() {
        let message = format!("the scene has no load case `{name}`: it has no load cases at all");
        return Diagnostic::new(Code::SceneCase, message).with_help("leave --case out");
    }
    let message = format!("the scene has no load case `{name}`: it has {}", names.join(", "));
    Diagnostic::new(Code::SceneCase, message)
}
