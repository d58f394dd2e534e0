//! Pictures of a simulation: both formats show the recorded motion.

use super::readers::{Glb, Vtu};
use crate::program::flexbody;
use flexbody_body::flex_body::FlexBody;
use flexbody_file::{self, RecordedMotion, read_simulation};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use oracle::fixtures;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Runs `flexbody`, asserts that it succeeds, and returns its messages.
fn done(folder: &Path, line: &str) -> String {
    let run = flexbody(folder, &line.split_whitespace().collect::<Vec<_>>());
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(run.status.success(), "{line}: {}{}", text(&run.stdout), text(&run.stderr));
    text(&run.stdout) + &text(&run.stderr)
}

/// Creates a folder with the body of a block with a surface and an interface, as `body.flex.h5`.
pub fn block() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let job = fixtures().join("small/abaqus_labels/job.inp");
    let job = job.to_str().expect("a path in UTF-8");
    done(
        folder.path(),
        &format!("convert {job} --units m,kg,s --modes 4 --interface left=Left,rigid -o body.flex.h5"),
    );
    folder
}

const TUMBLE: &str = "[initial]\nangular_velocity = [20, 0, 50]\nvelocity = [3, 0, 1]\nmode = [{ number = 1, amplitude = 1e-3 }, { number = 3, amplitude = 2e-3 }]\n[run]\nduration = 0.2\noutputs = 20\n";

struct Played {
    folder: TempDir,
    body: FlexBody,
    motion: RecordedMotion,
}

fn played(scene: &str) -> Played {
    let folder = block();
    fs::write(folder.path().join("scene.toml"), scene).expect("written");
    done(folder.path(), "simulate body.flex.h5 --scene scene.toml -o motion.h5");
    let motion = read_simulation(folder.path().join("motion.h5")).expect("a motion");
    let body = flexbody_file::read(folder.path().join("body.flex.h5")).expect("a body");
    let body = motion.body_in_frame(&body).expect("its motion");
    Played { folder, body, motion }
}

impl Played {
    /// Returns the position of a node at an output time, and its deflection, in world axes.
    fn place(&self, instant: usize, number: i64) -> ([f64; 3], [f64; 3]) {
        let Self { body, motion, .. } = self;
        let [w, i, j, k] = [0, 1, 2, 3].map(|part| motion.attitudes[4 * instant + part]);
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        let node = body.nodes().ids.iter().position(|id| *id == number).expect("a node");
        let q = &motion.q[instant * motion.modes..][..motion.modes];
        let u = |k: usize| q.iter().enumerate().map(|(j, q)| q * body.modes().shape[(3 * node + k, j)]).sum();
        let u: Vector3<f64> = body.frame().axes * Vector3::from([0, 1, 2].map(u));
        let x = Vector3::from(body.frame().to_model(body.nodes().positions[node]));
        let origin = Vector3::from_column_slice(&motion.origins[3 * instant..][..3]);
        let place = origin + turn * (x - Vector3::from(motion.origin_in_model) + u);
        (place.into(), (turn * u).into())
    }
}

fn apart(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
}

/// Asserts that the meshes of all output times agree with the motion.
fn check_vtk(played: &Played, instants: usize) {
    let place = played.folder.path();
    let said = done(place, "export body.flex.h5 --to vtk --simulation motion.h5 -o played.pvd");
    assert!(said.contains(&format!("{instants} files")), "{said}");
    let list = fs::read_to_string(place.join("played.pvd")).expect("a list");
    let lines: Vec<&str> = list.lines().filter(|line| line.starts_with("<DataSet")).collect();
    assert_eq!(lines.len(), instants);
    let size = played.body.extent();
    for (instant, line) in lines.iter().enumerate() {
        let words: Vec<&str> = line.split('"').collect();
        assert_eq!(words[1].parse(), Ok(played.motion.time[instant]));
        let vtu = Vtu::read(&fs::read(place.join(words[5])).expect("a mesh"));
        let deflections = vtu.array("PointData", "deflection").vectors();
        let marks = &vtu.array("PointData", "reference point").bytes;
        for (point, number) in vtu.numbers().iter().enumerate().filter(|(point, _)| marks[*point] == 0) {
            let (x, u) = played.place(instant, *number);
            assert!(apart(&vtu.positions()[point], &x) < 1e-12 * size, "node {number}");
            assert!(apart(&deflections[point], &u) < 1e-12 * size, "node {number}");
        }
    }
}

/// Asserts that vertices moved like in a viewer agree with the motion, in metres.
fn check_gltf(played: &Played, instants: usize) {
    let place = played.folder.path();
    done(place, "export body.flex.h5 --to gltf --simulation motion.h5 -o played.glb");
    let glb = Glb::read(&fs::read(place.join("played.glb")).expect("a file"));
    let (positions, targets) = glb.vertices();
    let (times, places) = glb.channel(0, "translation");
    let (attitudes, weights) = (glb.channel(0, "rotation").1, glb.channel(0, "weights").1);
    assert_eq!((times.len(), times[times.len() - 1]), (instants, 8.0));
    let metres = played.body.units().length.to_si();
    let size = played.body.extent() * metres;
    for instant in 0..instants {
        let [i, j, k, w] = [0, 1, 2, 3].map(|part| attitudes[4 * instant + part]);
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        let origin = Vector3::from_column_slice(&places[3 * instant..][..3]);
        let weights = &weights[instant * targets.len()..][..targets.len()];
        let moved: Vec<Vector3<f64>> = (0..positions.len())
            .map(|at| {
                let u: Vector3<f64> =
                    targets.iter().zip(weights).map(|(target, w)| Vector3::from(target[at]) * *w).sum();
                origin + turn * (Vector3::from(positions[at]) + u)
            })
            .collect();
        for number in &played.body.nodes().ids {
            let x = Vector3::from(played.place(instant, *number).0) * metres;
            let nearest = moved.iter().map(|own| (own - x).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 3e-6 * size.max(x.norm()), "node {number} at instant {instant}: {nearest:e}");
        }
    }
}

#[test]
fn both_formats_show_a_free_motion() {
    let played = played(TUMBLE);
    check_vtk(&played, 21);
    check_gltf(&played, 21);
}

#[test]
fn both_formats_show_a_carried_body() {
    let scene = "[carried]\ninterface = \"left\"\n[carried.spin]\naxis = [0, 0, 1]\nrate = 30\n";
    let scene = format!("{scene}[run]\nduration = 0.2\noutputs = 10\n");
    let played = played(&scene);
    check_vtk(&played, 11);
    check_gltf(&played, 11);
}

/// A run with too many output times for separate files is thinned, with a note.
#[test]
fn long_motions_are_thinned() {
    let played = played(&TUMBLE.replace("outputs = 20", "outputs = 1000"));
    let said =
        done(played.folder.path(), "export body.flex.h5 --to vtk --simulation motion.h5 -o played.pvd");
    assert!(said.contains("note[FB723]: 250 of 1001 instants are written"), "{said}");
    assert!(!said.contains("FB722"), "{said}");
    let names = fs::read_dir(played.folder.path()).expect("a folder");
    assert_eq!(
        names
            .filter(|entry| entry.as_ref().expect("an entry").path().extension().is_some_and(|e| e == "vtu"))
            .count(),
        250
    );
}
