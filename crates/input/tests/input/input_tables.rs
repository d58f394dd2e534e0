//! Manifest, tables and whole models.

use flexbody_base::diagnostic::{Code, Severity};
use flexbody_base::error::Result;
use flexbody_input::{InterfaceNodes, MatrixLocation, ModelFiles, read_manifest, read_model};
use flexbody_model::{DofLabel, RawModel};
use std::fmt::Write;
use std::path::PathBuf;

const K: &str = "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 1\n2 1 -1\n2 2 1\n";

fn tet4() -> PathBuf {
    oracle::fixtures().join("small/tet4")
}

/// Writes a model with these tables and reads it.
fn read(nodes: impl AsRef<[u8]>, dofs: Option<&str>, dimension: u8) -> Result<RawModel> {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("K.mtx"), K).unwrap();
    std::fs::write(path("nodes.csv"), nodes).unwrap();
    if let Some(dofs) = dofs {
        std::fs::write(path("dofs.csv"), dofs).unwrap();
    }
    let dofs = dofs.map(|_| path("dofs.csv"));
    let mut files = ModelFiles::from_arguments(path("K.mtx"), path("K.mtx"), path("nodes.csv"), dofs, None)?;
    files.dimension = dimension;
    read_model(&files)
}

fn manifest(text: &str) -> Result<ModelFiles> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.toml");
    std::fs::write(&path, text).unwrap();
    read_manifest(&path)
}

#[test]
fn node_tables_in_every_dialect_mean_the_same() {
    let expected =
        (vec![7, -2, 1_000_000_000_000], vec![[0.0, 0.5, -1e-3], [1.0, 2.0, 3.0], [0.0, 0.0, 1e3]]);
    for text in [
        "node,x,y,z\n7,0,0.5,-1e-3\n-2,1,2,3\n1000000000000,0,0,1000\n",
        "\u{feff}# nodes of the beam\r\n\r\n NODE ; X ; Y ; Z \r\n7;0;.5;-0.001\r\n# c\r\n-2;1;2;3\r\n\r\n1000000000000;0;0;1E3\r\n",
        "node\tx\ty\tz\n7\t0\t0.5\t-0.001\n-2\t1.0\t2\t3\n1000000000000\t0\t0\t1000\n",
        "node x y z\n  7   0 0.5   -0.001\n-2 1 2 3\n1000000000000 0 0 1000\n",
        "\"x\",\"node\",\"z\",\"y\"\n0,7,-0.001,0.5\n1,-2.0,3,2\n0,1.000000000000e+12,+1000,0\n",
    ] {
        let nodes = read(text, None, 3).unwrap_or_else(|e| panic!("{text}\n{e}")).nodes;
        assert_eq!((nodes.ids, nodes.positions), expected, "{text}");
        // Less its last line end, or its last digit as well, the table may be cut off.
        let whole = text.trim_end();
        for cut in [whole, &whole[..whole.len() - 1]] {
            assert!(read(cut, None, 3).unwrap_err().has(Code::TableRow), "{cut}");
        }
    }
}

#[test]
fn plane_models_need_no_z() {
    for text in ["node,x,y\n1,2,3\n", "node,x,y,z\n1,2,3,0\n"] {
        assert_eq!(read(text, None, 2).unwrap().nodes.positions, [[2.0, 3.0, 0.0]]);
    }
    assert!(read("node,x,y,z\n1,2,3,1e-9\n", None, 2).unwrap_err().has(Code::TableRow));
    assert!(read("node,x,y\n1,2,3\n", None, 3).unwrap_err().has(Code::TableHeader));
}

#[test]
fn dof_rows_are_put_into_the_order_of_their_numbers() {
    let nodes = "node,x,y,z\n1,0,0,0\n";
    let label = |node, direction| DofLabel { node, direction };
    let model = read(nodes, Some("row,node,dir\n2,9,6\n0,1,3\n1,1,1\n"), 3).unwrap();
    assert_eq!(model.dofs.unwrap(), [label(1, 3), label(1, 1), label(9, 6)]);
    let model = read(nodes, Some("node,dir\n9,6\n1,3\n"), 3).unwrap();
    assert_eq!(model.dofs.unwrap(), [label(9, 6), label(1, 3)]);
    for bad in ["row,node,dir\n0,1,1\n2,1,2\n", "row,node,dir\n0,1,1\n0,1,2\n", "row,node,dir\n-1,1,1\n"] {
        assert!(read(nodes, Some(bad), 3).unwrap_err().has(Code::DofRowOrder), "{bad}");
    }
}

