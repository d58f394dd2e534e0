//! Plugins of the HDF5 library: code that a file asks for by the number of a filter. None is loaded.

// An exception to `unsafe_code = "deny"`: the bindings have no safe form of these three functions.
#![allow(unsafe_code)]

use hdf5_metno_sys::h5pl::{H5PLremove, H5PLset_loading_state, H5PLsize};
use std::sync::Once;

/// Keeps the HDF5 library of this process from loading plugins: filters and whatever else may be loaded stay those that
/// the library has. Folders of plugins that it was built with, or that HDF5_PLUGIN_PATH names, are forgotten.
pub fn without_plugins() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        hdf5_metno::sync::sync(|| {
            let (mut nothing, mut folders) = (0, 0);
            // SAFETY: the library is held by `sync`, and both pointers are those of variables that outlive the calls.
            unsafe {
                H5PLset_loading_state(&raw mut nothing);
                if H5PLsize(&raw mut folders) >= 0 {
                    (0..folders).rev().for_each(|folder| _ = H5PLremove(folder));
                }
            }
        });
    });
}
