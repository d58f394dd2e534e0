//! Units of the entries of the table: how they are spelt, and how numbers follow the units of a body.

use super::value::View;
use flexbody_base::units::{Unit, UnitSystem};
use flexbody_body::flex_body::{InterfaceCoordinates, LOAD_COMPONENTS, LoadKind, UnitLoad};

/// Product mass^(halves/2) length^b time^c; mass-normalised modes carry mass^(-1/2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dimension {
    mass_halves: i8,
    length: i8,
    time: i8,
}

/// Unit of an entry in terms of the body's units of mass, length and time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Units {
    /// Hertz, for any unit of time.
    Hertz,
    /// Product of the units of the body.
    Of(Dimension),
    /// Product of the units of the body over the unit of the group's load, which is not spelt.
    PerLoad(Dimension),
    /// Unit of each row, which the body's units do not change, over a product of the units of the body. Written `mixed`;
    /// the description states the units.
    RowsOver(Dimension),
    /// Unit of each row over the units of the components of a load: three forces, three torques. Written `mixed`.
    RowsOverLoad,
    /// Product of the units of the body over those of two interface coordinates. Written `mixed`.
    PerCoordinates(Dimension),
    /// Unit of the interface coordinate of each row over that of a modal coordinate. Written `mixed`.
    CoordinatesOfModes,
    /// Unknown unit of the FE model times a product of the units of the body. Written `1`.
    OfModel(Dimension),
}

/// Returns the unit with these exponents of mass^(1/2), length and time.
pub(super) const fn unit(mass_halves: i8, length: i8, time: i8) -> Units {
    Units::Of(dimension(mass_halves, length, time))
}

/// Returns the product with these exponents of mass^(1/2), length and time.
pub(super) const fn dimension(mass_halves: i8, length: i8, time: i8) -> Dimension {
    Dimension { mass_halves, length, time }
}

const MODAL_COORDINATE: Dimension = dimension(1, 1, 0);
const OF_FORCE: Dimension = dimension(2, 1, -2);
const OF_TORQUE: Dimension = dimension(2, 2, -2);

pub(super) const ONE: Units = unit(0, 0, 0);
pub(super) const MASS: Units = unit(2, 0, 0);
pub(super) const LENGTH: Units = unit(0, 1, 0);
pub(super) const MASS_LENGTH: Units = unit(2, 1, 0);
pub(super) const MASS_LENGTH2: Units = unit(2, 2, 0);
pub(super) const ROOT_MASS: Units = unit(1, 0, 0);
pub(super) const ROOT_MASS_LENGTH: Units = unit(1, 1, 0);
pub(super) const PER_ROOT_MASS: Units = unit(-1, 0, 0);
pub(super) const PER_ROOT_MASS_LENGTH: Units = unit(-1, -1, 0);
pub(super) const PER_TIME: Units = unit(0, 0, -1);
pub(super) const PER_TIME2: Units = unit(0, 0, -2);
pub(super) const FORCE: Units = Units::Of(OF_FORCE);
pub(super) const TORQUE: Units = Units::Of(OF_TORQUE);
/// Unit of each row of a recovery.
pub(super) const OF_ROWS: Units = Units::RowsOver(dimension(0, 0, 0));

/// Returns the product of units of a load. That of a load known by its name only is the user's, which a change of the
/// body's units leaves.
pub(super) fn of_load(load: &UnitLoad) -> Dimension {
    match load.kind {
        LoadKind::Acceleration => dimension(0, 1, -2),
        LoadKind::AngularAcceleration | LoadKind::Spin => dimension(0, 0, -2),
        LoadKind::Force(_) => OF_FORCE,
        LoadKind::Moment(_) => OF_TORQUE,
        LoadKind::Named(_) => dimension(0, 0, 0),
    }
}

/// Returns the product of units of an interface coordinate by its name: a modal amplitude, the rotation `... rx`, or a
/// displacement.
fn of_coordinate(name: &str) -> Dimension {
    let last = name.rsplit(' ').next().unwrap_or(name);
    if InterfaceCoordinates::is_amplitude(name) {
        MODAL_COORDINATE
    } else if last.starts_with('r') {
        dimension(0, 0, 0)
    } else {
        dimension(0, 1, 0)
    }
}

/// Change of the units of a body: factors of numbers of mass, length and time.
#[derive(Clone, Copy)]
pub(super) struct UnitChange {
    mass: f64,
    length: f64,
    time: f64,
}

impl UnitChange {
    /// Returns the change from the units `old` to `new`.
    pub(crate) fn between(old: &UnitSystem, new: &UnitSystem) -> Self {
        let ratio = |old: &Unit, new: &Unit| old.to_si() / new.to_si();
        Self {
            mass: ratio(&old.mass, &new.mass),
            length: ratio(&old.length, &new.length),
            time: ratio(&old.time, &new.time),
        }
    }

