//! Meshes of VTK, for ParaView and other programs that show results.
//!
//! A file holds the body with its modes as one mesh, or a motion as one mesh for each output time and a list of the
//! meshes.

use crate::export::Holding::{Held, NotApplicable};
use crate::export::{ExportChecklist, ExportFormat, ExportOptions, Exported, Points};
use crate::picture::{Drawn, Played, mode_names, named, printable};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_file::RecordedMotion;
use flexbody_motion::scene::{CasePeak, Envelope, PointPeaks};
use std::collections::{HashMap, HashSet};
use std::fmt::Write;

/// Export format of VTK.
pub(crate) struct Vtk;

/// Largest number of files of a motion, and largest size of all of them in bytes; a longer motion is thinned.
const MOST_FILES: usize = 250;
const MAX_BYTES: usize = 500_000_000;

impl ExportFormat for Vtk {
    fn name(&self) -> &'static str {
        "vtk"
    }

    fn reader(&self) -> &'static str {
        "ParaView, PyVista, VisIt: modes to warp by (.vtu), or a motion (.pvd)"
    }

    fn other_names(&self) -> &'static [&'static str] {
        &["paraview", "pyvista", "visit"]
    }

    fn has_points(&self) -> bool {
        true
    }

    fn is_picture(&self) -> bool {
        true
    }

    /// Returns mechanical properties as not applicable to a picture; [`leaves_out`](Self::leaves_out) names
    /// them.
    fn checklist(&self, _: &FlexBody, _: &ExportOptions) -> ExportChecklist {
        ExportChecklist {
            rigid_coupling: NotApplicable,
            plane: NotApplicable,
            deformed_inertia: NotApplicable,
            general_w0: NotApplicable,
            coriolis_force: NotApplicable,
            general_w3: NotApplicable,
            separate_w2: NotApplicable,
            geometric_stiffness: NotApplicable,
            inertia_stiffness: NotApplicable,
            damping: NotApplicable,
            shapes: Held,
            rotations: Held,
            internal_rows: NotApplicable,
            gravity: NotApplicable,
            interfaces: Held,
            surface: Held,
            origins_of_modes: Held,
            units: Held,
            storage: NotApplicable,
            named_loads: NotApplicable,
            recoveries: NotApplicable,
        }
    }

    fn needs(&self, _: &FlexBody, options: &ExportOptions) -> Vec<String> {
        named(options, if options.motion.is_some() { "pvd" } else { "vtu" }).into_iter().collect()
    }

    fn leaves_out(&self, body: &FlexBody, options: &ExportOptions) -> Vec<String> {
        let mut left = vec![
            "vtk holds positions, shapes and interfaces for pictures, but no mass, stiffness, damping or inertia"
                .to_owned(),
        ];
        match options.modes {
            Some(modes) if modes < body.n_modes() => {
                left.push(format!("the first {modes} of {} modes are written", body.n_modes()));
            }
            _ => {}
        }
        if let Some(motion) = &options.motion {
            let played = played(&Drawn::places(body, &options.points), motion);
            if played.len() < motion.time.len() {
                left.push(format!("{} are written", played.in_words()));
            }
        }
        left
    }

    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported> {
        let drawn = Drawn::places(body, &options.points);
        let modes = options.modes.unwrap_or(body.n_modes());
        let mut grid = Grid::new(&drawn);
        grid.put_field("metres_per_unit_of_length", &[body.units().length.to_si()]);
        match &options.motion {
            Some(motion) => {
                let stem = options.name.as_ref().and_then(|name| name.file_stem());
                let stem = stem.map_or("motion".into(), |stem| stem.to_string_lossy());
                Ok(series(&grid, &drawn, &played(&drawn, motion), modes, &stem))
            }
            None => Ok(Exported::single(with_modes(grid, body, &drawn, modes))),
        }
    }
}

