//! Files of MBDyn, MBSim and Exudyn: each defect gives its own finding and no other; damaged files give an
//! error with a line and never a panic.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_base::provenance::SourceFile;
use flexbody_base::text::InputFile;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, Invariants, LumpedMasses, condense_lumped, primary_differences};
use flexbody_formats::export::ExportOptions;
use flexbody_formats::import::{ImportedFile, audit, import_body};
use flexbody_formats::{IMPORT_FORMATS, find_import_format, recognise};
use flexbody_formats::{export, find_format};
use flexbody_model::FeModel;
use hdf5_metno as hdf5;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::body_of;
use oracle::mesh::{Mesh, grid};
use proptest::prelude::*;
use std::path::Path;
use std::sync::LazyLock;

/// A small block without symmetry and its model.
static BLOCK: LazyLock<(FeModel, FlexBody)> = LazyLock::new(|| {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([2, 2, 1]), |[x, y, z]| {
        [0.2 * x + 0.03 * y, 0.2 * y * (1.0 - 0.05 * x), 0.2 * z * (1.0 + 0.1 * y)]
    });
    let raw = mesh.assemble(&rubber, MassRule::Consistent).raw_model();
    (FeModel::from_raw(raw.clone()).expect("a body").model, body_of(raw, 3, BodyFrame::Principal))
});

fn exported(format: &str, dialect: Option<&str>) -> Vec<u8> {
    let options = ExportOptions { dialect: dialect.map(str::to_owned), ..ExportOptions::default() };
    export(&BLOCK.1, find_format(format).expect("a format"), &options, true).expect("written").0.file
}

fn fem() -> String {
    String::from_utf8(exported("mbdyn", None)).expect("text")
}

fn read(bytes: &[u8], format: &str) -> Result<ImportedFile, Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file");
    std::fs::write(&path, bytes).expect("written");
    find_import_format(format).expect("a format").read(&InputFile::open(&path).map_err(Error::from)?)
}

/// Returns names and codes of the failed checks of the format.
fn findings(imported: &ImportedFile) -> Vec<(&'static str, Code)> {
    imported.checks.iter().filter(|check| !check.passed()).map(|check| (check.name, check.code)).collect()
}

