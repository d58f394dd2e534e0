//! Reads the entries of the table from a file and collects every violation. Nothing that the file declares is trusted
//! before it is checked against the rest.

use super::item::{Extent, Item, ItemKind, Origin, SchemaGroup};
use super::names;
use super::per::Per;
use super::schema::certificate::{DROPPED, KEPT};
use super::schema::{LIST, ORDER, TABLE, WHOLE};
use super::value::Value;
use super::version::{DIGESTS_SINCE, MAJOR};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::hdf5_file::{
    self, Array, Element, Number, Numbers, Stored, difference, digests_of, elements, of_numbers,
};
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{Storage, TermGroup, TermGroups};
use hdf5_metno as hdf5;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

/// Largest number of reported problems. A damaged file can break every entry of every scheme; this number shows the
/// pattern.
const MOST_PROBLEMS: usize = 200;

/// Content of a file that fits the table, and the problems of the rest.
pub(super) struct Scan {
    file: std::path::PathBuf,
    /// Values by path, e.g. `/modes/residual` or `/source@model` for attributes.
    pub values: HashMap<String, Value>,
    /// Names and links of instances by parent group, see [`Scan::instances`].
    instances: BTreeMap<&'static str, Vec<(String, String)>>,
    /// Violations found so far.
    pub problems: Vec<Diagnostic>,
    /// Extents of the datasets, without those of single interfaces.
    pub sizes: Sizes,
    stored: Stored,
    /// Fingerprints of the numbers that were read, if the file has digests.
    numbers: Numbers,
    units: Option<UnitSystem>,
    /// Precision of the large arrays, from the root attribute `storage`.
    pub storage: Storage,
    /// Entries that the file holds and that later minor versions added, with that version.
    newer: Vec<(String, i64)>,
    /// Entries of groups of the kinetic energy; true for each that the file holds.
    of_groups: Vec<(String, &'static Item, bool)>,
}

/// Returns the members `links` of `parent` in the order that the file states, if it does.
fn in_order(parent: &hdf5::Group, per: Per, links: Vec<String>) -> Result<Vec<String>, String> {
    let Some(text) = hdf5_file::text(parent, ORDER)?.filter(|_| per.is_ordered()) else { return Ok(links) };
    let order: Vec<String> = serde_json::from_str(&text).unwrap_or_default();
    let sorted = |names: &[String]| {
        let mut names = names.to_vec();
        names.sort_unstable();
        names
    };
    if sorted(&order) == sorted(&links) {
        Ok(order)
    } else {
        Err(format!("one whose attribute `{ORDER}` lists other members than it has"))
    }
}

/// Returns the key of an entry in [`Scan::values`].
pub(super) fn key(place: &str, item: &Item) -> String {
    let separator = if item.shape().is_none() {
        "@"
    } else if place == "/" {
        ""
    } else {
        "/"
    };
    format!("{place}{separator}{}", item.name)
}

impl Scan {
    /// Reads all entries of `file`, which lies at `path` and has `bytes` bytes.
    pub(crate) fn new(file: &hdf5::File, path: &Path, bytes: u64) -> Self {
        let mut scan = Self {
            file: path.to_path_buf(),
            values: HashMap::new(),
            instances: BTreeMap::new(),
            problems: Vec::new(),
            sizes: Sizes::default(),
            stored: Stored::new(bytes),
            numbers: Numbers::default(),
            units: None,
            storage: Storage::F64,
            newer: Vec::new(),
            of_groups: Vec::new(),
        };
        for group in TABLE {
            match group.per {
                Per::Body => scan.group(file, group, None),
                _ => {
                    scan.list(file, group);
                    for (_, link) in scan.instances(group.parent()) {
                        // Links take almost no space: a file may hold millions of them.
                        if scan.problems.len() > MOST_PROBLEMS {
                            break;
                        }
                        scan.group(file, group, Some(&link));
                    }
                }
            }
        }
        scan.groups();
        scan
    }

    /// Adds a violation of the schema, up to the largest number of problems.
    pub(crate) fn add(&mut self, message: String) {
        self.add_as(Code::BodySchema, message);
    }

    /// Adds a problem with the given code.
    pub(crate) fn add_as(&mut self, code: Code, message: String) {
        match self.problems.len() {
            len if len < MOST_PROBLEMS => {
                self.problems.push(Diagnostic::new(code, message).in_file(&self.file));
            }
            MOST_PROBLEMS => self
                .problems
                .push(Diagnostic::new(code, "further problems are not listed").in_file(&self.file)),
            _ => {}
        }
    }