/// Values at points of a recovery.
#[derive(Debug, Clone, PartialEq)]
pub struct PointValues {
    /// Name of the array.
    pub name: String,
    /// Node of each point; `None` for a point that is no node.
    pub nodes: Vec<Option<i64>>,
    /// Value at each point.
    pub values: Vec<f64>,
    /// True if the smallest of several values at a node counts; otherwise the largest.
    pub is_smallest: bool,
    /// Number of the load case of each value, counted from 1; empty without load cases.
    pub cases: Vec<f64>,
}

/// Returns the undeformed body with an array of values at its nodes for each of `all`, NaN at nodes without a point; with
/// load cases also the array `NAME case`. Returns `None` if no point is a node.
pub fn stresses_vtu(body: &FlexBody, all: &[PointValues]) -> Option<Vec<u8>> {
    let drawn = Drawn::places(body, &Points::Nodes);
    let place: HashMap<i64, usize> = drawn.numbers().iter().enumerate().map(|(at, id)| (*id, at)).collect();
    let mut grid = Grid::new(&drawn);
    let mut is_empty = true;
    for one in all {
        let mut values = vec![f64::NAN; drawn.len()];
        let mut cases = vec![f64::NAN; drawn.len()];
        let mut found = false;
        for (point, (node, own)) in one.nodes.iter().zip(&one.values).enumerate() {
            let Some(&at) = node.and_then(|node| place.get(&node)) else { continue };
            found = true;
            // Several elements may have a point at this node.
            let is_further = if one.is_smallest { *own < values[at] } else { *own > values[at] };
            if values[at].is_nan() || is_further {
                values[at] = *own;
                cases[at] = one.cases.get(point).copied().unwrap_or(f64::NAN);
            }
        }
        if found {
            is_empty = false;
            grid.put_scalars(&one.name, &values);
            if !one.cases.is_empty() {
                grid.put_scalars(&format!("{} case", one.name), &cases);
            }
        }
    }
    (!is_empty).then(|| grid.file(&drawn.positions()))
}

/// Returns the undeformed body with the largest stresses at every node: for each recovery with points at nodes the arrays
/// `NAME von Mises`, `NAME largest principal` and `NAME smallest principal`, NaN at nodes without stresses; of several load
/// cases each also with `case` behind its name, the number of the load case of each value. Returns `None` without such a
/// recovery.
pub fn envelope_vtu(body: &FlexBody, envelope: &Envelope) -> Option<Vec<u8>> {
    let mut all = Vec::new();
    for recovery in &envelope.recoveries {
        let nodes: Vec<Option<i64>> = recovery.points.iter().map(|point| point.node).collect();
        let mut put = |name: &str, is_smallest: bool, peak: fn(&PointPeaks) -> CasePeak| {
            let peaks: Vec<CasePeak> = recovery.points.iter().map(peak).collect();
            let is_named = !envelope.cases.is_empty();
            all.push(PointValues {
                name: format!("{} {name}", recovery.name),
                nodes: nodes.clone(),
                values: peaks.iter().map(|peak| peak.value).collect(),
                is_smallest,
                cases: peaks.iter().filter(|_| is_named).map(|peak| peak.case as f64 + 1.0).collect(),
            });
        };
        put("von Mises", false, |own| own.von_mises);
        put("largest principal", false, |own| own.largest_principal);
        put("smallest principal", true, |own| own.smallest_principal);
    }
    stresses_vtu(body, &all)
}

/// Returns the undeformed body with a vector at every point for each mode.
fn with_modes(mut grid: Grid, body: &FlexBody, drawn: &Drawn<'_>, modes: usize) -> Vec<u8> {
    grid.put_field("frequency_hz", &body.frequencies_hz()[..modes]);
    let names = mode_names(body, modes);
    for (j, name) in names.iter().enumerate() {
        grid.put_vectors(name, &drawn.shape(j));
    }
    for (j, name) in names.iter().enumerate() {
        if let Some(rotation) = drawn.rotation(j) {
            grid.put_vectors(&name.replacen("mode", "rotation", 1), &rotation);
        }
    }
    grid.file(&drawn.positions())
}

