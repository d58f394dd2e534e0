//! Proof of elements by an assembled stiffness, and the stress stiffness and stresses of proved elements.

use faer::Mat;
use flexbody_elements::{
    Axes, DescribedElements, Elasticity, ElementGroup, Equation, Formulation, NodeDirection, NodeStiffness,
    NotDescribed, ProvedElements, Refusal, Section, prove,
};
use flexbody_linalg::{CscMatrix, SymmetricMatrix};
use std::collections::BTreeMap;

const STEEL: (f64, f64) = (210e3, 0.3);
const BRASS: (f64, f64) = (100e3, 0.35);

fn section(material: &str, (youngs, poisson): (f64, f64)) -> Section {
    let elasticity = Elasticity::isotropic(youngs, poisson).expect("a material");
    Section { material: material.to_owned(), elasticity, axes: Axes::Model }
}

/// A row of skewed bricks along x, every second one of brass.
fn bricks(kind: &str, count: usize) -> DescribedElements {
    let node = |i: usize, j: usize, k: usize| 10 * (4 * i + 2 * j + k + 1) as i64;
    let mut positions = BTreeMap::new();
    for i in 0..=count {
        for (j, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let [x, y, z] = [i as f64, j as f64, k as f64];
            let skew = 0.1 * (3.0 * x + 2.0 * y + 5.0 * z).sin();
            positions.insert(node(i, j, k), [x + skew, y + 0.2 * skew + 0.1 * x, z - 0.3 * skew]);
        }
    }
    let group = |material: &str, constants, first: usize| {
        let own: Vec<usize> = (first..count).step_by(2).collect();
        let corners = |&i: &usize| {
            [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
                .map(|(a, j, k)| node(i + a, j, k))
        };
        ElementGroup {
            kind: kind.to_owned(),
            section: section(material, constants),
            ids: own.iter().map(|i| 100 + *i as i64).collect(),
            nodes: own.iter().flat_map(corners).collect(),
            internal: Vec::new(),
        }
    };
    let groups = vec![group("steel", STEEL, 0), group("brass", BRASS, 1)];
    DescribedElements { groups, positions, ..DescribedElements::default() }
}

/// Labels of the rows of all nodes in an order that is not that of the nodes, and without some of them.
fn labels(described: &DescribedElements, without: &[NodeDirection]) -> Vec<NodeDirection> {
    let all = described.positions.keys().rev().flat_map(|&node| [2, 1, 3].map(|direction| (node, direction)));
    all.filter(|label| !without.contains(label)).collect()
}

/// Factors by which each degree of freedom follows the rows, from the equations.
fn transformation(
    labels: &[NodeDirection],
    equations: &[Equation],
) -> BTreeMap<NodeDirection, Vec<(usize, f64)>> {
    let row = |at: &NodeDirection| labels.iter().position(|label| label == at);
    let mut all: BTreeMap<NodeDirection, Vec<(usize, f64)>> =
        labels.iter().enumerate().map(|(row, label)| (*label, vec![(row, 1.0)])).collect();
    for Equation { dependent, terms } in equations {
        let terms = terms.iter().map(|(at, factor)| (row(at).expect("an independent term"), *factor));
        all.insert(*dependent, terms.collect());
    }
    all
}

/// Assembles T'KT of the elements with a formulation each, densely.
fn assembled(
    described: &DescribedElements,
    formulation: Formulation,
    labels: &[NodeDirection],
) -> SymmetricMatrix {
    let follow = transformation(labels, &described.equations);
    let n = labels.len();
    let mut dense = Mat::<f64>::zeros(n, n);
    let mut add = |rows: &[NodeDirection], matrix: &[f64]| {
        for (a, at) in rows.iter().enumerate() {
            for (b, to) in rows.iter().enumerate() {
                for (i, left) in &follow[at] {
                    for (j, right) in &follow[to] {
                        dense[(*i, *j)] += left * matrix[a * rows.len() + b] * right;
                    }
                }
            }
        }
    };
    for group in &described.groups {
        for (_, nodes, _) in group.elements() {
            let positions: Vec<[f64; 3]> = nodes.iter().map(|node| described.positions[node]).collect();
            let matrix = formulation.stiffness(&positions, &group.section).expect("an element");
            let rows: Vec<NodeDirection> =
                nodes.iter().flat_map(|&node| [1, 2, 3].map(|d| (node, d))).collect();
            add(&rows, &matrix);
        }
    }
    for spring in &described.direct {
        add(&spring.rows, &spring.matrix);
    }
    let entries: Vec<(u32, u32, f64)> = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i as u32, j as u32)))
        .map(|(i, j)| (i, j, dense[(i as usize, j as usize)]))
        .collect();
    SymmetricMatrix::symmetrised(CscMatrix::from_triplets(n, n, &entries))
}

