//! Damaged files, and files that are no flexible bodies, are refused with all of their defects.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_body::flex_body::{FlexBody, SurfaceMesh};
use hdf5::file::Sizeof;
use hdf5_metno as hdf5;
use oracle::file_bodies::{Random, body, fingerprint, seal};
use std::path::{Path, PathBuf};

struct Case {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

/// Returns a valid file: 4 nodes, 3 modes, one lumping scheme, one interface.
fn valid() -> Case {
    stored(&body(5, 4, 3, 1, 1))
}

fn stored(body: &FlexBody) -> Case {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.flex.h5");
    flexbody_file::write(body, &path).unwrap();
    Case { _folder: folder, path }
}

fn refusal(path: &Path) -> Error {
    let error = flexbody_file::read(path).expect_err("the file is broken");
    assert_eq!(flexbody_file::validate(path), error.diagnostics(), "validate and read say the same");
    assert!(error.diagnostics().iter().all(|d| d.file() == Some(path)), "{error}");
    error
}

/// Damages a valid file and returns the error.
fn damaged(damage: impl FnOnce(&hdf5::File)) -> Error {
    refused(valid(), damage)
}

fn refused(case: Case, damage: impl FnOnce(&hdf5::File)) -> Error {
    let file = hdf5::File::open_rw(&case.path).unwrap();
    damage(&file);
    file.close().unwrap();
    refusal(&case.path)
}

#[track_caller]
fn assert_says(error: &Error, code: Code, texts: &[&str]) {
    for text in texts {
        assert!(
            error.diagnostics().iter().any(|d| d.code() == code && d.message().contains(text)),
            "no {code:?} with {text:?} in\n{error}"
        );
    }
    assert_eq!(error.diagnostics().len(), texts.len(), "{error}");
}

fn replace<T: hdf5::H5Type>(file: &hdf5::File, path: &str, shape: &[usize], values: &[T]) {
    let old = file.dataset(path).unwrap();
    let texts: Vec<(String, hdf5::types::VarLenUnicode)> = ["units", "symbol", "description"]
        .map(|name| (name.to_owned(), old.attr(name).unwrap().read_scalar().unwrap()))
        .to_vec();
    file.unlink(path).unwrap();
    let new = file.new_dataset::<T>().shape(shape.to_vec()).create(path).unwrap();
    new.write_raw(values).unwrap();
    for (name, text) in texts {
        new.new_attr::<hdf5::types::VarLenUnicode>()
            .create(name.as_str())
            .unwrap()
            .write_scalar(&text)
            .unwrap();
    }
}

fn set_int(file: &hdf5::File, group: &str, name: &str, value: i64) {
    file.group(group).unwrap().attr(name).unwrap().write_scalar(&value).unwrap();
}

fn set_text(place: &hdf5::Location, name: &str, value: &str) {
    let text: hdf5::types::VarLenUnicode = value.parse().unwrap();
    let _ = place.delete_attr(name);
    place.new_attr::<hdf5::types::VarLenUnicode>().create(name).unwrap().write_scalar(&text).unwrap();
}

#[test]
fn what_is_not_a_readable_file() {
    let folder = tempfile::tempdir().unwrap();
    let missing = refusal(&folder.path().join("missing.h5"));
    assert_says(&missing, Code::FileUnreadable, &["cannot read the flexible body"]);
    assert_says(&refusal(folder.path()), Code::FileUnreadable, &["not a regular file"]);
}

#[test]
fn what_is_not_a_flex_body_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.h5");
    for bytes in [&b""[..], b"node,x,y,z\n1,0,0,0\n", b"\x89HDF\r\n\x1a\n", &[0; 4096]] {
        std::fs::write(&path, bytes).unwrap();
        assert_says(&refusal(&path), Code::BodyUnreadable, &["cannot read the flexible body"]);
    }
    hdf5::File::create(&path).unwrap().close().unwrap();
    assert_says(&refusal(&path), Code::BodyUnreadable, &["HDF5 file without the attribute `format`"]);
    let small = hdf5::file::SizeofInfo { sizeof_addr: Sizeof::Bytes8, sizeof_size: Sizeof::Bytes4 };
    hdf5::File::with_options().with_fcpl(|p| p.sizes(small)).create(&path).unwrap().close().unwrap();
    assert_says(&refusal(&path), Code::BodyUnreadable, &["another width than 8 bytes"]);
    let other = damaged(|f| set_text(f, "format", "SDynPy"));
    assert_says(&other, Code::BodyUnreadable, &["attribute `format` is \"SDynPy\", expected `flexbody`"]);
}

