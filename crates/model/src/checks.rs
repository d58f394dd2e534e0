//! Checks of a model before any work: each failure is reported with its facts.

pub(crate) mod density;
pub(crate) mod ground;
pub(crate) mod materials;
pub(crate) mod node_pairs;
pub(crate) mod rigid_motion;
pub(crate) mod separate_bodies;
pub(crate) mod strained;
pub(crate) mod stress;
pub(crate) mod stress_loads;
pub(crate) mod stress_notes;
pub(crate) mod uniform_strains;

use crate::checks::density::{Densities, LocalMass, SoundSpeed, check_density, check_exchanged, check_speed};
use crate::checks::node_pairs::check_mass_pairs;
use crate::checks::rigid_motion::{check_inertia, check_massless, check_rigid_motion, misplaced, recover};
use crate::checks::stress::check_stress;
use crate::checks::stress_notes::note_stress_points;
use crate::checks::uniform_strains::check_stresses;
use crate::directors::mass_structure::{MassForm, mass_form};
use crate::fe_model::assemble::{Assembled, assemble};
use crate::geometric_stiffness::missing_components;
use crate::named_load::{check_preloads, refuse_stiff_preloads};
use crate::recovery::check_rigid_responses;
use crate::rounding::{block_tolerance, rounding};
use crate::rows::internal_rows::refuse_turned_internals;
use crate::rows::{centre_and_length, extents, rigid_residuals};
use crate::wording::{in_words, name_some};
use crate::{Damping, DofLabel, FeModel, Followers, Nodes, RawModel, Rows};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Result, stop_on_error};
use flexbody_base::numbers::significant;
use flexbody_linalg::{SymmetricMatrix, largest};

/// Model that passed the checks, with the warnings and notes found.
#[derive(Debug, Clone)]
pub struct CheckedModel {
    /// Checked model.
    pub model: FeModel,
    /// Warnings and notes, in the order found.
    pub diagnostics: Vec<Diagnostic>,
    /// Figures behind the warnings about position and size of the mass.
    pub plausibility: Plausibility,
}

/// Consistency of the mass with the stiffness and the positions, in the units of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plausibility {
    /// Number of pairs of nodes coupled by the mass.
    pub mass_pairs: usize,
    /// Number of these pairs that the stiffness does not couple.
    pub foreign_pairs: usize,
    /// Number of pairs of nodes whose masses fit their stiffness only if exchanged.
    pub exchanged_pairs: usize,
    /// Speeds of sound; `None` if no motion stretches the body.
    pub sound_speed: Option<SoundSpeed>,
    /// Densities of solid elements; `None` if too few are recognised.
    pub densities: Option<Densities>,
}

impl FeModel {
    /// Checks a model as delivered by a reader, and converts it to the internal order.
    ///
    /// # Errors
    /// The errors of [`check`].
    pub fn from_raw(raw: RawModel) -> Result<CheckedModel> {
        check(raw)
    }
}

/// Checks `raw` and converts it to the internal order.
///
/// # Errors
/// All errors of the first stage that has any: matrices by themselves; labels; mass; connections and rigid
/// motion.
pub fn check(raw: RawModel) -> Result<CheckedModel> {
    let (assembled, found) = assemble(raw)?;
    check_body(assembled, found)
}

