//! Craig-Bampton bodies checked against their model: residuals on the rows outside the interfaces, and interfaces that the
//! model does not state.

use crate::program::flexbody;
use flexbody_body::basis::{BasisChoice, CraigBampton};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_body::verification::verify;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use oracle::general::raw_fixture;
use std::fs;
use std::path::Path;

fn run(folder: &Path, line: &str) -> (Option<i32>, String, String) {
    let words: Vec<&str> = line.split(' ').collect();
    let run = flexbody(folder, &words);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (run.status.code(), text(&run.stdout), text(&run.stderr))
}

#[test]
fn interfaces_that_the_model_does_not_state_are_those_of_the_body() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = oracle::fixtures().join("models/bracket_hex20");
    for file in ["K.mtx.gz", "M.mtx.gz", "nodes.csv", "dofs.csv", "model.toml", "matrices.inp.gz"] {
        fs::copy(model.join(file), folder.path().join(file)).expect("a copy");
    }
    let manifest = fs::read_to_string(model.join("model.toml")).expect("a manifest");
    let (bare, first) = manifest.split_once("[[interface]]\n").expect("interfaces");
    fs::write(folder.path().join("bare.toml"), bare).expect("written");
    let (_, second) = first.split_once("[[interface]]\n").expect("two interfaces");
    let renamed = manifest.replace("\"bolt_base\"", "\"base\"");
    fs::write(folder.path().join("renamed.toml"), renamed).expect("written");
    fs::write(folder.path().join("one.toml"), format!("{bare}[[interface]]\n{second}")).expect("written");
    for (frame, residuals) in [
        ("com", &["constraint_modes_recomputed", "fixed_modes_recomputed"][..]),
        ("interface=bolt_base", &["interior_recomputed"][..]),
    ] {
        let line =
            format!("convert model.toml --basis craig-bampton --modes 4 --frame {frame} -o b.h5 --quiet");
        let (code, _, err) = run(folder.path(), &line);
        assert_eq!(code, Some(0), "{err}");
        let (code, out, err) = run(folder.path(), "check b.h5 --against model.toml");
        assert!(code == Some(0) && !err.contains("FB454"), "{out}{err}");
        // Modes of this basis are no eigenvectors of K and M.
        assert!(!out.contains("residual_recomputed"), "{out}");
        assert!(residuals.iter().all(|name| out.contains(name)), "{out}");
        let (code, out, err) = run(folder.path(), "check b.h5 --against bare.toml");
        assert!(code == Some(0) && residuals.iter().all(|name| out.contains(name)), "{out}{err}");
        let options = "--interface bolt_base=NODES,averaging --interface bolt_wall=NODES,averaging (";
        assert!(
            err.contains("note[FB454]: the model states no interfaces: `bolt_base`, `bolt_wall` with"),
            "{err}"
        );
        assert!(err.contains(options), "{err}");
        for other in ["renamed.toml", "one.toml"] {
            let (code, out, err) = run(folder.path(), &format!("check b.h5 --against {other}"));
            assert!(code == Some(1) && out.contains("FAILED"), "{out}{err}");
            assert!(err.contains("note[FB454]: `bolt_base` are missing in the model"), "{err}");
            assert!(!err.contains("bolt_wall=NODES"), "{err}");
        }
    }
}

/// The residuals see an error of a shape on interior rows, and allow every exact body.
#[test]
fn residuals_of_craig_bampton_modes_see_a_wrong_shape() {
    let model = FeModel::from_raw(raw_fixture("bracket_hex20")).expect("a model").model;
    for (frame, expected) in [
        (FrameChoice::Mean(BodyFrame::Com), "constraint_modes_recomputed"),
        (FrameChoice::Interface("bolt_wall".to_owned()), "interior_recomputed"),
    ] {
        let mut settings = ConvertSettings {
            basis: BasisChoice::CraigBampton(CraigBampton),
            frame,
            ..ConvertSettings::default()
        };
        settings.modes.wanted = Wanted::Lowest(3);
        let body = convert(&model, &settings, &Context::QUIET).expect("a body").body;
        let failed = |body: &FlexBody| -> Vec<&'static str> {
            let checks = verify(body, &model).expect("comparable");
            checks.iter().filter(|check| !check.passed).map(|check| check.name).collect()
        };
        assert_eq!(failed(&body), Vec::<&str>::new());
        let inside = (0..body.n_nodes())
            .find(|node| body.interfaces().iter().all(|interface| !interface.nodes.contains(node)))
            .expect("a node outside the interfaces");
        let mut parts = body.into_parts();
        let size = parts.modes.shape.norm_max();
        parts.modes.shape[(3 * inside, 2)] += 1e-6 * size;
        let wrong = FlexBody::new(parts).expect("a body");
        assert!(failed(&wrong).contains(&expected), "{:?}", failed(&wrong));
    }
}
