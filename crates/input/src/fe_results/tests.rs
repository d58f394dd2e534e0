//! Results in every format, written by the tests.

mod answers;
mod punch;

use super::read_steps;
use answers::{NODES, Place, archive, displacement, exponential, parts, stress};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_model::AnsweredShapes;

/// Nodes with results.
const WATCHED: [i32; 2] = [7, 11];

/// Form of a file of results.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    Text,
    Single,
    Double,
}

/// Results of CalculiX as they are written.
struct Frd {
    form: Form,
    out: Vec<u8>,
}

impl Frd {
    fn flag(&self) -> u8 {
        match self.form {
            Form::Text => 1,
            Form::Single => 2,
            Form::Double => 3,
        }
    }

    fn line(&mut self, text: &str) {
        self.out.extend(format!("{text}\n").into_bytes());
    }

    fn heading(&mut self, name: &str, count: usize) {
        self.line(&format!("{name:>6}{:18}{count:12}{:37}{}", "", "", self.flag()));
    }

    fn record(&mut self, node: i32, values: &[f64]) {
        match self.form {
            Form::Text => self.out.extend(format!(" -1{node:10}").into_bytes()),
            _ => self.out.extend(node.to_le_bytes()),
        }
        for &value in values {
            match self.form {
                Form::Text => self.out.extend(format!("{:>12}", exponential(value, 5)).into_bytes()),
                Form::Single => self.out.extend((value as f32).to_le_bytes()),
                Form::Double => self.out.extend(value.to_le_bytes()),
            }
        }
        if self.form == Form::Text {
            self.out.push(b'\n');
        }
    }

    fn end(&mut self) {
        if self.form == Form::Text {
            self.line(" -3");
        }
    }

    /// Writes two elements of materials 1 and 2, which share node 7.
    fn elements(&mut self) {
        self.heading("    3C", 2);
        for (element, material, nodes) in [(1, 1, [11, 7]), (2, 2, [7, 4])] {
            if self.form == Form::Text {
                self.line(&format!(" -1{element:10}{:5}{:5}{material:5}", 11, 0));
                self.line(&format!(" -2{:10}{:10}", nodes[0], nodes[1]));
            } else {
                let numbers = [element, 11, 0, material, nodes[0], nodes[1]];
                numbers.iter().for_each(|number: &i32| self.out.extend(number.to_le_bytes()));
            }
        }
        self.end();
    }

    fn block(&mut self, step: usize, head: &str, components: &[String], values: impl Fn(i32) -> Vec<f64>) {
        let (count, flag) = (WATCHED.len(), self.flag());
        self.line(&format!(
            "  100C{:6}{:12.9}{count:12}{:20}{:2}{:5}{:10}{flag:2}",
            "L  101",
            1.0,
            "",
            0,
            step + 1,
            ""
        ));
        self.line(head);
        components.iter().for_each(|component| self.line(component));
        WATCHED.iter().for_each(|node| self.record(*node, &values(*node)));
        self.end();
    }
}

/// Returns results of CalculiX with `steps` steps.
fn frd(form: Form, steps: usize) -> Vec<u8> {
    let mut file = Frd { form, out: b"    1C\n    1UPGM               CalculiX\n".to_vec() };
    file.heading("    2C", NODES.len());
    NODES.iter().for_each(|node| file.record(*node, &[0.5, 1.5, 2.5]));
    file.end();
    file.elements();
    let mut moved: Vec<String> = (1..=3).map(|k| format!(" -5  D{k}          1    2    {k}    0")).collect();
    moved.push(" -5  ALL         1    2    0    0    1ALL".to_owned());
    let names = ["XX", "YY", "ZZ", "XY", "YZ", "ZX"].iter().zip(1..);
    let stressed: Vec<String> =
        names.map(|(name, k)| format!(" -5  S{name}         1    4{k:5}    1")).collect();
    for step in 0..steps {
        file.block(step, " -4  DISP        4    1", &moved, |node| {
            (0..3).map(|k| displacement(step, node, k)).collect()
        });
        file.block(step, " -4  STRESS      6    1", &stressed, |node| {
            (0..6).map(|k| stress(step, node, k)).collect()
        });
    }
    file.line(" 9999");
    file.out
}

/// Returns printed results with the strain energy step + 1.
fn dat(steps: usize, with_stresses: bool) -> String {
    let mut out = String::new();
    for step in 0..steps {
        let time = step as f64 + 1.0;
        if with_stresses {
            out += &format!("\n displacements (vx,vy,vz) for set W and time  {time:e}\n\n");
            for node in WATCHED {
                let [x, y, z] = [0, 1, 2].map(|k| exponential(displacement(step, node, k), 6));
                out += &format!("{node:10} {x:>13} {y:>13} {z:>13}\n");
            }
            out += &format!(
                "\n stresses (elem, integ.pnt.,sxx,syy,szz,sxy,sxz,syz) for set E and time  {time:e}\n\n"
            );
            for point in WATCHED {
                let [xx, yy, zz, xy, yz, xz] =
                    [0, 1, 2, 3, 4, 5].map(|k| exponential(stress(step, point, k), 6));
                out += &format!("{:10}{point:4} {xx:>13} {yy:>13} {zz:>13} {xy:>13} {xz:>13} {yz:>13}\n", 5);
            }
            out += &format!("\n volume (element, volume) for set E and time  {time:e}\n\n 5 1.0\n");
        }
        out += &format!("\n total internal energy for set E and time  {time:e}\n\n       {time:.6E}\n");
    }
    out
}

