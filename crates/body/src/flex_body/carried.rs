//! A body whose frame is fixed to one of its interfaces: what hangs from a carried interface.
//!
//! With t_j and theta_j the translation and rotation of the interface in mode j, about its reference point,
//!
//! ```text
//! psi'_j(x) = psi_j(x) - t_j - theta_j x x,    x from the reference point
//! ```
//!
//! are modes in which the interface rests in the body frame. They span, with the rigid motion of the frame,
//! the motions of the old modes, K_ff is what it was, and the prescribed motion of the frame *is* that of the
//! interface: no constraint is left to solve. The body that hangs from the interface has the eigenpairs of
//! (K_ff, m_ff), with m_ff of the new modes.

use super::rigid_motion::{rotations_without, shapes_without, stacked};
use super::{FlexBody, LoadKind, ReferenceConditions, TermGroups};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_linalg::{dense_cholesky, solve_lower, solve_upper, symmetric_eigen};
use flexbody_model::{Coupling, DampingRatios};
use nalgebra::{Matrix3, Vector3};

/// Largest part that modes may leave of the static response of the carried body before that is said.
const RESOLVED: f64 = 0.01;

/// Deformation of a rigid interface, relative to its motion, above which it is not rigid.
const DEFORMED: f64 = 1e-4;

/// Motions of the interface below this part of the largest displacement of a mode are rounding.
const AT_REST: f64 = 1e-12;

/// What a body is carried by.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Carrier {
    /// The reference point of the interface of this name.
    Interface(String),
    /// The node of this number, which must have rotations.
    Node(i64),
}

impl Carrier {
    /// The carrier that files of simulations name: `interface NAME` or `node 17`.
    pub fn from_words(words: &str) -> Option<Self> {
        match words.split_once(' ')? {
            ("interface", name) => Some(Self::Interface(name.to_owned())),
            ("node", number) => Some(Self::Node(number.parse().ok()?)),
            _ => None,
        }
    }
}

impl std::fmt::Display for Carrier {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Interface(name) => write!(f, "interface `{name}`"),
            Self::Node(number) => write!(f, "node {number}"),
        }
    }
}

/// Where a body is carried, and how that place moves in every mode.
struct CarriedPoint {
    /// Reference point, body frame.
    reference: Vector3<f64>,
    /// Translations, then rotations (6 x nf), body axes.
    motion: Mat<f64>,
}

impl FlexBody {
    /// The same body in the frame of `carrier`: its reference point is the origin, the axes are those of the
    /// model, and the modes are those of the head of this module. A body that is carried already is returned
    /// as it is.
    ///
    /// Geometric stiffness is left out, whatever frame the body has: the loads together with the reaction at the
    /// interface stress the carried body. The stiffness of inertia follows from the moments of the nodes and
    /// their rotations relative to the carrier.
    ///
    /// # Errors
    /// FB212 for names that the body has not; FB214 where `carrier` has no reference point or no orientation,
    /// and for a body without all groups of the kinetic energy.
    pub fn carried(&self, carrier: &Carrier) -> Result<Self> {
        if self.groups() != TermGroups::ALL {
            let lacking: Vec<&str> = self.groups().dropped().map(|group| group.name()).collect();
            return Err(refused(format!(
                "the body lacks {}, without which its terms about {carrier} are not known",
                lacking.join(", ")
            )));
        }
        let along_model = self.frame().axes == nalgebra::Matrix3::identity();
        if along_model && self.rests_on(carrier)? {
            let mut parts = self.clone().into_parts();
            parts.geometric_stiffness.retain(|one| matches!(one.load.kind, LoadKind::Named(_)));
            return Self::new(parts);
        }
        let at = self.place_of(carrier)?;
        let body = self.in_model_axes(at.reference)?;
        let CarriedPoint { motion, .. } = body.place_of(carrier)?;
        let mut parts = body.into_parts();
        parts.conditions = match carrier {
            Carrier::Interface(name) => ReferenceConditions::Interface(name.clone()),
            Carrier::Node(_) => ReferenceConditions::Unstated,
        };
        parts.modes.shape = shapes_without(&motion, &parts.modes.shape, &parts.nodes.positions);
        parts.modes.rotation = parts.modes.rotation.map(|rotation| rotations_without(&motion, &rotation));
        parts.invariants = parts.invariants.without_rigid_motion(motion.as_ref());
        for lumped in &mut parts.lumped {
            lumped.invariants = lumped.invariants.without_rigid_motion(motion.as_ref());
        }
        parts.geometric_stiffness.retain(|one| matches!(one.load.kind, LoadKind::Named(_)));
        // Nodes turn by less now, relative to the frame that the carrier turns.
        parts.inertia_stiffness = match (&parts.inertia_stiffness, &parts.modes.rotation) {
            (Some(own), Some(rotation)) => Some(own.with_rotations(rotation.as_ref(), parts.dimension)),
            _ => None,
        };
        Self::new(parts)
    }

