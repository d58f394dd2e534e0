//! Random choices.

use nalgebra::Vector3;
use oracle::random::Random;

/// Returns a stream of random numbers for a seed and a purpose; streams of different purposes are
/// independent.
pub fn stream(seed: u64, purpose: u64) -> Random {
    let mut random =
        Random(seed.wrapping_mul(0x5851_f42d_4c95_7f2d) ^ purpose.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    random.next_u64();
    random
}

/// Returns a random number between two limits.
pub fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * 0.5 * (random.signed() + 1.0)
}

/// Returns a random index below `count`.
pub fn pick(random: &mut Random, count: usize) -> usize {
    (random.next_u64() % count as u64) as usize
}

/// Returns true once in `of` draws on average.
pub fn one_in(random: &mut Random, of: usize) -> bool {
    pick(random, of) == 0
}

/// Returns a unit vector; for a plane body in its plane.
pub fn direction(random: &mut Random, dimension: usize) -> Vector3<f64> {
    let [x, y, z] = random.vector::<3>();
    Vector3::new(x, y, if dimension == 2 { 0.0 } else { z }).normalize()
}

/// Returns a unit axis of rotation; for a plane body z or its opposite.
pub fn axis(random: &mut Random, dimension: usize) -> Vector3<f64> {
    match dimension {
        2 => Vector3::z() * random.signed().signum(),
        _ => direction(random, 3),
    }
}
