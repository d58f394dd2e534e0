//! Numbers of a sparse matrix: owned, or borrowed from a lender such as a memory-mapped file.

use std::fmt::{Debug, Formatter};
use std::ops::Deref;
use std::panic::{RefUnwindSafe, UnwindSafe};
use std::sync::Arc;

/// Owner of borrowed numbers, which must never change.
pub trait Lender<T>: AsRef<[T]> + Send + Sync + UnwindSafe + RefUnwindSafe {}

impl<T, L: AsRef<[T]> + Send + Sync + UnwindSafe + RefUnwindSafe> Lender<T> for L {}

/// List of numbers. Borrowed numbers are copied before they are changed.
#[derive(Clone)]
pub enum Stored<T: 'static> {
    /// Owned numbers.
    Owned(Vec<T>),
    /// Numbers borrowed from a lender.
    Lent(Arc<dyn Lender<T>>),
}

impl<T: Clone> Stored<T> {
    /// Returns the numbers for writing; copies borrowed ones first.
    pub(super) fn to_mut(&mut self) -> &mut Vec<T> {
        if let Self::Lent(lent) = self {
            *self = Self::Owned((**lent).as_ref().to_vec());
        }
        match self {
            Self::Owned(values) => values,
            Self::Lent(_) => unreachable!("a copy was taken"),
        }
    }
}

impl<T> Deref for Stored<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match self {
            Self::Owned(values) => values,
            Self::Lent(lent) => (**lent).as_ref(),
        }
    }
}

impl<T> From<Vec<T>> for Stored<T> {
    fn from(values: Vec<T>) -> Self {
        Self::Owned(values)
    }
}

impl<T: PartialEq> PartialEq for Stored<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Debug> Debug for Stored<T> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        (**self).fmt(f)
    }
}
