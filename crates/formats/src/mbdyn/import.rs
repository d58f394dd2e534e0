//! MBDyn as an import format, recognised by its record groups.

use super::checks::checks;
use super::read::body::{COUPLING, body, from_masses};
use super::read::records::Records;
use super::read::words::{GROUP, Surplus};
use crate::import::{ImportFormat, ImportedFile};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::text::InputFile;

/// Import format of MBDyn.
pub(crate) struct Mbdyn;

/// Number of bytes within which the first record group must begin.
const HEAD: usize = 1 << 16;

impl ImportFormat for Mbdyn {
    fn name(&self) -> &'static str {
        "mbdyn"
    }

    fn recognises(&self, file: &InputFile) -> bool {
        let head = &file.bytes()[..file.bytes().len().min(HEAD)];
        head.split(|byte| *byte == b'\n').any(|line| line.starts_with(GROUP.as_bytes()))
    }

    fn read(&self, file: &InputFile) -> Result<ImportedFile> {
        let records = Records::read(file)?;
        let Some(read) = body(&records) else {
            let message = "the file has no mass and inertia: record groups 11 and 12 are both missing";
            return Err(Diagnostic::new(Code::ForeignIncomplete, message).in_file(file.path()).into());
        };
        let newest = (1..=19).rev().find(|group| records.has(*group)).unwrap_or(10);
        let dialect = if newest > 13 { "level19" } else { "level13" };
        Ok(ImportedFile {
            format: "mbdyn",
            dialect: dialect.to_owned(),
            notes: notes(&records, newest),
            checks: checks(&records, &read),
            unsound: unsound(&records),
            body: read.body,
        })
    }
}

/// Returns the defects of a file with nonzero numbers that MBDyn skips: the header states other counts of
/// nodes or modes than the file has, and matrices are read wrongly.
fn unsound(records: &Records) -> Vec<String> {
    let numbers = records.skipped.iter().filter(|(_, surplus)| surplus.numbers && !surplus.zero);
    let sentence = |(group, surplus): &(Option<usize>, Surplus)| {
        let place = group
            .map_or_else(|| "before record group 1".to_owned(), |group| format!("of record group {group}"));
        format!("line {}: {} words {place} exceed the count in the header", surplus.line, surplus.words)
    };
    numbers.map(sentence).collect()
}

fn notes(records: &Records, newest: usize) -> Vec<String> {
    let mut notes = vec![
        format!("revision {}, {} nodes, {} modes", records.revision, records.n_nodes, records.n_modes),
        format!(
            "the last record group is {newest}; programs that do not know groups 14 to 19 reject files with a group above 13"
        ),
    ];
    if from_masses(records) {
        notes.push(
            "the invariants are computed from the lumped masses, as MBDyn does; MBDyn uses invariant 9 only if the joint has `use invariant 9`"
                .to_owned(),
        );
    }
    if COUPLING.iter().any(|group| records.has(*group)) {
        notes.push("invariants 4 and 8 are taken about the origin of the nodes: MBDyn does not move them with the origin of the joint".to_owned());
    }
    if records.general {
        notes.push(
            "the file states that the mass does not commute with rotations: record groups 9 and 18 need not agree"
                .to_owned(),
        );
    }
    let moves = |group: usize| records.get(group).is_some_and(|values| values.iter().any(|v| *v != 0.0));
    if moves(3) || moves(4) {
        notes.push(
            "the initial values of the modes (record groups 3 and 4) are not converted: a body has none"
                .to_owned(),
        );
    }
    if !records.ended {
        notes.push("the last line `** END OF FILE` is missing".to_owned());
    }
    notes
}
