//! Exports to Exudyn, MBDyn and MBSim: every number compared with the body and with sums over the mass
//! matrix, read back, and reported losses.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::numbers::significant;
use flexbody_base::text::InputFile;
use flexbody_body::flex_body::{FlexBody, LoadKind};
use flexbody_body::invariants::{BodyFrame, CauchySchwarz, InertiaShares, Invariants, primary_differences};
use flexbody_formats::export::{ExportOptions, Points, frames};
use flexbody_formats::import::{ImportedFile, audit};
use flexbody_formats::{IMPORT_FORMATS, find_import_format, recognise};
use flexbody_formats::{export, find_format};
use flexbody_model::{FeModel, GeometricStiffness, UnitLoad};
use hdf5_metno as hdf5;
use nalgebra::{Matrix3, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::{body_of, fixture, soft_block, stressed};
use oracle::mesh::{Mesh, grid};
use oracle::partial::{combinations, with_groups};
use oracle::random::Random;

/// Returns the formats that are read back, with their dialects; SID has tests of its own.
fn formats() -> Vec<(&'static str, &'static str)> {
    let names = IMPORT_FORMATS.iter().map(|format| format.name()).filter(|name| *name != "sid");
    let of_name = |name| match find_format(name).expect("a format").dialects() {
        [] => vec![(name, "")],
        dialects => dialects.iter().map(|dialect| (name, *dialect)).collect(),
    };
    names.flat_map(of_name).collect()
}

fn options(dialect: &str, points: Points) -> ExportOptions {
    ExportOptions {
        dialect: (!dialect.is_empty()).then(|| dialect.to_owned()),
        points,
        ..ExportOptions::default()
    }
}

/// Returns the file and its losses.
fn written(body: &FlexBody, format: &str, options: &ExportOptions) -> (Vec<u8>, Vec<String>) {
    let (exported, mut losses) =
        export(body, find_format(format).expect("a format"), options, true).expect("written");
    // A program that joins the interfaces, or a table of their numbers.
    let are_named =
        flexbody_formats::export::frames(body, &options.points).iter().any(|frame| frame.name.is_some());
    let beside = match format {
        "exudyn" => true,
        "mbsim" => are_named,
        _ => false,
    };
    assert_eq!(exported.beside.len(), usize::from(beside));
    losses.retain(|told| ![Code::ExportNeeds, Code::ExportNumbers].contains(&told.code()));
    assert!(losses.iter().all(|loss| loss.code() == Code::ExportLost));
    (exported.file, losses.iter().map(|loss| loss.message().to_owned()).collect())
}

fn read(bytes: &[u8], format: &str) -> ImportedFile {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file");
    std::fs::write(&path, bytes).expect("written");
    let file = InputFile::open(&path).expect("a file");
    assert_eq!(recognise(&file).expect("known").name(), format);
    find_import_format(format).expect("a format").read(&file).expect("readable")
}

fn models() -> Vec<String> {
    let folder = oracle::fixtures().join("models");
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("models")
        .map(|entry| entry.expect("a model").file_name().into_string().expect("a name"))
        .collect();
    names.sort();
    names
}

fn told(imported: &ImportedFile) -> Invariants {
    Invariants::from_numbered(&imported.body.inertia, imported.body.modal_stiffness.clone(), 1e-12)
}

/// Returns the invariants that these formats hold: no W0 beyond C1, W3 antisymmetric.
fn held(body: &FlexBody) -> Invariants {
    let mut held = body.invariants().clone();
    let nf = body.n_modes();
    let solid = held.as_solid();
    if let Some(general) = &mut held.primary_mut().general {
        let w3 = general.w3.clone();
        general.w0 = solid.w0();
        general.w3 =
            Mat::from_fn(3 * nf, nf, |row, k| 0.5 * (w3[(row, k)] - w3[(row / nf * nf + k, row % nf)]));
    }
    held
}

#[test]
#[ignore = "slow"]
fn every_fixture_is_read_back_with_every_number() {
    for name in models() {
        for frame in [BodyFrame::Principal, BodyFrame::Model] {
            let body = fixture(&name, 6, frame);
            for (format, dialect) in formats() {
                let options = options(dialect, Points::Usual);
                let (bytes, losses) = written(&body, format, &options);
                assert_eq!(written(&body, format, &options).0, bytes, "{name} {format}: equal bytes");
                let found = read(&bytes, format);
                assert_eq!(found.dialect, dialect, "{name}");
                let case = format!("{name} {format} {dialect} {frame:?}");
                let exact = dialect != "level13";
                if exact {
                    values(&body, &found, format, &case);
                    let audit = audit(&found, 1e-9);
                    // The lossy export of a general mass gives invariants that no distribution of mass has.
                    let general = body.invariants().general().is_some();
                    let excused = ["scalar_gram_psd", "velocity_gram_psd"];
                    let wrong = audit.checks.iter().filter(|check| !check.passed());
                    let wrong: Vec<_> = wrong
                        .filter(|check| !(general && excused.contains(&check.name)))
                        .map(|check| (check.name, check.value))
                        .collect();
                    assert!(wrong.is_empty(), "{case}: {wrong:?}");
                }
                assert_eq!(
                    losses.iter().any(|loss| loss.contains("record groups 14 to 18")),
                    !exact,
                    "{case}"
                );
                places(&body, &found, format, &case);
            }
        }
    }
}

/// Compares inertia and stiffness.
fn values(body: &FlexBody, found: &ImportedFile, format: &str, case: &str) {
    assert_eq!(&found.body.modal_stiffness, body.invariants().modal_stiffness(), "{case}");
    // MBSim states m_ff as a sum, which replaces W2 of a general mass.
    let own_w2 = format != "mbsim" || body.invariants().general().is_none();
    same(&held(body), &told(found), own_w2, case);
}

/// Asserts equality except for the part of W2 that these programs ignore: the part skew in its axes, if it
/// differs from W3.
fn same(expected: &Invariants, found: &Invariants, with_w2: bool, case: &str) {
    let composed = expected.general().is_some() || !expected.groups().w3;
    for (what, difference) in primary_differences(expected, found) {
        let exact = what != "second_moment" && (what != "S" || (with_w2 && !composed));
        assert!(!exact || difference < 1e-13, "{case}: {what} {difference:.1e}");
    }
    // Files have I0; the second moment of a thin body is a small difference of its entries.
    let apart = (expected.inertia() - found.inertia()).norm() / expected.inertia().norm();
    assert!(apart < 1e-14, "{case}: I0 {apart:.1e}");
    let (Some(own), Some(other)) = (expected.w2(), found.w2()) else { return };
    let nf = expected.n_modes();
    let bound = CauchySchwarz::of(expected);
    for (row, column) in (0..9 * nf * nf).map(|at| (at / (3 * nf), at % (3 * nf))) {
        let (a, j, b, k) = (row / nf, row % nf, column / nf, column % nf);
        let symmetric = |w2: &Mat<f64>| w2[(row, column)] + w2[(b * nf + j, a * nf + k)];
        let difference = (symmetric(&own) - symmetric(&other)).abs() / bound.s(j, k);
        assert!(!with_w2 || difference < 1e-13, "{case}: W2 {difference:.1e}");
    }
}

fn places(body: &FlexBody, found: &ImportedFile, format: &str, case: &str) {
    // Exudyn files have all nodes, with their numbers in the model.
    let points = if format == "exudyn" { Points::Nodes } else { Points::Usual };
    let places = frames(body, &points);
    assert_eq!(found.body.frames.len(), places.len(), "{case}");
    for (own, place) in found.body.frames.iter().zip(&places) {
        assert_eq!(own.position, place.position, "{case}");
        assert_eq!(own.translation, place.translation, "{case}");
        let name = match format {
            "mbdyn" => place.name.clone().unwrap_or_else(|| place.id.to_string()),
            _ => place.id.to_string(),
        };
        assert_eq!(own.label, name, "{case}");
        assert_eq!(own.interface, place.name.clone().filter(|_| format == "mbdyn"), "{case}");
        if format == "mbdyn" {
            let turns = place.rotation.as_ref().filter(|rotation| rotation.norm_max() > 0.0);
            assert_eq!(own.rotation.as_ref(), turns, "{case}");
        }
    }
}

/// Returns a block without symmetry, its model, and its body about a point other than the centre of mass.
fn block() -> (FeModel, FlexBody) {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([3, 2, 2]), |[x, y, z]| {
        [0.4 + 0.2 * x + 0.03 * y, 0.2 * y * (1.0 - 0.05 * x), 0.2 * z * (1.0 + 0.1 * y) - 0.3]
    });
    let raw = mesh.assemble(&rubber, MassRule::Consistent).raw_model();
    (FeModel::from_raw(raw.clone()).expect("a body").model, body_of(raw, 5, BodyFrame::Model))
}

