//! Round trips through every format that can be read, for every body of the fixtures: the file is recognised,
//! gives the body back, and passes its audit.

use faer::Mat;
use flexbody_base::provenance::SourceFile;
use flexbody_base::text::InputFile;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, Invariants, primary_differences};
use flexbody_formats::export::{ExportFormat, ExportOptions, Points};
use flexbody_formats::import::{ImportFormat, Imported, ImportedFile, audit, import_body};
use flexbody_formats::{FORMATS, export};
use flexbody_formats::{find_import_format, recognise};
use flexbody_model::{LoadKind, UnitLoad};
use oracle::exported::on_interfaces;
use oracle::flexible::fixture;
use std::path::Path;

/// Returns the bodies of the fixtures: all models in the principal frame, some in the frame of the model,
/// whose origin is not the centre of mass.
fn bodies() -> Vec<(String, FlexBody)> {
    let models = oracle::fixtures().join("models");
    let mut names: Vec<String> = std::fs::read_dir(models)
        .expect("fixtures")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let mut bodies: Vec<_> =
        names.iter().map(|name| (name.clone(), fixture(name, 6, BodyFrame::Principal))).collect();
    for name in ["connecting_rod", "turbine_blade", "frame_beams", "plane_frame"] {
        bodies.push((format!("{name} in its model frame"), fixture(name, 6, BodyFrame::Model)));
    }
    bodies.extend(on_interfaces());
    bodies
}

/// Returns every format that is written and read, with each of its dialects.
fn readable() -> Vec<(&'static dyn ExportFormat, &'static dyn ImportFormat, Option<&'static str>)> {
    let mut all = Vec::new();
    for format in FORMATS.iter().copied() {
        let Ok(reader) = find_import_format(format.name()) else { continue };
        match format.dialects() {
            [] => all.push((format, reader, None)),
            dialects => all.extend(dialects.iter().map(|dialect| (format, reader, Some(*dialect)))),
        }
    }
    all
}

fn written(body: &FlexBody, format: &dyn ExportFormat, dialect: Option<&str>, folder: &Path) -> InputFile {
    let points = if format.has_points() { Points::Nodes } else { Points::Usual };
    let options = ExportOptions { dialect: dialect.map(str::to_owned), points, ..ExportOptions::default() };
    let (exported, _) = export(body, format, &options, true).expect("written");
    let (again, _) = export(body, format, &options, true).expect("written");
    assert!(exported == again, "equal bodies give equal bytes");
    let path = folder.join("body.file");
    std::fs::write(&path, &exported.file).expect("a place");
    InputFile::open(&path).expect("readable")
}

fn taken(imported: &ImportedFile) -> Imported {
    let source = SourceFile::new("body", Path::new("body.file"), "0".repeat(64));
    import_body(imported, source, flexbody_base::units::UnitSystem::default(), None).expect("a body")
}

/// Returns the invariants without the part of a general mass that no format states: W0 beyond C1.
fn without_w0(invariants: &Invariants) -> Invariants {
    let mut told = invariants.clone();
    if let Some(general) = &mut told.primary_mut().general {
        general.w0 = invariants.as_solid().w0();
        general.plane = false;
    }
    told
}

/// Returns the stiffness under angular acceleration that the reader of SID adds: Cr1 holds this stiffness and
/// W3, and Ge gives only the antisymmetric part of W3.
fn symmetric_w3_of_sid(body: &FlexBody, back: &FlexBody, load: &UnitLoad) -> Mat<f64> {
    let nf = body.n_modes();
    let (Some(own), Some(told)) = (body.invariants().w3(), back.invariants().w3()) else {
        return Mat::zeros(nf, nf);
    };
    let axis = if body.dimension() == 2 { 2 } else { load.component };
    Mat::from_fn(nf, nf, |k, l| match load.kind {
        LoadKind::AngularAcceleration => own[(axis * nf + l, k)] - told[(axis * nf + l, k)],
        _ => 0.0,
    })
}

fn difference(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
    if *a == *b { 0.0 } else { (a - b).norm_max() / a.norm_max().max(b.norm_max()) }
}

