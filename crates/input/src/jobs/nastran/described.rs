//! Solid elements, materials and springs of bulk data, of which KGG is assembled.

use super::bulk::Bulk;
use super::elimination::GridPlaces;
use super::systems::{SystemAxes, Systems};
use crate::bulk_cards::{Card, Item, read_deck};
use crate::matrices::dmig::Point;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::scanner::{BadLines, excerpt};
use flexbody_elements::{
    Axes, DescribedElements, Elasticity, ElementGroup, NodeDirection, NodeStiffness, NotDescribed, Section,
};
use flexbody_model::Nodes;
use nalgebra::{Matrix3, Matrix6, Vector3};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Solid elements, with the largest number of grids.
const SOLIDS: &[(&str, usize)] = &[("CTETRA", 10), ("CPENTA", 15), ("CHEXA", 20), ("CPYRAM", 13)];

/// Prefixes of elements without stiffness.
const WITHOUT_STIFFNESS: &[&str] = &["CMASS", "CONM", "CDAMP", "CVISC", "CHBDY"];

/// Prefixes of cards that begin with C and are no elements.
const NO_ELEMENTS: &[&str] = &["CORD", "CSET", "CSUP", "CYJOIN", "CYSYM", "CYAX", "CYSUP", "CASE", "CSSCHD"];

/// Part of the shear modulus by which it may differ from that of E and nu: decks are written with few digits.
const SHEAR_ROUNDING: f64 = 1e-3;

/// Material of a deck: its elasticity, or the reason in words why it is not described.
type Material = Result<Elasticity, String>;

/// Property of solid elements: material and system of its axes.
#[derive(Debug, Clone, Copy)]
struct Property {
    material: i64,
    system: i64,
}

/// Elements of one type: number, property and grids.
type Solids = Vec<(i64, i64, Vec<i64>)>;

/// Spring between components of one or two grids.
struct Spring {
    id: i64,
    constant: Constant,
    ends: Vec<Point>,
}

/// Constant of a spring, or its property.
enum Constant {
    Stated(f64),
    Property(i64),
}

/// Cards of a deck that describe elements.
#[derive(Default)]
struct Cards {
    solids: BTreeMap<String, Solids>,
    properties: HashMap<i64, Property>,
    materials: HashMap<i64, Material>,
    springs: Vec<Spring>,
    spring_constants: HashMap<i64, f64>,
    /// Number of other elements of each type, and the grids that they name.
    others: BTreeMap<String, (usize, Vec<i64>)>,
    bad: BadLines,
}

/// Describes the elements of a deck.
///
/// * `has_other_matrices`: true if the deck has DMIG matrices beside its elements.
///
/// # Errors
/// FB110 for cards that cannot be read, and for coordinate systems of materials that are not in the deck.
pub(super) fn described(
    path: &Path,
    nodes: &Nodes,
    bulk: &Bulk,
    places: &GridPlaces<'_>,
    has_other_matrices: bool,
) -> Diagnosed<DescribedElements> {
    if bulk.is_condensed() {
        return Ok(nothing(path, "the matrices are condensed"));
    }
    let systems = &mut Systems::new(&bulk.systems, &bulk.grids);
    let mut cards = Cards::default();
    read_deck(path, &mut |item| {
        if let Item::Card(card, path) = item {
            cards.card(card, path);
        }
        Ok(())
    })
    .map_err(|diagnostic| vec![diagnostic])?;
    let bad = std::mem::take(&mut cards.bad).into_diagnostics(Code::DeckSyntax, "card");
    if !bad.is_empty() {
        return Err(bad);
    }
    let at = nodes.ids.iter().copied().zip(nodes.positions.iter().copied()).collect();
    let mut reading = Describing {
        cards: &cards,
        positions: at,
        described: DescribedElements { path: path.to_path_buf(), ..DescribedElements::default() },
        others: BTreeMap::new(),
    };
    for (kind, solids) in &cards.solids {
        reading.solids(kind, solids, systems).map_err(|diagnostic| vec![diagnostic.in_file(path)])?;
    }
    reading.springs(places);
    for (kind, (count, grids)) in &cards.others {
        let known = grids.iter().filter(|grid| reading.positions.contains_key(grid)).copied();
        let known: Vec<i64> = known.collect();
        reading.leave_out(kind, "the type is not described", *count, &known);
    }
    let mut described = reading.finished();
    if has_other_matrices {
        described
            .not_described
            .extend(nothing(path, "DMIG matrices are a part of the stiffness").not_described);
    }
    Ok(described)
}

