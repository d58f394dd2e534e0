//! A body that is made entry by entry: the rows of the table put their values into it.

use super::per::Per;
use super::value::ReadValue;
use faer::Mat;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{
    Certificate, FixedInterface, Frame, FreeEstimate, GeometricStiffness, Guarantee, Interface,
    InterfaceCoordinates, InternalRows, LoadColumns, LoadKind, LumpedBody, MassStructure, Modes, NamedLoad,
    Parts, Recovery, ReferenceConditions, RotatedStiffness, Source, Storage, SurfaceMesh, TermDecision,
    TermGroup, TermGroups, UnitLoad,
};
use flexbody_body::invariants::{
    DIGITS, GeneralTerms, InertiaStiffness, Invariants, PrimaryData, ibar_of_c2, s_of_modal_mass,
};
use flexbody_model::{BodyNumber, Description, Nodes};
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;

/// A body with the entries put so far; all others are empty.
pub(super) struct Draft {
    /// Body without its invariants and its surface.
    pub body: Parts,
    /// Number nc of interface coordinates; `None` if the file has no matrix of them.
    pub n_coordinates: Option<usize>,
    pub triangles: Option<Vec<u32>>,
    pub edges: Option<Vec<u32>>,
    /// Indices of the nodes by node number.
    pub index: HashMap<i64, usize>,
    /// Names of the columns of named loads, for each recovery.
    named_columns: Vec<Vec<String>>,
    invariants: InvariantEntries,
    of_lumped: Vec<InvariantEntries>,
    /// Group whose entries are put, and the index of its instance.
    per: Per,
    at: usize,
}

impl Draft {
    pub(super) fn new(units: UnitSystem, storage: Storage, groups: TermGroups) -> Self {
        let invariants = InvariantEntries::new().finish(0, false, groups);
        Self {
            body: empty_body(units, storage, invariants),
            n_coordinates: None,
            triangles: None,
            edges: None,
            index: HashMap::new(),
            named_columns: Vec::new(),
            invariants: InvariantEntries::new(),
            of_lumped: Vec::new(),
            per: Per::Body,
            at: 0,
        }
    }

    /// Begins an instance of a group: entries of all later calls belong to it.
    ///
    /// # Errors
    /// The expected names, if `name` is none of them.
    pub(super) fn begin(&mut self, per: Per, at: usize, name: &str) -> Result<(), String> {
        (self.per, self.at) = (per, at);
        let unit_load =
            || UnitLoad::from_label(name).unwrap_or(UnitLoad { kind: LoadKind::Spin, component: 0 });
        let load = || GeometricStiffness { load: unit_load(), matrix: Mat::new() };
        match per {
            Per::Body => {}
            Per::LumpingScheme if at < self.of_lumped.len() => {}
            Per::LumpingScheme => {
                self.of_lumped.push(InvariantEntries::new());
                self.body.lumped.push(LumpedBody {
                    scheme: name.to_owned(),
                    invariants: self.body.invariants.clone(),
                    negative_masses: 0,
                    comparison: Vec::new(),
                });
            }
            Per::Interface => {
                let (nodes, coupling, reference) = (Vec::new(), None, None);
                self.body.interfaces.push(Interface { name: name.to_owned(), nodes, coupling, reference });
            }
            Per::Recovery => {
                self.named_columns.push(Vec::new());
                self.body.recoveries.push(Recovery {
                    name: name.to_owned(),
                    rows: Vec::new(),
                    offset: Vec::new(),
                    modes: Mat::new(),
                    spin: Mat::new(),
                    loads: Vec::new(),
                    named: Mat::new(),
                    motion: Vec::new(),
                });
            }
            Per::NamedLoad => self.body.named_loads.push(NamedLoad {
                name: name.to_owned(),
                preload: false,
                modal: Vec::new(),
                force: Vector3::zeros(),
                torque: Vector3::zeros(),
                moments: Matrix3::zeros(),
                turning: Mat::new(),
                compliance: None,
            }),
            Per::UnitLoad => self.body.geometric_stiffness.push(load()),
            Per::EstimatedLoad => self.body.estimated_stiffness.push(load()),
            Per::InertiaLoad => self.inertia().stiffness.push(load()),
            Per::RotatedLoad => self.body.rotated_stiffness.push(RotatedStiffness {
                load: unit_load(),
                modes: Mat::new(),
                rotation: Mat::new(),
            }),
        }
        let known = !matches!(per, Per::UnitLoad | Per::EstimatedLoad | Per::InertiaLoad | Per::RotatedLoad)
            || UnitLoad::from_label(name).is_some();
        if known { Ok(()) } else { Err("expected a kind of load with its axis or name".to_owned()) }
    }

