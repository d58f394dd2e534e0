//! Bodies that the settings of a conversion make of one model.

use super::Source;
use crate::reference::{Enriched, Enrichment, MotionBodies, ReferenceError, enrich};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, FreeSurface, Loads, ModeSettings};
use flexbody_body::convert::{ConvertSettings, Lumping, convert};
use flexbody_eigen::{Accuracy, Wanted};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::LoadCases;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fmt::Write;
use std::time::Instant;

/// The bodies of a study.
pub struct Conversions {
    /// The reference first.
    pub sources: Vec<Source>,
    /// What the reference, and bodies before it that were enriched, lack of the model in each load case; the
    /// last one is the reference.
    pub lacks: Vec<Vec<ReferenceError>>,
    /// What was said about the reference.
    pub diagnostics: Vec<Diagnostic>,
}

/// What a study is to be made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WantedBodies {
    /// Free modes of a usual conversion.
    pub modes: usize,
    /// Whether the reference stands for the motion of all nodes: [`Enrichment::is_fine`].
    pub fine: bool,
}

/// Every conversion of a study in these load cases.
///
/// The reference has twice as many modes as are wanted, residual vectors of spin and interfaces, and what
/// [`enrich`] finds lacking in any case. Beside it stand as many as are wanted, their half and their quarter
/// with residual vectors and without, the same at the other levels of accuracy, bodies of the shapes that the
/// motions of the reference are made of, and what the settings of the reference make of the model with its
/// whole mass lumped. Each is timed.
///
/// # Errors
/// Those of [`convert`] and [`enrich`]. Accuracy `certified` is left out where it does not cover the model.
pub fn conversions(
    model: &FeModel,
    cases: &LoadCases,
    wanted: WantedBodies,
    context: &Context<'_>,
) -> Result<Conversions> {
    let making = Making::new(model, context);
    let WantedBodies { modes, fine } = wanted;
    let finest =
        Wish { count: modes.saturating_mul(2), residual: true, accuracy: Accuracy::Standard, lumped: None };
    let mut responses = Mat::new();
    let make = |loads: &Mat<f64>| {
        responses.clone_from(loads);
        making.make(&finest, loads, ConvertSettings::default().lumped)
    };
    let enrichment = Enrichment { grows: true, is_fine: fine };
    let enriched = enrich(model, cases, enrichment, context, make, |(made, _)| made.body())?;
    let Enriched { made: (reference, mut diagnostics), rounds: lacks } = enriched;
    diagnostics.extend(warnings(cases, &lacks, enrichment.enough()));
    let mut sources = vec![reference];
    for wish in wishes(modes) {
        let source = match making.make(&wish, &Mat::new(), Vec::new()) {
            Ok((source, _)) => source,
            Err(error)
                if wish.accuracy == Accuracy::Certified && error.first_error().code() == Code::Usage =>
            {
                continue;
            }
            Err(error) => return Err(error),
        };
        let beside = source.beside(sources[0].body(), model);
        sources.push(beside.expect(OF_THE_MODEL));
    }
    let lacking = |rounds: &Vec<ReferenceError>| rounds.last().map_or(0.0, |own| own.worst);
    let left: Vec<f64> = lacks.iter().map(|rounds| 1.0 - lacking(rounds)).collect();
    for source in making.make_of_motion(&sources[0], cases, &left)? {
        sources.push(source.beside(sources[0].body(), model).expect(OF_THE_MODEL));
    }
    for lumping in lumpings(model) {
        match making.make_lumped(&finest, &responses, &lumping)? {
            Ok(source) => sources.push(source.beside(sources[0].body(), model).expect(OF_THE_MODEL)),
            Err(reason) => diagnostics.push(reason),
        }
    }
    Ok(Conversions { sources, lacks, diagnostics })
}

/// Warnings about what the reference lacks, each with its load case where there are several.
fn warnings(cases: &LoadCases, lacks: &[Vec<ReferenceError>], enough: f64) -> Vec<Diagnostic> {
    let of = |(at, rounds): (usize, &Vec<ReferenceError>)| {
        let warning = rounds.last()?.warning(&cases[at], enough)?;
        Some(match cases.case_name(at) {
            Some(name) => warning.about(format!("case `{name}`")),
            None => warning,
        })
    };
    lacks.iter().enumerate().filter_map(of).collect()
}

/// Part of what is left of the tolerances that bodies of the fewest shapes may take: the rest is for terms
/// that are left out beside.
const SHARE_OF_SHAPES: f64 = 0.9;

const OF_THE_MODEL: &str = "bodies that were made of the model";

/// Schemes that lump the whole mass of `model`; none where it is lumped already, or where rows without a
/// place carry mass that belongs to no node.
fn lumpings(model: &FeModel) -> Vec<Lumping> {
    match model.has_diagonal_mass() || model.rows().vectors() > 0 {
        true => Vec::new(),
        false => ConvertSettings::default().lumped,
    }
}

/// A body that is wanted.
#[derive(Clone, PartialEq)]
struct Wish {
    /// Number of free modes.
    count: usize,
    /// Whether it has residual vectors.
    residual: bool,
    accuracy: Accuracy,
    /// Scheme by which the mass is lumped before.
    lumped: Option<&'static str>,
}

impl Wish {
    fn in_words(&self) -> String {
        let mut name = format!("{} free mode{}", self.count, if self.count == 1 { "" } else { "s" });
        if self.residual {
            name.push_str(", residual vectors");
        }
        if let Some(scheme) = self.lumped {
            let _ = write!(name, ", of a mass lumped by {scheme}");
        }
        if self.accuracy != Accuracy::Standard {
            name.push_str(&format!(", {}", self.accuracy.name()));
        }
        name
    }
}

