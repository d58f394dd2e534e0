//! Punch files of Nastran, written by the tests.

use super::answers::{NODES, Place, archive, displacement, exponential, parts, stress};
use flexbody_base::diagnostic::Code;

/// Element types of a tetrahedron and of a four-sided shell.
const CTETRA: &str = "          39   (CTETRA)";
const CQUAD4: &str = "          33   (CQUAD4)";

/// Lines of a punch file with their sequence numbers.
#[derive(Default)]
pub(super) struct Punch {
    out: String,
    lines: usize,
}

impl Punch {
    fn line(&mut self, text: &str) {
        self.lines += 1;
        self.out += &format!("{text:<72}{:8}\n", self.lines);
    }

    /// Writes a record: its head of 18 columns, and three fields in each line.
    fn record(&mut self, head: &str, fields: &[String]) {
        for (at, three) in fields.chunks(3).enumerate() {
            let head = if at == 0 { head } else { "-CONT-" };
            let fields: String = three.iter().map(|field| format!("{field:>18}")).collect();
            self.line(&format!("{head:<18}{fields}"));
        }
    }

    fn heading(&mut self, what: &str, subcase: usize) {
        self.line("$TITLE   = SHAPES");
        self.line("$SUBTITLE=");
        self.line("$LABEL   =");
        self.line(what);
        self.line("$REAL OUTPUT");
        self.line(&format!("$SUBCASE ID ={subcase:12}"));
        self.line("$LOAD FACTOR =   1.0000000E+00");
    }

    fn displacements(&mut self, steps: usize, nodes: &[i32]) {
        for step in 0..steps {
            self.heading("$DISPLACEMENTS", 10 * step + 1);
            for &node in nodes {
                let moved = (0..6).map(|k| if k < 3 { displacement(step, node, k) } else { 0.0 });
                self.record(&format!("{node:10}       G"), &moved.map(number).collect::<Vec<_>>());
            }
        }
    }

    /// Writes an element whose corner stresses are those of its nodes and an `addition`.
    fn tetrahedron(&mut self, element: i64, step: usize, addition: f64) {
        let mut fields = vec!["0".to_owned(), "GRID".to_owned(), "4".to_owned()];
        for node in [0].into_iter().chain(NODES) {
            let [xx, yy, zz, xy, yz, xz] = [0, 1, 2, 3, 4, 5].map(|k| stress(step, node, k) + addition);
            let filler = [7.0, 7.0, 7.0, 7.0, 7.0];
            fields.push(node.to_string());
            fields.extend([xx, xy].into_iter().chain([filler[0]; 6]).map(number));
            fields.extend([yy, yz].into_iter().chain([filler[1]; 4]).map(number));
            fields.extend([zz, xz].into_iter().chain([filler[2]; 4]).map(number));
        }
        self.record(&format!("{element:10}"), &fields);
    }
}

fn number(value: f64) -> String {
    exponential(value, 6)
}

/// Returns a punch file with stresses of two tetrahedra, both between all four nodes, whose mean is that of the nodes.
pub(super) fn of_elements(steps: usize) -> String {
    let mut punch = Punch::default();
    punch.displacements(steps, &NODES);
    for step in 0..steps {
        for (element, addition) in [(5, 3.0), (8, -3.0)] {
            punch.heading("$ELEMENT STRESSES", 10 * step + 1);
            punch.line(&format!("$ELEMENT TYPE ={CTETRA}"));
            punch.tetrahedron(element, step, addition);
        }
        // Rods have no six stresses.
        punch.heading("$ELEMENT STRESSES", 10 * step + 1);
        punch.line("$ELEMENT TYPE =           1   (CROD)");
        punch.record("        77", &["1.0", "2.0", "3.0", "4.0"].map(str::to_owned));
    }
    punch.out
}

/// Returns a punch file with stresses of a volume at some grid points.
pub(super) fn of_volume(steps: usize, nodes: &[i32]) -> String {
    let mut punch = Punch::default();
    punch.displacements(steps, nodes);
    for step in 0..steps {
        punch.heading("$GRID POINT STRESSES", 10 * step + 1);
        for &node in nodes {
            let values = (0..8).map(|k| if k < 6 { stress(step, node, k) } else { 1.0 });
            punch.record(&format!("{node:10}"), &values.map(number).collect::<Vec<_>>());
        }
    }
    punch.out
}

#[test]
fn corners_of_elements_are_averaged_at_their_nodes() {
    let place = Place::new(3);
    place.put("elements.pch", of_elements(3).as_bytes());
    let (operator, notes) = place.read("elements.pch", None).expect("answers");
    let (shapes, labels) = parts(operator);
    let mut nodes = NODES;
    nodes.sort_unstable();
    let names: Vec<&str> = labels.iter().step_by(6).map(|row| row.name.as_str()).collect();
    assert_eq!(names, ["n4 xx", "n7 xx", "n11 xx", "n1000000 xx"]);
    for step in 0..3 {
        for (row, value) in shapes.answers.col(step).iter().enumerate() {
            // Two values of up to 103 with seven digits.
            assert!(
                (value - stress(step, nodes[row / 6], row % 6)).abs() <= 5e-5,
                "row {row} of step {step}"
            );
        }
    }
    assert_eq!(shapes.answer_digits, 7);
    let [note] = notes.as_slice() else { panic!("one note: {notes:?}") };
    assert_eq!(note.code(), Code::RecoveryCorners);
    assert!(
        note.message().contains("of 4 nodes") && note.message().contains("by up to 2.92 %"),
        "{}",
        note.message()
    );
}