#[test]
#[ignore = "slow"]
fn what_is_written_comes_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let formats = readable();
    assert_eq!(formats.len(), 9, "sid in five dialects, mbdyn in two, mbsim, exudyn");
    let mut wrong = Vec::new();
    for (name, body) in bodies() {
        for (format, reader, dialect) in &formats {
            let what = format!("{name} as {} {}", format.name(), dialect.unwrap_or(""));
            let mut complain = |text: String| wrong.push(format!("{what}: {text}"));
            if *dialect == Some("level13") && !body.conditions().is_mean() {
                let options =
                    ExportOptions { dialect: dialect.map(str::to_owned), ..ExportOptions::default() };
                let refused = export(&body, *format, &options, true).expect_err("no coupling");
                assert!(refused.to_string().contains("stands on interface"), "{what}: {refused}");
                continue;
            }
            let file = written(&body, *format, *dialect, folder.path());
            assert_eq!(recognise(&file).expect("known").name(), reader.name(), "{what}");
            let imported = reader.read(&file).expect(&what);
            // The audit of a file without coupling reports that; its other contents are correct.
            let coupled = *dialect != Some("level13");
            let found = audit(&imported, 1e-11);
            // The part of a mass that does not commute with rotations kept by MBSim belongs to no mass.
            let lossless = format.checklist(&body, &ExportOptions::default()).losses().is_empty();
            let whole =
                coupled && (body.invariants().general().is_none() || lossless || format.name() != "mbsim");
            for finding in found.findings().iter().filter(|_| whole) {
                complain(finding.to_string());
            }
            if !coupled && found.passed() {
                complain("the missing coupling is not found".to_owned());
            }
            let Imported { body: back, diagnostics } = taken(&imported);
            if diagnostics.iter().any(|d| d.code() == flexbody_base::diagnostic::Code::ForeignChanged) {
                complain("the modes were changed".to_owned());
            }
            let (own, told) = (body.invariants(), back.invariants());
            let general = own.general().is_some();
            for (quantity, apart) in primary_differences(&without_w0(own), told) {
                // For such a mass each format keeps the part of S and W3 that its equations use, and reports
                // the rest.
                if general && ["S", "W3"].contains(&quantity.as_str()) {
                    // SID returns the symmetric part of W3 with the stiffness under angular acceleration.
                    if quantity == "W3" && apart > 1e-12 && lossless && format.name() != "sid" {
                        complain(format!("W3 is lost by {apart:.1e}, which is not told"));
                    }
                    continue;
                }
                if apart.is_nan() || apart > 1e-12 {
                    complain(format!("{quantity} differs by {apart:.1e}"));
                }
            }
            let apart =
                |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max);
            let positions = body.nodes().positions.iter().zip(&back.nodes().positions);
            let moved = positions.map(apart).fold(0.0, f64::max) / body.extent();
            if back.n_nodes() != body.n_nodes() || moved > 1e-15 {
                complain(format!("{} nodes of {}, moved by {moved:.1e}", back.n_nodes(), body.n_nodes()));
                continue;
            }
            if difference(&body.modes().shape, &back.modes().shape) > 1e-15 {
                complain("the shapes differ".to_owned());
            }
            // SID stores W2 and the geometric stiffness for spin as a sum, which is read back as the latter;
            // the equations are equal.
            let joined = back.groups() != body.groups();
            for one in back
                .geometric_stiffness()
                .iter()
                .filter(|stiffness| !(joined && stiffness.load.kind == LoadKind::Spin))
            {
                // The stiffness of inertia of rotating nodes is read back as geometric stiffness.
                let own = body.stiffness_under(&one.load).map(|own| match format.name() {
                    "sid" => own + symmetric_w3_of_sid(&body, &back, &one.load),
                    _ => own,
                });
                match own {
                    Some(own) if difference(&one.matrix, &own) <= 1e-13 => {}
                    Some(_) => complain(format!("geometric stiffness for {} differs", one.load)),
                    None => complain(format!("geometric stiffness for {} comes from nowhere", one.load)),
                }
            }
            if let Some(damping) = &back.modes().modal_damping {
                let ratios =
                    |j: usize| 2.0 * body.modes().damping_ratio[j] * body.modes().eigenvalue[j].sqrt();
                let nf = body.n_modes();
                let own = body
                    .modes()
                    .modal_damping
                    .clone()
                    .unwrap_or_else(|| Mat::from_fn(nf, nf, |i, j| if i == j { ratios(j) } else { 0.0 }));
                if difference(damping, &own) > 1e-14 {
                    complain("the damping differs".to_owned());
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} problems:\n{}", wrong.len(), wrong.join("\n"));
}
