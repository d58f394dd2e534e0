//! Conversion of a body to other units.

use super::{
    Certificate, FixedInterface, FlexBody, FreeEstimate, Guarantee, InterfaceCoordinates, InternalRows,
    LoadColumns, LumpedBody, Modes, MotionColumns, NamedLoad, Parts, Recovery, RotatedStiffness, UnitLoad,
};
use crate::invariants::{InertiaStiffness, Invariants, UnitFactors};
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_base::units::UnitSystem;
use flexbody_model::{GeometricStiffness, LoadKind, NodeMoments};

/// Factor of a number for a change of units, from its powers of mass, length and time.
#[derive(Clone, Copy)]
struct Change {
    mass: f64,
    length: f64,
    time: f64,
}

impl Change {
    /// Returns mass^(halves/2) length^l time^t.
    fn of(self, mass_halves: i32, length: i32, time: i32) -> f64 {
        self.mass.sqrt().powi(mass_halves) * self.length.powi(length) * self.time.powi(time)
    }

    /// Returns the factor of an eigenvalue: one over time squared.
    fn eigenvalue(self) -> f64 {
        self.of(0, 0, -2)
    }

    /// Returns the factor of a modal coordinate of a mass-normalised mode: sqrt(mass) length.
    fn modal(self) -> f64 {
        self.of(1, 1, 0)
    }

    fn invariants(self, given: &Invariants) -> Invariants {
        given.scaled(&UnitFactors {
            mass: self.of(2, 0, 0),
            first_moment: self.of(2, 1, 0),
            second_moment: self.of(2, 2, 0),
            c1: self.of(1, 0, 0),
            ibar: self.modal(),
            modal_stiffness: self.eigenvalue(),
        })
    }

    fn modes(self, given: &Modes) -> Modes {
        let (displacement, rotation) = (self.of(-1, 0, 0), self.of(-1, -1, 0));
        Modes {
            eigenvalue: given.eigenvalue.iter().map(|v| v * self.eigenvalue()).collect(),
            modal_damping: given.modal_damping.as_ref().map(|d| times(d, self.of(0, 0, -1))),
            shape: times(&given.shape, displacement),
            rotation: given.rotation.as_ref().map(|r| times(r, rotation)),
            internal: given.internal.as_ref().map(|internal| InternalRows {
                shape: times(&internal.shape, displacement),
                ..internal.clone()
            }),
            ..given.clone()
        }
    }

    /// Returns K_geo of a unit load in the new units: 1/time^2 over the unit of the load.
    fn geometric(self, given: &GeometricStiffness<Mat<f64>>) -> GeometricStiffness<Mat<f64>> {
        let factor = self.eigenvalue() / self.load(&given.load);
        GeometricStiffness { load: given.load.clone(), matrix: times(&given.matrix, factor) }
    }

    /// Returns K_geo of rotations for a unit load in the new units.
    fn rotated(self, given: &RotatedStiffness) -> RotatedStiffness {
        let load = self.load(&given.load);
        RotatedStiffness {
            load: given.load.clone(),
            modes: times(&given.modes, self.of(1, 1, -2) / load),
            rotation: times(&given.rotation, self.of(2, 2, -2) / load),
        }
    }

    /// Returns the factor of the unit of a load.
    fn load(self, load: &UnitLoad) -> f64 {
        match load.kind {
            LoadKind::Acceleration => self.of(0, 1, -2),
            LoadKind::AngularAcceleration | LoadKind::Spin => self.of(0, 0, -2),
            LoadKind::Force(_) => self.of(2, 1, -2),
            LoadKind::Moment(_) => self.of(2, 2, -2),
            // The unit of a load known by its name only is chosen by the user.
            LoadKind::Named(_) => 1.0,
        }
    }

    fn inertia_stiffness(self, given: &InertiaStiffness) -> InertiaStiffness {
        let moments = |node: &NodeMoments| NodeMoments {
            first: node.first * self.of(2, 1, 0),
            second: node.second * self.of(2, 2, 0),
        };
        InertiaStiffness {
            moments: given.moments.iter().map(moments).collect(),
            stiffness: given.stiffness.iter().map(|one| self.geometric(one)).collect(),
        }
    }

    fn certificate(self, given: &Certificate) -> Certificate {
        let eigenvalues = |values: &[f64]| values.iter().map(|v| v * self.eigenvalue()).collect();
        Certificate {
            shift: given.shift * self.eigenvalue(),
            guarantee: given.guarantee.as_ref().map(|guarantee| Guarantee {
                shift_below: guarantee.shift_below * self.eigenvalue(),
                eigenvalue_lower: eigenvalues(&guarantee.eigenvalue_lower),
                eigenvalue_upper: eigenvalues(&guarantee.eigenvalue_upper),
                ..guarantee.clone()
            }),
            fixed_interface: given.fixed_interface.as_ref().map(|fixed| FixedInterface {
                shift: fixed.shift * self.eigenvalue(),
                next: fixed.next.map(|next| next * self.eigenvalue()),
                eigenvalues: eigenvalues(&fixed.eigenvalues),
                free: fixed.free.as_ref().map(|free| FreeEstimate {
                    estimate: eigenvalues(&free.estimate),
                    lower: eigenvalues(&free.lower),
                }),
                ..*fixed
            }),
            ..given.clone()
        }
    }
}

