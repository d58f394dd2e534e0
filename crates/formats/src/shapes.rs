//! Shapes whose stresses an FE program is asked for, as files for that program: a deck of CalculiX, a table, an archive
//! of NumPy.

use super::npz::{archive, npy, text};
use flexbody_body::convert::{RecoveryShapes, ShapeColumn};
use flexbody_body::flex_body::FlexBody;
use flexbody_model::FeModel;
use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::{self, Write};

/// Number of decimals of a displacement. CalculiX refuses fields of more than 20 characters, as -1.2345678901234e-05
/// has.
const DECIMALS: usize = 13;

/// Displacements of all nodes in the shapes, with the digits of their files.
#[derive(Debug, Clone)]
pub struct NodalShapes {
    /// Name of the body.
    pub body: String,
    /// True if the modes respond to spin, so that the static columns of spin are what the modes leave out.
    modes_follow_spin: bool,
    /// Numbers of the nodes.
    nodes: Vec<i64>,
    /// Mode or column of each shape.
    columns: Vec<ShapeColumn>,
    /// Factor of each shape.
    factors: Vec<f64>,
    /// Positions of the nodes.
    positions: Vec<[f64; 3]>,
    /// Displacements of each shape and node along the axes of the model.
    displacements: Vec<Vec<[f64; 3]>>,
    /// Rotations of each shape and node, if nodes have rotations.
    rotations: Option<Vec<Vec<[f64; 3]>>>,
}

impl NodalShapes {
    /// Creates the shapes of `body` by the nodes of its model.
    pub fn new(shapes: &RecoveryShapes, model: &FeModel, body: &FlexBody) -> Self {
        let (n, d) = (model.nodes().len(), model.dimension());
        let count = shapes.columns.len();
        let displacements = (0..count)
            .map(|j| {
                let at = |node: usize, k: usize| if k < d { shapes.fields[(d * node + k, j)] } else { 0.0 };
                (0..n).map(|node| std::array::from_fn(|k| rounded(at(node, k)))).collect()
            })
            .collect();
        let rows = model.rows();
        let rotations = (!rows.rotations().is_empty()).then(|| {
            let of_shape = |j: usize| {
                let mut of_nodes = vec![[0.0; 3]; n];
                for (after, (node, axis)) in rows.rotations().iter().enumerate() {
                    let value = shapes.fields[(rows.displacements() + after, j)];
                    of_nodes[*node as usize][usize::from(*axis)] = rounded(value);
                }
                of_nodes
            };
            (0..count).map(of_shape).collect()
        });
        Self {
            body: body.description().name.clone(),
            modes_follow_spin: body.groups().w1,
            nodes: model.nodes().ids.clone(),
            positions: model.nodes().positions.clone(),
            columns: shapes.columns.clone(),
            factors: shapes.factors.clone(),
            displacements,
            rotations,
        }
    }

    /// Returns the number of shapes.
    pub fn count(&self) -> usize {
        self.columns.len()
    }

    /// Returns true if nodes have rotations.
    pub fn has_rotations(&self) -> bool {
        self.rotations.is_some()
    }

    /// Returns the mode or column of each shape with its factor.
    pub fn columns(&self) -> impl Iterator<Item = (&ShapeColumn, f64)> {
        self.columns.iter().zip(self.factors.iter().copied())
    }

    /// Returns the largest difference of displacements of nodes from those of shape `step`, relative to the largest of
    /// the shape; infinite for an unknown node.
    pub fn difference(&self, step: usize, nodes: &[i64], displacements: &[[f64; 3]]) -> f64 {
        let own: HashMap<i64, &[f64; 3]> =
            self.nodes.iter().copied().zip(&self.displacements[step]).collect();
        let size = own.values().flat_map(|u| u.iter()).fold(0.0f64, |most, value| most.max(value.abs()));
        let of_node = |(node, u): (&i64, &[f64; 3])| match own.get(node) {
            Some(shape) => (0..3).map(|k| (u[k] - shape[k]).abs()).fold(0.0, f64::max),
            None => f64::INFINITY,
        };
        nodes.iter().zip(displacements).map(of_node).fold(0.0, f64::max) / size
    }

