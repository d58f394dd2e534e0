//! First view of a page that colours a body by stresses: the place of the largest one is on the side of the viewer.

use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, SurfaceMesh};
use flexbody_body::invariants::BodyFrame;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::{CasePeak, Envelope, PointPeaks, RecoveryEnvelope};
use flexbody_report::{Colouring, View};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, grid};

/// Numbers of cells of a block along the axes.
const CELLS: [i32; 3] = [5, 2, 3];

/// Returns a block with its surface.
fn block() -> FlexBody {
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid(CELLS), |x| x);
    let raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    let model = FeModel::from_raw(raw).expect("a sound model").model;
    let settings = ConvertSettings {
        frame: BodyFrame::Com.into(),
        modes: ModeSettings { wanted: Wanted::Lowest(3), ..ModeSettings::default() },
        lumped: Vec::new(),
        ..ConvertSettings::default()
    };
    let body = convert(&model, &settings, &Context::QUIET).expect("a body").body;
    let places = places(&body);
    let at = |x: [i32; 3]| -> u32 {
        let node = places.iter().position(|place| (0..3).all(|k| (place[k] - f64::from(x[k])).abs() < 1e-6));
        u32::try_from(node.expect("a node")).expect("few nodes")
    };
    let mut triangles = Vec::new();
    for axis in 0..3 {
        let (l, m) = ((axis + 1) % 3, (axis + 2) % 3);
        for (side, i, j) in [0, CELLS[axis]]
            .into_iter()
            .flat_map(|side| (0..CELLS[l]).flat_map(move |i| (0..CELLS[m]).map(move |j| (side, i, j))))
        {
            let corner = |di: i32, dj: i32| {
                let mut x = [0; 3];
                (x[axis], x[l], x[m]) = (side, i + di, j + dj);
                at(x)
            };
            triangles.push([corner(0, 0), corner(1, 0), corner(1, 1)]);
            triangles.push([corner(0, 0), corner(1, 1), corner(0, 1)]);
        }
    }
    let mut parts = body.into_parts();
    let n = parts.nodes.ids.len();
    parts.mesh = Some(SurfaceMesh::new(triangles, Vec::new(), n).expect("a surface"));
    FlexBody::new(parts).expect("a body")
}

fn places(body: &FlexBody) -> Vec<[f64; 3]> {
    body.nodes().positions.iter().map(|x| body.frame().to_model(*x)).collect()
}

/// Returns the page of the body with stresses that grow towards the node `top` (index), where they are largest.
fn page(body: &FlexBody, top: usize) -> String {
    let places = places(body);
    let zero = CasePeak { value: 0.0, time: 0.0, case: 0 };
    let point = |(node, id): (usize, &i64)| {
        let distance = (0..3).map(|k| (places[node][k] - places[top][k]).powi(2)).sum::<f64>().sqrt();
        PointPeaks {
            name: format!("n{id}"),
            node: Some(*id),
            element: None,
            unit: "MPa".to_owned(),
            von_mises: CasePeak { value: 30.3 / (1.0 + distance), ..zero },
            largest_principal: zero,
            smallest_principal: zero,
        }
    };
    let points = body.nodes().ids.iter().enumerate().map(point).collect();
    let recoveries = vec![RecoveryEnvelope { name: "skin".to_owned(), points }];
    let envelope = Envelope { cases: Vec::new(), recoveries };
    View::new(body, None, None, Some(Colouring::Envelope(&envelope))).expect("a page").html().to_owned()
}

/// Returns the rotations about x and about z of the first view of a page.
fn view_of(page: &str) -> [f64; 2] {
    let (_, data) = page.split_once("id=\"data\">").expect("data");
    let data = data.split_once("</script>").expect("an end").0;
    let data: serde_json::Value = serde_json::from_str(data).expect("JSON");
    [0, 1].map(|k| data["view"][k].as_f64().expect("an angle"))
}

/// Returns the component towards the viewer of a vector of the model.
fn toward_viewer([about_x, about_z]: [f64; 2], v: [f64; 3]) -> f64 {
    let y = about_z.sin() * v[0] + about_z.cos() * v[1];
    about_x.sin() * y + about_x.cos() * v[2]
}

#[test]
fn the_first_view_shows_the_largest_stress() {
    let body = block();
    let mut views = Vec::new();
    for (node, place) in places(&body).iter().enumerate() {
        let mut normals = Vec::new();
        for k in 0..3 {
            for (side, sign) in [(0.0, -1.0), (f64::from(CELLS[k]), 1.0)] {
                if (place[k] - side).abs() < 1e-6 {
                    let mut normal = [0.0; 3];
                    normal[k] = sign;
                    normals.push(normal);
                }
            }
        }
        if normals.is_empty() {
            continue;
        }
        let html = page(&body, node);
        let view = view_of(&html);
        let is_seen = normals.iter().any(|normal| toward_viewer(view, *normal) > 0.0);
        assert!(is_seen, "node at {place:?}, view {view:?}");
        if !views.contains(&view) {
            views.push(view);
        }
    }
    assert!(views.contains(&[-1.12, -0.6]) && views.len() > 1, "{views:?}");
}
