//! Advice on the terms of the equations of motion for ranges of spin, deflection and attached mass, without a scene: the
//! errors of motions sampled from these ranges, and the guidelines of \[WP19\] section 8.

mod ranges;
mod sampled;

pub use crate::attached_mass::AttachedMass;
use crate::attached_mass::Carried;
use crate::selection::{Significance, Situation, significances};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::significant;
use flexbody_body::flex_body::{FlexBody, TermGroup, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_linalg::ties::first_largest;
use flexbody_motion::scene::{Attachment, AttachmentKind, Limits, MotionRange, Range, Requirements, Scene};
use nalgebra::Matrix3;
pub use ranges::Ranges;
pub use sampled::{NotSampled, SampledMotions, SampledSet};
use std::f64::consts::TAU;

/// Largest deflection, relative to the extent of the body, that is assumed if none is stated and no motion was sampled. It is
/// the value of the tables of \[WP19\].
const ASSUMED_DEFLECTION: f64 = 0.01;

/// Size of one term beside the term that it is compared with.
#[derive(Debug, Clone, PartialEq)]
pub struct AdvisedTerm {
    /// The term, and its bounds.
    pub significance: Significance,
    /// Size that decides: from the norms of the invariants where they bound the term, else from I0 and the frequencies.
    pub size: f64,
    /// True if the term acts in this motion: inertia of the rotation does not where the rotation is given.
    pub counts: bool,
}

/// A guideline of \[WP19\] section 8.
#[derive(Debug, Clone, PartialEq)]
pub struct GuidelineAdvice {
    /// Name: `I`, `II`, `III`, `III, free` or `IV`.
    pub name: &'static str,
    /// Terms that the guideline keeps, in words.
    pub keeps: &'static str,
    /// Index of the largest term that the guideline leaves out, among those that count; `None` if it leaves out none.
    pub largest_left_out: Option<usize>,
    /// Ratio of this term to the limit; zero if the guideline leaves out none.
    pub ratio: f64,
}

impl GuidelineAdvice {
    /// Returns true if the guideline leaves out nothing above the limit.
    pub fn qualifies(&self) -> bool {
        self.ratio <= 1.0
    }
}

/// Advice on the terms of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    /// Ranges that were asked for.
    pub ranges: Ranges,
    /// Largest deflection, in the unit of length of the body.
    pub deflection: f64,
    /// First frequency, with the attached mass. Unit: Hz.
    pub first_frequency_hz: f64,
    /// Ratio of the rotation rate to the first frequency.
    pub speed_ratio: f64,
    /// All terms.
    pub terms: Vec<AdvisedTerm>,
    /// The guidelines, from the fewest terms to all.
    pub guidelines: Vec<GuidelineAdvice>,
    /// Errors of motions within the ranges, or the reason why there are none.
    pub motions: std::result::Result<SampledMotions, NotSampled>,
    /// Groups of the kinetic energy with a term whose size is above the limit.
    pub groups_by_size: TermGroups,
    /// Largest part of the stiffness of a motion that the stress of the spin changes, by the estimate of the stiffness that
    /// the body does not have; zero if nothing is missing.
    pub missing_stress: f64,
}

impl Advice {
    /// Returns a warning if the missing stress stiffness changes more of a stiffness than the limit.
    pub fn warning(&self) -> Option<Diagnostic> {
        (self.missing_stress > self.ranges.limit).then(|| {
            let message = format!(
                "the body has no geometric stiffness of spin: a spin of {} Hz changes up to {} % of the stiffness of a motion by its stress (estimate), and the sizes of the terms leave that out",
                significant(self.ranges.spin_hz, 4),
                significant(100.0 * self.missing_stress, 2)
            );
            Diagnostic::new(Code::SpinSoftens, message)
        })
    }

    /// Returns the groups that a body needs: those of the sampled motions, without them those with a size above the limit.
    pub fn groups(&self) -> TermGroups {
        self.motions.as_ref().map_or(self.groups_by_size, |motions| motions.groups)
    }

    /// Returns the first guideline that qualifies. The last one always does.
    pub fn guideline(&self) -> &GuidelineAdvice {
        let first = self.guidelines.iter().find(|guideline| guideline.qualifies());
        first.unwrap_or(&self.guidelines[self.guidelines.len() - 1])
    }
}

/// Guidelines with the labels of the terms that each keeps, and these terms in words.
const GUIDELINES: [(&str, &[&str], &str); 5] = [
    ("I", &[], "inertia of the undeformed body I0"),
    ("II", &["II"], "I0 and the constant centrifugal load W1'w w / 2"),
    ("III", &["II", "III"], "II, inertia W1 Q, centrifugal load W2 Q w w and Euler force W3"),
    ("III, free", &["II", "III", FREE], "III, inertia Q'W2 Q and inertia coupling Q'W3"),
    ("IV", &["II", "III", FREE, "IV"], "all terms, with Coriolis forces and torques"),
];

