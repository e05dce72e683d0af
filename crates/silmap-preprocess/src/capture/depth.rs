//! Depths of the contour generator at the vertices of an outline.
//!
//! A ray just inside the outline enters the object shortly before the point where the ray along the outline touches it, and
//! leaves it shortly after. At a distance δ inside, on a surface of radius of curvature ρ, each is √(2ρδ) from the
//! touching point, one in front and one behind, so their mean is right to first order where either alone is far off.
//!
//! A contour vertex lies somewhere near the outline. A ray through it is moved across the outline, along the
//! outline's normal, until it just hits.

use glam::DVec2;
use silmap_geometry::bvh::Bvh;
use silmap_geometry::{Bounds, Camera, Loop};

use super::rim_edges::RimEdges;

/// Places, in pixels from a vertex across the outline, where the search for the object's edge looks: the traced outline
/// is rarely more than a pixel off.
const REACH_PX: [f64; 6] = [0.25, 0.5, 1.0, 1.5, 2.5, 4.0];
/// Where nothing is hit across the outline (wires thinner than a pixel), places on circles of these radii are tried, pixels.
const CIRCLES_PX: [f64; 4] = [0.4, 0.8, 1.2, 1.8];
/// Directions tried on each circle.
const CIRCLE_STEPS: u32 = 12;
/// Halvings between a hit and a miss, from a quarter of a pixel to a 64th: the error that is left is of second order.
const HALVINGS: u32 = 4;
/// Two hits closer than this share of the bounding radius are one: a ray through the edge that two faces share.
const SAME_HIT_REL: f64 = 1e-10;

/// For each vertex of each loop, the distance along the camera's `forward` to the point of the contour generator seen there.
///
/// `loops` are outlines of the object as `camera` sees it, in pixels, the object on the side where positive loops have
/// their inside. Where no ray near a vertex hits the object (a part thinner than a few hundredths of a pixel) the depth
/// comes from the nearest vertex along the loop that has one, and is that of the object's center when none has.
#[must_use]
pub fn tangent_depths(
    bvh: &Bvh,
    bounds: &Bounds,
    camera: &Camera,
    loops: &[Loop],
) -> Vec<Vec<f64>> {
    vertex_depths(
        &Probe::new(bvh, bounds, camera),
        loops,
        camera.depth(bounds.center),
    )
}

/// As [`tangent_depths`]; `otherwise` where nothing is found.
pub(super) fn vertex_depths(probe: &Probe<'_>, loops: &[Loop], otherwise: f64) -> Vec<Vec<f64>> {
    loops
        .iter()
        .map(|points| {
            let found: Vec<Option<f64>> = (0..points.len())
                .map(|k| probe.depth_at(points[k], inward(points, k)))
                .collect();
            fill_gaps(points, &found, otherwise)
        })
        .collect()
}

/// For each vertex of each loop, how deep the edge is that is seen there; `None` where none is near.
pub(crate) fn edge_depths(edges: &RimEdges, loops: &[Loop]) -> Vec<Vec<Option<f64>>> {
    let of_loop = |points: &Loop| {
        let depth = |k: usize| edges.depth_at(points[k], inward(points, k));
        (0..points.len()).map(depth).collect()
    };
    loops.iter().map(of_loop).collect()
}

/// Unit vector from vertex `k` into the region, halfway between the normals of its edges.
fn inward(points: &Loop, k: usize) -> DVec2 {
    let n = points.len();
    let along = |from: usize, to: usize| (points[to] - points[from]).normalize_or_zero();
    let (before, after) = (along((k + n - 1) % n, k), along(k, (k + 1) % n));
    // At a spike that turns back on itself the two cancel; then inside is backwards.
    (before + after)
        .try_normalize()
        .map_or(-before, DVec2::perp)
}

/// Gives vertices without a depth that of the nearest one along the loop.
fn fill_gaps(points: &Loop, found: &[Option<f64>], otherwise: f64) -> Vec<f64> {
    let n = points.len();
    let nearest = |k: usize, step: usize| {
        let mut travelled = 0.0;
        let mut at = k;
        for _ in 0..n {
            if let Some(depth) = found[at] {
                return Some((travelled, depth));
            }
            let next = (at + step) % n;
            travelled += points[at].distance(points[next]);
            at = next;
        }
        None
    };
    (0..n)
        .map(|k| match (nearest(k, 1), nearest(k, n - 1)) {
            (Some(ahead), Some(behind)) if behind.0 < ahead.0 => behind.1,
            (Some(ahead), _) => ahead.1,
            (None, _) => otherwise,
        })
        .collect()
}

/// Looks for the edge of an object along rays of a camera.
pub(super) struct Probe<'a> {
    bvh: &'a Bvh,
    camera: &'a Camera,
    same_hit: f64,
    /// Where rays need not be followed.
    edges: Option<&'a RimEdges>,
}

