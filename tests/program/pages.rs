//! Code blocks of README.md, docs/ and evidence/ run, and links and paths in documents and sources lead to files.
//!
//! | block | what happens |
//! |---|---|
//! | `sh` | the commands run, one block after the other in one folder of the page, and succeed |
//! | `sh exit=N` | the last command ends with this code |
//! | `sh slow` | the slow tests run the commands |
//! | `sh needs=A,B` | the commands run if these programs are found |
//! | `text` | its lines are in the output of the last `sh` block, in this order |
//! | `toml` | is valid TOML; `toml manifest` and `toml scene` fit their schemas |
//! | `json` | is valid JSON |
//! | `c` | compiles in the folder of the page without a warning |
//! | `python` | runs if its modules are installed, otherwise its syntax is checked; with `needs=MODULE` only the latter |
//! | `rust` | is a documentation test of the library (`src/lib.rs`) |
//! | none | lines for other programs, or commands with files that are not there: every `flexbody` command is understood |
//! | `cpp`, `matlab`, `math` | nothing: there is no program for them |

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A code block of a page.
struct Block {
    page: String,
    line: usize,
    language: String,
    words: Vec<String>,
    text: String,
}

impl Block {
    fn place(&self) -> String {
        format!("{}:{}", self.page, self.line)
    }

    fn has(&self, word: &str) -> bool {
        self.words.iter().any(|one| one == word)
    }

    fn value(&self, key: &str) -> Option<&str> {
        self.words.iter().find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
    }
}

/// Returns the code blocks of a text.
fn blocks(page: &str, text: &str) -> Vec<Block> {
    let (mut found, mut open): (Vec<Block>, Option<Block>) = (Vec::new(), None);
    for (number, line) in text.lines().enumerate() {
        let Some(info) = line.trim_start().strip_prefix("```") else {
            if let Some(block) = &mut open {
                block.text.push_str(line);
                block.text.push('\n');
            }
            continue;
        };
        if let Some(block) = open.take() {
            found.push(block);
            continue;
        }
        let mut words = info.split_whitespace().map(str::to_owned);
        open = Some(Block {
            page: page.to_owned(),
            line: number + 1,
            language: words.next().unwrap_or_default(),
            words: words.collect(),
            text: String::new(),
        });
    }
    assert!(open.is_none(), "{page}: a block without an end");
    found
}

