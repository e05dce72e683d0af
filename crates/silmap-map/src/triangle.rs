//! The silhouette from a point of the polytope, by the three views of its triangle (sections 5 and 5.1).
//!
//! Source: Silhouette Mapping, sections 5 (`3dSillInterp`) and 5.1 (`triSillInterp`): locate the triangle, interpolate along
//! the edge nearest to the point p_t on it, then between that and the third view, then map to the eye by the homography of
//! the plane through the center parallel to the triangle.
//! Deviation: method [`Method::Hull`] does this in all three orders, with all pairs of intervals as far as they can meet in the
//! bounding sphere, and intersects: each order is conservative, so the intersection is, and it depends on no nearest edge.
//! [`Method::Tight`] interpolates on two edges and then on a line between them: see `along_longest_edge`.

use glam::{DMat3, DVec3};
use silmap_geometry::Camera;

use crate::SilhouetteMap;
use crate::epipolar::{EpipolarFrame, image_from_object, object_from_image};
use crate::interpolation::{InterpolateError, Interpolation, Transfer};
use crate::locate::Location;
use crate::loops::{DeepLoops, SeenLoops};
use crate::pair_cache::{
    PairCache, RectifiedPair, RectifyParams, TURN_TANGENT, ViewedSilhouette, assign_contours,
    object_from_epipolar,
};
use crate::project::{Projection, Round, project_loops};
use crate::rule::PairInterpolator;
use crate::rule::method::Method;
use crate::sweep::intersection::RegionIntersection;

/// Interpolation within one triangle of views.
#[derive(Clone, Debug, Default)]
pub struct TriangleInterpolator {
    edges: PairCache,
    linear: PairInterpolator,
    inner_pair: RectifiedPair,
    captured: DeepLoops,
    on_edges: [DeepLoops; 2],
    inner: DeepLoops,
    regions: [SeenLoops; 3],
    intersection: RegionIntersection,
    shared: SeenLoops,
}

/// As [`TURN_TANGENT`], between two outlines that were interpolated already and have more small turns: most of a pixel of a 512² capture.
const TURN_TANGENT_INNER: f64 = 1e-3;

/// With a weight this close to 1 the eye is at a captured viewpoint, and the captured silhouette is the answer.
const AT_VIEW: f64 = 1.0 - 1e-9;

/// An eye between three views of a map.
#[derive(Clone, Copy, Debug)]
struct Between<'a> {
    map: &'a SilhouetteMap,
    ids: [u32; 3],
    weights: [f64; 3],
    level: u8,
    method: Method,
}

impl Between<'_> {
    fn eye(&self, corner: usize) -> DVec3 {
        self.map.eye(self.ids[corner])
    }

    fn rectify_params(&self, turn_tangent: f64) -> RectifyParams {
        RectifyParams {
            center: self.map.center,
            radius: Some(self.map.radius),
            turn_tangent,
        }
    }
}

impl TriangleInterpolator {
    /// The silhouette from `location` between the views `ids` of `map`, mapped to `camera`: simple loops that do not overlap where
    /// it is the intersection of several regions, else one region. One interpolator serves one map: it keeps what it has prepared
    /// of it.
    ///
    /// # Errors
    /// The two views that cannot be rectified with each other.
    pub(crate) fn interpolate(
        &mut self,
        map: &SilhouetteMap,
        location: &Location,
        camera: &Camera,
        how: Interpolation,
    ) -> Result<&SeenLoops, InterpolateError> {
        let ids = map.triangles[location.triangle as usize];
        let regions = self.interpolate_regions(map, ids, location, camera, how);
        let count = regions.map(<[_]>::len);
        let count = count.map_err(|(i, j)| InterpolateError::ViewsTooFarApart {
            one: ids[i],
            two: ids[j],
        })?;
        if count == 1 {
            return Ok(&self.regions[0]);
        }
        self.intersection
            .intersect(self.regions.each_ref(), &mut self.shared);
        Ok(&self.shared)
    }

    /// As an outline is interpolated between the views `ids` of `map`, but each order of the views gives its own region: all cover
    /// what is inside. There are three for [`Method::Hull`], else one.
    ///
    /// # Errors
    /// The two corners that cannot be rectified with each other.
    pub fn interpolate_regions(
        &mut self,
        map: &SilhouetteMap,
        ids: [u32; 3],
        location: &Location,
        camera: &Camera,
        how: Interpolation,
    ) -> Result<&[SeenLoops], (usize, usize)> {
        let between = Between {
            map,
            ids,
            weights: location.barycentric,
            level: how.detail.level(map, camera),
            method: how.method,
        };
        let views = ids.map(|v| &map.views[v as usize]);
        let has_depth = views.iter().all(|v| v.has_depth());
        let to_camera = projection(&between, location, camera, has_depth, how.transfer);
        let count = how.method.region_count();
        if let Some(k) = (location.barycentric.iter()).position(|&w| w >= AT_VIEW) {
            let sphere = map.bounding_sphere();
            assign_contours(&mut self.captured, views[k], sphere, between.level);
            let to_camera = to_camera.after(object_from_image(&views[k].camera));
            for region in &mut self.regions[..count] {
                project_loops(&self.captured, &to_camera, region);
            }
            return Ok(&self.regions[..count]);
        }
        for k in 0..count {
            let object_from_loops = match how.method {
                Method::Paper => self.two_steps(&between, opposite_to_nearest_edge(&between))?,
                Method::Hull => self.two_steps(&between, k)?,
                Method::Tight => self.along_longest_edge(&between)?,
            };
            let to_camera = to_camera.after_frame(object_from_loops);
            project_loops(&self.inner, &to_camera, &mut self.regions[k]);
        }
        Ok(&self.regions[..count])
    }

