//! Channels for programs that superpose the results of an FE program: the factor of each of its steps over time.
//!
//! A step of `flexbody shapes` is a factor times a mode or a static column. With the values y_k of the FE program in step
//! k and its values y0 at rest,
//!
//! ```text
//! y(t) = y0 + sum_k channel_k(t) y_k,        channel_k = q_j / factor, f_a / factor or w_k w_l / factor
//! ```
//!
//! The load f_a of a named load is its amplitude, that of a preload 1.

use super::LoadedHistory;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::convert::UNIFORM_STRAIN;
use flexbody_body::flex_body::{FlexBody, MotionLoad};
use flexbody_model::{LoadKind, ShapeSteps, UnitLoad};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Name of the channel of the values at rest.
const AT_REST: &str = "constant";

/// Largest difference of a mode in the steps from that of the body, relative to its largest displacement, after the best
/// rigid motion. Steps of the body reach 1e-12, bodies in single precision 1e-7; another mode has about 1.
const MAX_DIFFERENCE: f64 = 1e-5;

/// Factor of each step of an FE program over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Channels {
    /// Names: those of the steps, and `constant` for the values at rest.
    pub names: Vec<String>,
    /// Times.
    pub times: Vec<f64>,
    /// Value of each channel at each time.
    pub values: Vec<Vec<f64>>,
}

/// Quantity of the motion that a channel is, before its factor.
enum Source {
    Mode(usize),
    Spin(usize, usize),
    /// Index of the load of the history, and the component of force and torque.
    Load(usize, usize),
    /// Index of the named load of the history.
    Amplitude(usize),
    Preload,
    /// Force of motion of a kind: its component and its mode.
    Motion(MotionLoad, usize, usize),
    /// Load that the history does not have, or a uniform strain.
    Unloaded,
}

impl LoadedHistory {
    /// Returns the channels of the steps of an FE program for this motion of `body`.
    ///
    /// # Errors
    /// [`RecoveryShapes`](Code::RecoveryShapes) for steps of another body, FB215 if the history has no angular velocity
    /// and there are steps of spin.
    pub fn channels(&self, body: &FlexBody, steps: &ShapeSteps) -> Result<Channels> {
        refuse_foreign(steps, body)?;
        self.refuse_mean_axes(body)?;
        self.refuse_torque_without_rotation(body)?;
        self.refuse_load_without_step(body, steps)?;
        let sources = steps.columns.iter().map(|name| self.source(body, name)).collect::<Result<Vec<_>>>()?;
        let value = |source: &Source, i: usize| match *source {
            Source::Mode(j) => self.q[i][j],
            Source::Spin(k, l) => self.angular_velocity.as_ref().map_or(0.0, |w| w[i][k] * w[i][l]),
            Source::Load(at, component) => self.loads[at].values[i][component / 3][component % 3],
            Source::Amplitude(at) => self.named[at].values[i],
            Source::Preload => 1.0,
            Source::Motion(load, component, mode) => {
                load.amplitude(&self.motion(i, &Matrix3::identity()), component, mode)
            }
            Source::Unloaded => 0.0,
        };
        let at = |i: usize| {
            let own = sources.iter().zip(&steps.factors).map(|(source, factor)| value(source, i) / factor);
            own.chain([1.0]).collect()
        };
        Ok(Channels {
            names: steps.columns.iter().cloned().chain([AT_REST.to_owned()]).collect(),
            times: self.time.clone(),
            values: (0..self.time.len()).map(at).collect(),
        })
    }

    /// Refuses modal coordinates of other modes than those of the steps.
    fn refuse_mean_axes(&self, body: &FlexBody) -> Result<()> {
        if !self.is_in_mean_axes {
            return Ok(());
        }
        let message = format!(
            "{}: the modal coordinates of the run are those of the body in mean axes, and the steps have the modes of the file",
            body.conditions()
        );
        let help = "convert with --frame com, write the shapes of that body, and simulate it again";
        Err(Diagnostic::new(Code::SceneBody, message).in_file(&self.path).with_help(help).into())
    }

    /// Refuses a load at an interface of which neither a step nor a recovery has columns: no step has its stresses.
    fn refuse_load_without_step(&self, body: &FlexBody, steps: &ShapeSteps) -> Result<()> {
        for load in &self.loads {
            let is_loaded = load.values.iter().flatten().any(|vector| *vector != Vector3::zeros());
            let has_step = || {
                let all = UnitLoad::at_interface(&load.interface);
                all.iter().any(|one| steps.columns.contains(&one.step()))
            };
            let mut known = body.recoveries().iter().flat_map(|recovery| &recovery.loads);
            if is_loaded && !has_step() && !known.any(|own| own.interface == load.interface) {
                let message =
                    format!("no step has the static response to loads at interface `{}`", load.interface);
                let help = "convert the model with an interface that is not `coupling = \"free\"`, and with a recovery";
                return Err(Diagnostic::new(Code::SceneBody, message)
                    .in_file(&self.path)
                    .with_help(help)
                    .into());
            }
        }
        Ok(())
    }

