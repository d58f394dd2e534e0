//! Rows without coordinates that carry mass: displacements of bubbles are taken, amplitudes of condensed models refused.

use flexbody_base::diagnostic::Code;
use flexbody_linalg::CscMatrix;
use flexbody_model::{DofLabel, FeModel, RawModel};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, entries};

/// Returns a block with three rows of a node 900 without coordinates, which follow the difference of the displacements of
/// two nodes by a stiffness, as an amplitude of incompatible displacements does. `shared` gives the entry of M for the row k of the internal vector and the direction l of a node.
fn block(shared: impl Fn(usize, usize, usize) -> f64) -> RawModel {
    let plain = Mesh::block(ElementKind::Hex8, [2, 1, 1], [0.2, 0.1, 0.1])
        .assemble(&Material::STEEL, MassRule::Consistent)
        .raw_model();
    let n = plain.stiffness.matrix.n_rows();
    let mean = |matrix: &CscMatrix| (0..n).map(|i| matrix.get(i, i)).sum::<f64>() / n as f64;
    let (k, m) = (mean(&plain.stiffness.matrix), mean(&plain.mass.matrix));
    let own = |matrix: &CscMatrix, size: f64| {
        let mut all: Vec<(u32, u32, f64)> = entries(matrix).collect();
        all.extend((0..3).map(|axis| ((n + axis) as u32, (n + axis) as u32, size)));
        all
    };
    let mut stiffness = own(&plain.stiffness.matrix, k);
    for axis in 0..3 {
        let terms = [(n + axis, 1.0), (axis, -1.0), (3 + axis, 1.0)];
        for (i, (row, x)) in terms.iter().enumerate() {
            let others = terms.iter().enumerate().filter(|(j, _)| (i, *j) != (0, 0));
            stiffness.extend(others.map(|(_, (column, y))| (*row as u32, *column as u32, k * x * y)));
        }
    }
    let stiffness = CscMatrix::from_triplets(n + 3, n + 3, &stiffness);
    let mut mass = own(&plain.mass.matrix, m);
    for axis in 0..3 {
        for column in 0..n {
            let value = 0.05 * m * shared(column / 3, axis, column % 3);
            let (row, column) = ((n + axis) as u32, column as u32);
            mass.extend([(row, column, value), (column, row, value)]);
        }
    }
    let mass = CscMatrix::from_triplets(n + 3, n + 3, &mass);
    let nodes = plain.nodes.ids.iter().chain(&[900]);
    let labels = nodes.flat_map(|&node| (1..=3).map(move |direction| DofLabel { node, direction }));
    RawModel {
        dofs: Some(labels.collect()),
        // The mass couples what the stiffness does not.
        allow_implausible: true.into(),
        ..RawModel::in_memory("block", stiffness, mass, plain.nodes.clone())
    }
}

fn is_one(k: usize, l: usize) -> f64 {
    f64::from(u8::from(k == l))
}

#[test]
fn displacements_inside_an_element_turn_with_the_body() {
    // Another multiple of the identity for each node.
    let model = FeModel::from_raw(block(|node, k, l| (1.0 + node as f64) * is_one(k, l)));
    assert!(model.is_ok(), "{:?}", model.err());
}

#[test]
fn amplitudes_of_a_condensed_model_are_refused() {
    let amplitudes: [fn(usize, usize, usize) -> f64; 3] = [
        // Participation in one direction; in the directions exchanged; in rotations alone.
        |_, k, l| if k == 0 { is_one(k, l) } else { 0.0 },
        |node, k, l| node as f64 * is_one((k + 1) % 3, l),
        |node, k, l| if node < 2 { [1.0, -1.0][node] * is_one((k + 1) % 3, l) } else { 0.0 },
    ];
    for (number, shared) in amplitudes.into_iter().enumerate() {
        let error = FeModel::from_raw(block(shared)).expect_err("amplitudes are no displacements");
        assert!(error.has(Code::MassDirectional), "{number}: {error}");
        assert!(error.to_string().contains("rows of 900 have no coordinates"), "{number}: {error}");
    }
}
