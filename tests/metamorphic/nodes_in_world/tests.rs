//! Motions of the library compared with motions in absolute coordinates.
//!
//! With all modes and a common frame for K both give one motion, to the tolerance of the integrations. With
//! another frame for K, V differs in the third order of the deformation, so that motions differ in the second
//! order: half the loads give a quarter of the difference.

use super::absolute::{Absolute, Conditions, Driven, Force};
use super::corotation::{Fit, Solid, Weights, node};
use super::integration::State;
use crate::draws::stream;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, NodeSet};
use flexbody_motion::scene::{
    Axes, Carried, CarriedSpin, Drive, History, Load, Point, Recording, Scene, Spin, VectorHistory, simulate,
};
use nalgebra::{DMatrix, Matrix3, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, grid};
use oracle::reference::dense;
use oracle::scenes::nothing_happens;
use std::f64::consts::TAU;

/// Number of oracle steps between two output times.
const STEPS: usize = 300;

/// Number of output times after the first.
const OUTPUTS: usize = 8;

/// Nodes whose positions are compared.
const WATCHED: [usize; 2] = [3, 10];

/// Largest difference of positions, velocities and reactions of equal motions, relative to the deflections.
const SAME: f64 = 1e-7;

/// A soft block with the interface `root` of four nodes, all of its modes, and its representation in the
/// oracle.
struct Block {
    body: FlexBody,
    solid: Solid,
    root: Vec<usize>,
    rate: f64,
    extent: f64,
    mass: f64,
}

/// Loads, initial state and prescribed motion of the block, in its own scales.
#[derive(Debug, Clone, Copy)]
struct Happening {
    /// Size of forces, gravity and accelerations: about the deflection relative to the extent.
    size: f64,
    /// Angular velocity divided by the lowest natural circular frequency.
    speed: f64,
    /// True if the initial attitude is rotated.
    turned: bool,
    /// True if one of the forces rotates with the body.
    follows: bool,
    gravity: bool,
    held: Held,
}

/// Prescribed motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Held {
    Nothing,
    /// Rotation of the mean axes.
    Rotation,
    /// Rotation of the mean axes and position of the centre of mass.
    Frame,
    /// Motion of the interface.
    Interface,
}

fn block() -> Block {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([3, 1, 1]), |[x, y, z]| {
        [0.3 * x + 0.03 * y + 1.0, 0.25 * y * (1.0 - 0.05 * x) - 0.4, 0.2 * z * (1.0 + 0.1 * y)]
    });
    let assembly = mesh.assemble(&rubber, MassRule::Consistent);
    let root: Vec<usize> = (0..mesh.nodes.len()).filter(|&i| mesh.nodes[i][0] < 1.1).collect();
    let ids = root.iter().map(|&i| i as i64 + 1).collect();
    let interfaces = vec![NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new("root", ids) }];
    let raw = assembly.raw_model().with(|data| data.interfaces = interfaces);
    let matrix = |a| {
        let a = dense(a);
        DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
    };
    let solid = Solid {
        stiffness: matrix(&assembly.stiffness),
        mass: matrix(&assembly.scalar_mass),
        places: mesh.nodes.iter().map(|x| Vector3::from(*x)).collect(),
    };
    let model = FeModel::from_raw(raw).expect("a body").model;
    let modes = ModeSettings { wanted: Wanted::Lowest(usize::MAX), ..ModeSettings::default() };
    let settings = ConvertSettings { modes, lumped: Vec::new(), ..ConvertSettings::default() };
    let body = convert(&model, &settings, &Context::QUIET).expect("converts").body;
    let (rate, mass) = (body.modes().eigenvalue[0].sqrt(), body.invariants().mass());
    Block { body, solid, root, rate, extent: 0.9, mass }
}

/// Returns fixed random vectors.
fn vectors() -> [Vector3<f64>; 6] {
    let random = &mut stream(5, 11);
    std::array::from_fn(|_| Vector3::from(random.vector::<3>()))
}

impl Block {
    fn duration(&self) -> f64 {
        0.8 * TAU / self.rate
    }

    /// Returns an acceleration that deflects the block by about this part of its extent.
    fn acceleration(&self, size: f64) -> f64 {
        size * self.extent * self.rate * self.rate
    }

    fn forces(&self, what: &Happening) -> Vec<Force> {
        let [a, b, ..] = vectors();
        let size = 0.2 * self.mass * self.acceleration(what.size);
        let force = |node: usize, amplitude: Vector3<f64>, follows: bool| Force {
            node,
            amplitude: amplitude * size,
            follows,
            frequency: 1.3 * self.rate,
        };
        vec![force(WATCHED[0], a, what.follows), force(12, b, false)]
    }

    fn rotation(what: &Happening) -> Vector3<f64> {
        if what.turned { Vector3::new(0.7, -1.1, 1.6) } else { Vector3::zeros() }
    }

    fn axes(what: &Happening) -> Matrix3<f64> {
        let rotation = Self::rotation(what);
        rotation
            .try_normalize(0.0)
            .map_or_else(Matrix3::identity, |axis| super::absolute::rodrigues(&axis, rotation.norm()))
    }

