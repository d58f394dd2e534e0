//! The three tables: nodes, labels of the matrix rows, nodes of an interface.

use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error;
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{BadLines, excerpt, integer, number};
use flexbody_base::text::table::{Column, Table};
use flexbody_model::{DofLabel, Nodes, Quantity, RecoveryRow};
use std::collections::HashMap;
use std::path::Path;

const fn column(name: &'static str, required: bool) -> Column {
    Column { name, required }
}

/// Reads `node,x,y,z`; for `dimension` 2 `node,x,y`, where a column z must be zero.
pub(super) fn read_nodes(file: &InputFile, dimension: u8) -> Diagnosed<Nodes> {
    let plane = dimension == 2;
    let columns = [column("node", true), column("x", true), column("y", true), column("z", !plane)];
    let table = Table::open(file, &columns).map_err(|d| {
        vec![if d.message() == "column `z` is missing" {
            d.with_help("name the columns in the first line: `node,x,y,z`; in a plane model set `dimension = 2` in [model]")
        } else {
            d
        }]
    })?;
    let has_z = table.has(3);
    let rows = table.rows(|line, fields| {
        let node = node_number(fields[0])?;
        let mut position = [0.0; 3];
        for (k, axis) in ["x", "y", "z"].iter().enumerate().take(if has_z { 3 } else { 2 }) {
            position[k] = coordinate(node, axis, fields[k + 1])?;
        }
        if plane && position[2] != 0.0 {
            let message = format!("node {node} has z = {} in a plane model", position[2]);
            return Err(Diagnostic::new(Code::TableRow, message)
                .with_help("set z = 0 for all nodes of a plane model"));
        }
        Ok((node, line, position))
    })?;
    no_duplicates(file, rows.iter().map(|&(node, line, _)| (node, line)))?;
    Ok(Nodes { ids: rows.iter().map(|r| r.0).collect(), positions: rows.iter().map(|r| r.2).collect() })
}

/// Reads `node,dir` or `row,node,dir`. Returns the labels in the order of the matrix rows.
pub(super) fn read_dofs(file: &InputFile) -> Diagnosed<Vec<DofLabel>> {
    let columns = [column("node", true), column("dir", true), column("row", false)];
    let table = Table::open(file, &columns)
        .map_err(|d| vec![d.with_help("name the columns in the first line: `node,dir` or `row,node,dir`")])?;
    let numbered = table.has(2);
    let rows = table.rows(|line, fields| {
        let node = node_number(fields[0])?;
        let direction = match integer(fields[1]) {
            Some(direction @ 1..=6) => direction as u8,
            _ => {
                let message =
                    format!("direction of node {node} is `{}`, expected 1 to 6", excerpt(fields[1]));
                return Err(Diagnostic::new(Code::DofDirection, message));
            }
        };
        let row = match (numbered, integer(fields[2])) {
            (false, _) => 0,
            (true, Some(row)) => row,
            (true, None) => {
                let message = format!("row number is `{}`", excerpt(fields[2]));
                return Err(
                    Diagnostic::new(Code::TableRow, message).with_help("number the rows 0, 1, 2, ...")
                );
            }
        };
        Ok((row, line, DofLabel { node, direction }))
    })?;
    if numbered { by_row(file, &rows) } else { Ok(rows.into_iter().map(|r| r.2).collect()) }
}

/// Sorts labels by their row numbers, which must be 0 to n - 1, each once.
fn by_row(file: &InputFile, rows: &[(i64, usize, DofLabel)]) -> Diagnosed<Vec<DofLabel>> {
    let n = rows.len();
    let mut at: Vec<Option<usize>> = vec![None; n];
    let mut bad = BadLines::default();
    // Rows that are numbered from 1 get a specific help.
    let from_one = rows.iter().all(|r| r.0 >= 1) && rows.iter().any(|r| r.0 == n as i64);
    for (k, &(row, line, _)) in rows.iter().enumerate() {
        let slot = usize::try_from(row).ok().and_then(|row| at.get_mut(row));
        let message = match slot {
            Some(slot @ None) => {
                *slot = Some(k);
                continue;
            }
            Some(Some(first)) => format!("row {row} is given twice, first on line {}", rows[*first].1),
            None => format!("row {row} is out of range, {n} rows are numbered 0 to {}", n - 1),
        };
        let diagnostic = Diagnostic::new(Code::DofRowOrder, message).in_file(file.path()).at_line(line);
        bad.add(if from_one {
            diagnostic.with_help("number the rows from 0: they are numbered from 1")
        } else {
            diagnostic
        });
    }
    bad.finish(Code::TableRow, "row")?;
    Ok(at.into_iter().flatten().map(|k| rows[k].2).collect())
}

/// Reads the column `node`.
pub(super) fn read_node_list(file: &InputFile) -> Diagnosed<Vec<i64>> {
    let table = Table::open(file, &[column("node", true)]).map_err(|d| vec![d])?;
    let rows = table.rows(|line, fields| Ok((node_number(fields[0])?, line)))?;
    no_duplicates(file, rows.iter().copied())?;
    Ok(rows.into_iter().map(|r| r.0).collect())
}

