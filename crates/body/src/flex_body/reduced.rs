//! Reduction of a body to some of its modes and some groups of its kinetic energy.

use super::{
    Certificate, FixedInterface, FlexBody, Guarantee, InternalRows, LumpedBody, Modes, Parts, Storage,
    TermDecision, TermGroups,
};
use crate::invariants::{InertiaStiffness, error_norms};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_model::GeometricStiffness;

impl FlexBody {
    /// Returns the body with the modes `modes` (indices, ascending) and the groups of its kinetic energy
    /// that are in `groups`.
    ///
    /// `terms` gives the reasons; for groups that it does not name, the earlier decisions stay. If modes
    /// are dropped, data about all modes are dropped as well: interface coordinates, the truncation errors
    /// of residual vectors and, unless the lowest modes are kept, the proof of completeness, which the
    /// remark of the certificate then mentions. Bounds and digits of the remaining data stay valid.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) if the indices do not ascend or are not below the number of modes; the errors
    /// of [`FlexBody::new`] if `terms` contradict the groups.
    pub fn reduced(&self, modes: &[usize], groups: TermGroups, terms: Vec<TermDecision>) -> Result<Self> {
        let nf = self.n_modes();
        if modes.is_empty() || modes.windows(2).any(|w| w[0] >= w[1]) || modes[modes.len() - 1] >= nf {
            let message = format!("modes {modes:?} of {nf}, expected ascending indices below {nf}");
            return Err(Diagnostic::new(Code::Usage, message).into());
        }
        let parts = self.parts();
        let all = modes.len() == nf;
        let invariants = parts.invariants.with_modes(modes).with_groups(groups);
        let unchanged = all && invariants.groups() == parts.invariants.groups();
        let lumped = |lumped: &LumpedBody| {
            let reduced = lumped.invariants.with_modes(modes).with_groups(groups);
            LumpedBody {
                // Another program may use other norms: recompute them only if the data changed.
                comparison: if unchanged {
                    lumped.comparison.clone()
                } else {
                    error_norms(&invariants, &reduced)
                },
                invariants: reduced,
                scheme: lumped.scheme.clone(),
                negative_masses: lumped.negative_masses,
            }
        };
        let stiffness = |one: &GeometricStiffness<Mat<f64>>| GeometricStiffness {
            load: one.load.clone(),
            matrix: square(&one.matrix, modes),
        };
        let before = parts.terms.iter().filter(|old| terms.iter().all(|new| new.group != old.group));
        let body = Self::new(Parts {
            source: parts.source.clone(),
            dimension: parts.dimension,
            units: parts.units.clone(),
            frame: parts.frame,
            conditions: parts.conditions.clone(),
            nodes: parts.nodes.clone(),
            mesh: parts.mesh.clone(),
            modes: parts.modes.some(modes),
            geometric_stiffness: parts.geometric_stiffness.iter().map(stiffness).collect(),
            inertia_stiffness: parts.inertia_stiffness.as_ref().map(|inertia| InertiaStiffness {
                moments: inertia.moments.clone(),
                stiffness: inertia.stiffness.iter().map(stiffness).collect(),
            }),
            lumped: parts.lumped.iter().map(lumped).collect(),
            certificate: parts.certificate.of_some(modes, &parts.modes),
            interfaces: parts.interfaces.clone(),
            coordinates: parts.coordinates.clone().filter(|_| all),
            recoveries: self.reduced_recoveries(modes, invariants.groups()),
            terms: before.cloned().chain(terms.iter().cloned()).collect(),
            invariants,
            storage: parts.storage,
        })?;
        // W3 without S is stored on its own, as the difference of two rounded numbers: round it again.
        if parts.storage == Storage::F32 { body.rounded_to_f32() } else { Ok(body) }
    }
}

impl Modes {
    fn some(&self, modes: &[usize]) -> Self {
        let all = modes.len() == self.eigenvalue.len();
        Self {
            eigenvalue: entries(&self.eigenvalue, modes),
            residual: entries(&self.residual, modes),
            provenance: if self.provenance.is_empty() {
                Vec::new()
            } else {
                entries(&self.provenance, modes)
            },
            truncation: if all { self.truncation.clone() } else { Vec::new() },
            damping_ratio: entries(&self.damping_ratio, modes),
            modal_damping: self.modal_damping.as_ref().map(|damping| square(damping, modes)),
            shape: columns(&self.shape, modes),
            rotation: self.rotation.as_ref().map(|rotation| columns(rotation, modes)),
            internal: self.internal.as_ref().map(|internal| InternalRows {
                dofs: internal.dofs.clone(),
                shape: columns(&internal.shape, modes),
            }),
        }
    }
}

impl Certificate {
    /// Returns the certificate for a subset of the modes of this one.
    fn of_some(&self, modes: &[usize], of: &Modes) -> Self {
        let nf = of.eigenvalue.len();
        let all = modes.len() == nf;
        // The lowest modes of a complete set are complete.
        let lowest = modes[modes.len() - 1] + 1 == modes.len();
        let below = of.eigenvalue.iter().filter(|l| **l < self.shift).count();
        let complete = all || lowest && self.proved_modes.is_some_and(|count| below == count.min(nf));
        let left_out = || {
            let proved =
                |count: usize| format!(", of which the {count} below the shift were proved complete");
            let proved = self.proved_modes.map_or_else(String::new, proved);
            let remark = format!("{} of {nf} modes were kept{proved}", modes.len());
            if self.remark.is_empty() { remark } else { format!("{}; {remark}", self.remark) }
        };
        let guarantee = |guarantee: &Guarantee| Guarantee {
            eigenvalue_lower: entries(&guarantee.eigenvalue_lower, modes),
            eigenvalue_upper: entries(&guarantee.eigenvalue_upper, modes),
            shape_error: entries(&guarantee.shape_error, modes),
            ..*guarantee
        };
        Self {
            proved_modes: self.proved_modes.filter(|_| complete),
            remark: if complete { self.remark.clone() } else { left_out() },
            guarantee: self.guarantee.as_ref().map(guarantee),
            fixed_interface: self.fixed_interface.as_ref().map(|fixed| FixedInterface {
                free_estimate: entries(&fixed.free_estimate, modes),
                free_lower: entries(&fixed.free_lower, modes),
                ..*fixed
            }),
            ..*self
        }
    }
}

fn entries<T: Clone>(of_modes: &[T], modes: &[usize]) -> Vec<T> {
    modes.iter().map(|&j| of_modes[j].clone()).collect()
}

fn columns(a: &Mat<f64>, modes: &[usize]) -> Mat<f64> {
    Mat::from_fn(a.nrows(), modes.len(), |i, j| a[(i, modes[j])])
}

fn square(a: &Mat<f64>, modes: &[usize]) -> Mat<f64> {
    Mat::from_fn(modes.len(), modes.len(), |i, j| a[(modes[i], modes[j])])
}
