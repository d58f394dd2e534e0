//! The content of bulk data and case control of a deck: positions, axes of rows, boundary, supports, sets.

use super::constraints::Constraints;
use super::control_sections::{Assigned, SetLines};
use super::systems::{Definition, Grid, SystemCard, SystemKind};
use crate::bulk_cards::{Card, Item, components, read_deck};
use crate::matrices::dmig::Dmigs;
use crate::mesh::in_order_of_shape;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::input_file::SeenFile;
use flexbody_base::text::scanner::{BadLines, excerpt, whole};
use flexbody_model::{ElementShape, Elements};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// Largest number of scalar points in a range; `MAX_SCALARS` is the largest number in a deck.
const MAX_RANGE: i64 = 1_000_000;
const MAX_SCALARS: usize = 10_000_000;
/// Elements with displacements only.
const SOLIDS: &[&str] = &["CHEXA", "CTETRA", "CPENTA", "CPYRAM", "CPYRA", "CHEXA8", "CHEXA20"];
/// Prefixes of cards that begin with C and are no elements.
const NO_ELEMENTS: &[&str] = &["CORD", "CSET", "CSUP", "CYJOIN", "CYSYM", "CYAX", "CYSUP", "CASE", "CSSCHD"];

/// Range of points, and components of them.
struct Members {
    first: i64,
    last: i64,
    components: Vec<u8>,
}

/// Content of a deck.
#[derive(Default)]
pub(super) struct Bulk {
    /// Files of the deck, the main file first.
    pub files: Vec<SeenFile>,
    /// Files of the cards.
    pub card_files: Vec<PathBuf>,
    pub grids: BTreeMap<i64, Grid>,
    pub scalars: BTreeSet<i64>,
    pub systems: HashMap<i64, SystemCard>,
    pub dmigs: Dmigs,
    pub sets: SetLines,
    pub assigned: Assigned,
    pub constraints: Constraints,
    /// True after PARAM,COUPMASS.
    pub coupled_mass: bool,
    pub has_elements: bool,
    /// Number of damping elements.
    pub n_dampers: usize,
    /// Elements for drawing.
    pub elements: Elements,
    /// True if an element has more than displacements.
    pub has_rotations: bool,
    /// True after SEQGP.
    pub resequenced: bool,
    /// True after EXTRN.
    is_superelement: bool,
    /// First card that supports the body (file and line), and the number of such cards.
    pub supports: Option<(PathBuf, usize, usize)>,
    boundary: Vec<Members>,
    supported: Vec<Members>,
    defaults: [i64; 2],
    default_support: Vec<u8>,
    began: usize,
    bad: BadLines,
}

impl Bulk {
    /// Reads a deck with the files that it includes.
    ///
    /// # Errors
    /// FB101, FB106 for files that cannot be read, FB110 for bad lines, FB111 for unsupported cards, FB205 for a node
    /// that is given twice, and the errors of [`Dmigs`], all that are found.
    pub(super) fn read(path: &Path) -> Diagnosed<Self> {
        let mut bulk = Self::default();
        let files = read_deck(path, &mut |item| match item {
            Item::Control(line) => {
                bulk.sets.line(line);
                bulk.assigned.line(line);
                bulk.constraints.control(line);
                Ok(())
            }
            Item::Begin(place) => {
                if bulk.began > 0 && !bulk.grids.is_empty() {
                    let message = "the deck has several sections of bulk data (BEGIN SUPER)";
                    let diagnostic = Diagnostic::new(Code::DeckUnsupported, message);
                    let help = "give the deck of one superelement";
                    bulk.bad.add(diagnostic.in_file(place.path).at_line(place.line).with_help(help));
                }
                bulk.began += 1;
                Ok(())
            }
            Item::Card(card, path) => {
                if bulk.card_files.last().is_none_or(|last| last != path) {
                    bulk.card_files.push(path.to_path_buf());
                }
                bulk.card(card, path, bulk.card_files.len() - 1);
                Ok(())
            }
            Item::Matrices(lines) => bulk.dmigs.cards(lines),
        })
        .map_err(|diagnostic| vec![diagnostic])?;
        let mut bad = std::mem::take(&mut bulk.bad).into_diagnostics(Code::DeckSyntax, "card");
        bad.extend(bulk.dmigs.take_bad());
        bulk.apply_defaults();
        bulk.files = files;
        if bad.is_empty() { Ok(bulk) } else { Err(bad) }
    }

