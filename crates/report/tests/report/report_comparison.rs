//! `compare` detects every difference of two bodies and ignores signs, bases, order and frames.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{FlexBody, Parts};
use flexbody_body::invariants::{BodyFrame, Frame, choose_frame};
use flexbody_linalg::{CscMatrix, SymmetricMatrix};
use flexbody_report::{
    BodyComparison, ComparisonFormat, ComparisonReport, Pairing, Tolerances, compare, compare_common,
};
use nalgebra::Vector3;
use oracle::random::Random;
use oracle::report_bodies::{block, condensed, engine_mount, mesh, shapes};
use std::path::Path;

fn compared(a: &FlexBody, b: &FlexBody) -> BodyComparison {
    compare(a, b, &Tolerances::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn failed(comparison: &BodyComparison) -> Vec<&'static str> {
    comparison.rows().iter().filter(|row| !row.passed).map(|row| row.quantity).collect()
}

fn agrees(a: &FlexBody, b: &FlexBody) {
    for (a, b) in [(a, b), (b, a)] {
        let comparison = compared(a, b);
        assert!(comparison.passed() && comparison.same_nodes(), "{}", comparison.text());
        assert_eq!(comparison.rows().len(), 13);
    }
}

fn changed(body: &FlexBody, change: impl FnOnce(&mut Parts)) -> FlexBody {
    let mut parts = body.clone().into_parts();
    change(&mut parts);
    FlexBody::new(parts).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns the shapes of the modes with flipped signs and rotated bases of the two repeated eigenvalues.
fn other_basis(shape: &Mat<f64>) -> Mat<f64> {
    let (c, s) = (0.6, 0.8);
    let mut t = Mat::<f64>::zeros(6, 6);
    for (p, q, value) in [
        (0, 0, c),
        (0, 1, -s),
        (1, 0, s),
        (1, 1, c),
        (2, 2, -1.0),
        (3, 3, s),
        (3, 4, c),
        (4, 3, c),
        (4, 4, -s),
        (5, 5, -1.0),
    ] {
        t[(p, q)] = value;
    }
    shape * t
}

#[test]
fn a_body_agrees_with_itself_to_the_last_bit() {
    for body in [block(BodyFrame::Principal), block(BodyFrame::Model), engine_mount()] {
        let comparison = compared(&body, &body);
        // The alignment multiplies by an identity with the rounding of the singular value decomposition.
        assert!(comparison.rows().iter().all(|row| row.difference < 1e-14), "{}", comparison.text());
        assert!(comparison.text().ends_with("the bodies agree\n"));
    }
}

#[test]
fn signs_bases_of_repeated_eigenvalues_node_order_and_frames_make_no_difference() {
    let (mass, positions) = mesh([3, 3, 2]);
    let n = positions.len();
    let shape = shapes(&mass, &positions);
    let ids: Vec<i64> = (1..=n as i64).collect();
    let reference = block(BodyFrame::Principal);
    let mut random = Random(5);
    let any = Frame { origin: Vector3::new(4.0, -2.0, 0.5), axes: random.rotation() };
    let mut frames: Vec<Frame> =
        BodyFrame::ALL.iter().map(|f| choose_frame(&mass, &positions, *f).unwrap().0).collect();
    frames.push(any);
    for frame in frames {
        agrees(&reference, &condensed(&mass, ids.clone(), &positions, shape.clone(), frame));
        let turned = other_basis(&shape);
        agrees(&reference, &condensed(&mass, ids.clone(), &positions, turned.clone(), frame));

        let order = random.permutation(n);
        let permuted = condensed(
            &permute(&mass, &order),
            order.iter().map(|&i| ids[i]).collect(),
            &order.iter().map(|&i| positions[i]).collect::<Vec<_>>(),
            Mat::from_fn(3 * n, 6, |row, p| turned[(3 * order[row / 3] + row % 3, p)]),
            frame,
        );
        agrees(&reference, &permuted);
    }
}

fn permute(mass: &SymmetricMatrix, order: &[usize]) -> SymmetricMatrix {
    let mut place = vec![0; order.len()];
    order.iter().enumerate().for_each(|(new, &old)| place[old] = new);
    let (mut col_ptr, mut row_idx, mut values) = (vec![0], Vec::new(), Vec::new());
    for &old in order {
        let (columns, entries) = mass.row(old);
        let mut row: Vec<(u32, f64)> =
            columns.iter().zip(entries).map(|(&j, &v)| (place[j as usize] as u32, v)).collect();
        row.sort_by_key(|(j, _)| *j);
        row.into_iter().for_each(|(j, v)| {
            row_idx.push(j);
            values.push(v);
        });
        col_ptr.push(row_idx.len());
    }
    SymmetricMatrix::new(CscMatrix::from_parts(order.len(), order.len(), col_ptr, row_idx, values)).unwrap()
}

#[test]
fn a_turned_basis_is_a_difference_where_eigenvalues_are_distinct() {
    let body = block(BodyFrame::Principal);
    let swapped = changed(&body, |p| {
        let shape = p.modes.shape.clone();
        p.modes.shape = Mat::from_fn(shape.nrows(), 6, |i, j| shape[(i, [0, 1, 2, 3, 5, 4][j])]);
    });
    assert!(failed(&compared(&body, &swapped)).contains(&"mode shapes"));
}

#[test]
fn each_quantity_is_told_apart() {
    let body = block(BodyFrame::Principal);
    let mut cases: Vec<(&[&str], FlexBody)> = vec![
        (&["mass"], changed(&body, |p| p.invariants.primary_mut().mass *= 1.0 + 1e-8)),
        (&["frequency"], changed(&body, |p| p.modes.eigenvalue[2] *= 1.0 + 1e-8)),
        (&["node positions"], changed(&body, |p| p.nodes.positions[7][1] += 1e-7)),
        (&["mode shapes"], changed(&body, |p| p.modes.shape[(5, 3)] += 1e-5)),
        (&["C1"], changed(&body, |p| p.invariants.primary_mut().c1[(1, 5)] += 1e-6)),
        (&["Ibar (W1, C2)"], changed(&body, |p| p.invariants.primary_mut().ibar[0][2][5] += 1e-6)),
        (&["S (W2, W3, m_ff)"], changed(&body, |p| p.invariants.primary_mut().s[2][0][(5, 2)] += 1e-6)),
        (
            &["modal stiffness"],
            changed(&body, |p| p.invariants.primary_mut().modal_stiffness[(5, 5)] *= 1.0 + 1e-6),
        ),
        // Moving the frame in space changes the global positions, but nothing in the body frame.
        (&["centre of mass", "node positions", "first moment"], changed(&body, |p| p.frame.origin.x += 1e-7)),
    ];
    cases.push((
        &["inertia", "second moment"],
        changed(&body, |p| p.invariants.primary_mut().second_moment[(0, 0)] *= 1.0 + 1e-6),
    ));
    for (expected, other) in cases {
        let comparison = compared(&body, &other);
        assert!(!comparison.passed());
        assert_eq!(failed(&comparison), expected, "{}", comparison.text());
    }
}

#[test]
fn tolerances_are_the_user_s() {
    let body = block(BodyFrame::Principal);
    let other = changed(&body, |p| p.invariants.primary_mut().mass *= 1.0 + 1e-6);
    let wide = Tolerances { mass: 1e-5, ..Tolerances::default() };
    assert!(!compared(&body, &other).passed());
    assert!(compare(&body, &other, &wide).unwrap().passed());
    let nothing = Tolerances { mass: f64::NAN, ..Tolerances::default() };
    assert!(!compare(&body, &body, &nothing).unwrap().passed(), "a NaN never passes");
}

#[test]
fn other_nodes_leave_what_needs_no_common_node() {
    let (mass, positions) = mesh([3, 3, 2]);
    let shape = other_basis(&shapes(&mass, &positions));
    let body = block(BodyFrame::Principal);
    let ids: Vec<i64> = (1001..).take(positions.len()).collect();
    let renumbered = condensed(&mass, ids, &positions, shape, Frame::model());
    let comparison = compared(&body, &renumbered);
    assert!(comparison.passed() && !comparison.same_nodes(), "{}", comparison.text());
    assert_eq!(comparison.rows().len(), 7);
    assert!(comparison.notes()[0].contains("different nodes"));
    assert!(comparison.text().contains("note: the bodies have different nodes"));

    let worse = changed(&renumbered, |p| p.invariants.primary_mut().s[1][1][(2, 2)] += 1e-6);
    assert_eq!(failed(&compared(&body, &worse)), ["norms of S"]);

    // A finer mesh has the same mass and centre; its inertia is exact too, and its modes are close.
    let (mass, positions) = mesh([6, 6, 4]);
    let shape = shapes(&mass, &positions);
    let (frame, _) = choose_frame(&mass, &positions, BodyFrame::Principal).unwrap();
    let finer = condensed(&mass, (1..).take(positions.len()).collect(), &positions, shape, frame);
    let strict = compared(&body, &finer);
    assert_eq!(failed(&strict), ["norms of Ibar", "norms of S"], "{}", strict.text());
    let loose = compare(&body, &finer, &Tolerances { invariants: 0.1, ..Tolerances::default() }).unwrap();
    assert!(loose.passed(), "{}", loose.text());
}

#[test]
fn a_repeated_eigenvalue_cut_at_the_end_is_named_as_a_possible_cause() {
    let body = engine_mount();
    let other = changed(&body, |p| p.modes.shape[(9, 7)] = 1.0);
    let comparison = compared(&body, &other);
    assert_eq!(failed(&comparison), ["mode shapes"]);
    assert!(comparison.notes().iter().any(|n| n.starts_with("only the last modes differ")));
}

#[test]
fn bodies_with_different_numbers_of_modes_are_compared_in_what_they_have_in_common_when_asked() {
    let body = block(BodyFrame::Principal);
    let some = |modes: &[usize]| body.reduced(modes, body.groups(), Vec::new()).expect("some modes");
    let common = |a: &FlexBody, b: &FlexBody| compare_common(a, b, &Tolerances::default());
    let refused = compare(&body, &some(&[0, 1, 2]), &Tolerances::default()).unwrap_err();
    assert!(refused.has(Code::BodyIncomparable) && refused.to_string().contains("--common"), "{refused}");
    // Modes 1 and 2, and 4 and 5, are repeated: mode 1 of the last list is therefore not compared.
    for modes in [&[0, 1, 2][..], &[2, 5], &[5], &[0, 2]] {
        for (a, b) in [(&body, &some(modes)), (&some(modes), &body)] {
            let comparison = common(a, b).expect("comparable");
            assert!(comparison.passed() && comparison.same_nodes(), "{}", comparison.text());
            let notes = comparison.notes().join("; ");
            assert!(notes.contains("in common") && notes.contains("not compared: mode"), "{notes}");
        }
    }
    let refused = common(&body, &some(&[0])).unwrap_err();
    assert!(refused.has(Code::BodyIncomparable) && refused.to_string().contains("repeated"), "{refused}");
    // A changed mode is compared and not taken for a missing one.
    let wrong = changed(&some(&[2, 5]), |p| {
        p.modes.eigenvalue[1] *= 1.03;
        p.invariants.primary_mut().modal_stiffness[(1, 1)] *= 1.03;
    });
    let comparison = common(&body, &wrong).expect("comparable");
    assert_eq!(failed(&comparison), ["frequency", "modal stiffness"], "{}", comparison.text());
    assert_eq!(common(&body, &body).expect("comparable").notes(), compared(&body, &body).notes());
}

/// Frequencies are compared mode by mode: by shapes, also in another order, and in ascending order where nodes or shapes
/// differ. The worst one is named.
#[test]
fn frequencies_are_compared_mode_by_mode() {
    let body = block(BodyFrame::Principal);
    let own = body.frequencies_hz();
    let higher = changed(&body, |p| p.modes.eigenvalue[2] *= 1.02f64.powi(2));
    let comparison = compared(&body, &higher);
    assert_eq!((comparison.paired(), comparison.modes().len()), (Pairing::Shape, 6));
    for (j, pair) in comparison.modes().iter().enumerate() {
        assert_eq!((pair.mode_a, pair.mode_b), (j + 1, j + 1));
        assert!((pair.assurance.expect("common nodes") - 1.0).abs() < 1e-12);
        assert_eq!((pair.frequency_a_hz, pair.difference == 0.0), (own[j], j != 2));
    }
    assert!((comparison.modes()[2].difference - 0.02).abs() < 1e-12);
    let notes = comparison.notes().join("; ");
    assert!(notes.contains("that differs most is that of mode 3: ") && notes.ends_with("+2 %"), "{notes}");
    assert!(comparison.text().contains("+2 %  1.0000"), "{}", comparison.text());
    assert_eq!(comparison.json()["modes"][2]["mode_b"], 3);
    // Modes 3 and 6 have exchanged shapes: the frequencies are those of the shapes.
    let exchanged = changed(&body, |p| {
        let shape = p.modes.shape.clone();
        p.modes.shape = Mat::from_fn(shape.nrows(), 6, |i, j| shape[(i, [0, 1, 5, 3, 4, 2][j])]);
    });
    let comparison = compared(&body, &exchanged);
    let partners: Vec<usize> = comparison.modes().iter().map(|pair| pair.mode_b).collect();
    assert_eq!((comparison.paired(), &partners[..]), (Pairing::Shape, &[1, 2, 6, 4, 5, 3][..]));
    assert!(failed(&comparison).contains(&"frequency"));
    assert!(comparison.notes().iter().any(|note| note.contains("another order") && note.contains("3 is 6")));
    // A shape of no mode of the other body, and bodies of other nodes.
    let foreign = changed(&body, |p| {
        let rows = p.modes.shape.nrows();
        (0..rows).for_each(|i| p.modes.shape[(i, 2)] = if i % 7 == 0 { 1.0 } else { 0.0 });
        // Its frequency differs most, but no mode of the other body is the same mode; mode 5 is.
        p.modes.eigenvalue[2] *= 1.001f64.powi(2);
        p.modes.eigenvalue[4] *= 1.0005f64.powi(2);
    });
    let comparison = compared(&body, &foreign);
    assert_eq!(comparison.paired(), Pairing::Shape);
    let rows = comparison.rows();
    let of = |name: &str| rows.iter().find(|row| row.quantity == name).expect("a row");
    assert_eq!((of("modes without partner").difference, of("modes without partner").passed), (1.0, false));
    assert!((of("frequency").difference - 5e-4).abs() < 1e-12, "{}", of("frequency").difference);
    assert_eq!(comparison.worst_mode().map(|pair| pair.mode_a), Some(5));
    assert!(
        comparison
            .notes()
            .iter()
            .any(|note| note.starts_with("mode 3 of the first body has the shape of no mode of the second"))
    );
    let renumbered = changed(&body, |p| p.nodes.ids.iter_mut().for_each(|id| *id += 1000));
    let comparison = compared(&body, &renumbered);
    assert_eq!((comparison.paired(), comparison.modes()[0].assurance), (Pairing::Order, None));
    assert!(comparison.text().contains("Difference\n"), "{}", comparison.text());
    // Modes keep their numbers where only common ones are compared.
    let fewer = body.reduced(&[2, 5], body.groups(), Vec::new()).expect("two modes");
    let fewer = changed(&fewer, |p| p.modes.eigenvalue[1] *= 0.98f64.powi(2));
    let comparison = compare_common(&body, &fewer, &Tolerances::default()).expect("comparable");
    let numbers: Vec<_> = comparison.modes().iter().map(|pair| (pair.mode_a, pair.mode_b)).collect();
    assert_eq!(numbers, [(3, 1), (6, 2)]);
    let notes = comparison.notes().join("; ");
    assert!(notes.contains("that of mode 6: ") && notes.contains("(its mode 2), -2 %"), "{notes}");
}

#[test]
fn assumed_units_and_other_mode_counts_cannot_be_compared() {
    let body = engine_mount();
    let tonnes = changed(&body, |p| p.description.units = UnitSystem::parse("mm", "t", "s").unwrap());
    let assumed = changed(&body, |p| p.description.units.stated = false);
    let error = compare(&assumed, &tonnes, &Tolerances::default()).unwrap_err();
    assert!(error.has(Code::BodyIncomparable) && error.diagnostics().len() == 2, "{error}");
    // Two names of one unit are equal.
    let tonne = changed(&body, |p| p.description.units = UnitSystem::parse("mm", "tonne", "s").unwrap());
    assert!(compared(&tonnes, &tonne).passed());
    let error = compare(&body, &block(BodyFrame::Model), &Tolerances::default()).unwrap_err();
    assert!(error.to_string().contains("the first body has 8 modes, the second 6"), "{error}");
}

#[test]
fn a_distant_origin_costs_the_digits_that_it_costs_and_no_more() {
    let (mass, positions) = mesh([3, 3, 2]);
    let far: Vec<[f64; 3]> = positions.iter().map(|x| [x[0] + 1e4, x[1] - 2e4, x[2] + 5e3]).collect();
    let shape = shapes(&mass, &positions);
    let ids: Vec<i64> = (1..=positions.len() as i64).collect();
    let at = |choice| {
        let (frame, _) = choose_frame(&mass, &far, choice).unwrap();
        condensed(&mass, ids.clone(), &far, shape.clone(), frame)
    };
    let (principal, model) = (at(BodyFrame::Principal), at(BodyFrame::Model));
    for (a, b) in [(&principal, &model), (&model, &principal)] {
        let comparison = compared(a, b);
        assert!(comparison.passed(), "{}", comparison.text());
        let widest = comparison.rows().iter().map(|r| r.tolerance).fold(0.0, f64::max);
        // The tolerance is 8 eps m d^2 / J_min with d = 2.3e4, m = 6, J_min = 0.5: far below the difference
        // detected next.
        assert!(widest < 1.2e-5, "{}", comparison.text());
    }
    let other = changed(&principal, |p| p.invariants.primary_mut().second_moment *= 1.0 + 1e-4);
    assert!(failed(&compared(&principal, &other)).contains(&"inertia"));
}

#[test]
fn numbers_that_overflow_never_agree() {
    let body = changed(&engine_mount(), |p| {
        p.modes.shape[(0, 0)] = 1e300;
        p.invariants.primary_mut().second_moment *= 1e300;
        p.invariants.primary_mut().s[0][0][(0, 0)] = 1e300;
    });
    let comparison = compared(&body, &body);
    assert!(comparison.rows().iter().all(|row| row.passed == (row.difference <= row.tolerance)));
    assert!(comparison.json()["rows"].as_array().unwrap().len() == comparison.rows().len());
}

#[test]
fn json_and_text_say_the_same() {
    let body = block(BodyFrame::Principal);
    let other = changed(&body, |p| p.invariants.primary_mut().mass *= 1.0 + 1e-6);
    let comparison = compared(&body, &other);
    let json = comparison.json();
    assert_eq!(json["passed"], false);
    assert_eq!(json["rows"][0]["quantity"], "mass");
    assert_eq!(json["rows"][0]["passed"], false);
    let text = comparison.text();
    assert!(text.lines().nth(1).unwrap().ends_with("1e-9  DIFFERS"), "{text}");
    assert!(text.ends_with("the bodies DIFFER in 1 quantity\n"), "{text}");
}

#[test]
fn reports_have_a_test_case_for_every_quantity_and_escape_names() {
    let reference = block(BodyFrame::Principal);
    let heavier = changed(&reference, |parts| parts.modes.eigenvalue[5] *= 1.001);
    let comparison = compared(&reference, &heavier);
    let failures = failed(&comparison);
    assert!(failures.contains(&"frequency") && failures.len() < comparison.rows().len(), "{failures:?}");
    let report = ComparisonReport { comparison: &comparison, a: "a & b.flex.h5", b: "<new>.flex.h5" };
    let written = |name: &str| report.render(ComparisonFormat::from_path(Path::new(name)).expect("known"));

    let junit = written("r.XML");
    assert_eq!(junit.matches("<testcase ").count(), comparison.rows().len());
    assert_eq!(junit.matches("<failure ").count(), failures.len());
    let counts = format!("tests=\"{}\" failures=\"{}\"", comparison.rows().len(), failures.len());
    assert_eq!(junit.matches(&counts).count(), 2, "{junit}");
    assert!(junit.contains("tolerance 1e-9, mode 6: "), "{junit}");
    assert!(junit.contains("&lt;new&gt;.flex.h5 compared with a &amp; b.flex.h5"), "{junit}");

    let markdown = written("r.md");
    assert_eq!(
        markdown.matches("| agrees |").count() + failures.len(),
        comparison.rows().len(),
        "{markdown}"
    );
    assert!(markdown.contains(&format!("differ in {} of", failures.len())), "{markdown}");

    let html = written("r.html");
    assert!(html.contains("&lt;new&gt;") && !html.contains("<new>"), "{html}");
    assert_eq!(written("r.txt"), comparison.text());
    let json: serde_json::Value = serde_json::from_str(&written("r.json")).expect("JSON");
    assert_eq!(json, comparison.json());
    assert!(ComparisonFormat::from_path(Path::new("r.pdf")).is_none());
}

/// A body equals itself in other units, whichever of the two is the reference; assumed units are not converted.
#[test]
fn bodies_in_different_units_compare_by_their_meaning() {
    let units = |length, mass, time| UnitSystem::parse(length, mass, time).expect("units");
    let metres =
        flexbody_file::in_units(&oracle::flexible::soft_block(5), &units("m", "kg", "s")).expect("a body");
    let other = flexbody_file::in_units(&metres, &units("mm", "t", "ms")).expect("a body");
    for (a, b) in [(&metres, &other), (&other, &metres)] {
        let comparison = compare(a, b, &Tolerances::default()).expect("a comparison");
        assert!(comparison.passed(), "{}", comparison.text());
    }
    let fewer = other.reduced(&[0, 1, 2], other.groups(), Vec::new()).expect("a body");
    let common = compare_common(&metres, &fewer, &Tolerances::default()).expect("a comparison");
    assert!(common.passed(), "{}", common.text());
    // One body states no units: its numbers may be in any.
    let mut parts = other.into_parts();
    parts.description.units.stated = false;
    let assumed = FlexBody::new(parts).expect("a body");
    assert!(compare(&metres, &assumed, &Tolerances::default()).is_err());
}
