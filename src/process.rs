//! The settings of the process: limits that give errors instead of signals, and an end without
//! memory.
#![allow(unsafe_code)] // an allocator, and calls of the C library that set limits of a process

use flexbody::ExitCode;
use flexbody::program::{abandon_unfinished_soon, accepts_failure, end, take_hdf5_variables};
use mimalloc::MiMalloc;
use std::alloc::{GlobalAlloc, Layout};
use std::cell::Cell;
use std::fmt::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The program's allocator. Where there is no memory left it ends the program with exit code 4 and a message,
/// since no code that merely needs a vector could go on.
///
/// Large blocks come and go on all threads: the system allocator gives them back each time, and the page
/// faults and interrupts of that cost more than the work (measured: half of the factorisation time on two
/// threads).
pub(crate) struct Allocator;

// SAFETY: every call is passed on unchanged; a failure that is not expected does not return.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract, which is that of the inner allocator; so in the next ones.
        sound(unsafe { MiMalloc.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        sound(unsafe { MiMalloc.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        sound(unsafe { MiMalloc.realloc(block, layout, size) }, size)
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { MiMalloc.dealloc(block, layout) }
    }
}

#[inline]
fn sound(block: *mut u8, size: usize) -> *mut u8 {
    if block.is_null() && !accepts_failure() {
        out_of_memory(size);
    }
    block
}

/// Allocations of C code, HDF5 first of all: some of it uses a null pointer on the way out of a failed allocation
/// (`H5AC_create` of HDF5), which ends the process by a signal. `build.rs` has the linker replace the functions of the C
/// library by these, which end the program as [`Allocator`] does.
#[cfg(target_os = "linux")]
mod of_c {
    use super::out_of_memory;
    use libc::{c_void, size_t};

    /// Blocks up to this size in bytes end the program where memory is short: C code needs them for itself. Larger
    /// ones hold data, whose size may be that of a damaged file, and their absence is handled.
    const NEEDED: size_t = 4 << 20;

    unsafe extern "C" {
        fn __real_malloc(size: size_t) -> *mut c_void;
        fn __real_calloc(count: size_t, size: size_t) -> *mut c_void;
        fn __real_realloc(block: *mut c_void, size: size_t) -> *mut c_void;
    }

    fn sound(block: *mut c_void, size: size_t) -> *mut c_void {
        if block.is_null() && 0 < size && size <= NEEDED {
            out_of_memory(size);
        }
        block
    }

    // SAFETY of all three: every call is passed on unchanged to the function of the C library.

    #[unsafe(no_mangle)]
    unsafe extern "C" fn __wrap_malloc(size: size_t) -> *mut c_void {
        sound(unsafe { __real_malloc(size) }, size)
    }

    #[unsafe(no_mangle)]
    unsafe extern "C" fn __wrap_calloc(count: size_t, size: size_t) -> *mut c_void {
        sound(unsafe { __real_calloc(count, size) }, count.saturating_mul(size))
    }

    #[unsafe(no_mangle)]
    unsafe extern "C" fn __wrap_realloc(block: *mut c_void, size: size_t) -> *mut c_void {
        sound(unsafe { __real_realloc(block, size) }, size)
    }
}

thread_local! {
    static ENDING: Cell<bool> = const { Cell::new(false) };
}

/// Says so, removes the unfinished files, and ends the process; none of it allocates.
#[cold]
fn out_of_memory(size: usize) -> ! {
    static BEGUN: AtomicBool = AtomicBool::new(false);
    if ENDING.replace(true) {
        // An allocation on the way to the end after all.
        end(ExitCode::Resources);
    }
    if BEGUN.swap(true, Ordering::SeqCst) {
        // Another thread is at it.
        std::thread::sleep(Duration::from_secs(10));
        end(ExitCode::Resources);
    }
    abandon_unfinished_soon();
    let mut line = Line { bytes: [0; 256], len: 0 };
    // The text is shorter than the line.
    let _ = writeln!(
        line,
        "error[FB601]: not enough memory: {size} more bytes are not available\n  help: compute fewer modes, use fewer threads (--threads), raise the limits of memory, or use a larger machine"
    );
    write_stderr(&line.bytes[..line.len]);
    end(ExitCode::Resources)
}

/// A text of limited length that lies on the stack.
struct Line {
    bytes: [u8; 256],
    len: usize,
}

impl Write for Line {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        let rest = self.bytes.get_mut(self.len..self.len + text.len()).ok_or(std::fmt::Error)?;
        rest.copy_from_slice(text.as_bytes());
        self.len += text.len();
        Ok(())
    }
}

#[cfg(unix)]
fn write_stderr(text: &[u8]) {
    // SAFETY: the bytes are there for as long as the call lasts. A failure cannot be reported.
    let _ = unsafe { libc::write(2, text.as_ptr().cast(), text.len()) };
}

#[cfg(not(unix))]
fn write_stderr(text: &[u8]) {
    let _ = std::io::Write::write_all(&mut std::io::stderr(), text);
}

/// Before anything else: a file that becomes too large is an error of the write, not a signal; as many files
/// may be open as the system allows, since every output holds one; the C library keeps one pool of memory for
/// all threads, not 64 MiB of address space for each; no variable of the environment changes how HDF5 writes.
pub(crate) fn prepare() {
    drop(take_hdf5_variables());
    #[cfg(unix)]
    // SAFETY: sets limits of this process, before any thread is started; what fails leaves things as they
    // are.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
        let mut files = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        if libc::getrlimit(libc::RLIMIT_NOFILE, &mut files) == 0 && files.rlim_cur < files.rlim_max {
            files.rlim_cur = files.rlim_max;
            libc::setrlimit(libc::RLIMIT_NOFILE, &files);
        }
    }
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: as above.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, 1);
    }
}
