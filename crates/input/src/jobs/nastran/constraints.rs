//! Rigid elements and multipoint constraints of a deck: the components of grids that follow others. KGG and MGG do not
//! contain them: rows that follow others are eliminated.

use crate::bulk_cards::{Card, components};
use crate::matrices::dmig::{Point, label};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::scanner::{real, whole};
use flexbody_model::DofLabel;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Constraint cards that are not supported.
const NOT_READ: &[&str] = &[
    "RTRPLT", "RTRPLT1", "RJOINT", "RSPLINE", "RSSCON", "RSPINT", "RBE2GS", "RBE2A", "RBE3U", "MPCY", "MPCAX",
];

/// Largest number of points that THRU of all rigid elements of a deck may represent together.
const MAX_RANGED: i64 = 1_000_000;

/// Constraints of a deck.
#[derive(Default)]
pub(super) struct Constraints {
    all: Vec<Constraint>,
    /// Number of points that THRU has represented.
    ranged: i64,
    /// Sets joined by MPCADD.
    joined: BTreeMap<i64, Vec<i64>>,
    /// Sets selected by the case control.
    selected: BTreeSet<i64>,
}

/// Constraint of one card.
pub(super) struct Constraint {
    /// Name with number, for instance `RBE2 901`.
    pub name: String,
    pub relation: Relation,
    pub path: PathBuf,
    pub line: usize,
}

/// Relation by which components follow others.
pub(super) enum Relation {
    /// Rigid body moved by six independent components.
    Rigid { independent: Vec<Point>, dependent: Vec<Point> },
    /// Two grids at a constant distance, with the dependent component.
    Rod { grids: [i64; 2], dependent: Point },
    /// Weighted average of the motions of other grids.
    Average { reference: i64, components: Vec<u8>, weighted: Vec<(Point, f64)> },
    /// Zero sum of components, solved for the first of them; `set` is the number of its set.
    Sum { set: i64, terms: Vec<(Point, f64)> },
    /// Unsupported card with the whole numbers on it, some of which are grids.
    Unsupported { numbers: Vec<i64> },
}

impl Constraint {
    /// Returns the dependent points.
    fn dependent(&self) -> Vec<Point> {
        match &self.relation {
            Relation::Rigid { dependent, .. } => dependent.clone(),
            Relation::Rod { dependent, .. } => vec![*dependent],
            Relation::Average { reference, components, .. } => {
                components.iter().map(|component| (*reference, *component)).collect()
            }
            Relation::Sum { terms, .. } => vec![terms[0].0],
            Relation::Unsupported { .. } => Vec::new(),
        }
    }

    /// Returns the independent points.
    fn independent(&self) -> Vec<Point> {
        match &self.relation {
            Relation::Rigid { independent, .. } => independent.clone(),
            Relation::Rod { grids, dependent } => {
                let all = grids.iter().flat_map(|grid| (1..=3).map(|component| (*grid, component)));
                all.filter(|point| point != dependent).collect()
            }
            Relation::Average { weighted, .. } => weighted.iter().map(|(point, _)| *point).collect(),
            Relation::Sum { terms, .. } => terms[1..].iter().map(|(point, _)| *point).collect(),
            Relation::Unsupported { .. } => Vec::new(),
        }
    }

    /// Returns FB111 about the card.
    pub(super) fn refused(&self, why: impl std::fmt::Display) -> Diagnostic {
        let message = format!("{}: {why}", self.name);
        Diagnostic::new(Code::DeckUnsupported, message).in_file(&self.path).at_line(self.line)
    }
}

impl Constraints {
    /// Reads a line of case control, for instance `MPC = 5`.
    pub(super) fn control(&mut self, line: &str) {
        let words: Vec<&str> =
            line.split(|c: char| c == '=' || c.is_whitespace()).filter(|w| !w.is_empty()).collect();
        if let [name, number] = words.as_slice()
            && name.eq_ignore_ascii_case("MPC")
        {
            self.selected.extend(number.parse::<i64>().ok());
        }
    }

