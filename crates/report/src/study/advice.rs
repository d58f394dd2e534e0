//! Report on advice for ranges of motion: errors of sampled motions without terms, guidelines of the literature, and the settings of
//! other programs.

use super::errors::{error_in_words, errors_in_words, groups_in_words};
use crate::document::{Block, Document, Format, Inline, State, Table, Term, cells, heading};
use crate::notation::numbers::{frequency, percent, sentence, significant};
use crate::notation::units::UnitFacts;
use crate::run_data::RunData;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::generator;
use flexbody_body::flex_body::{FlexBody, TermGroup, TermGroups};
use flexbody_motion::scene::OutputErrors;
use flexbody_study::advice::{Advice, AdvisedTerm, GuidelineAdvice, SampledMotions, SampledSet};
use flexbody_study::recipe::advised;
use serde::Serialize;

/// Facts of an advice.
#[derive(Debug, Clone, Serialize)]
pub struct AdviceFacts<'a> {
    format: &'static str,
    format_major: u8,
    format_minor: u8,
    generator: String,
    body: &'a str,
    units: UnitFacts,
    /// First frequency, with the attached mass.
    first_frequency_hz: f64,
    spin_hz: f64,
    /// Ratio of the rotation rate to the first frequency.
    speed_ratio: f64,
    deflection: f64,
    /// Ratio of the deflection to the largest extent of the body.
    deflection_ratio: f64,
    attached_mass: Option<f64>,
    rotation: &'static str,
    limit: f64,
    guideline: &'static str,
    /// Groups of the kinetic energy that the body needs: those of the sampled motions, without them those by size.
    groups: Vec<&'static str>,
    /// Groups of the kinetic energy with a term whose size is above the limit.
    groups_by_size: Vec<&'static str>,
    /// Errors of sampled motions.
    motions: Option<MotionsFacts>,
    /// Reason why no motions were sampled.
    not_sampled: Option<&'a str>,
    command: String,
    guidelines: Vec<GuidelineFacts>,
    terms: Vec<TermFacts>,
    programs: Vec<ProgramFacts>,
    diagnostics: &'a [Diagnostic],
}

#[derive(Debug, Clone, Serialize)]
struct MotionsFacts {
    count: usize,
    duration: f64,
    sets: Vec<SetFacts>,
}

/// Errors of the motions with some terms only.
#[derive(Debug, Clone, Serialize)]
struct SetFacts {
    groups: Vec<&'static str>,
    #[serde(flatten)]
    errors: OutputErrors,
    /// Largest error over the limit; `None` if a motion could not be integrated.
    worst: Option<f64>,
    /// Number (from 1) of the motion with this error.
    motion: usize,
    holds: bool,
    /// Reason why there are no errors; empty if there are errors.
    remark: String,
}

#[derive(Debug, Clone, Serialize)]
struct GuidelineFacts {
    name: &'static str,
    keeps: &'static str,
    qualifies: bool,
    /// Largest term that the guideline leaves out.
    criterion: Option<&'static str>,
    size: Option<f64>,
    /// Ratio of this size to the limit.
    ratio: f64,
}

#[derive(Debug, Clone, Serialize)]
struct TermFacts {
    term: &'static str,
    beside: &'static str,
    group: &'static str,
    guideline: &'static str,
    formula: &'static str,
    size: f64,
    /// False if joints prescribe the rotation and the term is inertia of the rotation.
    counts: bool,
}

#[derive(Debug, Clone, Serialize)]
struct ProgramFacts {
    program: &'static str,
    setting: &'static str,
}

impl MotionsFacts {
    fn new(motions: &SampledMotions, is_rotation_given: bool) -> Self {
        // A given rotation has no error, and the reaction that gives it is not asked for.
        let judged = |errors: OutputErrors| OutputErrors {
            attitude: errors.attitude.filter(|_| !is_rotation_given),
            reaction: None,
            ..errors
        };
        let set = |set: &SampledSet| SetFacts {
            groups: names(set.groups),
            errors: set.errors.map(judged).unwrap_or_default(),
            worst: set.errors.map(|_| set.worst),
            motion: set.motion + 1,
            holds: set.holds(),
            remark: set.remark.clone(),
        };
        Self {
            count: motions.count,
            duration: motions.duration,
            sets: motions.sets.iter().map(set).collect(),
        }
    }

    fn in_words(&self, units: &UnitFacts) -> String {
        format!("in {} motions of {}", self.count, units.time_of(self.duration, 3))
    }

