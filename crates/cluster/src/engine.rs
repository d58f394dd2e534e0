//! Local run of the driver, with MPI and the Python packages of PETSc and SLEPc.

use super::prepare::{DRIVER, DRIVER_SOURCE};
use flexbody_base::children;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Solver of the driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum Solver {
    /// Shift-invert Krylov-Schur with a factor of MUMPS.
    #[default]
    Mumps,
    /// Spectrum slicing.
    Slices,
    /// Krylov-Schur with conjugate gradients and algebraic multigrid.
    Gamg,
    /// LOBPCG with algebraic multigrid.
    Lobpcg,
}

impl Solver {
    /// All solvers, in the order of the documentation.
    pub const ALL: &'static [Self] = <Self as strum::VariantArray>::VARIANTS;

    /// Returns the name for the driver and on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Programs that run the driver.
#[derive(Debug, Clone, PartialEq)]
pub struct Engine {
    /// Command and options that start MPI, such as `mpiexec --oversubscribe`.
    pub mpiexec: Vec<String>,
    /// Python with petsc4py and slepc4py; `None` for the first default one that has them.
    pub python: Option<String>,
    /// Number of MPI ranks.
    pub ranks: u32,
    /// Solver.
    pub solver: Solver,
}

/// Python interpreters that are tested by default.
const PYTHONS: [&str; 2] = ["python3", "/usr/bin/python3"];

/// Options that keep Python from loading packages of the current folder, of the folder of the driver and of PYTHONPATH,
/// which may hold untrusted data. Since Python 3.11 `-I` includes `-P`, which older versions do not support.
const ISOLATED: [&str; 1] = ["-I"];

impl Engine {
    /// Returns a Python that has the packages.
    ///
    /// # Errors
    /// [`EngineMissing`](Code::EngineMissing) with the message of the last interpreter that was tested.
    pub fn find_python(&self) -> Result<String> {
        let candidates: Vec<&str> = match &self.python {
            Some(stated) => vec![stated],
            None => PYTHONS.to_vec(),
        };
        let mut why = String::new();
        for python in candidates {
            match probe(python) {
                Ok(output) if output.status.success() => return Ok(python.to_owned()),
                Ok(output) => why = format!("{python} reports: {}", last_line(&output)),
                Err(e) => why = format!("{python} cannot be started: {e}"),
            }
        }
        Err(Diagnostic::new(
            Code::EngineMissing,
            format!("no Python with petsc4py and slepc4py was found: {why}"),
        )
        .into())
    }

    /// Checks, before anything is written, that the driver can be run. Returns the Python for it.
    ///
    /// # Errors
    /// [`EngineMissing`](Code::EngineMissing) if MPI or the packages are missing.
    pub fn check(&self) -> Result<String> {
        let program = self.mpiexec.first().map_or("", String::as_str);
        let mut version = Command::new(program);
        let version = children::output(version.arg("--version").stdin(Stdio::null()));
        version.map_err(|e| missing(program, &e))?;
        self.find_python()
    }

    /// Runs the driver on a prepared folder and waits for it.
    ///
    /// # Errors
    /// [`EngineMissing`](Code::EngineMissing) if MPI cannot be started; [`EngineFailed`](Code::EngineFailed) if the
    /// driver ends without a result.
    pub fn run(&self, python: &str, folder: &Path) -> Result<()> {
        let Some((program, options)) = self.mpiexec.split_first() else {
            return Err(Diagnostic::new(Code::EngineMissing, "no program that starts MPI is given").into());
        };
        let mut command = Command::new(program);
        command.args(options).arg("-n").arg(self.ranks.to_string());
        command
            .arg(python)
            .args(ISOLATED)
            .arg(folder.join(DRIVER))
            .arg(folder)
            .args(["--solver", self.solver.name()]);
        // Threads of BLAS would compete with the ranks for processors.
        command.env("OMP_NUM_THREADS", "1").env("OPENBLAS_NUM_THREADS", "1").stdin(Stdio::null());
        let output = children::output(&mut command).map_err(|e| missing(program, &e))?;
        if output.status.success() {
            return Ok(());
        }
        let message = format!("{program} ended with {}: {}", output.status, cause(&output));
        Err(Diagnostic::new(Code::EngineFailed, message).in_file(folder).into())
    }
}

fn missing(program: &str, error: &std::io::Error) -> Diagnostic {
    Diagnostic::new(Code::EngineMissing, format!("`{program}` cannot be started: {error}"))
}

/// Runs the driver in a Python to test which packages it finds.
fn probe(python: &str) -> std::io::Result<Output> {
    let mut command = Command::new(python);
    command
        .args(ISOLATED)
        .args(["-", "--probe"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = children::start(&mut command)?;
    if let Some(mut input) = child.stdin.take() {
        // A program that does not read its input reports its own error.
        let _ = input.write_all(DRIVER_SOURCE.as_bytes());
    }
    children::output_of(child)
}

/// Returns the reason of a failure: the error message of the program if there is one, else its last line.
fn cause(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr);
    let error_line = text.lines().find(|line| line.starts_with("error") || line.contains("exited on signal"));
    error_line.map_or_else(|| last_line(output), |line| line.trim().to_owned())
}

fn last_line(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr);
    let line = text.lines().rev().find(|line| line.chars().any(char::is_alphanumeric));
    line.map_or_else(|| "nothing".to_owned(), |line| line.trim().to_owned())
}