/// Sums over the mass matrix as defined in the papers and programs.
struct Sums {
    body: FlexBody,
    /// Nodes i and j, and the entry of Ms.
    mass: Vec<(usize, usize, f64)>,
}

impl Sums {
    fn new() -> Self {
        let (model, body) = block();
        let ms = model.scalar_mass().expect("a solid");
        let n = body.n_nodes();
        let mut mass = Vec::new();
        for column in 0..n {
            let mut unit = Mat::zeros(n, 1);
            unit[(column, 0)] = 1.0;
            let mut product = Mat::zeros(n, 1);
            flexbody_linalg::multiply(ms, 1, unit.as_ref(), product.as_mut());
            mass.extend((0..n).map(|row| (row, column, product[(row, 0)])).filter(|entry| entry.2 != 0.0));
        }
        Self { body, mass }
    }

    fn x(&self, node: usize) -> Vector3<f64> {
        Vector3::from(self.body.nodes().positions[node])
    }

    fn psi(&self, node: usize, mode: usize) -> Vector3<f64> {
        Vector3::from_fn(|k, _| self.body.modes().shape[(3 * node + k, mode)])
    }

    fn sum(&self, of: impl Fn(usize, usize) -> Matrix3<f64>) -> Matrix3<f64> {
        self.mass.iter().map(|&(i, j, m)| of(i, j) * m).sum()
    }

