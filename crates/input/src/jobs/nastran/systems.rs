//! Coordinate systems by three grids (CORD1x) or three points (CORD2x), each in another system, and the transformation
//! of coordinates and row axes.

use flexbody_base::diagnostic::{Code, Diagnostic};
use libm::{hypot, sincos};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// Largest depth of systems that refer to one another.
const MAX_REFERENCE_DEPTH: usize = 200;
/// Sine of the angle between the points of a system below which they count as collinear.
const ON_A_LINE: f64 = 1e-12;
/// Distance from the axis, relative to that from the origin, below which a grid counts as on the axis.
const ON_THE_AXIS: f64 = 1e-12;

/// Kind of the coordinates of a system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SystemKind {
    /// Coordinates x, y, z.
    Rectangular,
    /// Coordinates radius, angle in degrees, z.
    Cylindrical,
    /// Coordinates radius, angle from the z axis, angle about it, both in degrees.
    Spherical,
}

/// Grid with its position, the system of its coordinates and the system of its rows.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    /// System of the coordinates (CP) and of the rows (CD); `None` only while the deck is read.
    pub system: Option<i64>,
    pub x: [f64; 3],
    pub axes: Option<i64>,
    /// True if the field PS (permanent constraints) of the card is not empty.
    pub has_support_field: bool,
    /// Components held by the card.
    pub held: Vec<u8>,
    /// Position of the card: index of the file, and line.
    pub file: usize,
    pub line: usize,
}

/// Card of a system.
#[derive(Debug, Clone)]
pub(super) struct SystemCard {
    kind: SystemKind,
    definition: Definition,
    path: PathBuf,
    line: usize,
}

/// Origin, a point of the z axis, and a point of the xz plane.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Definition {
    /// Three grids.
    Grids([i64; 3]),
    /// Three points in another system.
    Points { reference: i64, points: [[f64; 3]; 3] },
}

impl Grid {
    /// Returns true when both cards define the same grid.
    pub(super) fn is_the_same(&self, other: &Self) -> bool {
        let said = |position: &Self| (position.system, position.x, position.axes, position.held.clone());
        said(self) == said(other)
    }
}

impl SystemCard {
    /// Returns true when both cards define the same system.
    pub(super) fn is_the_same(&self, other: &Self) -> bool {
        self.kind == other.kind && self.definition == other.definition
    }

    pub(super) fn new(kind: SystemKind, definition: Definition, path: &Path, line: usize) -> Self {
        Self { kind, definition, path: path.to_path_buf(), line }
    }
}

/// System in the basic system.
#[derive(Debug, Clone, Copy)]
struct System {
    kind: SystemKind,
    origin: [f64; 3],
    /// Unit vectors along x, y, z.
    axes: [[f64; 3]; 3],
}

/// Axes of a system in the basic system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum SystemAxes {
    /// Unit vectors along x, y, z.
    Fixed([[f64; 3]; 3]),
    /// Point of the axis of a cylindrical system, and its direction.
    Cylinder { origin: [f64; 3], along: [f64; 3] },
    /// Spherical system.
    Sphere,
}

const BASIC: System = System {
    kind: SystemKind::Rectangular,
    origin: [0.0; 3],
    axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
};

/// Cache of systems, each computed once.
pub(super) struct Systems<'b> {
    cards: &'b HashMap<i64, SystemCard>,
    grids: &'b BTreeMap<i64, Grid>,
    known: HashMap<i64, System>,
    /// Systems that are being computed.
    open: Vec<i64>,
}

impl<'b> Systems<'b> {
    pub(super) fn new(cards: &'b HashMap<i64, SystemCard>, grids: &'b BTreeMap<i64, Grid>) -> Self {
        Self { cards, grids, known: HashMap::from([(0, BASIC)]), open: Vec::new() }
    }

    /// Returns the position of a grid in the basic system.
    ///
    /// # Errors
    /// FB110 for systems that are missing, refer to themselves, or have collinear points.
    pub(super) fn position(&mut self, grid: &Grid) -> Result<[f64; 3], Diagnostic> {
        let system = self.system(grid.system.unwrap_or(0))?;
        Ok(system.point(grid.x))
    }

