//! Residual vectors: static response of the truncated modes, compared with the modal sum over all modes.

use faer::linalg::solvers::Solve;
use faer::{Mat, Scale, Side};
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_body::basis::{
    Basis, BasisChoice, FreeSurface, Loads, ModalBasis, ModeSettings, Task, UserLoads,
};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::verification::accept;
use flexbody_eigen::{Accuracy, FactorChoice, Method, Precision, Wanted};
use flexbody_linalg::context::Context;
use flexbody_linalg::{combine, gram};
use flexbody_model::{FeModel, NodeSet, RawShapes};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::general::raw_fixture;
use oracle::mesh::{Assembly, Mesh, grid};
use oracle::reference::{dense, dense_modes};
use std::path::PathBuf;

/// Returns a cylindrical shell segment of 0.5 rad with a twist, without symmetry.
fn curved_plate() -> Assembly {
    let cells = [8, 6, 1];
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid(cells), |p| {
        let [u, v, w] = [p[0] / 8.0, p[1] / 6.0, p[2]];
        let (angle, radius) = (0.5 * u * (1.0 + 0.2 * v), 1.0 + 0.02 * w);
        [radius * angle.sin(), 0.4 * v + 0.03 * u * v, radius * angle.cos()]
    });
    mesh.assemble(&Material::STEEL, MassRule::Consistent)
}

/// Returns the plate with two edges as interfaces.
fn model(plate: &Assembly) -> FeModel {
    let mut raw = plate.raw_model();
    let edge = |kept: &dyn Fn(usize) -> bool| {
        (0..plate.nodes.len()).filter(|&i| kept(i)).map(|i| raw.nodes.ids[i]).collect::<Vec<_>>()
    };
    let left = edge(&|i| i % 9 == 0);
    let corner = edge(&|i| i == 8);
    raw.data.interfaces = vec![NodeSet::new("edge", left), NodeSet::new("corner", corner)];
    FeModel::from_raw(raw).expect("a sound model").model
}

fn modes(model: &FeModel, settings: &ModeSettings, loads: Vec<Loads>) -> Result<ModalBasis> {
    let task = Task { model, settings, context: &Context::QUIET };
    FreeSurface { residual_vectors: loads }.modes(&task)
}

fn lowest(count: usize) -> ModeSettings {
    ModeSettings { wanted: Wanted::Lowest(count), ..ModeSettings::default() }
}

/// Returns the centrifugal loads by their definition, from M as 3n x 3n entries and about another origin.
fn centrifugal(plate: &Assembly) -> Mat<f64> {
    let n = plate.nodes.len();
    let mut fields = Mat::<f64>::zeros(3 * n, 6);
    for (column, (k, l)) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].into_iter().enumerate() {
        for (i, x) in plate.nodes.iter().enumerate() {
            let x = [x[0] - 0.2, x[1] + 1.0, x[2]];
            for c in 0..3 {
                let along = (f64::from(u8::from(c == k)) * x[l] + f64::from(u8::from(c == l)) * x[k])
                    / if k == l { 2.0 } else { 1.0 };
                let inward = if k == l { x[c] } else { 0.0 };
                fields[(3 * i + c, column)] = inward - along;
            }
        }
    }
    let mut loads = Mat::zeros(3 * n, 6);
    for (row, column, value) in oracle::mesh::entries(&plate.mass()) {
        for j in 0..6 {
            loads[(row as usize, j)] += value * fields[(column as usize, j)];
        }
    }
    loads
}

/// Returns the relative 2-norm and energy errors of the static responses in the span of `shapes`, for the
/// worst load.
fn response_error(
    plate: &Assembly,
    exact: &Mat<f64>,
    loads: &Mat<f64>,
    shapes: &Mat<f64>,
    lambda: &[f64],
) -> (f64, Vec<f64>) {
    let modal = gram(shapes.as_ref(), loads.as_ref());
    let amplitudes = Mat::from_fn(modal.nrows(), modal.ncols(), |p, j| modal[(p, j)] / lambda[p]);
    let rest = exact - combine(shapes.as_ref(), amplitudes.as_ref());
    let raw = FeModel::from_raw(plate.raw_model()).expect("sound").model;
    let pencil = raw.pencil();
    let energy = |x: &Mat<f64>| gram(x.as_ref(), pencil.apply_stiffness(x.as_ref()).as_ref());
    let (part, whole) = (energy(&rest), energy(exact));
    let worst =
        (0..loads.ncols()).map(|j| rest.col(j).norm_l2() / exact.col(j).norm_l2()).fold(0.0, f64::max);
    (worst, (0..loads.ncols()).map(|j| (part[(j, j)].max(0.0) / whole[(j, j)]).sqrt()).collect())
}

