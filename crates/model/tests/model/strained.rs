//! Rigid motions that strain K: the cause is named, and strain by rotations alone may be accepted as long as it is small.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::CscMatrix;
use flexbody_model::{Accepted, FeModel, RawModel};
use oracle::beams::chain;

/// Positions of a bent chain along no axis.
const PLACES: [[f64; 3]; 6] = [
    [0.0, 0.0, 0.0],
    [0.2, 0.03, 0.01],
    [0.45, 0.1, 0.0],
    [0.6, 0.05, 0.12],
    [0.85, 0.2, 0.1],
    [1.0, 0.1, 0.25],
];

/// Returns the chain whose K has in addition `part` of a diagonal entry times v v' for v, the sum of unit displacements
/// along y of the nodes with these factors.
fn with_energy(part: f64, factors: &[(i64, f64)]) -> RawModel {
    let mut raw = chain("chain", &PLACES);
    let labels = raw.dofs.clone().expect("labels");
    let row = |node: i64| {
        labels.iter().position(|label| (label.node, label.direction) == (node, 2)).expect("a row")
    };
    let matrix = &raw.stiffness.matrix;
    let mut entries: Vec<(u32, u32, f64)> = Vec::new();
    let mut size = 0.0;
    for column in 0..matrix.n_cols() {
        let (rows, values) = matrix.column(column);
        entries.extend(rows.iter().zip(values).map(|(row, value)| (*row, column as u32, *value)));
        let own =
            rows.iter().zip(values).find(|(at, _)| **at as usize == column && column == row(factors[0].0));
        size += own.map_or(0.0, |(_, value)| *value);
    }
    for &(a, first) in factors {
        let of = |&(b, second): &(i64, f64)| (row(a) as u32, row(b) as u32, part * size * first * second);
        entries.extend(factors.iter().map(of));
    }
    raw.stiffness.matrix = CscMatrix::from_triplets(labels.len(), labels.len(), &entries);
    raw
}

/// Returns the finding about strained rigid motion, an error or an accepted one.
fn finding(mut raw: RawModel, accepted: Accepted) -> Diagnostic {
    raw.allow_implausible = accepted;
    let found =
        FeModel::from_raw(raw).map_or_else(|error| error.into_diagnostics(), |checked| checked.diagnostics);
    let is_about = |own: &Diagnostic| matches!(own.code(), Code::RigidMotionStrained | Code::NodesRounded);
    found.into_iter().find(is_about).expect("a finding")
}

fn of(codes: &str) -> Accepted {
    Accepted::from_codes(codes).expect("codes")
}

fn ids() -> Vec<i64> {
    chain("chain", &PLACES).nodes.ids
}

#[test]
fn strain_by_rotations_alone_is_accepted_by_its_own_code_and_only_as_long_as_it_is_small() {
    let ids = ids();
    let turning = |part: f64| with_energy(part, &[(ids[1], 1.0), (ids[2], -1.0)]);
    let refused = finding(turning(1e-4), Accepted::default());
    assert_eq!(refused.code(), Code::RigidMotionStrained);
    assert!(refused.message().contains("by rotations alone"), "{refused}");
    assert!(
        refused.help().contains("--allow-implausible=FB410")
            && refused.help().contains(" Hz of the rigid body"),
        "{refused}"
    );
    for others in [Accepted::from(true), of("FB437,FB433,FB460")] {
        assert_eq!(finding(turning(1e-4), others).code(), Code::RigidMotionStrained);
    }
    let accepted = finding(turning(1e-4), of("FB410"));
    assert_eq!(accepted.code(), Code::NodesRounded);
    assert!(accepted.message().contains("accepted"), "{accepted}");
    // A tenth of a stiffness is no inaccuracy of elements.
    let large = finding(turning(0.1), of("FB410"));
    assert_eq!(large.code(), Code::RigidMotionStrained);
    assert!(!large.help().contains("allow-implausible"), "{large}");
}

#[test]
fn springs_to_ground_cannot_be_accepted() {
    let ids = ids();
    for part in [1e-7, 1e-4, 0.5] {
        let grounded = finding(with_energy(part, &[(ids[2], 1.0)]), of("FB410"));
        assert_eq!(grounded.code(), Code::RigidMotionStrained, "{part}");
        assert!(!grounded.message().contains("rotations alone"), "{part}: {grounded}");
        assert!(!grounded.help().contains("allow-implausible"), "{part}: {grounded}");
    }
}

#[test]
fn two_nodes_with_each_others_coordinates_are_named() {
    let ids = ids();
    for (a, b) in [(0, 1), (1, 4), (0, 5), (2, 3)] {
        for accepted in [Accepted::default(), of("FB410")] {
            let mut raw = chain("chain", &PLACES);
            raw.nodes.positions.swap(a, b);
            let found = finding(raw, accepted);
            let expected = format!("exchange the coordinates of nodes {} and {}:", ids[a], ids[b]);
            assert!(found.help().contains(&expected), "{found}");
        }
    }
}
