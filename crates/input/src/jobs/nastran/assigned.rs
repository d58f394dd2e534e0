//! ASSIGN of the file management section: the files that OUTPUT4 writes.

use std::path::{Path, PathBuf};

/// Lines of a deck above its bulk data that assign files.
#[derive(Default)]
pub(super) struct Assigned {
    statements: Vec<String>,
    continues: bool,
}

impl Assigned {
    /// Reads a line above the bulk data.
    pub(super) fn line(&mut self, line: &str) {
        let line = line.trim();
        let first = line.split([' ', '\t', ',']).next().unwrap_or_default();
        let is_assign = first.len() >= 4 && "ASSIGN".starts_with(&first.to_ascii_uppercase());
        if self.continues
            && let Some(last) = self.statements.last_mut()
        {
            last.push_str(line);
        } else if is_assign {
            self.statements.push(line[first.len()..].to_owned());
        }
        self.continues = (self.continues || is_assign) && line.ends_with(',');
    }

    /// Returns the files of OUTPUT4, in the order of the deck at `deck`. A file that is missing at the path in the deck
    /// is looked up by its name in the folder of the deck, as after a move of the run; if it is missing there too, the
    /// path of the deck is returned.
    pub(super) fn outputs(&self, deck: &Path) -> Vec<PathBuf> {
        let folder = deck.parent().unwrap_or(Path::new(""));
        let mut files = Vec::new();
        for name in self.statements.iter().filter_map(|statement| output(statement)) {
            let stated = folder.join(name);
            // Decks of other operating systems have other separators.
            let last = name.rsplit(['/', '\\']).next().unwrap_or(name);
            let beside = folder.join(last);
            let file = if !stated.is_file() && beside.is_file() { beside } else { stated };
            if !files.contains(&file) {
                files.push(file);
            }
        }
        files
    }
}

/// Returns the file of a statement `OUTPUT4='name',UNIT=12,FORM=FORMATTED`.
fn output(statement: &str) -> Option<&str> {
    let statement = statement.trim_start_matches([' ', '\t', ',']);
    let (kind, rest) = statement.split_once('=')?;
    if !kind.trim().eq_ignore_ascii_case("OUTPUT4") {
        return None;
    }
    let rest = rest.trim_start();
    let name = match rest.chars().next()? {
        quote @ ('\'' | '"') => rest[1..].split(quote).next()?,
        _ => rest.split([',', ' ', '\t']).next()?,
    };
    let name = name.trim();
    (!name.is_empty()).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_output4_are_those_that_assign_names() {
        let mut all = Assigned::default();
        for line in [
            "ASSIGN OUTPUT4='kgg.op4',UNIT=31,FORM=FORMATTED",
            "assign output4 = \"runs/m gg.op4\" unit=32,",
            "   delete",
            "ASSIGN OUTPUT2='job.op2',UNIT=12",
            "ASSI,OUTPUT4=third.op4,UNIT=33",
            "SOL 103",
            "ASSIGN OUTPUT4='kgg.op4',UNIT=34",
            "ASSIGN OUTPUT4",
            "ASSIGN OUTPUT4=",
        ] {
            all.line(line);
        }
        let names = ["kgg.op4", "runs/m gg.op4", "third.op4"];
        assert_eq!(all.outputs(Path::new("there/job.bdf")), names.map(|name| Path::new("there").join(name)));
    }
}
