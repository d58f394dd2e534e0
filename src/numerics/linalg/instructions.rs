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

/// Vectors of 256 bits for kernels, where the machine has them. Most kernels do not gain by longer ones, and the
/// substitutions lose a third.
pub fn short_vectors() -> Arch {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return Arch::V3(simd);
    }
    Arch::new()
}
