//! Export to the formats of other programs.

use super::progress::{NO_LISTENER, heard};
use super::{FlexBody, Motion, Scene};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_file::RecordedMotion;
use flexbody_formats::export::{self, AllowedLosses, Points};
use flexbody_formats::{FORMATS, export_in_units, find_format, motion_of_losses};
use flexbody_input::parse_units;
use std::path::Path;

/// Settings of an export. By default it has the first dialect of the format, its usual points, all modes and the units
/// of the body, and is refused if the format cannot hold
/// all of the body, apart from losses that are small or that only fast motions make large.
#[derive(Debug, Clone, Default)]
pub struct ExportOptions {
    points: Option<String>,
    dialect: Option<String>,
    units: Option<String>,
    modes: Option<usize>,
    motion: Option<RecordedMotion>,
    scene: Option<Scene>,
    allowed: AllowedLosses,
}

impl ExportOptions {
    /// Sets the places of the body in the file: `nodes`, `interfaces`, node numbers with commas, or both as in
    /// `interfaces,17,23`.
    pub fn points(mut self, points: impl Into<String>) -> Self {
        self.points = Some(points.into());
        self
    }

    /// Sets the dialect of the format.
    pub fn dialect(mut self, name: impl Into<String>) -> Self {
        self.dialect = Some(name.into());
        self
    }

    /// Sets the units of length, mass and time in the file, as in `mm,t,s`.
    pub fn to_units(mut self, units: impl Into<String>) -> Self {
        self.units = Some(units.into());
        self
    }

    /// Sets the number of modes in a picture (`vtk`, `gltf`), from the first.
    pub fn modes(mut self, count: usize) -> Self {
        self.modes = Some(count);
        self
    }

    /// Sets the motion that a picture (`vtk`, `gltf`) shows instead of modes.
    pub fn motion(mut self, motion: &Motion) -> Self {
        self.motion = Some(RecordedMotion::of(&motion.recording));
        self
    }

    /// Sets the motion that a picture shows, read from the file of a simulation.
    #[cfg(feature = "hdf5")]
    pub fn recorded_motion(mut self, motion: super::RecordedMotion) -> Self {
        self.motion = Some(motion.0);
        self
    }

    /// Sets the scene for which the errors of losses are stated that grow with the motion. Errors of deflections above
    /// 5 % need the permission to lose them.
    pub fn scene(mut self, scene: &Scene) -> Self {
        self.scene = Some(scene.clone());
        self
    }

    /// Writes the file even if the format cannot hold all of the body; every loss is then a warning.
    pub fn allow_loss(mut self) -> Self {
        self.allowed = AllowedLosses::All;
        self
    }

    /// Writes the file even if the format cannot hold the properties with these names, which the error of a loss states
    /// in brackets (`damping`, `rotations`, ...); these losses are then warnings.
    ///
    /// # Errors
    /// FB801 for an unknown name.
    pub fn allow_losses_of(mut self, names: Vec<String>) -> Result<Self> {
        self.allowed = AllowedLosses::named(names)?;
        Ok(self)
    }
}

impl FlexBody {
    /// Writes the body in a format of another program, given by its name on the command line
    /// (docs/reference/exports.md): the file, and further files beside it. Returns warnings and notes.
    ///
    /// # Errors
    /// FB801 for an unknown format, and for options that the format does not have; FB202 for unknown units; FB720 if the
    /// format cannot hold all of the body and loss is not allowed, or if no file of this format can be made of the body;
    /// FB735 for the motion of another body; FB104 and FB602 if a file cannot be written.
    pub fn export(
        &self,
        format: &str,
        path: impl AsRef<Path>,
        options: &ExportOptions,
    ) -> Result<Vec<Diagnostic>> {
        let (format, path) = (find_format(format)?, path.as_ref());
        let units = options.units.as_deref().map(parse_units).transpose()?;
        let points = options.points.as_deref().map(str::parse::<Points>).transpose()?;
        let mut asked = export::ExportOptions {
            dialect: options.dialect.clone(),
            points: points.unwrap_or_default(),
            modes: options.modes,
            motion: options.motion.clone(),
            name: Some(path.to_owned()),
            in_scene: Vec::new(),
        };
        if let Some(scene) = &options.scene {
            asked.in_scene =
                heard(NO_LISTENER, |context| motion_of_losses(&self.0, format, &asked, &scene.0, context))?;
        }
        let slot = OutputSlot::prepare(path)?;
        let (exported, diagnostics) =
            export_in_units(&self.0, format, &asked, units.as_ref(), options.allowed.clone())?;
        OutputSlot::commit_all(exported.fill(slot)?)?;
        Ok(diagnostics)
    }

    /// Returns the formats of [`FlexBody::export`]: the name of each, and the programs that read it.
    pub fn export_formats() -> Vec<(&'static str, &'static str)> {
        FORMATS.iter().map(|format| (format.name(), format.reader())).collect()
    }

    /// Returns the dialects of a format of [`FlexBody::export`], the default first; empty for a format with a single
    /// form.
    ///
    /// # Errors
    /// FB801 for an unknown format.
    pub fn export_dialects(format: &str) -> Result<&'static [&'static str]> {
        find_format(format).map(|format| format.dialects())
    }
}
