//! Reading assets and models, with the file's name in every error.

use std::path::Path;

use anyhow::{Context, bail};
use glam::DVec3;
use silmap_geometry::TriangleMesh;
use silmap_map::{Asset, asset};
use silmap_mesh_io::input;
use silmap_mesh_io::{self as mesh_io, LoadOptions, Loaded};
use silmap_preprocess::pipeline::model_crc32;

use crate::args::MendingArgs;
use crate::interrupt;
use crate::output;

/// Reads a file whole; stops when the user asks to, also where nothing comes.
///
/// # Errors
/// One sentence with the file's name.
pub(crate) fn read(path: &Path) -> anyhow::Result<Vec<u8>> {
    let owned = path.to_owned();
    interrupt::unless_stopped(move || input::read(&owned))?
        .with_context(|| path.display().to_string())
}

/// Reads a file of text, as [`read`].
///
/// # Errors
/// As [`read`], and when it is no text.
pub(crate) fn read_text(path: &Path) -> anyhow::Result<String> {
    let owned = path.to_owned();
    interrupt::unless_stopped(move || input::read_text(&owned))?
        .with_context(|| path.display().to_string())
}

/// Reads an asset; also gives the size of its file in bytes.
///
/// # Errors
/// One sentence with the file's name.
pub(crate) fn read_asset(path: &Path) -> anyhow::Result<(Asset, Vec<u8>)> {
    let bytes = read(path)?;
    let asset = match asset::read_with(&bytes, &input::beside(path)) {
        Ok(asset) => asset,
        Err(_) if mesh_io::is_plain_mesh(path, &bytes) => bail!(
            "{}: it is a mesh, and an asset is needed: make one with `silmap build {} -o {}`",
            path.display(),
            path.display(),
            path.with_extension("glb").display()
        ),
        Err(error) => return Err(error).with_context(|| path.display().to_string()),
    };
    Ok((asset, bytes))
}

/// Reads a closed model and prints its warnings.
///
/// # Errors
/// One sentence with the file's name.
pub(crate) fn load_model(path: &Path, mending: MendingArgs) -> anyhow::Result<Loaded> {
    load_model_bytes(path, &read(path)?, &load_options(mending))
}

/// The options as the library has them.
pub(crate) fn load_options(mending: MendingArgs) -> LoadOptions {
    LoadOptions {
        close_holes: mending.close_holes,
        repair: mending.repair,
        alpha: mending.alpha.into(),
        weld: mending.weld,
    }
}

/// As [`load_model`], by the library's options.
///
/// # Errors
/// As [`load_model`].
pub(crate) fn load_model_with(path: &Path, options: &LoadOptions) -> anyhow::Result<Loaded> {
    load_model_bytes(path, &read(path)?, options)
}

/// As [`load_model`], of bytes that were read before.
///
/// # Errors
/// As [`load_model`].
pub(crate) fn load_model_bytes(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
) -> anyhow::Result<Loaded> {
    if let Some(name) = model_of_asset(bytes) {
        output::warn(&format!(
            "{}: this is an asset: its coarse hull is taken as the mesh, not the model that it was made from ({name})",
            path.display()
        ));
    }
    // Its errors name the file already.
    let loaded = mesh_io::load_bytes(path, bytes, options)?;
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

/// The name of the model that an asset was made from, where a file is an asset. Only its JSON is looked at.
fn model_of_asset(bytes: &[u8]) -> Option<String> {
    let (header, rest) = bytes.split_first_chunk::<{ asset::HEADER_BYTES }>()?;
    let json_length = asset::json_length(header)?;
    asset::model_name(rest.get(..json_length as usize)?)
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
    check_model_of(asset, path, &loaded);
    Ok(loaded)
}

/// Warns when an asset seems to be made from another mesh.
pub(crate) fn check_model_of(asset: &Asset, path: &Path, loaded: &Loaded) {
    if model_crc32(loaded.mesh.mesh()) != asset.record.model_crc32 {
        output::warn(&format!(
            "{}: this is not the mesh that the asset was made from ({})",
            path.display(),
            asset.record.name
        ));
    }
}
