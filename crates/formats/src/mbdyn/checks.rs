//! Checks of the record groups.

use super::read::{COUPLING, Read, by_columns, from_masses, missing};
use super::records::{Records, Surplus};
use crate::import::AuditCheck;
use crate::import::redundant::{ROUNDING, Redundant, asymmetry, in_other_order, relative};
use flexbody_base::diagnostic::Code;
use flexbody_linalg::larger;

/// Largest relative rounding of a number that is not reported as lost digits. A larger value accepts files
/// with fewer digits.
const MAX_DIGIT_ROUNDING: f64 = 1e-8;

/// Number of last-digit roundings that an identity may accumulate. A smaller value reports rounding as
/// contradictions.
const TERMS: f64 = 10.0;

pub(crate) fn checks(records: &Records, read: &Read) -> Vec<AuditCheck> {
    let mut all = vec![digits(records), surplus(records)];
    all.extend(masses(records, read));
    if missing(records).is_empty() {
        all.extend(identities(records, read));
    } else if !from_masses(records) {
        all.push(coupling(records));
    }
    if let Some(damping) = &read.body.modal_damping {
        all.push(AuditCheck {
            name: "damping_symmetric",
            formula: "record group 13 = its transpose",
            value: asymmetry(damping),
            limit: ROUNDING + TERMS * records.rounding(),
            code: Code::AuditIdentity,
            meaning: "the damping of mode j by mode k differs from that of mode k by mode j".to_owned(),
        });
    }
    all
}

fn digits(records: &Records) -> AuditCheck {
    AuditCheck {
        name: "digits",
        formula: "half a unit of the last digit of numbers of size one",
        value: records.rounding(),
        limit: MAX_DIGIT_ROUNDING,
        code: Code::AuditDigits,
        meaning: format!("numbers are written with {}", records.digits.words()),
    }
}

/// Checks for text that MBDyn silently skips. A matrix of another size than the header states is then read
/// wrongly.
fn surplus(records: &Records) -> AuditCheck {
    let in_words = |(group, surplus): &(Option<usize>, Surplus)| {
        let zeros = if surplus.zero { ", all zero" } else { "" };
        let place =
            group.map_or("before record group 1".to_owned(), |group| format!("after record group {group}"));
        format!("{} words{zeros}, in line {} {place}", surplus.words, surplus.line)
    };
    let all: Vec<String> = records.skipped.iter().map(in_words).collect();
    AuditCheck {
        name: "no_more_than_the_header_says",
        formula: "number of words beyond the counts of the header",
        value: records.skipped.iter().map(|(_, surplus)| surplus.words as f64).sum(),
        limit: 0.0,
        code: Code::AuditSurplus,
        meaning: format!(
            "the file has more words than its header states, and MBDyn skips them without a message: {}",
            if all.is_empty() { "nothing".to_owned() } else { all.join("; ") }
        ),
    }
}

fn coupling(records: &Records) -> AuditCheck {
    let missing = missing(records);
    AuditCheck {
        name: "coupling_there",
        formula: "record groups 14 to 18, share that is missing",
        value: missing.len() as f64 / COUPLING.len() as f64,
        limit: 0.0,
        code: Code::AuditCoupling,
        meaning: format!(
            "record groups {} and lumped masses are missing: the motion of the body does not excite the modes, nor the modes the body",
            missing.join(", ")
        ),
    }
}

