//! `check` compares the statements of a file with its numbers, and interfaces with those of the model: every
//! contradicting statement is named, whatever the digests of the file.

use flexbody_base::diagnostic::Code;
use flexbody_base::units::UnitSystem;
use flexbody_body::basis::{BasisChoice, CraigBampton};
use flexbody_body::convert::{ConvertSettings, convert, poor_fits};
use flexbody_body::flex_body::{Certificate, FixedInterface, FlexBody, InterfaceCoordinates, Parts};
use flexbody_body::invariants::FrameChoice;
use flexbody_body::verification::{body_identities, verify};
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, RawModel};
use oracle::general::raw_fixture;

fn model_of(raw: RawModel) -> FeModel {
    FeModel::from_raw(raw).expect("a body").model
}

fn converted(model: &FeModel, basis: BasisChoice, modes: usize) -> FlexBody {
    let mut settings = ConvertSettings { basis, ..ConvertSettings::default() };
    settings.modes.wanted = Wanted::Lowest(modes);
    convert(model, &settings, &Context::QUIET).expect("converts").body
}

/// Returns a link with interfaces of this `coupling`.
fn link(coupling: Coupling) -> FeModel {
    let mut raw = raw_fixture("robot_link");
    raw.data.interfaces.iter_mut().for_each(|set| set.coupling = Some(coupling));
    model_of(raw)
}

/// Returns the link with the interface `name` as the place of its frame.
fn held_link(name: &str, modes: usize) -> FlexBody {
    let mut settings = ConvertSettings {
        basis: BasisChoice::CraigBampton(CraigBampton),
        frame: FrameChoice::Interface(name.to_owned()),
        ..ConvertSettings::default()
    };
    settings.modes.wanted = Wanted::Lowest(modes);
    convert(&link(Coupling::Rigid), &settings, &Context::QUIET).expect("converts").body
}

/// Returns the body after `change`, written to a file and read again, so that its digests are valid.
fn changed(body: &FlexBody, change: &dyn Fn(&mut Parts)) -> FlexBody {
    let mut parts = body.clone().into_parts();
    change(&mut parts);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("changed.flex.h5");
    flexbody_file::write(&FlexBody::new(parts).expect("a body"), &path).expect("written");
    flexbody_file::read(&path).expect("read")
}

fn failing(body: &FlexBody) -> Vec<&'static str> {
    body_identities(body).into_iter().filter(|check| !check.passed).map(|check| check.name).collect()
}

type Change<'a> = (&'a str, &'a dyn Fn(&mut Parts));

