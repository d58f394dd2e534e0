//! Parallel loops: each item once, results in the order of the items, the first of several errors.

use flexbody_linalg::parallel;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::sleep;
use std::time::Duration;

/// Runs `test` on pools of one, two and five threads.
fn on_pools(test: impl Fn() + Sync) {
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(&test);
    }
}

#[test]
fn every_index_is_visited_once() {
    on_pools(|| {
        for count in [0, 1, 2, 7, 1000] {
            let visits: Vec<AtomicUsize> = (0..count).map(|_| AtomicUsize::new(0)).collect();
            parallel::indices(count, &|i| {
                visits[i].fetch_add(1, Ordering::Relaxed);
            });
            assert!(visits.iter().all(|visits| visits.load(Ordering::Relaxed) == 1), "{count} indices");
        }
    });
}

#[test]
fn ranges_cover_the_indices() {
    assert_eq!(parallel::ranges(7, 3).collect::<Vec<_>>(), [0..3, 3..6, 6..7]);
    assert_eq!(parallel::ranges(6, 3).collect::<Vec<_>>(), [0..3, 3..6]);
    assert_eq!(parallel::ranges(2, usize::MAX).next(), Some(0..2));
    assert_eq!(parallel::ranges(0, 3).len(), 0);
}

#[test]
fn results_have_the_order_of_the_items() {
    let expected: Vec<String> = (0..301).map(|i| (i * i).to_string()).collect();
    let square = |i: usize| {
        // Later items end first.
        sleep(Duration::from_micros(300 - i as u64));
        (i * i).to_string()
    };
    on_pools(|| {
        assert_eq!(parallel::map(0..301, square), expected);
        assert_eq!(parallel::values(301, 8, square), expected);
        assert_eq!(parallel::concat(301, 8, |range| range.map(square).collect()), expected);
    });
}

#[test]
fn entries_are_changed_in_place() {
    on_pools(|| {
        let mut entries: Vec<usize> = (0..100).collect();
        parallel::for_each_mut(&mut entries, 7, |i, entry| *entry += 1000 * i);
        assert!(entries.iter().enumerate().all(|(i, entry)| *entry == 1001 * i));
        parallel::for_each(entries.chunks_mut(30).enumerate(), |(part, entries)| entries.fill(part));
        assert_eq!([entries[0], entries[29], entries[30], entries[99]], [0, 0, 1, 3]);
    });
}

#[test]
fn the_first_of_several_errors_is_returned() {
    let work = |i: usize| {
        // The first item that fails ends last.
        sleep(Duration::from_micros(if i == 20 { 5000 } else { 50 }));
        if i >= 20 && i.is_multiple_of(10) { Err(i) } else { Ok(2 * i) }
    };
    on_pools(|| {
        assert_eq!(parallel::try_map(0..200, work), Err(20));
        assert_eq!(parallel::try_map(0..20, work), Ok((0..20).map(|i| 2 * i).collect()));
        assert!(!parallel::any(0..20, |i| work(i).is_err()));
        assert!(parallel::any(0..21, |i| work(i).is_err()));
    });
}

#[test]
fn items_after_an_error_are_skipped() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("threads");
    let calls = AtomicUsize::new(0);
    let fail = |i: usize| {
        calls.fetch_add(1, Ordering::Relaxed);
        if i == 0 { Err(()) } else { Ok(()) }
    };
    assert_eq!(pool.install(|| parallel::try_map(0..1000, fail)), Err(()));
    assert_eq!(calls.into_inner(), 1);
}

#[test]
fn working_memory_is_shared_by_tasks_and_not_by_threads() {
    on_pools(|| {
        let created = AtomicUsize::new(0);
        let memory = || {
            created.fetch_add(1, Ordering::Relaxed);
            Vec::new()
        };
        let sums = parallel::values_with_memory(1000, 10, memory, |own: &mut Vec<usize>, i| {
            own.extend(0..i);
            own.drain(..).sum::<usize>()
        });
        assert!(sums.iter().enumerate().all(|(i, sum)| *sum == i * i.saturating_sub(1) / 2));
        assert!((1..=rayon::current_num_threads()).contains(&created.into_inner()));
    });
}

#[test]
fn both_functions_of_a_join_run() {
    on_pools(|| {
        let text = String::from("b");
        assert_eq!(parallel::join(|| 1, || text), (1, String::from("b")));
    });
}

#[test]
fn a_panic_in_a_loop_reaches_its_caller() {
    let result = std::panic::catch_unwind(|| {
        parallel::map(0..10, |i| assert!(i != 7, "seven"));
    });
    assert!(result.is_err());
}