    /// Returns the unit vectors, in the basic system, along the rows of a grid at `x`.
    ///
    /// # Errors
    /// The errors of [`position`](Self::position).
    pub(super) fn axes(&mut self, grid: &Grid, x: [f64; 3]) -> Result<[[f64; 3]; 3], Diagnostic> {
        Ok(self.system(grid.axes.unwrap_or(0))?.axes_at(x))
    }

    /// Returns the axes of a material along a system.
    ///
    /// # Errors
    /// The errors of [`position`](Self::position).
    pub(super) fn of_material(&mut self, id: i64) -> Result<SystemAxes, Diagnostic> {
        let System { kind, origin, axes } = self.system(id)?;
        Ok(match kind {
            SystemKind::Rectangular => SystemAxes::Fixed(axes),
            SystemKind::Cylindrical => SystemAxes::Cylinder { origin, along: axes[2] },
            SystemKind::Spherical => SystemAxes::Sphere,
        })
    }

    fn system(&mut self, id: i64) -> Result<System, Diagnostic> {
        if let Some(known) = self.known.get(&id) {
            return Ok(*known);
        }
        let refused = |message: String| Diagnostic::new(Code::DeckSyntax, message);
        let Some(card) = self.cards.get(&id) else {
            return Err(refused(format!("coordinate system {id} is not in the deck")));
        };
        let at = |diagnostic: Diagnostic| diagnostic.in_file(&card.path).at_line(card.line);
        if self.open.contains(&id) || self.open.len() >= MAX_REFERENCE_DEPTH {
            let through: Vec<String> = self.open.iter().take(8).map(i64::to_string).collect();
            let message = format!("coordinate system {id} refers to itself through {}", through.join(", "));
            return Err(
                at(refused(message)).with_help("define one of the systems of the circle in the basic system")
            );
        }
        self.open.push(id);
        let points = self.points(card).map_err(|diagnostic| match diagnostic.file() {
            None => at(diagnostic),
            Some(_) => diagnostic,
        });
        self.open.pop();
        let system = System::through(card.kind, points?)
            .ok_or_else(|| at(refused(format!("the points of coordinate system {id} lie on one line"))))?;
        self.known.insert(id, system);
        Ok(system)
    }

    /// Returns the three points of a card in the basic system.
    fn points(&mut self, card: &SystemCard) -> Result<[[f64; 3]; 3], Diagnostic> {
        match &card.definition {
            Definition::Points { reference, points } => {
                let system = self.system(*reference)?;
                Ok(points.map(|x| system.point(x)))
            }
            Definition::Grids(ids) => {
                let mut points = [[0.0; 3]; 3];
                for (point, id) in points.iter_mut().zip(ids) {
                    let grids = self.grids;
                    let Some(grid) = grids.get(id) else {
                        let message = format!("grid {id} of a coordinate system is not in the deck");
                        return Err(Diagnostic::new(Code::DeckSyntax, message));
                    };
                    *point = self.position(grid)?;
                }
                Ok(points)
            }
        }
    }
}

impl System {
    /// Creates the system from its origin, a point of the z axis and a point of the xz plane; returns `None` if they
    /// are collinear.
    fn through(kind: SystemKind, [origin, on_z, in_plane]: [[f64; 3]; 3]) -> Option<Self> {
        let z = unit(minus(on_z, origin))?;
        let across = unit(minus(in_plane, origin))?;
        let normal = cross(z, across);
        let y = unit(normal).filter(|_| length(normal) > ON_A_LINE)?;
        Some(Self { kind, origin, axes: [cross(y, z), y, z] })
    }

    /// Returns a point in the basic system.
    fn point(&self, x: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = x;
        let local = match self.kind {
            SystemKind::Rectangular => x,
            SystemKind::Cylindrical => {
                let (sin, cos) = sin_cos(b);
                [a * cos, a * sin, c]
            }
            SystemKind::Spherical => {
                let ((sin, cos), (sin_about, cos_about)) = (sin_cos(b), sin_cos(c));
                [a * sin * cos_about, a * sin * sin_about, a * cos]
            }
        };
        [0, 1, 2].map(|k| self.origin[k] + (0..3).map(|j| local[j] * self.axes[j][k]).sum::<f64>())
    }

