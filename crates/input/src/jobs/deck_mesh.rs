//! Nodes, elements and sets of a keyword deck, including parts and instances of Abaqus.

use super::deck::{Card, Deck, fields};
use super::deck_scope::{Elements, Scope};
use super::element_kinds::{Drawing, drawing};
use crate::sets::{Item, Members, NodeSets, SetIndex, SetInstance, SetScope, comparable, dotted};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::memory::{left, refuse_beyond};
use flexbody_base::text::scanner::{self, BadLines, excerpt, integer};
use flexbody_linalg::rotation;
use libm::sincos;
use nalgebra::{Rotation3, Unit, Vector3};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::sync::Arc;

/// Largest number of values of a line of a generated set. More of them are a mistake: no model has so many nodes.
const MAX_GENERATED: i64 = 100_000_000;

/// Bytes of memory of a node or an element of an instance, at least.
const BYTES_PER_NODE: f64 = 64.0;

/// Keywords of cards that describe elements by sets and axes of the scope that they are in.
const SCOPED: &[&str] = &["SOLIDSECTION", "SPRING", "ORIENTATION"];

/// Upper limit of the numbers of renumbered nodes.
const MAX_NODE_NUMBER: i64 = 1_000_000_000_000;

/// Nodes, elements and node sets in the numbering of the whole model.
#[derive(Debug, Default)]
pub(super) struct DeckMesh {
    /// Positions of the nodes, ascending by number.
    pub nodes: BTreeMap<i64, [f64; 3]>,
    pub elements: Vec<Elements>,
    /// Node sets, and element sets without those of parts and instances.
    pub sets: NodeSets,
    /// Notes about the numbering.
    pub notes: Vec<Diagnostic>,
    /// Content of the instances and of the assembly, for the description of elements; empty if it was not requested.
    pub scopes: Vec<PlacedScope>,
}

/// Content of an instance, or of the assembly or a deck without parts.
#[derive(Debug)]
pub(super) struct PlacedScope {
    /// Index of the instance; `None` for the assembly.
    pub instance: Option<usize>,
    pub scope: Scope,
    /// Difference of the node numbers of the model from those of the scope.
    pub shift: i64,
    pub moved: Placement,
}

impl DeckMesh {
    /// Reads nodes, elements and node sets of `deck`.
    ///
    /// # Errors
    /// FB110 for lines that cannot be read, FB111 for cards that define nodes in a way that is not supported.
    pub(super) fn of(deck: &Deck) -> Diagnosed<Self> {
        Self::read(deck, false)
    }

    /// Reads nodes, elements and node sets of `deck`, and keeps its scopes if `keep_scopes` is true.
    ///
    /// # Errors
    /// FB110 for lines that cannot be read, FB111 for cards that define nodes in a way that is not supported.
    pub(super) fn read(deck: &Deck, keep_scopes: bool) -> Diagnosed<Self> {
        let mut reading = DeckMeshReader { deck, bad: BadLines::default(), placed: 0 };
        let mut scopes = Scopes::default();
        for (at, card) in deck.cards().iter().enumerate() {
            reading.card(card, &mut scopes);
            if keep_scopes && SCOPED.contains(&card.keyword.as_str()) {
                Arc::make_mut(&mut scopes.current().cards).push(at);
            }
        }
        reading.bad.finish(Code::DeckSyntax, "line")?;
        scopes.assembled(keep_scopes)
    }

    /// Returns the elements for drawing.
    pub(super) fn drawn(&self) -> flexbody_model::Elements {
        self.drawn_with(|_, nodes| nodes)
    }

    /// Returns the elements for drawing, quadratic shells by their corners: CalculiX has no rows for the nodes between.
    pub(super) fn drawn_by_corners(&self) -> flexbody_model::Elements {
        self.drawn_with(|kind, nodes| match kind {
            "S6" | "S8" | "S8R" => nodes.get(..nodes.len() / 2).unwrap_or(nodes),
            _ => nodes,
        })
    }

    fn drawn_with(&self, part: impl for<'n> Fn(&str, &'n [i64]) -> &'n [i64]) -> flexbody_model::Elements {
        let mut drawn = flexbody_model::Elements::default();
        for Elements { kind, members } in &self.elements {
            for (_, nodes) in members.iter() {
                match drawing(kind, part(kind, nodes)) {
                    Drawing::Shape(shape, nodes) => drawn.add(kind, shape, &nodes),
                    Drawing::Nothing => {}
                    Drawing::Unknown => drawn.leave_out(kind, 1),
                }
            }
        }
        drawn
    }
}

