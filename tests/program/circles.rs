//! Files of a crate and their folders form no circle. The arrows are those of the code outside of tests: paths that
//! lead to another module of the crate, followed through re-exports to the file that defines the item.

use crate::structure::rust_files;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::PathBuf;

/// Words before the name of an item.
const KEYWORDS: [&str; 9] = ["fn", "struct", "enum", "trait", "type", "const", "static", "union", "mod"];

/// Path of a module from the root of its crate.
type Module = Vec<String>;

/// Name that a module imports.
struct Import {
    path: Vec<String>,
    name: String,
    is_public: bool,
}

/// Code of a file.
#[derive(Default)]
struct File {
    imports: Vec<Import>,
    /// Names of the items that the file defines.
    defined: BTreeSet<String>,
    /// Paths of several names outside of imports.
    paths: Vec<Vec<String>>,
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Returns the words, `::` and other characters of a code without comments, strings, characters and lifetimes.
fn tokens(text: &str) -> Vec<String> {
    let all: Vec<char> = text.chars().collect();
    let starts = |at: usize, word: &str| word.chars().enumerate().all(|(k, c)| all.get(at + k) == Some(&c));
    let find = |from: usize, word: &str| (from..all.len()).find(|&at| starts(at, word)).unwrap_or(all.len());
    let (mut tokens, mut at) = (Vec::new(), 0);
    while at < all.len() {
        let c = all[at];
        let after_word = all[at..].iter().take_while(|c| is_word(**c)).count();
        let hashes = all[at + after_word..].iter().take_while(|c| **c == '#').count();
        let is_raw = ["r", "br"].contains(&&*all[at..at + after_word].iter().collect::<String>())
            && all.get(at + after_word + hashes) == Some(&'"');
        if starts(at, "//") {
            at = find(at, "\n");
        } else if starts(at, "/*") {
            at = find(at, "*/") + 2;
        } else if is_raw {
            let end = format!("\"{}", "#".repeat(hashes));
            at = find(at + after_word + hashes + 1, &end) + end.len();
        } else if c == '"' {
            at += 1;
            while at < all.len() && all[at] != '"' {
                at += if all[at] == '\\' { 2 } else { 1 };
            }
            at += 1;
        } else if c == '\'' {
            // A lifetime has no second quote.
            let length = if all.get(at + 1) == Some(&'\\') { find(at + 3, "'") - at + 1 } else { 3 };
            at += if all.get(at + length - 1) == Some(&'\'') { length } else { 1 };
        } else if after_word > 0 {
            tokens.push(all[at..at + after_word].iter().collect());
            at += after_word;
        } else {
            let length = if starts(at, "::") { 2 } else { 1 };
            let token: String = all[at..at + length].iter().collect();
            tokens.extend((!token.trim().is_empty()).then_some(token));
            at += length;
        }
    }
    tokens
}

/// Returns the imports of the tree of a `use`, whose `head` is known.
fn imports(tree: &[String], head: &[String], is_public: bool) -> Vec<Import> {
    let Some(open) = tree.iter().position(|token| token == "{") else {
        let (path, alias) = match tree.iter().position(|token| token == "as") {
            Some(at) => (&tree[..at], tree.get(at + 1)),
            None => (tree, None),
        };
        let mut path: Vec<String> =
            head.iter().chain(path.iter().filter(|token| *token != "::")).cloned().collect();
        if path.last().is_some_and(|last| last == "self") && path.len() > 1 {
            path.pop();
        }
        let name = alias.or(path.last()).cloned().unwrap_or_default();
        return vec![Import { path, name, is_public }];
    };
    let own: Vec<String> =
        head.iter().chain(tree[..open].iter().filter(|token| *token != "::")).cloned().collect();
    let (mut all, mut depth, mut from) = (Vec::new(), 0, open + 1);
    for (at, token) in tree.iter().enumerate().skip(open) {
        depth += usize::from(token == "{");
        depth -= usize::from(token == "}");
        if (token == "," && depth == 1) || depth == 0 {
            all.extend((from < at).then(|| imports(&tree[from..at], &own, is_public)).into_iter().flatten());
            from = at + 1;
        }
    }
    all
}

impl File {
    fn new(text: &str) -> Self {
        let mut tokens = tokens(text);
        let test_module = ["#", "[", "cfg", "(", "test", ")", "]", "mod"];
        if let Some(at) = tokens.windows(test_module.len()).position(|window| window == test_module) {
            tokens.truncate(at);
        }
        let mut file = Self::default();
        let mut at = 0;
        while at < tokens.len() {
            let next = tokens.get(at + 1).map_or("", String::as_str);
            if tokens[at] == "use" && next != "<" {
                let end = at + tokens[at..].iter().position(|token| token == ";").expect("the end of a use");
                let is_public = at > 0 && ["pub", ")"].contains(&&*tokens[at - 1]);
                file.imports.extend(imports(&tokens[at + 1..end], &[], is_public));
                at = end;
            } else if KEYWORDS.contains(&&*tokens[at]) {
                file.defined.insert(next.to_owned());
            } else if tokens[at].chars().all(is_word) && next == "::" && (at == 0 || tokens[at - 1] != "::") {
                let mut path = vec![tokens[at].clone()];
                while tokens.get(at + 1).is_some_and(|token| token == "::")
                    && tokens.get(at + 2).is_some_and(|token| token.chars().all(is_word))
                {
                    path.push(tokens[at + 2].clone());
                    at += 2;
                }
                file.paths.push(path);
            }
            at += 1;
        }
        file
    }
}

/// Files of a crate by their modules.
struct Crate(BTreeMap<Module, File>);

impl Crate {
    /// Reads the files below a folder of the workspace.
    fn read(src: &str) -> Self {
        let file = |path: PathBuf| {
            let name = path.strip_prefix(src).expect("a file below").with_extension("");
            let mut module: Module =
                name.iter().map(|part| part.to_str().expect("our own names").to_owned()).collect();
            if ["mod", "lib"].contains(&&**module.last().expect("a name")) {
                module.pop();
            }
            let text = fs::read_to_string(oracle::root().join(&path)).expect("a text");
            (module, File::new(&text))
        };
        Self(rust_files(src).into_iter().map(file).collect())
    }

