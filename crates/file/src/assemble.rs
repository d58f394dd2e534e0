//! Puts the values of a file together to the parts of a body.

use super::scan::Scan;
use super::schema::terms::KEPT;
use super::value::Value;
use faer::Mat;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{
    Certificate, FixedInterface, Frame, GeometricStiffness, Guarantee, Interface, InterfaceCoordinates,
    InternalRows, LumpedBody, MassStructure, Modes, Parts, ReferenceConditions, Source, SurfaceMesh,
    TermDecision, TermGroup, TermGroups, UnitLoad,
};
use flexbody_body::invariants::{
    DIGITS, GeneralTerms, InertiaStiffness, Invariants, PrimaryData, ibar_of_c2, s_of_modal_mass,
};
use flexbody_model::{BodyNumber, Coupling, NodeMoments, Nodes};
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;

/// The parts; `None` when texts or counts mean nothing, which is then among the problems of `scan`.
///
/// `scan` had no problems before, so every required entry is there, of its kind and with its shape.
pub(super) fn assemble(scan: &mut Scan, units: UnitSystem) -> Option<Parts> {
    let mut take = Take { scan };
    let dimension = take.count("/@dimension");
    let source = take.source();
    let frame = Frame {
        origin: Vector3::from_column_slice(&take.floats("/frame/origin")),
        axes: Matrix3::from_row_slice(&take.floats("/frame/axes")),
    };
    let conditions = take.reference_conditions();
    let nodes = Nodes {
        ids: take.ints("/nodes/id"),
        positions: take.floats("/nodes/position").as_chunks().0.to_vec(),
    };
    let mesh = take.mesh(nodes.len());
    let modes = take.modes(nodes.len());
    let nf = modes.eigenvalue.len();
    let groups = take.scan.held()?;
    let invariants = take.invariants("/invariants", nf, dimension == 2, groups);
    let geometric_stiffness = take.geometric_stiffness("/geometric_stiffness", nf);
    let inertia_stiffness = take.inertia_stiffness(nf);
    let lumped = take.lumped(nf, dimension == 2, groups);
    let terms = take.terms();
    let certificate = take.certificate();
    let interfaces = take.interfaces(&nodes);
    let coordinates = take.coordinates(nf);
    let source = source.filter(|_| scan.problems.is_empty())?;
    Some(Parts {
        source,
        dimension,
        units,
        frame,
        conditions,
        nodes,
        mesh,
        modes,
        invariants,
        geometric_stiffness,
        inertia_stiffness,
        lumped,
        certificate,
        interfaces,
        coordinates,
        terms,
        storage: scan.storage,
    })
}

/// Paths of the moments that the stiffness of inertia follows from.
const ROTATIONAL_FIRST_MOMENT: &str = "/nodes/rotational_first_moment";
const ROTATIONAL_SECOND_MOMENT: &str = "/nodes/rotational_second_moment";

/// Stiffness of inertia in the order of [`InertiaStiffness::loads`]; members of a file may come in any.
fn in_order(mut stiffness: Vec<GeometricStiffness<Mat<f64>>>) -> Vec<GeometricStiffness<Mat<f64>>> {
    let order: Vec<UnitLoad> = InertiaStiffness::loads(3).collect();
    stiffness.sort_by_key(|one| order.iter().position(|load| *load == one.load));
    stiffness
}

/// Moves values out of a scan.
struct Take<'a> {
    scan: &'a mut Scan,
}

