//! Results in files of meshes: VTK in XML (.vtu), with the arrays `displacement N` and `stress N` of each step at the
//! points, and Exodus in netCDF-4, with variables of the nodes at every time.

use super::{Found, Place, Step, StepValues, unreadable};
use crate::hdf5::{NodalVariables, read_nodal_variables};
use crate::node_files::{PointArray, point_arrays};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::text::InputFile;

/// Places of the stresses xx, yy, zz, xy, yz, xz in a tensor of nine numbers, row by row.
const IN_TENSOR: [usize; 6] = [0, 4, 8, 1, 5, 2];

/// Reads the arrays `displacement N` (3 numbers) and `stress N` (6 numbers xx, yy, zz, xy, yz, xz, or 9) of the steps 1,
/// 2, .... Points without stresses have NaN. The array of global ids, or `node`, numbers the points.
///
/// # Errors
/// FB327 for another mesh, for a step without one of the two arrays, and for points without numbers.
pub(super) fn read_vtu(file: &InputFile) -> Found<StepValues> {
    let (ids, arrays) = point_arrays(file.bytes()).map_err(|message| unreadable(file, message))?;
    let Some(ids) = ids else {
        let message = "no array `node` of whole numbers numbers the points";
        return Err(unreadable(file, message));
    };
    let of_step = |what: &str, step: usize| arrays.iter().find(|array| step_of(array, what) == Some(step));
    let (mut steps, mut digits) = (Vec::new(), 15);
    for number in 1.. {
        let (moved, stressed) = match (of_step("displacement", number), of_step("stress", number)) {
            (Some(moved), Some(stressed)) => (moved, stressed),
            (None, None) => break,
            (None, _) => return Err(unreadable(file, format!("array `displacement {number}` is missing"))),
            (_, None) => return Err(unreadable(file, format!("array `stress {number}` is missing"))),
        };
        let places: &[usize] = match (moved.components, stressed.components) {
            (3, 6) => &[0, 1, 2, 3, 4, 5],
            (3, 9) => &IN_TENSOR,
            (displacements, stresses) => {
                let message = format!(
                    "arrays of step {number} have {displacements} and {stresses} numbers for each point, expected 3 displacements and 6 or 9 stresses"
                );
                return Err(unreadable(file, message));
            }
        };
        digits = digits.min(moved.digits).min(stressed.digits);
        let displacement = |at: usize, k: usize| moved.values[3 * at + k];
        let stress = |at: usize, k: usize| stressed.values[stressed.components * at + places[k]];
        steps.push(step(&ids, displacement, stress));
    }
    refuse_unfinished(file, &arrays, steps.len())?;
    StepValues::of(steps, digits, file)?.with_stresses(file)
}

/// Returns the number of the step whose values of this kind the array has: `stress 2` or `Stress_2` are those of step 2.
fn step_of(array: &PointArray, what: &str) -> Option<usize> {
    let name = array.name.to_lowercase();
    name.strip_prefix(what)?.trim_start_matches([' ', '_']).parse().ok()
}

/// Refuses arrays of steps behind a missing one.
fn refuse_unfinished(file: &InputFile, arrays: &[PointArray], steps: usize) -> Found<()> {
    let of_steps = arrays.iter().filter(|array| step_of(array, "stress").is_some());
    match of_steps.count() {
        0 => Err(unreadable(file, "file has no arrays `displacement 1` and `stress 1` at its points")),
        count if count != steps => {
            Err(unreadable(file, format!("step {} is missing before other steps", steps + 1)))
        }
        _ => Ok(()),
    }
}

/// Returns the values of a step at the nodes `ids`; nodes whose stresses are not numbers have none.
fn step(
    ids: &[i64],
    displacement: impl Fn(usize, usize) -> f64,
    stress: impl Fn(usize, usize) -> f64,
) -> Step {
    let stresses = ids
        .iter()
        .enumerate()
        .map(|(at, id)| (Place::Node(*id), std::array::from_fn::<f64, 6, _>(|k| stress(at, k))));
    Step {
        stresses: stresses.filter(|(_, values)| values.iter().any(|value| !value.is_nan())).collect(),
        displacements: ids
            .iter()
            .enumerate()
            .map(|(at, id)| (*id, std::array::from_fn(|k| displacement(at, k))))
            .collect(),
        energy: None,
    }
}

/// Names of displacements in Exodus files, in lower case without blanks and underscores.
const DISPLACEMENTS: [&str; 4] = ["disp", "displ", "displacement", "u"];
/// Names of stresses.
const STRESSES: [&str; 4] = ["stress", "sigma", "sig", "s"];
/// Names of the components of each stress.
const COMPONENTS: [[&str; 2]; 6] =
    [["xx", "xx"], ["yy", "yy"], ["zz", "zz"], ["xy", "yx"], ["yz", "zy"], ["xz", "zx"]];

/// Reads the variables `disp_x`, `disp_y`, `disp_z` and `stress_xx` to `stress_xz` (or similar names) of the nodes at
/// every time.
///
/// # Errors
/// FB327 for a file without one of these variables, and the errors of datasets.
pub(super) fn read_exodus(file: &InputFile) -> Found<StepValues> {
    let about = |found: Vec<Diagnostic>| -> Vec<Diagnostic> {
        found.iter().flat_map(|diagnostic| unreadable(file, diagnostic.message())).collect()
    };
    let variables = read_nodal_variables(file).map_err(about)?;
    let NodalVariables { ids, names, values, times, is_single } = &variables;
    let plain = |name: &String| name.to_lowercase().replace(['_', ' ', '-'], "");
    let find = |heads: &[&str], ends: &[&str]| {
        let is_asked = |name: &String| {
            let name = plain(name);
            ends.iter().any(|end| heads.iter().any(|head| name == format!("{head}{end}")))
        };
        names.iter().position(is_asked).ok_or_else(|| {
            let message = format!(
                "no variable of the nodes is `{}_{}`; the file has {}",
                heads[0],
                ends[0],
                names.join(", ")
            );
            unreadable(file, message)
        })
    };
    let moved: Vec<usize> =
        ["x", "y", "z"].iter().map(|end| find(&DISPLACEMENTS, &[end])).collect::<Found<_>>()?;
    let stressed: Vec<usize> = COMPONENTS.iter().map(|ends| find(&STRESSES, ends)).collect::<Found<_>>()?;
    let n = ids.len();
    let value = |variable: usize, time: usize, at: usize| values[variable][time * n + at];
    let of_time =
        |time: usize| step(ids, |at, k| value(moved[k], time, at), |at, k| value(stressed[k], time, at));
    let digits = if *is_single { 7 } else { 15 };
    StepValues::of((0..*times).map(of_time).collect(), digits, file)?.with_stresses(file)
}
