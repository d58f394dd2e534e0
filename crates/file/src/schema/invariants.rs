//! The rows of `/invariants`, `/lumped/<scheme>` and `/comparison/<scheme>`: invariants of a mass, exact or lumped, and
//! their comparison.

use super::super::item::Extent::{Fixed, Modes, ThreeModes};
use super::super::item::ItemKind::{Floats, Int, Named, Text};
use super::super::item::{Item, both, field, put, written};
use super::super::units::{
    MASS, MASS_LENGTH, MASS_LENGTH2, ONE, PER_TIME, PER_TIME2, ROOT_MASS, ROOT_MASS_LENGTH, Units, dimension,
    of_load,
};
use super::super::value::{Stored, Value, View, matrix, rows, text};
use super::entry::{INERTIA, attribute, dataset};
use flexbody_body::flex_body::TermGroup;

/// Makes both directions of an entry of the invariants of the group.
macro_rules! invariant {
    ($field:ident, $get:expr) => {
        both($get, put!(|d, read| d.invariants().$field = Stored::take(read)?))
    };
}

pub(super) const INVARIANTS: &[Item] = &[
    dataset("mass", Floats(&[Fixed(1)]), MASS, "m", "mass, 1' Ms 1", both(
        |v| Some(Value::Floats(vec![v.invariants().mass()])),
        put!(|d, read| d.invariants().mass = read.floats()[0]),
    )),
    dataset("first_moment", Floats(&[Fixed(3)]), MASS_LENGTH, "c", "first moment about the frame origin, c_k = 1' Ms x_k",
        invariant!(first_moment, |v| v.invariants().first_moment().value())),
    dataset("second_moment", Floats(&[Fixed(3), Fixed(3)]), MASS_LENGTH2, "J", "second moment about the frame origin, J_kl = x_k' Ms x_l",
        invariant!(second_moment, |v| v.invariants().second_moment().value())),
    dataset("C1", Floats(&[Fixed(3), Modes]), ROOT_MASS, "C1", "linear momentum of the modes, 1' Ms Psi_k",
        invariant!(c1, |v| matrix(v.invariants().c1().as_ref()))),
    dataset("Ibar", Floats(&[Fixed(3), Fixed(3), Modes]), ROOT_MASS_LENGTH, "Ibar", "Ibar_kl = x_k' Ms Psi_l", invariant!(ibar, |v| {
        v.invariants().ibar().map(|ibar| Value::Floats(ibar.as_flattened().iter().flatten().copied().collect()))
    }))
    .of(TermGroup::W1)
    .large(),
    dataset("S", Floats(&[Fixed(3), Fixed(3), Modes, Modes]), ONE, "S", "S_kl = Psi_k' Ms Psi_l", invariant!(s, |v| {
        v.invariants().s().map(|s| Value::Floats(s.as_flattened().iter().flat_map(|m| rows(m.as_ref())).collect()))
    }))
    .of(TermGroup::W2)
    .large(),
    dataset("modal_stiffness", Floats(&[Modes, Modes]), PER_TIME2, "K_ff", "Psi' K Psi",
        invariant!(modal_stiffness, |v| matrix(v.invariants().modal_stiffness().as_ref()))),
    dataset("I0", Floats(&[Fixed(3), Fixed(3)]), MASS_LENGTH2, "I0", "inertia about the frame origin, tr(J) I - J",
        written(|v| v.invariants().inertia().value()))
    .derived("second_moment"),
    dataset("W0", Floats(&[Fixed(3), ThreeModes]), ROOT_MASS, "W0", "mass structure `general` only: Phi_t' M B_j, column b nf + j; else block b is (-C1~) e_b",
        invariant!(w0, |v| matrix(v.invariants().general()?.w0.as_ref())))
    .added(2)
    .large(),
    dataset("W1", Floats(&[Fixed(3), ThreeModes]), ROOT_MASS_LENGTH, "W1", "diagonal blocks 2 (Ibar_ll + Ibar_mm), block (k,l) = -(Ibar_kl + Ibar_lk); column b nf + j for component b, mode j",
        written(|v| matrix(v.invariants().w1()?.as_ref())))
    .derived("Ibar")
    .of(TermGroup::W1)
    .large(),
    dataset("W2", Floats(&[ThreeModes, ThreeModes]), ONE, "W2", "diagonal blocks S_ll + S_mm, block (k,l) = -S_lk; row and column b nf + j",
        written(|v| matrix(v.invariants().w2()?.as_ref())))
    .derived("S")
    .of(TermGroup::W2)
    .large(),
    dataset("W3", Floats(&[ThreeModes, Modes]), ONE, "W3", "[S23 - S32; S31 - S13; S12 - S21]; row b nf + j; mass structure `general` (B_j' M Psi) and without W2: information of its own",
        invariant!(w3, |v| matrix(v.invariants().w3()?.as_ref())))
    .derived("S")
    .of(TermGroup::W3)
    .large(),
    dataset("C2", Floats(&[Fixed(3), Modes]), ROOT_MASS_LENGTH, "C2", "angular momentum of the modes, [Ibar23 - Ibar32; Ibar31 - Ibar13; Ibar12 - Ibar21]; without W1: information of its own",
        invariant!(c2, |v| matrix(v.invariants().c2().as_ref())))
    .derived("Ibar"),
    dataset("modal_mass", Floats(&[Modes, Modes]), ONE, "m_ff", "S11 + S22 + S33 = Psi' M Psi; mass structure `general` and without W2: information of its own",
        invariant!(modal_mass, |v| matrix(v.invariants().modal_mass().as_ref())))
        .derived("S"),
];

