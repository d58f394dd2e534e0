//! Everything that rows of recoveries depend on, instant by instant, and the linear map from it to the rows.

use super::surroundings::SceneForces;
use super::{Point, Scene, StressPoint};
use crate::dynamics::Motion;
use crate::integration::Failure;
use faer::Mat;
use flexbody_body::flex_body::{
    FlexBody, LOAD_COMPONENTS, ModalMotion, MotionLoad, Recovery, RecoveryRow, StaticCoordinates,
};
use flexbody_model::LoadKind;
use nalgebra::Vector3;
use std::ops::Range;

/// Order of the numbers z = (1, q, f_1 ... f_m, a, w_k w_l, ...) that rows are linear in: a constant, modal coordinates,
/// force and torque at each interface, amplitudes of the named loads, products of the angular velocity in the order of
/// [`LoadKind::SPIN`], and the amplitudes of the forces that the deformed body exerts by its motion
/// ([`MotionLoad::write_amplitudes`]).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowLayout {
    modes: usize,
    interfaces: Vec<String>,
    named: Vec<String>,
    motion: Vec<MotionLoad>,
}

impl RowLayout {
    /// Creates the order for `recoveries` of `body`: all interfaces and forces of motion that any of them has columns of, and
    /// all named loads of the body.
    pub fn new<'r>(body: &FlexBody, recoveries: impl IntoIterator<Item = &'r Recovery>) -> Self {
        let mut interfaces: Vec<String> = Vec::new();
        let mut motion: Vec<MotionLoad> = Vec::new();
        for recovery in recoveries {
            for load in &recovery.loads {
                if !interfaces.contains(&load.interface) {
                    interfaces.push(load.interface.clone());
                }
            }
            motion.extend(recovery.motion.iter().map(|one| one.load));
        }
        motion.sort_unstable();
        motion.dedup();
        let named = body.named_loads().iter().map(|load| load.name.clone()).collect();
        Self { modes: body.n_modes(), interfaces, named, motion }
    }

    /// Returns the length of z.
    pub fn len(&self) -> usize {
        self.first_motion() + self.motion.iter().map(|load| load.components() * self.modes).sum::<usize>()
    }

    /// Returns the kinds of forces of motion, in the order of their amplitudes.
    pub fn motion(&self) -> &[MotionLoad] {
        &self.motion
    }

    /// Returns the places of the amplitudes of the forces of one kind; `None` if z does not have them.
    fn amplitudes(&self, load: MotionLoad) -> Option<Range<usize>> {
        let at = self.motion.iter().position(|one| *one == load)?;
        let length = |one: &MotionLoad| one.components() * self.modes;
        let first = self.first_motion() + self.motion[..at].iter().map(length).sum::<usize>();
        Some(first..first + length(&load))
    }

    /// Returns the number of modal coordinates in z, which follow its constant.
    pub(super) fn modes(&self) -> usize {
        self.modes
    }

    /// Returns false: z has at least its constant.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Returns the place of an interface among those with columns.
    pub fn interface(&self, name: &str) -> Option<usize> {
        self.interfaces.iter().position(|known| known == name)
    }

    /// Returns the names of the interfaces with columns, in the order of their loads.
    pub fn interfaces(&self) -> &[String] {
        &self.interfaces
    }

    /// Returns force and torque at an interface in the state z, body axes.
    pub fn load_of<'z>(&self, z: &'z [f64], interface: usize) -> &'z [f64] {
        &z[self.load(interface)..][..LOAD_COMPONENTS]
    }

    fn load(&self, interface: usize) -> usize {
        1 + self.modes + LOAD_COMPONENTS * interface
    }

    /// Returns the names of the named loads, in the order of their amplitudes.
    pub fn named_loads(&self) -> &[String] {
        &self.named
    }

    /// Returns the amplitude of a named load in the state z.
    pub fn amplitude_of(&self, z: &[f64], named: usize) -> f64 {
        z[self.amplitude(named)]
    }

    /// Adds to the amplitude of a named load in the state z.
    pub fn add_amplitude(&self, z: &mut [f64], named: usize, amplitude: f64) {
        z[self.amplitude(named)] += amplitude;
    }

    fn amplitude(&self, named: usize) -> usize {
        self.load(self.interfaces.len()) + named
    }

    fn spin(&self) -> usize {
        self.amplitude(self.named.len())
    }

    fn first_motion(&self) -> usize {
        self.spin() + LoadKind::SPIN.len()
    }

    /// Returns z of a motion without loads and without forces of motion that depend on more than q and the angular velocity.
    ///
    /// * `angular_velocity`: of the frame, body axes.
    pub fn state(&self, q: &[f64], angular_velocity: &Vector3<f64>) -> Vec<f64> {
        let mut z = vec![0.0; self.len()];
        z[0] = 1.0;
        z[1..=self.modes].copy_from_slice(q);
        for (at, (k, l)) in (self.spin()..).zip(LoadKind::SPIN) {
            z[at] = angular_velocity[k] * angular_velocity[l];
        }
        z
    }

    /// Writes the amplitudes of the forces of motion to z, of the kinds for which `is_known` returns true.
    pub fn set_motion(&self, z: &mut [f64], motion: &ModalMotion<'_>, is_known: impl Fn(MotionLoad) -> bool) {
        for &load in self.motion.iter().filter(|load| is_known(**load)) {
            if let Some(places) = self.amplitudes(load) {
                load.write_amplitudes(motion, &mut z[places]);
            }
        }
    }

    /// Returns z with the modal coordinates `q`, and with the loads and the motion of a state `of` in another order. Forces
    /// of motion are those of that state, of a body with equally many modes.
    pub(super) fn with_loads_of(&self, order: &Self, of: &[f64], q: &[f64]) -> Vec<f64> {
        let mut z = vec![0.0; self.len()];
        z[0] = 1.0;
        z[1..=self.modes].copy_from_slice(q);
        for (at, name) in self.interfaces.iter().enumerate() {
            if let Some(known) = order.interface(name) {
                z[self.load(at)..][..LOAD_COMPONENTS].copy_from_slice(order.load_of(of, known));
            }
        }
        for (at, name) in self.named.iter().enumerate() {
            if let Some(known) = order.named.iter().position(|other| other == name) {
                z[self.amplitude(at)] = order.amplitude_of(of, known);
            }
        }
        z[self.spin()..self.first_motion()].copy_from_slice(&of[order.spin()..order.first_motion()]);
        for &load in self.motion.iter().filter(|_| self.modes == order.modes) {
            if let (Some(own), Some(known)) = (self.amplitudes(load), order.amplitudes(load)) {
                z[own].copy_from_slice(&of[known]);
            }
        }
        z
    }

    /// Returns the static response of the modal coordinates to every number of z (nf x length of z).
    pub(super) fn static_coordinates(&self, of: &StaticCoordinates) -> Mat<f64> {
        let mut all = Mat::zeros(self.modes, self.len());
        let mut place = |first: usize, part: &Mat<f64>| {
            all.as_mut().subcols_mut(first, part.ncols()).copy_from(part);
        };
        for (name, part) in &of.at_interfaces {
            if let Some(at) = self.interface(name) {
                place(self.load(at), part);
            }
        }
        place(self.amplitude(0), &of.named);
        if let Some(spin) = &of.spin {
            place(self.spin(), spin);
        }
        for (load, part) in &of.motion {
            if let Some(places) = self.amplitudes(*load) {
                place(places.start, part);
            }
        }
        all
    }

    /// Adds force and torque at the reference point of an interface to z, body axes.
    pub fn add_load(&self, z: &mut [f64], interface: usize, force: &Vector3<f64>, torque: &Vector3<f64>) {
        let first = self.load(interface);
        for k in 0..3 {
            z[first + k] += force[k];
            z[first + 3 + k] += torque[k];
        }
    }
}

