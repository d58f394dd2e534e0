//! Scenes written as files like those of a user.

use flexbody_motion::scene::{
    Attachment, Axes, Drive, History, Load, Point, Range, RecoveryLimit, Samples, Scene, Scheme,
    VectorHistory,
};
use nalgebra::Vector3;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// The scene file, and its tables by name.
#[derive(Debug, Default)]
pub struct Text {
    /// The scene file.
    pub scene: String,
    /// Name and contents of every table.
    pub tables: Vec<(String, String)>,
}

/// Writes a scene into a folder; returns the path of the scene file.
pub fn write(scene: &Scene, folder: &Path) -> PathBuf {
    let text = Text::of(scene);
    for (name, table) in &text.tables {
        fs::write(folder.join(name), table).expect("written");
    }
    let path = folder.join("crossing.toml");
    fs::write(&path, text.scene).expect("written");
    path
}

fn point(point: &Point) -> String {
    match point {
        Point::Node(id) => format!("node = {id}"),
        Point::Interface(name) => format!("interface = \"{name}\""),
        Point::NamedLoad(name) => format!("named_load = \"{name}\""),
    }
}

fn vector(v: &Vector3<f64>) -> String {
    format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)
}

fn list(values: impl Iterator<Item = f64>) -> String {
    format!("[{}]", values.map(|x| format!("{x:?}")).collect::<Vec<_>>().join(", "))
}

/// Returns a history times a factor as text.
fn history(history: &History, factor: f64) -> String {
    match history.scaled(factor) {
        History::Constant(value) => format!("{value:?}"),
        History::Sine { amplitude, frequency, phase } => {
            format!("{{ amplitude = {amplitude:?}, frequency = {frequency:?}, phase = {phase:?} }}")
        }
        History::Ramp { from, to, start, duration } => {
            format!("{{ from = {from:?}, to = {to:?}, start = {start:?}, duration = {duration:?} }}")
        }
        History::Table { times, values } => {
            format!("{{ times = {}, values = {} }}", list(times.into_iter()), list(values.into_iter()))
        }
        History::Samples(samples) => {
            let (times, values): (Vec<f64>, Vec<f64>) = samples.rows().map(|(t, row)| (t, row[0])).unzip();
            let (times, values) = (list(times.into_iter()), list(values.into_iter()));
            format!("{{ times = {times}, values = {values}, interpolation = \"cubic\" }}")
        }
    }
}

impl Text {
    /// Returns the text of a scene.
    pub fn of(scene: &Scene) -> Self {
        let mut text = Self::default();
        text.head(scene);
        text.start(scene);
        text.spin(scene);
        text.carried(scene);
        scene.loads.iter().for_each(|load| text.load(load));
        for place in &scene.watched {
            text.line(&format!("[[watch]]\n{}", point(place)));
        }
        text
    }

    fn line(&mut self, line: &str) {
        let _ = writeln!(self.scene, "{line}");
    }

    fn head(&mut self, scene: &Scene) {
        self.line(&format!("name = \"{}\"", scene.name));
        if let Some(gravity) = &scene.gravity {
            self.line(&format!("gravity = {}", vector(gravity)));
        }
        let run = &scene.run;
        self.line(&format!("[run]\noutputs = {}", run.outputs));
        if let Some(duration) = run.duration {
            self.line(&format!("duration = {duration:?}"));
        }
        match run.scheme {
            Scheme::Adaptive { tolerance } => self.line(&format!("tolerance = {tolerance:?}")),
            Scheme::Conserving { order, step } => {
                self.line(&format!("method = \"conserving\"\norder = {order}"));
                step.iter().for_each(|step| self.line(&format!("step = {step:?}")));
            }
        }
        let demands = &scene.requirements;
        if let Some(ratios) = &demands.damping {
            // Damping is a single ratio: random scenes have no bands.
            self.line(&format!("[damping]\nratio = {ratios}\nreplace = {}", demands.replaces_damping));
        }
        if let Some(Range::Any(length)) = demands.motion.angular_velocity {
            self.line(&format!("[motion]\nangular_velocity = {length:?}"));
        }
        if demands.attachment != Attachment::default() {
            let attachment = &demands.attachment;
            let inertia = vector(&attachment.inertia.diagonal());
            self.line(&format!("[attachment]\nkind = \"{}\"\ninertia = {inertia}", attachment.kind.name()));
            attachment
                .first_frequency
                .iter()
                .for_each(|own| self.line(&format!("first_frequency = {own:?}")));
        }
        let allowed = &demands.tolerance.errors;
        self.line(&format!(
            "[tolerance]\nattitude = {:?}\ndeflection = {:?}\nstress = {:?}\nreaction = {:?}",
            allowed.attitude, allowed.deflection, allowed.stress, allowed.reaction
        ));
        for one in &demands.recoveries {
            // Random limits are relative.
            let RecoveryLimit::Relative(part) = &one.limit else { continue };
            self.line(&format!(
                "recovery.{} = {{ limit = {part:?}, static_columns = {} }}",
                one.recovery, one.static_columns
            ));
        }
    }

