//! Reading assets and models, with the file's name in front of whatever goes wrong.

use std::fs;
use std::path::Path;

use anyhow::Context;
use glam::DVec3;
use silmap_geometry::TriangleMesh;
use silmap_map::Asset;
use silmap_preprocess::mesh_io::{self, LoadOptions, Loaded};
use silmap_preprocess::pipeline::model_crc32;

use crate::args::MendingArgs;
use crate::output;

/// Reads an asset; also gives the size of its file in bytes.
///
/// # Errors
/// One sentence with the file's name.
pub(crate) fn read_asset(path: &Path) -> anyhow::Result<(Asset, Vec<u8>)> {
    let bytes = fs::read(path).with_context(|| path.display().to_string())?;
    let asset = silmap_map::asset::read(&bytes).with_context(|| path.display().to_string())?;
    Ok((asset, bytes))
}

/// Reads a closed model and prints its warnings.
///
/// # Errors
/// One sentence with the file's name.
pub(crate) fn load_model(path: &Path, mending: MendingArgs) -> anyhow::Result<Loaded> {
    let options = LoadOptions {
        close_holes: mending.close_holes,
        repair: mending.repair,
    };
    // Its errors name the file already.
    let loaded = mesh_io::load(path, &options)?;
    for warning in &loaded.warnings {
        output::warn(&format!("{}: {warning}", path.display()));
    }
    Ok(loaded)
}

/// The bytes of a mesh in coordinates about `origin`, in the format that the file's name says; prints a warning when that cannot
/// hold it.
///
/// # Errors
/// One sentence with the file's name.
pub(crate) fn encode_mesh(
    path: &Path,
    mesh: &TriangleMesh,
    origin: DVec3,
) -> anyhow::Result<Vec<u8>> {
    let (bytes, warning) = mesh_io::encode_about(path, mesh, origin)?;
    if let Some(warning) = warning {
        output::warn(&format!("{}: {warning}", path.display()));
    }
    Ok(bytes)
}

/// Reads the model that an asset was made from, in the asset's coordinates, with a warning when it seems to be another one.
///
/// # Errors
/// As [`load_model`].
pub(crate) fn load_model_of(
    asset: &Asset,
    path: &Path,
    mending: MendingArgs,
) -> anyhow::Result<Loaded> {
    let mut loaded = load_model(path, mending)?;
    // Into the asset's coordinates.
    loaded.mesh = loaded.mesh.about(asset.placement.in_model);
    if model_crc32(loaded.mesh.mesh()) != asset.record.model_crc32 {
        output::warn(&format!(
            "{}: this is not the mesh that the asset was made from ({})",
            path.display(),
            asset.record.name
        ));
    }
    Ok(loaded)
}
