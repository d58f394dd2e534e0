//! Estimate for the first shift, compared with tubes of beams whose first eigenvalue is known.

use flexbody_body::basis::{first_eigenvalue_estimate, rigid_modes};
use flexbody_model::FeModel;
use oracle::beams::tube;

/// A tube bends in two circumferential waves, which second-degree fields represent by stretching only: their
/// Rayleigh quotients are larger by (radius / width)^2.
#[test]
fn the_estimate_of_a_thin_tube_is_that_of_its_bending() {
    for (around, rings, width) in [(16, 3, 0.05), (24, 4, 0.01), (32, 3, 0.002)] {
        let (raw, first) = tube(around, rings, width);
        let model = FeModel::from_raw(raw).expect("a sound model").model;
        let rigid = rigid_modes(&model, &model.pencil()).expect("six of them");
        let estimate = first_eigenvalue_estimate(&model, rigid.as_ref());
        assert!((0.3..3.0).contains(&(estimate / first)), "width {width}: {estimate:e}, {first:e}");
    }
}