#[test]
fn guarantees_that_contradict_the_modes_or_themselves_are_refused() {
    let certified = |damage: &dyn Fn(&hdf5::File)| refused(stored(&body(5, 5, 3, 1, 1)), damage);
    let error = certified(&|f| replace(f, "modes/eigenvalue_upper", &[3], &[1e-9, 1e-9, 1e-9]));
    assert_says(&error, Code::BodySchema, &["of mode 0 has the bounds", "of mode 1 has", "of mode 2 has"]);
    let error = certified(&|f| replace(f, "modes/shape_error", &[3], &[0.5, -0.5, 2.0]));
    assert_says(&error, Code::BodySchema, &["`guarantee.shape_error` is -5e-1 at mode 1, expected 0 to 1"]);
    let error = certified(&|f| {
        f.group("certificate").unwrap().attr("digits_W2").unwrap().write_scalar(&17.5).unwrap();
    });
    assert_says(&error, Code::BodySchema, &["guaranteed digits of `W2` are 1.75e1, expected 0 to 16"]);
    let error = certified(&|f| set_int(f, "certificate", "negative_pivots_below", 7));
    assert_says(
        &error,
        Code::BodySchema,
        &["counts 7 eigenvalues below the modes, expected the 6 rigid modes"],
    );
    let error = certified(&|f| f.unlink("modes/eigenvalue_lower").unwrap());
    assert_says(
        &error,
        Code::BodySchema,
        &["/modes/eigenvalue_lower: expected with the other entries of accuracy `certified`, found nothing"],
    );
}

#[test]
fn estimates_of_the_free_body_are_complete_and_belong_to_a_craig_bampton_body() {
    let reduced = |damage: &dyn Fn(&hdf5::File)| refused(stored(&body(5, 5, 3, 1, 1)), damage);
    let error = reduced(&|f| f.unlink("modes/free_eigenvalue_lower").unwrap());
    assert_says(&error, Code::BodySchema, &["`fixed_interface.free.lower` has 0 values, expected 3"]);
    let error = reduced(&|f| {
        let names = [
            "fixed_interface_modes",
            "interface_motions",
            "fixed_interface_shift",
            "fixed_interface_residual",
        ];
        names.iter().for_each(|name| f.group("certificate").unwrap().delete_attr(name).unwrap());
    });
    let expected =
        "/certificate@fixed_interface_modes: expected with the other entries of a Craig-Bampton body";
    assert!(error.to_string().contains(expected), "{error}");
    let error = reduced(&|f| {
        replace(f, "certificate/fixed_interface_eigenvalue", &[2], &[0.5, 1.0]);
    });
    assert_says(&error, Code::BodySchema, &["`fixed_interface.eigenvalues` has 2 values, expected 3"]);
}

#[test]
fn a_newer_format_is_refused_by_naming_the_program_that_wrote_it() {
    let error = damaged(|f| {
        set_int(f, "/", "format_major", 2);
        set_text(f, "generator", "flexbody 3.1.4");
        f.unlink("modes").unwrap(); // whatever else it holds
    });
    assert_says(
        &error,
        Code::BodyVersion,
        &["format version 2, written by flexbody 3.1.4; this version reads up to 1"],
    );
    assert_eq!(error.diagnostics()[0].help(), "read it with flexbody 3.1.4 or newer");
}

