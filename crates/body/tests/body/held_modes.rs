//! Modes of bodies held at an interface, and their effective masses: a cantilever in closed form, the carried body, and the
//! dense pencil of the held model.

use faer::Mat;
use flexbody_body::basis::{BasisChoice, CraigBampton, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{Carrier, FlexBody};
use flexbody_body::invariants::BodyFrame;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, NodeSet, RawModel};
use nalgebra::DMatrix;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, grid};

/// Effective masses of the first three bending modes of a slender cantilever, relative to its mass.
const CANTILEVER: [f64; 3] = [0.613_07, 0.188_30, 0.064_74];

fn converted(model: &FeModel, modes: usize, basis: BasisChoice, frame: BodyFrame) -> FlexBody {
    let settings = ConvertSettings {
        frame: frame.into(),
        basis,
        modes: ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() },
        lumped: Vec::new(),
        ..ConvertSettings::default()
    };
    convert(model, &settings, &Context::QUIET).expect("a body").body
}

fn with_root(raw: RawModel, coupling: Coupling) -> FeModel {
    let nodes = raw.nodes.ids.iter().zip(&raw.nodes.positions).filter(|(_, at)| at[0] < 1e-9);
    let root = NodeSet::new("root", nodes.map(|(id, _)| *id).collect());
    let interfaces = vec![NodeSet { coupling: Some(coupling), ..root }];
    FeModel::from_raw(raw.with(|data| data.interfaces = interfaces)).expect("a sound model").model
}

fn root() -> Carrier {
    Carrier::Interface("root".to_owned())
}

#[test]
fn effective_masses_of_a_cantilever_are_those_of_the_closed_form() {
    let steel = Material { poisson: 0.0, ..Material::STEEL };
    let mesh = Mesh::block(ElementKind::Hex20, [40, 1, 1], [1.0, 0.02, 0.03]);
    let model = with_root(mesh.assemble(&steel, MassRule::Consistent).raw_model(), Coupling::Rigid);
    for frame in [BodyFrame::Com, BodyFrame::Principal] {
        let body = converted(&model, 14, BasisChoice::CraigBampton(CraigBampton), frame);
        let held = body.held_modes(&root()).expect("an interface");
        for (axis, thickness) in [(1, 0.02f64), (2, 0.03)] {
            let bending: Vec<_> =
                held.iter().filter(|mode| mode.effective_mass[axis] > 0.03).take(3).collect();
            for (mode, expected) in bending.iter().zip(CANTILEVER) {
                let found = mode.effective_mass[axis];
                assert!((found - expected).abs() < 6e-3, "axis {axis}: {found} {expected}");
            }
            // The first frequency of Euler and Bernoulli.
            let inertia = thickness.powi(2) / 12.0;
            let first = 1.875_104f64.powi(4) * steel.youngs * inertia / steel.density;
            assert!((bending[0].eigenvalue / first - 1.0).abs() < 3e-3, "{}", bending[0].eigenvalue / first);
        }
        // All modes of a Craig-Bampton body hold the mass but for the part that the interface itself has.
        for axis in 0..3 {
            let sum: f64 = held.iter().map(|mode| mode.effective_mass[axis]).sum();
            assert!(sum < 1.0 + 1e-9 && sum > if axis == 0 { 0.7 } else { 0.85 }, "axis {axis}: {sum}");
        }
    }
}

/// A body with all its modes has the modes and effective masses of the dense pencil in which the mean motion of the
/// interface is zero, whatever its frame; the carried body has the same frequencies.
#[test]
fn held_modes_are_those_of_the_dense_pencil() {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([3, 1, 1]), |[x, y, z]| {
        [0.5 * x, 0.4 * y * (1.0 - 0.05 * x), 0.3 * z * (1.0 + 0.1 * y * x)]
    });
    let model = with_root(mesh.assemble(&rubber, MassRule::Consistent).raw_model(), Coupling::Averaging);
    let n = model.rows().len();
    let dense = |a: &Mat<f64>| DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)]);
    let unit = Mat::<f64>::identity(n, n);
    let pencil = model.pencil();
    let [mass, stiffness] =
        [pencil.apply_mass(unit.as_ref()), pencil.apply_stiffness(unit.as_ref())].map(|a| dense(&a));
    let loads = flexbody_body::basis::interface_loads(&model, "root").expect("sound").expect("known");
    // Displacements without mean motion of the interface: the null space of its loads.
    let loads = dense(&loads);
    let projector = DMatrix::identity(n, n)
        - &loads * (loads.transpose() * &loads).try_inverse().expect("regular") * loads.transpose();
    let eigen = projector.symmetric_eigen();
    let kept: Vec<usize> = (0..n).filter(|&j| eigen.eigenvalues[j] > 0.5).collect();
    let basis = DMatrix::from_fn(n, kept.len(), |i, j| eigen.eigenvectors[(i, kept[j])]);
    let [m, k] = [&mass, &stiffness].map(|a| basis.transpose() * a * &basis);
    let lower = m.cholesky().expect("definite").l();
    let inverse = lower.try_inverse().expect("regular");
    let held = (&inverse * k * inverse.transpose()).symmetric_eigen();
    let shapes = &basis * inverse.transpose() * &held.eigenvectors;
    let mut order: Vec<usize> = (0..kept.len()).collect();
    order.sort_by(|&a, &b| held.eigenvalues[a].total_cmp(&held.eigenvalues[b]));
    let rigid = DMatrix::from_fn(n, 3, |i, k| f64::from(u8::from(i % 3 == k)));
    let total = (rigid.transpose() * &mass * &rigid)[(0, 0)];
    let participation = rigid.transpose() * &mass * shapes;
    for frame in [BodyFrame::Com, BodyFrame::Principal, BodyFrame::Model] {
        let body = converted(&model, usize::MAX, BasisChoice::default(), frame);
        let found = body.held_modes(&root()).expect("an interface");
        assert_eq!(found.len(), order.len());
        for (mode, &at) in found.iter().zip(&order).take(12) {
            assert!((mode.eigenvalue / held.eigenvalues[at] - 1.0).abs() < 1e-7, "{frame:?}");
            for axis in 0..3 {
                let expected = participation[(axis, at)].powi(2) / total;
                let difference = (mode.effective_mass[axis] - expected).abs();
                assert!(difference < 1e-6, "{frame:?}: {} {expected}", mode.effective_mass[axis]);
            }
        }
        let carried = body.carried(&root()).expect("a carrier").eigenvalues_in_frame().expect("a pencil");
        for (mode, lambda) in found.iter().zip(carried).take(12) {
            assert!((mode.eigenvalue / lambda - 1.0).abs() < 1e-9);
        }
    }
}