/// Returns a description that only has a reason.
fn nothing(path: &Path, reason: &str) -> DescribedElements {
    let not_described = vec![NotDescribed { what: reason.to_owned(), line: None, nodes: Vec::new() }];
    DescribedElements { not_described, path: path.to_path_buf(), ..DescribedElements::default() }
}

impl Cards {
    fn card(&mut self, card: &Card, path: &Path) {
        let name = card.name.as_str();
        let read = match name {
            "PSOLID" => self.property(card),
            "MAT1" => self.isotropic(card),
            "MAT9" => self.anisotropic(card),
            "MAT11" | "MAT10" | "MATHP" | "MATHE" | "MATT1" | "MATT9" => {
                let reason = format!("{name} is not described");
                // A table of temperatures has the number of its material.
                card.integer(0).map(|id| _ = self.materials.insert(id, Err(reason)))
            }
            "PELAS" => self.spring_constant(card),
            "CELAS1" => card.integer(1).and_then(|id| self.spring(card, Constant::Property(id), 2)),
            "CELAS2" => card.real(1).and_then(|k| self.spring(card, Constant::Stated(k), 2)),
            _ => match SOLIDS.iter().find(|(kind, _)| *kind == name) {
                Some((_, most)) => self.solid(card, *most),
                None => {
                    self.other(card);
                    Some(())
                }
            },
        };
        if read.is_none() {
            let fields: Vec<String> = (0..card.len().min(8)).map(|k| excerpt(card.field(k))).collect();
            let message = format!("{name} cannot be read: `{}`", fields.join("`, `"));
            self.bad.add(Diagnostic::new(Code::DeckSyntax, message).in_file(path).at_line(card.line()));
        }
    }

    fn property(&mut self, card: &Card) -> Option<()> {
        let system = if card.field(2).is_empty() { 0 } else { card.integer(2)? };
        let property = Property { material: card.integer(1)?, system };
        self.properties.insert(card.integer(0)?, property);
        Some(())
    }

    /// Reads MAT1: two of E, G and nu determine the third.
    fn isotropic(&mut self, card: &Card) -> Option<()> {
        let given = |k: usize| match card.field(k) {
            b"" => Some(None),
            _ => card.real(k).map(Some),
        };
        let (youngs, shear, poisson) = (given(1)?, given(2)?, given(3)?);
        let (youngs, poisson) = match (youngs, shear, poisson) {
            (Some(youngs), _, Some(poisson)) => (youngs, poisson),
            (Some(youngs), Some(shear), None) => (youngs, youngs / (2.0 * shear) - 1.0),
            (None, Some(shear), Some(poisson)) => (2.0 * shear * (1.0 + poisson), poisson),
            _ => return None,
        };
        let implied = youngs / (2.0 * (1.0 + poisson));
        let material = if shear.is_some_and(|shear| (shear / implied - 1.0).abs() > SHEAR_ROUNDING) {
            Err("G differs from E / (2 + 2 nu)".to_owned())
        } else {
            definite(Elasticity::isotropic(youngs, poisson))
        };
        self.add_material(card, material)
    }

    /// Reads MAT9: the upper triangle of D row by row, for xx yy zz xy yz zx.
    fn anisotropic(&mut self, card: &Card) -> Option<()> {
        let mut matrix = Matrix6::zeros();
        let mut field = 1;
        for row in 0..6 {
            for column in row..6 {
                matrix[(row, column)] = card.real(field)?;
                matrix[(column, row)] = matrix[(row, column)];
                field += 1;
            }
        }
        self.add_material(card, definite(Elasticity::definite(matrix)))
    }

    fn add_material(&mut self, card: &Card, material: Material) -> Option<()> {
        // A table of temperatures may stand above its material.
        self.materials.entry(card.integer(0)?).or_insert(material);
        Some(())
    }