/// Returns the output times of a motion that are written.
fn played<'m>(drawn: &Drawn<'_>, motion: &'m RecordedMotion) -> Played<'m> {
    let (cells, interfaces) = (drawn.triangles().len() + drawn.edges().len(), drawn.interfaces().len());
    let bytes = drawn.len() * (3 * 8 + 3 * 8 + 8 + interfaces) + cells * (3 * 8 + 8 + 1);
    Played::new(motion, MOST_FILES.min(MAX_BYTES / bytes.max(1)))
}

/// Returns one mesh for each output time, and the list that ParaView opens.
fn series(grid: &Grid, drawn: &Drawn<'_>, played: &Played<'_>, modes: usize, stem: &str) -> Exported {
    let positions = drawn.positions();
    let shapes: Vec<_> = (0..modes).map(|j| drawn.shape(j)).collect();
    let mut list = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n",
    );
    let mut beside = Vec::new();
    for instant in 0..played.len() {
        let (places, deflections) = played.places(instant, &positions, &shapes);
        let mut own = grid.clone();
        own.put_vectors("deflection", &deflections);
        let ending = format!("_{instant:04}.vtu");
        let name = escaped(&printable(&format!("{stem}{ending}")));
        writeln!(list, "<DataSet timestep=\"{:e}\" part=\"0\" file=\"{name}\"/>", played.time(instant))
            .expect("a text takes what is written to it");
        beside.push((ending.into(), own.file(&places)));
    }
    list += "</Collection>\n</VTKFile>\n";
    Exported { file: list.into_bytes(), beside }
}

// A mesh of VTK in XML: tags first, then the raw bytes of the numbers.
// <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>

/// Cell types of VTK.
const VERTEX: u8 = 1;
const LINE: u8 = 3;
const TRIANGLE: u8 = 5;

/// An unstructured grid under construction.
#[derive(Clone)]
struct Grid {
    points: usize,
    cells: usize,
    /// Tags of the arrays of the grid, the points and the cells.
    field: String,
    point_data: String,
    cell_tags: String,
    /// Name of the first array of vectors.
    vectors: Option<String>,
    /// Names already used by arrays at the points.
    taken: HashSet<String>,
    data: Appended,
}

/// Appended data of the tags: each array follows its length in bytes.
#[derive(Clone, Default)]
struct Appended(Vec<u8>);

impl Grid {
    /// Builds the grid of points with their numbers, cells, and marks of the interfaces.
    fn new(drawn: &Drawn<'_>) -> Self {
        let empty = String::new();
        let mut grid = Self {
            points: drawn.len(),
            cells: 0,
            field: empty.clone(),
            point_data: empty.clone(),
            cell_tags: empty,
            vectors: None,
            taken: HashSet::new(),
            data: Appended::default(),
        };
        grid.put_cells(drawn);
        let numbers = drawn.numbers();
        grid.point_data += &grid.data.array("node", "Int64", 1, numbers.iter().map(|id| id.to_le_bytes()));
        grid.taken.insert("node".to_owned());
        for (name, marks) in drawn.interfaces() {
            grid.put_marks(&format!("interface {name}"), &marks);
        }
        if let Some(marks) = drawn.references() {
            grid.put_marks("reference point", &marks);
        }
        grid
    }

    /// Adds numbers of the body as a whole.
    fn put_field(&mut self, name: &str, values: &[f64]) {
        let tag = self.data.array(name, "Float64", 1, values.iter().map(|value| value.to_le_bytes()));
        let tuples = format!(" NumberOfTuples=\"{}\"/>", values.len());
        self.field += &tag.replace("/>", &tuples);
    }

    /// Adds a vector at every point.
    fn put_vectors(&mut self, name: &str, vectors: &[[f64; 3]]) {
        let name = self.unique_name(name);
        self.point_data += &self.data.vectors(&name, vectors);
        self.vectors.get_or_insert(name);
    }

