//! Page that shows a body in motion.

use super::{FlexBody, Motion, ReportFormat};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_report::{Colouring, read_envelope};
use std::path::Path;

/// Motion of a body as pictures need it: of a simulation, or read from its file.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedMotion(pub(super) flexbody_file::RecordedMotion);

impl RecordedMotion {
    /// Reads the file of a simulation ([`Motion::write`], `flexbody simulate -o`).
    ///
    /// # Errors
    /// FB101 if the file cannot be read; FB734 if it is another file, one of another version, or a damaged one.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        flexbody_file::read_simulation(path).map(Self)
    }
}

impl From<&Motion> for RecordedMotion {
    fn from(motion: &Motion) -> Self {
        Self(flexbody_file::RecordedMotion::of(&motion.recording))
    }
}

/// Page that shows the modes of a body, or a simulation, in motion: one HTML file for any browser, which loads nothing
/// from elsewhere.
#[derive(Debug, Clone)]
pub struct View(flexbody_report::View);

impl FlexBody {
    /// Returns the page of `flexbody view`: of the modes, or of a motion.
    ///
    /// * `triangles`: largest number of triangles of the surface; `None` for as many as keep the page below 10 MB.
    ///
    /// # Errors
    /// FB735 for the motion of another body.
    pub fn view(&self, motion: Option<&RecordedMotion>, triangles: Option<usize>) -> Result<View> {
        flexbody_report::View::new(&self.0, triangles, motion.map(|motion| &motion.0), None).map(View)
    }

    /// Returns the page of `flexbody view --recovery`: the modes in the colours of the equivalent stress of a recovery.
    ///
    /// * `triangles`: as for [`FlexBody::view`].
    ///
    /// # Errors
    /// FB221 for a recovery that the body does not have or that cannot be drawn.
    pub fn view_recovery(&self, name: &str, triangles: Option<usize>) -> Result<View> {
        flexbody_report::View::new(&self.0, triangles, None, Some(Colouring::Recovery(name))).map(View)
    }

    /// Returns the page of `flexbody view --envelope`: the body, at rest or in a motion, in the colours of the largest
    /// equivalent stresses of a run.
    ///
    /// * `envelope`: table of [`Recovered::write_envelope`](super::Recovered::write_envelope) or of `--envelope FILE.csv`.
    /// * `triangles`: as for [`FlexBody::view`].
    ///
    /// # Errors
    /// FB101, FB106, FB203 and FB204 for a table that cannot be read, FB221 for stresses that cannot be drawn, FB735 for
    /// the motion of another body.
    pub fn view_envelope(
        &self,
        envelope: impl AsRef<Path>,
        motion: Option<&RecordedMotion>,
        triangles: Option<usize>,
    ) -> Result<View> {
        let envelope = read_envelope(envelope.as_ref())?;
        let colouring = Some(Colouring::Envelope(&envelope));
        flexbody_report::View::new(&self.0, triangles, motion.map(|motion| &motion.0), colouring).map(View)
    }
}

impl View {
    /// Returns the HTML of the page.
    pub fn html(&self) -> &str {
        self.0.html()
    }

    /// Writes the page, which appears whole or not at all.
    ///
    /// # Errors
    /// FB104, FB105 and FB602 if the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let slot = OutputSlot::prepare(path)?;
        slot.fill(self.html().as_bytes())?;
        slot.commit()
    }

    /// Returns the facts of the drawing that `flexbody view` prints; the page for [`ReportFormat::Html`].
    pub fn report(&self, format: ReportFormat) -> String {
        self.0.render(format.inner())
    }
}
