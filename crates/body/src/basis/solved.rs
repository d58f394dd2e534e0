//! Free-surface modes from another eigen-solver for the same K and M. Rayleigh quotients and residuals are
//! recomputed. Only the inertia count may be taken from the other solver, if no own count is requested.

use super::BasisKind;
use super::failure::explain;
use super::modal_basis::{Basis, ModalBasis, Task, problem_of_span, rigid_modes};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::provenance::SourceFile;
use flexbody_eigen::{
    Accuracy, Completeness, EigenSettings, EigenSolution, Proof, SAME_EIGENVALUE, Wanted, modes_of_span,
};
use flexbody_linalg::larger;
use flexbody_model::FeModel;

/// Inertia count made by another program.
#[derive(Debug, Clone, PartialEq)]
pub struct CountElsewhere {
    /// Number of negative pivots of K - shift M.
    pub negative: usize,
    /// Number of zero pivots.
    pub zero: usize,
    /// Shift of the count, an eigenvalue.
    pub shift: f64,
    /// Name of the program, such as `MUMPS of PETSc 3.18.5`.
    pub by: String,
}

/// Modes of a model from another eigen-solver.
#[derive(Debug, Clone, PartialEq)]
pub struct SolvedModes {
    /// Modes by internal rows (N x k), ascending: the wanted modes and all others of their last eigenvalue.
    pub vectors: Mat<f64>,
    /// Eigenvalues as stated by the solver.
    pub eigenvalues: Vec<f64>,
    /// Next eigenvalue after the last, if the solver found it.
    pub next_eigenvalue: Option<f64>,
    /// Inertia count of the solver, if there is one.
    pub count: Option<CountElsewhere>,
    /// Name of the solver for settings, such as `slepc`.
    pub engine: String,
    /// True if the built-in inertia count is to be made.
    pub prove: bool,
    /// File that the modes were read from.
    pub source: SourceFile,
}

impl Basis for SolvedModes {
    fn kind(&self) -> BasisKind {
        BasisKind::Free
    }

    fn modes(&self, task: &Task<'_>) -> Result<ModalBasis> {
        let Task { model, settings, context } = *task;
        let rigid = rigid_modes(model, &model.pencil())?;
        let problem = problem_of_span(model, rigid.as_ref());
        // Use all modes found: the modes of one eigenvalue get their canonical form together.
        let accuracy = match (self.prove, settings.accuracy) {
            (false, _) => Accuracy::Fast,
            (true, Accuracy::Fast) => Accuracy::Standard,
            (true, other) => other,
        };
        let whole = EigenSettings { wanted: Wanted::Lowest(usize::MAX), accuracy, ..*settings };
        let solution = modes_of_span(&problem, self.vectors.clone(), &whole, context);
        let mut solution = solution.map_err(|failure| explain(model, failure))?;
        self.refuse_others(&solution, settings.accuracy)?;
        solution.completeness = self.completeness(model, rigid.ncols(), solution.completeness)?;
        let notes = self.cut(model, &mut solution, settings.wanted);
        let mut basis = ModalBasis::new(model, &problem, settings, solution, super::FREE_MODE)?;
        basis.diagnostics.extend(notes);
        Ok(basis)
    }
}

impl SolvedModes {
    /// Returns an error if the columns are no eigenvectors of the model.
    fn refuse_others(&self, solution: &EigenSolution, accuracy: Accuracy) -> Result<()> {
        let inaccurate =
            |message: String| Err(Error::from(Diagnostic::new(Code::ClusterInaccurate, message)));
        let (given, exact) = (solution.residuals.len(), solution.eigenvectors(accuracy));
        if exact < given {
            let worst = solution.residuals.iter().copied().fold(0.0, larger);
            return inaccurate(format!(
                "{} of {given} modes are not eigenvectors of the model: K-residual up to {worst:.0e}, accuracy `{}` requires {:.0e}",
                given - exact,
                accuracy.name(),
                accuracy.residual()
            ));
        }
        let pairs = self.eigenvalues.iter().zip(&solution.eigenvalues);
        match pairs
            .enumerate()
            .find(|(_, (stated, quotient))| (*stated - *quotient).abs() > SAME_EIGENVALUE * quotient.abs())
        {
            Some((j, (stated, quotient))) => inaccurate(format!(
                "the result states the eigenvalue {stated:.9e} for mode {}, its Rayleigh quotient is {quotient:.9e}",
                j + 1
            )),
            None => Ok(()),
        }
    }

