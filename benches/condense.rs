//! CPU time of the condensation at 300k degrees of freedom and 20 modes: `cargo bench --bench condense`.

use faer::Mat;
use flexbody_body::invariants::{BodyFrame, LumpedMasses, choose_frame, condense, condense_lumped};
use oracle::cuboid::Cuboid;
use std::time::Instant;

/// CPU seconds of this process, or `None` where the system does not tell.
fn cpu_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // Fields 14 and 15: ticks of a hundredth of a second, counted after the name in parentheses.
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks: f64 = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    Some(ticks / 100.0)
}

fn measure<T>(what: &str, mut work: impl FnMut() -> T) {
    const REPEATS: u32 = 5;
    work();
    let (cpu, wall) = (cpu_seconds(), Instant::now());
    for _ in 0..REPEATS {
        std::hint::black_box(work());
    }
    let wall = wall.elapsed().as_secs_f64() / f64::from(REPEATS);
    match (cpu, cpu_seconds()) {
        (Some(before), Some(after)) => {
            println!("{what:<28} {:8.3} CPU s {wall:8.3} s", (after - before) / f64::from(REPEATS));
        }
        _ => println!("{what:<28} {wall:8.3} s"),
    }
}

fn main() {
    const MODES: usize = 20;
    let body = Cuboid { cells: [46, 46, 44], low: [0.0; 3], size: [1.0, 1.0, 0.95], density: 7850.0 };
    let (mass, positions) = (body.scalar_mass(), body.positions());
    let n = positions.len();
    println!(
        "{n} nodes, {} entries, {MODES} modes, {} threads",
        mass.as_csc().nnz(),
        rayon::current_num_threads()
    );
    let shapes = Mat::from_fn(3 * n, MODES, |row, p| {
        let x = positions[row / 3];
        ((p + 1) as f64 * x[row % 3] + x[p % 3]).sin()
    });
    let frame = choose_frame(&mass, &positions, BodyFrame::Principal).expect("a cuboid has a frame").0;
    let body_positions = frame.to_body(&positions);
    let stiffness = || Mat::zeros(MODES, MODES);
    measure("choose_frame", || choose_frame(&mass, &positions, BodyFrame::Principal));
    measure("condense", || condense(&mass, &body_positions, shapes.as_ref(), stiffness()));
    let lumped = LumpedMasses::row_sum(&mass);
    measure("condense_lumped", || condense_lumped(&lumped, &body_positions, shapes.as_ref(), stiffness()));
}
