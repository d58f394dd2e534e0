//! The numbers of a sparse matrix: its own, or lent by whoever holds them, as a file that is mapped into memory.

use std::fmt::{Debug, Formatter};
use std::ops::Deref;
use std::panic::{RefUnwindSafe, UnwindSafe};
use std::sync::Arc;

/// Who lends numbers. They never change.
pub trait Lender<T>: AsRef<[T]> + Send + Sync + UnwindSafe + RefUnwindSafe {}

impl<T, L: AsRef<[T]> + Send + Sync + UnwindSafe + RefUnwindSafe> Lender<T> for L {}

/// A list of numbers. To change lent ones takes a copy.
#[derive(Clone)]
pub enum Stored<T: 'static> {
    /// In memory of its own.
    Own(Vec<T>),
    /// Where somebody else has them.
    Lent(Arc<dyn Lender<T>>),
}

impl<T: Clone> Stored<T> {
    /// The numbers, to be changed.
    pub(super) fn own(&mut self) -> &mut Vec<T> {
        if let Self::Lent(lent) = self {
            *self = Self::Own((**lent).as_ref().to_vec());
        }
        match self {
            Self::Own(own) => own,
            Self::Lent(_) => unreachable!("a copy was taken"),
        }
    }
}

impl<T> Deref for Stored<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match self {
            Self::Own(own) => own,
            Self::Lent(lent) => (**lent).as_ref(),
        }
    }
}

impl<T> From<Vec<T>> for Stored<T> {
    fn from(own: Vec<T>) -> Self {
        Self::Own(own)
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