    /// Returns the completeness by the built-in count if it was made, otherwise by the count of the solver,
    /// whose name then appears.
    fn completeness(&self, model: &FeModel, rigid: usize, stated: Completeness) -> Result<Completeness> {
        let missing = |message: String| {
            let diagnostic = Diagnostic::new(Code::CompletenessFailed, message);
            Err(Error::from(
                diagnostic.with_help("run the driver again: it searches for the modes that are missing"),
            ))
        };
        if self.prove {
            return match (stated.proof, stated.negative_pivots) {
                (Proof::NotProved, Some(_)) => missing(stated.remark),
                _ => Ok(stated),
            };
        }
        let Some(CountElsewhere { negative, zero, shift, by }) = &self.count else {
            let remark = "the solver made no inertia count".to_owned();
            return Ok(Completeness { proof: Proof::NotProved, negative_pivots: None, remark, ..stated });
        };
        let below = self.eigenvalues.iter().filter(|lambda| *lambda < shift).count();
        let hertz = model.units().frequency_of(*shift);
        if *negative != rigid + below || *zero > 0 {
            return missing(format!(
                "the result has {below} modes below {hertz:.3} Hz, its inertia count is {negative} with {rigid} rigid modes and {zero} pivots of zero"
            ));
        }
        let remark = format!("inertia count {negative} by {by} at {hertz:.3} Hz, not recomputed");
        let (proof, negative_pivots) = (Proof::NotProved, Some(*negative));
        Ok(Completeness { proof, shift: *shift, negative_pivots, modes_below: below, remark })
    }

    /// Keeps only the wanted modes and returns diagnostics about the others.
    fn cut(&self, model: &FeModel, solution: &mut EigenSolution, wanted: Wanted) -> Vec<Diagnostic> {
        let found = solution.eigenvalues.len();
        let given = match wanted {
            Wanted::Lowest(count) => count.min(found),
            Wanted::Below(lambda) => solution.eigenvalues.partition_point(|&l| l < lambda),
        };
        let mut notes = Vec::new();
        if let Wanted::Lowest(count) = wanted
            && count > given
            && count < usize::MAX
        {
            let message = format!("{count} modes were requested, the result has {given}");
            notes.push(Diagnostic::new(Code::ModesClamped, message));
        }
        let end = match wanted {
            Wanted::Lowest(_) => solution.completeness.modes_below,
            Wanted::Below(_) => given,
        };
        if end > given {
            let message = format!(
                "mode {given} shares its eigenvalue with other modes that are left out (number: {})",
                end - given
            );
            notes.push(
                Diagnostic::new(Code::RepeatedSplit, message)
                    .with_help(format!("ask for {end} modes to keep the body's symmetry")),
            );
        }
        solution.next_eigenvalue = solution.eigenvalues.get(given).copied().or(self.next_eigenvalue);
        solution.eigenvalues.truncate(given);
        solution.residuals.truncate(given);
        solution.rounding_floors.truncate(given);
        solution.vectors = solution.vectors.as_ref().subcols(0, given).to_owned();
        notes.extend(self.completeness_note(model, &solution.completeness));
        notes
    }

    /// Returns a diagnostic about the program that counted the modes, unless the built-in count proved
    /// them.
    fn completeness_note(&self, model: &FeModel, completeness: &Completeness) -> Option<Diagnostic> {
        let Completeness { proof, negative_pivots, remark, .. } = completeness;
        let help = "count again with flexbody assemble --prove, if the factor fits the memory";
        match (proof, negative_pivots) {
            (Proof::InertiaCount, _) => None,
            (_, Some(_)) => Some(Diagnostic::new(Code::CompletenessElsewhere, remark).with_help(help)),
            (_, None) => {
                let message =
                    format!("completeness of the modes of {} is not proved: {remark}", model.name());
                Some(Diagnostic::new(Code::CompletenessUnproved, message).with_help(help))
            }
        }
    }
}
