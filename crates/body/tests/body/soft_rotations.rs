//! Sheets whose elements are not quite coplanar: rotations about the normal have a stiffness of the square of the
//! angles between elements, and would act as hinges. The body is that of the flat sheet.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::verification::{body_identities, verify};
use flexbody_eigen::{Method, Wanted};
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{CheckedModel, DofLabel, FeModel, Nodes, RawModel};
use nalgebra::{DMatrix, DVector, Rotation3, Vector3};
use oracle::turning;

/// Sheet of bars with out-of-plane bending and torsion along edges and diagonals of a grid of nodes; each bar has
/// a normal of its own, and bends about the direction across it.
pub(crate) struct Sheet {
    pub(crate) places: Vec<Vector3<f64>>,
    k: DMatrix<f64>,
    m: DMatrix<f64>,
}

/// Number of nodes along x and along y.
const GRID: [usize; 2] = [5, 3];

/// Repeatable numbers between -1 and 1.
fn scatter(seed: usize) -> f64 {
    ((seed * 7919 + 104_729) % 2003) as f64 / 1001.0 - 1.0
}

impl Sheet {
    /// Returns the sheet whose bars have normals tilted by up to `angle` in radians, and a stiffness `inplane`
    /// of bending in the plane relative to that out of it.
    pub(crate) fn new(angle: f64, inplane: f64) -> Self {
        let [nx, ny] = GRID;
        let at = |i: usize, j: usize| nx * j + i;
        let places: Vec<Vector3<f64>> = (0..nx * ny)
            .map(|node| {
                let (i, j) = ((node % nx) as f64, (node / nx) as f64);
                Vector3::new(0.1 * i + 0.01 * j * j, 0.12 * j - 0.015 * i, 0.0)
            })
            .collect();
        let mut edges = Vec::new();
        for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
            edges.extend((i + 1 < nx).then(|| (at(i, j), at(i + 1, j))));
            edges.extend((j + 1 < ny).then(|| (at(i, j), at(i, j + 1))));
            edges.extend((i + 1 < nx && j + 1 < ny).then(|| (at(i, j), at(i + 1, j + 1))));
        }
        let n = 6 * places.len();
        let mut sheet = Self { places, k: DMatrix::zeros(n, n), m: DMatrix::zeros(n, n) };
        for (seed, &(a, b)) in edges.iter().enumerate() {
            let along = (sheet.places[b] - sheet.places[a]).normalize();
            let tilt = along * (angle * scatter(seed));
            let normal = Rotation3::new(tilt) * Vector3::z();
            let length = (sheet.places[b] - sheet.places[a]).norm();
            sheet.add(2e7 / length, &sheet.difference((a, b), 0, &along));
            sheet.add(90.0 / length, &sheet.difference((a, b), 3, &along));
            sheet.bend((a, b), 150.0 / length, &along, &normal);
            sheet.bend((a, b), 150.0 * inplane / length, &along, &along.cross(&normal));
            for node in [a, b] {
                (0..3).for_each(|axis| sheet.m[(6 * node + axis, 6 * node + axis)] += 0.4 * length);
            }
        }
        sheet
    }

    fn add(&mut self, stiffness: f64, row: &DVector<f64>) {
        self.k += stiffness * row * row.transpose();
    }

    /// Returns the displacement (`from` 0) or rotation (`from` 3) of a node along a direction, as a row.
    fn part(&self, node: usize, from: usize, direction: &Vector3<f64>) -> DVector<f64> {
        let mut row = DVector::zeros(self.k.nrows());
        (0..3).for_each(|axis| row[6 * node + from + axis] = direction[axis]);
        row
    }

    fn difference(&self, (a, b): (usize, usize), from: usize, direction: &Vector3<f64>) -> DVector<f64> {
        self.part(b, from, direction) - self.part(a, from, direction)
    }

    /// Adds bending with deflections along `normal`, with slopes relative to the chord.
    fn bend(&mut self, (a, b): (usize, usize), size: f64, along: &Vector3<f64>, normal: &Vector3<f64>) {
        let across = normal.cross(along);
        let length = (self.places[b] - self.places[a]).norm();
        let chord = self.difference((a, b), 0, normal) / length;
        let slopes = [a, b].map(|node| -self.part(node, 3, &across) - &chord);
        self.add(2.0 * size, &(&slopes[0] + &slopes[1]));
        slopes.iter().for_each(|slope| self.add(2.0 * size, slope));
    }

    /// Returns the model turned by `rotation`, with lengths multiplied by `scale` (the unit of force stays), and
    /// nodes in the order of `order`.
    pub(crate) fn raw(&self, rotation: &Rotation3<f64>, scale: f64, order: &[usize]) -> RawModel {
        let n = self.k.nrows();
        let mut all = DMatrix::zeros(n, n);
        for (to, &node) in order.iter().enumerate() {
            for from in [0, 3] {
                let size = if from == 0 { 1.0 / scale } else { 1.0 };
                let block = size * rotation.matrix();
                all.view_mut((6 * to + from, 6 * node + from), (3, 3)).copy_from(&block);
            }
        }
        let sparse = |matrix: &DMatrix<f64>, size: f64| {
            let matrix = size * &all * matrix * all.transpose();
            let matrix = 0.5 * (&matrix + matrix.transpose());
            turning::sparse(&matrix)
        };
        let nodes = Nodes {
            ids: order.iter().map(|&node| node as i64 + 1).collect(),
            positions: order.iter().map(|&node| (rotation * self.places[node] * scale).into()).collect(),
        };
        let labels =
            nodes.ids.iter().flat_map(|&node| (1..=6).map(move |direction| DofLabel { node, direction }));
        let dofs = Some(labels.collect());
        // Energy per length^2 of displacements: the factor 1 / scale^2 is in the transformation.
        let (k, m) = (sparse(&self.k, scale), sparse(&self.m, scale));
        RawModel { dofs, ..RawModel::in_memory("sheet", k, m, nodes) }
    }

    fn plain(&self) -> RawModel {
        self.raw(&Rotation3::identity(), 1.0, &self.order())
    }

    pub(crate) fn order(&self) -> Vec<usize> {
        (0..self.places.len()).collect()
    }

    /// Returns the flexible eigenvalues by dense algebra, without the massless rows: all rotations, or all but
    /// those about z.
    fn dense(&self, with_normal: bool) -> Vec<f64> {
        let rows = 0..self.k.nrows();
        let (moving, turning): (Vec<usize>, Vec<usize>) =
            rows.filter(|row| with_normal || row % 6 != 5).partition(|row| row % 6 < 3);
        let block =
            |a: &[usize], b: &[usize]| DMatrix::from_fn(a.len(), b.len(), |i, j| self.k[(a[i], b[j])]);
        let inverse = block(&turning, &turning).cholesky().expect("rotations are held");
        let coupling = block(&turning, &moving);
        let condensed = block(&moving, &moving) - coupling.transpose() * inverse.solve(&coupling);
        let root: Vec<f64> = moving.iter().map(|&row| self.m[(row, row)].sqrt()).collect();
        let n = moving.len();
        let scaled = DMatrix::from_fn(n, n, |i, j| condensed[(i, j)] / root[i] / root[j]);
        let mut values: Vec<f64> = scaled.symmetric_eigen().eigenvalues.iter().copied().collect();
        values.sort_by(f64::total_cmp);
        values.split_off(6)
    }
}

