//! The vector instructions of this machine.

use pulp::Arch;

/// The widest vector instructions that the kernels find here. Sums keep their order whatever they are.
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

/// The widest vector instructions whose vectors are not longer than rows of so many bytes, which the kernels then
/// hold in whole vectors.
pub(super) fn instructions_for_rows(bytes: usize) -> Arch {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(longer) if bytes < 64 => Arch::V3(*longer),
        arch => arch,
    }
}

/// Asks the processor to bring the line at `address` into its cache; any address will do. (Reading ahead
/// instead, in safe code, leaves solves with 4 columns at 0.63 of the speed.)
#[inline(always)]
#[allow(unsafe_code)]
pub(super) fn prefetch<T>(address: *const T) {
    // SAFETY: a hint, of the instructions that every x86-64 has: nothing is read, and an address that nothing
    // may be read from is ignored.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(address.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}
