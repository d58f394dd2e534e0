//! Conditions on the arrays of the invariants.

use super::{Invariants, TermGroups};
use crate::problems::Problems;
use faer::Mat;
use flexbody_base::diagnostic::Diagnostic;

impl Invariants {
    /// Returns true if every array has the shape that follows from nf, the number of columns of C1.
    pub(super) fn has_its_shapes(&self) -> bool {
        let (data, nf) = (&self.0, self.n_modes());
        let is = |m: &Mat<f64>, rows: usize, columns: usize| (m.nrows(), m.ncols()) == (rows, columns);
        data.c1.nrows() == 3
            && data.ibar.as_flattened().iter().all(|entries| entries.len() == nf)
            && data.s.as_flattened().iter().all(|s| is(s, nf, nf))
            && is(&data.modal_stiffness, nf, nf)
            && data.general.as_ref().is_none_or(|general| {
                is(&general.w0, 3, 3 * nf) && is(&general.w3, 3 * nf, nf) && is(&general.modal_mass, nf, nf)
            })
    }

    /// Returns the errors in the arrays of the invariants called `name`, of a body with `nf` modes.
    pub(crate) fn problems(&self, name: &str, nf: usize) -> Vec<Diagnostic> {
        let data = &self.0;
        let mut problems = Problems::default();
        problems.finite(&format!("{name}.mass"), [data.mass]);
        problems.finite(&format!("{name}.first_moment"), data.first_moment.iter().copied());
        problems.finite(&format!("{name}.second_moment"), data.second_moment.iter().copied());
        problems.matrix(&format!("{name}.c1"), &data.c1, 3, nf);
        for k in 0..3 {
            for l in 0..3 {
                let block = &data.ibar[k][l];
                problems.length(&format!("{name}.ibar[{k}][{l}]"), block.len(), nf, "mode");
                problems.finite(&format!("{name}.ibar[{k}][{l}]"), block.iter().copied());
                problems.matrix(&format!("{name}.s[{k}][{l}]"), &data.s[k][l], nf, nf);
            }
        }
        problems.matrix(&format!("{name}.modal_stiffness"), &data.modal_stiffness, nf, nf);
        if let Some(general) = &data.general {
            problems.matrix(&format!("{name}.w0"), &general.w0, 3, 3 * nf);
            problems.matrix(&format!("{name}.w3"), &general.w3, 3 * nf, nf);
            problems.matrix(&format!("{name}.modal_mass"), &general.modal_mass, nf, nf);
        }
        // The next check assumes that all arrays have valid shapes.
        if problems.is_empty() && data.groups != TermGroups::ALL && !self.holds_its_groups_only() {
            problems.add(format!("`{name}` has entries of groups that it does not hold"));
        }
        problems.found()
    }
}
