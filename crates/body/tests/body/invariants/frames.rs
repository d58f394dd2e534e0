//! Body frame: centre of mass and principal axes without loss of digits, in canonical form.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_body::invariants::{BodyFrame, Frame, Invariants, choose_frame, condense};
use flexbody_linalg::{CscMatrix, SymmetricMatrix};
use nalgebra::{Matrix3, Vector3};
use oracle::cuboid::Cuboid;
use oracle::models::symmetric;
use oracle::random::Random;

fn rigid(mass: &SymmetricMatrix, positions: &[[f64; 3]]) -> Invariants {
    condense(mass, positions, Mat::zeros(3 * positions.len(), 0).as_ref(), Mat::zeros(0, 0))
}

#[test]
fn a_body_a_million_lengths_away_keeps_its_digits() {
    let near = Cuboid { cells: [8, 4, 2], low: [0.0; 3], size: [1.0, 0.5, 0.25], density: 64.0 };
    let (mass, positions) = (near.scalar_mass(), near.positions());
    // The shift is a power of two: coordinates stay exact, so that only the algorithm could lose digits.
    let far: Vec<[f64; 3]> = positions.iter().map(|x| x.map(|v| v + 1048576.0)).collect();
    for choice in [BodyFrame::Com, BodyFrame::Principal] {
        let (near_frame, near_properties) = choose_frame(&mass, &positions, choice).expect("a body");
        let (far_frame, far_properties) = choose_frame(&mass, &far, choice).expect("a body");
        assert_eq!(near_frame.axes, far_frame.axes);
        assert!((far_properties.mass / near_properties.mass - 1.0).abs() < 1e-15);
        assert!(
            (far_properties.inertia - near_properties.inertia).amax()
                < 1e-15 * near_properties.inertia.amax()
        );
        assert_eq!(far_frame.origin, near_frame.origin.map(|v| v + 1048576.0));
        let (a, b) = (rigid(&mass, &near_frame.to_body(&positions)), rigid(&mass, &far_frame.to_body(&far)));
        assert!((a.inertia() - b.inertia()).amax() < 1e-14 * a.inertia().amax());
        assert!(b.first_moment().amax() < 1e-15 * b.mass());
    }
    // Accuracy of a second moment about the distant origin after a shift.
    let (frame, properties) = choose_frame(&mass, &far, BodyFrame::Com).expect("a body");
    let naive = rigid(&mass, &far).shifted(frame.origin).inertia();
    assert!((naive - properties.inertia).amax() > 1e-6 * properties.inertia.amax());
}

#[test]
fn a_distant_origin_is_rounded_and_the_first_moment_says_so() {
    let body = Cuboid { cells: [3, 3, 3], low: [1e6, 0.0, 0.0], size: [0.7, 0.3, 0.1], density: 1.0 };
    let (mass, positions) = (body.scalar_mass(), body.positions());
    let (frame, properties) = choose_frame(&mass, &positions, BodyFrame::Com).expect("a body");
    let invariants = rigid(&mass, &frame.to_body(&positions));
    // Half of the spacing of numbers at 1e6.
    assert!(invariants.first_moment().amax() <= 6e-11 * properties.mass);
    // About its own centre of mass the inertia has all digits of these coordinates.
    let central = invariants.shifted(invariants.first_moment() / invariants.mass()).inertia();
    assert!((central - properties.inertia).amax() < 1e-15 * central.amax());
}

#[test]
fn a_heavy_tip_does_not_spoil_the_inertia() {
    // A mass of 1e9 at the end of a unit bar: the centre of the box is far from the centre of mass.
    let mass = symmetric(3, &[(0, 0, 1e9), (1, 1, 1.0), (2, 2, 1.0)]);
    let positions = [[1.0, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, -0.25, 0.0]];
    let (_, properties) = choose_frame(&mass, &positions, BodyFrame::Principal).expect("a body");
    // About the centre of mass: 2 m d^2 (reduced mass) about y, plus 2 * 0.25^2 about z.
    let about_y = 2.0 * 1e9 / (1e9 + 2.0);
    assert!((properties.inertia[(1, 1)] / about_y - 1.0).abs() < 1e-15);
    assert!((properties.inertia[(0, 0)] / 0.125 - 1.0).abs() < 1e-15);
}

