//! Stresses and displacements of the steps of results, and where the stresses are.

use super::averaged::Averaged;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;

/// Components of the stress in the order of the rows of a recovery.
pub(super) const COMPONENTS: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];

/// Place of six stresses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// Number of a node.
    Node(i64),
    /// Integration point of an element.
    Point { element: i64, point: i64 },
}

/// Values of one step.
#[derive(Debug, Default)]
pub(super) struct Step {
    pub stresses: Vec<(Place, [f64; 6])>,
    pub displacements: Vec<(i64, [f64; 3])>,
    pub energy: Option<f64>,
}

/// Stresses and displacements of all steps.
#[derive(Debug, Default)]
pub(super) struct StepValues {
    /// Places of the stresses, equal in all steps.
    pub places: Vec<Place>,
    /// Stresses of each step and place, in the order xx, yy, zz, xy, yz, xz.
    pub stresses: Vec<Vec<[f64; 6]>>,
    /// Nodes of the displacements, equal in all steps.
    pub moved: Vec<i64>,
    /// Displacements of each step and node.
    pub displacements: Vec<Vec<[f64; 3]>>,
    /// Strain energies of the steps; fewer than the steps if some have none.
    pub energies: Vec<f64>,
    /// Significant decimal digits of stresses and displacements.
    pub digits: u8,
    /// Means among the stresses.
    pub averaged: Averaged,
}

impl StepValues {
    /// Collects the values of all steps.
    ///
    /// # Errors
    /// FB327 for results without stresses, for steps with different places, and for values that are not finite.
    pub(super) fn of(steps: Vec<Step>, digits: u8, file: &InputFile) -> Diagnosed<Self> {
        let mut values = Self { digits, ..Self::default() };
        for (at, step) in steps.into_iter().enumerate() {
            let (places, stresses): (Vec<_>, Vec<_>) = step.stresses.into_iter().unzip();
            let (moved, displacements): (Vec<_>, Vec<_>) = step.displacements.into_iter().unzip();
            if at == 0 {
                (values.places, values.moved) = (places, moved);
            } else if places != values.places || moved != values.moved {
                let message = format!("step {} has values at other places than step 1", at + 1);
                return Err(unreadable(file, message));
            }
            let finite = stresses.iter().flatten().chain(displacements.iter().flatten());
            if finite.chain(&step.energy).any(|value| !value.is_finite()) {
                return Err(unreadable(file, format!("a value of step {} is not finite", at + 1)));
            }
            values.stresses.push(stresses);
            values.displacements.push(displacements);
            values.energies.extend(step.energy);
        }
        Ok(values)
    }

    /// Refuses values without stresses.
    ///
    /// # Errors
    /// FB327.
    pub(super) fn with_stresses(self, file: &InputFile) -> Diagnosed<Self> {
        if self.places.is_empty() {
            return Err(unreadable(file, "no stresses are in the file"));
        }
        Ok(self)
    }

    /// Returns the number of steps.
    pub(super) fn steps(&self) -> usize {
        self.stresses.len()
    }

    /// Returns the strain energies; `None` if there are none.
    pub(super) fn energies(&self) -> Option<Vec<f64>> {
        (!self.energies.is_empty()).then(|| self.energies.clone())
    }

    /// Returns the stresses with six rows for each place and one column for each step.
    pub(super) fn stresses(&self) -> Mat<f64> {
        Mat::from_fn(6 * self.places.len(), self.steps(), |row, step| self.stresses[step][row / 6][row % 6])
    }
}

/// Returns FB327 about a file.
pub(super) fn unreadable(file: &InputFile, message: impl Into<String>) -> Vec<Diagnostic> {
    vec![Diagnostic::new(Code::FeResultsSyntax, message).in_file(file.path())]
}
