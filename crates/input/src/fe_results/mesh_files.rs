//! Results in files of meshes: VTK in XML (.vtu) and in the legacy form (.vtk), with the arrays `displacement N` and
//! `stress N` of each step at the points, files of pieces (.pvtu), collections of such files (.pvd), and Exodus, with
//! variables of the nodes at every time.

use super::step_values::{Place, Step, StepValues, unreadable};
use crate::exodus::{NodalVariables, read_nodal_variables};
use crate::matrices::HEAD;
use crate::node_files::{
    self, CollectionMember, PointArray, PointData, collection, legacy_point_arrays, pieces, point_arrays,
};
use flexbody_base::diagnostic::{Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Places of the stresses xx, yy, zz, xy, yz, xz in a tensor of nine numbers, row by row.
const IN_TENSOR: [usize; 6] = [0, 4, 8, 1, 5, 2];

/// Returns true if a file begins like VTK, in XML or in the legacy form.
pub(super) fn is_vtk(head: &[u8]) -> bool {
    node_files::is_vtk_xml(head) || node_files::is_vtk_legacy(head)
}

/// Returns the paths of the files of a collection (.pvd), of its pieces, or of the pieces of a parallel file (.pvtu); none if
/// the file is neither or cannot be read.
pub(super) fn files_of(path: &Path) -> Vec<PathBuf> {
    let mut known = HashSet::new();
    listed_files(path).into_iter().filter(|file| known.insert(file.clone())).collect()
}

/// Returns the paths that [`files_of`] returns, some of them twice.
fn listed_files(path: &Path) -> Vec<PathBuf> {
    let ends = |end: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(end));
    let opened = || InputFile::open(path).ok();
    if ends("pvtu") {
        let sources = opened().and_then(|file| pieces(file.bytes()).ok()).flatten();
        return sources.unwrap_or_default().iter().map(|source| beside(path, source)).collect();
    }
    if !ends("pvd") {
        return Vec::new();
    }
    let members = opened().and_then(|file| collection(file.bytes()).ok()).flatten().unwrap_or_default();
    let with_pieces = |member: &CollectionMember| {
        let own = beside(path, &member.file);
        // A collection does not list collections.
        let inner = if own.extension().is_some_and(|end| end.eq_ignore_ascii_case("pvtu")) {
            files_of(&own)
        } else {
            Vec::new()
        };
        std::iter::once(own).chain(inner).collect::<Vec<_>>()
    };
    members.iter().flat_map(with_pieces).collect()
}

fn beside(listing: &Path, member: &str) -> PathBuf {
    listing.parent().unwrap_or(Path::new("")).join(member)
}

