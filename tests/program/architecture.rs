//! The arrows between the rooms of `src/`, and the rules that keep the library a library (`ARCHITECTURE.md`).
//!
//! Sources are read as tokens: comments, strings and documentation examples do not count, and neither do
//! modules under `#[cfg(test)]`.

use proc_macro2::{Delimiter, Ident, Spacing, TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Rows of the table of rooms in `ARCHITECTURE.md`: the rooms of a row, and what each of them uses.
fn table() -> Vec<(Vec<String>, BTreeSet<String>)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md");
    let text = std::fs::read_to_string(path).expect("ARCHITECTURE.md");
    let section = text.split("\n## ").find(|s| s.starts_with("Rooms")).expect("a section about rooms");
    let names = |cell: &str| -> Vec<String> {
        cell.split('`').skip(1).step_by(2).map(|name| name.trim_end_matches('/').to_owned()).collect()
    };
    let rows: Vec<Vec<&str>> = section
        .lines()
        .filter(|line| line.starts_with("| `"))
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect();
    let all: BTreeSet<String> = rows.iter().flat_map(|row| names(row[0])).collect();
    let uses = |row: &[&str]| match row[2] {
        "all" => all.clone(),
        "each other" => names(row[0]).into_iter().collect(),
        uses => names(uses).into_iter().collect(),
    };
    rows.iter().map(|row| (names(row[0]), uses(row))).collect()
}

/// Each room and what it may use besides itself and [`BASE`].
fn rooms() -> BTreeMap<String, BTreeSet<String>> {
    table().into_iter().flat_map(|(names, uses)| names.into_iter().map(move |n| (n, uses.clone()))).collect()
}

/// What every room may use.
const BASE: &[&str] = &["base"];

/// Crates, or parts of crates, that only these rooms may name.
const OWNED: &[(&[&str], &[&str])] = &[
    (&["hdf5_metno"], &["base", "input", "formats"]),
    (&["faer", "sparse"], &["numerics"]),
    (&["metis_sys"], &["numerics"]),
    (&["clap"], &["cli"]),
    (&["indicatif"], &["cli"]),
];

/// Macros that only the command line may use.
const PRINTING: &[&str] = &["print", "println", "eprint", "eprintln", "dbg"];

/// Macros that say that something is missing.
const UNFINISHED: &[&str] = &["todo", "unimplemented"];

const LONGEST_FILE: usize = 700;

/// A path written in a source file, with the line it stands on: `crate::a::b` is ["crate", "a", "b"].
struct Written {
    path: Vec<String>,
    line: usize,
}

/// Every finding in one file of `room`, as `line: what`.
fn findings(room: &str, depth: usize, source: &str) -> Vec<String> {
    let rooms = rooms();
    let tokens = tokens(source);
    let mut found = Vec::new();
    let mut say = |line: usize, what: String| found.push(format!("{line}: {what}"));
    for Written { path, line } in &all_paths(&tokens) {
        let names: Vec<&str> = path.iter().map(String::as_str).collect();
        let supers = names.iter().take_while(|n| **n == "super").count();
        if supers > 0 && supers >= depth {
            say(*line, "leaves its room through `super`: write `crate::` instead".to_owned());
        }
        if let Some(target) = room_used(path, room, &rooms)
            && !BASE.contains(&target)
            && !rooms.get(room).is_some_and(|uses| uses.contains(target))
        {
            say(*line, format!("`{room}` may not use `{target}`"));
        }
        for (owned, owners) in OWNED {
            if names.starts_with(owned) && !owners.contains(&room) {
                say(*line, format!("only {} may name `{}`", owners.join(", "), owned.join("::")));
            }
        }
        if names.ends_with(&["process", "exit"]) && room != "cli" {
            say(*line, "the library does not exit".to_owned());
        }
    }
    calls(&tokens, &mut |name, line| {
        if PRINTING.contains(&name) && room != "cli" {
            say(line, format!("the library does not print: `{name}!`"));
        } else if UNFINISHED.contains(&name) {
            say(line, format!("unfinished: `{name}!`"));
        } else if name == ".unwrap" && room != "cli" {
            say(
                line,
                "the library does not unwrap: return an error, or `expect` the reason it cannot fail"
                    .to_owned(),
            );
        }
    });
    found
}

/// The other room that a path leads into.
fn room_used<'a>(
    path: &'a [String],
    room: &str,
    rooms: &BTreeMap<String, BTreeSet<String>>,
) -> Option<&'a str> {
    let [first, target, ..] = path else { return None };
    let own = first == "crate" || first == "flexbody";
    (own && target != room && rooms.contains_key(target)).then_some(target)
}

