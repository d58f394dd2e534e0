//! Results in files of meshes: VTK in XML (.vtu) and in the legacy form (.vtk), with the arrays `displacement N` and
//! `stress N` of each step at the points, collections of such files (.pvd), and Exodus, with variables of the
//! nodes at every time.

use super::{Found, Place, Step, StepValues, unreadable};
use crate::exodus::{NodalVariables, read_nodal_variables};
use crate::node_files::{
    self, CollectionMember, PointArray, PointData, collection, legacy_point_arrays, point_arrays,
};
use crate::reader::HEAD;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::text::InputFile;
use std::path::{Path, PathBuf};

/// Places of the stresses xx, yy, zz, xy, yz, xz in a tensor of nine numbers, row by row.
const IN_TENSOR: [usize; 6] = [0, 4, 8, 1, 5, 2];

/// Returns true if a file begins like VTK, in XML or in the legacy form.
pub(super) fn is_vtk(head: &[u8]) -> bool {
    node_files::is_vtk_xml(head) || node_files::is_vtk_legacy(head)
}

/// Returns the paths of the files of a collection (.pvd); none if the file is no collection or cannot be read.
pub(super) fn files_of(path: &Path) -> Vec<PathBuf> {
    if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("pvd")) {
        return Vec::new();
    }
    let members = InputFile::open(path).ok().and_then(|file| collection(file.bytes()).ok()).flatten();
    members.unwrap_or_default().iter().map(|member| beside(path, member)).collect()
}

fn beside(collection: &Path, member: &CollectionMember) -> PathBuf {
    collection.parent().unwrap_or(Path::new("")).join(&member.file)
}

/// Reads meshes of VTK: a file with the arrays `displacement N` (3 numbers) and `stress N` (6 numbers xx, yy, zz, xy,
/// yz, xz, or 9) of the steps 1, 2, ..., or a collection of files with `displacement` and `stress`, one for each step.
/// Points without stresses have NaN. The array of global ids, or `node`, numbers the points.
///
/// * `members`: files of the collections, opened.
///
/// # Errors
/// FB327 for another mesh, for a step without one of the two arrays, and for points without numbers.
pub(super) fn read_vtk(file: &InputFile, members: &[&InputFile]) -> Found<StepValues> {
    let listed = match node_files::is_vtk_xml(&file.first_bytes(HEAD)) {
        true => collection(file.bytes()).map_err(|message| unreadable(file, message))?,
        false => None,
    };
    if let Some(listed) = listed {
        return read_collection(file, &listed, members);
    }
    let (ids, arrays) = point_data(file)?;
    let of_step = |what: &str, step: usize| arrays.iter().find(|array| step_of(array, what) == Some(step));
    let (mut steps, mut digits) = (Vec::new(), 15);
    for number in 1.. {
        let (moved, stressed) = match (of_step("displacement", number), of_step("stress", number)) {
            (Some(moved), Some(stressed)) => (moved, stressed),
            (None, None) => break,
            (None, _) => return Err(unreadable(file, format!("array `displacement {number}` is missing"))),
            (_, None) => return Err(unreadable(file, format!("array `stress {number}` is missing"))),
        };
        digits = digits.min(moved.digits).min(stressed.digits);
        let step = step_of_arrays(&ids, moved, stressed);
        steps.push(step.map_err(|message| unreadable(file, format!("arrays of step {number} {message}")))?);
    }
    refuse_unfinished(file, &arrays, steps.len())?;
    StepValues::of(steps, digits, file)?.with_stresses(file)
}

/// Reads the files of a collection, one for each step, in the order of their times.
fn read_collection(
    file: &InputFile,
    listed: &[CollectionMember],
    members: &[&InputFile],
) -> Found<StepValues> {
    let (mut steps, mut digits) = (Vec::new(), 15);
    for member in listed {
        let path = beside(file.path(), member);
        let Some(own) = members.iter().find(|own| own.path() == path) else {
            let message =
                format!("the collection lists {} and its own name does not end with .pvd", member.file);
            return Err(unreadable(file, message));
        };
        own.load().map_err(|diagnostic| vec![diagnostic])?;
        let (ids, arrays) = point_data(own)?;
        let named = |what: &str| {
            let found = arrays.iter().find(|array| array.name.eq_ignore_ascii_case(what));
            found.ok_or_else(|| unreadable(own, format!("no array at the points is `{what}`")))
        };
        let (moved, stressed) = (named("displacement")?, named("stress")?);
        digits = digits.min(moved.digits).min(stressed.digits);
        let step = step_of_arrays(&ids, moved, stressed);
        steps.push(step.map_err(|message| unreadable(own, format!("arrays {message}")))?);
    }
    StepValues::of(steps, digits, file)?.with_stresses(file)
}

/// Returns the numbers of the points of a mesh and the arrays at them.
fn point_data(file: &InputFile) -> Found<(Vec<i64>, Vec<PointArray>)> {
    let PointData { ids, arrays } = if node_files::is_vtk_legacy(&file.first_bytes(HEAD)) {
        legacy_point_arrays(file.bytes()).map_err(|(line, message)| {
            unreadable(file, message).into_iter().map(|found| found.at_line(line)).collect::<Vec<_>>()
        })?
    } else {
        point_arrays(file.bytes()).map_err(|message| unreadable(file, message))?
    };
    match ids {
        Some(ids) => Ok((ids, arrays)),
        None => Err(unreadable(file, "no array `node` of whole numbers numbers the points")),
    }
}

/// Returns the values of a step; the error is a clause about its arrays.
fn step_of_arrays(ids: &[i64], moved: &PointArray, stressed: &PointArray) -> Result<Step, String> {
    let places: &[usize] = match (moved.components, stressed.components) {
        (3, 6) => &[0, 1, 2, 3, 4, 5],
        (3, 9) => &IN_TENSOR,
        (displacements, stresses) => {
            return Err(format!(
                "have {displacements} and {stresses} numbers for each point, expected 3 displacements and 6 or 9 stresses"
            ));
        }
    };
    let displacement = |at: usize, k: usize| moved.values[3 * at + k];
    let stress = |at: usize, k: usize| stressed.values[stressed.components * at + places[k]];
    Ok(step(ids, displacement, stress))
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