fn assert_each_is_named(body: &FlexBody, changes: &[Change<'_>]) {
    assert_eq!(failing(body), Vec::<&str>::new());
    for (i, (name, change)) in changes.iter().enumerate() {
        assert_eq!(failing(&changed(body, *change)), [*name], "change {i}");
    }
}

fn fixed(parts: &mut Parts) -> &mut FixedInterface {
    parts.certificate.fixed_interface.as_mut().expect("Craig-Bampton")
}

fn coordinates(parts: &mut Parts) -> &mut InterfaceCoordinates {
    parts.coordinates.as_mut().expect("Craig-Bampton")
}

#[test]
fn the_proof_and_the_lumped_errors_of_free_modes_are_held_to_their_numbers() {
    let body = converted(&link(Coupling::Averaging), BasisChoice::default(), 18);
    let proved = body.certificate().proved_modes.expect("proved");
    let change = |f: &'static dyn Fn(&mut Certificate)| move |p: &mut Parts| f(&mut p.certificate);
    assert_each_is_named(
        &body,
        &[
            ("counted_modes", &change(&|c| c.proved_modes = Some(999))),
            ("counted_modes", &change(&|c| c.proved_modes = Some(1))),
            ("counted_modes", &change(&|c| c.negative_pivots = Some(11))),
            ("counted_modes", &change(&|c| c.negative_pivots = None)),
            ("counted_modes", &change(&|c| c.rigid_modes = 5)),
            ("counted_modes", &change(&|c| c.shift *= 0.5)),
            ("counted_modes", &change(&|c| (c.proved_modes, c.negative_pivots) = (Some(17), Some(23)))),
            ("lumped_errors", &|p| p.lumped[0].comparison[5].1 += 1e-3),
        ],
    );
    // The lowest modes of a proved body remain proved.
    for count in [5, proved.min(body.n_modes())] {
        let modes: Vec<usize> = (0..count).collect();
        let some = body.reduced(&modes, body.groups(), Vec::new()).expect("fewer modes");
        assert_eq!(failing(&some), Vec::<&str>::new());
    }
    let without = changed(&body, &|p| p.certificate.proved_modes = None);
    assert_eq!(failing(&without), Vec::<&str>::new(), "nothing is claimed");
}

/// A frame on an interface changes the modes and not their span: the count of the fixed-interface modes holds for the
/// body, in its file of version 1.11 and in mean axes again.
#[test]
fn a_body_held_at_an_interface_knows_its_fixed_interface_modes() {
    let mean = converted(&link(Coupling::Rigid), BasisChoice::CraigBampton(CraigBampton), 6);
    let of_mean = mean.certificate().fixed_interface.clone().expect("Craig-Bampton");
    let name = mean.interfaces()[0].name.as_str();
    let held = held_link(name, 6);
    let record = held.certificate().fixed_interface.as_ref().expect("kept");
    assert!(record.is_proved() && record.free.is_none() && of_mean.free.is_some(), "{record:?}");
    let expected = FixedInterface {
        eigenvalues: mean.coordinates().expect("coordinates").fixed_interface_eigenvalues(),
        free: None,
        ..of_mean.clone()
    };
    assert_eq!(*record, expected);
    assert_eq!(record.eigenvalues.len(), 6);
    assert_each_is_named(
        &held,
        &[
            ("fixed_interface_modes", &|p| fixed(p).interface_motions = 6),
            ("fixed_interface_modes", &|p| fixed(p).counted = Some(3)),
            ("fixed_interface_modes", &|p| fixed(p).shift *= 0.1),
            ("fixed_interface_modes", &|p| fixed(p).next = Some(1.0)),
        ],
    );
    // Changes of the frame of a finished body keep the facts as well.
    for other in [mean.on_interface(name).expect("held"), held.in_mean_axes().expect("mean").into_owned()] {
        let record = other.certificate().fixed_interface.as_ref().expect("kept");
        assert_eq!(*record, expected);
        assert_eq!(failing(&other), Vec::<&str>::new());
    }
    let milliseconds = UnitSystem::parse("mm", "t", "ms").expect("units");
    let other = flexbody_file::in_units(&held, &milliseconds).expect("in other units");
    for (own, lambda) in fixed(&mut other.into_parts()).eigenvalues.iter().zip(&record.eigenvalues) {
        assert!((own / lambda - 1e-6).abs() < 1e-18, "{own:e}, {lambda:e}");
    }
    let mut short = held.clone().into_parts();
    fixed(&mut short).eigenvalues.pop();
    let error = FlexBody::new(short).expect_err("five of six").to_string();
    assert!(error.contains("fixed_interface.eigenvalues"), "{error}");
}

/// Only a body held at an interface has the facts of version 1.11.
#[test]
fn files_of_craig_bampton_bodies_state_the_version_that_their_entries_need() {
    let mean = converted(&link(Coupling::Rigid), BasisChoice::CraigBampton(CraigBampton), 6);
    let held = held_link(&mean.interfaces()[0].name, 6);
    // Versions up to 1.10 have no facts about the fixed-interface modes of a body held at an interface.
    let mut earlier = held.clone().into_parts();
    earlier.certificate.fixed_interface = None;
    let earlier = FlexBody::new(earlier).expect("a body");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("body.flex.h5");
    for (body, is_newest, has_estimates) in
        [(&mean, false, true), (&held, true, false), (&earlier, false, false)]
    {
        flexbody_file::write(body, &path).expect("written");
        assert_eq!(flexbody_file::read(&path).expect("read"), *body);
        let file = hdf5_metno::File::open(&path).expect("a file");
        let minor: i64 = file.attr("format_minor").expect("stated").read_scalar().expect("a number");
        // Two interfaces have an order since 1.12, a body in mean axes an estimate of its missing stress since 1.13.
        assert_eq!(minor, if has_estimates { 13 } else { 12 });
        for name in ["free_eigenvalue", "free_eigenvalue_lower"] {
            assert_eq!(file.link_exists(&format!("modes/{name}")), has_estimates, "{name}");
        }
        assert_eq!(file.link_exists("certificate/fixed_interface_eigenvalue"), is_newest);
    }
}

#[test]
fn what_a_craig_bampton_body_is_made_of_is_held_to_its_coordinates() {
    let rigid = converted(&link(Coupling::Rigid), BasisChoice::CraigBampton(CraigBampton), 6);
    assert!(rigid.certificate().fixed_interface.as_ref().and_then(|fixed| fixed.counted).is_some());
    assert_each_is_named(
        &rigid,
        &[
            ("fixed_interface_modes", &|p| fixed(p).modes = 7),
            ("fixed_interface_modes", &|p| fixed(p).interface_motions = 6),
            ("fixed_interface_modes", &|p| fixed(p).counted = Some(3)),
            ("fixed_interface_modes", &|p| fixed(p).shift *= 0.1),
            ("fixed_interface_modes", &|p| fixed(p).next = Some(1.0)),
        ],
    );
    let moved = changed(&rigid, &|p| p.interfaces[1].reference.as_mut().expect("a point")[1] += 0.01);
    assert!(failing(&moved).contains(&"interface_modes"), "{:?}", failing(&moved));
    let turned = changed(&rigid, &|p| {
        let b = &mut coordinates(p).of_modes;
        (0..b.ncols()).for_each(|j| (b[(1, j)], b[(2, j)]) = (b[(2, j)], b[(1, j)]));
    });
    assert!(failing(&turned).contains(&"interface_modes"), "{:?}", failing(&turned));
}

#[test]
fn an_interface_that_is_called_rigid_and_is_not_is_named() {
    let averaging = converted(&link(Coupling::Averaging), BasisChoice::CraigBampton(CraigBampton), 6);
    assert_each_is_named(
        &averaging,
        &[("rigid_interfaces", &|p| p.interfaces[0].coupling = Some(Coupling::Rigid))],
    );
    let some = averaging.reduced(&[0, 1, 2], averaging.groups(), Vec::new()).expect("fewer modes");
    assert_each_is_named(
        &some,
        &[("rigid_interfaces", &|p| p.interfaces[1].coupling = Some(Coupling::Rigid))],
    );
    // Free modes do not depend on couplings; a warning states the deviation.
    let free = converted(&link(Coupling::Averaging), BasisChoice::default(), 6);
    let claimed = changed(&free, &|p| p.interfaces[0].coupling = Some(Coupling::Rigid));
    assert_eq!(failing(&claimed), Vec::<&str>::new());
    assert!(poor_fits(&free).is_empty());
    let warned = poor_fits(&claimed);
    assert_eq!(warned.iter().map(|warning| warning.code()).collect::<Vec<_>>(), [Code::InterfaceFit]);
}

#[test]
fn interfaces_are_held_to_those_of_the_model() {
    for (coupling, basis) in [
        (Coupling::Rigid, BasisChoice::CraigBampton(CraigBampton)),
        (Coupling::Averaging, BasisChoice::default()),
    ] {
        let model = link(coupling);
        let body = converted(&model, basis, 6);
        let failing = |body: &FlexBody| -> Vec<&'static str> {
            let checks = verify(body, &model).expect("the same nodes");
            // A node that leaves an interface also changes the rows outside of them.
            let failed = checks.into_iter().filter(|check| !check.passed).map(|check| check.name);
            failed.filter(|name| !name.ends_with("_modes_recomputed")).collect()
        };
        assert_eq!(failing(&body), Vec::<&str>::new());
        let changes: &[Change<'_>] = &[
            ("interfaces", &|p| p.interfaces[0].name.push('x')),
            ("interfaces", &|p| assert!(p.interfaces[0].nodes.pop().is_some())),
            ("interfaces", &|p| p.interfaces[0].coupling = None),
            ("interfaces", &|p| drop(p.interfaces.pop())),
            ("interfaces", &|p| p.interfaces.clear()),
            ("interfaces", &|p| p.interfaces[1].reference = None),
            ("reference_points", &|p| p.interfaces[1].reference.as_mut().expect("a point")[2] += 1e-6),
        ];
        for (i, (name, change)) in changes.iter().enumerate() {
            assert_eq!(failing(&changed(&body, *change)), [*name], "change {i}");
        }
        let exchanged = changed(&body, &|p| {
            let name = p.interfaces[0].name.clone();
            p.interfaces[0].name = std::mem::replace(&mut p.interfaces[1].name, name);
        });
        assert_eq!(failing(&exchanged), ["interfaces", "reference_points"]);
    }
}
