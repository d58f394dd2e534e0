//! CPU and wall time of every stage of work, on a model from disk: `cargo bench --bench stages -- MODEL.toml`
//! (`benches/make_block.py` makes models).

use faer::Mat;
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::{Analysis, Cholesky, CscMatrix, Inertia, Pencil, Real, Solve};
use flexbody_model::FeModel;
use std::time::Instant;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// User and system CPU seconds of this process, or `None` where the system does not tell.
fn cpu_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    Some((fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?) / 100.0)
}

/// A line of /proc/self/status in MB; zero where there is none.
fn status_mb(key: &str) -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with(key));
    let kib = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<f64>().ok());
    kib.unwrap_or(0.0) * 1.024e-3
}

fn measure<T>(what: &str, repeats: u32, mut work: impl FnMut() -> T) -> (T, f64) {
    let (cpu, wall) = (cpu_seconds(), Instant::now());
    for _ in 1..repeats {
        std::hint::black_box(work());
    }
    let result = work();
    let wall = wall.elapsed().as_secs_f64() / f64::from(repeats);
    let cpu =
        cpu.zip(cpu_seconds()).map_or(f64::NAN, |(before, after)| (after - before) / f64::from(repeats));
    let (peak, now) = (status_mb("VmHWM"), status_mb("VmRSS"));
    println!("{what:<14} {cpu:8.4} CPU s {wall:8.4} s   peak {peak:7.0} MB, now {now:7.0} MB");
    (result, wall)
}

fn megabytes(matrix: &CscMatrix) -> f64 {
    12e-6 * matrix.nnz() as f64
}

fn main() {
    let Some(manifest) = std::env::args().skip(1).find(|a| !a.starts_with('-')) else {
        println!("usage: cargo bench --bench stages -- MODEL.toml");
        return;
    };
    let files = read_manifest(std::path::Path::new(&manifest)).unwrap_or_else(|e| panic!("{e}"));
    let bytes: u64 =
        files.paths().iter().map(|path| std::fs::metadata(path).map_or(0, |meta| meta.len())).sum();
    println!("{} threads, files of {:.0} MB", rayon::current_num_threads(), bytes as f64 * 1e-6);
    let (raw, wall) = measure("reading", 1, || read_model(&files).unwrap_or_else(|e| panic!("{e}")));
    let kept = megabytes(&raw.stiffness.matrix) + megabytes(&raw.mass.matrix);
    println!("{:14} {:.0} MB/s; matrices of {kept:.0} MB in memory", "", bytes as f64 * 1e-6 / wall);
    let mut raw = Some(raw);
    let (checked, _) = measure("checks", 1, || {
        FeModel::from_raw(raw.take().expect("checked once")).unwrap_or_else(|e| panic!("{e}"))
    });
    let model = checked.model;
    let pencil = model.pencil();
    for columns in [8, 20] {
        let x = Mat::from_fn(pencil.n(), columns, |i, j| ((i + 7 * j) as f64).sin());
        let passes = f64::from(columns as u32) / 8.0;
        for (name, matrix) in [("K X", pencil.stiffness()), ("M X", pencil.mass())] {
            let product = || {
                if name == "K X" { pencil.apply_stiffness(x.as_ref()) } else { pencil.apply_mass(x.as_ref()) }
            };
            let (_, wall) = measure(&format!("{name}, {columns} col."), 20, product);
            println!(
                "{:14} {:.1} GB/s of matrix per 8 columns",
                "",
                passes * 1e-3 * megabytes(matrix.as_csc()) / wall
            );
        }
    }
    let (analysis, _) = measure("ordering", 1, || Analysis::new(&pencil).expect("enough memory"));
    println!("{:14} {:.3e} numbers, {:.3e} flops", "", analysis.factor_len(), analysis.flops());
    // Any shift will do for timing: small against the largest eigenvalue, large against rounding.
    let trace = |diagonal: Vec<f64>| diagonal.iter().sum::<f64>();
    let tau = 1e-5 * trace(pencil.stiffness().diagonal()) / (3.0 * trace(pencil.mass().diagonal()));
    let rate = |wall: f64| println!("{:14} {:.1} GF/s", "", 1e-9 * analysis.flops() / wall);
    rate(solve_with::<f64>("f64", &analysis, &pencil, tau));
    rate(solve_with::<f32>("f32", &analysis, &pencil, tau));
    rate(measure("inertia", 1, || Inertia::new(&analysis, &pencil, tau)).1);
}

/// Factorisation and solves in one precision; the wall time of the factorisation.
fn solve_with<T: Real>(precision: &str, analysis: &Analysis, pencil: &Pencil<'_>, tau: f64) -> f64 {
    let (factor, wall) = measure(&format!("Cholesky {precision}"), 1, || {
        Cholesky::<T>::new(analysis, pencil, tau).expect("positive definite")
    });
    for columns in [4, 8] {
        let mut x = Mat::from_fn(pencil.n(), columns, |i, j| ((i + 7 * j) as f64).sin());
        let (_, wall) = measure(&format!("solve {columns}"), 10, || factor.solve_in_place(x.as_mut()));
        let bytes = 2.0 * (analysis.factor_len() * size_of::<T>()) as f64;
        println!("{:14} {:.1} GB/s of factor", "", 1e-9 * bytes / wall);
    }
    wall
}