    /// Returns the names that are data below `parent`, in file order, each with its link name.
    pub(crate) fn instances(&self, parent: &str) -> Vec<(String, String)> {
        // Groups of one kind share their names: `/comparison` has the members of `/lumped`.
        let per = TABLE.iter().find(|g| g.parent() == parent).map(|g| g.per);
        let first = TABLE.iter().find(|g| Some(g.per) == per).map_or("", |g| g.parent());
        self.instances.get(first).cloned().unwrap_or_default()
    }

    /// Reads the instances of a group that occurs several times. Groups of one kind must have the same instances.
    fn list(&mut self, file: &hdf5::File, group: &SchemaGroup) {
        let parent = group.parent();
        let opened = hdf5_file::open_group(file, parent);
        let links = match opened.and_then(|own| in_order(&own, group.per, hdf5_file::members(&own)?)) {
            Ok(links) => links,
            // The file has an older minor version.
            Err(found) if group.since() > 0 && found == hdf5_file::NOTHING => Vec::new(),
            Err(found) => return self.add(format!("{parent}: expected a group, found {found}")),
        };
        let first = TABLE.iter().find(|g| g.per == group.per).map_or(parent, |g| g.parent());
        if first == parent {
            let named = links.into_iter().map(|link| (names::decode(&link), link)).collect();
            self.instances.insert(first, named);
            return;
        }
        let expected: HashSet<String> = self.instances(parent).into_iter().map(|(_, link)| link).collect();
        for link in links {
            if !expected.contains(&link) {
                self.add(format!("{parent}/{link}: expected a group of that name in {first} too"));
            }
        }
    }

    fn group(&mut self, file: &hdf5::File, group: &SchemaGroup, link: Option<&str>) {
        let path = group.place(link);
        let opened = match hdf5_file::open_group(file, &path) {
            Ok(opened) => opened,
            // The body has no such group, or the file has an older minor version.
            Err(found) if group.since() > 0 && link.is_none() && found == hdf5_file::NOTHING => return,
            Err(found) => return self.add(format!("{path}: expected a group, found {found}")),
        };
        let mut sizes = self.sizes;
        (sizes.interface_nodes, sizes.recovery_rows) = (None, None);
        (sizes.loaded_interfaces, sizes.named_loads) = (None, None);
        for item in group.entries() {
            let name = key(&path, item);
            self.texts(&opened, &name, item);
            let entry = self.entry(&opened, &name, item, &mut sizes);
            if let (Ok(value), Some(_)) = (&entry, item.of) {
                self.of_groups.push((name.clone(), item, value.is_some()));
            }
            match entry {
                Ok(Some(value)) => {
                    self.constant(&name, item, &value);
                    if item.since > 0 {
                        self.newer.push((name.clone(), item.since));
                    }
                    self.values.insert(name, value);
                }
                Ok(None) if item.required && item.of.is_none() => {
                    self.add(format!("{name}: expected {}, found nothing", kind(item)))
                }
                Ok(None) => {}
                Err(problem) => self.add(format!("{name}: {problem}")),
            }
        }
        self.sizes = sizes;
        if group.path == "/" {
            self.units = self.unit_system();
            self.storage = self.precision();
        }
    }

    /// Reads the value of an entry and checks it. Returns `None` if the file does not hold it.
    fn entry(
        &mut self,
        place: &hdf5::Group,
        name: &str,
        item: &Item,
        sizes: &mut Sizes,
    ) -> Result<Option<Value>, String> {
        match item.kind {
            ItemKind::Floats(shape) => {
                let stored = &mut self.stored;
                let values = if item.is_short(self.storage) {
                    dataset::<f32>(place, item.name, shape, sizes, stored)?
                        .inspect(|read| self.hash(name, read))
                        .map(|(values, dims)| (values.into_iter().map(f64::from).collect(), dims))
                } else {
                    dataset::<f64>(place, item.name, shape, sizes, stored)?
                        .inspect(|read| self.hash(name, read))
                };
                let Some((values, dims)) = values else { return Ok(None) };
                match values.iter().position(|v| !v.is_finite()) {
                    Some(i) => {
                        Err(format!("expected finite numbers, found {} at {}", values[i], index(i, &dims)))
                    }
                    None => Ok(Some(Value::Floats(values))),
                }
            }
            ItemKind::Ints(shape) => {
                let values = dataset::<i64>(place, item.name, shape, sizes, &mut self.stored)?
                    .inspect(|read| self.hash(name, read));
                Ok(values.map(|(values, _)| Value::Ints(values)))
            }
            ItemKind::Indices(shape) => {
                let values = dataset::<i32>(place, item.name, shape, sizes, &mut self.stored)?
                    .inspect(|read| self.hash(name, read));
                Ok(values.map(|(values, _)| Value::Indices(values)))
            }
            ItemKind::Text => Ok(hdf5_file::text(place, item.name)?.map(Value::Text)),
            ItemKind::Int => Ok(hdf5_file::int(place, item.name)?.map(Value::Int)),
            ItemKind::Float => match hdf5_file::float(place, item.name)? {
                Some(v) if !v.is_finite() => Err(format!("expected a finite number, found {v}")),
                v => Ok(v.map(Value::Float)),
            },
            ItemKind::Named => {
                let mut values = Vec::new();
                for name in hdf5_file::attribute_names(place)? {
                    match hdf5_file::float(place, &name) {
                        Ok(Some(v)) if v.is_finite() => values.push((name, v)),
                        Ok(v) => return Err(format!("{name}: expected a finite number, found {v:?}")),
                        Err(e) => return Err(format!("{name}: {e}")),
                    }
                }
                Ok(Some(Value::Named(values)))
            }
        }
    }

