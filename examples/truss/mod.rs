// Steel trusses, their rods with consistent mass: what the examples and the guide of the library make models
// of.

use sprs::{CsMat, TriMat};

pub const YOUNGS: f64 = 2.1e11; // Pa
const DENSITY: f64 = 7850.0; // kg/m^3
const AREA: f64 = 1e-4; // m^2
pub const BAY: f64 = 0.5; // m

/// K, M and the positions of the joints of a tower of 3 x 3 x 8 bays.
pub fn truss() -> (CsMat<f64>, CsMat<f64>, Vec<[f64; 3]>) {
    truss_of([3, 3, 8], YOUNGS)
}

/// K, M and the positions of the joints of so many bays along x, y and z, of a material with this modulus
/// (Pa).
pub fn truss_of(bays: [i32; 3], youngs: f64) -> (CsMat<f64>, CsMat<f64>, Vec<[f64; 3]>) {
    let positions = joints(bays);
    let (stiffness, mass) = matrices(&positions, youngs);
    (stiffness, mass, positions)
}

/// Joints on a grid of bays.
fn joints([x, y, z]: [i32; 3]) -> Vec<[f64; 3]> {
    let grid = |(i, j, k): (i32, i32, i32)| [i, j, k].map(|c| BAY * f64::from(c));
    (0..=z).flat_map(|k| (0..=y).flat_map(move |j| (0..=x).map(move |i| grid((i, j, k))))).collect()
}

/// K and M of rods between all joints that are at most one space diagonal of a bay apart.
fn matrices(joints: &[[f64; 3]], youngs: f64) -> (CsMat<f64>, CsMat<f64>) {
    let n = 3 * joints.len();
    let (mut stiffness, mut mass) = (TriMat::new((n, n)), TriMat::new((n, n)));
    for (a, xa) in joints.iter().enumerate() {
        for (b, xb) in joints.iter().enumerate().skip(a + 1) {
            let along: [f64; 3] = std::array::from_fn(|k| xb[k] - xa[k]);
            let length = along.iter().map(|c| c * c).sum::<f64>().sqrt();
            if length > 1.01 * BAY * 3f64.sqrt() {
                continue;
            }
            // Along the rod: EA/L [1 -1; -1 1]. In every direction: rho A L / 6 [2 1; 1 2].
            for (i, j, sign, share) in
                [(a, a, 1.0, 2.0), (b, b, 1.0, 2.0), (a, b, -1.0, 1.0), (b, a, -1.0, 1.0)]
            {
                for k in 0..3 {
                    mass.add_triplet(3 * i + k, 3 * j + k, share * DENSITY * AREA * length / 6.0);
                    for l in 0..3 {
                        let value = sign * youngs * AREA / length.powi(3) * along[k] * along[l];
                        stiffness.add_triplet(3 * i + k, 3 * j + l, value);
                    }
                }
            }
        }
    }
    (stiffness.to_csc(), mass.to_csc())
}