    /// Returns the reason for the groups: the errors of the set that holds, or those of leaving out anything.
    fn reason(&self, groups: &[&'static str], limit: f64) -> String {
        match self.sets.last() {
            None => "the body has no terms that could be left out".to_owned(),
            Some(set) if set.holds => {
                format!(
                    "the errors are then at most {} (limit {})",
                    errors_in_words(&set.errors),
                    percent(limit)
                )
            }
            Some(_) => {
                let least = self.sets.iter().filter_map(|set| set.worst).fold(f64::INFINITY, f64::min);
                format!(
                    "leaving out any of {} makes an error of at least {}",
                    groups_in_words(groups),
                    percent(least * limit)
                )
            }
        }
    }

    fn table(&self) -> Table {
        let row = |set: &SetFacts| {
            let error = |name: &str, error: Option<f64>| match error {
                Some(error) => error_in_words(name, error, 3),
                None if set.remark.is_empty() => "\u{2013}".to_owned(),
                None => set.remark.clone(),
            };
            cells([
                groups_in_words(&set.groups),
                error("attitude", set.errors.attitude),
                error("deflection", set.errors.deflection),
                error("stress", set.errors.stress),
                set.motion.to_string(),
                if set.holds { "yes" } else { "no" }.to_owned(),
            ])
        };
        let heads = ["Terms", "Attitude", "Deflection", "Stress", "Worst motion", "Within the limit"];
        let rows = self.sets.iter().map(row).collect();
        Table::new("Largest errors beside the whole body, with these terms alone", heads, &[0], rows)
            .in_text(|_| true)
    }
}

impl<'a> AdviceFacts<'a> {
    /// Collects the facts of an advice for `body`. `path` is the file of the body as the command line named it.
    pub fn new(advice: &'a Advice, body: &'a FlexBody, path: &str, run: &'a RunData) -> Self {
        let terms = &advice.terms;
        let guideline = |one: &GuidelineAdvice| {
            let largest = one.largest_left_out.map(|at| &terms[at]);
            GuidelineFacts {
                name: one.name,
                keeps: one.keeps,
                qualifies: one.qualifies(),
                criterion: largest.map(|term| term.significance.term),
                size: largest.map(|term| term.size),
                ratio: one.ratio,
            }
        };
        let term = |one: &AdvisedTerm| TermFacts {
            term: one.significance.term,
            beside: one.significance.beside,
            group: one.significance.group.name(),
            guideline: one.significance.guideline,
            formula: one.significance.formula,
            size: one.size,
            counts: one.counts,
        };
        Self {
            format: "flexbody-advice",
            format_major: 1,
            format_minor: 1,
            generator: generator(),
            body: &body.description().name,
            units: UnitFacts::new(body.units()),
            first_frequency_hz: advice.first_frequency_hz,
            spin_hz: advice.ranges.spin_hz,
            speed_ratio: advice.speed_ratio,
            deflection: advice.deflection,
            deflection_ratio: advice.deflection / body.extent(),
            attached_mass: advice.ranges.attached.as_ref().map(|attached| attached.mass),
            rotation: if advice.ranges.is_rotation_given { "given" } else { "free" },
            limit: advice.ranges.limit,
            guideline: advice.guideline().name,
            groups: names(advice.groups()),
            groups_by_size: names(advice.groups_by_size),
            motions: advice
                .motions
                .as_ref()
                .ok()
                .map(|motions| MotionsFacts::new(motions, advice.ranges.is_rotation_given)),
            not_sampled: advice.motions.as_ref().err().map(String::as_str),
            command: advised(path, advice.groups()),
            guidelines: advice.guidelines.iter().map(guideline).collect(),
            terms: terms.iter().map(term).collect(),
            programs: programs(advice.groups()),
            diagnostics: &run.diagnostics,
        }
    }

    /// Renders the facts in a format, ending with a line break.
    pub fn render(&self, format: Format) -> String {
        Document::render(self, format, || self.document())
    }

    fn document(&self) -> Document<'_> {
        let verdict = self.verdict();
        let kept = self.kept();
        let mut terms = vec![Term::text("Advice", format!("{kept}: {verdict}"))];
        terms.extend(self.asked());
        terms.push(Term::new("Guideline", self.guideline_in_words()));
        terms.push(Term::new("Command", self.command.as_str()));
        let mut blocks = vec![
            Block::Verdict {
                state: State::Given,
                head: format!("{}.", sentence(&kept)),
                rest: sentence(&verdict),
            },
            Block::Terms(terms),
        ];
        if let Some(motions) = &self.motions {
            let table = motions.table();
            blocks.extend([Block::Gap, heading("Sampled motions"), Block::Table(table)]);
        }
        blocks.extend([
            Block::Gap,
            heading("Guidelines"),
            Block::Table(self.guideline_table()),
            Block::Gap,
            heading("Sizes of the terms"),
            Block::Table(self.term_table()),
            Block::Gap,
            heading("Settings of other programs"),
            Block::Table(self.program_table()),
        ]);
        blocks.push(Block::Diagnostics(self.diagnostics));
        Document { name: self.body, kind: "Advice", generator: &self.generator, blocks }
    }

    fn kept(&self) -> String {
        if self.groups.is_empty() {
            "the inertia of the undeformed body is enough".to_owned()
        } else {
            format!("keep the terms of {}", groups_in_words(&self.groups))
        }
    }