/// Damping does not depend on the mass: lumped bodies have no damping entries.
pub(super) const DAMPING: &[Item] = &[dataset(
    "modal_damping",
    Floats(&[Modes, Modes]),
    PER_TIME,
    "D_ff",
    "Psi' D Psi, where damping was given; `/modes/damping_ratio` is its diagonal over 2 sqrt(lambda)",
    field!(modes.modal_damping),
)
.added(2)];

pub(super) const LUMPED: &[Item] = &[attribute(
    "negative_masses",
    Int,
    ONE,
    "number of negative nodal masses",
    field!(lumped: negative_masses),
)];

pub(super) const COMPARISON: &[Item] = &[attribute(
    "<norm>",
    Named,
    ONE,
    "one attribute per error norm, in creation order",
    both(
        |v| Some(Value::Named(v.lumped?.comparison.clone())),
        put!(|d, read| d.lumped().comparison = read.named()),
    ),
)];

// Geometric stiffness and stiffness of inertia of unit loads: the rows of `/geometric_stiffness/<load>` and
// `/inertia_stiffness/<load>`.

/// Unit of a stiffness of the modes for one unit of the load.
const STIFFNESS_PER_LOAD: Units = Units::PerLoad(dimension(0, 0, -2));

pub(super) const GEOMETRIC_STIFFNESS: &[Item] = &[
    dataset(
        "stiffness",
        Floats(&[Modes, Modes]),
        STIFFNESS_PER_LOAD,
        "K_geo",
        "Psi' K_geo Psi for one unit of the load: times the load, it is added to K_ff",
        field!(load: matrix),
    )
    .within(2),
    attribute(
        "kind",
        Text,
        ONE,
        "`acceleration` of the frame's origin, `angular_acceleration`, `spin` (K_geo = sum of w_k w_l times the six), `force` or `moment` at an interface, `load` with a name only",
        written(|v| text(v.unit_load()?.kind.name())),
    )
    .derived("")
    .within(2),
    attribute(
        "axis",
        Text,
        ONE,
        "body axis `x`, `y`, `z`; for `spin` `xx`, `yy`, `zz`, `xy`, `yz`, `xz`; empty for `load`",
        written(|v| text(v.unit_load()?.axis())),
    )
    .derived("")
    .within(2),
    attribute("load_units", Text, ONE, "unit of the load; 1 for `load`, whose unit is the user's", written(load_units))
    .derived("")
    .within(2),
    attribute(
        "interface",
        Text,
        ONE,
        "name of the interface, for `force` and `moment`",
        written(|v| v.unit_load()?.kind.interface().and_then(text)),
    )
    .derived("")
    .added(2),
];

pub(super) const ROTATED_STIFFNESS: &[Item] = &[
    dataset(
        "modes",
        Floats(&[Modes, Fixed(3)]),
        Units::PerLoad(dimension(1, 1, -2)),
        "Psi' K_geo R",
        "K_geo of unit rotations R, at the modes, for one unit of the load",
        field!(rotated: modes),
    )
    .within(10),
    dataset(
        "rotations",
        Floats(&[Fixed(3), Fixed(3)]),
        Units::PerLoad(dimension(2, 2, -2)),
        "R' K_geo R",
        "K_geo of unit rotations, at unit rotations, for one unit of the load",
        field!(rotated: rotation),
    )
    .within(10),
];

pub(super) const ESTIMATED_STIFFNESS: &[Item] = &[
    dataset(
        "stiffness",
        Floats(&[Modes, Modes]),
        STIFFNESS_PER_LOAD,
        "K_est",
        "estimate of Psi' K_geo Psi for one unit of the load",
        field!(load: matrix),
    )
    .within(13),
    attribute(
        "kind",
        Text,
        ONE,
        "`spin` (K_geo = sum of w_k w_l times the six)",
        written(|v| text(v.unit_load()?.kind.name())),
    )
    .derived("")
    .within(13),
    attribute(
        "axis",
        Text,
        ONE,
        "body axes `xx`, `yy`, `zz`, `xy`, `yz`, `xz`",
        written(|v| text(v.unit_load()?.axis())),
    )
    .derived("")
    .within(13),
    attribute("load_units", Text, ONE, "unit of the load", written(load_units)).derived("").within(13),
];

pub(super) const INERTIA_STIFFNESS: &[Item] = &[
    dataset(
        "stiffness",
        Floats(&[Modes, Modes]),
        STIFFNESS_PER_LOAD,
        "K",
        "stiffness of inertia for one unit of the load: times the load, it is added to K_ff and belongs to the kinetic energy (theory section 6)",
        field!(load: matrix),
    )
    .with(&INERTIA)
    .within(6),
    attribute(
        "kind",
        Text,
        ONE,
        "`acceleration` of the frame's origin less gravity, `angular_acceleration`, or `spin` (K = sum of w_k w_l times the six)",
        written(|v| text(v.unit_load()?.kind.name())),
    )
    .derived("")
    .within(6),
    attribute("axis", Text, ONE, "body axis `x`, `y`, `z`; for `spin` `xx`, `yy`, `zz`, `xy`, `yz`, `xz`", written(|v| text(v.unit_load()?.axis())))
    .derived("")
    .within(6),
    attribute("load_units", Text, ONE, "unit of the load", written(load_units)).derived("").within(6),
];

fn load_units(view: &View<'_>) -> Option<Value> {
    text(Units::Of(of_load(view.unit_load()?)).concrete(&view.body.description.units))
}
