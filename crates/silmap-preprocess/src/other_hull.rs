//! An asset with a hull of another number of faces, made from the asset and its model: the silhouettes stay, hull and textures are new.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 3: a progressive hull has a level for each number
//! of faces.

use silmap_geometry::ClosedMesh;
use silmap_geometry::bvh::Bvh;
use silmap_geometry::watch::Watch;
use silmap_map::fewer_views::THEN;
use silmap_map::{Asset, BuildRecord, asset};
use thiserror::Error;

use crate::build_error::BuildError;
use crate::pipeline::{Photographed, check_hull, hull_around, hull_warnings, without_unseen};
use crate::progress::PrepWarning;
use crate::recipe::{Recipe, RecipeError};
use crate::record::{model_crc32, options_text};
use crate::texture;

/// Why an asset cannot have another hull.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OtherHullError {
    /// It was made from another mesh.
    #[error("this is not the mesh that the asset was made from ({name})")]
    OtherModel {
        /// What the asset was made from.
        name: String,
    },
    /// It does not tell how it was built.
    #[error(transparent)]
    Recipe(#[from] RecipeError),
    /// A stage fails, or was interrupted.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// `asset` with a hull of `faces` faces, and what was odd: what building it from `model` with that many faces gives. `seen` is what the asset
/// was built with besides the model.
///
/// # Errors
/// When interrupted, the model is not the asset's, it does not tell how it was built, or a stage fails.
pub fn with_hull_faces(
    asset: &Asset,
    (model, seen): (&ClosedMesh, &Photographed),
    faces: u32,
    watch: &Watch<'_>,
) -> Result<(Asset, Vec<PrepWarning>), OtherHullError> {
    if model_crc32(model.mesh()) != asset.record.model_crc32 {
        return Err(OtherHullError::OtherModel {
            name: asset.record.name.clone(),
        });
    }
    let mut recipe = Recipe::from_record(&asset.record)?;
    recipe.build.hull.target_faces = faces;
    let params = &recipe.build;
    let cleared = without_unseen(model, params);
    let model = cleared.as_ref().map_or(model, |(seen, _)| seen);
    let tree = Bvh::new(model.mesh());
    let hull = hull_around((model, &tree), seen, params, watch).map_err(BuildError::from)?;
    let textures = texture::bake_photographed(
        (model, &tree),
        &hull,
        &seen.photographs,
        &params.textures,
        watch,
    )
    .map_err(BuildError::from)?;
    let check = check_hull(model, &hull, params);
    let warnings = hull_warnings(params, (&hull, &check), &textures);
    let fewer_views = (asset.record.options.split_once(THEN))
        .map_or_else(String::new, |(_, then)| format!("{THEN}{then}"));
    let made = asset::quantise(&Asset {
        record: BuildRecord {
            options: options_text(params) + &fewer_views,
            params: recipe.to_value(),
            ..asset.record.clone()
        },
        map: asset.map.clone(),
        hull,
        textures,
        placement: asset.placement,
    })
    .map_err(BuildError::from)?;
    Ok((made, warnings))
}
