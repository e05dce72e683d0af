//! Views, contours and the polytope that connects them (section 4 of the paper).

use glam::{DVec2, DVec3};
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
    /// The part of the model whose outline this is. Contours of one part do not overlap; those of several parts may, and what any of
    /// them holds is inside.
    pub part: u16,
}

/// A viewpoint with the silhouette seen from it.
#[derive(Clone, Debug, PartialEq)]
pub struct CapturedView {
    /// The square camera of the capture.
    pub camera: Camera,
    /// All contours: outer ones and holes.
    pub contours: Vec<ViewContour>,
    /// In a map of photographs: the share of the outline's length that the photograph from here shows; the rest is the silhouette of
    /// the hull that all of them leave, and so is all of it where nobody took one. `None` where silhouettes are those of a mesh.
    pub photographed: Option<f64>,
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
    /// So many parts a map can have at most.
    pub const MOST_PARTS: u16 = 256;

    /// The sphere that holds the model.
    #[must_use]
    pub fn bounding_sphere(&self) -> BoundingSphere {
        BoundingSphere {
            center: self.center,
            radius: self.radius,
        }
    }

    /// Some of its views with a polytope of their own, over their new numbers.
    #[must_use]
    pub fn of_views(&self, kept: &[u32], triangles: Vec<[u32; 3]>) -> Self {
        Self {
            center: self.center,
            radius: self.radius,
            resolution_px: self.resolution_px,
            tolerance_px: self.tolerance_px,
            coverage: self.coverage,
            views: (kept.iter().map(|&v| self.views[v as usize].clone())).collect(),
            triangles,
        }
    }

    /// The viewpoint of a view, object space.
    #[must_use]
    pub fn eye(&self, view: u32) -> DVec3 {
        self.views[view as usize].camera.eye
    }

    /// How many parts of the model have outlines of their own.
    #[must_use]
    pub fn part_count(&self) -> usize {
        let parts = self.views.iter().flat_map(|v| &v.contours);
        parts.map(|c| usize::from(c.part) + 1).max().unwrap_or(0)
    }

    /// Whether every contour vertex has a depth.
    #[must_use]
    pub fn has_depth(&self) -> bool {
        self.views.iter().all(CapturedView::has_depth)
    }

    /// How much of what is seen from a place of the polytope rests on photographs: the mean share of three views, by their weights.
    /// `None` in the map of a mesh.
    #[must_use]
    pub fn covered(&self, triangle: u32, barycentric: [f64; 3]) -> Option<f64> {
        let views = self.triangles[triangle as usize];
        let shares = views.map(|v| self.views[v as usize].photographed);
        let is_of_photographs = shares.iter().any(Option::is_some);
        let weighted = shares.iter().zip(barycentric);
        is_of_photographs.then(|| {
            let covered: f64 = weighted.map(|(s, w)| s.unwrap_or(0.0) * w).sum();
            // Weights add up to 1 but for rounding.
            covered.clamp(0.0, 1.0)
        })
    }

    /// [`Self::covered`] on average over all directions from the center. `None` in the map of a mesh.
    #[must_use]
    pub fn covered_on_average(&self) -> Option<f64> {
        let (mut covered, mut whole) = (0.0, 0.0);
        for (t, views) in (0_u32..).zip(&self.triangles) {
            let [a, b, c] = views.map(|v| (self.eye(v) - self.center).normalize_or_zero());
            // The solid angle, by van Oosterom and Strackee, 1983; weights vary about evenly over it.
            let across = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
            let angle = 2.0 * a.dot(b.cross(c)).abs().atan2(across);
            covered += angle * self.covered(t, [1.0 / 3.0; 3])?;
            whole += angle;
        }
        (whole > 0.0).then(|| covered / whole)
    }

    /// The most contour vertices that any view has of each part.
    pub(crate) fn part_vertex_counts(&self) -> Vec<usize> {
        let mut most = vec![0; self.part_count()];
        let mut of_view = most.clone();
        for view in &self.views {
            of_view.fill(0);
            for contour in &view.contours {
                of_view[usize::from(contour.part)] += contour.points.len();
            }
            for (most, n) in most.iter_mut().zip(&of_view) {
                *most = (*most).max(*n);
            }
        }
        most
    }

    /// Contour vertices of each view.
    pub fn contour_vertex_counts(&self) -> impl Iterator<Item = usize> + '_ {
        self.views
            .iter()
            .map(|v| v.contours.iter().map(|c| c.points.len()).sum())
    }
}