    /// Whether the body lacks geometric stiffness as it is carried that it has as it is.
    pub fn loses_geometric_stiffness(&self) -> bool {
        self.geometric_stiffness().iter().any(|one| !matches!(one.load.kind, LoadKind::Named(_)))
    }

    /// lambda of the body in its frame: eigenvalues of (K_ff, m_ff), ascending. Those of free modes are their
    /// own; those of a carried body are of the body held at its interface. Unit: 1/time^2.
    pub fn eigenvalues_in_frame(&self) -> Option<Vec<f64>> {
        Some(self.eigenpairs_in_frame()?.0)
    }

    /// Gives the body the damping ratio of `ratios` at its frequency for each of its eigenpairs in its frame: D =
    /// m_ff X diag(2 ratio omega) X' m_ff. For a body of free modes these are the modes.
    ///
    /// # Errors
    /// Those of [`FlexBody::new`].
    pub fn with_damping_ratios(&self, ratios: &DampingRatios) -> Result<Self> {
        let mut parts = self.clone().into_parts();
        let ratio = |eigenvalue: f64| ratios.at(self.units().frequency_of(eigenvalue.max(0.0)));
        parts.modes.damping_ratio = self.modes().eigenvalue.iter().map(|&lambda| ratio(lambda)).collect();
        parts.modes.modal_damping = None;
        let mass = self.invariants().modal_mass();
        let apart = |i: usize, j: usize| (mass[(i, j)] - f64::from(i == j)).abs();
        let nf = self.n_modes();
        let normalised = (0..nf).all(|i| (0..nf).all(|j| apart(i, j) < 1e-6));
        if let Some((values, vectors)) = (!normalised).then(|| self.eigenpairs_in_frame()).flatten() {
            let moved = &mass * &vectors;
            let rate = |p: usize| 2.0 * ratio(values[p]) * values[p].max(0.0).sqrt();
            let entry = |i: usize, j: usize| (0..nf).map(|p| moved[(i, p)] * rate(p) * moved[(j, p)]).sum();
            parts.modes.modal_damping = Some(Mat::from_fn(nf, nf, entry));
        }
        Self::new(parts)
    }

    /// A warning where the modes of a body that is carried leave more than a hundredth of its static response
    /// to accelerations of the interface.
    ///
    /// The estimate is what the upper half of the modes adds to the elastic energy: that of free modes
    /// converges like the inverse of their number, so that as much again is missing. Residual vectors of the
    /// interface and a Craig-Bampton basis with it need none.
    pub fn unresolved(&self, carrier: &Carrier, original: &Self) -> Option<Diagnostic> {
        if original.resolves(carrier) {
            return None;
        }
        let (stiffness, c1, c2) =
            (self.invariants().modal_stiffness(), self.invariants().c1(), self.invariants().c2());
        let nf = self.n_modes();
        let energy = |loads: &Mat<f64>, modes: std::ops::Range<usize>| {
            Matrix3::from_fn(|a, b| {
                modes.clone().map(|j| loads[(a, j)] * loads[(b, j)] / stiffness[(j, j)]).sum::<f64>()
            })
        };
        let missing = |loads: &Mat<f64>| largest_part(&energy(loads, nf / 2..nf), &energy(loads, 0..nf));
        let worst = missing(c1).max(missing(&c2));
        (worst > RESOLVED).then(|| {
            let message = format!(
                "the {nf} modes resolve {carrier} badly: where it is accelerated, about {:.0} % of the elastic energy of the body that hangs from it are missing in the worst direction",
                100.0 * worst
            );
            Diagnostic::new(Code::CarrierUnresolved, message)
        })
    }

    /// A warning where an interface is to be rigid and the modes of this body, as it was before it was
    /// carried, deform it: its mean motion is carried then.
    pub fn softened(&self, carrier: &Carrier) -> Option<Diagnostic> {
        let Carrier::Interface(name) = carrier else { return None };
        let interface = self.interfaces().iter().find(|interface| interface.name == *name)?;
        let modes = self.modes();
        let rotation = modes.rotation.as_ref().map(Mat::as_ref);
        let rows = interface.rows(self.nodes(), modes.shape.as_ref(), rotation, self.dimension())?;
        let (mode, misfit) = rows.deformation();
        (interface.coupling == Some(Coupling::Rigid) && misfit > DEFORMED).then(|| {
            let message = format!(
                "interface `{name}` is rigid, but the modes deform it, mode {} by {:.1} % of its motion: its mean motion is carried, the nodes around it are free",
                mode + 1,
                100.0 * misfit
            );
            Diagnostic::new(Code::CarrierUnresolved, message)
                .with_help("convert with --basis craig-bampton, which keeps rigid interfaces rigid")
        })
    }

