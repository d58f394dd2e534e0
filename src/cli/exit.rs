//! End of the process, whatever its threads are doing.
#![allow(unsafe_code)] // a call of the C library that ends the process

use flexbody_base::error::ExitCode;

/// Ends the process at once: other threads may be inside HDF5, whose cleanup waits for them or crashes.
pub fn end(code: ExitCode) -> ! {
    #[cfg(unix)]
    // SAFETY: the call only ends the process.
    unsafe {
        libc::_exit(code as i32)
    }
    #[cfg(not(unix))]
    std::process::exit(code as i32)
}