/// Returns the text with the `at`-th number of a record group changed.
fn with_number(text: &str, group: usize, at: usize, change: impl Fn(f64) -> f64) -> String {
    let title = format!("** RECORD GROUP {group},");
    let (mut inside, mut seen) = (false, 0);
    let line = |line: &str| -> String {
        if line.starts_with("** RECORD GROUP") {
            inside = line.starts_with(&title);
        }
        if !inside || line.starts_with("**") {
            return line.to_owned();
        }
        let words = line.split_whitespace().map(|word| {
            seen += 1;
            let value: f64 = word.parse().expect("a number");
            if seen == at + 1 { format!("{:.16e}", change(value)) } else { word.to_owned() }
        });
        words.collect::<Vec<_>>().join(" ")
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n") + "\n"
}

/// Returns the numbers of a record group.
fn numbers(text: &str, group: usize) -> Vec<f64> {
    let title = format!("** RECORD GROUP {group},");
    let lines = text.lines().skip_while(|line| !line.starts_with(&title)).skip(1);
    let words = lines.take_while(|line| !line.starts_with("**")).flat_map(str::split_whitespace);
    words.map(|word| word.parse().expect("a number")).collect()
}

/// Returns the text without some record groups.
fn without(text: &str, groups: &[usize]) -> String {
    let mut drop = false;
    let keep = |line: &&str| {
        if let Some(title) = line.strip_prefix("** RECORD GROUP ") {
            let number = title.split(',').next().expect("a number").parse().expect("a number");
            drop = groups.contains(&number);
        }
        if line.starts_with("** END") {
            drop = false;
        }
        !drop
    };
    text.lines().filter(keep).collect::<Vec<_>>().join("\n") + "\n"
}

/// Returns the text with a record group inserted before its end.
fn with_group(text: &str, title: &str, values: &[String]) -> String {
    text.replace("** END OF FILE", &format!("** RECORD GROUP {title}\n{}\n** END OF FILE", values.join("\n")))
}

fn lumped_groups(masses: &[f64]) -> Vec<String> {
    masses.iter().map(|m| format!("{m:.16e} {m:.16e} {m:.16e} 0 0 0")).collect()
}

fn row_sums() -> LumpedMasses {
    LumpedMasses::row_sum(BLOCK.0.scalar_mass().expect("a solid"))
}

#[test]
fn a_sound_file_has_no_findings() {
    for format in IMPORT_FORMATS.iter().map(|format| format.name()) {
        let found = read(&exported(format, None), format).expect("readable");
        assert_eq!(findings(&found), []);
        assert!(audit(&found, 1e-9).passed(), "{format}");
    }
}

#[test]
fn each_fault_of_an_mbdyn_file_is_its_finding() {
    use Code::{
        AuditCoupling as Coupling, AuditDigits as Digits, AuditIdentity as Identity, AuditLumped as Lumped,
    };
    let (text, nf) = (fem(), 3);
    let of = |text: &str| findings(&read(text.as_bytes(), "mbdyn").expect("readable"));
    let twist = |v: f64| v + 1e-3;
    assert_eq!(of(&with_number(&text, 15, 1, twist)), [("i4_of_i8", Identity)]);
    assert_eq!(of(&with_number(&text, 16, 1, twist)), [("i4_of_i8", Identity)]);
    assert_eq!(of(&with_number(&text, 9, 0, twist)), [("modal_mass_of_i9", Lumped)]);
    let both = [("i5_antisymmetric", Identity), ("i5_of_i9", Identity)];
    assert_eq!(of(&with_number(&text, 17, 1, twist)), both);
    // I9_12(1,1) and I9_21(1,1) changed alike: symmetric, but with another modal mass.
    let diagonal = with_number(&with_number(&text, 18, 3, twist), 18, 3 * nf, twist);
    assert_eq!(of(&diagonal), [("modal_mass_of_i9", Lumped)]);
    assert_eq!(
        of(&with_number(&text, 18, 3, twist)),
        [("i9_symmetric", Identity), ("modal_mass_of_i9", Lumped)]
    );
    let no_coupling = without(&text, &[14, 15, 16, 17, 18]);
    assert_eq!(of(&no_coupling), [("coupling_there", Coupling)]);
    assert_eq!(of(&without(&text, &[17])), [("coupling_there", Coupling)]);

    let masses = row_sums();
    let beside = with_group(&text, "11, DIAGONAL OF LUMPED MASS MATRIX", &lumped_groups(masses.masses()));
    let alone =
        with_group(&no_coupling, "11, DIAGONAL OF LUMPED MASS MATRIX", &lumped_groups(masses.masses()));
    let carried = ("lumped_masses_carry_modes", Lumped);
    assert_eq!(of(&beside), [("lumped_masses_alone", Identity), carried]);
    assert_eq!(of(&alone), [carried]);
    let mut negative = masses.masses().to_vec();
    negative[0] *= -1.0;
    let negative = with_group(&no_coupling, "11, MASSES", &lumped_groups(&negative));
    assert_eq!(of(&negative), [("lumped_masses_positive", Lumped), carried]);

    // Three-row matrices are stored by columns, as the manual describes them.
    let mut columns = text.clone();
    for (group, width) in [(14, nf), (15, nf), (16, 3 * nf), (17, nf * nf), (18, 3 * nf * nf)] {
        let values: Vec<f64> = numbers(&text, group);
        for at in 0..3 * width {
            columns = with_number(&columns, group, at, |_| values[at % 3 * width + at / 3]);
        }
    }
    let found = of(&columns);
    assert!(!found.is_empty() && found.iter().all(|(_, code)| *code == Code::AuditLayout), "{found:?}");

    // All numbers have six decimals, as written by %f.
    let fixed = text.lines().map(|line| {
        if line.starts_with("**") || line.starts_with("REV") {
            line.to_owned()
        } else {
            line.split_whitespace()
                .map(|word| {
                    if word.contains('.') {
                        format!("{:.6}", word.parse::<f64>().expect("a number"))
                    } else {
                        word.to_owned()
                    }
                })
                .collect::<Vec<_>>()
                .join(" ")
        }
    });
    let found = of(&(fixed.collect::<Vec<_>>().join("\n") + "\n"));
    assert_eq!(found, [("digits", Digits)]);
}

/// MBDyn reads as many numbers as the header states and skips the text up to the next record group.
#[test]
fn what_mbdyn_skips_is_a_finding() {
    let text = fem();
    let surplus = ("no_more_than_the_header_says", Code::AuditSurplus);
    let of = |text: &str| {
        let imported = read(text.as_bytes(), "mbdyn").expect("readable");
        (findings(&imported), imported.unsound)
    };
    // femgen writes an additional row of zeros.
    let masses = row_sums();
    let mut rows = lumped_groups(masses.masses());
    rows.push("0.0 0.0 0.0 0.0 0.0 0.0".to_owned());
    let zeros = with_group(&without(&text, &[14, 15, 16, 17, 18]), "11, MASSES", &rows);
    let (found, unsound) = of(&zeros);
    assert_eq!(found, [surplus, ("lumped_masses_carry_modes", Code::AuditLumped)]);
    assert!(unsound.is_empty(), "{unsound:?}");
    // A line of words without a comment mark is harmless; numbers are not, wherever they are.
    let group = "** RECORD GROUP 9,";
    let (found, unsound) = of(&text.replacen(group, &format!("a remark\n{group}"), 1));
    assert!(found == [surplus] && unsound.is_empty(), "{found:?}");
    for numbers in [format!("1.0\n**\n{group}"), format!("**\n1.0\n{group}")] {
        let (found, unsound) = of(&text.replacen(group, &numbers, 1));
        assert_eq!((found, unsound.len()), (vec![surplus], 1));
        assert!(unsound[0].contains("of record group 8"), "{unsound:?}");
    }
    // The header states fewer modes than the file has.
    let (found, unsound) = of(&text.replacen("REV0 18 3", "REV0 18 2", 1));
    assert!(found.contains(&surplus) && unsound.len() > 3, "{found:?} {unsound:?}");
    let imported = read(text.replacen("REV0 18 3", "REV0 18 2", 1).as_bytes(), "mbdyn").expect("readable");
    let source = SourceFile::new("body", Path::new("body.fem"), "0".repeat(64));
    let error = import_body(&imported, source, UnitSystem::default(), None).expect_err("another body");
    assert!(error.has(Code::ForeignUnsound), "{error}");
}

/// Titles of modes may be blank lines, and numbers may be adjacent without a blank.
#[test]
fn shapes_are_read_as_mbdyn_reads_them() {
    let text = fem();
    let own = read(text.as_bytes(), "mbdyn").expect("readable").body;
    let is_title = |line: &str| line.starts_with("**    NORMAL MODE SHAPE");
    let blank =
        |line: &'static str| move |old: &str| if is_title(old) { line.to_owned() } else { old.to_owned() };
    for title in ["", "** "] {
        let lines: Vec<String> = text.lines().map(blank(title)).collect();
        assert_eq!(read(lines.join("\n").as_bytes(), "mbdyn").expect("readable").body, own);
    }
    let touching =
        |line: &str| if line.starts_with("**") { line.to_owned() } else { line.replace(" -", "-") };
    let lines: Vec<String> = text.lines().map(touching).collect();
    assert_ne!(lines.join("\n") + "\n", text);
    let found = read(lines.join("\n").as_bytes(), "mbdyn").expect("readable");
    assert_eq!((findings(&found), found.body), (Vec::new(), own));
}

/// The sums of MBDyn over lumped masses are the invariants of the body with these masses.
#[test]
fn bodies_of_lumped_masses_are_taken_as_mbdyn_takes_them() {
    let masses = row_sums();
    let text = without(&fem(), &[14, 15, 16, 17, 18]);
    let text = with_group(&text, "11, MASSES", &lumped_groups(masses.masses()));
    let body = &BLOCK.1;
    for text in [text.clone(), without(&text, &[12])] {
        let found = read(text.as_bytes(), "mbdyn").expect("readable");
        assert_eq!(found.dialect, "level13");
        let mut told = found.body.inertia.clone();
        // The expected modal mass is that of the lumped masses; the file has the consistent one.
        let expected = condense_lumped(
            &masses,
            &body.nodes().positions,
            body.modes().shape.as_ref(),
            body.invariants().modal_stiffness().clone(),
        );
        told.i6 = expected.modal_mass();
        if text.contains("RECORD GROUP 12") {
            (told.i1, told.i2, told.i7) = (expected.mass(), expected.first_moment(), expected.inertia());
        }
        let told = Invariants::from_numbered(&told, expected.modal_stiffness().clone(), 1e-12);
        for (what, difference) in primary_differences(&expected, &told) {
            assert!(difference < 1e-13, "{what}: {difference:.1e}");
        }
    }
}

#[test]
fn errors_name_the_line() {
    let text = fem();
    let line_of = |start: &str| 1 + text.lines().position(|line| line.starts_with(start)).expect("there");
    let error = |text: &str| {
        let error = read(text.as_bytes(), "mbdyn").expect_err("broken");
        let one = &error.diagnostics()[0];
        (one.code(), one.line(), one.message().to_owned())
    };
    let unreadable = |text: &str, line: usize, words: &str| {
        let (code, at, message) = error(text);
        assert_eq!((code, at), (Code::ForeignUnreadable, Some(line)), "{message}");
        assert!(message.contains(words), "{message}");
    };
    let group_9 = line_of("** RECORD GROUP 9,");
    unreadable(&with_number(&text, 9, 0, |_| f64::NAN), group_9 + 1, "expected a finite number");
    // A three-digit exponent in Fortran form, which MBDyn reads as two numbers.
    let digits = format!("{:.16e}", numbers(&text, 9)[0]);
    unreadable(&text.replacen(&digits, "1.2345678901-101", 1), group_9 + 1, "letter of the exponent");
    unreadable(&text.replacen("** RECORD GROUP 9,", "** RECORD GROUP 8,", 1), group_9, "twice");
    unreadable(
        &text.replacen("** RECORD GROUP 9,", "** RECORD GROUP 20,", 1),
        group_9,
        "groups are numbered 1 to 19",
    );
    let fewer = text.replacen("REV0 18 3", "REV0 18 4", 1);
    assert_ne!(fewer, text);
    assert_eq!(error(&fewer).0, Code::ForeignUnreadable);
    unreadable(
        &text.replacen("** RECORD GROUP 1,", "** RECORD GROUP 2,", 1),
        line_of("** RECORD GROUP 1,"),
        "precedes record group 1",
    );
    let cut: String = text.lines().take(group_9 + 1).map(|line| format!("{line}\n")).collect();
    unreadable(&cut, group_9 + 1, "ends too early");
    let (code, _, message) = error(&without(&text, &[6, 10]));
    assert_eq!(
        (code, message.as_str()),
        (Code::ForeignIncomplete, "the file has no record groups 6, 10, which are required")
    );
    assert_eq!(error(&without(&text, &[12])).0, Code::ForeignIncomplete);
    // The header states counts beyond any memory.
    assert_eq!(
        error(&text.replacen("REV0 18 3", "REV0 18446744073709551615 4294967295", 1)).0,
        Code::ForeignUnreadable
    );
}

/// Returns the file with some values of a dataset changed, by their index.
fn with_values(bytes: &[u8], name: &str, change: impl Fn(usize, f64) -> f64) -> Vec<u8> {
    edited(bytes, |file| {
        let dataset = file.dataset(name).expect(name);
        let mut values: Vec<f64> = dataset.read_raw().expect("floats");
        values.iter_mut().enumerate().for_each(|(i, value)| *value = change(i, *value));
        dataset.write_raw(&values).expect("written");
    })
}

fn edited(bytes: &[u8], edit: impl FnOnce(&hdf5::File)) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file.h5");
    std::fs::write(&path, bytes).expect("written");
    let file = hdf5::File::open_rw(&path).expect("HDF5");
    edit(&file);
    file.close().expect("closed");
    std::fs::read(&path).expect("there")
}

