//! Bodies described by other programs with arbitrary modes: conversion and audit.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::provenance::SourceFile;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{FlexBody, LoadKind, ReferenceConditions, UnitLoad};
use flexbody_body::invariants::{BodyFrame, FrameChoice, Invariants, condense, primary_differences};
use flexbody_formats::import::{
    Audit, Imported, ImportedBody, ImportedFile, ImportedFrame, accept_imported, audit, import_body,
};
use flexbody_model::{FeModel, GeometricStiffness};
use flexbody_report::{Tolerances, compare};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::{body_of, fixture};
use oracle::mesh::{Mesh, grid};
use oracle::random::Random;
use std::path::Path;

/// Returns a block without symmetry, its model and its body.
fn block(modes: usize) -> (FeModel, FlexBody) {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([4, 3, 2]), |[x, y, z]| {
        [0.2 * x + 0.03 * y, 0.2 * y * (1.0 - 0.05 * x), 0.2 * z * (1.0 + 0.1 * y)]
    });
    let assembly = mesh.assemble(&rubber, MassRule::Consistent);
    let model = FeModel::from_raw(assembly.raw_model()).expect("a body").model;
    (model, body_of(assembly.raw_model(), modes, BodyFrame::Principal))
}

/// Returns a file that describes `body` by other modes.
fn file_with(body: &FlexBody, shape: &Mat<f64>, invariants: &Invariants) -> ImportedFile {
    let frame = |i: usize| ImportedFrame {
        label: body.nodes().ids[i].to_string(),
        interface: None,
        position: body.nodes().positions[i],
        translation: shape.as_ref().subrows(3 * i, 3).to_owned(),
        rotation: None,
    };
    ImportedFile {
        format: "test",
        dialect: String::new(),
        notes: Vec::new(),
        checks: Vec::new(),
        unsound: Vec::new(),
        body: ImportedBody {
            mesh: None,
            name: "block".to_owned(),
            units: None,
            inertia: invariants.numbered(),
            modal_stiffness: invariants.modal_stiffness().clone(),
            modal_damping: body.modes().modal_damping.clone(),
            geometric_stiffness: body.geometric_stiffness().to_vec(),
            frames: (0..body.n_nodes()).map(frame).collect(),
            omissions: Vec::new(),
        },
    }
}

fn imported(file: &ImportedFile) -> Result<Imported, flexbody_base::error::Error> {
    imported_in(file, None)
}

fn imported_in(
    file: &ImportedFile,
    frame: Option<&FrameChoice>,
) -> Result<Imported, flexbody_base::error::Error> {
    let source = SourceFile::new("body", Path::new("block.file"), "0".repeat(64));
    import_body(file, source, UnitSystem::default(), frame)
}

fn random(random: &mut Random, rows: usize, columns: usize) -> Mat<f64> {
    Mat::from_fn(rows, columns, |_, _| random.signed())
}

/// Returns the rigid motions of the nodes (3n x 6).
fn rigid(body: &FlexBody) -> Mat<f64> {
    flexbody_model::rigid_fields(&body.nodes().positions, 3, [0.0; 3], 1.0)
}

fn worst_difference(a: &Invariants, b: &Invariants) -> f64 {
    primary_differences(a, b).into_iter().map(|(_, difference)| difference).fold(0.0, f64::max)
}

#[test]
fn free_surface_modes_are_taken_to_the_last_bit() {
    for name in ["bracket_hex20", "frame_beams", "shell_folded", "turbine_blade"] {
        let body = fixture(name, 6, BodyFrame::Principal);
        let Imported { body: taken, diagnostics } =
            imported(&file_with(&body, &body.modes().shape, body.invariants())).expect("a body");
        assert!(diagnostics.is_empty(), "{name}: {diagnostics:?}");
        assert_eq!(taken.modes().shape, body.modes().shape, "{name}");
        assert_eq!(taken.invariants().modal_stiffness(), body.invariants().modal_stiffness(), "{name}");
        let (own, told) = (taken.invariants(), body.invariants());
        // A file does not state W0 of a general mass beyond C1.
        let mut without_w0 = told.clone();
        if let Some(general) = &mut without_w0.primary_mut().general {
            let solid = told.as_solid();
            general.w0 = solid.w0();
        }
        assert_eq!(own.general().is_some(), told.general().is_some(), "{name}");
        assert!(
            worst_difference(&without_w0, own) < 1e-13,
            "{name}: {:?}",
            primary_differences(&without_w0, own)
        );
    }
}

