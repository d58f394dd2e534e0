//! The table as documentation: `docs/reference/file_format.md` and `schemas/flexbody-file.schema.json` are generated
//! here.

use super::item::{DERIVED_TOLERANCE, Extent, Item, ItemKind, Origin, SchemaGroup};
use super::schema::certificate::KEPT;
use super::schema::{FORMAT, TABLE};
use super::version::{DIGESTS_SINCE, MAJOR, MINOR};
use flexbody_body::flex_body::TermGroup;
use serde_json::{Map, Value, json};
use std::fmt::Write;

const INTRODUCTION: &str = "\
<!-- Generated from the table in crates/file/src/schema.rs: FLEXBODY_BLESS=1 cargo test --test program docs_generated -->

# The flex-body file

A flex-body file is an HDF5 file (readable by HDF5 1.8 and later). All arrays are row-major in the shapes given here
(MATLAB and Fortran show the extents in reverse order); numbers are 64-bit little-endian; texts are UTF-8 of variable
length. Every dataset has the text attributes `units`, `symbol` and `description`. Numbers are in the units of the root
group. n is the number of nodes, nf the number of modes, k the number of nodes of an interface, nc the number of interface coordinates,
nt and ne those of triangles and edges of the surface.

W1, W2, W3 are component-blocked: the column (or row) of component b = 0, 1, 2 and mode j is b nf + j.

```python
import h5py
with h5py.File(\"body.flex.h5\") as f:
    assert f.attrs[\"format\"] == \"flexbody\" and f.attrs[\"format_major\"] == 1
    I0, W1 = f[\"invariants/I0\"][()], f[\"invariants/W1\"][()]
    psi = f[\"modes/shape\"][0]  # first mode, n x 3
```

```matlab
assert(strcmp(h5readatt('body.flex.h5', '/', 'format'), 'flexbody'))
I0 = h5read('body.flex.h5', '/invariants/I0');
W1 = h5read('body.flex.h5', '/invariants/W1')';            % 3 x 3nf
psi = h5read('body.flex.h5', '/modes/shape', [1 1 1], [3 Inf 1])';  % first mode, n x 3
```

";

const RULES: &str = "\
A reader refuses a newer `format_major` and names the `generator`; a newer `format_minor` only adds entries, which older
readers ignore. A body without some groups of the kinetic energy (`/terms`, since 1.3) has no datasets for them, which readers up to 1.2 require: these
readers reject the file and name the datasets. A Craig-Bampton body whose frame is on an interface has no
`/modes/free_eigenvalue` and `/modes/free_eigenvalue_lower`, which readers up to 1.10 require of a body with `/certificate@fixed_interface_modes`: its file
states version 1.11, and these readers reject it and name the datasets. Names that are data (lumping schemes, interfaces, loads) are percent-encoded where they hold `/`, `%`, control
characters or a leading dot, and keep their order by HDF5 creation order; since 1.12 the attribute `order` of `/interfaces`, `/recovery` and `/named_loads` states the
order of two or more members as a JSON array of their encoded names, which goes before. Nothing in the file depends on the clock, on the
number of threads or on its path: equal bodies are equal bytes.
";

/// Description of the digests, with the lines of Python that recompute them.
const DIGESTS: &str = "\
## Digests

Since 1.4 the root attribute `digests` has a line `SHA-256  path` (two spaces, a line feed at the end of each) for every group and every dataset of the
file, entries that this page does not know included, in the order of the bytes of their paths; the root group is `/`. The root attribute `sha256` is the SHA-256 of this text in UTF-8, in
lowercase hexadecimal like all others. A reader refuses a file whose content has other digests (FB712) and names what was changed, added or
removed. The digests see numbers, shapes, types and attributes; they do not see how HDF5 lays these out: chunks, compression, byte order, storage of texts, and the order of
members and attributes. flexbody writes nothing compressed; `h5repack -m 100000 -f SHUF -f GZIP=1 body.flex.h5 smaller.flex.h5` makes large files 5 to 30 % smaller, and they stay valid.

The digest of a dataset is the SHA-256 of its record followed by the records of its attributes, by name in the order of their bytes; that of a group has
its attributes alone, the root without `digests` and `sha256`. A record is the line

    LENGTH NAME TYPE SHAPE BYTES

