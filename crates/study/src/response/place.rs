//! Place of a force or of a measured displacement, with its directions along the axes of the model.

use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, NamedLoad};
use flexbody_model::FeModel;
use flexbody_motion::scene::{Point, find_nodal_point};
use nalgebra::Vector3;

/// Direction of a force and displacement along an axis of the model, or of a torque and rotation about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, strum::IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
pub enum Direction {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
    /// About x.
    Rx,
    /// About y.
    Ry,
    /// About z.
    Rz,
    /// Amplitude of a named load, which has no direction in space.
    Amplitude,
}

impl Direction {
    /// All six directions in space.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::Rx, Self::Ry, Self::Rz];

    /// Returns the name of the direction: `x`, `y`, `z`, `rx`, `ry`, `rz` or `amplitude`.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns true for a torque and a rotation.
    pub fn turns(self) -> bool {
        matches!(self, Self::Rx | Self::Ry | Self::Rz)
    }

    /// Returns the index of the axis: 0, 1 or 2.
    fn axis(self) -> usize {
        self as usize % 3
    }

    /// Returns the index among the directions of a body of the given dimension; `None` if the body does not have the
    /// direction.
    fn column(self, dimension: usize) -> Option<usize> {
        match (dimension, self) {
            (_, Self::Amplitude) => Some(0),
            (3, _) | (_, Self::X | Self::Y) => Some(self as usize),
            (_, Self::Rz) => Some(2),
            _ => None,
        }
    }
}

/// Point of the body with the directions that count there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Node, or reference point of an interface.
    pub point: Point,
    /// Directions; empty means all displacements.
    pub directions: Vec<Direction>,
}

/// Motion of a point of a body: its position, and its displacements and rotations in the modes (3 x nf each).
/// `rotation` is `None` if the model does not determine it.
struct PointMotion {
    position: Vector3<f64>,
    translation: Mat<f64>,
    rotation: Option<Mat<f64>>,
}

/// Modal and rigid loads of a place.
pub(super) struct PlaceRows {
    /// Displacements and rotations of the modes along the directions (nf x k).
    pub modal: Mat<f64>,
    /// Force and torque about the centre of mass of a unit force or torque along each direction (6 x k).
    pub rigid: Mat<f64>,
}

impl Place {
    /// Returns the place of all displacements of a point.
    pub fn of(point: Point) -> Self {
        Self { point, directions: Vec::new() }
    }

    /// Parses a place: a node number or interface name, optionally with a colon and directions (`17`, `big_end`,
    /// `big_end:z`, `17:x,rz`).
    pub fn parse(text: &str) -> Self {
        let named = |name: &str| Direction::ALL.into_iter().find(|direction| direction.name() == name);
        let point = |text: &str| text.parse().map_or_else(|_| Point::Interface(text.to_owned()), Point::Node);
        // Text after a colon that is not a list of directions belongs to the name.
        let split = text.rsplit_once(':').and_then(|(before, after)| {
            let directions: Option<Vec<Direction>> =
                after.split(',').map(|name| named(name.trim())).collect();
            Some((before, directions?))
        });
        match split {
            Some((before, mut directions)) => {
                directions.sort_unstable();
                directions.dedup();
                Self { point: point(before), directions }
            }
            None => Self::of(point(text)),
        }
    }

    /// Returns the name of an interface or the number of a node, as it is stated.
    pub(super) fn stated_name(&self) -> String {
        match &self.point {
            Point::Node(number) => number.to_string(),
            Point::Interface(name) | Point::NamedLoad(name) => name.clone(),
        }
    }

    /// Returns the directions of the place in a body of the given dimension.
    pub(super) fn directions_of(&self, dimension: usize) -> Vec<Direction> {
        match self.directions.as_slice() {
            _ if matches!(self.point, Point::NamedLoad(_)) => vec![Direction::Amplitude],
            [] => Direction::ALL[..dimension].to_vec(),
            directions => directions.to_vec(),
        }
    }

