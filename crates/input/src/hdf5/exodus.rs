//! Nodes, node sets and elements of Exodus II meshes in netCDF-4: `coordx`, `coordy`, `coordz` (or `coord`),
//! `node_num_map`, `node_ns1`, ... and their names `ns_names`, or numbers `ns_prop1`, `connect1`, ....

use super::values::{Found, Heaps, Numbers, Vector, names_of, refuse_beyond_memory, text_of};
use super::{Members, opened};
use crate::mesh::in_order_of_shape;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_model::{ElementShape, Elements, Nodes};
use hdf5_metno::Group;

const HELP: &str = "give an Exodus mesh in netCDF-4, or a table with the columns node, x, y, z";

/// Node numbers of sets by name.
type NamedSets = Vec<(String, Vec<i64>)>;

/// Reads nodes, node sets and elements. Nodes have the numbers of `node_num_map`, or 1, 2, ... without it.
///
/// # Errors
/// FB101 for a file that cannot be opened, FB115 for a file that is no such mesh.
pub(crate) fn read_exodus(file: &InputFile) -> Found<(Nodes, NamedSets, Elements)> {
    let opened = opened(file)?;
    let root = opened.group("/").map_err(|e| wrong(format!("file cannot be read: {e}")))?;
    let mesh = Mesh { members: Members::of(&root), root, heaps: Heaps::of(file) };
    // Errors of datasets are reported as errors of nodes, not of matrices.
    mesh.read().map_err(|found| found.iter().flat_map(|one| wrong(one.message().to_owned())).collect())
}

/// Variables of the nodes at every time.
pub(crate) struct NodalVariables {
    pub ids: Vec<i64>,
    pub names: Vec<String>,
    /// Values of each variable, time by time.
    pub values: Vec<Vec<f64>>,
    pub times: usize,
    /// True if any variable has single precision.
    pub is_single: bool,
}

/// Returns true if a file is an Exodus file with variables of the nodes.
pub(crate) fn has_nodal_variables(file: &InputFile) -> bool {
    let root = opened(file).ok().and_then(|file| file.group("/").ok());
    root.is_some_and(|root| Members::of(&root).is_here("name_nod_var"))
}

/// Reads the variables of the nodes: `name_nod_var` and `vals_nod_var1`, `vals_nod_var2`, ... (times x nodes).
///
/// # Errors
/// FB101 for a file that cannot be opened, FB115 for variables that do not fit the nodes.
pub(crate) fn read_nodal_variables(file: &InputFile) -> Found<NodalVariables> {
    let opened = opened(file)?;
    let root = opened.group("/").map_err(|e| wrong(format!("file cannot be read: {e}")))?;
    let mesh = Mesh { members: Members::of(&root), root, heaps: Heaps::of(file) };
    let count = mesh.positions()?.len();
    let ids = match mesh.has("node_num_map") {
        true => mesh.whole_numbers("node_num_map")?,
        false => (1..=count as i64).collect(),
    };
    let names = names_of(&mesh.root, &mesh.members, "name_nod_var")?;
    let (mut values, mut times, mut is_single) = (Vec::new(), None, false);
    for variable in 1..=names.len() {
        let dataset = format!("vals_nod_var{variable}");
        let numbers = Numbers::open(&mesh.root, &mesh.members, "", &dataset)?;
        let &[steps, nodes] = numbers.dataset.shape().as_slice() else {
            return Err(wrong(format!("dataset {} is not times x nodes", numbers.name)));
        };
        if nodes != ids.len() || *times.get_or_insert(steps) != steps {
            let message = format!("dataset {} has {steps} times of {nodes} nodes", numbers.name);
            return Err(wrong(format!("{message}, expected {} of {}", times.unwrap_or(0), ids.len())));
        }
        refuse_beyond_memory(numbers.dataset.size(), &numbers.name)?;
        is_single |= numbers.is_single_precision();
        let read = numbers.dataset.read_raw::<f64>();
        values.push(read.map_err(|e| wrong(format!("dataset {} cannot be read: {e}", numbers.name)))?);
    }
    Ok(NodalVariables { ids, names, values, times: times.unwrap_or(0), is_single })
}

fn wrong(message: String) -> Vec<Diagnostic> {
    vec![Diagnostic::new(Code::NodeFileSyntax, message).with_help(HELP)]
}

struct Mesh<'f> {
    root: Group,
    members: Members,
    heaps: Heaps<'f>,
}

