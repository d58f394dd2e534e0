//! Bodies of every kind for the tests of exports: all fixture models, with free-surface modes and with interface modes,
//! damped, plane, with general mass matrices, and with some groups of the kinetic energy only.
#![allow(dead_code)] // every test file uses a part of this module

use super::flexible::soft_block;
use super::general::raw_fixture;
use super::partial::{combinations, with_groups};
use super::plane::rectangle;
use crate::fixtures;
use flexbody_body::basis::{BasisChoice, CraigBampton};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_eigen::Wanted;
use flexbody_formats::export::{ExportOptions, Exported};
use flexbody_formats::{export, find_format};
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, Damping, FeModel, RawModel};
use std::sync::OnceLock;

/// Returns the names of all fixture models.
pub fn models() -> Vec<String> {
    let folders = std::fs::read_dir(fixtures().join("models")).expect("fixtures");
    let mut names: Vec<String> =
        folders.map(|entry| entry.expect("a folder").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Converts a model with seven modes.
pub fn body_of(raw: RawModel, basis: BasisChoice, frame: BodyFrame) -> FlexBody {
    let model = FeModel::from_raw(raw).expect("a body").model;
    let mut settings = ConvertSettings { basis, frame: frame.into(), ..ConvertSettings::default() };
    settings.modes.wanted = Wanted::Lowest(7);
    convert(&model, &settings, &Context::QUIET).expect("converts").body
}

/// Converts a fixture model with Craig-Bampton modes and its interfaces coupled to reference points.
pub fn jointed(
    name: &str,
    coupling: Coupling,
    damping: Option<Damping<flexbody_model::RawMatrix>>,
) -> FlexBody {
    let mut raw = raw_fixture(name).with(|data| data.damping = damping);
    raw.data.interfaces.iter_mut().for_each(|interface| interface.coupling = Some(coupling));
    body_of(raw, BasisChoice::CraigBampton(CraigBampton), BodyFrame::Model)
}

/// Fixture models with interfaces.
pub const JOINTED: [&str; 4] = ["robot_link", "bracket_hex20", "satellite", "car_frame"];

/// Returns Craig-Bampton bodies, which have K and M of interface coordinates.
pub fn jointed_bodies() -> &'static [(String, FlexBody)] {
    static BODIES: OnceLock<Vec<(String, FlexBody)>> = OnceLock::new();
    BODIES.get_or_init(|| {
        let rigid =
            JOINTED.iter().map(|name| (format!("{name}, jointed"), jointed(name, Coupling::Rigid, None)));
        let rayleigh = Damping::Rayleigh { alpha: 12.0, beta: 3e-6 };
        let others = [
            (
                "robot_link, averaging, Rayleigh".to_owned(),
                jointed("robot_link", Coupling::Averaging, Some(rayleigh)),
            ),
            (
                "satellite, ratio".to_owned(),
                jointed("satellite", Coupling::Rigid, Some(Damping::Ratio(0.02))),
            ),
        ];
        rigid.chain(others).collect()
    })
}

/// Returns all bodies with their descriptions.
pub fn bodies() -> &'static [(String, FlexBody)] {
    static BODIES: OnceLock<Vec<(String, FlexBody)>> = OnceLock::new();
    BODIES.get_or_init(|| {
        let free = |raw| body_of(raw, BasisChoice::default(), BodyFrame::Principal);
        let mut all: Vec<(String, FlexBody)> =
            models().into_iter().map(|name| (name.clone(), free(raw_fixture(&name)))).collect();
        all.extend(jointed_bodies().iter().cloned());
        let damped = raw_fixture("frame_beams")
            .with(|data| data.damping = Some(Damping::Rayleigh { alpha: 4.0, beta: 2e-6 }));
        all.push((
            "frame_beams, Rayleigh, not at its centre".to_owned(),
            body_of(damped, BasisChoice::default(), BodyFrame::Model),
        ));
        all.extend(on_interfaces());
        all.push(("a plane solid".to_owned(), free(rectangle(5, 2, 0.7, [1.0, 2.0]))));
        let (solid, general) = (soft_block(5), all[6].1.clone());
        all.push(("soft block in short floats".to_owned(), solid.rounded_to_f32().expect("a body")));
        for groups in combinations() {
            all.push((format!("soft block with {groups:?}"), with_groups(&solid, groups)));
            all.push((format!("{} with {groups:?}", all[6].0), with_groups(&general, groups)));
        }
        all
    })
}

/// Returns bodies whose frame is carried by an interface: of solids, and of beams and shells with rotations, with
/// damping.
pub fn on_interfaces() -> Vec<(String, FlexBody)> {
    let made = |name: &str| {
        let mut raw =
            raw_fixture(name).with(|data| data.damping = Some(Damping::Rayleigh { alpha: 4.0, beta: 2e-6 }));
        raw.data.interfaces.iter_mut().for_each(|interface| interface.coupling = Some(Coupling::Rigid));
        let frame = FrameChoice::Interface(raw.data.interfaces[0].name.clone());
        let model = FeModel::from_raw(raw).expect("a body").model;
        let basis = BasisChoice::CraigBampton(CraigBampton);
        let mut settings = ConvertSettings { basis, frame, ..ConvertSettings::default() };
        settings.modes.wanted = Wanted::Lowest(4);
        let body = convert(&model, &settings, &Context::QUIET).expect("converts").body;
        (format!("{name}, frame on an interface"), body)
    };
    ["bracket_hex20", "robot_link", "satellite", "car_frame"].map(made).to_vec()
}

/// Returns the output of an export, which may have losses.
pub fn exported(
    body: &FlexBody,
    format: &str,
    dialect: Option<&str>,
) -> flexbody_base::error::Result<Exported> {
    let options = ExportOptions { dialect: dialect.map(str::to_owned), ..ExportOptions::default() };
    export(body, find_format(format).expect("a format"), &options, true).map(|(exported, _)| exported)
}

/// Returns the single file of an export.
pub fn file(body: &FlexBody, format: &str, dialect: Option<&str>) -> Vec<u8> {
    let Exported { file, beside } = exported(body, format, dialect).expect("writes");
    assert!(beside.is_empty());
    file
}

/// Returns the properties of a body that a format cannot hold.
pub fn losses(body: &FlexBody, format: &str) -> Vec<String> {
    find_format(format)
        .expect("a format")
        .checklist(body, &ExportOptions::default())
        .losses()
        .into_iter()
        .map(|loss| loss.text)
        .collect()
}
