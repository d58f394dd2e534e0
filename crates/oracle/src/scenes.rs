//! Random scenes for a body without units: rates are relative to the first frequency of the body, times to its first
//! period.

use super::flexible::{body_of, fixture, soft_block};
use super::plane::rectangle;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_motion::dynamics::Terms;
use flexbody_motion::scene::{
    Axes, History, Initial, Load, ModeStart, Point, Requirements, Run, Scene, Scheme, Spin, VectorHistory,
};
use nalgebra::Vector3;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::f64::consts::TAU;
use std::sync::OnceLock;

/// Returns the scene of a free body at rest, without loads or requirements, for this duration.
pub fn nothing_happens(name: &str, duration: f64, tolerance: f64) -> Scene {
    let run = Run {
        duration: Some(duration),
        outputs: 60,
        most_steps: Run::MOST_STEPS,
        scheme: Scheme::Adaptive { tolerance },
        terms: Terms::ALL,
    };
    Scene::new(name, run)
}

/// Returns solid bodies, soft and stiff, and a plane body.
pub fn bodies() -> &'static [FlexBody] {
    static BODIES: OnceLock<Vec<FlexBody>> = OnceLock::new();
    BODIES.get_or_init(|| {
        vec![
            soft_block(8),
            fixture("bracket_hex20", 8, BodyFrame::Principal),
            fixture("connecting_rod", 8, BodyFrame::Principal),
            body_of(rectangle(6, 3, 0.3, [5.0, -2.0]), 8, BodyFrame::Principal),
        ]
    })
}

/// Returns a configuration with fixed cases: a quarter of `cases`, or all with `FLEXBODY_SLOW=1`.
pub fn seeded(cases: u32, seed: u64) -> ProptestConfig {
    let share = if std::env::var_os("FLEXBODY_SLOW").is_some() { 1 } else { 4 };
    ProptestConfig {
        cases: cases.div_ceil(share),
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(seed),
        ..ProptestConfig::default()
    }
}

/// Function of time with values from -1 to 1.
#[derive(Debug, Clone)]
pub enum Shape {
    Constant(f64),
    /// Polyline: parts of the duration, some of them short, and values.
    Lines(Vec<(f64, f64)>),
    /// Harmonic near the frequency of a mode: number of the mode, factor of its frequency, phase.
    Tone(usize, f64, f64),
    /// Ramp: start value, end value, start time and duration, the times as parts of the duration of the scene.
    Ramp(f64, f64, f64, f64),
}

impl Shape {
    /// Returns the function of time, times `size`, over a duration, for a body with the circular frequencies `rates`.
    pub fn history(&self, size: f64, duration: f64, rates: &[f64]) -> History {
        match self {
            Self::Constant(value) => History::Constant(size * value),
            Self::Lines(points) => {
                let total: f64 = points.iter().map(|(part, _)| part).sum();
                let mut time = 0.0;
                let mut next = |part: f64| {
                    time += duration * part / total;
                    time
                };
                History::Table {
                    times: points.iter().map(|(part, _)| next(*part)).collect(),
                    values: points.iter().map(|(_, value)| size * value).collect(),
                }
            }
            Self::Tone(mode, factor, phase) => History::Sine {
                amplitude: size,
                frequency: rates[mode % rates.len()] * factor / TAU,
                phase: *phase,
            },
            Self::Ramp(from, to, start, length) => History::Ramp {
                from: size * from,
                to: size * to,
                start: duration * start,
                duration: duration * length,
            },
        }
    }
}

pub fn shape() -> impl Strategy<Value = Shape> {
    let value = || -1.0..1.0f64;
    // Parts over three decades: reversals faster than any mode.
    let part = (-3.0..0.0f64).prop_map(|x| 10f64.powf(x));
    let factor = prop_oneof![Just(1.0), 0.95..1.05f64, 0.01..3.0f64];
    prop_oneof![
        value().prop_map(Shape::Constant),
        proptest::collection::vec((part, value()), 2..6).prop_map(Shape::Lines),
        (0..8usize, factor, 0.0..TAU).prop_map(|(mode, factor, phase)| Shape::Tone(mode, factor, phase)),
        (value(), value(), 0.0..1.0f64, 0.01..1.0f64).prop_map(|(a, b, c, d)| Shape::Ramp(a, b, c, d)),
    ]
}

/// Generates directions, often along axes of the body.
pub fn direction() -> impl Strategy<Value = [f64; 3]> {
    let any = proptest::array::uniform3(-1.0..1.0f64)
        .prop_filter("a direction", |v| v.iter().map(|x| x * x).sum::<f64>() > 1e-2);
    prop_oneof![Just([1.0, 0.0, 0.0]), Just([0.0, 1.0, 0.0]), Just([0.0, 0.0, 1.0]), any]
}

/// Force: node as a part of all nodes, direction, size, function of time, and true if the direction is fixed in space.
type Push = (f64, [f64; 3], f64, Shape, bool);