fn replaced(bytes: &[u8], name: &str, shape: Option<Vec<usize>>) -> Vec<u8> {
    edited(bytes, |file| {
        file.unlink(name).expect("there");
        if let Some(shape) = shape {
            let values = vec![0.5; shape.iter().product()];
            file.new_dataset::<f64>()
                .shape(shape)
                .create(name)
                .expect("made")
                .write_raw(&values)
                .expect("written");
        }
    })
}

#[test]
fn each_fault_of_an_exudyn_file_is_its_finding() {
    use Code::{AuditIdentity as Identity, AuditLayout as Layout, AuditLumped as Lumped};
    let (bytes, nf) = (exported("exudyn", None), 3);
    let of = |bytes: &[u8]| findings(&read(bytes, "exudyn").expect("readable"));
    let twist = |name: &str, at: &[usize]| {
        of(&with_values(&bytes, name, |i, v| if at.contains(&i) { v + 1e-3 } else { v }))
    };
    assert_eq!(twist("Mtt", &[4]), [("mtt_is_mass", Identity)]);
    assert_eq!(twist("chiUtilde", &[1]), [("chi_tilde_is_chi", Identity)]);
    assert_eq!(twist("mPhitTPsiTilde", &[1]), [("phi_tilde_is_phi", Identity)]);
    assert_eq!(twist("mXRefTildePsi", &[0]), [("x_psi_of_x_psi_tilde", Identity)]);
    assert_eq!(twist("mXRefTildePsiTilde", &[1]), [("x_psi_of_x_psi_tilde", Identity)]);
    assert_eq!(twist("massMatrixReduced", &[0]), [("modal_mass_of_psi_tilde_psi_tilde", Lumped)]);
    assert_eq!(twist("mPsiTildePsiTilde", &[0]), [("modal_mass_of_psi_tilde_psi_tilde", Lumped)]);
    assert_eq!(
        twist("mPsiTildePsi", &[1]),
        [("psi_tilde_psi_antisymmetric", Identity), ("psi_tilde_psi_of_psi_tilde_psi_tilde", Identity)]
    );
    // All large arrays are ordered by axes, then modes.
    let by_axes = |i: usize| i % nf * 3 + i / nf;
    let mut mixed = bytes.clone();
    for (name, rows, columns) in [
        ("mPsiTildePsi", true, false),
        ("mPsiTildePsiTilde", true, true),
        ("mPhitTPsiTilde", false, true),
        ("mXRefTildePsiTilde", false, true),
    ] {
        let (values, width) = edited_values(&mixed, name);
        let height = values.len() / width;
        let at = |i: usize, of: bool| if of { by_axes(i) } else { i };
        assert!(height > 0);
        mixed = with_values(&mixed, name, |index, _| {
            values[at(index / width, rows) * width + at(index % width, columns)]
        });
    }
    let found = of(&mixed);
    assert!(!found.is_empty() && found.iter().all(|(_, code)| *code == Layout), "{found:?}");
}