#[test]
fn a_newer_minor_with_unknown_entries_is_read() {
    let case = valid();
    let before = flexbody_file::read(&case.path).unwrap();
    let file = hdf5::File::open_rw(&case.path).unwrap();
    set_int(&file, "/", "format_minor", 9);
    file.create_group("stress").unwrap();
    file.new_dataset::<f64>().shape([2]).create("modes/stress_norm").unwrap().write_raw(&[1.0, 2.0]).unwrap();
    set_text(&file.group("source").unwrap(), "comment", "checked by hand");
    seal(&file);
    file.close().unwrap();
    assert_eq!(flexbody_file::read(&case.path).unwrap(), before);
}

/// Returns a file with 4 nodes, with or without a surface of two triangles and an edge.
fn drawn(mesh: bool) -> Case {
    let mut parts = body(5, 4, 3, 1, 1).into_parts();
    let surface = || SurfaceMesh::new(vec![[0, 1, 2], [1, 3, 2]], vec![[0, 3]], 4).unwrap();
    parts.mesh = mesh.then(surface);
    parts.inertia_stiffness = None;
    stored(&FlexBody::new(parts).unwrap())
}

/// A file states the lowest version that supports its contents.
#[test]
fn files_without_a_surface_are_those_of_the_version_before() {
    for (mesh, minor) in [(false, 4), (true, 5)] {
        let file = hdf5::File::open(drawn(mesh).path).unwrap();
        assert_eq!(file.attr("format_minor").unwrap().read_scalar::<i64>().unwrap(), minor);
        assert_eq!(file.link_exists("mesh"), mesh);
    }
}

#[test]
fn surfaces_on_nodes_that_there_are_not_are_refused() {
    let triangles =
        |values: [i32; 6]| refused(drawn(true), move |f| replace(f, "mesh/triangles", &[2, 3], &values));
    let index = "/mesh: a mesh with node index 4, expected indices below 4";
    assert_says(&triangles([0, 1, 2, 1, 3, 4]), Code::BodySchema, &[index]);
    let twice = "/mesh: a mesh whose triangle 1 has a node twice";
    assert_says(&triangles([0, 1, 2, 3, 1, 3]), Code::BodySchema, &[twice]);
    let negative =
        ["/mesh/triangles: expected indices of nodes, found -1", "/mesh: a mesh with node index 4294967295"];
    assert_says(&triangles([0, 1, 2, 1, -1, 2]), Code::BodySchema, &negative);
    let error = refused(drawn(true), |f| replace(f, "mesh/edges", &[1, 2], &[2i32, 2]));
    assert_says(&error, Code::BodySchema, &["/mesh: a mesh whose edge 0 has a node twice"]);
    let error = refused(drawn(true), |f| replace(f, "mesh/edges", &[1, 2], &[0i64, 1]));
    assert_says(&error, Code::BodySchema, &["/mesh/edges: expected 32-bit integers, found type int64"]);
    let error = refused(drawn(true), |f| replace(f, "mesh/triangles", &[3, 2], &[0i32, 1, 2, 1, 3, 2]));
    assert_says(&error, Code::BodySchema, &["/mesh/triangles: expected shape [nt, 3], found [3, 2]"]);
}

#[test]
fn all_missing_entries_are_listed() {
    let error = damaged(|f| {
        f.unlink("invariants/S").unwrap();
        f.unlink("modes/residual").unwrap();
        f.unlink("terms").unwrap();
        f.unlink("lumped").unwrap();
        f.group("source").unwrap().delete_attr("model").unwrap();
        f.dataset("frame/origin").unwrap().delete_attr("symbol").unwrap();
        f.group("certificate").unwrap().delete_attr("proved_modes").ok(); // optional
    });
    assert_says(
        &error,
        Code::BodySchema,
        &[
            "/invariants/S: expected a dataset of 64-bit floats, found nothing",
            "/modes/residual: expected a dataset of 64-bit floats, found nothing",
            "/terms: expected a group, found nothing",
            "/lumped: expected a group, found nothing",
            "/source@model: expected a text attribute, found nothing",
            "/frame/origin@symbol: expected a text attribute, found nothing",
            "in /lumped too",
        ],
    );
}

