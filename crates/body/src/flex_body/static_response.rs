//! Static response of the modes of a body to the loads of its recoveries, and the recoveries of fewer modes, whose static
//! columns take over the response of the others.

use super::modal_change::{ModalChange, RigidCoupling, stacked};
use super::motion_columns::modal_forces;
use super::{
    FlexBody, Interface, LOAD_COMPONENTS, LoadColumns, LoadKind, MotionLoad, NamedLoad, Recovery, TermGroups,
    modes_respond,
};
use crate::invariants::Invariants;
use faer::Mat;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeSet;

/// Modal loads of the columns of recoveries: Psi_m' b, with the modes Psi_m in mean axes.
struct ModalLoads {
    /// Of the six centrifugal loads (nf x 6); `None` if the body does not hold W1.
    spin: Option<Mat<f64>>,
    /// Of unit forces and torques at an interface (nf x 6), by its name.
    at_interfaces: Vec<(String, Mat<f64>)>,
    /// Of the named loads (nf x their number).
    named: Mat<f64>,
    /// Of the forces of the deformed body by its motion (nf x components nf), by their kind; none that the modes do not
    /// respond to.
    motion: Vec<(MotionLoad, Mat<f64>)>,
}

/// Static response of modal coordinates to unit loads.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticCoordinates {
    /// Response (nf x 6) to unit products of the angular velocity, in the order of [`LoadKind::SPIN`]; `None` if the body
    /// does not hold W1.
    pub spin: Option<Mat<f64>>,
    /// Response (nf x 6) to unit forces and torques at each interface, by its name.
    pub at_interfaces: Vec<(String, Mat<f64>)>,
    /// Response (nf x number of named loads) to each named load with amplitude 1.
    pub named: Mat<f64>,
    /// Response (nf x components nf) to the forces of the deformed body by its motion, by their kind.
    pub motion: Vec<(MotionLoad, Mat<f64>)>,
}

impl FlexBody {
    /// Returns the recoveries of this body after a reduction to the modes `kept` (indices, ascending) and the `groups`.
    pub(super) fn reduced_recoveries(&self, kept: &[usize], groups: TermGroups) -> Vec<Recovery> {
        let nf = self.n_modes();
        if kept.len() == nf && self.groups() == groups {
            return self.recoveries().to_vec();
        }
        // The stiffness of modes is diagonal: each takes its own flexibility with it.
        let stiffness = self.invariants().modal_stiffness();
        let is_lost = |j: usize| kept.binary_search(&j).is_err();
        let lost =
            Mat::from_fn(nf, nf, |i, j| if i == j && is_lost(j) { 1.0 / stiffness[(j, j)] } else { 0.0 });
        self.taking_over(&lost, groups, |recovery| recovery.of_modes(kept))
    }

    /// Returns the recoveries of this body after a change of its modes, by which these lose the static flexibility `lost`
    /// (nf x nf).
    pub(super) fn combined_recoveries(&self, change: &ModalChange, lost: &Mat<f64>) -> Vec<Recovery> {
        self.taking_over(lost, self.groups(), |recovery| recovery.with_modes(change))
    }

    /// Returns the recoveries of a body with other modes, `of_others`, and the `groups`: static columns take over what the
    /// flexibility `lost` (nf x nf) contributed to the static response, so that rows under constant loads and constant spin
    /// do not change. A body that loses W1 has no modal response to spin.
    fn taking_over(
        &self,
        lost: &Mat<f64>,
        groups: TermGroups,
        of_others: impl Fn(&Recovery) -> Recovery,
    ) -> Vec<Recovery> {
        let recoveries = self.recoveries();
        if recoveries.is_empty() {
            return Vec::new();
        }
        let (nf, stiffness) = (self.n_modes(), self.invariants().modal_stiffness());
        let whole = Mat::from_fn(nf, nf, |i, j| if i == j { 1.0 / stiffness[(j, j)] } else { 0.0 });
        let of_spin = if self.groups().w1 && !groups.w1 { &whole } else { lost };
        let loads = self.modal_loads();
        let take_over = |recovery: &Recovery, columns: &mut Mat<f64>, load: &Mat<f64>, from: &Mat<f64>| {
            *columns += &recovery.modes * (from * load);
        };
        let taken = |recovery: &Recovery| {
            let mut own = recovery.clone();
            if let Some(spin) = &loads.spin {
                take_over(recovery, &mut own.spin, spin, of_spin);
            }
            take_over(recovery, &mut own.named, &loads.named, lost);
            for of_motion in &mut own.motion {
                let responded = loads.motion.iter().find(|(load, _)| *load == of_motion.load);
                if let Some((load, force)) = responded {
                    let from = if modes_respond(*load, groups) { lost } else { &whole };
                    take_over(recovery, &mut of_motion.columns, force, from);
                }
            }
            for at in &mut own.loads {
                if let Some((_, load)) = loads.at_interfaces.iter().find(|(name, _)| *name == at.interface) {
                    take_over(recovery, &mut at.columns, load, lost);
                }
            }
            of_others(&own)
        };
        recoveries.iter().map(taken).collect()
    }

