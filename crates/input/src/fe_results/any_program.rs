//! Results of any FE program: a table with the columns `step`, `node`, three displacements and six stresses, or HDF5
//! with the datasets `nodes` (n), `displacements` (steps x 3n), `stresses` (steps x 6n) and optionally `strain_energy`
//! (steps), node by node.

use super::step_values::{Place, Step, StepValues, unreadable};
use crate::array::Array;
use crate::hdf5::read_array;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{excerpt, integer, number};
use flexbody_base::text::table::{Column, Table};

const NAMES: [&str; 11] = ["step", "node", "ux", "uy", "uz", "sxx", "syy", "szz", "sxy", "syz", "sxz"];

/// Significant decimal digits that a table is assumed to have.
const DIGITS: u8 = 6;

/// Reads displacements and stresses of all steps, numbered from 1.
///
/// # Errors
/// FB203, FB204 for a table that cannot be read, FB327 for steps that are not in ascending order from 1.
pub(super) fn read_table(file: &InputFile) -> Diagnosed<StepValues> {
    let columns = NAMES.map(|name| Column { name, required: true });
    let table = Table::open(file, &columns).map_err(|diagnostic| vec![diagnostic])?;
    let rows = table.rows(|_, fields| {
        let wrong = |k: usize| {
            let message = format!("column `{}` has `{}`", NAMES[k], excerpt(fields[k]));
            Diagnostic::new(Code::TableRow, message)
        };
        let whole = |k: usize| integer(fields[k]).ok_or_else(|| wrong(k));
        let mut values = [0.0; 9];
        for (k, value) in values.iter_mut().enumerate() {
            *value = number(fields[k + 2]).ok_or_else(|| wrong(k + 2))?;
        }
        Ok((whole(0)?, whole(1)?, values))
    })?;
    let mut steps: Vec<Step> = Vec::new();
    for (step, node, values) in rows {
        let last = steps.len() as i64;
        if step == last + 1 {
            steps.push(Step::default());
        } else if step != last || last == 0 {
            let message = format!("rows of step {step} come after those of step {last}");
            return Err(unreadable(file, message));
        }
        let open = steps.last_mut().expect("a step was begun");
        open.displacements.push((node, [values[0], values[1], values[2]]));
        open.stresses.push((Place::Node(node), std::array::from_fn(|k| values[3 + k])));
    }
    StepValues::of(steps, DIGITS, file)?.with_stresses(file)
}

/// Reads displacements and stresses of all steps.
///
/// # Errors
/// FB327 for arrays that do not fit each other, and the errors of arrays.
pub(super) fn read_hdf5(file: &InputFile) -> Diagnosed<StepValues> {
    let about = |found: Vec<Diagnostic>| -> Vec<_> {
        found.into_iter().map(|diagnostic| diagnostic.in_file(file.path())).collect()
    };
    let array = |name: &str| read_array(file, Some(name)).map_err(about);
    let (nodes, displacements, stresses) = (array("nodes")?, array("displacements")?, array("stresses")?);
    let energies = match read_array(file, Some("strain_energy")) {
        Ok(energies) => Some(energies.values),
        Err(found) if found.iter().all(|diagnostic| diagnostic.code() == Code::Hdf5Layout) => None,
        Err(found) => return Err(about(found)),
    };
    let n = nodes.values.len();
    let steps = stresses.rows;
    let fits = |array: &Array, components: usize| array.rows == steps && array.cols == components * n;
    if !fits(&displacements, 3) || !fits(&stresses, 6) {
        let message = format!(
            "`displacements` are {} x {}, `stresses` {} x {} for {n} nodes, expected steps x {} and steps x {}",
            displacements.rows,
            displacements.cols,
            stresses.rows,
            stresses.cols,
            3 * n,
            6 * n
        );
        return Err(unreadable(file, message));
    }
    if energies.as_ref().is_some_and(|energies| energies.len() != steps) {
        return Err(unreadable(file, format!("`strain_energy` does not have {steps} values")));
    }
    let node = |at: usize| nodes.values[at] as i64;
    let step = |step: usize| Step {
        stresses: (0..n)
            .map(|at| {
                (Place::Node(node(at)), std::array::from_fn(|k| stresses.values[(step * n + at) * 6 + k]))
            })
            .collect(),
        displacements: (0..n)
            .map(|at| (node(at), std::array::from_fn(|k| displacements.values[(step * n + at) * 3 + k])))
            .collect(),
        energy: energies.as_ref().map(|energies| energies[step]),
    };
    let digits = stresses.digits.min(displacements.digits).min(15);
    StepValues::of((0..steps).map(step).collect(), digits, file)?.with_stresses(file)
}