/// Checks lumped masses: no other coupling group is present, all are positive, and the modes belong to them.
fn masses(records: &Records, read: &Read) -> Vec<AuditCheck> {
    let Some(lumped) = &read.lumped else { return Vec::new() };
    let n = records.n_nodes;
    let nf = records.n_modes;
    let beside = !from_masses(records);
    let twice = AuditCheck {
        name: "lumped_masses_alone",
        formula: "no record group 11 beside 14 to 18",
        value: f64::from(u8::from(beside)),
        limit: 0.0,
        code: Code::AuditIdentity,
        meaning:
            "the file has both lumped masses and invariants: MBDyn adds the sums over the masses to the invariants of the file, which then count twice"
                .to_owned(),
    };
    let negative = AuditCheck {
        name: "lumped_masses_positive",
        formula: "share of negative lumped masses",
        value: lumped.negative_share,
        limit: 0.0,
        code: Code::AuditLumped,
        meaning: format!("{} of {n} lumped masses are negative", lumped.negative),
    };
    // Differences between the sums over the masses and groups 9 and 12.
    let (own, sums) = (&read.body.inertia.i6, &lumped.numbered.i6);
    let size = |j: usize, k: usize| (own[(j, j)] * own[(k, k)]).abs().sqrt();
    let modal = (0..nf)
        .flat_map(|j| (0..nf).map(move |k| (j, k)))
        .map(|(j, k)| relative((own[(j, k)] - sums[(j, k)]).abs(), size(j, k)))
        .fold(0.0, larger);
    let total = relative((read.body.inertia.i1 - lumped.numbered.i1).abs(), read.body.inertia.i1.abs());
    let tensor =
        relative((read.body.inertia.i7 - lumped.numbered.i7).abs().max(), read.body.inertia.i7.abs().max());
    let consistent = AuditCheck {
        name: "lumped_masses_carry_modes",
        formula: "record groups 9 and 12 = sums over the masses of record group 11",
        value: larger(modal, larger(total, tensor)),
        limit: ROUNDING + TERMS * records.rounding(),
        code: Code::AuditLumped,
        meaning: format!(
            "the coupling of rigid motion and modes comes from {n} lumped masses, but the modes come from another mass matrix: modal mass differs by {modal:.1e}, mass by {total:.1e}, inertia by {tensor:.1e}"
        ),
    };
    vec![twice, negative, consistent]
}

/// Checks the redundant information of groups 9 and 14 to 18.
fn identities(records: &Records, read: &Read) -> Vec<AuditCheck> {
    let redundant = Redundant::new(&read.body.inertia);
    let limit = ROUNDING + TERMS * records.rounding();
    let identity = |name, formula, value, meaning: &str| AuditCheck {
        name,
        formula,
        value,
        limit,
        code: Code::AuditIdentity,
        meaning: meaning.to_owned(),
    };
    // Identities between invariants that follow from each other.
    let mut all = vec![
        identity(
            "i4_of_i8",
            "invariant 4 = skew part of invariant 8",
            redundant.i4_of_i8(),
            "groups 15 and 16 state different couplings of modes and rotation: they refer to different points, or group 16 is transposed",
        ),
        identity(
            "i5_antisymmetric",
            "invariant 5_jk = -invariant 5_kj",
            redundant.i5_antisymmetric(),
            "a mode has moment of momentum with itself",
        ),
        identity(
            "i9_symmetric",
            "invariant 9_jk = transpose of invariant 9_kj",
            redundant.i9_symmetric(),
            "the inertia of a pair of modes differs between (j, k) and (k, j)",
        ),
        identity(
            "i5_of_i9",
            "invariant 5_jk = skew part of invariant 9_jk",
            redundant.i5_of_i9(),
            "groups 17 and 18 state different couplings of pairs of modes to rotation: group 18 is transposed, or one of them has the opposite sign",
        ),
    ];
    if !records.general && read.body.inertia.i9.is_some() {
        let mut lumped = redundant.lumped(
            "modal_mass_of_i9",
            "modal mass = half the trace of -invariant 9_jk",
            "record group 18",
        );
        lumped.limit = limit;
        all.push(lumped);
    }
    find_column_order(records, read, &mut all);
    all
}

/// Distinguishes groups stored column by column from wrong groups: their identities hold in that order.
fn find_column_order(records: &Records, read: &Read, checks: &mut [AuditCheck]) {
    let columns = by_columns(records, &read.body.inertia);
    let redundant = Redundant::new(&columns);
    let seen_by = [
        ("i4_of_i8", redundant.i4_of_i8()),
        ("i5_antisymmetric", redundant.i5_antisymmetric()),
        ("i9_symmetric", redundant.i9_symmetric()),
        ("i5_of_i9", redundant.i5_of_i9()),
        ("modal_mass_of_i9", redundant.i6_of_i9()),
    ];
    let meaning = "groups 14 to 18 are stored column by column, as the manual describes them; MBDyn reads them row by row";
    in_other_order(checks, &seen_by, meaning);
}