#[test]
fn modes_of_one_subcase_are_steps() {
    let modes = of_elements(2)
        .replace("$DISPLACEMENTS", "$EIGENVECTOR  ")
        .replace(
            &format!("$SUBCASE ID ={:12}", 1),
            "$EIGENVALUE =  1.0000000E+02  MODE =     1\n$SUBCASE ID = 1",
        )
        .replace(
            &format!("$SUBCASE ID ={:12}", 11),
            "$EIGENVALUE =  4.0000000E+02  MODE =     2\n$SUBCASE ID = 1",
        );
    let place = Place::new(2);
    place.put("modes.pch", modes.as_bytes());
    let (shapes, _) = parts(place.read("modes.pch", None).expect("answers").0);
    assert!((shapes.answers[(0, 1)] - stress(1, 4, 0)).abs() <= 5e-5);
}

#[test]
fn punch_files_of_other_requests_are_refused_by_name() {
    let place = Place::new(2);
    let (elements, volume) = (of_elements(2), of_volume(2, &NODES));
    let (displacements, stresses) = elements.split_at(elements.find("$ELEMENT").expect("stresses"));
    let head = |element: i64| format!("{element:10}{:8}{:>18}", "", "0");
    let repeated = format!("{elements}$TITLE   =\n{stresses}");
    for (name, text, part) in [
        ("shells.pch", elements.replacen(CTETRA, CQUAD4, 1), "stresses of CQUAD4 elements (type 33)"),
        ("other.pch", elements.replace("          39", "         999"), "of type 999"),
        ("centre.pch", centre_alone(), "element 5 has stresses at its centre alone"),
        (
            "hexa.pch",
            elements.replace("          39", "          67"),
            "expected 189 for its centre and 8 corners",
        ),
        (
            "axes.pch",
            elements.replacen(
                "                 0              GRID",
                "                 3              GRID",
                1,
            ),
            "along the coordinate system `3`",
        ),
        ("points.pch", elements.replace("$SUBCASE ID =", "$POINT ID =  "), "SORT2"),
        ("complex.pch", elements.replace("$REAL OUTPUT", "$REAL-IMAGINARY OUTPUT"), "complex"),
        ("frequency.pch", elements.replace("$REAL OUTPUT", "$FREQUENCY = 1.0"), "frequency or an instant"),
        ("surface.pch", volume.replace("$REAL OUTPUT", "$SURFACE ID = 3"), "axes of a surface"),
        ("still.pch", stresses.to_owned(), "subcase 1 has stresses and no displacements"),
        ("unstressed.pch", displacements.to_owned(), "subcase 1 has no stresses"),
        ("twice.pch", repeated, "stresses of element 5 twice"),
        ("both.pch", format!("{elements}{volume}"), "stresses of elements and of grid points"),
        ("fewer.pch", elements.replacen(&head(8), &head(9), 1), "other elements than those before"),
        ("type.pch", elements.replace("$ELEMENT TYPE =", "$LABEL = "), "before the type"),
        ("subcase.pch", elements.replace("$SUBCASE ID =", "$LABEL = "), "before the number of their subcase"),
        (
            "letters.pch",
            elements.replacen("E+0", "X+0", 400),
            "expected a grid point with three displacements",
        ),
        ("nine.pch", volume.replacen("1.000000E+00", "            ", 1), "with 7"),
        ("nothing.pch", "$TITLE   =\n".to_owned(), "no stresses are in the file"),
    ] {
        place.put(name, text.as_bytes());
        let (code, message) = place.refused(name, None);
        assert_eq!(code, Code::FeResultsSyntax, "{name}");
        assert!(message.contains(part), "{name}: {message}");
    }
}

/// Returns a punch file of a tetrahedron without corners.
fn centre_alone() -> String {
    let mut punch = Punch::default();
    punch.displacements(2, &NODES);
    punch.heading("$ELEMENT STRESSES", 1);
    punch.line(&format!("$ELEMENT TYPE ={CTETRA}"));
    let mut fields = vec!["0".to_owned(), "GRID".to_owned(), "0".to_owned()];
    fields.extend((0..21).map(|k| if k == 0 { "0".to_owned() } else { number(1.0) }));
    punch.record("         5", &fields);
    punch.out
}

/// A file that ends within a line, between lines or between blocks is refused unless only blanks are missing.
#[test]
fn cut_punch_files_are_refused() {
    let place = Place::new(2);
    let whole = of_elements(2);
    let end = whole.trim_end().rfind("$TITLE").expect("rods");
    for cut in (8..end - 90).step_by(97) {
        place.put("cut.pch", &whole.as_bytes()[..cut]);
        place.read("cut.pch", None).expect_err("cut off");
    }
}

#[test]
fn changed_bytes_of_punch_files_end_without_a_panic() {
    let place = Place::new(2);
    for whole in [of_elements(2), of_volume(2, &NODES)] {
        for at in (0..whole.len()).step_by(157) {
            for value in [b' ', b'-', b'9', b'$', b'\n', 0xff] {
                let mut changed = whole.clone().into_bytes();
                changed[at] = value;
                place.put("changed.pch", &changed);
                let _ = place.read("changed.pch", None);
            }
        }
    }
}

/// The archive of shapes beside the files has the same displacements with more digits.
#[test]
fn displacements_of_another_run_are_refused() {
    let place = Place::new(2);
    place.put("elements.pch", of_elements(2).as_bytes());
    place.put("ask.npz", &archive(3));
    assert_eq!(place.refused("elements.pch", None).0, Code::RecoveryShapes);
}