fn edited_values(bytes: &[u8], name: &str) -> (Vec<f64>, usize) {
    let mut found = (Vec::new(), 0);
    edited(bytes, |file| {
        let dataset = file.dataset(name).expect(name);
        found = (dataset.read_raw().expect("floats"), dataset.shape()[1]);
    });
    found
}

#[test]
fn each_fault_of_an_mbsim_file_is_its_finding() {
    use Code::{AuditIdentity as Identity, AuditLumped as Lumped};
    let (bytes, nf) = (exported("mbsim", None), 3);
    let of = |bytes: &[u8]| findings(&read(bytes, "mbsim").expect("readable"));
    let twist = |name: &str, at: &[usize]| {
        of(&with_values(&bytes, name, |i, v| if at.contains(&i) { v + 1e-3 } else { v }))
    };
    let pairs = "shape function shape function integral";
    assert_eq!(twist("position position integral", &[1]), [("position_position_symmetric", Identity)]);
    assert_eq!(twist(pairs, &[1, nf]), [("modal_mass_diagonal", Lumped)]);
    assert_eq!(twist(pairs, &[1]), [("shape_shape_symmetric", Identity), ("modal_mass_diagonal", Lumped)]);
}

#[test]
fn hdf5_files_that_lack_something_are_refused_by_its_name() {
    for (format, name, rows) in
        [("exudyn", "mPsiTildePsiTilde", 9), ("mbsim", "position shape function integral", 9)]
    {
        let bytes = exported(format, None);
        let error = read(&replaced(&bytes, name, None), format).expect_err("incomplete");
        assert!(error.has(Code::ForeignIncomplete));
        assert!(error.diagnostics()[0].message().contains(&format!("`{name}`")));
        for shape in [vec![rows, 2], vec![rows], vec![1], vec![rows, 3, 2]] {
            let error = read(&replaced(&bytes, name, Some(shape)), format).expect_err("another shape");
            assert!(error.has(Code::ForeignUnreadable));
            assert!(error.diagnostics()[0].message().contains("expected shape"), "{error}");
        }
    }
}