    /// Returns true when the matrices have the rows of a boundary only.
    pub(super) fn is_condensed(&self) -> bool {
        let kept: BTreeSet<i64> = self.boundary().into_iter().map(|(id, _)| id).collect();
        self.is_superelement || !kept.is_empty() && self.grids.keys().any(|id| !kept.contains(id))
    }

    /// Returns the points of the a-set that cards name, ascending.
    pub(super) fn boundary(&self) -> BTreeSet<(i64, u8)> {
        self.named(&self.boundary)
    }

    /// Returns the points that supports hold.
    pub(super) fn supported(&self) -> BTreeSet<(i64, u8)> {
        self.named(&self.supported)
    }

    fn named(&self, members: &[Members]) -> BTreeSet<(i64, u8)> {
        let mut points = BTreeSet::new();
        for component in 1..=6 {
            let with_component = members.iter().filter(|range| range.components.contains(&component));
            for range in apart(with_component) {
                points.extend(self.grids.range(range).map(|(&id, _)| (id, component)));
            }
        }
        for range in apart(members.iter()) {
            points.extend(self.scalars.range(range).map(|&id| (id, 0)));
        }
        points
    }

    fn card(&mut self, card: &Card, path: &Path, file: usize) {
        let read = match card.name.as_str() {
            "GRID" => self.grid(card, path, file),
            "GRDSET" => self.grid_defaults(card, path),
            "SPOINT" => self.scalar_points(card),
            "CORD1R" | "CORD1C" | "CORD1S" => self.systems_by_grids(card, path),
            "CORD2R" | "CORD2C" | "CORD2S" => self.system(card, path),
            "DMIG" => {
                self.dmigs.card(card, path);
                Some(())
            }
            "ASET" | "BSET" | "CSET" | "QSET" | "BNDFIX" | "BNDFREE" => pairs(card, 0, &mut self.boundary),
            "ASET1" | "BSET1" | "CSET1" | "QSET1" | "BNDFIX1" | "BNDFRE1" => {
                list(card, 0, &mut self.boundary)
            }
            "SPC" => {
                self.is_supported(card, path);
                triples(card, &mut self.supported)
            }
            "SPC1" => {
                self.is_supported(card, path);
                list(card, 1, &mut self.supported)
            }
            "PARAM" => {
                if card.field(0).eq_ignore_ascii_case(b"COUPMASS") {
                    self.coupled_mass = card.integer(1).is_some_and(|value| value > 0)
                        || card.field(1).eq_ignore_ascii_case(b"YES");
                }
                Some(())
            }
            "SEQGP" => {
                self.resequenced = true;
                Some(())
            }
            "EXTRN" => {
                self.is_superelement = true;
                Some(())
            }
            _ => self.constraints.card(card, path).map(|is_constraint| {
                if !is_constraint {
                    self.element(card);
                }
            }),
        };
        if read.is_none() {
            let fields: Vec<String> = (0..card.len().min(8)).map(|k| excerpt(card.field(k))).collect();
            let message = format!("{} cannot be read: `{}`", card.name, fields.join("`, `"));
            self.bad.add(Diagnostic::new(Code::DeckSyntax, message).in_file(path).at_line(card.line()));
        }
    }

    fn grid(&mut self, card: &Card, path: &Path, file: usize) -> Option<()> {
        let id = card.integer(0).filter(|id| *id > 0)?;
        let system = |k: usize| match card.field(k) {
            b"" => Some(None),
            field => whole(field).filter(|system| *system >= 0).map(Some),
        };
        let grid = Grid {
            system: system(1)?,
            x: [card.real(2)?, card.real(3)?, card.real(4)?],
            axes: system(5)?,
            has_support_field: !card.field(6).is_empty(),
            held: components(card.field(6))?,
            file,
            line: card.line(),
        };
        let held = grid.held.clone();
        if !held.is_empty() && held != [0] {
            self.is_supported(card, path);
            self.supported.push(Members { first: id, last: id, components: held });
        }
        let same = grid.clone();
        // A card may occur in several included files.
        if self.grids.insert(id, grid).is_some_and(|other| !other.is_the_same(&same)) {
            let message = format!("grid {id} is given twice");
            self.bad.add(Diagnostic::new(Code::NodeDuplicate, message).in_file(path).at_line(card.line()));
        }
        Some(())
    }