/// Checks a body: its mass, its connections, its rigid motion.
pub(crate) fn check_body(mut body: Assembled, mut diagnostics: Vec<Diagnostic>) -> Result<CheckedModel> {
    diagnostics.extend(check_exchanged_matrices(&body));
    stop_on_error(&mut diagnostics)?;
    let given = body.followers.take();
    let followers = given.and_then(|given| Followers::new(&given, &body.rows, &body.nodes));
    let own_mass = followers.as_ref().map(|followers| followers.own_mass(body.rows.len()));
    let [mass_pairs, foreign_pairs] = check_mass_pairs(&body, own_mass.as_ref(), &mut diagnostics);
    stop_on_error(&mut diagnostics)?;
    let form = form_of_mass(&body, &mut diagnostics);
    check_connections(&body, &mut diagnostics);
    let rigid_residual = check_rigid_motions(&mut body, &mut diagnostics)?;
    stop_on_error(&mut diagnostics)?;
    let mut form = form.expect("a missing mass comes with an error");
    // Vectors that rigid motion moves have no position x in the formulas for Ms.
    form.commutes &= body.rows.are_still();
    if !form.commutes {
        check_inertia(&body, rounding(body.origin.mass.digits, 3).max(1e-9), &mut diagnostics);
        stop_on_error(&mut diagnostics)?;
    }
    let diagonal_mass = is_diagonal(&body.mass);
    note_structure(&body, diagonal_mass, &mut diagnostics);
    let plausibility = Plausibility {
        mass_pairs,
        foreign_pairs,
        ..check_local_mass(&body, &form, diagonal_mass, &mut diagnostics)
    };
    stop_on_error(&mut diagnostics)?;
    let mass_rounding = block_tolerance(body.origin.mass.digits);
    let mass_path = body.origin.mass.path.clone();
    let stress_files = std::mem::take(&mut body.origin.geometric_stiffness);
    let [first, second] = [form.worst.0, form.worst.1].map(|row| body.rows.label(&body.nodes, row));
    let allowed = body.origin.allow_implausible.accepts(Code::RecoveryContradicts);
    let mut model = FeModel::new(body, form, rigid_residual, diagonal_mass).with_followers(followers);
    model.find_fixed_mass(mass_rounding);
    let kept = unrotated_mass_note(&model, mass_rounding, [first, second]);
    let follows = diagnostics.iter().any(|note| note.code() == Code::DeckConstrained)
        && model.followers().is_none_or(|points| !points.are_all());
    diagnostics.extend(kept.map(|note| with_help_for_dependents(note, follows).in_file(&mass_path)));
    check_stress(&model, &stress_files, plausibility.densities.is_some(), &mut diagnostics);
    let density = plausibility.densities.map(|densities| densities.quartiles[1]);
    check_stresses(&model, density, allowed, &mut diagnostics);
    note_stress_points(&model, &mut diagnostics);
    stop_on_error(&mut diagnostics)?;
    // Stresses of elements that K proves need no comparison with K.
    let asked = model.take_nodal_stresses();
    model.add_nodal_stresses(&asked).map_err(|error| error.after(std::mem::take(&mut diagnostics)))?;
    // Compute the fingerprints now, so that the files need not stay open.
    model.find_sources()?;
    Ok(CheckedModel { model, diagnostics, plausibility })
}

/// Returns the form of the mass matrix; `None` with a diagnostic if it belongs to no physical body.
fn form_of_mass(body: &Assembled, diagnostics: &mut Vec<Diagnostic>) -> Option<MassForm> {
    let form = mass_form(&body.mass, &body.rows, block_tolerance(body.origin.mass.digits));
    form.map_err(|diagnostic| diagnostics.push(diagnostic.in_file(&body.origin.mass.path))).ok()
}

/// Finds the rigid motion of every row, and checks that K and the other matrices leave it free. Returns the
/// residual of K.
///
/// # Errors
/// Rows without a position whose motion K does not determine, with all earlier findings.
fn check_rigid_motions(body: &mut Assembled, diagnostics: &mut Vec<Diagnostic>) -> Result<f64> {
    if let Err(diagnostic) = recover(&body.stiffness, &mut body.rows, &body.nodes) {
        diagnostics.push(diagnostic.in_file(&body.origin.stiffness.path));
        stop_on_error(diagnostics)?;
    }
    let label = |row: usize| body.rows.label(&body.nodes, row);
    if let Some(diagnostic) = misplaced(&body.rows) {
        diagnostics.push(diagnostic.in_file(&body.origin.nodes_path));
    } else if let Some(diagnostic) = refuse_turned_internals(&body.mass, &body.rows, &body.nodes) {
        diagnostics.push(diagnostic.in_file(&body.origin.mass.path));
    }
    if let Err(diagnostic) = check_massless(&body.stiffness, &body.mass, label) {
        diagnostics.push(diagnostic.in_file(&body.origin.stiffness.path));
    }
    let written = body.origin.stiffness.digits;
    let rounded = rounding(written, 1).max(1e-9);
    let limit = rounding(written, 3).max(1e-6);
    let rigid_residual = check_rigid_motion(body, rounded, limit, diagnostics);
    check_rigid_damping(body, diagnostics);
    diagnostics.extend(check_rigid_responses(&body.data.recoveries, &body.rows, &body.nodes));
    diagnostics.extend(refuse_stiff_preloads(&body.data.named_loads, &body.data.geometric_stiffness));
    diagnostics.extend(check_preloads(&body.data.named_loads, &body.rows, &body.nodes));
    diagnostics.extend(missing_components(&body.data.geometric_stiffness, body.rows.dimension));
    Ok(rigid_residual)
}

/// Checks the position of the mass, and that density and speed of sound are those of real materials; pairs
/// of nodes are not counted here.
fn check_local_mass(
    body: &Assembled,
    form: &MassForm,
    diagonal_mass: bool,
    diagnostics: &mut Vec<Diagnostic>,
) -> Plausibility {
    let local = LocalMass::new(body, &form.scalar);
    // Lumping moves mass between the nodes of an element: skip the check.
    let exchanged_pairs = if diagonal_mass { 0 } else { check_exchanged(body, &local, diagnostics) };
    let before = diagnostics.len();
    let densities = Densities::new(body, &local, diagonal_mass);
    let density = check_density(body, densities, &local, diagnostics);
    if diagnostics.len() == before {
        check_plausibility(&form.scalar, body, diagnostics);
    }
    check_speed(body, &local, density, diagnostics);
    let sound_speed = local.sound_speed(body.rows.dimension);
    Plausibility { mass_pairs: 0, foreign_pairs: 0, exchanged_pairs, sound_speed, densities }
}

