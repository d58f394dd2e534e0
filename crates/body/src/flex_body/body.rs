//! The validated body.

use super::rotated_stiffness::joined;
use super::validate::problems;
use super::{
    Certificate, Interface, InterfaceCoordinates, LumpedBody, Modes, NamedLoad, Parts, Recovery,
    ReferenceConditions, Source, Storage, TermDecision, TermGroups,
};
use crate::basis::BasisKind;
use crate::invariants::{
    BodyFrame, Expected, Frame, IdentityCheck, InertiaShares, InertiaStiffness, Invariants, Turning,
    identities,
};
use faer::Mat;
use flexbody_base::error::{Error, Result};
use flexbody_base::numbers::significant;
use flexbody_base::units::UnitSystem;
use flexbody_model::{
    Coupling, Description, GeometricStiffness, LoadKind, Nodes, SurfaceMesh, UnitLoad, span,
};

/// Flexible body: frame, nodes, modes, exact invariants and their certificate. Validated at construction.
#[derive(Debug, Clone, PartialEq)]
pub struct FlexBody {
    parts: Parts,
}

/// Motions at which the stiffness of inertia reaches a given part of the stiffness against some deformation
/// of the body, for the most unfavourable direction. A value is `None` if the stiffness of inertia is zero
/// for that motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InertiaRates {
    /// Spin, in hertz.
    pub spin_hz: Option<f64>,
    /// Acceleration of the origin minus gravity. Unit: length/time^2.
    pub acceleration: Option<f64>,
    /// Angular acceleration. Unit: 1/time^2.
    pub angular_acceleration: Option<f64>,
}

impl InertiaRates {
    /// Returns a text such as `a spin of 12.3 Hz, an acceleration of 4.5e3 m/s^2, an angular acceleration
    /// of 1.2e4 1/s^2` for the loads that `asked` accepts; empty if there are none.
    pub fn in_words(&self, units: &UnitSystem, asked: impl Fn(&LoadKind) -> bool) -> String {
        let (length, time) = (units.length.name(), units.time.name());
        let all = [
            (LoadKind::Spin, self.spin_hz.map(|hertz| format!("a spin of {} Hz", significant(hertz, 3)))),
            (
                LoadKind::Acceleration,
                self.acceleration
                    .map(|a| format!("an acceleration of {} {length}/{time}^2", significant(a, 3))),
            ),
            (
                LoadKind::AngularAcceleration,
                self.angular_acceleration
                    .map(|a| format!("an angular acceleration of {} 1/{time}^2", significant(a, 3))),
            ),
        ];
        let described: Vec<String> =
            all.into_iter().filter(|(kind, _)| asked(kind)).filter_map(|(_, described)| described).collect();
        described.join(", ")
    }
}

impl FlexBody {
    /// Checks `parts` and makes a body of them.
    ///
    /// The dimension is 3, or 2 and then nothing has a component along z. With n nodes and nf modes: n >= 1,
    /// 1 <= nf <= 3n (where the nodes are all of a model); every array has the shape that [`Parts`] states
    /// and only finite values; the mass is positive; eigenvalues are positive and ascend; residuals and
    /// damping ratios are not negative; the axes are orthonormal and right-handed to 1e-10; node numbers are
    /// unique; the body number lies between 1 and the number of bodies; names of lumping schemes and of
    /// interfaces are unique and not empty; loads of geometric stiffness are those of the dimension, each
    /// once; surface and interfaces name existing nodes, interfaces declared free have no reference point; matrices in
    /// interface coordinates are symmetric; names of recoveries are unique and not empty, and their loads act at
    /// interfaces with a reference point; names of named loads are unique and no names of interfaces; a group of the kinetic energy is dropped by a decision of
    /// [`Parts::terms`] or held, here and by the lumped comparators; no text contains a NUL character (no
    /// file could hold it).
    ///
    /// # Errors
    /// [`BodySchema`](flexbody_base::diagnostic::Code::BodySchema), one diagnostic per violation.
    pub fn new(mut parts: Parts) -> Result<Self> {
        // Files hold the terms in the order of the groups.
        parts.terms.sort_by_key(|term| term.group);
        let problems = problems(&parts);
        if problems.is_empty() { Ok(Self { parts }) } else { Err(Error::new(problems)) }
    }

