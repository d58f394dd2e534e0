//! Flexible bodies.

use super::matrix::shown;
use super::progress::{Listener, NO_LISTENER, heard};
use super::scene::Subject;
use super::{Matrix, Motion, Scene, Selection};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{self, Subset};
use flexbody_body::verification::{accept, body_identities};
use flexbody_motion::dynamics::{BodyPoint, EquationsOfMotion, Terms};
use flexbody_motion::scene::{Point, Simulated, SimulationRequest, body_point};
use flexbody_study::selection_request::SelectionRequest;
use nalgebra::{Matrix3, Vector3};
#[cfg(feature = "hdf5")]
use std::path::Path;

/// Flexible body: modes, and the constant invariants of the equations of motion of its floating frame (theory section
/// 2). Vectors are along the axes of the body frame, about its origin, in the units of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct FlexBody(pub(super) flex_body::FlexBody);

/// Relation that the numbers of every body satisfy (theory section 10).
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Identity {
    /// Name of the identity.
    pub name: &'static str,
    /// Relative violation.
    pub value: f64,
    /// Largest allowed violation.
    pub limit: f64,
    /// True if the identity holds.
    pub holds: bool,
}

impl FlexBody {
    /// Reads a flex-body file.
    ///
    /// # Errors
    /// FB101 and FB106 if the file cannot be read; FB701 to FB703 if it is another file, has a newer format, or
    /// violates its schema; FB712 if it was changed since it was written.
    #[cfg(feature = "hdf5")]
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        flexbody_file::read(path).map(Self)
    }

    /// Writes a flex-body file, which appears whole or not at all.
    ///
    /// # Errors
    /// FB104 and FB602 if the file cannot be written.
    #[cfg(feature = "hdf5")]
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        flexbody_file::write(&self.0, path)
    }

    /// Returns the bytes of the flex-body file that [`FlexBody::write`] writes.
    ///
    /// # Errors
    /// FB104 and FB602 if its temporary file cannot be written.
    #[cfg(feature = "hdf5")]
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let file = TemporaryBody::new()?;
        self.write(&file.path)?;
        std::fs::read(&file.path).map_err(|error| file.failure(&error))
    }

    /// Reads the bytes of a flex-body file.
    ///
    /// # Errors
    /// The errors of [`FlexBody::read`]; FB104 if the temporary file of the bytes cannot be written.
    #[cfg(feature = "hdf5")]
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let file = TemporaryBody::new()?;
        std::fs::write(&file.path, bytes).map_err(|error| file.failure(&error))?;
        Self::read(&file.path)
    }

    /// Returns the number of modes nf.
    pub fn n_modes(&self) -> usize {
        self.0.n_modes()
    }

    /// Returns the node numbers (n).
    pub fn node_ids(&self) -> &[i64] {
        &self.0.nodes().ids
    }

    /// Returns the positions of the nodes (n x 3), body frame. Unit: length.
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.0.nodes().positions
    }

    /// Returns the triangles of the surface as node indices, counterclockwise seen from outside; empty if no surface is
    /// known.
    pub fn mesh_triangles(&self) -> &[[u32; 3]] {
        self.0.mesh().map_or(&[], |mesh| mesh.triangles())
    }

    /// Returns the edges of the surface and beams as node indices; empty if none are known.
    pub fn mesh_edges(&self) -> &[[u32; 2]] {
        self.0.mesh().map_or(&[], |mesh| mesh.edges())
    }

    /// Returns the origin of the body frame in model coordinates, and its axes as columns.
    pub fn frame(&self) -> (Vector3<f64>, Matrix3<f64>) {
        (self.0.frame().origin, self.0.frame().axes)
    }

    /// Returns the frequencies of the modes, ascending. Unit: Hz.
    pub fn frequencies_hz(&self) -> Vec<f64> {
        self.0.frequencies_hz()
    }

    /// Returns the eigenvalues of the modes, omega^2 (nf). Unit: 1/time^2.
    pub fn eigenvalues(&self) -> &[f64] {
        &self.0.modes().eigenvalue
    }

    /// Returns the damping ratios of the modes (nf).
    pub fn damping_ratios(&self) -> &[f64] {
        &self.0.modes().damping_ratio
    }

    /// Returns the displacements of the nodes in the modes, Psi (3n x nf), three rows per node. Unit: 1/sqrt(mass).
    pub fn shapes(&self) -> Matrix {
        shown(self.0.modes().shape.as_ref())
    }

    /// Returns the number of lowest modes that are proved complete; `None` without a proof.
    pub fn proved_complete(&self) -> Option<usize> {
        self.0.certificate().proved_modes
    }

    /// Returns the mass m. Unit: mass.
    pub fn mass(&self) -> f64 {
        self.0.invariants().mass()
    }

    /// Returns the first moment c = sum m x. Unit: mass length.
    pub fn first_moment(&self) -> Vector3<f64> {
        self.0.invariants().first_moment()
    }

    /// Returns the inertia tensor I0 (3 x 3). Unit: mass length^2.
    pub fn inertia(&self) -> Matrix3<f64> {
        self.0.invariants().inertia()
    }

    /// Returns W1 (3 x 3nf), the inertia linear in the modal coordinates; `None` if the body was made for a scene that
    /// does not need it.
    pub fn w1(&self) -> Option<Matrix> {
        self.0.invariants().w1().map(|w1| shown(w1.as_ref()))
    }

    /// Returns W2 (3nf x 3nf), the inertia quadratic in the modal coordinates; `None` if the body was made for a scene
    /// that does not need it.
    pub fn w2(&self) -> Option<Matrix> {
        self.0.invariants().w2().map(|w2| shown(w2.as_ref()))
    }

    /// Returns W3 (3nf x nf), the coupling of rotation and modes through the modal coordinates; `None` if the body was
    /// made for a scene that does not need it.
    pub fn w3(&self) -> Option<Matrix> {
        self.0.invariants().w3().map(|w3| shown(w3.as_ref()))
    }

    /// Returns C1 (3 x nf), the coupling of translation and modes; zero for free modes.
    pub fn c1(&self) -> Matrix {
        shown(self.0.invariants().c1().as_ref())
    }

    /// Returns C2 (3 x nf), the coupling of rotation and modes in the undeformed body; zero for free modes.
    pub fn c2(&self) -> Matrix {
        shown(self.0.invariants().c2().as_ref())
    }

    /// Returns the modal mass m_ff (nf x nf) = Psi' M Psi.
    pub fn modal_mass(&self) -> Matrix {
        shown(self.0.invariants().modal_mass().as_ref())
    }

    /// Returns the modal stiffness K_ff (nf x nf) = Psi' K Psi.
    pub fn modal_stiffness(&self) -> Matrix {
        shown(self.0.invariants().modal_stiffness().as_ref())
    }

    /// Returns the errors of lumped masses: name of the scheme, and the relative error of each invariant.
    pub fn lumped_errors(&self) -> Vec<(&str, &[(String, f64)])> {
        self.0.lumped().iter().map(|lumped| (lumped.scheme.as_str(), lumped.comparison.as_slice())).collect()
    }

    /// Checks and returns all identities of the body.
    pub fn identities(&self) -> Vec<Identity> {
        body_identities(&self.0).iter().map(Identity::of).collect()
    }

    /// Selects the terms and modes that the body needs in a scene, so that every load case is within its tolerances.
    ///
    /// # Errors
    /// FB212 if the scene does not match the body; FB540 if its motion cannot be integrated.
    pub fn select(&self, scene: &Scene) -> Result<Selection> {
        self.select_with_progress(scene, NO_LISTENER)
    }

    /// Does the work of [`FlexBody::select`] with a listener, which may stop it.
    ///
    /// # Errors
    /// The errors of [`FlexBody::select`]; FB605 if the listener stops it.
    pub fn select_with_progress(&self, scene: &Scene, listener: Listener<'_>) -> Result<Selection> {
        let request = SelectionRequest::default();
        heard(listener, |context| request.for_body(&self.0, &scene.0, context))
            .map(|selected| Selection { inner: selected.selection, subject: Subject::Body })
    }

    /// Returns the body with some of its modes and groups of terms, like `flexbody reduce`.
    ///
    /// * `modes`: numbers of the modes to keep, from 1, ascending; `None` for all.
    /// * `terms`: groups to keep: `W1`, `W2`, `W3` with commas, `none`, `all`, or those of a guideline of the literature:
    ///   `I`, `II`, `III`, `IV`.
    ///
    /// # Errors
    /// FB801 for unknown groups, and for modes that the body does not have; FB714 if an identity does not hold.
    pub fn subset(&self, modes: Option<&[usize]>, terms: &str) -> Result<FlexBody> {
        let modes = modes.map(|modes| Subset::modes_of(modes.to_vec())).transpose()?;
        let subset = Subset { modes, groups: Subset::parse_groups(terms)?, ..Subset::default() };
        let made = self.0.clone().subset(&subset)?;
        accept(&made)?;
        Ok(FlexBody(made))
    }

    /// Returns a Craig-Bampton body with some of its fixed-interface modes and all motions of its interfaces, like `flexbody
    /// reduce --fixed-interface-modes`.
    ///
    /// * `numbers`: numbers of the fixed-interface modes to keep, from 1, ascending; empty for none.
    ///
    /// # Errors
    /// FB801 for another body, and for fixed-interface modes that the body does not have; FB714 if an identity does not hold.
    pub fn with_fixed_interface_modes(&self, numbers: &[usize]) -> Result<FlexBody> {
        let made = self.0.with_fixed_interface_modes(&Subset::modes_of(numbers.to_vec())?)?;
        accept(&made)?;
        Ok(FlexBody(made))
    }

    /// Returns the body with shapes and inertia of the modes rounded to 32-bit floats, like `flexbody reduce --storage
    /// f32`.
    ///
    /// # Errors
    /// FB703 for a number that is too large for a 32-bit float; FB714 if an identity does not hold.
    pub fn rounded_to_f32(&self) -> Result<FlexBody> {
        let made = self.0.rounded_to_f32()?;
        accept(&made)?;
        Ok(FlexBody(made))
    }

    /// Returns the equations of motion of the body, with all terms that it holds.
    pub fn equations_of_motion(&self) -> EquationsOfMotion {
        EquationsOfMotion::new(&self.0, Terms::ALL)
    }

    /// Returns node `number` as a point for forces and measured motion. With the Jacobian J of its velocity, J nu = v
    /// ([`BodyPoint::velocity`]), the force of a joint is J'lambda ([`BodyPoint::add_force`]; \[ZG19\] (57) to (60)).
    /// `examples/pendulum.rs` and `examples/slider_crank.rs` join bodies in this way.
    ///
    /// ```
    /// use flexbody::dynamics::Evaluation;
    /// use flexbody::{ConvertOptions, Model};
    /// # fn main() -> flexbody::Result<()> {
    /// let model = Model::read("fixtures/models/cube_hex8/model.toml")?;
    /// let body = model.convert(&ConvertOptions::default().modes(6))?.body;
    /// let node = body.node_point(body.node_ids()[0])?;
    /// let equations = body.equations_of_motion();
    /// let mut evaluation = Evaluation::new(&equations);
    /// evaluation.set(&[1e-4; 6], &[0.1; 12]);
    /// // A force does the power F v on the velocities nu, whatever the deformation.
    /// let force = nalgebra::Vector3::new(1.0, 2.0, 3.0);
    /// let mut generalised = vec![0.0; 12];
    /// node.add_force(&evaluation, &force, &mut generalised);
    /// let power: f64 = generalised.iter().map(|part| part * 0.1).sum();
    /// assert!((power - force.dot(&node.velocity(&evaluation))).abs() < 1e-12);
    /// assert!(body.node_point(-1).is_err());
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// FB212 for a node that the body does not have.
    pub fn node_point(&self, number: i64) -> Result<BodyPoint> {
        self.point(&Point::Node(number))
    }

    /// Returns the reference point of an interface, which moves with the mean motion of its nodes (theory 5.3).
    ///
    /// # Errors
    /// FB212 for an interface that the body does not have, or one without a reference point.
    pub fn interface_point(&self, name: &str) -> Result<BodyPoint> {
        self.point(&Point::Interface(name.to_owned()))
    }

    fn point(&self, place: &Point) -> Result<BodyPoint> {
        let wrong = |message| Diagnostic::new(Code::SceneBody, message).into();
        body_point(&self.0, Terms::ALL, place).map_err(wrong)
    }

    /// Simulates the body in a scene of one load case.
    ///
    /// # Errors
    /// FB219 if the scene has several load cases; FB212 if it does not match the body; FB540 if the integration fails;
    /// FB550 if it takes more steps than allowed.
    pub fn simulate(&self, scene: &Scene) -> Result<Motion> {
        self.simulate_with_progress(scene, NO_LISTENER)
    }

    /// Does the work of [`FlexBody::simulate`] with a listener, which may stop it.
    ///
    /// # Errors
    /// The errors of [`FlexBody::simulate`]; FB605 if the listener stops it.
    pub fn simulate_with_progress(&self, scene: &Scene, listener: Listener<'_>) -> Result<Motion> {
        self.simulate_by(SimulationRequest::default(), scene, listener)
    }

    /// Does the work of [`FlexBody::simulate_with_progress`], and finds the largest stresses of every point of the
    /// recoveries over the continuous motion for [`Recovered::write_envelope`](super::Recovered::write_envelope).
    ///
    /// # Errors
    /// The errors of [`FlexBody::simulate_with_progress`].
    pub fn simulate_with_envelope(&self, scene: &Scene, listener: Listener<'_>) -> Result<Motion> {
        let request = SimulationRequest { needs_envelope: true, ..SimulationRequest::default() };
        self.simulate_by(request, scene, listener)
    }

    fn simulate_by(
        &self,
        request: SimulationRequest,
        scene: &Scene,
        listener: Listener<'_>,
    ) -> Result<Motion> {
        let scene = scene.0.single()?;
        let Simulated { recording, diagnostics } =
            heard(listener, |context| request.run(&self.0, scene, context))?;
        let (units, extent) = (self.0.units().clone(), self.0.extent());
        Ok(Motion { recording, units, extent, diagnostics })
    }
}

/// Flex-body file in a temporary folder, since HDF5 reads and writes files.
#[cfg(feature = "hdf5")]
struct TemporaryBody {
    path: std::path::PathBuf,
    _folder: tempfile::TempDir,
}

#[cfg(feature = "hdf5")]
impl TemporaryBody {
    fn new() -> Result<Self> {
        let folder = tempfile::tempdir().map_err(|error| {
            let message = format!("no temporary folder can be made: {error}");
            Diagnostic::new(Code::OutputUnwritable, message)
        })?;
        Ok(Self { path: folder.path().join("body.flex.h5"), _folder: folder })
    }

    fn failure(&self, error: &std::io::Error) -> flexbody_base::error::Error {
        Diagnostic::new(Code::OutputUnwritable, error.to_string()).in_file(&self.path).into()
    }
}