#[test]
fn symmetric_bodies_keep_the_model_axes() {
    for (size, axes) in [
        ([1.0, 1.0, 1.0], Matrix3::identity()),
        // Plate: the two small moments are equal, the large one is about z.
        ([1.0, 1.0, 0.1], Matrix3::identity()),
        // Bar along z: the small moment comes first.
        ([0.1, 0.1, 1.0], Matrix3::new(0., 1., 0., 0., 0., 1., 1., 0., 0.)),
        // Three distinct moments: about z < y < x, and the third axis completes a right-handed frame.
        ([0.1, 0.2, 1.0], Matrix3::new(0., 0., -1., 0., 1., 0., 1., 0., 0.)),
    ] {
        let body = Cuboid { cells: [3, 4, 5], low: [0.1, 0.7, -3.0], size, density: 7.8e-9 };
        let frame =
            choose_frame(&body.scalar_mass(), &body.positions(), BodyFrame::Principal).expect("a body").0;
        assert_eq!(frame.axes, axes, "{size:?}");
    }
}

#[test]
fn frame_follows_the_body_when_it_is_turned_and_moved() {
    let body = Cuboid { cells: [3, 4, 5], low: [0.0; 3], size: [0.5, 0.9, 1.4], density: 2.0 };
    let (mass, positions) = (body.scalar_mass(), body.positions());
    let (frame, properties) = choose_frame(&mass, &positions, BodyFrame::Principal).expect("a body");
    for seed in 0..10 {
        let mut random = Random(seed);
        let (turn, shift) = (random.rotation(), Vector3::from(random.vector::<3>()) * 10.0);
        let moved: Vec<[f64; 3]> =
            positions.iter().map(|x| (turn * Vector3::from(*x) + shift).into()).collect();
        let (turned, turned_properties) = choose_frame(&mass, &moved, BodyFrame::Principal).expect("a body");
        assert!((turned.origin - (turn * frame.origin + shift)).amax() < 2e-14);
        assert!((turned_properties.principal_moments - properties.principal_moments).amax() < 1e-13);
        assert!((turned.axes.determinant() - 1.0).abs() < 1e-14);
        let between = frame.axes.transpose() * turn.transpose() * turned.axes;
        for k in 0..3 {
            assert!((between[(k, k)].abs() - 1.0).abs() < 1e-13, "axis {k} up to its sign");
        }
    }
}

#[test]
fn body_coordinates_lead_back_to_the_model() {
    let mut random = Random(2);
    let frame = Frame { origin: Vector3::from(random.vector::<3>()), axes: random.rotation() };
    let positions: Vec<[f64; 3]> = (0..10).map(|_| random.vector()).collect();
    let mut shapes = Mat::from_fn(30, 2, |row, p| positions[row / 3][row % 3] * (p + 1) as f64);
    frame.rotate_shapes(&mut shapes);
    for (i, (x, body)) in positions.iter().zip(frame.to_body(&positions)).enumerate() {
        assert!((frame.origin + frame.axes * Vector3::from(body) - Vector3::from(*x)).amax() < 1e-15);
        let turned = frame.axes * Vector3::from_fn(|k, _| shapes[(3 * i + k, 1)]);
        assert!((turned - 2.0 * Vector3::from(*x)).amax() < 1e-15);
    }
    assert_eq!(Frame::model().to_body(&positions), positions);
}

#[test]
fn bodies_without_mass_or_place_are_refused() {
    let unit = symmetric(2, &[(0, 0, 1.0), (1, 1, 1.0)]);
    let positions = [[0.0; 3], [1.0, 0.0, 0.0]];
    for value in [-1.0, f64::NAN, f64::INFINITY] {
        // A NaN differs from its transpose, so that the symmetric mean is used.
        let triplets = [(0, 0, value), (1, 1, value)];
        let mass = SymmetricMatrix::symmetrised(CscMatrix::from_triplets(2, 2, &triplets));
        let error = choose_frame(&mass, &positions, BodyFrame::Com).expect_err("refused");
        assert!(error.has(Code::MassNotPositive), "{value}");
    }
    let empty = symmetric(2, &[]);
    assert!(
        choose_frame(&empty, &positions, BodyFrame::Com).expect_err("refused").has(Code::MassNotPositive)
    );
    for value in [f64::NAN, f64::INFINITY, 1e200] {
        let error = choose_frame(&unit, &[[0.0; 3], [value, 0.0, 0.0]], BodyFrame::Principal);
        assert!(error.expect_err("refused").has(Code::CoordinateNotFinite), "{value}");
    }
}