#[test]
fn numbers_may_have_exponents_of_fortran_and_fields_may_have_quotes() {
    let model = read("\"node\" \"x\" y z\n1 1.5D+01 \" 2d0\" -3E0\n", None, 3).unwrap();
    assert_eq!(model.nodes.positions, [[15.0, 2.0, -3.0]]);
}

#[test]
fn bad_rows_are_shown_five_times_and_counted() {
    let mut text = "node,x,y,z\n".to_owned();
    for i in 0..100 {
        writeln!(text, "{i},0,0{}", if i % 2 == 0 { ",0" } else { "" }).unwrap();
    }
    let error = read(text, None, 3).unwrap_err();
    let lines: Vec<_> = error.diagnostics().iter().map(|d| d.line()).collect();
    assert_eq!(lines, [Some(3), Some(5), Some(7), Some(9), Some(11), Some(13)]);
    assert!(error.to_string().contains("45 more rows"), "{error}");
}

#[test]
fn three_hundred_thousand_nodes_are_no_trouble() {
    let mut text = "node,x,y,z\n".to_owned();
    for i in (0..300_000).rev() {
        writeln!(text, "{i},{}.25,0,0", i % 1000).unwrap();
    }
    let nodes = read(&text, None, 3).unwrap().nodes;
    assert_eq!((nodes.len(), nodes.ids[0], nodes.positions[1]), (300_000, 299_999, [998.25, 0.0, 0.0]));
}

#[test]
fn a_manifest_says_everything() {
    let files = manifest(
        r#"
[model]
name = "beam"
dimension = 2
[model.units]
length = "mm"
mass = 1000
time = 1e-3
[files]
stiffness = "matrices.h5:/fe/K"
mass = "/tmp/M.mtx"
nodes = "sub/nodes.csv"
[[interface]]
name = "left"
nodes = [3, 0x10, -1]
[[interface]]
name = "right"
nodes_file = "right.csv"
"#,
    )
    .unwrap();
    let folder = files.manifest.as_ref().unwrap().parent().unwrap().to_path_buf();
    let tables = files.tables().expect("tables");
    assert_eq!((files.description.name.as_str(), files.dimension, &tables.dofs), ("beam", 2, &None));
    let units = &files.description.units;
    assert_eq!((units.length.to_si(), units.mass.to_si(), units.time.to_si()), (1e-3, 1000.0, 1e-3));
    assert_eq!((units.mass.name(), units.time.name(), units.stated), ("1000", "1e-3", true));
    assert_eq!(
        tables.stiffness,
        MatrixLocation { path: folder.join("matrices.h5"), group: Some("/fe/K".into()) }
    );
    assert_eq!(tables.mass, MatrixLocation { path: "/tmp/M.mtx".into(), group: None });
    assert_eq!(tables.nodes, folder.join("sub/nodes.csv"));
    assert_eq!(files.interfaces[0].nodes, InterfaceNodes::Listed(vec![3, 16, -1]));
    assert_eq!(files.interfaces[1].nodes, InterfaceNodes::File(folder.join("right.csv")));
}

