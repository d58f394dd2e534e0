//! Reference points of interfaces: on the axis, at the centre, or at a stated position.

use crate::program::flexbody;
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::{BasisChoice, CraigBampton, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::verification::verify;
use flexbody_eigen::Wanted;
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{
    CheckedModel, Coupling, ElementShape, Elements, FeModel, NodeSet, RawModel, Reference, skin,
};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::fixtures;
use oracle::mesh::{Mesh, grid};
use std::fs;
use std::path::Path;

const RADIUS: f64 = 0.01;
const CENTRE: [f64; 3] = [0.3, -0.2, 0.05];

/// Returns a plate of tetrahedra with a hole about the axis through [`CENTRE`] along z, meshed five times as
/// fine on one side; with its surface and the nodes of the hole.
fn plate() -> (RawModel, Vec<i64>) {
    const AROUND: i32 = 48;
    let map = |[r, t, z]: [f64; 3]| {
        let turn = std::f64::consts::TAU * t / f64::from(AROUND);
        let angle = turn + 0.65 * turn.sin();
        let radius = RADIUS * (1.0 + r);
        [radius * angle.cos(), radius * angle.sin(), 0.004 * z]
    };
    let mesh = Mesh::from_cells(ElementKind::Tet10, &grid([1, AROUND, 2]), map).welded(1e-9);
    let middle = 0.004;
    let bore: Vec<i64> =
        (1..).zip(&mesh.nodes).filter(|(_, x)| x[0].hypot(x[1]) < 1.001 * RADIUS).map(|(id, _)| id).collect();
    let mesh = mesh.moved(&nalgebra::Matrix3::identity(), [CENTRE[0], CENTRE[1], CENTRE[2] - middle]);
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    let mut elements = Elements::default();
    for (_, nodes) in &mesh.elements {
        let ids: Vec<i64> = nodes.iter().map(|&node| node as i64 + 1).collect();
        elements.add("C3D10", ElementShape::Tetrahedron, &ids);
    }
    raw.data.mesh = skin(&elements, &raw.nodes).mesh;
    (raw, bore)
}

fn checked(raw: RawModel) -> CheckedModel {
    FeModel::from_raw(raw).unwrap_or_else(|error| panic!("{error}"))
}

fn away(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

fn body_of(model: &FeModel, basis: BasisChoice) -> FlexBody {
    let modes = ModeSettings { wanted: Wanted::Lowest(3), ..ModeSettings::default() };
    convert(model, &ConvertSettings { modes, basis, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("a body")
        .body
}

/// The mean of the nodes is half a radius off the axis, the centre of the faces is on it; the coupling refers
/// to the latter.
#[test]
fn the_centre_of_a_hole_is_that_of_its_faces() {
    let (mut raw, bore) = plate();
    for coupling in [Coupling::Averaging, Coupling::Rigid] {
        let set = NodeSet { coupling: Some(coupling), ..NodeSet::new("bore", bore.clone()) };
        raw.data.interfaces = vec![set];
        let CheckedModel { model, diagnostics, .. } = checked(raw.clone());
        let point = model.interfaces()[0].reference.point().expect("a point");
        assert!(away(point, CENTRE) < 0.004 * RADIUS, "{point:?}");
        let told = diagnostics.iter().find(|told| told.code() == Code::InterfaceCentre).expect("a warning");
        assert!(told.message().contains("the centre of its faces, weighted by area"), "{}", told.message());
        let body = body_of(&model, BasisChoice::CraigBampton(CraigBampton));
        let interface = &body.interfaces()[0];
        let place = body.frame().to_model(interface.reference.expect("a point"));
        assert!(away(place, point) < 1e-15);
    }
    raw.data.mesh = None;
    let model = checked(raw).model;
    let mean = model.interfaces()[0].reference.point().expect("a point");
    assert!(away(mean, CENTRE) > 0.2 * RADIUS, "{mean:?}");
}

/// The rim of the hole has edges and no faces; a stated point is used without a warning, and a free interface
/// has no point.
#[test]
fn rims_have_the_centre_of_their_edges_and_stated_points_stay() {
    let (mut raw, bore) = plate();
    let positions = &raw.nodes.positions;
    let lowest = CENTRE[2] - 0.004;
    let on_rim = |id: &i64| (positions[*id as usize - 1][2] - lowest).abs() < 1e-9;
    let rim: Vec<i64> = bore.iter().copied().filter(on_rim).collect();
    let stated = Reference::Point([0.3, -0.2, 0.06]);
    raw.data.interfaces = vec![
        NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new("rim", rim.clone()) },
        NodeSet { reference: stated, coupling: Some(Coupling::Averaging), ..NodeSet::new("stated", bore) },
        NodeSet { coupling: Some(Coupling::Free), ..NodeSet::new("free", rim) },
    ];
    let CheckedModel { model, diagnostics, .. } = checked(raw);
    let [rim, stated, free] = [0, 1, 2].map(|i| model.interfaces()[i].reference.point());
    assert!(away(rim.expect("a point"), [CENTRE[0], CENTRE[1], lowest]) < 0.004 * RADIUS, "{rim:?}");
    assert_eq!((stated, free), (Some([0.3, -0.2, 0.06]), None));
    let told: Vec<&str> = diagnostics
        .iter()
        .filter(|told| told.code() == Code::InterfaceCentre)
        .map(|told| told.message())
        .collect();
    assert!(matches!(told[..], [one] if one.contains("`rim`") && one.contains("of its edges")), "{told:?}");
}

/// Creates a folder with the cube of the fixtures and `more` in its manifest.
fn cube(more: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for entry in fs::read_dir(fixtures().join("models/cube_hex8")).expect("the fixture") {
        let entry = entry.expect("an entry");
        fs::copy(entry.path(), folder.path().join(entry.file_name())).expect("a copy");
    }
    let manifest = folder.path().join("model.toml");
    let text = fs::read_to_string(&manifest).expect("the manifest");
    fs::write(&manifest, format!("{text}\n{more}")).expect("a manifest");
    folder
}

fn cube_model(folder: &Path) -> FeModel {
    let files = read_manifest(folder.join("model.toml")).expect("a manifest");
    checked(read_model(&files).expect("a model")).model
}

/// Half of the nodes about an axis have their point on the axis, in the middle of their extent.
#[test]
fn a_cylinder_has_its_point_on_its_axis() {
    let region = |coupling: &str| {
        format!(
            "[[interface]]\nname = \"pin\"\ncylinder = {{ from = [0, 0, -1], to = [0, 0, 2], radius = 0.09 }}\n{coupling}"
        )
    };
    let folder = cube(&region(""));
    let model = cube_model(folder.path());
    let set = &model.interfaces()[0];
    let places = model.nodes().ids.iter().zip(&model.nodes().positions);
    let z: Vec<f64> = places.filter(|(id, _)| set.nodes.contains(id)).map(|(_, x)| x[2]).collect();
    let (low, high) = z.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(*z), h.max(*z)));
    let point = set.reference.point().expect("a point");
    assert!(away(point, [0.0, 0.0, 0.5 * (low + high)]) < 1e-15, "{point:?}");
    let stated = cube(&region("reference = [0.01, 0.02, 0.03]\n"));
    assert_eq!(cube_model(stated.path()).interfaces()[0].reference, Reference::Point([0.01, 0.02, 0.03]));
    let free = cube(&region("coupling = \"free\"\n"));
    assert_eq!(cube_model(free.path()).interfaces()[0].reference.point(), None);
}

/// A body of an earlier version has its point at the mean of the nodes and is consistent with the same model.
#[test]
fn bodies_of_earlier_versions_keep_the_mean_of_the_nodes() {
    let (raw, bore) = plate();
    let with = |reference| {
        let set = NodeSet { reference, ..NodeSet::new("bore", bore.clone()) };
        checked(raw.clone().with(|data| data.interfaces = vec![set])).model
    };
    let sum = bore.iter().fold([0.0; 3], |sum, &id| {
        let x = raw.nodes.positions[id as usize - 1];
        [0, 1, 2].map(|k| sum[k] + x[k])
    });
    let mean = Reference::Point(sum.map(|sum| sum / bore.len() as f64));
    let body = body_of(&with(mean), BasisChoice::default());
    let holds = |model: &FeModel| {
        let checks = verify(&body, model).expect("the same nodes");
        checks.iter().find(|check| check.name == "reference_points").expect("a check").passed
    };
    assert!(holds(&with(mean)) && holds(&with(Reference::Centre)));
    assert!(!holds(&with(Reference::Point(CENTRE))));
}

/// The command line states a point; terminal, `inspect` and JSON show it in model axes.
#[test]
fn the_point_of_a_set_is_stated_and_told() {
    let folder = tempfile::tempdir().expect("a folder");
    for entry in fs::read_dir(fixtures().join("small/calculix")).expect("the fixture") {
        let entry = entry.expect("an entry");
        fs::copy(entry.path(), folder.path().join(entry.file_name())).expect("a copy");
    }
    let convert =
        ["convert", "job.inp", "--units", "m,kg,s", "--modes", "4", "-o", "b.flex.h5", "--interface"];
    let run = |interface: &str| {
        let output = flexbody(folder.path(), &[&convert[..], &[interface]].concat());
        (
            output.status.success(),
            String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned(),
        )
    };
    for interface in ["end=RIGHT,averaging,0.25/0.04/0.03", "end=RIGHT,0.25/0.04/0.03"] {
        let (done, text) = run(interface);
        assert!(done && text.contains("at 0.25, 0.04, 0.03 m"), "{text}");
        for words in [&["inspect", "b.flex.h5"][..], &["inspect", "b.flex.h5", "--verbose"]] {
            let text = String::from_utf8_lossy(&flexbody(folder.path(), words).stdout).into_owned();
            assert!(text.contains("at 0.25, 0.04, 0.03 m"), "{text}");
        }
        let json = flexbody(folder.path(), &["inspect", "b.flex.h5", "--json"]).stdout;
        let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
        let point = &json["results"]["model"]["interfaces"][0]["reference_model"];
        let point = [0, 1, 2].map(|k| point[k].as_f64().expect("a number"));
        assert!(away(point, [0.25, 0.04, 0.03]) < 1e-15, "{json}");
    }
    for (interface, said) in [
        ("end=RIGHT,averaging,1/2", "`1/2` is not a point"),
        ("end=RIGHT,averaging,1/2/z", "`1/2/z` is not a point"),
        ("end=RIGHT,glued,1/2/3", "`glued` is not a coupling"),
        ("end=RIGHT,free,0.2/0/0", "is free, but has a reference point"),
        ("end=RIGHT,averaging,1/2/inf", "`1/2/inf` is not a point"),
    ] {
        let (done, text) = run(interface);
        assert!(!done && text.contains(said), "{interface}: {text}");
    }
}
