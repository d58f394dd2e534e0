//! Exact flexible bodies for multibody simulation from finite element matrices.
//!
//! `flexbody` reads the consistent mass matrix M and stiffness matrix K of a free body, computes its
//! free-surface mass-normalised modes and condenses the nodal floating-frame equations of motion, without a
//! lumped-mass approximation, into the constant invariants I0, W1, W2, W3. Sources of every equation and the
//! errata of the literature: `docs/theory.md`.
//!
//! # Six tasks
//!
//! **Convert the model of a manifest, look at the body, write it and read it back.**
//!
//! ```
//! use flexbody::{ConvertOptions, FlexBody, Model};
//! # fn main() -> flexbody::Result<()> {
//! let model = Model::read("fixtures/models/cube_hex8/model.toml")?;
//! let body = model.convert(&ConvertOptions::default().modes(8))?.body;
//! println!("{} kg, first mode at {} Hz", body.mass(), body.frequencies_hz()[0]);
//! let w2 = body.w2().expect("all groups are there without a scene");
//! assert_eq!((w2.rows(), w2.columns()), (24, 24));
//! # let folder = tempfile::tempdir().expect("a folder");
//! # let path = folder.path().join("cube.flex.h5");
//! body.write(&path)?;
//! assert_eq!(FlexBody::read(&path)?, body);
//! # Ok(())
//! # }
//! ```
//!
//! **Make a model of matrices in memory**, here a truss, from `sprs` or from slices of compressed columns
//! ([`SparseMatrix::from_csc`]). `examples/from_memory.rs` goes on from here.
//!
//! ```
//! use flexbody::{Model, SparseMatrix};
//! # fn main() -> flexbody::Result<()> {
//! # let (k, m, nodes) = flexbody_doctest::truss();
//! let model = Model::builder("truss", SparseMatrix::from_sprs(&k), SparseMatrix::from_sprs(&m))
//!     .nodes((1..=nodes.len() as i64).collect(), nodes)
//!     .units("m", "kg", "s")?
//!     .damping_ratio(0.02)
//!     .build()?;
//! assert_eq!(model.n_dofs(), 3 * model.node_ids().len());
//! # Ok(())
//! # }
//! # mod flexbody_doctest { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/truss/mod.rs")); }
//! ```
//!
//! **Keep what a scene needs**, and see why.
//!
//! ```no_run
//! use flexbody::{ConvertOptions, Model, Scene};
//! # fn main() -> flexbody::Result<()> {
//! let model = Model::read("fixtures/models/bracket_hex20/model.toml")?;
//! let scene = Scene::read("fixtures/scenes/tumbling.toml")?;
//! let (conversion, selection) = model.convert_for(&scene, &ConvertOptions::default().modes(6))?;
//! for (group, kept, why) in selection.groups() {
//!     println!("{group}: {} {why}", if kept { "kept," } else { "dropped," });
//! }
//! assert_eq!(conversion.body.n_modes(), selection.modes().len());
//! # Ok(())
//! # }
//! ```
//!
//! **Simulate.**
//!
//! ```
//! use flexbody::{ConvertOptions, Model, Scene};
//! # fn main() -> flexbody::Result<()> {
//! let model = Model::read("fixtures/models/bracket_hex20/model.toml")?;
//! let body = model.convert(&ConvertOptions::default().modes(6))?.body;
//! let motion = body.simulate(&Scene::read("fixtures/scenes/tumbling.toml")?)?;
//! println!("a node is deflected by {} at most", motion.largest_deflection());
//! # assert!(motion.largest_deflection() > 0.0);
//! # Ok(())
//! # }
//! ```
//!
//! **Join bodies.** The equations of motion and the points of a body are enough for Lagrange multipliers:
//! `examples/joints/mod.rs` holds flexible bodies together in some two hundred lines, `examples/pendulum.rs`
//! and `examples/slider_crank.rs` use it.
//!
//! **Hand the body to another program.** Errors carry codes (`docs/reference/codes.md`), with what to do.
//!
//! ```
//! use flexbody::{ConvertOptions, ExportOptions, Model};
//! # fn main() -> flexbody::Result<()> {
//! # let folder = tempfile::tempdir().expect("a folder");
//! # let path = folder.path().join("cube.sid");
//! let body = Model::read("fixtures/models/cube_hex8/model.toml")?.convert(&ConvertOptions::default())?.body;
//! for note in body.export("sid", &path, &ExportOptions::default())? {
//!     println!("{note}");
//! }
//! let unknown = body.export("msc", &path, &ExportOptions::default()).expect_err("no such format");
//! println!("{}: {}", unknown.diagnostics()[0].code().id(), unknown.diagnostics()[0].message());
//! # Ok(())
//! # }
//! ```
//!
//! The crates that stand behind this front door, and which of them uses which: `ARCHITECTURE.md`.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

