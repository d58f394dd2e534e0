//! Descriptions of small decks.

use super::*;
use flexbody_model::DofLabel;
use nalgebra::{Matrix3, Vector3};
use std::fs;

/// Corners of two cubes in a row, from node 1 on.
const NODES: &str = "*NODE\n1,0,0,0\n2,1,0,0\n3,2,0,0\n4,0,1,0\n5,1,1,0\n6,2,1,0\n\
    7,0,0,1\n8,1,0,1\n9,2,0,1\n10,0,1,1\n11,1,1,1\n12,2,1,1\n";
const BRICKS: &str = "*ELEMENT, TYPE=C3D8, ELSET=ALL\n1, 1,2,5,4,7,8,11,10\n2, 2,3,6,5,8,9,12,11\n";
const STEEL: &str = "*MATERIAL, NAME=Steel\n*DENSITY\n1.\n*ELASTIC\n210000., .3, 20.\n";
const SECTION: &str = "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL\n";

/// Describes a deck whose nodes all have rows, without those for which `has_row` is false, and with others.
fn describe(
    text: &str,
    has_row: impl Fn(i64, u8) -> bool,
    more: &[(i64, u8)],
) -> Diagnosed<DescribedElements> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("job.inp");
    fs::write(&path, text).expect("written");
    let deck = Deck::read(&path)?;
    let mesh = DeckMesh::read(&deck, true)?;
    let nodes = mesh.nodes.keys().flat_map(|node| (1..=3).map(move |direction| (*node, direction)));
    let rows = nodes.filter(|(node, direction)| has_row(*node, *direction)).chain(more.iter().copied());
    let labels: Vec<DofLabel> = rows.map(|(node, direction)| DofLabel { node, direction }).collect();
    let rotations = HashMap::from([(901, 900)]);
    let rows = Rows::new(Program::Calculix, &labels, &rotations);
    described(&deck, &mesh, &rows, &Requested::default())
}

fn all_rows(text: &str) -> DescribedElements {
    describe(text, |_, _| true, &[]).expect("described")
}

fn reasons(described: &DescribedElements) -> Vec<&str> {
    described.not_described.iter().map(|one| one.what.as_str()).collect()
}

#[test]
fn elements_take_the_last_section_that_names_them() {
    let soft = "*MATERIAL, NAME=SOFT\n*ELASTIC\n1000., .2\n*ELSET, ELSET=RIGHT\n2\n";
    let of_right = "*SOLID SECTION, ELSET=RIGHT, MATERIAL=SOFT\n";
    let found = all_rows(&format!("{NODES}{BRICKS}{STEEL}{soft}{SECTION}{of_right}"));
    let materials: Vec<(&str, &[i64])> =
        found.groups.iter().map(|group| (group.section.material.as_str(), group.ids.as_slice())).collect();
    assert_eq!(materials, [("STEEL", &[1][..]), ("SOFT", &[2])]);
    assert_eq!(found.groups[1].nodes, [2, 3, 6, 5, 8, 9, 12, 11]);
    assert_eq!(found.positions.len(), 12);
    assert_eq!(found.groups[0].section.elasticity, Elasticity::isotropic(210e3, 0.3).expect("steel"));
    let found = all_rows(&format!("{NODES}{BRICKS}{STEEL}{soft}{of_right}{SECTION}"));
    assert_eq!(found.groups.len(), 1, "the section of all elements comes last");
    assert_eq!(found.groups[0].ids, [1, 2]);
    assert_eq!(reasons(&found), Vec::<&str>::new());
}

