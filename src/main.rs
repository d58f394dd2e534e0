//! The `flexbody` program.

fn main() {}
