//! Meshes and nodal variables of Exodus II, in HDF5 (netCDF-4) and in classic netCDF: `coordx`, `coordy`, `coordz` (or
//! `coord`), `node_num_map`, `node_ns1`, ... and their names `ns_names`, or numbers `ns_prop1`, `connect1`, ...,
//! `name_nod_var` with `vals_nod_var1`, ....

mod classic;
#[cfg(feature = "hdf5")]
mod netcdf4;
#[cfg(not(feature = "hdf5"))]
#[path = "exodus/without_hdf5.rs"]
mod netcdf4;
mod variables;

use super::classic_netcdf::{ClassicNetcdf, is_classic};
use super::matrices::HEAD;
use super::mesh::in_order_of_shape;
use super::sets::{Item, Members, NodeSets, SetList};
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::InputFile;
use flexbody_model::{ElementShape, Elements, Nodes};
use variables::{ExodusFile, NumberTable, wrong};

/// Largest number of members of all sets together, for each byte of the file: sets of more members name datasets that
/// others name as well, or are packed far more densely than node numbers are.
const MAX_MEMBERS_PER_BYTE: u64 = 16;

/// Number of members that the sets of any file may have.
const MIN_MEMBERS: u64 = 1 << 20;

/// Variables of the nodes at every time.
pub(super) struct NodalVariables {
    pub ids: Vec<i64>,
    pub names: Vec<String>,
    /// Values of each variable, time by time.
    pub values: Vec<Vec<f64>>,
    pub times: usize,
    /// True if any variable has single precision.
    pub is_single: bool,
}

/// Runs `read` on the file in either form.
fn with_file<T>(file: &InputFile, read: impl FnOnce(&dyn ExodusFile) -> Diagnosed<T>) -> Diagnosed<T> {
    let found = if is_classic(&file.first_bytes(HEAD)) {
        file.load().map_err(|diagnostic| vec![diagnostic])?;
        let opened = ClassicNetcdf::open(file.bytes()).map_err(wrong)?;
        read(&opened)
    } else {
        netcdf4::with_exodus(file, read)?
    };
    // Errors of datasets are reported as errors of nodes, not of matrices.
    found.map_err(|found| found.iter().flat_map(|one| wrong(one.message().to_owned())).collect())
}

/// Reads nodes, node sets and elements. Nodes have the numbers of `node_num_map`, or 1, 2, ... without it.
///
/// # Errors
/// FB101 for a file that cannot be opened, FB115 for a file that is no such mesh.
pub(super) fn read_mesh(file: &InputFile) -> Diagnosed<(Nodes, NodeSets, Elements)> {
    with_file(file, |opened| {
        let positions = positions(opened)?;
        let ids = ids(opened, positions.len())?;
        if ids.len() != positions.len() {
            let message = format!("`node_num_map` has {} numbers for {} nodes", ids.len(), positions.len());
            return Err(wrong(message));
        }
        let most = file.length().saturating_mul(MAX_MEMBERS_PER_BYTE).max(MIN_MEMBERS);
        let sets = NodeSets::of_nodes(&ids, sets(opened, &ids, most)?);
        let elements = elements(opened, &ids)?;
        Ok((Nodes { ids, positions }, sets, elements))
    })
}

/// Returns true if a file is an Exodus file with variables of the nodes.
pub(super) fn has_nodal_variables(file: &InputFile) -> bool {
    with_file(file, |opened| Ok(opened.has("name_nod_var"))).unwrap_or(false)
}

/// Reads the variables of the nodes: `name_nod_var` and `vals_nod_var1`, `vals_nod_var2`, ... (times x nodes), or in
/// older files one `vals_nod_var` (times x variables x nodes).
///
/// # Errors
/// FB101 for a file that cannot be opened, FB115 for variables that do not fit the nodes.
pub(super) fn read_nodal_variables(file: &InputFile) -> Diagnosed<NodalVariables> {
    with_file(file, |opened| {
        let ids = ids(opened, positions(opened)?.len())?;
        let names = opened.names("name_nod_var")?;
        if !opened.has("vals_nod_var1") && opened.has("vals_nod_var") {
            return of_one_variable(opened, ids, names);
        }
        let (mut values, mut times, mut is_single) = (Vec::new(), None, false);
        for variable in 1..=names.len() {
            let name = format!("vals_nod_var{variable}");
            let table = opened.table(&name)?;
            let (steps, nodes) = (table.rows, table.columns);
            if nodes != ids.len() || *times.get_or_insert(steps) != steps {
                let message = format!("`{name}` has {steps} times of {nodes} nodes");
                return Err(wrong(format!("{message}, expected {} of {}", times.unwrap_or(0), ids.len())));
            }
            is_single |= table.is_single_precision;
            values.push(table.values);
        }
        Ok(NodalVariables { ids, names, values, times: times.unwrap_or(0), is_single })
    })
}