/// Motion and loads of a body.
#[derive(Debug, Clone)]
pub struct Doing {
    pub axis: [f64; 3],
    pub spin: Shape,
    /// Largest rate, as a part of the first circular frequency.
    pub rate: f64,
    pub pushes: Vec<Push>,
    /// Numbers of modes with their initial amplitudes and rates.
    pub start: Vec<(usize, f64, f64)>,
    pub damping: f64,
    pub periods: f64,
    pub outputs: usize,
    /// Watched nodes, as parts of all.
    pub watched: Vec<f64>,
}

pub fn doing(longest: f64) -> impl Strategy<Value = Doing> {
    let push = (0.0..1.0f64, direction(), 0.1..1.0f64, shape(), any::<bool>());
    let start = (0..8usize, -1.0..1.0f64, -1.0..1.0f64);
    let rate = prop_oneof![Just(0.9), 0.01..0.9f64];
    (
        (direction(), shape(), rate),
        proptest::collection::vec(push, 0..3),
        proptest::collection::vec(start, 0..3),
        prop_oneof![Just(0.0), 0.0..0.1f64],
        (0.1f64.ln()..longest.ln()).prop_map(f64::exp),
        5..200usize,
        proptest::collection::vec(0.0..1.0f64, 0..3),
    )
        .prop_map(|((axis, spin, rate), pushes, start, damping, periods, outputs, watched)| Doing {
            axis,
            spin,
            rate,
            pushes,
            start,
            damping,
            periods,
            outputs,
            watched,
        })
}

impl Doing {
    /// Returns the scene of a body: with the spin prescribed, or, if `free`, with the spin as the initial angular
    /// velocity.
    pub fn scene(&self, body: &FlexBody, free: bool) -> Scene {
        let rates: Vec<f64> = body.modes().eigenvalue.iter().map(|l| l.sqrt()).collect();
        let duration = self.periods * TAU / rates[0];
        let plane = body.dimension() == 2;
        let (mass, size) = (body.invariants().mass(), body.invariants().inertia().trace().sqrt());
        let axis = if plane { Vector3::z() } else { Vector3::from(self.axis).normalize() };
        let node = |part: f64| Point::Node(body.nodes().ids[(part * body.n_nodes() as f64) as usize]);
        // This force deforms the body statically in its first mode by about a thousandth of its size.
        let force = 1e-3 * size * mass.sqrt() * rates[0].powi(2);
        let load = |(at, along, part, over, fixed): &Push| {
            let along = Vector3::new(along[0], along[1], if plane { 0.0 } else { along[2] });
            Load {
                at: node(*at),
                force: VectorHistory::Along {
                    direction: along * (part * force),
                    factor: over.history(1.0, duration, &rates),
                },
                torque: VectorHistory::nothing(),
                axes: if *fixed { Axes::World } else { Axes::Body },
            }
        };
        let mut modes: Vec<ModeStart> = Vec::new();
        for (mode, amplitude, rate) in &self.start {
            let mode = mode % rates.len();
            if modes.iter().all(|other| other.mode != mode) {
                let most = 1e-3 * size * rates[0] / rates[mode];
                let (amplitude, rate) = (most * amplitude, most * rates[mode] * rate);
                modes.push(ModeStart { mode, amplitude, rate });
            }
        }
        let rate = self.rate * rates[0];
        Scene {
            name: "random".to_owned(),
            run: Run {
                duration: Some(duration),
                outputs: self.outputs,
                most_steps: Run::MOST_STEPS,
                scheme: Scheme::Adaptive { tolerance: 1e-10 },
                terms: Terms::ALL,
            },
            initial: Initial {
                modes,
                axes: Axes::Body,
                angular_velocity: if free { axis * rate } else { Vector3::zeros() },
                ..Initial::default()
            },
            gravity: None,
            loads: self.pushes.iter().map(load).collect(),
            spin: (!free).then(|| Spin {
                velocity: VectorHistory::Along {
                    direction: axis,
                    factor: self.spin.history(rate, duration, &rates),
                },
                axes: Axes::Body,
                start: None,
                hold: true,
            }),
            carried: None,
            watched: self.watched.iter().map(|&part| node(part)).collect(),
            requirements: Requirements {
                damping: (self.damping > 0.0).then_some(self.damping.into()),
                // Bodies of some tests have damping already.
                replaces_damping: true,
                ..Default::default()
            },
            source: None,
            series: Vec::new(),
            resolved: false,
            case: None,
        }
    }
}

/// Returns the body with the modes whose bits are set; with the first mode if none is.
pub fn some_modes(body: &FlexBody, bits: u8) -> FlexBody {
    let mut modes: Vec<usize> = (0..body.n_modes()).filter(|j| bits >> j & 1 != 0).collect();
    if modes.is_empty() {
        modes.push(0);
    }
    body.reduced(&modes, body.groups(), Vec::new()).expect("a body")
}