#[test]
fn the_manifest_of_the_documentation_is_in_order() {
    let docs = include_str!("../../../../docs/reference/input.md");
    let example = docs
        .split("```toml manifest\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .expect("an example");
    let files = manifest(example).unwrap();
    assert_eq!(
        (files.description.name.as_str(), files.description.units.mass.to_si(), files.interfaces.len()),
        ("conrod", 1000.0, 2)
    );
    let docs = include_str!("../../../../docs/how_to/from_fe_programs.md");
    let example = docs
        .split("```toml manifest\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .expect("an example");
    assert_eq!(manifest(example).unwrap().interfaces.len(), 5);
}

#[test]
fn a_manifest_may_say_little() {
    let files = manifest("files = { stiffness = 'K.mtx', mass = 'M.mtx', nodes = 'n.csv' }").unwrap();
    assert_eq!(
        (files.description.name.as_str(), files.dimension, files.description.units.stated),
        ("model", 3, false)
    );
    assert!(files.interfaces.is_empty());
}

#[test]
fn a_manifest_nested_without_end_is_refused() {
    for open in ["[", "{a="] {
        let text = format!("files = {}", open.repeat(100_000));
        assert!(manifest(&text).unwrap_err().has(Code::ManifestSyntax), "{open}");
    }
}

/// Manifest texts, and true for valid ones.
const MANIFESTS: &[(&str, bool)] = &[
    ("[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", true),
    ("[model]\nname='b'\ndimension=2\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\ndofs='d'\n", true),
    ("[model.units]\nlength='mm'\nmass='t'\ntime=1e-3\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", true),
    (
        "[model.units]\nlength='0.5'\nmass='slinch'\ntime=1\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        true,
    ),
    (
        "interface=[{name='a',nodes=[1]},{name='b',nodes_file='f'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        true,
    ),
    (
        "geometric_stiffness=[{file='g',spin='xz'},{file='g',load='bolts'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        true,
    ),
    (
        "geometric_stiffness=[{file='g.h5:/Kg',force='x',interface='a'},{file='g',angular_acceleration='z'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        true,
    ),
    (
        "geometric_stiffness=[{with_stress='g.sti',spin='xz'},{with_stress='g',load_size=2e5,load='bolts'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        true,
    ),
    (
        "geometric_stiffness=[{with_stress='g',file='g',spin='xx'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        false,
    ),
    (
        "geometric_stiffness=[{file='g',load_size=2,spin='xx'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        false,
    ),
    (
        "geometric_stiffness=[{with_stress='g',load_size=0,spin='xx'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        false,
    ),
    (
        "basis={residual_vectors=['centrifugal','interfaces'],loads='f.npy'}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        true,
    ),
    ("basis={}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", true),
    (
        "damping={bands=[{to_hz=10,ratio=0.1},{ratio=0.2}]}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        true,
    ),
    ("damping={rayleigh={alpha=0,beta=1e-6}}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", true),
    ("", false),
    ("[files]\nstiffness='K'\nmass='M'\n", false),
    ("[files]\nstiffness=''\nmass='M'\nnodes='n'\n", false),
    ("[files]\nstiffness=1\nmass='M'\nnodes='n'\n", false),
    ("title=''\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("[model]\ndimension=4\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("[model]\nversion=1\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("[model.units]\nlength='mm'\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("[model.units]\nlength='yd'\nmass='kg'\ntime='s'\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("[model.units]\nlength=-1\nmass='kg'\ntime='s'\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("interface=[{name='a'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("interface=[{nodes=[1]}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("interface=[{name='a',nodes=[1],nodes_file='f'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("interface=[{name='a',nodes=[]}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("interface=[{name='a',nodes=[1,1]}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("interface=[{name='a',nodes=[1.5]}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("interface={name='a',nodes=[1]}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("geometric_stiffness=[{file='g'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("geometric_stiffness=[{spin='xx'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("geometric_stiffness=[{file='g',spin='x'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    (
        "geometric_stiffness=[{file='g',acceleration='xx'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        false,
    ),
    (
        "geometric_stiffness=[{file='g',spin='xx',load='a'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        false,
    ),
    ("geometric_stiffness=[{file='g',force='x'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    (
        "geometric_stiffness=[{file='g',spin='xx',interface='a'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        false,
    ),
    ("geometric_stiffness=[{file='g',load=''}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("geometric_stiffness={file='g',spin='xx'}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("geometric_stiffness=[1]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("basis={residual_vectors='centrifugal'}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("basis={residual_vectors=['gravity']}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    (
        "basis={residual_vectors=['interfaces','interfaces']}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n",
        false,
    ),
    ("basis={residual_vectors=[1]}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("basis={loads=''}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("basis={modes=3}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("basis=1\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("elements=[{file='d.inp'}]\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", true),
    (
        "elements=[{file='m.msh',set='s',kind='C3D10',youngs_modulus=2,poisson_ratio=0.3}]\n[files]\njob='j'\n",
        true,
    ),
    (
        "elements=[{file='m.msh',elasticity=[3,1,3,1,1,3,0,0,0,1,0,0,0,0,1,0,0,0,0,0,1]}]\n[files]\njob='j'\n",
        true,
    ),
    ("elements=[{file='m.msh',elasticity=[3,1,3,1,1,3]}]\n[files]\njob='j'\n", false),
    ("elements=[{file='m.msh',youngs_modulus=2}]\n[files]\njob='j'\n", false),
    ("elements=[{file='m.msh',youngs_modulus=2,poisson_ratio=0.5}]\n[files]\njob='j'\n", false),
    (
        "elements=[{file='m',youngs_modulus=2,poisson_ratio=0.3,elasticity=[3,1,3,1,1,3,0,0,0,1,0,0,0,0,1,0,0,0,0,0,1]}]\n[files]\njob='j'\n",
        false,
    ),
    ("elements=[{set='s'}]\n[files]\njob='j'\n", false),
    ("elements=[{file='m',sets='s'}]\n[files]\njob='j'\n", false),
    ("elements={file='m'}\n[files]\njob='j'\n", false),
    ("damping={ratio=3}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", true),
    ("damping={ratio=-0.1}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("damping={}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
    ("damping={ratio=0.1,matrix='D'}\n[files]\nstiffness='K'\nmass='M'\nnodes='n'\n", false),
];

#[test]
fn the_schema_and_the_reader_agree() {
    let schema: serde_json::Value =
        serde_json::from_str(include_str!("../../../../schemas/manifest.schema.json")).unwrap();
    let schema = jsonschema::validator_for(&schema).unwrap();
    for (text, good) in MANIFESTS {
        let document: toml::Table = text.parse().unwrap();
        assert_eq!(schema.is_valid(&serde_json::to_value(document).unwrap()), *good, "schema on\n{text}");
        assert_eq!(manifest(text).is_ok(), *good, "reader on\n{text}");
    }
}

#[test]
fn a_whole_model_is_read_with_its_fingerprints() {
    let path = |name: &str| tet4().join(name);
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("base.csv");
    std::fs::write(&list, "node\n30\n10\n").unwrap();
    let mut files = ModelFiles::from_arguments(
        path("K.mtx"),
        path("M.mtx"),
        path("nodes.csv"),
        Some(path("dofs.csv")),
        None,
    )
    .unwrap();
    let interface = |name: &str, nodes| flexbody_input::InterfaceSource {
        name: name.into(),
        nodes,
        coupling: None,
        reference: flexbody_model::Reference::Centre,
    };
    files.interfaces = vec![
        interface("tip", InterfaceNodes::Listed(vec![40])),
        interface("base", InterfaceNodes::File(list)),
    ];
    let model = read_model(&files).unwrap();
    assert_eq!((model.stiffness.matrix.n_rows(), model.mass.matrix.n_rows(), model.nodes.len()), (12, 12, 4));
    assert_eq!(model.data.interfaces[1].nodes, [30, 10]);
    assert!(model.diagnostics.is_empty(), "{:?}", model.diagnostics);
    let of = |role: &str| model.data.sources.iter().find(|s| s.role == role).expect(role);
    let roles: Vec<&str> = model.data.sources.iter().map(|s| s.role.as_str()).collect();
    assert_eq!(roles, ["stiffness", "mass", "nodes", "dofs", "interface"]);
    assert_eq!(of("nodes").name, "nodes.csv");
    let bytes = std::fs::read(path("K.mtx")).unwrap();
    assert_eq!(of("stiffness").sha256, flexbody_base::provenance::sha256_hex(&bytes));
    // The empty message of FIPS 180-4.
    assert!(flexbody_base::provenance::sha256_hex(b"").starts_with("e3b0c44298fc1c14"));
}

#[test]
fn one_file_in_two_roles_is_fingerprinted_in_both_and_blamed_once() {
    let folder = oracle::fixtures().join("readers/hdf5");
    let both = folder.join("stiffness_and_mass.h5");
    let files = ModelFiles::from_arguments(&both, &both, tet4().join("nodes.csv"), None, None).unwrap();
    let model = read_model(&files).unwrap();
    assert_ne!(model.stiffness.matrix, model.mass.matrix);
    assert_eq!(model.data.sources[0].sha256, model.data.sources[1].sha256);

    let missing = folder.join("missing.h5");
    let files = ModelFiles::from_arguments(&missing, &missing, tet4().join("nodes.csv"), None, None).unwrap();
    assert_eq!(read_model(&files).unwrap_err().diagnostics().len(), 1);
}

#[test]
fn all_that_is_wrong_with_all_files_is_reported_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let files = ModelFiles::from_arguments(
        write("K.mtx", &K.replace("-1", "nan")),
        write("M.mtx", &K.replace("2 2 3", "2 2 4")),
        write("nodes.csv", "node,x,y,z\n1,0,0,zero\n"),
        Some(write("dofs.csv", "node,dir\n1,9\n")),
        None,
    )
    .unwrap();
    let error = read_model(&files).unwrap_err();
    let codes: Vec<Code> = error.diagnostics().iter().map(|d| d.code()).collect();
    assert_eq!(codes, [Code::MatrixNotFinite, Code::MatrixCount, Code::TableRow, Code::DofDirection]);
    assert!(error.diagnostics().iter().all(|d| d.severity() == Severity::Error && d.file().is_some()));
}

/// A pipe would wait for its writer.
#[cfg(unix)]
#[test]
fn devices_are_refused() {
    let files =
        ModelFiles::from_arguments("/dev/null", "/dev/zero", tet4().join("nodes.csv"), None, None).unwrap();
    let error = read_model(&files).unwrap_err();
    assert_eq!(error.diagnostics().len(), 2);
    assert!(error.diagnostics().iter().all(|d| d.code() == Code::FileUnreadable));
}