/// The tokens of a source file, without its tests.
fn tokens(source: &str) -> Vec<TokenTree> {
    without_tests(source.parse().expect("the file compiles"))
}

fn all_paths(tokens: &[TokenTree]) -> Vec<Written> {
    let mut paths = Vec::new();
    written_paths(tokens, &[], &mut paths);
    paths
}

/// Drops every item under `#[cfg(test)]`: its attribute, and all up to its braces or semicolon.
fn without_tests(tokens: TokenStream) -> Vec<TokenTree> {
    let mut kept = Vec::new();
    let mut tokens = tokens.into_iter().peekable();
    while let Some(token) = tokens.next() {
        let is_hash = matches!(&token, TokenTree::Punct(p) if p.as_char() == '#');
        let is_test = is_hash
            && matches!(tokens.peek(), Some(TokenTree::Group(g)) if g.stream().to_string().replace(' ', "") == "cfg(test)");
        if is_test {
            for skipped in tokens.by_ref() {
                let ends = match &skipped {
                    TokenTree::Group(g) => g.delimiter() == Delimiter::Brace,
                    TokenTree::Punct(p) => p.as_char() == ';',
                    _ => false,
                };
                if ends {
                    break;
                }
            }
        } else if let TokenTree::Group(group) = &token {
            let mut inner = proc_macro2::Group::new(
                group.delimiter(),
                without_tests(group.stream()).into_iter().collect(),
            );
            inner.set_span(group.span());
            kept.push(TokenTree::Group(inner));
        } else {
            kept.push(token);
        }
    }
    kept
}

/// All paths `a::b::c`, those of `use a::{b, c::d}` trees written out.
fn written_paths(tokens: &[TokenTree], prefix: &[String], paths: &mut Vec<Written>) {
    let mut i = 0;
    while i < tokens.len() {
        match &tokens[i] {
            TokenTree::Ident(first) => {
                let mut path: Vec<String> = prefix.to_vec();
                path.push(name(first));
                let line = first.span().start().line;
                let mut is_tree = false;
                i += 1;
                while is_colons(&tokens[i..]) {
                    match tokens.get(i + 2) {
                        Some(TokenTree::Ident(next)) => path.push(name(next)),
                        Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Brace => {
                            let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                            written_paths(&inner, &path, paths);
                            is_tree = true;
                        }
                        _ => {} // a glob or a turbofish ends the path
                    }
                    i += 3;
                }
                if !is_tree {
                    paths.push(Written { path, line });
                }
            }
            TokenTree::Group(group) => {
                let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                written_paths(&inner, &[], paths);
                i += 1;
            }
            _ => i += 1,
        }
    }
}

fn name(ident: &Ident) -> String {
    ident.to_string().trim_start_matches("r#").to_owned()
}

fn is_colons(tokens: &[TokenTree]) -> bool {
    let colon = |t: Option<&TokenTree>, spacing: Option<Spacing>| matches!(t, Some(TokenTree::Punct(p)) if p.as_char() == ':' && spacing.is_none_or(|s| p.spacing() == s));
    colon(tokens.first(), Some(Spacing::Joint)) && colon(tokens.get(1), None)
}

/// Names of all macros (`name` before `!`) and of calls of `unwrap` (as `.unwrap`).
fn calls(tokens: &[TokenTree], say: &mut impl FnMut(&str, usize)) {
    for (i, token) in tokens.iter().enumerate() {
        match token {
            TokenTree::Group(group) => calls(&group.stream().into_iter().collect::<Vec<_>>(), say),
            TokenTree::Ident(ident) => {
                let is = |at: Option<&TokenTree>, c: char| matches!(at, Some(TokenTree::Punct(p)) if p.as_char() == c);
                let line = ident.span().start().line;
                if is(tokens.get(i + 1), '!') {
                    say(&name(ident), line);
                } else if name(ident) == "unwrap"
                    && i > 0
                    && (is(tokens.get(i - 1), '.') || is(tokens.get(i - 1), ':'))
                {
                    say(".unwrap", line);
                }
            }
            _ => {}
        }
    }
}

