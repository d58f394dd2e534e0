//! Other parts of a body: provenance, units, and the arrays that are not invariants.

use super::matrix::shown;
use super::{FlexBody, Matrix};
use nalgebra::Matrix3;

/// File that a body was made of.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct SourceFile {
    /// Role: `manifest`, `stiffness`, `mass`, `nodes`, `dofs`, `interface`, `scene`, `history`, ...
    pub role: String,
    /// File name without folders.
    pub name: String,
    /// SHA-256 of its bytes, in lowercase hex.
    pub sha256: String,
}

/// Stiffness added by a unit load: through the stress that it causes, or through the inertia of turning nodes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct GeometricStiffness {
    /// Name of the load: `spin_xx`, `acceleration_x`, `force_z_tip` (interface `tip`), ...
    pub load: String,
    /// Modal matrix (nf x nf): Psi' K_geo Psi for geometric stiffness. Unit: 1/time^2 over that of the load.
    pub matrix: Matrix,
}

impl FlexBody {
    /// Returns the name of the model.
    pub fn name(&self) -> &str {
        &self.0.description().name
    }

    /// Returns the units of length, mass and time as they were stated: `"mm"`, `"t"`, `"s"`, or factors to SI.
    pub fn units(&self) -> [&str; 3] {
        let units = self.0.units();
        [units.length.name(), units.mass.name(), units.time.name()]
    }

    /// Returns 3, or 2 for a body that moves in its plane z = 0 only.
    pub fn dimension(&self) -> usize {
        self.0.dimension()
    }

    /// Returns the number of matrix rows of the model; 0 if it is unknown.
    pub fn n_dofs(&self) -> usize {
        self.0.source().n_dofs
    }

    /// Returns the files that the body was made of; empty for matrices in memory.
    pub fn source_files(&self) -> Vec<SourceFile> {
        let files = self.0.source().files.iter();
        files
            .map(|file| SourceFile {
                role: file.role.clone(),
                name: file.name.clone(),
                sha256: file.sha256.clone(),
            })
            .collect()
    }

    /// Returns the settings of the conversion that can change the result, as a JSON object.
    pub fn settings_json(&self) -> String {
        self.0.source().settings.to_string()
    }

    /// Returns the structure of M: `rotation-invariant` if every 3 x 3 block between nodes is a multiple of the
    /// identity, `diagonal` if M is also diagonal, or `general`.
    pub fn mass_structure(&self) -> &'static str {
        self.0.source().mass_structure.name()
    }

    /// Returns |K psi - lambda M psi| / (|K psi| + |lambda| |M psi|) of the modes (nf).
    pub fn residuals(&self) -> &[f64] {
        &self.0.modes().residual
    }

    /// Returns the origin of each mode: `free mode`, `imported shape`, ...; empty if it is unknown.
    pub fn mode_origins(&self) -> &[String] {
        &self.0.modes().provenance
    }

    /// Returns the rotations of the nodes in the modes (3n x nf), zero at nodes without rotations; `None` for models of
    /// displacements only. Unit: 1/(length sqrt(mass)).
    pub fn rotations(&self) -> Option<Matrix> {
        self.0.modes().rotation.as_ref().map(|rotation| shown(rotation.as_ref()))
    }

    /// Returns the modal damping D (nf x nf); diag(2 zeta_j omega_j) if only damping ratios are known. Unit: 1/time.
    pub fn damping(&self) -> Matrix {
        shown(self.0.damping().as_ref())
    }

    /// Returns J = sum m x x' (3 x 3), about the origin of the body frame. Unit: mass length^2.
    pub fn second_moment(&self) -> Matrix3<f64> {
        self.0.invariants().second_moment()
    }

    /// Returns W0 (3 x 3nf): the part of linear momentum that is linear in angular velocity and modal coordinates.
    pub fn w0(&self) -> Matrix {
        shown(self.0.invariants().w0().as_ref())
    }

    /// Returns the geometric stiffness of unit loads along the axes of the body frame. A load that is not listed has
    /// zero or unknown geometric stiffness.
    pub fn geometric_stiffness(&self) -> Vec<GeometricStiffness> {
        let all = self.0.geometric_stiffness().iter();
        all.map(|stiffness| GeometricStiffness {
            load: stiffness.load.label(),
            matrix: shown(stiffness.matrix.as_ref()),
        })
        .collect()
    }

    /// Returns the stiffness of inertia of nodes whose rotations carry mass, for unit loads along the axes of the body
    /// frame: `acceleration_x` (of the origin, minus gravity), `angular_acceleration_x`, `spin_xx`, ... It belongs to
    /// the kinetic energy (theory section 6) and is added to K_ff like geometric stiffness. Empty if no rotation
    /// carries mass.
    pub fn inertia_stiffness(&self) -> Vec<GeometricStiffness> {
        let all = self.0.inertia_stiffness().into_iter().flat_map(|own| &own.stiffness);
        all.map(|stiffness| GeometricStiffness {
            load: stiffness.load.label(),
            matrix: shown(stiffness.matrix.as_ref()),
        })
        .collect()
    }

    /// Returns the decisions about the groups of the kinetic energy: name, whether it is kept, and the reason. Empty if
    /// no selection was made, and then all groups are kept.
    pub fn terms(&self) -> Vec<(&'static str, bool, &str)> {
        let terms = self.0.terms().iter();
        terms.map(|term| (term.group.name(), term.kept, term.reason.as_str())).collect()
    }
}