/// Returns the variables of the nodes of a file that has all of them in `vals_nod_var`.
fn of_one_variable(opened: &dyn ExodusFile, ids: Vec<i64>, names: Vec<String>) -> Diagnosed<NodalVariables> {
    let count = names.len();
    let NumberTable { rows, columns: nodes, values: all, is_single_precision } =
        opened.stacked("vals_nod_var", count)?;
    if nodes != ids.len() || count == 0 {
        let message = format!("`vals_nod_var` has {count} variables of {nodes} nodes");
        return Err(wrong(format!("{message}, expected one or more of {} nodes", ids.len())));
    }
    let times = rows / count;
    let row = |time: usize, variable: usize| {
        let first = (time * count + variable) * nodes;
        &all[first..first + nodes]
    };
    let of = |variable: usize| (0..times).flat_map(|time| row(time, variable).iter().copied()).collect();
    let values = (0..count).map(of).collect();
    Ok(NodalVariables { ids, names, values, times, is_single: is_single_precision })
}

/// Returns the numbers of `count` nodes.
fn ids(file: &dyn ExodusFile, count: usize) -> Diagnosed<Vec<i64>> {
    if file.has("node_num_map") {
        file.whole_numbers("node_num_map")
    } else {
        Ok((1..=count as i64).collect())
    }
}

fn positions(file: &dyn ExodusFile) -> Diagnosed<Vec<[f64; 3]>> {
    let axes: Vec<Vec<f64>> = if file.has("coordx") {
        let names = ["coordx", "coordy", "coordz"].into_iter().filter(|name| file.has(name));
        names.map(|name| file.floats(name)).collect::<Diagnosed<_>>()?
    } else if file.has("coord") {
        let table = file.table("coord")?;
        table.values.chunks(table.columns.max(1)).map(<[f64]>::to_vec).collect()
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

/// Returns the elements of all blocks, which list node positions from 1.
fn elements(file: &dyn ExodusFile, ids: &[i64]) -> Diagnosed<Elements> {
    let mut elements = Elements::default();
    for name in (1..).map(|k| format!("connect{k}")).take_while(|name| file.has(name)) {
        let kind = file.element_type(&name);
        let table = file.table(&name)?;
        for places in table.values.chunks(table.columns.max(1)) {
            let whole = |place: &f64| (place.fract() == 0.0).then_some(*place as i64);
            let nodes = nodes_at(&name, ids, places.iter().map(whole))?;
            add_element(&mut elements, &kind, &nodes);
        }
    }
    Ok(elements)
}

/// Returns the node sets, which list node positions from 1. A set without a name is named by its number.
///
/// * `most`: largest number of members of all sets together.
fn sets(file: &dyn ExodusFile, ids: &[i64], most: u64) -> Diagnosed<SetList> {
    let names = if file.has("ns_names") { file.names("ns_names")? } else { Vec::new() };
    let numbers = if file.has("ns_prop1") { file.whole_numbers("ns_prop1")? } else { Vec::new() };
    let (mut sets, mut members) = (SetList::default(), 0);
    for k in 0.. {
        let list = format!("node_ns{}", k + 1);
        if !file.has(&list) {
            // A set without nodes has no list.
            if k < names.len().max(numbers.len()) { continue } else { break }
        }
        let places = file.whole_numbers(&list)?;
        members += places.len() as u64;
        if members > most {
            let message =
                format!("the node sets up to `{list}` list {members} nodes together, more than {most}");
            return Err(wrong(message));
        }
        let nodes = nodes_at(&list, ids, places.iter().map(|place| Some(*place)))?;
        let number = numbers.get(k).copied().unwrap_or(k as i64 + 1);
        let name = names.get(k).filter(|name| !name.is_empty()).cloned();
        let name = name.unwrap_or_else(|| number.to_string());
        sets.add(&name, vec![Item::own(Members::Numbers(nodes))]);
    }
    Ok(sets)
}

/// Returns the numbers of the nodes at `places` (from 1), which a variable lists; `None` is an invalid position.
fn nodes_at(list: &str, ids: &[i64], places: impl Iterator<Item = Option<i64>>) -> Diagnosed<Vec<i64>> {
    let node = |place: Option<i64>| {
        let at = usize::try_from(place?.checked_sub(1)?).ok()?;
        ids.get(at).copied()
    };
    let nodes: Option<Vec<i64>> = places.map(node).collect();
    nodes.ok_or_else(|| wrong(format!("`{list}` names a node that does not exist")))
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
