//! Surface for drawing a body: from decks, archives and meshes, through a conversion and a file.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, MeshChoice, convert};
use flexbody_body::flex_body::{FlexBody, SurfaceMesh};
use flexbody_eigen::Wanted;
use flexbody_input::{ModelFiles, read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, Nodes, RawModel};
use nalgebra::Vector3;
use oracle::fixtures;
use std::collections::HashMap;
use std::fs;
use std::path::Path;

/// Reads the matrices of the tetrahedron of `fixtures/small` with the nodes of another model.
fn with_nodes(nodes: &Path) -> Result<RawModel, Error> {
    let small = |name: &str| fixtures().join("small/tet4").join(name);
    let dofs = Some(small("dofs.csv"));
    read_model(&ModelFiles::from_arguments(small("K.mtx"), small("M.mtx"), nodes, dofs, None).expect("files"))
}

fn read(nodes: &Path) -> RawModel {
    with_nodes(nodes).unwrap_or_else(|error| panic!("{}: {error}", nodes.display()))
}

fn job(name: &str) -> RawModel {
    let path = fixtures().join("small").join(name).join("job.inp");
    read_model(&ModelFiles::from_job(path, None, Vec::new(), Some("m,kg,s")).expect("units")).expect("a job")
}

fn corners(triangle: [u32; 3], x: &[[f64; 3]]) -> [Vector3<f64>; 3] {
    triangle.map(|i| x[i as usize].into())
}

/// Returns the volume inside a closed surface, and its area.
fn volume_and_area(triangles: &[[u32; 3]], x: &[[f64; 3]]) -> (f64, f64) {
    let own = triangles.iter().map(|&triangle| {
        let [a, b, c] = corners(triangle, x);
        (a.dot(&b.cross(&c)) / 6.0, (b - a).cross(&(c - a)).norm() / 2.0)
    });
    own.fold((0.0, 0.0), |(volume, area), (v, a)| (volume + v, area + a))
}

/// Asserts that every side of a triangle belongs to exactly one other triangle, in the opposite direction.
fn assert_closed(mesh: &SurfaceMesh) {
    let mut sides: HashMap<[u32; 2], usize> = HashMap::new();
    for &[a, b, c] in mesh.triangles() {
        [[a, b], [b, c], [c, a]].into_iter().for_each(|side| *sides.entry(side).or_default() += 1);
    }
    assert!(sides.iter().all(|([a, b], count)| *count == 1 && sides.get(&[*b, *a]) == Some(&1)));
}

fn assert_encloses(mesh: &SurfaceMesh, nodes: &Nodes, volume: f64, area: f64) {
    assert_closed(mesh);
    let own = volume_and_area(mesh.triangles(), &nodes.positions);
    assert!((own.0 / volume - 1.0).abs() < 1e-12 && (own.1 / area - 1.0).abs() < 1e-12, "{own:?}");
}

/// The block of `fixtures/make/make_jobs.py`: its surface and its twelve edges, four of which consist of two
/// elements.
#[test]
fn decks_give_the_surface_of_their_solids() {
    let [a, b, c]: [f64; 3] = [0.2, 0.08, 0.06];
    for name in ["calculix", "abaqus", "abaqus_labels"] {
        let raw = job(name);
        let mesh = raw.data.mesh.as_ref().expect("a surface");
        assert_encloses(mesh, &raw.nodes, a * b * c, 2.0 * (a * b + b * c + c * a));
        assert_eq!((mesh.triangles().len(), mesh.edges().len()), (20, 16), "{name}");
    }
}

/// Nastran decks of a job, and as node files for other matrices.
#[test]
fn decks_of_nastran_give_the_surface_of_their_solids() {
    let [a, b, c]: [f64; 3] = [0.2, 0.08, 0.06];
    let deck = |name: &str| fixtures().join("small").join(name).join("job.bdf");
    let job = read_model(
        &ModelFiles::from_job(deck("nastran_op4"), None, Vec::new(), Some("m,kg,s")).expect("units"),
    )
    .expect("a job");
    for raw in [job, read(&deck("nastran_op4"))] {
        let mesh = raw.data.mesh.as_ref().expect("a surface");
        assert_encloses(mesh, &raw.nodes, a * b * c, 2.0 * (a * b + b * c + c * a));
        assert_eq!((mesh.triangles().len(), mesh.edges().len()), (20, 16));
    }
    let turned = with_nodes(&deck("nastran")).expect_err("rows along other axes");
    assert_eq!(turned.diagnostics()[0].code(), Code::DeckUnsupported);
}