#[test]
fn modes_of_any_frame_and_basis_give_the_same_body() {
    let (model, body) = block(7);
    let mut numbers = Random(5);
    let (nf, mass) = (body.n_modes(), model.scalar_mass().expect("a solid"));
    // A rigid motion of equal size is added to every mode, and all modes are mixed.
    let mix = random(&mut numbers, nf, nf) + Mat::<f64>::identity(nf, nf);
    let own = &body.modes().shape;
    let size = own.norm_max();
    let shape = own * &mix + rigid(&body) * (random(&mut numbers, 6, nf) * faer::Scale(size));
    let stiffness = mix.transpose() * body.invariants().modal_stiffness() * &mix;
    let invariants = condense(mass, &body.nodes().positions, shape.as_ref(), stiffness);
    let mut told = file_with(&body, &shape, &invariants);
    // A damping matrix that is not diagonal, and its transform to the mixed modes.
    let damping = Mat::from_fn(nf, nf, |i, j| 0.01 * (1 + i.min(j)) as f64);
    told.body.modal_damping = Some(mix.transpose() * &damping * &mix);

    let Imported { body: taken, diagnostics } =
        imported_in(&told, Some(&BodyFrame::Model.into())).expect("a body");
    assert_eq!(diagnostics.iter().map(|d| d.code()).collect::<Vec<_>>(), [Code::ForeignChanged]);
    assert_eq!(*taken.conditions(), ReferenceConditions::MeanAxes);
    let failed: Vec<_> = taken.identities(BodyFrame::Model).into_iter().filter(|c| !c.passed).collect();
    assert!(failed.is_empty(), "{failed:?}");
    let mut in_frame = body.clone().into_parts();
    in_frame.frame = *taken.frame();
    in_frame.description.units = taken.units().clone();
    let omega: Vec<f64> = in_frame.modes.eigenvalue.iter().map(|lambda| lambda.sqrt()).collect();
    in_frame.modes.damping_ratio = (0..nf).map(|j| damping[(j, j)] / (2.0 * omega[j])).collect();
    in_frame.modes.modal_damping = Some(damping.clone());
    let in_frame = FlexBody::new(in_frame).expect("a body");
    let strict = Tolerances { frequency: 1e-11, invariants: 1e-9, ..Tolerances::default() };
    let comparison = compare(&in_frame, &taken, &strict).expect("comparable");
    assert!(comparison.same_nodes() && comparison.passed(), "{}", comparison.text());
    // Modes are equal up to their signs.
    let sign = |j: usize| {
        let products = (0..3 * body.n_nodes()).map(|row| own[(row, j)] * taken.modes().shape[(row, j)]);
        products.sum::<f64>().signum()
    };
    let found = taken.modes().modal_damping.as_ref().expect("told");
    let apart = (0..nf * nf)
        .map(|at| (at / nf, at % nf))
        .map(|(i, j)| (found[(i, j)] * sign(i) * sign(j) - damping[(i, j)]).abs())
        .fold(0.0, f64::max);
    assert!(apart < 1e-9 * damping.norm_max(), "{apart:e}");
}

