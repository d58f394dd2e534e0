//! Models that are given by their manifest.

use super::places::refuse_replacing;
use crate::base::error::Result;
use crate::input::{ModelFiles, read_manifest, read_model};
use crate::model::{CheckedModel, FeModel};
use std::path::{Path, PathBuf};

/// Whether a path is that of a manifest.
pub(super) fn is_manifest(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "toml")
}

/// The files that `manifest` names and the model that they are, checked; none of `outputs` replaces one of
/// them.
pub(super) fn read_checked<'p>(
    manifest: &Path,
    outputs: impl Iterator<Item = &'p PathBuf>,
) -> Result<(ModelFiles, CheckedModel)> {
    let files = read_manifest(manifest)?;
    refuse_replacing(files.paths().iter(), outputs)?;
    let checked = FeModel::from_raw(read_model(&files)?)?;
    Ok((files, checked))
}
