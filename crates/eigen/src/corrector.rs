//! What makes corrections of approximate modes out of the forces that these leave unbalanced.

use super::counters::Counters;
use super::search_space::SearchSpace;
use flexbody_linalg::multigrid::{Aim, Levels};
use flexbody_linalg::{Solve, Tall};

/// Part of the error of a correction that may be left, beside the residual of the pair: a correction is right to
/// about the square of that, and the residual is mostly roughness that a step removes. (Measured with these two
/// numbers on a bar and a cube of 100,000 rows, 16 to 24 modes: steps of cycles vary by a twentieth.)
const LEFT_OF_RESIDUAL: f64 = 0.2;

/// The least part, since what the span lacks limits what a correction gains.
const LEAST_LEFT: f64 = 0.007;

/// Part of the residual that a last correction aims at.
const BELOW_ALLOWED: f64 = 0.3;

/// Pairs that cycles correct, filled up to a multiple: with those above the wanted ones the last of these converge
/// sooner. The few that are poor at the end take fewer steps than those that would fill them up.
const FILLED: usize = 8;

/// Vectors that a span which levels correct has room for, with so many at first.
pub(super) fn room_with_levels(base: usize) -> usize {
    2 * base + FILLED
}

#[derive(Clone, Copy)]
pub(super) enum Corrector<'a> {
    /// A factor of K + tau M that is not exact: T r.
    Factor(&'a dyn Solve),
    /// Cycles over levels, for the correction equation of each mode.
    Levels(&'a dyn Levels),
}

/// A Ritz pair that is looked at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    /// Its number, from the lowest.
    pub number: usize,
    /// Its relative residual, and what that may be.
    pub residual: f64,
    pub allowed: f64,
}

impl Corrector<'_> {
    /// The shift tau.
    pub(super) fn shift(self) -> f64 {
        match self {
            Self::Factor(factor) => factor.shift(),
            Self::Levels(levels) => levels.shift(),
        }
    }

    /// The number of pairs that is corrected where so many are poor.
    pub(super) fn filled(self, poor: usize) -> usize {
        match self {
            Self::Levels(_) if poor >= FILLED => poor.next_multiple_of(FILLED),
            _ => poor,
        }
    }

    /// Times that corrections are made orthogonal to the space. Those of levels nearly are already, and Rayleigh-Ritz
    /// accounts for what is left along it.
    pub(super) fn passes(self) -> usize {
        match self {
            Self::Factor(_) => 2,
            Self::Levels(_) => 1,
        }
    }

    /// Whether a span of `base` vectors at first, and now so many, is to be contracted. With earlier corrections of a
    /// factor the last modes take half the columns; corrections of levels have used up what these would tell, and
    /// need a basis of Ritz vectors.
    pub(super) fn contracts(self, vectors: usize, base: usize) -> bool {
        match self {
            Self::Factor(_) => vectors > 2 * base,
            Self::Levels(_) => true,
        }
    }

    /// Vectors that a span of `base` vectors at first has room for.
    pub(super) fn room(self, base: usize) -> usize {
        match self {
            Self::Factor(_) => 3 * base + 1,
            Self::Levels(_) => room_with_levels(base),
        }
    }

    /// Replaces the forces, of about unit size, which the pairs of the space leave unbalanced. The space of levels is
    /// one of Ritz vectors.
    pub(super) fn correct(
        self,
        space: &SearchSpace<'_>,
        pairs: &[Pair],
        forces: &mut Tall,
        counters: &mut Counters,
    ) {
        counters.solved_columns += match self {
            Self::Factor(factor) => {
                factor.solve_in_place(forces.as_mut());
                forces.ncols() as u64
            }
            Self::Levels(levels) => {
                let aims: Vec<Aim> = pairs.iter().map(Pair::aim).collect();
                levels.correct(&space.near(), &aims, forces.as_mut())
            }
        };
    }
}

impl Pair {
    fn aim(&self) -> Aim {
        let last = BELOW_ALLOWED * self.allowed / self.residual;
        Aim { pair: self.number, left: (LEFT_OF_RESIDUAL * self.residual).max(last).max(LEAST_LEFT) }
    }
}
