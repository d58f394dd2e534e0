//! MBSim: the HDF5 file of its `ExternalFlexibleFfrBody` (external_flexible_ffr_body.cc,
//! generic_flexible_ffr_body.cc).
//!
//! The file holds the integrals of x_a S_b and S_a S_b, one of each symmetric pair of shape functions, from
//! which MBSim forms all other terms. The modal mass is not stored: it is the sum of the integrals of S_a
//! S_a. W2 and W3 follow from the same integrals.

use crate::export::Holding::{self, Held, Lost, NotApplicable};
use crate::export::frames::{frame_table, numbered_interfaces};
use crate::export::hdf5_contents::{Hdf5Contents, Hdf5Entry, hdf5_bytes};
use crate::export::matrices::inertia;
use crate::export::stresses::{NodalStresses, without_named_loads};
use crate::export::{ExportChecklist, ExportFormat, ExportFrame, ExportOptions, Exported, frames, losses};
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{CauchySchwarz, MassKind};
use flexbody_model::{GeometricStiffness, LoadKind, UnitLoad};

/// Export format of MBSim.
pub(crate) struct Mbsim;

/// Blocks of the integral of two shape functions.
const PAIRS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

impl ExportFormat for Mbsim {
    fn name(&self) -> &'static str {
        "mbsim"
    }

    fn reader(&self) -> &'static str {
        "MBSim, ExternalFlexibleFfrBody"
    }

    fn has_points(&self) -> bool {
        true
    }

    fn checklist(&self, body: &FlexBody, options: &ExportOptions) -> ExportChecklist {
        ExportChecklist {
            rigid_coupling: Held,
            plane: losses::plane(body),
            deformed_inertia: Held,
            general_w0: losses::general_w0(body),
            coriolis_force: Held,
            general_w3: losses::general_w3(body, options),
            separate_w2: other_w2(body, options),
            geometric_stiffness: losses::geometric_stiffness(body, options, |_| false),
            inertia_stiffness: losses::inertia_stiffness(body, options, |_| false),
            damping: Held,
            shapes: Held,
            rotations: Held,
            internal_rows: losses::internal_rows(body),
            gravity: Held,
            interfaces: Held,
            surface: NotApplicable,
            origins_of_modes: NotApplicable,
            units: NotApplicable,
            storage: NotApplicable,
            named_loads: without_named_loads(body),
            recoveries: {
                let places = frames(body, &options.points);
                let found = NodalStresses::new(body, places.iter().map(|place| place.id));
                NodalStresses::holding(found.as_ref(), body, false)
            },
        }
    }

    fn interface_numbers(&self, body: &FlexBody, options: &ExportOptions) -> Vec<(String, i64)> {
        numbered_interfaces(frames(body, &options.points).iter().map(|frame| (frame.id, frame)))
    }

    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported> {
        let places = frames(body, &options.points);
        let mut exported = hdf5_bytes(&entries(body, &places)).map(Exported::single)?;
        if places.iter().any(|place| place.name.is_some()) {
            let table = frame_table(places.iter().map(|frame| (frame.id, frame)));
            exported.beside.push(("frames.csv".into(), table.into_bytes()));
        }
        Ok(exported)
    }
}

/// Returns the S_aa of the file: those of W2, plus equal parts of the difference to the modal mass if their
/// sum is not the modal mass.
fn diagonal(body: &FlexBody) -> [Mat<f64>; 3] {
    let invariants = body.invariants();
    let s = invariants.s();
    if let (MassKind::Solid, Some(s)) = (invariants.kind(), s) {
        return [0, 1, 2].map(|a| s[a][a].clone());
    }
    let modal_mass = invariants.modal_mass();
    let nf = body.n_modes();
    let held = |a: usize, j: usize, k: usize| s.map_or(0.0, |s| s[a][a][(j, k)]);
    [0, 1, 2].map(|a| {
        Mat::from_fn(nf, nf, |j, k| {
            let sum: f64 = (0..3).map(|c| held(c, j, k)).sum();
            held(a, j, k) + (modal_mass[(j, k)] - sum) / 3.0
        })
    })
}

/// Returns the holding of a W2 that differs from the one implied by the modal mass: for a mass that does not
/// commute with rotations, or a body without W2. The centrifugal term of W2 is a stiffness of the spin.
fn other_w2(body: &FlexBody, options: &ExportOptions) -> Holding {
    let differences = differences_of_w2(body);
    let bound = CauchySchwarz::of(body.invariants());
    let nf = body.n_modes();
    let places =
        differences.iter().flat_map(|own| (0..nf).flat_map(move |j| (0..nf).map(move |k| (own, j, k))));
    let lost = places.map(|(own, j, k)| own[(j, k)].abs() / bound.s(j, k)).fold(0.0, f64::max);
    if body.invariants().w2().is_none() {
        return Lost(format!(
            "the absence of W2: MBSim computes W2 from the integrals whose sum is the modal mass, here up to {lost:.1e} of its Cauchy-Schwarz bound"
        ));
    }
    if lost <= losses::ROUNDING {
        return Held;
    }
    let of_spin = |body: &FlexBody| {
        let spin = |component: usize| UnitLoad { kind: LoadKind::Spin, component };
        let differences = differences_of_w2(body).into_iter().enumerate();
        Some(differences.map(|(k, matrix)| GeometricStiffness { load: spin(k), matrix }).collect())
    };
    let what =
        "W2 that differs from the one implied by the modal mass, which is the sum of the same integrals";
    losses::in_motion(body, options, what, of_spin)
}

