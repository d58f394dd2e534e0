//! SID_FEM as a format of other programs.

use super::arrays::{Arrays, FrameArrays};
use super::body::{Declared, body};
use super::checks::checks;
use super::layout::Layout;
use super::parse::Listed;
use crate::error::Result;
use crate::foreign::{Foreign, ForeignFormat};
use crate::input::InputFile;

/// SID_FEM text (Wallrapp, Standard Input Data).
pub struct SidFile;

/// Bytes at the beginning in which the first keywords must be.
const HEAD: usize = 4096;

impl ForeignFormat for SidFile {
    fn name(&self) -> &'static str {
        "sid"
    }

    fn recognises(&self, file: &InputFile) -> bool {
        let bytes = file.bytes();
        let head = String::from_utf8_lossy(&bytes[..bytes.len().min(HEAD)]).to_lowercase();
        let mut lines = head.lines().map(str::trim).filter(|line| !line.is_empty()).take(3);
        let part = lines.by_ref().take(2).any(|line| line == "part");
        part && head.contains("new modal")
    }

    fn read(&self, file: &InputFile) -> Result<Foreign> {
        // Names may be of any encoding, keywords and numbers are ASCII.
        let text = String::from_utf8_lossy(file.bytes());
        let listed = Listed::read(file.path(), &text)?;
        let digits = listed.digits();
        let arrays = Arrays::new(&listed, digits);
        let frames: Vec<FrameArrays> =
            listed.frames.iter().map(|frame| FrameArrays::new(frame, &listed, digits)).collect();
        let layout = Layout::detect(&listed, &arrays);
        let mut declared = Declared::of(&listed.comment);
        // A file with geometric stiffness for acceleration has that for spin too.
        declared.stiffened = declared.stiffened.or((arrays.ct.sizes()[1] > 0.0).then_some(true));
        let found = checks(&listed, &arrays, &frames, &layout, &declared);
        let (body, mut notes) = body(&listed, &arrays, frames, &declared, found.spin_in_oe);
        notes.insert(0, layout.reason);
        Ok(Foreign { format: "sid", dialect: layout.dialect.to_owned(), notes, checks: found.checks, body })
    }
}