fn source_root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Every source file below `folder`.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).expect("source folder") {
        let path = entry.expect("source folder").path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// The room of a file below `src/` and the depth of its module (`crate::a` is 1); `lib.rs` is no room;
/// `main.rs` and its module `process.rs` belong to the command line.
fn room_of(relative: &Path) -> Option<(String, usize)> {
    let parts: Vec<String> =
        relative.iter().map(|p| p.to_string_lossy().trim_end_matches(".rs").to_owned()).collect();
    match parts[0].as_str() {
        "lib" => None,
        "main" | "process" => Some(("cli".to_owned(), 1)),
        room => {
            let is_mod = parts[parts.len() - 1] == "mod";
            Some((room.to_owned(), parts.len() - usize::from(is_mod)))
        }
    }
}

#[test]
fn rooms_use_only_what_they_may_and_the_library_never_prints_exits_or_unwraps() {
    let mut wrong = Vec::new();
    for file in rust_files(&source_root()) {
        let relative = file.strip_prefix(source_root()).expect("below src");
        if let Some((room, depth)) = room_of(relative) {
            let source = std::fs::read_to_string(&file).expect("source file");
            let all = findings(&room, depth, &source);
            wrong.extend(all.into_iter().map(|f| format!("src/{}:{f}", relative.display())));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_table_of_rooms_says_what_the_sources_do() {
    let rooms = rooms();
    assert_eq!(
        rooms.len(),
        table().iter().map(|(names, _)| names.len()).sum::<usize>(),
        "a room stands twice"
    );
    let mut used: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for file in rust_files(&source_root()) {
        let Some((room, _)) = room_of(file.strip_prefix(source_root()).expect("below src")) else { continue };
        let source = std::fs::read_to_string(&file).expect("source file");
        let all = used.entry(room.clone()).or_default();
        for Written { path, .. } in all_paths(&tokens(&source)) {
            all.extend(room_used(&path, &room, &rooms).map(str::to_owned));
        }
    }
    let named: Vec<_> = rooms.keys().collect();
    assert_eq!(named, used.keys().collect::<Vec<_>>(), "rooms of the table, rooms of src/");
    for (room, uses) in &rooms {
        // The command line stands on everything; everything may report errors.
        let listed = uses.iter().filter(|u| *u != room && room != "cli" && !BASE.contains(&u.as_str()));
        let idle: Vec<_> = listed.filter(|u| !used[room].contains(*u)).collect();
        assert!(idle.is_empty(), "the table says that `{room}` uses {idle:?}, but it does not");
    }
}

#[test]
fn arrows_make_no_circle() {
    // Rooms use only rooms of their own row or of rows above.
    let mut above = BTreeSet::new();
    for (names, uses) in table() {
        above.extend(names.iter().cloned());
        let below: Vec<_> = uses.difference(&above).collect();
        assert!(below.is_empty(), "{names:?} use {below:?}, which stand below");
    }
}

/// A source file as a module: its path below the crate, and every path that it writes, from the root of the
/// crate.
struct Module {
    name: Vec<String>,
    /// `mod.rs`: declarations and re-exports alone.
    is_index: bool,
    uses: Vec<Vec<String>>,
}

fn modules() -> Vec<Module> {
    let root = source_root();
    let files = rust_files(&root)
        .into_iter()
        .filter(|file| room_of(file.strip_prefix(&root).expect("below src")).is_some());
    let named: Vec<(Vec<String>, bool, PathBuf)> = files
        .map(|file| {
            let relative = file.strip_prefix(&root).expect("below src");
            let mut name: Vec<String> = relative
                .iter()
                .map(|part| part.to_string_lossy().trim_end_matches(".rs").to_owned())
                .collect();
            let is_index = name.last().is_some_and(|last| last == "mod");
            name.truncate(name.len() - usize::from(is_index));
            (name, is_index, file)
        })
        .collect();
    let known: BTreeSet<Vec<String>> = named.iter().map(|(name, ..)| name.clone()).collect();
    let read = |(name, is_index, file): (Vec<String>, bool, PathBuf)| {
        let source = std::fs::read_to_string(file).expect("source file");
        let written = all_paths(&tokens(&source));
        let uses = written.iter().filter_map(|written| from_root(&written.path, &name, &known)).collect();
        Module { name, is_index, uses }
    };
    named.into_iter().map(read).collect()
}

/// A path as written in the module `name`, from the root of the crate; none where it leads out of the crate.
fn from_root(path: &[String], name: &[String], known: &BTreeSet<Vec<String>>) -> Option<Vec<String>> {
    let supers = path.iter().take_while(|part| *part == "super").count();
    let (base, rest) = match path.first()?.as_str() {
        "crate" => (&name[..0], &path[1..]),
        "self" => (name, &path[1..]),
        "super" => (&name[..name.len().checked_sub(supers)?], &path[supers..]),
        _ if known.contains(&[name, &path[..1]].concat()) => (name, path),
        _ => return None,
    };
    Some([base, rest].concat())
}

/// The file that holds what a path means: the longest module in it, or where the index of that module has it
/// from.
fn holder(path: &[String], modules: &BTreeMap<Vec<String>, &Module>) -> Option<Vec<String>> {
    let depth = (1..=path.len()).rev().find(|&depth| modules.contains_key(&path[..depth]))?;
    let module = modules[&path[..depth]];
    let from =
        |item: &String| module.uses.iter().find(|used| used.last() == Some(item) && used.as_slice() != path);
    match path.get(depth).filter(|_| module.is_index).and_then(from) {
        Some(origin) => holder(&[origin.as_slice(), &path[depth + 1..]].concat(), modules),
        None => Some(path[..depth].to_vec()),
    }
}

/// Whether one is the other or a part of it.
fn kin(a: &[String], b: &[String]) -> bool {
    a.starts_with(b) || b.starts_with(a)
}

/// Files that a file leads back to.
fn circles() -> Vec<String> {
    let modules = modules();
    let by_name: BTreeMap<Vec<String>, &Module> = modules.iter().map(|m| (m.name.clone(), m)).collect();
    let arrows: BTreeMap<&[String], BTreeSet<Vec<String>>> = modules
        .iter()
        .filter(|module| !module.is_index)
        .map(|module| {
            let targets = module.uses.iter().filter_map(|path| holder(path, &by_name));
            let others = targets.filter(|to| !by_name[to].is_index && !kin(to, &module.name));
            (module.name.as_slice(), others.collect())
        })
        .collect();
    let reached = |from: &[String]| {
        let (mut seen, mut next) = (BTreeSet::new(), vec![from.to_vec()]);
        while let Some(at) = next.pop() {
            for to in arrows.get(at.as_slice()).into_iter().flatten() {
                if seen.insert(to.clone()) {
                    next.push(to.clone());
                }
            }
        }
        seen
    };
    let all: BTreeMap<&[String], BTreeSet<Vec<String>>> =
        arrows.keys().map(|from| (*from, reached(from))).collect();
    let back = |from: &[String], to: &Vec<String>| all[to.as_slice()].contains(from);
    let pairs = arrows.iter().flat_map(|(from, targets)| targets.iter().map(move |to| (*from, to)));
    pairs
        .filter(|(from, to)| back(from, to))
        .map(|(from, to)| format!("{} uses {}, from which it is used", from.join("/"), to.join("/")))
        .collect()
}

#[test]
fn files_make_no_circle() {
    let found = circles();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// The longest function that is not seen as one thought any more.
const LONGEST_FUNCTION: usize = 70;

#[test]
fn functions_stay_short() {
    let mut long = Vec::new();
    for file in rust_files(&source_root()) {
        let source = std::fs::read_to_string(&file).expect("source file");
        for (name, lines) in functions(&source.parse().expect("the file compiles")) {
            if lines > LONGEST_FUNCTION {
                long.push(format!("{}: `{name}` has {lines} lines", file.display()));
            }
        }
    }
    assert!(long.is_empty(), "{}", long.join("\n"));
}

/// Name and number of lines of every function.
fn functions(tokens: &TokenStream) -> Vec<(String, usize)> {
    let tokens: Vec<TokenTree> = tokens.clone().into_iter().collect();
    let mut found = Vec::new();
    for (i, token) in tokens.iter().enumerate() {
        match token {
            TokenTree::Group(group) => found.extend(functions(&group.stream())),
            TokenTree::Ident(word) if word == "fn" => {
                let Some(TokenTree::Ident(own)) = tokens.get(i + 1) else { continue };
                let ends = tokens[i..].iter().find_map(|token| match token {
                    TokenTree::Group(body) if body.delimiter() == Delimiter::Brace => {
                        Some(body.span_close().end().line)
                    }
                    TokenTree::Punct(end) if end.as_char() == ';' => Some(end.span().end().line),
                    _ => None,
                });
                found.extend(ends.map(|end| (name(own), end + 1 - word.span().start().line)));
            }
            _ => {}
        }
    }
    found
}

#[test]
fn every_exception_to_the_ban_of_unsafe_code_is_named() {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md"))
        .expect("a page");
    let paragraph = page.split("\n\n").find(|part| part.starts_with("**Unsafe code**")).expect("a paragraph");
    let named: BTreeSet<&str> = paragraph.split('`').skip(1).step_by(2).collect();
    let is_unsafe = |file: &PathBuf| {
        let source = std::fs::read_to_string(file).expect("source file");
        all_paths(&tokens(&source)).iter().any(|written| written.path == ["unsafe"])
    };
    let root = source_root();
    let files = rust_files(&root);
    let found: Vec<&PathBuf> = files.iter().filter(|file| is_unsafe(file)).collect();
    let found: BTreeSet<&str> = found
        .iter()
        .map(|file| file.strip_prefix(&root).expect("below src").to_str().expect("our own names"))
        .collect();
    assert_eq!(named, found);
}

#[test]
fn files_stay_short() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let long: Vec<String> = ["src", "tests", "benches", "examples"]
        .iter()
        .map(|folder| root.join(folder))
        .filter(|folder| folder.is_dir())
        .flat_map(|folder| rust_files(&folder))
        .filter_map(|file| {
            let lines = std::fs::read_to_string(&file).expect("source file").lines().count();
            (lines > LONGEST_FILE).then(|| format!("{} has {lines} lines", file.display()))
        })
        .collect();
    assert!(long.is_empty(), "{}", long.join("\n"));
}

#[test]
fn mod_files_hold_no_code() {
    for file in rust_files(&source_root()).iter().filter(|f| f.ends_with("mod.rs")) {
        let source = std::fs::read_to_string(file).expect("source file");
        for token in tokens(&source) {
            if let TokenTree::Ident(ident) = token {
                let word = ident.to_string();
                let code = ["fn", "impl", "struct", "enum", "trait", "macro_rules"].contains(&word.as_str());
                assert!(!code, "{}: `{word}` belongs in a file of its own", file.display());
            }
        }
    }
}

/// The rules themselves, on sources that break them.
mod rules {
    use super::findings;

    fn of(room: &str, source: &str) -> Vec<String> {
        findings(room, 2, source)
    }

    #[test]
    fn see_paths_in_every_spelling() {
        for source in [
            "use crate::input::Reader;",
            "use crate::{base::Error, input};",
            "use crate::{base::{Error, Result}, input::{a::b}};",
            "fn f() { crate::input::read(); }",
            "fn f() { vec![crate::input::A] }",
            "impl From<crate::input::A> for B {}",
            "pub use crate::input as i;",
            "fn f() { flexbody::input::read() }",
        ] {
            let found = of("model", source);
            assert!(
                found.len() == 1 && found[0].contains("`model` may not use `input`"),
                "{source}: {found:?}"
            );
        }
        assert!(of("model", "use super::super::input::A;").iter().any(|f| f.contains("super")));
        assert!(
            of("model", "use crate::model::A; use crate::numerics::B; use crate::base::C; use super::d;")
                .is_empty()
        );
    }

    #[test]
    fn see_printing_exits_unwraps_and_unfinished_code() {
        for source in [
            "fn f() { println!(\"x\") }",
            "fn f() { std::process::exit(1) }",
            "use std::process::exit;",
            "fn f() { x.unwrap() }",
            "fn f() { x.map(Option::unwrap) }",
            "fn f() { if a { b(|| dbg!(x)) } }",
            "fn f() { todo!() }",
        ] {
            assert_eq!(of("formats", source).len(), 1, "{source}");
        }
        assert!(of("cli", "fn f() { println!(\"x\"); std::process::exit(1) }").is_empty());
    }

    #[test]
    fn see_foreign_crates_outside_their_room() {
        assert_eq!(of("report", "use hdf5_metno as hdf5;").len(), 1);
        assert_eq!(of("report", "use hdf5_metno::File;").len(), 1);
        assert_eq!(of("model", "use faer::{Mat, sparse::SparseColMat};").len(), 1);
        assert_eq!(of("model", "fn f(x: faer::sparse::SparseColMat<usize, f64>) {}").len(), 1);
        assert_eq!(of("report", "use clap::Parser;").len(), 1);
        assert!(of("numerics", "use faer::{Mat, sparse::SparseColMat};").is_empty());
        assert!(of("model", "use faer::{Mat, MatRef};").is_empty());
    }

    #[test]
    fn ignore_comments_strings_doctests_and_test_modules() {
        let source = "//! ```\n//! x.unwrap();\n//! ```\n/* println! */ fn f() { g(\"crate::input::A println!()\") }\n\
                      #[cfg(test)] mod tests { use crate::input::A; fn t() { x.unwrap(); println!() } }";
        assert!(of("model", source).is_empty(), "{:?}", of("model", source));
        // What follows a test module counts again.
        assert_eq!(of("model", "#[cfg(test)] mod t { } fn f() { x.unwrap() }").len(), 1);
        assert_eq!(of("model", "#[cfg(test)] use crate::input::A; fn f() { x.unwrap() }").len(), 1);
    }

    #[test]
    fn give_the_line() {
        assert!(of("model", "\n\nuse crate::input::A;")[0].starts_with("3: "));
    }
}
