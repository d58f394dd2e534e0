//! What an entry of the table holds, and where the writer takes it from.

use faer::{Mat, MatRef};
use flexbody_base::units::{Unit, UnitSystem};
use flexbody_body::flex_body::{GeometricStiffness, Interface, InterfaceRows, LumpedBody, Parts};
use flexbody_body::invariants::Invariants;

/// Content of one entry; arrays are row-major in the shape that the table states.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Floats(Vec<f64>),
    Ints(Vec<i64>),
    Indices(Vec<i32>),
    Text(String),
    Int(i64),
    Float(f64),
    /// Attributes whose names are data.
    Named(Vec<(String, f64)>),
}

/// What the entries of one group are about.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub body: &'a Parts,
    pub lumped: Option<&'a LumpedBody>,
    pub interface: Option<&'a Interface>,
    /// Geometric stiffness or stiffness of inertia.
    pub geometric_stiffness: Option<&'a GeometricStiffness<Mat<f64>>>,
}

impl<'a> View<'a> {
    /// The invariants of the group: exact, or those of its lumping scheme.
    pub(crate) fn invariants(&self) -> &'a Invariants {
        self.lumped.map_or(&self.body.invariants, |l| &l.invariants)
    }

    /// The modes at the reference point of the group's interface.
    pub(crate) fn interface_rows(&self) -> Option<InterfaceRows> {
        let Parts { nodes, modes, dimension, .. } = self.body;
        let rotation = modes.rotation.as_ref().map(Mat::as_ref);
        self.interface?.rows(nodes, modes.shape.as_ref(), rotation, *dimension)
    }

    /// Node indices of the group's interface.
    pub(crate) fn interface_nodes(&self) -> &'a [usize] {
        self.interface.map_or(&[], |i| &i.nodes)
    }
}

/// Components of shapes (3n x nf) at `nodes`, (nf x nodes x 3).
pub(super) fn shape_rows(shape: &Mat<f64>, nodes: impl Iterator<Item = usize> + Clone) -> Value {
    let mut out = Vec::new();
    for j in 0..shape.ncols() {
        out.extend(nodes.clone().flat_map(|i| [0, 1, 2].map(|k| shape[(3 * i + k, j)])));
    }
    Value::Floats(out)
}

/// A matrix, row by row.
pub(super) fn rows(m: MatRef<'_, f64>) -> impl Iterator<Item = f64> + '_ {
    (0..m.nrows()).flat_map(move |i| (0..m.ncols()).map(move |j| m[(i, j)]))
}

pub(super) fn matrix(m: MatRef<'_, f64>) -> Option<Value> {
    Some(Value::Floats(rows(m).collect()))
}

/// A 3-vector or 3x3 matrix of nalgebra, row by row.
pub(super) fn small<const C: usize>(m: nalgebra::SMatrix<f64, 3, C>) -> Option<Value> {
    Some(Value::Floats(m.transpose().iter().copied().collect()))
}

/// Indices of nodes, of which no body has more than 2^31.
pub(super) fn indices(values: &[u32]) -> Value {
    Value::Indices(values.iter().map(|&i| i32::try_from(i).unwrap_or(i32::MAX)).collect())
}

/// A count as the file's integer. Counts of things in memory are far below 2^63.
pub(super) fn count(value: usize) -> Option<Value> {
    Some(Value::Int(i64::try_from(value).unwrap_or(i64::MAX)))
}

pub(super) fn text(value: impl Into<String>) -> Option<Value> {
    Some(Value::Text(value.into()))
}

/// Units of an entry in terms of the body's units of mass, length and time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Units {
    /// Dimensionless, written `1`.
    One,
    /// Hertz, whatever the unit of time.
    Hertz,
    /// They differ between the rows, as the description says.
    Mixed,
    /// mass^(halves/2) length^b time^c: mass-normalised modes carry mass^(-1/2).
    Of { mass_halves: i8, length: i8, time: i8 },
}

impl Units {
    /// With the unit names of a body: `kg m^2`, `tonne^(1/2) mm`, `s^-2`; a unit that the user gave as a
    /// number is written in SI: `(0.0254 m)^2`.
    pub(crate) fn concrete(self, system: &UnitSystem) -> String {
        let name = |unit: &Unit, si: &str| match unit.name().parse::<f64>() {
            Ok(_) => format!("({} {si})", unit.name()),
            Err(_) => unit.name().to_owned(),
        };
        self.spell([name(&system.mass, "kg"), name(&system.length, "m"), name(&system.time, "s")])
    }

    /// In words: `mass length^2`.
    pub(crate) fn symbolic(self) -> String {
        self.spell(["mass", "length", "time"].map(str::to_owned))
    }

    fn spell(self, [mass, length, time]: [String; 3]) -> String {
        let (m, l, t) = match self {
            Units::One => return "1".to_owned(),
            Units::Hertz => return "Hz".to_owned(),
            Units::Mixed => return "mixed".to_owned(),
            Units::Of { mass_halves, length, time } => (mass_halves, length, time),
        };
        let mut factors = Vec::new();
        match m {
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
        let spelt = |mass_halves, length, time| Units::Of { mass_halves, length, time }.concrete(&system);
        assert_eq!(spelt(2, 2, 0), "tonne mm^2");
        assert_eq!(spelt(1, 1, 0), "tonne^(1/2) mm");
        assert_eq!(spelt(-1, 0, 0), "tonne^(-1/2)");
        assert_eq!(spelt(4, 0, 1), "tonne^2 (0.5 s)");
        assert_eq!(spelt(0, 0, -2), "(0.5 s)^-2");
        assert_eq!((Units::One.concrete(&system), Units::Hertz.concrete(&system)), ("1".into(), "Hz".into()));
        assert_eq!(Units::Of { mass_halves: 1, length: 1, time: -2 }.symbolic(), "mass^(1/2) length time^-2");
    }
}
