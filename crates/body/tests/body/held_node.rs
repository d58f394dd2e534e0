//! Frames on an interface of one node, whose rotation is zero in every mode and known.

use faer::Mat;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{Carrier, FlexBody};
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, NodeSet, Reference};
use oracle::beams::{BeamMass, star};

const FOOT: &str = "foot";

/// Returns a star of beams with all its modes; its interface is one node with a reference point beside it.
fn body(frame: FrameChoice) -> FlexBody {
    let raw = star(BeamMass::Consistent);
    let foot = NodeSet {
        reference: Reference::Point([0.1, -0.2, 0.05]),
        ..NodeSet::new(FOOT, vec![raw.nodes.ids[1]])
    };
    let model = FeModel::from_raw(raw.with(|data| data.interfaces = vec![foot])).expect("a body").model;
    let modes = ModeSettings { wanted: Wanted::Lowest(36), ..ModeSettings::default() };
    let settings = ConvertSettings { modes, frame, ..ConvertSettings::default() };
    convert(&model, &settings, &Context::QUIET).expect("converts").body
}

/// Returns the compliance of the reference point to forces and torques there: translations and rotations of the deformation
/// (6 x 6), whatever modes the body has.
fn compliance(body: &FlexBody) -> Mat<f64> {
    let modes = body.modes();
    let rotation = modes.rotation.as_ref().map(Mat::as_ref);
    let rows =
        body.interfaces()[0].rows(body.nodes(), modes.shape.as_ref(), rotation, 3).expect("a reference");
    let rotation = rows.rotation.expect("the node has rotations");
    let entry = |i: usize, j: usize| if i < 3 { rows.translation[(i, j)] } else { rotation[(i - 3, j)] };
    let motion = Mat::from_fn(6, body.n_modes(), |i, j| entry(i, j) / modes.eigenvalue[j].sqrt());
    &motion * motion.transpose()
}

#[test]
fn the_rotation_of_a_held_node_is_known() {
    let mean = body(BodyFrame::Com.into());
    let held = body(FrameChoice::Interface(FOOT.to_owned()));
    assert!(compliance(&held).norm_max() < 1e-12 * compliance(&mean).norm_max());
    // A torque there acts, and the node carries.
    assert!(held.carried(&Carrier::Interface(FOOT.to_owned())).is_ok());
    // In mean axes the node turns again.
    let back = held.in_mean_axes().expect("mean axes");
    let (found, right) = (compliance(&back), compliance(&mean));
    assert!((&found - &right).norm_max() < 1e-8 * right.norm_max(), "{found:?} {right:?}");
}
