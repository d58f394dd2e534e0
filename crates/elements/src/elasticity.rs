//! Elasticity of a material: the matrix that makes stresses of strains.

use nalgebra::{Matrix3, Matrix6, SMatrix};

/// Elasticity D of a linear elastic material: stress = D strain, with the components xx, yy, zz, xy, yz, xz and with
/// engineering shear strains (2 eps_xy). Symmetric. Unit: that of stress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elasticity(pub Matrix6<f64>);

impl Elasticity {
    /// Returns the elasticity of an isotropic material; `None` unless E > 0 and -1 < nu < 1/2.
    pub fn isotropic(youngs: f64, poisson: f64) -> Option<Self> {
        Self::orthotropic_constants([youngs; 3], [poisson; 3], [youngs / (2.0 * (1.0 + poisson)); 3])
    }

    /// Returns the elasticity of an isotropic material by Lame's constants.
    pub fn of_lame(lambda: f64, mu: f64) -> Self {
        Self(Matrix6::from_fn(|i, j| match (i < 3 && j < 3, i == j) {
            (true, true) => lambda + 2.0 * mu,
            (true, false) => lambda,
            (false, true) => mu,
            (false, false) => 0.0,
        }))
    }

    /// Returns the elasticity of an orthotropic material by its engineering constants E1, E2, E3, nu12, nu13, nu23 and
    /// G12, G13, G23, where nu_ij / E_i = nu_ji / E_j; `None` unless it is positive definite.
    pub fn orthotropic_constants(youngs: [f64; 3], poisson: [f64; 3], shear: [f64; 3]) -> Option<Self> {
        let [e1, e2, e3] = youngs;
        let [nu12, nu13, nu23] = poisson;
        let compliance = Matrix3::new(
            1.0 / e1,
            -nu12 / e1,
            -nu13 / e1,
            -nu12 / e1,
            1.0 / e2,
            -nu23 / e2,
            -nu13 / e1,
            -nu23 / e2,
            1.0 / e3,
        );
        let normal = compliance.cholesky()?.inverse();
        let mut matrix = Matrix6::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&normal);
        let [g12, g13, g23] = shear;
        for (k, modulus) in [g12, g23, g13].into_iter().enumerate() {
            matrix[(3 + k, 3 + k)] = modulus;
        }
        Self::definite(matrix)
    }

    /// Returns the elasticity if its matrix is finite and positive definite.
    pub fn definite(matrix: Matrix6<f64>) -> Option<Self> {
        let symmetric = (matrix + matrix.transpose()) * 0.5;
        (symmetric.iter().all(|value| value.is_finite()) && symmetric.cholesky().is_some())
            .then_some(Self(symmetric))
    }

    /// Returns the elasticity along other axes: `axes` has the axes of the material as columns, along those in which the
    /// result holds.
    pub fn turned(&self, axes: &Matrix3<f64>) -> Self {
        let stresses = stresses_along(axes);
        Self(stresses * self.0 * stresses.transpose())
    }
}

/// Components of a symmetric tensor, in the order of its vector.
pub(crate) const COMPONENTS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Places of the components of a symmetric tensor in its vector, the reverse of [`COMPONENTS`].
pub(crate) const PLACES: [[usize; 3]; 3] = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];

/// Returns the matrix that turns a vector of stresses along `axes` (columns) into one along the common axes:
/// s_ij = sum_kl a_ik a_jl s_kl. Its transpose turns engineering strains the other way.
pub(crate) fn stresses_along(axes: &Matrix3<f64>) -> SMatrix<f64, 6, 6> {
    SMatrix::from_fn(|row, column| {
        let ((i, j), (k, l)) = (COMPONENTS[row], COMPONENTS[column]);
        let direct = axes[(i, k)] * axes[(j, l)];
        if k == l { direct } else { direct + axes[(i, l)] * axes[(j, k)] }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn an_isotropic_material_has_lames_constants_along_all_axes() {
        let steel = Elasticity::isotropic(210e3, 0.3).expect("a material");
        let (lambda, mu) = (210e3 * 0.3 / (1.3 * 0.4), 210e3 / 2.6);
        let expected = Matrix6::from_fn(|i, j| match (i < 3 && j < 3, i == j) {
            (true, true) => lambda + 2.0 * mu,
            (true, false) => lambda,
            (false, true) => mu,
            (false, false) => 0.0,
        });
        assert!((steel.0 - expected).amax() < 1e-10 * lambda);
        let turned = steel.turned(Rotation3::from_euler_angles(0.3, -1.2, 2.0).matrix());
        assert!((turned.0 - expected).amax() < 1e-10 * lambda);
        for (youngs, poisson) in [(0.0, 0.3), (-1.0, 0.3), (1.0, 0.5), (1.0, -1.0), (f64::NAN, 0.3)] {
            assert_eq!(Elasticity::isotropic(youngs, poisson), None, "{youngs} {poisson}");
        }
    }

    #[test]
    fn the_energy_of_a_strain_does_not_depend_on_the_axes() {
        let wood = Elasticity::orthotropic_constants([10.0, 1.0, 0.5], [0.4, 0.35, 0.6], [0.7, 0.8, 0.1])
            .expect("a material");
        let axes = Rotation3::from_euler_angles(1.3, 0.2, -0.7);
        let strain = Matrix3::new(0.1, 0.4, -0.2, 0.4, -0.3, 0.25, -0.2, 0.25, 0.05);
        let vector = |e: &Matrix3<f64>| {
            nalgebra::Vector6::from_fn(|k, _| {
                let (i, j) = COMPONENTS[k];
                if i == j { e[(i, j)] } else { 2.0 * e[(i, j)] }
            })
        };
        let own = vector(&(axes.matrix().transpose() * strain * axes.matrix()));
        let common = vector(&strain);
        let energy = own.dot(&(wood.0 * own));
        let turned = common.dot(&(wood.turned(axes.matrix()).0 * common));
        assert!((energy - turned).abs() < 1e-12 * energy, "{energy} {turned}");
    }
}
