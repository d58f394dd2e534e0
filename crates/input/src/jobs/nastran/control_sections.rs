//! Sections of a deck above the bulk data: SET of the case control (numbers, ranges and exceptions, which may continue
//! in further lines), and ASSIGN of the file management section (the files that OUTPUT4 writes).

use crate::sets::{Edit, Item, Members, NodeSets, SetList};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Lines of case control with sets.
#[derive(Default)]
pub(super) struct SetLines {
    lines: Vec<String>,
    continues: bool,
}

impl SetLines {
    /// Reads a line of case control.
    pub(super) fn line(&mut self, line: &str) {
        let line = line.trim();
        let words: Vec<&str> = line.split_whitespace().collect();
        let is_set = words.first().is_some_and(|word| word.eq_ignore_ascii_case("SET")) && line.contains('=');
        if self.continues
            && let Some(last) = self.lines.last_mut()
        {
            last.push(' ');
            last.push_str(line);
        } else if is_set {
            self.lines.push(line.to_owned());
        }
        self.continues = (self.continues || is_set) && line.ends_with(',');
    }

    /// Returns the sets with those members that are nodes, each by its number and as `SET5`.
    pub(super) fn of<T>(&self, nodes: &BTreeMap<i64, T>) -> NodeSets {
        let mut sets = SetList::default();
        for line in &self.lines {
            let Some((number, edits)) = parsed(line) else { continue };
            let name = format!("SET{number}");
            // A set that is defined again in another subcase is another set: the last one is used.
            sets.forget(&name);
            sets.forget(&number.to_string());
            let set = sets.add(&name, vec![Item::own(Members::Edited(edits))]);
            let same = Item::own(Members::Set(sets.all_of(set)));
            sets.add(&number.to_string(), vec![same]);
        }
        let ids: Vec<i64> = nodes.keys().copied().collect();
        NodeSets::of_nodes(&ids, sets)
    }
}

/// Returns the number of a set and the steps by which its members are selected.
fn parsed(line: &str) -> Option<(i64, Vec<Edit>)> {
    let (head, members) = line.split_once('=')?;
    let number: i64 = head.split_whitespace().nth(1)?.parse().ok()?;
    let mut edits = Vec::new();
    // Exceptions are taken out of the last range; numbers beyond it are members again.
    let (mut range, mut except) = (None, false);
    let mut words = members.split([',', ' ', '\t']).filter(|word| !word.is_empty()).peekable();
    while let Some(word) = words.next() {
        if word.eq_ignore_ascii_case("EXCEPT") {
            except = true;
            continue;
        }
        if word.eq_ignore_ascii_case("ALL") {
            edits.push(Edit::Add { first: i64::MIN, last: i64::MAX });
            continue;
        }
        let first: i64 = word.parse().ok()?;
        if words.next_if(|word| word.eq_ignore_ascii_case("THRU")).is_some() {
            let last: i64 = words.next()?.parse().ok()?;
            let listed_range = (first <= last).then_some(first..=last)?;
            edits.push(Edit::Add { first, last });
            (range, except) = (Some(listed_range), false);
        } else if except && range.as_ref().is_some_and(|range| range.contains(&first)) {
            edits.push(Edit::Remove(first));
        } else {
            except = false;
            edits.push(Edit::Add { first, last: first });
        }
    }
    Some((number, edits))
}

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
    fn sets_have_ranges_exceptions_and_further_lines() {
        let mut lines = SetLines::default();
        for line in [
            "TITLE = A SET",
            "SET 5 = 1 THRU 6 EXCEPT 2, 4,",
            "  9, 12",
            "set 7 = ALL",
            "DISP = 5",
            "SET 8 = 3",
        ] {
            lines.line(line);
        }
        let nodes: BTreeMap<i64, ()> = [1, 2, 3, 4, 6, 9, 11].map(|id| (id, ())).into();
        let sets = lines.of(&nodes);
        let of = |name: &str| sets.find(name).expect("a set").expect("resolved");
        // Numbers beyond the range are members again.
        assert_eq!(of("SET5"), [1, 3, 6, 9]);
        assert_eq!(of("7"), [1, 2, 3, 4, 6, 9, 11]);
        assert_eq!(of("8"), [3]);
        assert_eq!(sets.names().count(), 6);
    }

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