/// The bodies beside the reference, each once.
fn wishes(modes: usize) -> Vec<Wish> {
    let other = |accuracy| Wish { count: modes, residual: false, accuracy, lumped: None };
    let mut wishes = vec![other(Accuracy::Fast), other(Accuracy::Certified)];
    for part in [1, 2, 4] {
        let count = (modes / part).max(1);
        for residual in [true, false] {
            let wish = Wish { count, residual, accuracy: Accuracy::Standard, lumped: None };
            if !wishes.contains(&wish) {
                wishes.push(wish);
            }
        }
    }
    wishes
}

/// What all conversions of a study have in common.
struct Making<'m> {
    model: &'m FeModel,
    /// Loads of the residual vectors.
    loads: Vec<Loads>,
    context: Context<'m>,
}

impl<'m> Making<'m> {
    fn new(model: &'m FeModel, context: &Context<'m>) -> Self {
        let mut loads = vec![Loads::Centrifugal];
        if !model.interfaces().is_empty() {
            loads.push(Loads::Interfaces);
        }
        Self { model, loads, context: *context }
    }

    /// Settings of a conversion with so many modes, without lumped comparators.
    fn settings(&self, modes: usize) -> ConvertSettings {
        ConvertSettings {
            modes: ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() },
            lumped: Vec::new(),
            ..ConvertSettings::default()
        }
    }

    /// Converts the model, with the static responses to `motion` as well, and takes the time of it.
    fn make(
        &self,
        wish: &Wish,
        motion: &Mat<f64>,
        lumped: Vec<Lumping>,
    ) -> Result<(Source, Vec<Diagnostic>)> {
        let residual_vectors = if wish.residual { self.loads.clone() } else { Vec::new() };
        let basis = BasisChoice::Free(FreeSurface { residual_vectors });
        let own = self.settings(wish.count);
        let settings = ConvertSettings {
            modes: ModeSettings { accuracy: wish.accuracy, ..own.modes },
            basis: basis.with_motion(motion).expect("free modes take responses"),
            lumped,
            ..own
        };
        let start = Instant::now();
        let conversion = convert(self.model, &settings, &self.context)?;
        let seconds = start.elapsed().as_secs_f64();
        Ok((Source::new(wish.in_words(), conversion.body, Some(seconds))?, conversion.diagnostics))
    }

    /// Bodies of the shapes of the motion of `reference` in `cases`: of the numbers worth trying, and of the
    /// fewest that are good enough where the parts `left` of the tolerances are left to them. Each takes the
    /// time of the reference and its motion besides.
    fn make_of_motion(&self, reference: &Source, cases: &LoadCases, left: &[f64]) -> Result<Vec<Source>> {
        if cases.iter().any(|scene| scene.run.duration.is_none()) {
            return Ok(Vec::new());
        }
        let start = Instant::now();
        let Some(bodies) = MotionBodies::new(self.model, reference.body(), cases, &self.context)? else {
            return Ok(Vec::new());
        };
        let before = start.elapsed().as_secs_f64() + reference.preprocessing().unwrap_or(0.0);
        let mut made = BTreeMap::new();
        let mut make = |count: usize| match made.entry(count) {
            Entry::Occupied(known) => Ok(Source::clone(known.get())),
            Entry::Vacant(new) => Ok(new.insert(self.of_shapes(&bodies, count, before)?).clone()),
        };
        let mut counts = bodies.counts();
        counts.iter().try_for_each(|count| make(*count).map(drop))?;
        let most: Vec<f64> = left.iter().map(|left| SHARE_OF_SHAPES * left).collect();
        let fewest = bodies.fewest(&most, make, Source::body)?;
        counts.extend(fewest.map(|own| own.count));
        Ok(made.into_iter().filter(|(count, _)| counts.contains(count)).map(|(_, own)| own).collect())
    }

    /// The body of so many shapes of a motion that took `before` seconds.
    fn of_shapes(&self, bodies: &MotionBodies<'_>, count: usize, before: f64) -> Result<Source> {
        let start = Instant::now();
        let settings = ConvertSettings { basis: bodies.basis(count), ..self.settings(usize::MAX) };
        let body = convert(self.model, &settings, &self.context)?.body;
        let name = format!("{count} shape{} of the motion", if count == 1 { "" } else { "s" });
        Source::new(name, body, Some(before + start.elapsed().as_secs_f64()))
    }

    /// The same of the model with its whole mass lumped; the reason where this has no modes.
    fn make_lumped(
        &self,
        wish: &Wish,
        motion: &Mat<f64>,
        lumping: &Lumping,
    ) -> Result<std::result::Result<Source, Diagnostic>> {
        let masses = lumping.masses(self.model)?;
        let scheme = masses.scheme().name();
        let no_body = |why: String| {
            let message = format!("no candidate whose whole mass is lumped by {scheme}: {why}");
            Ok(Err(Diagnostic::new(Code::LumpedWithoutBody, message)))
        };
        if masses.negative() > 0 {
            return no_body(format!("{} nodal masses are negative", masses.negative()));
        }
        let lumped = self.model.with_nodal_masses(masses.masses());
        let name = Wish { lumped: Some(scheme), ..wish.clone() };
        let own = Making { model: &lumped, loads: self.loads.clone(), ..*self };
        match own.make(&name, motion, Vec::new()) {
            Ok((source, _)) => Ok(Ok(source.of_lumped_mass(scheme))),
            Err(error) => no_body(error.first_error().message().to_owned()),
        }
    }
}
