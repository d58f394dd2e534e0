//! Reproducible random numbers by row and column, independent of the number of threads.

/// Returns a uniform number in (-1, 1): a SplitMix64 hash of (seed, row, column).
pub fn uniform(seed: u64, row: u64, column: u64) -> f64 {
    let mut z = seed
        .wrapping_mul(0xA076_1D64_78BD_642F)
        .wrapping_add(row.wrapping_mul(0x9E37_79B9_7F4A_7C15))
        .wrapping_add(column.wrapping_mul(0xD1B5_4A32_D192_ED03))
        .wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^= z >> 31;
    (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Returns a normal number with mean zero and variance one (Box and Muller, Ann. Math. Stat. 29 (1958) 610).
pub(crate) fn normal(row: u64, column: u64) -> f64 {
    // In (0, 1], since zero has no logarithm.
    let radius = 0.5 * (1.0 - uniform(1, row, column));
    let angle = std::f64::consts::PI * uniform(2, row, column);
    (-2.0 * radius.max(f64::MIN_POSITIVE).ln()).sqrt() * angle.cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_the_moments_of_theirs() {
        let n = 40_000;
        let moment = |power: i32| (0..n).map(|i| normal(i / 7, i % 7).powi(power)).sum::<f64>() / n as f64;
        assert!(moment(1).abs() < 0.02 && (moment(2) - 1.0).abs() < 0.03);
        assert!(moment(3).abs() < 0.06 && (moment(4) - 3.0).abs() < 0.2);
    }
}