followed by the content. NAME is the attribute's name, empty for the dataset itself, and LENGTH the number of its bytes; TYPE is `float64`, `float32`, `int64`, `int32` (and other
`int` and `uint`) or `text`; SHAPE is the extents with `x` between them, empty for a single value; BYTES is the number of bytes of the content: numbers row-major and
little-endian, texts in UTF-8 without an end mark. One space stands between the fields, a line feed ends the line. Other types, arrays of texts, links that are not hard and more than eight levels of groups occur in no flex-body file.

These lines compute them; a program that changes a file on purpose states them anew with the last two:

```python
import hashlib, h5py, numpy as np

def record(name, value):
    if isinstance(value, str):
        kind, shape, content = \"text\", \"\", value.encode()
    else:
        value = np.asarray(value)
        kind, shape = value.dtype.name, \"x\".join(map(str, value.shape))
        content = value.astype(value.dtype.newbyteorder(\"<\")).tobytes()
    return f\"{len(name.encode())} {name} {kind} {shape} {len(content)}\\n\".encode() + content

def digests(file):
    found = {}
    def add(path, entry):
        content = record(\"\", entry[()]) if isinstance(entry, h5py.Dataset) else b\"\"
        for name in sorted(entry.attrs, key=str.encode):
            if path != \"/\" or name not in (\"digests\", \"sha256\"):
                content += record(name, entry.attrs[name])
        found[path] = hashlib.sha256(content).hexdigest()
    add(\"/\", file)
    file.visititems(lambda path, entry: add(\"/\" + path, entry))
    text = \"\".join(f\"{found[path]}  {path}\\n\" for path in sorted(found, key=str.encode))
    return text, hashlib.sha256(text.encode()).hexdigest()

with h5py.File(\"body.flex.h5\", \"r+\") as f:
    for name, value in zip((\"digests\", \"sha256\"), digests(f)):
        f.attrs[name] = value
```

A digest tells damage and careless edits from what was written; it is no signature. What the laws of mechanics say of the numbers themselves is checked besides: section 10 of the [theory](../theory.md).
";

/// Returns the text of `docs/reference/file_format.md`.
pub fn format_markdown() -> String {
    let mut out = INTRODUCTION.to_owned();
    let mut add =
        |text: std::fmt::Arguments<'_>| out.write_fmt(text).expect("writing to a String cannot fail");
    add(format_args!("Format version {MAJOR}.{MINOR}. {RULES}"));
    add(format_args!(
        "\nEntries marked *derived* follow from the others; a reader recomputes them and refuses a file that contradicts\n\
         itself by more than {DERIVED_TOLERANCE:e} of the magnitude of the data they come from.\n"
    ));
    add(format_args!("\n{DIGESTS}"));
    for group in TABLE {
        add(format_args!("\n## `{}`\n\n{}\n", group.path, description(group)));
        let (attributes, datasets): (Vec<_>, Vec<_>) = group.entries().partition(|i| i.shape().is_none());
        if !datasets.is_empty() {
            add(format_args!(
                "\n| dataset | symbol | shape | type | units | content |\n|---|---|---|---|---|---|\n"
            ));
        }
        for item in datasets {
            let (name, symbol, shape, kind) = (item.name, item.symbol, shape(item), kind(item));
            let (units, content) = (item.units.symbolic(), content(item));
            add(format_args!("| `{name}` | {symbol} | {shape} | {kind} | {units} | {content} |\n"));
        }
        if !attributes.is_empty() {
            add(format_args!("\n| attribute | type | units | content |\n|---|---|---|---|\n"));
        }
        for item in attributes {
            let (kind, units, content) = (kind(item), item.units.symbolic(), content(item));
            add(format_args!("| `{}` | {kind} | {units} | {content} |\n", item.name));
        }
    }
    out
}

/// Returns the description of a group. That of a group which raises the version of files names the version.
fn description(group: &SchemaGroup) -> String {
    let since = group.since();
    if since > DIGESTS_SINCE {
        let before = since - 1;
        format!("{} Since {MAJOR}.{since}; a file without it is one of {MAJOR}.{before}.", group.description)
    } else {
        group.description.to_owned()
    }
}