    /// Interpolates along the edge opposite to corner `last`, then towards that corner (`triSillInterp`). The result is in
    /// `self.inner`; returns the matrix from its coordinates to rays.
    fn two_steps(&mut self, between: &Between<'_>, last: usize) -> Result<DMat3, (usize, usize)> {
        let (i, j) = ((last + 1) % 3, (last + 2) % 3);
        let (w_i, w_j) = (between.weights[i], between.weights[j]);
        let alpha = w_j / (w_i + w_j);
        let edge_frame = self.on_edge(0, between, (i, j), alpha)?;
        let view = &between.map.views[between.ids[last] as usize];
        let sphere = between.map.bounding_sphere();
        assign_contours(&mut self.captured, view, sphere, between.level);
        let on_edge = ViewedSilhouette {
            eye: between.eye(i).lerp(between.eye(j), alpha),
            loops: &self.on_edges[0],
            object_from_loops: object_from_epipolar(&edge_frame),
        };
        let captured = ViewedSilhouette {
            eye: view.camera.eye,
            loops: &self.captured,
            object_from_loops: object_from_image(&view.camera),
        };
        let frame = (self.inner_pair)
            .assign([on_edge, captured], &between.rectify_params(TURN_TANGENT))
            .ok_or((i, last))?;
        let towards = between.weights[last];
        self.linear.interpolate(
            &mut self.inner_pair.silhouettes,
            towards,
            between.method,
            &mut self.inner,
        );
        Ok(object_from_epipolar(&frame))
    }

    /// Interpolates on the two shorter edges, to where the line through the eye along the longest one meets them, and then on
    /// that line. The result is in `self.inner`; returns the matrix from its coordinates to rays.
    ///
    /// Source: beyond the paper; the side-to-side scheme of Barnhill, Birkhoff and Gordon, Smooth Interpolation in Triangles, 1973,
    /// with silhouettes in the place of numbers. Deviation: one direction per triangle, not the mean of all three: it is continuous
    /// within the triangle, and on each edge it is what that edge's own two views give, so that neighbours agree.
    fn along_longest_edge(&mut self, between: &Between<'_>) -> Result<DMat3, (usize, usize)> {
        let length = |k: usize| between.eye((k + 1) % 3).distance(between.eye((k + 2) % 3));
        let apex = (0..3).fold(0, |best, k| if length(k) > length(best) { k } else { best });
        let (i, j) = ((apex + 1) % 3, (apex + 2) % 3);
        let towards = between.weights[apex];
        let frames = [
            self.on_edge(0, between, (i, apex), towards)?,
            self.on_edge(1, between, (j, apex), towards)?,
        ];
        let [one, two] = [(i, 0), (j, 1)].map(|(k, n)| ViewedSilhouette {
            eye: between.eye(k).lerp(between.eye(apex), towards),
            loops: &self.on_edges[n],
            object_from_loops: object_from_epipolar(&frames[n]),
        });
        let frame = (self.inner_pair)
            .assign([one, two], &between.rectify_params(TURN_TANGENT_INNER))
            .ok_or((i, j))?;
        let (w_i, w_j) = (between.weights[i], between.weights[j]);
        let alpha = w_j / (w_i + w_j);
        self.linear.interpolate(
            &mut self.inner_pair.silhouettes,
            alpha,
            between.method,
            &mut self.inner,
        );
        Ok(object_from_epipolar(&frame))
    }

    /// Interpolates between two corners into buffer `n` of `self.on_edges`; returns the frame of the result. It is the same
    /// whichever triangle the edge is seen as part of.
    fn on_edge(
        &mut self,
        n: usize,
        between: &Between<'_>,
        (from, to): (usize, usize),
        alpha: f64,
    ) -> Result<EpipolarFrame, (usize, usize)> {
        let (a, b) = (between.ids[from], between.ids[to]);
        let (views, alpha) = if a < b {
            ([a, b], alpha)
        } else {
            ([b, a], 1.0 - alpha)
        };
        let pair = (self.edges.pair(between.map, views, between.level)).ok_or((from, to))?;
        let frame = *pair.frame().ok_or((from, to))?;
        self.linear.interpolate(
            &mut pair.silhouettes,
            alpha,
            between.method,
            &mut self.on_edges[n],
        );
        Ok(frame)
    }
}

/// An eye closer than this to the located point, in radii of the bounding sphere, is there.
const ON_POLYTOPE: f64 = 1e-9;

/// How the outline from the located point is carried to the eye.
fn projection(
    between: &Between<'_>,
    location: &Location,
    camera: &Camera,
    has_depth: bool,
    transfer: Transfer,
) -> Projection {
    let image_from_rays = image_from_object(camera);
    if has_depth && transfer != Transfer::Homography {
        let offset = camera.eye - location.point;
        let radius = between.map.radius;
        let round = Round { offset, radius };
        return Projection {
            matrix: image_from_rays,
            shift: -(image_from_rays * offset),
            round: (offset.length() > ON_POLYTOPE * radius).then_some(round),
            keeps_depth: true,
        };
    }
    let [a, b, c] = [0, 1, 2].map(|k| between.eye(k));
    let normal = (b - a).cross(c - a);
    let homography = plane_homography(between.map.center, normal, location.point, camera.eye);
    Projection {
        matrix: image_from_rays * homography,
        shift: DVec3::ZERO,
        round: None,
        keeps_depth: false,
    }
}

/// The corner opposite to the edge nearest to the eye.
fn opposite_to_nearest_edge(between: &Between<'_>) -> usize {
    // A corner's weight is the distance to the opposite edge over the triangle's height there.
    let distance = |k: usize| {
        let edge = between.eye((k + 1) % 3).distance(between.eye((k + 2) % 3));
        between.weights[k] / edge
    };
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
