//! Reading assets and models, with the file's name in front of whatever goes wrong.

use std::fs;
use std::io::Read;
use std::path::{Component, Path};

use anyhow::Context;
use silmap_map::{Asset, asset};
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
    let asset = asset::read_with(&bytes, &beside(path));
    let asset = asset.with_context(|| path.display().to_string())?;
    Ok((asset, bytes))
}

/// Reads files beside an asset, which another program may have taken apart. Names that lead out of its folder are not followed.
pub(crate) fn beside(path: &Path) -> impl Fn(&str) -> Option<Vec<u8>> {
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    move |name: &str| {
        let is_plain = Path::new(name)
            .components()
            .all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        is_plain.then(|| fs::read(folder.join(name)).ok()).flatten()
    }
}

/// Reads a closed model and prints its warnings.
///
/// # Errors
/// One sentence with the file's name.
pub(crate) fn load_model(path: &Path, mending: MendingArgs) -> anyhow::Result<Loaded> {
    load_model_with(path, &load_options(mending))
}

/// The options as the library has them.
pub(crate) fn load_options(mending: MendingArgs) -> LoadOptions {
    LoadOptions {
        close_holes: mending.close_holes,
        repair: mending.repair,
    }
}

/// As [`load_model`], by the library's options.
///
/// # Errors
/// As [`load_model`].
pub(crate) fn load_model_with(path: &Path, options: &LoadOptions) -> anyhow::Result<Loaded> {
    if let Some(name) = model_of_asset(path) {
        output::warn(&format!(
            "{}: this is an asset: its coarse hull is taken as the mesh, not the model that it was made from ({name})",
            path.display()
        ));
    }
    // Its errors name the file already.
    let loaded = mesh_io::load(path, options)?;
    for warning in &loaded.warnings {
        output::warn(&format!("{}: {warning}", path.display()));
    }
    Ok(loaded)
}

/// The name of the model that an asset was made from, where a file is an asset. Only its JSON is looked at.
fn model_of_asset(path: &Path) -> Option<String> {
    // A pipe can be read only once.
    let length = fs::metadata(path).ok().filter(fs::Metadata::is_file)?.len();
    let mut file = fs::File::open(path).ok()?;
    let mut header = [0; asset::HEADER_BYTES];
    file.read_exact(&mut header).ok()?;
    let json_length = asset::json_length(&header)?;
    if u64::from(json_length) > length {
        return None;
    }
    let mut json = vec![0; json_length as usize];
    file.read_exact(&mut json).ok()?;
    asset::model_name(&json)
}

/// Reads the model that an asset was made from, with a warning when it seems to be another one.
///
/// # Errors
/// As [`load_model`].
pub(crate) fn load_model_of(
    asset: &Asset,
    path: &Path,
    mending: MendingArgs,
) -> anyhow::Result<Loaded> {
    let loaded = load_model(path, mending)?;
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
