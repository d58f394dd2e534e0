//! Residuals of Craig-Bampton bodies, whose modes are no eigenvectors of K and M: their equations hold on the rows outside
//! the interfaces.

use super::{MAX_ROUNDING_ESTIMATES, Recomputed};
use crate::flex_body::InterfaceCoordinates;
use crate::invariants::IdentityCheck;
use faer::linalg::solvers::{DenseSolveCore, Solve};
use faer::{Mat, MatRef};
use flexbody_eigen::{residual_scale, rounding_residual};
use flexbody_linalg::{combine, gram, larger, side_by_side};
use flexbody_model::{Coupling, FeModel};

/// Largest residual on interior rows that rounding of the factor of the interior may leave, relative to |K| |psi|.
const MAX_INTERIOR_RESIDUAL: f64 = 1e-10;

impl Recomputed<'_> {
    /// Returns the checks of the residuals of a Craig-Bampton body; none for a body with fewer modes than its basis, for
    /// which the equations need not hold.
    ///
    /// With interface coordinates, the columns of the basis are T = [R Psi] [R_c B]^-1 (constraint modes, then fixed-interface
    /// modes), and each kind has an equation of its own. A body whose frame is on an interface has no such coordinates: K Psi
    /// is then a combination of M [R Psi] on the interior rows, because constraint modes have no force there and
    /// fixed-interface modes one of inertia.
    pub(super) fn interior(&self) -> Vec<IdentityCheck> {
        let interior = self.interior_rows();
        let space = side_by_side(&[self.rigid_motions().as_ref(), self.modes.vectors.as_ref()]);
        match self.body.coordinates() {
            Some(coordinates) => {
                self.residuals_of_columns(coordinates, &space, &interior).unwrap_or_default()
            }
            None => self.residual_of_space(&space, &interior).into_iter().collect(),
        }
    }

    /// Returns true for each row that belongs to no node of an interface.
    fn interior_rows(&self) -> Vec<bool> {
        let (rows, d) = (self.model.rows(), self.model.dimension());
        let mut interior = vec![true; rows.len()];
        for &node in self.body.interfaces().iter().flat_map(|interface| &interface.nodes) {
            interior[d * node..d * (node + 1)].fill(false);
            let first = rows.displacements();
            for (k, &(owner, _)) in rows.rotations().iter().enumerate() {
                if owner as usize == node {
                    interior[first + k] = false;
                }
            }
        }
        interior
    }

    /// Returns the rigid motions about the origin of the frame, along the axes of the frame.
    fn rigid_motions(&self) -> Mat<f64> {
        let (frame, d) = (&self.place.frame, self.model.dimension());
        let fields = self.model.rigid_fields(frame.origin.into(), 1.0);
        let n = fields.ncols();
        let turned = Mat::from_fn(n, n, |i, j| match (i < d, j < d) {
            (true, true) => frame.axes[(i, j)],
            (false, false) if d == 3 => frame.axes[(i - d, j - d)],
            (false, false) => 1.0,
            _ => 0.0,
        });
        combine(fields.as_ref(), turned.as_ref())
    }

    /// Returns the static residual of the constraint modes and the residual of the fixed-interface modes.
    fn residuals_of_columns(
        &self,
        coordinates: &InterfaceCoordinates,
        space: &Mat<f64>,
        interior: &[bool],
    ) -> Option<Vec<IdentityCheck>> {
        let rigid = self.body.parts().rigid_coordinates()?;
        let square = side_by_side(&[rigid.as_ref(), coordinates.of_modes.as_ref()]);
        if square.nrows() != square.ncols() {
            return None;
        }
        let columns = combine(space.as_ref(), square.partial_piv_lu().inverse().as_ref());
        let pencil = self.model.pencil();
        let (kx, mx) = (pencil.apply_stiffness(columns.as_ref()), pencil.apply_mass(columns.as_ref()));
        let sizes = rounding_sizes(self.model, columns.as_ref());
        let (mut constraint, mut fixed, mut allowed) = (0.0f64, 0.0f64, 0.0f64);
        for (j, name) in coordinates.names.iter().enumerate() {
            if InterfaceCoordinates::is_amplitude(name) {
                let lambda = coordinates.stiffness[(j, j)] / coordinates.mass[(j, j)];
                let left = norm_on(interior, |i| kx[(i, j)] - lambda * mx[(i, j)]);
                let scale = residual_scale(kx.col(j), mx.col(j), lambda);
                fixed = larger(fixed, left / scale);
                let rounding = self.body.storage().roundings() * f64::EPSILON * sizes[j];
                allowed = allowed.max(MAX_ROUNDING_ESTIMATES * rounding / scale);
            } else {
                constraint = larger(constraint, norm_on(interior, |i| kx[(i, j)]) / sizes[j]);
            }
        }
        let stored = self.body.certificate().fixed_interface.as_ref().map_or(0.0, |fixed| fixed.residual);
        let mut checks = vec![IdentityCheck::new(
            "constraint_modes_recomputed",
            "|K psi| of the constraint modes on rows outside the interfaces / | |K| |psi| |",
            constraint,
            MAX_INTERIOR_RESIDUAL + 4.0 * self.body.storage().rounding(),
        )];
        if coordinates.names.iter().any(|name| InterfaceCoordinates::is_amplitude(name)) {
            checks.push(IdentityCheck::new(
                "fixed_modes_recomputed",
                "|K phi - lambda M phi| of the fixed-interface modes on rows outside the interfaces / (|K phi| + |lambda M phi|)",
                fixed,
                2.0 * (stored + allowed) + MAX_INTERIOR_RESIDUAL,
            ));
        }
        Some(checks)
    }

    /// Returns the part of K Psi on interior rows that is no combination of M [R Psi]; `None` for a body with fewer modes than
    /// its basis, for which it need not vanish.
    fn residual_of_space(&self, space: &Mat<f64>, interior: &[bool]) -> Option<IdentityCheck> {
        let held =
            self.body.interfaces().iter().find(|interface| interface.coupling != Some(Coupling::Free))?;
        if !self.body.is_whole_craig_bampton(&held.name) {
            return None;
        }
        let only = |matrix: MatRef<'_, f64>| {
            Mat::from_fn(
                matrix.nrows(),
                matrix.ncols(),
                |i, j| if interior[i] { matrix[(i, j)] } else { 0.0 },
            )
        };
        let forces = only(self.kx.as_ref());
        let mut inertia = only(self.model.pencil().apply_mass(space.as_ref()).as_ref());
        // Columns of equal length, so that the normal equations are well scaled.
        for j in 0..inertia.ncols() {
            let length = inertia.col(j).norm_l2();
            inertia.col_mut(j).iter_mut().for_each(|entry| *entry /= length);
        }
        let normal = gram(inertia.as_ref(), inertia.as_ref());
        let weights = normal.partial_piv_lu().solve(gram(inertia.as_ref(), forces.as_ref()));
        let left = &forces - combine(inertia.as_ref(), weights.as_ref());
        let sizes = rounding_sizes(self.model, self.modes.vectors.as_ref());
        let value = (0..left.ncols()).map(|j| left.col(j).norm_l2() / sizes[j]).fold(0.0, larger);
        Some(IdentityCheck::new(
            "interior_recomputed",
            "|K psi - M x| on rows outside the interfaces / | |K| |psi| |, with x in the span of the modes and rigid motions",
            value,
            MAX_INTERIOR_RESIDUAL + 4.0 * self.body.storage().rounding(),
        ))
    }
}

/// Returns | |K| |x| | of each column x.
fn rounding_sizes(model: &FeModel, columns: MatRef<'_, f64>) -> Vec<f64> {
    rounding_residual(model.stiffness(), columns).into_iter().map(|size| size / f64::EPSILON).collect()
}

/// Returns the norm of the values of the interior rows.
fn norm_on(interior: &[bool], value: impl Fn(usize) -> f64) -> f64 {
    (0..interior.len()).filter(|&i| interior[i]).map(|i| value(i).powi(2)).sum::<f64>().sqrt()
}
