//! Levels of detail of contours, and which one a picture needs.

use glam::DVec2;
use silmap_geometry::Camera;
use silmap_geometry::camera::FIT_MARGIN;

use crate::{SilhouetteMap, ViewContour};

/// How fine the contours are that an outline is interpolated from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Detail {
    /// The coarsest level that stays within [`DETAIL_BOUND_PX`] of the traced outlines on the screen.
    #[default]
    OnScreen,
    /// That level, or the coarsest there is.
    Level(u8),
}

impl Detail {
    /// The level of the contours of `map` that it asks for in the picture of `camera`.
    #[must_use]
    pub fn level(self, map: &SilhouetteMap, camera: &Camera) -> u8 {
        match self {
            _ if !map.has_levels() => 0,
            Self::OnScreen => map.level_for(camera, DETAIL_BOUND_PX),
            Self::Level(level) => level.min(ViewContour::COARSEST_LEVEL),
        }
    }
}

/// How far the contours that are used may be from the traced ones, pixels of the picture. Where levels change the outline then
/// moves by about 0.03 pixels on average.
pub const DETAIL_BOUND_PX: f64 = 0.25;

impl ViewContour {
    /// The coarsest level of detail. Level k stays within 2ᵏ times the map's tolerance of the traced outline.
    pub const COARSEST_LEVEL: u8 = 6;

    /// Indices of the vertices that a level of detail has, in their order.
    pub fn vertices_at(&self, level: u8) -> impl Iterator<Item = usize> + '_ {
        let is_whole = level == 0 || self.levels.len() != self.points.len();
        (0..self.points.len()).filter(move |&k| is_whole || self.levels[k] >= level)
    }
}

impl SilhouetteMap {
    /// Whether contours have levels of detail.
    #[must_use]
    pub fn has_levels(&self) -> bool {
        (self.views.iter().flat_map(|v| &v.contours)).any(|c| !c.levels.is_empty())
    }

    /// The coarsest level of detail whose distance from the traced outline, seen by `camera`, is at most `bound_px` of its
    /// pixels. Level 0 also where not even that is so near.
    #[must_use]
    pub fn level_for(&self, camera: &Camera, bound_px: f64) -> u8 {
        // A picture of exactly so many pixels is on the near side, whatever the rounding.
        let allowed_px = bound_px * self.capture_px_per_px(camera) * (1.0 + 1e-9);
        let fits = |level: &u8| self.tolerance_px * f64::from(1_u32 << level) <= allowed_px;
        (1..=ViewContour::COARSEST_LEVEL).rfind(fits).unwrap_or(0)
    }

    /// How many pixels of the capture one pixel of `camera` is: by the bounding sphere's radius in both. Zero where the center
    /// is beside or behind the camera, or the eye in the sphere.
    fn capture_px_per_px(&self, camera: &Camera) -> f64 {
        let to_center = self.center - camera.eye;
        let outside = to_center.length_squared() - self.radius * self.radius;
        let along = to_center.dot(camera.forward);
        if outside <= 0.0 || along <= 0.0 {
            return 0.0;
        }
        // Off the axis a pinhole's picture is stretched by up to the square of this.
        let stretch = to_center.length() / along;
        let size_px = DVec2::new(camera.width_px.into(), camera.height_px.into());
        let px_per_tangent = (0.5 * size_px / camera.half_tangent).max_element();
        let radius_px = px_per_tangent * self.radius / outside.sqrt() * stretch * stretch;
        0.5 * f64::from(self.resolution_px) / FIT_MARGIN / radius_px
    }

    /// Contour vertices of all views together at each level of detail; one number where there are no levels.
    #[must_use]
    pub fn level_vertex_counts(&self) -> Vec<usize> {
        let coarsest = if self.has_levels() {
            ViewContour::COARSEST_LEVEL
        } else {
            0
        };
        let contours = || self.views.iter().flat_map(|v| &v.contours);
        (0..=coarsest)
            .map(|level| contours().map(|c| c.vertices_at(level).count()).sum())
            .collect()
    }
}
