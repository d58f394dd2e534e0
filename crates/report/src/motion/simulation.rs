//! Report on a simulation: facts, verdict, motion and plots.

use super::recovered::RecoveryFacts;
use crate::chart::{Axis, Chart, Mark, Panel, STYLES, Scale, Series};
use crate::document::{Block, Document, Format, State, Term, heading, quantity};
use crate::notation::csv;
use crate::notation::numbers::{counted, frequencies, significant, times};
use crate::notation::units::UnitFacts;
use crate::picture::Fields;
use crate::run_data::RunData;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::generator;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::larger;
use flexbody_linalg::ties::sort_descending;
use flexbody_motion::dynamics::Balance;
use flexbody_motion::integration::Work;
use flexbody_motion::scene::{Drift, Envelope, IN_MEAN_AXES, MEAN_AXES, Path, Recording, Scheme};
use nalgebra::Vector3;
use serde::Serialize;
use std::f64::consts::TAU;

/// Facts of a simulation, and its recording.
#[derive(Debug, Clone, Serialize)]
pub struct SimulationFacts<'a> {
    generator: String,
    scene: &'a str,
    body: &'a str,
    units: UnitFacts,
    method: MethodFacts,
    duration: f64,
    instants: usize,
    steps: u64,
    rejected_steps: u64,
    evaluations: u64,
    energy_drift: f64,
    linear_momentum_drift: f64,
    angular_momentum_drift: f64,
    first: EnergyFacts,
    last: EnergyFacts,
    largest_spin: f64,
    /// Components of the largest spin in the axes of the model, which turn with the body.
    largest_spin_components: [f64; 3],
    /// Gravity in the axes of the model at the start; `None` without gravity.
    gravity: Option<[f64; 3]>,
    /// Carrier of the body, and the natural frequencies of the carried body; `None` for a body without
    /// carrier.
    carried: Option<CarriedFacts<'a>>,
    /// Description of the origin of the frame.
    frame_origin: String,
    largest_deflection: f64,
    /// Largest reaction force and torque of the prescribed motion; `None` without prescribed motion.
    reaction: Option<ReactionFacts>,
    /// Largest torque that the reference conditions carry at the output times; `None` unless the frame is a
    /// mean-axis frame.
    largest_conditions_torque: Option<f64>,
    geometric_stiffness: StiffeningFacts<'a>,
    points: Vec<PointFacts<'a>>,
    /// Largest values of the recoveries over the continuous motion; absent for a body without.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    recoveries: Vec<RecoveryFacts<'a>>,
    diagnostics: &'a [Diagnostic],
    wall_seconds: f64,
    cpu_seconds: f64,
    #[serde(skip)]
    recording: &'a Recording,
    /// Body in the colours of its largest stresses.
    #[serde(skip)]
    picture: Option<Coloured<'a>>,
}

/// Body in the colours of stresses.
#[derive(Debug, Clone)]
struct Coloured<'a> {
    body: &'a FlexBody,
    fields: Fields,
}

#[derive(Debug, Clone, Serialize)]
#[serde(tag = "name", rename_all = "lowercase")]
enum MethodFacts {
    Adaptive { order: usize, tolerance: f64 },
    Conserving { order: usize, step: f64 },
}

#[derive(Debug, Clone, Serialize)]
struct CarriedFacts<'a> {
    by: &'a str,
    frequency_hz: Vec<f64>,
    largest_force: f64,
    largest_torque: f64,
}

/// Part that geometric stiffness has in a simulation.
#[derive(Debug, Clone, Serialize)]
struct StiffeningFacts<'a> {
    /// True if geometric stiffness acts in the simulation.
    acts: bool,
    /// True if `geometric_stiffness = false` in [run] of the scene leaves it out.
    is_off: bool,
    /// Loads and motions for which the body has geometric stiffness.
    loads: &'a [String],
}

impl StiffeningFacts<'_> {
    fn in_words(&self) -> String {
        let loads = self.loads.join(", ");
        match (self.loads.is_empty(), self.is_off) {
            (true, _) => "no geometric stiffness in the body".to_owned(),
            (false, false) => format!("geometric stiffness acts, for {loads}"),
            (false, true) => format!(
                "geometric stiffness is switched off (geometric_stiffness = false in [run]); the body has it for {loads}"
            ),
        }
    }
}