#[test]
fn wrong_shapes_and_types_are_listed_with_what_was_expected() {
    let error = damaged(|f| {
        replace(f, "modes/residual", &[2], &[0.0; 2]);
        replace(f, "invariants/C1", &[3, 3, 1], &[0.0; 9]);
        replace(f, "invariants/W1", &[9, 3], &[0.0; 27]);
        replace(f, "nodes/position", &[12], &[0.0; 12]);
        replace(f, "invariants/mass", &[1], &[1.0f32]);
        replace(f, "frame/axes", &[3, 3], &[1i64; 9]);
        let link = f.group("interfaces").unwrap().member_names().unwrap().remove(0);
        replace(f, &format!("interfaces/{link}/node_id"), &[1], &[3.0]);
        f.unlink("source").unwrap();
        f.new_dataset::<f64>().shape([1]).create("source").unwrap();
    });
    assert_says(
        &error,
        Code::BodySchema,
        &[
            "/modes/residual: expected shape [nf = 3], found [2]",
            "/invariants/C1: expected shape [3, nf = 3], found [3, 3, 1]",
            "/invariants/W1: expected shape [3, 3 nf = 9], found [9, 3]",
            "/nodes/position: expected shape [n = 4, 3], found [12]",
            "/invariants/mass: expected 64-bit floats, found type float32",
            "/frame/axes: expected 64-bit floats, found type int64",
            "/node_id: expected 64-bit integers, found type float64",
            "/source: expected a group, found another object",
        ],
    );
}

#[test]
fn values_that_are_not_finite_are_named_with_their_place() {
    let error = damaged(|f| {
        let mut s = f.dataset("invariants/S").unwrap().read_raw::<f64>().unwrap();
        s[9 * 5 + 3 * 2 + 1] = f64::NAN;
        f.dataset("invariants/S").unwrap().write_raw(&s).unwrap();
        f.dataset("modes/damping_ratio").unwrap().write_raw(&[0.0, 0.0, f64::INFINITY]).unwrap();
        f.group("certificate").unwrap().attr("shift").unwrap().write_scalar(&f64::NAN).unwrap();
    });
    assert_says(
        &error,
        Code::BodySchema,
        &[
            "/invariants/S: expected finite numbers, found NaN at [1, 2, 2, 1]",
            "/modes/damping_ratio: expected finite numbers, found inf at [2]",
            "/certificate@shift: expected a finite number, found NaN",
        ],
    );
}

#[test]
fn a_body_in_space_is_no_plane_body() {
    let error = damaged(|f| set_int(f, "/", "dimension", 2));
    assert_says(
        &error,
        Code::BodySchema,
        &[
            "`frame.axes` of a plane body have the third axis",
            "`nodes.positions` of a plane body has z = ",
            "`modes.shape` of a plane body has components along z",
            "`inertia_stiffness` has other loads than acceleration_x, acceleration_y, angular_acceleration_z, spin_zz",
        ],
    );
    let error = damaged(|f| set_int(f, "/", "dimension", 4));
    assert_says(&error, Code::BodySchema, &["`dimension` is 4, expected 2 or 3"]);
}