/// CalculiX 2.20 computes the stiffness of C3D20 with these constants to 2e-11.
#[test]
fn constants_of_all_types_are_read_in_the_order_of_the_deck() {
    let of = |elastic: &str| {
        let found = all_rows(&format!("{NODES}{BRICKS}*MATERIAL, NAME=STEEL\n*ELASTIC{elastic}{SECTION}"));
        found.groups[0].section.elasticity.0
    };
    let orthotropic = of(", TYPE=ORTHO\n500.,157.,400.,121.,110.,300.,126.,111.,\n90.\n");
    assert_eq!(orthotropic.diagonal().as_slice(), [500.0, 400.0, 300.0, 126.0, 90.0, 111.0]);
    assert_eq!((orthotropic[(0, 1)], orthotropic[(0, 2)], orthotropic[(1, 2)]), (157.0, 121.0, 110.0));
    let constants = of(", TYPE = Engineering Constants\n1e5,1e4,5e3,.3,.25,.4,7e3,6e3\n2e3\n");
    let compliance = constants.try_inverse().expect("regular");
    let near =
        |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-12, "{value} {expected}");
    near(compliance[(1, 0)], -0.3 / 1e5);
    near(compliance[(2, 0)], -0.25 / 1e5);
    near(compliance[(2, 1)], -0.4 / 1e4);
    assert_eq!([3, 4, 5].map(|k| constants[(k, k)]), [7e3, 2e3, 6e3], "xy, yz, xz");
    // Diagonal entries are 1000 and more, the others their place in the deck.
    let values: Vec<String> = (1..=21)
        .map(|place| match [1, 3, 6, 10, 15, 21].iter().position(|at| *at == place) {
            Some(k) => format!("{}", 1000 * (k + 1)),
            None => place.to_string(),
        })
        .collect();
    let lines: Vec<String> = values.chunks(8).map(|line| line.join(", ")).collect();
    let all = of(&format!(", TYPE=ANISO\n{}\n", lines.join("\n")));
    assert_eq!(all.diagonal().as_slice(), [1000.0, 2000.0, 3000.0, 4000.0, 6000.0, 5000.0]);
    // D1113 is the eleventh, D1123 the sixteenth, D1323 the twentieth.
    assert_eq!((all[(0, 5)], all[(0, 4)], all[(5, 4)], all[(3, 5)]), (11.0, 16.0, 20.0, 14.0));
}

#[test]
fn materials_with_another_stiffness_are_not_described() {
    for (material, reason) in [
        ("*ELASTIC\n210000., .3, 0.\n200000., .3, 100.\n", "its elasticity depends on temperature"),
        ("*HYPERELASTIC, NEO HOOKE\n1., .1\n", "*HYPERELASTIC"),
        ("*USER MATERIAL, CONSTANTS=2\n1., 2.\n", "*USER MATERIAL"),
        ("*ELASTIC, TYPE=LAMINA\n1., 2., .3, 1., 1., 1.\n", "*ELASTIC, TYPE=LAMINA"),
        ("*ELASTIC\n210000., .5\n", "its elasticity is not positive definite"),
        ("*DENSITY\n1.\n", "no *ELASTIC"),
    ] {
        let found = all_rows(&format!("{NODES}{BRICKS}*MATERIAL, NAME=STEEL\n{material}{SECTION}"));
        assert_eq!(found.groups, []);
        assert_eq!(reasons(&found), [format!("2 elements of type C3D8: material `STEEL`: {reason}")]);
        assert_eq!(found.not_described[0].nodes, (1..=12).collect::<Vec<i64>>());
    }
    let plastic = "*MATERIAL, NAME=STEEL\n*ELASTIC\n1., .3\n*PLASTIC\n1., 0.\n2., .1\n*EXPANSION\n1e-5\n";
    assert_eq!(all_rows(&format!("{NODES}{BRICKS}{plastic}{SECTION}")).groups.len(), 1);
}

#[test]
fn orientations_are_axes_of_anisotropic_materials() {
    let wood = "*MATERIAL, NAME=STEEL\n*ELASTIC, TYPE=ORTHO\n5.,1.,4.,1.,1.,3.,1.,1.,\n1.\n";
    let section = "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL, ORIENTATION=O\n";
    let of = |orientation: &str| {
        let found = all_rows(&format!("{NODES}{BRICKS}{wood}*ORIENTATION, NAME=O{orientation}\n{section}"));
        found.groups.first().map(|group| group.section.axes)
    };
    let Some(Axes::Fixed(axes)) = of("\n0,2,0, 0,1,3") else { panic!("fixed axes") };
    assert_eq!(axes, Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0), "x along y, y along z");
    let Some(Axes::Fixed(turned)) = of("\n0,2,0, 0,1,3\n3, 90.") else { panic!("fixed axes") };
    let expected = Matrix3::new(0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0);
    assert!((turned - expected).amax() < 1e-15, "90 degrees about x: {turned}");
    let cylinder = Axes::Cylinder { from: Vector3::new(1.0, 0.0, 0.0), to: Vector3::new(1.0, 0.0, 2.0) };
    assert_eq!(of(", SYSTEM=CYLINDRICAL\n1,0,0, 1,0,2"), Some(cylinder));
    assert_eq!(of(", SYSTEM=CYLINDRICAL\n1,0,0, 1,0,2\n3, 20."), None);
    assert_eq!(of("\nDIST\n3, 0."), None);
    // The axes of an isotropic material make no difference.
    let found = all_rows(&format!("{NODES}{BRICKS}{STEEL}*ORIENTATION, NAME=O\nDIST\n{section}"));
    assert_eq!(found.groups[0].section.axes, Axes::Model);
}