/// Reads meshes of VTK: a file with the arrays `displacement N` (3 numbers) and `stress N` (6 numbers xx, yy, zz, xy,
/// yz, xz, or 9) of the steps 1, 2, ..., or a collection of files with `displacement` and `stress`, one for each step.
/// Points without stresses have NaN. The array of global ids, or `node`, numbers the points.
///
/// * `members`: files of the collections, opened.
///
/// # Errors
/// FB327 for another mesh, for a step without one of the two arrays, and for points without numbers.
pub(super) fn read_vtk(file: &InputFile, members: &[&InputFile]) -> Diagnosed<StepValues> {
    let members: &Opened<'_> = &members.iter().map(|member| (member.path(), *member)).collect();
    let listed = if node_files::is_vtk_xml(&file.first_bytes(HEAD)) {
        collection(file.bytes()).map_err(|message| unreadable(file, message))?
    } else {
        None
    };
    if let Some(listed) = listed {
        return read_collection(file, &listed, members);
    }
    let (ids, arrays) = point_data(file, members)?;
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

/// Opened files by their paths.
type Opened<'f> = HashMap<&'f Path, &'f InputFile>;

/// Reads the files of a collection, one for each step, in the order of their times.
fn read_collection(
    file: &InputFile,
    listed: &[CollectionMember],
    members: &Opened<'_>,
) -> Diagnosed<StepValues> {
    let (mut steps, mut digits) = (Vec::new(), 15);
    for member in listed {
        let path = beside(file.path(), &member.file);
        let Some(own) = members.get(path.as_path()) else {
            let message =
                format!("the collection lists {} and its own name does not end with .pvd", member.file);
            return Err(unreadable(file, message));
        };
        own.load().map_err(|diagnostic| vec![diagnostic])?;
        let (ids, arrays) = point_data(own, members)?;
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

/// Returns the numbers of the points of a mesh and the arrays at them; of a parallel file those of all pieces.
fn point_data(file: &InputFile, members: &Opened<'_>) -> Diagnosed<(Vec<i64>, Vec<PointArray>)> {
    let sources = if node_files::is_vtk_xml(&file.first_bytes(HEAD)) {
        pieces(file.bytes()).map_err(|message| unreadable(file, message))?
    } else {
        None
    };
    match sources {
        Some(sources) => data_of_pieces(file, &sources, members),
        None => data_of_file(file).map(|(ids, arrays, _)| (ids, arrays)),
    }
}

/// Largest difference of values that pieces state for one point, relative to the largest value of the array: rounding of
/// text. A larger value would hide that a program computed nodal values piece by piece.
const MAX_PIECE_DIFFERENCE: f64 = 1e-5;

/// Returns the points of all pieces, each once: points that the pieces mark as ghosts are left to their owners, and a point of
/// several pieces must have the same values in them.
fn data_of_pieces(
    file: &InputFile,
    sources: &[String],
    members: &Opened<'_>,
) -> Diagnosed<(Vec<i64>, Vec<PointArray>)> {
    let mut whole: Option<(Vec<i64>, Vec<PointArray>)> = None;
    let mut place: HashMap<i64, usize> = HashMap::new();
    let mut left: HashSet<i64> = HashSet::new();
    for source in sources {
        let path = beside(file.path(), source);
        let Some(own) = members.get(path.as_path()) else {
            let message =
                format!("the file lists the piece {source} and its own name does not end with .pvtu");
            return Err(unreadable(file, message));
        };
        own.load().map_err(|diagnostic| vec![diagnostic])?;
        let (ids, arrays, ghosts) = data_of_file(own)?;
        let (all, joined) = whole.get_or_insert_with(|| {
            let empty = |array: &PointArray| PointArray { values: Vec::new(), ..array.clone() };
            (Vec::new(), arrays.iter().map(empty).collect())
        });
        let kinds = |arrays: &[PointArray]| -> Vec<String> {
            arrays.iter().map(|array| format!("`{}` of {}", array.name, array.components)).collect()
        };
        if kinds(&arrays) != kinds(joined) {
            let message = format!(
                "piece has the arrays {}, the first piece has {}",
                kinds(&arrays).join(", "),
                kinds(joined).join(", ")
            );
            return Err(unreadable(own, message));
        }
        for (at, id) in ids.iter().enumerate() {
            if ghosts.get(at).copied().unwrap_or(false) {
                left.insert(*id);
                continue;
            }
            match place.get(id) {
                Some(&first) => refuse_difference(own, *id, joined, first, &arrays, at)?,
                None => {
                    place.insert(*id, all.len());
                    all.push(*id);
                    for (whole, array) in joined.iter_mut().zip(&arrays) {
                        let n = array.components;
                        whole.values.extend_from_slice(&array.values[n * at..n * (at + 1)]);
                        whole.digits = whole.digits.min(array.digits);
                    }
                }
            }
        }
    }
    if let Some(id) = left.iter().filter(|id| !place.contains_key(id)).min() {
        let message =
            format!("node {id} is a ghost in every piece that has it: the piece that owns it is missing");
        return Err(unreadable(file, message));
    }
    Ok(whole.unwrap_or_default())
}

/// Refuses other values of a node than those of an earlier piece.
fn refuse_difference(
    file: &InputFile,
    id: i64,
    joined: &[PointArray],
    first: usize,
    arrays: &[PointArray],
    at: usize,
) -> Diagnosed<()> {
    for (whole, array) in joined.iter().zip(arrays) {
        let n = array.components;
        let size = array.values.iter().filter(|value| value.is_finite()).fold(0.0f64, |m, v| m.max(v.abs()));
        for k in 0..n {
            let (stated, here) = (whole.values[n * first + k], array.values[n * at + k]);
            let differ =
                (stated - here).abs() > MAX_PIECE_DIFFERENCE * size || stated.is_nan() != here.is_nan();
            if differ {
                let message = format!(
                    "node {id} has {here} in array `{}`, and {stated} in an earlier piece: values at shared nodes must be those of the whole mesh",
                    array.name
                );
                return Err(unreadable(file, message));
            }
        }
    }
    Ok(())
}

/// Points, their arrays and their marks as ghosts.
type FileData = (Vec<i64>, Vec<PointArray>, Vec<bool>);

/// Returns the numbers of the points of one file, the arrays at them and the marks of ghosts.
fn data_of_file(file: &InputFile) -> Diagnosed<FileData> {
    let PointData { ids, arrays, ghosts } = if node_files::is_vtk_legacy(&file.first_bytes(HEAD)) {
        legacy_point_arrays(file.bytes()).map_err(|(line, message)| {
            unreadable(file, message).into_iter().map(|found| found.at_line(line)).collect::<Vec<_>>()
        })?
    } else {
        point_arrays(file.bytes()).map_err(|message| unreadable(file, message))?
    };
    match ids {
        Some(ids) => Ok((ids, arrays, ghosts)),
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
fn refuse_unfinished(file: &InputFile, arrays: &[PointArray], steps: usize) -> Diagnosed<()> {
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
pub(super) fn read_exodus(file: &InputFile) -> Diagnosed<StepValues> {
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
        ["x", "y", "z"].iter().map(|end| find(&DISPLACEMENTS, &[end])).collect::<Diagnosed<_>>()?;
    let stressed: Vec<usize> =
        COMPONENTS.iter().map(|ends| find(&STRESSES, ends)).collect::<Diagnosed<_>>()?;
    let n = ids.len();
    let value = |variable: usize, time: usize, at: usize| values[variable][time * n + at];
    let of_time =
        |time: usize| step(ids, |at, k| value(moved[k], time, at), |at, k| value(stressed[k], time, at));
    let digits = if *is_single { 7 } else { 15 };
    StepValues::of((0..*times).map(of_time).collect(), digits, file)?.with_stresses(file)
}
