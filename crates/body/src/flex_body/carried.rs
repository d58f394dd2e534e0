//! A body whose frame is fixed to one of its interfaces: the body is carried by that interface.
//!
//! With t_j and theta_j the translation and rotation of the interface in mode j, about its reference point,
//!
//! ```text
//! psi'_j(x) = psi_j(x) - t_j - theta_j x x,    x from the reference point
//! ```
//!
//! are modes in which the interface is at rest in the body frame. Together with the rigid motion of the
//! frame they span the motions of the old modes, and K_ff does not change. The prescribed motion of the
//! frame is the motion of the interface, so that no constraint is left to solve. The body held at the
//! interface has the eigenpairs of (K_ff, m_ff), with m_ff of the new modes.

use super::carrier::{CarriedPoint, refused};
use super::modal_change::{rotations_without, shapes_without};
use super::rotated_stiffness::{SplitStiffness, split, transformed, without_rotation};
use super::{Carrier, FlexBody, Interface, Modes, ReferenceConditions};
use crate::basis::BasisKind;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::about_percent;
use flexbody_linalg::combine;
use flexbody_model::{Coupling, rigid_count};
use nalgebra::{Matrix3, Vector3};

/// Largest truncation error of the static response of a carried body that passes without a warning.
const MAX_TRUNCATION: f64 = 0.01;

/// Largest deformation of an interface declared rigid, relative to its motion, that passes without a
/// warning.
const MAX_RIGID_DEFORMATION: f64 = 1e-4;

/// Motion of the interface, relative to the largest displacement of a mode or its largest rotation times the extent of
/// the body, below which the motion is taken for rounding.
const ROUNDING_MOTION: f64 = 1e-12;

impl FlexBody {
    /// Returns this body in the frame of `carrier`: the origin is the reference point of the carrier, the
    /// axes are those of the model, and the carrier is at rest in every mode (see the module
    /// documentation). A body already carried there keeps its modes.
    ///
    /// Geometric stiffness includes that of the reaction at the carrier, where it is given (theory 7.6). If the carrier
    /// moves in the modes of this body, it is reduced to the modes without that motion, or dropped if that of rotations is
    /// not known. The stiffness of inertia follows from the moments of the nodes and their rotations relative to the carrier.
    /// Ratios and proportional damping that the model states are those of the held body.
    ///
    /// # Errors
    /// FB212 if the body has no interface or node of this name; FB214 if `carrier` has no reference point
    /// or no orientation, or if the body holds W2 or W3 without W1, which both require in the modes of the carried body.
    pub fn carried(&self, carrier: &Carrier) -> Result<Self> {
        let along_model = self.frame().axes == nalgebra::Matrix3::identity();
        if along_model && self.has_carrier_at_rest(carrier)? {
            let mut parts = self.clone().into_parts();
            (parts.geometric_stiffness, parts.rotated_stiffness) = self.carried_stiffness(carrier, None);
            return Self::new(parts)?.with_stated_damping(self.stated_damping());
        }
        self.refuse_lost_groups(carrier)?;
        let at = self.place_of(carrier)?;
        let body = self.in_model_axes(at.reference)?;
        let CarriedPoint { motion, .. } = body.place_of(carrier)?;
        let moved = (!body.is_at_rest(&motion)).then_some(&motion);
        let (geometric_stiffness, rotated_stiffness) = body.carried_stiffness(carrier, moved);
        let mut parts = body.into_parts();
        parts.conditions = match carrier {
            Carrier::Interface(name) => ReferenceConditions::Interface(name.clone()),
            Carrier::Node(_) => ReferenceConditions::Unstated,
        };
        let Modes { shape, rotation, .. } = &parts.modes;
        let rotation = rotation.as_ref().map(|rotation| rotations_without(&motion, rotation, shape));
        parts.modes.shape = shapes_without(&motion, shape, &parts.nodes.positions);
        parts.modes.rotation = rotation;
        parts.invariants = parts.invariants.without_rigid_motion(motion.as_ref());
        for lumped in &mut parts.lumped {
            lumped.invariants = lumped.invariants.without_rigid_motion(motion.as_ref());
        }
        parts.named_loads = parts.named_loads.iter().map(|load| load.without_rigid_motion(&motion)).collect();
        parts.recoveries =
            parts.recoveries.iter().map(|recovery| recovery.without_rigid_motion(&motion)).collect();
        (parts.geometric_stiffness, parts.rotated_stiffness) = (geometric_stiffness, rotated_stiffness);
        // The estimate is that of the free body, without the stress of the reaction.
        parts.estimated_stiffness = Vec::new();
        // The nodes turn relative to the carrier, which turns the frame.
        parts.inertia_stiffness = match (&parts.inertia_stiffness, &parts.modes.rotation) {
            (Some(inertia), Some(rotation)) => {
                Some(inertia.with_rotations(rotation.as_ref(), parts.dimension))
            }
            _ => None,
        };
        Self::new(parts)?.with_stated_damping(self.stated_damping())
    }