    fn vector(&self, of: impl Fn(usize, usize) -> Vector3<f64>) -> Vector3<f64> {
        self.mass.iter().map(|&(i, j, m)| of(i, j) * m).sum()
    }
}

fn close(found: f64, expected: f64, size: f64, what: &str) {
    assert!((found - expected).abs() <= 1e-13 * size, "{what}: {found:e}, expected {expected:e}");
}

fn array(file: &hdf5::File, name: &str) -> (Vec<f64>, Vec<usize>) {
    let dataset = file.dataset(name).expect(name);
    (dataset.read_raw().expect("floats"), dataset.shape())
}

/// Opens the file with the HDF5 library.
fn opened<T>(bytes: &[u8], look: impl FnOnce(&hdf5::File) -> T) -> T {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file.h5");
    std::fs::write(&path, bytes).expect("written");
    look(&hdf5::File::open(&path).expect("HDF5"))
}

#[test]
fn arrays_of_exudyn_are_the_products_of_fem_py() {
    let sums = Sums::new();
    let nf = sums.body.n_modes();
    let (bytes, losses) = written(&sums.body, "exudyn", &ExportOptions::default());
    assert!(losses.is_empty(), "{losses:?}");
    opened(&bytes, |file| {
        let at = |name: &str, row: usize, column: usize| {
            let (values, shape) = array(file, name);
            assert_eq!(shape.len(), 2, "{name}");
            values[row * shape[1] + column]
        };
        let inertia = sums.sum(|i, j| sums.x(i).cross_matrix().transpose() * sums.x(j).cross_matrix());
        let size = inertia.norm();
        for j in 0..nf {
            // xRefTilde' M PsiTilde, and xRefTilde' M Psi.
            let i8 = sums.sum(|a, b| sums.x(a).cross_matrix().transpose() * sums.psi(b, j).cross_matrix());
            let x_psi = sums.vector(|a, b| sums.x(a).cross_matrix().transpose() * sums.psi(b, j));
            let phi = sums.vector(|_, b| sums.psi(b, j));
            for a in 0..3 {
                close(at("mXRefTildePsi", a, j), x_psi[a], size, "mXRefTildePsi");
                close(at("mPhitTPsi", a, j), phi[a], size, "mPhitTPsi");
                for b in 0..3 {
                    close(at("mXRefTildePsiTilde", a, 3 * j + b), i8[(a, b)], size, "mXRefTildePsiTilde");
                    let skew = phi.cross_matrix()[(a, b)];
                    close(at("mPhitTPsiTilde", a, 3 * j + b), skew, size, "mPhitTPsiTilde");
                }
            }
            for k in 0..nf {
                let p = sums
                    .sum(|a, b| sums.psi(a, j).cross_matrix().transpose() * sums.psi(b, k).cross_matrix());
                let c = sums.vector(|a, b| sums.psi(a, j).cross_matrix().transpose() * sums.psi(b, k));
                for a in 0..3 {
                    close(at("mPsiTildePsi", 3 * j + a, k), c[a], 1.0, "mPsiTildePsi");
                    for b in 0..3 {
                        close(
                            at("mPsiTildePsiTilde", 3 * j + a, 3 * k + b),
                            p[(a, b)],
                            1.0,
                            "mPsiTildePsiTilde",
                        );
                    }
                }
            }
        }
        for a in 0..3 {
            for b in 0..3 {
                close(at("inertiaLocal", a, b), inertia[(a, b)], size, "inertiaLocal");
            }
        }
        let names = file.member_names().expect("names");
        assert_eq!(names.len(), 25, "{names:?}");
        let kind = |name: &str| {
            let place = file.dataset(name).expect(name);
            let text: hdf5::types::VarLenUnicode =
                place.attr("datatype").expect("datatype").read_scalar().expect("text");
            text.as_str().to_owned()
        };
        assert_eq!(
            ["xRef", "totalMass", "fileVersion", "type"].map(kind),
            ["ndarray", "float64", "int", "str"]
        );
        let info: Vec<i64> = file.dataset("infoList").expect("there").read_raw().expect("integers");
        assert_eq!(info, [nf as i64, sums.body.n_nodes() as i64, 3, 4, 7, 7 + nf as i64]);
    });
}