/// States z at successive instants.
#[derive(Debug, Clone, PartialEq)]
pub struct RowStates {
    /// Order of the numbers of a state.
    pub layout: RowLayout,
    /// Times, ascending.
    pub times: Vec<f64>,
    /// z at each time, one after the other.
    values: Vec<f64>,
}

impl RowStates {
    /// Creates a history without instants.
    pub fn new(layout: RowLayout) -> Self {
        Self { layout, times: Vec::new(), values: Vec::new() }
    }

    /// Appends the state `z` at a time.
    ///
    /// # Panics
    /// When its length differs from that of the layout.
    pub fn push(&mut self, time: f64, z: &[f64]) {
        assert_eq!(z.len(), self.layout.len(), "length of a state");
        self.times.push(time);
        self.values.extend_from_slice(z);
    }

    /// Returns z at the instant `at`.
    pub fn state(&self, at: usize) -> &[f64] {
        &self.values[at * self.layout.len()..][..self.layout.len()]
    }

    /// Returns all states in the order of time.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.values.chunks_exact(self.layout.len())
    }

    /// Returns the states as plain numbers.
    pub(super) fn sampled(&self) -> SampledStates<'_> {
        SampledStates { times: &self.times, values: &self.values, width: self.layout.len() }
    }

    /// Removes all instants but the last `kept`.
    pub(super) fn keep_last(&mut self, kept: usize) {
        let first = self.times.len().saturating_sub(kept);
        self.times.drain(..first);
        self.values.drain(..first * self.layout.len());
    }
}