    /// Returns an error if the body holds a group that it would not have with `carrier` at rest.
    fn refuse_lost_groups(&self, carrier: &Carrier) -> Result<()> {
        let held = self.groups();
        let lost = held.in_carried_modes().dropped().filter(|group| held.has(*group));
        let lost: Vec<&str> = lost.map(|group| group.name()).collect();
        if lost.is_empty() {
            return Ok(());
        }
        Err(refused(format!(
            "the body does not have W1, which its {} about {carrier} require",
            lost.join(" and ")
        )))
    }

    /// Returns the geometric stiffness of this body, whose origin is the carrier, in the modes in which the carrier is at
    /// rest, with that of the reaction; none if it is not known.
    ///
    /// * `moved`: translation and rotation of the carrier in the modes (6 x nf); `None` if it is at rest.
    fn carried_stiffness(&self, carrier: &Carrier, moved: Option<&Mat<f64>>) -> SplitStiffness {
        let identity = || Mat::identity(self.n_modes(), self.n_modes());
        match (self.stiffness_with_rotation(), moved) {
            (Some(all), Some(moved)) => {
                let change = without_rotation(moved.as_ref().subrows(3, 3), &identity());
                split(self.stiffness_with_reaction(transformed(all, &change), carrier))
            }
            (Some(all), None) => split(self.stiffness_with_reaction(all, carrier)),
            (None, Some(_)) => (Vec::new(), Vec::new()),
            (None, None) => {
                (self.stiffness_with_reaction(self.geometric_stiffness().to_vec(), carrier), Vec::new())
            }
        }
    }

    /// Returns a warning if the modes of a carried body leave more than one hundredth of its static
    /// response to accelerations of the interface unresolved.
    ///
    /// The estimate is the contribution of the upper half of the held modes to the elastic energy. With free
    /// modes the energy converges like the inverse of their number, so the missing part is about as large. The
    /// held modes of (K_ff, m_ff) depend on the span of the modes alone, not on the frame of the file.
    /// Residual vectors of the interface and a Craig-Bampton basis with it need no warning.
    pub fn unresolved(&self, carrier: &Carrier, original: &Self) -> Option<Diagnostic> {
        if original.resolves(carrier) {
            return None;
        }
        let (values, vectors) = self.eigenpairs_in_frame()?;
        let nf = values.len();
        let energy = |loads: &Mat<f64>, modes: std::ops::Range<usize>| {
            Matrix3::from_fn(|a, b| {
                modes.clone().map(|j| loads[(a, j)] * loads[(b, j)] / values[j]).sum::<f64>()
            })
        };
        let missing = |loads: &Mat<f64>| {
            let held = combine(loads.as_ref(), vectors.as_ref());
            largest_ratio(&energy(&held, nf / 2..nf), &energy(&held, 0..nf))
        };
        let worst = missing(self.invariants().c1()).max(missing(&self.invariants().c2()));
        (worst > MAX_TRUNCATION).then(|| {
            let message = format!(
                "the {nf} modes resolve {carrier} poorly: when it is accelerated, up to about {} of the elastic energy is missing, depending on the direction",
                about_percent(worst)
            );
            Diagnostic::new(Code::CarrierUnresolved, message)
        })
    }

    /// Returns a warning if an interface is declared rigid and the modes of this body, taken before it was
    /// carried, deform the interface. The carrier then follows the mean motion of the interface.
    pub fn softened(&self, carrier: &Carrier) -> Option<Diagnostic> {
        let Carrier::Interface(name) = carrier else { return None };
        let interface = self.interfaces().iter().find(|interface| interface.name == *name)?;
        let modes = self.modes();
        let rotation = modes.rotation.as_ref().map(Mat::as_ref);
        let rows = interface.rows(self.nodes(), modes.shape.as_ref(), rotation, self.dimension())?;
        let (mode, misfit) = rows.deformation();
        (interface.coupling == Some(Coupling::Rigid) && misfit > MAX_RIGID_DEFORMATION).then(|| {
            let message = format!(
                "interface `{name}` is rigid, but the modes deform it, mode {} by {:.1} % of its motion: its mean motion is carried, the nodes around it are free",
                mode + 1,
                100.0 * misfit
            );
            Diagnostic::new(Code::CarrierUnresolved, message)
                .with_help("convert with --basis craig-bampton, which keeps rigid interfaces rigid")
        })
    }

