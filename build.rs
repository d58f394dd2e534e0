//! Leads the allocations of C code in the program through functions of `src/process.rs`, where the linker can.

/// Allocating functions of the C library.
const ALLOCATING: [&str; 3] = ["malloc", "calloc", "realloc"];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let target = std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    if target == "linux" && std::env::var_os("CARGO_FEATURE_CLI").is_some() {
        for name in ALLOCATING {
            println!("cargo:rustc-link-arg-bin=flexbody=-Wl,--wrap={name}");
        }
    }
}