    /// Stores the fingerprint of numbers that were read, so that they need not be read again.
    fn hash<T: Number>(&mut self, name: &str, (values, dims): &Array<T>) {
        if self.stated_digests().is_some() {
            self.numbers.insert(name.to_owned(), of_numbers(dims, values));
        }
    }

    /// Returns the minor version that the file states; 0 without.
    pub(crate) fn minor(&self) -> i64 {
        match self.values.get("/@format_minor") {
            Some(Value::Int(minor)) => *minor,
            _ => 0,
        }
    }

    /// Returns the list of digests in the file, and the SHA-256 of the list; `None` without them.
    pub(crate) fn stated_digests(&self) -> Option<(&str, &str)> {
        match [LIST, WHOLE].map(|name| self.values.get(&format!("/@{name}"))) {
            [Some(Value::Text(list)), Some(Value::Text(whole))] => Some((list, whole)),
            _ => None,
        }
    }

    /// Checks all content of the file, unknown entries included, against the digests that it states.
    pub(crate) fn check_digests(&mut self, file: &hdf5::File) {
        let Some((list, whole)) = self.stated_digests() else {
            let minor = self.minor();
            let newer = self.newer.iter().find(|(_, since)| *since > minor);
            if minor >= DIGESTS_SINCE {
                self.add_as(
                    Code::BodyChanged,
                    format!("the attributes `{LIST}` and `{WHOLE}` were removed from the file"),
                );
            } else if let Some((name, since)) = newer {
                let message = format!(
                    "the file states version {MAJOR}.{minor} and has no digests, but holds {name}, which files have since {MAJOR}.{since}: the version was changed and digests were removed"
                );
                self.add_as(Code::BodyChanged, message);
            }
            return;
        };
        let (list, whole) = (list.to_owned(), whole.to_owned());
        let found = digests_of(file, &self.numbers, &mut self.stored, &[LIST, WHOLE]);
        let differs = match found {
            Ok(found) => difference(&found, &list, &whole),
            Err(problem) => Some(problem),
        };
        if let Some(differs) = differs {
            self.add_as(
                Code::BodyChanged,
                format!("the content was changed after it was written; {differs}"),
            );
        }
    }

    /// Checks that an entry of a group of the kinetic energy exists if `/terms` keeps the group, and only then.
    fn groups(&mut self) {
        let Some(held) = self.held() else { return };
        for (name, item, there) in std::mem::take(&mut self.of_groups) {
            let Some(group) = item.of else { continue };
            match (held.has(group), there) {
                (true, false) => self.add(format!("{name}: expected {}, found nothing", kind(item))),
                (false, true) => {
                    let said = format!("/terms@{} is `{DROPPED}`", group.name());
                    self.add(format!("{name}: expected nothing, since {said}, found a dataset"));
                }
                _ => {}
            }
        }
    }

    /// Returns the groups of the kinetic energy that the body holds by `/terms`; `None` if an entry there has an
    /// invalid value.
    pub(crate) fn held(&mut self) -> Option<TermGroups> {
        let mut says = |group: TermGroup| match self.values.get(&format!("/terms@{}", group.name())) {
            Some(Value::Text(text)) if text == KEPT => Some(true),
            Some(Value::Text(text)) if text == DROPPED => Some(false),
            Some(Value::Text(found)) => {
                let message =
                    format!("/terms@{}: expected `{KEPT}` or `{DROPPED}`, found {found:?}", group.name());
                self.add(message);
                None
            }
            // A missing entry is reported elsewhere.
            _ => Some(true),
        };
        let [w1, w2, w3] = TermGroup::ALL.map(&mut says);
        Some(TermGroups { w1: w1?, w2: w2?, w3: w3? })
    }