/// Returns K^+ F as the sum over all flexible modes of a dense solver.
fn exact_responses(plate: &Assembly, loads: &Mat<f64>) -> Mat<f64> {
    let all = dense_modes(plate);
    let modal = gram(all.shapes.as_ref(), loads.as_ref());
    let amplitudes = Mat::from_fn(modal.nrows(), modal.ncols(), |p, j| modal[(p, j)] / all.eigenvalues[p]);
    combine(all.shapes.as_ref(), amplitudes.as_ref())
}

/// Returns K^+ F by a dense factorisation of K + s M R R'M, which equals K for motions without a rigid part.
fn solved_responses(plate: &Assembly, loads: &Mat<f64>) -> Mat<f64> {
    let n = plate.n_dofs();
    let (k, m) = (dense(&plate.stiffness), dense(&plate.mass()));
    let mut rigid = Mat::from_fn(n, 6, |row, j| {
        let (x, axis) = (plate.nodes[row / 3], row % 3);
        match (j, (axis + 6 - j) % 3) {
            (0..3, same) => f64::from(u8::from(same == 0)),
            (_, 1) => -x[(axis + 1) % 3],
            (_, 2) => x[(axis + 2) % 3],
            _ => 0.0,
        }
    });
    // M-orthonormalised twice for full accuracy.
    for _ in 0..2 {
        let gram = rigid.transpose() * &m * &rigid;
        let factor = gram.llt(Side::Lower).expect("independent").L().to_owned();
        let mut transposed = rigid.transpose().to_owned();
        faer::linalg::triangular_solve::solve_lower_triangular_in_place(
            factor.as_ref(),
            transposed.as_mut(),
            faer::Par::Seq,
        );
        rigid = transposed.transpose().to_owned();
    }
    let m_rigid = &m * &rigid;
    let mean = (0..n).map(|i| k[(i, i)]).sum::<f64>() / (0..n).map(|i| m[(i, i)]).sum::<f64>();
    let raised = &k + &m_rigid * m_rigid.transpose() * Scale(mean);
    let factor = raised.llt(Side::Lower).expect("positive definite");
    let balanced = loads - &m_rigid * (rigid.transpose() * loads);
    let mut responses = factor.solve(&balanced);
    for _ in 0..3 {
        let left = &balanced - &k * &responses;
        responses += factor.solve(&left);
        let along = m_rigid.transpose() * &responses;
        responses -= &rigid * along;
    }
    responses
}

/// Experiment of theory section 8: a plate of 1 x 0.75 x 0.01 m, bent to 0.8 rad. Its response to spin about
/// the axes is mostly bending, which the first modes represent, and a tenth is stretching, which none of the
/// first 50 modes represents.
#[test]
fn fifty_modes_miss_a_tenth_of_the_centrifugal_response_and_six_vectors_nothing() {
    let mesh = Mesh::from_cells(ElementKind::Hex20, &grid([8, 6, 1]), |p| {
        let (angle, radius) = (0.8 * (p[0] / 8.0 - 0.5), 1.25 + 0.01 * (p[2] - 0.5));
        [radius * angle.sin(), 0.125 * p[1], radius * angle.cos()]
    });
    let plate = mesh.assemble(&Material::STEEL, MassRule::Consistent);
    let model = FeModel::from_raw(plate.raw_model()).expect("sound").model;
    let loads = centrifugal(&plate);
    let exact = solved_responses(&plate, &loads);
    let spins = |energy: &[f64]| [energy[0], energy[1], energy[2]].map(|e| 100.0 * e);
    for count in [5, 10, 20, 50] {
        let alone = modes(&model, &lowest(count), vec![]).expect("modes").solution;
        let (_, energy) = response_error(&plate, &exact, &loads, &alone.vectors, &alone.eigenvalues);
        println!("{count} modes: spin about x, y, z {:.2?} %", spins(&energy));
        assert!(spins(&energy).iter().all(|percent| (7.0..13.0).contains(percent)), "{count}: {energy:?}");
    }
    let settings = ModeSettings { method: Method::Lanczos, ..lowest(10) };
    let basis = modes(&model, &settings, vec![Loads::Centrifugal]).expect("modes");
    let solution = &basis.solution;
    assert_eq!(solution.eigenvalues.len(), 16);
    let (displacement, energy) =
        response_error(&plate, &exact, &loads, &solution.vectors, &solution.eigenvalues);
    println!("10 + 6: displacement {displacement:.1e}, energy {energy:?}");
    // Rounding of K limits the accuracy of any solution: ratio of its stiffest to its softest motion.
    let stiffest = |i: usize| plate.stiffness.get(i, i) / plate.scalar_mass.get(i / 3, i / 3);
    let highest = (0..plate.n_dofs()).map(stiffest).fold(0.0, f64::max);
    let floor = f64::EPSILON * highest / solution.eigenvalues[0];
    assert!(floor < 1e-7 && displacement < floor, "{displacement:e} {floor:e}");
    assert!(energy.iter().all(|e| *e < floor), "{energy:?} {floor:e}");
    let alone = modes(&model, &lowest(10), vec![]).expect("modes").solution;
    let (_, before) = response_error(&plate, &exact, &loads, &alone.vectors, &alone.eigenvalues);
    for (j, told) in basis.truncation.iter().enumerate() {
        assert!((told.before / before[j] - 1.0).abs() < 1e-6, "{told:?}, {}", before[j]);
        assert!(told.after < floor, "{told:?}");
    }
}

