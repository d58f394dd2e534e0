//! Damping ratios of a model are those of its modes as a frame holds them: of the free body, and of the body held by a
//! carrier, whatever the frame of the file.

use faer::Mat;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{Carrier, FlexBody};
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, Damping, DampingBand, FeModel, NodeSet, RawMatrix, ratio_at};
use nalgebra::DMatrix;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::Mesh;

const ROOT: &str = "root";

fn body(damping: &Damping<RawMatrix>, frame: FrameChoice) -> FlexBody {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let raw = Mesh::block(ElementKind::Hex8, [3, 1, 1], [1.5, 0.4, 0.3])
        .assemble(&rubber, MassRule::Consistent)
        .raw_model();
    let nodes = raw.nodes.ids.iter().zip(&raw.nodes.positions).filter(|(_, at)| at[0] < 1e-9);
    let root = NodeSet::new(ROOT, nodes.map(|(id, _)| *id).collect());
    let interfaces = vec![NodeSet { coupling: Some(Coupling::Averaging), ..root }];
    let model = FeModel::from_raw(raw.with(|data| {
        data.interfaces = interfaces;
        data.damping = Some(damping.clone());
    }));
    let settings = ConvertSettings {
        frame,
        modes: ModeSettings { wanted: Wanted::Lowest(12), ..ModeSettings::default() },
        ..ConvertSettings::default()
    };
    convert(&model.expect("a body").model, &settings, &Context::QUIET).expect("converts").body
}

/// Returns the frequencies in hertz and damping ratios of the eigenpairs of (K_ff, m_ff), which D must not couple.
fn ratios(body: &FlexBody) -> Vec<(f64, f64)> {
    let dense = |a: &Mat<f64>| DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)]);
    let (k, m) = (dense(body.invariants().modal_stiffness()), dense(&body.invariants().modal_mass()));
    let factor = m.cholesky().expect("positive definite").l();
    let inverse = factor.try_inverse().expect("regular");
    let eigen = (&inverse * k * inverse.transpose()).symmetric_eigen();
    let shapes = inverse.transpose() * &eigen.eigenvectors;
    let damping = shapes.transpose() * dense(&body.damping()) * &shapes;
    let mut found = Vec::new();
    for (j, lambda) in eigen.eigenvalues.iter().enumerate() {
        for i in 0..j {
            let bound = 1e-7 * (damping[(i, i)] * damping[(j, j)]).sqrt();
            assert!(damping[(i, j)].abs() < bound, "modes {i} and {j}: {}", damping[(i, j)]);
        }
        found.push((lambda.sqrt() / std::f64::consts::TAU, damping[(j, j)] / (2.0 * lambda.sqrt())));
    }
    found
}

/// Compares the ratios of the modes in every frame of an analysis, for bodies of both frames of the file.
fn holds_in_every_frame(damping: &Damping<RawMatrix>, right: impl Fn(f64) -> f64) {
    for frame in [FrameChoice::from(BodyFrame::Com), FrameChoice::Interface(ROOT.to_owned())] {
        let own = body(damping, frame);
        let carried = own.carried(&Carrier::Interface(ROOT.to_owned())).expect("an interface");
        let again = carried.carried(&Carrier::Interface(ROOT.to_owned())).expect("an interface");
        let free = own.in_mean_axes().expect("mean axes");
        let held = own.on_interface(ROOT).expect("a frame");
        for one in [&carried, &again, &free, &held, &held.in_mean_axes().expect("mean axes")] {
            for (hertz, ratio) in ratios(one) {
                let right = right(hertz);
                assert!((ratio - right).abs() < 1e-7 * right, "{hertz} Hz: {ratio}, not {right}");
            }
        }
    }
}

#[test]
fn ratios_are_those_of_the_modes_of_the_analysis() {
    let bands = vec![
        DampingBand { to_hz: 0.15, ratio: 0.01 },
        DampingBand { to_hz: 0.8, ratio: 0.03 },
        DampingBand { to_hz: f64::INFINITY, ratio: 0.1 },
    ];
    holds_in_every_frame(&Damping::Ratio(0.03), |_| 0.03);
    holds_in_every_frame(&Damping::Bands(bands.clone()), |hertz| ratio_at(&bands, hertz));
}

#[test]
fn damping_in_proportion_to_the_mass_is_that_of_the_motion_in_the_frame() {
    let (alpha, beta) = (0.3, 0.02);
    holds_in_every_frame(&Damping::Rayleigh { alpha, beta }, |hertz| {
        let omega = std::f64::consts::TAU * hertz;
        0.5 * (alpha / omega + beta * omega)
    });
}