#[test]
fn constants_units_and_texts_are_checked() {
    let error = damaged(|f| {
        set_text(&f.group("terms").unwrap(), "W2", "perhaps");
        set_text(&f.dataset("invariants/I0").unwrap(), "units", "bananas");
        f.dataset("modes/shape").unwrap().delete_attr("description").unwrap();
    });
    assert_says(
        &error,
        Code::BodySchema,
        &[
            "/terms@W2: expected `kept` or `dropped`, found \"perhaps\"",
            "/invariants/I0@units: expected `",
            "/modes/shape@description: expected a text attribute, found nothing",
        ],
    );
    let error = damaged(|f| set_text(f, "units_mass", "stone"));
    assert_says(
        &error,
        Code::BodySchema,
        &["/@units_mass: expected a known unit or a number, found `stone`"],
    );
}

#[test]
fn texts_and_counts_that_mean_nothing_are_listed() {
    let error = damaged(|f| {
        let source = f.group("source").unwrap();
        set_text(&source, "files", "{\"role\": 1}");
        set_text(&source, "settings", "{");
        set_text(&source, "mass_structure", "fluffy");
        set_int(f, "/source", "n_dofs", -1);
        set_int(f, "/certificate", "rigid_modes", -6);
        let link = f.group("interfaces").unwrap().member_names().unwrap().remove(0);
        let ids = f.dataset(&format!("interfaces/{link}/node_id")).unwrap();
        ids.write_raw(&vec![123_456i64; ids.size()]).unwrap();
    });
    assert_says(
        &error,
        Code::BodySchema,
        &[
            "/source@files: expected a JSON array of files",
            "/source@settings: expected JSON",
            "/source@mass_structure: expected one of `rotation-invariant`, `diagonal`, `general`, found \"fluffy\"",
            "/source@n_dofs: expected a count, found -1",
            "/certificate@rigid_modes: expected a count, found -6",
            "/node_id: expected nodes of /nodes/id, found 123456",
        ],
    );
}

#[test]
fn what_the_body_itself_refuses_is_refused() {
    let error = damaged(|f| {
        f.dataset("nodes/id").unwrap().write_raw(&[1i64, 2, 2, 3]).unwrap();
        f.dataset("frame/axes").unwrap().write_raw(&[-1.0, 0., 0., 0., 1., 0., 0., 0., 1.]).unwrap();
        f.dataset("modes/eigenvalue").unwrap().write_raw(&[3.0, 2.0, 1.0]).unwrap();
        f.unlink("interfaces").unwrap();
        f.create_group("interfaces").unwrap();
    });
    assert_says(
        &error,
        Code::BodySchema,
        &[
            "`nodes.ids` has node 2 twice",
            "`frame.axes` are left-handed",
            "`modes.eigenvalue` falls from 3e0 to 2e0 at mode 1",
        ],
    );
}

#[test]
fn derived_entries_must_follow_from_the_primary_ones() {
    let change = |f: &hdf5::File, path: &str, at: usize, factor: f64| {
        let mut values = f.dataset(path).unwrap().read_raw::<f64>().unwrap();
        values[at] = (values[at] + 1.0) * factor;
        f.dataset(path).unwrap().write_raw(&values).unwrap();
    };
    for path in ["I0", "W1", "W2", "W3", "C2", "modal_mass"] {
        let error = damaged(|f| change(f, &format!("invariants/{path}"), 1, 2.0));
        assert_says(&error, Code::BodyIdentity, &[&format!("/invariants/{path}: found ")]);
    }
    let error = damaged(|f| {
        change(f, "modes/frequency_hz", 2, 1.0);
        let scheme = f.group("lumped").unwrap().member_names().unwrap().remove(0);
        change(f, &format!("lumped/{scheme}/W3"), 0, 2.0);
        let link = f.group("interfaces").unwrap().member_names().unwrap().remove(0);
        change(f, &format!("interfaces/{link}/shape"), 1, 2.0);
    });
    assert_says(&error, Code::BodyIdentity, &["/modes/frequency_hz: found", "/W3: found", "/shape: found"]);
    let error = damaged(|f| {
        set_int(f, "/source", "n_nodes", 5);
    });
    assert_says(&error, Code::BodySchema, &["/source@n_nodes: expected 4, found 5"]);
}