    /// Returns about the largest strain of shape `step` in `elements`: the largest change of the distance vector of two
    /// nodes of an element, relative to their distance.
    pub(super) fn strain(&self, step: usize, elements: &[(i64, Vec<i64>)]) -> f64 {
        let place: HashMap<i64, usize> = self.nodes.iter().copied().zip(0..).collect();
        let distance = |at: &[[f64; 3]], a: usize, b: usize| {
            (0..3).map(|k| (at[a][k] - at[b][k]).powi(2)).sum::<f64>().sqrt()
        };
        let of_element = |(_, nodes): &(i64, Vec<i64>)| {
            let known: Vec<usize> = nodes.iter().filter_map(|node| place.get(node).copied()).collect();
            let pairs =
                known.iter().enumerate().flat_map(|(at, a)| known[..at].iter().map(move |b| (*a, *b)));
            let strain = |(a, b)| distance(&self.displacements[step], a, b) / distance(&self.positions, a, b);
            pairs.map(strain).filter(|strain| strain.is_finite()).fold(0.0, f64::max)
        };
        elements.iter().map(of_element).fold(0.0, f64::max)
    }

    /// Returns the archive from which the answers of the FE program are read: the arrays `nodes`, `displacements`
    /// (shapes x nodes x 3), `rotations` if nodes have them, `factors`, and the JSON text `description`.
    pub fn npz(&self) -> Vec<u8> {
        let columns: Vec<String> = self.columns.iter().map(ToString::to_string).collect();
        let description = serde_json::json!({
            "format": "flexbody-shapes",
            "version": 1,
            "program": format!("flexbody {}", env!("CARGO_PKG_VERSION")),
            "body": self.body,
            "columns": columns,
            "modes_follow_spin": self.modes_follow_spin,
        });
        let (count, n) = (self.count(), self.nodes.len());
        let field = |values: &[Vec<[f64; 3]>]| {
            let values = values.iter().flatten().flatten().map(|value| value.to_le_bytes());
            npy("<f8", &[count, n, 3], values)
        };
        let mut members = vec![
            ("nodes", npy("<i8", &[n], self.nodes.iter().map(|node| node.to_le_bytes()))),
            ("displacements", field(&self.displacements)),
        ];
        members.extend(self.rotations.as_ref().map(|rotations| ("rotations", field(rotations))));
        members.push(("factors", npy("<f8", &[count], self.factors.iter().map(|f| f.to_le_bytes()))));
        members.push(("description", text(&description.to_string())));
        archive(members).expect("memory takes every byte, and no two paths are the same")
    }

    /// Returns the shapes as a table `step,column,node,ux,uy,uz`, with `rx,ry,rz` if nodes have rotations.
    pub fn csv(&self) -> String {
        let mut out = String::from("step,column,node,ux,uy,uz");
        out += if self.rotations.is_some() { ",rx,ry,rz\n" } else { "\n" };
        for (step, column) in self.columns.iter().enumerate() {
            for (at, node) in self.nodes.iter().enumerate() {
                let turned = self.rotations.iter().flat_map(|rotations| rotations[step][at]);
                let _ = write!(out, "{},{column},{node}", step + 1);
                for value in self.displacements[step][at].into_iter().chain(turned) {
                    let _ = write!(out, ",{}", written(value));
                }
                out.push('\n');
            }
        }
        out
    }
}

/// Returns a value as it is written.
fn written(value: f64) -> String {
    format!("{value:.DECIMALS$e}")
}

/// Returns a value with the digits with which it is written.
fn rounded(value: f64) -> f64 {
    // A denormalised value has too long an exponent, and no effect.
    if value.abs() < 1e-90 {
        return 0.0;
    }
    written(value).parse().expect("a number was written")
}

// Deck of CalculiX: one linear static step for each shape, with given displacements of all nodes.

/// Set of the nodes with stresses.
const WATCHED: &str = "FLEXBODY_WATCHED";