/// Part at a position of the assembly.
#[derive(Debug, Clone)]
struct Instance {
    name: String,
    /// Nodes, elements and sets of the part, and those defined within the instance.
    scope: Scope,
    moved: Placement,
}

/// Displacement, then a rotation about an axis.
#[derive(Debug, Clone, Default)]
pub(super) struct Placement {
    displacement: [f64; 3],
    /// Two points of the axis, and the angle in degrees.
    turn: Option<[f64; 7]>,
}

impl Placement {
    /// Returns the position of a point of the part.
    pub(super) fn of(&self, x: [f64; 3]) -> [f64; 3] {
        let mut x = Vector3::from(x) + Vector3::from(self.displacement);
        if let Some([a, b, c, ..]) = self.turn {
            let from = Vector3::new(a, b, c);
            x = from + self.rotation() * (x - from);
        }
        x.into()
    }

    /// Returns the rotation of the part.
    pub(super) fn rotation(&self) -> Rotation3<f64> {
        self.turn.map_or(Rotation3::identity(), |[a, b, c, d, e, f, degrees]| {
            let axis = Vector3::new(d - a, e - b, f - c);
            rotation(&Unit::new_normalize(axis), degrees.to_radians())
        })
    }
}

/// Scopes to which the cards of a deck belong.
#[derive(Debug, Default)]
struct Scopes {
    /// Scope of the assembly, or of a deck without parts.
    top: Scope,
    parts: HashMap<String, Scope>,
    instances: Vec<Instance>,
    /// Index of the first instance of each name in the form of comparison.
    places: HashMap<String, usize>,
    part: Option<String>,
    in_instance: bool,
}

impl Scopes {
    /// Returns the index of an instance that sets of the assembly may name; `None` within a part or an instance.
    fn instance(&self, name: &str) -> Option<usize> {
        let is_assembly = self.part.is_none() && !self.in_instance;
        self.places.get(&comparable(name)).copied().filter(|_| is_assembly)
    }

    /// Returns the node `INSTANCE.12` or the set `INSTANCE.SET`.
    fn named(&self, name: &str) -> Option<Item> {
        dotted(name).find_map(|(instance, rest)| {
            let instance = self.instance(instance)?;
            let set = self.instances[instance].scope.sets.so_far(rest).map(Members::Set);
            let node = || integer(rest.as_bytes()).map(|id| Members::Numbers(vec![id]));
            Some(Item { instance: Some(instance), members: set.or_else(node)? })
        })
    }

    /// Returns the scope to which cards belong; `None` for a part without content.
    fn open(&self) -> Option<&Scope> {
        match (&self.part, self.in_instance) {
            (Some(part), _) => self.parts.get(part),
            (None, true) => self.instances.last().map(|instance| &instance.scope),
            _ => Some(&self.top),
        }
    }

    fn current(&mut self) -> &mut Scope {
        match (&self.part, self.in_instance) {
            (Some(part), _) => self.parts.entry(part.clone()).or_default(),
            (None, true) => &mut self.instances.last_mut().expect("an instance is open").scope,
            _ => &mut self.top,
        }
    }

