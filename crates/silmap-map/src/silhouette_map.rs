//! Views, contours and the polytope that connects them (section 4 of the paper).

use glam::{DVec2, DVec3};
use silmap_geometry::camera::FIT_MARGIN;
use silmap_geometry::{Camera, CoverageRule};

/// One closed contour of a captured view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewContour {
    /// Vertices in pixels of the capture image; outer contours have positive area, holes negative.
    pub points: Vec<DVec2>,
    /// Per vertex: distance along the camera's `forward` to the point of the contour generator that is seen there; empty
    /// when the capture recorded none.
    pub depths: Vec<f64>,
    /// Per vertex: the coarsest level of detail that has it, at most [`Self::COARSEST_LEVEL`], which at least three vertices
    /// have. Empty when the contour is always drawn whole.
    pub levels: Vec<u8>,
}

impl ViewContour {
    /// The coarsest level of detail. Level k stays within 2ᵏ times the map's tolerance of the traced outline.
    pub const COARSEST_LEVEL: u8 = 6;

    /// Indices of the vertices that a level of detail has, in their order.
    pub fn vertices_at(&self, level: u8) -> impl Iterator<Item = usize> + '_ {
        let is_whole = level == 0 || self.levels.len() != self.points.len();
        (0..self.points.len()).filter(move |&k| is_whole || self.levels[k] >= level)
    }
}

/// A viewpoint with the silhouette seen from it.
#[derive(Clone, Debug, PartialEq)]
pub struct CapturedView {
    /// The square camera of the capture.
    pub camera: Camera,
    /// All contours: outer ones and holes.
    pub contours: Vec<ViewContour>,
}

impl CapturedView {
    /// Whether every contour vertex has a depth.
    #[must_use]
    pub fn has_depth(&self) -> bool {
        (self.contours.iter()).all(|c| c.depths.len() == c.points.len())
    }
}

/// The silhouettes of a model from the vertices of a star-shaped polytope around it.
#[derive(Clone, Debug, PartialEq)]
pub struct SilhouetteMap {
    /// The point that every polytope triangle faces; middle of the model's box.
    pub center: DVec3,
    /// Radius of the model's bounding sphere about `center`.
    pub radius: f64,
    /// Side of the square capture images, pixels.
    pub resolution_px: u32,
    /// How far a contour may lie from the traced pixel outline, pixels.
    pub tolerance_px: f64,
    /// The rule the silhouettes were captured with.
    pub coverage: CoverageRule,
    /// The views; their eyes are the polytope's vertices.
    pub views: Vec<CapturedView>,
    /// Triangles over `views`, counter-clockwise seen from outside: each has positive volume with `center`.
    pub triangles: Vec<[u32; 3]>,
}

/// The sphere that holds the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// Its middle, object space.
    pub center: DVec3,
    /// Its radius, model units.
    pub radius: f64,
}

impl SilhouetteMap {
    /// The sphere that holds the model.
    #[must_use]
    pub fn bounding_sphere(&self) -> BoundingSphere {
        BoundingSphere {
            center: self.center,
            radius: self.radius,
        }
    }

    /// The viewpoint of a view, object space.
    #[must_use]
    pub fn eye(&self, view: u32) -> DVec3 {
        self.views[view as usize].camera.eye
    }

    /// Whether every contour vertex has a depth.
    #[must_use]
    pub fn has_depth(&self) -> bool {
        self.views.iter().all(CapturedView::has_depth)
    }

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

    /// Contour vertices of each view.
    pub fn contour_vertex_counts(&self) -> impl Iterator<Item = usize> + '_ {
        self.views
            .iter()
            .map(|v| v.contours.iter().map(|c| c.points.len()).sum())
    }
}