#[test]
fn entries_of_interfaces_are_checked() {
    // Covers the sizes of reference points and interface coordinates.
    let odd = || stored(&body(5, 3, 3, 0, 1));
    let link = |f: &hdf5::File| f.group("interfaces").unwrap().member_names().unwrap().remove(0);
    let error = refused(odd(), |f| {
        let interface = f.group(&format!("interfaces/{}", link(f))).unwrap();
        if interface.attr_names().unwrap().iter().any(|name| name == "coupling") {
            interface.delete_attr("coupling").unwrap();
        }
        set_text(&interface, "coupling", "glued");
        f.unlink("interface_coordinates/mass").unwrap();
    });
    assert_says(
        &error,
        Code::BodySchema,
        &[
            "@coupling: expected one of `rigid`, `averaging`, `free`, found \"glued\"",
            "/interface_coordinates: expected `names`, `stiffness`, `mass` and `of_modes`, found 3 of them",
        ],
    );
    let error = refused(odd(), |f| {
        let group = f.group("interface_coordinates").unwrap();
        group.delete_attr("names").unwrap();
        set_text(&group, "names", "[\"one\"]");
    });
    assert_says(
        &error,
        Code::BodySchema,
        &["/interface_coordinates@names: expected a name for each coordinate, found 1 for 4 numbers"],
    );
    let error = refused(odd(), |f| {
        let path = "interface_coordinates/stiffness";
        f.dataset(path).unwrap().write_raw(&[1.0, 2.0, 3.0, 4.0]).unwrap();
    });
    assert_says(&error, Code::BodySchema, &["`coordinates.stiffness` is not symmetric"]);
    let error = refused(odd(), |f| {
        let path = format!("interfaces/{}/misfit", link(f));
        let mut values = f.dataset(&path).unwrap().read_raw::<f64>().unwrap();
        values[1] += 1.0;
        f.dataset(&path).unwrap().write_raw(&values).unwrap();
    });
    assert_says(&error, Code::BodyIdentity, &["/misfit: found "]);
    let error = refused(odd(), |f| replace(f, "interface_coordinates/of_modes", &[3, 3], &[1.0; 9]));
    assert_says(
        &error,
        Code::BodySchema,
        &["/interface_coordinates/of_modes: expected shape [nc = 2, nf = 3]"],
    );
}

#[test]
fn a_file_cannot_lead_out_of_itself() {
    let case = valid();
    let other = case.path.with_file_name("other.h5");
    std::fs::copy(&case.path, &other).unwrap();
    let secret = case.path.with_file_name("secret.bin");
    std::fs::write(&secret, [0u8; 24]).unwrap();
    let file = hdf5::File::open_rw(&case.path).unwrap();
    file.unlink("modes/residual").unwrap();
    file.link_soft("/modes/damping_ratio", "modes/residual").unwrap();
    file.unlink("frame").unwrap();
    file.link_external(other.to_str().unwrap(), "/frame", "frame").unwrap();
    file.unlink("modes/damping_ratio").unwrap();
    let outside = file
        .new_dataset::<f64>()
        .external(secret.to_str().unwrap(), 0, 24)
        .shape([3])
        .create("modes/damping_ratio")
        .unwrap();
    for name in ["units", "symbol", "description"] {
        set_text(&outside, name, "1");
    }
    drop(outside);
    file.close().unwrap();
    assert_says(
        &refusal(&case.path),
        Code::BodySchema,
        &[
            "/modes/residual: expected a dataset, found a soft or external link",
            "/frame: expected a group, found a soft or external link",
            "/modes/damping_ratio: expected data inside the file, found references to other files",
        ],
    );
}