/// Second-order elements with mid-edge nodes in the order of Nastran: G13 to G16 of CHEXA (G10 to G12 of
/// CPENTA) between the lower and the upper face. A wrong order would fold the faces.
#[test]
fn elements_of_nastran_have_their_middles_in_place() {
    let cube: [[f64; 3]; 8] = [
        [0., 0., 0.],
        [2., 0., 0.],
        [2., 2., 0.],
        [0., 2., 0.],
        [0., 0., 2.],
        [2., 0., 2.],
        [2., 2., 2.],
        [0., 2., 2.],
    ];
    let edges_of_cube =
        [[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 5], [2, 6], [3, 7], [4, 5], [5, 6], [6, 7], [7, 4]];
    let edges_of_wedge = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 4], [2, 5], [3, 4], [4, 5], [5, 3]];
    let wedge = [cube[0], cube[1], cube[3], cube[4], cube[5], cube[7]];
    for (name, corners, edges, volume, area) in [
        ("CHEXA", &cube[..], &edges_of_cube[..], 8.0, 24.0),
        ("CPENTA", &wedge[..], &edges_of_wedge[..], 4.0, 12.0 + 4.0 * 2f64.sqrt()),
    ] {
        let middles =
            edges.iter().map(|&[i, j]| std::array::from_fn(|k| (corners[i][k] + corners[j][k]) / 2.0));
        let places: Vec<[f64; 3]> = corners.iter().copied().chain(middles).collect();
        let mut deck = String::from("BEGIN BULK\n");
        for (id, [x, y, z]) in places.iter().enumerate() {
            deck += &format!("GRID,{},,{x:?},{y:?},{z:?}\n", id + 1);
        }
        deck += &format!("{name},1,1");
        for id in 1..=places.len() {
            deck += if id % 8 == 7 { "\n" } else { "" };
            deck += &format!(",{id}");
        }
        deck += "\nCBAR,2,1,1,2\nCELAS2,3,1.0,1,1\nCTRIAX6,4,1,1,2,3,4,5,6\nENDDATA\n";
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("deck.nas");
        fs::write(&path, deck).expect("written");
        let raw = read(&path);
        let mesh = raw.data.mesh.as_ref().expect("a surface");
        assert_encloses(mesh, &raw.nodes, volume, area);
        let told: Vec<&str> = raw.diagnostics.iter().map(|d| d.message()).collect();
        assert_eq!(told, ["elements that are not drawn: 1 of CTRIAX6"], "{name}");
    }
}