/// The marker of Exudyn takes the mean and the best-fit rotation of the nodes, which move like the interface
/// of the body.
#[test]
fn interfaces_of_exudyn_are_nodes_whose_mean_motion_is_that_of_the_interface() {
    let body = fixture("bracket_hex20", 5, BodyFrame::Principal);
    let (bytes, losses) = written(&body, "exudyn", &ExportOptions::default());
    assert!(losses.is_empty(), "{losses:?}");
    opened(&bytes, |file| {
        let numbers: Vec<i64> = file.dataset("nodeNumbers").expect("there").read_raw().expect("integers");
        assert_eq!(numbers, body.nodes().ids);
        let groups = file.group("interfaces").expect("there").groups().expect("groups");
        assert_eq!(groups.len(), body.interfaces().len());
        for (group, interface) in groups.iter().zip(body.interfaces()) {
            let text = |name: &str| {
                // Texts have a fixed length, which every reader accepts.
                let text: hdf5::types::FixedAscii<64> =
                    group.dataset(name).expect(name).read_scalar().expect("text");
                text.as_str().to_owned()
            };
            let floats =
                |name: &str| -> Vec<f64> { group.dataset(name).expect(name).read_raw().expect("floats") };
            let integers =
                |name: &str| -> Vec<i64> { group.dataset(name).expect(name).read_raw().expect("integers") };
            assert_eq!((text("name"), text("marker")), (interface.name.clone(), "rigid".to_owned()));
            let mesh: Vec<usize> = integers("meshNodeNumbers").iter().map(|&i| i as usize).collect();
            let weights = floats("weights");
            assert_eq!(integers("nodeNumbers"), mesh.iter().map(|&i| numbers[i]).collect::<Vec<_>>());
            close(weights.iter().sum(), 1.0, 1.0, "weights");
            let x = |i: usize| Vector3::from(body.nodes().positions[i]);
            let place: Vector3<f64> = mesh.iter().zip(&weights).map(|(&i, w)| x(i) * *w).sum();
            let reference = Vector3::from_column_slice(&floats("referencePoint"));
            let offset = Vector3::from_column_slice(&floats("offset"));
            assert_eq!(Some(<[f64; 3]>::from(reference)), interface.reference);
            assert!((place + offset - reference).norm() < 1e-12 * reference.norm());
            // The alternative approach of the marker: W theta = sum w p~ u.
            let rows = interface.rows(body.nodes(), body.modes().shape.as_ref(), None, 3).expect("rows");
            for j in 0..body.n_modes() {
                let u = |i: usize| Vector3::from_fn(|k, _| body.modes().shape[(3 * i + k, j)]);
                let mean: Vector3<f64> = mesh.iter().zip(&weights).map(|(&i, w)| u(i) * *w).sum();
                let arm = |i: usize| (x(i) - place).cross_matrix();
                let inertia: Matrix3<f64> =
                    mesh.iter().zip(&weights).map(|(&i, w)| arm(i).transpose() * arm(i) * *w).sum();
                let turned: Vector3<f64> = mesh.iter().zip(&weights).map(|(&i, w)| arm(i) * u(i) * *w).sum();
                let theta = inertia.try_inverse().expect("not on a line") * turned;
                let moved = mean + theta.cross(&offset);
                let rotation = rows.rotation.as_ref().expect("determined");
                let size = (0..mesh.len()).map(|i| u(mesh[i]).norm()).fold(0.0, f64::max);
                for k in 0..3 {
                    let turned = (theta[k] - rotation[(k, j)]) * arm(mesh[0]).norm();
                    assert!((moved[k] - rows.translation[(k, j)]).abs() < 1e-11 * size, "mode {j}, {k}");
                    assert!(turned.abs() < 1e-11 * size, "mode {j}, {k}: {turned:e}");
                }
            }
        }
    });
}