#[derive(Debug, Clone, Copy, Serialize)]
struct ReactionFacts {
    largest_force: f64,
    largest_torque: f64,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct EnergyFacts {
    kinetic: f64,
    elastic: f64,
    work: f64,
}

#[derive(Debug, Clone, Serialize)]
struct PointFacts<'a> {
    name: &'a str,
    largest_deflection: f64,
    /// Position of the point at the last output time, world axes; velocity and acceleration are in world axes
    /// too.
    last_place: [f64; 3],
    last_velocity: [f64; 3],
    last_acceleration: [f64; 3],
    /// Largest speed at the output times.
    largest_speed: f64,
    largest_acceleration: f64,
}

impl<'a> PointFacts<'a> {
    fn new(path: &'a Path, largest_deflection: f64) -> Self {
        let last = |vectors: &[Vector3<f64>]| vectors.last().copied().unwrap_or_default().into();
        Self {
            name: &path.name,
            largest_deflection,
            last_place: last(&path.place),
            last_velocity: last(&path.velocity),
            last_acceleration: last(&path.acceleration),
            largest_speed: longest(&path.velocity),
            largest_acceleration: longest(&path.acceleration),
        }
    }
}

/// Drift whose digits are those of rounding: they differ between processors.
const ROUNDING_DRIFT: f64 = 1e-12;

/// Returns a relative drift in words.
fn drift_in_words(drift: f64) -> String {
    if drift <= ROUNDING_DRIFT { format!("below {ROUNDING_DRIFT:.0e}") } else { format!("{drift:.1e}") }
}

/// Returns the length of the longest vector.
fn longest(vectors: &[Vector3<f64>]) -> f64 {
    vectors.iter().fold(0.0, |most, vector| larger(most, vector.norm()))
}

impl<'a> SimulationFacts<'a> {
    /// Collects the facts of a recording whose numbers are in `units`, and of the run that made it.
    pub fn new(recording: &'a Recording, units: &UnitSystem, run: &'a RunData) -> Self {
        let Drift { energy, linear, angular } = recording.drift();
        let Work { steps, rejected, rates } = recording.work;
        let energies = |balance: Option<&Balance>| {
            let part = |value: fn(&Balance) -> f64| balance.map_or(0.0, value);
            EnergyFacts { kinetic: part(|b| b.kinetic), elastic: part(|b| b.elastic), work: part(|b| b.work) }
        };
        let extremes = &recording.extremes;
        let setting = &recording.setting;
        let hertz = |lambda: &f64| lambda.max(0.0).sqrt() / TAU * units.hertz();
        let carried = setting.carrier.as_deref().map(|by| CarriedFacts {
            by,
            frequency_hz: setting.eigenvalues.iter().map(hertz).collect(),
            largest_force: extremes.reaction.0,
            largest_torque: extremes.reaction.1,
        });
        let points = recording.paths.iter().zip(&extremes.watched);
        let reaction = recording.reactions.as_ref().map(|_| ReactionFacts {
            largest_force: extremes.reaction.0,
            largest_torque: extremes.reaction.1,
        });
        Self {
            generator: generator(),
            scene: &recording.scene,
            body: &recording.body,
            units: UnitFacts::new(units),
            method: match recording.scheme {
                Scheme::Adaptive { tolerance } => MethodFacts::Adaptive { order: 8, tolerance },
                Scheme::Conserving { order, step } => {
                    MethodFacts::Conserving { order, step: step.unwrap_or(f64::NAN) }
                }
            },
            duration: recording.time.last().copied().unwrap_or(0.0),
            instants: recording.time.len(),
            steps,
            rejected_steps: rejected,
            evaluations: rates,
            energy_drift: energy,
            linear_momentum_drift: linear,
            angular_momentum_drift: angular,
            first: energies(recording.balances.first()),
            last: energies(recording.balances.last()),
            largest_spin: extremes.spin,
            largest_deflection: extremes.deflection.value,
            largest_spin_components: extremes.spin_body.into(),
            gravity: setting.gravity_model.map(Into::into),
            carried,
            frame_origin: setting.origin_in_words(),
            reaction,
            largest_conditions_torque: recording.conditions.as_deref().map(longest),
            geometric_stiffness: StiffeningFacts {
                acts: !setting.stiffening.is_empty() && !setting.stiffening_is_off,
                is_off: setting.stiffening_is_off,
                loads: &setting.stiffening,
            },
            points: points.map(|(path, peak)| PointFacts::new(path, peak.value)).collect(),
            recoveries: recording.recovered.as_ref().map_or_else(Vec::new, RecoveryFacts::of_motion),
            diagnostics: &run.diagnostics,
            wall_seconds: run.wall_seconds(),
            cpu_seconds: run.cpu_seconds(),
            recording,
            picture: None,
        }
    }