fn csv(steps: usize) -> String {
    let mut out = "step,node,ux,uy,uz,sxx,syy,szz,sxy,syz,sxz\n".to_owned();
    for step in 0..steps {
        for node in WATCHED {
            let u = [0, 1, 2].map(|k| displacement(step, node, k));
            let s = [0, 1, 2, 3, 4, 5].map(|k| stress(step, node, k));
            let values: Vec<String> = u.iter().chain(&s).map(|value| format!("{value:.6e}")).collect();
            out += &format!("{},{node},{}\n", step + 1, values.join(","));
        }
    }
    out
}

fn apart(shapes: &AnsweredShapes) -> f64 {
    let expected = Mat::from_fn(12, 3, |row, step| stress(step, WATCHED[row / 6], row % 6));
    (&shapes.answers - &expected).norm_max() / expected.norm_max()
}

#[test]
fn every_format_gives_the_same_stresses() {
    let place = Place::new(3);
    place.put("text.frd", &frd(Form::Text, 3));
    place.put("single.frd", &frd(Form::Single, 3));
    place.put("double.frd", &frd(Form::Double, 3));
    place.put("points.dat", dat(3, true).as_bytes());
    place.put("ask.dat", dat(3, false).as_bytes());
    place.put("table.csv", csv(3).as_bytes());
    place.put("volume.pch", punch::of_volume(3, &WATCHED).as_bytes());
    let files: [(&str, Option<&str>, u8, f64); 6] = [
        ("text.frd", None, 6, 1e-5),
        ("single.frd", None, 7, 1e-6),
        ("double.frd", Some("ask.dat"), 15, 1e-15),
        ("points.dat", None, 7, 1e-6),
        ("table.csv", None, 6, 1e-6),
        ("volume.pch", None, 7, 1e-6),
    ];
    for (name, energies, digits, limit) in files {
        let (operator, warnings) = place.read(name, energies).expect(name);
        let (shapes, labels) = parts(operator);
        assert!(apart(&shapes) <= limit, "{name}: {}", apart(&shapes));
        assert_eq!((shapes.answer_digits, shapes.dofs.len()), (digits, 12), "{name}");
        let is_dat = name == "points.dat";
        let names: Vec<&str> = labels[5..7].iter().map(|row| row.name.as_str()).collect();
        assert_eq!(names, if is_dat { ["e5 p7 xz", "e5 p11 xx"] } else { ["n7 xz", "n11 xx"] });
        assert_eq!((labels[0].unit.as_str(), labels[0].node.is_some()), ("MPa", !is_dat));
        let expected = (is_dat || energies.is_some()).then(|| vec![1.0, 2.0, 3.0]);
        assert_eq!(shapes.energies, expected, "{name}");
        // Only the elements of a .frd show their materials.
        let averaged: Vec<Code> = warnings.iter().map(Diagnostic::code).collect();
        let is_frd = name.ends_with("frd");
        assert_eq!(averaged, if is_frd { vec![Code::RecoveryAveraged] } else { Vec::new() }, "{name}");
        assert!(
            !is_frd
                || warnings[0]
                    .message()
                    .ends_with("of 1 nodes are means over elements of several materials: node 7"),
            "{}",
            warnings[0].message()
        );
    }
}

#[cfg(feature = "hdf5")]
#[test]
fn arrays_of_hdf5_are_read_with_their_energies() {
    let place = Place::new(2);
    let file = hdf5_metno::File::create(place.0.path().join("answers.h5")).expect("a file");
    let put = |name: &str, shape: (usize, usize), value: &dyn Fn(usize, usize) -> f64| {
        let values = ndarray(shape, value);
        file.new_dataset::<f64>()
            .shape(shape)
            .create(name)
            .and_then(|set| set.write_raw(&values))
            .expect(name);
    };
    put("displacements", (2, 6), &|step, at| displacement(step, WATCHED[at / 3], at % 3));
    put("stresses", (2, 12), &|step, at| stress(step, WATCHED[at / 6], at % 6));
    let nodes = WATCHED.map(i64::from);
    file.new_dataset::<i64>().shape(2).create("nodes").and_then(|set| set.write_raw(&nodes)).expect("nodes");
    file.new_dataset::<f64>()
        .shape(2)
        .create("strain_energy")
        .and_then(|set| set.write_raw(&[4.0, 5.0]))
        .expect("energies");
    file.close().expect("closed");
    let (shapes, _) = parts(place.read("answers.h5", None).expect("answers").0);
    assert_eq!(shapes.answers[(11, 1)], stress(1, 11, 5));
    assert_eq!(shapes.energies, Some(vec![4.0, 5.0]));
}