impl Take<'_> {
    fn floats(&mut self, path: &str) -> Vec<f64> {
        match self.scan.values.remove(path) {
            Some(Value::Floats(values)) => values,
            other => unreachable!("scan without problems has {other:?} as {path}"),
        }
    }

    fn optional_floats(&mut self, path: &str) -> Option<Vec<f64>> {
        self.scan.values.contains_key(path).then(|| self.floats(path))
    }

    fn optional_text(&mut self, path: &str) -> Option<String> {
        self.scan.values.contains_key(path).then(|| self.text(path))
    }

    fn ints(&mut self, path: &str) -> Vec<i64> {
        match self.scan.values.remove(path) {
            Some(Value::Ints(values)) => values,
            other => unreachable!("scan without problems has {other:?} as {path}"),
        }
    }

    fn text(&mut self, path: &str) -> String {
        match self.scan.values.remove(path) {
            Some(Value::Text(text)) => text,
            other => unreachable!("scan without problems has {other:?} as {path}"),
        }
    }

    fn float(&mut self, path: &str) -> f64 {
        match self.scan.values.remove(path) {
            Some(Value::Float(value)) => value,
            other => unreachable!("scan without problems has {other:?} as {path}"),
        }
    }

    fn optional_float(&mut self, path: &str) -> Option<f64> {
        self.scan.values.contains_key(path).then(|| self.float(path))
    }

    /// A count that may be absent; negative ones are problems.
    fn optional_count(&mut self, path: &str) -> Option<usize> {
        let Some(Value::Int(value)) = self.scan.values.remove(path) else { return None };
        let count = usize::try_from(value).ok();
        if count.is_none() {
            self.scan.add(format!("{path}: expected a count, found {value}"));
        }
        count
    }

    /// A count that the table requires; 0 in place of a negative one, which is a problem.
    fn count(&mut self, path: &str) -> usize {
        self.optional_count(path).unwrap_or(0)
    }

    /// Rows of a matrix.
    fn matrix(&mut self, path: &str, columns: usize) -> Mat<f64> {
        let values = self.floats(path);
        Mat::from_fn(values.len() / columns, columns, |i, j| values[i * columns + j])
    }

    fn json<T: serde::de::DeserializeOwned>(&mut self, path: &str, expected: &str) -> Option<T> {
        let text = self.text(path);
        let parsed = serde_json::from_str(&text);
        if let Err(e) = &parsed {
            self.scan.add(format!("{path}: expected {expected}, found text that is not ({e})"));
        }
        parsed.ok()
    }

    /// An empty list where nothing is stored.
    fn optional_json<T: serde::de::DeserializeOwned>(&mut self, path: &str, expected: &str) -> Vec<T> {
        let stored = self.scan.values.contains_key(path);
        stored.then(|| self.json(path, expected)).flatten().unwrap_or_default()
    }

    fn source(&mut self) -> Option<Source> {
        let name = self.text("/source@model");
        let files = self.json("/source@files", "a JSON array of files");
        let number = self.number();
        let n_dofs = self.count("/source@n_dofs");
        let structure = self.text("/source@mass_structure");
        let mass_structure = MassStructure::from_name(&structure);
        if mass_structure.is_none() {
            let known = MassStructure::ALL.map(|structure| format!("`{}`", structure.name())).join(", ");
            self.scan.add(format!("/source@mass_structure: expected one of {known}, found {structure:?}"));
        }
        let approximation = self.optional_text("/source@approximation");
        let settings = self.json("/source@settings", "JSON");
        Some(Source {
            name,
            files: files?,
            number,
            n_dofs,
            mass_structure: mass_structure?,
            approximation,
            settings: settings?,
        })
    }

    /// Reference conditions; mean axes if the file does not state them.
    fn reference_conditions(&mut self) -> ReferenceConditions {
        const PATH: &str = "/frame@reference_conditions";
        let Some(stated) = self.optional_text(PATH) else { return ReferenceConditions::MeanAxes };
        ReferenceConditions::from_text(&stated).unwrap_or_else(|| {
            self.scan.add(format!(
                "{PATH}: expected `mean axes`, `interface NAME` or `not stated`, found {stated:?}"
            ));
            ReferenceConditions::MeanAxes
        })
    }

    /// Number of the body and count of bodies: the file has both or neither.
    fn number(&mut self) -> Option<BodyNumber> {
        let paths = ["/source@body_number", "/source@bodies"];
        let there = paths.map(|path| self.scan.values.contains_key(path));
        let [number, of] = paths.map(|path| self.optional_count(path));
        if there[0] != there[1] {
            self.scan.add(format!("{} and {}: expected both or none, found one", paths[0], paths[1]));
        }
        Some(BodyNumber { number: number?, of: of? })
    }

    /// The surface on `n` nodes, where there is one.
    fn mesh(&mut self, n: usize) -> Option<SurfaceMesh> {
        let [triangles, edges] = ["/mesh/triangles", "/mesh/edges"].map(|path| self.indices(path));
        if triangles.is_none() && edges.is_none() {
            return None;
        }
        let triangles = triangles.unwrap_or_default().as_chunks().0.to_vec();
        let edges = edges.unwrap_or_default().as_chunks().0.to_vec();
        SurfaceMesh::new(triangles, edges, n)
            .map_err(|problem| self.scan.add(format!("/mesh: {problem}")))
            .ok()
    }

    /// Indices of nodes, where they are stored; negative ones are problems.
    fn indices(&mut self, path: &str) -> Option<Vec<u32>> {
        let Some(Value::Indices(values)) = self.scan.values.remove(path) else { return None };
        if let Some(negative) = values.iter().find(|&&index| index < 0) {
            self.scan.add(format!("{path}: expected indices of nodes, found {negative}"));
        }
        // Negative ones become such that no body has.
        Some(values.into_iter().map(i32::cast_unsigned).collect())
    }

    fn modes(&mut self, n: usize) -> Modes {
        let eigenvalue = self.floats("/modes/eigenvalue");
        let shape = self.floats("/modes/shape");
        let provenance = self.optional_json("/modes@provenance", "a JSON array of texts");
        let truncation = self.optional_json("/modes@truncation", "a JSON array of loads");
        let damping = "/invariants/modal_damping";
        let damped = self.scan.values.contains_key(damping);
        let nf = eigenvalue.len();
        let by_node = |shape: &[f64]| Mat::from_fn(3 * n, nf, |row, j| shape[j * 3 * n + row]);
        let turned = self.scan.values.contains_key("/modes/rotation");
        let rotation = turned.then(|| by_node(&self.floats("/modes/rotation")));
        let internal = self.internal(nf);
        Modes {
            residual: self.floats("/modes/residual"),
            provenance,
            truncation,
            damping_ratio: self.floats("/modes/damping_ratio"),
            modal_damping: damped.then(|| self.matrix(damping, nf)),
            shape: by_node(&shape),
            rotation,
            internal,
            eigenvalue,
        }
    }

    /// Labels and values of the rows without a place, or neither.
    fn internal(&mut self, nf: usize) -> Option<InternalRows> {
        let [labels, values] = ["/modes/internal_dof", "/modes/internal"];
        let there = [labels, values].map(|path| self.scan.values.contains_key(path));
        if there != [true; 2] {
            if there[0] != there[1] {
                self.scan.add(format!("{labels} and {values}: expected both or none, found one"));
            }
            return None;
        }
        let dofs = self.ints(labels).as_chunks::<2>().0.to_vec();
        Some(InternalRows { dofs, shape: self.matrix(values, nf) })
    }

    fn invariants(&mut self, place: &str, nf: usize, plane: bool, groups: TermGroups) -> Invariants {
        let path = |name: &str| format!("{place}/{name}");
        let block = |k: usize, l: usize| 3 * k + l;
        let w0 = path("W0");
        // Elsewhere W3 and m_ff follow from S, and C2 from Ibar, and are compared with them.
        let general = self.scan.values.contains_key(&w0).then(|| GeneralTerms {
            w0: self.matrix(&w0, 3 * nf),
            w3: if groups.w3 { self.matrix(&path("W3"), nf) } else { Mat::zeros(3 * nf, nf) },
            modal_mass: self.matrix(&path("modal_mass"), nf),
            plane,
        });
        let ibar = match groups.w1 {
            true => {
                let ibar = self.floats(&path("Ibar"));
                [0, 1, 2].map(|k| [0, 1, 2].map(|l| ibar[block(k, l) * nf..][..nf].to_vec()))
            }
            false => ibar_of_c2(&self.matrix(&path("C2"), nf)),
        };
        let s = match (groups.w2, &general) {
            (true, _) => {
                let s = self.floats(&path("S"));
                let entry = |k, l, i, j| s[(block(k, l) * nf + i) * nf + j];
                [0, 1, 2].map(|k| [0, 1, 2].map(|l| Mat::from_fn(nf, nf, |i, j| entry(k, l, i, j))))
            }
            (false, Some(_)) => s_of_modal_mass(nf, None, None),
            (false, None) => {
                let modal_mass = self.matrix(&path("modal_mass"), nf);
                let w3 = groups.w3.then(|| self.matrix(&path("W3"), nf));
                s_of_modal_mass(nf, Some(&modal_mass), w3.as_ref())
            }
        };
        Invariants::new(PrimaryData {
            general,
            mass: self.floats(&path("mass"))[0],
            first_moment: Vector3::from_column_slice(&self.floats(&path("first_moment"))),
            second_moment: Matrix3::from_row_slice(&self.floats(&path("second_moment"))),
            c1: self.matrix(&path("C1"), nf),
            ibar,
            s,
            modal_stiffness: self.matrix(&path("modal_stiffness"), nf),
            groups,
        })
    }

    /// Stiffness of inertia, where the file has it: the moments of the nodes and the matrices.
    fn inertia_stiffness(&mut self, nf: usize) -> Option<InertiaStiffness> {
        let [first, second] =
            [ROTATIONAL_FIRST_MOMENT, ROTATIONAL_SECOND_MOMENT].map(|path| self.optional_floats(path));
        let stiffness = self.geometric_stiffness("/inertia_stiffness", nf);
        let (first, second) = match (first, second, stiffness.is_empty()) {
            (None, None, true) => return None,
            (Some(first), Some(second), false) => (first, second),
            _ => {
                self.scan.add(format!(
                    "{ROTATIONAL_FIRST_MOMENT}, {ROTATIONAL_SECOND_MOMENT}, /inertia_stiffness: expected all or none, found some"
                ));
                return None;
            }
        };
        let moments = first.chunks_exact(3).zip(second.chunks_exact(9)).map(|(first, second)| NodeMoments {
            first: Vector3::from_column_slice(first),
            second: Matrix3::from_row_slice(second),
        });
        Some(InertiaStiffness { moments: moments.collect(), stiffness: in_order(stiffness) })
    }

    fn geometric_stiffness(&mut self, parent: &str, nf: usize) -> Vec<GeometricStiffness<Mat<f64>>> {
        let mut out = Vec::new();
        for (label, link) in self.scan.instances(parent) {
            let place = format!("{parent}/{link}");
            let matrix = self.matrix(&format!("{place}/stiffness"), nf);
            match UnitLoad::from_label(&label) {
                Some(load) => out.push(GeometricStiffness { load, matrix }),
                None => self.scan.add(format!("{place}: expected a kind of load with its axis or name")),
            }
        }
        out
    }

    /// What was decided about each group, where it was.
    fn terms(&mut self) -> Vec<TermDecision> {
        TermGroup::ALL.into_iter().filter_map(|group| self.term(group)).collect()
    }

    fn term(&mut self, group: TermGroup) -> Option<TermDecision> {
        let path = |name: &str| format!("/terms@{}_{name}", group.name());
        let [reason, tier, bound, limit] = ["reason", "tier", "bound", "limit"].map(path);
        let there = |path: &String| self.scan.values.contains_key(path);
        if !there(&reason) || !there(&tier) {
            if let Some(first) = [&reason, &tier, &bound, &limit].into_iter().find(|path| there(path)) {
                self.scan.add(format!("{first}: expected with {reason} and {tier}, one of which is missing"));
            }
            return None;
        }
        let kept = self.text(&format!("/terms@{}", group.name())) == KEPT;
        let number = self.optional_count(&tier)?;
        let Ok(tier) = u8::try_from(number) else {
            self.scan.add(format!("{tier}: expected 0, 1 or 2, found {number}"));
            return None;
        };
        let mut size = |path: &str| match self.scan.values.remove(path) {
            Some(Value::Float(value)) => value,
            _ => f64::INFINITY,
        };
        Some(TermDecision {
            group,
            kept,
            tier,
            bound: size(&bound),
            limit: size(&limit),
            reason: self.text(&reason),
        })
    }

    fn lumped(&mut self, nf: usize, plane: bool, groups: TermGroups) -> Vec<LumpedBody> {
        let mut out = Vec::new();
        for (scheme, link) in self.scan.instances("/lumped") {
            let place = format!("/lumped/{link}");
            let comparison = match self.scan.values.remove(&format!("/comparison/{link}@<norm>")) {
                Some(Value::Named(values)) => values,
                other => unreachable!("scan without problems has {other:?} as norms of {link}"),
            };
            let negative_masses = self.count(&format!("{place}@negative_masses"));
            let invariants = self.invariants(&place, nf, plane, groups);
            out.push(LumpedBody { scheme, invariants, negative_masses, comparison });
        }
        out
    }

    fn certificate(&mut self) -> Certificate {
        Certificate {
            proved_modes: self.optional_count("/certificate@proved_modes"),
            shift: self.float("/certificate@shift"),
            negative_pivots: self.optional_count("/certificate@negative_pivots"),
            rigid_modes: self.count("/certificate@rigid_modes"),
            remark: self.text("/certificate@remark"),
            rigid_noise: self.float("/certificate@rigid_noise"),
            rigid_residual: self.float("/certificate@rigid_residual"),
            eigenvalue_rounding: self.optional_float("/certificate@eigenvalue_rounding").unwrap_or(0.0),
            inertia_rounding: self.optional_float("/certificate@inertia_rounding").unwrap_or(0.0),
            guarantee: self.guarantee(),
            fixed_interface: self.fixed_interface(),
        }
    }

    /// All of what a Craig-Bampton body has, or nothing of it.
    fn fixed_interface(&mut self) -> Option<FixedInterface> {
        let [modes, motions, shift, residual] = [
            "fixed_interface_modes",
            "interface_motions",
            "fixed_interface_shift",
            "fixed_interface_residual",
        ]
        .map(|name| format!("/certificate@{name}"));
        let columns = ["free_eigenvalue", "free_eigenvalue_lower"].map(|name| format!("/modes/{name}"));
        if !self
            .whole(&[&modes, &motions, &shift, &residual, &columns[0], &columns[1]], "a Craig-Bampton body")
        {
            return None;
        }
        let [free_estimate, free_lower] = columns.map(|name| self.floats(&name));
        Some(FixedInterface {
            modes: self.count(&modes),
            interface_motions: self.count(&motions),
            counted: self.optional_count("/certificate@fixed_interface_counted"),
            shift: self.float(&shift),
            next: self.optional_float("/certificate@fixed_interface_next"),
            residual: self.float(&residual),
            free_estimate,
            free_lower,
        })
    }

    /// Whether all of these entries are there; a part of them is a problem.
    fn whole(&mut self, names: &[&String], what: &str) -> bool {
        let missing: Vec<&&String> =
            names.iter().filter(|name| !self.scan.values.contains_key(**name)).collect();
        if let Some(first) = missing.first()
            && missing.len() < names.len()
        {
            self.scan.add(format!("{first}: expected with the other entries of {what}, found nothing"));
        }
        missing.is_empty()
    }

    /// All of what accuracy `certified` adds, or nothing of it.
    fn guarantee(&mut self) -> Option<Guarantee> {
        let digits = DIGITS.map(|name| format!("/certificate@digits_{name}"));
        let columns = ["eigenvalue_lower", "eigenvalue_upper", "shape_error"].map(|n| format!("/modes/{n}"));
        let counts = ["shift_below", "negative_pivots_below"].map(|n| format!("/certificate@{n}"));
        let names: Vec<&String> = digits.iter().chain(&columns).chain(&counts).collect();
        if !self.whole(&names, "accuracy `certified`") {
            return None;
        }
        let [eigenvalue_lower, eigenvalue_upper, shape_error] = columns.map(|name| self.floats(&name));
        Some(Guarantee {
            shift_below: self.float(&counts[0]),
            pivots_below: self.count(&counts[1]),
            eigenvalue_lower,
            eigenvalue_upper,
            shape_error,
            digits: digits.map(|name| self.float(&name)),
        })
    }

    fn interfaces(&mut self, body: &Nodes) -> Vec<Interface> {
        let index: HashMap<i64, usize> = body.ids.iter().enumerate().map(|(i, &id)| (id, i)).collect();
        let mut out = Vec::new();
        for (name, link) in self.scan.instances("/interfaces") {
            let path = format!("/interfaces/{link}/node_id");
            let ids = self.ints(&path);
            if let Some(id) = ids.iter().find(|id| !index.contains_key(id)) {
                self.scan.add(format!("{path}: expected nodes of /nodes/id, found {id}"));
            }
            let nodes = ids.iter().filter_map(|id| index.get(id).copied()).collect();
            let coupling = self.coupling(&format!("/interfaces/{link}@coupling"));
            let reference = self.optional_floats(&format!("/interfaces/{link}/reference"));
            let reference = reference.and_then(|x| x.try_into().ok());
            out.push(Interface { name, nodes, coupling, reference });
        }
        out
    }

    fn coupling(&mut self, path: &str) -> Option<Coupling> {
        let Some(Value::Text(name)) = self.scan.values.remove(path) else { return None };
        let coupling = Coupling::from_name(&name);
        if coupling.is_none() {
            let known = Coupling::ALL.map(|coupling| format!("`{}`", coupling.name())).join(", ");
            self.scan.add(format!("{path}: expected one of {known}, found {name:?}"));
        }
        coupling
    }

    /// All of the interface coordinates, or nothing of them.
    fn coordinates(&mut self, nf: usize) -> Option<InterfaceCoordinates> {
        let names = "/interface_coordinates@names";
        let matrices = ["stiffness", "mass", "of_modes"].map(|name| format!("/interface_coordinates/{name}"));
        let there = |path: &str| self.scan.values.contains_key(path);
        let count = matrices.iter().filter(|path| there(path)).count() + usize::from(there(names));
        if count < 1 + matrices.len() {
            if count > 0 {
                let expected = "/interface_coordinates: expected `names`, `stiffness`, `mass` and `of_modes`";
                self.scan.add(format!("{expected}, found {count} of them"));
            }
            return None;
        }
        let names: Vec<String> = self.json(names, "a JSON array of texts")?;
        let [stiffness, mass, of_modes] = matrices.map(|path| self.floats(&path));
        if stiffness.len() != names.len().pow(2) {
            let found = format!("found {} for {} numbers in `stiffness`", names.len(), stiffness.len());
            self.scan
                .add(format!("/interface_coordinates@names: expected a name for each coordinate, {found}"));
            return None;
        }
        let matrix = |values: Vec<f64>, columns: usize| {
            Mat::from_fn(values.len() / columns, columns, |i, j| values[i * columns + j])
        };
        let size = names.len();
        Some(InterfaceCoordinates {
            names,
            stiffness: matrix(stiffness, size),
            mass: matrix(mass, size),
            of_modes: matrix(of_modes, nf),
        })
    }
}