    /// Returns the rows of a recovery under constant unit loads, modes and static columns together, along the axes of the
    /// model: `spin` holds those of unit products of the angular velocity, `loads` those of unit forces and torques at
    /// the interfaces. They depend neither on the modes nor on the frame. There are no modes in the result.
    pub fn static_rows(&self, recovery: &Recovery) -> Recovery {
        let loads = self.modal_loads();
        let all: Vec<usize> = (0..self.n_modes()).collect();
        let whole = |columns: &Mat<f64>, modal: Option<&Mat<f64>>| match modal {
            Some(modal) => columns + &recovery.modes * self.static_response(modal, &all),
            None => columns.clone(),
        };
        let at_interface = |load: &LoadColumns| {
            let own = loads.at_interfaces.iter().find(|(name, _)| *name == load.interface);
            LoadColumns { columns: whole(&load.columns, own.map(|(_, modal)| modal)), ..load.clone() }
        };
        let along_body = Recovery {
            modes: Mat::zeros(recovery.rows.len(), 0),
            spin: whole(&recovery.spin, loads.spin.as_ref()),
            loads: recovery.loads.iter().map(at_interface).collect(),
            named: whole(&recovery.named, Some(&loads.named)),
            motion: Vec::new(),
            ..recovery.clone()
        };
        along_body.in_axes(&self.frame().axes.transpose())
    }

    /// Returns the rows of a recovery under the static response to the forces of motion of one kind (rows x components nf),
    /// modes and static columns together; `None` if the recovery does not have them.
    pub fn motion_rows(&self, recovery: &Recovery, load: MotionLoad) -> Option<Mat<f64>> {
        let columns = recovery.of_motion(load)?;
        let all: Vec<usize> = (0..self.n_modes()).collect();
        let forces = self.modal_loads().motion;
        Some(match forces.iter().find(|(own, _)| *own == load) {
            Some((_, forces)) => columns + &recovery.modes * self.static_response(forces, &all),
            None => columns.clone(),
        })
    }

    /// Returns the largest part of a static response of a recovery that its static columns hold, and that the modes alone
    /// leave out, over unit loads at the interfaces, named loads and unit products of the angular velocity along the axes of the
    /// model: the largest value of a column relative to that of the response.
    pub fn part_of_static_columns(&self, recovery: &Recovery) -> f64 {
        let (columns, whole) = (recovery.in_axes(&self.frame().axes.transpose()), self.static_rows(recovery));
        let largest = |of: &Mat<f64>, c: usize| of.col(c).iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let part = |(columns, whole): (&Mat<f64>, &Mat<f64>)| {
            let ratio = |c: usize| match largest(whole, c) {
                0.0 => 0.0,
                whole => largest(columns, c) / whole,
            };
            (0..columns.ncols()).map(ratio).fold(0.0, f64::max)
        };
        let loads = columns.loads.iter().zip(&whole.loads).map(|(own, whole)| (&own.columns, &whole.columns));
        let others = [(&columns.spin, &whole.spin), (&columns.named, &whole.named)];
        others.into_iter().chain(loads).map(part).fold(0.0, f64::max)
    }

    /// Returns the static response of the modes `of` to modal loads (nf x c), K_ff restricted to these modes. The
    /// stiffness of modes is diagonal, so that the other modes do not take part.
    fn static_response(&self, loads: &Mat<f64>, of: &[usize]) -> Mat<f64> {
        let stiffness = self.invariants().modal_stiffness();
        Mat::from_fn(of.len(), loads.ncols(), |p, c| loads[(of[p], c)] / stiffness[(of[p], of[p])])
    }

    /// Returns the static response of the modal coordinates to unit loads at the interfaces and to unit products of the
    /// angular velocity, along the axes of the body.
    pub fn static_modal_coordinates(&self) -> StaticCoordinates {
        let loads = self.modal_loads();
        let all: Vec<usize> = (0..self.n_modes()).collect();
        let response = |load: &Mat<f64>| self.static_response(load, &all);
        StaticCoordinates {
            spin: loads.spin.as_ref().map(response),
            at_interfaces: loads
                .at_interfaces
                .iter()
                .map(|(name, load)| (name.clone(), response(load)))
                .collect(),
            named: response(&loads.named),
            motion: loads.motion.iter().map(|(load, force)| (*load, response(force))).collect(),
        }
    }