#[test]
fn huge_declared_arrays_are_refused_before_any_memory_is_taken() {
    // 2^40 empty modes: consistent with each other, but never stored.
    const HUGE: usize = 1 << 40;
    let error = damaged(|f| {
        for name in ["eigenvalue", "residual"] {
            f.unlink(&format!("modes/{name}")).unwrap();
            let empty = f
                .new_dataset::<f64>()
                .chunk([1024])
                .shape([HUGE])
                .create(format!("modes/{name}").as_str())
                .unwrap();
            for text in ["units", "symbol", "description"] {
                set_text(&empty, text, "1");
            }
        }
    });
    let found: Vec<_> = error.diagnostics().iter().map(|d| d.message()).collect();
    assert!(
        found.contains(&"/modes/residual: expected stored data for 1099511627776 values, found 0 bytes"),
        "{error}"
    );
}

#[test]
fn many_links_to_the_same_data_do_not_multiply_it() {
    let error = damaged(|f| {
        let group = f.group("lumped").unwrap();
        let first = group.member_names().unwrap().remove(0);
        let norms = f.group("comparison").unwrap();
        for i in 0..3000 {
            group.link_hard(&first, &format!("copy{i}")).unwrap();
            norms.link_hard(&first, &format!("copy{i}")).unwrap();
        }
    });
    assert!(
        error.diagnostics().iter().any(|d| d.message().contains("expected datasets that fit into the file"))
    );
    assert!(error.diagnostics().len() <= 201, "{}", error.diagnostics().len());
}

/// HDF5 2.2 hangs on object 0 of a global heap with the size 0.
#[test]
fn a_text_heap_that_never_ends_is_refused() {
    let case = valid();
    let mut bytes = std::fs::read(&case.path).unwrap();
    let heap = bytes.windows(4).position(|w| w == b"GCOL").expect("texts have variable length");
    bytes[heap + 16..heap + 18].fill(0);
    bytes[heap + 24..heap + 32].fill(0);
    std::fs::write(&case.path, &bytes).unwrap();
    assert_says(&refusal(&case.path), Code::BodyUnreadable, &["the text heap at byte"]);
    // An object with a stated size of 2^64 - 8 bytes would be read far beyond the heap.
    bytes[heap + 16] = 1;
    bytes[heap + 24..heap + 32].copy_from_slice(&(u64::MAX - 7).to_le_bytes());
    std::fs::write(&case.path, &bytes).unwrap();
    assert_says(&refusal(&case.path), Code::BodyUnreadable, &["the text heap at byte"]);
}

#[test]
fn every_truncation_is_refused() {
    let case = valid();
    let bytes = std::fs::read(&case.path).unwrap();
    for length in (0..bytes.len()).step_by(97).chain([bytes.len() - 1]) {
        std::fs::write(&case.path, &bytes[..length]).unwrap();
        refusal(&case.path);
    }
}

#[test]
fn damaged_bytes_never_panic_and_never_change_sizes() {
    let case = valid();
    let bytes = std::fs::read(&case.path).unwrap();
    let whole = flexbody_file::read(&case.path).unwrap();
    let mut random = Random::new(2024);
    let mut refused = 0;
    for _ in 0..400 {
        let mut damaged = bytes.clone();
        let at = random.below(bytes.len());
        match random.below(3) {
            0 => damaged[at] ^= 1 << random.below(8),
            1 => damaged[at] = 0xff,
            _ => {
                let end = (at + 1 + random.below(64)).min(bytes.len());
                damaged[at..end].iter_mut().for_each(|b| *b = random.bits() as u8);
            }
        }
        std::fs::write(&case.path, &damaged).unwrap();
        match flexbody_file::read(&case.path) {
            // HDF5 has no checksum of plain numbers, but the digests cover them: only unused bytes may
            // differ.
            Ok(read) => assert_eq!(fingerprint(&read), fingerprint(&whole)),
            Err(_) => refused += 1,
        }
    }
    assert!(refused > 200, "{refused} of 400 refused");
}