fn full(kind: &str) -> Formulation {
    Formulation::candidates(kind, 8)[0]
}

/// Bricks with a spring, and a node that follows two others.
fn tied() -> DescribedElements {
    let mut described = bricks("C3D8", 4);
    described.direct.push(NodeStiffness {
        name: "spring 7".to_owned(),
        rows: vec![(10, 1), (60, 2)],
        matrix: vec![5e4, -5e4, -5e4, 5e4],
    });
    described.equations = (1..=3)
        .map(|d| Equation { dependent: (200, d), terms: vec![((190, d), 0.5), ((180, d), 0.5)] })
        .collect();
    described
}

fn proof(
    described: &DescribedElements,
    stiffness: &SymmetricMatrix,
    labels: &[NodeDirection],
) -> Result<ProvedElements, Vec<Refusal>> {
    prove(described.clone(), stiffness, labels, 16)
}

#[test]
fn elements_springs_and_equations_are_proved_by_their_sum() {
    let described = tied();
    let labels = labels(&described, &[(200, 1), (200, 2), (200, 3)]);
    let stiffness = assembled(&described, full("C3D8"), &labels);
    let proved = proof(&described, &stiffness, &labels).expect("proved");
    assert_eq!(proved.n_nodes(), 20);
    assert!(proved.groups().all(|(_, formulation)| formulation == full("C3D8")));
}

#[test]
fn the_formulation_is_that_of_the_matrix() {
    for formulation in Formulation::candidates("C3D8", 8) {
        let described = bricks("C3D8", 3);
        let labels = labels(&described, &[]);
        let stiffness = assembled(&described, formulation, &labels);
        let proved = proof(&described, &stiffness, &labels).expect("proved");
        assert!(proved.groups().all(|(_, own)| own == formulation), "{}", formulation.name());
    }
}

#[test]
fn what_differs_is_refused_by_name() {
    let sound = tied();
    let labels = labels(&sound, &[(200, 1), (200, 2), (200, 3)]);
    let stiffness = assembled(&sound, full("C3D8"), &labels);
    let refused = |change: &dyn Fn(&mut DescribedElements)| {
        let mut described = sound.clone();
        change(&mut described);
        proof(&described, &stiffness, &labels).expect_err("refused")
    };
    // One element with a modulus that is wrong by 1e-6.
    let other = refused(&|described| {
        let mut group = described.groups[1].clone();
        (group.ids, group.nodes) = (vec![101], group.nodes[..8].to_vec());
        group.section = section("odd", (BRASS.0 * (1.0 + 1e-6), BRASS.1));
        described.groups[1].ids.remove(0);
        described.groups[1].nodes.drain(..8);
        described.groups.push(group);
    });
    let [Refusal::Differs { ids, material, of: 1, largest, .. }] = &other[..] else { panic!("{other:?}") };
    assert_eq!((ids.as_slice(), material.as_str()), (&[101][..], "odd"));
    assert!((1e-8..1e-6).contains(largest), "{largest:e}");
    // Another Poisson's ratio of a whole material.
    let other = refused(&|described| described.groups[0].section = section("steel", (STEEL.0, 0.31)));
    let [Refusal::Differs { ids, of: 2, .. }] = &other[..] else { panic!("{other:?}") };
    assert_eq!(ids.as_slice(), [100, 102]);
    // Nodes of an element in another order.
    let other = refused(&|described| described.groups[0].nodes[..8].rotate_left(1));
    assert!(
        matches!(&other[..], [Refusal::Degenerate { .. }])
            || matches!(&other[..], [Refusal::Differs { ids, .. }] if ids == &[100]),
        "{other:?}"
    );
    // An element, a spring or an equation less.
    let other = refused(&|described| {
        described.groups[1].ids.remove(0);
        described.groups[1].nodes.drain(..8);
    });
    assert!(matches!(&other[..], [Refusal::Unexplained { .. }]), "{other:?}");
    let other = refused(&|described| described.direct.clear());
    let [Refusal::Unexplained { at: [a, b], .. }] = &other[..] else { panic!("{other:?}") };
    assert!([(10, 1), (60, 2)].contains(a) && [(10, 1), (60, 2)].contains(b));
    let other = refused(&|described| described.equations.clear());
    assert_eq!(other, [Refusal::WithoutRow(vec![(200, 1), (200, 2), (200, 3)])]);
    // What the reader could not describe, and types without a formulation.
    let shells = NotDescribed { what: "3 shells".to_owned(), line: Some(7), nodes: vec![1] };
    let other = refused(&|described| {
        described.not_described.push(shells.clone());
        described.groups[0].kind = "S8R".to_owned();
    });
    let unknown = Refusal::UnknownType { kind: "S8R".to_owned(), nodes: 8, count: 2 };
    assert_eq!(other, [Refusal::NotDescribed(shells), unknown]);
}

