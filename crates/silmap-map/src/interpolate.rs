//! The silhouette for any eye, from the three nearby views (sections 5 and 5.1).
//!
//! Source: Silhouette Mapping, sections 5 (`3dSillInterp`) and 5.1 (`triSillInterp`): locate the triangle, interpolate along
//! the edge nearest to the point p_t on it, then between that and the third view, then map to the eye by the homography of
//! the plane through the center parallel to the triangle.
//! Deviation: method [`Method::Hull`] does this in all three orders, with all pairs of intervals as far as they can meet in the
//! bounding sphere, and intersects: each order is conservative, so the intersection is, and it depends on no nearest edge.

use glam::{DMat3, DVec3};
use silmap_geometry::{Camera, Loop};
use thiserror::Error;

use crate::epipolar::{image_from_object, object_from_image};
use crate::intersect::IntersectScratch;
use crate::linear::{LinearScratch, Pairing, Seen, object_from_epipolar, project_loops};
use crate::loops::FlatLoops;
use crate::polytope::{Location, Polytope, PolytopeError};
use crate::{BoundingSphere, CapturedView, SilhouetteMap};

/// How silhouettes are interpolated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Method {
    /// The 1999 paper's: nearest edge first, cliques by tracking frontier points.
    Paper,
    /// All pairs of intervals in all three orders, intersected: conservative and tighter than any one order.
    #[default]
    Hull,
}

impl Method {
    /// All methods, in the order of their names in reports.
    pub const ALL: [Self; 2] = [Self::Paper, Self::Hull];

    /// The name users type.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Hull => "hull",
        }
    }
}

/// Why there is no outline.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum InterpolateError {
    /// The eye lies in the model's bounding sphere.
    #[error(
        "the eye is {distance} from the center, inside the bounding sphere of radius {radius}: move it farther out"
    )]
    EyeInsideBounds {
        /// Distance from the eye to the center, model units.
        distance: f64,
        /// Radius of the bounding sphere, model units.
        radius: f64,
    },
    /// The map's triangles are not a star-shaped polytope.
    #[error(transparent)]
    Polytope(#[from] PolytopeError),
    /// Two views are too far apart to be rectified.
    #[error("views {one} and {two} of the silhouette map are too far apart to interpolate between")]
    ViewsTooFarApart {
        /// One view.
        one: u32,
        /// The other.
        two: u32,
    },
}

/// The outline of the model from one eye.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// The polytope triangle that faces the eye.
    pub triangle: u32,
    /// Weights of its three views.
    pub barycentric: [f64; 3],
    /// Regions in pixels of the camera, to be intersected: one for [`Method::Paper`], three for [`Method::Hull`]. The loops of a
    /// region are simple, do not overlap, and have positive area outside and negative area for holes.
    pub layers: Vec<Vec<Loop>>,
    simple: Vec<Loop>,
}

impl Outline {
    /// The intersection of all layers as simple loops that do not overlap.
    #[must_use]
    pub fn simple_loops(&self) -> &[Loop] {
        &self.simple
    }
}

/// A map prepared for reading, with every buffer that reading needs.
#[derive(Clone, Debug)]
pub struct Scratch {
    polytope: Polytope,
    last_triangle: u32,
    triangle: TriangleInterpolator,
    intersect: IntersectScratch,
    simple: FlatLoops,
}

impl Scratch {
    /// Prepares `map`.
    ///
    /// # Errors
    /// When its triangles are not a star-shaped polytope.
    pub fn new(map: &SilhouetteMap) -> Result<Self, PolytopeError> {
        Ok(Self {
            polytope: Polytope::new(map)?,
            last_triangle: 0,
            triangle: TriangleInterpolator::default(),
            intersect: IntersectScratch::default(),
            simple: FlatLoops::default(),
        })
    }
}

/// The outline of the model that `map` describes, in pixels of `camera`.
///
/// `scratch` was made from the same map; it remembers the last triangle, so that a moving eye is located by walking.
///
/// # Errors
/// When the eye lies in the model's bounding sphere, or the map is broken.
pub fn outline(
    map: &SilhouetteMap,
    camera: &Camera,
    method: Method,
    scratch: &mut Scratch,
) -> Result<Outline, InterpolateError> {
    let distance = camera.eye.distance(map.center);
    let location = scratch
        .polytope
        .locate(camera.eye, scratch.last_triangle)
        .filter(|_| distance > map.radius)
        .ok_or(InterpolateError::EyeInsideBounds {
            distance,
            radius: map.radius,
        })?;
    scratch.last_triangle = location.triangle;
    let ids = map.triangles[location.triangle as usize];
    let views = ids.map(|v| &map.views[v as usize]);
    let layers = scratch
        .triangle
        .interpolate(map.bounding_sphere(), views, &location, camera, method)
        .map_err(|(i, j)| InterpolateError::ViewsTooFarApart {
            one: ids[i],
            two: ids[j],
        })?;
    let simple = match layers {
        [a, b, c] => {
            scratch.intersect.intersect([a, b, c], &mut scratch.simple);
            scratch.simple.to_loops()
        }
        _ => layers.iter().flat_map(FlatLoops::to_loops).collect(),
    };
    Ok(Outline {
        triangle: location.triangle,
        barycentric: location.barycentric,
        layers: layers.iter().map(FlatLoops::to_loops).collect(),
        simple,
    })
}

/// Two-step interpolation within one triangle of views.
#[derive(Clone, Debug, Default)]
pub struct TriangleInterpolator {
    linear: LinearScratch,
    captured: [FlatLoops; 3],
    edge: FlatLoops,
    inner: FlatLoops,
    layers: [FlatLoops; 3],
}