fn is_diagonal(m: &SymmetricMatrix) -> bool {
    (0..m.n()).all(|i| m.row(i).0.iter().all(|&j| j as usize == i))
}

/// Adds notes about the kind of mass and of rows, unless they are plain.
fn note_structure(body: &Assembled, diagonal_mass: bool, diagnostics: &mut Vec<Diagnostic>) {
    let (origin, rows) = (&body.origin, &body.rows);
    if diagonal_mass {
        let message = "mass matrix is diagonal: the program that wrote it lumped the mass";
        diagnostics.push(Diagnostic::new(Code::MassDiagonal, message).in_file(&origin.mass.path));
    }
    let [vectors, others] = rows.without_place();
    if !(vectors.is_empty() && others.is_empty()) {
        let labels: Vec<DofLabel> =
            vectors.clone().chain(others.clone()).map(|row| rows.label(&body.nodes, row)).collect();
        let message = format!(
            "{} rows have no coordinates: {} in {} vectors with mass, {} massless and condensed: {}",
            labels.len(),
            vectors.len(),
            rows.vectors(),
            others.len(),
            name_some(&labels)
        );
        diagnostics.push(Diagnostic::new(Code::RowsWithoutPlace, message).in_file(&origin.nodes_path));
    }
}

/// Returns a note about the part of the mass that keeps the axes of the body while its nodes turn; `worst`
/// labels the rows of the displacement block that differs most by direction.
fn unrotated_mass_note(model: &FeModel, rounding: f64, worst: [DofLabel; 2]) -> Option<Diagnostic> {
    let share = model.fixed_mass_share();
    // Blocks of displacements differ by direction also because their nodes carry a point that follows them.
    let deviation = if model.followers().is_some() { 0.0 } else { model.mass_deviation() };
    (share > 0.0).then(|| {
        let [a, b] = worst;
        let place = if a == b { format!("at {a}") } else { format!("between {a} and {b}") };
        let why = if deviation > rounding {
            format!(
                "blocks of displacements deviate by {deviation:.1e} from multiples of the identity, most {place}"
            )
        } else {
            format!("displacements and rotations share symmetric blocks of up to {share:.1e}")
        };
        let message = format!("part of the mass matrix does not rotate with the nodes: {why}");
        Diagnostic::new(Code::MassBlockStructure, message)
    })
}

/// Returns the note about mass that does not rotate with the nodes, with advice on dependent points if the deck has
/// some: the error of their mass does not fall with the size of the elements.
fn with_help_for_dependents(note: Diagnostic, follows: bool) -> Diagnostic {
    if !follows {
        return note;
    }
    note.with_help(
        "if a point that follows others (RBE3, MPC) carries mass, give it rows of its own, tied by RBE2 or stiff beams: the mass of a dependent point turns with the body and not with the points that it follows, by which W2 and W3 are wrong; nothing to do for beams and shells without such points",
    )
}

/// Adds a warning if D damps rigid motion: forces on the motion of the whole body are not in the modes.
fn check_rigid_damping(body: &Assembled, diagnostics: &mut Vec<Diagnostic>) {
    /// Residual due to node tables with few digits.
    const MAX_RIGID_DAMPING: f64 = 1e-6;
    if let Some(Damping::Rayleigh { alpha, .. }) = &body.data.damping {
        if *alpha > 0.0 {
            let message = "alpha M resists rigid motion; only the damping of the deformation is kept: that of motion relative to mean axes or, of a carried body, to its carrier";
            diagnostics.push(Diagnostic::new(Code::DampingRigid, message.to_owned()));
        }
        return;
    }
    let Some(damping) = body.data.damping.as_ref().and_then(Damping::matrix) else { return };
    let (centre, length) = centre_and_length(&body.nodes.positions);
    let fields = body.rows.rigid_fields(&body.nodes.positions, centre, length);
    let residuals = rigid_residuals(damping, &fields, &body.rows.field_sizes(length));
    let damped = residuals.iter().filter(|r| r.is_nan() || **r > MAX_RIGID_DAMPING).count();
    if damped > 0 {
        let worst = largest(residuals.iter().copied());
        let message = format!(
            "D R is not zero for {damped} of {} rows: |D R| reaches {worst:.1e} of the row sum of |D|; only the damping of the modes is kept",
            residuals.len()
        );
        diagnostics.push(Diagnostic::new(Code::DampingRigid, message));
    }
}

