//! Commands that make exactly the body of a recommendation.

use crate::selection::Selection;
use flexbody_base::provenance::shell_word;
use flexbody_body::flex_body::{Storage, Subset, TermGroups};
use flexbody_eigen::Accuracy;

/// Inputs of a study as the user named them, from which its commands start.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin {
    /// Model or flex-body file, with the options that read it: words of a command line.
    pub input: Vec<String>,
    /// Scene file.
    pub scene: String,
    /// Load case of the scene, if only one was studied.
    pub case: Option<String>,
}

/// Conversion that makes a body of a study, in terms of the options of `flexbody convert`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Recipe {
    /// Body of a flex-body file.
    File,
    /// Body converted from the model.
    Conversion(ConversionRecipe),
}

/// Options of `flexbody convert` that make a body of a study before modes and terms are left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConversionRecipe {
    /// Number of free modes.
    pub modes: usize,
    /// Loads of the residual vectors, as `--residual-vectors` takes them; empty for none.
    pub residual_vectors: Vec<&'static str>,
    /// Accuracy of the modes.
    pub accuracy: Accuracy,
    /// Contribution of the scene to the basis.
    pub scene: SceneBasis,
}

/// Contribution of a scene to the basis of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SceneBasis {
    /// None.
    Without,
    /// Static responses to the forces that the motion leaves unbalanced.
    Enriched {
        /// True if the truncation error is within a hundredth of the tolerances, instead of a tenth.
        is_fine: bool,
    },
    /// Shapes of the motion of the enriched body.
    Shapes {
        /// Number of shapes.
        count: usize,
        /// True if the truncation error of the enriched body is within a hundredth of the tolerances.
        is_fine: bool,
    },
}

impl Recipe {
    /// Returns the command that makes the body with the modes and groups of `subset`. `n_modes` is the number of modes
    /// before any is left out.
    pub fn command(&self, origin: &Origin, subset: &Subset, n_modes: usize, storage: Storage) -> String {
        let Self::Conversion(own) = self else {
            return reduction(origin, subset, n_modes, storage);
        };
        let mut words = own.words(origin);
        words.extend(subset_words(subset, n_modes, own.scene != SceneBasis::Without));
        command("convert", &origin.input, words, storage)
    }
}

impl ConversionRecipe {
    fn words(&self, origin: &Origin) -> Vec<String> {
        let loads = if self.residual_vectors.is_empty() { "none" } else { &self.residual_vectors.join(",") };
        let mut words = text(["--modes", &self.modes.to_string(), "--residual-vectors", loads]);
        if self.accuracy != Accuracy::default() {
            words.extend(text(["--accuracy", self.accuracy.name()]));
        }
        let is_fine = match self.scene {
            SceneBasis::Without => return words,
            SceneBasis::Enriched { is_fine } => is_fine,
            SceneBasis::Shapes { count, is_fine } => {
                words.extend(text(["--basis", "scene", "--motion-shapes", &count.to_string()]));
                is_fine
            }
        };
        words.extend(scene_words(origin));
        if is_fine {
            words.extend(text(["--enrichment", "fine"]));
        }
        words
    }
}

/// Returns the command that makes the body of a selection from a model. `modes` is the number of free modes that the
/// user gave; `None` if the band of the scene decides.
pub fn selected_from_model(selection: &Selection, origin: &Origin, modes: Option<usize>) -> String {
    let mut words = scene_words(origin);
    if let Some(modes) = modes {
        words.extend(text(["--modes", &modes.to_string()]));
    }
    words.extend(subset_words(&selection.subset(), selection.n_modes, true));
    command("convert", &origin.input, words, Storage::F64)
}

/// Returns the command that makes the body of a selection from the flex-body file that it was made for.
pub fn selected_from_file(selection: &Selection, origin: &Origin) -> String {
    reduction(origin, &selection.subset(), selection.n_modes, Storage::F64)
}

/// Returns the command that makes the body of an advice from its flex-body file.
pub fn advised(file: &str, groups: TermGroups) -> String {
    let subset = Subset { groups, ..Subset::default() };
    command("reduce", &[file.to_owned()], subset_words(&subset, 0, true), Storage::F64)
}

fn reduction(origin: &Origin, subset: &Subset, n_modes: usize, storage: Storage) -> String {
    command("reduce", &origin.input, subset_words(subset, n_modes, true), storage)
}

fn command(name: &str, input: &[String], options: Vec<String>, storage: Storage) -> String {
    let start = text(["flexbody", name]).into_iter().chain(input.iter().cloned());
    let words = start.chain(options).chain(storage_words(storage)).chain(text(["-o", "body.flex.h5"]));
    words.map(|word| shell_word(&word)).collect::<Vec<_>>().join(" ")
}

fn scene_words(origin: &Origin) -> Vec<String> {
    let case = origin.case.iter().flat_map(|case| text(["--case", case]));
    text(["--scene", &origin.scene]).into_iter().chain(case).collect()
}

/// Returns the options that state the subset of `n_modes` modes. The terms are stated even if the body has all of them
/// if `states_terms`: `convert` with a scene would select them otherwise, and `reduce` needs something to do.
fn subset_words(subset: &Subset, n_modes: usize, states_terms: bool) -> Vec<String> {
    let fixed = subset.fixed_interface_modes.as_ref();
    let fixed = fixed.map(|modes| text(["--fixed-interface-modes", &Subset::some_modes_text(modes)]));
    let some = subset.modes.as_ref().filter(|modes| modes.len() < n_modes);
    let some = some.map(|modes| text(["--keep-modes", &Subset::modes_text(modes)]));
    let mut words: Vec<String> = fixed.into_iter().chain(some).flatten().collect();
    if states_terms || subset.groups != TermGroups::ALL {
        words.extend(text(["--terms", &Subset::groups_text(subset.groups)]));
    }
    words
}

fn storage_words(storage: Storage) -> Vec<String> {
    match storage {
        Storage::F64 => Vec::new(),
        Storage::F32 => text(["--storage", storage.name()]),
    }
}

fn text<const N: usize>(words: [&str; N]) -> Vec<String> {
    words.map(str::to_owned).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A command that leaves nothing out still runs: `reduce` without an option is refused.
    #[test]
    fn the_whole_body_is_stated() {
        let origin = Origin { input: vec!["a b.h5".to_owned()], scene: "s.toml".to_owned(), case: None };
        let all = Subset { modes: Some(vec![0, 1]), ..Subset::default() };
        let command = Recipe::File.command(&origin, &all, 2, Storage::F64);
        assert_eq!(command, "flexbody reduce 'a b.h5' --terms all -o body.flex.h5");
        assert_eq!(advised("a.h5", TermGroups::NONE), "flexbody reduce a.h5 --terms none -o body.flex.h5");
    }
}
