//! Matrices and stresses of single elements beside those of CalculiX 2.20 (fixtures/make/make_element_matrices.py).

use flexbody_elements::{Axes, Elasticity, Formulation, Section};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// One element as CalculiX computed it.
struct Case {
    name: String,
    kind: String,
    section: Section,
    x: Vec<[f64; 3]>,
    sections: BTreeMap<String, Vec<Vec<f64>>>,
}

impl Case {
    fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).expect("a readable file");
        let mut lines = text.lines().skip(1);
        let mut sections = BTreeMap::new();
        while let Some(title) = lines.next() {
            let (key, count) = title.split_once(' ').expect("name and number of rows");
            let rows = (0..count.parse().expect("a number"))
                .map(|_| {
                    lines.next().expect("a row").split_whitespace().map(|v| v.parse().expect("a number"))
                })
                .map(Iterator::collect)
                .collect::<Vec<Vec<f64>>>();
            sections.insert(key.to_owned(), rows);
        }
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let kind = sections.keys().find(|key| key.starts_with("C3D")).expect("a type").clone();
        let x = triples(&sections["nodes"]);
        Self { section: section(&sections), name, kind, x, sections }
    }

    fn formulation(&self) -> Formulation {
        Formulation::candidates(&self.kind, self.x.len())[0]
    }

    /// Returns a matrix of its upper triangle.
    fn matrix(&self, key: &str) -> DMatrix<f64> {
        let rows = &self.sections[key];
        DMatrix::from_fn(rows.len(), rows.len(), |i, j| rows[i.min(j)][i.max(j) - i.min(j)])
    }

    fn stiffness(&self) -> DMatrix<f64> {
        let values = self.formulation().stiffness(&self.x, &self.section).expect("an element");
        square(&values)
    }

    /// Returns the displacements of the nodes, and those of the internal nodes that have no forces.
    fn displacements(&self) -> Vec<[f64; 3]> {
        let mut u = triples(&self.sections["displacements"]);
        let (outer, inner) = (3 * self.formulation().n_nodes(), 3 * self.formulation().n_internal());
        if inner > 0 {
            let stiffness = self.stiffness();
            let known = DVector::from_iterator(outer, u.iter().flatten().copied());
            let load = -(stiffness.view((outer, 0), (inner, outer)) * known);
            let solved = stiffness.view((outer, outer), (inner, inner)).into_owned().lu().solve(&load);
            u.extend(solved.expect("stiff internal nodes").as_slice().chunks(3).map(|u| [u[0], u[1], u[2]]));
        }
        u
    }
}

fn section(sections: &BTreeMap<String, Vec<Vec<f64>>>) -> Section {
    let elasticity = match (sections.get("isotropic"), sections.get("constants")) {
        (Some(rows), None) => Elasticity::isotropic(rows[0][0], rows[0][1]),
        (None, Some(rows)) => {
            let triple = |at: usize| [rows[0][at], rows[0][at + 1], rows[0][at + 2]];
            Elasticity::orthotropic_constants(triple(0), triple(3), triple(6))
        }
        _ => None,
    };
    let points = |key: &str| {
        let row = &sections.get(key)?[0];
        Some((Vector3::from_column_slice(&row[..3]), Vector3::from_column_slice(&row[3..])))
    };
    let axes = if let Some((first, second)) = points("rectangular") {
        let first = first.normalize();
        let third = first.cross(&second).normalize();
        Axes::Fixed(Matrix3::from_columns(&[first, third.cross(&first), third]))
    } else if let Some((from, to)) = points("cylindrical") {
        Axes::Cylinder { from, to }
    } else {
        Axes::Model
    };
    Section { material: "M".to_owned(), elasticity: elasticity.expect("a material"), axes }
}

fn triples(rows: &[Vec<f64>]) -> Vec<[f64; 3]> {
    rows.iter().map(|row| [row[0], row[1], row[2]]).collect()
}

fn square(values: &[f64]) -> DMatrix<f64> {
    let size = values.len().isqrt();
    DMatrix::from_row_slice(size, size, values)
}