    fn constant(&mut self, name: &str, item: &Item, value: &Value) {
        match (item.origin, value) {
            (Origin::ConstantText(expected), Value::Text(found)) if found != expected => {
                self.add(format!("{name}: expected `{expected}`, found {found:?}"));
            }
            (Origin::ConstantInt(expected), Value::Int(found)) if *found != expected => {
                self.add(format!("{name}: expected {expected}, found {found}"));
            }
            _ => {}
        }
    }

    /// Checks the descriptive attributes of a dataset. The unit must be that of the body.
    fn texts(&mut self, place: &hdf5::Group, name: &str, item: &Item) {
        if item.shape().is_none() {
            return;
        }
        let Ok(Some(dataset)) = hdf5_file::open_dataset(place, item.name) else { return };
        for attribute in ["units", "symbol", "description"] {
            match hdf5_file::text(&dataset, attribute) {
                Ok(Some(found)) => {
                    let expected = self.units.as_ref().map(|u| item.units.concrete(u));
                    if let Some(expected) = expected.filter(|e| attribute == "units" && *e != found) {
                        self.add(format!("{name}@units: expected `{expected}`, found {found:?}"));
                    }
                }
                Ok(None) => self.add(format!("{name}@{attribute}: expected a text attribute, found nothing")),
                Err(problem) => self.add(format!("{name}@{attribute}: {problem}")),
            }
        }
    }

    fn precision(&mut self) -> Storage {
        let Some(Value::Text(name)) = self.values.get("/@storage") else { return Storage::F64 };
        let known = Storage::from_name(name);
        if known.is_none() {
            let message = format!("/@storage: expected `f64` or `f32`, found {name:?}");
            self.add(message);
        }
        known.unwrap_or_default()
    }

    fn unit_system(&mut self) -> Option<UnitSystem> {
        let name = |what: &str| match self.values.get(&format!("/@units_{what}")) {
            Some(Value::Text(name)) => Some(name.clone()),
            _ => None,
        };
        let (length, mass, time) = (name("length")?, name("mass")?, name("time")?);
        match UnitSystem::parse(&length, &mass, &time) {
            Ok(mut units) => {
                units.stated = self.values.get("/@units_stated") == Some(&Value::Int(1));
                Some(units)
            }
            Err(unknown) => {
                let (what, found) = unknown.split_once(' ').unwrap_or(("", &unknown));
                self.add(format!("/@units_{what}: expected a known unit or a number, found {found}"));
                None
            }
        }
    }

    /// Returns the units of the body; `None` if the file does not state them, which is then among the problems.
    pub(crate) fn units(&self) -> Option<&UnitSystem> {
        self.units.as_ref()
    }
}

fn kind(item: &Item) -> &'static str {
    match item.kind {
        ItemKind::Floats(_) => "a dataset of 64-bit floats",
        ItemKind::Ints(_) => "a dataset of 64-bit integers",
        ItemKind::Indices(_) => "a dataset of 32-bit integers",
        ItemKind::Text => "a text attribute",
        ItemKind::Int => "an integer attribute",
        ItemKind::Float | ItemKind::Named => "a float attribute",
    }
}

// Checks of the shapes of datasets against the table.

/// Extents known so far; the first dataset with an extent determines its size.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sizes {
    nodes: Option<usize>,
    modes: Option<usize>,
    pub interface_nodes: Option<usize>,
    pub internal_rows: Option<usize>,
    coordinates: Option<usize>,
    triangles: Option<usize>,
    edges: Option<usize>,
    pub recovery_rows: Option<usize>,
    pub named_loads: Option<usize>,
    pub loaded_interfaces: Option<usize>,
    fixed_interface_modes: Option<usize>,
}

/// Reads a dataset of the stated shape, with its extents. Returns `None` if there is no such dataset.
fn dataset<T: Element>(
    place: &hdf5::Group,
    name: &str,
    shape: &[Extent],
    sizes: &mut Sizes,
    stored: &mut Stored,
) -> Result<Option<Array<T>>, String> {
    hdf5_file::dataset(place, name, stored, |dims| sizes.fit(shape, dims))
}