    /// Adds the picture of `body` in the colours of its largest stresses.
    ///
    /// * `envelopes`: largest stresses, each with the name of what they are the largest of, as in "the run".
    pub fn with_picture(mut self, body: &'a FlexBody, envelopes: &[(String, &Envelope)]) -> Self {
        let fields = Fields::of_envelopes(body, envelopes);
        self.picture = Some(Coloured { body, fields });
        self
    }

    /// Renders the facts in a format, ending with a line break.
    pub fn render(&self, format: Format) -> String {
        Document::render(self, format, || self.document())
    }

    fn method_in_words(&self) -> String {
        match self.method {
            MethodFacts::Adaptive { order, tolerance } => {
                format!("adaptive, order {order}, tolerance {tolerance:e}")
            }
            MethodFacts::Conserving { order, step } => {
                format!("conserving, order {order}, step {}", self.units.time_of(step, 4))
            }
        }
    }

    fn work_in_words(&self) -> String {
        let rejected = if self.rejected_steps > 0 {
            format!(", {} rejected", self.rejected_steps)
        } else {
            String::new()
        };
        // Implicit steps iterate to rounding: how often hangs on last bits.
        let evaluations = match self.method {
            MethodFacts::Adaptive { .. } => self.evaluations.to_string(),
            MethodFacts::Conserving { .. } => format!("about {}", to_two_digits(self.evaluations)),
        };
        format!("{}{rejected}, {evaluations} evaluations", counted(self.steps as usize, "step"))
    }

    fn energy_in_words(&self, energy: &EnergyFacts) -> String {
        let unit = self.units.energy();
        format!(
            "kinetic {} + elastic {} {unit}",
            significant(energy.kinetic, 6),
            significant(energy.elastic, 6)
        )
    }

    fn gravity_in_words(&self) -> Option<String> {
        let [x, y, z] = self.gravity?.map(|g| significant(g, 6));
        let turned = if self.largest_spin > 0.0 { " at the start" } else { "" };
        Some(format!("{x}, {y}, {z} {} along the axes of the model{turned}", self.units.acceleration()))
    }

    fn spin_in_words(&self) -> String {
        let most = format!("{} rad/{}", significant(self.largest_spin, 5), self.units.time());
        if self.largest_spin == 0.0 {
            return most;
        }
        let [x, y, z] = self.largest_spin_components.map(|w| significant(w, 5));
        format!("{most}; at most {x}, {y}, {z} about the axes of the model")
    }

    /// Returns the carrier of the body, and the forces on the carrier and on the reference conditions, in
    /// words.
    fn support_in_words(&self) -> Vec<(&'static str, String)> {
        let torque = |value: f64| format!("{} {}", significant(value, 5), self.units.torque());
        let mut words = Vec::from_iter(self.carried_in_words().map(|carried| ("Carried", carried)));
        if let Some(ReactionFacts { largest_force, largest_torque }) = self.reaction {
            let force = format!("{} {}", significant(largest_force, 5), self.units.force());
            let torque = torque(largest_torque);
            words.push(("Reaction", format!("force at most {force}, torque at most {torque}")));
        }
        if let Some(largest) = self.largest_conditions_torque {
            words.push(("Mean axes", format!("need no force and a torque of at most {}", torque(largest))));
        }
        words
    }