    /// Returns the unit vectors at a point of the basic system. On the axis of a cylindrical or spherical system these
    /// are the axes of the rectangular system that defines it.
    fn axes_at(&self, x: [f64; 3]) -> [[f64; 3]; 3] {
        let from = minus(x, self.origin);
        let [u, v, w] = self.axes.map(|axis| dot(axis, from));
        let radius = hypot(u, v);
        if self.kind == SystemKind::Rectangular || radius <= ON_THE_AXIS * length(from) {
            return self.axes;
        }
        let (cos, sin) = (u / radius, v / radius);
        let [e, f, z] = self.axes;
        let mix = |a: f64, b: f64, c: f64| [0, 1, 2].map(|k| a * e[k] + b * f[k] + c * z[k]);
        match self.kind {
            SystemKind::Spherical => {
                let whole = hypot(radius, w);
                let (down, up) = (radius / whole, w / whole);
                [mix(down * cos, down * sin, up), mix(up * cos, up * sin, -down), mix(-sin, cos, 0.0)]
            }
            _ => [mix(cos, sin, 0.0), mix(-sin, cos, 0.0), z],
        }
    }
}

/// Returns sine and cosine of an angle in degrees, exact at right angles.
fn sin_cos(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        turn => sincos(turn.to_radians()),
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn length(a: [f64; 3]) -> f64 {
    hypot(hypot(a[0], a[1]), a[2])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let length_of_a = length(a);
    (length_of_a > 0.0 && length_of_a.is_finite()).then(|| a.map(|x| x / length_of_a))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn card(kind: SystemKind, reference: i64, points: [[f64; 3]; 3]) -> SystemCard {
        SystemCard::new(kind, Definition::Points { reference, points }, Path::new("job.bdf"), 1)
    }

    /// A cylinder about an axis along x, and a sphere in this system.
    #[test]
    fn systems_within_systems() {
        let upright = [[0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        let lying = [[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [1.0, 3.0, 3.0]];
        let cards = HashMap::from([
            (1, card(SystemKind::Cylindrical, 0, lying)),
            (2, card(SystemKind::Spherical, 1, [[2.0, 90.0, 5.0], [2.0, 90.0, 6.0], [3.0, 90.0, 5.0]])),
            (3, card(SystemKind::Rectangular, 4, upright)),
            (4, card(SystemKind::Rectangular, 3, upright)),
            (5, card(SystemKind::Rectangular, 0, [[0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, 2.0]])),
        ]);
        let grids = BTreeMap::new();
        let mut systems = Systems::new(&cards, &grids);
        let near = |a: [f64; 3], b: [f64; 3]| assert!(length(minus(a, b)) < 1e-14, "{a:?} {b:?}");
        let cylinder = systems.system(1).expect("a system");
        near(cylinder.point([2.0, 90.0, 5.0]), [6.0, 2.0, 5.0]);
        let axes = cylinder.axes_at([6.0, 2.0, 5.0]);
        near(axes[0], [0.0, 0.0, 1.0]);
        near(axes[1], [0.0, -1.0, 0.0]);
        near(axes[2], [1.0, 0.0, 0.0]);
        near(cylinder.axes_at([9.0, 2.0, 3.0])[0], [0.0, 1.0, 0.0]);
        let sphere = systems.system(2).expect("a system");
        // The z axis of the sphere is along x, its x axis along z.
        near(sphere.point([2.0, 90.0, 0.0]), [6.0, 2.0, 7.0]);
        near(sphere.point([2.0, 0.0, 77.0]), [8.0, 2.0, 5.0]);
        let axes = sphere.axes_at([6.0, 2.0, 7.0]);
        near(axes[0], [0.0, 0.0, 1.0]);
        near(axes[1], [-1.0, 0.0, 0.0]);
        near(axes[2], [0.0, -1.0, 0.0]);
        for (id, part) in [(3, "refers to itself"), (5, "on one line"), (9, "is not in the deck")] {
            let error = systems.system(id).expect_err(part);
            assert!(error.message().contains(part), "{}", error.message());
        }
    }
}
