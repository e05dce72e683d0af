//! An asset with a hull of another number of faces, made from the asset and its model: the silhouettes stay, hull and textures are new.
//!
//! Source: Sander, Gu, Gortler, Hoppe, Snyder. Silhouette Clipping. SIGGRAPH 2000, section 3: a progressive hull has a level for each number
//! of faces.

use silmap_geometry::ClosedMesh;
use silmap_geometry::bvh::Bvh;
use silmap_geometry::watch::Watch;
use silmap_hull::HullError;
use silmap_map::fewer_views::THEN;
use silmap_map::{Asset, AssetError, BuildRecord, asset};
use thiserror::Error;

use crate::pipeline::{Photographed, check_hull, hull_around, hull_warnings, without_unseen};
use crate::progress::PrepWarning;
use crate::recipe::{Recipe, RecipeError};
use crate::record::{model_crc32, options_text};
use crate::texture::{self, TextureError};

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
    /// There is no hull.
    #[error(transparent)]
    Hull(#[from] HullError),
    /// The hull cannot be painted.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// The parts cannot be stored.
    #[error(transparent)]
    Asset(#[from] AssetError),
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
    let hull = hull_around((model, &tree), seen, params, watch)?;
    let textures = texture::bake_photographed(
        (model, &tree),
        &hull,
        &seen.photographs,
        &params.textures,
        watch,
    )?;
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
    })?;
    Ok((made, warnings))
}

#[cfg(test)]
mod tests {
    use silmap_map::fewer_views::{ViewGoal, keep_fewer_views};
    use silmap_models as models;

    use super::*;
    use crate::build_params::BuildParams;
    use crate::capture::Backend;
    use crate::pipeline;

    fn params(faces: u32) -> BuildParams {
        let mut params = BuildParams {
            views: 48,
            resolution_px: 64,
            ..BuildParams::default()
        };
        params.capture.backend = Backend::Cpu;
        params.map.keep = 20;
        params.hull.target_faces = faces;
        params.textures.views = 3;
        params.textures.size_px = 16;
        params
    }

    #[test]
    fn another_hull_is_the_one_that_a_build_gives() {
        let model = ClosedMesh::try_from(models::torus(600)).unwrap();
        let watch = Watch::silent();
        let built = |faces| {
            let (asset, _) = pipeline::build(&model, "torus", &params(faces), &watch).unwrap();
            asset
        };
        let first = built(100);
        let seen = Photographed::default();
        let other = |asset: &Asset| {
            let (made, warnings) = with_hull_faces(asset, (&model, &seen), 160, &watch).unwrap();
            assert_eq!(warnings, Vec::new());
            asset::write(&made).unwrap()
        };
        assert!(other(&first) == asset::write(&built(160)).unwrap());
        assert!(other(&first) != asset::write(&first).unwrap());
        // Whether views are removed before or after is all the same.
        let fewer = |asset: &Asset| keep_fewer_views(asset, ViewGoal::Keep(16)).unwrap();
        let after = fewer(&asset::read(&other(&first)).unwrap());
        assert!(other(&fewer(&first)) == asset::write(&after).unwrap());
    }

    #[test]
    fn another_mesh_is_refused() {
        let watch = Watch::silent();
        let [model, other] =
            [600, 700].map(|faces| ClosedMesh::try_from(models::torus(faces)).unwrap());
        let (asset, _) = pipeline::build(&model, "torus", &params(100), &watch).unwrap();
        let made = with_hull_faces(&asset, (&other, &Photographed::default()), 50, &watch);
        assert!(
            matches!(made, Err(OtherHullError::OtherModel { .. })),
            "{made:?}"
        );
    }
}
