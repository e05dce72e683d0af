//! What is looked at: an asset, a full mesh, or both, in the same coordinates.

use std::sync::Arc;

use glam::DVec3;
use silmap_geometry::TriangleMesh;
use silmap_map::{Asset, BoundingSphere, Method};

/// What was loaded.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// What people call it.
    pub name: String,
    /// Bytes of its file.
    pub bytes: u64,
    /// The asset.
    pub asset: Option<Arc<Asset>>,
    /// The full mesh, in the asset's coordinates.
    pub model: Option<Arc<TriangleMesh>>,
    /// The origin of these coordinates in those of the file.
    pub origin: DVec3,
    /// What was odd.
    pub warnings: Vec<String>,
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
            model: None,
            warnings: Vec::new(),
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

    /// The method that is meant, and whether the asset has the data for it.
    #[must_use]
    pub fn method(&self, wanted: Option<Method>) -> Method {
        let has_depth = self.asset.as_ref().is_some_and(|a| a.map.has_depth());
        match wanted {
            Some(Method::Tight) | None if !has_depth => Method::Hull,
            Some(method) => method,
            None => Method::Tight,
        }
    }

    /// Whether anything is there.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.asset.is_none() && self.model.is_none()
    }
}
