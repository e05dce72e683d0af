//! What a camera looks at, and the coordinates of both.

use glam::DVec3;
use silmap_geometry::Bounds;
use silmap_map::Asset;

/// What is looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scene {
    /// The origin of its coordinates in those of what is typed and printed.
    pub(crate) origin: DVec3,
    /// The origin of its coordinates in those of the model's file or the capture.
    pub(crate) origin_in_model: DVec3,
    /// Middle and radius of the sphere about it.
    pub(crate) sphere: (DVec3, f64),
}

impl Scene {
    /// An asset.
    pub(crate) fn of(asset: &Asset) -> Self {
        Self {
            origin: asset.placement.in_scene,
            origin_in_model: asset.placement.in_model,
            sphere: (asset.map.center, asset.map.radius),
        }
    }

    /// A mesh, in coordinates about its origin.
    pub(crate) fn of_mesh(origin: DVec3, bounds: &Bounds) -> Self {
        Self {
            origin,
            origin_in_model: origin,
            sphere: (bounds.center, bounds.radius),
        }
    }
}