    fn solid(&mut self, card: &Card, most: usize) -> Option<()> {
        let property = if card.field(1).is_empty() { card.integer(0)? } else { card.integer(1)? };
        let mut grids = Vec::new();
        for k in 2..card.len().min(2 + most) {
            grids.push(if card.field(k).is_empty() { 0 } else { card.integer(k)? });
        }
        while grids.last() == Some(&0) {
            grids.pop();
        }
        let solids = self.solids.entry(card.name.clone()).or_default();
        solids.push((card.integer(0)?, property, grids));
        Some(())
    }

    fn spring_constant(&mut self, card: &Card) -> Option<()> {
        for first in [0, 4].into_iter().filter(|first| !card.field(*first).is_empty()) {
            self.spring_constants.insert(card.integer(first)?, card.real(first + 1)?);
        }
        Some(())
    }

    /// Reads a spring whose ends begin at a field: grid and component, twice. A missing end is held.
    fn spring(&mut self, card: &Card, constant: Constant, first: usize) -> Option<()> {
        let mut ends = Vec::new();
        for k in [first, first + 2].into_iter().filter(|k| !card.field(*k).is_empty()) {
            let grid = card.integer(k)?;
            let component = if card.field(k + 1).is_empty() { 0 } else { card.integer(k + 1)? };
            if grid != 0 {
                ends.push((grid, u8::try_from(component).ok().filter(|k| *k <= 6)?));
            }
        }
        self.springs.push(Spring { id: card.integer(0)?, constant, ends });
        Some(())
    }

    fn other(&mut self, card: &Card) {
        let name = card.name.as_str();
        let begins = |heads: &[&str]| heads.iter().any(|head| name.starts_with(head));
        let is_element = name.starts_with('C') && !begins(NO_ELEMENTS) && !begins(WITHOUT_STIFFNESS);
        if is_element || matches!(name, "GENEL" | "K2GG") {
            let (count, grids) = self.others.entry(name.to_owned()).or_default();
            *count += 1;
            grids.extend((2..card.len()).filter_map(|k| card.integer(k)).filter(|grid| *grid > 0));
        }
    }
}

fn definite(elasticity: Option<Elasticity>) -> Material {
    elasticity.ok_or_else(|| "its elasticity is not positive definite".to_owned())
}

/// State of describing a deck.
struct Describing<'d> {
    cards: &'d Cards,
    positions: HashMap<i64, [f64; 3]>,
    described: DescribedElements,
    /// Number and nodes of elements that are not described, by type and reason.
    others: BTreeMap<(String, String), (usize, Vec<i64>)>,
}