    /// Returns all parts.
    pub fn parts(&self) -> &Parts {
        &self.parts
    }

    /// Returns all parts for a change that keeps every condition that [`FlexBody::new`] checks.
    pub(super) fn parts_mut(&mut self) -> &mut Parts {
        &mut self.parts
    }

    /// Returns the parts, to change them and to build a new body.
    pub fn into_parts(self) -> Parts {
        self.parts
    }

    /// Returns the number of nodes n.
    pub fn n_nodes(&self) -> usize {
        self.parts.nodes.len()
    }

    /// Returns the number of modes nf.
    pub fn n_modes(&self) -> usize {
        self.parts.modes.eigenvalue.len()
    }

    /// Returns the dimension: 3, or 2 for a body that moves in its plane z = 0 only.
    pub fn dimension(&self) -> usize {
        self.parts.dimension
    }

    /// Returns the name of the model and the units of all numbers.
    pub fn description(&self) -> &Description {
        &self.parts.description
    }

    /// Returns the provenance.
    pub fn source(&self) -> &Source {
        &self.parts.source
    }

    /// Returns the units of all numbers.
    pub fn units(&self) -> &UnitSystem {
        &self.parts.description.units
    }

    /// Returns the body frame in model coordinates.
    pub fn frame(&self) -> &Frame {
        &self.parts.frame
    }

    /// Returns the reference conditions that tie the body frame to the deformed body.
    pub fn conditions(&self) -> &ReferenceConditions {
        &self.parts.conditions
    }

    /// Returns node numbers and positions in the body frame.
    pub fn nodes(&self) -> &Nodes {
        &self.parts.nodes
    }

    /// Returns the rows to read off the deformed body: stresses, strains, forces, displacements.
    pub fn recoveries(&self) -> &[Recovery] {
        &self.parts.recoveries
    }

    /// Returns the nodal forces with a name.
    pub fn named_loads(&self) -> &[NamedLoad] {
        &self.parts.named_loads
    }

    /// Returns the surface to draw the body by, if it is known.
    pub fn mesh(&self) -> Option<&SurfaceMesh> {
        self.parts.mesh.as_ref()
    }

    /// Returns the largest distance between two nodes. Unit: length.
    pub fn extent(&self) -> f64 {
        span(&self.parts.nodes.positions)
    }

    /// Returns the largest displacement of a node in mode `j` at unit amplitude.
    ///
    /// # Panics
    /// When `j` is not below the number of modes.
    pub fn largest_displacement(&self, j: usize) -> f64 {
        let shape = &self.parts.modes.shape;
        let square = |i: usize| (0..3).map(|k| shape[(3 * i + k, j)].powi(2)).sum::<f64>();
        (0..self.n_nodes()).map(square).fold(0.0, f64::max).sqrt()
    }

    /// Returns the modes.
    pub fn modes(&self) -> &Modes {
        &self.parts.modes
    }

    /// Returns D (nf x nf): the modal damping or, if there is none, diag(2 zeta_j omega_j). Unit: 1/time.
    pub fn damping(&self) -> Mat<f64> {
        let modes = &self.parts.modes;
        let by_ratio = |j: usize| 2.0 * modes.damping_ratio[j] * modes.eigenvalue[j].sqrt();
        modes.modal_damping.clone().unwrap_or_else(|| {
            Mat::from_fn(self.n_modes(), self.n_modes(), |i, j| if i == j { by_ratio(j) } else { 0.0 })
        })
    }

    /// Returns f_j = sqrt(lambda_j) / (2 pi) in hertz (nf), independent of the body's unit of time.
    pub fn frequencies_hz(&self) -> Vec<f64> {
        let hertz = self.parts.description.units.hertz();
        self.parts.modes.eigenvalue.iter().map(|l| l.sqrt() / std::f64::consts::TAU * hertz).collect()
    }

    /// Returns the exact invariants about the frame origin, body axes.
    pub fn invariants(&self) -> &Invariants {
        &self.parts.invariants
    }

