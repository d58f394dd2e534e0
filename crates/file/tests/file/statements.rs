//! `check` compares the statements of a file with its numbers, and interfaces with those of the model: every
//! contradicting statement is named, whatever the digests of the file.

use flexbody_base::diagnostic::Code;
use flexbody_body::basis::{BasisChoice, CraigBampton};
use flexbody_body::convert::{ConvertSettings, convert, poor_fits};
use flexbody_body::flex_body::{Certificate, FixedInterface, FlexBody, InterfaceCoordinates, Parts};
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
    raw.interfaces.iter_mut().for_each(|set| set.coupling = Some(coupling));
    model_of(raw)
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
