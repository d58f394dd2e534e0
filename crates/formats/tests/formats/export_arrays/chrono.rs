//! Format `chrono`: K, M and damping for boundary and internal nodes, and the gravity that Chrono forms from
//! them. The test reduces the files like `ChModalAssembly` and loads them with its automatic gravity.

use super::matrices::{Matrices, assert_is_the_body, of_rows, rigid};
use super::readers::matrix_market;
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::{BasisChoice, CraigBampton};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_formats::export::ExportOptions;
use flexbody_formats::{export, find_format};
use flexbody_linalg::CscMatrix;
use flexbody_model::{Coupling, NodeSet};
use nalgebra::{DMatrix, DVector, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::exported::{body_of, exported, jointed_bodies};
use oracle::general::dense;
use oracle::mesh::{Assembly, Mesh, entries};
use std::collections::BTreeMap;

/// The files of an export.
struct Files {
    remark: String,
    /// Positions of the boundary nodes, one per row.
    origins: DMatrix<f64>,
    matrices: BTreeMap<String, DMatrix<f64>>,
}

impl Files {
    fn of(body: &FlexBody) -> Self {
        let done = exported(body, "chrono", None).expect("writes");
        let table = String::from_utf8(done.file).expect("UTF-8");
        let mut lines = table.lines();
        let remark = lines.next().expect("a remark").to_owned();
        assert_eq!(lines.next(), Some("name,x,y,z"));
        let row = |line: &str| {
            let mut numbers: Vec<f64> =
                line.rsplitn(4, ',').take(3).map(|v| v.parse().expect("a number")).collect();
            numbers.reverse();
            numbers
        };
        let origins = of_rows(&lines.map(row).collect::<Vec<_>>());
        let file = |(ending, bytes): &(std::borrow::Cow<'static, str>, Vec<u8>)| {
            (ending.trim_end_matches(".mtx").to_owned(), of_rows(&matrix_market(bytes)))
        };
        Self { remark, origins, matrices: done.beside.iter().map(file).collect() }
    }

    /// Returns the number after these words of the remark.
    fn stated(&self, before: &str, after: &str) -> usize {
        let (_, rest) = self.remark.split_once(before).expect("its words");
        rest.split_once(after).map_or(rest, |(number, _)| number).parse().expect("a number")
    }
}

/// An assembly after `DoModalReduction` with Craig-Bampton and without static correction: boundary
/// coordinates, then modes of unit mass.
struct Reduced {
    n_boundary: usize,
    /// Transformation from reduced to full coordinates.
    basis: DMatrix<f64>,
    full_mass: DMatrix<f64>,
    mass: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    damping: Option<DMatrix<f64>>,
}

impl Reduced {
    fn of(files: &Files, n_modes: usize) -> Self {
        let (m, k) = (&files.matrices["M"], &files.matrices["K"]);
        let nb = 6 * files.origins.nrows();
        let ni = m.nrows() - nb;
        assert_eq!((ni % 6, ni / 6), (0, files.stated("then ", " internal nodes")));
        let inner = |a: &DMatrix<f64>| a.view((nb, nb), (ni, ni)).into_owned();
        // The eigensolvers of Chrono require fewer modes than coordinates, and a positive definite mass.
        assert!(n_modes < ni && inner(m).cholesky().is_some());
        let held = inner(k).cholesky().expect("internal nodes are held by the boundary");
        let static_modes = -held.solve(&k.view((nb, 0), (ni, nb)).into_owned());
        // Fixed-interface modes by decreasing 1 / lambda: the lowest come first.
        let l = held.l();
        let half = l.solve_lower_triangular(&inner(m)).expect("regular");
        let inverse = l.solve_lower_triangular(&half.transpose()).expect("regular");
        let eigen = inverse.symmetric_eigen();
        let mut order: Vec<usize> = (0..ni).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let mut modes = DMatrix::zeros(ni, n_modes);
        for (column, &at) in order.iter().take(n_modes).enumerate() {
            let shape = l.tr_solve_lower_triangular(&eigen.eigenvectors.column(at)).expect("regular");
            modes.set_column(column, &(shape / eigen.eigenvalues[at].sqrt()));
        }
        let mut basis = DMatrix::zeros(nb + ni, nb + n_modes);
        basis.view_mut((0, 0), (nb, nb)).fill_with_identity();
        basis.view_mut((nb, 0), (ni, nb)).copy_from(&static_modes);
        basis.view_mut((nb, nb), (ni, n_modes)).copy_from(&modes);
        let of = |a: &DMatrix<f64>| basis.transpose() * a * &basis;
        let damping = files.matrices.get("R").map(of);
        Self { n_boundary: nb, mass: of(m), stiffness: of(k), full_mass: m.clone(), damping, basis }
    }

    /// Returns the generalised forces of automatic gravity: M times g on the translations of all nodes, of
    /// which Chrono keeps the rows of translations.
    fn gravity(&self, g: &Vector3<f64>) -> DVector<f64> {
        let on_nodes =
            DVector::from_fn(self.full_mass.nrows(), |i, _| if i % 6 < 3 { g[i % 6] } else { 0.0 });
        let mut force = &self.full_mass * on_nodes;
        force.iter_mut().enumerate().filter(|(i, _)| i % 6 >= 3).for_each(|(_, v)| *v = 0.0);
        self.basis.transpose() * force
    }

    /// Returns the displacements under gravity of a body with its first node clamped.
    fn hanging(&self, g: &Vector3<f64>) -> DVector<f64> {
        let n = self.stiffness.nrows() - 6;
        let free = self.stiffness.view((6, 6), (n, n)).into_owned();
        free.cholesky().expect("clamped").solve(&self.gravity(g).rows(6, n).into_owned())
    }

    /// Returns the transformation from reduced coordinates to coordinates of the body: those of the
    /// interfaces, then the amplitudes that the internal nodes represent by the documentation of the format.
    fn of_body(&self, n_modes: usize, mass: f64) -> DMatrix<f64> {
        let nb = self.n_boundary;
        DMatrix::from_fn(nb + n_modes, self.basis.ncols(), |i, j| {
            if i < nb {
                return self.basis[(i, j)];
            }
            let at = 3 + i - nb;
            let carried = if at % 6 < 3 { self.basis[(nb + at % 6, j)] } else { 0.0 };
            mass.sqrt() * (self.basis[(nb + at, j)] - carried)
        })
    }
}

const DIRECTIONS: [Vector3<f64>; 4] = [
    Vector3::new(9.81, 0.0, 0.0),
    Vector3::new(0.0, -9.81, 0.0),
    Vector3::new(0.0, 0.0, 9.81),
    Vector3::new(-3.0, 5.0, 7.0),
];

#[test]
fn chrono_reduces_the_files_to_the_matrices_of_the_body() {
    for (name, body) in jointed_bodies() {
        let files = Files::of(body);
        let coordinates = body.coordinates().expect("jointed");
        let n_modes = coordinates.names.len() - 6 * files.origins.nrows();
        assert_eq!(files.stated("modes to request: ", "\n"), n_modes);
        let reduced = Reduced::of(&files, n_modes);
        let back = reduced.of_body(n_modes, body.invariants().mass()).try_inverse().expect("a basis");
        let mut matrices = Matrices::from([("P0".to_owned(), files.origins.clone())]);
        for (own, matrix) in
            [("K", Some(&reduced.stiffness)), ("M", Some(&reduced.mass)), ("C", reduced.damping.as_ref())]
        {
            if let Some(matrix) = matrix {
                matrices.insert(own.to_owned(), back.transpose() * matrix * &back);
            }
        }
        assert_is_the_body(name, body, &matrices);
        for (own, matrix) in [("K", &coordinates.stiffness), ("M", &coordinates.mass)] {
            let (own, found) = (dense(matrix), &matrices[own]);
            let worst = (0..own.nrows()).flat_map(|i| (0..own.nrows()).map(move |j| (i, j)));
            let worst = worst
                .map(|(i, j)| (found[(i, j)] - own[(i, j)]).abs() / (own[(i, i)] * own[(j, j)]).sqrt())
                .fold(0.0, f64::max);
            assert!(worst < 1e-9, "{name}: {worst:e}");
        }
    }
}

#[test]
fn automatic_gravity_of_chrono_is_that_of_the_body() {
    for (name, body) in jointed_bodies() {
        let files = Files::of(body);
        let own = dense(&body.coordinates().expect("jointed").mass);
        let n_modes = own.nrows() - 6 * files.origins.nrows();
        let reduced = Reduced::of(&files, n_modes);
        let rigid = rigid(&files.origins, own.nrows());
        let (mass, moment) = (body.invariants().mass(), body.invariants().first_moment());
        let to_body = reduced.of_body(n_modes, mass);
        for g in DIRECTIONS {
            // Weight and torque about the origin of the body frame.
            let force = rigid.transpose() * reduced.gravity(&g);
            let size = mass * g.norm();
            let reach = files.origins.amax();
            assert!((force.rows(0, 3) - mass * g).amax() <= 1e-10 * size, "{name}: weight {g}");
            assert!(
                (force.rows(3, 3) - moment.cross(&g)).amax() <= 1e-9 * size * reach,
                "{name}: torque {g}"
            );
            // Forces on all coordinates, each compared with its effect in rigid motion.
            let load = DVector::from_fn(rigid.nrows(), |i, _| (0..3).map(|a| rigid[(i, a)] * g[a]).sum());
            let expected = to_body.transpose() * (&own * load);
            let found = reduced.gravity(&g);
            for i in 0..found.len() {
                let scale = (own[(i, i)] * mass).sqrt() * g.norm();
                assert!((found[i] - expected[i]).abs() <= 1e-9 * scale, "{name}: force {i} of {g}");
            }
        }
    }
}

/// A steel cantilever of 1 m, in m, kg, s or, with `per_metre` = 1000, in mm, t, s.
struct Cantilever {
    assembly: Assembly,
    size: [f64; 3],
}

impl Cantilever {
    fn new(per_metre: f64) -> Self {
        let steel = Material::STEEL;
        let mass_unit = if per_metre == 1.0 { 1.0 } else { 1e-3 };
        let material = Material {
            youngs: steel.youngs / per_metre.powi(2),
            density: mass_unit * steel.density / per_metre.powi(3),
            ..steel
        };
        let size = [1.0, 0.04, 0.05].map(|v| v * per_metre);
        let assembly =
            Mesh::block(ElementKind::Hex20, [8, 1, 1], size).assemble(&material, MassRule::Consistent);
        Self { assembly, size }
    }

    /// Returns the indices of the nodes at a position along the axis.
    fn section(&self, at: f64) -> Vec<usize> {
        let near = |x: &[f64; 3]| (x[0] - at).abs() < 1e-9 * self.size[0];
        (0..self.assembly.nodes.len()).filter(|&i| near(&self.assembly.nodes[i])).collect()
    }

    fn body(&self) -> FlexBody {
        let mut raw = self.assembly.raw_model();
        raw.data.interfaces = [("root", 0.0), ("tip", self.size[0])]
            .map(|(name, at)| {
                let nodes = self.section(at).iter().map(|&i| i as i64 + 1).collect();
                NodeSet { coupling: Some(Coupling::Rigid), ..NodeSet::new(name, nodes) }
            })
            .into();
        body_of(raw, BasisChoice::CraigBampton(CraigBampton), BodyFrame::Com)
    }

    /// Returns the displacement of the centre of the rigid tip under gravity from the matrices of all nodes,
    /// with the root clamped.
    fn tip(&self, g: &Vector3<f64>) -> Vector3<f64> {
        let [root, tip] = [self.section(0.0), self.section(self.size[0])];
        let nodes = &self.assembly.nodes;
        let inner: Vec<usize> = (0..nodes.len()).filter(|i| !root.contains(i) && !tip.contains(i)).collect();
        let mut motions = DMatrix::zeros(3 * nodes.len(), 3 * inner.len() + 6);
        for (at, node) in inner.iter().enumerate() {
            motions.view_mut((3 * node, 3 * at), (3, 3)).fill_with_identity();
        }
        let centre = Vector3::new(self.size[0], self.size[1] / 2.0, self.size[2] / 2.0);
        for &node in &tip {
            let arm = Vector3::from(nodes[node]) - centre;
            motions.view_mut((3 * node, 3 * inner.len()), (3, 3)).fill_with_identity();
            motions.view_mut((3 * node, 3 * inner.len() + 3), (3, 3)).copy_from(&-arm.cross_matrix());
        }
        let full = |matrix: &CscMatrix| {
            let mut all = DMatrix::zeros(matrix.n_rows(), matrix.n_cols());
            entries(matrix).for_each(|(i, j, v)| all[(i as usize, j as usize)] += v);
            all
        };
        let load = full(&self.assembly.mass()) * DVector::from_fn(3 * nodes.len(), |i, _| g[i % 3]);
        let stiffness = motions.transpose() * full(&self.assembly.stiffness) * &motions;
        let moved = stiffness.cholesky().expect("clamped").solve(&(motions.transpose() * load));
        moved.fixed_rows::<3>(3 * inner.len()).into_owned()
    }
}

#[test]
fn a_cantilever_hangs_as_far_as_its_nodes_in_m_and_in_mm() {
    for per_metre in [1.0, 1000.0] {
        let cantilever = Cantilever::new(per_metre);
        let files = Files::of(&cantilever.body());
        let reduced = Reduced::of(&files, files.stated("modes to request: ", "\n"));
        for direction in DIRECTIONS {
            let g = per_metre * direction;
            let (own, found) = (cantilever.tip(&g), reduced.hanging(&g));
            let apart = (found.rows(0, 3) - own).amax() / own.amax();
            assert!(apart < 1e-7, "{per_metre} along {direction}: {apart:e}");
        }
    }
}

#[test]
fn the_settings_that_gravity_needs_are_told() {
    let (name, body) = &jointed_bodies()[0];
    let format = find_format("chrono").expect("a format");
    let (_, told) = export(body, format, &ExportOptions::default(), true).expect("allowed");
    let notes: Vec<&str> =
        told.iter().filter(|d| d.code() == Code::ExportNeeds).map(|d| d.message()).collect();
    assert!(notes.iter().any(|note| note.contains("must request 7 modes")), "{name}: {notes:?}");
    assert!(notes.iter().any(|note| note.contains("SetModalAutomaticGravity(true)")), "{name}: {notes:?}");
}