fn cases() -> Vec<Case> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let mut paths: Vec<PathBuf> =
        folder.read_dir().expect("a folder").map(|entry| entry.expect("a file").path()).collect();
    paths.sort();
    paths.iter().map(|path| Case::read(path)).collect()
}

/// Returns the largest difference, by the sum of magnitudes of its row.
fn row_error(found: &DMatrix<f64>, expected: &DMatrix<f64>) -> f64 {
    assert_eq!(found.shape(), expected.shape());
    let sums = expected.row_iter().map(|row| row.iter().map(|value| value.abs()).sum::<f64>());
    let errors = (found - expected).row_iter().map(|row| row.amax()).collect::<Vec<_>>();
    sums.zip(errors).map(|(sum, error)| error / sum).fold(0.0, f64::max)
}

/// Returns the largest difference of stresses, by the largest stress.
fn stress_error(found: &[[f64; 6]], expected: &[Vec<f64>]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let size = expected.iter().flatten().fold(0.0_f64, |size, value| size.max(value.abs()));
    let differences = found.iter().flatten().zip(expected.iter().flatten());
    differences.map(|(a, b)| (a - b).abs() / size).fold(0.0, f64::max)
}

#[test]
fn the_stiffness_is_that_of_calculix() {
    let cases = cases();
    assert!(cases.len() >= 20);
    for case in cases {
        let error = row_error(&case.stiffness(), &case.matrix("stiffness"));
        println!("{:16} {error:.1e}", case.name);
        assert!(error < 1e-13, "{}: {error:e}", case.name);
    }
}

#[test]
fn stresses_at_points_and_nodes_are_those_of_calculix() {
    for case in cases() {
        let formulation = case.formulation();
        let stresses =
            formulation.stresses(&case.x, &case.displacements(), &case.section).expect("an element");
        let points = stress_error(&stresses, &case.sections["stresses"]);
        let nodal: Vec<[f64; 6]> = formulation
            .nodal_extrapolation()
            .iter()
            .map(|weights| {
                std::array::from_fn(|k| weights.iter().zip(&stresses).map(|(w, s)| w * s[k]).sum())
            })
            .collect();
        let nodes = stress_error(&nodal, &case.sections["nodal_stresses"]);
        println!("{:16} points {points:.1e} nodes {nodes:.1e}", case.name);
        assert!(points < 1e-6, "{}: {points:e}", case.name);
        // CalculiX has factors of three to six digits, and exchanges nodes of C3D6.
        assert!(nodes < 3e-5 || case.kind == "C3D6", "{}: {nodes:e}", case.name);
    }
}

#[test]
fn calculix_exchanges_the_triangles_of_nodes_of_c3d6() {
    for case in cases().iter().filter(|case| case.kind == "C3D6") {
        let points = &case.sections["stresses"];
        // Positions of three Gauss points for the two that there are; lower and upper triangle in turn.
        let near = 0.5 + 0.5 / 0.6_f64.sqrt();
        let written: Vec<[f64; 6]> = (0..6)
            .map(|n| std::array::from_fn(|k| near * points[n % 2][k] + (1.0 - near) * points[1 - n % 2][k]))
            .collect();
        assert!(stress_error(&written, &case.sections["nodal_stresses"]) < 3e-5);
    }
}

#[test]
fn the_geometric_stiffness_is_that_of_calculix() {
    for case in cases() {
        let stresses: Vec<[f64; 6]> =
            case.sections["initial_stresses"].iter().map(|row| std::array::from_fn(|k| row[k])).collect();
        let scalar = square(&case.formulation().geometric_stiffness(&case.x, &stresses).expect("an element"));
        let found = scalar.kronecker(&DMatrix::identity(3, 3));
        let expected = case.matrix("with_stress") - case.matrix("stiffness");
        let error = row_error(&found, &expected);
        println!("{:16} {error:.1e}", case.name);
        assert!(error < 1e-12, "{}: {error:e}", case.name);
    }
}
