//! Parallel loops whose work stealing is compiled once.
//!
//! Every chain of rayon's iterators is compiled again for its closure. [`indices`] receives the closure by reference to
//! `dyn Fn` instead, and all other loops hand it pieces. The order of results is that of the items at any number of
//! threads.

use pulp::Arch;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Calls `work` with each index below `count`, in parallel and in any order.
///
/// Each call costs a few nanoseconds: an index should stand for a piece of work, not for a number.
pub fn indices(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(work);
}

/// Returns the indices below `count` in ranges of `length`; the last one may be shorter.
///
/// # Panics
/// If `length` is zero.
pub fn ranges(count: usize, length: usize) -> impl ExactSizeIterator<Item = Range<usize>> {
    (0..count).step_by(length).map(move |first| first..count.min(first.saturating_add(length)))
}

/// Calls `work` with each item, in parallel and in any order.
pub fn for_each<I: Send>(items: impl IntoIterator<Item = I>, work: impl Fn(I) + Sync) {
    let items: Vec<Slot<I>> = items.into_iter().map(Slot::full).collect();
    indices(items.len(), &|i| items[i].take().into_iter().for_each(&work));
}

/// Calls `work` with index and entry of each entry of `entries`. A parallel task has `length` entries.
///
/// # Panics
/// If `length` is zero.
pub fn for_each_mut<T: Send>(entries: &mut [T], length: usize, work: impl Fn(usize, &mut T) + Sync) {
    for_each(entries.chunks_mut(length).enumerate(), |(task, part)| {
        part.iter_mut().enumerate().for_each(|(i, entry)| work(task * length + i, entry));
    });
}

/// Returns the results of `work` for each item, in the order of the items.
pub fn map<I: Send, T: Send>(items: impl IntoIterator<Item = I>, work: impl Fn(I) -> T + Sync) -> Vec<T> {
    let items: Vec<Slot<I>> = items.into_iter().map(Slot::full).collect();
    let results: Vec<Slot<T>> = items.iter().map(|_| Slot::empty()).collect();
    indices(items.len(), &|i| items[i].take().into_iter().for_each(|item| results[i].put(work(item))));
    results.into_iter().map(|result| result.into_inner().expect("every item has a result")).collect()
}

/// Returns the results of `work` for each item, in the order of the items. Items after one that fails may be skipped.
///
/// # Errors
/// The error of the first item that fails.
pub fn try_map<I: Send, T: Send, E: Send>(
    items: impl IntoIterator<Item = I>,
    work: impl Fn(I) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let first_failed = AtomicUsize::new(usize::MAX);
    let results = map(items.into_iter().enumerate(), |(i, item)| {
        // Items before the first known failure always run: one of them may fail, too.
        (i <= first_failed.load(Ordering::Relaxed)).then(|| {
            work(item).inspect_err(|_| {
                first_failed.fetch_min(i, Ordering::Relaxed);
            })
        })
    });
    results.into_iter().flatten().collect()
}

/// Returns true if an item passes the test. Items after it may be skipped.
pub fn any<I: Send>(items: impl IntoIterator<Item = I>, test: impl Fn(I) -> bool + Sync) -> bool {
    try_map(items, |item| if test(item) { Err(()) } else { Ok(()) }).is_err()
}

/// Returns the values at the indices below `count`, written where they stay. A parallel task has at least `length` of
/// them.
///
/// This loop is compiled for each type of values. [`concat()`] is smaller, but copies the values once more.
pub fn values<T: Send>(count: usize, length: usize, value: impl Fn(usize) -> T + Sync) -> Vec<T> {
    values_of(count, length, &value)
}

fn values_of<T: Send>(count: usize, length: usize, value: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    (0..count).into_par_iter().with_min_len(length).map(value).collect()
}

/// Returns the results of `work` for the indices below `count` in ranges of `length`, joined in order.
///
/// # Panics
/// If `length` is zero.
pub fn concat<T: Send>(count: usize, length: usize, work: impl Fn(Range<usize>) -> Vec<T> + Sync) -> Vec<T> {
    let parts = map(ranges(count, length), work);
    let mut all = Vec::with_capacity(parts.iter().map(Vec::len).sum());
    parts.into_iter().for_each(|part| all.extend(part));
    all
}

/// Returns the results of `work` for each index below `count`. A parallel task has `length` indices, and working memory
/// that `memory` creates and that tasks after it use again.
///
/// # Panics
/// If `length` is zero.
pub fn values_with_memory<M: Send, T: Send>(
    count: usize,
    length: usize,
    memory: impl Fn() -> M + Sync,
    work: impl Fn(&mut M, usize) -> T + Sync,
) -> Vec<T> {
    let free: Mutex<Vec<M>> = Mutex::new(Vec::new());
    concat(count, length, |range| {
        let last = free.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut own = last.unwrap_or_else(&memory);
        let part = range.map(|i| work(&mut own, i)).collect();
        free.lock().unwrap_or_else(PoisonError::into_inner).push(own);
        part
    })
}

/// Runs two functions, in parallel if a thread is idle, and returns their results.
pub fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    let ((mut a, mut b), (mut of_a, mut of_b)) = ((Some(a), Some(b)), (None, None));
    both(&mut || of_a = a.take().map(|a| a()), &mut || of_b = b.take().map(|b| b()));
    (of_a.expect("the first function has run"), of_b.expect("the second function has run"))
}

fn both(a: &mut (dyn FnMut() + Send), b: &mut (dyn FnMut() + Send)) {
    rayon::join(a, b);
}

/// Place of an item that one thread stores and one thread takes.
struct Slot<T>(Mutex<Option<T>>);

impl<T> Slot<T> {
    fn full(item: T) -> Self {
        Self(Mutex::new(Some(item)))
    }

    fn empty() -> Self {
        Self(Mutex::new(None))
    }

    fn put(&self, item: T) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(item);
    }

    fn take(&self) -> Option<T> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn into_inner(self) -> Option<T> {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

// Vector instructions of this machine.

/// Returns the name of the widest vector instructions that the kernels use. Sparse sums have one order on all of them;
/// dense products of `faer` have an order for each, so that last bits of results depend on them.
pub fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        let fused = std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma");
        if fused && std::is_x86_feature_detected!("avx512f") {
            return "AVX-512, AVX2, FMA";
        }
        if fused {
            return "AVX2, FMA";
        }
    }
    "of the build alone"
}

/// Returns the widest instruction set whose vectors are at most `bytes` long, so that the kernels hold rows of that
/// size in whole vectors.
pub(super) fn instructions_for_rows(bytes: usize) -> Arch {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(longer) if bytes < 64 => Arch::V3(*longer),
        arch => arch,
    }
}

/// Prefetches the cache line at `address`, which may be any address. Reading ahead in safe code instead leaves solves
/// with 4 columns at 0.63 of the speed.
#[inline(always)]
#[allow(unsafe_code)]
pub(super) fn prefetch<T>(address: *const T) {
    // SAFETY: a prefetch hint, which every x86-64 has, reads no data; invalid addresses are ignored.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(address.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}