impl Describing<'_> {
    fn leave_out(&mut self, kind: &str, reason: &str, count: usize, nodes: &[i64]) {
        let (all, own) = self.others.entry((kind.to_owned(), reason.to_owned())).or_default();
        *all += count;
        own.extend(nodes);
    }

    fn solids(&mut self, kind: &str, solids: &Solids, systems: &mut Systems<'_>) -> Result<(), Diagnostic> {
        let mut sections: HashMap<i64, Result<Section, String>> = HashMap::new();
        let mut groups: BTreeMap<(i64, usize), ElementGroup> = BTreeMap::new();
        for (id, property, grids) in solids {
            if !sections.contains_key(property) {
                sections.insert(*property, self.section(*property, systems)?);
            }
            let is_whole = grids.iter().all(|grid| self.positions.contains_key(grid));
            let section = match &sections[property] {
                Ok(section) if is_whole => section,
                Ok(_) => {
                    self.leave_out(kind, "grids are missing", 1, grids);
                    continue;
                }
                Err(reason) => {
                    self.leave_out(kind, reason, 1, grids);
                    continue;
                }
            };
            let group = groups.entry((*property, grids.len())).or_insert_with(|| ElementGroup {
                kind: kind.to_owned(),
                section: section.clone(),
                ids: Vec::new(),
                nodes: Vec::new(),
                internal: Vec::new(),
            });
            group.ids.push(*id);
            group.nodes.extend(grids);
            self.described.positions.extend(grids.iter().map(|grid| (*grid, self.positions[grid])));
        }
        self.described.groups.extend(groups.into_values());
        Ok(())
    }

    /// Returns the section of a property.
    ///
    /// # Errors
    /// FB110 for a coordinate system that is not in the deck.
    fn section(&self, id: i64, systems: &mut Systems<'_>) -> Result<Result<Section, String>, Diagnostic> {
        let Some(property) = self.cards.properties.get(&id) else {
            return Ok(Err(format!("property {id} is no PSOLID")));
        };
        let elasticity = match self.cards.materials.get(&property.material) {
            Some(Ok(elasticity)) => *elasticity,
            Some(Err(reason)) => return Ok(Err(format!("material {}: {reason}", property.material))),
            None => return Ok(Err(format!("material {} is neither MAT1 nor MAT9", property.material))),
        };
        let axes = match property.system {
            _ if crate::element_source::is_isotropic(&elasticity) => Axes::Model,
            0 => Axes::Model,
            ..0 => return Ok(Err("an anisotropic material along the axes of its elements".to_owned())),
            system => match systems.of_material(system)? {
                SystemAxes::Fixed([x, y, z]) => {
                    Axes::Fixed(Matrix3::from_columns(&[x, y, z].map(Vector3::from)))
                }
                SystemAxes::Cylinder { origin, along } => {
                    let from = Vector3::from(origin);
                    Axes::Cylinder { from, to: from + Vector3::from(along) }
                }
                SystemAxes::Sphere => return Ok(Err("a material along spherical axes".to_owned())),
            },
        };
        Ok(Ok(Section { material: format!("{}", property.material), elasticity, axes }))
    }

    fn springs(&mut self, places: &GridPlaces<'_>) {
        for Spring { id, constant, ends } in &self.cards.springs {
            let constant = match constant {
                Constant::Stated(constant) => Some(*constant),
                Constant::Property(property) => self.cards.spring_constants.get(property).copied(),
            };
            let is_scalar = ends.iter().any(|end| end.1 == 0 || !self.positions.contains_key(&end.0));
            let Some(constant) = constant.filter(|_| !is_scalar && !ends.is_empty()) else {
                let nodes: Vec<i64> = ends.iter().map(|end| end.0).collect();
                self.leave_out("CELAS", "a scalar point, or no PELAS", 1, &nodes);
                continue;
            };
            // Displacements along the axes of a grid are sums of those along the axes of the model.
            let mut elongation: BTreeMap<NodeDirection, f64> = BTreeMap::new();
            for (end, sign) in ends.iter().zip([1.0, -1.0]) {
                let first = if end.1 > 3 { 4 } else { 1 };
                let axis = places.axis(*end);
                for k in (0..3u8).filter(|k| axis[usize::from(*k)] != 0.0) {
                    *elongation.entry((end.0, first + k)).or_default() += sign * axis[usize::from(k)];
                }
            }
            let matrix = elongation.values().flat_map(|a| elongation.values().map(move |b| constant * a * b));
            let (name, rows) = (format!("spring {id}"), elongation.keys().copied().collect());
            self.described.direct.push(NodeStiffness { name, rows, matrix: matrix.collect() });
        }
    }

    fn finished(mut self) -> DescribedElements {
        for ((kind, reason), (count, nodes)) in self.others {
            self.described.not_described.push(NotDescribed::elements(&kind, &reason, count, nodes));
        }
        self.described
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::job::{JobFile, JobReader};
    use super::super::Nastran;
    use super::*;
    use std::fs;

    fn describe(folder: &Path) -> DescribedElements {
        let job = JobFile { path: folder.join("job.bdf"), program: None, matrices: None };
        Nastran.read(&job, true).expect("a job").described.expect("elements")
    }

    fn fixture() -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/small/nastran")
    }

    #[test]
    fn solids_have_the_material_of_their_property() {
        let found = describe(&fixture());
        let [group] = found.groups.as_slice() else { panic!("{:?}", found.groups) };
        assert_eq!((group.kind.as_str(), group.ids.as_slice()), ("CHEXA", &[1, 2][..]));
        assert_eq!(group.nodes[..8], [11, 23, 29, 17, 14, 26, 32, 20]);
        assert_eq!(Some(group.section.elasticity), Elasticity::isotropic(2.1e11, 0.3));
        assert_eq!(found.positions.len(), 12);
        assert_eq!((found.not_described.len(), found.equations.len()), (0, 0));
    }

    /// Returns the description of the fixture with other cards in place of its bulk data after the grids.
    fn with_cards(cards: &str) -> DescribedElements {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["grids.bdf", "job.pch"] {
            fs::copy(fixture().join(name), folder.path().join(name)).expect("copied");
        }
        let text = format!("BEGIN BULK\nPARAM,COUPMASS,1\nINCLUDE 'grids.bdf'\n{cards}ENDDATA\n");
        fs::write(folder.path().join("job.bdf"), text).expect("written");
        describe(folder.path())
    }

    const BRICKS: &str = "CHEXA,1,1,11,23,29,17,14,26\n,32,20\nCHEXA,2,1,23,35,41,29,26,38\n,44,32\n";

    #[test]
    fn materials_and_their_axes_are_those_of_the_cards() {
        let anisotropic = "MAT9,7,5.,1.,2.,0.,0.,0.,6.\n,3.,0.,0.,0.,7.,0.,0.,0.\n,8.,0.,0.,9.,0.,10.\n";
        let found = with_cards(&format!("{BRICKS}PSOLID,1,7,1\n{anisotropic}"));
        let section = &found.groups[0].section;
        assert_eq!(section.elasticity.0.diagonal().as_slice(), [5.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
        assert_eq!((section.elasticity.0[(0, 2)], section.elasticity.0[(1, 2)]), (2.0, 3.0));
        let Axes::Fixed(axes) = section.axes else { panic!("{:?}", section.axes) };
        let expected = Matrix3::new(0.6, -0.8, 0.0, 0.8, 0.6, 0.0, 0.0, 0.0, 1.0);
        assert!((axes - expected).amax() < 1e-15, "{axes}");
        let found = with_cards(&format!("{BRICKS}PSOLID,1,7,2\n{anisotropic}"));
        assert!(matches!(found.groups[0].section.axes, Axes::Cylinder { .. }));
        let found = with_cards(&format!("{BRICKS}PSOLID,1,7\nMAT1,7,2.,.8\n"));
        assert_eq!(Some(found.groups[0].section.elasticity), Elasticity::isotropic(2.0, 2.0 / 1.6 - 1.0));
        for (material, reason) in [
            ("MAT1,7,2.,.9,.3\n", "G differs"),
            ("MATT1,7,1\nMAT1,7,2.,,.3\n", "MATT1"),
            ("MAT11,7,1.\n", "MAT11"),
            ("MAT8,7,1.\n", "neither MAT1 nor MAT9"),
        ] {
            let found = with_cards(&format!("{BRICKS}PSOLID,1,7\n{material}"));
            assert_eq!(found.groups, []);
            assert!(found.not_described[0].what.contains(reason), "{:?}", found.not_described);
            assert_eq!(found.not_described[0].nodes.len(), 12);
        }
    }

    #[test]
    fn springs_and_constraints_are_along_the_axes_of_the_model() {
        let steel = "PSOLID,1,1\nMAT1,1,2.+11,,.3\n";
        // Grid 26 has the basic axes, grid 35 those of system 1.
        let more = "CELAS2,91,50.,26,2,35,1\nCELAS2,92,7.,26,1\nCBUSH,93,4,26,35\nRBE2,94,35,123,38\n";
        let found = with_cards(&format!("{BRICKS}{steel}{more}"));
        let [between, to_ground] = found.direct.as_slice() else { panic!("{:?}", found.direct) };
        assert_eq!(between.rows, [(26, 2), (35, 1), (35, 2)]);
        let expected = [50.0, -30.0, -40.0, -30.0, 18.0, 24.0, -40.0, 24.0, 32.0];
        assert!(between.matrix.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{between:?}");
        assert_eq!((to_ground.rows.as_slice(), to_ground.matrix.as_slice()), (&[(26, 1)][..], &[7.0][..]));
        assert_eq!(found.not_described[0].what, "1 element of type CBUSH: the type is not described");
        assert_eq!(found.not_described[0].nodes, [26, 35]);
        assert_eq!(found.equations.len(), 3);
        for equation in &found.equations {
            let own = ((35, equation.dependent.1), 1.0);
            let near = |term: &&((i64, u8), f64)| term.0 == own.0;
            let factor = equation.terms.iter().find(near).expect("its translation").1;
            assert!(equation.dependent.0 == 38 && (factor - 1.0).abs() < 1e-12, "{equation:?}");
        }
    }
}