    /// Returns the module in which a path of `module` starts, and the rest of the path; `None` for paths of other crates.
    fn start(&self, module: &Module, path: &[String]) -> Option<(Module, Vec<String>)> {
        let supers = path.iter().take_while(|name| *name == "super").count();
        match path[0].as_str() {
            "crate" => Some((Module::new(), path[1..].to_vec())),
            "self" => Some((module.clone(), path[1..].to_vec())),
            "super" => Some((module[..module.len().checked_sub(supers)?].to_vec(), path[supers..].to_vec())),
            name => {
                let is_child = self.0.contains_key(&[module.as_slice(), &[name.to_owned()]].concat());
                is_child.then(|| (module.clone(), path.to_vec()))
            }
        }
    }

    /// Returns the module that defines what a path from `module` leads to.
    fn defining(
        &self,
        mut module: Module,
        mut path: Vec<String>,
        seen: &mut BTreeSet<(Module, String)>,
    ) -> Module {
        while let Some(name) = path.first().cloned() {
            let child = [module.as_slice(), std::slice::from_ref(&name)].concat();
            let file = &self.0[&module];
            if self.0.contains_key(&child) {
                module = child;
                path.remove(0);
                continue;
            }
            if file.defined.contains(&name) || !seen.insert((module.clone(), name.clone())) {
                return module;
            }
            let named = file.imports.iter().filter(|import| import.name == name || import.name == "*");
            for import in named {
                let end = import.path.len() - usize::from(import.name == "*");
                let Some((base, mut rest)) = self.start(&module, &import.path[..end]) else { continue };
                rest.extend(path.iter().skip(usize::from(import.name != "*")).cloned());
                let found = self.defining(base, rest, seen);
                if import.name == name || self.0[&found].defined.contains(&name) {
                    return found;
                }
            }
            return module;
        }
        module
    }

