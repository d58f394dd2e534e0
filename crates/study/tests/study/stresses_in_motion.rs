//! Stresses of bodies in motion, beside those of the equations of all nodes: modes alone, with static columns of loads and
//! spin, and with those of the inertia of the deformation. With `FLEXBODY_BLESS` the ignored test writes the table of
//! `evidence/pages/recovery.md`.

use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, NodeSet, RawModel};
use flexbody_motion::scene::{
    Axes, FramedScene, History, Load, Point, RecoveryLimit, RecoveryTolerance, Scene, VectorHistory, trace,
    trace_at,
};
use flexbody_study::trade::NodalReference;
use nalgebra::Vector3;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, grid};
use oracle::scenes::nothing_happens;
use std::f64::consts::TAU;

const CELL: f64 = 0.05;

/// Limit of the error of stresses, which the accuracy of the motion of all nodes follows.
const LIMIT: f64 = 1e-3;

/// Returns the model of a mesh with stresses of all elements and the interface `tip` of the nodes that `is_tip` names.
fn model_of(mesh: &Mesh, is_tip: impl Fn(&[f64; 3]) -> bool) -> RawModel {
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    let tip = raw.nodes.ids.iter().zip(&raw.nodes.positions).filter(|(_, at)| is_tip(at));
    let tip = tip.map(|(id, _)| *id).collect();
    raw.data.interfaces = vec![NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new("tip", tip) }];
    raw.data.recoveries = vec![mesh.stresses(&Material::STEEL)];
    raw.data.recoveries[0].deformed_inertia = true;
    raw
}

fn bracket() -> RawModel {
    let mesh = Mesh::bracket(ElementKind::Hex8, 4, 2, CELL);
    model_of(&mesh, |at| (at[0] - 4.0 * CELL).abs() < 1e-9)
}

/// Returns an arm of ten bricks in a row, twenty times as long as thick.
fn arm() -> RawModel {
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([10, 1, 1]), |[x, y, z]| {
        [2.0 * CELL * x, CELL * y * (1.0 + 0.02 * x), 0.8 * CELL * z]
    });
    model_of(&mesh, |at| at[0] > 19.9 * CELL)
}

/// Scene of a row of the table. Frequencies are relative to the first of the body.
struct Motion {
    words: &'static str,
    raw: fn() -> RawModel,
    modes: &'static [usize],
    /// Frequency of the load, whose amplitude deflects the body statically by `deflection` of its length.
    swing: f64,
    deflection: f64,
    /// Rate of the spin about an axis that is no principal one.
    spin: f64,
    /// True to start in static equilibrium.
    settled: bool,
}

const MOTIONS: [Motion; 3] = [
    Motion {
        words: "bracket, sine at 0.4 f1 from rest",
        raw: bracket,
        modes: &[5, 10, 28],
        swing: 0.4,
        deflection: 1e-6,
        spin: 0.0,
        settled: false,
    },
    Motion {
        words: "bracket, tumbling at 0.1 f1 under a load at 0.2 f1",
        raw: bracket,
        modes: &[5, 10, 28],
        swing: 0.2,
        deflection: 0.01,
        spin: 0.1,
        settled: true,
    },
    Motion {
        words: "slender arm, tumbling at 0.1 f1",
        raw: arm,
        modes: &[5, 10, 28],
        swing: 0.0,
        deflection: 0.0,
        spin: 0.1,
        settled: true,
    },
];

fn body(model: &FeModel, modes: usize) -> FlexBody {
    let settings = ConvertSettings {
        frame: FrameChoice::from(BodyFrame::Com),
        modes: ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() },
        lumped: Vec::new(),
        ..ConvertSettings::default()
    };
    convert(model, &settings, &Context::QUIET).expect("a body").body
}

impl Motion {
    fn scene(&self, body: &FlexBody, raw: &RawModel, static_columns: bool) -> Scene {
        let rate = body.modes().eigenvalue[0].sqrt();
        let slowest =
            [self.swing, self.spin].into_iter().filter(|part| *part > 0.0).fold(f64::INFINITY, f64::min);
        let mut scene = nothing_happens("in motion", TAU / (rate * slowest.max(0.1)), 1e-10);
        scene.run.outputs = 60;
        scene.initial.settled = self.settled;
        scene.initial.angular_velocity = Vector3::new(0.4, -0.5, 0.7).normalize() * (self.spin * rate);
        let direction = Vector3::new(0.3, -0.8, 0.5);
        if self.deflection > 0.0 {
            let length = flexbody_model::extents(&raw.nodes.positions).into_iter().fold(0.0, f64::max);
            let size = self.deflection * length / tip_compliance(body, &direction);
            // From rest the load grows from zero; from equilibrium it begins at its peak, so that it pushes the body nowhere.
            let phase = if self.settled { 0.25 * TAU } else { 0.0 };
            let factor = History::Sine { amplitude: size, frequency: self.swing * rate / TAU, phase };
            scene.loads = vec![Load {
                at: Point::Interface("tip".to_owned()),
                force: VectorHistory::Along { direction, factor },
                torque: VectorHistory::nothing(),
                axes: Axes::Body,
            }];
        }
        scene.requirements.tolerance.errors.recovery = 1.0;
        let limit = RecoveryLimit::Relative(LIMIT);
        scene.requirements.recoveries =
            vec![RecoveryTolerance { recovery: "stress".to_owned(), limit, static_columns }];
        scene
    }