/// The examples of the page on the library.
#[cfg(doctest)]
#[doc = include_str!("../docs/reference/rust.md")]
struct PageOnTheLibrary;

mod api;
#[cfg(feature = "cli")]
#[allow(clippy::exit, clippy::print_stderr, clippy::print_stdout)] // the program
mod cli;

#[cfg(feature = "import")]
pub use api::Audit;
pub use api::{
    Accuracy, Advice, AttachedMass, Basis, BodyFrame, Channels, Check, Comparison, ComparisonFormat,
    ComparisonRow, Conversion, ConvertOptions, Coupling, ExportOptions, FlexBody, FrameChoice,
    GeometricStiffness, Identity, Interface, InterfaceCoordinates, Listener, LoadedHistory, Matrix,
    MeasuredRun, ModePair, Model, ModelBuilder, Motion, MotionHistory, PointPath, Progress, Quantity, Ranges,
    Recipe, RecipeStep, Recovered, RecoveredRows, RecoveryRow, ReportFormat, Scene, Selection, SourceFile,
    SparseMatrix, StressLoads, StressNodes, Tolerances, unit_names,
};
#[cfg(feature = "cluster")]
pub use api::{Batch, BatchOptions, BatchedBody};
#[cfg(feature = "hdf5")]
pub use api::{RecordedMotion, ReferenceChoice, Trade, TradeOptions, View};
#[cfg(feature = "response")]
pub use api::{Response, ResponseOptions, TransferFunction};

/// The reduced equations of motion of one body, as a reference for other programs: mass matrix, velocity
/// forces, accelerations, momenta, energies (theory sections 2 and 6). [`FlexBody::equations_of_motion`]
/// makes them, [`FlexBody::node_point`] and [`FlexBody::interface_point`] the points where joints hold a
/// body; `examples/pendulum.rs` joins one to the ground.
pub mod dynamics {
    pub use flexbody_motion::dynamics::{
        AngularVelocity, BodyPoint, EquationsOfMotion, EulerParameters, Evaluation, LoadAxes, LoadJacobian,
        NotPositiveDefinite, Orientation, PlaneAngle, Prescribed, RotationVector, Terms,
    };
}

/// Crates whose types signatures of this library have: vectors and matrices of three rows, values that can be
/// serialised, and sparse matrices.
pub use {nalgebra, serde, sprs};

pub use flexbody_base::diagnostic::{Code, Diagnostic, Explanation, Severity};
pub use flexbody_base::error::{Error, ExitCode, Result};

/// Entry points of `src/main.rs` and of the command of the Python package; not part of the public interface.
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod program {
    #[cfg(feature = "cluster")]
    pub use crate::cli::set_program;
    pub use crate::cli::{Arguments, end, end_without_unfinished_files, parse, run, use_threads};
    pub use flexbody_base::hdf5_file::take_variables as take_hdf5_variables;
    pub use flexbody_base::memory::accepts_failure;
    pub use flexbody_base::output::abandon_unfinished_soon;
    pub use flexbody_base::provenance::state_command;
}