    pub(super) fn nf(&self) -> usize {
        self.body.modes.eigenvalue.len()
    }

    pub(super) fn number(&mut self) -> &mut BodyNumber {
        self.body.description.number.get_or_insert(BodyNumber { number: 0, of: 0 })
    }

    pub(super) fn internal(&mut self) -> &mut InternalRows {
        let empty = || InternalRows { dofs: Vec::new(), shape: Mat::new() };
        self.body.modes.internal.get_or_insert_with(empty)
    }

    pub(super) fn inertia(&mut self) -> &mut InertiaStiffness {
        let empty = || InertiaStiffness { moments: Vec::new(), stiffness: Vec::new() };
        self.body.inertia_stiffness.get_or_insert_with(empty)
    }

    pub(super) fn guarantee(&mut self) -> &mut Guarantee {
        self.body.certificate.guarantee.get_or_insert_with(|| Guarantee {
            shift_below: 0.0,
            pivots_below: 0,
            eigenvalue_lower: Vec::new(),
            eigenvalue_upper: Vec::new(),
            shape_error: Vec::new(),
            digits: [0.0; DIGITS.len()],
        })
    }

    pub(super) fn fixed_interface(&mut self) -> &mut FixedInterface {
        self.body.certificate.fixed_interface.get_or_insert_with(|| FixedInterface {
            modes: 0,
            interface_motions: 0,
            counted: None,
            shift: 0.0,
            next: None,
            residual: 0.0,
            eigenvalues: Vec::new(),
            free: None,
        })
    }

    pub(super) fn free_estimate(&mut self) -> &mut FreeEstimate {
        self.fixed_interface().free.get_or_insert_default()
    }

    pub(super) fn coordinates(&mut self) -> &mut InterfaceCoordinates {
        self.body.coordinates.get_or_insert_with(|| InterfaceCoordinates {
            names: Vec::new(),
            stiffness: Mat::new(),
            mass: Mat::new(),
            of_modes: Mat::new(),
        })
    }

    /// Returns the decision about a group of the kinetic energy, creating it if necessary.
    pub(super) fn decision(&mut self, group: TermGroup) -> &mut TermDecision {
        let terms = &mut self.body.terms;
        let at = terms.iter().position(|term| term.group == group).unwrap_or_else(|| {
            let kept = self.body.invariants.groups().has(group);
            let (bound, limit) = (f64::INFINITY, f64::INFINITY);
            terms.push(TermDecision { group, kept, tier: 0, bound, limit, reason: String::new() });
            terms.len() - 1
        });
        &mut terms[at]
    }

    /// Returns the interface of the current instance.
    pub(super) fn interface(&mut self) -> &mut Interface {
        &mut self.body.interfaces[self.at]
    }

    /// Returns the recovery of the current instance.
    pub(super) fn recovery(&mut self) -> &mut Recovery {
        &mut self.body.recoveries[self.at]
    }

    /// Sets the interfaces of the loads of the current recovery.
    pub(super) fn recovery_interfaces(&mut self, names: Vec<String>) -> Result<(), String> {
        let load = |interface| LoadColumns { interface, columns: Mat::new() };
        self.recovery().loads = names.into_iter().map(load).collect();
        Ok(())
    }

    /// Sets the columns of the loads of the current recovery, one matrix for each of its interfaces.
    ///
    /// # Errors
    /// The expected number of matrices, if it differs.
    pub(super) fn recovery_columns(&mut self, columns: Vec<Mat<f64>>) -> Result<(), String> {
        let loads = &mut self.recovery().loads;
        if loads.len() != columns.len() {
            return Err(format!("expected {} interfaces, found {}", loads.len(), columns.len()));
        }
        loads.iter_mut().zip(columns).for_each(|(load, columns)| load.columns = columns);
        Ok(())
    }

    /// Sets the named loads that the current recovery has columns of.
    pub(super) fn recovery_named(&mut self, names: Vec<String>) -> Result<(), String> {
        self.named_columns[self.at] = names;
        Ok(())
    }