    /// Returns the geometric stiffness of unit loads along body axes, reduced to the modes.
    pub fn geometric_stiffness(&self) -> &[GeometricStiffness<Mat<f64>>] {
        &self.parts.geometric_stiffness
    }

    /// Returns K_geo of every load on modes and unit rotations together ((nf + 3) square); `None` if that of the rotations
    /// is not known.
    pub(super) fn stiffness_with_rotation(&self) -> Option<Vec<GeometricStiffness<Mat<f64>>>> {
        let rotated = &self.parts().rotated_stiffness;
        (!rotated.is_empty()).then(|| joined(self.geometric_stiffness(), rotated, 1.0))
    }

    /// Returns the stiffness of inertia of nodes whose rotations carry mass: the terms of the kinetic
    /// energy of second order in the rotations, with the sign of geometric stiffness (theory sections 6 and
    /// 7.4).
    pub fn inertia_stiffness(&self) -> Option<&InertiaStiffness> {
        self.parts.inertia_stiffness.as_ref()
    }

    /// Returns the stiffness of inertia plus the geometric stiffness for a unit of `load`, to be added to
    /// K_ff. Returns `None` if the body has neither.
    pub fn stiffness_under(&self, load: &UnitLoad) -> Option<Mat<f64>> {
        let of_inertia = self.inertia_stiffness().into_iter().flat_map(|inertia| &inertia.stiffness);
        let all = of_inertia.chain(self.geometric_stiffness()).filter(|one| one.load == *load);
        all.fold(None, |sum: Option<Mat<f64>>, one| match sum {
            None => Some(one.matrix.clone()),
            Some(sum) => Some(sum + &one.matrix),
        })
    }

    /// Returns the motions at which the stiffness of inertia reaches `part` of the stiffness against some
    /// deformation. Returns `None` if the body has no stiffness of inertia, or if K_ff is not positive
    /// definite.
    pub fn inertia_rates(&self, part: f64) -> Option<InertiaRates> {
        let shares = self.inertia_stiffness()?.shares(self.invariants().modal_stiffness().as_ref())?;
        Some(self.rates_of(&shares, part))
    }

    /// Returns the motions at which a stiffness with these `shares` reaches `part` of the stiffness against some
    /// deformation.
    pub fn rates_of(&self, shares: &InertiaShares, part: f64) -> InertiaRates {
        let at = |share: f64| (share > 0.0).then_some(part / share);
        InertiaRates {
            spin_hz: at(shares.spin_squared).map(|square| self.units().frequency_of(square)),
            acceleration: at(shares.acceleration),
            angular_acceleration: at(shares.angular_acceleration),
        }
    }

    /// Returns the loads that the body has a [stiffness](FlexBody::stiffness_under) for, each once.
    pub fn stiffening_loads(&self) -> Vec<UnitLoad> {
        let of_inertia = self.inertia_stiffness().into_iter().flat_map(|inertia| &inertia.stiffness);
        let mut loads: Vec<UnitLoad> = Vec::new();
        for one in self.geometric_stiffness().iter().chain(of_inertia) {
            if !loads.contains(&one.load) {
                loads.push(one.load.clone());
            }
        }
        loads
    }

    /// Returns the lumped comparators.
    pub fn lumped(&self) -> &[LumpedBody] {
        &self.parts.lumped
    }

    /// Returns the proof of completeness and the noise floor.
    pub fn certificate(&self) -> &Certificate {
        &self.parts.certificate
    }

    /// Returns the interfaces.
    pub fn interfaces(&self) -> &[Interface] {
        &self.parts.interfaces
    }

    /// Returns true if an interface was declared to move as a rigid body.
    pub fn has_rigid_interfaces(&self) -> bool {
        self.parts.interfaces.iter().any(|interface| interface.coupling == Some(Coupling::Rigid))
    }

    /// Returns K and M in interface coordinates, if the basis has them.
    pub fn coordinates(&self) -> Option<&InterfaceCoordinates> {
        self.parts.coordinates.as_ref()
    }

