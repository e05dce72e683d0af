//! Outline points with normals: of an outline traced in an image, and of a model's outline with positions in space.

use glam::{DVec2, DVec3};
use silmap_geometry::Camera;
use silmap_geometry::polygon::Loop;

use crate::DirectedEdge;

/// Distance between points taken along outlines, pixels.
const STEP_PX: f64 = 2.0;

/// Points of a traced outline are means over this length on either side, pixels: it runs along pixels' sides.
const SMOOTHED_PX: f64 = 2.5;

/// How far a point of a projected edge may be from the outline that it is part of, pixels.
const ON_OUTLINE_PX: f64 = 0.01;

/// Outlines are looked up in bands of this height, pixels.
const BAND_PX: f64 = 4.0;

/// A point of an image's outline.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImagePoint {
    pub(super) at: DVec2,
    /// Outward, of unit length.
    pub(super) normal: DVec2,
}

/// An outline as evenly spread points.
#[derive(Clone, Debug, Default)]
pub(super) struct ImageOutline {
    pub(super) points: Vec<ImagePoint>,
}

impl ImageOutline {
    pub(super) fn new(loops: &[Loop]) -> Self {
        let mut points = Vec::new();
        for points_of_loop in loops {
            let fine = resampled(points_of_loop, 0.5);
            let n = fine.len();
            let reach = ((SMOOTHED_PX / 0.5) as usize).min(n / 4);
            let stride = (STEP_PX / 0.5) as usize;
            for k in (0..n).step_by(stride) {
                let mean = |from: usize, count: usize| {
                    let sum: DVec2 = (from..from + count).map(|i| fine[i % n]).sum();
                    sum / count as f64
                };
                let start = k + n - reach;
                let (at, before, after) = (
                    mean(start, 2 * reach + 1),
                    mean(start, reach + 1),
                    mean(k, reach + 1),
                );
                if let Some(along) = (after - before).try_normalize() {
                    points.push(ImagePoint {
                        at,
                        normal: outward(along),
                    });
                }
            }
        }
        Self { points }
    }
}

/// Points about `step` apart on a closed loop.
fn resampled(points: &[DVec2], step: f64) -> Vec<DVec2> {
    let mut fine = Vec::new();
    for (k, &from) in points.iter().enumerate() {
        let to = points[(k + 1) % points.len()];
        let pieces = (from.distance(to) / step).round().max(1.0) as usize;
        fine.extend((0..pieces).map(|i| from.lerp(to, i as f64 / pieces as f64)));
    }
    fine
}

/// The outward normal of an outline that runs along `along`: with y down, the inside of loops with positive area is on the right
/// as seen, and that is (−y, x).
fn outward(along: DVec2) -> DVec2 {
    DVec2::new(along.y, -along.x)
}

/// A point of the model that is seen on its outline.
#[derive(Clone, Copy, Debug)]
pub(super) struct RimPoint {
    /// Object space.
    pub(super) position: DVec3,
    /// Pixels.
    pub(super) at: DVec2,
    /// Outward, of unit length.
    pub(super) normal: DVec2,
}

impl RimPoint {
    /// What a shift of the point in object space, times this, moves its picture by along the normal, pixels.
    pub(super) fn pull(&self, camera: &Camera) -> DVec3 {
        let offset = self.position - camera.eye;
        let depth = offset.dot(camera.forward);
        let focal = camera.focal_px();
        let across = |axis: DVec3| (axis - camera.forward * (offset.dot(axis) / depth)) / depth;
        across(camera.right) * (self.normal.x * focal.x)
            - across(camera.up) * (self.normal.y * focal.y)
    }
}

/// Points about [`STEP_PX`] apart on those parts of silhouette edges that `outline` runs along.
pub(super) fn rim_points(
    positions: &[DVec3],
    edges: &[DirectedEdge],
    outline: &[Loop],
    camera: &Camera,
) -> Vec<RimPoint> {
    let size = camera.size();
    let bands = Bands::new(outline, size.y);
    let mut rim = Vec::new();
    // So that short edges are not seen more often than long ones.
    let mut since = 0.0;
    for edge in edges {
        let ends = [edge.from, edge.to].map(|v| positions[v as usize]);
        let [a, b] = ends.map(|p| camera.image_from_object(p));
        // What an eye close to the model sees far beside the image fits nothing.
        let is_beside = |p: DVec2| p.cmplt(-size).any() || p.cmpgt(2.0 * size).any();
        if is_beside(a) || is_beside(b) {
            continue;
        }
        let length = a.distance(b);
        since += length;
        if since < STEP_PX {
            continue;
        }
        since = 0.0;
        let pieces = (length / STEP_PX).ceil().max(1.0) as usize;
        for i in 0..pieces {
            let share = (i as f64 + 0.5) / pieces as f64;
            let at = a.lerp(b, share);
            let Some(normal) = bands.normal_at(at) else {
                continue;
            };
            // Inverse depth is linear in the image.
            let inverse = ends.map(|p| 1.0 / camera.depth(p));
            let weight = share * inverse[1] / (inverse[0] + (inverse[1] - inverse[0]) * share);
            rim.push(RimPoint {
                position: ends[0].lerp(ends[1], weight),
                at,
                normal,
            });
        }
    }
    rim
}

/// The segments of an outline by the rows that they pass, as far as these lie within an image's height of the image.
struct Bands {
    first: i64,
    segments: Vec<Vec<[DVec2; 2]>>,
}

impl Bands {
    fn new(outline: &[Loop], height_px: f64) -> Self {
        let ys = || outline.iter().flatten().map(|p| p.y);
        let band = |y: f64| (y.clamp(-height_px, 2.0 * height_px) / BAND_PX).floor() as i64;
        let lowest = ys().fold(f64::INFINITY, f64::min);
        let highest = ys().fold(f64::NEG_INFINITY, f64::max);
        if lowest > highest {
            return Self {
                first: 0,
                segments: Vec::new(),
            };
        }
        let first = band(lowest) - 1;
        let mut segments = vec![Vec::new(); (band(highest) - first + 2) as usize];
        for points in outline {
            for (k, &from) in points.iter().enumerate() {
                let to = points[(k + 1) % points.len()];
                let low = band(from.y.min(to.y) - ON_OUTLINE_PX) - first;
                let high = band(from.y.max(to.y) + ON_OUTLINE_PX) - first;
                for bucket in &mut segments[low as usize..=high as usize] {
                    bucket.push([from, to]);
                }
            }
        }
        Self { first, segments }
    }

    /// The outward normal of the outline at a point; `None` beside it.
    fn normal_at(&self, at: DVec2) -> Option<DVec2> {
        let band = (at.y / BAND_PX).floor() as i64 - self.first;
        let bucket = usize::try_from(band)
            .ok()
            .and_then(|b| self.segments.get(b))?;
        bucket.iter().find_map(|&[from, to]| {
            let along = to - from;
            let share = (at - from).dot(along) / along.length_squared();
            let foot = from + along * share.clamp(0.0, 1.0);
            let is_on = at.distance_squared(foot) <= ON_OUTLINE_PX * ON_OUTLINE_PX;
            is_on.then(|| outward(along).try_normalize()).flatten()
        })
    }
}