    fn start(&mut self, scene: &Scene) {
        let initial = &scene.initial;
        let carried = scene.carried.as_ref().and_then(|carried| carried.spin.as_ref());
        let start = scene.spin.as_ref().and_then(|spin| spin.start).or(carried.and_then(|spin| spin.start));
        let rotation = start.map_or(initial.rotation, |start| start.0);
        self.line("[initial]");
        for (key, value) in [
            ("origin", initial.origin),
            ("velocity", initial.velocity),
            ("rotation", rotation),
            ("angular_velocity", initial.angular_velocity),
        ] {
            if value != Vector3::zeros() {
                self.line(&format!("{key} = {}", vector(&value)));
            }
        }
        if initial.angular_velocity != Vector3::zeros() {
            self.line(&format!("axes = \"{}\"", initial.axes.name()));
        }
        if initial.settled {
            self.line("deformation = \"static\"");
        }
        for start in &initial.modes {
            let (number, amplitude, rate) = (start.mode + 1, start.amplitude, start.rate);
            self.line(&format!(
                "[[initial.mode]]\nnumber = {number}\namplitude = {amplitude:?}\nrate = {rate:?}"
            ));
        }
    }

    /// Writes a rotation: axis and rate, or columns.
    fn turning(&mut self, velocity: &VectorHistory, axes: Axes) {
        match velocity {
            VectorHistory::Along { direction, factor } => {
                self.line(&format!("axis = {}", vector(direction)));
                self.line(&format!("rate = {}", history(factor, direction.norm())));
            }
            VectorHistory::Columns(columns) => {
                let columns = self.columns(columns);
                self.line(&format!("angular_velocity_from = {columns}"));
            }
        }
        self.line(&format!("axes = \"{}\"", axes.name()));
    }

    fn spin(&mut self, scene: &Scene) {
        if let Some(spin) = &scene.spin {
            self.line(&format!("[spin]\nhold = {}", spin.hold));
            self.turning(&spin.velocity, spin.axes);
        }
    }

    fn carried(&mut self, scene: &Scene) {
        let Some(carried) = &scene.carried else { return };
        self.line(&format!("[carried]\n{}", point(&carried.by)));
        if let Some(spin) = &carried.spin {
            self.line("[carried.spin]");
            self.turning(&spin.velocity, spin.axes);
            spin.through.iter().for_each(|through| self.line(&format!("through = {}", vector(through))));
        }
        let Some(drive) = &carried.translation else { return };
        self.line("[carried.translation]");
        let name = match drive {
            Drive::Displacement(_) => "displacement",
            Drive::Velocity(_) => "velocity",
            Drive::Acceleration(_) => "acceleration",
        };
        match drive.history() {
            VectorHistory::Along { direction, factor } => {
                self.line(&format!("direction = {}", vector(direction)));
                self.line(&format!("{name} = {}", history(factor, direction.norm())));
            }
            VectorHistory::Columns(columns) => {
                let columns = self.columns(columns);
                self.line(&format!("{name}_from = {columns}"));
            }
        }
    }

    /// Writes force and torque as separate loads.
    fn load(&mut self, load: &Load) {
        if let (true, VectorHistory::Along { factor, .. }) = (load.is_named(), &load.force) {
            self.line(&format!("[[load]]\n{}\nhistory = {}", point(&load.at), history(factor, 1.0)));
            return;
        }
        for (name, vector_history) in [("force", &load.force), ("torque", &load.torque)] {
            if vector_history.is_nothing() {
                continue;
            }
            self.line(&format!("[[load]]\n{}\naxes = \"{}\"", point(&load.at), load.axes.name()));
            match vector_history {
                VectorHistory::Along { direction, factor } => {
                    self.line(&format!("{name} = {}", vector(direction)));
                    self.line(&format!("history = {}", history(factor, 1.0)));
                }
                VectorHistory::Columns(columns) => {
                    let columns = self.columns(columns);
                    self.line(&format!("{name}_from = {columns}"));
                }
            }
        }
    }

    /// Writes columns into a table; returns the reference to it.
    fn columns(&mut self, columns: &Samples<3>) -> String {
        let name = format!("columns{}.csv", self.tables.len() + 1);
        let mut table = String::from("t,x,y,z\n");
        for (t, row) in columns.rows() {
            let _ = writeln!(table, "{t:?},{:?},{:?},{:?}", row.x, row.y, row.z);
        }
        self.tables.push((name.clone(), table));
        format!(
            "{{ file = \"{name}\", time = \"t\", columns = [\"x\", \"y\", \"z\"], interpolation = \"cubic\", outside = \"hold\" }}"
        )
    }
}