/// A change of the bytes at a position given as a fraction of the length.
#[derive(Debug, Clone)]
enum Damage {
    Set(f64, u8),
    Insert(f64, Vec<u8>),
    Remove(f64, usize),
    CutOff(f64),
}

fn damage() -> impl Strategy<Value = Damage> {
    let at = 0.0..1.0f64;
    let words = vec![
        &b" "[..],
        b"\n",
        b"** RECORD GROUP 18, X\n",
        b"99999999999999999999",
        b"-1",
        b"nan",
        b"1e999",
        b"\xff",
    ];
    prop_oneof![
        4 => (at.clone(), any::<u8>()).prop_map(|(at, byte)| Damage::Set(at, byte)),
        2 => (at.clone(), prop::sample::select(words)).prop_map(|(at, b)| Damage::Insert(at, b.to_vec())),
        1 => (at.clone(), 1..40usize).prop_map(|(at, length)| Damage::Remove(at, length)),
        1 => at.prop_map(Damage::CutOff),
    ]
}

fn damaged(bytes: &[u8], damages: &[Damage]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for damage in damages {
        let len = bytes.len();
        let place = |at: f64| ((at * len as f64) as usize).min(len.saturating_sub(1));
        match damage {
            _ if len == 0 => {}
            Damage::Set(at, byte) => bytes[place(*at)] = *byte,
            Damage::Insert(at, new) => {
                bytes.splice(place(*at)..place(*at), new.iter().copied());
            }
            Damage::Remove(at, length) => {
                bytes.drain(place(*at)..(place(*at) + length).min(len));
            }
            Damage::CutOff(at) => bytes.truncate(place(*at).max(1)),
        }
    }
    bytes
}