    /// Returns the modal and rigid loads of the place. The axes of `body` must be those of the model and its origin the
    /// centre of mass.
    ///
    /// # Errors
    /// [`PlaceUnknown`](Code::PlaceUnknown) for a point or direction that the body does not have.
    pub(super) fn rows(&self, body: &FlexBody) -> Result<PlaceRows> {
        if let Some(load) = self.named_load(body) {
            let resultant = [load.resultant_force(), load.torque_at(&vec![0.0; load.modal.len()])];
            return Ok(PlaceRows {
                modal: Mat::from_fn(load.modal.len(), 1, |j, _| load.modal[j]),
                rigid: Mat::from_fn(6, 1, |i, _| resultant[i / 3][i % 3]),
            });
        }
        let (nf, d) = (body.n_modes(), body.dimension());
        let PointMotion { position, translation, rotation } = self.motion(body)?;
        let directions = self.directions_of(d);
        for direction in &directions {
            if direction.column(d).is_none() {
                return Err(self.without_direction(*direction, "the body lies in a plane"));
            }
            if direction.turns() && rotation.is_none() {
                return Err(self.without_direction(*direction, "its nodes do not determine a rotation"));
            }
        }
        let modal = Mat::from_fn(nf, directions.len(), |j, at| {
            let (direction, rows) = (directions[at], rotation.as_ref().filter(|_| directions[at].turns()));
            rows.unwrap_or(&translation)[(direction.axis(), j)]
        });
        let rigid = Mat::from_fn(6, directions.len(), |i, at| {
            let axis = Vector3::ith(directions[at].axis(), 1.0);
            let turns = directions[at].turns();
            let force = if turns { Vector3::zeros() } else { axis };
            let torque = if turns { axis } else { position.cross(&axis) };
            if i < 3 { force[i] } else { torque[i - 3] }
        });
        Ok(PlaceRows { modal, rigid })
    }

    /// Returns the place with the named load of `body` in place of an unknown interface of its name.
    ///
    /// # Errors
    /// [`PlaceUnknown`](Code::PlaceUnknown) for a preload, and for directions of a named load.
    pub(super) fn resolved(&self, body: &FlexBody) -> Result<Self> {
        let (Point::Interface(name) | Point::NamedLoad(name)) = &self.point else { return Ok(self.clone()) };
        let Some(load) = body.named_loads().iter().find(|load| load.name == *name) else {
            return Ok(self.clone());
        };
        let refuse = |message: String, help: &str| {
            Err(Diagnostic::new(Code::PlaceUnknown, message).with_help(help.to_owned()).into())
        };
        if load.preload {
            let message = format!("`{name}` is a preload, which is constant");
            return refuse(message, "give a load whose amplitude oscillates");
        }
        if !self.directions.is_empty() {
            let message = format!("named load `{name}` has no directions: its input is its amplitude");
            return refuse(message, "leave the directions out");
        }
        Ok(Self::of(Point::NamedLoad(name.clone())))
    }