fn times(a: &Mat<f64>, factor: f64) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * factor)
}

impl Change {
    /// Returns a recovery for modal coordinates, angular velocities and loads in the new units. Its values keep the
    /// units of their rows.
    fn recovery(self, given: &Recovery) -> Recovery {
        let (force, torque) = (self.of(2, 1, -2), self.of(2, 2, -2));
        let loads = |one: &LoadColumns| LoadColumns {
            columns: Mat::from_fn(one.columns.nrows(), one.columns.ncols(), |i, a| {
                one.columns[(i, a)] / if a < 3 { force } else { torque }
            }),
            ..one.clone()
        };
        let of_motion = |one: &MotionColumns| {
            let amplitude = self.modal() * self.of(0, 0, one.load.power_of_time());
            MotionColumns { columns: times(&one.columns, 1.0 / amplitude), ..*one }
        };
        Recovery {
            modes: times(&given.modes, 1.0 / self.modal()),
            spin: times(&given.spin, 1.0 / self.of(0, 0, -2)),
            loads: given.loads.iter().map(loads).collect(),
            motion: given.motion.iter().map(of_motion).collect(),
            ..given.clone()
        }
    }

    /// Returns a named load in the new units; the amplitude 1 stays the same load.
    fn named_load(self, given: &NamedLoad) -> NamedLoad {
        let (force, torque) = (self.of(2, 1, -2), self.of(2, 2, -2));
        NamedLoad {
            modal: given.modal.iter().map(|value| value * force / self.of(1, 0, 0)).collect(),
            force: given.force * force,
            torque: given.torque * torque,
            moments: given.moments * torque,
            turning: times(&given.turning, force / self.of(1, 0, 0)),
            compliance: given.compliance.map(|value| value * torque),
            ..given.clone()
        }
    }

    /// Returns the factor of a coordinate by its name: a modal amplitude, the rotation `... rx`, or a
    /// displacement.
    fn coordinate(self, name: &str) -> f64 {
        let last = name.rsplit(' ').next().unwrap_or(name);
        if InterfaceCoordinates::is_amplitude(name) {
            self.modal()
        } else if last.starts_with('r') {
            1.0
        } else {
            self.of(0, 1, 0)
        }
    }

    fn coordinates(self, given: &InterfaceCoordinates) -> InterfaceCoordinates {
        let unit: Vec<f64> = given.names.iter().map(|name| self.coordinate(name)).collect();
        let pairs = |a: &Mat<f64>, factor: f64| {
            Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * factor / (unit[i] * unit[j]))
        };
        let of_modes = &given.of_modes;
        InterfaceCoordinates {
            names: given.names.clone(),
            stiffness: pairs(&given.stiffness, self.of(2, 2, -2)),
            mass: pairs(&given.mass, self.of(2, 2, 0)),
            of_modes: Mat::from_fn(of_modes.nrows(), of_modes.ncols(), |i, j| {
                of_modes[(i, j)] * unit[i] / self.modal()
            }),
        }
    }
}

impl FlexBody {
    /// Returns this body with every number in `units`, which then count as stated. Modes stay
    /// mass-normalised: their shapes change with the unit of mass. Geometric stiffness of a load known by
    /// its name only keeps the unit of its load.
    ///
    /// # Errors
    /// The errors of [`FlexBody::new`], if numbers leave the range of double precision.
    pub fn in_units(&self, units: &UnitSystem) -> Result<Self> {
        let old = self.units();
        let ratio = |old: f64, new: f64| old / new;
        let change = Change {
            mass: ratio(old.mass.to_si(), units.mass.to_si()),
            length: ratio(old.length.to_si(), units.length.to_si()),
            time: ratio(old.time.to_si(), units.time.to_si()),
        };
        let point = |x: &[f64; 3]| x.map(|v| v * change.length);
        let mut parts: Parts = self.parts().clone();
        parts.description.units = units.clone();
        parts.frame.origin *= change.length;
        parts.nodes.positions = parts.nodes.positions.iter().map(point).collect();
        parts.modes = change.modes(&parts.modes);
        parts.invariants = change.invariants(&parts.invariants);
        parts.geometric_stiffness =
            parts.geometric_stiffness.iter().map(|one| change.geometric(one)).collect();
        parts.rotated_stiffness = parts.rotated_stiffness.iter().map(|one| change.rotated(one)).collect();
        parts.inertia_stiffness =
            parts.inertia_stiffness.as_ref().map(|inertia| change.inertia_stiffness(inertia));
        let lumped =
            |one: &LumpedBody| LumpedBody { invariants: change.invariants(&one.invariants), ..one.clone() };
        parts.lumped = parts.lumped.iter().map(lumped).collect();
        parts.certificate = change.certificate(&parts.certificate);
        for interface in &mut parts.interfaces {
            interface.reference = interface.reference.as_ref().map(point);
        }
        parts.recoveries = parts.recoveries.iter().map(|one| change.recovery(one)).collect();
        parts.named_loads = parts.named_loads.iter().map(|one| change.named_load(one)).collect();
        parts.coordinates = parts.coordinates.as_ref().map(|coordinates| change.coordinates(coordinates));
        Self::new(parts)
    }
}