/// The frame of a file is kept: with the frame held, nodal displacements under modal elastic forces agree
/// with the file, and so do all terms linear in the modes.
#[test]
fn a_frame_that_the_modes_tie_to_the_body_is_kept() {
    let (model, body) = block(7);
    let mut numbers = Random(11);
    let (nf, mass) = (body.n_modes(), model.scalar_mass().expect("a solid"));
    let mix = random(&mut numbers, nf, nf) + Mat::<f64>::identity(nf, nf);
    let own = &body.modes().shape;
    let shape = own * &mix + rigid(&body) * (random(&mut numbers, 6, nf) * faer::Scale(own.norm_max()));
    let stiffness = mix.transpose() * body.invariants().modal_stiffness() * &mix;
    let invariants = condense(mass, &body.nodes().positions, shape.as_ref(), stiffness.clone());
    let mut told = file_with(&body, &shape, &invariants);
    let load = UnitLoad { kind: LoadKind::Spin, component: 1 };
    let stressed = Mat::from_fn(nf, nf, |i, j| 0.01 * (1 + i.min(j)) as f64);
    told.body.geometric_stiffness = vec![GeometricStiffness { load, matrix: stressed.clone() }];

    let Imported { body: taken, diagnostics } = imported(&told).expect("a body");
    assert_eq!(diagnostics.iter().map(|d| d.code()).collect::<Vec<_>>(), [Code::ForeignChanged]);
    assert_eq!(*taken.conditions(), ReferenceConditions::Unstated);
    let failed: Vec<_> = taken.identities(BodyFrame::Model).into_iter().filter(|c| !c.passed).collect();
    assert!(failed.is_empty(), "{failed:?}");
    // Compliance of the nodes with the frame held: Phi K^-1 Phi' before and after.
    let solve = |a: &Mat<f64>, b: &Mat<f64>| {
        let a = nalgebra::DMatrix::from_fn(nf, nf, |i, j| a[(i, j)]);
        let b = nalgebra::DMatrix::from_fn(nf, b.ncols(), |i, j| b[(i, j)]);
        let x = a.lu().solve(&b).expect("regular");
        Mat::from_fn(nf, x.ncols(), |i, j| x[(i, j)])
    };
    let compliance = |shape: &Mat<f64>, a: &Mat<f64>| shape * solve(a, &shape.transpose().to_owned());
    let close = |a: &Mat<f64>, b: &Mat<f64>, what: &str| {
        let apart = (a - b).norm_max() / b.norm_max();
        assert!(apart < 1e-9, "{what}: {apart:e}");
    };
    let new = &taken.modes().shape;
    close(&compliance(new, taken.invariants().modal_stiffness()), &compliance(&shape, &stiffness), "K");
    close(
        &compliance(new, &taken.invariants().modal_mass()),
        &compliance(&shape, &invariants.modal_mass()),
        "m",
    );
    // C1' = X'C1' and K_geo' = X'K_geo X with Psi' = Psi X, expressed by nodal quantities.
    let inverse = |a: &Mat<f64>, shape: &Mat<f64>, m: &Mat<f64>| {
        let moved = solve(m, &shape.transpose().to_owned());
        moved.transpose() * a * &moved
    };
    let taken_k = &taken.geometric_stiffness()[0].matrix;
    let m = invariants.modal_mass();
    close(&inverse(taken_k, new, &taken.invariants().modal_mass()), &inverse(&stressed, &shape, &m), "K_geo");
    let momentum =
        |c1: &Mat<f64>, shape: &Mat<f64>, m: &Mat<f64>| c1 * solve(m, &shape.transpose().to_owned());
    close(
        &momentum(taken.invariants().c1(), new, &taken.invariants().modal_mass()),
        &momentum(invariants.c1(), &shape, &m),
        "C1",
    );
    // Mean axes need the geometric stiffness of the rigid motions, which the file lacks.
    let refused = imported_in(&told, Some(&BodyFrame::Com.into())).expect_err("geometric stiffness");
    assert!(refused.has(Code::CarrierImpossible), "{refused}");
}

