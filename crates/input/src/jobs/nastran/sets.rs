//! SET of the case control: numbers, ranges and exceptions, which may continue in further lines.

use crate::node_file::NodeSets;
use std::collections::{BTreeMap, BTreeSet};

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
        let mut sets = Vec::new();
        for line in &self.lines {
            let Some((number, members)) = parsed(line, nodes) else { continue };
            for name in [format!("SET{number}"), number.to_string()] {
                // A set that is defined again in another subcase is another set: the last one is used.
                sets.retain(|(key, _): &(String, Vec<i64>)| *key != name);
                sets.push((name, members.clone()));
            }
        }
        sets
    }
}

fn parsed<T>(line: &str, nodes: &BTreeMap<i64, T>) -> Option<(i64, Vec<i64>)> {
    let (head, members) = line.split_once('=')?;
    let number: i64 = head.split_whitespace().nth(1)?.parse().ok()?;
    let mut listed = BTreeSet::new();
    // Exceptions are taken out of the last range; numbers beyond it are members again.
    let (mut range, mut except) = (None, false);
    let mut words = members.split([',', ' ', '\t']).filter(|word| !word.is_empty()).peekable();
    while let Some(word) = words.next() {
        if word.eq_ignore_ascii_case("EXCEPT") {
            except = true;
            continue;
        }
        if word.eq_ignore_ascii_case("ALL") {
            listed.extend(nodes.keys().copied());
            continue;
        }
        let first: i64 = word.parse().ok()?;
        if words.next_if(|word| word.eq_ignore_ascii_case("THRU")).is_some() {
            let last: i64 = words.next()?.parse().ok()?;
            let listed_range = (first <= last).then_some(first..=last)?;
            listed.extend(nodes.range(listed_range.clone()).map(|(id, _)| *id));
            (range, except) = (Some(listed_range), false);
        } else if except && range.as_ref().is_some_and(|range| range.contains(&first)) {
            listed.remove(&first);
        } else {
            except = false;
            listed.extend(nodes.contains_key(&first).then_some(first));
        }
    }
    Some((number, listed.into_iter().collect()))
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
        let of = |name: &str| sets.iter().find(|(key, _)| key == name).expect("a set").1.clone();
        // Numbers beyond the range are members again.
        assert_eq!(of("SET5"), [1, 3, 6, 9]);
        assert_eq!(of("7"), [1, 2, 3, 4, 6, 9, 11]);
        assert_eq!(of("8"), [3]);
        assert_eq!(sets.len(), 6);
    }
}