    /// Returns the error of the static response of the modes to each named load, in the order of the loads: |x - x_modes| /
    /// |x| in the norm of K, whose square is the missing part of the compliance. `None` where the compliance is not known.
    pub fn named_load_truncation(&self) -> Vec<Option<f64>> {
        if self.named_loads().is_empty() {
            return Vec::new();
        }
        let (loads, all) = (self.modal_loads().named, (0..self.n_modes()).collect::<Vec<_>>());
        let response = self.static_response(&loads, &all);
        let error = |(c, load): (usize, &NamedLoad)| {
            let of_modes: f64 = (0..self.n_modes()).map(|j| loads[(j, c)] * response[(j, c)]).sum();
            load.compliance.map(|whole| (1.0 - of_modes / whole).clamp(0.0, 1.0).sqrt())
        };
        self.named_loads().iter().enumerate().map(error).collect()
    }

    fn modal_loads(&self) -> ModalLoads {
        let (modes, invariants) = (self.modes(), self.invariants());
        // Rigid motion A (6 x nf) in the modes, about the origin of the frame; zero in mean axes.
        let coupling = RigidCoupling::new(&invariants.mass_matrix(), self.dimension());
        let taken = coupling.map_or_else(|| Mat::zeros(6, self.n_modes()), |coupling| coupling.nearest());
        let rotation = modes.rotation.as_ref().map(Mat::as_ref);
        let at_interface = |interface: &Interface| {
            let rows = interface.rows(self.nodes(), modes.shape.as_ref(), rotation, self.dimension())?;
            let reference = Vector3::from(interface.reference?);
            let turning = rows.rotation.unwrap_or_else(|| Mat::zeros(3, self.n_modes()));
            let motion = stacked(&rows.translation, &turning);
            let loads = Mat::from_fn(self.n_modes(), LOAD_COMPONENTS, |j, a| {
                let resultant = resultant_of(a, &reference);
                motion[(a, j)] - (0..6).map(|k| taken[(k, j)] * resultant[k]).sum::<f64>()
            });
            Some((interface.name.clone(), loads))
        };
        let named = self.named_loads();
        let of_named = |j: usize, c: usize| {
            let resultant = named[c].resultant();
            named[c].modal[j] - (0..6).map(|k| taken[(k, j)] * resultant[k]).sum::<f64>()
        };
        let kinds = self.recoveries().iter().flat_map(|recovery| &recovery.motion).map(|one| one.load);
        let kinds: BTreeSet<MotionLoad> = kinds.collect();
        let damping = self.damping();
        let of_motion = |load: MotionLoad| Some((load, modal_forces(load, invariants, &damping, &taken)?));
        ModalLoads {
            motion: kinds.into_iter().filter_map(of_motion).collect(),
            named: Mat::from_fn(self.n_modes(), named.len(), of_named),
            spin: centrifugal_loads(invariants, &taken),
            at_interfaces: self.interfaces().iter().filter_map(at_interface).collect(),
        }
    }
}

/// Returns force and moment about the origin of unit load `a` at the point `x`.
fn resultant_of(a: usize, x: &Vector3<f64>) -> [f64; 6] {
    let unit = Vector3::ith(a % 3, 1.0);
    let (force, moment) = if a < 3 { (unit, x.cross(&unit)) } else { (Vector3::zeros(), unit) };
    [force.x, force.y, force.z, moment.x, moment.y, moment.z]
}

/// Returns -Psi_m' M c_kl (nf x 6) in the order of [`LoadKind::SPIN`], from W1 and the moments of the mass:
/// -Psi' M c_kk is half the diagonal block of W1, -Psi' M c_kl its block (k, l).
fn centrifugal_loads(invariants: &Invariants, taken: &Mat<f64>) -> Option<Mat<f64>> {
    let (w1, nf) = (invariants.w1()?, invariants.n_modes());
    let (first, second) = (invariants.first_moment(), invariants.second_moment());
    Some(Mat::from_fn(nf, LoadKind::SPIN.len(), |j, c| {
        let (k, l) = LoadKind::SPIN[c];
        let of_mode = if k == l { 0.5 * w1[(k, k * nf + j)] } else { w1[(k, l * nf + j)] };
        // Resultants of M c_kl about the origin: c_kl = E x.
        let unit = |a: usize, b: usize| Matrix3::from_fn(|i, m| f64::from(u8::from(i == a && m == b)));
        let e = if k == l { unit(k, k) - Matrix3::identity() } else { unit(k, l) + unit(l, k) };
        let force = e * first;
        let moments = e * second;
        let moment = |i: usize| {
            let (a, b) = ((i + 1) % 3, (i + 2) % 3);
            moments[(b, a)] - moments[(a, b)]
        };
        let rigid: f64 = (0..3).map(|i| taken[(i, j)] * force[i] + taken[(3 + i, j)] * moment(i)).sum();
        of_mode + rigid
    }))
}
