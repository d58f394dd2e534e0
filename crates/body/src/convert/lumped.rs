//! Lumped comparators: invariants on the modes of the body, and the pipeline with modes of the lumped mass.

use super::body_modes::reduced;
use super::{BodyModes, Lumping, ModalModel};
use crate::basis::{ModeSettings, free_surface};
use crate::flex_body::{LumpedBody, TermGroups};
use crate::invariants::{
    Invariants, LumpedMasses, align, condense_lumped, condense_lumped_linear, error_norms,
};
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::significant;
use flexbody_eigen::{Accuracy, EigenSolution, Wanted};
use flexbody_linalg::context::Context;
use flexbody_linalg::gram;
use flexbody_model::FeModel;
use libm::acos;
use std::collections::HashMap;

/// Result of a fully lumped pipeline: the modes come from the lumped mass as well.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedPipeline {
    /// Lumping scheme.
    pub scheme: String,
    /// Eigenvalues with the lumped mass, ascending; empty if it has no real modes.
    pub eigenvalues: Vec<f64>,
    /// Smallest singular value of Psi' M Psi_l: the cosine of the largest angle between the two modal
    /// subspaces.
    pub subspace_cosine: f64,
    /// Error norms of the invariants after alignment of the subspaces.
    pub comparison: Vec<(String, f64)>,
    /// Reason for a missing result; empty if there is one.
    pub remark: String,
    /// Reason to distrust the error norms and the cosine; empty if there is none.
    pub caution: String,
}

/// Relative difference of eigenvalues up to which modes count as one group with one frequency.
/// Discretisation splits the pairs of symmetric parts by less, and any vectors of the group may be its
/// modes. A larger value also warns about neighbours that are distinct.
const SAME_EIGENVALUE_DIFFERENCE: f64 = 1e-3;

/// Cosine below which a direction of one subspace is closer to the complement of the other than to the
/// other itself (45 degrees).
const MIN_SUBSPACE_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

impl Lumping {
    /// Returns the masses of the nodes of `model`.
    ///
    /// # Errors
    /// [`LumpedMassTable`](Code::LumpedMassTable) if user masses do not fit the nodes.
    pub fn masses(&self, model: &FeModel) -> Result<LumpedMasses> {
        match self {
            Lumping::RowSum => Ok(LumpedMasses::row_sum(&model.nodal_mass())),
            Lumping::DiagonalScaling => LumpedMasses::diagonal_scaling(&model.nodal_mass()),
            Lumping::User(table) => {
                let ids = &model.nodes().ids;
                let by_node: HashMap<i64, f64> = table.iter().copied().collect();
                let refuse = |message: String| Diagnostic::new(Code::LumpedMassTable, message).into();
                if by_node.len() < table.len() {
                    return Err(refuse(format!(
                        "{} nodes are given more than once",
                        table.len() - by_node.len()
                    )));
                }
                let missing: Vec<i64> = ids.iter().filter(|id| !by_node.contains_key(id)).copied().collect();
                if let Some(first) = missing.first() {
                    return Err(refuse(format!("{} nodes have no mass, node {first} first", missing.len())));
                }
                LumpedMasses::user(ids.iter().map(|id| by_node[id]).collect(), ids.len())
            }
        }
    }
}

/// Returns the invariants of `masses` on the modes of the body, and their error norms.
pub(super) fn comparator(modal: &ModalModel<'_>, masses: &LumpedMasses, exact: &Invariants) -> LumpedBody {
    let shapes = modal.modes.of_nodes();
    let invariants =
        lumped_invariants(modal, masses, shapes, exact.modal_stiffness().clone(), exact.groups());
    LumpedBody {
        scheme: masses.scheme().name().to_owned(),
        comparison: error_norms(exact, &invariants),
        invariants,
        negative_masses: masses.negative(),
    }
}

/// Returns the lumped invariants for the groups that the body holds. For a plane body with a general mass
/// only the rotation about z is known, and the comparison is limited to it.
fn lumped_invariants(
    modal: &ModalModel<'_>,
    masses: &LumpedMasses,
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
    groups: TermGroups,
) -> Invariants {
    let only_about_z = modal.model.dimension() == 2 && modal.model.scalar_mass().is_none();
    let condense = if groups.w2 || groups.w3 { condense_lumped } else { condense_lumped_linear };
    let invariants = condense(masses, &modal.place.positions, shapes, modal_stiffness);
    if only_about_z { invariants.about_z() } else { invariants }.with_groups(groups)
}