static EXPORTS: LazyLock<Vec<(&str, Vec<u8>)>> = LazyLock::new(|| {
    IMPORT_FORMATS.iter().map(|format| (format.name(), exported(format.name(), None))).collect()
});

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any damage ends in a body or in a report; audit and import of a readable file end likewise.
    #[test]
    fn damaged_files_never_panic(which in 0..IMPORT_FORMATS.len(), damages in proptest::collection::vec(damage(), 1..4)) {
        let (format, bytes) = &EXPORTS[which];
        let bytes = damaged(bytes, &damages);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        std::fs::write(&path, &bytes).expect("written");
        let Ok(file) = InputFile::open(&path) else { return Ok(()) };
        let _ = recognise(&file);
        match find_import_format(format).expect("a format").read(&file) {
            Ok(found) => {
                prop_assert!(found.body.frames.iter().all(|frame| frame.translation.ncols() == found.body.n_modes()));
                let _ = audit(&found, 1e-6);
                let source = SourceFile::new("body", &path, "0".repeat(64));
                let _ = import_body(&found, source, UnitSystem::default(), None);
            }
            Err(error) => {
                let about = [Code::ForeignUnreadable, Code::ForeignIncomplete, Code::FileUnreadable];
                prop_assert!(error.diagnostics().iter().all(|d| about.contains(&d.code()) && !d.message().is_empty()));
            }
        }
    }
}

/// A public body whose frame is fixed to its clamped ends keeps the frame: the compliance of its middle with
/// the frame held agrees with the file, also after export and import.
#[test]
fn a_clamped_public_body_keeps_its_frame() {
    let shared = oracle::shared().join("cases/targets/mbsim/modal_reduced_beam.h5");
    if !shared.exists() {
        return;
    }
    let read = |path: &Path| {
        let file = InputFile::open(path).expect("readable");
        find_import_format("mbsim").expect("a format").read(&file).expect("a body")
    };
    let compliance = |told: &ImportedFile| {
        let k = &told.body.modal_stiffness;
        let n = k.ncols();
        let inverse = nalgebra::DMatrix::from_fn(n, n, |i, j| k[(i, j)]).try_inverse().expect("regular");
        let of_frame = |frame: &flexbody_formats::import::ImportedFrame| {
            let phi = nalgebra::DMatrix::from_fn(3, n, |i, j| frame.translation[(i, j)]);
            (&phi * &inverse * phi.transpose()).amax()
        };
        told.body.frames.iter().map(of_frame).fold(0.0, f64::max)
    };
    let given = read(&shared);
    let notes = audit(&given, 1e-6).notes.join("\n");
    assert!(notes.contains("the frame is fixed to 2 nodes that move in no mode, 1 to 21"), "{notes}");
    let source = SourceFile::new("body", &shared, "0".repeat(64));
    let taken = import_body(&given, source, UnitSystem::default(), None).expect("a body");
    // Surface lines are kept, stresses are reported as lost.
    assert!(taken.body.mesh().is_some_and(|mesh| mesh.edges().len() == 20));
    assert!(taken.diagnostics.iter().any(|d| d.message().contains("nodal stress matrix")));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("again.h5");
    let format = find_format("mbsim").expect("a format");
    let (written, _) = export(&taken.body, format, &ExportOptions::default(), false).expect("written");
    std::fs::write(&path, written.file).expect("a place");
    let again = read(&path);
    let (own, told) = (compliance(&again), compliance(&given));
    assert!((own / told - 1.0).abs() < 1e-9 && (told - 3.326e-5).abs() < 0.001e-5, "{own:e} {told:e}");
    assert_eq!(again.body.mesh, given.body.mesh);
}