impl<'a> Probe<'a> {
    /// Of the object in `bvh`, with its bounds, as `camera` sees it.
    pub(super) fn new(bvh: &'a Bvh, bounds: &Bounds, camera: &'a Camera) -> Self {
        Self {
            bvh,
            camera,
            same_hit: SAME_HIT_REL * bounds.radius,
            edges: None,
        }
    }

    /// Looks depths up at these edges first.
    pub(super) fn with_edges(self, edges: Option<&'a RimEdges>) -> Self {
        Self { edges, ..self }
    }

    fn hits(&self, p: DVec2) -> bool {
        let direction = self.camera.direction_from_image(p);
        self.bvh
            .first_hit(self.camera.eye, direction, 0.0, f64::INFINITY)
            .is_some()
    }

    /// Depth at the object's edge near `vertex`; `None` when the object is nowhere near.
    pub(super) fn depth_at(&self, vertex: DVec2, inward: DVec2) -> Option<f64> {
        let known = self.edges.and_then(|edges| edges.depth_at(vertex, inward));
        if known.is_some() {
            return known;
        }
        let (mut hit, mut miss) = self.bracket(vertex, inward)?;
        if let Some(miss) = &mut miss {
            for _ in 0..HALVINGS {
                let middle = (hit + *miss) * 0.5;
                if self.hits(middle) {
                    hit = middle;
                } else {
                    *miss = middle;
                }
            }
        }
        self.middle_of_first_solid(hit)
    }

    /// An image point that hits the object and, if there is one near, one that misses it.
    fn bracket(&self, vertex: DVec2, inward: DVec2) -> Option<(DVec2, Option<DVec2>)> {
        if self.hits(vertex) {
            let mut hit = vertex;
            for reach in REACH_PX {
                let p = vertex - inward * reach;
                if !self.hits(p) {
                    return Some((hit, Some(p)));
                }
                hit = p;
            }
            // The object goes on everywhere around: an outline within a gap too narrow to find.
            return Some((vertex, None));
        }
        let mut miss = vertex;
        for reach in REACH_PX {
            let p = vertex + inward * reach;
            if self.hits(p) {
                return Some((p, Some(miss)));
            }
            miss = p;
        }
        for radius in CIRCLES_PX {
            for step in 0..CIRCLE_STEPS {
                let angle = f64::from(step) / f64::from(CIRCLE_STEPS) * std::f64::consts::TAU;
                let p = vertex + DVec2::from_angle(angle) * radius;
                if self.hits(p) {
                    return Some((p, Some(vertex)));
                }
            }
        }
        None
    }

    /// Mean of the depths where the ray enters the object first and where it leaves it again.
    fn middle_of_first_solid(&self, p: DVec2) -> Option<f64> {
        // The ray's direction has forward part 1, so `t` is depth.
        let hits = self
            .bvh
            .all_hits(self.camera.eye, self.camera.direction_from_image(p));
        let enter = hits.first()?.t;
        // Solids that overlap count as one.
        let mut depth_in_solids = 0;
        let mut leave = enter;
        for (k, hit) in hits.iter().enumerate() {
            let is_repeated =
                k > 0 && hits[k - 1].enters == hit.enters && hit.t - hits[k - 1].t <= self.same_hit;
            if is_repeated {
                continue;
            }
            depth_in_solids += if hit.enters { 1 } else { -1 };
            leave = hit.t;
            if depth_in_solids <= 0 {
                break;
            }
        }
        Some((enter + leave) * 0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::cpu::rasterise;
    use crate::simplify_contour::{SimplifyContourParams, simplify_contours};
    use glam::DVec3;
    use silmap_geometry::trace::trace_contours;
    use silmap_geometry::{CoverageRule, Mask, TriangleMesh};
    use silmap_models as models;

    const SIZE_PX: u32 = 512;

    fn outline(mesh: &TriangleMesh, camera: &Camera) -> Vec<Loop> {
        let mut mask = Mask::new(camera.width_px, camera.height_px);
        rasterise(mesh, camera, CoverageRule::Center, &mut mask).unwrap();
        simplify_contours(&trace_contours(&mask), &SimplifyContourParams::default())
    }

    fn camera_at(direction: DVec3, bounds: &Bounds) -> Camera {
        let eye = bounds.center + direction.normalize_or_zero() * 3.0 * bounds.radius;
        Camera::fit_sphere(eye, bounds.center, bounds.radius, None, (SIZE_PX, SIZE_PX)).unwrap()
    }

    /// A sphere of radius 1 from a subdivided octahedron.
    fn sphere() -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        const N: i32 = 60;
        let mut ids = std::collections::BTreeMap::new();
        for signs in 0..8 {
            let sign = |bit: i32| if signs >> bit & 1 == 1 { -1 } else { 1 };
            let mut id = |i: i32, j: i32| {
                let key = [i * sign(0), j * sign(1), (N - i - j) * sign(2)];
                *ids.entry(key).or_insert_with(|| {
                    let p = DVec3::from(key.map(f64::from));
                    mesh.positions.push(p.normalize_or_zero());
                    mesh.positions.len() as u32 - 1
                })
            };
            for i in 0..N {
                for j in 0..N - i {
                    let mut faces = vec![[id(i, j), id(i + 1, j), id(i, j + 1)]];
                    if i + j < N - 1 {
                        faces.push([id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)]);
                    }
                    for mut face in faces {
                        if sign(0) * sign(1) * sign(2) < 0 {
                            face.swap(1, 2);
                        }
                        mesh.faces.push(face);
                    }
                }
            }
        }
        mesh
    }