impl Sizes {
    /// Checks `dims` against the table and the known extents, and records new extents. Returns the number of elements.
    fn fit(&mut self, shape: &[Extent], dims: &[usize]) -> Result<usize, String> {
        let mut learnt = *self;
        let fits = shape.len() == dims.len()
            && shape.iter().zip(dims).all(|(extent, &size)| size > 0 && learnt.fits(*extent, size));
        if !fits {
            let expected: Vec<_> = shape.iter().map(|e| self.show(*e)).collect();
            return Err(format!("expected shape [{}], found {dims:?}", expected.join(", ")));
        }
        let elements = elements(dims)?;
        *self = learnt;
        Ok(elements)
    }

    fn fits(&mut self, extent: Extent, size: usize) -> bool {
        match extent {
            Extent::Fixed(expected) => size == expected,
            Extent::Nodes => size == *self.nodes.get_or_insert(size),
            Extent::Modes => size == *self.modes.get_or_insert(size),
            Extent::ThreeModes => size.is_multiple_of(3) && size / 3 == *self.modes.get_or_insert(size / 3),
            Extent::SixModes => size.is_multiple_of(6) && size / 6 == *self.modes.get_or_insert(size / 6),
            Extent::InterfaceNodes => size == *self.interface_nodes.get_or_insert(size),
            Extent::InternalRows => size == *self.internal_rows.get_or_insert(size),
            Extent::Coordinates => size == *self.coordinates.get_or_insert(size),
            Extent::Triangles => size == *self.triangles.get_or_insert(size),
            Extent::Edges => size == *self.edges.get_or_insert(size),
            Extent::RecoveryRows => size == *self.recovery_rows.get_or_insert(size),
            Extent::LoadedInterfaces => size == *self.loaded_interfaces.get_or_insert(size),
            Extent::NamedLoads => size == *self.named_loads.get_or_insert(size),
            Extent::FixedInterfaceModes => size == *self.fixed_interface_modes.get_or_insert(size),
        }
    }

    /// Returns the size of an extent; 0 if no dataset with this extent was read.
    pub(super) fn of(&self, extent: Extent) -> usize {
        let known = match extent {
            Extent::Fixed(size) => Some(size),
            Extent::Nodes => self.nodes,
            Extent::Modes => self.modes,
            Extent::ThreeModes => self.modes.map(|nf| 3 * nf),
            Extent::SixModes => self.modes.map(|nf| 6 * nf),
            Extent::InterfaceNodes => self.interface_nodes,
            Extent::InternalRows => self.internal_rows,
            Extent::Coordinates => self.coordinates,
            Extent::Triangles => self.triangles,
            Extent::Edges => self.edges,
            Extent::RecoveryRows => self.recovery_rows,
            Extent::LoadedInterfaces => self.loaded_interfaces,
            Extent::NamedLoads => self.named_loads,
            Extent::FixedInterfaceModes => self.fixed_interface_modes,
        };
        known.unwrap_or(0)
    }

    fn show(&self, extent: Extent) -> String {
        let known = |name: &str, size: Option<usize>| match size {
            Some(size) => format!("{name} = {size}"),
            None => name.to_owned(),
        };
        match extent {
            Extent::Fixed(size) => size.to_string(),
            Extent::Nodes => known("n", self.nodes),
            Extent::Modes => known("nf", self.modes),
            Extent::ThreeModes => known("3 nf", self.modes.map(|nf| 3 * nf)),
            Extent::SixModes => known("6 nf", self.modes.map(|nf| 6 * nf)),
            Extent::InterfaceNodes => known("k", self.interface_nodes),
            Extent::InternalRows => known("m", self.internal_rows),
            Extent::Coordinates => known("nc", self.coordinates),
            Extent::Triangles => known("nt", self.triangles),
            Extent::Edges => known("ne", self.edges),
            Extent::RecoveryRows => known("r", self.recovery_rows),
            Extent::LoadedInterfaces => known("ni", self.loaded_interfaces),
            Extent::NamedLoads => known("nl", self.named_loads),
            Extent::FixedInterfaceModes => known("ny", self.fixed_interface_modes),
        }
    }
}

/// Returns the index of a row-major position as text, for instance `[2, 0, 5]`.
pub(super) fn index(mut position: usize, dims: &[usize]) -> String {
    let mut index: Vec<usize> = dims
        .iter()
        .rev()
        .map(|&d| {
            let i = position % d;
            position /= d;
            i
        })
        .collect();
    index.reverse();
    format!("{index:?}")
}
