//! Real finite element models from disk, with a separate reader for compressed Matrix Market and the two tables.

use flexbody_linalg::SymmetricMatrix;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Solid body as the finite element program wrote it, in node-major order.
pub struct Model {
    pub name: String,
    pub positions: Vec<[f64; 3]>,
    /// Every entry of M (3n x 3n), both triangles.
    pub mass: Vec<(usize, usize, f64)>,
    /// Scalar mass matrix Ms, from the entries of the first direction.
    pub scalar_mass: SymmetricMatrix,
    /// Reference numbers in the folder of the matrices.
    pub reference: serde_json::Value,
    folder: PathBuf,
    /// Node-major index of each stored matrix row.
    rows: Vec<usize>,
}

impl Model {
    /// Reads a folder with M.mtx.gz, nodes.csv, dofs.csv and a file of reference numbers.
    pub fn read(folder: &Path, reference: &str) -> Self {
        let nodes = table(&folder.join("nodes.csv"));
        let dofs = table(&folder.join("dofs.csv"));
        // The row number before the label is optional.
        let label = |dof: &[f64]| (dof[dof.len() - 2], dof[dof.len() - 1] as usize);
        let index = |id: f64| nodes.iter().position(|row| row[0] == id).expect("every label names a node");
        let mut last = (f64::NAN, 0);
        let mut rows = Vec::new();
        for dof in &dofs {
            let (node, direction) = label(dof);
            if node != last.0 {
                last = (node, index(node));
            }
            rows.push(3 * last.1 + direction - 1);
        }
        assert_eq!(rows.len(), 3 * nodes.len(), "a solid has three directions at every node");
        let mass = assembled(&folder.join("M.mtx.gz"), &rows);
        let first: Vec<(u32, u32, f64)> = mass
            .iter()
            .filter(|(i, j, _)| i % 3 == 0 && j % 3 == 0)
            .map(|&(i, j, value)| (i as u32 / 3, j as u32 / 3, value))
            .collect();
        assert!(mass.iter().all(|(i, j, _)| i % 3 == j % 3), "directions do not mix");
        let text = std::fs::read_to_string(folder.join(reference)).expect("reference");
        Self {
            name: folder.file_name().expect("a folder").to_string_lossy().into_owned(),
            positions: nodes.iter().map(|row| [row[1], row[2], row[3]]).collect(),
            mass,
            scalar_mass: symmetric(nodes.len(), &first),
            reference: serde_json::from_str(&text).expect("JSON"),
            folder: folder.to_path_buf(),
            rows,
        }
    }

    /// Returns K (3n x 3n), in node-major order.
    pub fn stiffness(&self) -> SymmetricMatrix {
        let both = assembled(&self.folder.join("K.mtx.gz"), &self.rows);
        let triplets: Vec<_> = both.iter().map(|&(i, j, value)| (i as u32, j as u32, value)).collect();
        symmetric(self.rows.len(), &triplets)
    }
}

/// Returns the entries of both triangles of a stored matrix, with renumbered rows.
fn assembled(path: &Path, rows: &[usize]) -> Vec<(usize, usize, f64)> {
    let mut entries = Vec::new();
    for (i, j, value) in matrix_market(path) {
        entries.push((rows[i], rows[j], value));
        if i != j {
            entries.push((rows[j], rows[i], value));
        }
    }
    entries
}

/// Returns a symmetric matrix from the entries of both triangles.
pub fn symmetric(n: usize, triplets: &[(u32, u32, f64)]) -> SymmetricMatrix {
    SymmetricMatrix::new(flexbody_linalg::CscMatrix::from_triplets(n, n, triplets)).expect("symmetric")
}

/// Returns the four solid bodies of the fixtures.
pub fn own() -> Vec<Model> {
    let folder = crate::fixtures().join("models");
    ["bar_c3d8r", "bracket_hex20", "connecting_rod", "cube_hex8"]
        .iter()
        .map(|name| Model::read(&folder.join(name), "expected.json"))
        .collect()
}

/// Returns larger solid bodies from the shared folder; none if the folder is missing.
pub fn shared() -> Vec<Model> {
    let root = crate::shared();
    ["a_beam_c3d20", "b_conrod_30k", "e_bracket_near", "f_cube_c3d8", "g_two_1e6", "k_c3d8r_singularM"]
        .iter()
        .map(|name| root.join("models").join(name))
        .filter(|folder| folder.is_dir())
        .map(|folder| Model::read(&folder, "ref.json"))
        .collect()
}

/// Returns the numbers of a CSV file, without its header.
fn table(path: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).expect("table");
    let row = |line: &str| line.split(',').map(|field| field.trim().parse().expect("number")).collect();
    text.lines().skip(1).filter(|line| !line.trim().is_empty()).map(row).collect()
}

/// Returns the entries (from 0) of a compressed symmetric Matrix Market file, as stored: one triangle.
fn matrix_market(path: &Path) -> Vec<(usize, usize, f64)> {
    let mut text = String::new();
    let file = std::fs::File::open(path).expect("matrix");
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).expect("gzip");
    assert!(text.lines().next().expect("banner").ends_with("symmetric"));
    let mut lines = text.lines().filter(|line| !line.starts_with('%')).skip(1);
    let entry = |line: &str| {
        let mut fields = line.split_whitespace();
        let mut index = || fields.next().expect("index").parse::<usize>().expect("index") - 1;
        (index(), index(), fields.next().expect("value").parse().expect("value"))
    };
    lines.by_ref().map(entry).collect()
}
