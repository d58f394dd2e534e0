//! Plugins of the HDF5 library, which a file requests by the number of a filter. They are never loaded.

// Exception to `unsafe_code = "deny"`: the bindings have no safe form of these three functions.
#![allow(unsafe_code)]

use hdf5_metno_sys::h5pl::{H5PLremove, H5PLset_loading_state, H5PLsize};
use std::sync::Once;

/// Prevents the HDF5 library of this process from loading plugins. Only its built-in filters remain; plugin folders
/// that it was built with, or that HDF5_PLUGIN_PATH names, are removed.
pub fn without_plugins() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        hdf5_metno::sync::sync(|| {
            let (mut nothing, mut folders) = (0, 0);
            // SAFETY: `sync` holds the lock of the library, and both pointers are those of variables that outlive the
            // calls.
            unsafe {
                H5PLset_loading_state(&raw mut nothing);
                if H5PLsize(&raw mut folders) >= 0 {
                    (0..folders).rev().for_each(|folder| _ = H5PLremove(folder));
                }
            }
        });
    });
}