    /// Returns for each module the other modules whose items its code uses.
    fn arrows(&self) -> BTreeMap<Module, BTreeSet<Module>> {
        let mut arrows = BTreeMap::new();
        for (module, file) in &self.0 {
            let mut used = BTreeSet::new();
            let mut modules: BTreeMap<&str, Module> = BTreeMap::new();
            for import in &file.imports {
                let Some((base, rest)) = self.start(module, &import.path) else { continue };
                let whole = [base.as_slice(), &rest].concat();
                if self.0.contains_key(&whole) {
                    modules.insert(&import.name, whole);
                } else if !import.is_public {
                    used.insert(self.defining(base, rest, &mut BTreeSet::new()));
                }
            }
            for path in &file.paths {
                let found = match modules.get(&*path[0]) {
                    Some(base) => Some((base.clone(), path[1..].to_vec())),
                    None => self.start(module, path),
                };
                if let Some((base, rest)) = found {
                    used.insert(self.defining(base, rest, &mut BTreeSet::new()));
                }
            }
            used.remove(module);
            arrows.insert(module.clone(), used);
        }
        arrows
    }

    /// Returns the members of circles, or of what leads to one: of the files, and of the members of each folder.
    fn circles(&self) -> Vec<String> {
        let arrows = self.arrows();
        let whole: Vec<(String, String)> = arrows
            .iter()
            .flat_map(|(from, all)| all.iter().map(|to| (from.join("::"), to.join("::"))))
            .collect();
        let folders: BTreeSet<&[String]> =
            self.0.keys().flat_map(|module| (0..module.len()).map(|length| &module[..length])).collect();
        let inside = |folder: &&[String]| {
            let member = |module: &Module| module.strip_prefix(*folder)?.first().cloned();
            let pairs = arrows.iter().flat_map(|(from, all)| all.iter().map(move |to| (from, to)));
            let pairs = pairs.filter_map(|(from, to)| Some((member(from)?, member(to)?)));
            left_over(pairs.filter(|(from, to)| from != to).collect())
        };
        left_over(whole).into_iter().chain(folders.iter().flat_map(inside)).collect()
    }
}

/// Repeatedly removes what uses nothing that remains, until nothing remains or the rest form a circle.
fn left_over(mut arrows: Vec<(String, String)>) -> BTreeSet<String> {
    loop {
        let users: BTreeSet<String> = arrows.iter().map(|(from, _)| from.clone()).collect();
        let count = arrows.len();
        arrows.retain(|(_, to)| users.contains(to));
        if arrows.len() == count {
            return users;
        }
    }
}

#[test]
fn files_of_a_crate_make_no_circle() {
    let crates = oracle::members(&oracle::root().join("crates"));
    let sources = crates.iter().map(|name| format!("crates/{name}/src"));
    let sources = sources.chain(["src".to_owned(), "python/src".to_owned()]);
    let found: BTreeMap<String, Vec<String>> = sources
        .map(|src| (src.clone(), Crate::read(&src).circles()))
        .filter(|(_, members)| !members.is_empty())
        .collect();
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn circles_are_found_through_re_exports() {
    let file = |text: &str| File::new(text);
    let module = |name: &str| vec![name.to_owned()];
    let circle = |b: &str| {
        Crate(BTreeMap::from([
            (Module::new(), file("mod a;\nmod b;\npub use a::{A, Other as Else};")),
            (module("a"), file("use crate::b::B;\npub struct A(B); // crate::b\npub struct Other;")),
            (module("b"), file(b)),
        ]))
        .circles()
    };
    assert!(circle("pub struct B;\nfn f() -> &'static str { \"crate::A\" }").is_empty());
    assert!(circle("pub struct B;\n#[cfg(test)]\nmod tests { use crate::A; }").is_empty());
    assert!(!circle("use super::A;\npub struct B;").is_empty());
    assert!(!circle("pub struct B;\nfn f(_: crate::Else) {}").is_empty());
}