/// Returns the numbers of a record group.
fn group(text: &str, number: usize) -> Vec<f64> {
    let title = format!("** RECORD GROUP {number},");
    let lines = text.lines().skip_while(|line| !line.starts_with(&title)).skip(1);
    let body: Vec<&str> = lines.take_while(|line| !line.starts_with("**")).collect();
    body.join(" ").split_whitespace().map(|word| word.parse().expect("a number")).collect()
}

#[test]
fn record_groups_of_mbdyn_are_the_integrals_of_its_manual() {
    let sums = Sums::new();
    let nf = sums.body.n_modes();
    let (bytes, losses) = written(&sums.body, "mbdyn", &ExportOptions::default());
    assert!(losses.is_empty(), "{losses:?}");
    let text = String::from_utf8(bytes).expect("text");
    assert!(!text.contains("RECORD GROUP 11,") && text.ends_with("** END OF FILE\n"));
    let inertia = sums.sum(|i, j| sums.x(i).cross_matrix().transpose() * sums.x(j).cross_matrix());
    let size = inertia.norm();
    let [g12, g14, g15, g16, g17, g18] = [12, 14, 15, 16, 17, 18].map(|number| group(&text, number));
    assert_eq!([g14.len(), g16.len(), g17.len(), g18.len()], [3 * nf, 9 * nf, 3 * nf * nf, 9 * nf * nf]);
    let center = sums.vector(|i, _| sums.x(i)) / g12[0];
    let about_center = sums
        .sum(|i, j| (sums.x(i) - center).cross_matrix().transpose() * (sums.x(j) - center).cross_matrix());
    for a in 0..3 {
        close(g12[1 + a], center[a], 1.0, "centre of mass");
        for b in 0..3 {
            close(g12[4 + 3 * a + b], about_center[(a, b)], size, "inertia about the centre of mass");
        }
    }
    for j in 0..nf {
        let i3 = sums.vector(|_, b| sums.psi(b, j));
        let i4 = sums.vector(|a, b| sums.x(a).cross(&sums.psi(b, j)));
        let i8 = sums.sum(|a, b| sums.x(a).cross_matrix() * sums.psi(b, j).cross_matrix().transpose());
        for a in 0..3 {
            close(g14[a * nf + j], i3[a], size, "I3");
            close(g15[a * nf + j], i4[a], size, "I4");
            for b in 0..3 {
                close(g16[(a * nf + j) * 3 + b], i8[(a, b)], size, "I8");
            }
        }
        for k in 0..nf {
            let i5 = sums.vector(|a, b| sums.psi(a, j).cross(&sums.psi(b, k)));
            let i9 = sums.sum(|a, b| sums.psi(a, j).cross_matrix() * sums.psi(b, k).cross_matrix());
            for a in 0..3 {
                close(g17[(a * nf + j) * nf + k], i5[a], 1.0, "I5");
                for b in 0..3 {
                    close(g18[((a * nf + j) * nf + k) * 3 + b], i9[(a, b)], 1.0, "I9");
                }
            }
        }
    }
}

#[test]
fn datasets_of_mbsim_are_its_integrals() {
    let sums = Sums::new();
    let nf = sums.body.n_modes();
    let (bytes, losses) = written(&sums.body, "mbsim", &ExportOptions::default());
    assert!(losses.is_empty(), "{losses:?}");
    opened(&bytes, |file| {
        let (xx, shape) = array(file, "position position integral");
        assert_eq!(shape, [3, 3]);
        let (xs, shape) = array(file, "position shape function integral");
        assert_eq!(shape, [9, nf]);
        let (ss, shape) = array(file, "shape function shape function integral");
        assert_eq!(shape, [6 * nf, nf]);
        let second = sums.sum(|i, j| sums.x(i) * sums.x(j).transpose());
        for a in 0..3 {
            for b in 0..3 {
                close(xx[3 * a + b], second[(a, b)], second.norm(), "x x");
                for j in 0..nf {
                    let expected = sums.sum(|i, l| sums.x(i) * sums.psi(l, j).transpose())[(a, b)];
                    close(xs[(3 * a + b) * nf + j], expected, second.norm(), "x S");
                }
            }
        }
        let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        for (block, (a, b)) in pairs.into_iter().enumerate() {
            for j in 0..nf {
                for k in 0..nf {
                    let expected = sums.sum(|i, l| sums.psi(i, j) * sums.psi(l, k).transpose())[(a, b)];
                    close(ss[(block * nf + j) * nf + k], expected, 1.0, "S S");
                }
            }
        }
    });
}

