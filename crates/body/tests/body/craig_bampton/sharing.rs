//! Interfaces that share nodes: valid bodies compared with every oracle, and refused ones.

use super::*;

/// Couplings of interfaces that share nodes; at least one of two is averaging.
const SHARING: [[Coupling; 2]; 4] = [
    [Coupling::Averaging, Coupling::Averaging],
    [Coupling::Rigid, Coupling::Averaging],
    [Coupling::Averaging, Coupling::Rigid],
    [Coupling::Averaging, Coupling::Free],
];

/// Returns the bracket or strip with some nodes of its second interface, and further nodes, added to the
/// first.
fn shared(couplings: [Coupling; 2], raw: RawModel) -> RawModel {
    let mut raw = raw;
    let taken: Vec<i64> = raw.data.interfaces[1].nodes.iter().copied().take(2).collect();
    raw.data.interfaces[0].nodes.extend(taken);
    assert_eq!(raw.data.interfaces.iter().map(|set| set.coupling).collect::<Vec<_>>(), couplings.map(Some));
    raw
}

/// Returns brackets and strips whose interfaces share nodes.
pub fn models() -> impl Iterator<Item = RawModel> {
    SHARING.into_iter().flat_map(|c| [shared(c, bracket(c)), shared(c, strip(c))])
}

/// Returns the motions with unit coordinates for interfaces that share nodes: changed at the `free` rows
/// only.
pub fn with_unit_coordinates(motion: Mat<f64>, weights: &Mat<f64>, free: impl Fn(usize) -> bool) -> Mat<f64> {
    let c = weights.ncols();
    let missing = Mat::<f64>::identity(c, c) - weights.transpose() * &motion;
    let moved: Vec<usize> = (0..c).filter(|&j| missing.row(j).norm_max() > 1e-12).collect();
    if moved.is_empty() {
        return motion;
    }
    let own =
        Mat::from_fn(
            weights.nrows(),
            moved.len(),
            |row, j| {
                if free(row) { weights[(row, moved[j])] } else { 0.0 }
            },
        );
    let missing = Mat::from_fn(moved.len(), c, |i, j| missing[(moved[i], j)]);
    let normal = own.transpose() * &own;
    motion + &own * normal.partial_piv_lu().solve(missing)
}

/// Interfaces whose motions follow from other interfaces are refused, with the shared node.
#[test]
fn interfaces_whose_motions_follow_from_others_are_refused() {
    use Coupling::{Averaging, Free, Rigid};
    let told = |couplings: [Coupling; 2], nodes: &dyn Fn(&[i64]) -> Vec<i64>| {
        let mut raw = bracket(couplings);
        raw.data.interfaces[1].reference = Reference::Centre;
        raw.data.interfaces[1].nodes = nodes(&raw.data.interfaces[0].nodes);
        let error = modes_of(&model(raw), &CraigBampton, &lowest(3)).expect_err("not independent");
        assert!(error.has(Code::InterfaceShared), "{couplings:?}: {error}");
        assert!(error.to_string().contains("with `first`"), "{couplings:?}: {error}");
    };
    for couplings in [[Averaging, Averaging], [Rigid, Averaging], [Free, Averaging], [Rigid, Free]] {
        told(couplings, &|first| first.to_vec());
    }
    // A few nodes of its own do not make a rigid or averaging interface independent of another rigid one.
    told([Rigid, Rigid], &|first| [&first[..1], &[1, 2, 30]].concat());
    told([Rigid, Averaging], &|first| [first, &[1]].concat());
    let other = |first: &[i64]| (1..).filter(|id| !first.contains(id)).take(6).collect::<Vec<i64>>();
    let mut raw = bracket([Averaging, Averaging]);
    let first = raw.data.interfaces[0].nodes.clone();
    raw.data.interfaces[1].nodes = [first.as_slice(), &other(&first)].concat();
    assert_eq!(craig_bampton(&model(raw), 3).solution.eigenvalues.len(), 9);
}
