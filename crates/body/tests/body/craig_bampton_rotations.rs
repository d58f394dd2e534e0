//! Craig-Bampton bases of bodies whose nodes have rotations: a single node is a complete joint, and rigid
//! interfaces constrain rotations too.

use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};
use flexbody_body::basis::{BasisChoice, CraigBampton, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::verification::{body_identities, verify};
use flexbody_eigen::Wanted;
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, NodeSet, RawModel};
use oracle::reference::symmetric_eigen;

fn fixture(name: &str) -> RawModel {
    let folder = oracle::fixtures().join("models").join(name);
    read_model(&read_manifest(folder.join("model.toml")).expect("a fixture")).expect("a fixture")
}

/// Returns the nodes whose rows include all rotations.
fn turning(raw: &RawModel) -> Vec<i64> {
    let labels = raw.dofs.as_ref().expect("labels");
    let rotations = if raw.dimension == 2 { 1 } else { 3 };
    let all = |id: &i64| labels.iter().filter(|l| l.node == *id && l.direction > 3).count() == rotations;
    raw.nodes.ids.iter().copied().filter(all).collect()
}

fn with(mut raw: RawModel, coupling: Coupling, sets: &[Vec<i64>]) -> FeModel {
    let set = |(i, nodes): (usize, &Vec<i64>)| NodeSet {
        coupling: Some(coupling),
        ..NodeSet::new(format!("joint {i}"), nodes.clone())
    };
    raw.data.interfaces = sets.iter().enumerate().map(set).collect();
    FeModel::from_raw(raw).expect("a sound model").model
}

fn body(model: &FeModel, count: usize) -> FlexBody {
    let modes = ModeSettings { wanted: Wanted::Lowest(count), ..ModeSettings::default() };
    let basis = BasisChoice::CraigBampton(CraigBampton);
    convert(model, &ConvertSettings { modes, basis, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("a body")
        .body
}

/// Returns the finite eigenvalues of K, M in the given rows, ascending, without the `zero` lowest.
fn eigenvalues(model: &FeModel, kept: &dyn Fn(usize) -> bool, zero: usize) -> Vec<f64> {
    let pencil = model.pencil();
    let rows: Vec<usize> = (0..pencil.n()).filter(|&row| kept(row)).collect();
    let whole = Mat::<f64>::identity(pencil.n(), pencil.n());
    let part = |a: Mat<f64>| Mat::from_fn(rows.len(), rows.len(), |i, j| a[(rows[i], rows[j])]);
    let (k, m) = (part(pencil.apply_stiffness(whole.as_ref())), part(pencil.apply_mass(whole.as_ref())));
    let trace = |a: MatRef<'_, f64>| (0..a.nrows()).map(|i| a[(i, i)]).sum::<f64>();
    let shift = 1e-7 * trace(k.as_ref()) / trace(m.as_ref());
    let l = (&k + faer::Scale(shift) * &m).llt(faer::Side::Lower).expect("positive definite");
    let half = |a: &Mat<f64>| l.L().partial_piv_lu().solve(a);
    let theta = symmetric_eigen(half(&half(&m).transpose().to_owned()).as_ref()).0;
    let finite = theta.iter().rev().take_while(|theta| **theta > 1e-12 * theta.max(1.0 / shift));
    finite.skip(zero).map(|theta| 1.0 / theta - shift).collect()
}

fn fixed(body: &FlexBody) -> Vec<f64> {
    let coordinates = body.coordinates().expect("a Craig-Bampton basis");
    let modal = |(_, name): &(usize, &String)| name.starts_with("fixed-interface mode ");
    coordinates.names.iter().enumerate().filter(modal).map(|(i, _)| coordinates.stiffness[(i, i)]).collect()
}

fn close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= tolerance * expected, "{what}: {found}, expected {expected}");
    }
}

fn all_hold(body: &FlexBody, model: &FeModel, what: &str) {
    let mut checks = verify(body, model).expect("the same nodes");
    checks.extend(body_identities(body));
    for check in checks {
        assert!(check.passed, "{what}, {}: {:e} > {:e}", check.name, check.value, check.limit);
    }
}

