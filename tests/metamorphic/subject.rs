//! A model with its scene.

use crate::text;
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, CraigBampton, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, RawModel};
use flexbody_motion::scene::{LoadCases, Scene};

/// Modes of a conversion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// Number of lowest free modes.
    Lowest(usize),
    /// All free modes: a complete basis.
    All,
    /// All fixed-interface modes and all constraint modes: a complete basis.
    Fixed,
}

/// Returns the frames of a conversion of a model: those of the body, and at its interfaces. The geometric stiffness of a body in
/// the latter does not hold in mean axes (FB214).
pub fn frames(raw: &RawModel) -> Vec<FrameChoice> {
    let at = |name: &&str| FrameChoice::Interface((*name).to_owned());
    let interfaces = if raw.data.geometric_stiffness.is_empty() { &["root", "tip"][..] } else { &[] };
    BodyFrame::ALL.iter().map(|&frame| FrameChoice::Mean(frame)).chain(interfaces.iter().map(at)).collect()
}

/// A model, its conversion, and the load cases of the body.
#[derive(Debug, Clone)]
pub struct Subject {
    /// Name of the kind of body.
    pub kind: &'static str,
    /// Model before its checks.
    pub raw: RawModel,
    /// Modes of the conversion.
    pub basis: Basis,
    /// Frame of the conversion.
    pub frame: FrameChoice,
    /// Scene of the first load case.
    pub scene: Scene,
    /// Number of load cases that repeat the scene.
    pub cases: usize,
    /// A different load case.
    pub second: Option<Scene>,
    /// True if the body is written and read before use.
    pub stored: bool,
    /// True if the scene is written and read before use.
    pub written: bool,
    /// True if rows of recoveries are those of `recover` for the table of the motion.
    pub by_table: bool,
}

impl Subject {
    /// Returns the checked model.
    ///
    /// # Errors
    /// The errors of [`FeModel::from_raw`].
    pub fn model(&self) -> Result<FeModel> {
        Ok(FeModel::from_raw(self.raw.clone())?.model)
    }

    /// Returns the settings of the conversion.
    pub fn settings(&self) -> ConvertSettings {
        let wanted = match self.basis {
            Basis::Lowest(count) => count,
            Basis::All | Basis::Fixed => usize::MAX,
        };
        let basis = match self.basis {
            Basis::Fixed => BasisChoice::CraigBampton(CraigBampton),
            Basis::Lowest(_) | Basis::All => BasisChoice::default(),
        };
        ConvertSettings {
            modes: ModeSettings { wanted: Wanted::Lowest(wanted), ..ModeSettings::default() },
            basis,
            frame: self.frame.clone(),
            lumped: Vec::new(),
            ..ConvertSettings::default()
        }
    }

    /// Returns the converted body.
    ///
    /// # Errors
    /// The errors of the conversion and of the file.
    pub fn body(&self) -> Result<FlexBody> {
        let body = convert(&self.model()?, &self.settings(), &Context::QUIET)?.body;
        if !self.stored {
            return Ok(body);
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("body.flex.h5");
        flexbody_file::write(&body, &path)?;
        flexbody_file::read(&path)
    }

    /// Returns the load cases.
    ///
    /// # Errors
    /// The errors of the scene file.
    pub fn scenes(&self) -> Result<Vec<Scene>> {
        if !self.written {
            return Ok(self.with_second(vec![self.scene.clone(); self.cases]));
        }
        let folder = tempfile::tempdir().expect("a folder");
        Ok(self.with_second(LoadCases::read(text::write(&self.scene, folder.path()), None)?.to_vec()))
    }

    fn with_second(&self, mut scenes: Vec<Scene>) -> Vec<Scene> {
        scenes.extend(self.second.clone());
        scenes
    }

    /// Returns the number of dimensions of the model.
    pub fn dimension(&self) -> usize {
        usize::from(self.raw.dimension)
    }
}