    fn verdict(&self) -> String {
        match &self.motions {
            Some(motions) => format!(
                "{}, sampled in these ranges, {}",
                motions.in_words(&self.units),
                motions.reason(&self.groups, self.limit)
            ),
            None => format!(
                "by the sizes of the terms alone, which are no errors: every term left out is below {} of what it is compared with ({})",
                percent(self.limit),
                self.not_sampled.unwrap_or_default()
            ),
        }
    }

    fn guideline_in_words(&self) -> String {
        let leaves_out =
            self.guidelines.iter().any(|own| own.name == self.guideline && own.criterion.is_some());
        if !leaves_out {
            return format!("{}: it leaves out nothing", self.guideline);
        }
        format!(
            "{}: every term that it leaves out has a size below {} of what it is compared with; a size is no error",
            self.guideline,
            percent(self.limit)
        )
    }

    fn asked(&self) -> Vec<Term> {
        let spin = format!(
            "{} ({} of the first frequency{}, {})",
            frequency(self.spin_hz, 4),
            percent(self.speed_ratio),
            if self.attached_mass.is_some() { " with the attached mass" } else { "" },
            frequency(self.first_frequency_hz, 4)
        );
        let deflection = format!(
            "{} ({} of the largest extent)",
            self.units.length_of(self.deflection, 3),
            percent(self.deflection_ratio)
        );
        let rotation = match self.rotation {
            "given" => "prescribed by joints: the inertia of the rotation does not matter",
            _ => "free",
        };
        let mut terms = vec![
            Term::new("Rotation rate", spin).short("Spin"),
            Term::new("Deflection", deflection),
            Term::new("Rotation", rotation),
        ];
        terms.extend(
            self.attached_mass
                .map(|mass| Term::new("Attached mass", self.units.mass_of(mass, 4)).short("Attached")),
        );
        terms
    }

    fn guideline_table(&self) -> Table {
        let row = |one: &GuidelineFacts| {
            let number = |value: f64| significant(value, 3);
            cells([
                one.name.to_owned(),
                one.keeps.to_owned(),
                one.criterion.unwrap_or("nothing").to_owned(),
                one.size.map_or_else(|| "\u{2013}".to_owned(), number),
                number(one.ratio),
                if one.qualifies { "yes" } else { "no" }.to_owned(),
            ])
        };
        let heads = ["Guideline", "Keeps", "Largest term left out", "Its size", "Size / limit", "Qualifies"];
        let rows = self.guidelines.iter().map(row).collect();
        Table::new("Guidelines of Witteveen and Pichler (2019), section 8", heads, &[0, 1, 2], rows)
            .in_text(|head| head != "Keeps")
    }

    fn term_table(&self) -> Table {
        let row = |one: &TermFacts| -> Vec<Inline> {
            let size = significant(one.size, 3);
            let size = if one.counts { size } else { format!("{size} (does not act)") };
            cells([
                one.term.to_owned(),
                one.beside.to_owned(),
                one.group.to_owned(),
                one.guideline.to_owned(),
                size,
            ])
        };
        let heads = ["Term", "Compared with", "Group", "Guideline", "Size"];
        let rows = self.terms.iter().map(row).collect();
        Table::new("Relative sizes, with the invariants of the body", heads, &[0, 1, 2, 3], rows)
            .in_text(|head| head != "Compared with")
    }

    fn program_table(&self) -> Table {
        let row = |one: &ProgramFacts| cells([one.program.to_owned(), one.setting.to_owned()]);
        let rows = self.programs.iter().map(row).collect();
        Table::new("Settings that keep these terms", ["Program", "Setting"], &[0, 1], rows).in_text(|_| true)
    }
}

fn names(groups: TermGroups) -> Vec<&'static str> {
    groups.kept().map(TermGroup::name).collect()
}

/// Returns the settings of multibody programs that compute at least these groups. The invariants of Adams are numbered 1
/// to 9: 8 holds W1, 9 holds W2 and 5 holds W3; RecurDyn calls the last two N4 and N6.
fn programs(groups: TermGroups) -> Vec<ProgramFacts> {
    let adams = match (groups.w1, groups.w2, groups.w3) {
        (false, false, false) => "Constant (invariants 1, 2, 6, 7)",
        (true, false, false) => "Partial coupling (without invariants 5 and 9)",
        (_, true, false) => "Custom: all invariants but 5",
        (_, false, true) => "Custom: all invariants but 9",
        (_, true, true) => "Full coupling (all nine invariants)",
    };
    let recurdyn = if groups.w2 || groups.w3 {
        "Mass Invariant: Full"
    } else {
        "Mass Invariant: Partial (without N4 and N6)"
    };
    let rows = [
        ("Adams", adams),
        ("RecurDyn RFlex", recurdyn),
        (
            "Simpack and other readers of SID",
            "none: the exported file of the reduced body holds only these terms",
        ),
        (
            "Exudyn",
            "none: the exported arrays of terms that are left out are zero; the number of modes sets the cost",
        ),
    ];
    rows.map(|(program, setting)| ProgramFacts { program, setting }).to_vec()
}