/// A node with rotations is a joint by itself with any coupling: its six rows are the coordinates.
#[test]
fn a_single_node_with_rotations_is_a_joint() {
    for name in ["frame_beams", "plane_frame"] {
        let raw = fixture(name);
        let (d, zero) = if raw.dimension == 2 { (2, 3) } else { (3, 6) };
        let nodes = turning(&raw);
        let ends = [vec![nodes[0]], vec![nodes[1]]];
        for &coupling in Coupling::ALL {
            let what = format!("{name}, {}", coupling.name());
            let model = with(raw.clone(), coupling, &ends);
            let held = |row: usize| ends.iter().any(|set| set.contains(&model.label(row).node));
            let body_of = |count: usize| body(&model, count);
            let few = body_of(6);
            close(&fixed(&few), &eigenvalues(&model, &|row| !held(row), 0), 1e-9, &what);
            assert_eq!(few.coordinates().expect("coordinates").names.len(), 2 * zero + 6, "{what}");
            all_hold(&few, &model, &what);
            assert_eq!(
                few.parts().interface_identities().len(),
                if coupling == Coupling::Free { 2 } else { 4 }
            );
            // With all fixed-interface modes the body has the modes of the free body.
            let free = eigenvalues(&model, &|_| true, zero);
            let all = body_of(1000);
            close(&all.modes().eigenvalue[..10], &free[..10], 1e-8, &what);
            let above = few.modes().eigenvalue.iter().zip(&free);
            assert!(above.clone().all(|(found, exact)| *found >= exact * (1.0 - 1e-9)), "{what}");
            let rotation = few.modes().rotation.as_ref().expect("nodal rotations");
            for interface in few.interfaces().iter().filter(|interface| interface.reference.is_some()) {
                let shape = &few.modes().shape;
                let rows =
                    interface.rows(few.nodes(), shape.as_ref(), Some(rotation.as_ref()), d).expect("a point");
                let turned = rows.rotation.as_ref().expect("a rotation");
                let node = interface.nodes[0];
                for j in 0..few.n_modes() {
                    for c in 0..3 {
                        let place = 3 * node + c;
                        assert!(
                            (rows.translation[(c, j)] - shape[(place, j)]).abs() < 1e-12 * shape.norm_max()
                        );
                        assert!((turned[(c, j)] - rotation[(place, j)]).abs() < 1e-12 * rotation.norm_max());
                    }
                }
                assert!(rows.deformation().1 < 1e-12, "{what}");
            }
        }
    }
}

/// The reference node of an eliminated constraint, held; and an edge of a shell, whose rotations a rigid
/// interface constrains.
#[test]
fn rigid_interfaces_tie_rotations() {
    let mpc = fixture("mpc_block");
    let reference = turning(&mpc);
    assert_eq!(reference.len(), 1, "one node carries the end face");
    let shell = fixture("shell_folded");
    let edge: Vec<i64> = {
        let x = &shell.nodes.positions;
        let low = x.iter().map(|x| x[0]).fold(f64::INFINITY, f64::min);
        let ids = shell.nodes.ids.iter().zip(x).filter(|(_, x)| (x[0] - low).abs() < 1e-9);
        ids.map(|(&id, _)| id).collect()
    };
    assert!(edge.len() > 2);
    for (raw, nodes) in [(mpc, reference), (shell, edge)] {
        let what = raw.data.description.name.clone();
        let model = with(raw, Coupling::Rigid, std::slice::from_ref(&nodes));
        let body = body(&model, 8);
        let held = |row: usize| nodes.contains(&model.label(row).node);
        close(&fixed(&body), &eigenvalues(&model, &|row| !held(row), 0), 1e-9, &what);
        all_hold(&body, &model, &what);
        let coordinates = body.coordinates().expect("coordinates");
        assert_eq!(
            coordinates.names[..6],
            ["ux", "uy", "uz", "rx", "ry", "rz"].map(|c| format!("joint 0 {c}"))
        );
        // With one interface the modes are the fixed-interface modes without their rigid part.
        assert_eq!(body.n_modes(), 8, "{what}");
        // The rotation of every node of the interface equals that of its reference point.
        let (modes, interface) = (body.modes(), &body.interfaces()[0]);
        let rotation = modes.rotation.as_ref().expect("nodal rotations");
        let rows = interface.rows(body.nodes(), modes.shape.as_ref(), Some(rotation.as_ref()), 3);
        let turned = rows.and_then(|rows| rows.rotation).expect("a rotation");
        for &node in &interface.nodes {
            for j in 0..body.n_modes() {
                for c in 0..3 {
                    let off = turned[(c, j)] - rotation[(3 * node + c, j)];
                    assert!(off.abs() < 1e-9 * rotation.norm_max(), "{what}: {off:e}");
                }
            }
        }
    }
}