/// VTK cells: a voxel, wedges that fill a brick (with and without mid-edge nodes), a pyramid, and a vertex,
/// which is not drawn.
#[test]
fn meshes_of_vtk_give_the_surface_of_their_cells() {
    let cube: [[f64; 3]; 8] = std::array::from_fn(|k| [(k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64]);
    let wedge = [0, 2, 1, 4, 6, 5];
    let middles = [[0, 2], [2, 1], [1, 0], [4, 6], [6, 5], [5, 4], [0, 4], [2, 6], [1, 5]];
    let between = |[i, j]: [usize; 2]| std::array::from_fn(|k| (cube[i][k] + cube[j][k]) / 2.0);
    let quadratic: Vec<[f64; 3]> = wedge.iter().map(|&k| cube[k]).chain(middles.map(between)).collect();
    let pyramid = [cube[0], cube[1], cube[3], cube[2], cube[4]];
    let root = 2f64.sqrt();
    for (kind, points, volume, area) in [
        (11, cube.to_vec(), 1.0, 6.0),
        (13, quadratic[..6].to_vec(), 0.5, 3.0 + root),
        (26, quadratic.clone(), 0.5, 3.0 + root),
        (14, pyramid.to_vec(), 1.0 / 3.0, 2.0 + root),
    ] {
        let places: Vec<String> = points.iter().flatten().map(f64::to_string).collect();
        let numbers: Vec<String> = (0..points.len()).map(|k| k.to_string()).collect();
        let array = |name: &str, kind: &str, text: String| {
            format!(
                "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{}\" format=\"ascii\">{text}</DataArray>",
                if name == "Points" { 3 } else { 1 }
            )
        };
        let cells = array("connectivity", "Int64", format!("0 {}", numbers.join(" ")))
            + &array("offsets", "Int64", format!("1 {}", points.len() + 1))
            + &array("types", "UInt8", format!("1 {kind}"));
        let text = format!(
            "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\"><UnstructuredGrid><Piece NumberOfPoints=\"{}\" NumberOfCells=\"2\"><Points>{}</Points><Cells>{cells}</Cells></Piece></UnstructuredGrid></VTKFile>",
            points.len(),
            array("Points", "Float64", places.join(" ")),
        );
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("mesh.vtu");
        fs::write(&path, text).expect("written");
        let raw = read(&path);
        let mesh = raw.data.mesh.as_ref().unwrap_or_else(|| panic!("{kind}: a surface"));
        assert_encloses(mesh, &raw.nodes, volume, area);
    }
}

/// The tetrahedron of `fixtures/small` in Exodus files of HDF5 and of classic netCDF: four faces.
#[test]
fn meshes_of_exodus_give_the_surface_of_their_elements() {
    for name in ["tet4.exo", "tet4_classic.exo"] {
        let raw = read(&fixtures().join("small/meshes").join(name));
        let mesh = raw.data.mesh.as_ref().expect(name);
        assert_closed(mesh);
        assert_eq!((mesh.triangles().len(), mesh.edges().len()), (4, 6), "{name}");
        assert!(volume_and_area(mesh.triangles(), &raw.nodes.positions).0 > 0.0, "{name}");
    }
}

/// Second-order tetrahedra with explicit triangles on their faces, which are not drawn twice.
#[test]
fn meshes_of_gmsh_give_the_surface_once() {
    for name in ["block41.msh", "block22.msh"] {
        let raw = read(&fixtures().join("small/meshes").join(name));
        assert_encloses(raw.data.mesh.as_ref().expect("a surface"), &raw.nodes, 2.0, 10.0);
    }
}

/// Reference elements of Gmsh; a wrong order of mid-edge nodes would fold the faces of solids.
#[test]
fn elements_of_the_second_order_have_their_middles_in_place() {
    let raw = read(&fixtures().join("small/meshes/second_order.msh"));
    let mesh = raw.data.mesh.as_ref().expect("a surface");
    let x = &raw.nodes.positions;
    let root = 2f64.sqrt();
    let tetrahedron = (1.0 / 6.0, 1.5 + 3f64.sqrt() / 2.0);
    let (hexahedron, wedge) = ((8.0, 24.0), (1.0, 1.0 + 2.0 * (2.0 + root)));
    let pyramid = (4.0 / 3.0, 4.0 + 4.0 * root);
    let expected = [
        // A line has no area, flat elements no volume.
        (0.0, 0.0),
        (0.0, 0.5),
        (0.0, 4.0),
        (0.0, 4.0),
        tetrahedron,
        hexahedron,
        hexahedron,
        wedge,
        wedge,
        pyramid,
        pyramid,
    ];
    for (k, expected) in expected.into_iter().enumerate() {
        let here = |triangle: &&[u32; 3]| (x[triangle[0] as usize][0] / 4.0).round() as usize == k;
        let own: Vec<[u32; 3]> = mesh.triangles().iter().filter(here).copied().collect();
        let shifted: Vec<[f64; 3]> = x.iter().map(|x| [x[0] - 4.0 * k as f64, x[1], x[2]]).collect();
        let (volume, area) = volume_and_area(&own, &shifted);
        assert!((volume - expected.0).abs() < 1e-12, "{k}: volume {volume}");
        assert!((area - expected.1).abs() < 1e-12, "{k}: area {area}");
    }
    let line = mesh.edges().iter().filter(|[a, b]| x[*a as usize][0].max(x[*b as usize][0]) < 2.0);
    assert_eq!(line.count(), 2, "both halves of the line");
}

/// An archive with a brick, tetrahedra written as bricks (with and without mid-edge nodes), a triangle
/// written as a four-node shell, beams with an orientation node, a spring and an unknown type.
#[test]
fn archives_of_ansys_give_the_surface() {
    let places: [[f64; 3]; 12] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
        [5.0, 0.0, 0.0],
        [6.0, 0.0, 0.0],
        [5.0, 1.0, 0.0],
        [5.0, 0.0, 1.0],
    ];
    let mut text =
        "/COM,ANSYS RELEASE 2021 R1\n/PREP7\nET,1,185\nET,        2,181\nET,3,SOLID186\nET,4,188\n\
        ET,5,14\nET,6,9999\nNBLOCK,6,SOLID,12,12\n(3i9,6e21.13e3)\n"
            .to_owned();
    for (k, x) in places.iter().enumerate() {
        let reals: String = x.iter().map(|x| format!("{:>21}", format!("{x:.13}"))).collect();
        text += &format!("{:>9}{:>9}{:>9}{reals}\n", k + 1, 0, 0);
    }
    text += "N,R5.3,LOC,       -1,\nEBLOCK,19,SOLID,         7,         7\n(19i9)\n";
    let elements: [(i64, &[i64]); 7] = [
        (1, &[1, 2, 3, 4, 5, 6, 7, 8]),
        (3, &[9, 10, 11, 11, 12, 12, 12, 12, 0, 0, 11, 0, 12, 12, 12, 12, 0, 0, 0, 0]),
        (2, &[6, 9, 10, 10]),
        (4, &[10, 11, 1]),
        (5, &[1, 9]),
        (6, &[1, 2, 3]),
        (4, &[10, 77]),
    ];
    for (number, (kind, nodes)) in elements.iter().enumerate() {
        let head = [1, *kind, 1, 1, 0, 0, 0, 0, nodes.len() as i64, 0, number as i64 + 1];
        let fields: Vec<String> = head.iter().chain(*nodes).map(|field| format!("{field:>9}")).collect();
        fields.chunks(19).for_each(|line| text += &(line.concat() + "\n"));
    }
    text += "       -1\nFINISH\n";
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("part.cdb");
    fs::write(&path, &text).expect("written");
    let raw = read(&path);
    let mesh = raw.data.mesh.as_ref().expect("a surface");
    // Twelve triangles of the brick, four of the tetrahedron, one of the shell.
    assert_eq!(mesh.triangles().len(), 17);
    assert!(mesh.edges().contains(&[9, 10]), "the beam");
    let closed = SurfaceMesh::new(mesh.triangles()[..16].to_vec(), Vec::new(), 12).expect("a mesh");
    assert_encloses(&closed, &raw.nodes, 1.0 + 1.0 / 6.0, 6.0 + 1.5 + 3f64.sqrt() / 2.0);
    let told: Vec<&str> = raw.diagnostics.iter().map(|found| found.message()).collect();
    assert_eq!(
        told,
        [
            "elements that are not drawn: 1 of element type 9999",
            "1 of 5 elements have nodes that are not in the model: they are not drawn",
        ]
    );
    // Unreadable elements are no reason to refuse the nodes.
    for (from, to) in [("(19i9)", "(something)"), (",SOLID,         7", ",,         7"), ("      186", " ")] {
        fs::write(&path, text.replace(from, to)).expect("written");
        read(&path);
    }
    for length in (text.find("EBLOCK").expect("a block")..text.len()).step_by(7) {
        fs::write(&path, &text[..length]).expect("written");
        read(&path);
    }
}