/// Returns all files below a folder of the workspace whose names end with one of the endings, with paths from the
/// root.
fn files(folder: &str, endings: &[&str]) -> Vec<String> {
    let (mut found, mut left) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(place) = left.pop() {
        for entry in fs::read_dir(oracle::root().join(&place)).expect("a folder") {
            let entry = entry.expect("an entry");
            let path = format!("{place}/{}", entry.file_name().to_str().expect("our own names"));
            if entry.file_type().expect("a type").is_dir() {
                if !path.ends_with("target") && !path.contains("/.") {
                    left.push(path);
                }
            } else if endings.iter().any(|ending| path.ends_with(ending)) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Returns the documents: those of the root, and all others with paths from the root.
fn documents() -> Vec<String> {
    let mut found: Vec<String> =
        ["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md"].map(str::to_owned).into();
    for folder in ["docs", "evidence", "fixtures", "benches", "python", "crates"] {
        found.extend(files(folder, &[".md"]));
    }
    found
}

fn read(path: &str) -> String {
    // Some broken inputs of the fixtures are not UTF-8.
    let bytes = fs::read(oracle::root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Returns the folder in which the blocks of a page run: `docs/page` beside links to the folders of the workspace,
/// with a link to the fixtures of its own.
fn folder_of_page() -> (tempfile::TempDir, PathBuf) {
    let top = tempfile::tempdir().expect("a folder");
    let folder = top.path().join("docs/page");
    fs::create_dir_all(&folder).expect("a folder");
    for name in ["fixtures", "examples"] {
        let source = oracle::root().join(name).canonicalize().expect("a folder of the workspace");
        std::os::unix::fs::symlink(&source, top.path().join(name)).expect("a link");
        std::os::unix::fs::symlink(&source, folder.join(name)).expect("a link");
    }
    (top, folder)
}

/// Runs commands and returns their exit code and output, both streams together.
fn run(commands: &str, folder: &Path) -> (Option<i32>, String) {
    let program = Path::new(env!("CARGO_BIN_EXE_flexbody")).parent().expect("a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    let mut shell = Command::new("bash");
    shell.args(["-euc", &format!("exec 2>&1\n{commands}")]).current_dir(folder).stdin(Stdio::null());
    shell.env("PATH", format!("{}:{path}", program.display())).env("COLUMNS", "100");
    let output = shell.output().expect("bash");
    (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
}

fn is_installed(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}

/// Runs an `sh` block and returns its output; `None` if a program is missing.
fn run_shell(block: &Block, folder: &Path) -> Option<String> {
    let needs = block.value("needs").map(|list| list.split(',').collect::<Vec<_>>()).unwrap_or_default();
    if !needs.iter().all(|program| is_installed(program)) {
        return None;
    }
    let expected = block.value("exit").map_or(0, |code| code.parse().expect("an exit code"));
    let (code, output) = run(&block.text, folder);
    assert_eq!(code, Some(expected), "{}\n{}\n{output}", block.place(), block.text);
    Some(output)
}

/// Compares the lines of a `text` block with the output above it.
fn compare_text(block: &Block, output: &str) {
    let mut rest = output;
    for line in block.text.lines() {
        let at = rest.find(line).unwrap_or_else(|| panic!("{}: `{line}` is not in\n{output}", block.place()));
        rest = &rest[at..];
    }
}

/// Compiles a `c` block in the folder of the page.
fn compile_c(block: &Block, folder: &Path) {
    fs::write(folder.join("block.c"), &block.text).expect("written");
    let options = "-std=c99 -pedantic -Wall -Wextra -Wconversion -Werror -fsyntax-only block.c";
    let done =
        Command::new("cc").args(options.split(' ')).current_dir(folder).output().expect("a C compiler");
    assert!(done.status.success(), "{}\n{}", block.place(), String::from_utf8_lossy(&done.stderr));
}

/// Python program that runs its input if all of its modules are installed, and only checks the syntax otherwise.
const PYTHON: &str = r#"
import ast, importlib.util, sys
text = sys.stdin.read()
nodes = list(ast.walk(ast.parse(text)))
names = [name.name for node in nodes if isinstance(node, ast.Import) for name in node.names]
names += [node.module for node in nodes if isinstance(node, ast.ImportFrom)]
if sys.argv[1] == "run" and all(importlib.util.find_spec(name.split(".")[0]) for name in names):
    exec(compile(text, "page", "exec"), {"__name__": "page"})
"#;

/// Runs the `python` blocks of a page as one program. A block with `needs` is for a program that is not there: its
/// syntax is checked.
fn run_python(page: &str, blocks: &[&Block], folder: &Path) {
    if blocks.is_empty() || !is_installed("python3") {
        return;
    }
    fs::write(folder.join("runner"), PYTHON).expect("written");
    let (other, own): (Vec<&Block>, Vec<&Block>) =
        blocks.iter().partition(|block| block.value("needs").is_some());
    for (word, blocks) in [("syntax", other), ("run", own)] {
        let text: Vec<&str> = blocks.iter().map(|block| block.text.as_str()).collect();
        let text = text.join("\n");
        if text.contains("body.flex.h5") {
            let command = "flexbody convert fixtures/models/cube_hex8/model.toml --modes 6 -o body.flex.h5";
            assert_eq!(run(command, folder).0, Some(0));
        }
        fs::write(folder.join("page.py"), text).expect("written");
        let (code, output) = run(&format!("MPLBACKEND=Agg python3 runner {word} < page.py"), folder);
        assert_eq!(code, Some(0), "{page}\n{output}");
    }
}

/// Returns the commands of `flexbody` in a block, with lines that are continued joined and placeholders left out.
fn commands(text: &str) -> Vec<String> {
    let joined = text.replace("\\\n", " ");
    let lines = joined.lines().filter(|line| line.starts_with("flexbody "));
    let lines = lines.filter(|line| !line.contains('[') && !line.contains('$'));
    lines.map(|line| line.replace(" ...", " ")).collect()
}

/// Requires that every command of a block that does not run is understood: it fails for its missing files only.
fn understand(block: &Block) {
    let folder = tempfile::tempdir().expect("a folder");
    for command in commands(&block.text) {
        let (code, output) = run(&command, folder.path());
        let is_understood = matches!(code, Some(0..=4)) && !output.contains("FB80");
        assert!(is_understood, "{}: `{command}` ends with {code:?}\n{output}", block.place());
    }
}

/// Requires that a `toml` block is valid, and that manifests and scenes fit their schemas.
fn compare_toml(block: &Block) {
    let parsed = toml::from_str::<toml::Table>(&block.text);
    let mut table = parsed.unwrap_or_else(|error| panic!("{}: {error}", block.place()));
    let (schema, key, least) = match block.words.first().map(String::as_str) {
        Some("manifest") => ("manifest", "files", "stiffness = 'K'\nmass = 'M'\nnodes = 'n'"),
        Some("scene") => ("scene", "run", "duration = 1"),
        _ => return,
    };
    // Blocks that show a part of a manifest or scene leave out what every one has.
    let least: toml::Table = toml::from_str(least).expect("TOML");
    table.entry(key).or_insert_with(|| toml::Value::Table(least));
    let schema = serde_json::from_str(&read(&format!("schemas/{schema}.schema.json"))).expect("a schema");
    let schema = jsonschema::validator_for(&schema).expect("a schema");
    let value = serde_json::to_value(&table).expect("JSON");
    let wrong: Vec<String> = schema.iter_errors(&value).map(|error| error.to_string()).collect();
    assert!(wrong.is_empty(), "{}: {wrong:?}", block.place());
}

/// Runs the blocks of a page, with those that are slow or without them.
fn check(page: &str, with_slow: bool) {
    let text = read(page);
    let blocks = blocks(page, &text);
    let (_top, folder) = folder_of_page();
    let mut output = None;
    for block in &blocks {
        match block.language.as_str() {
            "sh" if with_slow || !block.has("slow") => output = run_shell(block, &folder),
            "sh" => output = None,
            "text" => {
                if let Some(output) = &output {
                    compare_text(block, output);
                }
            }
            "toml" => compare_toml(block),
            "json" => {
                assert!(serde_json::from_str::<serde_json::Value>(&block.text).is_ok(), "{}", block.place())
            }
            "c" => compile_c(block, &folder),
            "" => understand(block),
            "python" | "cpp" | "matlab" | "math" | "rust" => {}
            other => panic!("{}: a block of `{other}`", block.place()),
        }
    }
    let python: Vec<&Block> = blocks.iter().filter(|block| block.language == "python").collect();
    run_python(page, &python, &folder);
}

fn check_all(folder: &str, with_slow: bool) {
    let pages = files(folder, &[".md"]);
    assert!(!pages.is_empty(), "{folder} has pages");
    pages.iter().for_each(|page| check(page, with_slow));
}

#[test]
fn readme() {
    check("README.md", false);
    let lines = read("README.md").lines().count();
    assert!(lines <= 80, "README.md has {lines} lines: move details to a page of docs/");
}

#[test]
fn start() {
    check_all("docs/start", false);
}

#[test]
fn how_to() {
    check_all("docs/how_to", false);
}

#[test]
fn reference() {
    check_all("docs/reference", false);
}

#[test]
fn theory_and_validation() {
    check_all("docs/validation", false);
    check_all("evidence", false);
    check("docs/theory.md", false);
    check("docs/decisions.md", false);
}

/// Pages with slow blocks, each a test of its own, so that they run beside each other.
mod slow_blocks {
    use super::{blocks, check, files, read};

    macro_rules! of_pages {
        ($($name:ident: $page:literal,)*) => {
            const PAGES: &[&str] = &[$($page),*];
            $(#[test]
            #[ignore = "slow"]
            fn $name() {
                check($page, true);
            })*
        };
    }

    of_pages! {
        tour: "docs/start/tour.md",
        frame: "docs/how_to/frame.md",
        known_error: "docs/how_to/known_error.md",
        rotor: "docs/how_to/rotor.md",
        satellite: "docs/how_to/satellite.md",
        select: "docs/reference/select.md",
        trade: "docs/reference/trade.md",
    }

    #[test]
    fn every_page_has_its_test() {
        let folders = ["docs/start", "docs/how_to", "docs/reference"];
        let pages = folders.into_iter().flat_map(|folder| files(folder, &[".md"]));
        let slow: Vec<String> =
            pages.filter(|page| blocks(page, &read(page)).iter().any(|block| block.has("slow"))).collect();
        assert_eq!(slow.len(), PAGES.len());
        assert!(slow.iter().all(|page| PAGES.contains(&page.as_str())), "{slow:?}");
    }
}

/// Rust blocks run where rustdoc sees them.
#[test]
fn rust_blocks_are_documentation_tests() {
    let tested = read("src/lib.rs");
    for page in files("docs", &[".md"]) {
        if blocks(&page, &read(&page)).iter().any(|block| block.language == "rust") {
            assert!(tested.contains(&format!("include_str!(\"../{page}\")")), "src/lib.rs includes {page}");
        }
    }
}

/// The page of the Python package has the cells of its notebook.
#[test]
fn the_page_of_the_notebook_has_its_cells() {
    let notebook: serde_json::Value =
        serde_json::from_str(&read("docs/reference/python.ipynb")).expect("JSON");
    let page = read("docs/reference/python.md");
    let cells = notebook["cells"].as_array().expect("cells");
    for cell in cells {
        let lines = cell["source"].as_array().expect("lines");
        let source: String = lines.iter().map(|line| line.as_str().expect("text")).collect();
        assert!(page.contains(&source), "./scripts/make.sh pages python: the page lacks\n{source}");
    }
    assert!(cells.len() > 10);
}

/// Returns the text without its code blocks and inline code, in which nothing is a link.
fn prose(text: &str) -> String {
    let mut out = String::new();
    let mut in_block = false;
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            in_block = !in_block;
        } else if !in_block {
            out.extend(line.split('`').step_by(2));
            out.push('\n');
        }
    }
    out
}

/// Returns the anchors of the headings of a page.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut in_block = false;
    for line in text.lines() {
        in_block ^= line.trim_start().starts_with("```");
        let Some(title) = line.strip_prefix('#').filter(|_| !in_block) else { continue };
        let title = title.trim_start_matches('#').trim();
        let kept = title.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        let slug: String = kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect();
        let again = (1..).map(|number| format!("{slug}-{number}"));
        let name = std::iter::once(slug.clone()).chain(again).find(|name| !found.contains(name));
        found.insert(name.expect("a number"));
    }
    found
}

#[test]
fn links_lead_to_files_and_headings() {
    let mut links = 0;
    for page in documents() {
        let text = prose(&read(&page));
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if target.contains(':') {
                continue;
            }
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let page_path = oracle::root().join(&page);
            let path = if file.is_empty() { page_path } else { page_path.with_file_name("").join(file) };
            assert!(path.exists(), "{page} links to {target}, which does not exist");
            if !anchor.is_empty() {
                let linked = fs::read_to_string(&path).expect("text");
                assert!(anchors(&linked).contains(anchor), "{page} links to {target}: no such heading");
            }
            links += 1;
        }
    }
    assert!(links >= 200, "{links} links");
}

/// Returns the paths in a text that begin with a folder and end with a known ending.
fn paths<'a>(text: &'a str, folder: &'a str) -> impl Iterator<Item = &'a str> {
    let is_inside = |c: char| c.is_alphanumeric() || matches!(c, '/' | '_' | '-' | '.' | '*' | '<' | '{');
    text.match_indices(folder).filter_map(move |(at, _)| {
        let before = text[..at].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || matches!(c, '/' | '_' | '-' | '.' | '$' | '}')) {
            return None;
        }
        let path = text[at..].split(|c| !is_inside(c)).next()?.trim_end_matches('.');
        let is_file = [".md", ".rs", ".py", ".sh", ".toml", ".ipynb", ".svg", ".json"];
        let is_placeholder = path.contains(['*', '<', '{']) || path.contains("NAME");
        (is_file.iter().any(|ending| path.ends_with(ending)) && !is_placeholder).then_some(path)
    })
}

#[test]
fn paths_in_documents_and_sources_exist() {
    let root = oracle::root();
    let mut sources = documents();
    for folder in [
        "src",
        "crates",
        "tests",
        "benches",
        "examples",
        "scripts",
        "schemas",
        "python",
        "fixtures/cases",
        "docs",
        "evidence",
    ] {
        sources.extend(files(folder, &[".rs", ".py", ".sh", ".json", ".pyi", ".h", ".toml", ".ipynb"]));
    }
    let mut count = 0;
    for source in sources {
        let text = read(&source);
        let is_document = source.ends_with(".md");
        let folders =
            ["docs/", "evidence/", "scripts/", "crates/", "tests/", "benches/", "examples/", "schemas/"];
        for folder in if is_document { &folders[..] } else { &folders[..2] } {
            for path in paths(&text, folder) {
                assert!(root.join(path).exists(), "{source} names {path}, which does not exist");
                count += 1;
            }
        }
    }
    assert!(count > 200, "{count} paths");
}

/// The picture of README.md shows the lines that the command prints today, apart from its numbers.
#[test]
fn the_picture_of_the_terminal_is_what_the_command_prints() {
    let (_top, folder) = folder_of_page();
    let command =
        "flexbody convert fixtures/models/connecting_rod/model.toml -o rod.flex.h5 --report rod.html";
    let (code, output) = run(&format!("COLUMNS=80 {command} 2>/dev/null"), &folder);
    assert_eq!(code, Some(0), "{output}");
    let masked = |text: &str| -> String { text.chars().filter(|c| c.is_alphabetic()).collect() };
    let picture = read("docs/images/terminal.svg");
    let shown: Vec<&str> =
        picture.split("textLength=").skip(1).filter_map(|rest| rest.split(['>', '<']).nth(1)).collect();
    let shown = masked(&shown.join("").replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"));
    for line in output.lines().filter(|line| !line.contains("rod.")) {
        let line = masked(line);
        assert!(
            shown.contains(&line),
            "./scripts/make.sh pages image_terminal: `{line}` is not in the picture"
        );
    }
}