#[test]
fn six_vectors_bring_the_centrifugal_response_to_the_floor_in_both_precisions() {
    let plate = curved_plate();
    let model = model(&plate);
    let loads = centrifugal(&plate);
    let exact = exact_responses(&plate, &loads);
    for factor in [Precision::Double, Precision::Single] {
        let settings =
            ModeSettings { factor: FactorChoice::Always(factor), method: Method::Lanczos, ..lowest(10) };
        let basis = modes(&model, &settings, vec![Loads::Centrifugal]).expect("modes");
        let solution = &basis.solution;
        assert_eq!(solution.eigenvalues.len(), 16);
        let (displacement, energy) =
            response_error(&plate, &exact, &loads, &solution.vectors, &solution.eigenvalues);
        println!("{factor:?}: 10 + 6: displacement {displacement:.1e}, energy {energy:.1?}");
        assert!(displacement < 1e-9, "{displacement:e}");
        let alone = modes(&model, &lowest(10), vec![]).expect("modes").solution;
        let (_, before) = response_error(&plate, &exact, &loads, &alone.vectors, &alone.eigenvalues);
        for (j, told) in basis.truncation.iter().enumerate() {
            assert!((told.before / before[j] - 1.0).abs() < 1e-6, "{told:?}, {}", before[j]);
            assert!(told.after < 1e-9, "{told:?}");
        }
        assert_eq!(basis.truncation[3].load, "centrifugal xy");
    }
}

#[test]
fn free_modes_stay_what_they_are_and_proved() {
    let plate = curved_plate();
    let model = model(&plate);
    let alone = modes(&model, &lowest(8), vec![]).expect("modes").solution;
    let basis = modes(&model, &lowest(8), vec![Loads::Centrifugal, Loads::Interfaces]).expect("modes");
    let solution = &basis.solution;
    for j in 0..8 {
        assert!((solution.eigenvalues[j] / alone.eigenvalues[j] - 1.0).abs() < 1e-10, "mode {j}");
        let difference = solution.vectors.col(j) - alone.vectors.col(j);
        assert!(difference.norm_max() < 1e-7 * alone.vectors.norm_max(), "mode {j}");
        assert_eq!(basis.provenance[j], "free mode");
    }
    assert!(basis.provenance[8..].iter().all(|text| text.starts_with("residual vector: ")));
    assert_eq!(solution.completeness, alone.completeness);
    assert!(solution.eigenvalues[8] > alone.completeness.shift);
    // M-orthonormal, M-orthogonal to rigid motion, with diagonal stiffness.
    let pencil = model.pencil();
    let psi = solution.vectors.as_ref();
    let count = psi.ncols();
    let mass = gram(psi, pencil.apply_mass(psi).as_ref());
    assert!((mass - Mat::<f64>::identity(count, count)).norm_max() < 1e-13);
    let rigid = flexbody_model::rigid_fields(&model.nodes().positions, 3, [0.0; 3], 1.0);
    let momentum = gram(rigid.as_ref(), pencil.apply_mass(psi).as_ref());
    assert!(momentum.norm_max() < 1e-12, "{:e}", momentum.norm_max());
}

