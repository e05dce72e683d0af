//! What is looked at: an asset, a full mesh, or both, in the same coordinates.

use std::sync::Arc;

use glam::DVec3;
use silmap_geometry::ClosedMesh;
use silmap_map::{Asset, BoundingSphere, Method};

/// What was loaded.
#[derive(Clone, Default)]
pub struct Scene {
    /// What people call it.
    pub name: String,
    /// Where it is from: a path or an address.
    pub(crate) source: String,
    /// The files that it is from.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) opened: Option<crate::start::Opened>,
    /// Bytes of its file.
    pub bytes: u64,
    /// The asset, as it is shown.
    pub asset: Option<Arc<Asset>>,
    /// The asset as it was loaded, where the one that is shown has fewer views or another hull.
    pub whole: Option<Arc<Asset>>,
    /// The asset with another hull of so many faces and all its views, where it was made.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) with_other_hull: Option<(u32, Arc<Asset>)>,
    /// The full mesh, in the asset's coordinates.
    pub model: Option<Arc<ClosedMesh>>,
    /// What the asset was built with besides its mesh, where that is known.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) photographed: Option<Arc<silmap_preprocess::pipeline::Photographed>>,
    /// The photographs of the capture that it was built of.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) shots: Arc<[crate::shot::Shot]>,
    /// The direction that is upwards, where that is known; y is without.
    pub upwards: Option<DVec3>,
    /// The origin of these coordinates in those of the file.
    pub origin: DVec3,
    /// What was odd.
    pub warnings: Vec<String>,
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scene")
            .field("name", &self.name)
            .field("bytes", &self.bytes)
            .field("warnings", &self.warnings)
            .finish_non_exhaustive()
    }
}

impl Scene {
    /// An asset alone.
    #[must_use]
    pub fn of_asset(name: &str, bytes: u64, asset: Asset) -> Self {
        Self {
            name: name.to_owned(),
            bytes,
            origin: asset.placement.in_scene,
            asset: Some(Arc::new(asset)),
            ..Self::default()
        }
    }

    /// The sphere about it.
    #[must_use]
    pub fn sphere(&self) -> BoundingSphere {
        if let Some(asset) = &self.asset {
            return asset.map.bounding_sphere();
        }
        if let Some(model) = &self.model {
            let bounds = model.bounds();
            return BoundingSphere {
                center: bounds.center,
                radius: bounds.radius,
            };
        }
        BoundingSphere {
            center: DVec3::ZERO,
            radius: 1.0,
        }
    }

    /// The method that is meant, or one that the asset has the data for.
    #[must_use]
    pub fn method(&self, wanted: Option<Method>) -> Method {
        let has_depth = self.asset.as_ref().is_some_and(|a| a.map.has_depth());
        match wanted {
            Some(Method::Tight) | None if !has_depth => Method::Hull,
            Some(method) => method,
            None => Method::Tight,
        }
    }

    /// The asset as it was loaded.
    #[must_use]
    pub fn loaded(&self) -> Option<&Arc<Asset>> {
        self.whole.as_ref().or(self.asset.as_ref())
    }

    /// Whether the asset can be given another hull: its mesh is at hand, and what its textures were made of.
    #[must_use]
    pub fn can_have_other_hull(&self) -> bool {
        #[cfg(target_arch = "wasm32")]
        return false;
        #[cfg(not(target_arch = "wasm32"))]
        self.loaded().is_some_and(|asset| {
            let views = &asset.map.views;
            let is_of_capture = views.iter().any(|view| view.photographed.is_some());
            self.model.is_some() && (!is_of_capture || self.photographed.is_some())
        })
    }

    /// Whether anything is there.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.asset.is_none() && self.model.is_none()
    }
}
