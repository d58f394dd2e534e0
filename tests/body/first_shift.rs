//! The estimate that the first shift comes from, against rings of beams whose first eigenvalue is known.

use crate::support::beams::ring;
use flexbody::body::basis::{first_eigenvalue_estimate, rigid_modes};
use flexbody::model::FeModel;

/// A ring bends in two waves, which fields of the second degree only stretch: their Rayleigh quotients are larger by
/// (radius / width)^2.
#[test]
fn the_estimate_of_a_thin_ring_is_that_of_its_bending() {
    for (n, width) in [(40, 0.05), (120, 0.01), (400, 0.002)] {
        let (raw, first) = ring(n, width);
        let model = FeModel::from_raw(raw).expect("a sound model").model;
        let rigid = rigid_modes(&model, &model.pencil()).expect("six of them");
        let estimate = first_eigenvalue_estimate(&model, rigid.as_ref());
        assert!((0.98..3.0).contains(&(estimate / first)), "{n} beams: {estimate:e}, {first:e}");
    }
}