/// Reads `row,name,quantity,component,unit` with optional `node` and `element`. Returns the labels in the order of the
/// rows of the operator.
///
/// # Errors
/// FB203, FB204 for a table that cannot be read, FB323 for unknown quantities and row numbers that are not 0, 1, 2, ...
pub(super) fn read_recovery_rows(file: &InputFile) -> Diagnosed<Vec<RecoveryRow>> {
    let columns = [
        column("row", true),
        column("name", true),
        column("quantity", true),
        column("component", true),
        column("unit", true),
        column("node", false),
        column("element", false),
    ];
    let table = Table::open(file, &columns).map_err(|d| {
        vec![d.with_help("name the columns in the first line: `row,name,quantity,component,unit`")]
    })?;
    let has = [table.has(5), table.has(6)];
    let text = |field: &[u8]| String::from_utf8_lossy(field).trim().to_owned();
    let mut rows = table.rows(|line, fields| {
        let wrong = |message: String| Diagnostic::new(Code::RecoveryRows, message).at_line(line);
        let Some(row) = integer(fields[0]) else {
            return Err(wrong(format!("row number is `{}`", excerpt(fields[0]))));
        };
        let quantity = text(fields[2]);
        let known = Quantity::from_name(&quantity).ok_or_else(|| {
            let all = Quantity::NAMES.join(", ");
            wrong(format!("quantity of row {row} is `{}`, expected one of {all}", excerpt(fields[2])))
        })?;
        let number = |at: usize, what: &str| match (has[at], fields[5 + at]) {
            (false, _) | (true, b"") => Ok(None),
            (true, field) => integer(field)
                .map(Some)
                .ok_or_else(|| wrong(format!("{what} number of row {row} is `{}`", excerpt(field)))),
        };
        let label = RecoveryRow {
            name: text(fields[1]),
            quantity: known,
            component: text(fields[3]),
            unit: text(fields[4]),
            node: number(0, "node")?,
            element: number(1, "element")?,
        };
        Ok((row, line, label))
    })?;
    rows.sort_by_key(|(row, ..)| *row);
    for (expected, (row, line, _)) in (0..).zip(&rows) {
        if *row != expected {
            let message =
                format!("row number is {row} where {expected} is expected: rows count from 0, each once");
            let wrong = Diagnostic::new(Code::RecoveryRows, message).in_file(file.path()).at_line(*line);
            return Err(vec![wrong]);
        }
    }
    Ok(rows.into_iter().map(|(.., label)| label).collect())
}

/// Reads `node,mass`.
pub(super) fn read_masses(file: &InputFile) -> Diagnosed<Vec<(i64, f64)>> {
    let columns = [column("node", true), column("mass", true)];
    let table = Table::open(file, &columns)
        .map_err(|d| vec![d.with_help("name the columns in the first line: `node,mass`")])?;
    let rows = table.rows(|line, fields| {
        let node = node_number(fields[0])?;
        match number(fields[1]) {
            Some(mass) if mass.is_finite() => Ok((node, line, mass)),
            _ => {
                let message =
                    format!("mass of node {node} is `{}`, expected a finite number", excerpt(fields[1]));
                Err(Diagnostic::new(Code::LumpedMassTable, message))
            }
        }
    })?;
    no_duplicates(file, rows.iter().map(|&(node, line, _)| (node, line)))?;
    Ok(rows.into_iter().map(|(node, _, mass)| (node, mass)).collect())
}

fn node_number(field: &[u8]) -> Result<i64, Diagnostic> {
    integer(field).ok_or_else(|| {
        Diagnostic::new(
            Code::TableRow,
            format!("node number is `{}`, expected a whole number", excerpt(field)),
        )
    })
}

fn coordinate(node: i64, axis: &str, field: &[u8]) -> Result<f64, Diagnostic> {
    let message = || format!("{axis} of node {node} is `{}`", excerpt(field));
    match number(field) {
        Some(value) if value.is_finite() => Ok(value),
        Some(_) => Err(Diagnostic::new(Code::CoordinateNotFinite, message())),
        None => {
            let diagnostic = Diagnostic::new(Code::TableRow, format!("{}, expected a number", message()));
            Err(if field.contains(&b',') {
                diagnostic.with_help("write numbers with a decimal point")
            } else {
                diagnostic
            })
        }
    }
}

fn no_duplicates(file: &InputFile, nodes: impl Iterator<Item = (i64, usize)>) -> Diagnosed<()> {
    let mut bad = BadLines::default();
    let mut first: HashMap<i64, usize> = HashMap::with_capacity(nodes.size_hint().0);
    for (node, line) in nodes {
        if let Some(before) = first.insert(node, line) {
            let message = format!("node {node} is given twice, first on line {before}");
            bad.add(Diagnostic::new(Code::NodeDuplicate, message).in_file(file.path()).at_line(line));
        }
    }
    bad.finish(Code::TableRow, "row")
}

/// Reads nodal masses `node,mass`, as a multibody program would have imported them.
///
/// # Errors
/// FB101 to FB106 for a file that cannot be read, FB203 to FB205 for an invalid table, FB803 for invalid masses.
pub fn read_nodal_masses(path: &Path) -> error::Result<Vec<(i64, f64)>> {
    read_masses(&InputFile::open(path)?).map_err(error::Error::new)
}

/// Reads the column `node` of a table.
///
/// # Errors
/// FB101 to FB106 for a file that cannot be read, FB203 to FB205 for an invalid table.
pub fn read_nodes_of_table(path: &Path) -> error::Result<Vec<i64>> {
    read_node_list(&InputFile::open(path)?).map_err(error::Error::new)
}