    fn grid_defaults(&mut self, card: &Card, path: &Path) -> Option<()> {
        self.defaults = [card.integer(1)?, card.integer(5)?];
        self.default_support = components(card.field(6))?;
        if !self.default_support.is_empty() {
            self.is_supported(card, path);
        }
        Some(())
    }

    /// Replaces empty fields of GRID by those of GRDSET, which may follow later.
    fn apply_defaults(&mut self) {
        let [system, axes] = self.defaults;
        for (&id, grid) in &mut self.grids {
            grid.system.get_or_insert(system);
            grid.axes.get_or_insert(axes);
            if !grid.has_support_field && !self.default_support.is_empty() {
                let components = self.default_support.clone();
                self.supported.push(Members { first: id, last: id, components });
            }
        }
    }

    fn scalar_points(&mut self, card: &Card) -> Option<()> {
        if card.field(1).eq_ignore_ascii_case(b"THRU") {
            let (first, last) = (card.integer(0)?, card.integer(2)?);
            let fits =
                first > 0 && first <= last && last - first < MAX_RANGE && self.scalars.len() < MAX_SCALARS;
            self.scalars.extend(fits.then_some(first..=last)?);
            return Some(());
        }
        for k in (0..card.len()).filter(|k| !card.field(*k).is_empty()) {
            self.scalars.insert(card.integer(k).filter(|id| *id > 0)?);
        }
        Some(())
    }

    fn systems_by_grids(&mut self, card: &Card, path: &Path) -> Option<()> {
        let kind = kind(card)?;
        for first in [0, 4].into_iter().filter(|first| !card.field(*first).is_empty()) {
            let mut grids = [0; 3];
            for (k, grid) in grids.iter_mut().enumerate() {
                *grid = card.integer(first + 1 + k).filter(|id| *id > 0)?;
            }
            self.add_system(
                card,
                first,
                path,
                SystemCard::new(kind, Definition::Grids(grids), path, card.line()),
            )?;
        }
        Some(())
    }

    fn system(&mut self, card: &Card, path: &Path) -> Option<()> {
        let reference = card.integer(1)?;
        let mut points = [[0.0; 3]; 3];
        for (k, x) in points.iter_mut().flatten().enumerate() {
            *x = card.real(2 + k)?;
        }
        let definition = Definition::Points { reference, points };
        self.add_system(card, 0, path, SystemCard::new(kind(card)?, definition, path, card.line()))
    }

    fn add_system(&mut self, card: &Card, field: usize, path: &Path, system: SystemCard) -> Option<()> {
        let id = card.integer(field).filter(|id| *id > 0)?;
        let same = system.clone();
        if self.systems.insert(id, system).is_some_and(|other| !other.is_the_same(&same)) {
            let message = format!("coordinate system {id} is given twice");
            self.bad.add(Diagnostic::new(Code::DeckSyntax, message).in_file(path).at_line(card.line()));
        }
        Some(())
    }

    fn is_supported(&mut self, card: &Card, path: &Path) {
        let (.., count) = self.supports.get_or_insert_with(|| (path.to_path_buf(), card.line(), 0));
        *count += 1;
    }

    fn element(&mut self, card: &Card) {
        let name = card.name.as_str();
        self.n_dampers += usize::from(DAMPERS.iter().any(|head| name.starts_with(head)));
        let is_element = name.starts_with('C') && !NO_ELEMENTS.iter().any(|head| name.starts_with(head));
        if is_element {
            self.has_elements = true;
            self.has_rotations |= !SOLIDS.contains(&name);
            add_element(card, &mut self.elements);
        }
    }
}

fn kind(card: &Card) -> Option<SystemKind> {
    match card.name.as_bytes().last()? {
        b'R' => Some(SystemKind::Rectangular),
        b'C' => Some(SystemKind::Cylindrical),
        b'S' => Some(SystemKind::Spherical),
        _ => None,
    }
}

/// Adds the points of a card with pairs of point and components.
fn pairs(card: &Card, from: usize, members: &mut Vec<Members>) -> Option<()> {
    for k in (from..card.len()).step_by(2).filter(|k| !card.field(*k).is_empty()) {
        let id = card.integer(k).filter(|id| *id > 0)?;
        members.push(Members { first: id, last: id, components: components(card.field(k + 1))? });
    }
    Some(())
}