fn converted(model: &FeModel, modes: usize, method: Method) -> Conversion {
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), method, ..ModeSettings::default() };
    convert(model, &ConvertSettings { modes, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("converts")
}

fn find(found: &[Diagnostic], code: Code) -> Option<&str> {
    found.iter().find(|one| one.code() == code).map(Diagnostic::message)
}

/// Returns the largest deviation of eigenvalues from `expected`, relative.
fn deviation(found: &[f64], expected: &[f64]) -> f64 {
    found.iter().zip(expected).map(|(found, expected)| (found / expected - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn rotations_held_by_misaligned_elements_follow_in_any_axes_units_and_order() {
    let flat = Sheet::new(0.0, 0.0).dense(false);
    let folded = Sheet::new(1e-5, 0.0);
    // Hinges lower frequencies by several percent.
    assert!(folded.dense(true)[3] < 0.9 * flat[3], "{:?} {flat:?}", folded.dense(true));
    let tilt = Rotation3::from_euler_angles(0.4, -0.7, 1.1);
    let reversed: Vec<usize> = folded.order().into_iter().rev().collect();
    for raw in [
        folded.plain(),
        folded.raw(&tilt, 1.0, &folded.order()),
        folded.raw(&tilt, 1000.0, &folded.order()),
        folded.raw(&Rotation3::from_euler_angles(1.5, 0.2, -0.1), 1.0, &reversed),
    ] {
        let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(raw).expect("a body");
        let message = find(&diagnostics, Code::SoftRotationsFollow).expect("soft rotations");
        assert!(message.starts_with("rotations of 15 nodes have less than 1e-6 of the largest"), "{message}");
        for method in [Method::Dense, Method::Lanczos] {
            let converted = converted(&model, 10, method);
            let eigenvalues = &converted.body.modes().eigenvalue;
            assert!(deviation(eigenvalues, &flat) < 1e-6, "{method:?}: {eigenvalues:?} {flat:?}");
            let verified = verify(&converted.body, &model).expect("the same model");
            let broken: Vec<_> = body_identities(&converted.body)
                .into_iter()
                .chain(verified)
                .filter(|one| !one.passed)
                .collect();
            assert!(broken.is_empty(), "{method:?}: {broken:?}");
        }
    }
}

#[test]
fn the_switch_leaves_the_stiffness_as_it_is() {
    let folded = Sheet::new(1e-4, 0.0);
    let raw = RawModel { keep_soft_rotations: true, ..folded.plain() };
    let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(raw).expect("a body");
    assert_eq!(find(&diagnostics, Code::SoftRotationsFollow), None);
    let kept = converted(&model, 10, Method::Dense);
    assert!(deviation(&kept.body.modes().eigenvalue, &folded.dense(true)) < 1e-4);
    assert_eq!(find(&kept.diagnostics, Code::SoftRotationsEffect), None);
}

/// The stated frequency without the terms lies between that of the hinges and the one with the terms.
#[test]
fn the_effect_on_the_lowest_changed_frequency_is_stated() {
    let folded = Sheet::new(1e-4, 0.0);
    let model = FeModel::from_raw(folded.plain()).expect("a body").model;
    let converted = converted(&model, 10, Method::Dense);
    let message = find(&converted.diagnostics, Code::SoftRotationsEffect).expect("an effect");
    let words: Vec<&str> = message.split([' ', ':']).filter(|word| !word.is_empty()).collect();
    let mode: usize = words[1].parse().expect("a mode");
    let numbers: Vec<f64> = words[2..].iter().filter_map(|word| word.parse().ok()).collect();
    let hertz = |eigenvalue: f64| model.units().frequency_of(eigenvalue);
    let with = hertz(converted.body.modes().eigenvalue[mode - 1]);
    let without = hertz(folded.dense(true)[mode - 1]);
    assert!((numbers[0] / with - 1.0).abs() < 1e-5, "{message}");
    assert!(numbers[1] < 0.99 * with && numbers[1] > 0.999 * without, "{message}: {without}");
    let unchanged = converted.body.modes().eigenvalue[..mode - 1].iter().zip(folded.dense(true));
    unchanged.for_each(|(with, without)| assert!(without > 0.95 * with, "{message}"));
}

/// Folds above the limit, a drilling stiffness and rotations that a spring holds stay as K has them.
#[test]
fn folds_and_small_stiffnesses_stay() {
    for (sheet, what) in [
        (Sheet::new(2e-2, 0.0), "a fold"),
        (Sheet::new(0.0, 1e-7), "a flat sheet that is soft in its plane"),
        (Sheet::new(1e-6, 1e-7), "a sheet whose bending in the plane holds the rotation"),
    ] {
        let raw = sheet.raw(&Rotation3::from_euler_angles(0.4, -0.7, 1.1), 1.0, &sheet.order());
        let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(raw).expect("a body");
        assert_eq!(find(&diagnostics, Code::SoftRotationsFollow), None, "{what}");
        let eigenvalues = converted(&model, 6, Method::Dense).body.modes().eigenvalue.clone();
        assert!(deviation(&eigenvalues, &sheet.dense(true)) < 1e-6, "{what}");
    }
}

/// A mass with rotary inertia about all axes turns with the elements around it.
#[test]
fn rotary_inertia_about_the_normal_follows() {
    let inertia = 0.5;
    let node = 7;
    let mut folded = Sheet::new(1e-5, 0.0);
    (3..6).for_each(|axis| folded.m[(6 * node + axis, 6 * node + axis)] += inertia);
    let model = FeModel::from_raw(folded.plain()).expect("a body").model;
    let found = converted(&model, 8, Method::Dense).body.modes().eigenvalue.clone();
    // The flat sheet whose node turns about z exactly as a triangle of nodes around it does.
    let soft = flat_with_inertia(inertia, node, &model);
    assert!(deviation(&found, &soft) < 1e-4, "{found:?} {soft:?}");
}

/// Returns the eigenvalues of the flat sheet with rotary inertia at a node, whose rotation about z is the
/// combination of displacements by which `model` makes it follow.
fn flat_with_inertia(inertia: f64, node: usize, model: &FeModel) -> Vec<f64> {
    let flat = Sheet::new(0.0, 0.0);
    let row = |row: u32| {
        let label = model.label(row as usize);
        6 * (label.node as usize - 1) + usize::from(label.direction) - 1
    };
    let rotation = model.soft_rotations().iter().find(|one| row(one.direction[0].0) / 6 == node);
    let rotation = rotation.expect("the node is soft");
    let along = rotation.direction.iter().find(|(at, _)| row(*at) % 6 == 5).expect("about z").1;
    let mut follow = DVector::zeros(flat.k.nrows());
    for &(at, part) in rotation.term.iter().filter(|(at, _)| row(*at) % 6 < 3) {
        follow[row(at)] = -part / along;
    }
    // Keep displacements and the rotations of the node across z; condense all other rotations.
    let kept: Vec<usize> =
        (0..flat.k.nrows()).filter(|at| at % 6 < 3 || (at / 6 == node && at % 6 < 5)).collect();
    let rest: Vec<usize> = (0..flat.k.nrows()).filter(|at| !kept.contains(at) && at % 6 != 5).collect();
    let block = |a: &[usize], b: &[usize]| DMatrix::from_fn(a.len(), b.len(), |i, j| flat.k[(a[i], b[j])]);
    let coupling = block(&rest, &kept);
    let held = block(&rest, &rest).cholesky().expect("rotations are held");
    let k = block(&kept, &kept) - coupling.transpose() * held.solve(&coupling);
    let follow = DVector::from_iterator(kept.len(), kept.iter().map(|&at| follow[at]));
    let mut m = DMatrix::from_fn(kept.len(), kept.len(), |i, j| flat.m[(kept[i], kept[j])]);
    kept.iter().enumerate().filter(|(_, at)| *at % 6 >= 3).for_each(|(i, _)| m[(i, i)] += inertia);
    m += inertia * &follow * follow.transpose();
    let lower = m.cholesky().expect("mass").l();
    let half = lower.solve_lower_triangular(&k).expect("a factor");
    let scaled = lower.solve_lower_triangular(&half.transpose()).expect("a factor");
    let mut values: Vec<f64> =
        (0.5 * (&scaled + scaled.transpose())).symmetric_eigen().eigenvalues.iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values.split_off(6)
}

/// The parts of a split model keep the terms of their own nodes.
#[test]
fn soft_rotations_of_separate_bodies_are_their_own() {
    let folded = Sheet::new(1e-5, 0.0);
    let one = folded.plain();
    let n = one.stiffness.matrix.n_cols();
    let twice = |matrix: &CscMatrix| {
        let entries: Vec<(u32, u32, f64)> = [0, n]
            .into_iter()
            .flat_map(|from| (0..n).map(move |j| (from, j)))
            .flat_map(|(from, j)| {
                let (rows, values) = matrix.column(j);
                rows.iter().zip(values).map(move |(&i, &v)| (i + from as u32, (j + from) as u32, v))
            })
            .collect();
        CscMatrix::from_triplets(2 * n, 2 * n, &entries)
    };
    let nodes = Nodes {
        ids: one.nodes.ids.iter().copied().chain(one.nodes.ids.iter().map(|id| id + 100)).collect(),
        positions: one.nodes.positions.repeat(2),
    };
    let labels =
        nodes.ids.iter().flat_map(|&node| (1..=6).map(move |direction| DofLabel { node, direction }));
    let (k, m) = (twice(&one.stiffness.matrix), twice(&one.mass.matrix));
    let dofs = Some(labels.collect());
    let raw = RawModel { dofs, ..RawModel::in_memory("sheets", k, m, nodes) };
    let bodies = FeModel::bodies_from_raw(raw).expect("two bodies");
    let whole = FeModel::from_raw(one).expect("a body").model;
    let expected = converted(&whole, 6, Method::Dense);
    for body in &bodies {
        let found = converted(&body.model, 6, Method::Dense);
        assert_eq!(found.body.modes().eigenvalue, expected.body.modes().eigenvalue);
        let effect = |conversion: &Conversion| {
            find(&conversion.diagnostics, Code::SoftRotationsEffect).map(str::to_owned)
        };
        assert_eq!(effect(&found), effect(&expected));
        assert!(effect(&found).is_some());
    }
}