    /// Whether the basis has the static responses to loads at `carrier`.
    fn resolves(&self, carrier: &Carrier) -> bool {
        let Carrier::Interface(name) = carrier else { return false };
        let named = |text: &str| text.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with(' '));
        // `residual vector: 98 % bore force x`.
        let made_for = |provenance: &str| provenance.split_once(" % ").is_some_and(|(_, load)| named(load));
        let modes = self.modes();
        // All motions of the model, but rigid ones.
        let complete = self.n_modes() + 6 >= self.source().n_dofs && self.source().n_dofs > 0;
        complete
            || self.coordinates().is_some_and(|all| all.names.iter().any(|coordinate| named(coordinate)))
            || modes.truncation.iter().any(|one| named(&one.load))
                && modes.truncation.iter().all(|one| !named(&one.load) || one.after < RESOLVED)
            || modes.provenance.iter().any(|one| made_for(one))
    }

    /// Eigenvalues and m_ff-orthonormal eigenvectors of (K_ff, m_ff).
    fn eigenpairs_in_frame(&self) -> Option<(Vec<f64>, Mat<f64>)> {
        let lower = dense_cholesky(self.invariants().modal_mass())?;
        let half = solve_lower(&lower, self.invariants().modal_stiffness());
        let eigen = symmetric_eigen(solve_lower(&lower, &half.transpose().to_owned()).as_ref())?;
        Some((eigen.values, solve_upper(&lower, &eigen.vectors)))
    }

    /// True if the origin of the frame is the reference point of `carrier`, which moves in no mode.
    ///
    /// # Errors
    /// FB212 and FB214, as [`FlexBody::carried`].
    fn rests_on(&self, carrier: &Carrier) -> Result<bool> {
        if let (ReferenceConditions::Interface(own), Carrier::Interface(name)) = (self.conditions(), carrier)
            && own == name
        {
            return Ok(true);
        }
        let at = self.place_of(carrier)?;
        Ok(at.reference == Vector3::zeros() && self.rests(&at.motion))
    }

    /// Whether the place with `motion` moves in no mode.
    fn rests(&self, motion: &Mat<f64>) -> bool {
        let extent = self.extent();
        (0..self.n_modes()).all(|j| {
            let size = AT_REST * self.largest_displacement(j);
            (0..3).all(|k| motion[(k, j)].abs() <= size && motion[(3 + k, j)].abs() * extent <= size)
        })
    }

    fn place_of(&self, carrier: &Carrier) -> Result<CarriedPoint> {
        let unknown = |message: String| Err(Diagnostic::new(Code::SceneBody, message).into());
        match carrier {
            Carrier::Node(number) => {
                let Some(node) = self.nodes().ids.iter().position(|id| id == number) else {
                    return unknown(format!("the body has no node {number}"));
                };
                let rotation = self.modes().rotation.as_ref();
                let at = |shape: &Mat<f64>| shape.as_ref().subrows(3 * node, 3).to_owned();
                let rotation = rotation.map(at).filter(|rows| rows.norm_max() > 0.0);
                let Some(rotation) = rotation else {
                    return Err(refused(format!(
                        "node {number} has no rotations: its orientation is not known"
                    )));
                };
                let motion = stacked(&at(&self.modes().shape), &rotation);
                Ok(CarriedPoint { reference: Vector3::from(self.nodes().positions[node]), motion })
            }
            Carrier::Interface(name) => {
                let Some(interface) = self.interfaces().iter().find(|interface| interface.name == *name)
                else {
                    let all: Vec<&str> = self.interfaces().iter().map(|i| i.name.as_str()).collect();
                    let known = if all.is_empty() { "it has none".to_owned() } else { all.join(", ") };
                    return unknown(format!("the body has no interface `{name}`: {known}"));
                };
                let modes = self.modes();
                let rotation = modes.rotation.as_ref().map(Mat::as_ref);
                let rows = interface.rows(self.nodes(), modes.shape.as_ref(), rotation, self.dimension());
                let Some((rows, reference)) = rows.zip(interface.reference) else {
                    let why = if interface.coupling == Some(Coupling::Free) { " (it is free)" } else { "" };
                    return Err(refused(format!("interface `{name}` has no reference point{why}")));
                };
                let Some(motion) = rows.rigid_motion() else {
                    return Err(refused(format!(
                        "the nodes of interface `{name}` lie on one line: its orientation is not known"
                    )));
                };
                Ok(CarriedPoint { reference: Vector3::from(reference), motion })
            }
        }
    }
}

fn refused(message: String) -> Error {
    Diagnostic::new(Code::CarrierImpossible, message).into()
}

/// Energy, relative to that of the direction with most, below which there is nothing in a direction.
const NO_ENERGY: f64 = 1e-9;

/// The largest b'P b / b'W b over all directions b that `whole` = W has energy in.
fn largest_part(part: &Matrix3<f64>, whole: &Matrix3<f64>) -> f64 {
    let eigen = whole.symmetric_eigen();
    let most = eigen.eigenvalues.max();
    let unit = Matrix3::from_fn(|i, k| match eigen.eigenvalues[k] {
        energy if energy > NO_ENERGY * most => eigen.eigenvectors[(i, k)] / energy.sqrt(),
        _ => 0.0,
    });
    (unit.transpose() * part * unit).symmetric_eigenvalues().max().max(0.0)
}