    /// Reads a card. Returns false if it is no constraint, `None` if it cannot be read.
    pub(super) fn card(&mut self, card: &Card, path: &Path) -> Option<bool> {
        let relation = match card.name.as_str() {
            "RBE2" => rbe2(card, &mut self.ranged)?,
            "RBAR" => rbar(card)?,
            "RBAR1" => rbar1(card)?,
            "RBE1" => rbe1(card)?,
            "RROD" => rrod(card)?,
            "RBE3" => rbe3(card, &mut self.ranged)?,
            "MPC" => sum(card)?,
            "MPCADD" => {
                let sets: Option<Vec<i64>> = filled(card, 1).map(|k| card.integer(k)).collect();
                self.joined.entry(card.integer(0)?).or_default().extend(sets?);
                return Some(true);
            }
            name if NOT_READ.contains(&name) => not_read(card),
            _ => return Some(false),
        };
        let name = format!("{} {}", card.name, card.integer(0).unwrap_or(0));
        let (path, line) = (path.to_path_buf(), card.line());
        self.all.push(Constraint { name, relation, path, line });
        Some(true)
    }

    /// Returns the sets that the case control selects, with the sets that MPCADD joins in them.
    fn sets(&self) -> BTreeSet<i64> {
        let joined = |set: &i64| self.joined.get(set).into_iter().flatten().copied();
        self.selected.iter().flat_map(|set| joined(set).chain([*set])).collect()
    }

    /// Returns the active constraints: rigid elements, and sums of the sets that the case control selects.
    fn holding(&self) -> impl Iterator<Item = &Constraint> {
        let sets = self.sets();
        self.all.iter().filter(move |constraint| match &constraint.relation {
            Relation::Sum { set, .. } => sets.contains(set),
            _ => true,
        })
    }

    /// Returns the active constraints of supported kinds.
    pub(super) fn supported(&self) -> Vec<&Constraint> {
        let is_supported = |of: &&Constraint| !matches!(of.relation, Relation::Unsupported { .. });
        self.holding().filter(is_supported).collect()
    }

    /// Returns the dependent and the independent points.
    pub(super) fn points(&self) -> (BTreeSet<Point>, BTreeSet<Point>) {
        let followers = self.holding().flat_map(Constraint::dependent).collect();
        (followers, self.holding().flat_map(Constraint::independent).collect())
    }

    /// Returns the dependent rows, by the names of the constraints.
    pub(super) fn followers(&self) -> Vec<(String, Vec<DofLabel>)> {
        let of = |constraint: &Constraint| {
            (constraint.name.clone(), constraint.dependent().into_iter().map(label).collect::<Vec<_>>())
        };
        self.holding().map(of).collect()
    }

    /// Returns the constraints that the matrices do not contain yet. `has` returns true when the matrices have rows of
    /// a point; matrices after the constraints have no dependent rows.
    ///
    /// # Errors
    /// FB111 for unsupported constraints, and for sums of a set that is not selected, since they may be active or not.
    pub(super) fn open(&self, has: impl Fn(&Point) -> bool) -> Result<Vec<&Constraint>, Diagnostic> {
        let sets = self.sets();
        let mut open = Vec::new();
        for constraint in &self.all {
            match &constraint.relation {
                // An unsupported card matters only if it connects grids with rows.
                Relation::Unsupported { numbers } => {
                    let moves = |grid: i64| (0..=6).any(|component| has(&(grid, component)));
                    if numbers.iter().filter(|number| moves(**number)).count() > 1 {
                        let help = "write the matrices of the a-set (EXTOUT, EXTSEOUT), which contain it, or write it as RBE2, RBE3 without UM, RBAR or MPC";
                        return Err(constraint
                            .refused("constraints of this kind are not supported")
                            .with_help(help));
                    }
                }
                Relation::Sum { set, .. }
                    if !sets.contains(set) && constraint.dependent().iter().any(&has) =>
                {
                    let why = "the case control does not select the set, so that it is not known whether the constraint acts";
                    let help =
                        format!("write MPC = {set} into the case control, or remove the cards of the set");
                    return Err(constraint.refused(why).with_help(help));
                }
                _ if constraint.dependent().iter().any(&has) => open.push(constraint),
                _ => {}
            }
        }
        Ok(open)
    }
}