    /// Returns the named load of the place.
    fn named_load<'b>(&self, body: &'b FlexBody) -> Option<&'b NamedLoad> {
        let Point::NamedLoad(name) = &self.point else { return None };
        body.named_loads().iter().find(|load| load.name == *name)
    }

    /// Returns the place of the named load in the list of the body.
    pub(super) fn named_column(&self, body: &FlexBody) -> Option<usize> {
        let Point::NamedLoad(name) = &self.point else { return None };
        body.named_loads().iter().position(|load| load.name == *name)
    }

    fn motion(&self, body: &FlexBody) -> Result<PointMotion> {
        let (modes, nf) = (body.modes(), body.n_modes());
        match &self.point {
            Point::Node(number) => {
                let found = body.nodes().ids.iter().position(|id| id == number);
                let node = found.ok_or_else(|| self.unknown(body))?;
                let rows_of_node = |shape: &Mat<f64>| Mat::from_fn(3, nf, |k, j| shape[(3 * node + k, j)]);
                // Nodes without rotations have zero rows.
                let turns = |rows: &Mat<f64>| (0..nf).any(|j| (0..3).any(|k| rows[(k, j)] != 0.0));
                let rotation = modes.rotation.as_ref().map(rows_of_node).filter(turns);
                let position = Vector3::from(body.nodes().positions[node]);
                Ok(PointMotion { position, translation: rows_of_node(&modes.shape), rotation })
            }
            Point::NamedLoad(_) => Err(self.unknown(body)),
            Point::Interface(name) => {
                let found = body.interfaces().iter().find(|interface| interface.name == *name);
                let interface = found.ok_or_else(|| self.unknown(body))?;
                let rotation = modes.rotation.as_ref().map(|rotation| rotation.as_ref());
                let rows = interface.rows(body.nodes(), modes.shape.as_ref(), rotation, body.dimension());
                match (rows, interface.reference) {
                    (Some(rows), Some(reference)) => Ok(PointMotion {
                        position: Vector3::from(reference),
                        translation: rows.translation,
                        rotation: rows.rotation,
                    }),
                    _ => {
                        let message = format!("{} has no reference point: its coupling is free", self.point);
                        let help = "give the number of one of its nodes";
                        Err(Diagnostic::new(Code::PlaceUnknown, message).with_help(help).into())
                    }
                }
            }
        }
    }

    /// Returns the nodal forces of a unit force or torque along each direction (N x k). Their transpose gives the
    /// displacements.
    ///
    /// # Errors
    /// [`PlaceUnknown`](Code::PlaceUnknown) for a point or direction that the model does not have, and
    /// [`InterfaceNode`](Code::InterfaceNode).
    pub(super) fn loads(&self, model: &FeModel) -> Result<Mat<f64>> {
        let d = model.dimension();
        let missing = || {
            let message = format!("the model has no {} with a reference point", self.point);
            Diagnostic::new(Code::PlaceUnknown, message)
        };
        let all = find_nodal_point(model, &self.point)?.ok_or_else(missing)?.unit_loads(model);
        let mut columns = Mat::zeros(all.nrows(), 0);
        for direction in self.directions_of(d) {
            let column = direction.column(d).filter(|&column| column < all.ncols());
            let load = column.map(|column| all.as_ref().col(column)).filter(|load| load.norm_max() > 0.0);
            let load = load
                .ok_or_else(|| self.without_direction(direction, "its nodes do not determine a rotation"))?;
            columns.resize_with(all.nrows(), columns.ncols() + 1, |i, _| load[i]);
        }
        Ok(columns)
    }

    fn without_direction(&self, direction: Direction, why: &str) -> flexbody_base::error::Error {
        let message = format!("{} has no direction {}: {why}", self.point, direction.name());
        Diagnostic::new(Code::PlaceUnknown, message).with_help("leave the direction out").into()
    }

    fn unknown(&self, body: &FlexBody) -> flexbody_base::error::Error {
        let names: Vec<&str> = body.interfaces().iter().map(|interface| interface.name.as_str()).collect();
        let help = match names.as_slice() {
            [] => "give the number of a node: the body has no interfaces".to_owned(),
            names => format!("give the number of a node, or one of the interfaces {}", names.join(", ")),
        };
        Diagnostic::new(Code::PlaceUnknown, format!("the body has no {}", self.point)).with_help(help).into()
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_as_they_are_written() {
        let interface = |name: &str| Point::Interface(name.to_owned());
        for (text, point, directions) in [
            ("17", Point::Node(17), vec![]),
            ("big_end", interface("big_end"), vec![]),
            ("big_end:z", interface("big_end"), vec![Direction::Z]),
            ("17:rz,x,x", Point::Node(17), vec![Direction::X, Direction::Rz]),
            ("hub:left", interface("hub:left"), vec![]),
            ("hub:left:y", interface("hub:left"), vec![Direction::Y]),
            ("hub:", interface("hub:"), vec![]),
        ] {
            assert_eq!(Place::parse(text), Place { point, directions }, "{text}");
        }
    }
}
