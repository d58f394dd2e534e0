//! Error of a run of another program.

use super::progress::{Listener, heard};
use super::{FlexBody, Model, ReportFormat, Scene};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_motion::dynamics::EulerParameters;
use flexbody_motion::scene;
use flexbody_report::{MeasuredRunFacts, RunData};
use flexbody_study::measured_run;
use std::path::{Path, PathBuf};

/// Motion of a body that another program computed, from time 0 to the end of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionHistory(scene::MotionHistory);

impl MotionHistory {
    /// Reads the table of a run for a body with `n_modes` modes, see `docs/how_to/known_error.md`.
    ///
    /// # Errors
    /// FB215 for missing columns; FB216 for rows that cannot be read; FB101 if there is no such file.
    pub fn read(path: impl AsRef<Path>, n_modes: usize) -> Result<Self> {
        scene::MotionHistory::read(path.as_ref(), n_modes).map(Self)
    }

    /// Makes a history of ascending times, the modal coordinates at each time and, if they are known, the Euler
    /// parameters of the axes of the model in the world, the cosine of half the angle first.
    ///
    /// # Errors
    /// FB804 if the lengths differ, for fewer than two times, and for times that do not ascend.
    pub fn new(time: Vec<f64>, q: Vec<Vec<f64>>, attitude: Option<Vec<[f64; 4]>>) -> Result<Self> {
        let count = time.len();
        let refused = |message: &str| Err(Diagnostic::new(Code::Argument, message).into());
        if q.len() != count || attitude.as_ref().is_some_and(|rows| rows.len() != count) {
            return refused(
                "a history needs modal coordinates, and an attitude if one is given, for every time",
            );
        }
        if count < 2 || !time.windows(2).all(|pair| pair[0] < pair[1]) {
            return refused("a history needs two or more ascending times");
        }
        let unit = |row: [f64; 4]| {
            let length = row.iter().map(|value| value * value).sum::<f64>().sqrt();
            EulerParameters(row.map(|value| value / length))
        };
        let attitude = attitude.map(|rows| rows.into_iter().map(unit).collect());
        Ok(Self(scene::MotionHistory { path: PathBuf::from("history"), time, attitude, q }))
    }
}

/// Errors of a run of another program relative to a reference motion.
#[derive(Debug, Clone)]
pub struct MeasuredRun {
    inner: measured_run::MeasuredRun,
    body: String,
    history: String,
    diagnostics: Vec<Diagnostic>,
}

impl FlexBody {
    /// Measures the errors of a run of this body in `scene` by another program, like `flexbody measure`. The reference is
    /// the motion of `reference`, a body with more modes of the same model, or of this body itself.
    ///
    /// # Errors
    /// FB217 if the history does not cover the time of the scene; FB707 for a history or a reference that does not belong
    /// to the body; FB540 if the motion of the reference cannot be integrated; FB605 if the listener stops it.
    pub fn measure(
        &self,
        scene: &Scene,
        history: &MotionHistory,
        reference: Option<(&FlexBody, &Model)>,
        listener: Listener<'_>,
    ) -> Result<MeasuredRun> {
        let reference = reference.map(|(body, model)| (&body.0, &model.checked));
        let only = scene.0.single()?;
        let (inner, diagnostics) = heard(listener, |context| {
            measured_run::measured_run(&self.0, history.0.clone(), only, reference, context)
        })?;
        let history = history.0.path.display().to_string();
        Ok(MeasuredRun { inner, body: self.name().to_owned(), history, diagnostics })
    }
}

impl MeasuredRun {
    /// Returns true if every error is within its tolerance.
    pub fn holds(&self) -> bool {
        self.inner.holds()
    }

    /// Returns the largest ratio of error to tolerance.
    pub fn worst(&self) -> f64 {
        self.inner.worst
    }

    /// Returns warnings and notes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// Returns the report of `flexbody measure`.
    pub fn report(&self, format: ReportFormat) -> String {
        let run = RunData { diagnostics: self.diagnostics.clone(), ..RunData::default() };
        MeasuredRunFacts::new(&self.inner, &self.body, self.history.clone(), &run).render(format.inner())
    }
}