/// Set of the elements around these nodes.
const WATCHED_ELEMENTS: &str = "FLEXBODY_WATCHED_ELEMENTS";

/// Set of all solid elements, whose strain energy is printed.
const SOLIDS: &str = "FLEXBODY_SOLIDS";

/// Number of members in a line of a set.
const MEMBERS_PER_LINE: usize = 8;

/// Places of the stresses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StressPlaces {
    /// Nodes, in a `.frd` with 64-bit numbers. Stresses are means over the elements at the node.
    Nodes,
    /// Integration points, in a `.dat` with seven digits.
    IntegrationPoints,
}

/// Deck that asks CalculiX for the stresses of shapes.
#[derive(Debug, Clone)]
pub struct StressDeck<'a> {
    /// Shapes.
    pub shapes: &'a NodalShapes,
    /// Cards of nodes, elements and materials.
    pub elements: &'a [u8],
    /// Numbers and nodes of the solid elements.
    pub solids: &'a [(i64, Vec<i64>)],
    /// Nodes with stresses.
    pub watched: &'a [i64],
    /// Places of the stresses.
    pub places: StressPlaces,
}

impl StressDeck<'_> {
    /// Writes the deck.
    ///
    /// # Errors
    /// Errors of `out`.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let shapes = self.shapes;
        writeln!(
            out,
            "*HEADING\nShapes of a flexible body; the stresses of all steps are read by flexbody convert"
        )?;
        out.write_all(self.elements)?;
        set(out, "NSET", WATCHED, self.watched.iter().copied())?;
        set(out, "ELSET", SOLIDS, self.solids.iter().map(|(id, _)| *id))?;
        if self.places == StressPlaces::IntegrationPoints {
            let watched: std::collections::HashSet<i64> = self.watched.iter().copied().collect();
            let touching = |(_, nodes): &&(i64, Vec<i64>)| nodes.iter().any(|node| watched.contains(node));
            set(out, "ELSET", WATCHED_ELEMENTS, self.solids.iter().filter(touching).map(|(id, _)| *id))?;
        }
        for (step, (column, factor)) in shapes.columns().enumerate() {
            writeln!(out, "** step {}: {factor:e} times {column}", step + 1)?;
            writeln!(out, "*STEP\n*STATIC\n*BOUNDARY")?;
            for (node, u) in shapes.nodes.iter().zip(&shapes.displacements[step]) {
                for (direction, &value) in (1..).zip(u) {
                    writeln!(out, "{node},{direction},{direction},{}", written(value))?;
                }
            }
            match self.places {
                StressPlaces::Nodes => {
                    writeln!(out, "*NODE OUTPUT, NSET={WATCHED}, DOUBLE\nU")?;
                    writeln!(out, "*ELEMENT OUTPUT, NSET={WATCHED}, DOUBLE\nS, NOE")?;
                }
                StressPlaces::IntegrationPoints => {
                    writeln!(out, "*NODE PRINT, NSET={WATCHED}\nU")?;
                    writeln!(out, "*EL PRINT, ELSET={WATCHED_ELEMENTS}, GLOBAL=YES\nS")?;
                }
            }
            writeln!(out, "*EL PRINT, ELSET={SOLIDS}, TOTALS=ONLY\nELSE\n*END STEP")?;
        }
        Ok(())
    }
}

impl NodalShapes {
    /// Writes the set of all nodes for the steps of [`super::stiffening`].
    pub(super) fn write_all_nodes(&self, out: &mut impl Write) -> io::Result<()> {
        set(out, "NSET", "FLEXBODY_ALL", self.nodes.iter().copied())
    }
}

/// Writes a set of nodes or elements.
fn set(
    out: &mut impl Write,
    keyword: &str,
    name: &str,
    members: impl Iterator<Item = i64>,
) -> io::Result<()> {
    writeln!(out, "*{keyword}, {keyword}={name}")?;
    let members: Vec<String> = members.map(|member| member.to_string()).collect();
    for line in members.chunks(MEMBERS_PER_LINE) {
        writeln!(out, "{}", line.join(", "))?;
    }
    Ok(())
}