/// Returns the blocks aa of W2 as MBSim computes them less those of the body.
fn differences_of_w2(body: &FlexBody) -> [Mat<f64>; 3] {
    let (nf, written, own) = (body.n_modes(), diagonal(body), body.invariants().w2());
    [0, 1, 2].map(|a| {
        Mat::from_fn(nf, nf, |j, k| {
            let numbered: f64 = (0..3).filter(|b| *b != a).map(|b| written[b][(j, k)]).sum();
            numbered - own.as_ref().map_or(0.0, |w2| w2[(a * nf + j, a * nf + k)])
        })
    })
}

fn entries(body: &FlexBody, places: &[ExportFrame]) -> Vec<Hdf5Entry> {
    let nf = body.n_modes();
    let invariants = body.invariants();
    let numbered = inertia(body);
    let s_aa = diagonal(body);
    // For a != b, S_ab is at (b, a) of I9.
    let s = |pair: usize, j: usize, k: usize| match PAIRS[pair] {
        (a, b) if a == b => s_aa[a][(j, k)],
        (a, b) => numbered.i9.as_ref().map_or(0.0, |i9| i9[(b * nf + j, a * nf + k)]),
    };
    let second = invariants.second_moment();
    let positions: Vec<f64> = places.iter().flat_map(|place| place.position).collect();
    let numbers = places.iter().map(|place| place.id).collect();
    let turn = |row: usize, j: usize| {
        places[row / 3].rotation.as_ref().map_or(0.0, |rotation| rotation[(row % 3, j)])
    };
    let mut all = vec![
        Hdf5Contents::number(numbered.i1).named("mass"),
        Hdf5Contents::list(numbered.i2.as_slice()).named("position integral"),
        Hdf5Contents::from_fn(3, 3, |i, j| second[(i, j)]).named("position position integral"),
        Hdf5Contents::matrix(&numbered.i3).named("shape function integral"),
        Hdf5Contents::matrix(invariants.modal_stiffness()).named("stiffness matrix"),
        Hdf5Contents::from_fn(9, nf, |row, j| invariants.ibar_or_half_c2()[row / 3][row % 3][j])
            .named("position shape function integral"),
        Hdf5Contents::from_fn(6 * nf, nf, |row, k| s(row / nf, row % nf, k))
            .named("shape function shape function integral"),
    ];
    if losses::is_damped(body) {
        all.push(Hdf5Contents::matrix(&body.damping()).named("damping matrix"));
    }
    let translation = |row: usize, j: usize| places[row / 3].translation[(row % 3, j)];
    all.extend([
        Hdf5Contents::Integers(vec![places.len()], numbers).named("node numbers"),
        Hdf5Contents::list(&positions).named("nodal relative position"),
        Hdf5Contents::from_fn(3 * places.len(), nf, translation).named("nodal shape matrix of translation"),
    ]);
    if places.iter().any(|place| place.rotation.is_some()) {
        all.push(Hdf5Contents::from_fn(3 * places.len(), nf, turn).named("nodal shape matrix of rotation"));
    }
    // Six rows xx, yy, zz, xy, yz, zx for each node, along body axes.
    if let Some(stresses) = NodalStresses::new(body, places.iter().map(|place| place.id)) {
        let value = |row: usize, j: usize| stresses.in_mode(row / 6, j)[row % 6];
        all.push(Hdf5Contents::from_fn(6 * places.len(), nf, value).named("nodal stress matrix"));
    }
    all.extend(openmbv_indices(body, places));
    all
}

/// Returns the triangles, or otherwise the edges, of the surface on the places of the file, each ended by -1.
fn openmbv_indices(body: &FlexBody, places: &[ExportFrame]) -> Option<Hdf5Entry> {
    let numbers: Vec<i64> = places.iter().map(|place| place.id).collect();
    let mesh = body.mesh()?.among(&body.nodes().ids, &numbers)?;
    let ended = |corners: &[u32]| {
        let indices: Vec<i64> = corners.iter().map(|&index| i64::from(index)).chain([-1]).collect();
        indices
    };
    let indices: Vec<i64> = match mesh.triangles() {
        [] => mesh.edges().iter().flat_map(|edge| ended(edge)).collect(),
        triangles => triangles.iter().flat_map(|triangle| ended(triangle)).collect(),
    };
    Some(Hdf5Contents::Integers(vec![indices.len()], indices).named("openmbv indices"))
}