#[test]
fn groups_that_a_body_does_without_are_zero_and_the_rest_stays_consistent() {
    let body = soft_block(4);
    for groups in combinations() {
        let reduced = with_groups(&body, groups);
        for format in ["exudyn", "mbdyn"] {
            let (bytes, losses) = written(&reduced, format, &ExportOptions::default());
            assert!(losses.is_empty(), "{format} {groups:?}: {losses:?}");
            let found = read(&bytes, format);
            let wrong: Vec<_> = found.checks.iter().filter(|c| !c.passed()).map(|c| c.name).collect();
            assert!(wrong.is_empty(), "{format} {groups:?}: {wrong:?}");
            assert_eq!(found.body.omissions.is_empty(), groups.w2, "{format} {groups:?}");
            same(
                reduced.invariants(),
                &told(&found).with_groups(groups),
                true,
                &format!("{format} {groups:?}"),
            );
            // Dropped terms are zero in the file.
            let inertia = &found.body.inertia;
            let symmetric = inertia.i8.iter().map(|i8| (i8 + i8.transpose()).norm()).fold(0.0, f64::max);
            assert_eq!(symmetric == 0.0, !groups.w1, "{format} {groups:?}");
            let i5 = inertia.i5.as_ref().expect("in every file").norm_max();
            assert_eq!(i5 == 0.0, !groups.w3, "{format} {groups:?}");
        }
        // MBSim takes W2 from the integrals that give the modal mass.
        let (bytes, losses) = written(&reduced, "mbsim", &ExportOptions::default());
        assert_eq!(
            losses.iter().any(|loss| loss.contains("the absence of W2")),
            !groups.w2,
            "{groups:?}: {losses:?}"
        );
        let held = told(&read(&bytes, "mbsim")).with_groups(groups);
        same(reduced.invariants(), &held, true, &format!("mbsim {groups:?}"));
    }
}

#[test]
fn damping_and_geometric_stiffness_are_held_where_there_is_a_place() {
    let mut parts = fixture("bracket_hex20", 5, BodyFrame::Principal).into_parts();
    parts.modes.damping_ratio = vec![0.01, 0.02, 0.03, 0.0, 0.05];
    let kinds = [
        LoadKind::Spin,
        LoadKind::AngularAcceleration,
        LoadKind::Acceleration,
        LoadKind::Force("bolt_wall".to_owned()),
        LoadKind::Moment("bolt_wall".to_owned()),
        LoadKind::Named("pretension".to_owned()),
    ];
    let body = stressed(FlexBody::new(parts).expect("a body"), &kinds, 0.1, &mut Random(3));
    let damping = Mat::from_fn(5, 5, |i, j| {
        let modes = body.modes();
        if i == j { 2.0 * modes.damping_ratio[j] * modes.eigenvalue[j].sqrt() } else { 0.0 }
    });

    let (bytes, losses) = written(&body, "mbdyn", &ExportOptions::default());
    let [lost] = &losses[..] else { panic!("{losses:?}") };
    assert!(
        lost.starts_with("mbdyn cannot hold the geometric stiffness for load `pretension`, which"),
        "{lost}"
    );
    let found = read(&bytes, "mbdyn").body;
    assert_eq!(found.modal_damping.as_ref(), Some(&damping));
    let named = |load: &UnitLoad| matches!(load.kind, LoadKind::Named(_));
    let held: Vec<_> =
        body.geometric_stiffness().iter().filter(|stiffness| !named(&stiffness.load)).cloned().collect();
    assert_eq!(found.geometric_stiffness, held);

    let (bytes, losses) = written(&body, "mbsim", &ExportOptions::default());
    assert_eq!(losses.len(), 1, "{losses:?}");
    assert!(losses[0].contains("spin xx") && losses[0].contains("moment z at `bolt_wall`"), "{losses:?}");
    assert_eq!(read(&bytes, "mbsim").body.modal_damping.as_ref(), Some(&damping));

    let (bytes, losses) = written(&body, "exudyn", &ExportOptions::default());
    assert_eq!(losses.len(), 1, "{losses:?}");
    assert!(losses[0].contains("geometric stiffness"), "{losses:?}");
    assert_eq!(read(&bytes, "exudyn").body.modal_damping, Some(damping));
    // Level 13 has damping, but neither coupling nor stress stiffening.
    let (bytes, losses) = written(&body, "mbdyn", &options("level13", Points::Usual));
    assert_eq!(losses.len(), 2, "{losses:?}");
    let text = String::from_utf8(bytes).expect("text");
    assert!(text.contains("RECORD GROUP 13,") && !text.contains("RECORD GROUP 14,"));
}