#[cfg(feature = "hdf5")]
fn ndarray(shape: (usize, usize), value: &dyn Fn(usize, usize) -> f64) -> Vec<f64> {
    (0..shape.0 * shape.1).map(|k| value(k / shape.1, k % shape.1)).collect()
}

#[test]
fn results_of_other_shapes_are_refused() {
    let place = Place::new(3);
    place.put("fewer.frd", &frd(Form::Double, 2));
    assert_eq!(place.refused("fewer.frd", None).0, Code::RecoveryShapes);
    // A displacement of the second step differs by its tenth digit.
    let mut other = frd(Form::Double, 3);
    let value = displacement(1, 11, 2);
    let bytes = value.to_le_bytes();
    let at = other.windows(8).position(|window| window == bytes).expect("a displacement");
    other[at..at + 8].copy_from_slice(&(value * 1.00001).to_le_bytes());
    place.put("other.frd", &other);
    let (code, message) = place.refused("other.frd", None);
    assert_eq!(code, Code::RecoveryShapes);
    assert!(message.contains("step 2") && message.contains("at node 11"), "{message}");
    place.put("double.frd", &frd(Form::Double, 3));
    place.put("ask.dat", dat(2, false).as_bytes());
    assert_eq!(place.refused("double.frd", Some("ask.dat")).0, Code::RecoveryShapes);
    // Without displacements nothing shows that the results belong to the shapes.
    let printed = dat(3, true).replace("displacements", "velocities");
    place.put("still.dat", printed.as_bytes());
    assert_eq!(place.refused("still.dat", None).0, Code::RecoveryShapes);
    place.put("ask.npz", &archive(3)[..400]);
    assert_eq!(place.refused("double.frd", None).0, Code::FileCompressionBroken);
}

/// Archives are read by the code for matrices of SciPy, whose help is about matrices.
#[test]
fn the_help_about_damaged_archives_is_about_shapes() {
    let place = Place::new(3);
    place.put("answers.csv", csv(3).as_bytes());
    let whole = archive(3);
    for end in [whole.len() - 60, 400, 200] {
        let path = place.put("ask.npz", &whole[..end]);
        let channels = read_steps(&path).expect_err("cut off");
        let answers = place.read("answers.csv", None).expect_err("cut off");
        for found in channels.diagnostics().iter().chain(&answers) {
            assert_eq!(found.code(), Code::FileCompressionBroken);
            assert!(
                found.help().contains("flexbody shapes") && !found.help().contains("scipy"),
                "{}",
                found.help()
            );
        }
    }
}

#[test]
fn results_of_all_nodes_are_their_own_shapes() {
    let place = Place::new(3);
    // Blocks with one number, as those of modes and static steps may have, are told apart by their quantities.
    let same = String::from_utf8(frd(Form::Text, 3))
        .expect("text")
        .replace("    2           1\n", "    1           1\n");
    std::fs::copy(place.put("own.frd", same.as_bytes()), place.0.path().join("ask.npz")).expect("copied");
    let (shapes, _) = parts(place.read("own.frd", None).expect("shapes").0);
    assert_eq!((shapes.dofs.len(), shapes.digits, shapes.displacements.ncols()), (6, 6, 3));
    assert!((shapes.displacements[(4, 1)] - displacement(1, 11, 1)).abs() < 1e-8);
    assert!(apart(&shapes) < 1e-5);
}

#[test]
fn damaged_results_are_refused() {
    let place = Place::new(2);
    for form in [Form::Text, Form::Single, Form::Double] {
        let whole = frd(form, 2);
        for end in (0..whole.len() - 6).step_by(11) {
            // The beginning decides about the format.
            let path = if end < 7 { "short.frd" } else { "cut.frd" };
            place.put(path, &whole[..end]);
            if end > 0 {
                place.read(path, None).expect_err("cut off");
            }
        }
    }
    let twice = String::from_utf8(frd(Form::Text, 2)).expect("text");
    let (before, after) = twice.rsplit_once(" -1         7").expect("a node");
    let elsewhere = format!("{before} -1         8{after}");
    for (name, text, part) in [
        ("letters.frd", twice.replacen("E+0", "X+0", 40), "expected"),
        ("places.frd", elsewhere, "other places"),
        ("no_stress.frd", twice.replace("STRESS", "STRAIN"), "no stresses"),
        ("steps.csv", csv(2).replace("\n2,", "\n3,"), "come after"),
        ("table.csv", csv(2).replace("e-", "x-"), "has `"),
        ("local.dat", dat(2, true).replace("E+01\n", "E+01 local\n"), "six stresses"),
    ] {
        place.put(name, text.as_bytes());
        let message = place.refused(name, None).1;
        assert!(message.contains(part), "{name}: {message}");
    }
}

#[test]
fn changed_bytes_end_without_a_panic() {
    let place = Place::new(2);
    for form in [Form::Text, Form::Double] {
        let whole = frd(form, 2);
        for at in (0..whole.len()).step_by(23) {
            for value in [b' ', b'-', b'9', 0xff] {
                let mut changed = whole.clone();
                changed[at] = value;
                place.put("changed.frd", &changed);
                let _ = place.read("changed.frd", None);
            }
        }
    }
}