#[test]
fn responses_to_interface_loads_are_exact_and_what_adds_nothing_is_named() {
    let plate = curved_plate();
    let model = model(&plate);
    let basis = modes(&model, &lowest(6), vec![Loads::Interfaces]).expect("modes");
    // A single node of a solid transmits no torque.
    let [note] = basis.diagnostics.as_slice() else { panic!("{:?}", basis.diagnostics) };
    assert_eq!(note.code(), Code::LoadsCovered);
    assert!(note.message().starts_with("3 of 12"), "{note}");
    assert!(note.message().contains("corner torque z (deforms nothing)"), "{note}");
    assert_eq!(basis.solution.eigenvalues.len(), 6 + 9);
    // Unit force along y at the corner, with nodal forces written down here.
    let mut load = Mat::zeros(3 * plate.nodes.len(), 1);
    load[(3 * 8 + 1, 0)] = 1.0;
    let exact = exact_responses(&plate, &load);
    let solution = &basis.solution;
    let (displacement, energy) =
        response_error(&plate, &exact, &load, &solution.vectors, &solution.eigenvalues);
    assert!(displacement < 1e-9 && energy[0] < 1e-9, "{displacement:e} {energy:?}");
}

/// Without residual vectors the truncation error of free modes at interfaces is still known; it agrees with
/// the modal sum over all modes.
#[test]
fn free_modes_know_what_they_lack_at_interfaces() {
    let plate = curved_plate();
    let model = model(&plate);
    let free = modes(&model, &lowest(6), Vec::new()).expect("modes");
    let with = modes(&model, &lowest(6), vec![Loads::Interfaces]).expect("modes");
    assert_eq!(free.truncation.len(), with.truncation.len());
    for (own, exact) in free.truncation.iter().zip(&with.truncation) {
        assert_eq!((&own.load, own.before), (&exact.load, own.after));
        assert!((own.before - exact.before).abs() < 1e-4, "{own:?} {exact:?}");
    }
    assert!(
        free.truncation.iter().any(|truncation| truncation.before > 0.3)
            && with.truncation.iter().all(|truncation| truncation.after < 1e-6)
    );
}

#[test]
fn user_loads_that_repeat_or_only_move_the_body_are_named() {
    let plate = curved_plate();
    let model = model(&plate);
    let n = 3 * plate.nodes.len();
    let pencil = model.pencil();
    // A point force, twice that force, gravity along x, the inertia load of the first mode.
    let first = modes(&model, &lowest(1), vec![]).expect("modes").solution.vectors;
    let inertia = pencil.apply_mass(first.as_ref());
    let gravity = pencil.apply_mass(Mat::from_fn(n, 1, |i, _| if i % 3 == 0 { 1.0 } else { 0.0 }).as_ref());
    let matrix = Mat::from_fn(n, 4, |i, j| match j {
        0 | 1 => {
            if i == 40 {
                1.0 + j as f64
            } else {
                0.0
            }
        }
        2 => gravity[(i, 0)],
        _ => inertia[(i, 0)],
    });
    let raw = RawShapes { matrix, digits: 17, path: PathBuf::new(), source: None };
    let loads = UserLoads::new(&model, raw).expect("loads");
    let basis = modes(&model, &lowest(5), vec![Loads::User(loads)]).expect("modes");
    assert_eq!(basis.solution.eigenvalues.len(), 6);
    let [note] = basis.diagnostics.as_slice() else { panic!("{:?}", basis.diagnostics) };
    for what in ["3 of 4", "load 2 (", "load 3 (deforms nothing)", "load 4 ("] {
        assert!(note.message().contains(what), "{what}: {note}");
    }
    assert_eq!(basis.truncation[2].before, 0.0);
}

#[test]
fn what_cannot_be_is_refused_before_the_work() {
    let plate = curved_plate();
    let with_interfaces = model(&plate);
    let certified = ModeSettings { accuracy: Accuracy::Certified, ..lowest(5) };
    let error = modes(&with_interfaces, &certified, vec![Loads::Centrifugal]).expect_err("no bounds");
    assert!(error.has(Code::Usage));
    let without = FeModel::from_raw(plate.raw_model()).expect("sound").model;
    assert!(modes(&without, &lowest(5), vec![Loads::Interfaces]).expect_err("none").has(Code::InterfaceNode));
}