#[test]
fn what_is_lost_is_told_with_its_size() {
    let refused = |name: &str, format: &str| -> Vec<String> {
        let body = fixture(name, 5, BodyFrame::Principal);
        let format = find_format(format).expect("a format");
        // Losses that only motion causes are warnings, all others are refused.
        let (_, found) = export(&body, format, &ExportOptions::default(), true).expect("allowed");
        let lost = found.iter().filter(|d| d.code() == Code::ExportLost);
        let lost: Vec<String> = lost.map(|d| d.message().to_owned()).collect();
        match export(&body, format, &ExportOptions::default(), false) {
            Ok((_, again)) => assert_eq!(found, again),
            Err(error) => {
                assert!(error.diagnostics().iter().all(|d| d.code() == Code::ExportLoses));
                assert!(error.diagnostics().iter().all(|d| lost.contains(&d.message().to_owned())));
            }
        }
        lost
    };
    let has = |losses: &[String], word: &str| losses.iter().any(|loss| loss.contains(word));
    for format in ["exudyn", "mbdyn", "mbsim"] {
        assert!(has(&refused("plane_frame", format), "plane z = 0"), "{format}");
        let general = refused("shell_folded", format);
        assert!(
            has(&general, "the symmetric part of W3, which changes deflections by 1 %"),
            "{format}: {general:?}"
        );
        assert_eq!(has(&general, "stiffness of inertia"), format != "mbdyn", "{format}: {general:?}");
        assert_eq!(has(&general, "rotations of the nodes in the modes"), format == "exudyn", "{general:?}");
        assert_eq!(has(&general, "W2 that differs"), format == "mbsim", "{general:?}");
        let blade = refused("turbine_blade", format);
        assert_eq!(has(&blade, "geometric stiffness"), format != "mbdyn", "{format}: {blade:?}");
        assert_eq!(refused("cube_hex8", format), Vec::<String>::new());
    }
}

/// W2 of MBSim differs by the reported loss and no more.
#[test]
fn the_size_of_a_loss_is_what_is_lost() {
    let body = fixture("shell_folded", 5, BodyFrame::Principal);
    let (bytes, losses) = written(&body, "mbsim", &ExportOptions::default());
    let own = body.invariants().w2().expect("held");
    let found = told(&read(&bytes, "mbsim"));
    let other = found.w2().expect("held");
    let nf = body.n_modes();
    // Stiffness of the products of spin that the file lacks.
    let lost = (0..LoadKind::SPIN.len()).map(|component| {
        let (a, b) = LoadKind::SPIN[component];
        let entry = |i: usize, j: usize| other[(a * nf + i, b * nf + j)] - own[(a * nf + i, b * nf + j)];
        let factor = if a == b { 0.5 } else { 1.0 };
        let matrix = Mat::from_fn(nf, nf, |i, j| factor * (entry(i, j) + entry(j, i)));
        GeometricStiffness { load: UnitLoad { kind: LoadKind::Spin, component }, matrix }
    });
    let lost: Vec<_> = lost.collect();
    let shares = InertiaShares::of(&lost, body.invariants().modal_stiffness().as_ref()).expect("stiff");
    let hertz = body.units().frequency_of(0.01 / shares.spin_squared);
    let told = losses.iter().find(|loss| loss.contains("W2")).expect("told");
    assert!(told.contains(&format!("at a spin of {} Hz", significant(hertz, 3))), "{told}: {hertz}");
}

/// Settings that MBDyn needs are reported if the file has the data that they affect.
#[test]
fn mbdyn_says_what_its_input_must_have() {
    let plain = fixture("bracket_hex20", 3, BodyFrame::Principal);
    let needs = |body: &FlexBody, dialect: &str| -> Vec<String> {
        let mbdyn = find_format("mbdyn").expect("a format");
        let (_, told) = export(body, mbdyn, &options(dialect, Points::Usual), true).expect("written");
        let needs = told.iter().filter(|diagnostic| diagnostic.code() == Code::ExportNeeds);
        needs.map(|need| need.message().to_owned()).collect()
    };
    let spun = stressed(plain.clone(), &[LoadKind::Spin], 1.0, &mut Random(4));
    let second = plain.interfaces()[1].name.clone();
    let pulled = stressed(plain.clone(), &[LoadKind::Spin, LoadKind::Force(second)], 1.0, &mut Random(4));
    assert_eq!(needs(&plain, "level19"), Vec::<String>::new());
    assert_eq!(needs(&spun, "level13"), Vec::<String>::new());
    assert!(matches!(&needs(&spun, "level19")[..], [one] if one.contains("use automatic differentiation")));
    let [_, nodes] = &needs(&pulled, "level19")[..] else { panic!("two settings") };
    assert!(nodes.contains("2 or more interface nodes"), "{nodes}");
}