/// A mesh in addition to tables: its surface is drawn on the nodes of the table, in the body and in the file;
/// without `mesh` there is none.
#[test]
fn a_mesh_beside_tables_is_drawn_on_their_nodes() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    for name in ["K.mtx", "M.mtx", "nodes.csv", "dofs.csv"] {
        fs::copy(fixtures().join("small/tet4").join(name), place.join(name)).expect("copied");
    }
    let table = read(&place.join("nodes.csv"));
    assert_eq!(table.data.mesh, None);
    let deck = |scale: f64, first: i64| {
        let mut deck = "*NODE\n".to_owned();
        for (id, x) in table.nodes.ids.iter().zip(&table.nodes.positions) {
            let [x, y, z] = x.map(|x| scale * x);
            deck += &format!("{id}, {x:.6e}, {y:.6e}, {z:.6e}\n");
        }
        let [_, b, c, d] = table.nodes.ids[..] else { panic!("four nodes") };
        deck + &format!("*ELEMENT, TYPE=C3D4\n1, {first}, {b}, {c}, {d}\n")
    };
    let first = table.nodes.ids[0];
    let manifest = place.join("model.toml");
    let files =
        "[files]\nstiffness = \"K.mtx\"\nmass = \"M.mtx\"\nnodes = \"nodes.csv\"\ndofs = \"dofs.csv\"\n";
    fs::write(&manifest, format!("{files}mesh = \"part.inp\"\n")).expect("written");
    fs::write(place.join("part.inp"), deck(1.0, first)).expect("written");
    let model = |manifest: &Path| read_model(&read_manifest(manifest).expect("a manifest"));
    let raw = model(&manifest).expect("a model");
    assert_eq!(raw.data.mesh.as_ref().map(|mesh| mesh.triangles().len()), Some(4));
    assert!(
        raw.data
            .sources
            .iter()
            .any(|source| (source.role.as_str(), source.name.as_str()) == ("mesh", "part.inp"))
    );
    for (text, part) in [
        (deck(1000.0, first), "of the mesh lies at"),
        (deck(1.0, 4711), "no element of the mesh has all of its nodes"),
        ("*NODE\n1, 0, 0, 0\n".to_owned(), "no elements"),
    ] {
        fs::write(place.join("part.inp"), text).expect("written");
        let error = model(&manifest).expect_err(part);
        assert!(error.has(Code::MeshForeign) && error.to_string().contains(part), "{error}");
    }
}

