//! Options of pictures, their messages, and refusals.

use super::motion::block;
use super::readers::{Glb, Vtu};
use crate::program::flexbody;
use flexbody_base::diagnostic::Code;
use flexbody_formats::export::ExportOptions;
use flexbody_formats::{FORMATS, export, find_format};
use oracle::exported::bodies;
use std::fs;
use std::path::Path;

fn refused(folder: &Path, line: &str, part: &str) {
    let run = flexbody(folder, &line.split_whitespace().collect::<Vec<_>>());
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(2), "{line}: {said}");
    assert!(said.contains(part), "{line}: {said}");
}

#[test]
fn modes_are_chosen_by_their_number() {
    let body = &bodies()[0].1;
    for (format, usual) in [("vtk", body.n_modes()), ("gltf", body.n_modes().min(8))] {
        for modes in [None, Some(1), Some(3)] {
            let options = ExportOptions { modes, ..ExportOptions::default() };
            let (exported, told) =
                export(body, find_format(format).expect("a format"), &options, false).expect("written");
            let count = match format {
                "vtk" => {
                    Vtu::read(&exported.file).arrays.iter().filter(|a| a.name.starts_with("mode_")).count()
                }
                _ => Glb::read(&exported.file).vertices().1.len(),
            };
            assert_eq!(count, modes.unwrap_or(usual), "{format}");
            assert!(told.iter().all(|note| note.code() == Code::ExportPicture), "{format}");
            let fewer = modes.is_some_and(|modes| modes < body.n_modes());
            let said =
                told.iter().any(|note| note.message().contains(&format!("of {} modes", body.n_modes())));
            assert_eq!(said, fewer, "{format}: {told:?}");
        }
    }
}

/// Pictures hold neither damping nor geometric stiffness; none of this counts as a loss.
#[test]
fn pictures_of_every_body_need_no_permission() {
    for (name, body) in bodies() {
        for format in FORMATS.iter().copied().filter(|format| format.is_picture()) {
            let write = || export(body, format, &ExportOptions::default(), false).expect(name).0;
            assert!(write() == write(), "{name}: equal bodies give equal bytes");
        }
    }
}

#[test]
fn what_makes_no_sense_is_refused_and_leaves_nothing() {
    let folder = block();
    let place = folder.path();
    refused(
        place,
        "export body.flex.h5 --to json --modes 2 -o x",
        "json always writes all modes of the body",
    );
    refused(place, "export body.flex.h5 --to vtk --modes 5 -o x.vtu", "the body has 4 modes, not 5");
    refused(place, "export body.flex.h5 --to gltf --points nodes -o x.glb", "--points");
    refused(place, "export body.flex.h5 --to vtk --simulation body.flex.h5 -o x.pvd", "FB734");
    refused(
        place,
        "export body.flex.h5 --to gltf --simulation x.h5 --to-units m,kg,s -o x.glb",
        "--to-units",
    );
    let other = block();
    let scene = "[initial]\nangular_velocity = [0, 0, 50]\n[run]\nduration = 0.01\noutputs = 2\n";
    fs::write(other.path().join("spin.toml"), scene).expect("written");
    let simulate = ["simulate", "body.flex.h5", "--scene", "spin.toml", "-o", "spin.h5"];
    assert!(flexbody(other.path(), &simulate).status.success());
    fs::copy(other.path().join("spin.h5"), place.join("spin.h5")).expect("copied");
    let job = oracle::fixtures().join("small/abaqus_labels/job.inp");
    let job = job.to_str().expect("a path in UTF-8");
    let convert = ["convert", job, "--units", "m,kg,s", "--modes", "3", "-o", "fewer.flex.h5", "--quiet"];
    assert!(flexbody(place, &convert).status.success());
    refused(place, "export fewer.flex.h5 --to gltf --simulation spin.h5 -o x.glb", "FB735");
    // A mesh of the motion would replace an input.
    fs::copy(place.join("body.flex.h5"), place.join("x_0001.vtu")).expect("copied");
    refused(place, "export x_0001.vtu --to vtk --simulation spin.h5 -o x.pvd", "FB801");
    // Viewers do not recognise this extension.
    let run = flexbody(place, &["export", "body.flex.h5", "--to", "gltf", "-o", "x.gltf"]);
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(
        run.status.success() && said.contains("note[FB722]: viewers recognise") && said.contains("x.glb"),
        "{said}"
    );
    fs::remove_file(place.join("x.gltf")).expect("written");
    let mut names: Vec<_> =
        fs::read_dir(place).expect("a folder").map(|entry| entry.expect("an entry").file_name()).collect();
    names.sort();
    assert_eq!(names, ["body.flex.h5", "fewer.flex.h5", "spin.h5", "x_0001.vtu"]);
}
