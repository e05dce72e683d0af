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
use crate::epipolar::{EpipolarFrame, object_from_image};
use crate::interpolation::{InterpolateError, Interpolation};
use crate::locate::Location;
use crate::loops::{DeepLoops, SeenLoops};
use crate::pair_cache::{
    PairCache, RectifiedPair, RectifyParams, TURN_TANGENT, ViewedSilhouette, assign_contours,
    object_from_epipolar,
};
use crate::polytope_outline::{OutlineCarrier, PolytopeOutline};
use crate::rule::PairInterpolator;
use crate::rule::method::Method;

/// Interpolation within one triangle of views.
#[derive(Clone, Debug, Default)]
pub struct TriangleInterpolator {
    edges: PairCache,
    linear: PairInterpolator,
    inner_pair: RectifiedPair,
    captured: DeepLoops,
    on_edges: [DeepLoops; 2],
    outline: PolytopeOutline,
    carrier: OutlineCarrier,
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
    /// The outline from a point of the polytope, at a level of detail. One interpolator serves one map: it keeps what it has prepared
    /// of it.
    ///
    /// # Errors
    /// The two views that cannot be rectified with each other.
    pub(crate) fn interpolate(
        &mut self,
        map: &SilhouetteMap,
        location: &Location,
        (method, level): (Method, u8),
        outline: &mut PolytopeOutline,
    ) -> Result<(), InterpolateError> {
        let ids = map.triangles[location.triangle as usize];
        let between = Between {
            map,
            ids,
            weights: location.barycentric,
            level,
            method,
        };
        (self.fill(&between, location.point, outline)).map_err(|(i, j)| {
            InterpolateError::ViewsTooFarApart {
                one: ids[i],
                two: ids[j],
            }
        })
    }

    /// The silhouette from `location` between the views `ids` of `map`, mapped to `camera`: each order of the views gives its own
    /// region, all of which cover what is inside. There are three for [`Method::Hull`], else one.
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
        let mut outline = std::mem::take(&mut self.outline);
        let filled = self.fill(&between, location.point, &mut outline);
        self.outline = outline;
        filled?;
        Ok((self.carrier).carry_regions(&self.outline, map, camera, how.transfer))
    }

    /// Fills in all but the pieces.
    fn fill(
        &mut self,
        between: &Between<'_>,
        point: DVec3,
        outline: &mut PolytopeOutline,
    ) -> Result<(), (usize, usize)> {
        let map = between.map;
        let views = between.ids.map(|v| &map.views[v as usize]);
        let [a, b, c] = [0, 1, 2].map(|k| between.eye(k));
        outline.point = point;
        outline.normal = (b - a).cross(c - a);
        outline.has_depth = views.iter().all(|v| v.has_depth());
        outline.count = between.method.region_count();
        let at_view = between.weights.iter().position(|&w| w >= AT_VIEW);
        for k in 0..outline.count {
            let region = &mut outline.regions[k];
            region.is_frame = at_view.is_none();
            region.rays_from_loops = match (at_view, between.method) {
                (Some(corner), _) => {
                    let view = views[corner];
                    let sphere = map.bounding_sphere();
                    assign_contours(&mut region.loops, view, sphere, between.level);
                    object_from_image(&view.camera)
                }
                (None, Method::Paper) => {
                    let last = opposite_to_nearest_edge(between);
                    self.two_steps(between, last, &mut region.loops)?
                }
                (None, Method::Hull) => self.two_steps(between, k, &mut region.loops)?,
                (None, Method::Tight) => self.along_longest_edge(between, &mut region.loops)?,
            };
        }
        Ok(())
    }

    /// Interpolates along the edge opposite to corner `last`, then towards that corner (`triSillInterp`). Returns
    /// the matrix from the coordinates of the result to rays.
    fn two_steps(
        &mut self,
        between: &Between<'_>,
        last: usize,
        output: &mut DeepLoops,
    ) -> Result<DMat3, (usize, usize)> {
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
        self.linear
            .interpolate(self.inner_pair.parts_mut(), towards, between.method, output);
        Ok(object_from_epipolar(&frame))
    }

    /// Interpolates on the two shorter edges, to where the line through the eye along the longest one meets them, and then on
    /// that line. Returns the matrix from the coordinates of the result to rays.
    ///
    /// Source: beyond the paper; the side-to-side scheme of Barnhill, Birkhoff and Gordon, Smooth Interpolation in Triangles, 1973,
    /// with silhouettes in the place of numbers. Deviation: one direction per triangle, not the mean of all three: it is continuous
    /// within the triangle, and on each edge it is what that edge's own two views give, so that neighbours agree.
    fn along_longest_edge(
        &mut self,
        between: &Between<'_>,
        output: &mut DeepLoops,
    ) -> Result<DMat3, (usize, usize)> {
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
        self.linear
            .interpolate(self.inner_pair.parts_mut(), alpha, between.method, output);
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
            pair.parts_mut(),
            alpha,
            between.method,
            &mut self.on_edges[n],
        );
        Ok(frame)
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