/// Returns the indices of the fields of a card that are not empty, from `from` on.
fn filled(card: &Card, from: usize) -> impl Iterator<Item = usize> {
    (from..card.len()).filter(|k| !card.field(*k).is_empty())
}

/// Returns true when a field is a real number but no whole one: a weight, or a coefficient of expansion.
fn is_real(field: &[u8]) -> bool {
    whole(field).is_none() && real(field).is_some()
}

fn grid(card: &Card, k: usize) -> Option<i64> {
    card.integer(k).filter(|id| *id > 0)
}

/// Returns the points of a grid. Components of scalar points are 0 or none.
fn points(grid: i64, field: &[u8]) -> Option<Vec<Point>> {
    let listed = components(field)?;
    Some(if listed.is_empty() { vec![(grid, 0)] } else { listed.into_iter().map(|c| (grid, c)).collect() })
}

fn all_of(grid: i64) -> impl Iterator<Item = Point> {
    (1..=6).map(move |component| (grid, component))
}

/// Returns the grids, including ranges, from a field up to the first that is no whole number, and the index of that
/// field. Adds the number of grids in ranges to `ranged`.
fn grids(card: &Card, from: usize, ranged: &mut i64) -> Option<(Vec<i64>, usize)> {
    let (mut ids, mut k) = (Vec::new(), from);
    while k < card.len() {
        let field = card.field(k);
        if field.eq_ignore_ascii_case(b"THRU") {
            let (first, last) = (*ids.last()?, grid(card, k + 1)?);
            *ranged = ranged.saturating_add(last.checked_sub(first).filter(|more| *more > 0)?);
            (*ranged < MAX_RANGED).then_some(())?;
            ids.extend(first + 1..=last);
            k += 1;
        } else if !field.is_empty() {
            match whole(field) {
                Some(id) if id > 0 => ids.push(id),
                Some(_) => return None,
                None => break,
            }
        }
        k += 1;
    }
    Some((ids, k))
}

fn not_read(card: &Card) -> Relation {
    Relation::Unsupported { numbers: (1..card.len()).filter_map(|k| whole(card.field(k))).collect() }
}

/// Reads RBE2 with the fields EID, GN, CM, GM1, GM2, ..., ALPHA.
fn rbe2(card: &Card, ranged: &mut i64) -> Option<Relation> {
    let listed = components(card.field(2)).filter(|listed| !listed.is_empty() && !listed.contains(&0))?;
    let (followers, end) = grids(card, 3, ranged)?;
    (end >= card.len() || is_real(card.field(end))).then_some(())?;
    let dependent = followers.iter().flat_map(|id| listed.iter().map(|c| (*id, *c))).collect();
    Some(Relation::Rigid { independent: all_of(grid(card, 1)?).collect(), dependent })
}

/// Reads RBAR with the fields EID, GA, GB, CNA, CNB, CMA, CMB, ALPHA.
fn rbar(card: &Card) -> Option<Relation> {
    let points_of_end = |k: usize| -> Option<Vec<Point>> {
        let id = grid(card, 1 + k % 2)?;
        Some(components(card.field(3 + k))?.into_iter().map(|c| (id, c)).collect())
    };
    let independent = [points_of_end(0)?, points_of_end(1)?].concat();
    let stated = [points_of_end(2)?, points_of_end(3)?].concat();
    let others = || {
        let all = all_of(grid(card, 1)?).chain(all_of(grid(card, 2)?));
        Some(all.filter(|point| !independent.contains(point)).collect())
    };
    let dependent = if stated.is_empty() { others()? } else { stated };
    Some(Relation::Rigid { independent, dependent })
}

