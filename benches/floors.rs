//! What this machine can do, as one JSON object: `cargo bench --bench floors`.
//!
//! `gemm_f64`, `gemm_f32`: GF/s of faer's matrix product, the rate that no factorisation exceeds; `read`:
//! GB/s of a sum over memory far beyond every cache, the rate that solves and products with sparse matrices
//! cannot exceed. Each on one thread and on two; best of several, since interruptions only ever slow a run
//! down.

use faer::linalg::matmul::matmul;
use faer::traits::ComplexField;
use faer::{Accum, Mat, Par};
use rayon::prelude::*;
use std::time::Instant;

const REPEATS: usize = 5;

fn best_seconds(mut work: impl FnMut()) -> f64 {
    (0..REPEATS)
        .map(|_| {
            let began = Instant::now();
            work();
            began.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

fn product_rate<T: ComplexField>(threads: usize, entry: impl Fn(usize, usize) -> T) -> f64 {
    const SIZE: usize = 3000;
    let [a, b] = [0, 1].map(|shift| Mat::from_fn(SIZE, SIZE, |i, j| entry(i + shift, j)));
    // Every thread has columns of its own, as the fronts of the factorisation do.
    let width = SIZE / threads;
    let mut parts = vec![Mat::<T>::zeros(SIZE, width); threads];
    let seconds = best_seconds(|| {
        parts.par_iter_mut().enumerate().for_each(|(thread, c)| {
            let b = b.as_ref().subcols(thread * width, width);
            matmul(c.as_mut(), Accum::Replace, a.as_ref(), b, T::one_impl(), Par::Seq);
        });
    });
    std::hint::black_box(&parts);
    2.0 * (SIZE as f64).powi(3) / seconds / 1e9
}

/// Sixteen sums side by side: one alone would wait for its own additions, not for memory.
fn sum(part: &[f64]) -> f64 {
    let mut sums = [0.0; 16];
    for lane in part.chunks_exact(sums.len()) {
        sums.iter_mut().zip(lane).for_each(|(sum, x)| *sum += x);
    }
    sums.iter().sum()
}

fn read_rate(threads: usize, memory: &[f64]) -> f64 {
    let seconds = best_seconds(|| {
        let total: f64 = memory.par_chunks(memory.len() / threads).map(sum).sum();
        std::hint::black_box(total);
    });
    size_of_val(memory) as f64 / seconds / 1e9
}

fn main() {
    let memory = vec![1.0; 1 << 27];
    let rates = |rate: &(dyn Fn(usize) -> f64 + Sync)| {
        [1, 2].map(|threads| {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
            pool.install(|| rate(threads))
        })
    };
    let wave = |i: usize, j: usize| ((3 * i + 7 * j) as f64).sin();
    let found = serde_json::json!({
        "gemm_f64": rates(&|threads| product_rate::<f64>(threads, wave)),
        "gemm_f32": rates(&|threads| product_rate::<f32>(threads, |i, j| wave(i, j) as f32)),
        "read": rates(&|threads| read_rate(threads, &memory)),
    });
    println!("{found}");
}