fn content(item: &Item) -> String {
    let mut text = item.description.replace('|', "\\|");
    match item.origin {
        Origin::ConstantText(value) => write!(text, "; always `{value}`").expect("a String"),
        Origin::ConstantInt(value) => write!(text, "; always {value}").expect("a String"),
        Origin::Derived(..) => text.push_str(" (*derived*)"),
        Origin::Primary(_) => {}
    }
    if let Some(group) = item.of {
        write!(text, " (where {} is kept)", group.name()).expect("a String");
    }
    if !item.required {
        text.push_str(" (optional)");
    }
    if item.since > 0 {
        write!(text, " (since {MAJOR}.{})", item.since).expect("a String");
    }
    text
}

fn kind(item: &Item) -> &'static str {
    match item.kind {
        ItemKind::Floats(_) if item.large => "float64 or float32",
        ItemKind::Floats(_) | ItemKind::Float | ItemKind::Named => "float64",
        ItemKind::Ints(_) | ItemKind::Int => "int64",
        ItemKind::Indices(_) => "int32",
        ItemKind::Text => "text",
    }
}

fn symbol(extent: Extent) -> String {
    match extent {
        Extent::Fixed(size) => size.to_string(),
        Extent::Nodes => "n".to_owned(),
        Extent::Modes => "nf".to_owned(),
        Extent::ThreeModes => "3nf".to_owned(),
        Extent::SixModes => "6nf".to_owned(),
        Extent::InterfaceNodes => "k".to_owned(),
        Extent::InternalRows => "m".to_owned(),
        Extent::Coordinates => "nc".to_owned(),
        Extent::Triangles => "nt".to_owned(),
        Extent::Edges => "ne".to_owned(),
        Extent::RecoveryRows => "r".to_owned(),
        Extent::LoadedInterfaces => "ni".to_owned(),
        Extent::NamedLoads => "nl".to_owned(),
        Extent::FixedInterfaceModes => "ny".to_owned(),
    }
}

fn shape(item: &Item) -> String {
    item.shape().unwrap_or(&[]).iter().map(|e| symbol(*e)).collect::<Vec<_>>().join(" x ")
}

/// Returns the text of `schemas/flexbody-file.schema.json`: a JSON Schema of the output of
/// [`structure`](super::structure) for a file.
pub fn format_schema() -> String {
    let mut root = json!({});
    for group in TABLE {
        let mut target = &mut root;
        for name in group.path.split('/').filter(|name| !name.is_empty()) {
            let key = if name.starts_with('<') { "additionalProperties" } else { name };
            target = descend(target, key, group.since() == 0);
        }
        fill(target, group);
    }
    root["allOf"] = TermGroup::ALL.into_iter().map(of_group).collect();
    root["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    root["title"] = json!(format!("{FORMAT} file, format version {MAJOR}.{MINOR}"));
    root["description"] = json!(
        "What `flexbody inspect --structure` prints about a flex-body file. `x-shape` and `x-units` state how extents and \
         units of the datasets hang together, which JSON Schema cannot."
    );
    let mut text = serde_json::to_string_pretty(&root).expect("a tree of maps is valid JSON");
    text.push('\n');
    text
}

/// Returns the schema that requires the datasets of a group of the kinetic energy if `/terms` keeps the group, and
/// forbids them otherwise.
fn of_group(held: TermGroup) -> Value {
    let within = |path: &str, part: &str, inner: Value| {
        path.split('/').filter(|name| !name.is_empty()).rev().fold(
            json!({ "properties": { part: inner } }),
            |inner, name| {
                if name.starts_with('<') {
                    json!({ "properties": { "groups": { "additionalProperties": inner } } })
                } else {
                    json!({ "properties": { "groups": { "properties": { name: inner } } } })
                }
            },
        )
    };
    let groups = || TABLE.iter().filter(|group| group.entries().any(|item| item.of == Some(held)));
    let all = |inner: &dyn Fn(&[&str]) -> Value| -> Value {
        let schema = |group: &SchemaGroup| {
            let items = group.entries().filter(|item| item.of == Some(held));
            within(group.path, "datasets", inner(&items.map(|item| item.name).collect::<Vec<_>>()))
        };
        json!({ "allOf": groups().map(schema).collect::<Vec<_>>() })
    };
    let none = |names: &[&str]| {
        let never: Map<String, Value> = names.iter().map(|name| ((*name).to_owned(), json!(false))).collect();
        json!({ "properties": never })
    };
    json!({
        "if": within("/terms", "attributes", json!({ "properties": { held.name(): { "const": KEPT } } })),
        "then": all(&|names| json!({ "required": names })),
        "else": all(&none),
    })
}

/// Returns the schema of the member group `key`, creating it if necessary. `required` is false for groups that files of
/// older minor versions do not have.
fn descend<'a>(group: &'a mut Value, key: &str, required: bool) -> &'a mut Value {
    let schema = group.as_object_mut().expect("schemas of groups are objects");
    schema.insert("type".to_owned(), json!("object"));
    require(schema, "groups");
    let groups = member(member(schema, "properties"), "groups");
    groups.insert("type".to_owned(), json!("object"));
    if key == "additionalProperties" {
        return groups.entry(key).or_insert_with(|| json!({}));
    }
    if required {
        require(groups, key);
    }
    member(groups, "properties").entry(key).or_insert_with(|| json!({}))
}