    #[test]
    fn on_a_sphere_the_whole_rim_is_at_one_depth() {
        let mesh = sphere();
        let bounds = mesh.bounds();
        let bvh = Bvh::new(&mesh);
        let camera = camera_at(DVec3::new(0.3, 0.5, 1.0), &bounds);
        let loops = outline(&mesh, &camera);
        let depths = tangent_depths(&bvh, &bounds, &camera, &loops);
        // The rim is the circle of points with n·(p − eye) = 0, at distance d − R²/d from the eye's plane.
        let d = camera.eye.distance(bounds.center);
        let expected = d - 1.0 / d;
        assert!(depths[0].len() > 20);
        for depth in depths.iter().flatten() {
            assert!((depth - expected).abs() < 0.02, "{depth} is not {expected}");
        }
        // The nearest entry alone, half a pixel inside, is off by several times as much.
        let probe = Probe {
            bvh: &bvh,
            camera: &camera,
            same_hit: 0.0,
            edges: None,
        };
        let worst = (0..loops[0].len())
            .filter_map(|k| {
                let p = loops[0][k] + inward(&loops[0], k) * 0.5;
                let ray = camera.direction_from_image(p);
                let hit = probe.bvh.first_hit(camera.eye, ray, 0.0, f64::INFINITY)?;
                Some((hit.t - expected).abs())
            })
            .fold(0.0, f64::max);
        assert!(worst > 0.05, "the control is only {worst} off");
    }

    /// Offsets of outline points of the torus from the true contour generator, along the ray, for each vertex.
    fn torus_offsets(camera: &Camera, loops: &[Loop], depths: &[Vec<f64>]) -> Vec<f64> {
        let mut offsets: Vec<f64> = loops
            .iter()
            .flatten()
            .zip(depths.iter().flatten())
            .map(|(&vertex, &depth)| {
                let x = camera.object_from_image(vertex, depth);
                let ring = DVec3::new(x.x, x.y, 0.0).normalize_or_zero();
                let ray = camera.direction_from_image(vertex).normalize_or_zero();
                // On a tube the ray touches where it is nearest to the tube's core.
                (x - ring).dot(ray).abs()
            })
            .collect();
        offsets.sort_by(f64::total_cmp);
        offsets
    }

    #[test]
    fn on_a_torus_rays_touch_where_the_depth_says() {
        let mesh = models::torus(65_536);
        let bounds = mesh.bounds();
        let bvh = Bvh::new(&mesh);
        for direction in [
            DVec3::new(0.1, 0.3, 1.0),
            DVec3::new(1.0, 0.4, 0.9),
            DVec3::X,
        ] {
            let camera = camera_at(direction, &bounds);
            let loops = outline(&mesh, &camera);
            let depths = tangent_depths(&bvh, &bounds, &camera, &loops);
            let offsets = torus_offsets(&camera, &loops, &depths);
            let mean = offsets.iter().sum::<f64>() / offsets.len() as f64 / bounds.radius;
            let worst = offsets[offsets.len() - 1] / bounds.radius;
            eprintln!(
                "{} vertices, mean {mean:.5} worst {worst:.5}",
                offsets.len()
            );
            assert!(
                mean < 0.005 && worst < 0.015,
                "{direction}: mean {mean}, worst {worst}"
            );
            // Depths of another vertex are noticed.
            let mut shifted = depths.clone();
            shifted[0].rotate_left(offsets.len() / 8);
            let wrong = torus_offsets(&camera, &loops, &shifted);
            let wrong_mean = wrong.iter().sum::<f64>() / wrong.len() as f64 / bounds.radius;
            assert!(
                wrong_mean > 8.0 * mean,
                "the control is only {wrong_mean} off"
            );
        }
    }

    #[test]
    fn far_from_the_object_depth_is_that_of_its_center() {
        let mesh = sphere();
        let bounds = mesh.bounds();
        let camera = camera_at(DVec3::Z, &bounds);
        let far = [(1.0, 1.0), (6.0, 1.0), (6.0, 5.0)].map(|(x, y)| DVec2::new(x, y));
        let depths = tangent_depths(&Bvh::new(&mesh), &bounds, &camera, &[far.to_vec()]);
        assert_eq!(depths, [[camera.depth(bounds.center); 3]]);
        let gaps = fill_gaps(&far.to_vec(), &[None, Some(2.0), Some(5.0)], 9.0);
        assert_eq!(gaps, [2.0, 2.0, 5.0]);
    }
}