    /// Returns the model of all instances. Node numbers are kept if no two instances share one; else every instance
    /// gets a separate range of numbers.
    fn assembled(self, keep_scopes: bool) -> Diagnosed<DeckMesh> {
        let placed: Vec<(&Instance, &Scope)> =
            self.instances.iter().map(|instance| (instance, &instance.scope)).collect();
        let mut taken: HashSet<i64> = self.top.nodes.keys().copied().collect();
        let unique = placed.iter().all(|(_, scope)| scope.nodes.keys().all(|id| taken.insert(*id)));
        let keys = placed.iter().map(|(_, scope)| &scope.nodes).chain([&self.top.nodes]);
        let highest = keys.filter_map(|nodes| nodes.keys().next_back().copied()).max().unwrap_or(0);
        if !unique && highest > MAX_NODE_NUMBER / placed.len() as i64 {
            let message =
                format!("instances share node numbers, which are too large ({highest}) to be changed");
            return Err(vec![Diagnostic::new(Code::DeckUnsupported, message)]);
        }
        // Each instance gets a range of numbers above the highest one, a power of ten apart.
        let stride = if unique { 0 } else { power_of_ten_above(highest) };
        // Nodes of the assembly keep their numbers.
        let first = i64::from(!self.top.nodes.is_empty());
        let mut mesh = DeckMesh {
            nodes: self.top.nodes.as_ref().clone(),
            elements: self.top.elements.as_ref().clone(),
            ..DeckMesh::default()
        };
        let mut numbers = Numbers::default();
        let mut instances = Vec::new();
        for (k, (instance, scope)) in placed.iter().enumerate() {
            let shift = stride * (k as i64 + first);
            if shift > 0 {
                let message = format!(
                    "nodes of the instance `{}` are numbered from {}: instances share numbers",
                    instance.name,
                    shift + 1
                );
                mesh.notes.push(Diagnostic::new(Code::DeckRenumbered, message));
            }
            mesh.add(scope, shift, instance);
            if keep_scopes {
                let (scope, moved) = ((*scope).clone(), instance.moved.clone());
                mesh.scopes.push(PlacedScope { instance: Some(k), scope, shift, moved });
            }
            instances.push(SetInstance { name: instance.name.clone(), scope: numbers.scope(scope, shift) });
        }
        mesh.sets = NodeSets::of_instances(numbers.scope(&self.top, 0), instances, keep_scopes);
        if keep_scopes {
            let moved = Placement::default();
            mesh.scopes.push(PlacedScope { instance: None, scope: self.top, shift: 0, moved });
        }
        Ok(mesh)
    }
}

/// Numbers of the nodes of scopes. Instances of a part share them.
#[derive(Default)]
struct Numbers(HashMap<*const BTreeMap<i64, [f64; 3]>, Arc<Vec<i64>>>);

impl Numbers {
    /// Returns the sets of a scope with its nodes and elements.
    fn scope(&mut self, scope: &Scope, shift: i64) -> SetScope {
        let numbers = || Arc::new(scope.nodes.keys().copied().collect());
        SetScope {
            nodes: Arc::clone(&scope.sets),
            elements: Arc::clone(&scope.element_sets),
            ids: Arc::clone(self.0.entry(Arc::as_ptr(&scope.nodes)).or_insert_with(numbers)),
            element_nodes: scope.elements.iter().map(|elements| Arc::clone(&elements.members)).collect(),
            shift,
            index: SetIndex::default(),
        }
    }
}

impl DeckMesh {
    fn add(&mut self, scope: &Scope, shift: i64, instance: &Instance) {
        self.nodes.extend(scope.nodes.iter().map(|(id, x)| (id + shift, instance.moved.of(*x))));
        for elements in scope.elements.iter() {
            let member =
                |(id, nodes): &(i64, Vec<i64>)| (id + shift, nodes.iter().map(|id| id + shift).collect());
            let members = match shift {
                0 => Arc::clone(&elements.members),
                _ => Arc::new(elements.members.iter().map(member).collect()),
            };
            self.elements.push(Elements { kind: elements.kind.clone(), members });
        }
    }

    /// Returns the nodes of the elements of an element set outside of parts and instances.
    pub(super) fn nodes_of_elements(&self, set: &str) -> Option<Vec<i64>> {
        let members: HashSet<i64> = self.sets.elements(set)?.into_iter().collect();
        let elements = self.elements.iter().flat_map(|elements| elements.members.iter());
        let nodes =
            elements.filter(|(id, _)| members.contains(id)).flat_map(|(_, nodes)| nodes.iter().copied());
        Some(nodes.collect::<BTreeSet<i64>>().into_iter().collect())
    }

    /// Returns the nodes of a set.
    pub(super) fn set(&self, name: &str) -> Option<Vec<i64>> {
        self.sets.find(name)?.ok()
    }
}

/// Returns the lowest power of ten above `number`.
fn power_of_ten_above(number: i64) -> i64 {
    let mut power = 10i64;
    while power <= number && power < i64::MAX / 10 {
        power *= 10;
    }
    power
}

/// State of reading a deck.
struct DeckMeshReader<'d> {
    deck: &'d Deck,
    bad: BadLines,
    /// Number of nodes and elements of the instances so far.
    placed: usize,
}

