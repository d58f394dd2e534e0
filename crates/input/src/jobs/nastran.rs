//! Jobs of Nastran: a deck (.bdf, .dat, .nas), or a punch file with the grids of a superelement, and the matrices in it
//! or in its folder: DMIG cards, which name their rows, or OUTPUT4, whose rows follow the points.

mod bulk;
mod carried_mass;
mod constraints;
mod elimination;
mod matrices;
mod systems;

use super::{Found, JobFile, JobModel, JobReader, condensed};
use crate::bulk_cards::is_bulk_data;
use crate::node_files::NodeFile;
use crate::sets::{Edit, Item, Members, NodeSets, SetList};
use bulk::Bulk;
use elimination::GridPlaces;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_base::text::scanner::BadLines;
use flexbody_model::{Elements, NodeAxes as Axes, Nodes};
use matrices::Matrices;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use systems::Systems;

/// Number of bytes in which a deck is recognised: comments may precede its first card.
const DECK_HEAD: usize = 1 << 20;

/// Reader of Nastran jobs.
pub(super) struct Nastran;

impl JobReader for Nastran {
    fn name(&self) -> &'static str {
        "nastran"
    }

    fn needs(&self) -> &'static str {
        "job.bdf with DMIG cards, or with job.pch or job.op4 beside it"
    }

    fn recognises(&self, path: &Path) -> bool {
        InputFile::open_unread(path).is_ok_and(|file| is_bulk_data(&file.first_bytes(DECK_HEAD)))
    }

    fn names_matrices(&self) -> bool {
        true
    }

    fn read(&self, job: &JobFile) -> Found<JobModel> {
        let path = job.path.as_path();
        let mut bulk = Bulk::read(path)?;
        if bulk.grids.is_empty() {
            let diagnostic = Diagnostic::new(Code::DeckSyntax, "the deck has no GRID").in_file(path);
            return Err(vec![diagnostic.with_help("give the deck, or the punch file that has the grids")]);
        }
        let (nodes, axes) = places(&bulk)?;
        let dmigs = std::mem::take(&mut bulk.dmigs);
        let places = GridPlaces::new(&nodes, &axes);
        let matrices = Matrices::of(&bulk, dmigs, job, &places)?;
        let mut diagnostics = deck_notes(&bulk, path);
        let matrices = matrices.without_followers(&mut diagnostics).turned(&axes)?;
        let matrices = matrices.without_empty_rows(&mut diagnostics);
        matrices.refuse_modal(&bulk)?;
        if bulk.is_condensed() {
            diagnostics.push(condensed(matrices.grids(&bulk), &matrices.stiffness.path));
        }
        let sets = bulk.sets.of(&bulk.grids);
        let mut files: Vec<(&'static str, SeenFile)> =
            bulk.files.iter().map(|file| ("deck", file.clone())).collect();
        files.extend(matrices.files.iter().map(|file| ("matrices", file.clone())));
        let followers = matrices.carried(&nodes, &axes);
        let given_rows = matrices.given_rows(axes);
        let Matrices { stiffness, mass, labels: dofs, .. } = matrices;
        // With condensed matrices no element has all of its nodes.
        let elements = if bulk.is_condensed() { Elements::default() } else { bulk.elements };
        Ok(JobModel {
            stiffness,
            mass,
            nodes,
            dofs,
            given_rows,
            followers,
            sets,
            elements,
            files,
            diagnostics,
        })
    }
}

/// Returns the positions of the grids in the basic system, and the row axes of grids with other axes than the basic
/// ones.
fn places(bulk: &Bulk) -> Found<(Nodes, HashMap<i64, Axes>)> {
    let mut systems = Systems::new(&bulk.systems, &bulk.grids);
    let (mut nodes, mut axes, mut bad) = (Nodes::default(), HashMap::new(), Vec::new());
    for (&id, grid) in &bulk.grids {
        let found = systems.position(grid).and_then(|x| Ok((x, systems.axes(grid, x)?)));
        match found {
            Ok((x, axes_of_grid)) => {
                nodes.ids.push(id);
                nodes.positions.push(x);
                if grid.axes.is_some_and(|system| system != 0) {
                    axes.insert(id, axes_of_grid);
                }
            }
            Err(diagnostic) if bad.len() < BadLines::MAX_SHOWN => bad.push(match diagnostic.file() {
                None => diagnostic
                    .about(format!("grid {id}"))
                    .in_file(&bulk.card_files[grid.file])
                    .at_line(grid.line),
                Some(_) => diagnostic,
            }),
            Err(_) => {}
        }
    }
    bad.dedup();
    if bad.is_empty() { Ok((nodes, axes)) } else { Err(bad) }
}

/// Returns the grids, sets and elements of a deck for matrices from other files.
///
/// # Errors
/// The errors of [`Bulk::read`]; FB111 if rows of grids are along other axes than those of the basic system.
pub(crate) fn nodes_of_bulk(path: &Path) -> Found<NodeFile> {
    let bulk = Bulk::read(path)?;
    let (nodes, axes) = places(&bulk)?;
    if let Some(grid) = axes.keys().min() {
        let message = format!(
            "rows of {} grids are along the axes of their CD, the first of them grid {grid}: matrices that are not of this job cannot be transformed to the axes of the model",
            axes.len()
        );
        let diagnostic = Diagnostic::new(Code::DeckUnsupported, message).in_file(path);
        return Err(vec![diagnostic.with_help("give the deck as the model, with its matrices beside it")]);
    }
    let sets = bulk.sets.of(&bulk.grids);
    let followers = bulk.constraints.followers();
    Ok(NodeFile { nodes, sets, elements: bulk.elements, followers, ..NodeFile::default() })
}

/// Returns warnings and notes about the deck.
fn deck_notes(bulk: &Bulk, path: &Path) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    if bulk.has_elements && !bulk.coupled_mass {
        let message = "the deck does not ask for coupled masses (PARAM,COUPMASS,1): Nastran lumps them";
        found.push(Diagnostic::new(Code::DeckLumps, message).in_file(path));
    }
    if let Some((path, line, count)) = &bulk.supports {
        let message = match count {
            1 => "a card supports the body".to_owned(),
            _ => format!("{count} cards support the body"),
        };
        found.push(Diagnostic::new(Code::DeckSupports, message).in_file(path).at_line(*line));
    }
    found
}

// Sections of a deck above the bulk data: SET of the case control (numbers, ranges and exceptions, which may continue
// in further lines), and ASSIGN of the file management section (the files that OUTPUT4 writes).

/// Lines of case control with sets.
#[derive(Default)]
struct SetLines {
    lines: Vec<String>,
    continues: bool,
}

impl SetLines {
    /// Reads a line of case control.
    fn line(&mut self, line: &str) {
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
    fn of<T>(&self, nodes: &BTreeMap<i64, T>) -> NodeSets {
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
struct Assigned {
    statements: Vec<String>,
    continues: bool,
}

impl Assigned {
    /// Reads a line above the bulk data.
    fn line(&mut self, line: &str) {
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
    fn outputs(&self, deck: &Path) -> Vec<PathBuf> {
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