    fn omega(&self, what: &Happening) -> Vector3<f64> {
        vectors()[2].normalize() * (what.speed * self.rate)
    }

    fn gravity(&self, what: &Happening) -> Vector3<f64> {
        if what.gravity { vectors()[3] * self.acceleration(what.size) } else { Vector3::zeros() }
    }

    /// Returns the amplitude of the velocity of the carrier.
    fn swing(&self, what: &Happening) -> Vector3<f64> {
        vectors()[4] * (self.acceleration(what.size) / self.rate)
    }

    fn through(&self) -> Vector3<f64> {
        self.solid.centre() + vectors()[5] * self.extent
    }

    /// Returns the scene for the library.
    fn scene(&self, what: &Happening) -> Scene {
        let mut scene = nothing_happens("absolute", self.duration(), 1e-12);
        scene.run.outputs = OUTPUTS;
        scene.initial.rotation = Self::rotation(what);
        scene.initial.origin = Vector3::new(0.4, -0.2, 0.9);
        scene.gravity = what.gravity.then(|| self.gravity(what));
        let sine = |amplitude: Vector3<f64>, circular: f64| VectorHistory::Along {
            direction: amplitude,
            factor: History::Sine { amplitude: 1.0, frequency: circular / TAU, phase: 0.0 },
        };
        let load = |force: &Force| Load {
            at: Point::Node(force.node as i64 + 1),
            force: sine(force.amplitude, force.frequency),
            torque: VectorHistory::nothing(),
            axes: if force.follows { Axes::Model } else { Axes::World },
        };
        scene.loads = self.forces(what).iter().map(load).collect();
        scene.watched = WATCHED.map(|node| Point::Node(node as i64 + 1)).to_vec();
        let velocity = VectorHistory::constant(self.omega(what));
        match what.held {
            Held::Nothing => {
                scene.initial.velocity = self.swing(what);
                scene.initial.angular_velocity = self.omega(what);
            }
            Held::Rotation | Held::Frame => {
                scene.spin =
                    Some(Spin { velocity, axes: Axes::Model, start: None, hold: what.held == Held::Frame });
            }
            Held::Interface => {
                let spin =
                    CarriedSpin { velocity, axes: Axes::Model, start: None, through: Some(self.through()) };
                scene.carried = Some(Carried {
                    by: Point::Interface("root".to_owned()),
                    spin: (what.speed > 0.0).then_some(spin),
                    translation: Some(Drive::Velocity(sine(self.swing(what), 0.9 * self.rate))),
                });
            }
        }
        scene
    }

    /// Returns the rows of the conditions, the origin of their frame, and a point on the axis of rotation.
    fn conditions(&self, what: &Happening) -> Option<(DMatrix<f64>, Vector3<f64>, Vector3<f64>)> {
        let n = self.solid.places.len();
        let centre = self.solid.centre();
        let turning = Fit::new(&self.solid, Weights::Mass).rows();
        let stacked = |means: &dyn Fn(usize) -> f64, turns: &DMatrix<f64>| {
            let mut rows = DMatrix::zeros(6, 3 * n);
            for i in 0..n {
                rows.view_mut((0, 3 * i), (3, 3)).copy_from(&(Matrix3::identity() * means(i)));
            }
            rows.view_mut((3, 0), (3, 3 * n)).copy_from(turns);
            rows
        };
        match what.held {
            Held::Nothing => None,
            Held::Rotation => Some((turning, centre, centre)),
            Held::Frame => {
                let masses = self.solid.row_masses();
                Some((stacked(&|i| masses[i], &turning), centre, centre))
            }
            Held::Interface => {
                let count = self.root.len() as f64;
                let mean = self.root.iter().map(|&i| self.solid.places[i]).sum::<Vector3<f64>>() / count;
                let mut turns = DMatrix::zeros(3, 3 * n);
                for &i in &self.root {
                    let arm = self.solid.places[i] - mean;
                    turns.view_mut((0, 3 * i), (3, 3)).copy_from(&arm.cross_matrix());
                }
                let is_root = |i: usize| f64::from(u8::from(self.root.contains(&i)));
                let through = if what.speed > 0.0 { self.through() } else { mean };
                Some((stacked(&is_root, &turns), mean, through))
            }
        }
    }

    /// Computes the motion with the oracle. If `weights` is `None`, the driven frame carries K.
    fn absolute(&self, what: &Happening, weights: Option<Weights>) -> (Absolute, Vec<State>) {
        let scene_origin = Vector3::new(0.4, -0.2, 0.9);
        let own = weights.unwrap_or(Weights::Mass);
        let mut body = Absolute::new(self.solid.clone(), own).under(&self.forces(what), self.gravity(what));
        if let Some((rows, origin, through)) = self.conditions(what) {
            let swings = what.held == Held::Interface;
            let frame = Driven {
                start: Self::axes(what),
                omega: self.omega(what),
                origin,
                through,
                place: scene_origin,
                velocity: if swings { self.swing(what) } else { Vector3::zeros() },
                frequency: 0.9 * self.rate,
            };
            body = body.held(Conditions { rows, frame, carries: weights.is_none() });
        }
        let start = body.start(&Self::axes(what), scene_origin, self.swing(what), self.omega(what));
        let motion = body.motion(start, self.duration(), OUTPUTS, STEPS);
        (body, motion)
    }

