//! Orders of convergence under refinement: frequencies, and the errors that lumped masses make.

use crate::support::elements::{Kind, MassRule, Material};
use crate::support::mesh::Mesh;
use crate::support::pipeline::modes;

const SIZE: [f64; 3] = [1.0, 0.62, 0.45];

#[test]
fn probe() {
    for (kind, list) in [(Kind::Hex8, vec![2,4,8,16]), (Kind::Tet10, vec![1, 2,4, 8])] {
        let mut all = Vec::new();
        for s in list {
            let t = std::time::Instant::now();
            let body = Mesh::block(kind, [2 * s, s, s], SIZE).assemble(&Material::STEEL, MassRule::Consistent);
            let found = modes(&body, 8);
            eprintln!("{kind:?} {s} {:?}", t.elapsed());
            all.push(found.frequencies());
        }
        for w in all.windows(3) {
            eprintln!("{:?}", (0..8).map(|j| ((w[0][j]-w[1][j])/(w[1][j]-w[2][j])).log2()).collect::<Vec<_>>());
        }
    }
}