    /// Returns the named load of the current instance.
    pub(super) fn named_load(&mut self) -> &mut NamedLoad {
        &mut self.body.named_loads[self.at]
    }

    /// Puts the columns of named loads of every recovery into the order of the named loads.
    fn order_named_columns(&mut self, problems: &mut Vec<String>) {
        let loads = &self.body.named_loads;
        for (recovery, names) in self.body.recoveries.iter_mut().zip(&self.named_columns) {
            let place = |load: &NamedLoad| names.iter().position(|name| *name == load.name);
            let places: Vec<usize> = loads.iter().filter_map(place).collect();
            let is_whole = places.len() == loads.len() && names.len() == loads.len();
            if !is_whole || (recovery.named.ncols() != names.len()) {
                let found = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
                problems.push(format!(
                    "/recovery/{}: expected a column for each of the {} named loads, found {found}",
                    recovery.name,
                    loads.len()
                ));
                continue;
            }
            recovery.named =
                Mat::from_fn(recovery.rows.len(), places.len(), |i, c| recovery.named[(i, places[c])]);
        }
    }

    /// Returns the lumped body of the current instance.
    pub(super) fn lumped(&mut self) -> &mut LumpedBody {
        &mut self.body.lumped[self.at]
    }

    /// Returns the geometric stiffness, or the stiffness of inertia, of the current instance.
    pub(super) fn load(&mut self) -> &mut GeometricStiffness<Mat<f64>> {
        let at = self.at;
        match self.per {
            Per::EstimatedLoad => &mut self.body.estimated_stiffness[at],
            Per::InertiaLoad => &mut self.inertia().stiffness[at],
            _ => &mut self.body.geometric_stiffness[at],
        }
    }

    /// Returns the geometric stiffness of rotations of the current instance.
    pub(super) fn rotated(&mut self) -> &mut RotatedStiffness {
        &mut self.body.rotated_stiffness[self.at]
    }

    /// Returns the invariants of the current group: the exact ones, or those of its lumping scheme.
    pub(super) fn invariants(&mut self) -> &mut InvariantEntries {
        match self.per {
            Per::LumpingScheme => &mut self.of_lumped[self.at],
            _ => &mut self.invariants,
        }
    }

    /// Completes the body after all entries are put. Adds contradictions to `problems`.
    pub(super) fn finish(mut self, problems: &mut Vec<String>) -> Parts {
        self.order_named_columns(problems);
        let (nf, plane, groups) = (self.nf(), self.body.dimension == 2, self.body.invariants.groups());
        self.body.invariants = self.invariants.finish(nf, plane, groups);
        for (lumped, entries) in self.body.lumped.iter_mut().zip(self.of_lumped) {
            lumped.invariants = entries.finish(nf, plane, groups);
        }
        if let Some(inertia) = &mut self.body.inertia_stiffness {
            // Members of a file may come in any order.
            let order: Vec<UnitLoad> = InertiaStiffness::loads(3).collect();
            inertia.stiffness.sort_by_key(|one| order.iter().position(|load| *load == one.load));
        }
        self.body.estimated_stiffness.sort_by_key(|stiffness| stiffness.load.component);
        if self.triangles.is_some() || self.edges.is_some() {
            let triangles = self.triangles.unwrap_or_default().as_chunks().0.to_vec();
            let edges = self.edges.unwrap_or_default().as_chunks().0.to_vec();
            match SurfaceMesh::new(triangles, edges, self.body.nodes.len()) {
                Ok(mesh) => self.body.mesh = Some(mesh),
                Err(problem) => problems.push(format!("/mesh: {problem}")),
            }
        }
        self.body
    }
}

/// Stores indices of nodes in `place`. A negative index is an error; it is stored as an index that no body has.
pub(super) fn node_indices(read: ReadValue, place: &mut Option<Vec<u32>>) -> Result<(), String> {
    let values = read.indices();
    let negative = values.iter().copied().find(|index| *index < 0);
    *place = Some(values.into_iter().map(i32::cast_unsigned).collect());
    negative.map_or(Ok(()), |index| Err(format!("expected indices of nodes, found {index}")))
}