/// With a weight this close to 1 the eye is at a captured viewpoint, and the captured silhouette is the answer.
const AT_VIEW: f64 = 1.0 - 1e-9;

impl TriangleInterpolator {
    /// The silhouette from `location` between three views, mapped to `camera`: the regions to be intersected.
    ///
    /// # Errors
    /// The two corners that cannot be rectified with each other.
    pub fn interpolate(
        &mut self,
        sphere: BoundingSphere,
        views: [&CapturedView; 3],
        location: &Location,
        camera: &Camera,
        method: Method,
    ) -> Result<&[FlatLoops], (usize, usize)> {
        let eyes = views.map(|v| v.camera.eye);
        let normal = (eyes[1] - eyes[0]).cross(eyes[2] - eyes[0]);
        let image_from_rays = image_from_object(camera)
            * plane_homography(sphere.center, normal, location.point, camera.eye);
        for (captured, view) in self.captured.iter_mut().zip(views) {
            captured.assign(view.contours.iter().map(|c| c.points.as_slice()));
        }
        let weights = location.barycentric;
        let n_layers = if method == Method::Hull { 3 } else { 1 };
        if let Some(k) = weights.iter().position(|&w| w >= AT_VIEW) {
            let matrix = image_from_rays * object_from_image(&views[k].camera);
            for layer in &mut self.layers[..n_layers] {
                project_loops(&self.captured[k], &matrix, layer);
            }
            return Ok(&self.layers[..n_layers]);
        }
        match method {
            Method::Paper => {
                let last = opposite_to_nearest_edge(&eyes, location);
                self.two_steps(sphere, views, location, last, Pairing::Cliques)
                    .map(|matrix| {
                        project_loops(
                            &self.inner,
                            &(image_from_rays * matrix),
                            &mut self.layers[0],
                        )
                    })?;
            }
            Method::Hull => {
                for last in 0..3 {
                    let matrix = self.two_steps(
                        sphere,
                        views,
                        location,
                        last,
                        Pairing::Within {
                            radius: sphere.radius,
                        },
                    )?;
                    project_loops(
                        &self.inner,
                        &(image_from_rays * matrix),
                        &mut self.layers[last],
                    );
                }
            }
        }
        Ok(&self.layers[..n_layers])
    }

    /// Interpolates along the edge opposite to corner `last`, then towards that corner (`triSillInterp`). The result is in
    /// `self.inner`; returns the matrix from its coordinates to rays.
    fn two_steps(
        &mut self,
        sphere: BoundingSphere,
        views: [&CapturedView; 3],
        location: &Location,
        last: usize,
        pairing: Pairing,
    ) -> Result<DMat3, (usize, usize)> {
        let (i, j) = ((last + 1) % 3, (last + 2) % 3);
        let (w_i, w_j) = (location.barycentric[i], location.barycentric[j]);
        let alpha = w_j / (w_i + w_j);
        let captured = |k: usize| Seen {
            eye: views[k].camera.eye,
            loops: &self.captured[k],
            object_from_loops: object_from_image(&views[k].camera),
        };
        let edge_frame = self
            .linear
            .interpolate(
                (captured(i), captured(j)),
                sphere.center,
                alpha,
                pairing,
                &mut self.edge,
            )
            .ok_or((i, j))?;
        let on_edge = Seen {
            eye: views[i].camera.eye.lerp(views[j].camera.eye, alpha),
            loops: &self.edge,
            object_from_loops: object_from_epipolar(&edge_frame),
        };
        let towards = location.barycentric[last];
        let frame = self
            .linear
            .interpolate(
                (on_edge, captured(last)),
                sphere.center,
                towards,
                pairing,
                &mut self.inner,
            )
            .ok_or((i, last))?;
        Ok(object_from_epipolar(&frame))
    }
}

/// The corner opposite to the edge nearest to the located point.
fn opposite_to_nearest_edge(eyes: &[DVec3; 3], location: &Location) -> usize {
    // A corner's weight is the distance to the opposite edge over the triangle's height there.
    let distance =
        |k: usize| location.barycentric[k] / eyes[(k + 1) % 3].distance(eyes[(k + 2) % 3]);
    (0..3)
        .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(0)
}

/// From rays at `from` to rays at `to` that meet them on the plane through `center` with `normal`, up to positive scale
/// (section 5, footnote 2).
fn plane_homography(center: DVec3, normal: DVec3, from: DVec3, to: DVec3) -> DMat3 {
    // A ray d from p_t meets the plane at p_t + d·(n·(c − p_t))/(n·d); times n·d, seen from p_c.
    let towards = if normal.dot(center - from) < 0.0 {
        -normal
    } else {
        normal
    };
    let reach = towards.dot(center - from);
    let shift = from - to;
    let outer = DMat3::from_cols(shift * towards.x, shift * towards.y, shift * towards.z);
    DMat3::from_diagonal(DVec3::splat(reach)) + outer
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn the_homography_meets_points_of_the_plane() {
        let (center, normal) = (DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.2, 0.5, 1.0));
        let (from, to) = (DVec3::new(0.5, 0.3, 4.0), DVec3::new(-1.0, 2.0, 7.0));
        let across = normal.any_orthogonal_vector();
        let point = center + across * 0.7;
        let mapped = plane_homography(center, normal, from, to) * (point - from);
        assert!(mapped.cross(point - to).length() < 1e-9 && mapped.dot(point - to) > 0.0);
        let same = plane_homography(center, normal, from, from) * DVec2::new(0.1, 0.2).extend(-1.0);
        assert!(same.cross(DVec3::new(0.1, 0.2, -1.0)).length() < 1e-9);
    }
}
