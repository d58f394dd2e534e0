//! Warnings about modes of a Craig-Bampton basis that lack the static response to the motion of their carrier.

use flexbody_base::diagnostic::Code;
use flexbody_body::basis::{BasisChoice, CraigBampton, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, NodeSet};
use flexbody_motion::scene::{FramedScene, LoadCases};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::Mesh;

/// Returns a slender beam along x with `modes` fixed-interface modes: bending along y and z comes first, stretching last.
fn beam(modes: usize) -> FlexBody {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::block(ElementKind::Hex20, [8, 1, 1], [4.0, 0.3, 0.2]);
    let mut raw = mesh.assemble(&rubber, MassRule::Consistent).raw_model();
    let at_root = raw.nodes.ids.iter().zip(&raw.nodes.positions).filter(|(_, x)| x[0] == 0.0);
    let nodes = at_root.map(|(id, _)| *id).collect();
    raw.data.interfaces = vec![NodeSet { coupling: Some(Coupling::Rigid), ..NodeSet::new("root", nodes) }];
    let settings = ConvertSettings {
        basis: BasisChoice::CraigBampton(CraigBampton),
        modes: ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() },
        lumped: Vec::new(),
        ..ConvertSettings::default()
    };
    let model = FeModel::from_raw(raw).expect("a sound model").model;
    convert(&model, &settings, &Context::QUIET).expect("a body").body
}

/// Returns the message about missing responses in a scene, carried by the root.
fn missing(body: &FlexBody, head: &str, tail: &str) -> Option<String> {
    let text = format!("{head}\n[run]\nduration = 1\n[carried]\ninterface = \"root\"\n{tail}");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("written");
    let scene = LoadCases::read_single(path, None).expect("a scene");
    let found = FramedScene::new(body, &scene).expect("a carried body").diagnostics;
    found
        .iter()
        .find(|diagnostic| diagnostic.code() == Code::CarrierUnresolved)
        .map(|one| one.message().to_owned())
}

/// A few bending modes hold the response to gravity across the beam and nothing of that along it, to spin about any axis
/// across it, or to a drive along it; enough modes hold all of them.
#[test]
fn modes_without_the_static_response_to_the_carrier_are_named() {
    let few = beam(4);
    let along = "gravity = [-1e-3, 0, 0]";
    let spin = "[carried.spin]\naxis = [0, 0, 1]\nrate = 0.01";
    let drive =
        "[carried.translation]\ndirection = [1, 0, 0]\nacceleration = { amplitude = 1e-3, frequency = 1 }";
    for (head, tail) in [(along, ""), ("", spin), ("", drive)] {
        let message = missing(&few, head, tail).expect("a warning");
        assert!(message.contains("about 100 % of its elastic energy"), "{message}");
    }
    // Gravity across the beam, alone and beside a hundredth of it along the beam.
    for across in ["gravity = [0, 0, -1e-3]", "gravity = [-1e-5, 0, -1e-3]", "gravity = [0, 1e-3, 0]"] {
        assert_eq!(missing(&few, across, ""), None, "{across}");
    }
    // A held body without a load, and a body with several modes of stretching.
    assert_eq!(missing(&few, "", ""), None);
    let many = beam(30);
    for (head, tail) in [(along, ""), ("", spin), ("", drive)] {
        assert_eq!(missing(&many, head, tail), None, "{head} {tail}");
    }
}