/// Six rigid motions mixed into the modes are detected as a span and removed.
#[test]
fn rigid_motions_mixed_into_the_modes_are_named_and_left_out() {
    let (model, body) = block(5);
    let mass = model.scalar_mass().expect("a solid");
    let mut numbers = Random(3);
    let all = Mat::from_fn(3 * body.n_nodes(), 11, |row, j| match j.checked_sub(5) {
        None => body.modes().shape[(row, j)],
        Some(_) => 0.0,
    });
    let rigid = rigid(&body);
    let all = Mat::from_fn(all.nrows(), 11, |row, j| if j < 5 { all[(row, j)] } else { rigid[(row, j - 5)] });
    let mix = random(&mut numbers, 11, 11) + Mat::<f64>::identity(11, 11);
    let lambda = &body.modes().eigenvalue;
    let own = Mat::from_fn(11, 11, |i, j| if i == j && i < 5 { lambda[i] } else { 0.0 });
    let (shape, stiffness) = (all * &mix, mix.transpose() * own * &mix);
    let invariants = condense(mass, &body.nodes().positions, shape.as_ref(), stiffness);
    let file = file_with(&body, &shape, &invariants);
    let found = audit(&file, 1e-6);
    let messages: Vec<String> = found.findings().iter().map(ToString::to_string).collect();
    assert_eq!(codes(&found), [Code::AuditImplausible], "{messages:?}");
    assert!(messages[0].contains("6 combinations of the modes are rigid motions"), "{messages:?}");
    let Imported { body: taken, diagnostics } = imported(&file).expect("a body");
    assert!(diagnostics[0].message().contains("6 combinations"), "{}", diagnostics[0]);
    // The remaining modes are M-orthogonal to all rigid motions: mean axes.
    assert_eq!(*taken.conditions(), ReferenceConditions::MeanAxes);
    assert_eq!(taken.n_modes(), 5);
    for (own, told) in taken.modes().eigenvalue.iter().zip(lambda) {
        assert!((own / told - 1.0).abs() < 1e-9, "{own} {told}");
    }
}

#[test]
fn a_rigid_motion_among_the_modes_is_left_out() {
    let (model, body) = block(4);
    let mass = model.scalar_mass().expect("a solid");
    let rigid = rigid(&body);
    let own = &body.modes().shape;
    let shape = Mat::from_fn(own.nrows(), 5, |row, j| match j {
        0 => own[(row, 0)],
        1 => rigid[(row, 4)],
        _ => own[(row, j - 1)],
    });
    let lambda = &body.modes().eigenvalue;
    let stiffness = Mat::from_fn(5, 5, |i, j| match (i, i == j) {
        (1, _) | (_, false) => 0.0,
        (0, _) => lambda[0],
        _ => lambda[i - 1],
    });
    let invariants = condense(mass, &body.nodes().positions, shape.as_ref(), stiffness);
    let Imported { body: taken, diagnostics } =
        imported(&file_with(&body, &shape, &invariants)).expect("a body");
    assert!(
        diagnostics[0].message().starts_with("mode 2 is a rigid motion: these modes were removed"),
        "{}",
        diagnostics[0]
    );
    assert_eq!(taken.n_modes(), 4);
    assert!(worst_difference(body.invariants(), taken.invariants()) < 1e-10);
}

#[test]
fn what_is_no_body_is_refused_in_words() {
    let (_, body) = block(3);
    let good = file_with(&body, &body.modes().shape, body.invariants());
    let refused = |change: &dyn Fn(&mut ImportedBody), code: Code, words: &str| {
        let mut bad = good.clone();
        change(&mut bad.body);
        let error = imported(&bad).expect_err(words);
        let first = &error.diagnostics()[0];
        assert!(first.code() == code && first.message().contains(words), "{words}: {first}");
    };
    refused(&|b| b.frames.clear(), Code::ForeignIncomplete, "no node");
    refused(&|b| b.inertia.i1 = -1.0, Code::ForeignIncomplete, "m > 0");
    refused(&|b| b.inertia.i7[(0, 0)] = f64::NAN, Code::ForeignIncomplete, "no NaN");
    refused(&|b| b.modal_stiffness[(0, 0)] *= -1.0, Code::ForeignIncomplete, "not positive definite beside");
    refused(&|b| b.inertia.i3[(0, 1)] = 1e3, Code::ForeignIncomplete, "mode 2 and rigid motion together");
    // All masses lie on the x axis.
    let line =
        |b: &mut ImportedBody| b.inertia.i7 = nalgebra::Matrix3::from_diagonal(&[0.0, 1.0, 1.0].into());
    refused(&line, Code::ForeignIncomplete, "all masses lie on a line");
    refused(
        &|b| {
            b.inertia.i6 = Mat::from_fn(3, 3, |_, _| 1.0);
            b.inertia.i9 = None;
        },
        Code::ForeignIncomplete,
        "depend on each other",
    );
}