fn member<'a>(map: &'a mut Map<String, Value>, key: &str) -> &'a mut Map<String, Value> {
    map.entry(key).or_insert_with(|| json!({})).as_object_mut().expect("made as an object")
}

fn require(schema: &mut Map<String, Value>, key: &str) {
    let list = schema.entry("required").or_insert_with(|| json!([])).as_array_mut().expect("a list");
    if !list.contains(&json!(key)) {
        list.push(json!(key));
    }
}

fn fill(target: &mut Value, group: &SchemaGroup) {
    let schema = target.as_object_mut().expect("schemas of groups are objects");
    schema.insert("type".to_owned(), json!("object"));
    schema.insert("description".to_owned(), json!(description(group)));
    for (section, of_datasets) in [("attributes", false), ("datasets", true)] {
        let items = || group.entries().filter(move |i| i.shape().is_some() == of_datasets);
        let mut part = json!({ "type": "object" });
        let named = items().find(|i| i.kind == ItemKind::Named);
        if let Some(item) = named {
            part["additionalProperties"] = json!({ "type": "number", "description": item.description });
        }
        let listed = || items().filter(|i| i.kind != ItemKind::Named);
        let required: Vec<_> = listed().filter(|i| i.required && i.of.is_none()).map(|i| i.name).collect();
        if !required.is_empty() {
            part["required"] = json!(required);
        }
        for item in listed() {
            part["properties"][item.name] = entry(item);
        }
        if items().next().is_some() {
            require(schema, section);
            member(schema, "properties").insert(section.to_owned(), part);
        }
    }
}

fn entry(item: &Item) -> Value {
    let mut schema = match item.kind {
        ItemKind::Text => json!({ "type": "string" }),
        ItemKind::Int => json!({ "type": "integer" }),
        ItemKind::Float | ItemKind::Named => json!({ "type": "number" }),
        ItemKind::Floats(extents) | ItemKind::Ints(extents) | ItemKind::Indices(extents) => {
            let sizes = extents.iter().map(|extent| match extent {
                Extent::Fixed(size) => json!({ "const": size }),
                Extent::ThreeModes => json!({ "type": "integer", "minimum": 3, "multipleOf": 3 }),
                Extent::SixModes => json!({ "type": "integer", "minimum": 6, "multipleOf": 6 }),
                _ => json!({ "type": "integer", "minimum": 1 }),
            });
            json!({
                "type": "object",
                "required": ["type", "shape", "units", "symbol", "description"],
                "properties": {
                    "type": { "enum": kind(item).split(" or ").collect::<Vec<_>>() },
                    "shape": {
                        "type": "array",
                        "prefixItems": sizes.collect::<Vec<_>>(),
                        "minItems": extents.len(),
                        "maxItems": extents.len(),
                    },
                    "units": { "type": "string" },
                    "symbol": { "type": "string" },
                    "description": { "type": "string" },
                },
                "x-shape": extents.iter().map(|e| symbol(*e)).collect::<Vec<_>>(),
            })
        }
    };
    match item.origin {
        Origin::ConstantText(value) => schema["const"] = json!(value),
        Origin::ConstantInt(value) => schema["const"] = json!(value),
        Origin::Primary(_) | Origin::Derived(..) => {}
    }
    schema["description"] = json!(item.description);
    let units = item.units.symbolic();
    if units != "1" {
        schema["x-units"] = json!(units);
    }
    if item.since > 0 {
        schema["x-since"] = json!(format!("{MAJOR}.{}", item.since));
    }
    schema
}

#[cfg(all(test, feature = "hdf5"))]
mod tests;