    /// Returns the eigenvalues of the fixed-interface modes of a Craig-Bampton body; `None` if the body has neither
    /// interface coordinates nor a list of these eigenvalues. Unit: 1/time^2.
    pub fn fixed_interface_eigenvalues(&self) -> Option<Vec<f64>> {
        let fixed = self.certificate().fixed_interface.as_ref()?;
        match self.coordinates() {
            Some(coordinates) => Some(coordinates.fixed_interface_eigenvalues()),
            // Without fixed-interface modes the empty list is complete.
            None => (fixed.eigenvalues.len() == fixed.modes).then(|| fixed.eigenvalues.clone()),
        }
    }

    /// Returns the decisions about the groups of the kinetic energy; empty if no selection was made.
    pub fn terms(&self) -> &[TermDecision] {
        &self.parts.terms
    }

    /// Returns the name of the basis of the modes, as recorded by the settings of the conversion.
    pub fn basis_name(&self) -> Option<&str> {
        self.source().settings["basis"].as_str()
    }

    /// Returns the kind of basis. Returns `None` if the body records no basis, or an unknown one.
    pub fn basis(&self) -> Option<BasisKind> {
        self.basis_name().and_then(BasisKind::from_name)
    }

    /// Returns the precision of shapes and of the inertia of the modes.
    pub fn storage(&self) -> Storage {
        self.parts.storage
    }

    /// Returns the groups of the kinetic energy that the body holds.
    pub fn groups(&self) -> TermGroups {
        self.parts.invariants.groups()
    }

    /// Checks every identity that the file alone can fulfil (theory section 10), including those of the
    /// interface coordinates. `frame` is the intended body frame. The limits for a body with 32-bit arrays
    /// include their rounding.
    pub fn identities(&self, frame: BodyFrame) -> Vec<IdentityCheck> {
        let expected = Expected {
            mass_normalised: true,
            free_surface: self.parts.conditions.is_mean(),
            frame,
            origin: self.parts.frame.origin,
            eigenvalues: Some(&self.parts.modes.eigenvalue),
            eigenvalue_noise: self.parts.certificate.rigid_noise,
            eigenvalue_rounding: self.parts.certificate.eigenvalue_rounding,
            turning: match (&self.parts.inertia_stiffness, &self.parts.source.approximation) {
                (None, _) => Turning::None,
                (Some(_), Some(_)) => Turning::Partial,
                (Some(_), None) => Turning::Whole,
            },
        };
        let mut checks = identities(&self.parts.invariants, &expected);
        if self.parts.source.is_foreign() && self.parts.invariants.general().is_some() {
            checks.iter_mut().for_each(allow_turning_nodes);
        }
        // Rounding moves the eigenvalues of the largest Gram matrix by at most the number of its rows times
        // one rounding.
        let rounding = self.parts.storage.rounding() * (4 + 3 * self.n_modes()) as f64;
        let mut checks = relaxed(checks, rounding + self.parts.certificate.inertia_rounding);
        checks.extend(self.parts.frame_at_rest());
        checks.extend(self.parts.interface_identities());
        checks.extend(self.parts.cross_checks());
        checks
    }
}

/// Largest violation of an identity of points of mass, relative to the bounds of its terms, that nodes whose rotations carry
/// mass explain: 1.4e-2 for a frame of consistent beams, three to each member, and less for finer ones. Exchanged blocks
/// and wrong units reach 0.1 to 1.
pub const MAX_TURNING_PART: f64 = 0.05;

/// Allows for a mass that turns with its nodes, which files of other programs do not state, in the identity of a mass that
/// does not.
fn allow_turning_nodes(check: &mut IdentityCheck) {
    if check.name == "velocity_gram_psd" {
        check.limit = check.limit.max(MAX_TURNING_PART);
        check.passed = check.value <= check.limit;
    }
}

/// Returns the checks with `rounding` added to their limits, for bodies with rounded arrays.
fn relaxed(mut checks: Vec<IdentityCheck>, rounding: f64) -> Vec<IdentityCheck> {
    // Checks without a tolerance, such as finiteness, keep the limit zero.
    for check in checks.iter_mut().filter(|check| check.limit > 0.0) {
        check.limit += rounding;
        check.passed = check.value <= check.limit;
    }
    checks
}