    fn carried_in_words(&self) -> Option<String> {
        const FIRST: usize = 6;
        let carried = self.carried.as_ref()?;
        let (all, unit) = frequencies(&carried.frequency_hz, 5);
        let first = &all[..all.len().min(FIRST)];
        let more = if carried.frequency_hz.len() > FIRST { " ..." } else { "" };
        Some(format!(
            "by {}; natural frequencies of the carried body {}{more} {unit}",
            carried.by,
            first.join(" ")
        ))
    }

    fn document(&self) -> Document<'_> {
        let [energy, linear, angular] =
            [self.energy_drift, self.linear_momentum_drift, self.angular_momentum_drift].map(drift_in_words);
        let head = format!("Energy drift {energy}, momentum drift {linear} (linear), {angular} (angular).");
        let method = format!("{}: {}", self.method_in_words(), self.work_in_words());
        let drift = format!("energy {energy}, linear momentum {linear}, angular momentum {angular}");
        let mut terms = vec![self.body_in_words(), Term::text("Method", method.as_str())];
        terms.extend(self.energies());
        terms.push(Term::text("Drift", drift));
        terms.extend(self.motion());
        terms.push(Term::text("Time", times(self.wall_seconds, self.cpu_seconds)));
        let mut blocks = vec![
            Block::Verdict { state: State::Good, head, rest: method + "." },
            heading("Motion"),
            Block::Terms(terms),
        ];
        blocks.extend(self.largest_stresses());
        blocks.push(heading("Plots"));
        blocks.extend(self.plots().into_iter().map(Block::Chart));
        blocks.push(Block::Diagnostics(self.diagnostics));
        let (name, generator) = (self.scene, self.generator.as_str());
        Document { name, kind: "Simulation of a flexible body", generator, blocks }
    }

    /// Returns the picture of the largest stresses, or the reasons why there is none.
    fn largest_stresses(&self) -> Vec<Block<'_>> {
        let Some(Coloured { body, fields }) = &self.picture else { return Vec::new() };
        let mut blocks = vec![heading("Largest stresses")];
        if fields.drawn.is_empty() {
            blocks.push(Block::Quiet(fields.left_out.join("; ")));
        } else {
            blocks.push(Block::Coloured(body, fields));
        }
        blocks
    }

    fn body_in_words(&self) -> Term {
        let duration = self.units.time_of(self.duration, 6);
        let words = format!("{}, {duration}, {}", self.body, counted(self.instants, "instant"));
        Term::new("Body", words.as_str()).in_text("Simulation", format!("{}: {words}", self.scene))
    }

    fn energies(&self) -> [Term; 3] {
        let at = |energy: &EnergyFacts, when: &str| {
            Term::new("Energy", quantity(format!("{} at the {when}", self.energy_in_words(energy))))
        };
        let work = format!("{} {}", significant(self.last.work, 6), self.units.energy());
        let work = Term::new("Energy", quantity(format!("work of loads and damping {work}")));
        let work = if self.last.work == 0.0 { Term { text: None, ..work } } else { work };
        [at(&self.first, "start"), at(&self.last, "end"), work]
    }

    fn motion(&self) -> Vec<Term> {
        let gravity = self.gravity_in_words().map(|gravity| Term::new("Gravity", quantity(gravity)));
        let mut terms = Vec::from_iter(gravity);
        terms.push(Term::new("Spin", format!("at most {}", self.spin_in_words())));
        terms.extend(
            self.support_in_words().into_iter().map(|(label, words)| Term::new(label, quantity(words))),
        );
        terms.push(Term::new("Stiffening", self.geometric_stiffness.in_words()));
        let part = significant(100.0 * self.largest_deflection, 3);
        terms.push(Term::new("Deflection", format!("{part} % of the largest extent of the body")));
        let length = self.units.length();
        terms.extend(self.points.iter().map(|point| {
            let [x, y, z] = point.last_place.map(|v| significant(v, 6));
            let (name, deflection) = (point.name, self.units.length_of(point.largest_deflection, 4));
            let words = format!("last position {x}, {y}, {z} {length}; largest deflection {deflection}");
            Term::new("Point", format!("{name}: {words}"))
        }));
        let time = self.units.time();
        terms.extend(self.recoveries.iter().flat_map(|recovery| recovery.terms(&time)));
        terms
    }

    fn plots(&self) -> Vec<Chart> {
        let Recording { time, states, balances, paths, reactions, .. } = self.recording;
        let (units, mut charts) = (&self.units, Vec::new());
        let mut plot = |title: &str, unit: String, lines: Vec<Line>| {
            charts.extend(line_chart(title, time, &units.time(), lines, &unit));
        };
        let along = |name: &str, value: &dyn Fn(&Balance) -> f64| Line {
            name: name.to_owned(),
            values: balances.iter().map(value).collect(),
        };
        let internal = vec![
            along("kinetic without flight", &|b| b.kinetic - b.flight),
            along("elastic", &|b| b.elastic),
            along("work", &|b| b.work),
        ];
        plot("Energy", units.energy(), internal);
        let first = balances.first().map_or(0.0, |b| b.kinetic + b.elastic);
        let lost = along("energy less work", &|b| b.kinetic + b.elastic - first - b.work);
        plot("Drift of the energy", units.energy(), vec![lost]);
        let omega = components(states.iter().map(|state| state.omega));
        plot("Angular velocity, axes of the model", format!("rad/{}", units.time()), omega);
        let modal = format!("{}^(1/2) {}", units.mass(), units.length());
        plot("Largest modal coordinates", modal, self.largest_coordinates());
        for path in paths {
            let (deflection, acceleration) = (path.deflection.iter(), path.acceleration.iter());
            let title = format!("Deflection of {}, axes of the model", path.name);
            plot(&title, units.length(), components(deflection.copied()));
            let title = format!("Acceleration of {}, world axes", path.name);
            plot(&title, units.acceleration(), components(acceleration.copied()));
        }
        if let Some(reactions) = reactions {
            let torques = components(reactions.iter().map(|(_, torque)| *torque));
            plot("Torque of the prescribed motion, axes of the model", units.torque(), torques);
        }
        charts
    }

    /// Returns the modal coordinates with the largest amplitudes.
    fn largest_coordinates(&self) -> Vec<Line> {
        let states = &self.recording.states;
        let nf = states.first().map_or(0, |state| state.q.len());
        let peak = |j: usize| states.iter().map(|state| state.q[j].abs()).fold(0.0, f64::max);
        let mut modes: Vec<(usize, f64)> = (0..nf).map(|j| (j, peak(j))).collect();
        sort_descending(&mut modes, |mode| mode.1);
        let line = |&(j, _): &(usize, f64)| Line {
            name: format!("mode {}", j + 1),
            values: states.iter().map(|state| state.q[j]).collect(),
        };
        modes.iter().take(STYLES).map(line).collect()
    }
}

