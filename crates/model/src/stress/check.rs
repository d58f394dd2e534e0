//! Check of each given geometric stiffness.

use super::loads::UnitLoads;
use super::relations::Relations;
use crate::wording::name_some;
use crate::{FeModel, GeometricStiffness, RawMatrix, UnitLoad};
use flexbody_base::diagnostic::{Code, Diagnostic};
use std::path::Path;

/// Largest accepted error of a relation: reduced integration leaves some tenths of a percent. A larger
/// value would accept parts of the stiffness of initial displacements, which for a straight bar under
/// tension breaks the relation of rotation by 30 %.
const MAX_RELATION_ERROR: f64 = 1e-2;

/// Errors up to this value are not reported: matrices written with ten digits leave 1e-8.
const MIN_REPORTED_ERROR: f64 = 1e-6;

/// Adds an error for each geometric stiffness that breaks a relation with rigid motion, or that belongs to
/// another load.
///
/// * `files`: matrices as read, with their files.
/// * `solid`: true if all elements of the body are known to be solids, so that K_geo is a multiple of I for
///   every pair of nodes.
pub(crate) fn check_stress(
    model: &FeModel,
    files: &[GeometricStiffness<RawMatrix>],
    solid: bool,
    found: &mut Vec<Diagnostic>,
) {
    let given = model.geometric_stiffness();
    if given.is_empty() {
        return;
    }
    let loads = UnitLoads::new(model);
    for GeometricStiffness { load, matrix } in given {
        let file = files.iter().find(|one| one.load == *load).map(|one| &one.matrix);
        let digits = file.map_or(17, |file| file.digits);
        let relations = Relations::new(model, matrix, solid, digits);
        let judged = Judged { model, load, relations };
        let diagnostic = judged.motion().or_else(|| judged.load(&loads));
        let path = file.map_or(Path::new(""), |file| &file.path);
        found.extend(diagnostic.map(|one| one.in_file(path)));
    }
}

/// Geometric stiffness with the results of its check.
struct Judged<'m> {
    model: &'m FeModel,
    load: &'m UnitLoad,
    relations: Relations,
}

impl Judged<'_> {
    /// Returns an error about the worst relation with rigid motion that holds for every load.
    fn motion(&self) -> Option<Diagnostic> {
        let Relations { translation, rotation, blocks, .. } = &self.relations;
        let (name, per_cent) = (self.load, |share: f64| format!("{:.2} %", 100.0 * share));
        if translation.share > MAX_RELATION_ERROR {
            let labels: Vec<_> = translation.rows.iter().map(|&row| self.model.label(row)).collect();
            let message = format!(
                "geometric stiffness for {name} resists translation: forces reach {} of the row sums (allowed 1 %), at {}",
                per_cent(translation.share),
                name_some(&labels)
            );
            let help = "give the matrix of the free body: rows and columns of supported nodes belong to it";
            return Some(Diagnostic::new(Code::GeometricStiffnessMotion, message).with_help(help));
        }
        if *rotation > MAX_RELATION_ERROR {
            let message = format!(
                "geometric stiffness for {name} does not rotate the forces of its load with the body: {} of its forces under rigid rotation are not rotated forces (allowed 1 %)",
                per_cent(*rotation)
            );
            return Some(Diagnostic::new(Code::GeometricStiffnessMotion, message));
        }
        if *blocks > MAX_RELATION_ERROR {
            let message = format!(
                "geometric stiffness for {name} depends on directions: {} of its entries are outside of multiples of the identity for each pair of nodes (allowed 1 %)",
                per_cent(*blocks)
            );
            return Some(Diagnostic::new(Code::GeometricStiffnessMotion, message));
        }
        None
    }

    /// Returns an error if the load is another one, or a warning about smaller errors.
    fn load(&self, loads: &UnitLoads<'_>) -> Option<Diagnostic> {
        let (name, relations) = (self.load, &self.relations);
        let other = loads.error(self.load, &relations.forces).unwrap_or(0.0);
        if other > MAX_RELATION_ERROR {
            let message = format!(
                "geometric stiffness for {name} belongs to another load: the forces that it turns differ from those of {name} by {:.3} % (allowed 1 %), supports and inertia relief apart",
                100.0 * other
            );
            return Some(Diagnostic::new(Code::GeometricStiffnessLoad, message));
        }
        let errors = [
            ("translation", relations.translation.share),
            ("rotation", relations.rotation),
            ("direction", relations.blocks),
            ("the load", other),
        ];
        let (what, worst) = errors.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (worst > MIN_REPORTED_ERROR.max(relations.rounding)).then(|| {
            let message = format!(
                "geometric stiffness for {name} fulfils its relations with rigid motion to {worst:.1e} (worst: {what})"
            );
            Diagnostic::new(Code::GeometricStiffnessRough, message)
        })
    }
}