/// Returns H = B'(K - w^2 M)^-1 B without the rigid motion, for modes with these eigenvalues.
fn transfer(shapes: &Mat<f64>, lambda: &[f64], loads: &Mat<f64>, square: f64) -> Mat<f64> {
    let modal = gram(shapes.as_ref(), loads.as_ref());
    let answered = Mat::from_fn(modal.nrows(), modal.ncols(), |p, j| modal[(p, j)] / (lambda[p] - square));
    modal.transpose() * answered
}

/// Returns the largest difference of two transfer functions, relative to the first.
fn difference(exact: &Mat<f64>, other: &Mat<f64>) -> f64 {
    (exact - other).norm_max() / exact.norm_max()
}

#[test]
fn responses_at_a_frequency_give_the_transfer_function_there_and_its_slope() {
    let plate = curved_plate();
    let model = model(&plate);
    let all = dense_modes(&plate);
    let mut loads = Mat::zeros(3 * plate.nodes.len(), 3);
    (0..3).for_each(|k| loads[(3 * 8 + k, k)] = 1.0);
    // Frequencies among the six kept modes, and beyond them.
    for below in [3, 8] {
        let gap = all.eigenvalues[below + 1] - all.eigenvalues[below];
        let square = all.eigenvalues[below] + 0.4 * gap;
        let hertz = model.units().frequency_of(square);
        let at = Loads::At { loads: Box::new(Loads::Interfaces), hertz };
        let errors_of = |wanted: Vec<Loads>| {
            let solution = modes(&model, &lowest(6), wanted).expect("modes").solution;
            [0.0, 0.01, 0.02].map(|aside| {
                let square = square + aside * gap;
                let exact = transfer(&all.shapes, &all.eigenvalues, &loads, square);
                difference(&exact, &transfer(&solution.vectors, &solution.eigenvalues, &loads, square))
            })
        };
        let [there, near, farther] = errors_of(vec![at]);
        assert!(there < 1e-10, "{there:e} at {hertz} Hz");
        // The error grows with the square of the distance: the slope is that of the model.
        let growth = farther / near;
        assert!((3.5..5.0).contains(&growth) && near < 1e-3, "{near:e} {farther:e}");
        let [statically, ..] = errors_of(vec![Loads::Interfaces]);
        assert!(statically > 1e3 * there, "{statically:e}");
    }
}

#[test]
fn a_frequency_of_a_mode_that_is_kept_is_no_resonance_and_of_another_one_is_told() {
    let plate = curved_plate();
    let model = model(&plate);
    let all = dense_modes(&plate);
    let at = |mode: usize| {
        let hertz = model.units().frequency_of(all.eigenvalues[mode]);
        vec![Loads::At { loads: Box::new(Loads::Interfaces), hertz }]
    };
    let basis = modes(&model, &lowest(6), at(2)).expect("the mode takes the resonance");
    assert!(basis.solution.eigenvalues.len() > 6);
    assert!(basis.provenance.iter().any(|origin| origin.contains(" Hz")), "{:?}", basis.provenance);
    assert!(basis.truncation.is_empty(), "of static responses only");
    let error = modes(&model, &lowest(6), at(9)).expect_err("a resonance that no mode has");
    assert!(error.has(Code::FactorizationFailed), "{error}");
}

/// A wheel has pairs of modes of one frequency. If the number of modes parts a pair, its count proves one mode more than
/// the body has, and a residual vector stands for the other one.
#[test]
fn bodies_that_part_a_pair_of_modes_keep_their_proof() {
    let model = FeModel::from_raw(raw_fixture("gear_disc")).expect("a sound model").model;
    let mut parted = 0;
    for count in 6..=12 {
        let settings = ConvertSettings {
            modes: lowest(count),
            basis: BasisChoice::Free(FreeSurface { residual_vectors: vec![Loads::Interfaces] }),
            lumped: Vec::new(),
            ..ConvertSettings::default()
        };
        let body = convert(&model, &settings, &Context::QUIET).expect("a body").body;
        accept(&body).unwrap_or_else(|error| panic!("{count} modes: {error}"));
        parted += usize::from(body.certificate().proved_modes.is_some_and(|proved| proved > count));
    }
    assert!(parted > 0, "a number of modes parts a pair");
}
