//! The vector instructions of this machine.

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