/// Computes modes and invariants from the lumped mass, aligned with the exact subspace before the
/// comparison.
pub(super) fn pipeline(
    modal: &ModalModel<'_>,
    masses: &LumpedMasses,
    exact: &Invariants,
    context: &Context<'_>,
) -> Result<LumpedPipeline> {
    let scheme = masses.scheme().name().to_owned();
    let EigenSolution { eigenvalues, vectors, next_eigenvalue, .. } =
        match lumped_modes(modal, masses, context) {
            Ok(found) => found,
            Err(remark) => return Ok(LumpedPipeline::without_result(scheme, remark)),
        };
    let modes = BodyModes::new(modal.model, &modal.place, vectors);
    let mass_times_modes = modal.model.pencil().apply_mass(modes.vectors.as_ref());
    let cross = gram(modal.modes.vectors.as_ref(), mass_times_modes.as_ref());
    let alignment = align(cross.as_ref(), std::slice::from_ref(&(0..modal.n_modes())));
    let stiffness = reduced(modal.model.stiffness(), modes.vectors.as_ref());
    let invariants = lumped_invariants(modal, masses, modes.of_nodes(), stiffness, exact.groups());
    let exact_modes = &modal.found.solution;
    let cuts = [
        ("model", exact_modes.eigenvalues.last().copied(), exact_modes.next_eigenvalue),
        ("lumped mass", eigenvalues.last().copied(), next_eigenvalue),
    ];
    Ok(LumpedPipeline {
        caution: caution(modal, &cuts, alignment.agreement),
        scheme,
        eigenvalues,
        subspace_cosine: alignment.agreement,
        comparison: error_norms(exact, &invariants.with_basis(alignment.basis.as_ref())),
        remark: String::new(),
    })
}

/// Returns the reason why the compared subspaces are arbitrary or have little in common, as text. `cuts`
/// holds, for each subspace, its name, its last eigenvalue and the next one.
fn caution(
    modal: &ModalModel<'_>,
    cuts: &[(&str, Option<f64>, Option<f64>)],
    subspace_cosine: f64,
) -> String {
    let count = modal.n_modes();
    let hertz = |lambda: f64| format!("{} Hz", significant(modal.model.units().frequency_of(lambda), 5));
    let cut = cuts.iter().filter_map(|&(whose, last, next)| {
        let (last, next) = (last?, next?);
        (next - last <= SAME_EIGENVALUE_DIFFERENCE * next).then(|| {
            format!("{count} modes divide a group of equal frequencies of the {whose} at {}", hertz(last))
        })
    });
    let disjoint = (subspace_cosine < MIN_SUBSPACE_COSINE).then(|| {
        let angle = acos(subspace_cosine.clamp(0.0, 1.0)).to_degrees();
        format!("the subspaces differ by {angle:.0} degrees: other modes are among the lowest {count}")
    });
    let found: Vec<String> = cut.chain(disjoint).collect();
    if found.is_empty() {
        return String::new();
    }
    format!("{}; the errors of the invariants are arbitrary: choose another --modes", found.join("; "))
}

/// Returns as many modes of the lumped mass as the body has, or the reason why there are none.
fn lumped_modes(
    modal: &ModalModel<'_>,
    masses: &LumpedMasses,
    context: &Context<'_>,
) -> std::result::Result<EigenSolution, String> {
    if masses.negative() > 0 {
        return Err(format!("{} nodal masses are negative: no real modes", masses.negative()));
    }
    // A comparison needs no guarantees.
    let accuracy = match modal.settings.modes.accuracy {
        Accuracy::Certified => Accuracy::Standard,
        other => other,
    };
    let wanted = Wanted::Lowest(modal.n_modes());
    let settings = ModeSettings { wanted, accuracy, ..modal.settings.modes };
    let lumped = modal.model.with_nodal_masses(masses.masses());
    let found = free_surface(&lumped, &settings, context)
        .map_err(|error| error.first_error().message().to_owned())?
        .solution;
    if found.eigenvalues.len() < modal.n_modes() {
        return Err(format!("the lumped mass has only {} modes", found.eigenvalues.len()));
    }
    Ok(found)
}

impl LumpedPipeline {
    fn without_result(scheme: String, remark: String) -> Self {
        let (eigenvalues, comparison) = (Vec::new(), Vec::new());
        let caution = String::new();
        Self { scheme, eigenvalues, subspace_cosine: f64::NAN, comparison, remark, caution }
    }
}
