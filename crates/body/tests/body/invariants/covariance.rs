//! Transformed invariants equal the invariants of the transformed body.

use super::bodies::{Body, assert_agree, random_matrix, stiffness};
use faer::Mat;
use flexbody_body::invariants::{
    BodyFrame, Frame, Invariants, PrimaryData, TermGroups, choose_frame, condense,
};
use nalgebra::Vector3;
use oracle::models::symmetric;
use oracle::random::Random;

fn condensed(body: &Body) -> Invariants {
    let nf = body.shapes.ncols();
    condense(&body.scalar_mass, &body.positions, body.shapes.as_ref(), stiffness(nf))
}

fn moved(body: &Body, frame: &Frame) -> Body {
    let mut shapes = body.shapes.clone();
    frame.rotate_shapes(&mut shapes);
    Body::new(body.scalar_mass.clone(), frame.to_body(&body.positions), shapes)
}

#[test]
fn shift_and_rotation_are_those_of_the_coordinates() {
    let mut random = Random(8);
    let body = Body::cuboid(9, 5);
    let invariants = condensed(&body);
    let (origin, axes) = (Vector3::from(random.vector::<3>()), random.rotation());
    let shift = Frame { origin, ..Frame::model() };
    assert_agree("shift", &condensed(&moved(&body, &shift)), &invariants.shifted(origin), 2e-14);
    let turn = Frame { axes, ..Frame::model() };
    assert_agree("rotation", &condensed(&moved(&body, &turn)), &invariants.rotated(&axes), 1e-14);
    let both = Frame { origin, axes };
    assert_agree("both", &condensed(&moved(&body, &both)), &invariants.shifted(origin).rotated(&axes), 2e-14);
}

#[test]
fn transformations_undo_themselves_and_keep_exact_symmetry() {
    let mut random = Random(18);
    let invariants = condensed(&Body::random(6, 30, 4));
    let (origin, axes) = (Vector3::from(random.vector::<3>()), random.rotation());
    let turned = invariants.rotated(&axes);
    assert_agree("rotation", &invariants, &turned.rotated(&axes.transpose()), 1e-14);
    assert_agree("shift", &invariants, &invariants.shifted(origin).shifted(-origin), 2e-14);
    let changed = turned.with_basis(random_matrix(&mut random, 4, 3).as_ref());
    for k in 0..3 {
        for l in 0..3 {
            assert_eq!(changed.s().unwrap()[k][l].transpose().to_owned(), changed.s().unwrap()[l][k]);
            assert_eq!(turned.second_moment()[(k, l)], turned.second_moment()[(l, k)]);
        }
    }
}

#[test]
fn basis_change_is_that_of_the_shapes() {
    let mut random = Random(28);
    let body = Body::cuboid(4, 6);
    for columns in [6, 4, 1, 0] {
        let t = random_matrix(&mut random, 6, columns);
        let shapes = &body.shapes * &t;
        let k_ff = t.transpose() * stiffness(6) * &t;
        let direct = condense(&body.scalar_mass, &body.positions, shapes.as_ref(), k_ff);
        assert_agree("basis", &direct, &condensed(&body).with_basis(t.as_ref()), 1e-14);
    }
}

#[test]
fn numbering_of_the_nodes_does_not_matter() {
    let body = Body::cuboid(14, 3);
    let n = body.positions.len();
    let order = Random(3).permutation(n);
    let mut triplets = Vec::new();
    for i in 0..n {
        let (columns, values) = body.scalar_mass.row(order[i]);
        for (&j, &value) in columns.iter().zip(values) {
            let column = order.iter().position(|&old| old == j as usize).expect("a permutation");
            triplets.push((i as u32, column as u32, value));
        }
    }
    let permuted = Body::new(
        symmetric(n, &triplets),
        order.iter().map(|&i| body.positions[i]).collect(),
        Mat::from_fn(3 * n, 3, |row, p| body.shapes[(3 * order[row / 3] + row % 3, p)]),
    );
    assert_agree("permutation", &condensed(&body), &condensed(&permuted), 1e-14);
    let frame =
        |body: &Body| choose_frame(&body.scalar_mass, &body.positions, BodyFrame::Principal).expect("a body");
    let (a, b) = (frame(&body).0, frame(&permuted).0);
    assert!((a.axes - b.axes).amax() < 1e-13 && (a.origin - b.origin).amax() < 1e-15);
}

#[test]
fn units_scale_every_invariant_by_its_dimension() {
    // Micrometres and nanograms: powers of ten far from one, and a separate unit of the shapes.
    let (length, mass, shape) = (1e6, 1e12, 1e-3);
    let body = Body::cuboid(5, 4);
    let n = body.positions.len();
    let triplets: Vec<(u32, u32, f64)> = (0..n)
        .flat_map(|i| {
            let (columns, values) = body.scalar_mass.row(i);
            columns.iter().zip(values).map(move |(&j, &v)| (i as u32, j, mass * v)).collect::<Vec<_>>()
        })
        .collect();
    let scaled = Body::new(
        symmetric(n, &triplets),
        body.positions.iter().map(|x| x.map(|v| length * v)).collect(),
        Mat::from_fn(3 * n, 4, |row, p| shape * body.shapes[(row, p)]),
    );
    let (a, b) = (condensed(&body), condensed(&scaled));
    let times = |m: &Mat<f64>, factor: f64| Mat::from_fn(m.nrows(), m.ncols(), |i, j| factor * m[(i, j)]);
    let expected = Invariants::new(PrimaryData {
        mass: mass * a.mass(),
        first_moment: a.first_moment() * (mass * length),
        second_moment: a.second_moment() * (mass * length * length),
        c1: times(a.c1(), mass * shape),
        ibar: a.ibar().unwrap().each_ref().map(|row| {
            row.each_ref().map(|v| v.iter().map(|v| mass * length * shape * v).collect::<Vec<f64>>())
        }),
        s: a.s().unwrap().each_ref().map(|row| row.each_ref().map(|s| times(s, mass * shape * shape))),
        modal_stiffness: a.modal_stiffness().clone(),
        general: None,
        groups: TermGroups::ALL,
    });
    assert_agree("units", &expected, &b, 1e-14);
}