impl Mesh<'_> {
    fn read(&self) -> Found<(Nodes, NamedSets, Elements)> {
        let positions = self.positions()?;
        let ids = if self.has("node_num_map") {
            self.whole_numbers("node_num_map")?
        } else {
            (1..=positions.len() as i64).collect()
        };
        if ids.len() != positions.len() {
            let message = format!("`node_num_map` has {} numbers for {} nodes", ids.len(), positions.len());
            return Err(wrong(message));
        }
        let sets = self.sets(&ids)?;
        let elements = self.elements(&ids)?;
        Ok((Nodes { ids, positions }, sets, elements))
    }

    fn has(&self, name: &str) -> bool {
        self.members.link(name).is_some()
    }

    fn vector(&self, name: &str) -> Found<Vector> {
        Vector::open(&self.root, &self.members, "", name)
    }

    fn whole_numbers(&self, name: &str) -> Found<Vec<i64>> {
        let vector = self.vector(name)?;
        vector.integers(0..vector.len)
    }

    fn positions(&self) -> Found<Vec<[f64; 3]>> {
        let axes: Vec<Vec<f64>> = if self.has("coordx") {
            let names = ["coordx", "coordy", "coordz"].into_iter().filter(|name| self.has(name));
            let axis = |name| self.vector(name).and_then(|vector| vector.floats(0..vector.len));
            names.map(axis).collect::<Found<_>>()?
        } else if self.has("coord") {
            self.rows_of("coord")?
        } else {
            return Err(wrong("file has neither `coordx` nor `coord`: it is not an Exodus mesh".to_owned()));
        };
        let count = axes.first().map_or(0, Vec::len);
        if axes.len() > 3 || axes.iter().any(|axis| axis.len() != count) {
            return Err(wrong("the coordinates along the axes differ in number".to_owned()));
        }
        let along = |axis: usize, node: usize| axes.get(axis).map_or(0.0, |values| values[node]);
        Ok((0..count).map(|node| [0, 1, 2].map(|axis| along(axis, node))).collect())
    }

    /// Returns the rows of a dataset with two extents.
    fn rows_of(&self, name: &str) -> Found<Vec<Vec<f64>>> {
        let numbers = Numbers::open(&self.root, &self.members, "", name)?;
        let &[_, columns] = numbers.dataset.shape().as_slice() else {
            return Err(wrong(format!("dataset {} does not have one row for each axis", numbers.name)));
        };
        refuse_beyond_memory(numbers.dataset.size(), &numbers.name)?;
        let values = numbers.dataset.read_raw::<f64>();
        let values = values.map_err(|e| wrong(format!("dataset {} cannot be read: {e}", numbers.name)))?;
        Ok(values.chunks(columns.max(1)).map(<[f64]>::to_vec).collect())
    }

    /// Returns the elements of all blocks, which list node positions from 1.
    fn elements(&self, ids: &[i64]) -> Found<Elements> {
        let mut elements = Elements::default();
        for dataset in (1..).map(|k| format!("connect{k}")).take_while(|dataset| self.has(dataset)) {
            let opened = Numbers::open(&self.root, &self.members, "", &dataset)?;
            let kind = opened.dataset.attr("elem_type").ok();
            let kind = kind.and_then(|kind| text_of(&kind, &self.heaps)).unwrap_or_default();
            for places in self.rows_of(&dataset)? {
                let whole = |place: &f64| (place.fract() == 0.0).then_some(*place as i64);
                let nodes = nodes_at(&dataset, ids, places.iter().map(whole))?;
                add_element(&mut elements, &kind, &nodes);
            }
        }
        Ok(elements)
    }

    /// Returns the node sets, which list node positions from 1. A set without a name is named by its number.
    fn sets(&self, ids: &[i64]) -> Found<NamedSets> {
        let names =
            if self.has("ns_names") { names_of(&self.root, &self.members, "ns_names")? } else { Vec::new() };
        let numbers = if self.has("ns_prop1") { self.whole_numbers("ns_prop1")? } else { Vec::new() };
        let mut sets = Vec::new();
        for k in 0.. {
            let dataset = format!("node_ns{}", k + 1);
            if !self.has(&dataset) {
                // A set without nodes has no list.
                if k < names.len().max(numbers.len()) { continue } else { break }
            }
            let places = self.whole_numbers(&dataset)?;
            let nodes = nodes_at(&dataset, ids, places.iter().map(|place| Some(*place)))?;
            let number = numbers.get(k).copied().unwrap_or(k as i64 + 1);
            let name = names.get(k).filter(|name| !name.is_empty()).cloned();
            sets.push((name.unwrap_or_else(|| number.to_string()), nodes));
        }
        Ok(sets)
    }
}

/// Returns the numbers of the nodes at `places` (from 1), which a dataset lists; `None` is an invalid position.
fn nodes_at(dataset: &str, ids: &[i64], places: impl Iterator<Item = Option<i64>>) -> Found<Vec<i64>> {
    let node = |place: Option<i64>| {
        let at = usize::try_from(place?.checked_sub(1)?).ok()?;
        ids.get(at).copied()
    };
    let nodes: Option<Vec<i64>> = places.map(node).collect();
    nodes.ok_or_else(|| wrong(format!("`{dataset}` names a node that does not exist")))
}

/// Adds an element of a type with an Exodus name (`HEX8`, `TETRA`, `SHELL4`). Points are not drawn.
fn add_element(elements: &mut Elements, kind: &str, nodes: &[i64]) {
    let name = kind.to_ascii_uppercase();
    let begins = |heads: &[&str]| heads.iter().any(|head| name.starts_with(head));
    let shape = if begins(&["HEX"]) {
        ElementShape::Hexahedron
    } else if begins(&["TET"]) {
        ElementShape::Tetrahedron
    } else if begins(&["WEDGE", "PENTA"]) {
        ElementShape::Wedge
    } else if begins(&["PYR"]) {
        ElementShape::Pyramid
    } else if begins(&["TRI"]) || begins(&["SHELL"]) && [3, 6, 7].contains(&nodes.len()) {
        ElementShape::Triangle
    } else if begins(&["QUAD", "SHELL"]) {
        ElementShape::Quadrilateral
    } else if begins(&["BAR", "BEAM", "TRUSS", "EDGE"]) {
        ElementShape::Line
    } else {
        if !begins(&["SPHERE", "CIRCLE"]) {
            elements.leave_out(kind, 1);
        }
        return;
    };
    elements.add(kind, shape, &in_order_of_shape(shape, nodes));
}