    /// Returns the factor of a number of this dimension.
    fn factor(self, Dimension { mass_halves, length, time }: Dimension) -> f64 {
        self.mass.sqrt().powi(mass_halves.into())
            * self.length.powi(length.into())
            * self.time.powi(time.into())
    }
}

impl Units {
    /// Converts numbers of the object `view`, an array in the shape that the table states, to other units.
    pub(crate) fn convert(self, change: UnitChange, view: &View<'_>, values: &mut [f64]) {
        let times = |values: &mut [f64], factor: f64| values.iter_mut().for_each(|value| *value *= factor);
        let coordinates = || -> Vec<f64> {
            let names = view.body.coordinates.iter().flat_map(|coordinates| &coordinates.names);
            names.map(|name| change.factor(of_coordinate(name))).collect()
        };
        match self {
            Units::Hertz => {}
            Units::Of(dimension) | Units::OfModel(dimension) => times(values, change.factor(dimension)),
            Units::PerLoad(dimension) => {
                let load = view.unit_load().map_or(1.0, |load| change.factor(of_load(load)));
                times(values, change.factor(dimension) / load);
            }
            Units::RowsOver(dimension) => times(values, 1.0 / change.factor(dimension)),
            Units::RowsOverLoad => {
                let components = [OF_FORCE, OF_FORCE, OF_FORCE, OF_TORQUE, OF_TORQUE, OF_TORQUE];
                let units: [f64; LOAD_COMPONENTS] = components.map(|component| change.factor(component));
                for row in values.chunks_mut(LOAD_COMPONENTS) {
                    row.iter_mut().zip(units).for_each(|(value, unit)| *value /= unit);
                }
            }
            Units::PerCoordinates(dimension) => {
                let units = coordinates();
                let factor = change.factor(dimension);
                for (row, of_row) in values.chunks_mut(units.len().max(1)).zip(&units) {
                    let pairs = row.iter_mut().zip(&units);
                    pairs.for_each(|(value, of_column)| *value = *value * factor / (of_row * of_column));
                }
            }
            Units::CoordinatesOfModes => {
                let nf = view.body.modes.eigenvalue.len();
                let modal = change.factor(MODAL_COORDINATE);
                for (row, of_row) in values.chunks_mut(nf).zip(coordinates()) {
                    row.iter_mut().for_each(|value| *value = *value * of_row / modal);
                }
            }
        }
    }

    /// Returns the unit with the unit names of a body: `kg m^2`, `tonne^(1/2) mm`, `s^-2`. A unit that the user gave as
    /// a number is written in SI: `(0.0254 m)^2`.
    pub(crate) fn concrete(self, system: &UnitSystem) -> String {
        let name = |unit: &Unit, si: &str| match unit.name().parse::<f64>() {
            Ok(_) => format!("({} {si})", unit.name()),
            Err(_) => unit.name().to_owned(),
        };
        self.spell([name(&system.mass, "kg"), name(&system.length, "m"), name(&system.time, "s")])
    }

    /// Returns the unit in words: `mass length^2`.
    pub(crate) fn symbolic(self) -> String {
        self.spell(["mass", "length", "time"].map(str::to_owned))
    }

    fn spell(self, [mass, length, time]: [String; 3]) -> String {
        let Dimension { mass_halves, length: l, time: t } = match self {
            Units::Hertz => return "Hz".to_owned(),
            Units::OfModel(_) | ONE => return "1".to_owned(),
            Units::Of(dimension) | Units::PerLoad(dimension) => dimension,
            Units::RowsOver(_)
            | Units::RowsOverLoad
            | Units::PerCoordinates(_)
            | Units::CoordinatesOfModes => return "mixed".to_owned(),
        };
        let mut factors = Vec::new();
        match mass_halves {
            0 => {}
            2 => factors.push(mass),
            m if m % 2 == 0 => factors.push(format!("{mass}^{}", m / 2)),
            m => factors.push(format!("{mass}^({m}/2)")),
        }
        for (name, power) in [(length, l), (time, t)] {
            match power {
                0 => {}
                1 => factors.push(name),
                p => factors.push(format!("{name}^{p}")),
            }
        }
        factors.join(" ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_spelt_with_the_names_of_the_body() {
        let system = UnitSystem::parse("mm", "tonne", "0.5").expect("known units");
        let spelt = |mass_halves, length, time| unit(mass_halves, length, time).concrete(&system);
        assert_eq!(spelt(2, 2, 0), "tonne mm^2");
        assert_eq!(spelt(1, 1, 0), "tonne^(1/2) mm");
        assert_eq!(spelt(-1, 0, 0), "tonne^(-1/2)");
        assert_eq!(spelt(4, 0, 1), "tonne^2 (0.5 s)");
        assert_eq!(spelt(0, 0, -2), "(0.5 s)^-2");
        assert_eq!((ONE.concrete(&system), Units::Hertz.concrete(&system)), ("1".into(), "Hz".into()));
        assert_eq!(unit(1, 1, -2).symbolic(), "mass^(1/2) length time^-2");
    }
}