    fn source(&self, body: &FlexBody, name: &str) -> Result<Source> {
        let number = name.strip_prefix("mode ").and_then(|number| number.parse::<usize>().ok());
        if let Some(number) = number.filter(|number| (1..=body.n_modes()).contains(number)) {
            return Ok(Source::Mode(number - 1));
        }
        // Uniform strains test the answers of the FE program, and no motion has them.
        if name.starts_with(UNIFORM_STRAIN) {
            return Ok(Source::Unloaded);
        }
        let is_spin =
            |component: &usize| UnitLoad { kind: LoadKind::Spin, component: *component }.step() == name;
        let spin = (0..LoadKind::SPIN.len()).find(is_spin).map(|component| LoadKind::SPIN[component]);
        if let Some((k, l)) = spin {
            if self.angular_velocity.is_none() {
                let message =
                    format!("step `{name}` depends on the angular velocity, whose columns are missing");
                let help = "write angular_velocity_x, _y, _z along the axes of the model, or zeros for a body that does not turn";
                return Err(self.lacks_columns(message, help));
            }
            return Ok(Source::Spin(k, l));
        }
        for interface in body.interfaces() {
            let component = UnitLoad::at_interface(&interface.name).iter().position(|one| one.step() == name);
            if let Some(component) = component {
                let load = self.loads.iter().position(|load| load.interface == interface.name);
                return Ok(load.map_or(Source::Unloaded, |load| Source::Load(load, component)));
            }
        }
        if let Some(load) = body.named_loads().iter().find(|load| load.name == name) {
            let own = self.named.iter().position(|one| one.load == name);
            let acting = own.map_or(Source::Unloaded, Source::Amplitude);
            return Ok(if load.preload { Source::Preload } else { acting });
        }
        if let Some((load, component, mode)) = motion_step(name, body.n_modes()) {
            let lacking = self.missing_for(load);
            if !lacking.is_empty() {
                let message =
                    format!("step `{name}` depends on the columns {}, which are missing", lacking.join(", "));
                let help = "write these columns to the table of the run, as `simulate --csv` does";
                return Err(self.lacks_columns(message, help));
            }
            return Ok(Source::Motion(load, component, mode));
        }
        Err(foreign(format!("step `{name}` is no mode and no load of the body")).into())
    }
}

/// Returns the kind of force of motion that a step is, its component and its mode.
fn motion_step(name: &str, n_modes: usize) -> Option<(MotionLoad, usize, usize)> {
    let mode =
        name.rsplit_once(" of mode ")?.1.parse::<usize>().ok()?.checked_sub(1).filter(|j| *j < n_modes)?;
    let component =
        |load: MotionLoad| (0..load.components()).find(|&component| load.step(component, mode) == name);
    MotionLoad::ALL.iter().find_map(|&load| Some((load, component(load)?, mode)))
}

/// Refuses steps of another body.
///
/// # Errors
/// [`RecoveryShapes`](Code::RecoveryShapes).
fn refuse_foreign(steps: &ShapeSteps, body: &FlexBody) -> Result<()> {
    let count = steps.columns.len();
    let fits = steps.factors.len() == count
        && steps.displacements.len() == count
        && steps.displacements.iter().all(|own| own.len() == steps.nodes.len());
    if !fits || steps.factors.iter().any(|factor| !(factor.is_finite() && *factor > 0.0)) {
        return Err(foreign(
            "the names, factors and displacements of the steps do not fit each other".to_owned(),
        )
        .into());
    }
    if steps.nodes != body.nodes().ids {
        return Err(foreign("the nodes of the steps are not those of the body".to_owned()).into());
    }
    let modes = steps.columns.iter().filter(|name| name.starts_with("mode ")).count();
    if modes != body.n_modes() {
        let message = format!("the steps have {modes} modes, the body has {}", body.n_modes());
        return Err(foreign(message).into());
    }
    if steps.modes_follow_spin != body.groups().w1 {
        let message =
            "the steps belong to the same modes with other terms: their static columns of spin differ";
        return Err(foreign(message.to_owned()).into());
    }
    for j in 0..body.n_modes() {
        let name = format!("mode {}", j + 1);
        let Some(step) = steps.columns.iter().position(|known| *known == name) else {
            return Err(foreign(format!("no step is {name}")).into());
        };
        let difference = difference(steps, body, step, j);
        if difference.is_nan() || difference > MAX_DIFFERENCE {
            let message = format!(
                "step {} is not {name} of the body: its displacements differ by {difference:.1e} of the largest",
                step + 1
            );
            return Err(foreign(message).into());
        }
    }
    Ok(())
}

/// Returns the largest difference of a step from mode `j` of the body after the best rigid motion, relative to the
/// largest displacement.
fn difference(steps: &ShapeSteps, body: &FlexBody, step: usize, j: usize) -> f64 {
    let (frame, shape) = (body.frame(), &body.modes().shape);
    let size = body.largest_displacement(j);
    let places: Vec<Vector3<f64>> =
        body.nodes().positions.iter().map(|x| Vector3::from(frame.to_model(*x)) / body.extent()).collect();
    let middle = places.iter().sum::<Vector3<f64>>() / places.len().max(1) as f64;
    let apart = |node: usize| {
        let own = frame.axes * Vector3::from_fn(|k, _| shape[(3 * node + k, j)]);
        (Vector3::from(steps.displacements[step][node]) / steps.factors[step] - own) / size
    };
    // Least squares of translation and rotation.
    let motions = |node: usize| {
        let [x, y, z] = <[f64; 3]>::from(places[node] - middle);
        SMatrix::<f64, 3, 6>::from_row_slice(&[
            1.0, 0.0, 0.0, 0.0, z, -y, 0.0, 1.0, 0.0, -z, 0.0, x, 0.0, 0.0, 1.0, y, -x, 0.0,
        ])
    };
    let (mut gram, mut along) = (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros());
    for node in 0..places.len() {
        let own = motions(node);
        gram += own.transpose() * own;
        along += own.transpose() * apart(node);
    }
    let rigid = gram.svd(true, true).solve(&along, 1e-12).unwrap_or_default();
    (0..places.len()).map(|node| (apart(node) - motions(node) * rigid).amax()).fold(0.0, f64::max)
}

fn foreign(message: String) -> Diagnostic {
    Diagnostic::new(Code::RecoveryShapes, message).with_help(
        "write the steps of this body: flexbody shapes BODY --to npz, and run the FE program on them",
    )
}