/// Entries of the invariants of a mass. The mass and the groups of the kinetic energy determine which of them are
/// primary.
pub(super) struct InvariantEntries {
    pub mass: f64,
    pub first_moment: Vector3<f64>,
    pub second_moment: Matrix3<f64>,
    pub c1: Mat<f64>,
    /// Row-major, 3 x 3 x nf.
    pub ibar: Vec<f64>,
    /// Row-major, 3 x 3 x nf x nf.
    pub s: Vec<f64>,
    pub modal_stiffness: Mat<f64>,
    pub w0: Option<Mat<f64>>,
    pub w3: Option<Mat<f64>>,
    pub c2: Mat<f64>,
    pub modal_mass: Mat<f64>,
}

impl InvariantEntries {
    /// Returns the entries of a body without modes.
    fn new() -> Self {
        Self {
            mass: 0.0,
            first_moment: Vector3::zeros(),
            second_moment: Matrix3::zeros(),
            c1: Mat::zeros(3, 0),
            ibar: Vec::new(),
            s: Vec::new(),
            modal_stiffness: Mat::new(),
            w0: None,
            w3: None,
            c2: Mat::zeros(3, 0),
            modal_mass: Mat::new(),
        }
    }

    fn finish(self, nf: usize, plane: bool, groups: TermGroups) -> Invariants {
        let block = |k: usize, l: usize| 3 * k + l;
        let w3 = self.w3.filter(|_| groups.w3);
        let ibar = if groups.w1 {
            [0, 1, 2].map(|k| [0, 1, 2].map(|l| self.ibar[block(k, l) * nf..][..nf].to_vec()))
        } else {
            ibar_of_c2(&self.c2)
        };
        let s = match (groups.w2, &self.w0) {
            (true, _) => {
                let entry = |k, l, i, j| self.s[(block(k, l) * nf + i) * nf + j];
                [0, 1, 2].map(|k| [0, 1, 2].map(|l| Mat::from_fn(nf, nf, |i, j| entry(k, l, i, j))))
            }
            (false, Some(_)) => s_of_modal_mass(nf, None, None),
            (false, None) => s_of_modal_mass(nf, Some(&self.modal_mass), w3.as_ref()),
        };
        // Without W0 the entries W3 and m_ff follow from S.
        let general = self.w0.map(|w0| GeneralTerms {
            w0,
            w3: w3.unwrap_or_else(|| Mat::zeros(3 * nf, nf)),
            modal_mass: self.modal_mass,
            plane,
        });
        Invariants::new(PrimaryData {
            general,
            mass: self.mass,
            first_moment: self.first_moment,
            second_moment: self.second_moment,
            c1: self.c1,
            ibar,
            s,
            modal_stiffness: self.modal_stiffness,
            groups,
        })
    }
}

fn empty_body(units: UnitSystem, storage: Storage, invariants: Invariants) -> Parts {
    Parts {
        description: Description::new("", units),
        source: Source {
            files: Vec::new(),
            n_dofs: 0,
            mass_structure: MassStructure::General,
            approximation: None,
            settings: serde_json::Value::Null,
        },
        dimension: 3,
        frame: Frame { origin: Vector3::zeros(), axes: Matrix3::identity() },
        conditions: ReferenceConditions::MeanAxes,
        nodes: Nodes::default(),
        mesh: None,
        modes: Modes {
            eigenvalue: Vec::new(),
            residual: Vec::new(),
            provenance: Vec::new(),
            truncation: Vec::new(),
            damping_ratio: Vec::new(),
            modal_damping: None,
            shape: Mat::new(),
            rotation: None,
            internal: None,
        },
        invariants,
        geometric_stiffness: Vec::new(),
        rotated_stiffness: Vec::new(),
        estimated_stiffness: Vec::new(),
        inertia_stiffness: None,
        lumped: Vec::new(),
        certificate: Certificate {
            proved_modes: None,
            shift: 0.0,
            negative_pivots: None,
            rigid_modes: 0,
            remark: String::new(),
            rigid_noise: 0.0,
            rigid_residual: 0.0,
            eigenvalue_rounding: 0.0,
            inertia_rounding: 0.0,
            guarantee: None,
            fixed_interface: None,
        },
        interfaces: Vec::new(),
        coordinates: None,
        recoveries: Vec::new(),
        named_loads: Vec::new(),
        terms: Vec::new(),
        storage,
    }
}