fn body(raw: RawModel, mesh: MeshChoice) -> FlexBody {
    let model = FeModel::from_raw(raw).unwrap_or_else(|error| panic!("{error}")).model;
    let modes = ModeSettings { wanted: Wanted::Lowest(4), ..ModeSettings::default() };
    convert(&model, &ConvertSettings { modes, mesh, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("a body")
        .body
}

/// The body has the requested surface of its model on the nodes that move, in the body frame; a body with
/// fewer modes has it too.
#[test]
fn bodies_have_the_surface_that_is_asked_for() {
    let whole = body(job("abaqus_labels"), MeshChoice::Whole);
    let mesh = whole.mesh().expect("a surface");
    assert_closed(mesh);
    let (volume, _) = volume_and_area(mesh.triangles(), &whole.nodes().positions);
    assert!((volume / (0.2 * 0.08 * 0.06) - 1.0).abs() < 1e-12, "{volume}");
    let fewer = body(job("abaqus_labels"), MeshChoice::AtMost(12));
    assert!((1..=12).contains(&fewer.mesh().expect("a surface").triangles().len()));
    assert_eq!(body(job("abaqus_labels"), MeshChoice::Without).mesh(), None);
    let reduced = whole.reduced(&[0, 2], whole.groups(), Vec::new()).expect("a body");
    assert_eq!(reduced.mesh(), whole.mesh());
}

/// Nodes without degrees of freedom do not belong to the body: triangles at them are dropped with a message.
#[test]
fn triangles_at_nodes_without_rows_are_told() {
    // The four nodes at the left end are rigidly attached to a reference node and have no rows in CalculiX.
    let checked = FeModel::from_raw(job("calculix")).expect("a model");
    assert_eq!(checked.model.mesh().map(|mesh| mesh.triangles().len()), Some(10));
    let told = checked.diagnostics.iter().find(|found| found.code() == Code::MeshPartial).expect("told");
    assert!(told.message().starts_with("10 of 20 triangles"), "{}", told.message());
}