/// Range of plausible densities in kg/m^3, from aerogel to osmium, for the bounding box of the nodes; used
/// for bodies other than solids.
const PLAUSIBLE_DENSITY: (f64, f64) = (0.1, 30_000.0);

fn check_plausibility(mass: &SymmetricMatrix, body: &Assembled, diagnostics: &mut Vec<Diagnostic>) {
    if !body.has_units() {
        return;
    }
    let units = &body.data.description.units;
    let total: f64 = mass.as_csc().values().iter().sum::<f64>() * units.mass.to_si();
    let [x, y, z] = extents(&body.nodes.positions).map(|extent| extent * units.length.to_si());
    let volume = x * y * z;
    if volume <= 0.0 {
        return;
    }
    let density = total / volume;
    if !(PLAUSIBLE_DENSITY.0..=PLAUSIBLE_DENSITY.1).contains(&density) {
        let [mass, x, y, z] = [total, x, y, z].map(|value| significant(value, 4));
        let message =
            format!("{mass} kg in a box of {x} x {y} x {z} m is {} kg/m^3", significant(density, 2));
        diagnostics.push(Diagnostic::new(Code::InertiaImplausible, message));
    }
}

/// Checks that K and M together make one body, and that K alone holds it together.
fn check_connections(body: &Assembled, diagnostics: &mut Vec<Diagnostic>) {
    let Assembled { origin, nodes, rows, stiffness, mass, .. } = body;
    let component = rows.components(&[stiffness]);
    if component.iter().all(|&c| c == 0) {
        return;
    }
    let bodies = groups(&rows.components(&[stiffness, mass]), rows, nodes);
    if bodies.len() > 1 {
        let message = format!("the matrices hold {} separate bodies: {}", bodies.len(), in_words(&bodies));
        diagnostics.push(Diagnostic::new(Code::BodiesSeveral, message).in_file(&origin.stiffness.path));
        return;
    }
    // K R = 0 holds for each part by itself: each has rigid motions of its own for any mass coupling.
    let parts = groups(&component, rows, nodes);
    let message = format!(
        "the stiffness matrix separates {} parts that only the mass matrix couples, each with its rigid motions: {}",
        parts.len(),
        in_words(&parts)
    );
    diagnostics.push(Diagnostic::new(Code::Mechanism, message).in_file(&origin.stiffness.path));
}

/// Returns the node numbers of every component, in the order of their first nodes.
pub(crate) fn groups(component: &[usize], rows: &Rows, nodes: &Nodes) -> Vec<Vec<i64>> {
    let mut groups = vec![Vec::new(); component.iter().max().map_or(0, |last| last + 1)];
    for (vertex, &c) in component.iter().enumerate() {
        groups[c].push(rows.number(nodes, vertex));
    }
    groups
}

/// Row sum of a stiffness, relative to that of its absolute values, below which translations leave the row
/// free.
const FREE_ROW_SUM: f64 = 1e-6;

/// Returns an error if translations leave M free but not K.
fn check_exchanged_matrices(body: &Assembled) -> Option<Diagnostic> {
    let Assembled { origin, rows, stiffness, mass, .. } = body;
    let (free_in_mass, free_in_stiffness) = (free_rows(mass, rows), free_rows(stiffness, rows));
    (free_in_mass > 0.5 && free_in_stiffness < 0.1).then(|| {
        let message = format!(
            "the matrix given as mass ({}) does not resist translations, like a stiffness matrix, and the one given as stiffness ({}) does, like a mass matrix: they are exchanged",
            origin.mass.path.display(),
            origin.stiffness.path.display()
        );
        Diagnostic::new(Code::MatricesExchanged, message).in_file(&origin.stiffness.path)
    })
}

/// Returns the part of the nonempty rows of displacements without force under translations along all axes.
fn free_rows(matrix: &SymmetricMatrix, rows: &Rows) -> f64 {
    let (d, displacements) = (rows.dimension, rows.dimension * rows.nodes);
    let (mut held, mut free) = (0, 0);
    for row in 0..displacements {
        let (columns, values) = matrix.row(row);
        let (mut sums, mut size) = ([0.0; 3], 0.0);
        for (&column, &value) in
            columns.iter().zip(values).take_while(|(j, _)| (**j as usize) < displacements)
        {
            sums[column as usize % d] += value;
            size += value.abs();
        }
        match sums.iter().all(|sum: &f64| sum.abs() <= FREE_ROW_SUM * size) {
            _ if size == 0.0 => {}
            true => free += 1,
            false => held += 1,
        }
    }
    f64::from(free) / f64::from((free + held).max(1))
}