    /// Returns the largest differences of positions, velocities and reactions, each relative to the
    /// deflection of the motion of the library and to its scale at the lowest frequency; and that deflection
    /// relative to the extent.
    fn apart(&self, what: &Happening, weights: Option<Weights>) -> ([f64; 3], f64) {
        let scene = self.scene(what);
        let (recording, _) = simulate(&self.body, &scene, &Context::QUIET).expect("a motion");
        let (body, states) = self.absolute(what, weights);
        let deflections = recording.paths.iter().flat_map(|path| &path.deflection);
        let deflection = deflections.map(|u| u.norm()).fold(0.0, f64::max);
        let mut apart = [0.0f64; 3];
        let mut see = |at: usize, difference: f64| apart[at] = apart[at].max(difference / deflection);
        for (at, state) in states.iter().enumerate() {
            for (path, &watched) in recording.paths.iter().zip(&WATCHED) {
                see(0, (path.place[at] - node(&state.x, watched)).norm());
                see(1, (path.velocity[at] - node(&state.v, watched)).norm() / self.rate);
            }
            see(2, self.reaction_apart(&recording, &body, at, state));
        }
        (apart, deflection / self.extent)
    }

    fn reaction_apart(&self, recording: &Recording, body: &Absolute, at: usize, state: &State) -> f64 {
        let (Some(all), Some((force, torque, moment))) =
            (&recording.reactions, body.reaction(recording.time[at], state))
        else {
            return 0.0;
        };
        // Mean axes carry the moment of the elastic forces; for an objective V this moment is zero.
        let conditions = recording.conditions.as_ref().filter(|_| moment.norm() > 1e-9 * torque.norm());
        let carried = conditions.map_or(0.0, |conditions| (conditions[at] + moment).norm());
        let torques = (all[at].1 - torque).norm().max(carried) / self.extent;
        (all[at].0 - force).norm().max(torques) / (self.mass * self.rate * self.rate)
    }
}

const CALM: Happening =
    Happening { size: 0.02, speed: 0.0, turned: false, follows: false, gravity: false, held: Held::Nothing };

/// Returns a case with all loads at once and the prescribed motion `held`.
fn everything(held: Held) -> Happening {
    Happening { size: 0.02, speed: 0.15, turned: true, follows: true, gravity: true, held }
}

#[test]
fn free_solids_move_as_in_absolute_coordinates() {
    let block = block();
    let cases = [
        CALM,
        Happening { gravity: true, ..CALM },
        Happening { follows: true, turned: true, ..CALM },
        Happening { speed: 0.2, turned: true, ..CALM },
        Happening { size: 0.2, ..everything(Held::Nothing) },
    ];
    for what in cases {
        let (apart, deflection) = block.apart(&what, Some(Weights::Mass));
        println!("{what:?}: {apart:?} at a deflection of {deflection:.1e}");
        assert!(apart.iter().all(|apart| *apart < SAME), "{what:?}: {apart:?}");
    }
}

#[test]
fn driven_solids_move_as_in_absolute_coordinates() {
    let block = block();
    for held in [Held::Rotation, Held::Frame, Held::Interface] {
        for what in [
            Happening { held, ..CALM },
            Happening { held, turned: true, gravity: true, ..CALM },
            Happening { held, speed: 0.15, ..CALM },
            everything(held),
        ] {
            let (apart, deflection) = block.apart(&what, None);
            println!("{what:?}: {apart:?} at a deflection of {deflection:.1e}");
            assert!(apart.iter().all(|apart| *apart < SAME), "{what:?}: {apart:?}");
            if held != Held::Interface {
                let (apart, _) = block.apart(&what, Some(Weights::Mass));
                assert!(apart.iter().all(|apart| *apart < SAME), "{what:?}, objective: {apart:?}");
            }
        }
    }
}

/// Differences caused by another frame of the stiffness fall with the square of the loads.
#[test]
fn another_frame_of_the_stiffness_differs_in_the_second_order() {
    let block = block();
    let free = Some(Weights::Nodes);
    let cases = [
        (CALM, free),
        (Happening { held: Held::Interface, gravity: true, turned: true, ..CALM }, Some(Weights::Mass)),
    ];
    for (what, weights) in cases {
        let size = |size: f64| {
            let (apart, deflection) = block.apart(&Happening { size, ..what }, weights);
            apart.map(|apart| apart * deflection)
        };
        let sizes = [4e-3, 2e-3, 1e-3].map(size);
        println!("{what:?}: {sizes:?}");
        for pair in sizes.windows(2) {
            for (larger, smaller) in pair[0].iter().zip(&pair[1]).filter(|(larger, _)| **larger > 0.0) {
                let order = (larger / smaller).log2();
                assert!((order - 2.0).abs() < 0.1, "{what:?}: order {order}");
            }
        }
    }
}