/// Numbers of one length at successive instants.
#[derive(Debug, Clone, Copy)]
pub(super) struct SampledStates<'a> {
    pub times: &'a [f64],
    /// Numbers at each time, one instant after the other.
    pub values: &'a [f64],
    /// Length of the numbers of an instant.
    pub width: usize,
}

impl<'a> SampledStates<'a> {
    /// Returns the numbers of all instants in the order of time.
    pub(super) fn iter(self) -> impl ExactSizeIterator<Item = &'a [f64]> {
        self.values.chunks_exact(self.width)
    }
}

/// States z of a body in its scene, both in one frame.
#[derive(Debug, Clone)]
pub(super) struct RowSampler {
    pub layout: RowLayout,
    /// Static columns of each load of the scene; `None` for a place without.
    loaded: Vec<Option<Columns>>,
    /// Interface that carries the body.
    carrier: Option<usize>,
    /// Delay of the response to loads: beta of damping in proportion to the stiffness.
    delay: f64,
}

/// Static columns of a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Columns {
    /// The columns of an interface, by its place in the layout.
    Interface(usize),
    /// The column of a named load, by its place in the layout.
    Named(usize),
}

impl RowSampler {
    /// Creates the states in the order `layout` for `body` in `scene`.
    pub(super) fn new(layout: RowLayout, body: &FlexBody, scene: &Scene) -> Self {
        let column = |place: &Point| match place {
            Point::Interface(name) => layout.interface(name).map(Columns::Interface),
            Point::NamedLoad(name) => layout.named.iter().position(|known| known == name).map(Columns::Named),
            Point::Node(_) => None,
        };
        let carrier = scene.carried.as_ref().and_then(|carried| column(&carried.by));
        Self {
            loaded: scene.loads.iter().map(|load| column(&load.at)).collect(),
            carrier: match carrier {
                Some(Columns::Interface(place)) => Some(place),
                _ => None,
            },
            delay: body.stiffness_damping(),
            layout,
        }
    }

