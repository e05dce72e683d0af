//! How an asset was built, as data in it: enough to build it again, byte for byte, from the same mesh by the same version.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use silmap_geometry::CoverageRule;
use silmap_map::{BuildRecord, Method};
use thiserror::Error;

use crate::build_params::BuildParams;
use crate::capture::Backend;

/// The one version of recipes that this program writes and reads.
pub const RECIPE_VERSION: u32 = 1;

/// All that decides what an asset is, next to the mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Version of the recipe.
    pub version: u32,
    /// How it was built.
    pub build: BuildParams,
    /// Views that were left when views were removed afterwards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fewer_views: Option<u32>,
}

/// Why the recipe of an asset cannot be read.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum RecipeError {
    /// It was built before options were recorded as data.
    #[error(
        "it does not tell how it was built as data: it was made by {generator:?}, with {options}"
    )]
    Missing {
        /// Version of silmap.
        generator: String,
        /// The options as text.
        options: String,
    },
    /// Written by a later version.
    #[error("its recipe has version {found}, this program reads version {known}")]
    UnknownVersion {
        /// Version in the file.
        found: u64,
        /// Version of this program.
        known: u32,
    },
    /// An option that this version does not have, or a value that it cannot have.
    #[error("its recipe cannot be read: {reason}")]
    Unknown {
        /// What is not known.
        reason: String,
    },
}

impl Recipe {
    /// The recipe of a build with these params. Its backend is the one that drew: only coverage by centers is ever drawn by a device.
    #[must_use]
    pub fn of(params: &BuildParams) -> Self {
        let mut build = params.clone();
        let capture = &mut build.capture;
        let is_by_device =
            capture.backend == Backend::Gpu && capture.coverage == CoverageRule::Center;
        capture.backend = if is_by_device {
            Backend::Gpu
        } else {
            Backend::Cpu
        };
        Self {
            version: RECIPE_VERSION,
            build,
            fewer_views: None,
        }
    }

    /// As it is stored.
    #[must_use]
    pub fn to_value(&self) -> Value {
        // Strings and finite numbers can always be put into JSON; others become null, which is read as missing.
        serde_json::to_value(self).unwrap_or(Value::Null)
    }

    /// The recipe of an asset.
    ///
    /// # Errors
    /// When the asset has none, or one with options that this version does not know.
    pub fn from_record(record: &BuildRecord) -> Result<Self, RecipeError> {
        let version = record.params.get("version").and_then(Value::as_u64);
        match version {
            Some(found) if found == u64::from(RECIPE_VERSION) => {
                serde_json::from_value(record.params.clone()).map_err(|error| {
                    RecipeError::Unknown {
                        reason: error.to_string(),
                    }
                })
            }
            Some(found) => Err(RecipeError::UnknownVersion {
                found,
                known: RECIPE_VERSION,
            }),
            None => Err(RecipeError::Missing {
                generator: record.generator.clone(),
                options: record.options.clone(),
            }),
        }
    }
}

/// [`CoverageRule`] in a recipe.
#[derive(Serialize, Deserialize)]
#[serde(remote = "CoverageRule", rename_all = "kebab-case")]
pub(crate) enum CoverageName {
    Center,
    Any,
}

/// [`Method`] in a recipe.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Method", rename_all = "kebab-case")]
pub(crate) enum MethodName {
    Paper,
    Hull,
    Tight,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recipe_comes_back_as_it_was() {
        let mut params = BuildParams {
            view_radius_rel: 0.1 + 0.2,
            views: 77,
            ..BuildParams::default()
        };
        params.capture.coverage = CoverageRule::Any;
        params.map.method = Method::Paper;
        params.map.max_error = Some(1.0 / 3.0);
        params.load.repair = true;
        params.textures.budget_bytes = Some(12_345);
        let recipe = Recipe::of(&params);
        let mut record = BuildRecord {
            params: recipe.to_value(),
            ..BuildRecord::default()
        };
        assert_eq!(Recipe::from_record(&record), Ok(recipe.clone()));
        assert_eq!(recipe.build.capture.backend, Backend::Cpu);
        record.params = silmap_map::fewer_views::with_fewer_views(&record.params, 9);
        let fewer = Recipe::from_record(&record).map(|r| r.fewer_views);
        assert_eq!(fewer, Ok(Some(9)));
        record.params["build"]["later"] = 1.into();
        let refused = Recipe::from_record(&record).unwrap_err();
        assert!(refused.to_string().contains("later"), "{refused}");
        record.params["version"] = 2.into();
        let refused = Recipe::from_record(&record).unwrap_err();
        assert_eq!(refused, RecipeError::UnknownVersion { found: 2, known: 1 });
        record.params = Value::Null;
        let refused = Recipe::from_record(&record).unwrap_err();
        assert!(matches!(refused, RecipeError::Missing { .. }));
    }
}