    /// Returns true if the basis spans all motions of the model except rigid ones.
    pub(super) fn is_complete(&self) -> bool {
        let rows = self.source().n_dofs;
        rows > 0 && self.n_modes() + 6 >= rows
    }

    /// Returns true if the basis contains the static responses to loads at `carrier`.
    fn resolves(&self, carrier: &Carrier) -> bool {
        let Carrier::Interface(name) = carrier else { return false };
        let named = |text: &str| text.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with(' '));
        // Example of a provenance: `residual vector: 98 % bore force x`.
        let made_for = |provenance: &str| provenance.split_once(" % ").is_some_and(|(_, load)| named(load));
        let modes = self.modes();
        self.is_complete()
            || self.coordinates().is_some_and(|all| all.names.iter().any(|coordinate| named(coordinate)))
            || modes.truncation.iter().any(|one| named(&one.load))
                && modes
                    .truncation
                    .iter()
                    .all(|truncation| !named(&truncation.load) || truncation.after < MAX_TRUNCATION)
            || modes.provenance.iter().any(|one| made_for(one))
            || self.is_whole_craig_bampton(name)
    }

    /// Returns true for a Craig-Bampton body with all modes of its basis, whose boundary holds the interface `name`, as the
    /// certificate states. Bodies of files up to 1.10 with the frame on an interface have no such statement; the settings of
    /// their conversion state the basis.
    pub(crate) fn is_whole_craig_bampton(&self, name: &str) -> bool {
        let settings = &self.source().settings;
        let at_boundary = |interface: &&Interface| interface.coupling != Some(Coupling::Free);
        let boundary: Vec<&Interface> = self.interfaces().iter().filter(at_boundary).collect();
        let rigid = rigid_count(self.dimension());
        let whole = match &self.certificate().fixed_interface {
            Some(fixed) => self.n_modes() + rigid >= fixed.modes.saturating_add(fixed.interface_motions),
            None => {
                let all = |fixed: u64| self.n_modes() + rigid >= fixed as usize + rigid * boundary.len();
                settings["basis"] == BasisKind::CraigBampton.name()
                    && settings["modes"].as_u64().is_some_and(all)
            }
        };
        whole && boundary.iter().any(|one| one.name == name)
    }

    /// True if the origin of the frame is the reference point of `carrier`, which moves in no mode.
    ///
    /// # Errors
    /// The errors FB212 and FB214 of [`FlexBody::carried`].
    fn has_carrier_at_rest(&self, carrier: &Carrier) -> Result<bool> {
        if let (ReferenceConditions::Interface(frame_interface), Carrier::Interface(name)) =
            (self.conditions(), carrier)
            && frame_interface == name
        {
            return Ok(true);
        }
        let at = self.place_of(carrier)?;
        Ok(at.reference == Vector3::zeros() && self.is_at_rest(&at.motion))
    }

    /// Returns true if a point with `motion` (6 x nf) moves in no mode.
    fn is_at_rest(&self, motion: &Mat<f64>) -> bool {
        let extent = self.extent();
        (0..self.n_modes()).all(|j| {
            let turn = self.modes().rotation.as_ref().map_or(0.0, |all| all.col(j).norm_max());
            let size = ROUNDING_MOTION * self.largest_displacement(j).max(turn * extent);
            (0..3).all(|k| motion[(k, j)].abs() <= size && motion[(3 + k, j)].abs() * extent <= size)
        })
    }
}

/// Relative energy of a direction, compared with the largest, below which the direction counts as free of
/// energy.
const ROUNDING_ENERGY: f64 = 1e-9;

/// Returns the largest b'P b / b'W b over all directions b in which `whole` = W has energy.
fn largest_ratio(part: &Matrix3<f64>, whole: &Matrix3<f64>) -> f64 {
    let eigen = whole.symmetric_eigen();
    let most = eigen.eigenvalues.max();
    let unit = Matrix3::from_fn(|i, k| match eigen.eigenvalues[k] {
        energy if energy > ROUNDING_ENERGY * most => eigen.eigenvectors[(i, k)] / energy.sqrt(),
        _ => 0.0,
    });
    (unit.transpose() * part * unit).symmetric_eigenvalues().max().max(0.0)
}