#[test]
fn parts_turn_their_axes_with_their_instances() {
    let wood = "*MATERIAL, NAME=WOOD\n*ELASTIC, TYPE=ORTHO\n5.,1.,4.,1.,1.,3.,1.,1.,\n1.\n";
    let text = format!(
        "*PART, NAME=P\n{NODES}{BRICKS}*ELSET, ELSET=Left, GENERATE\n1, 1, 1\n*ELSET, ELSET=Right\n2\n\
        *ORIENTATION, NAME=O\n1,0,0, 0,1,0\n*ORIENTATION, NAME=C, SYSTEM=CYLINDRICAL\n0,0,0, 0,0,1\n\
        *SOLID SECTION, ELSET=Left, MATERIAL=WOOD, ORIENTATION=O\n\
        *SOLID SECTION, ELSET=Right, MATERIAL=WOOD, ORIENTATION=C\n*END PART\n\
        *ASSEMBLY, NAME=A\n*INSTANCE, NAME=I1, PART=P\n*END INSTANCE\n\
        *INSTANCE, NAME=I2, PART=P\n10,0,0\n10,0,0, 10,0,1, 90.\n*END INSTANCE\n*END ASSEMBLY\n{wood}"
    );
    let found = all_rows(&text);
    let [fixed, cylinder, turned, moved] = found.groups.as_slice() else { panic!("{:?}", found.groups) };
    assert_eq!((fixed.ids.as_slice(), turned.ids.as_slice()), (&[1][..], &[101][..]));
    assert_eq!(fixed.section.axes, Axes::Fixed(Matrix3::identity()));
    let Axes::Fixed(axes) = turned.section.axes else { panic!("fixed axes") };
    assert!((axes - Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)).amax() < 1e-15);
    let origin = |group: &ElementGroup| match group.section.axes {
        Axes::Cylinder { from, to } => (from, to),
        other => panic!("{other:?}"),
    };
    assert_eq!(origin(cylinder), (Vector3::zeros(), Vector3::z()));
    assert_eq!(origin(moved), (Vector3::new(10.0, 0.0, 0.0), Vector3::new(10.0, 0.0, 1.0)));
    assert_eq!(moved.nodes[..2], [102, 103]);
    assert_eq!(found.positions.len(), 24);
}