    /// Adds a number at every point.
    fn put_scalars(&mut self, name: &str, values: &[f64]) {
        let name = self.unique_name(name);
        self.point_data +=
            &self.data.array(&name, "Float64", 1, values.iter().map(|value| value.to_le_bytes()));
    }

    fn put_marks(&mut self, name: &str, marks: &[u8]) {
        let name = self.unique_name(name);
        self.point_data += &self.data.array(&name, "UInt8", 1, marks.iter().map(|mark| [*mark]));
    }

    fn put_cells(&mut self, drawn: &Drawn<'_>) {
        let (triangles, edges, loose) = (drawn.triangles(), drawn.edges(), drawn.loose());
        let points = triangles.as_flattened().iter().chain(edges.as_flattened()).chain(&loose);
        let connectivity: Vec<[u8; 8]> = points.map(|point| i64::from(*point).to_le_bytes()).collect();
        let kinds = [(TRIANGLE, triangles.len(), 3), (LINE, edges.len(), 2), (VERTEX, loose.len(), 1)];
        let (mut offsets, mut types, mut end) = (Vec::new(), Vec::new(), 0i64);
        for (kind, count, corners) in kinds {
            for _ in 0..count {
                end += corners;
                offsets.push(end.to_le_bytes());
                types.push([kind]);
            }
        }
        self.cells = types.len();
        self.cell_tags = self.data.array("connectivity", "Int64", 1, connectivity.into_iter());
        self.cell_tags += &self.data.array("offsets", "Int64", 1, offsets.into_iter());
        self.cell_tags += &self.data.array("types", "UInt8", 1, types.into_iter());
    }

    /// Returns a name that no other array at the points has: readers keep one array per name.
    fn unique_name(&mut self, wanted: &str) -> String {
        let wanted = printable(wanted);
        let mut name = wanted.clone();
        let mut number = 1;
        while !self.taken.insert(name.clone()) {
            number += 1;
            name = format!("{wanted} #{number}");
        }
        name
    }

    /// Returns the bytes of the file with the given positions of the points.
    fn file(mut self, positions: &[[f64; 3]]) -> Vec<u8> {
        let points = self.data.vectors("Points", positions);
        let vectors = self.vectors.as_deref().map(|name| format!(" Vectors=\"{}\"", escaped(name)));
        let field = match self.field.as_str() {
            "" => String::new(),
            tags => format!("<FieldData>\n{tags}</FieldData>\n"),
        };
        let mut head = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        let written = write!(
            head,
            "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
             <UnstructuredGrid>\n{field}<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n\
             <PointData GlobalIds=\"node\"{}>\n{}</PointData>\n<Points>\n{points}</Points>\n\
             <Cells>\n{}</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_",
            self.points,
            self.cells,
            vectors.unwrap_or_default(),
            self.point_data,
            self.cell_tags,
        );
        written.expect("a text takes what is written to it");
        let mut file = head.into_bytes();
        file.append(&mut self.data.0);
        file.extend(b"\n</AppendedData>\n</VTKFile>\n");
        file
    }
}

impl Appended {
    fn vectors(&mut self, name: &str, vectors: &[[f64; 3]]) -> String {
        self.array(name, "Float64", 3, vectors.as_flattened().iter().map(|value| value.to_le_bytes()))
    }

    /// Appends an array and returns its tag.
    fn array<const N: usize>(
        &mut self,
        name: &str,
        kind: &str,
        components: usize,
        values: impl Iterator<Item = [u8; N]>,
    ) -> String {
        let offset = self.0.len();
        self.0.extend([0; 8]);
        self.0.extend(values.flatten());
        let length = (self.0.len() - offset - 8) as u64;
        self.0[offset..offset + 8].copy_from_slice(&length.to_le_bytes());
        let name = escaped(name);
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>\n"
        )
    }
}

/// Returns a text escaped as the value of an attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