/// Reads RBAR1 with the fields EID, GA, GB, CB, ALPHA.
fn rbar1(card: &Card) -> Option<Relation> {
    let listed = components(card.field(3))?;
    let listed = if listed.is_empty() { vec![1, 2, 3, 4, 5, 6] } else { listed };
    let follower = grid(card, 2)?;
    let dependent = listed.into_iter().map(|c| (follower, c)).collect();
    Some(Relation::Rigid { independent: all_of(grid(card, 1)?).collect(), dependent })
}

/// Reads RBE1 with the fields EID, pairs of independent grids and components, UM, dependent pairs, ALPHA.
fn rbe1(card: &Card) -> Option<Relation> {
    let (mut independent, mut dependent, mut follows) = (Vec::new(), Vec::new(), false);
    let mut fields = filled(card, 1);
    while let Some(k) = fields.next() {
        if card.field(k).eq_ignore_ascii_case(b"UM") {
            follows = true;
        } else if is_real(card.field(k)) {
            break;
        } else {
            let listed = points(grid(card, k)?, card.field(fields.next()?))?;
            if follows { &mut dependent } else { &mut independent }.extend(listed);
        }
    }
    Some(Relation::Rigid { independent, dependent })
}

/// Reads RROD with the fields EID, GA, GB, CMA, CMB, ALPHA.
fn rrod(card: &Card) -> Option<Relation> {
    let grids = [grid(card, 1)?, grid(card, 2)?];
    let listed = [components(card.field(3))?, components(card.field(4))?];
    let dependent = match (listed[0].as_slice(), listed[1].as_slice()) {
        (&[component @ 1..=3], []) => (grids[0], component),
        ([], &[component @ 1..=3]) => (grids[1], component),
        _ => return None,
    };
    Some(Relation::Rod { grids, dependent })
}

/// Reads RBE3 with the fields EID, blank, REFGRID, REFC, then groups of weight, components and grids, UM, ALPHA.
fn rbe3(card: &Card, ranged: &mut i64) -> Option<Relation> {
    let reference = grid(card, 2)?;
    let listed = components(card.field(3)).filter(|listed| !listed.is_empty() && !listed.contains(&0))?;
    let (mut weighted, mut k) = (Vec::new(), 4);
    while k < card.len() {
        let field = card.field(k);
        if field.is_empty() {
            k += 1;
        } else if field.eq_ignore_ascii_case(b"UM") {
            return Some(not_read(card));
        } else if field.eq_ignore_ascii_case(b"ALPHA") {
            break;
        } else {
            let weight = real(field).filter(|weight| weight.is_finite())?;
            let components = components(card.field(k + 1))?;
            let (members, end) = grids(card, k + 2, ranged)?;
            (!members.is_empty()).then_some(())?;
            let points = members.iter().flat_map(|id| components.iter().map(|c| ((*id, *c), weight)));
            weighted.extend(points);
            k = end;
        }
    }
    Some(Relation::Average { reference, components: listed, weighted })
}

/// Reads MPC with the fields SID, then groups of grid, component and coefficient, two per line of eight fields.
fn sum(card: &Card) -> Option<Relation> {
    let set = grid(card, 0)?;
    let mut terms = Vec::new();
    for k in (0..card.len()).step_by(8).flat_map(|row| [row + 1, row + 4]) {
        if card.field(k).is_empty() {
            continue;
        }
        let component = card.integer(k + 1).filter(|component| (0..=6).contains(component))?;
        terms.push(((grid(card, k)?, component as u8), card.real(k + 2)?));
    }
    (terms.first()?.1 != 0.0).then_some(Relation::Sum { set, terms })
}