/// Line of a chart over time.
struct Line {
    name: String,
    values: Vec<f64>,
}

fn components(vectors: impl Iterator<Item = Vector3<f64>> + Clone) -> Vec<Line> {
    let line = |(k, name): (usize, &str)| Line {
        name: name.to_owned(),
        values: vectors.clone().map(|vector| vector[k]).collect(),
    };
    ["x", "y", "z"].into_iter().enumerate().map(line).collect()
}

/// Returns the chart of lines over time; `None` if there is nothing to draw.
fn line_chart(title: &str, time: &[f64], time_unit: &str, lines: Vec<Line>, unit: &str) -> Option<Chart> {
    let x = Axis::between(time_unit, Scale::Linear, [*time.first()?, *time.last()?])?;
    let y = Axis::around(unit, lines.iter().flat_map(|line| line.values.iter().copied()))?;
    let series = |(style, line): (usize, &Line)| {
        let points = time.iter().zip(&line.values).map(|(&t, &value)| [t, value]).collect();
        Series::new(&line.name, Mark::Line, style, points)
    };
    let series = lines.iter().enumerate().map(series).collect();
    let panel = Panel { caption: String::new(), y, height: 170.0, series };
    Some(Chart { title: title.to_owned(), x, panels: vec![panel] })
}

