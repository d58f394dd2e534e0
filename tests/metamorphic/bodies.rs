//! Random bodies: solids, plane bodies, nodes with rotations, singular mass matrices.

use crate::draws::{between, direction, one_in, pick};
use crate::stress::of_spin;
use crate::{named_loads, recoveries};
use flexbody_model::{Coupling, Damping, NodeSet, RawModel, Reference};
use nalgebra::{Rotation3, Vector3};
use oracle::beams::{BeamMass, elbow, star};
use oracle::carried_mass::Carrier;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::general::raw_fixture;
use oracle::mesh::{Mesh, grid};
use oracle::plane::rectangle;
use oracle::random::Random;
use oracle::sheet::Sheet;
use oracle::turning::block;

/// Kinds of bodies.
pub const KINDS: [&str; 10] = [
    "solid",
    "solid, singular mass",
    "solid with a rigid end",
    "beams",
    "beams, massless rotations",
    "elbow",
    "plane solid",
    "plane frame",
    "sheet, soft rotations",
    "sheet with a mass on weighted nodes",
];

/// Number of kinds of which most bodies are; the others have draws of their own.
pub const FREQUENT: usize = 8;

/// Returns a random body of one of the [`KINDS`].
pub fn body(kind: usize, random: &mut Random) -> RawModel {
    let raw = match kind {
        0 => graded_block(random, MassRule::Consistent),
        1 => graded_block(random, MassRule::Reduced),
        2 => block(ElementKind::Hex8).raw,
        3 => star(if one_in(random, 2) { BeamMass::Rotary } else { BeamMass::Consistent }),
        4 => star(BeamMass::Lumped),
        5 => elbow(3),
        6 => rectangle(3, 1, between(random, 0.0, 3.0), [between(random, -3.0, 3.0), 1.0]),
        7 => raw_fixture("plane_frame"),
        8 => Sheet::new(between(random, 1e-6, 5e-5), 0.0).plain(),
        _ => Carrier::new(Sheet::new(0.0, 0.0).plain(), &Rotation3::identity(), 1.0, one_in(random, 2)).raw,
    };
    // Numbers of their own, so that other features of a seed do not depend on the offset.
    let own = &mut Random(random.0 ^ 0x5eed);
    let offset = (kind == 2 && one_in(own, 2)).then(|| direction(own, 3) * 0.2);
    let raw = with_ends(raw, kind == 2, offset);
    let (recoveries, named_loads) = (recoveries::of(&raw), named_loads::of(&raw));
    raw.with(|data| {
        data.damping = damping(random);
        data.recoveries = recoveries;
        data.named_loads = named_loads;
    })
}

/// Returns damping of the model in a third of the draws.
fn damping(random: &mut Random) -> Option<Damping<flexbody_model::RawMatrix>> {
    match pick(random, 6) {
        0 => Some(Damping::Ratio(0.02)),
        // The coefficients are chosen for lowest frequencies near one, which all bodies except the plane
        // frame have.
        1 => Some(Damping::Rayleigh { alpha: 0.02, beta: 0.0 }),
        _ => None,
    }
}

/// Returns a skewed block of bricks with stiffness and density that vary along it.
fn graded_block(random: &mut Random, rule: MassRule) -> RawModel {
    // The integration points of a reduced rule must not lie on one line.
    let across = if rule == MassRule::Reduced { 2 } else { 1 + pick(random, 2) as i32 };
    let cells = [3, across, 1];
    let size = [between(random, 0.3, 0.7), between(random, 0.2, 0.5), between(random, 0.1, 0.4)];
    let [skew, taper] = [between(random, 0.02, 0.2), between(random, -0.1, 0.1)];
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid(cells), |[x, y, z]| {
        [size[0] * x + skew * y, size[1] * y * (1.0 - taper * x), size[2] * z * (1.0 + taper * y)]
    });
    let border = 0.5 * size[0];
    let stiff = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let soft = Material { youngs: between(random, 0.5, 4.0), density: between(random, 0.3, 3.0), ..stiff };
    let parts = [(mesh.part(|node| node[0] < border), stiff), (mesh.part(|node| node[0] >= border), soft)];
    let [left, right] = parts.each_ref().map(|(part, material)| part.assemble(material, rule));
    let raw = left.plus(&right).raw_model();
    let geometric_stiffness =
        if rule == MassRule::Consistent && one_in(random, 3) { of_spin(&raw, &parts) } else { Vec::new() };
    raw.with(|data| data.geometric_stiffness = geometric_stiffness)
}

/// Returns the model with interfaces `root` and `tip` of its nodes with smallest and largest x; if `by_node`
/// is true, the root is its last node, with a reference point `offset` beside it or at it. Three of the nodes may lie on one
/// line, four do not.
fn with_ends(raw: RawModel, by_node: bool, offset: Option<Vector3<f64>>) -> RawModel {
    const AT_ROOT: usize = 3;
    const AT_TIP: usize = 4;
    let mut order: Vec<usize> = (0..raw.nodes.len()).collect();
    order.sort_by(|&a, &b| raw.nodes.positions[a][0].total_cmp(&raw.nodes.positions[b][0]));
    let set = |name: &str, nodes: &[usize]| {
        let places = nodes.iter().map(|&i| Vector3::from(raw.nodes.positions[i]));
        let mean = places.sum::<Vector3<f64>>() / nodes.len() as f64;
        NodeSet {
            coupling: Some(Coupling::Averaging),
            reference: Reference::Point(mean.into()),
            ..NodeSet::new(name, nodes.iter().map(|&i| raw.nodes.ids[i]).collect())
        }
    };
    let root = if by_node {
        let own = NodeSet::new("root", raw.nodes.ids.last().copied().into_iter().collect());
        let beside = offset.zip(raw.nodes.positions.last()).map(|(by, x)| Vector3::from(*x) + by);
        match beside {
            Some(point) => NodeSet { reference: Reference::Point(point.into()), ..own },
            None => own,
        }
    } else {
        set("root", &order[..AT_ROOT])
    };
    let interfaces = vec![root, set("tip", &order[order.len() - AT_TIP..])];
    raw.with(|data| data.interfaces = interfaces)
}

/// Returns true if a node has rotations.
pub fn turns(raw: &RawModel, id: i64) -> bool {
    raw.dofs.iter().flatten().any(|label| label.node == id && label.direction > 3)
}