/// A file whose body violates an identity is refused with a message about the file, not about a model.
#[test]
fn a_file_that_breaks_an_identity_is_told_to_be_wrong() {
    let (_, body) = block(3);
    let good = file_with(&body, &body.modes().shape, body.invariants());
    accept_imported(&imported(&good).expect("a body")).expect("a sound file");
    let mut bad = good.clone();
    let i9 = bad.body.inertia.i9.as_mut().expect("all groups");
    *i9 *= faer::Scale(0.01);
    let error = accept_imported(&imported(&bad).expect("a body"))
        .expect_err("a hundredth of the inertia of the modes");
    let told = error.to_string();
    assert!(
        error.has(Code::ForeignUnsound) && told.contains("the numbers of the file violate the identity"),
        "{told}"
    );
    assert!(told.contains("write the file again") && !told.contains("report the model"), "{told}");
}

#[test]
fn groups_that_a_file_lacks_are_dropped_and_named() {
    let (_, body) = block(3);
    let mut without = file_with(&body, &body.modes().shape, body.invariants());
    without.body.inertia.i9 = None;
    without.body.omissions = vec!["inertia that is quadratic in the modes".to_owned()];
    let Imported { body: taken, diagnostics } = imported(&without).expect("a body");
    assert_eq!(diagnostics[0].code(), Code::ForeignDropped);
    let (w1, w2, w3) = (taken.invariants().w1(), taken.invariants().w2(), taken.invariants().w3());
    assert!(w1.is_some() && w2.is_none() && w3.is_some());
    assert_eq!(taken.terms().len(), 1);
}

fn codes(found: &Audit) -> Vec<Code> {
    found.findings().iter().map(|finding| finding.code()).collect()
}

#[test]
fn an_audit_passes_a_body_and_names_what_is_wrong_with_another() {
    let (_, body) = block(4);
    let good = file_with(&body, &body.modes().shape, body.invariants());
    let found = audit(&good, 1e-9);
    assert!(found.passed() && found.checks.len() > 12, "{:?}", found.findings());
    assert!(found.notes.iter().any(|note| note.contains("free-surface")));
    let of = |change: &dyn Fn(&mut ImportedBody)| {
        let mut bad = good.clone();
        change(&mut bad.body);
        audit(&bad, 1e-9)
    };
    // Positions of nodes are in millimetres, inertia in metres.
    let millimetres = of(&|b| b.frames.iter_mut().for_each(|f| f.position = f.position.map(|x| 1000.0 * x)));
    assert_eq!(codes(&millimetres), [Code::AuditUnits]);
    assert!(millimetres.findings()[0].message().contains("1e-3"), "{}", millimetres.findings()[0]);
    // The inertia is impossible for any body.
    assert!(codes(&of(&|b| b.inertia.i7[(0, 0)] *= 9.0)).contains(&Code::AuditImplausible));
    assert_eq!(codes(&of(&|b| b.inertia.i1 = f64::NAN)), [Code::AuditImplausible]);
    // A body without mass has a single finding, not one for each quotient.
    for mass in [0.0, -3.0] {
        let found = of(&|b| b.inertia.i1 = mass);
        assert_eq!(codes(&found), [Code::AuditImplausible], "{:?}", found.findings());
        assert!(found.findings()[0].message().contains("mass is not positive"));
    }
    // The conversion refuses masses on a line, and the audit reports them.
    let line = of(&|b| b.inertia.i7 = nalgebra::Matrix3::from_diagonal(&[0.0, 1.0, 1.0].into()));
    assert!(line.findings().iter().any(|f| f.message().contains("all masses lie on a line")), "{line:?}");
    // A coupling a thousand times too large: modes would have negative energy.
    assert!(codes(&of(&|b| b.inertia.i3[(0, 0)] = 1e3)).contains(&Code::AuditIdentity));
    assert!(codes(&of(&|b| b.modal_stiffness = Mat::zeros(4, 4))).contains(&Code::AuditImplausible));
    assert!(codes(&of(&|b| b.modal_stiffness[(0, 1)] += 1.0)).contains(&Code::AuditIdentity));
    // Differences within the tolerance pass.
    let slightly = |by: f64| of(&|b| b.modal_stiffness[(0, 1)] += by * b.modal_stiffness.norm_max());
    assert!(slightly(1e-10).passed() && !slightly(1e-8).passed());
}