/// CalculiX 2.20 adds these entries to the stiffness.
#[test]
fn springs_are_stiffnesses_of_their_elongations() {
    let springs = "*ELEMENT, TYPE=SPRING1, ELSET=S1\n21, 5\n*SPRING, ELSET=S1\n2\n50.\n\
        *ELEMENT, TYPE=SPRING2, ELSET=S2\n22, 1, 12\n*SPRING, ELSET=S2\n1, 3\n70.\n\
        *ELEMENT, TYPE=SPRINGA, ELSET=SA\n23, 1, 5\n*SPRING, ELSET=SA\n\n100.\n\
        *ELEMENT, TYPE=SPRINGA, ELSET=SN\n24, 1, 6\n*SPRING, ELSET=SN, NONLINEAR\n\n0.,0.\n1.,1.\n\
        *ELEMENT, TYPE=SPRING2, ELSET=ST\n25, 900, 901\n*SPRING, ELSET=ST\n1, 2\n10.\n";
    let found = all_rows(&format!("{NODES}900,0,0,0\n901,0,0,0\n{BRICKS}{STEEL}{SECTION}{springs}"));
    let [to_ground, between, along, of_rotation] = found.direct.as_slice() else { panic!("four springs") };
    assert_eq!((to_ground.rows.as_slice(), to_ground.matrix.as_slice()), (&[(5, 2)][..], &[50.0][..]));
    assert_eq!(between.rows, [(1, 1), (12, 3)]);
    assert_eq!(between.matrix, [70.0, -70.0, -70.0, 70.0]);
    assert_eq!(of_rotation.rows, [(900, 1), (900, 5)]);
    let expected = [50.0, 50.0, 0.0, -50.0, -50.0, 0.0];
    assert!(along.matrix[..6].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{:?}", along.matrix);
    assert_eq!(along.rows[3..], [(5, 1), (5, 2), (5, 3)]);
    assert_eq!(reasons(&found), ["1 element of type SPRINGA: *SPRING with NONLINEAR"]);
    assert_eq!(found.not_described[0].nodes, [1, 6]);
}

#[test]
fn elements_that_are_not_described_are_named_with_their_nodes() {
    let others = "*ELEMENT, TYPE=S4R, ELSET=SHELL\n31, 1,2,5,4\n32, 2,3,6,5\n*ELEMENT, TYPE=B31, ELSET=BEAM\n33, 1,2\n\
        *ELEMENT, TYPE=MASS, ELSET=MASS\n34, 7\n*ELEMENT, TYPE=DASHPOTA, ELSET=D\n35, 7, 8\n\
        *ELEMENT, TYPE=C3D4, ELSET=LOOSE\n36, 1,2,4,7\n";
    let found = all_rows(&format!("{NODES}{BRICKS}{STEEL}{SECTION}{others}"));
    assert_eq!(
        reasons(&found),
        [
            "1 element of type B31: beams are not described",
            "1 element of type C3D4: no *SOLID SECTION",
            "2 elements of type S4R: shells are not described",
        ]
    );
    assert_eq!(found.not_described[2].nodes, [1, 2, 3, 4, 5, 6]);
    assert_eq!(found.groups[0].ids, [1, 2]);
}

/// Rows and equations as CalculiX 2.20 eliminates them: K of the job is T' K T of the deck without constraints, to
/// 1e-14.
#[test]
fn equations_are_those_of_degrees_of_freedom_without_rows() {
    let text = format!(
        "{NODES}900,-1,.5,.5\n901,0,0,0\n{BRICKS}{STEEL}{SECTION}*EQUATION\n3\n1,1,2., 5,2,-1., 9,3,.5\n\
        *NSET, NSET=F\n4, 7, 900\n*RIGID BODY, NSET=F, REF NODE=900, ROT NODE=901\n*BOUNDARY\n3, 2, 3\n12, 11, 11\n"
    );
    let has_row = |node, direction| match node {
        1 => direction != 1,
        3 => direction == 1,
        4 | 7 | 901 => false,
        _ => true,
    };
    let found = describe(&text, has_row, &[(900, 4), (900, 5), (900, 6)]).expect("described");
    let equation = |dependent| {
        let mut all = found.equations.iter().filter(|equation| equation.dependent == dependent);
        let first = all.next().expect("an equation");
        assert_eq!(all.next(), None);
        first.terms.as_slice()
    };
    assert_eq!(equation((1, 1)), [((5, 2), 0.5), ((9, 3), -0.25)]);
    assert_eq!((equation((3, 2)), equation((3, 3))), (&[][..], &[][..]));
    // From the reference node to node 4: (1, 0.5, -0.5).
    assert_eq!(equation((4, 1)), [((900, 1), 1.0), ((900, 5), -0.5), ((900, 6), -0.5)]);
    assert_eq!(equation((4, 2)), [((900, 2), 1.0), ((900, 4), 0.5), ((900, 6), 1.0)]);
    assert_eq!(equation((4, 3)), [((900, 3), 1.0), ((900, 4), 0.5), ((900, 5), -1.0)]);
    assert_eq!(found.equations.len(), 9);
    assert_eq!(reasons(&found), Vec::<&str>::new());
}

#[test]
fn couplings_are_equations_of_their_directions() {
    let coupling = "*SURFACE, NAME=S, TYPE=NODE\n1\n4\n*COUPLING, REF NODE=900, SURFACE=S, CONSTRAINT NAME=C\n*KINEMATIC\n1\n3\n";
    let mean = "*ELEMENT, TYPE=DCOUP3D, ELSET=D\n50, 800\n*DISTRIBUTING COUPLING, ELSET=D\n6, 1.\n3, 2.\n";
    let text = format!("{NODES}900,-1,.5,.5\n800,3,0,0\n{BRICKS}{STEEL}{SECTION}{coupling}{mean}");
    let has_row = |node, direction| node != 6 && (![1, 4].contains(&node) || direction == 2);
    let found = describe(&text, has_row, &[(900, 4), (900, 5), (900, 6)]).expect("described");
    let equation = |at: (i64, u8)| {
        found.equations.iter().find(|equation| equation.dependent == at).map(|equation| &equation.terms[..])
    };
    assert_eq!(equation((1, 1)), Some(&[((900, 1), 1.0), ((900, 5), -0.5), ((900, 6), 0.5)][..]));
    assert_eq!(equation((1, 2)), None);
    assert_eq!(equation((6, 2)), Some(&[((800, 2), 3.0), ((3, 2), -2.0)][..]));
    assert_eq!(found.equations.len(), 7);
    assert_eq!(reasons(&found), Vec::<&str>::new());
}

#[test]
fn constraints_that_are_not_described_are_named() {
    let text = format!(
        "{NODES}{BRICKS}{STEEL}{SECTION}*SURFACE, NAME=A, TYPE=NODE\n1\n4\n*SURFACE, NAME=B, TYPE=NODE\n3\n\
        *TIE, NAME=T\nA, B\n*MPC\nPLANE, 1, 2, 3, 4\n*EQUATION\n2\n5,1,1., 6,1,-1.\n"
    );
    let found = all_rows(&text);
    assert_eq!(
        reasons(&found),
        [
            "*TIE: ties are not described",
            "*MPC: the constraint is not described",
            "*EQUATION: its dependent degrees of freedom have rows"
        ]
    );
    let nodes: Vec<&[i64]> = found.not_described.iter().map(|one| one.nodes.as_slice()).collect();
    assert_eq!(nodes, [&[1, 3, 4][..], &[1, 2, 3, 4], &[5]]);
    assert_eq!(found.not_described[1].line, Some(30));
}

/// CalculiX 2.20 numbers the internal nodes by ascending element numbers, whatever the order of the deck is.
#[test]
fn internal_nodes_follow_the_numbers_of_the_elements() {
    let bricks = "*ELEMENT, TYPE=C3D8I, ELSET=ALL\n50, 1,2,5,4,7,8,11,10\n7, 2,3,6,5,8,9,12,11\n";
    let text = format!("{NODES}{bricks}{STEEL}{SECTION}");
    let rows: Vec<(i64, u8)> = (20..26).flat_map(|node| [1, 2, 3].map(|k| (node, k))).collect();
    let found = describe(&text, |_, _| true, &rows).expect("described");
    assert_eq!(found.groups[0].ids, [50, 7]);
    assert_eq!(found.groups[0].internal, [23, 24, 25, 20, 21, 22]);
    let condensed = all_rows(&text);
    assert_eq!(condensed.groups[0].internal, Vec::<i64>::new(), "a program without rows for them");
    let other = describe(&text, |_, _| true, &rows[3..]).expect("described");
    assert_eq!(other.groups, []);
    assert!(reasons(&other)[0].contains("5 nodes outside the deck have rows, 6 are their internal nodes"));
}

#[test]
fn cards_that_cannot_be_read_are_refused_at_their_lines() {
    for (cards, line, part) in [
        ("*MATERIAL, NAME=STEEL\n*ELASTIC\n210000, x\n", Some(19), "expected numbers, found `210000, x`"),
        ("*MATERIAL, NAME=STEEL\n*ELASTIC\n210000\n", Some(18), "expected 2 numbers, found 1"),
        ("*SOLID SECTION, ELSET=NONE, MATERIAL=STEEL\n", Some(17), "element set `NONE` is unknown"),
        ("*SOLID SECTION, ELSET=ALL, MATERIAL=WOOD\n", Some(17), "material `WOOD` is unknown"),
        ("*EQUATION\n2\n1,1,1., 2,x,1.\n", Some(19), "node, direction and factor"),
        ("*EQUATION\n3\n1,1,1., 2,1,1.\n", Some(18), "a line with the terms"),
        ("*BOUNDARY\nNONE, 1\n", Some(18), "a node or node set and its directions"),
        ("*ELEMENT, TYPE=SPRING1, ELSET=S\n9, 1\n*SPRING, ELSET=S\n7\n1.\n", Some(20), "a direction"),
    ] {
        let found = describe(&format!("{NODES}{BRICKS}{cards}"), |_, _| true, &[]).expect_err("refused");
        assert_eq!(found[0].line(), line, "{}", found[0].message());
        assert!(found[0].message().contains(part), "{}", found[0].message());
        assert_eq!(found[0].code(), Code::DeckSyntax);
    }
}