/// Returns the names of the columns of [`simulation_csv`].
fn csv_columns(recording: &Recording) -> Vec<String> {
    let Recording { states, paths, reactions, conditions, recovered, accelerations, .. } = recording;
    let loads = recovered.as_ref().map(|recovered| &recovered.states);
    let nf = states.first().map_or(0, |state| state.q.len());
    let mut head = vec!["time".to_owned()];
    let xyz = |name: &str| ["x", "y", "z"].map(|k| format!("{name}_{k}"));
    head.extend(xyz("origin"));
    head.extend((0..4).map(|k| format!("attitude_{k}")));
    head.extend(xyz("velocity"));
    head.extend(xyz("angular_velocity"));
    let modes = if recording.setting.is_in_mean_axes { MEAN_AXES } else { "" };
    head.extend((1..=nf).map(|j| format!("{modes}q_{j}")));
    head.extend((1..=nf).map(|j| format!("{modes}qd_{j}")));
    head.extend(["kinetic", "elastic", "work"].map(str::to_owned));
    head.extend(["linear_momentum", "angular_momentum"].iter().flat_map(|name| xyz(name)));
    if reactions.is_some() {
        head.extend(["reaction_force", "reaction_torque"].iter().flat_map(|name| xyz(name)));
    }
    if conditions.is_some() {
        head.extend(xyz("conditions_torque"));
    }
    if names_mean_axes(recording) {
        head.push(IN_MEAN_AXES.to_owned());
    }
    for path in paths {
        for what in ["place", "deflection", "velocity", "acceleration"] {
            head.extend(xyz(&format!("{} {what}", path.name)));
        }
    }
    // Loads that recoveries depend on, as `recover` reads them.
    for interface in loads.iter().flat_map(|states| states.layout.interfaces()) {
        head.extend(["force", "torque"].iter().flat_map(|part| xyz(&format!("{interface} {part}"))));
    }
    head.extend(loads.iter().flat_map(|states| states.layout.named_loads()).cloned());
    if accelerations.is_some() {
        head.extend(xyz("angular_acceleration"));
        head.extend((1..=nf).map(|j| format!("{modes}qdd_{j}")));
    }
    head
}

/// Returns true if a prescribed motion is in mean axes and no column of their torque tells so.
fn names_mean_axes(recording: &Recording) -> bool {
    let Recording { reactions, conditions, setting, .. } = recording;
    reactions.is_some() && conditions.is_none() && setting.carrier.is_none()
}

/// Returns a recording as comma-separated values with one row per output time; numbers round-trip.
pub fn simulation_csv(recording: &Recording) -> String {
    let Recording { time, states, balances, paths, reactions, conditions, recovered, accelerations, .. } =
        recording;
    let loads = recovered.as_ref().map(|recovered| &recovered.states);
    let mut table = String::new();
    csv::push_row(&mut table, csv_columns(recording).iter().map(|cell| csv::text(cell)));
    for (i, (time, (state, balance))) in time.iter().zip(states.iter().zip(balances)).enumerate() {
        let mut row = vec![*time];
        row.extend(&state.origin);
        row.extend(state.attitude.0);
        row.extend(&state.velocity);
        row.extend(&state.omega);
        row.extend(&state.q);
        row.extend(&state.qd);
        row.extend([balance.kinetic, balance.elastic, balance.work]);
        row.extend(&balance.linear);
        row.extend(&balance.angular);
        if let Some(reactions) = reactions {
            row.extend(&reactions[i].0);
            row.extend(&reactions[i].1);
        }
        if let Some(torques) = conditions {
            row.extend(&torques[i]);
        }
        if names_mean_axes(recording) {
            row.push(1.0);
        }
        for path in paths {
            for vectors in [&path.place, &path.deflection, &path.velocity, &path.acceleration] {
                row.extend(&vectors[i]);
            }
        }
        if let Some(states) = loads {
            let of = |interface: usize| states.layout.load_of(states.state(i), interface);
            row.extend((0..states.layout.interfaces().len()).flat_map(of));
            let amplitude = |load: usize| states.layout.amplitude_of(states.state(i), load);
            row.extend((0..states.layout.named_loads().len()).map(amplitude));
        }
        if let Some(accelerations) = accelerations {
            row.extend(&accelerations[i].0);
            row.extend(&accelerations[i].1);
        }
        csv::push_row(&mut table, row.into_iter().map(csv::number));
    }
    table
}

/// Returns a number rounded to two digits.
fn to_two_digits(number: u64) -> u64 {
    let unit = 10u64.pow(number.checked_ilog10().unwrap_or(0).saturating_sub(1));
    (number + unit / 2) / unit * unit
}