/// Six nodes on a cross have the position and the rotation of the interface, including nodal rotations that
/// Exudyn cannot represent otherwise.
#[test]
fn interfaces_of_exudyn_are_crosses_of_six_nodes_where_places_are_asked_for() {
    for model in ["bracket_hex20", "car_frame"] {
        let body = fixture(model, 4, BodyFrame::Principal);
        let other = body.nodes().ids[3];
        let points = Points::InterfacesAnd(vec![other]);
        let (bytes, losses) = written(&body, "exudyn", &options("", points));
        assert!(!losses.iter().any(|loss| loss.contains("rotations of the nodes")), "{losses:?}");
        let (nodal, turned) = (body.modes().shape.as_ref(), body.modes().rotation.as_ref());
        opened(&bytes, |file| {
            let count = 6 * body.interfaces().len() + 1;
            let (positions, _) = array(file, "xRef");
            let (shape, size) = array(file, "modeBasis");
            assert_eq!((positions.len(), size), (3 * count, vec![3 * count, body.n_modes()]), "{model}");
            let x = |i: usize| Vector3::from_fn(|k, _| positions[3 * i + k]);
            let u = |i: usize, j: usize| Vector3::from_fn(|k, _| shape[(3 * i + k) * body.n_modes() + j]);
            for (number, interface) in body.interfaces().iter().enumerate() {
                let nodes = 6 * number..6 * number + 6;
                let mean =
                    |of: &dyn Fn(usize) -> Vector3<f64>| nodes.clone().map(of).sum::<Vector3<f64>>() / 6.0;
                let reference = Vector3::from(interface.reference.expect("a reference point"));
                let place = mean(&x);
                assert!((place - reference).norm() < 1e-12 * (1.0 + reference.norm()), "{place}");
                let arm = |i: usize| (x(i) - place).cross_matrix();
                let inertia: Matrix3<f64> = nodes.clone().map(|i| arm(i).transpose() * arm(i)).sum();
                let inverse = inertia.try_inverse().expect("not on a line");
                let rows = interface.rows(body.nodes(), nodal, turned.map(Mat::as_ref), 3).expect("rows");
                let rotation = rows.rotation.as_ref().expect("determined");
                for j in 0..body.n_modes() {
                    let theta = inverse * nodes.clone().map(|i| arm(i) * u(i, j)).sum::<Vector3<f64>>();
                    let moved = mean(&|i| u(i, j));
                    let size = nodes.clone().map(|i| u(i, j).norm()).fold(0.0, f64::max);
                    for k in 0..3 {
                        close(moved[k], rows.translation[(k, j)], size, "translation");
                        close(theta[k], rotation[(k, j)], size / arm(nodes.start).norm(), "rotation");
                    }
                }
            }
            let last = body.nodes().ids.iter().position(|id| *id == other).expect("a node");
            assert_eq!(x(count - 1), Vector3::from(body.nodes().positions[last]));
            assert_eq!(u(count - 1, 1), Vector3::from_fn(|k, _| nodal[(3 * last + k, 1)]));
        });
    }
}

#[test]
fn places_are_those_that_were_asked_for() {
    let body = fixture("bracket_hex20", 3, BodyFrame::Principal);
    let some = vec![body.nodes().ids[4], body.nodes().ids[9]];
    for format in ["mbdyn", "mbsim"] {
        for (points, count) in [
            (Points::Usual, 2),
            (Points::Interfaces, 2),
            (Points::Nodes, body.n_nodes()),
            (Points::Some(some.clone()), 2),
            (Points::InterfacesAnd(some.clone()), 4),
        ] {
            let (bytes, losses) = written(&body, format, &options("", points.clone()));
            assert!(losses.is_empty(), "{losses:?}");
            assert_eq!(read(&bytes, format).body.frames.len(), count, "{format} {points:?}");
        }
    }
}