/// Adds the points of a card with a set number, then triples of point, components and displacement.
fn triples(card: &Card, members: &mut Vec<Members>) -> Option<()> {
    for k in (1..card.len()).step_by(3).filter(|k| !card.field(*k).is_empty()) {
        let id = card.integer(k).filter(|id| *id > 0)?;
        members.push(Members { first: id, last: id, components: components(card.field(k + 1))? });
    }
    Some(())
}

/// Returns the ranges of members without their overlaps, ascending, so that each point is visited once.
fn apart<'m>(members: impl Iterator<Item = &'m Members>) -> Vec<RangeInclusive<i64>> {
    let mut ranges: Vec<[i64; 2]> = members.map(|range| [range.first, range.last]).collect();
    ranges.sort_unstable();
    let (mut apart, mut next) = (Vec::new(), i64::MIN);
    for [first, last] in ranges {
        let first = first.max(next);
        if first <= last {
            apart.push(first..=last);
            next = last.saturating_add(1);
        }
    }
    apart
}

/// Adds the points of a card with components, then points or a range of them.
fn list(card: &Card, at: usize, members: &mut Vec<Members>) -> Option<()> {
    let components = components(card.field(at))?;
    let mut k = at + 1;
    while k < card.len() {
        let field = card.field(k);
        k += 1;
        if field.is_empty() {
            continue;
        }
        let first = whole(field).filter(|id| *id > 0)?;
        let last = if card.field(k).eq_ignore_ascii_case(b"THRU") {
            k += 2;
            whole(card.field(k - 1)).filter(|last| *last >= first)?
        } else {
            first
        };
        members.push(Members { first, last, components: components.clone() });
    }
    Some(())
}

/// Elements that only damp.
const DAMPERS: &[&str] = &["CDAMP", "CVISC"];

/// Elements that are points or connect coincident points, and are not drawn: springs, masses, dampers, fasteners.
const NOTHING_TO_DRAW: &[&str] =
    &["CELAS", "CBUSH", "CMASS", "CONM", "CDAMP", "CVISC", "CGAP", "CFAST", "CWELD", "CSEAM", "CHBDY"];

/// Adds the element of a card to the elements for drawing.
fn add_element(card: &Card, elements: &mut Elements) {
    let name = card.name.as_str();
    let Some((shape, first, most)) = shape(name) else {
        if !NOTHING_TO_DRAW.iter().any(|head| name.starts_with(head)) {
            elements.leave_out(name, 1);
        }
        return;
    };
    let grids: Vec<i64> = (first..first + most).map(|k| card.integer(k).unwrap_or(0)).collect();
    let (corners, middles) = grids.split_at(shape.corners());
    if corners.iter().any(|&grid| grid <= 0) {
        elements.leave_out(name, 1);
    } else if middles.is_empty() || middles.contains(&0) {
        elements.add(name, shape, corners);
    } else {
        elements.add(name, shape, &in_order_of_shape(shape, &grids));
    }
}

/// Returns the shape of an element, the field of its first grid, and its largest number of grids.
fn shape(name: &str) -> Option<(ElementShape, usize, usize)> {
    Some(match name {
        "CTETRA" => (ElementShape::Tetrahedron, 2, 10),
        "CPYRAM" | "CPYRA" => (ElementShape::Pyramid, 2, 13),
        "CPENTA" => (ElementShape::Wedge, 2, 15),
        "CHEXA" | "CHEXA20" => (ElementShape::Hexahedron, 2, 20),
        "CHEXA8" => (ElementShape::Hexahedron, 2, 8),
        "CTRIA3" | "CTRIAR" => (ElementShape::Triangle, 2, 3),
        "CTRIA6" => (ElementShape::Triangle, 2, 6),
        "CQUAD4" | "CQUADR" | "CSHEAR" => (ElementShape::Quadrilateral, 2, 4),
        "CQUAD8" => (ElementShape::Quadrilateral, 2, 8),
        "CBAR" | "CBEAM" | "CBEND" | "CROD" | "CTUBE" => (ElementShape::Line, 2, 2),
        "CONROD" => (ElementShape::Line, 1, 2),
        _ => return None,
    })
}