    /// Returns the places of loads and of a carrier without static columns.
    pub(super) fn unseen<'s>(&self, scene: &'s Scene) -> Vec<&'s Point> {
        let loads = scene.loads.iter().map(|load| &load.at).zip(self.loaded.iter().map(Option::is_some));
        let carrier = scene.carried.iter().map(|carried| (&carried.by, self.carrier.is_some()));
        loads.chain(carrier).filter(|(_, is_seen)| !is_seen).map(|(place, _)| place).collect()
    }

    /// Returns z of the body at a state of its motion.
    ///
    /// # Errors
    /// The errors of [`Motion::accelerations`].
    pub(super) fn state(
        &self,
        time: f64,
        state: &[f64],
        motion: &mut Motion<'_>,
        forces: &SceneForces<'_>,
    ) -> Result<Vec<f64>, Failure> {
        // Accelerations cost a solution, and only the inertia of the deformation depends on them.
        let is_inertial = self.layout.motion.iter().any(|load| *load != MotionLoad::Damping);
        let rates = if is_inertial { Some(motion.accelerations(time, state)?.to_vec()) } else { None };
        let now = motion.evaluate(time, state)?;
        let evaluation = now.evaluation();
        let mut z = self.layout.state(evaluation.modal_coordinates(), &evaluation.rigid_velocity().1);
        // What the modes leave out follows a load that swings at w with 1 / (1 + i w beta), about exp(-i w beta): it is late
        // by beta.
        let before = (time - self.delay).max(0.0);
        for (place, (_, force, torque)) in self.loaded.iter().zip(forces.acting(before, now.place())) {
            match *place {
                Some(Columns::Interface(place)) => self.layout.add_load(&mut z, place, &force, &torque),
                Some(Columns::Named(place)) => self.layout.add_amplitude(&mut z, place, force.x),
                None => {}
            }
        }
        // The frame of a carried body has its origin at the reference point of the carrier.
        if let Some(carrier) = self.carrier {
            let (force, torque) = now.reaction();
            self.layout.add_load(&mut z, carrier, &force, &torque);
        }
        let (_, angular_acceleration, acceleration) = match &rates {
            Some(rates) => evaluation.equations().split(rates),
            None => (Vector3::zeros(), Vector3::zeros(), &[][..]),
        };
        let modal = ModalMotion {
            q: evaluation.modal_coordinates(),
            rate: evaluation.modal_velocity(),
            acceleration,
            angular_velocity: evaluation.rigid_velocity().1,
            angular_acceleration,
        };
        self.layout.set_motion(&mut z, &modal, |_| true);
        Ok(z)
    }
}

/// Rows of a recovery as a linear map of the states z.
#[derive(Debug, Clone, PartialEq)]
pub struct RowMap {
    /// Name of the recovery.
    pub name: String,
    /// Label of every row.
    pub rows: Vec<RecoveryRow>,
    /// Points with all six stresses among the rows.
    pub points: Vec<StressPoint>,
    /// Columns y0, R Psi, R G_r b_a of all interfaces of the layout, R G_r f of the named loads, -R G_r M c_kl, and those of
    /// the forces of motion (rows x length of z).
    pub(super) matrix: Mat<f64>,
}

impl RowMap {
    /// Creates the map of `recovery` for states in the order `layout`.
    pub fn new(recovery: &Recovery, layout: &RowLayout) -> Self {
        let mut matrix = Mat::zeros(recovery.rows.len(), layout.len());
        for i in 0..recovery.rows.len() {
            matrix[(i, 0)] = recovery.offset[i];
            (0..layout.modes).for_each(|j| matrix[(i, 1 + j)] = recovery.modes[(i, j)]);
            for load in &recovery.loads {
                let first =
                    layout.load(layout.interface(&load.interface).expect("a layout of this recovery"));
                (0..LOAD_COMPONENTS).for_each(|a| matrix[(i, first + a)] = load.columns[(i, a)]);
            }
            (0..recovery.named.ncols())
                .for_each(|c| matrix[(i, layout.amplitude(c))] = recovery.named[(i, c)]);
            (0..LoadKind::SPIN.len()).for_each(|c| matrix[(i, layout.spin() + c)] = recovery.spin[(i, c)]);
            for one in &recovery.motion {
                let places = layout.amplitudes(one.load).expect("a layout of this recovery");
                places.enumerate().for_each(|(c, at)| matrix[(i, at)] = one.columns[(i, c)]);
            }
        }
        let points = StressPoint::among(&recovery.rows);
        Self { name: recovery.name.clone(), rows: recovery.rows.clone(), points, matrix }
    }

    /// Returns the values of all rows in the state `z`.
    pub fn values(&self, z: &[f64]) -> Vec<f64> {
        let value = |i: usize| z.iter().enumerate().map(|(c, z)| self.matrix[(i, c)] * z).sum();
        (0..self.rows.len()).map(value).collect()
    }

    /// Returns true if any row depends on the angular velocity.
    ///
    /// * `layout`: order of the states that the map was made for.
    pub fn depends_on_spin(&self, layout: &RowLayout) -> bool {
        let of_motion = [MotionLoad::Turning, MotionLoad::Centrifugal];
        let of_motion = of_motion.iter().filter_map(|load| layout.amplitudes(*load));
        let mut places = of_motion.chain(std::iter::once(layout.spin()..layout.first_motion()));
        places.any(|places| self.matrix.as_ref().subcols(places.start, places.len()).norm_max() > 0.0)
    }
}