impl DeckMeshReader<'_> {
    fn card(&mut self, card: &Card, scopes: &mut Scopes) {
        match card.keyword.as_str() {
            "PART" => scopes.part = Some(card.name("NAME").unwrap_or_default()),
            "ENDPART" => scopes.part = None,
            "INSTANCE" => {
                let moved = self.placement(card);
                let name = card.parameter("NAME").unwrap_or_default().to_owned();
                let part = card.name("PART").unwrap_or_default();
                let scope = scopes.parts.get(&part).cloned().unwrap_or_default();
                let scope = self.within_memory(card, scope);
                scopes.places.entry(comparable(&name)).or_insert(scopes.instances.len());
                scopes.instances.push(Instance { name, scope, moved });
                scopes.in_instance = true;
            }
            "ENDINSTANCE" => scopes.in_instance = false,
            "NODE" => self.nodes(card, scopes.current()),
            "ELEMENT" => self.elements(card, scopes.current()),
            "NSET" => self.set(card, scopes),
            "ELSET" => self.element_set(card, scopes.current()),
            "NGEN" | "NFILL" | "NCOPY" | "NMAP" | "ELGEN" | "ELCOPY" | "SYSTEM" => {
                let message = format!("*{} is not read", card.title);
                let help = "write the nodes and elements one by one, as preprocessors do";
                self.bad.add(self.deck.about(card, Code::DeckUnsupported, message).with_help(help));
            }
            _ => {}
        }
    }

    fn syntax(&mut self, card: &Card, line: usize, expected: &str, text: &[u8]) {
        let message = format!("*{}: expected {expected}, found `{}`", card.title, excerpt(text));
        self.bad.add(self.deck.at(card, line, Code::DeckSyntax, message).with_help("correct the line"));
    }

    fn numbers(&mut self, card: &Card, most: usize) -> Option<Vec<Vec<f64>>> {
        let mut rows = Vec::new();
        for (line, text) in self.deck.data(card) {
            let row: Option<Vec<f64>> = fields(text).map(real).collect();
            match row {
                Some(row) if row.len() <= most => rows.push(row),
                _ => {
                    self.syntax(card, line, &format!("up to {most} numbers"), text);
                    return None;
                }
            }
        }
        Some(rows)
    }

    /// Returns the content of an instance. Each instance places all nodes of its part once more: those that do not fit the
    /// memory are an error, and empty.
    fn within_memory(&mut self, card: &Card, scope: Scope) -> Scope {
        let elements: usize = scope.elements.iter().map(|elements| elements.members.len()).sum();
        self.placed += scope.nodes.len() + elements;
        let what = format!("placing {} nodes and elements of instances", self.placed);
        let needed = BYTES_PER_NODE * self.placed as f64;
        match refuse_beyond(left(), needed, &what, "remove instances, or use a larger machine") {
            Ok(()) => scope,
            Err(refused) => {
                let message = refused.first_error().message().to_owned();
                let refused = self.deck.about(card, Code::MemoryShort, message);
                self.bad.add(refused.with_help("remove instances, or use a larger machine"));
                Scope::default()
            }
        }
    }

    fn placement(&mut self, card: &Card) -> Placement {
        let rows = self.numbers(card, 7).unwrap_or_default();
        let mut placement = Placement::default();
        if let Some(row) = rows.first() {
            for (k, value) in row.iter().take(3).enumerate() {
                placement.displacement[k] = *value;
            }
        }
        if let Some(row) = rows.get(1) {
            let turn: Option<[f64; 7]> = row.as_slice().try_into().ok();
            placement.turn = turn.filter(|[a, b, c, d, e, f, _]| [a, b, c] != [d, e, f]);
            if placement.turn.is_none() {
                let message = "*INSTANCE: expected two points of an axis and an angle";
                self.bad.add(self.deck.about(card, Code::DeckSyntax, message).with_help("correct the line"));
            }
        }
        placement
    }

    fn nodes(&mut self, card: &Card, scope: &mut Scope) {
        let system = card.name("SYSTEM").unwrap_or_default();
        let mut ids = Vec::new();
        let nodes = Arc::make_mut(&mut scope.nodes);
        for (line, text) in self.deck.data(card) {
            let mut given = fields(text);
            let id = given.next().and_then(integer);
            let mut x = [0.0; 3];
            let mut read = true;
            for coordinate in &mut x {
                let Some(field) = given.next() else { break };
                match real(field) {
                    Some(value) => *coordinate = value,
                    None => read = false,
                }
            }
            match id {
                Some(id) if read && x.iter().all(|value| value.is_finite()) => {
                    nodes.insert(id, in_cartesian(&system, x));
                    ids.push(id);
                }
                _ => self.syntax(card, line, "a node number and its coordinates", text),
            }
        }
        if let Some(name) = card.parameter("NSET") {
            Arc::make_mut(&mut scope.sets).extend(name, Ok(vec![Item::own(Members::Numbers(ids))]));
        }
    }

    fn elements(&mut self, card: &Card, scope: &mut Scope) {
        let Some(kind) = card.name("TYPE") else {
            let diagnostic = self.deck.about(card, Code::DeckSyntax, "*ELEMENT has no TYPE");
            return self.bad.add(diagnostic.with_help("write *ELEMENT, TYPE=C3D20, for example"));
        };
        let mut members: Vec<(i64, Vec<i64>)> = Vec::new();
        let mut continues = false;
        for (line, text) in self.deck.data(card) {
            let ids: Option<Vec<i64>> = fields(text).filter(|field| !field.is_empty()).map(integer).collect();
            let Some(ids) = ids else {
                self.syntax(card, line, "an element number and its nodes", text);
                continue;
            };
            match (continues, members.last_mut()) {
                (true, Some((_, nodes))) => nodes.extend(ids),
                _ => members.extend(ids.split_first().map(|(id, nodes)| (*id, nodes.to_vec()))),
            }
            // A line that ends with a comma continues. Elements with many nodes continue without a comma as well.
            let wanted = super::element_kinds::n_nodes(&kind);
            let have = members.last().map_or(0, |(_, nodes)| nodes.len());
            continues = wanted.map_or(text.ends_with(b","), |wanted| have < wanted);
        }
        if let Some(name) = card.name("ELSET") {
            let ids = members.iter().map(|(id, _)| *id).collect();
            Arc::make_mut(&mut scope.element_sets).extend(&name, Ok(vec![Item::own(Members::Numbers(ids))]));
        }
        Arc::make_mut(&mut scope.elements).push(Elements { kind, members: Arc::new(members) });
    }

    /// Returns the parts of a set: numbers, ranges with GENERATE, and the result of `known` for names. The first unknown
    /// name is an error for the whole set.
    ///
    /// * `instance`: index of the instance to which numbers belong; `None` for the scope of the card.
    fn items(
        &mut self,
        card: &Card,
        instance: Option<usize>,
        known: impl Fn(&str) -> Option<Item>,
    ) -> Result<Vec<Item>, Diagnostic> {
        let generate = card.parameter("GENERATE").is_some();
        let (mut items, mut unknown) = (Vec::new(), None);
        let mut numbers = Vec::new();
        let listed = |numbers: &mut Vec<i64>| {
            let members = std::mem::take(numbers);
            (!members.is_empty()).then_some(Item { instance, members: Members::Numbers(members) })
        };
        for (line, text) in self.deck.data(card) {
            if generate {
                let bounds: Option<Vec<i64>> =
                    fields(text).filter(|field| !field.is_empty()).map(integer).collect();
                match bounds.as_deref().and_then(range) {
                    Some(members) => items.push(Item { instance, members }),
                    None => self.syntax(card, line, "first, last and increment", text),
                }
                continue;
            }
            for field in fields(text).filter(|field| !field.is_empty()) {
                let name = String::from_utf8_lossy(field);
                let name = name.trim_matches('"');
                if let Some(number) = integer(name.as_bytes()) {
                    numbers.push(number);
                } else if let Some(item) = known(name) {
                    items.extend(listed(&mut numbers));
                    items.push(item);
                } else {
                    let message = format!(
                        "*{}: `{name}` is neither a number nor a set that is defined above",
                        card.title
                    );
                    let help = "define the set before this line, or correct the name";
                    let refused = self.deck.at(card, line, Code::DeckSyntax, message).with_help(help);
                    unknown.get_or_insert(refused);
                }
            }
        }
        items.extend(listed(&mut numbers));
        match unknown {
            None => Ok(items),
            Some(refused) => Err(refused),
        }
    }

    fn set(&mut self, card: &Card, scopes: &mut Scopes) {
        let Some(name) = card.parameter("NSET").map(str::to_owned) else {
            let diagnostic = self.deck.about(card, Code::DeckSyntax, "*NSET has no name");
            return self.bad.add(diagnostic.with_help("write *NSET, NSET=NAME"));
        };
        let items = match card.parameter("ELSET").filter(|elements| !elements.is_empty()) {
            Some(elements) => self.nodes_of_elements(card, elements, scopes).map(|item| vec![item]),
            None => self.nodes_of_set(card, scopes),
        };
        Arc::make_mut(&mut scopes.current().sets).extend(&name, items);
    }

    /// Returns the nodes of *NSET, ELSET=NAME, of an instance or of the scope of the card.
    fn nodes_of_elements(&self, card: &Card, elements: &str, scopes: &Scopes) -> Result<Item, Diagnostic> {
        let nodes = match card.parameter("INSTANCE") {
            Some(instance) => scopes.instance(instance).and_then(|at| {
                let set = scopes.instances[at].scope.element_sets.so_far(elements)?;
                Some(Item { instance: Some(at), members: Members::NodesOfElements(set) })
            }),
            None => {
                let set = scopes.open().and_then(|scope| scope.element_sets.so_far(elements));
                set.map(|set| Item::own(Members::NodesOfElements(set)))
            }
        };
        nodes.ok_or_else(|| {
            let message = format!("element set `{elements}` is not defined above");
            let diagnostic = self.deck.about(card, Code::DeckSyntax, message);
            diagnostic.with_help("define the element set before this line")
        })
    }

    /// Returns the nodes of *NSET by numbers and names, of an instance or of the scope of the card.
    fn nodes_of_set(&mut self, card: &Card, scopes: &Scopes) -> Result<Vec<Item>, Diagnostic> {
        let Some(instance) = card.parameter("INSTANCE") else {
            let known = |set: &str| {
                let own = scopes.open().and_then(|scope| scope.sets.so_far(set));
                own.map(|set| Item::own(Members::Set(set))).or_else(|| scopes.named(set))
            };
            return self.items(card, None, known);
        };
        match scopes.instance(instance) {
            Some(at) => self.items(card, Some(at), |set| {
                let set = scopes.instances[at].scope.sets.so_far(set)?;
                Some(Item { instance: Some(at), members: Members::Set(set) })
            }),
            None => {
                let message = format!("the instance `{instance}` is not in the deck");
                let diagnostic = self.deck.about(card, Code::DeckSyntax, message);
                Err(diagnostic.with_help("name an instance of the assembly"))
            }
        }
    }

    fn element_set(&mut self, card: &Card, scope: &mut Scope) {
        // Element sets of the assembly select elements of instances; they are not needed.
        let (Some(name), None) = (card.name("ELSET"), card.parameter("INSTANCE")) else { return };
        let known = |set: &str| scope.element_sets.so_far(set).map(|set| Item::own(Members::Set(set)));
        let items = self.items(card, None, known);
        let sets = Arc::make_mut(&mut scope.element_sets);
        // A set with an unknown name is unknown as well.
        match items {
            Ok(items) => sets.extend(&name, Ok(items)),
            Err(_) => sets.forget(&name),
        }
    }
}

/// Returns the range of a line of a generated set: first, last and increment.
fn range(bounds: &[i64]) -> Option<Members> {
    let (first, last, step) = match *bounds {
        [first, last] => (first, last, 1),
        [first, last, step] if step > 0 => (first, last, step),
        _ => return None,
    };
    let few = last.checked_sub(first).is_some_and(|length| length / step < MAX_GENERATED);
    (first <= last && few).then_some(Members::Range { first, last, step })
}

/// Returns a number; an empty field is zero.
fn real(field: &[u8]) -> Option<f64> {
    if field.is_empty() { Some(0.0) } else { scanner::real(field) }
}

/// Returns Cartesian coordinates of a node in cylindrical (`C`: radius, degrees, z) or spherical coordinates (`S`:
/// radius, longitude and latitude in degrees).
fn in_cartesian(system: &str, x: [f64; 3]) -> [f64; 3] {
    let [r, theta, third] = x;
    let (sin, cos) = sincos(theta.to_radians());
    match system {
        "C" => [r * cos, r * sin, third],
        "S" => {
            let (up, out) = sincos(third.to_radians());
            [r * cos * out, r * sin * out, r * up]
        }
        _ => x,
    }
}