/// Label of the terms that slender free bodies need.
const FREE: &str = "III, free slender bodies";

/// Term of [`Significance`] that is a torque on the rotation, beside those that stand beside I0.
const CORIOLIS_TORQUE: &str = "Coriolis torque";

/// Returns the advice for a body in mean axes.
///
/// Motions within the ranges are simulated with all terms and with fewer. The sizes of the terms are those of
/// [`significances`] at the largest spin w, the angular acceleration w^2, and modal amplitudes that move a node by the largest
/// deflection. An attached mass adds its inertia about the common centre of mass and lowers the first frequency.
///
/// # Errors
/// FB801 for ranges that are negative or not finite, and for an unknown interface; FB225 and others if the body has no
/// mean axes; the errors of [`trace`](flexbody_motion::scene::trace).
pub fn advise(body: &FlexBody, ranges: Ranges, context: &Context<'_>) -> Result<Advice> {
    body.require_mean_axes("advise")?;
    ranges.refuse()?;
    let motions = sampled::sampled(body, &ranges, context)?;
    let of_motions = motions.as_ref().ok().map(|motions| motions.deflection).filter(|largest| *largest > 0.0);
    let deflection = ranges.deflection.or(of_motions).unwrap_or(ASSUMED_DEFLECTION * body.extent());
    let spin = body.units().eigenvalue_of(ranges.spin_hz).sqrt();
    let carried = ranges.attached.as_ref().map(|attached| Carried::new(body, attached)).transpose()?;
    let inertia = carried.as_ref().map_or_else(Matrix3::zeros, Carried::inertia);
    let scene = scene_of(spin, deflection, inertia, carried.as_ref().and_then(Carried::first_rate));
    let situation = Situation::new(body, &scene, &[]);
    // A term counts unless the rotation is given and the term is inertia of the rotation.
    let advised = |significance: Significance| AdvisedTerm {
        size: significance.of_body.unwrap_or(significance.bound),
        counts: !(ranges.is_rotation_given && acts_on_rotation(&significance)),
        significance,
    };
    let terms: Vec<AdvisedTerm> = significances(&situation, body).into_iter().map(advised).collect();
    let guidelines =
        GUIDELINES.map(|(name, labels, keeps)| guideline(name, labels, keeps, &terms, ranges.limit));
    let is_needed = |group: &TermGroup| {
        terms.iter().any(|term| term.counts && term.significance.group == *group && term.size > ranges.limit)
    };
    Ok(Advice {
        deflection,
        first_frequency_hz: situation.first_rate.value / TAU * body.units().hertz(),
        speed_ratio: spin / situation.first_rate.value,
        motions,
        groups_by_size: TermGroup::ALL
            .iter()
            .filter(|group| is_needed(group))
            .fold(TermGroups::NONE, |all, one| all.with(*one)),
        guidelines: guidelines.to_vec(),
        missing_stress: body.largest_missing_part().map_or(0.0, |part| part * spin * spin),
        terms,
        ranges,
    })
}

/// Returns true for the inertia of the rotation and the torques on it.
fn acts_on_rotation(term: &Significance) -> bool {
    term.beside.starts_with("I0") || term.term.starts_with(CORIOLIS_TORQUE)
}

fn guideline(
    name: &'static str,
    labels: &[&str],
    keeps: &'static str,
    terms: &[AdvisedTerm],
    limit: f64,
) -> GuidelineAdvice {
    let left_out = |at: &usize| {
        let term = &terms[*at];
        term.counts && !labels.contains(&term.significance.guideline)
    };
    let largest = first_largest((0..terms.len()).filter(left_out), |at| terms[*at].size);
    GuidelineAdvice {
        name,
        keeps,
        largest_left_out: largest,
        ratio: largest.map_or(0.0, |at| terms[at].size / limit),
    }
}

/// Returns a scene of ranges alone.
fn scene_of(spin: f64, deflection: f64, inertia: Matrix3<f64>, first_rate: Option<f64>) -> Scene {
    let requirements = Requirements {
        motion: MotionRange { angular_velocity: Some(Range::Any(spin)), ..MotionRange::default() },
        attachment: Attachment {
            kind: AttachmentKind::Free,
            inertia,
            first_frequency: first_rate.map(|rate| rate / TAU),
            ..Attachment::default()
        },
        limits: Limits { deflection: Some(deflection), ..Limits::default() },
        ..Requirements::default()
    };
    Scene { requirements, resolved: true, ..Scene::new("ranges", sampled::run(None, 1e-9)) }
}