/// Returns T' (g kron I3) T with the displacements T of the nodes of elements for a unit displacement of each row.
fn in_rows(proved: &ProvedElements, by_nodes: &SymmetricMatrix, n: usize) -> SymmetricMatrix {
    let follow = proved.displacements(Mat::<f64>::identity(n, n).as_ref());
    let nodes = proved.n_nodes();
    let whole = Mat::from_fn(3 * nodes, 3 * nodes, |i, j| {
        if i % 3 == j % 3 { by_nodes.as_csc().get(i / 3, j / 3) } else { 0.0 }
    });
    let dense = follow.transpose() * whole * &follow;
    let entries: Vec<(u32, u32, f64)> = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .map(|(i, j)| (i as u32, j as u32, dense[(i, j)]))
        .collect();
    SymmetricMatrix::symmetrised(CscMatrix::from_triplets(n, n, &entries))
}

#[test]
fn stress_stiffness_turns_the_load_and_stresses_are_those_of_a_linear_field() {
    let described = bricks("C3D8", 4);
    let labels = labels(&described, &[]);
    let stiffness = assembled(&described, full("C3D8"), &labels);
    let proved = proof(&described, &stiffness, &labels).expect("proved");
    let n = labels.len();
    // Any displacements: the stress stiffness times positions is the force K u, and it leaves translations free.
    let field = Mat::from_fn(n, 1, |i, _| 1e-3 * (1.7 * i as f64).sin());
    let moved = proved.displacements(field.as_ref());
    let by_nodes = proved.stress_stiffness(moved.as_ref());
    let of_stress = in_rows(&proved, &by_nodes[0], n);
    let position = |row: usize, along: usize| {
        let (node, direction) = labels[row];
        if usize::from(direction) == along + 1 { described.positions[&node] } else { [0.0; 3] }
    };
    for row in 0..n {
        let (columns, values) = of_stress.row(row);
        let (node, direction) = labels[row];
        let force: f64 = stiffness
            .row(row)
            .0
            .iter()
            .zip(stiffness.row(row).1)
            .map(|(&j, k)| k * field[(j as usize, 0)])
            .sum();
        let size: f64 = values.iter().map(|value| value.abs()).sum();
        let along = |of: usize| -> f64 {
            let k = usize::from(direction) - 1;
            columns.iter().zip(values).map(|(&j, value)| value * position(j as usize, k)[of]).sum()
        };
        let translated: f64 = columns
            .iter()
            .zip(values)
            .filter(|(j, _)| labels[**j as usize].1 == direction)
            .map(|(_, value)| value)
            .sum();
        assert!(translated.abs() < 1e-12 * size, "{node} {direction}");
        let own = usize::from(direction) - 1;
        assert!(
            (along(own) - force).abs() < 1e-11 * size.max(force.abs()),
            "{node} {direction}: {} {force}",
            along(own)
        );
    }
    // A linear field has one stress per material at all nodes.
    let slope = [[1e-3, 2e-4, -3e-4], [4e-4, -6e-4, 1e-4], [0.0, 5e-4, 8e-4]];
    let linear = Mat::from_fn(n, 1, |row, _| {
        let (node, direction) = labels[row];
        let x = described.positions[&node];
        (0..3).map(|k| slope[usize::from(direction) - 1][k] * x[k]).sum::<f64>()
    });
    let nodes: Vec<i64> = described.positions.keys().copied().collect();
    let stresses = proved.nodal_stresses(&nodes);
    assert_eq!(stresses.places.len(), 20 + 12, "nodes between two materials have a place for each");
    for (at, (node, material)) in stresses.places.iter().enumerate() {
        let (youngs, poisson) = if *material == "steel" { STEEL } else { BRASS };
        let (lambda, mu) =
            (youngs * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), youngs / (2.0 * (1.0 + poisson)));
        let trace = slope[0][0] + slope[1][1] + slope[2][2];
        for (k, (i, j)) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].into_iter().enumerate() {
            let expected = if i == j { lambda * trace } else { 0.0 } + mu * (slope[i][j] + slope[j][i]);
            let (rows, values) = stresses.transposed.column(6 * at + k);
            let found: f64 =
                rows.iter().zip(values).map(|(&row, value)| value * linear[(row as usize, 0)]).sum();
            assert!(
                (found - expected).abs() < 1e-10 * youngs * 1e-3,
                "node {node}, {material}, {k}: {found} {expected}"
            );
        }
    }
}