    /// Returns, for each number of modes, the errors of the stresses of modes alone, with static columns of loads and spin,
    /// and with those of the inertia of the deformation, and the largest deflection.
    fn errors(&self) -> Vec<(usize, [f64; 3], f64)> {
        let raw = (self.raw)();
        let model = FeModel::from_raw(raw.clone()).expect("a sound model").model;
        let of = |modes: &usize| {
            let whole = body(&model, *modes);
            let mut parts = whole.clone().into_parts();
            parts.recoveries[0].motion.clear();
            let plain = FlexBody::new(parts).expect("a body");
            let measured = |body: &FlexBody, static_columns: bool| {
                let scene = self.scene(body, &raw, static_columns);
                let framed = FramedScene::new(body, &scene).expect("a frame");
                let (motion, _) = trace(&framed.body, &framed.scene, &Context::QUIET).expect("a motion");
                let nodal =
                    NodalReference::new(&model, &framed.body, &framed.scene, &motion, &Context::QUIET)
                        .expect("a reference");
                let own =
                    trace_at(&framed.body, &framed.scene, nodal.time(), &Context::QUIET).expect("a motion");
                let error = nodal.errors(&framed.body, &own).expect("of one model").largest().recovery;
                (LIMIT * error.expect("a limit"), motion.extremes.deflection.value)
            };
            let ((alone, deflection), (columns, _), (deformed, _)) =
                (measured(&plain, false), measured(&plain, true), measured(&whole, true));
            (*modes, [alone, columns, deformed], deflection)
        };
        self.modes.iter().map(of).collect()
    }
}

/// Returns the static displacement of the tip along a unit load in the modes, per unit of force.
fn tip_compliance(body: &FlexBody, direction: &Vector3<f64>) -> f64 {
    let tip = &body.interfaces()[0];
    let rows = tip.rows(body.nodes(), body.modes().shape.as_ref(), None, 3).expect("a reference point");
    let along = |j: usize| (0..3).map(|k| rows.translation[(k, j)] * direction[k]).sum::<f64>();
    (0..body.n_modes()).map(|j| along(j).powi(2) / body.modes().eigenvalue[j]).sum()
}

fn per_cent(error: f64) -> String {
    if error > 1e-3 { format!("{:.2} %", 100.0 * error) } else { format!("{error:.1e}") }
}

/// Columns of loads and spin take over most of what modes lack in slow motion; those of inertia follow where bodies turn.
#[test]
#[ignore = "slow"]
fn stresses_in_motion_are_those_of_all_nodes() {
    let mut table = "| motion | modes | modes alone | with static columns | with the inertia of the deformation |\n|---|---|---|---|---|\n".to_owned();
    for motion in &MOTIONS {
        for (modes, [alone, columns, deformed], deflection) in motion.errors() {
            println!(
                "{} {modes}: {alone:.2e} {columns:.2e} {deformed:.2e}, deflection {deflection:.1e}",
                motion.words
            );
            assert!(columns < 0.3 * alone && deformed < 1.1 * columns, "{}, {modes} modes", motion.words);
            let cells = [alone, columns, deformed].map(per_cent).join(" | ");
            table += &format!("| {} | {modes} | {cells} |\n", motion.words);
        }
    }
    if std::env::var_os("FLEXBODY_BLESS").is_some() {
        let path = oracle::root().join("evidence/pages/recovery.md");
        let page = std::fs::read_to_string(&path).expect("the page");
        let (begin, end) = ("<!-- motion -->\n", "<!-- end of motion -->");
        let (before, rest) = page.split_once(begin).expect("a place for the table");
        let (_, after) = rest.split_once(end).expect("an end of the table");
        std::fs::write(&path, format!("{before}{begin}{table}{end}{after}")).expect("written");
    }
}
