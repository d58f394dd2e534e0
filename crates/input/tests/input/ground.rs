//! Springs to ground in K: refused as far as the digits of K show them, in every kind of model; sound models with few
//! digits stay accepted.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::CscMatrix;
use flexbody_model::{DofLabel, FeModel, RawModel};
use oracle::general::raw_fixture;
use oracle::mesh::entries;

/// Solids, beams, shells, a plane model, eliminated constraints, bubbles, springs.
const MODELS: [&str; 12] = [
    "bar_c3d8r",
    "bracket_hex20",
    "car_frame",
    "cube_hex8",
    "frame_beams",
    "gear_disc",
    "hex8_bubbles",
    "mpc_block",
    "plane_frame",
    "satellite",
    "shell_folded",
    "spring_ends",
];

/// Stiffness to ground relative to the diagonal entry of its row.
const SOFT: f64 = 1e-9;

/// Returns the errors and warnings of a model.
fn told(raw: RawModel) -> Vec<Diagnostic> {
    match FeModel::from_raw(raw) {
        Ok(checked) => checked.diagnostics,
        Err(error) => error.into_diagnostics(),
    }
}

fn strained(raw: RawModel) -> Option<Diagnostic> {
    told(raw).into_iter().find(|d| d.code() == Code::RigidMotionStrained)
}

/// Returns the model with a changed K.
fn with_stiffness(raw: &RawModel, change: impl Fn(u32, u32, f64) -> f64) -> RawModel {
    let mut changed = raw.clone();
    let k = &raw.stiffness.matrix;
    let all: Vec<_> = entries(k).map(|(i, j, v)| (i, j, change(i, j, v))).collect();
    changed.stiffness.matrix = CscMatrix::from_triplets(k.n_rows(), k.n_cols(), &all);
    changed
}

/// Returns the rows of displacements along x, y (and z) of the n-th node.
fn rows_of_node(raw: &RawModel, n: usize) -> Vec<u32> {
    let (node, d) = (raw.nodes.ids[n], raw.dimension);
    (1..=d)
        .map(|direction| match &raw.dofs {
            Some(dofs) => dofs.iter().position(|l| *l == DofLabel { node, direction }).expect("a row") as u32,
            None => (n * usize::from(d)) as u32 + u32::from(direction) - 1,
        })
        .collect()
}

/// Returns the model with springs to ground of `part` of the diagonal at some nodes, and their rows.
fn on_springs(raw: &RawModel, part: f64) -> (RawModel, Vec<u32>) {
    let last = raw.nodes.len() - 1;
    let rows: Vec<u32> = [0, last / 2, last].iter().flat_map(|&n| rows_of_node(raw, n)).collect();
    let own = rows.clone();
    let add = |i, j, v: f64| if i == j && rows.contains(&i) { v + part * v } else { v };
    (with_stiffness(raw, add), own)
}

fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().expect("a number")
}

#[test]
fn soft_springs_to_ground_are_refused_and_named() {
    for name in MODELS {
        let raw = raw_fixture(name);
        let (tied, rows) = on_springs(&raw, SOFT);
        let found = strained(tied).unwrap_or_else(|| panic!("{name} is accepted"));
        assert!(
            found.message().starts_with(&format!("K ties the body to ground at {} rows: node", rows.len()))
                && found.help().contains("multibody program"),
            "{name}: {found}"
        );
        assert!(strained(raw).is_none(), "{name} is sound");
    }
}

#[test]
fn stiffness_to_ground_and_suspension_frequency_are_told() {
    let raw = raw_fixture("cube_hex8");
    let row = rows_of_node(&raw, 7)[2];
    let spring = 100.0;
    let tied = with_stiffness(&raw, |i, j, v| if i == j && i == row { v + spring } else { v });
    let message = strained(tied).expect("refused").message().to_owned();
    assert!(message.contains(&format!("at 1 row: node {} uz", raw.nodes.ids[7])), "{message}");
    assert!(
        message.contains("stiffness of these rows to ground 0 N/m along x, 0 N/m along y, 100 N/m along z"),
        "{message}"
    );
    // The cube of 0.1 m of aluminium: sqrt(100 / 2.7) / 2 pi.
    assert!(message.contains("0 Hz along x, 0 Hz along y, 0.969 Hz along z"), "{message}");
}

#[test]
fn a_spring_along_a_diagonal_is_refused() {
    let raw = raw_fixture("cube_hex8");
    let rows = rows_of_node(&raw, 100);
    let both = |i, j| rows.contains(&i) && rows.contains(&j);
    let tied = with_stiffness(&raw, |i, j, v| if both(i, j) { v + 1000.0 } else { v });
    assert!(strained(tied).expect("refused").message().contains("at 3 rows"));
}

/// Numbers of few digits leave |K t| of their rounding, also if the file states more digits than its numbers have.
#[test]
fn sound_models_of_few_digits_are_accepted() {
    for name in MODELS {
        let raw = raw_fixture(name);
        for digits in [7, 9, 11, 14] {
            let few = with_stiffness(&raw, |_, _, v| rounded(v, digits));
            for stated in [digits as u8, 17] {
                let mut few = few.clone();
                few.stiffness.digits = stated;
                let ground = strained(few).filter(|d| d.message().starts_with("K ties"));
                assert!(
                    ground.is_none(),
                    "{name}, {digits} digits, stated {stated}: {}",
                    ground.expect("one")
                );
            }
        }
        let single = with_stiffness(&raw, |_, _, v| f64::from(v as f32));
        let ground = strained(single).filter(|d| d.message().starts_with("K ties"));
        assert!(ground.is_none(), "{name} in single precision");
    }
}

#[test]
fn springs_show_as_far_as_the_digits_of_the_numbers() {
    let raw = raw_fixture("bracket_hex20");
    for (digits, part, seen) in [(14, SOFT, true), (10, SOFT, false), (10, 1e-7, true), (8, 1e-7, false)] {
        let (tied, _) = on_springs(&raw, part);
        let mut tied = with_stiffness(&tied, |_, _, v| rounded(v, digits));
        tied.stiffness.digits = digits as u8;
        assert_eq!(strained(tied).is_some(), seen, "{digits} digits, {part:e}");
    }
}

/// A constraint whose coefficients have few digits strains a translation as well, but with energy of second order only.
#[test]
fn rounded_coefficients_of_a_constraint_are_no_ground() {
    let raw = raw_fixture("cube_hex8");
    let rows = rows_of_node(&raw, 50);
    let error = |i| if rows.contains(&i) { 1.0 + 1e-8 } else { 1.0 };
    let scaled = with_stiffness(&raw, |i, j, v| v * error(i) * error(j));
    let codes: Vec<Code> = told(scaled).iter().map(|d| d.code()).collect();
    assert_eq!(codes, [Code::NodesRounded]);
}
