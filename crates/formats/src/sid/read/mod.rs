//! SID_FEM as an import format, recognised by its keywords.

mod arrays;
mod body;
mod checks;
mod frame_checks;
mod lines;
mod parse;
mod taylor;

use crate::import::{AuditCheck, ImportFormat, ImportedFile};
use arrays::FrameArrays;
use body::{Declared, Layout, arrays_in_order, body};
use checks::checks;
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_base::text::InputFile;
use parse::Listed;

/// SID_FEM text (Wallrapp, Standard Input Data).
pub(crate) struct SidFile;

/// Number of bytes within which the first keywords must occur.
const HEAD: usize = 4096;

/// Returns the frames whose axes differ from a rotation by more than few digits can explain.
fn unsound(checks: &[AuditCheck]) -> Vec<String> {
    const FEW_DIGITS: f64 = 1e-2;
    let broken = |check: &&AuditCheck| {
        check.code == Code::AuditFrame && (check.value > FEW_DIGITS || check.value.is_nan())
    };
    checks.iter().filter(broken).map(|check| check.meaning.clone()).collect()
}

impl ImportFormat for SidFile {
    fn name(&self) -> &'static str {
        "sid"
    }

    fn recognises(&self, file: &InputFile) -> bool {
        let bytes = file.bytes();
        let head = String::from_utf8_lossy(&bytes[..bytes.len().min(HEAD)]).to_lowercase();
        head.lines().any(|line| line.trim() == "part") && head.contains("new modal")
    }

    fn read(&self, file: &InputFile) -> Result<ImportedFile> {
        // Names may have any encoding; keywords and numbers are ASCII.
        let text = String::from_utf8_lossy(file.bytes());
        let mut listed = Listed::read(file.path(), &text)?;
        let digits = listed.digits();
        let arrays = arrays_in_order(&mut listed, digits);
        let frames: Vec<FrameArrays> =
            listed.frames.iter().map(|frame| FrameArrays::new(frame, &listed, digits)).collect();
        let layout = Layout::detect(&listed, &arrays);
        let mut declared = Declared::of(&listed.comment);
        // A file with geometric stiffness for acceleration has it for spin too.
        declared.stiffened = declared.stiffened.or((arrays.ct.sizes()[1] > 0.0).then_some(true));
        let found = checks(&listed, &arrays, &frames, &layout, &declared);
        let (body, mut notes) = body(&listed, &arrays, frames, &declared, found.spin_in_oe);
        notes.insert(0, layout.reason);
        let inferred = listed.inferred();
        if !inferred.is_empty() {
            let names = inferred.join(", ");
            notes
                .push(format!("{names} have no `structure`: it is inferred from the entries that they list"));
        }
        Ok(ImportedFile {
            format: "sid",
            dialect: layout.dialect.to_owned(),
            notes,
            unsound: unsound(&found.checks),
            checks: found.checks,
            body,
        })
    }
}
