// A steel truss of 3 x 3 x 8 bays, its rods with consistent mass: what the example and the guide of the library make a model of.

use sprs::{CsMat, TriMat};

const YOUNGS: f64 = 2.1e11; // Pa
const DENSITY: f64 = 7850.0; // kg/m^3
const AREA: f64 = 1e-4; // m^2
const BAY: f64 = 0.5; // m

/// K, M and the positions of the joints.
pub fn truss() -> (CsMat<f64>, CsMat<f64>, Vec<[f64; 3]>) {
    let positions = joints();
    let (stiffness, mass) = matrices(&positions);
    (stiffness, mass, positions)
}

/// Joints on a grid of bays.
fn joints() -> Vec<[f64; 3]> {
    let grid = |(i, j, k): (i32, i32, i32)| [i, j, k].map(|c| BAY * f64::from(c));
    (0..9).flat_map(|k| (0..4).flat_map(move |j| (0..4).map(move |i| grid((i, j, k))))).collect()
}

/// K and M of rods between all joints that are at most one space diagonal of a bay apart.
fn matrices(joints: &[[f64; 3]]) -> (CsMat<f64>, CsMat<f64>) {
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
                        let value = sign * YOUNGS * AREA / length.powi(3) * along[k] * along[l];
                        stiffness.add_triplet(3 * i + k, 3 * j + l, value);
                    }
                }
            }
        }
    }
    (stiffness.to_csc(), mass.to_csc())
}
