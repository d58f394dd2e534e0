//! Vector instructions of this machine.

use pulp::Arch;

/// Returns the name of the widest vector instructions that the kernels use. The order of sums does not depend on them.
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
