//! Transformations of the conversion.

use super::Pair;
use crate::correspondence::Correspondence;
use crate::features::has_singular_mass;
use crate::subject::{Basis, Subject, frames};
use flexbody_base::error::Result;
use flexbody_body::flex_body::MassStructure;
use flexbody_body::invariants::FrameChoice;
use oracle::random::Random;

/// Largest difference of bodies whose mass does not commute with rotations, on an interface and in mean axes, relative to
/// the size of the output. Their nodal rotations do not turn with the frame, which differs in second order of the
/// rotation of the interface (theory section 6; 5e-3 of a deflection seen, where it turns by 5e-3 rad).
const SECOND_ORDER: f64 = 1e-2;

/// Converts with another frame.
pub fn frame(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let mut others = frames(&subject.raw);
    others.retain(|frame| *frame != subject.frame);
    let frame = others[crate::draws::pick(random, others.len())].clone();
    let is_mean = |frame: &FrameChoice| matches!(frame, FrameChoice::Mean(_));
    let mut map = Correspondence::default();
    if is_mean(&frame) != is_mean(&subject.frame)
        && subject.body()?.source().mass_structure == MassStructure::General
    {
        map.allowed = SECOND_ORDER;
    }
    Ok(Some(Pair::new(subject, Subject { frame, ..subject.clone() }, map)))
}

/// Converts with another complete basis. Bodies with a singular mass matrix are excluded: the static shapes
/// of a Craig-Bampton basis keep a part that moves no mass and do not span the finite modes (12 of 12 modes,
/// the first at 0.453 instead of 0.246 Hz).
pub fn basis(subject: &Subject, _: &mut Random) -> Result<Option<Pair>> {
    if !subject.scene.initial.modes.is_empty() || has_singular_mass(subject) {
        return Ok(None);
    }
    let with = |basis: Basis| Subject { basis, ..subject.clone() };
    Ok(Some(Pair::new(&with(Basis::All), with(Basis::Fixed), Correspondence::default())))
}

/// Writes the body to a file and reads it, which gives equal bits.
pub fn stored(subject: &Subject, _: &mut Random) -> Result<Option<Pair>> {
    let changed = Subject { stored: true, ..subject.clone() };
    Ok(Some(Pair::new(subject, changed, Correspondence { allowed: 0.0, ..Correspondence::default() })))
}

/// Writes the scene to files and reads it.
pub fn written(subject: &Subject, _: &mut Random) -> Result<Option<Pair>> {
    let changed = Subject { written: true, ..subject.clone() };
    Ok(Some(Pair::new(subject, changed, Correspondence::default())))
}

/// Recovers the rows from the table of the motion, with no difference but that of its largest rows, which are found between
/// its instants too.
pub fn by_table(subject: &Subject, _: &mut Random) -> Result<Option<Pair>> {
    let changed = Subject { by_table: true, ..subject.clone() };
    Ok(Some(Pair::new(subject, changed, Correspondence::default())))
}
